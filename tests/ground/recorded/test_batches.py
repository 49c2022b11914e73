"""Rows of many frames are those of each alone, whatever the packets and the bytes."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from packet_cases import SATELLITE, some_bytes

from torquer.flight.packets.codec import decoder
from torquer.flight.packets.frames import HEADER, HEADER_BYTES, Frame
from torquer.ground.archive import RowMaker
from torquer.ground.recorded import batches
from torquer.ground.recorded.batches import Batches

PACKETS = list(SATELLITE.down.values())
#: It takes longer to make than a row.
ROWS = RowMaker(SATELLITE)


def frames(packet, rng, count):
    """Frames of random bytes, of which some are all zeros, ones, or 'not known'."""
    for number in range(count):
        data = some_bytes(packet, rng)
        if number % 4 == 1:
            data = bytes([int(rng.choice([0, 0x80, 0xFF, 0x7F]))]) * packet.size
        code, time_s = int(rng.integers(3)), int(rng.integers(2**32))
        yield HEADER.pack(0xAABBCCDD, time_s, packet.id, code, 0, packet.size) + data


def alone(packet, raw):
    _, time_s, _, code, _, _ = HEADER.unpack_from(raw)
    frame = Frame(packet, time_s, code, decoder(packet)(raw, HEADER_BYTES), raw)
    row = ROWS.row(frame, None, 2)
    return (*row[1:6], *row.values)


@pytest.mark.parametrize("packet", PACKETS, ids=lambda packet: packet.name)
@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32), count=st.integers(1, 40))
def test_rows_together_are_rows_alone(packet, seed, count):
    raws = list(frames(packet, np.random.default_rng(seed), count))
    made = Batches(SATELLITE)
    for raw in raws:
        assert made.takes(raw)
        made.add(raw, 2)
    assert made.bytes == sum(map(len, raws))
    (batch,) = made.take()
    expected = sorted((alone(packet, raw) for raw in raws), key=lambda row: (row[0], row[4]))
    assert batch.packet == packet.name
    assert list(map(repr, batch.rows)) == list(map(repr, expected))
    assert (made.bytes, list(made.take())) == (0, [])


def test_packets_that_numpy_has_no_type_for_go_through_the_codec(monkeypatch):
    rng = np.random.default_rng(1)
    packet = SATELLITE.down["extended"]
    raws = list(frames(packet, rng, 20))
    found = []
    for types in (batches._TYPES, {}):
        monkeypatch.setattr(batches, "_TYPES", types)
        made = Batches(SATELLITE)
        assert (made._kinds[packet.id]._type is None) == (not types)
        for raw in raws:
            made.add(raw, 1)
        found.append([repr(row) for batch in made.take() for row in batch.rows])
    assert found[0] == found[1]


def test_only_whole_frames_are_taken():
    made, packet = Batches(SATELLITE), SATELLITE.down["beacon"]
    (raw,) = frames(packet, np.random.default_rng(1), 1)
    assert made.takes(raw)
    for wrong in (b"", raw[:-1], raw + b"\0", b"\0" + raw[1:], raw[:9] + b"\7" + raw[10:]):
        assert not made.takes(wrong)
