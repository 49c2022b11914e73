"""The link: what COM does with bytes of the uplink and with frames of the downlink."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

from torquer.onboard.memory import Memory
from torquer.packets.dictionary import Dictionary
from torquer.packets.frames import Frame, Rejected, Stream
from torquer.packets.protected import CommandReceiver, TelemetrySender

#: Files of the non-volatile memory: last accepted counters of commands; a counter of telemetry
#: that lies ahead.
COMMANDS, TELEMETRY = "counters.up", "counter.down"
#: How far ahead of the frames sent the stored counter of telemetry lies.
_AHEAD = 10000
_COUNTER = struct.Struct("<I")
#: Keys where a software file names none. Everybody knows them: they are for simulations only.
DEMONSTRATION_UP, DEMONSTRATION_DOWN = bytes(range(32)), bytes(range(32, 64))


class Keys(NamedTuple):
    """Keys of a protected link, their index and the number of the spacecraft."""

    up: bytes = DEMONSTRATION_UP
    down: bytes = DEMONSTRATION_DOWN
    spi: int = 1
    spacecraft: int = 77


class Historical:
    """Frames as Chibis-M had them, without checksum and authentication. Plain state."""

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

    def wrapped(self, frames: list[bytes], memory: Memory) -> list[bytes]:
        """What is transmitted for these frames."""
        return frames


class Protected:
    """The same within frames with checksum, MAC and counter. Plain state.

    The counters outlive a reboot: those of commands are stored before a command is executed, that
    of telemetry now and then, ahead of the frames that are sent.
    """

    def __init__(self, dictionary: Dictionary, keys: Keys, memory: Memory):
        self._stream = Stream(dictionary, "up")
        self._receiver = CommandReceiver({keys.spi: keys.up}, keys.spacecraft, window=10000)
        names = memory.names()
        if COMMANDS in names:
            self._receiver.restore(memory.read(COMMANDS))
        else:
            memory.write(COMMANDS, self._receiver.save())
        kept = memory.read(TELEMETRY) if TELEMETRY in names else None
        valid = kept is not None and len(kept) == _COUNTER.size
        (self._kept,) = _COUNTER.unpack(kept) if kept is not None and valid else (0,)
        self._sender = TelemetrySender(keys.down, keys.spi, keys.spacecraft, self._kept)
        self._refused: Counter[str] = Counter()

    @property
    def lost_bytes(self) -> int:
        """Bytes received that belong to no frame."""
        return self._receiver.lost_bytes + self._stream.lost_bytes

    def receive(self, data: bytes, memory: Memory) -> Iterator[Frame]:
        """Commands in frames that are authentic and have not been received before."""
        yield from self._commands(self._receiver.feed(data), memory)

    def silence(self, memory: Memory) -> Iterator[Frame]:
        """Commands behind the beginning of a frame that is not completed any more."""
        yield from self._commands(self._receiver.flush(), memory)
        yield from self._stream.finish()

    def _commands(self, accepted: list[bytes], memory: Memory) -> Iterator[Frame]:
        """Commands in what was accepted, once the counter is stored."""
        if accepted:
            memory.write(COMMANDS, self._receiver.save())
        for each in accepted:
            yield from self._stream.feed(each)

    def take_rejected(self) -> list[Rejected]:
        """Headers of commands that were rejected since the last call."""
        return self._stream.take_rejected()

    def take_refused(self) -> int:
        """Number of frames around commands that were refused since the last call."""
        refused = self._receiver.rejected.total() - self._refused.total()
        self._refused = Counter(self._receiver.rejected)
        return refused

    def wrapped(self, frames: list[bytes], memory: Memory) -> list[bytes]:
        """What is transmitted for these frames: whole ones, nothing waits."""
        if self._sender.counter + len(frames) * 8 >= self._kept:
            self._kept = self._sender.counter + _AHEAD
            memory.write(TELEMETRY, _COUNTER.pack(self._kept))
        sent = [self._sender.wrap(frame) for frame in frames]
        return [*sent, self._sender.flush()]


def new_link(kind: str, dictionary: Dictionary, keys: Keys, memory: Memory):
    """The link of a software file."""
    return Historical(dictionary) if kind == "historical" else Protected(dictionary, keys, memory)
