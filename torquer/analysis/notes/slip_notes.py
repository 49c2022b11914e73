"""Numbers that look like a mistaken unit, and hardware that cannot do its job."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from torquer.analysis.notes.assess import assess
from torquer.base.conventions import EARTH_RADIUS_M, STRONG_FIELD_T
from torquer.environment.field import DirectDipole, UserField
from torquer.environment.orbit import Numerical
from torquer.scenario.spec import Scenario

#: Heights [km] between which satellites fly; beyond, a unit may have been mistaken.
LOWEST_KM, _HIGHEST_KM = 120.0, 50_000.0
#: Altitude [km] of the Moon. Difference [km] of two heights that are the same.
_MOON_KM, _ROUND_KM = 378_000.0, 1.0
#: Rates [deg/s] that coils can take off at best in a day. Hubble has 11 deg/s, microsatellites have
#: some hundreds, CubeSats some thousands, the smallest 1e5.
_LEAST_DEG_S_A_DAY, _MOST_DEG_S_A_DAY = 5.0, 3e5
_DAY_S = 86400.0
#: Scalar of a quaternion from which on it is a small rotation, of 16 deg at most.
_NO_TURN = 0.99
#: Rate [deg/s] and angle [deg] that no satellite with coils or wheels holds.
_UNHELD = 1e-5
#: Control steps of a run from which on it shows something.
_FEW_STEPS = 10
#: Height [km] up to which orbits near the equator are rare.
_LOW_ORBIT_KM = 2000.0
#: Factor and angle [deg] by which no field of the Earth differs from a dipole in the median along
#: an orbit: IGRF does by 5 % and 17 deg in a low one. Instants at which it is compared.
_MOST_TIMES, _MOST_TURNED_DEG, _COMPARED = 4.0, 60.0, 24


def slip_notes(scenario: Scenario) -> list[str]:
    """Notes on numbers that may have been given in another unit, one line each."""
    return [*assess(_CHECKS, scenario)]


def _altitude_notes(scenario: Scenario) -> Iterator[str]:
    """Heights of perigee and apogee, however the orbit is given."""
    extent = scenario.orbit.extent(scenario.start)
    if extent is None:
        return
    near, far = (1e-3 * (radius - EARTH_RADIUS_M) for radius in extent[:2])
    is_round = far - near < _ROUND_KM
    low, high = ("", "") if is_round else ("perigee's ", "apogee's ")
    if near < LOWEST_KM:
        soon = "a revolution" if is_round else "some revolutions"
        yield (
            f"orbit: the {low}altitude is {near:.6g} km: below {LOWEST_KM:g} km drag ends every "
            f"flight within {soon}"
        )
    if near > _HIGHEST_KM:
        yield (
            f"orbit: the {low}altitude is {near:.6g} km, far beyond the geostationary orbit's "
            f"35786 km{_in_metres(near)}"
        )
    elif far > _MOON_KM:
        yield (
            f"orbit: the {high}altitude is {far:.6g} km, beyond the Moon, which would change such "
            f"an orbit{_in_metres(far)}"
        )


def _in_metres(altitude_km: float) -> str:
    """The question whether a height was given in metres, where it would be a usual one."""
    is_usual = LOWEST_KM <= 1e-3 * altitude_km <= _HIGHEST_KM
    return f", or is it {1e-3 * altitude_km:.6g} km in metres?" if is_usual else ""


def _inertia_notes(scenario: Scenario) -> Iterator[str]:
    """A body that coils of this size could not turn, or would spin up at once."""
    coils, body = scenario.spacecraft.coils, scenario.spacecraft.body
    if coils is None:
        return
    limit, moment = float(coils.limits_a_m2().max()), float(body.principal()[0].max())
    a_day = math.degrees(limit * STRONG_FIELD_T / moment) * _DAY_S
    if a_day > _MOST_DEG_S_A_DAY:
        yield (
            f"spacecraft.coils.limit_a_m2 of {limit:g} is very large for a moment of inertia of "
            f"{moment:.3g} kg m^2, whose rate it could change by {a_day:.2g} deg/s a day"
        )
    if 0.0 < a_day < _LEAST_DEG_S_A_DAY:
        yield (
            f"spacecraft.body.inertia_kg_m2 of {moment:.3g} is too large for coils of {limit:g} "
            f"A m^2, which could change its rate by {a_day:.2g} deg/s a day at best: is it in "
            "kg m^2 (1 g cm^2 is 1e-7 kg m^2)?"
        )


def _inclination_notes(scenario: Scenario) -> Iterator[str]:
    """An inclination in radians: a low orbit that is nearly equatorial."""
    orbit = scenario.orbit
    given = orbit.start if isinstance(orbit, Numerical) else orbit
    angle = getattr(given, "inclination_deg", None)
    if angle is None:  # of elements that nobody typed as numbers of their own
        return
    extent = given.extent(scenario.start)
    is_low = extent.perigee_m < EARTH_RADIUS_M + 1e3 * _LOW_ORBIT_KM
    if is_low and 0.0 < angle <= math.pi:
        yield (
            f"orbit: inclination_deg is {angle:g} deg, a nearly equatorial orbit: or is it "
            f"{math.degrees(angle):.3g} deg in radians?"
        )


def _lag_notes(scenario: Scenario) -> Iterator[str]:
    """Coils that take longer to follow a command than the command lasts."""
    coils, control = scenario.spacecraft.coils, scenario.control
    held_s = control.actuate_s or control.sample_s
    if coils is not None and coils.lag_s > held_s:
        yield (
            f"spacecraft.coils.lag_s of {coils.lag_s:g} s is longer than the {held_s:g} s for "
            "which a command is held: the coils never reach the commanded dipole"
        )


def _residual_notes(scenario: Scenario) -> Iterator[str]:
    """A residual dipole that the coils cannot balance."""
    coils = scenario.spacecraft.coils
    if coils is None:
        return
    residual = float(np.linalg.norm(coils.residual_dipole_a_m2))
    limit = float(coils.limits_a_m2().max())
    if residual > limit:
        yield (
            f"spacecraft.coils.residual_dipole_a_m2 of {residual:.3g} A m^2 exceeds the "
            f"{limit:g} A m^2 of a coil: the coils cannot balance it"
        )


def _quaternion_notes(scenario: Scenario) -> Iterator[str]:
    """A quaternion with its scalar first: what means no rotation, or a small one, elsewhere."""
    q = scenario.initial.quaternion
    if q is not None and abs(q[0]) > _NO_TURN:
        nearly = "" if abs(q[0]) == 1.0 else "nearly "
        yield (
            f"initial.quaternion of [{', '.join(f'{x:g}' for x in q)}] is {nearly}half a turn "
            "about x: the scalar is last here, and [0, 0, 0, 1] is no rotation"
        )


def _mission_notes(scenario: Scenario) -> Iterator[str]:
    """Goals that hold from the start, or never."""
    mission = scenario.mission
    if mission is None:
        return
    units = {
        "rate_below_deg_s": "deg/s", "rate_orbital_below_deg_s": "deg/s",
        "attitude_error_below_deg": "deg", "commanded_error_below_deg": "deg",
    }  # fmt: skip
    for key, unit in units.items():
        limit = getattr(mission, key)
        if limit is not None and limit < _UNHELD:
            yield (
                f"mission.{key} of {limit:g} {unit} is less than any satellite with coils or "
                "wheels holds"
            )
    limit, initial = mission.rate_below_deg_s, scenario.initial
    rate = float(np.linalg.norm(initial.rate_deg_s))
    if limit is not None and initial.rate_relative_to == "inertial" and 0.0 < rate < limit:
        yield (
            f"mission.rate_below_deg_s of {limit:g} deg/s is above the initial rate of "
            f"{rate:.3g} deg/s: the goal holds from the start"
        )


def _duration_notes(scenario: Scenario) -> Iterator[str]:
    """A run that is over before the control has done anything."""
    duration_s, cycle_s = scenario.length_s, scenario.control.cycle_s
    if duration_s < _FEW_STEPS * cycle_s:
        yield (
            f"simulation: the run of {duration_s:g} s ends after {duration_s / cycle_s:.2g} "
            f"control steps of {cycle_s:g} s"
        )


def _field_notes(scenario: Scenario) -> Iterator[str]:
    """A field of the user's own in another unit, or in other axes than the Earth-fixed ones."""
    orbit = scenario.orbit
    if (
        not isinstance(scenario.environment.field, UserField)
        or orbit.extent(scenario.start) is None
    ):
        return
    own = scenario.orbit_environment()
    dipole = own.environment.model_copy(update={"field": DirectDipole()})
    t_s = np.linspace(0.0, min(orbit.period_s, scenario.length_s), _COMPARED)
    r, v = own.state(t_s)
    found, usual = own.field(t_s, r, v), replace(own, environment=dipole).field(t_s, r, v)
    sizes, usual_sizes = (np.linalg.norm(b, axis=1) for b in (found, usual))
    times = float(np.median(sizes / usual_sizes))
    if not 1.0 / _MOST_TIMES < times < _MOST_TIMES:
        yield (
            f"environment.field: {1e9 * float(np.median(sizes)):.3g} nT along the orbit is "
            f"{times:.2g} times the Earth's dipole: is it in tesla (1 nT is 1e-9 T, 1 gauss is "
            "1e-4 T)?"
        )
        return
    cosines = np.sum(found * usual, axis=1) / (sizes * usual_sizes)
    angle = math.degrees(float(np.median(np.arccos(np.clip(cosines, -1.0, 1.0)))))
    if angle > _MOST_TURNED_DEG:
        yield (
            f"environment.field: along the orbit its direction is {angle:.0f} deg off that of the "
            "Earth's dipole: is it in Earth-fixed axes, not north, east and down?"
        )


_CHECKS = {
    "the heights of the orbit": _altitude_notes,
    "the inertia and the coils' dipole": _inertia_notes,
    "the inclination": _inclination_notes,
    "the field of your own": _field_notes,
    "the lag of the coils": _lag_notes,
    "the residual dipole of the coils": _residual_notes,
    "the attitude at the start": _quaternion_notes,
    "the goals of the mission": _mission_notes,
    "the length of the run": _duration_notes,
}
