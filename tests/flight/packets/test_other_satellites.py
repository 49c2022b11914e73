"""Packets of other satellites: both byte orders, any width; the bytes are made by others."""

import ctypes
import math
import struct

import naive_codec
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from packet_strategies import any_fields

from torquer.flight.packets.codec import decoder, encoder
from torquer.flight.packets.dictionary import Field, Packet
from torquer.flight.packets.number_types import TYPES
from torquer.flight.packets.received import field_attributes

many = settings(max_examples=150, deadline=None)


def field(type, name="a", **keys):
    return Field(name=name, type=type, description="x", **keys)


def pad(count, order="big"):
    return Field(name="", type="pad", count=count, byte_order=order, description="padding")


def packet(*fields, **keys):
    return Packet(name="house", id=1, description="d", fields=fields, **keys)


def row(*types, **keys):
    """A packet of numbers called a0, a1, ..."""
    return packet(*(field(t, f"a{k}", **keys) for k, t in enumerate(types)))


def test_big_endian_numbers_are_those_of_struct():
    types = ("i16be", "u8", "u32be", "i64be", "f64be", "f32be", "f16be", "u64be")
    values = (-1234, 200, 4000000000, -(2**63) + 1, 1e-300, 0.5, 1.5, 2**64 - 1)
    data = struct.pack(">hBIqdfeQ", *values)
    assert decoder(row(*types))(data) == values
    assert encoder(row(*types))(values) == data


def test_both_orders_stand_side_by_side_in_a_packet():
    mixed = row("u16be", "u16le", "i24be", "f32le", "f64be")
    values = (0x1234, 0x1234, -5, 0.25, -2.5)
    data = b"\x12\x34\x34\x12" + (-5).to_bytes(3, "big", signed=True)
    data += struct.pack("<f", 0.25) + struct.pack(">d", -2.5)
    assert decoder(mixed)(data) == values and encoder(mixed)(values) == data


@pytest.mark.parametrize("order", ["big", "little"])
@pytest.mark.parametrize("bits", [24, 40, 48, 56, 64])
def test_wide_numbers_are_those_of_python(bits, order):
    for letter, raw in (("i", -(2 ** (bits - 1)) + 1), ("i", 5), ("u", 2**bits - 2)):
        data = b"\x07" + raw.to_bytes(bits // 8, order, signed=letter == "i") + b"\x09"
        packed = row("u8", f"{letter}{bits}", "u8", byte_order=order)
        assert decoder(packed)(data) == (7, raw, 9) and encoder(packed)((7, raw, 9)) == data


@many
@given(raws=st.lists(st.integers(-(2**11), 2**11 - 1), min_size=1, max_size=9))
def test_twelve_bits_follow_each_other_from_the_highest_on(raws):
    text = "".join(format(raw % 2**12, "012b") for raw in raws)
    text += "0" * (-len(text) % 8)
    fields = [field("i12be", f"a{k}") for k in range(len(raws))]
    fields += [pad(4)] * (len(raws) % 2)
    data = int(text, 2).to_bytes(len(text) // 8, "big")
    assert decoder(packet(*fields))(data) == tuple(raws)


WIDTHS = (("a", 3), ("b", 12), ("c", 1), ("d", 7), ("e", 9))


@many
@given(raws=st.tuples(*(st.integers(0, 2**bits - 1) for _, bits in WIDTHS)))
@pytest.mark.parametrize("order", ["big", "little"])
def test_bit_fields_are_those_of_the_c_compiler(order, raws):
    base = ctypes.BigEndianStructure if order == "big" else ctypes.LittleEndianStructure
    keys = {"_fields_": [(name, ctypes.c_uint32, bits) for name, bits in WIDTHS]}
    made = type("Bits", (base,), keys)(*raws)
    packed = packet(*(field(f"u{bits}", name, byte_order=order) for name, bits in WIDTHS))
    assert decoder(packed)(bytes(made)) == raws and encoder(packed)(raws) == bytes(made)


@many
@given(fields=any_fields(), data=st.data())
def test_any_packet_is_read_as_bit_by_bit(fields, data):
    made = packet(*fields)
    raw = data.draw(st.binary(min_size=made.size, max_size=made.size))
    values, naive = decoder(made)(raw), naive_codec.decode(made, raw)
    for (_, each, _), value, other in zip(made.numbers(), values, naive, strict=True):
        if each.polynomial:
            scale = sum(abs(c) * abs(each.kind.low or each.kind.high) ** k
                        for k, c in enumerate(each.polynomial))  # fmt: skip
            assert value == pytest.approx(other, rel=1e-9, abs=1e-12 * scale)
        else:
            assert value == other or (value != value and other != other)
            assert not each.is_whole or isinstance(value, int)
    with pytest.raises(ValueError, match=f"house: must have {made.size} bytes; received"):
        decoder(made)(raw[:-1])


@many
@given(fields=any_fields(), data=st.data())
def test_any_packet_that_is_written_again_is_the_same(fields, data):
    made = packet(*fields)
    raw = data.draw(st.binary(min_size=made.size, max_size=made.size))
    values = decoder(made)(raw)
    kept = decoder(made)(encoder(made)(values))
    for (_, each, _), value, other in zip(made.numbers(), values, kept, strict=True):
        if not each.polynomial:
            exact = each.is_whole or not each.kind.is_whole
            step = 0.0 if exact else abs(each.scale) + 1e-9 * (abs(each.offset) + abs(value))
            assert value == other or value != value or abs(value - other) <= step


@many
@given(fields=any_fields(), data=st.data())
def test_any_numbers_become_what_the_naive_codec_makes_of_them(fields, data):
    made = packet(*(f.model_copy(update={"polynomial": ()}) if f.polynomial else f for f in fields))
    kinds = [each.type for _, each, _ in made.numbers()]
    numbers = st.floats() | st.integers() | st.integers(-(2**70), 2**70)
    values = data.draw(st.tuples(*(st.binary(max_size=5) if k == "bytes" else numbers
                                   for k in kinds)))  # fmt: skip
    assert encoder(made)(values) == naive_codec.encode(made, values)


def test_numbers_of_64_bits_keep_all_their_digits():
    wide = packet(
        field("u64be"), field("i60", "b", offset=-3.0), field("u4", "d"), field("u8", "c")
    )
    greatest = (2**64 - 1, 2**59 - 4, 1, 1)
    for values in (greatest, (2**53 + 1, -(2**59) - 2, 9, 7), (2**63 + 1, 2**53 + 1, 0, 0)):
        assert decoder(wide)(encoder(wide)(values)) == values
    spoilt = (2**64 - 1, np.int64(2**53 + 1), 3, math.nan)
    assert decoder(wide)(encoder(wide)(spoilt)) == (2**64 - 1, 2**53 + 1, 3, 0)
    least = (2**70, -(2**70), -5, 300)
    assert decoder(wide)(encoder(wide)(least)) == (2**64 - 1, -(2**59) - 3, 0, 255)


def test_offset_and_negative_scale_give_the_value():
    made = packet(
        field("u8", "t", scale=0.5, offset=-40), field("i16be", "b", scale=-0.01),
        field("u8", "n", offset=-40),
    )  # fmt: skip
    assert decoder(made)(bytes([90]) + struct.pack(">h", 500) + b"\x00") == (5.0, -5.0, -40)
    assert encoder(made)((5.0, -5.0, np.uint8(3))) == bytes([90]) + struct.pack(">h", 500) + b"\x2b"
    assert encoder(made)((1e9, 1e9, -1e9)) == b"\xff\x80\x00\x00"
    assert made.fields[1].range == (-0.01 * 32767, 0.01 * 32768)
    assert made.fields[2].range == (-40, 215) and made.fields[2].dtype == "i2"


def test_polynomial_gives_the_value_and_finds_the_nearest_raw_number():
    thermistor = field("u8", polynomial=(120.0, -1.5, 0.004))  # turns at 187.5
    made = packet(thermistor)
    assert decoder(made)(b"\x0a") == (120.0 - 15.0 + 0.4,)
    values = [120.0 - 1.5 * raw + 0.004 * raw**2 for raw in range(256)]
    assert thermistor.range == pytest.approx((min(values), max(values)))
    for wanted in (-100.0, -20.6, -20.0, 0.0, 33.3, 119.0, 500.0, math.inf):
        (raw,) = encoder(made)((wanted,))
        target = min(wanted, 1e300)
        assert abs(values[raw] - target) == min(abs(value - target) for value in values)
    wild = packet(field("u64", polynomial=(1e30, -1e30, *[0.0] * 9, 1e-30)))
    for wanted in (-math.inf, -1e300, 0.0, 1e39, 1e300, 10**400):
        assert len(encoder(wild)((wanted,))) == 8
    assert encoder(made)((math.nan,)) == b"\0"


def test_lowest_number_is_a_value_where_the_dictionary_says_so():
    ours, theirs = field("i16"), field("i16", unknown="none")
    assert (ours.unknown_value, theirs.unknown_value) == (-32768, None)
    assert "unknown" in field_attributes(ours) and "unknown" not in field_attributes(theirs)


def test_every_type_is_declared_once_with_its_width():
    assert len(TYPES) == 64 + 63 + 3 + 2
    for name, kind in TYPES.items():
        if kind.is_whole:
            assert int(name[1:]) == kind.bits and kind.high - kind.low == 2**kind.bits - 1
        if kind.code:
            assert struct.calcsize(f"<{kind.code}") * 8 == kind.bits


WRONG = {
    "order": (dict(type="u16be", byte_order="little"), "byte_order: must agree with the type u16"),
    "scale": (dict(type="u8", scale=0), "scale: must not be 0, or nearer to .*; received 0"),
    "offset": (dict(type="f32", offset=1), r"offset: must be 0 for the type f32; received 1\.0"),
    "of float": (dict(type="f32", polynomial=(1, 2, 3)), "polynomial: must be left out for the ty"),
    "both": (dict(type="u8", scale=2, polynomial=(1, 2, 3)), "polynomial: must be given without"),
    "short": (dict(type="u8", polynomial=(1, 2)), "polynomial: must have 3 to 12 coefficients"),
    "last": (dict(type="u8", polynomial=(1, 2, 0)), "the last not 0; received .1.0, 2.0, 0.0."),
    "tiny": (dict(type="u8", polynomial=(1, 2, 1e-40)), "must have 3 to 12 coefficients"),
    "wide": (dict(type="u64", offset=-1), "offset: must leave values within 64 bits; received -1"),
    "infinite": (dict(type="u8", offset=math.inf), "must be finite"),
    "key": (dict(type="u8", labels={"x": "A"}), "must have whole numbers for keys"),
    "key twice": (dict(type="u8", labels={"1": "A", "01": "B"}), "must have the key 1 once"),
    "zero twice": (dict(type="i8", labels={"0": "A", "-0": "B"}), "must have the key 0 once"),
    "label": (dict(type="u4", labels={16: "A"}), "labels: must be of numbers from 0 to 15; .* 16"),
    "same": (dict(type="u4", labels={1: "A", 2: "A"}), "must differ from each other"),
    "nameless": (dict(type="u8", name=""), "name: must be given; received ''"),
    "named": (dict(type="pad"), "name: must be left out for padding; received 'a'"),
    "bytes": (dict(type="bytes", byte_order="big"), "byte_order: must be left out for bytes"),
    "unknown": (dict(type="u8", unknown="none"), "unknown: must be left out for the type u8"),
}  # fmt: skip


@pytest.mark.parametrize(("keys", "message"), WRONG.values(), ids=WRONG)
def test_what_a_field_cannot_be_gets_one_line(keys, message):
    with pytest.raises(ValueError, match=message):
        field(**keys)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ([field("u4be")], r"fill whole bytes, by padding \(type = \"pad\", count = 4\)"),
        (
            [field("u4be"), field("u4", "b")],
            r"must change at a whole byte; received b \(little\) 4",
        ),
        ([field("u4be"), field("bytes", "b"), pad(4)], "bytes must begin at a whole byte; .* b 4"),
        ([field("u4be"), pad(4, "little")], r"received padding \(little\) 4 bits"),
        ([field("bytes", count=65535), pad(8)], "must have 1 to 65535 bytes; received 65536"),
    ],
)
def test_what_makes_no_packet_gets_one_line(fields, message):
    with pytest.raises(ValueError, match=message):
        packet(*fields)
