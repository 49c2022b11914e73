"""Notes that cannot fail: an error in one becomes a note, and neither a run nor a check ends."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from typing import Any, TypeVar

import numpy as np

#: Begins the reason of an error that is a mistake of the note itself.
UNEXPECTED = "unexpected"
_LONGEST = 300
Found = TypeVar("Found")


def assess(checks: Mapping[str, Callable[..., Iterable[str]]], *about: Any) -> Iterator[str]:
    """The notes of checks on the same things; a check stands under what it assesses, in words."""
    for what, check in checks.items():
        notes: list[str] = []
        attempt(what, partial(_extend, notes, check, about), notes)
        yield from notes


def _extend(notes: list[str], check: Callable[..., Iterable[str]], about: tuple) -> None:
    notes.extend(check(*about))


def attempt(what: str, find: Callable[[], Found], notes: list[str]) -> Found | None:
    """What is found; None after an error, which joins the notes."""
    try:
        with np.errstate(all="ignore"):
            return find()
    except Exception as error:
        notes.append(f"{what} could not be assessed: {_reason(error)}")
        return None


def _reason(error: Exception) -> str:
    """The first line of an error; what is not meant for users is led by the error's kind."""
    line = (str(error).splitlines() or [""])[0][:_LONGEST]
    if isinstance(error, ValueError):
        return line
    return f"{UNEXPECTED} {type(error).__name__} ({line})"
