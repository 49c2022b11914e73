"""PUS-C on board (ECSS-E-ST-70-41C): telecommands become commands, frames become telemetry.

An application process takes space packets and gives the commands of a dictionary, and the other way
round for telemetry. `torquer.flight.packets.pus_profile` says which packet is which message,
`pus_verification` how requests are reported on; `pus_user` is the end on the ground.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping

from torquer.flight.packets.dictionary import Dictionary
from torquer.flight.packets.frames import HEADER_BYTES, INFO, Frame, Rejected, Rejections
from torquer.flight.packets.pus_profile import Kind, Made, Message, Profile
from torquer.flight.packets.pus_verification import (
    Key,
    Report,
    Request,
    Verification,
    failure,
    success,
)
from torquer.flight.packets.space_packets import (
    COUNTERS,
    COUNTS,
    Malformed,
    Telecommand,
    Telemetry,
    is_telecommand,
    read_telecommand,
)

#: Destination of the reports that are not on a request.
_ALL = 0
#: The packet `acknowledgement`: packet id, module, accepted, code, time stamp, counter, request.
_ANSWER = struct.Struct("<BBBBIII")
_CODE = 3


class ApplicationProcess(Rejections):
    """The end on board. Plain state that can be copied; its counts begin with 0 at a reboot.

    `codes`: reason codes by why a packet is rejected; `severities`: subtypes of service 5 by event
    code. What is rejected are telecommand packets; its `id`: that of the command, or 256 * service
    + subtype; 0 if the packet does not say.
    """

    #: Most message type counters, one for each message and destination: the oldest begin again.
    MOST_COUNTERS = 256
    #: Bytes that belong to no packet: each telecommand comes whole.
    lost_bytes = 0

    def __init__(
        self,
        dictionary: Dictionary,
        apid: int,
        codes: Mapping[str, int],
        severities: Mapping[int, int],
    ):
        super().__init__()
        self._profile, self._apid = Profile(dictionary), apid
        self._codes, self._severities = codes, severities
        self._verification = Verification()
        self._count = 0
        self._counters: dict[tuple, int] = {}

    @property
    def waiting(self) -> bool:
        """Whether there are reports to send that answer no frame."""
        return self._verification.waiting

    def feed(self, packet: bytes) -> Iterator[Frame]:
        """The commands of a telecommand packet. Each must be `judged` before the next is taken."""
        read = None
        try:
            read = read_telecommand(packet, self._apid)
            yield from self._commands(read, packet)
        except Malformed as error:
            self._reject(packet, read, error.reason)

    def finish(self) -> Iterator[Frame]:
        """Nothing waits for the rest of a packet."""
        return iter(())

    def _commands(self, read: Telecommand, packet: bytes) -> Iterator[Frame]:
        """The commands of a request; `Malformed` before the first of them if it is none."""
        kind, verification = (read.service, read.subtype), self._verification
        request = Request.of(packet)
        if kind == Kind.INSERT_ACTIVITIES:
            frames = self._profile.activities(read.data, self._apid)
            verification.insertion_begins(frame.raw for frame in frames)
            yield from frames
            verification.insertion_ends(request)
        elif kind != Kind.ARE_YOU_ALIVE:
            yield self._profile.command(read, packet, 0)
        elif read.data:
            raise Malformed("length")
        else:
            verification.reports += [
                *success(request, Kind.ACCEPTED),
                Report(Message(Kind.I_AM_ALIVE, b""), read.source),
                *success(request, Kind.COMPLETED),
            ]

    def _reject(self, packet: bytes, read: Telecommand | None, reason: str) -> None:
        """Count a packet, keep it for `take_rejected`, and report that it is refused."""
        self.note_rejected(Rejected(reason, _number(read), 0, 0, len(packet)))
        if is_telecommand(packet):
            request = Request.of(packet)
            self._verification.reports += failure(request, Kind.REFUSED, self._codes[reason])

    def judged(self, packet: bytes, key: Key, code: int) -> None:
        """What became of a command of `feed`: 0 handed on, 14 waits for its time, else refused."""
        self._verification.judged(packet, key, code)

    def reports(self, frames: list[bytes], time_s: int) -> list[bytes]:
        """The telemetry packets of frames, then those on requests, made at a time."""
        made = [Made.of(frame) for frame in frames if len(frame) >= HEADER_BYTES]
        keys = [_key_in(each) for each in made if self._is_answer(each)]
        requests = iter(self._verification.answered(keys))
        found = []
        for each in made:
            request = next(requests) if self._is_answer(each) else None
            if request is None:
                report = Report(self._profile.report(each, self._severities), _ALL)
                found.append(self._packet(report, each.time_s))
            else:
                found += self._verified(request, each)
        return found + [self._packet(each, time_s) for each in self._verification.take()]

    def _is_answer(self, made: Made) -> bool:
        """Whether a frame answers a command."""
        is_known = 0 < made.id == self._profile.acknowledgement
        return is_known and made.code == INFO and len(made.data) == _ANSWER.size

    def _verified(self, request: Request, made: Made) -> list[bytes]:
        """The packet, if any, on the execution of a request."""
        code = made.data[_CODE]
        reports = failure(request, Kind.FAILED, code) if code else success(request, Kind.COMPLETED)
        return [self._packet(each, made.time_s) for each in reports]

    def _packet(self, report: Report, time_s: int) -> bytes:
        """A telemetry packet with the next counts."""
        count, self._count = self._count, (self._count + 1) % COUNTS
        (service, subtype), data = report.message
        key = (service, subtype, report.destination)
        counter = self._counters.get(key, 0)
        self._counters[key] = (counter + 1) % COUNTERS
        if len(self._counters) > self.MOST_COUNTERS:
            del self._counters[next(iter(self._counters))]
        made = Telemetry(
            self._apid, count, service, subtype, counter, report.destination, time_s, data
        )
        return made.packed()


def _number(read: Telecommand | None) -> int:
    """What the log states of a telecommand: id of the command, else service and subtype."""
    if read is None:
        return 0
    is_function = (read.service, read.subtype) == Kind.PERFORM_FUNCTION and read.data
    return read.data[0] if is_function else read.service << 8 | read.subtype


def _key_in(made: Made) -> Key:
    """Which command an answer is for."""
    number, module, _, _, time_s, _, request = _ANSWER.unpack(made.data)
    return number, module, time_s, request
