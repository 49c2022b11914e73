"""Passes with Doppler and data volume: what one pass leaves on board waits for the next one."""

import json

import pytest
from station_skies import HOUR_MS, START_MS, TARUSA, chibis

from torquer.base.strict_json import json_text
from torquer.flight.packets.software_file import load_link
from torquer.ground.backlog import DownlinkTable, air_bytes, packet_bytes
from torquer.ground.file import SatelliteTable
from torquer.ground.passes import CURVE, doppler, find_passes
from torquer.ground.schedule import Radio, radio_of, schedule

LINK = load_link({"link": "historical"})


@pytest.fixture(scope="module")
def passes():
    return find_passes(chibis(), {"t": TARUSA}, START_MS, START_MS + 24 * HOUR_MS)


def test_a_row_has_what_the_pass_has(passes):
    rows = schedule(passes, START_MS, Radio(437.5e6))
    assert json.loads(json_text(rows)) == rows
    for each, row in zip(passes, rows, strict=True):
        assert row["aos"]["time_ms"] == each.aos.time_ms and row["station"] == "t"
        assert (row["aos"]["doppler_hz"], row["aos"]["doppler_rate_hz_s"]) == doppler(
            each.aos, 437.5e6
        )
        assert len(row["curve"]) == CURVE and row["downlink"] is None
        time_ms, azimuth, elevation, range_km, shift, sunlit = row["curve"][30]
        point = each.curve[30]
        assert (time_ms, sunlit) == (point.time_ms, point.sunlit)
        assert azimuth == pytest.approx(point.azimuth_deg, abs=1e-3)
        assert elevation == pytest.approx(point.elevation_deg, abs=1e-3)
        assert range_km == pytest.approx(point.range_km, abs=1e-2)
        assert shift == pytest.approx(doppler(point, 437.5e6)[0], abs=0.1)


def test_without_a_frequency_there_is_no_doppler(passes):
    row = schedule(passes, START_MS, Radio())[0]
    assert row["aos"]["doppler_hz"] is None and row["curve"][0][4] is None


def test_time_since_the_last_pass(passes):
    rows = schedule(passes, START_MS, Radio())
    assert rows[0]["since_s"] == pytest.approx((passes[0].aos.time_ms - START_MS) / 1e3)
    for before, each, row in zip(passes, passes[1:], rows[1:], strict=False):
        assert row["since_s"] == pytest.approx((each.aos.time_ms - before.los.time_ms) / 1e3)
    # a station that sees it while another does finds nothing that has gathered meanwhile
    twice = schedule([passes[0], passes[0]], START_MS, Radio())
    assert twice[1]["since_s"] == 0.0


def test_bytes_without_packets_are_those_of_the_rate(passes):
    for each, row in zip(passes, schedule(passes, START_MS, Radio(None, 9600.0)), strict=True):
        assert row["downlink"] == {"bit_s": 9600.0, "bytes": int(1200.0 * each.duration_s)}


def test_what_stays_on_board_waits_for_the_next_pass(passes):
    """A satellite that keeps a packet each second, and a slow link: counted packet by packet."""
    table = DownlinkTable(stored_s={"stored": 1.0})
    size = packet_bytes(LINK, "stored")
    rows = schedule(passes, START_MS, Radio(None, 4800.0, LINK, table))
    sent = 0
    for each, row in zip(passes, rows, strict=True):
        (kind,) = row["downlink"]["stored"]
        made = (each.los.time_ms - START_MS) / 1e3
        assert abs(kind["packets"] - (made - sent)) <= 1.0
        assert kind["fit"] == min(kind["packets"], int(600.0 * each.duration_s) // size)
        assert kind["bytes"] == air_bytes(LINK, "stored", kind["packets"])
        assert row["downlink"]["left_packets"] == kind["packets"] - kind["fit"]
        sent += kind["fit"]
    assert rows[-1]["downlink"]["left_packets"] > 10_000


def test_what_the_ground_file_says_of_a_downlink():
    table = SatelliteTable(link="udp:127.0.0.1:1", downlink_hz=4e8, downlink={"bit_s": 1200.0})
    radio = radio_of(table)
    assert (radio.frequency_hz, radio.bit_s) == (4e8, 1200.0)
    assert radio.table.stored_s == {"stored": 60.0} and radio.link.dictionary.name == "Chibis-M"
