"""Values of a scenario by their dotted keys: read, and replaced with all checks."""

import re
from collections.abc import Iterable, Mapping
from typing import Any, TypeVar

from pydantic import BaseModel

from torquer.base.checked_columns import checked_columns, opened
from torquer.base.computing import Computing
from torquer.base.explain import ScenarioError, suggestion, validate_tables
from torquer.base.spec import Spec, as_data
from torquer.compile.when_compiling import plainly

S = TypeVar("S", bound=Spec)


def with_values(scenario: S, values: Mapping[str, Any]) -> S:
    """The scenario with other values at dotted keys, checked once with all of them in place.

    All other values have been checked already; only how they fit with these is checked again.
    """
    data = _open_file(scenario)
    for key, value in values.items():
        table, last = _find_place(data, key)
        table[last] = as_data(value)
    return validate_tables(type(scenario), data)


def checked_again(scenario: S, keys: Iterable[str]) -> S:
    """The same scenario, made anew as far as `with_values` does for other values at the keys."""
    data = _open_file(scenario)
    for key in keys:
        _find_place(data, key)
    return validate_tables(type(scenario), data)


def with_columns(computing: Computing, scenario: S, values: Mapping[str, Any]) -> S:
    """What `with_values` makes of many scenarios, of columns in place of numbers.

    `Refused` where that cannot be, `Mixed` where it can of some alone.
    """
    places = {tuple(_names(key)): value for key, value in values.items()}
    with plainly():
        return checked_columns(computing, opened(scenario, places))


def fields_at(scenario: Spec, keys: Iterable[str]) -> dict[type[BaseModel], frozenset[str]]:
    """The fields that dotted keys change, by the class of their spec.

    Classes of the specs that these are within have no fields.
    """
    found: dict[type[BaseModel], frozenset[str]] = {}
    for key in keys:
        specs, value = [], scenario
        for name in _names(key):
            if isinstance(value, BaseModel):
                specs.append((type(value), name))
                value = getattr(value, str(name), None)
            elif isinstance(value, Mapping):
                value = value.get(name)
            elif isinstance(value, list | tuple) and isinstance(name, int):
                value = value[name] if name < len(value) else None
        for spec, _ in specs:
            found.setdefault(spec, frozenset())
        found[specs[-1][0]] |= {specs[-1][1]}
    return found


def value_at(scenario: Spec, key: str):
    """The value at a dotted key, as plain data."""
    table, last = _find_place(as_data(scenario), key)
    if isinstance(table, dict) and last not in table:
        text = suggestion(str(last), [str(name) for name in table])
        raise ScenarioError(f"{key}: must be a known key; received {key!r}{text}")
    return table[last]


def found_at(scenario: Spec, key: str) -> Any:
    """The value at a dotted key, as plain data; None where the scenario has no such table."""
    try:
        return value_at(scenario, key)
    except ScenarioError:
        return None


def _names(key: str) -> list:
    """Words and numbers of a dotted key."""
    return [int(n) if n.isdigit() else n for n in re.findall(r"[^.\[\]]+", key)]


def _find_place(data: dict, key: str):
    """The table or list that holds a dotted key, and the key's last word or number."""
    names, table, place = _names(key), data, ""
    for name in names[:-1]:
        table, place = _within(table, name, place)
    last = names[-1] if names else ""
    if isinstance(table, list) and not (isinstance(last, int) and last < len(table)):
        raise ScenarioError(f"{key}: must be one of {len(table)} elements; received {key!r}")
    return table, last


def _within(table, name, place: str):
    """The table or list at a name, and its key; it may then be changed."""
    here = f"{place}[{name}]" if isinstance(name, int) else f"{place}.{name}".lstrip(".")
    known = name in table if isinstance(table, dict) else name in range(len(table))
    inner = table[name] if known else None
    if not isinstance(inner, BaseModel | Mapping | list | tuple):
        raise ScenarioError(
            f"{here}: must be a table to change a key in it; received {_instead(table, name)}"
        )
    table[name] = inner = _open_file(inner)
    return inner, here


def _instead(table, name) -> str:
    """What is there in place of a table, in words."""
    if isinstance(table, list):
        return repr(table[name]) if name in range(len(table)) else "no such key"
    if name not in table:
        return f"no such key{suggestion(str(name), [str(key) for key in table])}"
    return "none: the whole of it must be given" if table[name] is None else repr(table[name])


def _open_file(table):
    """A table or list that may be changed; the specs in it stay as they are.

    Those that were not given become plain data: only given keys of a spec are stored, and of one
    that was a default not even its kind was given.
    """
    if isinstance(table, BaseModel):
        given = table.model_fields_set
        return {key: value if key in given else as_data(value) for key, value in table}
    return dict(table) if isinstance(table, Mapping) else list(table)
