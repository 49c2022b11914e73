"""What protected frames of both directions have in common: MAC, counter against replay, CRC.

A frame is header, SPI (u16: which key), counter (u32), data, MAC (16 bytes), CRC (u16), big-endian,
as in CCSDS 355.0-B (space data link security, authentication only). The MAC is HMAC-SHA-256 (RFC
2104) of everything before it, its first half; the CRC, CCITT with initial value 0xFFFF, covers
everything before it. Data are authenticated, not encrypted. Each direction must have keys of its
own: otherwise a frame could be sent back to its sender.

A receiver accepts a counter that is greater than the last one, by at most a window. A bitmap that
lets frames overtake each other would be no use: commands must not be executed out of order, and one
number for each key is what a memory can keep through a reboot. A frame cannot leap beyond the
window, so that one mistake of a sender does not use up the counter.
"""

import hashlib
import struct
from binascii import crc_hqx
from collections import Counter
from collections.abc import Mapping
from functools import lru_cache
from hmac import compare_digest

KEY_BYTES = 32
MAC_BYTES = 16
SECURITY = struct.Struct(">HI")
_CRC = struct.Struct(">H")
#: Bytes after the data, and what a frame adds to its header and data.
TRAILER = MAC_BYTES + _CRC.size
OVERHEAD = SECURITY.size + TRAILER
#: The last counter: a key that has used it, or whose counter is not known, accepts nothing more.
USED_UP = 2**32 - 1


def begun_mark(data: bytes | bytearray, mark: bytes) -> int:
    """Bytes at the end of the data with which a mark may begin."""
    end = bytes(data[1 - len(mark) :])
    return next((n for n in range(len(end), 0, -1) if mark.startswith(end[-n:])), 0)


def crc16(data: bytes) -> int:
    """CRC-16/CCITT with initial value 0xFFFF: frame error control of CCSDS."""
    return crc_hqx(data, 0xFFFF)


@lru_cache(maxsize=64)
def _begin_hashes(key: bytes):
    """Hashes after the inner and the outer key of HMAC, kept because they take half of its time."""
    padded = key.ljust(64, b"\0")
    return tuple(hashlib.sha256(bytes(byte ^ pad for byte in padded)) for pad in (0x36, 0x5C))


def mac(key: bytes, data: bytes) -> bytes:
    """The first 16 bytes of HMAC-SHA-256; a key of at most 64 bytes."""
    begun_inner, begun_outer = _begin_hashes(key)
    inner, outer = begun_inner.copy(), begun_outer.copy()
    inner.update(data)
    outer.update(inner.digest())
    return outer.digest()[:MAC_BYTES]


def close_frame(key: bytes, body: bytes) -> bytes:
    """A frame: header, SPI, counter and data with their MAC and CRC."""
    body += mac(key, body)
    return body + _CRC.pack(crc_hqx(body, 0xFFFF))


def check_link(keys: Mapping[int, bytes], spacecraft: int) -> None:
    """ValueError for numbers that do not fit their fields, and for a key of another size."""
    if not 0 <= spacecraft <= 1023:
        raise ValueError(f"spacecraft: must be from 0 to 1023; received {spacecraft}")
    for spi, key in keys.items():
        if not 1 <= spi <= 65534:
            raise ValueError(f"spi: must be from 1 to 65534; received {spi}")
        if len(key) != KEY_BYTES:
            raise ValueError(f"key: must have {KEY_BYTES} bytes; received {len(key)}")


def next_number(counter: int) -> int:
    """The counter of the next frame; ValueError when the last has been used."""
    if not 0 <= counter < USED_UP:
        raise ValueError(
            f"counter: must be from 0 to {USED_UP - 1}, else a new key; received {counter}"
        )
    return counter + 1


#: Why an authentic frame is rejected.
_COUNTED = ("replayed", "repeated", "leap", "closed")


class Receiver:
    """Extracts frames from bytes and accepts or rejects them; plain state that can be copied.

    Checked in this order: length, CRC, spacecraft, SPI, MAC, counter; the counter moves only when
    all hold. `counters`: last accepted counter by SPI. `rejected`: number of marks after which
    there was no frame to accept, by reason (`length`, `checksum`, `spacecraft`, `spi`, `mac`,
    `replayed`, `leap`, `closed`). `lost_bytes`: bytes that belong to no authentic frame.
    """

    mark: bytes
    #: Bytes of the frame's header, to which the security header is next.
    header: int

    def __init__(
        self,
        keys: Mapping[int, bytes],
        identity: int,
        window: int,
        counters: Mapping[int, int] | None = None,
    ):
        """`identity`: first two bytes of a frame. Counters that are not given start at 0."""
        if window < 1:
            raise ValueError(f"window: must be at least 1; received {window}")
        self.keys = dict(keys)
        self.window = window
        self.counters = {spi: (counters or {}).get(spi, 0) for spi in keys}
        self.rejected: Counter[str] = Counter()
        self.lost_bytes = 0
        self._identity = identity.to_bytes(2, "big")
        self._buffer = bytearray()

    def feed(self, data: bytes) -> list[bytes]:
        """What has become complete with these bytes and is accepted, oldest first."""
        return self.contents(self.take(data))

    def flush(self) -> list[bytes]:
        """As `feed`, after a silence of the link or at the end of the stream: a frame that is
        incomplete now stays incomplete.

        Otherwise the mark of a frame whose end was lost would hold back what follows it, up to the
        length that a frame may have.
        """
        return self.contents(self.take(b"", ended=True))

    def take(self, data: bytes, ended: bool = False) -> list[bytes]:
        """The accepted frames themselves, without marks; `ended`: no bytes follow."""
        self._buffer += data
        return self.frames(ended)

    def index_of(self, frame: bytes) -> int:
        """The SPI of a frame."""
        return SECURITY.unpack_from(frame, self.header)[0]

    def contents(self, frames: list[bytes]) -> list[bytes]:
        """What accepted frames carry."""
        raise NotImplementedError

    def size_at(self, at: int) -> int:
        """Bytes of the frame that begins there; 0 if not yet known, -1 if there cannot be one."""
        raise NotImplementedError

    def frames(self, ended: bool) -> list[bytes]:
        """Accepted frames in the bytes received; `ended`: no bytes follow."""
        buffer, mark, at, accepted = self._buffer, self.mark, 0, []
        while (found := buffer.find(mark, at)) >= 0:
            self.lost_bytes += found - at
            at = found + len(mark)
            size = self.size_at(at)
            frame = bytes(buffer[at : at + size]) if size > 0 else b""
            if len(frame) == size > 0:
                reason = self._judge(frame)
            elif size < 0 or ended:
                reason = "length"
            else:
                at = found
                break
            if reason:
                self.rejected[reason] += 1
            else:
                accepted.append(frame)
            # only the MAC proves where a frame ends: otherwise a genuine one may follow the mark
            authentic = reason in ("", *_COUNTED)
            at += size if authentic else 0
            self.lost_bytes += 0 if authentic else len(mark)
        else:
            kept = 0 if ended else begun_mark(buffer[max(at, len(buffer) - len(mark)) :], mark)
            self.lost_bytes += len(buffer) - kept - at
            at = len(buffer) - kept
        del buffer[:at]
        return accepted

    def doubt(self, frame: bytes) -> str:
        """Why a frame of the right length is not authentic; "" if it is, whatever its counter."""
        if crc_hqx(frame, 0xFFFF):
            return "checksum"
        if frame[:2] != self._identity:
            return "spacecraft"
        (spi, _) = SECURITY.unpack_from(frame, self.header)
        key = self.keys.get(spi)
        if key is None:
            return "spi"
        if not compare_digest(mac(key, frame[:-TRAILER]), frame[-TRAILER:-2]):
            return "mac"
        return ""

    def judge(self, frame: bytes) -> str:
        """Why a frame of the right length is not accepted now; "" if it is. Nothing moves."""
        if reason := self.doubt(frame):
            return reason
        spi, number = SECURITY.unpack_from(frame, self.header)
        last = self.counters[spi]
        if last == USED_UP:
            return "closed"
        if number <= last:
            return "replayed"
        return "leap" if number - last > self.window else ""

    def _judge(self, frame: bytes) -> str:
        """As `judge`, and the counter of a frame that is accepted moves."""
        reason = self.judge(frame)
        if not reason:
            spi, number = SECURITY.unpack_from(frame, self.header)
            self.counters[spi] = number
        return reason
