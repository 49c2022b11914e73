"""Passes as pages and the command line give them: with Doppler, and with what is brought down."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from torquer.flight.packets.software_file import SpaceLink
from torquer.ground.backlog import DownlinkTable, downlinked
from torquer.ground.file import SatelliteTable, link_of
from torquer.ground.passes import Pass, Point, doppler


class Radio(NamedTuple):
    """Frequency of the downlink [Hz] and its bits a second, each None where it is not known; with
    the packets of the link, what waits for a pass."""

    frequency_hz: float | None = None
    bit_s: float | None = None
    link: SpaceLink | None = None
    table: DownlinkTable = DownlinkTable()


def radio_of(table: SatelliteTable) -> Radio:
    """What the ground file says of a satellite's downlink; `ScenarioError` for wrong files."""
    link, downlink = link_of(table)
    return Radio(table.downlink_hz, downlink.bit_s, link, downlink)


def schedule(passes: Sequence[Pass], start_ms: int, radio: Radio) -> list[dict]:
    """Passes as tables for JSON, in order; what is stored on board counts from `start_ms` on.

    What a pass leaves on board waits for the next one. `curve`: rows of time_ms, azimuth_deg,
    elevation_deg, range_km, doppler_hz (None without a frequency), sunlit.
    """
    found, until_ms, carried = [], start_ms, dict.fromkeys(radio.table.stored_s, 0.0)
    for each in passes:
        since_s = max(each.aos.time_ms - until_ms, 0) * 1e-3
        table = _as_table(each, radio.frequency_hz) | {"since_s": since_s, "downlink": None}
        if radio.bit_s is not None:
            table["downlink"] = _downlink(each, since_s, radio, carried)
        found.append(table)
        until_ms = max(until_ms, each.los.time_ms)
    return found


def _as_table(each: Pass, frequency_hz: float | None) -> dict:
    keys = ("station", "rises", "sets", "duration_s", "sun_elevation_deg", "light")
    points = ("aos", "highest", "closest", "los")
    return (
        {key: getattr(each, key) for key in keys}
        | {key: _as_point(getattr(each, key), frequency_hz) for key in points}
        | {
            "eclipse_ms": [list(part) for part in each.eclipse_ms],
            "curve": [_as_row(point, frequency_hz) for point in each.curve],
        }
    )


def _as_point(point: Point, frequency_hz: float | None) -> dict:
    shift, rate = (None, None) if frequency_hz is None else doppler(point, frequency_hz)
    return point._asdict() | {"doppler_hz": shift, "doppler_rate_hz_s": rate}


def _as_row(point: Point, frequency_hz: float | None) -> list:
    shift = None if frequency_hz is None else round(doppler(point, frequency_hz)[0], 1)
    sky = round(point.azimuth_deg, 3), round(point.elevation_deg, 3), round(point.range_km, 2)
    return [point.time_ms, *sky, shift, point.sunlit]


def _downlink(each: Pass, since_s: float, radio: Radio, carried: dict[str, float]) -> dict:
    """What a pass brings down; `carried`: packets that wait, before it and then after it."""
    if radio.link is None:
        return {"bit_s": radio.bit_s, "bytes": int(each.bits(radio.bit_s or 0.0) / 8.0)}
    found = downlinked(
        radio.link, radio.table, radio.bit_s or 0.0, each.duration_s, since_s, carried
    )
    for kind in found.stored:
        carried[kind.packet] += (since_s + each.duration_s) / kind.period_s - kind.fit
    return {
        "bit_s": radio.bit_s,
        "bytes": found.bytes,
        "live_bytes": found.live_bytes,
        "live": [kind._asdict() for kind in found.live],
        "stored": [kind._asdict() for kind in found.stored],
        "left_packets": found.left_packets,
    }
