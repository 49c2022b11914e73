"""A campaign's plain data as its specs take it: dotted keys, keys that are tied, number of runs."""

import math
from collections.abc import Callable, Mapping
from typing import Any

from torquer.base.explain import suggestion
from torquer.campaign.variation import Variation


def completed(data):
    """A campaign's plain data with flat keys, ties resolved, and `runs` where these follow."""
    data = with_flat_keys(data)
    if not isinstance(data, Mapping):
        return data
    if isinstance(data.get("vary"), Mapping):
        data = {**data, "vary": {key: _with_tie(key, data["vary"]) for key in data["vary"]}}
    return data if data.get("runs") is not None else _with_runs(data)


def with_flat_keys(data):
    """A campaign's plain data with the keys that vary as the scenario's dotted keys."""
    if not isinstance(data, Mapping):
        return data
    given = {name: data[name] for name in _HOLDS_KEYS if isinstance(data.get(name), Mapping)}
    flat = {name: _flatten(name, table, _HOLDS_KEYS[name]) for name, table in given.items()}
    return {**data, **flat}


def _flatten(name: str, table: Mapping, holds_keys: Callable, place: str = "") -> dict[str, Any]:
    """The table with nested tables, as TOML makes them of dotted keys, turned into dotted keys."""
    flat: dict[str, Any] = {}
    for key, value in table.items():
        here, inner = f"{place}{key}", holds_keys(value)
        found = _flatten(name, value, holds_keys, f"{here}.") if inner else {here: value}
        for again in flat.keys() & found.keys():
            raise ValueError(f'{name}."{again}": must be given once; received it twice')
        flat |= found
    return flat


def _varies_below(value) -> bool:
    """Whether a value is a table of more keys, not a variation."""
    if not isinstance(value, Mapping) or not value or set(value) & set(Variation.model_fields):
        return False
    return all(isinstance(inner, Mapping | str | Variation) for inner in value.values())


#: Tables by the scenario's keys: whether a value in them is a table of more keys.
_HOLDS_KEYS: dict[str, Callable] = {
    "vary": _varies_below,
    "table": lambda value: isinstance(value, Mapping),
}


def _with_tie(key: str, vary: Mapping):
    """The variation of a key; one that is tied to another and has none of its own gets that one."""
    own = _as_table(vary[key])
    if own is None or "tied_to" not in own:
        return vary[key]
    other, named = own["tied_to"], f'vary."{key}".tied_to'
    source = _as_table(vary.get(other)) if isinstance(other, str) and other != key else None
    if source is None:
        near = suggestion(str(other), [name for name in vary if name != key])
        raise ValueError(f"{named}: must be another key of vary; received {other!r}{near}")
    if "tied_to" in source:
        raise ValueError(
            f"{named}: must be a key with a draw of its own; received {other!r}, which is tied to "
            f"{source['tied_to']!r}"
        )
    return {**source, **own} if own.keys() == {"tied_to"} else own


def _as_table(variation) -> dict | None:
    """A variation as a table of what it has; None for what is none."""
    if isinstance(variation, str):
        return {"rotation": variation}
    if isinstance(variation, Variation | Mapping):
        return {key: value for key, value in dict(variation).items() if value is not None}
    return None


def _with_runs(data: Mapping):
    """The data with the runs of its grid, or of its table's rows."""
    vary, table = data.get("vary"), data.get("table")
    if data.get("sampling") == "grid" and isinstance(vary, Mapping):
        tables = (_as_table(variation) or {} for variation in vary.values())
        lists = [each["values"] for each in tables if "values" in each and "tied_to" not in each]
        return {**data, "runs": math.prod(len(v) for v in lists if isinstance(v, list | tuple))}
    columns = [*table.values()] if isinstance(table, Mapping) else []
    if columns and isinstance(columns[0], list | tuple):
        return {**data, "runs": max(1, len(columns[0]))}
    return data
