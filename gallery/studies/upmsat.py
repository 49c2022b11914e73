"""A. Porras-Hermoso and others (2024): UPMSat-2, a B-dot that keeps a rate of rotation, in orbit.

Inertia, orbit, gain, wanted rate, coils, magnetometers and the cycle on board are printed; the
first motion is not, nor how the field's rate follows from the five readings of a cycle.
"""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gallery.studies.flying import digits, first_attitude, fly_all, read
from torquer.analysis.series import stays_from
from torquer.maths.geometry.attitudes import to_body
from torquer.scenario.change import with_values
from torquer.scenario.load import load_scenario
from torquer.simulation.setup.simulate import simulate

NAME = "upmsat"
SCENARIO = Path(__file__).with_suffix(".toml")
#: Wanted rate [rad/s]; revolutions after which the motion is looked at; settled within [deg].
WANTED_RAD_S, SETTLED_AFTER, WITHIN_DEG = 0.1, 15, 10.0
#: Greatest first rate about an axis [deg/s], ours; error of the magnetometers, residual dipole.
_RATE_DEG_S, _NOISE_NT, _BIAS_NT, _RESIDUAL_A_M2 = 3.0, 2.0, 25.0, 0.075
_GAIN = "control.law.parameters.gain"
_ON_BOARD = {"control.law.function": "on_board", "spacecraft.magnetometer.noise_nt": _NOISE_NT}


class Case(NamedTuple):
    """Starts, and changes to the scenario; `errs`: with residual dipole and magnetometer bias."""

    starts: int
    changes: Mapping
    errs: bool = False


CASES = {
    "tilted dipole": Case(8, {"environment.field.degree": 1}),
    "all of the field": Case(8, {}),
    "short steps": Case(2, {"control.sample_s": 0.02, "simulation.step_s": 0.02}),
    "a tenth of the gain": Case(8, {_GAIN: 1e7}),
    "a hundredth": Case(8, {_GAIN: 1e6}),
    "on board": Case(8, _ON_BOARD, errs=True),
    "on board, short steps": Case(2, _ON_BOARD | {"simulation.step_s": 0.02}, errs=True),
    "between cycles": Case(
        8, _ON_BOARD | {"control.law.parameters.between_cycles": 1.0}, errs=True
    ),
}  # fmt: skip


def start(number: int, errs: bool) -> dict:
    """First motion and errors of a start, of its number alone."""
    rng = np.random.default_rng([2020, number])
    found = {
        "initial.quaternion": first_attitude(2020, number),
        "initial.rate_deg_s": rng.uniform(-_RATE_DEG_S, _RATE_DEG_S, 3),
    }
    if errs:
        parts = rng.standard_normal((2, 3))
        residual, bias = (parts.T / np.linalg.norm(parts, axis=1)).T
        found["spacecraft.coils.residual_dipole_a_m2"] = _RESIDUAL_A_M2 * residual
        found["spacecraft.magnetometer.bias_nt"] = _BIAS_NT * bias
    return {key: value.tolist() for key, value in found.items()}


def flight(case: str, number: int):
    """The scenario of a case from one of the starts."""
    given = CASES[case]
    return with_values(load_scenario(SCENARIO), start(number, given.errs) | dict(given.changes))


def flown(scenario) -> dict:
    """How axis 3 lies and turns once it has settled: angles [deg], rates [rad/s]."""
    result = simulate(scenario)
    normal = np.cross(result["position_inertial"].values, result["velocity_inertial"].values)
    sun = result["sun_inertial"].values
    q, t_s = result["q_body_to_inertial"].values, result["time"].values
    off, late = _angle(to_body(q, normal)), t_s >= SETTLED_AFTER * scenario.orbit.period_s
    # to the Sun, of the other end of the axis, as published: less than that of the normal's
    moved = _angle(to_body(q, -sun))[late] - _angle_between(-normal, sun)[late]
    rate = result["omega_body"].values[late, 2]
    return {
        "settled_h": digits(stays_from(t_s, off < WITHIN_DEG) / 3600.0),
        "off_deg": digits(off[late].mean()),
        "off_most_deg": digits(off[late].max()),
        "sun_moved_deg": digits(moved.mean()),
        "sun_sd_deg": digits(moved.std()),
        "rate_rad_s": digits(rate.mean()),
        "least_rad_s": digits(rate.min()),
        "most_rad_s": digits(rate.max()),
    }


def _angle(v: np.ndarray) -> np.ndarray:
    """Angle [deg] of vectors (n, 3) from axis 3."""
    return np.degrees(np.arctan2(np.hypot(v[:, 0], v[:, 1]), v[:, 2]))


def _angle_between(v: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Angle [deg] between vectors (n, 3)."""
    across = np.linalg.norm(np.cross(v, w), axis=1)
    return np.degrees(np.arctan2(across, (v * w).sum(axis=1)))


def column(case: str, key: str) -> np.ndarray:
    """Stored numbers of a case's starts; NaN for what there is not."""
    return np.array([row[key] for row in read(NAME)["cases"][case]["rows"]], dtype=float)


def settled_h(case: str) -> np.ndarray:
    """Hours after which a case's starts stay near the normal; NaN if not in the first half."""
    hours = column(case, "settled_h")
    half = SETTLED_AFTER * load_scenario(SCENARIO).orbit.period_s / 3600.0
    return np.where(hours < half, hours, np.nan)


def above_wanted(case: str, key: str) -> np.ndarray:
    """Rates of a case's starts above the wanted one, in orbital rates."""
    per_orbit = 2.0 * math.pi / load_scenario(SCENARIO).orbit.period_s
    return (column(case, key) - WANTED_RAD_S) / per_orbit


def fly(case: str, starts: int | None = None) -> list[dict]:
    """How each start settles."""
    return fly_all(flown, [flight(case, k) for k in range(starts or CASES[case].starts)])
