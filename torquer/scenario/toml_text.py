"""Plain data as TOML text."""

import re
from datetime import datetime

import tomli_w

#: A list over several lines, without lists or texts in it.
_PLAIN_LIST = re.compile(r'\[\n\s+([^\[\]{}"\n]+(?:\n\s+[^\[\]{}"\n]+)*),\n\s*\]')
#: A list of such lists, each in one line.
_LIST_OF_LISTS = re.compile(r"\[\n\s+(\[[^\[\]\n]*\](?:,\n\s+\[[^\[\]\n]*\])*),\n\s*\]")


def toml_of(data: dict, widest: int = 80) -> str:
    """A scenario's plain data as TOML text; keys without a value are left out.

    Lists of numbers that fit within `widest` characters are put on one line. No text has a line
    break, so none is affected.
    """
    text = tomli_w.dumps(_given(data))
    for pattern in (_PLAIN_LIST, _LIST_OF_LISTS):
        text = pattern.sub(lambda found: _in_one_line(found, widest), text)
    return text


def toml_from_data(data: dict) -> str:
    """A scenario's plain data, with its start as text, as TOML text."""
    return toml_of(_with_times(data))


def _with_times(data: dict) -> dict:
    """The data with its start as a time, which TOML writes without quotes."""
    try:
        return {**data, "start": datetime.fromisoformat(data["start"])}
    except (KeyError, TypeError, ValueError):
        return data


def _given(value):
    """The data without keys that have no value."""
    if isinstance(value, dict):
        return {key: _given(each) for key, each in value.items() if each is not None}
    return [_given(each) for each in value] if isinstance(value, list) else value


def _in_one_line(found: re.Match, widest: int) -> str:
    line = f"[{' '.join(found[1].split())}]"
    return line if len(line) <= widest else found[0]
