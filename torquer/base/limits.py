"""Requests: what a function, or the command of the same name, is asked; with the ranges of numbers.

A request is a frozen dataclass. Its values are checked when it is made, by the same rule for a
caller in Python and for the command line, which takes the fields for options (`altitude_km` for
`--altitude-km`) and the strings below them for their help.

    @request
    class SweepRequest:
        \"\"\"What `sweep` is asked.\"\"\"

        runs: Annotated[int, at_least(1)] = 10
        \"\"\"Number of runs.\"\"\"
"""

import inspect
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from numbers import Integral, Real
from os import PathLike
from pathlib import Path
from types import NoneType, UnionType
from typing import (
    Literal,
    NamedTuple,
    TypeVar,
    Union,
    dataclass_transform,
    get_args,
    get_origin,
    get_type_hints,
)

from torquer.base.field_texts import texts_below_fields

T = TypeVar("T")
Three = tuple[float, float, float]


class RequestError(ValueError):
    """A mistake in a key of a request, "" for the request as a whole.

    `others`: further keys that the problem names. A key that is a word of the language as well,
    such as `date`, is marked where it means the key: "must be given with {date}". The command line
    names the options instead.
    """

    def __init__(self, key: str, problem: str, *others: str):
        # a key with a dot is one of the scenario: that is written as it is
        self.keys = tuple(each for each in (*key.split(", "), *others) if each.isidentifier())
        self.clear = tuple(each for each in self.keys if "_" in each or each in others)
        self.marked = f"{key}: {problem}" if key else problem
        super().__init__(re.sub(_MARKED, r"\1", self.marked))

    def spelled(self, spell: Callable[[str], str]) -> str:
        """The message, with the keys as users of the command line know them."""
        head, *rest = self.marked.split(": ", 1)
        text = ": ".join(
            (_spelled(head, self.keys, spell), *(_spelled(x, self.clear, spell) for x in rest))
        )
        return re.sub(_MARKED, lambda key: spell(key[1]), text)


#: A marked key; what stands in quotation marks was received, and is left alone.
_MARKED = r"(?<!['\"\w]){([a-z]\w*)}"


def _spelled(text: str, keys: tuple[str, ...], spell: Callable[[str], str]) -> str:
    names = "|".join(map(re.escape, keys)) or "(?!)"
    return re.sub(rf"(?<![\w.{{])(?:{names})(?![\w.}}])", lambda key: spell(key[0]), text)


class Range(NamedTuple):
    """What must hold of a number, in words and as a function; `size_of`: the key of scenario files
    whose greatest and least size it shares."""

    must: str
    holds: Callable[[float], bool]
    size_of: str = ""

    @property
    def in_words(self) -> str:
        """The range as a sentence."""
        return f"Must {self.must}."

    def __repr__(self) -> str:
        return repr(self.in_words)

    def check(self, name: str, value: float) -> None:
        """RequestError for a number outside."""
        must = "" if self.holds(value) else self.must
        if not must and self.size_of:
            from torquer.base.validate import out_of_range

            size = out_of_range(self.size_of, value, 0.0)
            must = size and f"be {size}"
        if must:
            raise RequestError(name, f"must {must}; received {value:g}")


def within(low: float, high: float, unit: str = "") -> Range:
    """The range between two ends, both allowed."""
    must = f"lie within {low:g}..{high:g} {unit}".rstrip()
    return Range(must, lambda value: low <= value <= high)


def at_least(low: float) -> Range:
    """The range of finite numbers from one on."""
    return Range(f"be {low:g} or more", lambda value: low <= value < math.inf)


def positive(size_of: str = "") -> Range:
    """The range of positive numbers."""
    return Range("be a positive number", lambda value: 0.0 < value < math.inf, size_of)


#: What counts as a value of a type, and what it is called; True and False are no numbers.
_KINDS = {
    float: (Real, "a number"),
    int: (Integral, "a whole number"),
    bool: (bool, "True or False"),
    str: (str, "text"),
    Path: (str | PathLike, "a path"),
}


def _must_be(hint, value) -> str:
    """What a value must be by the annotation of its field, "" if it is that."""
    origin, inside = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        musts = [_must_be(each, value) for each in inside]
        return "" if "" in musts else " or ".join(musts)
    if hint is NoneType:
        return "" if value is None else "None"
    if origin is Literal:
        is_one = any(type(value) is type(each) and value == each for each in inside)
        return "" if is_one else f"one of {', '.join(map(str, inside))}"
    if origin in (tuple, list):
        return _must_hold(inside, value, origin)
    kinds, name = _KINDS.get(hint, (object, ""))
    is_right = isinstance(value, kinds) and (hint is bool or not isinstance(value, bool))
    return "" if is_right else name


def _must_hold(hints: tuple, values, kind: type) -> str:
    """What a tuple or a list must be by the annotations of its elements."""
    if isinstance(values, str) or not hasattr(values, "__len__"):
        is_right = False
    else:
        each = hints if kind is tuple else hints * len(values)
        is_right = len(values) == len(each) and not any(map(_must_be, each, values))
    return "" if is_right else "a list" if kind is list else f"{len(hints)} numbers"


def _stated_ranges(kind: type) -> list[tuple[str, Range]]:
    """Ranges that the fields of a class state, however its annotations are kept."""
    hints = get_type_hints(kind, include_extras=True)
    return [
        (name, each)
        for name, hint in hints.items()
        for each in getattr(hint, "__metadata__", ())
        if isinstance(each, Range)
    ]


def _range_words(hint) -> list[str]:
    """What a field's annotation says in words: its range, or where else that stands."""
    metadata = getattr(hint, "__metadata__", ())
    return [each.in_words for each in metadata if hasattr(each, "in_words")]


def _in_python(text: str) -> str:
    """A text with options as keys: --sample-s is sample_s."""
    return re.sub(r"--[a-z][a-z0-9-]*", lambda key: key[0][2:].replace("-", "_"), text)


class _Help(NamedTuple):
    """Documentation of a request: its own, and what its keys mean; made when it is asked for."""

    own: str

    def __get__(self, _, kind: type) -> str:
        hints = get_type_hints(kind, include_extras=True)
        keys = (
            " ".join([f"    {name}:", _in_python(text), *_range_words(hints[name])])
            for name, text in texts_below_fields(kind).items()
        )
        return "\n".join([inspect.cleandoc(self.own), "", "Keys:", *keys])


@dataclass_transform(frozen_default=True, kw_only_default=True)
def request(kind: type[T]) -> type[T]:
    """Decorator of a request: a frozen dataclass, whose values are checked when it is made.

    `help` of it also lists the keys, with the strings below the fields and the ranges.
    """
    further, ranges = getattr(kind, "__post_init__", None), _stated_ranges(kind)
    hints = get_type_hints(kind)

    def check(self) -> None:
        for name, hint in hints.items():
            if must := _must_be(hint, value := getattr(self, name)):
                raise RequestError(name, f"must be {must}; received {value!r}")
            if isinstance(value, str) and Path in (hint, *get_args(hint)):
                object.__setattr__(self, name, Path(value))
        for name, each in ranges:
            if (value := getattr(self, name)) is not None:
                each.check(name, value)
        if further is not None:
            further(self)

    kind.__post_init__ = check  # type: ignore[attr-defined]
    made = dataclass(frozen=True, kw_only=True)(kind)
    made.__doc__ = _Help(kind.__doc__ or "")  # type: ignore[assignment]
    return made


def given_values(spec, *keys: str) -> dict:
    """Values, by name, of those of the named fields of a request that are not None."""
    return {key: value for key in keys if (value := getattr(spec, key)) is not None}
