"""Request verification of PUS-C on board: service 1 (ECSS-E-ST-70-41C, 6.1 and 8.1).

TM[1,1] accepted, TM[1,2] refused, TM[1,7] completed, TM[1,8] failed; each with the ID of the
request, the two failures with a reason code u8. Successes are reported if the ack flags ask for it,
failures always. A report goes to where the request came from.

Whoever judges commands states what became of each (`judged`); a module's answer states the command
by packet, module, time stamp and number of the request. Equal ones, as two users of the process
may send, are answered in the order in which they were handed on.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from torquer.flight.packets.pus_profile import DONE, WAITING, Kind, Message
from torquer.flight.packets.space_packets import ACCEPTANCE, COMPLETION, request_id

#: Place of the source id in a telecommand packet, and of the byte that ends with its ack flags.
_SOURCE, _ACK = slice(9, 11), slice(6, 7)
#: What the answer to a command states of it: id of its packet, module, time stamp [s], request.
Key = tuple[int, int, int, int]


class Request(NamedTuple):
    """What a report needs of a telecommand: its ID, its source, its ack flags."""

    id: bytes
    source: int
    ack: int

    @classmethod
    def of(cls, packet: bytes) -> Request:
        """Of a telecommand packet; source and ack flags are 0 if it ends before them."""
        source, ack = packet[_SOURCE], packet[_ACK]
        return cls(request_id(packet), int.from_bytes(source, "big"), sum(ack) & 0xF)


class Report(NamedTuple):
    """A report that waits to be sent."""

    message: Message
    destination: int


def success(request: Request, kind: tuple[int, int]) -> list[Report]:
    """The report, if it is asked for, that a request was accepted or completed."""
    asked = ACCEPTANCE if kind == Kind.ACCEPTED else COMPLETION
    return [Report(Message(kind, request.id), request.source)] if request.ack & asked else []


def failure(request: Request, kind: tuple[int, int], code: int) -> list[Report]:
    """The report that a request was refused or failed."""
    return [Report(Message(kind, request.id + bytes([code & 0xFF])), request.source)]


class _OnItsWay(NamedTuple):
    """A command that was handed on to its module, and whether its acceptance is reported."""

    key: Key
    request: Request
    reported: bool


class Verification:
    """What became of requests, as reports. Plain state."""

    #: Most commands whose answers are waited for: of the oldest no end is reported.
    MOST_ON_THEIR_WAY = 2000

    def __init__(self) -> None:
        self.reports: list[Report] = []
        self._on_their_way: list[_OnItsWay] = []
        #: While activities are inserted into the schedule: reason code by the activity's ID.
        self._inserting: dict[bytes, int] = {}

    @property
    def waiting(self) -> bool:
        """Whether there is something to report."""
        return bool(self.reports) or not all(each.reported for each in self._on_their_way)

    def judged(self, packet: bytes, key: Key, code: int) -> None:
        """What became of the command of a packet: handed on, in the list, or refused.

        One that was handed on can still be refused: its module has been stopped.
        """
        request = Request.of(packet)
        alone = request.id in self._inserting and len(self._inserting) == 1
        if request.id in self._inserting:
            self._inserting[request.id] = code
        if code == DONE:
            self._on_their_way.append(_OnItsWay(key, request, False))
            del self._on_their_way[: -self.MOST_ON_THEIR_WAY]
        elif code != WAITING:
            begun = [each for each in self._on_their_way if each.key == key]
            self._on_their_way = [each for each in self._on_their_way if each.key != key]
            was_accepted = any(each.reported for each in begun)
            if not alone:  # else the report on the insertion says it
                kind = Kind.FAILED if was_accepted else Kind.REFUSED
                self.reports += failure(request, kind, code)

    def insertion_begins(self, activities: Iterable[bytes]) -> None:
        """Activities (telecommand packets) are judged from now on."""
        self._inserting = {request_id(packet): DONE for packet in activities}

    def insertion_ends(self, request: Request) -> None:
        """Report on the request that inserts: refused if no activity was inserted, failed if some
        were not.
        """
        codes, self._inserting = list(self._inserting.values()), {}
        faults = [code for code in codes if code not in (DONE, WAITING)]
        if len(faults) == len(codes):
            self.reports += failure(request, Kind.REFUSED, faults[0])
            return
        self.reports += success(request, Kind.ACCEPTED)
        self.reports += (
            failure(request, Kind.FAILED, faults[0]) if faults else success(request, Kind.COMPLETED)
        )

    def answered(self, keys: Sequence[Key]) -> list[Request | None]:
        """The requests to which answers of modules belong, by their keys; None for none."""
        return [self._first(key) for key in keys]

    def _first(self, key: Key) -> Request | None:
        """Take the first of a key that was on its way before."""
        for place, each in enumerate(self._on_their_way):
            if each.reported and each.key == key:
                return self._on_their_way.pop(place).request
        return None

    def take(self) -> list[Report]:
        """The reports that wait, those on commands handed on just now included."""
        for each in self._on_their_way:
            if not each.reported:
                self.reports += success(each.request, Kind.ACCEPTED)
        self._on_their_way = [each._replace(reported=True) for each in self._on_their_way]
        taken, self.reports = self.reports, []
        return taken
