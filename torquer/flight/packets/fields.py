"""Fields of a packet: what a number, or several, or bytes, mean, by their raw numbers.

Bits of a big-endian number are counted from the highest of a byte on, as CCSDS does; those of a
little-endian one from the lowest, as compilers for little-endian computers lay out bit fields.
"""

import math
import re
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

import numpy as np
import pydantic
from pydantic import AfterValidator, BeforeValidator, model_validator

from torquer.base.spec import Spec
from torquer.flight.packets.alarm_limits import AlarmKeys, Ends, check_alarm
from torquer.flight.packets.number_types import TYPES, Type

#: Bytes of the longest packet of our frames: protected, it fits the 1024 bytes of a telecommand
#: frame of CCSDS. Bytes of any packet; numbers of one: columns that a table of an archive can have.
MOST_BYTES, ANY_BYTES, MOST_NUMBERS = 960, 65535, 1900
#: Characters of the longest name: the names that DBC files make of it have at most 32.
LONGEST_NAME = 23
#: Greatest offset or coefficient, more than any time in any unit; least scale.
_HUGE, _TINY = 1e30, 1e-30
_LARGEST_COEFFICIENT = pydantic.Field(ge=-_HUGE, le=_HUGE)
Order = Literal["little", "big"]
_MUST = "must be u1 to u64, i2 to i64, f16, f32, f64, bytes or pad, numbers with be or le after it"


def _name(text: str) -> str:
    if not re.fullmatch(r"[a-z][a-z0-9]*(_[a-z0-9]+)*", text) or len(text) > LONGEST_NAME:
        raise ValueError(
            "must be words of lower-case letters and digits, with '_' between them, at most "
            f"{LONGEST_NAME} characters"
        )
    return text


def _field_name(text: str) -> str:
    return text and _name(text)


def _type(text: str) -> str:
    if text not in TYPES:
        raise ValueError(_MUST)
    return text


def _plain(text: str) -> str:
    if not text.isprintable() or '"' in text or "\\" in text:
        raise ValueError("must be one line without quotation marks and backslashes")
    return text


def _not_empty(text: str) -> str:
    if not text.strip():
        raise ValueError("must not be empty")
    return text


def _differ(names: tuple[str, ...]) -> tuple[str, ...]:
    if len(set(names)) < len(names):
        raise ValueError("must differ from each other")
    return names


def _bits(names: tuple[str, ...]) -> tuple[str, ...]:
    for name in _differ(names):
        if "," in name or name.isdecimal():
            raise ValueError(f"must have no commas, and not be numbers; received {name!r}")
    return names


def _numbered(table: Any) -> Any:
    """A table of labels with whole numbers for keys: those of files are texts."""
    if not isinstance(table, Mapping):
        return table
    found: dict[int, Any] = {}
    for key, label in table.items():
        if not re.fullmatch(r"-?\d{1,20}", str(key)):
            raise ValueError("must have whole numbers for keys")
        if int(key) in found:
            raise ValueError(f"must have the key {int(key)} once, however it is written")
        found[int(key)] = label
    return found


def _differ_in_table(table: dict[int, str]) -> dict[int, str] | tuple[str, ...]:
    """The table in order; one of 0, 1, ... without gaps is the same as a list."""
    _differ(tuple(table.values()))
    numbers = sorted(table)
    if numbers == list(range(len(table))):
        return tuple(table[number] for number in numbers)
    return {number: table[number] for number in numbers}


def _kind_of_labels(given: Any) -> str:
    return "[table]" if isinstance(given, Mapping) else "[list]"


Name = Annotated[str, AfterValidator(_name)]
Text = Annotated[str, AfterValidator(_plain)]
Described = Annotated[str, AfterValidator(_plain), AfterValidator(_not_empty)]
_List = Annotated[tuple[Described, ...], AfterValidator(_differ)]
_Table = Annotated[
    dict[int, Described], BeforeValidator(_numbered), AfterValidator(_differ_in_table)
]
Labels = Annotated[
    Annotated[_List, pydantic.Tag("[list]")] | Annotated[_Table, pydantic.Tag("[table]")],
    pydantic.Discriminator(_kind_of_labels),
]
Bits = Annotated[tuple[Described, ...], AfterValidator(_bits)]


class Fixed(Spec):
    """A spec of which copies are the same object: it is frozen, and snapshots hold many."""

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: Any = None) -> Self:
        return self


class Field(Fixed):
    """One number of a packet, or `count` of them, or `count` bytes, or `count` bits of padding.

    Field(name="mag_y", type="i12be", scale=-0.5, unit="uT", description="field along y")
    """

    name: Annotated[str, AfterValidator(_field_name)]
    """Name, unique in its packet; padding has none."""
    type: Annotated[str, AfterValidator(_type)]
    """How a number is packed: u1 to u64, i2 to i64, f16, f32, f64; `bytes`: as they are; `pad`:
    bits that mean nothing. `be` or `le` at the end: its byte order."""
    description: Described
    """What it is."""
    unit: Text = ""
    """Unit of the value."""
    byte_order: Order = "little"
    """Order of its bytes and bits; it changes within a packet at whole bytes only. Numbers of
    whole bytes may have either; in a file, also a key of the packet or of the whole file."""
    scale: Annotated[float, _LARGEST_COEFFICIENT] = 1.0
    """Value of the raw number one, above the offset; 1 for floats and bytes."""
    offset: Annotated[float, _LARGEST_COEFFICIENT] = 0.0
    """Value of the raw number zero; 0 for floats and bytes."""
    polynomial: tuple[Annotated[float, _LARGEST_COEFFICIENT], ...] = ()
    """In place of scale and offset: value = c0 + c1 raw + c2 raw^2 + ..., c0 first."""
    count: int = pydantic.Field(default=1, ge=1, le=8 * ANY_BYTES)
    """How many numbers, bytes, or bits of padding."""
    labels: Labels = ()
    """What raw numbers mean: a list of texts for 0, 1, ..., or a table of texts by numbers; others
    are shown as numbers. In a file, also the name of a table in `labels`."""
    bits: Bits = ()
    """Names of its bits, of which any may be set, the lowest first; in a file, also the name of a
    table in `labels`, or `sensors`: all kinds of devices.
    """
    limits: Ends | None = None
    """Least and greatest value that is in order; the ground is warned beyond."""
    alarm: AlarmKeys | None = None
    """When telemetry raises an alarm besides: `critical`, `values`, `samples`, `latched`,
    `by_mode`."""
    unknown: Literal["lowest", "none"] = "lowest"
    """Raw number of a signed type that stands for a value not known on board; in a file, also a key
    of the packet or of the whole file."""

    @model_validator(mode="before")
    @classmethod
    def _order_of_type(cls, given: Any) -> Any:
        """`type = "i16be"` is `type = "i16"` with `byte_order = "big"`."""
        kind = given.get("type") if isinstance(given, dict) else None
        if not isinstance(kind, str) or kind[:-2] not in TYPES or kind[:-2] in ("bytes", "pad"):
            return given
        order = {"be": "big", "le": "little"}.get(kind[-2:])
        if order is None:
            return given
        if given.get("byte_order", order) != order:
            raise ValueError(f"byte_order: must agree with the type {kind}; received "
                             f"{given['byte_order']!r}")  # fmt: skip
        return {**given, "type": kind[:-2], "byte_order": order}

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for check in (_check_name, _check_value, _check_labels):
            check(self)
        is_number = self.kind.letter not in "sx"
        check_alarm(self.limits, self.alarm, is_number, self.texts.values(), self.bits)
        return self

    @property
    def kind(self) -> Type:
        """How a number is packed."""
        return TYPES[self.type]

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each number: `_x`, `_y`, `_z` for three, `_0`, `_1`, ... for other counts."""
        if self.type == "pad":
            return ()
        if self.count == 1 or self.type == "bytes":
            return (self.name,)
        ends = "xyz" if self.count == 3 else map(str, range(self.count))
        return tuple(f"{self.name}_{end}" for end in ends)

    @property
    def format(self) -> str:
        """The field in the letters of `struct`, "?" where it has none."""
        code, count = self.kind.code, self.count
        if self.type == "pad":
            return "?" if count % 8 else f"{count // 8}x"
        return f"{count}s" if code == "s" else (code or "?") * count

    @property
    def bit_size(self) -> int:
        """Bits of the field."""
        return self.kind.bits * self.count

    @property
    def size(self) -> int:
        """Bytes of the field, of those that have whole ones."""
        return self.bit_size // 8

    @property
    def texts(self) -> dict[int, str]:
        """What raw numbers mean."""
        return self.labels if isinstance(self.labels, dict) else dict(enumerate(self.labels))

    @property
    def is_raw(self) -> bool:
        """Whether the value is the raw number."""
        return self.scale == 1.0 and self.offset == 0.0 and not self.polynomial

    @property
    def is_whole(self) -> bool:
        """Whether values are whole: then they are integers, exact with all their digits."""
        is_plain = self.scale == 1.0 and self.offset.is_integer() and not self.polynomial
        return self.kind.is_whole and is_plain

    @property
    def coefficients(self) -> tuple[float, ...]:
        """Of the polynomial from raw number to value, the one of the raw number's power 0 first."""
        return self.polynomial or (self.offset, self.scale)

    def value(self, raw: float) -> float:
        """The value of a raw number."""
        if self.is_whole:
            return raw + int(self.offset)
        if self.is_raw:
            return raw
        if not self.polynomial:
            return raw * self.scale + self.offset if self.offset else raw * self.scale
        total = self.polynomial[-1]
        for coefficient in self.polynomial[-2::-1]:
            total = total * raw + coefficient
        return total

    @property
    def range(self) -> tuple[float, float]:
        """Least and greatest value."""
        ends = [self.kind.low, self.kind.high]
        values = [self.value(raw) for raw in (*ends, *self._turns())]
        return min(values), max(values)

    @property
    def unknown_value(self) -> float | None:
        """The value that stands for one not known on board."""
        has_one = self.kind.letter == "i" and self.unknown == "lowest"
        return self.value(self.kind.low) if has_one else None

    @property
    def dtype(self) -> str:
        """The type of NumPy that holds its values, "O" for bytes."""
        if self.type == "bytes":
            return "O"
        if not self.is_whole:
            return "f8"
        least, greatest = self.range
        ends = ((kind, np.iinfo(kind)) for sign in self._signs for kind in _NUMPY[sign])
        return next(kind for kind, x in ends if x.min <= least and greatest <= x.max)

    @property
    def _signs(self) -> str:
        return "i" if self.kind.letter == "i" or self.range[0] < 0 else "u"

    def raw_of(self, value: float) -> int:
        """The raw number of which the polynomial comes nearest to a value; NaN: the least."""
        low, high = int(self.kind.low), int(self.kind.high)
        if math.isnan(value):
            return low
        least, greatest = self.range
        value = min(max(value, least), greatest)
        roots = np.roots([*self.polynomial[:0:-1], self.polynomial[0] - value]).real
        inside = (min(max(float(root), low), high) for root in (*roots, *self._turns()))
        near = {low, high} | {whole for x in inside for whole in (math.floor(x), math.ceil(x))}
        return min(sorted(near), key=lambda raw: abs(self.value(raw) - value))

    def _turns(self) -> list[float]:
        """Raw numbers within the range at which the polynomial turns."""
        slope = [k * c for k, c in enumerate(self.polynomial)][:0:-1]
        roots = np.roots(slope).real if len(slope) > 1 else ()
        low, high = self.kind.low, self.kind.high
        near = (whole for x in roots if low <= x <= high for whole in (math.floor(x), math.ceil(x)))
        return [x for x in near if low <= x <= high]


#: Types of NumPy that hold whole values, the smallest first.
_NUMPY = {sign: tuple(f"{sign}{size}" for size in (1, 2, 4, 8)) for sign in "ui"}


#: What floats, bytes and padding must have of the keys that give a value; in words.
_OF_FLOATS = (("scale", 1.0, "1"), ("offset", 0.0, "0"), ("polynomial", (), "left out"))


def _check_name(field: Field) -> None:
    if (field.type == "pad") != (field.name == ""):
        must = "must be left out for padding" if field.name else "must be given"
        raise ValueError(f"name: {must}; received {field.name!r}")
    if field.type == "bytes" and field.byte_order != "little":
        raise ValueError(f"byte_order: must be left out for bytes; received {field.byte_order!r}")
    most = {"pad": 8 * ANY_BYTES, "bytes": ANY_BYTES}.get(field.type, MOST_NUMBERS)
    if field.count > most:
        raise ValueError(f"count: must be at most {most}; received {field.count}")
    if field.unknown != "lowest" and field.kind.letter != "i":
        raise ValueError(f"unknown: must be left out for the type {field.type}; received "
                         f"{field.unknown!r}")  # fmt: skip


def _check_value(field: Field) -> None:
    if abs(field.scale) < _TINY:
        raise ValueError(f"scale: must not be 0, or nearer to it than {_TINY:g}; received "
                         f"{field.scale:g}")  # fmt: skip
    if not field.kind.is_whole:
        for key, plain, must in _OF_FLOATS:
            if (given := getattr(field, key)) != plain:
                raise ValueError(f"{key}: must be {must} for the type {field.type}; received "
                                 f"{given}")  # fmt: skip
    if field.polynomial and not (field.scale == 1.0 and field.offset == 0.0):
        raise ValueError(f"polynomial: must be given without scale and offset; received scale "
                         f"{field.scale:g}, offset {field.offset:g}")  # fmt: skip
    if field.polynomial and not (
        3 <= len(field.polynomial) <= 12 and abs(field.polynomial[-1]) >= _TINY
    ):
        raise ValueError("polynomial: must have 3 to 12 coefficients (scale and offset have two), "
                         f"the last not 0; received {list(field.polynomial)}")  # fmt: skip
    if field.is_whole and not (field.range[0] >= -(2**63) and field.range[1] < 2**64
                               and (field.range[0] >= 0 or field.range[1] < 2**63)):  # fmt: skip
        raise ValueError(f"offset: must leave values within 64 bits; received {field.offset:g}")


def _check_labels(field: Field) -> None:
    kind = field.kind
    for key, letters, what in (("labels", "ui", "a whole"), ("bits", "u", "an unsigned")):
        if getattr(field, key) and not (kind.letter in letters and field.is_raw):
            raise ValueError(
                f"{key}: must belong to {what} type without scale, offset and polynomial; received "
                f"type {field.type}, scale {field.scale:g}, offset {field.offset:g}"
            )
    if field.labels and field.bits:
        raise ValueError("bits: must be left out with labels; received both")
    if isinstance(field.labels, tuple) and len(field.labels) > kind.high + 1:
        raise ValueError(f"labels: must be at most {kind.high + 1} for the type {field.type}; "
                         f"received {len(field.labels)}")  # fmt: skip
    for number in field.texts:
        if not kind.low <= number <= kind.high:
            raise ValueError(f"labels: must be of numbers from {kind.low} to {kind.high}; "
                             f"received {number}")  # fmt: skip
    if len(field.bits) > kind.bits:
        raise ValueError(f"bits: must be at most {kind.bits} for the type {field.type}; received "
                         f"{len(field.bits)}")  # fmt: skip
