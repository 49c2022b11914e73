"""The dictionary of packets between satellite and ground: frozen specs, read from TOML.

A packet is a row of fields, packed without gaps; value = raw number * `scale` + `offset`, in
`unit`. A field holds one number or several, of 1 to 64 bits in either byte order, or bytes; see
`fields`. Whatever reads, writes or describes packets (codec, frames, XTCE, DBC, Open MCT,
documentation) follows from here.
"""

import difflib
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Self, get_args

import pydantic
from pydantic import ValidationError, model_validator

from torquer.base.text_files import LEVELS, has_deep_key, limited_text
from torquer.flight.packets.alarm_limits import check_modes
from torquer.flight.packets.fields import (
    ANY_BYTES,
    MOST_NUMBERS,
    Described,
    Field as Field,
    Fixed,
    Labels,
    Name as Name,
    Order,
)
from torquer.flight.packets.mistakes import describe_mistake, quote_value
from torquer.spacecraft.sensors.devices import DEVICES

#: Tables of names besides those in `labels` of a file, which go first: all kinds of devices.
TABLES = {"sensors": tuple(device.name for device in DEVICES)}
_SHIPPED = Path(__file__).parent
#: Keys of fields that a packet, or a whole file, may state for all its fields; their values, and
#: the types that take them.
COMMON = {"byte_order": (get_args(Order), "uifx"), "unknown": (("lowest", "none"), "i")}


class DictionaryError(ValueError):
    """Mistakes in a dictionary: one line each, with file and key."""


Id = Annotated[int, pydantic.Field(ge=0, le=65535)]
ModuleId = Annotated[int, pydantic.Field(ge=1, le=255)]


class Place(NamedTuple):
    """A number of a packet, or bytes: its name, field, first bit and how many.

    A bit counts from the beginning of the packet, in the byte order of the field.
    """

    name: str
    field: Field
    bit: int
    bits: int

    @property
    def end(self) -> int:
        """The byte after its last one."""
        return -(-(self.bit + self.bits) // 8)


class Packet(Fixed):
    """The data of a frame. A packet of the uplink is a command to a module."""

    name: Name
    """Name, unique in its direction."""
    id: Id
    """`msg_id` of the header, unique in its direction; of a space packet its APID."""
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
        _check_packing(self.fields)
        if not 0 < self.size <= ANY_BYTES:
            raise ValueError(f"fields: must have 1 to {ANY_BYTES} bytes; received {self.size}")
        if len(self.names) > MOST_NUMBERS:
            raise ValueError(
                f"fields: must have at most {MOST_NUMBERS} numbers; received {len(self.names)}"
            )
        times = {f.names[0] for f in self.fields if len(f.names) == 1 and f.type != "bytes"}
        if self.time_ms and self.time_ms not in times:
            raise ValueError(f"time_ms: must be a field of one number; received {self.time_ms!r}")
        return self

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the values, one per number."""
        return _names(self)

    @property
    def struct_format(self) -> str | None:
        """The data in the letters of `struct`; None if it cannot pack them."""
        orders = {f.byte_order for f in self.fields if f.kind.letter != "x" and f.kind.bits > 8}
        letters = "".join(field.format for field in self.fields)
        if "?" in letters or len(orders) > 1:
            return None
        return (">" if "big" in orders else "<") + letters

    @property
    def format(self) -> str:
        """How the data are packed, in a text that differs where that does."""
        return self.struct_format or " ".join(
            f"{f.byte_order[0]} {f.count}{f.type}" for f in self.fields
        )

    @property
    def size(self) -> int:
        """Bytes of the data."""
        return _size(self)

    @property
    def places(self) -> tuple[Place, ...]:
        """Where each value is, in order."""
        return _places(self)

    def numbers(self) -> Iterator[tuple[str, Field, int]]:
        """(name, field, first byte) of each value."""
        return ((each.name, each.field, each.bit // 8) for each in self.places)


def _check_packing(fields: tuple[Field, ...]) -> None:
    """Bytes begin, the byte order changes, and the packet ends where a byte does."""
    at, order = 0, ""
    for field in fields:
        if at % 8 and field.type == "bytes":
            raise ValueError(f"fields: bytes must begin at a whole byte; received {field.name} "
                             f"{at % 8} bits after one")  # fmt: skip
        if at % 8 and field.byte_order != order:
            raise ValueError(f"fields: the byte order must change at a whole byte; received "
                             f"{field.name or 'padding'} ({field.byte_order}) {at % 8} bits after "
                             "one")  # fmt: skip
        at, order = at + field.bit_size, field.byte_order
    if at % 8:
        raise ValueError("fields: must fill whole bytes, by padding (type = \"pad\", count = "
                         f"{-at % 8}) if need be; received {at} bits")  # fmt: skip


@cache
def _names(packet: Packet) -> tuple[str, ...]:
    return tuple(name for field in packet.fields for name in field.names)


@cache
def _size(packet: Packet) -> int:
    return sum(field.bit_size for field in packet.fields) // 8


@cache
def _places(packet: Packet) -> tuple[Place, ...]:
    found, at = [], 0
    for field in packet.fields:
        bits = field.bit_size // max(len(field.names), 1)
        found += [Place(name, field, at + k * bits, bits) for k, name in enumerate(field.names)]
        at += field.bit_size
    return tuple(found)


class Dictionary(Fixed):
    """All packets of a satellite, by name."""

    name: Described
    """Name of the satellite."""
    modules: dict[Name, ModuleId] = pydantic.Field(default_factory=dict)
    """Ids of the modules of its software; only commands need them."""
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
                known = ", ".join(self.modules) or "the table [modules], which is empty"
                raise ValueError(
                    f"up.{packet.name}.module: must be one of {known}; received {received}"
                )
        return self

    def check_alarms(self, regions: Mapping[str, Iterable[str]] | None = None) -> None:
        """ValueError with one line for limits by a mode that telemetry does not tell.

        `regions`: the states of each region of the mode table; left out: not known yet.
        """
        for packet in self.up.values():
            for k, field in enumerate(packet.fields[1:]):
                if field.alarm:
                    raise ValueError(f"up.{packet.name}.fields[{k}].alarm: must not be given for "
                                     "commands; received one")  # fmt: skip
        modes: dict[str, Iterable[str]] = {
            f"{packet.name}.{name}": field.texts.values()
            for packet in self.down.values()
            for name, field, _ in packet.numbers()
            if field.labels
        }
        modes |= dict(regions or {}) if "modes" in self.down else {}
        are_open = regions is None and "modes" in self.down
        for packet in self.down.values():
            for k, field in enumerate(packet.fields):
                if field.alarm:
                    check_modes(f"down.{packet.name}.fields[{k}]", field.alarm, modes, are_open)

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
    if not (re.fullmatch(r"\w+", str(source)) and shipped.exists()):
        return _load_files((Path(source), *map(Path, extra)))
    return _load_files((shipped, *map(Path, extra))) if extra else _load_shipped(shipped)


@cache
def _load_shipped(path: Path) -> Dictionary:
    """A dictionary of the package, which does not change: an export to C asks for it ten times."""
    return _load_files((path,))


def _load_files(paths: tuple[Path, ...]) -> Dictionary:
    """The dictionary of a first file and of those that add to it."""
    found: dict[str, Any] = {}
    for path in paths:
        try:
            data = _read_toml(path)
            common = _common(data, "")
            found = _join(found, data)
            found |= {key: _with_fields(found, key, common) for key in ("down", "up")}
            dictionary = Dictionary.model_validate(found)
            dictionary.check_alarms()
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


def _common(table: dict, place: str) -> dict[str, str]:
    """What a file or packet states for all its fields, taken out of its table."""
    found = {key: table.pop(key) for key in COMMON if key in table}
    for key, value in found.items():
        if value not in COMMON[key][0]:
            must = " or ".join(map(repr, COMMON[key][0]))
            raise ValueError(f"{place}{key}: must be {must}; received {quote_value(value)}")
    return found


def _with_fields(data: dict, direction: str, common: dict[str, str]) -> dict:
    """Packets with their names and all their fields; those that are specs already stay.

    `common`: what the file states for all fields.
    """
    packets = dict(data.get(direction, {}))
    for name, table in packets.items():
        if isinstance(table, Packet) or not isinstance(table, dict):
            continue
        table, place = dict(table), f"{direction}.{name}"
        fields, of_packet = table.get("fields"), common | _common(table, f"{place}.")
        if "name" in table:
            raise ValueError(f"{place}.name: must not be given: it is the table's name")
        if direction == "down" and "module" in table:
            raise ValueError(f"{place}.module: must not be given for telemetry")
        if isinstance(fields, str):
            fields = _copied_fields(packets, fields, place)
        elif isinstance(fields, list):
            tables = TABLES | data.get("labels", {})
            _check_polynomials(fields, place)
            fields = [_label(f, tables, f"{place}.fields[{i}]") for i, f in enumerate(fields)]
            fields = [_complete(field, of_packet) for field in fields]
            fields = [ACKNOWLEDGE, *fields] if direction == "up" else fields
        known = {} if fields is None else {"fields": fields}
        packets[name] = {**table, "name": name, **known}
    return packets


def _complete(field, common: dict[str, str]):
    """A field with what is common to all of its packet, and padding with what stands for a name."""
    kind = field.get("type") if isinstance(field, dict) else None
    if not isinstance(kind, str):
        return field
    letter = "x" if kind == "pad" else "s" if kind == "bytes" else kind[:1]
    stated = {key: value for key, value in common.items() if letter in COMMON[key][1]}
    if kind.endswith(("be", "le")):
        stated.pop("byte_order", None)
    begin = {"name": "", "description": "padding"} if kind == "pad" else {}
    return {**begin, **stated, **field}


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


def _check_polynomials(fields: list, place: str) -> None:
    """ValueError for a polynomial of a file that is empty: in a field that stands for none."""
    for k, field in enumerate(fields):
        if isinstance(field, dict) and field.get("polynomial") == []:
            raise ValueError(
                f"{place}.fields[{k}].polynomial: must have 3 to 12 coefficients, or be left out; "
                "received []"
            )


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
