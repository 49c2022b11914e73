"""Mistakes in a dictionary's file that pydantic found: one line each."""

from typing import Any

_MUST = {
    "dict_type": "must be a table of keys",
    "extra_forbidden": "must be a known key",
    "float_parsing": "must be a number",
    "int_from_float": "must be a whole number",
    "int_parsing": "must be a whole number",
    "int_parsing_size": "must be a whole number",
    "int_type": "must be a whole number",
    "missing": "must be given",
    "model_type": "must be a table of keys",
    "string_type": "must be text",
    "too_short": "must not be empty",
    "too_long": "must be two numbers",  # limits are the only list of fixed length
    "tuple_type": "must be a list",
}
#: Parts of a place that pydantic adds: of a key, of labels as a list or a table.
_NOT_WRITTEN = ("[key]", "[list]", "[table]")


def describe_mistake(mistake: Any) -> str:
    """One of `ValidationError.errors()` as a line: key, what must hold, what was received."""
    place, kind = mistake["loc"], mistake["type"]
    key = _key(place)
    received = "nothing" if kind == "missing" else quote_value(mistake["input"])
    if kind == "value_error":
        text = str(mistake["ctx"]["error"])
        if not text.startswith("must"):
            return f"{key}.{text}" if key else text
        return f"{key}: {text}; received {received}"
    if kind == "missing" and isinstance(mistake["input"], list | tuple):
        key, kind, received = _key(place[:-1]), "too_long", quote_value(mistake["input"])
    if kind == "tuple_type" and place[-1] == "[list]":
        return f"{key}: must be a list or a table; received {received}"
    must = _MUST.get(kind) or f"must be {mistake['msg'].removeprefix('Input should be ')}"
    return f"{key}: {must}; received {received}"


def _key(place: tuple) -> str:
    """A key as the user writes it; `acknowledge` does not count among the fields of a command."""
    shift = 1 if place[:1] == ("up",) else 0
    shown_key = ""
    for level, part in enumerate(part for part in place if part not in _NOT_WRITTEN):
        number = part - shift if level == 3 and isinstance(part, int) else part
        shown_key += f"[{number}]" if isinstance(part, int) else f".{part}"
    return shown_key.removeprefix(".")


def quote_value(value: Any) -> str:
    """A value as the file has it, shortened."""
    text = repr(value)
    return text if len(text) <= 100 else f"{text[:100]}..."
