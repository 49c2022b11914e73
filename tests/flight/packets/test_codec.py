"""The generated codec against the naive one, and what happens to values that do not fit."""

import math

import naive_codec
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from packet_cases import CHIBIS, ODD, PACKETS

from torquer.flight.packets.codec import decoder, encoder

EXTENDED = CHIBIS.down["extended"]
every_packet = pytest.mark.parametrize("packet", PACKETS.values(), ids=PACKETS)
few = settings(max_examples=40, deadline=None)
extremes = st.integers(-2, 2).map(lambda x: x * 10**310 if x % 2 else x * 1e307)
numbers = st.one_of(st.floats(), st.floats(width=32), st.integers(), st.booleans(), extremes)


def is_same(a, b):
    return a == b or (a != a and b != b)


def values_of(packet, of_numbers):
    kinds = (field.type for _, field, _ in packet.numbers())
    return st.tuples(*(st.binary(max_size=80) if k == "bytes" else of_numbers for k in kinds))


@pytest.mark.verifies("REQ-PKT-002")
@every_packet
@few
@given(data=st.data())
def test_all_raw_numbers_make_the_round_trip(packet, data):
    raw = data.draw(st.binary(min_size=packet.size, max_size=packet.size))
    values = decoder(packet)(raw)
    assert all(map(is_same, values, naive_codec.decode(packet, raw)))
    again = encoder(packet)(values)
    assert all(map(is_same, decoder(packet)(again), values))
    if all(value == value for value in values if not isinstance(value, bytes)):
        assert again == raw  # a NaN may come back with other bits


@pytest.mark.verifies("REQ-PKT-002")
@every_packet
@few
@given(data=st.data())
def test_any_values_become_what_the_naive_codec_makes_of_them(packet, data):
    values = data.draw(values_of(packet, numbers))
    assert encoder(packet)(values) == naive_codec.encode(packet, values)


@few
@given(values=values_of(EXTENDED, st.floats(-1e-3, 1e-3)))
def test_values_in_range_are_kept_to_half_a_step(values):
    kept = decoder(EXTENDED)(encoder(EXTENDED)(values))
    for (name, field, _), value, found in zip(EXTENDED.numbers(), values, kept, strict=True):
        unit = field.scale if field.type != "f64" else 0.0
        low = 0.0 if field.type[0] == "u" else -math.inf
        assert abs(found - max(value, low)) <= 0.5 * unit * (1 + 1e-9), name


def test_unfitting_value_becomes_nearest_number_and_nan_the_least():
    def sent(number):
        values = [0.0] * len(EXTENDED.names)
        place = EXTENDED.names.index("b_x")
        values[place] = number
        return decoder(EXTENDED)(encoder(EXTENDED)(values))[place]

    assert [sent(x) for x in (1e9, math.inf, 10**400)] == [65534.0] * 3
    assert [sent(x) for x in (-1e9, -math.inf, math.nan)] == [-65536.0] * 3
    assert [sent(x) for x in (2.9, 3.1, np.float32(-2.9), np.int64(7))] == [2.0, 4.0, -2.0, 8.0]


def test_large_numbers_stay_finite_in_32_bits():
    place = ODD.names.index("half_y")
    values = [b"" if name == "text" else 0 for name in ODD.names]
    greatest = float(np.finfo(np.float32).max)
    for sent, kept in ((1e39, greatest), (-1e300, -greatest), (-(10**400), -greatest)):
        values[place] = sent
        assert decoder(ODD)(encoder(ODD)(values))[place] == kept
    values[place] = -math.inf
    assert decoder(ODD)(encoder(ODD)(values))[place] == -math.inf


def test_bytes_are_filled_with_zeros_or_cut():
    dump = CHIBIS.down["dump"]
    assert decoder(dump)(encoder(dump)((1, 2, 3, b"abc")))[3] == b"abc" + bytes(61)
    assert decoder(dump)(encoder(dump)((1, 2, 3, memoryview(b"x" * 99))))[3] == b"x" * 64


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ((1, 2), "dump: must have 4 values; received 2"),
        ((1, 2, "3", b""), "dump.length: must be a number; received '3'"),
        ((1, 2, None, b""), "dump.length: must be a number; received None"),
        ((1, 2, 3, 4), "dump.data: must be bytes; received 4"),
    ],
)
def test_what_is_no_number_is_a_mistake_of_the_caller(values, message):
    with pytest.raises(ValueError) as error:
        encoder(CHIBIS.down["dump"])(values)
    assert str(error.value) == message


def test_data_that_end_too_early_are_a_mistake():
    with pytest.raises(ValueError, match="beacon: must have 8 bytes; received 7"):
        decoder(CHIBIS.down["beacon"])(bytes(10), 3)
