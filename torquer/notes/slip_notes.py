"""Numbers that look like a mistaken unit, and hardware that cannot do its job."""

import math

import numpy as np

from torquer.scenario.spec import Scenario

#: Heights [km] between which satellites fly; beyond, a unit may have been mistaken.
_LOWEST_KM, _HIGHEST_KM = 120.0, 50_000.0
#: A strong field in low orbit [T], for what coils can do at best.
_STRONG_FIELD_T = 5e-5
#: Rate [deg/s] that coils can take off at best in a day: less is none. Large satellites have
#: 100 deg/s; inertia in g cm^2 makes 1e-4 deg/s of a CubeSat's 1000.
_LEAST_DEG_S_A_DAY = 0.05
#: Cosine of the angle from which two coils count as parallel, 1 deg.
_PARALLEL = math.cos(math.radians(1.0))
_DAY_S = 86400.0
#: Noise [nT] of the best magnetometers; less is a number in another unit.
_QUIETEST_NT = 1e-3


def slip_notes(scenario: Scenario) -> list[str]:
    """Notes on numbers that may have been given in another unit, one line each."""
    return [
        *_altitude_notes(scenario),
        *_inertia_notes(scenario),
        *_axis_notes(scenario),
        *_lag_notes(scenario),
        *_magnetometer_notes(scenario),
    ]


def _altitude_notes(scenario: Scenario) -> list[str]:
    altitude_km = getattr(scenario.orbit, "altitude_km", None)
    if altitude_km is None or _LOWEST_KM <= altitude_km <= _HIGHEST_KM:
        return []
    if altitude_km < _LOWEST_KM:
        return [
            f"orbit.altitude_km is {altitude_km:g} km: below {_LOWEST_KM:g} km drag ends every "
            "flight within a revolution"
        ]
    metres = f", or is it {altitude_km / 1e3:g} km in metres?"
    meant = metres if _LOWEST_KM <= altitude_km / 1e3 <= _HIGHEST_KM else ""
    return [
        f"orbit.altitude_km is {altitude_km:g} km, far beyond the geostationary orbit's 35786 km"
        f"{meant}"
    ]


def _inertia_notes(scenario: Scenario) -> list[str]:
    """A body that coils of this size could not turn."""
    coils, body = scenario.spacecraft.coils, scenario.spacecraft.body
    if coils is None:
        return []
    limit, moment = float(np.max(coils.limit_a_m2)), float(body.principal()[0].max())
    a_day = math.degrees(limit * _STRONG_FIELD_T / moment) * _DAY_S
    if not 0.0 < a_day < _LEAST_DEG_S_A_DAY:
        return []
    return [
        f"spacecraft.body.inertia_kg_m2 of {moment:.3g} is too large for coils of {limit:g} A m^2, "
        f"which could change its rate by {a_day:.2g} deg/s a day at best: is it in kg m^2 "
        "(1 g cm^2 is 1e-7 kg m^2)?"
    ]


def _axis_notes(scenario: Scenario) -> list[str]:
    """Three coils or more whose axes span only a plane or a line, as two of them are parallel."""
    coils = scenario.spacecraft.coils
    axes = np.array(coils.axes) if coils is not None else np.zeros((0, 3))
    if len(axes) < 3 or np.linalg.matrix_rank(axes, 1e-2) == 3:
        return []
    cosines = np.abs(np.triu(axes @ axes.T, 1))
    pairs = [f"{i} and {j}" for i, j in np.argwhere(cosines > _PARALLEL).tolist()]
    why = f": coils {', '.join(pairs)} are parallel" if pairs else ""
    return [f"spacecraft.coils.axes: the {len(axes)} coils produce no dipole outside a plane{why}"]


def _lag_notes(scenario: Scenario) -> list[str]:
    """Coils that take longer to follow a command than the command lasts."""
    coils, control = scenario.spacecraft.coils, scenario.control
    held_s = control.actuate_s or control.sample_s
    if coils is None or coils.lag_s <= held_s:
        return []
    return [
        f"spacecraft.coils.lag_s of {coils.lag_s:g} s is longer than the {held_s:g} s for which a "
        "command is held: the coils never reach the commanded dipole"
    ]


def _magnetometer_notes(scenario: Scenario) -> list[str]:
    """A range that the field exceeds, and noise that no magnetometer has."""
    sensor, notes = scenario.spacecraft.magnetometer, []
    if 0.0 < sensor.noise_nt < _QUIETEST_NT:
        notes.append(
            f"spacecraft.magnetometer.noise_nt of {sensor.noise_nt:g} nT is below that of any "
            f"magnetometer: is it in tesla ({sensor.noise_nt * 1e9:g} nT)?"
        )
    environment = scenario.orbit_environment()
    duration_s = scenario.steps() * scenario.grid_s
    t_s = np.linspace(0.0, min(scenario.orbit.period_s, duration_s), 50)
    greatest_nt = 1e9 * float(np.linalg.norm(environment.sample(t_s)[:, 3:6], axis=1).max())
    if sensor.range_nt < greatest_nt:
        notes.append(
            f"spacecraft.magnetometer.range_nt of {sensor.range_nt:g} nT is exceeded on this "
            f"orbit, where the field reaches {greatest_nt:.3g} nT: readings will saturate"
        )
    return notes
