"""Numbers that look like a mistaken unit, and hardware that cannot do its job."""

import math
from collections.abc import Iterator

import numpy as np

from torquer.scenario.spec import Scenario

#: Heights [km] between which satellites fly; beyond, a unit may have been mistaken.
_LOWEST_KM, _HIGHEST_KM = 120.0, 50_000.0
#: A strong field in low orbit [T], for what coils can do at best.
_STRONG_FIELD_T = 5e-5
#: Rates [deg/s] that coils can take off at best in a day. Hubble has 11 deg/s, microsatellites have
#: some hundreds, CubeSats some thousands, the smallest 1e5.
_LEAST_DEG_S_A_DAY, _MOST_DEG_S_A_DAY = 5.0, 3e5
#: Cosine of the angle from which two coils count as parallel, 1 deg.
_PARALLEL = math.cos(math.radians(1.0))
_DAY_S = 86400.0
#: Noise [nT] of the best magnetometers; less is a number in another unit. Part of the field above
#: which noise leaves no direction to work with.
_QUIETEST_NT, _NOISIEST = 1e-3, 0.2
#: Misalignment [deg] that no mounting has.
_MISALIGNED_DEG = 20.0
#: Rate [deg/s] and angle [deg] that no satellite with coils or wheels holds.
_UNHELD = 1e-5
#: Control steps of a run from which on it shows something.
_FEW_STEPS = 10
#: Height [km] up to which orbits near the equator are rare.
_LOW_ORBIT_KM = 2000.0


def slip_notes(scenario: Scenario) -> list[str]:
    """Notes on numbers that may have been given in another unit, one line each."""
    return [
        *_altitude_notes(scenario),
        *_inertia_notes(scenario),
        *_axis_notes(scenario),
        *_inclination_notes(scenario),
        *_lag_notes(scenario),
        *_residual_notes(scenario),
        *_mounting_notes(scenario),
        *_magnetometer_notes(scenario),
        *_mission_notes(scenario),
        *_duration_notes(scenario),
    ]


def _altitude_notes(scenario: Scenario) -> Iterator[str]:
    altitude_km = getattr(scenario.orbit, "altitude_km", _LOWEST_KM)
    if altitude_km < _LOWEST_KM:
        yield (
            f"orbit.altitude_km is {altitude_km:g} km: below {_LOWEST_KM:g} km drag ends every "
            "flight within a revolution"
        )
    if altitude_km > _HIGHEST_KM:
        metres = f", or is it {altitude_km / 1e3:g} km in metres?"
        meant = metres if _LOWEST_KM <= altitude_km / 1e3 <= _HIGHEST_KM else ""
        yield (
            f"orbit.altitude_km is {altitude_km:g} km, far beyond the geostationary orbit's "
            f"35786 km{meant}"
        )


def _inertia_notes(scenario: Scenario) -> Iterator[str]:
    """A body that coils of this size could not turn, or would spin up at once."""
    coils, body = scenario.spacecraft.coils, scenario.spacecraft.body
    if coils is None:
        return
    limit, moment = float(np.max(coils.limit_a_m2)), float(body.principal()[0].max())
    a_day = math.degrees(limit * _STRONG_FIELD_T / moment) * _DAY_S
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
    angle = getattr(orbit, "inclination_deg", 0.0)
    is_low = getattr(orbit, "altitude_km", 0.0) < _LOW_ORBIT_KM
    if is_low and 0.0 < angle <= math.pi:
        yield (
            f"orbit.inclination_deg is {angle:g} deg, a nearly equatorial orbit: or is it "
            f"{math.degrees(angle):.3g} deg in radians?"
        )


def _axis_notes(scenario: Scenario) -> Iterator[str]:
    """Three coils or more whose axes span only a plane or a line, as two of them are parallel."""
    coils = scenario.spacecraft.coils
    axes = np.array(coils.axes) if coils is not None else np.zeros((0, 3))
    if len(axes) < 3 or np.linalg.matrix_rank(axes, 1e-2) == 3:
        return
    cosines = np.abs(np.triu(axes @ axes.T, 1))
    pairs = [f"{i} and {j}" for i, j in np.argwhere(cosines > _PARALLEL).tolist()]
    why = f": coils {', '.join(pairs)} are parallel" if pairs else ""
    yield f"spacecraft.coils.axes: the {len(axes)} coils produce no dipole outside a plane{why}"


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
    limit = float(np.max(coils.limit_a_m2))
    if residual > limit:
        yield (
            f"spacecraft.coils.residual_dipole_a_m2 of {residual:.3g} A m^2 exceeds the "
            f"{limit:g} A m^2 of a coil: the coils cannot balance it"
        )


def _mounting_notes(scenario: Scenario) -> Iterator[str]:
    """Sensors whose misalignment is not one of mounting."""
    for name in ("magnetometer", "gyro"):
        angle = np.linalg.norm(getattr(scenario.spacecraft, name).misalignment_deg)
        if angle > _MISALIGNED_DEG:
            yield (
                f"spacecraft.{name}.misalignment_deg of {angle:.3g} deg is not an error of "
                "mounting: beyond 90 deg laws that damp by this sensor may drive the rotation"
            )


def _mission_notes(scenario: Scenario) -> Iterator[str]:
    """Goals that hold from the start, or never."""
    mission = scenario.mission
    if mission is None:
        return
    for key in ("rate_below_deg_s", "rate_orbital_below_deg_s", "attitude_error_below_deg"):
        limit = getattr(mission, key)
        if limit is not None and limit < _UNHELD:
            unit = "deg" if key.startswith("attitude") else "deg/s"
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


def _magnetometer_notes(scenario: Scenario) -> Iterator[str]:
    """A range that the field exceeds, and noise that no magnetometer has."""
    sensor = scenario.spacecraft.magnetometer
    if 0.0 < sensor.noise_nt < _QUIETEST_NT:
        yield (
            f"spacecraft.magnetometer.noise_nt of {sensor.noise_nt:g} nT is below that of any "
            f"magnetometer: is it in tesla ({sensor.noise_nt * 1e9:g} nT)?"
        )
    environment = scenario.orbit_environment()
    duration_s = scenario.length_s
    t_s = np.linspace(0.0, min(scenario.orbit.period_s, duration_s), 50)
    field_nt = 1e9 * np.linalg.norm(environment.sample(t_s)[:, 3:6], axis=1)
    least_nt, greatest_nt = float(field_nt.min()), float(field_nt.max())
    if sensor.noise_nt > _NOISIEST * least_nt:
        part = sensor.noise_nt / least_nt
        yield (
            f"spacecraft.magnetometer.noise_nt of {sensor.noise_nt:g} nT is {part:.2g} of the "
            f"field where it is weakest on this orbit, {least_nt:.3g} nT: readings hardly show its "
            "direction"
        )
    if sensor.range_nt < greatest_nt:
        yield (
            f"spacecraft.magnetometer.range_nt of {sensor.range_nt:g} nT is exceeded on this "
            f"orbit, where the field reaches {greatest_nt:.3g} nT: readings will saturate"
        )
