"""The plan: commands that wait on board for their execution time, kept in non-volatile memory.

A reboot loses none of them. Each is taken out of the memory before it is executed, so that no
reboot has one executed twice.
"""

from __future__ import annotations

import struct
from bisect import insort
from collections.abc import Callable, Iterator
from operator import attrgetter

from torquer.flight.packets.dictionary import Dictionary
from torquer.flight.packets.frames import Stream, Uplink
from torquer.flight.software.memory import Memory
from torquer.flight.software.state import Telecommand

#: File of the non-volatile memory that holds the plan.
PLAN = "plan"
#: Before each command: its number, bytes of its frame, bytes that it came in.
_HEAD = struct.Struct("<IHH")
_BY_TIME = attrgetter("time_s")


class Plan:
    """Commands by their execution time, equal times in the order in which they came. Plain state.

    The memory is written first: what it does not take is no change.
    """

    def __init__(self) -> None:
        self.commands: list[Telecommand] = []

    def __len__(self) -> int:
        return len(self.commands)

    def add(self, command: Telecommand, memory: Memory, dictionary: Dictionary) -> bool:
        """One more command; False if the memory did not take it."""
        kept = list(self.commands)
        insort(kept, command, key=_BY_TIME)
        return self._keep(kept, memory, dictionary)

    def take(
        self, wanted: Callable[[Telecommand], bool], memory: Memory, dictionary: Dictionary
    ) -> list[Telecommand]:
        """Take out the commands that are wanted, asked in their order; none if the memory did not
        take that."""
        taken: list[Telecommand] = []
        left: list[Telecommand] = []
        for command in self.commands:
            (taken if wanted(command) else left).append(command)
        return taken if taken and self._keep(left, memory, dictionary) else []

    def restore(self, memory: Memory, dictionary: Dictionary) -> bool:
        """Take up what the memory holds; False if not all of it can be read any more."""
        data = memory.read(PLAN)
        found = [_unpacked(dictionary, *part) for part in _parts(data or b"")]
        self.commands = [command for command in found if command is not None]
        return data is not None and len(self.commands) == len(found)

    def _keep(self, commands: list[Telecommand], memory: Memory, dictionary: Dictionary) -> bool:
        written = memory.write(PLAN, b"".join(_packed(dictionary, each) for each in commands))
        if written:
            self.commands = commands
        return written


def _packed(dictionary: Dictionary, command: Telecommand) -> bytes:
    values = (command.acknowledge, *command.values)
    frame = Uplink(dictionary).frame(command.packet, command.time_s, values)
    head = _HEAD.pack(command.request, len(frame), len(command.received))
    return head + frame + command.received


def _parts(data: bytes) -> Iterator[tuple[int, bytes, bytes]]:
    """Number, frame, what it came in, of each command; the checksum of the file has been right."""
    at = 0
    while at + _HEAD.size <= len(data):
        number, frame, received = _HEAD.unpack_from(data, at)
        at += _HEAD.size
        yield number, data[at : at + frame], data[at + frame : at + frame + received]
        at += frame + received


def _unpacked(
    dictionary: Dictionary, number: int, frame: bytes, received: bytes
) -> Telecommand | None:
    """The command; None where the software does not have it any more."""
    for each in Stream(dictionary, "up").feed(frame):
        asks, *values = each.values
        return Telecommand(
            *(each.packet.name, each.packet.id, each.module, each.time_s, bool(asks)),
            *(tuple(values), received, number),
        )
    return None
