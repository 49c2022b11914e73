"""Passes of a satellite over ground stations: when, where in the sky, in what light, what Doppler.

    from torquer.ground import GroundStation, doppler, find_passes, ms_of, orbit_from_file

    start_ms = ms_of("2026-03-01T00:00:00Z", "start")
    known = orbit_from_file("cubesat.tle", start_ms)
    stations = {"tarusa": GroundStation(latitude_deg=54.7, longitude_deg=37.2)}
    for each in find_passes(known.around, stations, start_ms, start_ms + 86_400_000):
        print(each.station, each.aos.time_ms, doppler(each.highest, 437.5e6))

Times are milliseconds since 1970, UTC. A pass that the span cuts off begins or ends with it, which
`rises` and `sets` say.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from torquer.base.time import parse_utc, seconds_between, utc_at
from torquer.environment.earth.apparent_sun import LIGHT_SPEED_M_S
from torquer.ground.sight import (
    Look,
    crossings,
    highest,
    look,
    spans_in_sight,
    sun_elevation,
)
from torquer.ground.stations import GroundStation

if TYPE_CHECKING:
    from torquer.environment.along_orbit import OrbitEnvironment

#: Longest span in which passes are looked for [s].
LONGEST_S = 100 * 86_400.0
#: Points of a pass's curve; instants at which its light is looked at, and the finest such step [s].
CURVE, _LIGHT, _LIGHT_S = 61, 2000, 1.0
#: Half of the time over which the acceleration along the line of sight is taken [s].
_HALF_S = 0.25
#: Elevations of the Sun's centre at which day ends (refraction and radius), and civil twilight.
_DAY_DEG, _TWILIGHT_DEG = -0.833, -6.0


class Point(NamedTuple):
    """A satellite in a station's sky; the range rate is positive where it recedes."""

    time_ms: int
    azimuth_deg: float
    elevation_deg: float
    range_km: float
    range_rate_km_s: float
    range_acceleration_m_s2: float
    sunlit: bool


class Pass(NamedTuple):
    """A pass: rise (AOS), greatest elevation, closest approach (TCA), set (LOS), and its curve.

    `rises`, `sets`: False where the span that was asked for cuts it off. `eclipse_ms`: parts in
    which less than half of the Sun is seen from the satellite. `sun_elevation_deg`: at the station,
    with the satellite at its highest; `light` there: day, twilight (Sun down to -6 deg), night.
    """

    station: str
    rises: bool
    sets: bool
    aos: Point
    highest: Point
    closest: Point
    los: Point
    eclipse_ms: list[tuple[int, int]]
    sun_elevation_deg: float
    light: str
    curve: list[Point]

    @property
    def duration_s(self) -> float:
        """Length [s]."""
        return (self.los.time_ms - self.aos.time_ms) * 1e-3

    def bits(self, bit_s: float) -> float:
        """Bits that it can bring down at a rate."""
        return bit_s * self.duration_s


def doppler(at: Point, frequency_hz: float) -> tuple[float, float]:
    """Shift [Hz] of a frequency sent from the satellite, as the station receives it, and its rate
    [Hz/s].

    Of the first order in speed over that of light; what is left out is a hertz of 2 GHz. A
    station that shall be received at a frequency sends by the same amount to the other side.
    """
    per_m_s = -frequency_hz / LIGHT_SPEED_M_S
    return 1e3 * per_m_s * at.range_rate_km_s, per_m_s * at.range_acceleration_m_s2


def find_passes(
    around: OrbitEnvironment, stations: Mapping[str, GroundStation], start_ms: int, end_ms: int
) -> list[Pass]:
    """Passes over stations between two times, in order of their beginning.

    ValueError with one line where there is no orbit in the span (elements that are too old, a
    satellite that has decayed, a file that ends), and for a span that is none.
    """
    if not 0 < end_ms - start_ms <= 1e3 * LONGEST_S:
        raise ValueError(
            f"hours: must be above 0 and at most {LONGEST_S / 3600:g}; received "
            f"{(end_ms - start_ms) / 3.6e6:g}"
        )
    span_s = seconds_of(around, start_ms), seconds_of(around, end_ms)
    around.orbit.check_span(around.start, *span_s)
    found = [
        each
        for name, station in stations.items()
        for each in _over(_Sky(around, name, station), span_s)
    ]
    return sorted(found, key=lambda each: (each.aos.time_ms, each.station))


def seconds_of(around: OrbitEnvironment, time_ms: float) -> float:
    """Seconds after an orbit's start of a time; ValueError beyond the years 1950 to 2150."""
    try:
        moment = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(milliseconds=time_ms)
    except (OverflowError, ValueError):
        moment = None
    if moment is None or not 1950 <= moment.year < 2150:
        raise ValueError(f"from: must be a time from 1950 to 2150; received {time_ms} ms")
    return seconds_between(around.start, moment)


class _Sky(NamedTuple):
    """A satellite above a station."""

    around: OrbitEnvironment
    name: str
    station: GroundStation


def _over(sky: _Sky, span_s: tuple[float, float]) -> list[Pass]:
    """Passes over a station, all of them at once: what takes time are calls, not instants."""
    spans = [*spans_in_sight(sky.around, sky.station, *span_s)]
    if not spans:
        return []
    first, last = np.array(spans).T
    grids = [_grid(*each) for each in spans]
    key_s = np.stack([
        first,
        _greatest(sky, grids, lambda seen: seen.elevation_rad),
        _greatest(sky, grids, lambda seen: -seen.range_m),
        last,
    ])  # fmt: skip
    sun_deg = np.degrees(sun_elevation(sky.around, sky.station, key_s[1])).tolist()
    points = _points(sky, np.concatenate([key_s.T, np.linspace(first, last, CURVE).T], axis=1))
    rises, sets = (first > span_s[0]).tolist(), (last < span_s[1]).tolist()
    return [
        Pass(sky.name, *edges, each[0], each[1], each[2], each[3], dark, sun, _light(sun), each[4:])
        for edges, each, dark, sun in zip(
            zip(rises, sets, strict=True), points, _dark(sky, grids), sun_deg, strict=True
        )
    ]


def _grid(first_s: float, last_s: float) -> np.ndarray:
    """Instants of a pass at which its light and its highest place are looked for."""
    return np.linspace(first_s, last_s, int(np.clip((last_s - first_s) / _LIGHT_S, 60, _LIGHT)))


def _light(sun_deg: float) -> str:
    if sun_deg > _DAY_DEG:
        return "day"
    return "twilight" if sun_deg > _TWILIGHT_DEG else "night"


def _greatest(sky: _Sky, grids: list[np.ndarray], what) -> np.ndarray:
    """Times [n] s of the greatest value within each pass."""
    values = np.split(what(_look(sky, np.concatenate(grids))), np.cumsum([*map(len, grids)])[:-1])
    rows = [int(np.argmax(each)) for each in values]
    before = [grid[max(row - 1, 0)] for grid, row in zip(grids, rows, strict=True)]
    after = [grid[min(row + 1, grid.size - 1)] for grid, row in zip(grids, rows, strict=True)]
    return highest(lambda t: what(_look(sky, t)), np.array(before), np.array(after))


def _look(sky: _Sky, t_s) -> Look:
    return look(sky.around, sky.station, t_s)


def _dark(sky: _Sky, grids: list[np.ndarray]) -> list[list[tuple[int, int]]]:
    """Parts of each pass in which less than half of the Sun's disc is seen."""

    def depth(t_s):
        return 0.5 - _sunlit(sky.around, t_s)

    t_s = np.concatenate(grids)
    h = depth(t_s)
    found, at = [], np.cumsum([0, *map(len, grids)])
    for begin, end in pairwise(at.tolist()):
        inner = crossings(depth, t_s[begin:end], h[begin:end])[0].tolist()
        edges = [t_s[begin]] * bool(h[begin] > 0.0) + inner + [t_s[end - 1]] * bool(h[end - 1] > 0)
        ms = [_ms(sky.around, edge) for edge in edges]
        found.append([*zip(ms[::2], ms[1::2], strict=True)])
    return found


def _sunlit(around: OrbitEnvironment, t_s: np.ndarray) -> np.ndarray:
    r, _ = around.state(t_s)
    return around.sunlit_fraction(t_s, r)


def _points(sky: _Sky, times_s: np.ndarray) -> list[list[Point]]:
    """Points at times [passes, n] s, a list each."""
    t_s, around = times_s.ravel(), sky.around
    seen = _look(sky, t_s)
    later, earlier = (_look(sky, t_s + by).range_rate_m_s for by in (_HALF_S, -_HALF_S))
    columns = (
        times_ms(around, t_s),
        np.degrees(seen.azimuth_rad),
        np.degrees(seen.elevation_rad),
        1e-3 * seen.range_m,
        1e-3 * seen.range_rate_m_s,
        (later - earlier) / (2.0 * _HALF_S),
        _sunlit(around, t_s) >= 0.5,
    )
    made = [Point(*each) for each in zip(*(each.tolist() for each in columns), strict=True)]
    count = times_s.shape[1]
    return [made[k : k + count] for k in range(0, len(made), count)]


def times_ms(around: OrbitEnvironment, t_s) -> np.ndarray:
    """Milliseconds since 1970, UTC, of seconds after an orbit's start."""
    since = utc_at(around.start, t_s) - np.datetime64(0, "us")
    return np.rint(since / np.timedelta64(1, "ms")).astype(np.int64)


def _ms(around: OrbitEnvironment, t_s: float) -> int:
    return int(times_ms(around, t_s))


def ms_of(text: str, name: str) -> int:
    """Milliseconds since 1970 of an ISO 8601 text with a zone; ValueError with one line."""
    return round(parse_utc(text, name).timestamp() * 1e3)
