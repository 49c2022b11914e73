"""What to cite: the models, laws and data that a scenario uses, from the table `sources.toml`.

    print(torquer.citations(result))    # BibTeX

Only what the scenario uses is listed, after the package itself. Laws of your own are not: cite
their sources yourself.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from torquer.base.version import VERSION
from torquer.scenario.spec import Scenario

if TYPE_CHECKING:
    import xarray as xr

#: The package's own key, which every list begins with.
OWN = "torquer"


class Source(NamedTuple):
    """A source to cite: its key, its BibTeX fields, and what of the scenario calls for it."""

    key: str
    fields: dict[str, str]
    uses: tuple[str, ...]

    def in_words(self) -> str:
        """The reference in one line of plain text."""
        given = self.fields
        by = given.get("author") or (f"{given['editor']} (ed.)" if "editor" in given else "")
        within = given.get("journal", "") + "".join(
            f" {given[key]}" for key in ("volume", "number") if "journal" in given and key in given
        )
        parts = [by.replace(" and ", ", "), given["title"], within, given.get("booktitle", ""),
                 given.get("institution", ""), "" if within else given.get("number", ""),
                 given.get("pages", "").replace("--", "-"), given.get("year", ""),
                 given.get("version", ""), given.get("note", "")]  # fmt: skip
        text = ". ".join(part.strip("{}").removesuffix(".") for part in parts if part)
        return f"{text}. doi:{given['doi']}" if "doi" in given else f"{text}."

    def as_bibtex(self) -> str:
        """The reference as an entry of BibTeX."""
        fields = {key: re.sub(r"([&#%])", r"\\\1", text) for key, text in self.fields.items()}
        fields["title"] = f"{{{fields['title']}}}"  # capitals as they are
        lines = [f"  {key} = {{{text}}}," for key, text in fields.items() if key != "type"]
        return "\n".join([f"@{fields['type']}{{{self.key},", *lines, "}"])


def citations(of: Scenario | xr.Dataset) -> str:
    """BibTeX of the models, laws and data that a scenario or result uses, and of torquer.

    `of`: a `Scenario`, or the result of a run or campaign; ValueError for anything else.

        >>> print(torquer.citations(scenario).splitlines()[0])
        @...
    """
    return "\n\n".join(source.as_bibtex() for source in select_sources(of)) + "\n"


def select_sources(of: Scenario | xr.Dataset) -> list[Source]:
    """The sources to cite, torquer first, then in the order of the scenario's tables."""
    table = source_table()
    uses: dict[str, list[str]] = {OWN: []}
    for path, keys in _calls(_plain(of), ""):
        for key in keys:
            if path not in uses.setdefault(key, []):
                uses[key].append(path)
    return [Source(key, table["source"][key], tuple(found)) for key, found in uses.items()]


def cited_in_words(of: Scenario | xr.Dataset) -> dict[str, str]:
    """References in plain text by their keys, for summaries."""
    return {source.key: source.in_words() for source in select_sources(of)}


@cache
def source_table() -> dict:
    """The table of sources and of what uses them."""
    text = Path(__file__).with_name("sources.toml").read_text(encoding="utf-8")
    table = tomllib.loads(text)
    table["source"][OWN]["version"] = VERSION
    return table


def _plain(of) -> dict:
    """A scenario, or that of a result, as plain data; the campaign of one in its own table."""
    if isinstance(of, Scenario):
        return json.loads(of.model_dump_json(exclude_none=True))
    attrs = getattr(of, "attrs", {})
    if "scenario" not in attrs:
        raise ValueError(
            f"citations: must be of a Scenario or a result; received {type(of).__name__}"
        )
    return json.loads(attrs["scenario"]) | {"campaign": json.loads(attrs.get("campaign", "{}"))}


#: Values of a key of which a scenario has none.
_NOTHING: tuple = (None, 0.0, [], ())


def _calls(data: Mapping, path: str) -> Iterator[tuple[str, list[str]]]:
    """What of nested tables calls for sources: its path, with the kind in brackets, and keys."""
    by_value, by_table = source_table()["used_by"]["value"], source_table()["used_by"]["table"]
    for key, value in data.items():
        here = f"{path}.{key}" if path else str(key)
        if isinstance(value, str) and value in by_value.get(key, {}):
            place = path if key == "kind" else here
            yield f"{place} ({value})", by_value[key][value]
        if here in by_table and value not in _NOTHING:
            yield here, by_table[here]
        for inner in value if isinstance(value, list) else [value]:
            if isinstance(inner, Mapping):
                yield from _calls(inner, here)
