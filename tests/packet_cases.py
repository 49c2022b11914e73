"""Packets for tests: Chibis-M's, and one with every type that they do not use."""

import numpy as np

from torquer.flight.packets.dictionary import Dictionary, Field, Packet, load_dictionary

CHIBIS = load_dictionary("chibis_m")
#: i8, scales above one, counts other than three, bytes that begin within a segment.
ODD = Packet(
    name="odd",
    id=200,
    description="every type that Chibis-M does not use",
    fields=(
        Field(name="small", type="i8", count=2, scale=0.5, description="i8"),
        Field(name="text", type="bytes", count=11, description="bytes between numbers"),
        Field(name="wide", type="u32", scale=1e3, limits=(0, 1e12), description="a large scale"),
        Field(name="word", type="u16", count=7, limits=(1, 9), description="seven of them"),
        Field(name="signed", type="i32", scale=1e-9, description="a small scale"),
        Field(name="half", type="f32", count=3, description="f32"),
        Field(name="kind", type="u16", labels=("A", "B C"), description="a long enumeration"),
        Field(name="parts", type="u8", bits=("lamp", "a b"), description="bits, some named"),
        Field(name="time", type="f64", description="f64"),
    ),
)
SATELLITE = Dictionary(
    name="A satellite/1",
    modules=CHIBIS.modules,
    down={**CHIBIS.down, "odd": ODD},
    up={**CHIBIS.up, "odd": ODD.model_copy(update={"module": "adc"})},
)
PACKETS = {
    f"{direction}_{packet.name}": packet
    for direction in ("down", "up")
    for packet in getattr(SATELLITE, direction).values()
}


def some_bytes(packet, rng):
    """Data of a packet: any raw numbers, labels that there are, no NaN."""
    data = bytearray(rng.bytes(packet.size))
    for _, field, at in packet.numbers():
        size = field.size // len(field.names)
        if field.labels:
            number = int(rng.integers(len(field.labels)))
            data[at : at + size] = number.to_bytes(size, "little")
        if field.type[0] == "f":
            number = rng.normal() * 10.0 ** rng.integers(-5, 5)
            data[at : at + size] = np.array(number, f"<f{size}").tobytes()
    if packet.name == "plan_cancel":  # of a telecommand, whose number begins and goes on like this
        number = 0x1800C000 | int.from_bytes(data[1:], "little") & 0x07FF3FFF
        data[1:] = number.to_bytes(4, "little")
    return bytes(data)
