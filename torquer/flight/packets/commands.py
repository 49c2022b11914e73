"""Commands as a ground station sends them, by time, with names in place of numbers.

[[commands]]
at_s = 600                 # time of the run at which it is sent
command = "set_mode"
values = { region = "stabilisation", state = "science" }
delay_s = 60               # executed so long after it is sent; or at = 2012-03-04T12:00:00Z
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from datetime import datetime
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import BeforeValidator, Field, PlainSerializer, model_validator

from torquer.base.explain import ScenarioError, validate_tables
from torquer.base.spec import Spec
from torquer.base.time import parse_utc, utc_text
from torquer.computer.names import Names
from torquer.flight.packets.bits import from_words
from torquer.flight.packets.dictionary import Dictionary, Field as PacketField, Packet
from torquer.flight.packets.frames import EPOCH, LAST_REQUEST, Uplink
from torquer.flight.packets.mistakes import quote_value
from torquer.scenario.toml_text import parse_toml, read_text

#: Answers to commands that wait on board until they are sent down: a further one drops the oldest.
ANSWERS = 10
#: Last year in which all seconds since 2010 fit into a header.
_LAST_YEAR = 2145


def _checked_at(value) -> datetime | None:
    """An execution time that a header can hold."""
    if value is None:
        return None
    try:
        at = parse_utc(value, "at")
    except OverflowError:  # a zone beyond the first or the last day of the calendar
        at = None
    if at is None or not at > EPOCH or at.year > _LAST_YEAR:
        raise ValueError(f"at: must lie within the years 2010 to {_LAST_YEAR}; received {value}")
    return at


class Sent(Spec):
    """A command and when it is sent."""

    at_s: float = Field(ge=0.0)
    """Time of the run at which it is sent; the next control step receives it."""
    command: str
    """Name of a packet of the uplink."""
    values: dict[str, Any] = Field(default_factory=dict)
    """Its values by the names of its fields, several numbers as a list. Regions, states, flags,
    parameters and labels may be named, bits that are set by a text of names with commas.
    """
    delay_s: float | None = Field(default=None, gt=0.0)
    """Time after which it is executed; left out: at once."""
    at: Annotated[
        datetime | None,
        BeforeValidator(_checked_at),
        PlainSerializer(lambda at: at and utc_text(at), when_used="json"),
    ] = None
    """Time of its execution, by the satellite's clock, with its zone; in place of delay_s."""
    acknowledge: bool = True
    """Whether an acknowledgement is asked for."""

    @model_validator(mode="after")
    def _has_one_time(self) -> Self:
        if self.at is not None and self.delay_s is not None:
            raise ValueError("at: must not be given with delay_s; received both")
        return self

    def execute_s(self, sent_s: float) -> int:
        """Execution time [s since 2010], 0: at once; `sent_s`: time of sending, likewise."""
        if self.at is not None:
            return math.ceil((self.at - EPOCH).total_seconds())
        return 0 if self.delay_s is None else math.ceil(sent_s + self.delay_s)


class ScriptFile(Spec):
    """A file of commands."""

    commands: tuple[Sent, ...] = ()
    """Commands, in any order."""


def load_script(path: Path) -> ScriptFile:
    """The commands of a TOML file; `ScenarioError` with one line for each mistake."""
    return validate_tables(ScriptFile, parse_toml(read_text(path, "commands"), "commands"))


def make_frames(
    script: ScriptFile, dictionary: Dictionary, names: Names, start: datetime
) -> list[tuple[float, bytes]]:
    """(time of the run, frame) of each command, by time; `ScenarioError` for one that cannot be.

    `start`: of the run, a time with a zone. Commands have numbers from 1 on, as they are sent.
    """
    maker, start_s = Uplink(dictionary), (start - EPOCH).total_seconds()
    found = [
        (sent, command_numbers(sent, dictionary, names, f"commands[{i}]."))
        for i, sent in enumerate(script.commands)
    ]
    frames = []
    for i, (sent, numbers) in enumerate(sorted(found, key=lambda pair: pair[0].at_s)):
        due_s = sent.execute_s(start_s + sent.at_s)
        request = i % LAST_REQUEST + 1
        frames.append((sent.at_s, maker.frame(sent.command, due_s, numbers, request)))
    return frames


def command_numbers(sent: Sent, dictionary: Dictionary, names: Names, place: str = "") -> list:
    """The numbers of a command's packet, in order; `ScenarioError` for what it cannot hold.

    `place`: what stands before its keys in messages.
    """
    if sent.command not in dictionary.up:
        near = get_close_matches(sent.command, dictionary.up, 1)
        hint = f" (did you mean {near[0]}?)" if near else ""
        raise ScenarioError(
            f"{place}command: must be one of {', '.join(dictionary.up) or 'no commands'}; received "
            f"{sent.command!r}{hint}"
        )
    return _numbers(f"{place}values", sent, dictionary.up[sent.command], names)


def _numbers(place: str, sent: Sent, packet: Packet, names: Names) -> list:
    """The numbers of a packet, in order."""
    fields = {field.name: field for field in packet.fields if field.name != "acknowledge"}
    for name in sent.values:
        if name not in fields:
            raise ScenarioError(
                f"{place}.{name}: must be a field of {packet.name}: {', '.join(fields) or 'none'}"
            )
    numbers: list = [int(sent.acknowledge)]
    for name, field in fields.items():
        if name not in sent.values:
            raise ScenarioError(f"{place}.{name}: must be given; received nothing")
        value = _number(f"{place}.{name}", name, sent.values, field, names)
        many = field.count > 1 and field.type != "bytes"
        if many and not (isinstance(value, list) and len(value) == field.count):
            raise ScenarioError(
                f"{place}.{name}: must be {field.count} numbers; received {quote_value(value)}"
            )
        for each in value if many else [value]:
            _check_fits(f"{place}.{name}", field, each)
        numbers += value if many else [value]
    return numbers


def _check_fits(place: str, field: PacketField, value) -> None:
    """`ScenarioError` for a value that the codec would change: it saturates and rounds."""
    if field.type == "bytes":
        if not isinstance(value, bytes) or len(value) > field.count:
            raise ScenarioError(
                f"{place}: must be ASCII text of at most {field.count} characters; received "
                f"{quote_value(value)}"
            )
        return
    low, high = field.range
    must = "a whole number" if field.is_whole else "a number"
    is_number = isinstance(value, int | float)
    if not is_number or not low <= value <= high or (must != "a number" and value % 1):
        raise ScenarioError(
            f"{place}: must be {must} from {_text(low)} to {_text(high)}; received "
            f"{quote_value(value)}"
        )


def _text(end: float) -> str:
    """An end of a range; whole ones have all their digits."""
    return str(end) if isinstance(end, int) else f"{end:g}"


def _number(place: str, name: str, values: Mapping, field: PacketField, names: Names):
    """A value with its name resolved."""
    value = values[name]
    if not isinstance(value, str):
        return value
    known = {label: number for number, label in field.texts.items()}
    if name == "region":
        known = _numbered(names.regions)
    elif name == "state" and values.get("region") in names.regions:
        known = _numbered(names.regions[values["region"]][1])
    elif name == "flag":
        known = _numbered(names.flags)
    elif name == "index":
        known = _numbered(names.all_parameters())
    elif field.bits:
        try:
            return from_words(field, value)
        except ValueError as error:
            raise ScenarioError(f"{place}: {error}; received {value!r}") from None
    elif not field.labels:
        return value.encode() if field.type == "bytes" and value.isascii() else value
    if value not in known:
        one_of = f"one of {', '.join(known)}" if known else "a number: no name is known here"
        raise ScenarioError(f"{place}: must be {one_of}; received {value!r}")
    return known[value]


def _numbered(names: Iterable[str]) -> dict[str, int]:
    """The place of each name; of a name that comes twice, the first."""
    found: dict[str, int] = {}
    for number, name in enumerate(names):
        found.setdefault(name, number)
    return found
