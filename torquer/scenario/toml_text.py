"""Plain data as TOML text and back: files are read up to a size and a depth, with clear errors."""

import contextlib
import re
import tomllib
from datetime import datetime
from html import escape
from pathlib import Path

import tomli_w

from torquer.base.explain import ScenarioError
from torquer.base.spec import Spec
from torquer.base.text_files import LEVELS, has_deep_key, limited_text

#: A time in a leap second that is a value, not part of a text.
_SECOND_60 = re.compile(
    r"([=\[,]\s*)(\d{4}-\d\d-\d\d[Tt ]\d\d:\d\d:60(?:\.\d+)?(?:[Zz]|[+-]\d\d:\d\d)?)", re.ASCII
)
#: A list over several lines, without lists or texts in it.
_PLAIN_LIST = re.compile(r'\[\n\s+([^\[\]{}"\n]+(?:\n\s+[^\[\]{}"\n]+)*),\n\s*\]')
#: A list of such lists, each in one line.
_LIST_OF_LISTS = re.compile(r"\[\n\s+(\[[^\[\]\n]*\](?:,\n\s+\[[^\[\]\n]*\])*),\n\s*\]")


def read_text(path: Path, what: str) -> str:
    """The text of a file; `what` it must be, in the message."""
    try:
        return limited_text(path)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        hint = f"; did you mean {path}.toml?" if Path(f"{path}.toml").is_file() else ""
        raise ScenarioError(
            f"{what}: must be a readable file; received {path} ({reason}){hint}"
        ) from None


def parse_toml(text: str, what: str) -> dict:
    """What a TOML text holds; `what` it must be, in the message."""
    try:
        deep = has_deep_key(text)
        data = {} if deep else _loads(text)
        deep = deep or not _within_levels(data)
    except RecursionError:
        deep = True
    except ValueError as error:  # of TOML, or a number with too many digits
        raise ScenarioError(f"{what}: must be TOML; received: {error}") from None
    if deep:
        raise ScenarioError(
            f"{what}: must have at most {LEVELS} levels of tables and lists; received more"
        )
    return data


def _loads(text: str) -> dict:
    """What a TOML text holds; times in a leap second, which TOML's reader refuses, as texts."""
    try:
        return tomllib.loads(text)
    except ValueError:
        quoted = _SECOND_60.sub(r'\1"\2"', text)
        if quoted == text:
            raise
        return tomllib.loads(quoted)


def _within_levels(data: dict) -> bool:
    """Whether tables and lists are nested no deeper than that."""
    level: list = [data]
    for _ in range(LEVELS):
        inner = (part.values() if isinstance(part, dict) else part for part in level)
        level = [x for part in inner for x in part if isinstance(x, dict | list)]
    return not level


def to_toml(data: dict, widest: int = 80) -> str:
    """A scenario's plain data as TOML text; keys without a value are left out.

    Lists of numbers that fit within `widest` characters are put on one line. No text has a line
    break, so none is affected.
    """
    text = tomli_w.dumps(_drop_none(data))
    for pattern in (_PLAIN_LIST, _LIST_OF_LISTS):
        text = pattern.sub(lambda found: _in_one_line(found, widest), text)
    return text


def html_of_given(spec: Spec, table: str = "") -> str:
    """What was given of a spec as TOML text for notebooks, in a table unless "" is its name."""
    given = spec.model_dump(mode="json", exclude_unset=True, exclude_none=True)
    return f"<pre>{escape(to_toml({table: given} if table else given))}</pre>"


def toml_from_data(data: dict) -> str:
    """A scenario's data as JSON holds them as TOML text, without comments; the start as a time."""
    with contextlib.suppress(KeyError, TypeError, ValueError):
        data = {**data, "start": datetime.fromisoformat(data["start"])}
    return to_toml(data)


def _drop_none(value):
    """The data without keys that have no value."""
    if isinstance(value, dict):
        return {key: _drop_none(each) for key, each in value.items() if each is not None}
    return [_drop_none(each) for each in value] if isinstance(value, list) else value


def _in_one_line(found: re.Match, widest: int) -> str:
    line = f"[{' '.join(found[1].split())}]"
    return line if len(line) <= widest else found[0]
