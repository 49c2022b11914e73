"""Python files of laws that a campaign names: members execute them, as a run does its own laws."""

import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from torquer.campaign.spec import Campaign
from torquer.scenario.explain import key_name

#: The key of a law's file; no other key of a scenario names a file.
_FILE = "file"


def code_named(campaign: Campaign) -> Iterator[tuple[str, Path]]:
    """Places in the campaign's table that name Python files, and the files.

    All values of all keys, also those that no member happens to have.
    """
    found: list[tuple[str, Path]] = []

    def note(place: str, file):
        found.append((place, Path(file)))
        return file

    for key, variation in campaign.vary.items():
        with_files(key, {"values": variation.values}, note)
    yield from found


def with_files(key: str, variation, change: Callable):
    """Plain data of a key's variation with `change(place, file)` for each file that it names."""
    if not isinstance(variation, Mapping) or "values" not in variation:
        return variation
    names_file = re.findall(r"[^.\[\]]+", key)[-1:] == [_FILE]
    place = ("campaign", "vary", key, "values")
    return {**variation, "values": _change(variation["values"], place, names_file, change)}


def _change(value, place: tuple, is_file: bool, change: Callable):
    """The value with the files in it changed; `is_file`: whether a text here is one."""
    if isinstance(value, Mapping):
        return {
            key: _change(each, (*place, str(key)), key == _FILE, change)
            for key, each in value.items()
        }
    if isinstance(value, list | tuple):
        return [_change(each, (*place, n), is_file, change) for n, each in enumerate(value)]
    if is_file and isinstance(value, str | Path):
        return change(key_name(place), value)
    return value
