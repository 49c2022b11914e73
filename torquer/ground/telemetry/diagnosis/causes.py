"""Causes that may explain readings which do not fit the field, each with all that it might be.

A scan is a sum over its offsets, weighted by how probable each is beforehand: that corrects for
the number that is tried.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from torquer.environment.along_orbit import OrbitEnvironment
from torquer.environment.orbit import AnyOrbit
from torquer.ground.telemetry.modulus import FieldGiven

#: Offsets of the zones that people use [h].
ZONES_H = (
    -12.0, -11.0, -10.0, -9.5, -9.0, -8.0, -7.0, -6.0, -5.0, -4.0, -3.5, -3.0, -2.5, -2.0, -1.0,
    1.0, 2.0, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5, 5.75, 6.0, 6.5, 7.0, 8.0, 8.75, 9.0, 9.5, 10.0, 10.5,
    11.0, 12.0, 12.75, 13.0, 13.75, 14.0,
)  # fmt: skip
#: Shifts of a clock that are tried [s]; one in the middle of the probable ones is 15 s.
_CLOCK_S = (3.0, 9.0, 17.0, 28.0, 45.0, 70.0, 105.0, 160.0, 240.0)
_USUAL_CLOCK_S = 15.0
#: Phases along the orbit that are tried, besides small ones [s].
_PHASES, _SMALL_S = 72, (5.0, 10.0, 20.0)
#: Error along the track of elements [s]: when fresh, by the square of their age [days]; how much of
#: the prior is any phase; that of their node [deg], when fresh and by the day.
_FRESH_S, _DRAG_S_DAY2, _ANY_PHASE, _NODE_DEG = 0.4, 0.06, 0.1, 0.05
#: What a unit was taken for, by the ratio of the readings to the field.
SLIPS = {
    1e-9: "tesla taken for nanotesla", 1e-6: "tesla taken for microtesla",
    1e-5: "gauss taken for nanotesla", 1e-3: "microtesla taken for nanotesla",
    1e-2: "gauss taken for microtesla", 1e2: "nanotesla taken for milligauss",
    1e-1: "microtesla taken for milligauss", 1e1: "milligauss taken for microtesla",
    1e3: "nanotesla taken for microtesla", 1e5: "nanotesla taken for gauss",
    1e6: "microtesla taken for tesla", 1e9: "nanotesla taken for tesla",
}  # fmt: skip
#: A slip is tried where the ratio is within this factor of it.
_NEAR_SLIP = 3.0


class Cause(NamedTuple):
    """A cause: how probable it is beforehand, whether it moves the satellite, and what it is in
    words, of its value."""

    prior: float
    is_place: bool
    say: Callable[[Any], str]


def _seconds(value: float) -> str:
    return f"{value:+.0f} s" if abs(value) >= 100.0 else f"{value:+.3g} s"


CAUSES = {
    "stated": Cause(0.7, False, lambda _: "as stated"),
    "zone": Cause(0.06, True, lambda hours: f"zone wrong by {hours:+g} h"),
    "clock": Cause(0.06, False, lambda s: f"clock wrong by {_seconds(-s)}"),
    "track": Cause(0.06, True, lambda s: f"satellite {_seconds(s)} along its orbit"),
    "satellite": Cause(0.04, True, lambda name: f"elements of another satellite, {name}"),
    "lag": Cause(0.04, False, lambda lag: f"sensor that {lag[0]} over {lag[1]:.3g} s"),
    "units": Cause(0.02, False, lambda factor: SLIPS[factor]),
}
#: How probable it is beforehand that it is none of these.
NONE_OF_THESE = 0.02
#: Causes that |B| seldom tells apart: each moves the field in time.
TIMING = ("clock", "track", "lag")


class Hypothesis(NamedTuple):
    """One value of a cause: its share of the cause's prior, readings [n, 3] and strength [n] nT,
    columns [n] that may be added with the standard deviation of their factor, and the logarithm of
    the Jacobian of a row's readings."""

    cause: str
    value: Any
    prior: float
    m: np.ndarray
    strength: np.ndarray
    columns: Sequence[np.ndarray] = ()
    sigma: Sequence[float] = ()
    jacobian: float = 0.0


class Path(NamedTuple):
    """Positions [n, 3] m and velocities [n, 3] m/s of a satellite, inertial, taken for times [n]
    s."""

    t_s: np.ndarray
    r: np.ndarray
    v: np.ndarray


class Place(NamedTuple):
    """Where a satellite is said to be; `environment` starts at time 0 of the rows."""

    environment: OrbitEnvironment

    def path(self, t_s, ahead_s=0.0) -> Path:
        """Where it is at times [n] s, `ahead_s` along the orbit. ValueError beyond what is known of
        orbit or field."""
        along = self.environment
        along.check_dates(*(float(edge(t_s)) + ahead_s for edge in (np.min, np.max)))
        return Path(t_s, *along.state(t_s + ahead_s))

    def strength_on(self, path: Path, east_rad=0.0, higher=1.0) -> np.ndarray:
        """Strength [n] nT on a path, its plane turned to the east, the radius so many times as
        large."""
        r = path.r
        if east_rad:
            cos, sin = np.cos(east_rad), np.sin(east_rad)
            r = r @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
        field = self.environment.field(path.t_s, higher * r, path.v)
        return 1e9 * np.linalg.norm(field, axis=1)

    def strength(self, t_s, ahead_s=0.0) -> np.ndarray:
        """Strength [n] nT at times [n] s, `ahead_s` along the orbit."""
        return self.strength_on(self.path(t_s, ahead_s))

    @property
    def period_s(self) -> float:
        """Time of a revolution [s]."""
        return self.environment.orbit.period_s


class Given(NamedTuple):
    """Positions that the telemetry itself holds: they belong to their stamps."""

    field: FieldGiven

    def strength(self, t_s) -> np.ndarray:
        """Strength [n] nT at times [n] s."""
        return 1e9 * self.field.strength(t_s)[0]


class Known(NamedTuple):
    """What is known beforehand: whether stamps state their zone, age of the elements [days], orbits
    of the other satellites of their file by name."""

    zone_is_stated: bool = False
    age_days: float = 0.0
    others: Mapping[str, AnyOrbit] = MappingProxyType({})


#: Nothing.
NOTHING = Known()


def hypotheses(t_s, m, place: Place | Given, known: Known) -> list[Hypothesis]:
    """All places and times that are tried, for rows at times [n] s with readings [n, 3] nT."""
    found = [Hypothesis("stated", None, 1.0, m, place.strength(t_s))]
    if isinstance(place, Given):
        return found
    for more in (_zones, _clock, _track, _others):
        found += more(t_s, m, place, known)
    return found


def _zones(t_s, m, place: Place, known: Known) -> Iterator[Hypothesis]:
    if known.zone_is_stated:
        return
    for hours in ZONES_H:
        strength = _where_known(place, t_s - 3600.0 * hours)
        if strength is not None:
            yield Hypothesis("zone", hours, 1.0 / len(ZONES_H), m, strength)


def _where_known(place: Place, t_s, ahead_s: float = 0.0, east_rad: float = 0.0):
    """The strength, or None beyond what is known of the orbit."""
    try:
        return place.strength_on(place.path(t_s, ahead_s), east_rad)
    except ValueError:
        return None


def _clock(t_s, m, place: Place, known: Known) -> Iterator[Hypothesis]:
    grid = np.array([*(-s for s in _CLOCK_S[::-1]), *_CLOCK_S])
    half = _half_widths(grid)
    weight = half / (1.0 + (grid / _USUAL_CLOCK_S) ** 2)
    for shift, wide, share in zip(grid, half, weight / weight.sum(), strict=True):
        strength, later = (_where_known(place, t_s + s) for s in (shift, shift + 2.0))
        if strength is not None and later is not None:
            rate = 0.5 * (later - strength)
            yield Hypothesis("clock", shift, share, m, strength, [rate], [wide])


def _half_widths(grid: np.ndarray) -> np.ndarray:
    """Half the distance to the neighbours of each point of a grid, as its own width."""
    edges = 0.5 * (grid[1:] + grid[:-1])
    low = np.append(grid[0] - (edges[0] - grid[0]), edges)
    high = np.append(edges, grid[-1] + (grid[-1] - edges[-1]))
    return 0.5 * (high - low)


def _track(t_s, m, place: Place, known: Known) -> Iterator[Hypothesis]:
    step = place.period_s / _PHASES
    small = np.array([*(-s for s in _SMALL_S[::-1]), *_SMALL_S])
    half_turn = (np.arange(_PHASES) - 0.5 * (_PHASES - 1)) * step
    grid = np.unique(np.concatenate([small, half_turn[np.abs(half_turn) > small[-1]]]))
    half = _half_widths(grid)
    wide = _FRESH_S + _DRAG_S_DAY2 * known.age_days**2
    near = np.exp(-0.5 * (grid / wide) ** 2) / wide * half
    weight = _ANY_PHASE * half / half.sum() + (1.0 - _ANY_PHASE) * near / max(near.sum(), 1e-9)
    node_deg = _NODE_DEG * (1.0 + known.age_days)
    for shift, width, share in zip(grid, half, weight, strict=True):
        strength, later, turned = (
            _where_known(place, t_s, *moved)
            for moved in ((shift,), (shift + 2.0,), (shift, np.radians(0.5)))
        )
        if strength is None or later is None or turned is None:
            continue
        columns = [0.5 * (later - strength), (turned - strength) / 0.5]
        yield Hypothesis("track", shift, share, m, strength, columns, [width, node_deg])


def _others(t_s, m, place: Place, known: Known) -> Iterator[Hypothesis]:
    for name, orbit in known.others.items():
        other = Place(replace(place.environment, orbit=orbit))
        strength = _where_known(other, t_s)
        if strength is not None:
            yield Hypothesis("satellite", name, 1.0 / len(known.others), m, strength)


def units(m, strength) -> Iterator[Hypothesis]:
    """Slips of the unit of readings [n, 3] nT near which the ratio to the strength [n] nT is."""
    with np.errstate(divide="ignore"):
        ratio = np.log(np.median(np.linalg.norm(m, axis=1)) / np.median(strength))
    for slip in SLIPS:
        if abs(ratio - np.log(slip)) < np.log(_NEAR_SLIP):
            # a factor of readings has its Jacobian: without it small numbers fit anything
            yield Hypothesis(
                "units", slip, 1.0 / len(SLIPS), m / slip, strength, jacobian=-np.log(slip)
            )
