"""Frames damaged and forged in all ways, for tests of protected frames.

The attacker sees all frames, also those that have not arrived yet, knows the CRC, and does not know
the key.
"""

import random
import struct
from binascii import crc_hqx

from torquer.flight.packets.protected import CommandReceiver, CommandSender

KEY, SPI, SPACECRAFT = bytes(range(32)), 7, 0x15A
MARK = b"\xeb\x90"
#: Places in a frame with its mark: SPI, counter, data.
_SPI, _COUNTER, _DATA = 7, 9, 13


def refit(frame: bytearray) -> bytes:
    """The frame with the CRC that it should have."""
    struct.pack_into(">H", frame, len(frame) - 2, crc_hqx(bytes(frame[2:-2]), 0xFFFF))
    return bytes(frame)


def flipped(rng, frame, _):
    """One bit."""
    frame[rng.randrange(len(frame))] ^= 1 << rng.randrange(8)
    return bytes(frame)


def noise(rng, frame, _):
    """Noise, of which half begins as a frame does."""
    return frame[: rng.choice((0, 7))] + rng.randbytes(rng.randrange(80))


def cut(rng, frame, _):
    """The begin or the end of a frame."""
    at = rng.randrange(len(frame))
    return bytes(frame[:at] if rng.random() < 0.5 else frame[at:])


def changed(rng, frame, _):
    """A byte behind the mark, with a CRC that fits."""
    frame[rng.randrange(2, len(frame) - 2)] ^= 1 + rng.randrange(255)
    return refit(frame)


def counted(rng, frame, _):
    """Another counter, with a CRC that fits."""
    struct.pack_into(">I", frame, _COUNTER, rng.randrange(1 << rng.choice((8, 32))))
    return refit(frame)


def addressed(rng, frame, _):
    """Another SPI, with a CRC that fits."""
    struct.pack_into(">H", frame, _SPI, rng.randrange(1 << 16))
    return refit(frame)


def forged(rng, frame, _):
    """A whole frame by another key, of a counter that is due."""
    number = struct.unpack_from(">I", frame, _COUNTER)[0]
    sender = CommandSender(rng.randbytes(32), SPI, SPACECRAFT, number - 1)
    return sender.wrap(command(rng, number))


def replayed(rng, frame, seen):
    """A frame that was accepted."""
    return rng.choice(seen) if seen else b""


def doubled(rng, frame, _):
    """A damaged frame, and the same again."""
    return 2 * flipped(rng, frame, _)


def spliced(rng, frame, seen):
    """The begin of one frame and the end of another, with a CRC that fits."""
    other = rng.choice(seen) if seen else frame
    at = rng.randrange(2, min(len(frame), len(other)) - 2)
    return refit(frame[:at] + other[at:])


def stretched(rng, frame, _):
    """Bytes more or less, with a length and a CRC that fit."""
    frame[_DATA:_DATA] = rng.randbytes(rng.randrange(1, 20))
    struct.pack_into(">H", frame, 4, len(frame) - 3)
    return refit(frame)


MUTATIONS = (
    *(flipped, noise, cut, changed, counted, addressed, forged),
    *(replayed, doubled, spliced, stretched),
)


def command(rng, number: int) -> bytes:
    """Data that no other frame has; some have a mark in them."""
    return struct.pack(">I", number) + rng.choice((b"", MARK)) + rng.randbytes(rng.randrange(24))


class Watched:
    """A receiver of which all that it accepts must be what the sender sent."""

    def __init__(self):
        self.receiver = CommandReceiver({SPI: KEY, SPI + 1: bytes(32)}, SPACECRAFT)
        self.sent: dict[bytes, bytes] = {}
        self.relayed = 0
        self._line = b""

    def take(self, fed: bytes) -> None:
        """Feed bytes, b"" for a silent line.

        AssertionError for data accepted that were not sent, for a frame that was not on the line,
        and for a counter that moved otherwise. (By chance an attacker relays a genuine frame.)
        """
        before = dict(self.receiver.counters)
        self._line = (self._line + fed)[-2500:]
        for data in self.receiver.feed(fed) if fed else self.receiver.flush():
            assert self.sent[data] in self._line, fed.hex()
            assert struct.unpack_from(">I", data)[0] > before[SPI]
            before[SPI] = struct.unpack_from(">I", data)[0]
            self.relayed += 1
        assert self.receiver.counters == before, fed.hex()


def attack(total: int, seed: int, by_mutation: int = 500) -> Watched:
    """Feed mutated frames; genuine ones in between must be accepted. The receiver thereafter."""
    rng = random.Random(seed)
    sender, watched = CommandSender(KEY, SPI, SPACECRAFT), Watched()
    seen: list[bytes] = []
    while total > 0:
        datas = [command(rng, sender.counter + number) for number in range(1, 9)]
        frames = [sender.wrap(data) for data in datas]
        watched.sent |= zip(datas, frames, strict=True)
        for _ in range(min(total, by_mutation)):
            mutate = rng.choice(MUTATIONS)
            watched.take(mutate(rng, bytearray(rng.choice(frames)), seen))
            if rng.random() < 0.3:
                watched.take(b"")
        total -= by_mutation
        watched.take(rng.randbytes(rng.randrange(60)))
        watched.take(b"")  # what is incomplete is given up when the line has been silent
        genuine = command(rng, sender.counter + 1)
        assert watched.receiver.feed(sender.wrap(genuine)) == [genuine]
        assert watched.receiver.counters == {SPI: sender.counter, SPI + 1: 0}
        seen = [*seen[-50:], *frames]
        watched.sent = dict(zip(datas, frames, strict=True))
    return watched
