"""The dictionary of packets between satellite and ground: frozen specs, read from TOML.

A packet is a row of fields, packed without gaps, little-endian. A field holds one number or
several, or bytes; value = raw number * `scale`, in `unit`. Whatever reads, writes or describes
packets (codec, frames, XTCE, DBC, Open MCT, documentation) follows from here.
"""

import difflib
import re
import struct
import tomllib
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Self

import pydantic
from pydantic import AfterValidator, ValidationError, model_validator

from torquer.base.spec import Spec
from torquer.base.text_files import LEVELS, has_deep_key, limited_text
from torquer.flight.packets.mistakes import describe_mistake, quote_value
from torquer.spacecraft.sensors.devices import DEVICES

#: Bytes of the longest packet: with its header and the protected frame around it, it fits the 1024
#: bytes of a CCSDS telecommand frame.
MOST_BYTES = 960
#: Characters of the longest name: the names that DBC files make of it have at most 32.
_LONGEST_NAME = 23
#: Tables of names besides those in `labels` of a file, which go first: all kinds of devices.
TABLES = {"sensors": tuple(device.name for device in DEVICES)}
_SHIPPED = Path(__file__).parent
_LARGEST_F32 = float(struct.unpack("<f", b"\xff\xff\x7f\x7f")[0])
_LARGEST_F64 = float(struct.unpack("<d", b"\xff\xff\xff\xff\xff\xff\xef\x7f")[0])


class Type(NamedTuple):
    """How a number is packed: its code in `struct`, its bytes, least and greatest raw number."""

    code: str
    size: int
    low: float
    high: float

    @property
    def is_whole(self) -> bool:
        """Whether raw numbers are whole."""
        return self.code in "BHIbhi"


TYPES = {
    "u8": Type("B", 1, 0, 2**8 - 1),
    "u16": Type("H", 2, 0, 2**16 - 1),
    "u32": Type("I", 4, 0, 2**32 - 1),
    "i8": Type("b", 1, -(2**7), 2**7 - 1),
    "i16": Type("h", 2, -(2**15), 2**15 - 1),
    "i32": Type("i", 4, -(2**31), 2**31 - 1),
    "f32": Type("f", 4, -_LARGEST_F32, _LARGEST_F32),
    "f64": Type("d", 8, -_LARGEST_F64, _LARGEST_F64),
    "bytes": Type("s", 1, 0, 255),
}


class DictionaryError(ValueError):
    """Mistakes in a dictionary: one line each, with file and key."""


def _name(text: str) -> str:
    if not re.fullmatch(r"[a-z][a-z0-9]*(_[a-z0-9]+)*", text) or len(text) > _LONGEST_NAME:
        raise ValueError(
            "must be words of lower-case letters and digits, with '_' between them, at most "
            f"{_LONGEST_NAME} characters"
        )
    return text


def _plain(text: str) -> str:
    if not text.isprintable() or '"' in text or "\\" in text:
        raise ValueError("must be one line without quotation marks and backslashes")
    return text


def _parse_number(text: str) -> str:
    if not text.strip():
        raise ValueError("must not be empty")
    return text


def _labels(labels: tuple[str, ...]) -> tuple[str, ...]:
    if len(set(labels)) < len(labels):
        raise ValueError("must differ from each other")
    return labels


def _bits(names: tuple[str, ...]) -> tuple[str, ...]:
    for name in _labels(names):
        if "," in name or name.isdecimal():
            raise ValueError(f"must have no commas, and not be numbers; received {name!r}")
    return names


Name = Annotated[str, AfterValidator(_name)]
Text = Annotated[str, AfterValidator(_plain)]
Described = Annotated[str, AfterValidator(_plain), AfterValidator(_parse_number)]
Labels = Annotated[tuple[Described, ...], AfterValidator(_labels)]
Bits = Annotated[tuple[Described, ...], AfterValidator(_bits)]
Id = Annotated[int, pydantic.Field(ge=1, le=255)]


class _Fixed(Spec):
    """A spec of which copies are the same object: it is frozen, and snapshots hold many."""

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: Any = None) -> Self:
        return self


class Field(_Fixed):
    """One number of a packet, or `count` of them, or `count` bytes."""

    name: Name
    """Name, unique in its packet."""
    type: Literal["u8", "u16", "u32", "i8", "i16", "i32", "f32", "f64", "bytes"]
    """How a number is packed; `bytes`: as they are."""
    description: Described
    """What it is."""
    unit: Text = ""
    """Unit of the value."""
    scale: float = pydantic.Field(default=1.0, gt=0.0)
    """Value of the raw number one; 1 for f32, f64 and bytes."""
    count: int = pydantic.Field(default=1, ge=1, le=MOST_BYTES)
    """How many numbers or bytes."""
    labels: Labels = ()
    """What the raw numbers 0, 1, ... mean; in a file, also the name of a table in `labels`."""
    bits: Bits = ()
    """Names of its bits, of which any may be set, the lowest first; in a file, also the name of a
    table in `labels`, or `sensors`: all kinds of devices.
    """
    limits: tuple[float, float] | None = None
    """Least and greatest value that is in order; the ground is warned beyond."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        kind = TYPES[self.type]
        if self.scale != 1.0 and not kind.is_whole:
            raise ValueError(f"scale: must be 1 for the type {self.type}; received {self.scale}")
        for key, most in (("labels", kind.high + 1), ("bits", 8 * kind.size)):
            names = getattr(self, key)
            if names and (self.type[0] != "u" or self.scale != 1.0):
                raise ValueError(
                    f"{key}: must belong to an unsigned type without a scale; received "
                    f"type {self.type}, scale {self.scale:g}"
                )
            if len(names) > most:
                raise ValueError(
                    f"{key}: must be at most {most} for the type {self.type}; received {len(names)}"
                )
        if self.labels and self.bits:
            raise ValueError("bits: must be left out with labels; received both")
        if self.limits and (self.type == "bytes" or not self.limits[0] < self.limits[1]):
            raise ValueError(f"limits: must be [least, greatest]; received {list(self.limits)}")
        return self

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each number: `_x`, `_y`, `_z` for three, `_0`, `_1`, ... for other counts."""
        if self.count == 1 or self.type == "bytes":
            return (self.name,)
        ends = "xyz" if self.count == 3 else map(str, range(self.count))
        return tuple(f"{self.name}_{end}" for end in ends)

    @property
    def format(self) -> str:
        """The field in the letters of `struct`."""
        code = TYPES[self.type].code
        return f"{self.count}s" if code == "s" else code * self.count

    @property
    def size(self) -> int:
        """Bytes of the field."""
        return TYPES[self.type].size * self.count


class Packet(_Fixed):
    """The data of a frame. A packet of the uplink is a command to a module."""

    name: Name
    """Name, unique in its direction."""
    id: Id
    """`msg_id` of the header, unique in its direction."""
    description: Described
    """What it is."""
    fields: tuple[Field, ...]
    """Its fields, in order. Every command begins with `acknowledge`, which the dictionary adds."""
    module: str = ""
    """Module to which a command goes; empty for telemetry."""
    time_ms: str = ""
    """Field with the on-board time of the values [ms since 2010-01-01]; left out: the time stamp of
    the frame.
    """

    def __hash__(self) -> int:
        return hash((self.name, self.id))  # of all fields it takes longer than to encode them

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        seen: set[str] = set()
        for name in self.names:
            if name in seen:
                raise ValueError(f"fields: names must differ; received {name} twice")
            seen.add(name)
        if not 0 < self.size <= MOST_BYTES:
            raise ValueError(f"fields: must have 1 to {MOST_BYTES} bytes; received {self.size}")
        times = {f.names[0] for f in self.fields if len(f.names) == 1 and f.type != "bytes"}
        if self.time_ms and self.time_ms not in times:
            raise ValueError(f"time_ms: must be a field of one number; received {self.time_ms!r}")
        return self

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the values, one per number."""
        return _names(self)

    @property
    def format(self) -> str:
        """The data in the letters of `struct`: packed, little-endian."""
        return "<" + "".join(field.format for field in self.fields)

    @property
    def size(self) -> int:
        """Bytes of the data."""
        return _size(self)

    def numbers(self) -> Iterator[tuple[str, Field, int]]:
        """(name, field, first byte) of each value."""
        at = 0
        for field in self.fields:
            for name in field.names:
                yield name, field, at
                at += field.size // len(field.names)


@cache
def _names(packet: Packet) -> tuple[str, ...]:
    return tuple(name for field in packet.fields for name in field.names)


@cache
def _size(packet: Packet) -> int:
    return struct.calcsize(packet.format)


class Dictionary(_Fixed):
    """All packets of a satellite, by name."""

    name: Described
    """Name of the satellite."""
    modules: dict[Name, Id] = pydantic.Field(min_length=1)
    """Ids of the modules of its software."""
    labels: dict[Name, Labels] = pydantic.Field(default_factory=dict)
    """Enumerations, by name."""
    down: dict[str, Packet] = pydantic.Field(default_factory=dict)
    """Telemetry."""
    up: dict[str, Packet] = pydantic.Field(default_factory=dict)
    """Commands."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._ids_differ("modules", self.modules)
        for key, packets in (("down", self.down), ("up", self.up)):
            self._ids_differ(key, {name: packet.id for name, packet in packets.items()}, ".id")
        for packet in self.up.values():
            if packet.module not in self.modules:
                received = repr(packet.module) if packet.module else "nothing"
                raise ValueError(
                    f"up.{packet.name}.module: must be one of {', '.join(self.modules)}; "
                    f"received {received}"
                )
        return self

    def _ids_differ(self, place: str, ids: Mapping[str, int], end: str = "") -> None:
        taken: dict[int, str] = {}
        for name, number in ids.items():
            if number in taken:
                raise ValueError(
                    f"{place}.{name}{end}: must be free; received {number}, the id of "
                    f"{taken[number]}"
                )
            taken[number] = name


#: First field of every command.
ACKNOWLEDGE = Field(
    name="acknowledge",
    type="u8",
    labels=("NO", "YES"),
    description="whether an acknowledgement is asked for",
)


def load_dictionary(source: str | Path, extra: tuple = ()) -> Dictionary:
    """The dictionary of a TOML file, or the shipped one of a name (`"chibis_m"`).

    `extra`: further files; their modules, labels and packets are added. Names and ids that they
    take must be free. Mistakes are a `DictionaryError`.
    """
    shipped = _SHIPPED / f"{source}.toml"
    first = shipped if re.fullmatch(r"\w+", str(source)) and shipped.exists() else Path(source)
    found: dict[str, Any] = {}
    for path in (first, *map(Path, extra)):
        try:
            found = _join(found, _read_toml(path))
            found |= {key: _with_fields(found, key) for key in ("down", "up")}
            dictionary = Dictionary.model_validate(found)
        except ValidationError as error:
            lines = dict.fromkeys(map(describe_mistake, error.errors()))
            raise DictionaryError("\n".join(f"{path.name}: {line}" for line in lines)) from None
        except ValueError as error:
            raise DictionaryError(f"{path.name}: {error}") from None
        found = {key: getattr(dictionary, key) for key in Dictionary.model_fields}
    return dictionary


def _read_toml(path: Path) -> dict:
    """What a TOML file holds; ValueError if it is none."""
    try:
        text = limited_text(path)
        deep = has_deep_key(text)
        data = {} if deep else tomllib.loads(text)
    except OSError as error:
        shipped = ", ".join(sorted(file.stem for file in _SHIPPED.glob("*.toml")))
        raise ValueError(
            f"must be a readable file or one of {shipped}; received {path} ({error.strerror})"
        ) from None
    except RecursionError:
        deep = True
    except ValueError as error:  # of TOML, of UTF-8, or a number with too many digits
        raise ValueError(f"must be TOML; received: {error}") from None
    if deep:
        raise ValueError(f"must have at most {LEVELS} levels of tables and lists; received more")
    return data


def _join(known: dict, data: dict) -> dict:
    """What is known with the tables of a further file."""
    joined = dict(known)
    for key, value in data.items():
        if key in ("modules", "labels", "down", "up"):
            if not isinstance(value, dict):
                raise ValueError(f"{key}: must be a table of keys; received {quote_value(value)}")
            before = joined.get(key, {})
            for name in value:
                if name in before:
                    raise ValueError(f"{key}.{name}: must be a free name; received one in use")
            joined[key] = {**before, **value}
        elif key in known:
            raise ValueError(f"{key}: must not be in a file that adds packets")
        else:
            joined[key] = value
    return joined


def _with_fields(data: dict, direction: str) -> dict:
    """Packets with their names and all their fields; those that are specs already stay."""
    packets = dict(data.get(direction, {}))
    for name, table in packets.items():
        if isinstance(table, Packet) or not isinstance(table, dict):
            continue
        fields, place = table.get("fields"), f"{direction}.{name}"
        if "name" in table:
            raise ValueError(f"{place}.name: must not be given: it is the table's name")
        if direction == "down" and "module" in table:
            raise ValueError(f"{place}.module: must not be given for telemetry")
        if isinstance(fields, str):
            fields = _copied_fields(packets, fields, place)
        elif isinstance(fields, list):
            tables = TABLES | data.get("labels", {})
            fields = [_label(f, tables, f"{place}.fields[{i}]") for i, f in enumerate(fields)]
            fields = [ACKNOWLEDGE, *fields] if direction == "up" else fields
        known = {} if fields is None else {"fields": fields}
        packets[name] = {**table, "name": name, **known}
    return packets


def _copied_fields(packets: dict, name: str, place: str):
    """The fields of another packet above in the file."""
    other = packets.get(name)
    if isinstance(other, Packet):
        return other.fields
    fields = other.get("fields") if isinstance(other, dict) and "name" in other else None
    if not isinstance(fields, list | tuple):
        raise ValueError(f"{place}.fields: must be a list, or the name of a packet above it; "
                         f"received {quote_value(name)}")  # fmt: skip
    return fields


def _label(field, tables: dict, place: str):
    """A field with its labels, and names of bits, themselves in place of the name of a table."""
    found = {}
    for key in ("labels", "bits"):
        name = field.get(key) if isinstance(field, dict) else None
        if not isinstance(name, str):
            continue
        if name not in tables:
            near = difflib.get_close_matches(name, tables, 1)
            hint = f" (did you mean {near[0]}?)" if near else ""
            raise ValueError(
                f"{place}.{key}: must be a list or a name in [labels]; received {name!r}{hint}"
            )
        found[key] = tables[name]
    return {**field, **found} if found else field
