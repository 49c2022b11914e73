"""A scenario as the page has it: plain data, which JSON holds, from TOML text and back."""

from __future__ import annotations

import copy
import re
from collections.abc import Container, Iterator
from datetime import date, datetime
from pathlib import Path

from torquer.base.explain import ScenarioError
from torquer.scenario.load import scenario_from_data, tables_with_files
from torquer.scenario.spec import Scenario
from torquer.scenario.toml_text import parse_toml

_KEY = re.compile(r"([A-Za-z_][\w.\[\]-]*): ")


def data_from_toml(text: str) -> dict:
    """The data of a TOML text; times become text, as ISO 8601 has it."""
    return _plain(parse_toml(text, "scenario"))


def read_scenario(data: dict, folder: Path, code: Container[Path]) -> Scenario:
    """The scenario of data; `ScenarioError` for one that names other files than `code`."""
    for key, file in files_in(data, folder):
        if file not in code:
            raise ScenarioError(
                f"{key}: must be a file that the board was opened with, as it is executed or read; "
                f"received {file}"
            )
    return scenario_from_data(copy.deepcopy(data), folder)  # loading replaces paths in it


def files_in(data: dict, folder: Path) -> Iterator[tuple[str, Path]]:
    """Files that a scenario's data name, with their keys."""
    for key, table in tables_with_files(data):
        try:
            yield f"{key}.file", (folder / table["file"]).resolve()
        except (OSError, ValueError, RuntimeError):
            raise ScenarioError(
                f"{key}.file: must be the path of a file; received {table['file']!r}"
            ) from None


def mistakes_in(text: str) -> list[dict[str, str]]:
    """Lines of an error, each with the key that it is about, "" if none is named."""
    found = []
    for line in text.split("\n"):
        named = _KEY.match(line)
        found.append({"key": named[1] if named else "", "text": line})
    return found


def _plain(value):
    if isinstance(value, datetime | date):
        return value.isoformat().replace("+00:00", "Z")
    if isinstance(value, dict):
        return {key: _plain(part) for key, part in value.items()}
    return [_plain(part) for part in value] if isinstance(value, list) else value
