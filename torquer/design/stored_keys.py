"""What `torquer explain` knows of the keys of files, without the specs that they come from.

To import all specs and read their sources takes a second. So the tables of
`torquer.design.file_keys` are stored in `stored_tables.json`, which `docs/generate.py` writes.
"""

import json
import re
from functools import cache
from pathlib import Path

from torquer.base.units import conversion, near_names
from torquer.scenario.described import Key, Table

FILE = Path(__file__).with_name("stored_tables.json")


@cache
def _store() -> dict[str, list[Table]]:
    """The tables of scenario files, below DESIGN those of wheel designs, those of mappings."""
    lists = json.loads(FILE.read_text(encoding="utf-8"))
    return {
        name: [Table(places, kind, about, [Key(*key) for key in keys])
               for places, kind, about, keys in tables]
        for name, tables in lists.items()
    }  # fmt: skip


def file_tables() -> list[Table]:
    """All tables of a scenario file."""
    return _store()["scenario"]


def all_tables() -> list[Table]:
    """All tables of scenario files, below DESIGN those of wheel designs only, and of mappings."""
    return [table for tables in _store().values() for table in tables]


def find(name: str) -> tuple[list[Table], list[tuple[Table, Key]]]:
    """The tables, and the keys with their tables, that a name may mean.

    A name is a whole key ("spacecraft.coils.limit_a_m2"), a table ("spacecraft.coils"), the end
    of one of them ("coils", "limit_a_m2") or the kind of a table ("bdot"). `ValueError` with the
    nearest names for one that means nothing.
    """
    asked = _words(name)
    keys = [
        (table, key)
        for table in all_tables()
        for key in table.keys
        if any(_ends_with(_words(f"{place}.{key.name}"), asked) for place in table.places)
    ]
    tables = [
        table
        for table in all_tables()
        if [table.kind] == asked
        or any(place and _ends_with(_words(place), asked) for place in table.places)
    ]
    if not tables and not keys:
        word = asked[-1] if asked else ""
        near = near_names(word, _read_stored(), 3, 0.7)
        near = near or [key for key in _read_stored() if word and word in key.split("_")][:3]
        how = " ".join(dict.fromkeys(filter(None, (conversion(word, each) for each in near))))
        hint = f"; did you mean {' or '.join(near)}?{f' {how}' if how else ''}" if near else ""
        raise ValueError(
            "KEY: must be a key or table of scenario files, wheel designs or mappings; received "
            f"{name!r}{hint}"
        )
    return tables, keys


def _read_stored() -> list[str]:
    keys = [key.name for table in all_tables() for key in table.keys]
    kinds = [table.kind for table in all_tables() if table.kind]
    return list(dict.fromkeys([*keys, *kinds]))


def _words(place: str) -> list[str]:
    """Words of a dotted place, without numbers of elements."""
    return [word for word in re.sub(r"\[\d*\]", "", place).split(".") if word]


def _ends_with(place: list[str], asked: list[str]) -> bool:
    """Whether a place ends as asked; NAME stands for any name, but not for the first word."""
    end = place[-len(asked) :]
    return len(end) == len(asked) > 0 and all(
        ours == word or (ours == "NAME" and n > 0)
        for n, (ours, word) in enumerate(zip(end, asked, strict=True))
    )
