"""The models that a scenario uses: its tables as rows, with what differs from their defaults."""

from collections.abc import Iterable, Iterator
from typing import Any

from pydantic import BaseModel

from torquer.report.common.keys import changed_keys, value_in_words
from torquer.scenario.keys import key_unit, key_words
from torquer.scenario.spec import Scenario

#: Longest value that is told; TLEs and tables of numbers are in the scenario.
_LONGEST = 100
#: What tables are that the user names, by the table around them.
_NAMED = {"control.laws": "law", "control.estimators": "estimator"}
#: Keeps a number and its unit on one line.
_NO_BREAK = "\u00a0"
#: Tables that say what the satellite is to do, or how it starts: no models.
_NO_MODELS = ("mission",)
#: Tables whose parts stand in rows of their own.
_OPENED = (
    "environment", "spacecraft", "disturbance", "control", "control.laws", "control.estimators",
)  # fmt: skip


def model_rows(scenario: Scenario) -> list[tuple[str, str]]:
    """Label and value of each table of a scenario that is not as it is by default."""
    return [(_label(path), text) for path, text in _tables(scenario, "") if text]


def _tables(spec: BaseModel | dict, path: str) -> Iterator[tuple[str, str]]:
    """Path and text of each table, the outer ones first."""
    parts: Iterable[tuple[str, Any]] = spec.items() if isinstance(spec, dict) else spec
    for name, part in parts:
        here = f"{path}.{name}" if path else name
        if here in _NO_MODELS or not isinstance(part, BaseModel | dict):
            continue
        opened = here in _OPENED
        if isinstance(part, BaseModel):
            yield here, table_in_words(part, without_tables=opened)
        if opened:
            yield from _tables(part, here)


def table_in_words(spec: BaseModel, without_tables: bool = False) -> str:
    """The kind of a table and its keys with units; "" for one that is as by default."""
    given = changed_keys(spec)
    if without_tables:
        given = {key: value for key, value in given.items() if not isinstance(value, dict)}
    return _in_words({"kind": getattr(spec, "kind", None)} | given)


def _in_words(table: dict) -> str:
    """A table's kind, then its keys."""
    kind = str(table.get("kind") or "").replace("_", " ")
    told = (_key_in_words(key, value) for key, value in table.items() if key != "kind")
    return ", ".join(filter(None, [kind, *told]))


def _key_in_words(key: str, value) -> str:
    """A key and its value with its unit; "" for one that is too long."""
    words = key_words(key)
    if isinstance(value, dict):
        inner = _in_words(value)
        return f"{words} ({inner})" if inner else words
    if value is True:
        return words
    text = value if isinstance(value, str) else value_in_words(value)
    if len(text) > _LONGEST:
        return ""
    unit = key_unit(key).replace(" ", _NO_BREAK)
    return f"{words} {text}{_NO_BREAK}{unit}" if unit else f"{words} {text}"


def _label(path: str) -> str:
    """A table's name, without the table around it unless that says what it is."""
    around, _, name = path.rpartition(".")
    words = f"{_NAMED[around]} {name}" if around in _NAMED else name.replace("_", " ")
    return words[:1].upper() + words[1:]
