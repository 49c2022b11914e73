"""`torquer explain`: what a key or a table of scenario files means."""

import re
from json import dumps

from torquer.base.strict_json import json_text
from torquer.cli.options import Json
from torquer.cli.output import console
from torquer.design.stored_keys import file_tables, find
from torquer.scenario.described import Key, Table
from torquer.scenario.words import Word, trade_word

#: More tables than this are listed by their first lines.
_MOST_TABLES = 3


def explain(key: str | None = None, /, *, json: Json = False) -> int:
    """Explain KEY of scenario files: meaning, unit, range and default.

    KEY is a key ("spacecraft.coils.limit_a_m2"), a table ("coils"), the last part of either, or
    the kind of a table ("bdot"). Without KEY all tables are listed. "mapping" are the keys with
    which `torquer telemetry` reads files. A word of the trade ("momentum dumping") leads to the
    page and the key that answer it.
    """
    word, tables, keys = _find(key) if key else (None, [], [])
    if json:
        whole = tables if key else file_tables()
        alone = [{"table": table.title} | each._asdict() for table, each in keys]
        found = {"tables": [_plain(table) for table in whole], "keys": alone}
        print(json_text(found | ({"word": word._asdict()} if word else {})))
        return 0
    if not key:
        tables = file_tables()
    blocks = [_list_items(tables)] if len(tables) > _MOST_TABLES else [*map(_explain_table, tables)]
    blocks = [_explain_word(word), *blocks] if word else blocks
    text = "\n\n".join(
        each for each in blocks + [_explain_key(k, keys) for k in _each(keys)] if each
    )
    console(soft_wrap=True).print(text + _explain_sources(text))
    return 0


def _find(key: str) -> tuple[Word | None, list[Table], list[tuple[Table, Key]]]:
    """What a key means, or a word of the trade, which no key is called."""
    try:
        return None, *find(key)
    except ValueError:
        if (word := trade_word(key)) is None:
            raise
        return word, *(find(word.key) if word.key else ([], []))


def _explain_word(word: Word) -> str:
    words = ", ".join(word.words)
    return f"{words}\n  called here: {word.here}\n  see docs/{word.page}.md"


def schema() -> int:
    """Print the JSON schema of scenario files, for editors."""
    from torquer.design.file_keys import file_schema

    print(dumps(file_schema(), indent=2))
    return 0


def _explain_sources(text: str) -> str:
    """Where the texts that an explanation cites are listed; "" if it cites none."""
    cited = dict.fromkeys(re.findall(r"\b(?:MAG|SDOT|FIELD|WHEEL|MGS)\b", text))
    return f"\n\n{', '.join(cited)}: see docs/sources.md for these texts" if cited else ""


def _list_items(tables: list[Table]) -> str:
    """Tables in a line each."""
    return "\n".join(f"{table.title}: {_first_line(table)}" for table in tables)


def _plain(table: Table) -> dict:
    return table._asdict() | {"keys": [key._asdict() for key in table.keys]}


def _each(keys: list[tuple[Table, Key]]) -> list[Key]:
    """Distinct keys: one that several tables share is explained once."""
    return list(dict.fromkeys(key for _, key in keys))


def _explain_key(key: Key, keys: list[tuple[Table, Key]]) -> str:
    """A key, and the tables that have it."""
    titles = [table.title for table, other in keys if other == key]
    default = key.default or "none: the key must be given"
    rows = [("in", titles[0]), *(("", title) for title in titles[1:])]
    rows += [("unit", key.unit), ("values", key.values), ("default", default)]
    lines = [f"  {label:8} {value}" for label, value in rows if value]
    return "\n".join([key.name, f"  {key.description}", *lines])


def _explain_table(table: Table) -> str:
    places = f"\nAlso at {', '.join(table.places[1:])}." if table.places[1:] else ""
    wide = max(len(key.name) for key in table.keys)
    lines = [f"  {key.name:{wide}}  {_key_line(key)}" for key in table.keys]
    return "\n".join([table.title, table.about + places, "", *lines])


def _key_line(key: Key) -> str:
    """Description, unit and default in one line."""
    unit = f" [{key.unit}]" if key.unit else ""
    default = f" Default: {key.default}." if key.default else " Must be given."
    return f"{key.description}{unit}{default}"


def _first_line(table: Table) -> str:
    return table.about.partition("\n\n")[0].replace("\n", " ")
