"""PUS-C on the ground (ECSS-E-ST-70-41C): commands become telecommands, telemetry becomes frames.

The user of an application process takes and gives the frames of a dictionary, so that whoever
commands and archives need not know of PUS. A report on a request becomes the acknowledgement of
the command that was sent with it. `torquer.flight.packets.pus` is the end on board.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

from torquer.flight.packets.codec import encoder
from torquer.flight.packets.dictionary import Dictionary
from torquer.flight.packets.frames import Frame
from torquer.flight.packets.pus_profile import (
    DONE,
    SOURCE,
    WAITING,
    Kind,
    Made,
    Message,
    Profile,
    ack_flags,
    frame_packet,
    insertion,
)
from torquer.flight.packets.space_packets import (
    COUNTS,
    Malformed,
    Telecommand,
    Telemetry,
    is_idle,
    read_telemetry,
    request_id,
)


class Sent(NamedTuple):
    """A command of which reports may come: id of its packet, module, time stamp [s], number.

    `inserts`: whether the request only inserted it into the schedule.
    """

    id: int
    module: int
    time_s: int
    request: int
    inserts: bool


#: What is known of the command of a request that someone else has sent.
_NOT_OURS = Sent(0, 0, 0, 0, False)


class User:
    """The end on the ground.

    `rejected`: telemetry packets by why they were rejected; `accepted`: reports of acceptance;
    `pings_answered`: answers to connection tests; `unknown_requests`: reports on the end of a
    request that was not sent here, or too long ago.
    """

    #: Most requests whose commands are remembered: the oldest are forgotten.
    MOST_SENT = 1000
    #: Bytes that belong to no packet: packets come whole.
    lost_bytes = 0

    def __init__(self, dictionary: Dictionary, apid: int):
        self._profile, self._apid, self._count = Profile(dictionary), apid, 0
        self._sent: dict[bytes, Sent] = {}
        self.rejected: Counter[str] = Counter()
        self.accepted = self.pings_answered = self.unknown_requests = 0

    def request(self, frame: bytes) -> bytes:
        """The telecommand packet for the frame of a command; ValueError if it is none.

        With a time stamp, the packet that inserts it into the schedule: it has the count before.
        """
        made = Made.of(frame)
        message = self._profile.request(made)
        if message.kind == Kind.DELETE_ACTIVITIES:
            message = self._profile.request(made._replace(data=self._named(made.data)))
        count = self._next_count()
        if not made.time_s:
            return self._remember(message, made, count)
        activity = self._remember(message, made, self._next_count())
        return self._remember(insertion(made.time_s, activity), made, count)

    def ping(self) -> bytes:
        """A connection test: TC[17,1]; its answer is counted."""
        return self._telecommand(Message(Kind.ARE_YOU_ALIVE, b""), self._next_count(), 0)

    def feed(self, packet: bytes) -> Iterator[Frame]:
        """The frame, if any, that a telemetry packet stands for."""
        if is_idle(packet):
            return
        try:
            frame = self._frame(read_telemetry(packet, self._apid))
        except Malformed as error:
            self.rejected[error.reason] += 1
        else:
            if frame is not None:
                yield frame

    def finish(self) -> Iterator[Frame]:
        """Nothing waits for the rest of a packet."""
        return iter(())

    def _next_count(self) -> int:
        count, self._count = self._count, (self._count + 1) % COUNTS
        return count

    def _telecommand(self, message: Message, count: int, ack: int) -> bytes:
        (service, subtype), data = message
        return Telecommand(self._apid, count, ack, service, subtype, SOURCE, data).packed()

    def _remember(self, message: Message, made: Made, count: int) -> bytes:
        """The packet of a message, its request ID noted for the reports on it."""
        packet = self._telecommand(message, count, ack_flags(made))
        number = request_id(packet)
        self._sent.pop(number, None)
        inserts = message.kind == Kind.INSERT_ACTIVITIES
        self._sent[number] = Sent(made.id, made.code, made.time_s, made.request, inserts)
        if len(self._sent) > self.MOST_SENT:
            del self._sent[next(iter(self._sent))]
        return packet

    def _named(self, data: bytes) -> bytes:
        """The fields of `plan_cancel` with the telecommand of a command for the command's number.

        One that was not sent here, or too long ago, keeps its number, which no telecommand has.
        """
        request = int.from_bytes(data[1:], "little")
        for number, sent in reversed(self._sent.items()):
            if request and sent.request == request and not sent.inserts:
                return data[:1] + number[::-1]
        return data

    def _frame(self, read: Telemetry) -> Frame | None:
        """The frame of a report; None if it was only to be counted."""
        kind = (read.service, read.subtype)
        if read.service == Kind.ACCEPTED[0]:
            return self._answer(kind, read)
        if kind != Kind.I_AM_ALIVE:
            return self._profile.frame(kind, read.time_s, read.data)
        if read.data:
            raise Malformed("length")
        self.pings_answered += 1
        return None

    def _answer(self, kind: tuple[int, int], read: Telemetry) -> Frame | None:
        """The acknowledgement that a report of service 1 stands for."""
        if kind not in (Kind.ACCEPTED, Kind.REFUSED, Kind.COMPLETED, Kind.FAILED):
            raise Malformed("unknown")
        number, failed = read.data[:4], kind in (Kind.REFUSED, Kind.FAILED)
        if len(read.data) != 4 + failed:
            raise Malformed("length")
        code = read.data[4] if failed else DONE
        # another user of the process may have sent a request with the same ID
        sent = self._sent.get(number) if read.destination == SOURCE else None
        if kind == Kind.ACCEPTED:
            self.accepted += 1
            is_told = sent is not None and sent.inserts
            return self._acknowledgement(sent, WAITING, read.time_s) if is_told else None
        if sent is None:
            self.unknown_requests += 1
        else:
            del self._sent[number]
            if kind == Kind.COMPLETED and sent.inserts:
                return None
        return self._acknowledgement(sent, code, read.time_s)

    def _acknowledgement(self, sent: Sent | None, code: int, time_s: int) -> Frame | None:
        """The frame, if the dictionary has such a packet; its counter is 0: not reported.

        `sent` is None for a request of someone else: id, module and time stamp are then 0.
        """
        packet = self._profile.down.get(self._profile.acknowledgement)
        if packet is None:
            return None
        number, module, command_s, request, _ = sent or _NOT_OURS
        values = (number, module, code == DONE, code, command_s, 0, request)
        return frame_packet(packet, time_s, encoder(packet)(values))
