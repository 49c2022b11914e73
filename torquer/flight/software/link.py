"""The link: what COM does with bytes of the uplink and with frames of the downlink."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Iterator

from torquer.flight.packets.dictionary import Dictionary
from torquer.flight.packets.frames import Frame, Rejected, Stream
from torquer.flight.packets.keys import KEY_COMMAND, Keys
from torquer.flight.packets.protected import TelemetrySender
from torquer.flight.packets.pus import ApplicationProcess
from torquer.flight.packets.reasons import REJECTIONS, Reason
from torquer.flight.software.command_keys import CommandKeys, deliver_keys
from torquer.flight.software.memory import Memory
from torquer.flight.software.state import Telecommand

#: File of the non-volatile memory: a counter of telemetry that lies ahead.
TELEMETRY = "counter.down"
#: How far ahead of the frames sent the stored counter of telemetry lies.
_AHEAD = 10000
_COUNTER = struct.Struct("<I")


def deliver_counters(memory: Memory) -> None:
    """The counters of an empty memory as it is delivered, whatever the link."""
    deliver_keys(memory)
    memory.write(TELEMETRY, _COUNTER.pack(0))


class Historical:
    """Frames as Chibis-M had them, without checksum and authentication. Plain state."""

    #: Whether there is something to transmit that is no frame.
    waiting = False

    def __init__(self, dictionary: Dictionary):
        self._stream = Stream(dictionary, "up")

    @property
    def lost_bytes(self) -> int:
        """Bytes received that belong to no frame."""
        return self._stream.lost_bytes

    def receive(self, data: bytes, memory: Memory) -> Iterator[Frame]:
        """Commands that are complete with these bytes."""
        return self._stream.feed(data)

    def silence(self, memory: Memory) -> Iterator[Frame]:
        """Commands behind the beginning of a frame that is not completed any more."""
        return self._stream.finish()

    def take_rejected(self) -> list[Rejected]:
        """Headers of commands that were rejected since the last call."""
        return self._stream.take_rejected()

    def take_refused(self) -> int:
        """Number of frames around commands that were refused since the last call."""
        return 0

    def judge(self, frame: bytes) -> str:
        """Why a frame around commands would not be accepted now; "" if it would."""
        return ""

    def take_events(self) -> list[tuple[Reason, int]]:
        """What there is to be reported of keys since the last call: reason and argument."""
        return []

    def fault(self, packet: str) -> Reason:
        """Why the command that is now received may not come by its key; DONE if it may."""
        return Reason.DONE

    def change_key(self, number: int, memory: Memory) -> Reason:
        """Commands have another key from now on."""
        return Reason.NOT_AVAILABLE

    def judged(self, command: Telecommand, code: Reason) -> bool:
        """What COM has decided on a command; whether the link tells the ground itself."""
        return False

    def wrapped(self, frames: list[bytes], memory: Memory, time_s: int) -> list[bytes]:
        """What is transmitted at a time [s since 2010-01-01] for these frames."""
        return frames


class Protected(Historical):
    """A link whose frames are within others that carry checksum, MAC and counter. Plain state.

    The counters outlive a reboot: those of commands as `CommandKeys` keeps them, that of telemetry
    is stored now and then, ahead of the frames that are sent.
    """

    def __init__(self, dictionary: Dictionary, keys: Keys, memory: Memory):
        self._stream = self._new_stream(dictionary, keys)
        self.keys, self._recovery_spi = CommandKeys(keys, memory), keys.recovery_spi
        self._spi = 0
        kept = memory.read(TELEMETRY)
        valid = kept is not None and len(kept) == _COUNTER.size
        (self._kept,) = _COUNTER.unpack(kept) if kept is not None and valid else (0,)
        self._sender = TelemetrySender(keys.down, keys.spi, keys.spacecraft, self._kept)
        self._refused: Counter[str] = Counter()

    def _new_stream(self, dictionary: Dictionary, keys: Keys):
        """What finds commands in the data of an accepted frame."""
        return Stream(dictionary, "up")

    @property
    def lost_bytes(self) -> int:
        return self.keys.receiver.lost_bytes + self._stream.lost_bytes

    def receive(self, data: bytes, memory: Memory) -> Iterator[Frame]:
        """Commands in frames that are authentic and have not been received before."""
        yield from self._commands(self.keys.take(data, memory))

    def silence(self, memory: Memory) -> Iterator[Frame]:
        yield from self._commands(self.keys.take(b"", memory, ended=True))
        yield from self._stream.finish()

    def _commands(self, accepted: list[tuple[int, bytes]]) -> Iterator[Frame]:
        """Commands in what was accepted."""
        for self._spi, content in accepted:
            yield from self._stream.feed(content)

    def take_refused(self) -> int:
        rejected = self.keys.receiver.rejected
        refused = rejected.total() - self._refused.total()
        self._refused = Counter(rejected)
        return refused

    def judge(self, frame: bytes) -> str:
        return self.keys.receiver.judge(frame)

    def take_events(self) -> list[tuple[Reason, int]]:
        taken, self.keys.events = self.keys.events, []
        return taken

    def fault(self, packet: str) -> Reason:
        """The recovery key allows a change of the other key only, and nothing else does."""
        allowed = (packet == KEY_COMMAND) == (self._spi == self._recovery_spi)
        return Reason.DONE if allowed else Reason.REJECTED

    def change_key(self, number: int, memory: Memory) -> Reason:
        return self.keys.change(number, memory)

    def wrapped(self, frames: list[bytes], memory: Memory, time_s: int) -> list[bytes]:
        """What is transmitted at a time for these frames: whole ones, nothing waits."""
        self._keep_counter(len(frames), memory)
        sent = [self._sender.wrap(frame) for frame in frames]
        return [*sent, self._sender.flush()]

    def _keep_counter(self, count: int, memory: Memory) -> None:
        """Have a counter of telemetry in the memory that lies ahead of this many packets."""
        if self._sender.counter + count * 8 >= self._kept:
            ahead = self._sender.counter + _AHEAD
            if memory.write(TELEMETRY, _COUNTER.pack(ahead)):
                self._kept = ahead


class Pus(Protected):
    """Space packets of PUS-C within the same frames. Plain state; a reboot sets its counts to 0.

    The application process has the number of the spacecraft.
    """

    def _new_stream(self, dictionary: Dictionary, keys: Keys):
        severities = {int(reason): int(reason.severity) for reason in Reason}
        codes = {why: int(reason) for why, reason in REJECTIONS.items()}
        return ApplicationProcess(dictionary, keys.spacecraft, codes, severities)

    @property
    def waiting(self) -> bool:
        """Whether there are reports on requests to transmit."""
        return self._stream.waiting

    def judged(self, command: Telecommand, code: Reason) -> bool:
        """Keep for the reports on requests what COM has decided; those on malformed ones exist."""
        if command.received:
            key = (command.id, command.module, command.time_s, command.request)
            self._stream.judged(command.received, key, code)
        return True

    def wrapped(self, frames: list[bytes], memory: Memory, time_s: int) -> list[bytes]:
        """What is transmitted at a time for these frames, and the reports that wait."""
        packets = self._stream.reports(frames, time_s)
        self._keep_counter(len(packets), memory)
        sent = [self._sender.wrap_packet(packet) for packet in packets]
        return [*sent, self._sender.flush()]


def new_link(kind: str, dictionary: Dictionary, keys: Keys, memory: Memory):
    """The link of a software file."""
    if kind == "historical":
        return Historical(dictionary)
    return {"protected": Protected, "pus": Pus}[kind](dictionary, keys, memory)
