"""Packing of numbers that `struct` has no letters for: any width, any place, either byte order.

The data of a packet are one big-endian number, in which a big-endian value lies so many bits from
the top, and one little-endian number, in which a little-endian value lies so many from the bottom.
"""

import struct
from collections.abc import Callable, Iterator

from torquer.flight.packets.dictionary import Packet, Place

_UNPACK = """
def unpack_from(data, at=0):
    part = bytes(data[at : at + {size}])
    if len(part) != {size}:
        raise Short
    big, little = from_bytes(part, "big"), from_bytes(part, "little")
    return ({values},)
"""


class BitLayout:
    """Packs raw numbers, and unpacks them, as a `struct.Struct` does; `size`: in bytes."""

    def __init__(self, packet: Packet):
        self.size, self._places = packet.size, packet.places
        self.unpack_from = _unpacker(packet)

    def pack(self, *raws) -> bytes:
        """The data of raw numbers; `struct.error` for one out of range."""
        if len(raws) != len(self._places):
            raise struct.error(f"{len(self._places)} numbers; received {len(raws)}")
        words = {"big": 0, "little": 0}
        for place, raw in zip(self._places, raws, strict=True):
            is_big = _is_big(place)
            shift = 8 * self.size - place.bit - place.bits if is_big else place.bit
            words["big" if is_big else "little"] |= _bits_of(place, raw) << shift
        little = words["little"].to_bytes(self.size, "little")
        return (words["big"] | int.from_bytes(little, "big")).to_bytes(self.size, "big")


def _is_big(place: Place) -> bool:
    return place.field.byte_order == "big" or place.field.type == "bytes"


def _bits_of(place: Place, raw) -> int:
    """A raw number as a number without sign."""
    kind = place.field.kind
    if kind.letter == "s":
        return int.from_bytes(struct.pack(f"{place.bits // 8}s", raw), "big")
    if kind.letter == "f":
        return int.from_bytes(struct.pack(f">{kind.code}", raw), "big")
    whole = raw.__index__()
    if not kind.low <= whole <= kind.high:
        raise struct.error(f"{place.name}: out of range")
    return whole & (1 << place.bits) - 1


def _unpacker(packet: Packet) -> Callable[..., tuple]:
    """The function (data, at=0) -> raw numbers: source text, compiled once."""
    values = ", ".join(_values(packet)) or "()"
    source = _UNPACK.format(size=packet.size, values=values)
    space: dict = {"from_bytes": int.from_bytes, "Short": struct.error}
    space |= {f"f{bits}": _float_of(bits, code) for bits, code in ((16, "e"), (32, "f"), (64, "d"))}
    exec(compile(source, f"<unpack {packet.name}>", "exec"), space)
    return space["unpack_from"]


def _float_of(bits: int, code: str) -> Callable[[int], float]:
    unpack = struct.Struct(f">{code}").unpack
    return lambda word: unpack(word.to_bytes(bits // 8, "big"))[0]


def _values(packet: Packet) -> Iterator[str]:
    """The expression of each raw number."""
    for place in packet.places:
        kind, begin = place.field.kind, place.bit // 8
        if kind.letter == "s":
            yield f"part[{begin}:{place.end}]"
            continue
        big = place.field.byte_order == "big"
        shift = 8 * packet.size - place.bit - place.bits if big else place.bit
        word = f"({'big' if big else 'little'} >> {shift} & {(1 << place.bits) - 1})"
        if kind.letter == "f":
            yield f"f{place.bits}{word}"
        elif kind.letter == "i":
            yield f"({word} ^ {1 << place.bits - 1}) - {1 << place.bits - 1}"
        else:
            yield word
