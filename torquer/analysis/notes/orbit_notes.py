"""Runs for which their model of the orbit does not hold: no precession, no drag, old elements."""

import math
from collections.abc import Iterator

import numpy as np

from torquer.analysis.notes.assess import assess
from torquer.analysis.notes.slip_notes import LOWEST_KM
from torquer.analysis.verdict import clock_text
from torquer.base.conventions import EARTH_RADIUS_M, MU_EARTH_M3_S2
from torquer.base.time import DAY_S
from torquer.environment.earth.atmosphere.exponential import TABLE
from torquer.environment.orbit import AnyOrbit, Circular, Drifting, Kepler, Numerical, Sgp4
from torquer.environment.orbit.drifting import sun_synchronous_rad
from torquer.environment.orbit.kepler import Extent
from torquer.environment.orbit.numerical import tle_epoch
from torquer.environment.orbit.secular import EARTH_J2, secular_rates
from torquer.scenario.spec import Scenario

#: Age of two-line elements [days] from which the satellite's place is hardly theirs any more.
_OLD_DAYS = 14.0
#: Turn of node or perigee [deg] that a run without it would show.
_TURNED_DEG = 10.0
#: Eccentricity from which it matters where the perigee lies: 130 km of height in low orbits.
_OVAL = 0.01
#: Cross-section times drag coefficient over mass [m^2/kg] of many small satellites.
_DRAG_M2_KG = 0.02
#: Change [min] of a local time that is meant to stay, and the days within which it shows.
_OFF_MIN, _SHOWS_DAYS = 30.0, 365.25
#: Loss of height [km] that a run without it would show.
_LOST_KM = 20.0
#: Days that any mission lasts at least; heights at which the descent is found.
_STAYS_DAYS, _HEIGHTS = 14.0, 200


def orbit_notes(scenario: Scenario) -> list[str]:
    """Notes on the orbit against the length and the date of the run, one line each."""
    return [*assess(_CHECKS, scenario)]


def _age_notes(scenario: Scenario) -> Iterator[str]:
    """Two-line elements whose epoch is far from the start, or from the end."""
    orbit = scenario.orbit
    elements = orbit.start if isinstance(orbit, Numerical) else orbit
    if not isinstance(elements, Sgp4):
        return
    age_days = (scenario.start - tle_epoch(elements)).total_seconds() / DAY_S
    ages = {"the start": age_days, "the end": age_days + scenario.length_s / DAY_S}
    for what, age in ages.items():
        if abs(age) >= _OLD_DAYS:
            side = "after" if age > 0.0 else "before"
            yield (
                f"{what} is {abs(age):.0f} days {side} the epoch of the two-line elements: "
                "their error grows by some kilometres a day"
            )
            return


def _precession_notes(scenario: Scenario) -> Iterator[str]:
    """An orbit without J2 over so many days that its plane or its perigee would turn."""
    orbit, days = scenario.orbit, scenario.length_s / DAY_S
    if not _is_of_two_bodies(orbit) or scenario.environment.sun_direction is not None:
        return
    axis, eccentricity, inclination = _elements(orbit.extent(scenario.start))
    drift = secular_rates(axis, eccentricity, inclination, EARTH_J2)
    turns = {"plane": drift.node} | ({"perigee": drift.perigee} if eccentricity > _OVAL else {})
    a_day = {what: abs(math.degrees(rate)) * DAY_S for what, rate in turns.items()}
    seen = [
        f"the {what} by {rate:.2g} deg a day, {rate * days:.0f} deg in this run"
        for what, rate in a_day.items()
        if rate * days >= _TURNED_DEG
    ]
    if seen:
        yield (
            f"orbit: {_in_words(orbit)} does not precess; the Earth's flattening turns "
            f"{', '.join(seen)}: kinds 'drifting', 'sgp4', and 'numerical' of degree 2 have it"
        )


def _local_time_notes(scenario: Scenario) -> Iterator[str]:
    """A local time of the node that does not stay: of an inclination that is not the one for it."""
    orbit = scenario.orbit
    if not isinstance(orbit, Drifting) or orbit.ltan_h is None or orbit.inclination_deg is None:
        return
    a_day = DAY_S / 60.0 * orbit.local_time_rate()
    if abs(a_day) * _SHOWS_DAYS < _OFF_MIN:
        return
    days, needed = _OFF_MIN / abs(a_day), sun_synchronous_rad(orbit.axis_m, orbit.eccentricity)
    would = "no orbit of this height is Sun-synchronous"
    if needed is not None:
        would = f"left out, it is the {math.degrees(needed):.5g} deg of a Sun-synchronous orbit"
    yield (
        f"orbit.ltan_h of {orbit.ltan_h:g} h holds at the start only: with inclination_deg = "
        f"{orbit.inclination_deg:g} the local time drifts by {a_day:+.3g} min a day, "
        f"{_OFF_MIN:g} min in {clock_text(days * DAY_S)}; {would}"
    )


def _drag_notes(scenario: Scenario) -> Iterator[str]:
    """An orbit without drag over so many days that a satellite would descend, or so low that it
    would not stay for two weeks."""
    orbit = scenario.orbit
    is_drawn = orbit.drag is not None if isinstance(orbit, Numerical) else isinstance(orbit, Sgp4)
    extent = orbit.extent(scenario.start)
    if is_drawn or extent is None:
        return
    axis, eccentricity, _ = _elements(extent)
    if eccentricity > _OVAL:
        return
    height_km = 1e-3 * (axis - EARTH_RADIUS_M)
    if height_km < LOWEST_KM:  # which has a note of its own
        return
    lost_km = min(float(_descent_km_s(height_km)) * scenario.length_s, height_km)
    days = _days_left(height_km)
    if lost_km < _LOST_KM and days < _STAYS_DAYS:
        within = clock_text(DAY_S * float(f"{days:.2g}"))
        yield (
            f"orbit: drag takes a satellite of {0.5 * _DRAG_M2_KG:g} m^2 a kilogram down from "
            f"{height_km:.4g} km within about {within}: {_in_words(orbit)} has no drag"
        )
    if lost_km >= _LOST_KM:
        lost = "all of its height" if lost_km == height_km else f"about {lost_km:.0f} km"
        yield (
            f"orbit: at a height of {height_km:.4g} km drag would take {lost} from a satellite of "
            f"{0.5 * _DRAG_M2_KG:g} m^2 a kilogram in this run: {_in_words(orbit)} has no drag"
        )


def _days_left(height_km: float) -> float:
    """Days in which drag lowers a circular orbit to the height below which it ends at once."""
    heights_km = np.linspace(LOWEST_KM, height_km, _HEIGHTS)
    speeds_km_s = _descent_km_s(heights_km)
    if not np.all(speeds_km_s):
        return math.inf
    return float(np.trapezoid(1.0 / speeds_km_s, heights_km)) / DAY_S


def _is_of_two_bodies(orbit: AnyOrbit) -> bool:
    """Whether the Earth is a point for this orbit."""
    if isinstance(orbit, Numerical):
        return orbit.degree < 2
    return isinstance(orbit, Circular | Kepler)


def _in_words(orbit: AnyOrbit) -> str:
    if isinstance(orbit, Numerical):
        return f"a numerical orbit of degree {orbit.degree}"
    return f"an orbit of kind '{orbit.kind}'"


def _elements(extent: Extent) -> tuple[float, float, float]:
    """Semi-major axis [m], eccentricity, inclination [rad]."""
    near, far, inclination = extent
    return 0.5 * (near + far), (far - near) / (far + near), inclination


def _descent_km_s(height_km: float | np.ndarray) -> np.ndarray:
    """Speeds [km/s] at which drag lowers circular orbits: density sqrt(mu a) times drag by mass;
    0 above the table."""
    heights, densities = np.array(TABLE).T
    density = np.exp(np.interp(height_km, heights, np.log(densities)))
    axis_m = EARTH_RADIUS_M + 1e3 * np.asarray(height_km)
    speed = 1e-3 * density * np.sqrt(MU_EARTH_M3_S2 * axis_m) * _DRAG_M2_KG
    return np.where(height_km > heights[-1], 0.0, speed)


_CHECKS = {
    "the age of the two-line elements": _age_notes,
    "the precession of the orbit": _precession_notes,
    "the local time of the node": _local_time_notes,
    "the descent of the orbit": _drag_notes,
}
