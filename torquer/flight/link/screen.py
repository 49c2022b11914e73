"""What a link hands on of what a client sends: whole frames, those of each client by themselves.

A screen is the part of a receiver in front of the satellite. It has the bytes of one client only,
so that nobody's bytes come between those of another, and knows when the frame began that is not
complete yet. Frames that the satellite would accept are proven; noise ends here; of the rest, made
with another key or received before, so much is handed on that the satellite can report it.
"""

from collections.abc import Callable, Iterable
from typing import Protocol

from torquer.flight.packets.dictionary import Dictionary
from torquer.flight.packets.frames import Stream
from torquer.flight.packets.protected import CommandReceiver
from torquer.flight.packets.software_file import SpaceLink

#: Time from the beginning of a frame after which its end is no longer waited for [s].
FRAME_S = 2.0
#: Most bytes handed on by one call of `receive`, which is what the satellite's receiver holds, and
#: most of frames that are not proven.
AT_ONCE, UNPROVEN = 8192, 1024
#: Why no frame begins at a mark: such bytes are noise.
_NOISE = ("checksum", "spacecraft")
#: Frames with their marks, and whether the satellite would accept them.
Found = list[tuple[bytes, bool]]


class Screen(Protocol):
    """What has come of one client, and is not complete yet."""

    def pass_on(self, data: bytes, now_s: float) -> Found:
        """The frames that are complete with these bytes, at a time of any clock [s]."""
        ...


NewScreen = Callable[[], Screen]


class Unscreened:
    """Bytes as they come."""

    def pass_on(self, data: bytes, now_s: float) -> Found:
        """The bytes."""
        return [(data, False)] if data else []


class _Begun:
    """Since when a frame waits for its end."""

    def __init__(self) -> None:
        self._fed, self._place, self._since_s = 0, -1, 0.0

    def is_late(self, fed: int, waiting: int, now_s: float) -> bool:
        """Whether what waits began too long ago; `fed`: bytes that have come now."""
        self._fed += fed
        place = self._fed - waiting if waiting else -1
        if place != self._place:
            self._place, self._since_s = place, now_s
        return waiting > 0 and now_s - self._since_s > FRAME_S


class ProtectedScreen(CommandReceiver):
    """Protected frames; `judge`: why the satellite would not accept one, "" if it would."""

    def __init__(self, spacecraft: int, judge: Callable[[bytes], str]):
        super().__init__({}, spacecraft)
        self._ask = judge
        self._found: Found = []
        self._begun = _Begun()

    def pass_on(self, data: bytes, now_s: float) -> Found:
        """Whole frames, but for noise."""
        self.take(data)
        while self._begun.is_late(len(data), len(self._buffer), now_s):
            data = b""
            del self._buffer[: len(self.mark)]  # a genuine frame may follow it
            self.take(b"")
        found, self._found = self._found, []
        return found

    def _judge(self, frame: bytes) -> str:
        reason = self.doubt(frame)
        if reason not in _NOISE:
            reason = self._ask(frame)
            self._found.append((self.mark + frame, not reason))
        return reason


class HistoricalScreen:
    """Frames of Chibis-M, which nothing proves: whoever sends a whole one counts as genuine."""

    def __init__(self, dictionary: Dictionary):
        self._dictionary, self._stream = dictionary, Stream(dictionary, "up")
        self._bytes, self._begun = bytearray(), _Begun()

    def pass_on(self, data: bytes, now_s: float) -> Found:
        """Whole frames, and rejected ones with what is around them."""
        stream = self._stream
        self._bytes += data
        has_frames = bool(list(stream.feed(data)))
        done = len(self._bytes) - stream.waiting_bytes
        run, self._bytes = bytes(self._bytes[:done]), self._bytes[done:]
        is_of_use = has_frames or bool(stream.take_rejected())
        if self._begun.is_late(len(data), len(self._bytes), now_s):
            self._stream, self._begun = Stream(self._dictionary, "up"), _Begun()
            self._bytes.clear()
        return [(run, has_frames)] if run and is_of_use else []


def screens_of(link: SpaceLink, judge: Callable[[bytes], str]) -> NewScreen:
    """Maker of screens for a satellite with this link; `judge`: of its receiver on board."""
    if link.link == "historical":
        return lambda: HistoricalScreen(link.dictionary)
    return lambda: ProtectedScreen(link.keys.spacecraft, judge)


def choose(found: Iterable[tuple[bytes, bool]]) -> bytes:
    """What is handed on of the frames of all clients: proven ones first, whole frames only."""
    chosen, rooms = bytearray(), {True: AT_ONCE, False: UNPROVEN}
    for frame, is_proven in sorted(found, key=lambda each: not each[1]):
        room = min(AT_ONCE - len(chosen), rooms[is_proven])
        if len(frame) <= room:
            rooms[is_proven] -= len(frame)
            chosen += frame
    return bytes(chosen)
