"""J. Willis, P. Fisch, A. Seletskiy, Z. Manchester (2024): six laws brake a tumbling CubeSat.

The starts are drawn from the ranges of the study, with draws of our own; all laws have the same.
Several starts share an orbit, so that they fly in lanes.
"""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gallery.studies.flying import digits, fly_all, fly_table, read
from torquer.scenario.change import with_values
from torquer.scenario.load import load_scenario

NAME = "non_monotonic"
SCENARIO = Path(__file__).with_suffix(".toml")
#: Detumbled: so much of the first momentum is left.
LEFT = 0.01
#: Laws by the study's names: functions, published gains.
LAWS = {
    "B-cross": ("b_cross", 4e-5), "B-dot": ("b_dot", 1.0), "B-dot variant": ("b_dot_variant", 0.4),
    "Lyapunov": ("momentum", 2e3), "projection": ("projection", 5e-2),
    "non-monotonic": ("non_monotonic", 3e3),
}  # fmt: skip
#: The last one with the field's rate as the instruments on board give it.
INSTRUMENTS = {"differences": 0.1, "filter of 30 s": 30.0}
_OWN_RATE = {"b_dot", "non_monotonic"}
_SAMPLED = {"b_dot_variant", "non_monotonic_filtered"}
_PARAMETERS = "control.law.parameters."
_RATE_DEG_S, _NOISE_NT = 30.0, 15.0
_NOISY = {"spacecraft.magnetometer.noise_nt": _NOISE_NT,
          "spacecraft.gyro.noise_deg_s": 0.005 * math.sqrt(10.0)}  # fmt: skip
_RESIDUAL_A_M2, _GYRO_BIAS_DEG_S = 0.01, 1.0
FACTORS = (0.3, 1.0, 3.0)


class Case(NamedTuple):
    """What is flown: `starts` on each of `orbits`, from the `first` on; `factor` of the gains.

    None: of each law the best one.
    """

    orbits: int = 5
    starts: int = 16
    isotropic: bool = True
    changes: Mapping = _NOISY
    inclination_deg: tuple[float, float] = (20.0, 160.0)
    factor: float | None = 1.0
    first: int = 0
    residual: bool = False
    gyro_bias: bool = False
    instruments: bool = False


CASES = {
    "no noise": Case(12, 8, isotropic=False, changes={}),
    "short steps": Case(2, 8, isotropic=False, changes={"simulation.step_s": 0.02}),
    "noise": Case(4, 8, isotropic=False),
    "isotropic": Case(),
    **{f"gain x {factor:g}": Case(2, factor=factor) for factor in FACTORS if factor != 1.0},
    "best gains": Case(3, factor=None, first=100),
    "residual dipole": Case(2, residual=True),
    "1 Hz": Case(2, changes=_NOISY | {"control.sample_s": 1.0}),
    "gyro bias": Case(2, gyro_bias=True),
    "instruments": Case(2, instruments=True),
    "low inclination": Case(2, inclination_deg=(0.0, 15.0)),
}


def orbit(number: int, case: Case) -> dict:
    """An orbit, of its number alone."""
    low, high = case.inclination_deg
    inclination, raan, place = np.random.default_rng([2024, number]).random(3)
    return {
        "orbit.inclination_deg": float(low + (high - low) * inclination),
        "orbit.raan_deg": float(360.0 * raan),
        "orbit.argument_of_latitude_deg": float(360.0 * place),
    }


def start(number: int, case: Case) -> dict:
    """Attitude, rate, residual dipole, gyro bias of a start, of its number alone.

    The study draws the parts of each direction from 0 to 1: all are in one octant.
    """
    rng = np.random.default_rng([2025, number])
    parts = rng.standard_normal((3, 3)) if case.isotropic else rng.random((3, 3))
    axis, rate, dipole = (parts.T / np.linalg.norm(parts, axis=1)).T
    half_turn = math.pi * rng.random()
    quaternion = np.array([*(math.sin(half_turn) * axis), math.cos(half_turn)])
    if case.isotropic:
        quaternion = (four := rng.standard_normal(4)) / np.linalg.norm(four)
    found = {"initial.quaternion": quaternion, "initial.rate_deg_s": _RATE_DEG_S * rate}
    if case.residual:
        found["spacecraft.coils.residual_dipole_a_m2"] = _RESIDUAL_A_M2 * dipole
    if case.gyro_bias:
        found["spacecraft.gyro.bias_deg_s"] = _GYRO_BIAS_DEG_S * rng.uniform(-1.0, 1.0, 3)
    return {key: value.tolist() for key, value in found.items()}


def of_law(law: str, case: Case) -> dict:
    """Changes of the scenario for a law, by one of its names."""
    if law in INSTRUMENTS:
        return _changes("non_monotonic_filtered", 3e3, case) | {
            _PARAMETERS + "tau_s": INSTRUMENTS[law]
        }
    function, gain = LAWS[law]
    factor = best_factor(law) if case.factor is None else case.factor
    return _changes(function, factor * gain, case)


def _changes(function: str, gain: float, case: Case) -> dict:
    found = {"control.law.function": function, _PARAMETERS + "gain": gain}
    if function in _OWN_RATE and "spacecraft.magnetometer.noise_nt" in case.changes:
        found[_PARAMETERS + "noise_t_s"] = 1e-9 * _NOISE_NT
    if function in _SAMPLED and "control.sample_s" in case.changes:
        found[_PARAMETERS + "sample_s"] = case.changes["control.sample_s"]
    return found


def of_factor(factor: float) -> str:
    """The case with gains that many times the published ones."""
    return "isotropic" if factor == 1.0 else f"gain x {factor:g}"


def best_factor(law: str) -> float:
    """Of the factors that were flown, the one with most members there, then the soonest."""

    def place(factor: float):
        hours = hours_of(of_factor(factor), law)[: CASES[of_factor(FACTORS[0])].orbits]
        return np.isfinite(hours).sum(), -np.median(np.where(np.isfinite(hours), hours, 2.0))

    return max(FACTORS, key=place)


def hours_of(case: str, law: str) -> np.ndarray:
    """Stored hours [orbit, start] until a case's members are detumbled; NaN where they are not."""
    return np.array([row[law] for row in read(NAME)["cases"][case]["rows"]], dtype=float)


def of_orbit(number: int, law: str, case: Case):
    """The scenario of a law on an orbit, with the first of its starts."""
    first = start(case.starts * number, case)
    changes = {**orbit(number, case), **case.changes, **of_law(law, case), **first}
    return with_values(load_scenario(SCENARIO), changes)


def table(number: int, case: Case) -> dict[str, list]:
    """The starts on an orbit by keys of the scenario."""
    rows = [start(case.starts * number + k, case) for k in range(case.starts)]
    return {key: [row[key] for row in rows] for key in rows[0]}


def hours_below(scenario, starts: dict[str, list], part: float) -> list[float | None]:
    """Hours until each of the starts on an orbit has less than a part of its first momentum."""
    below = {"signal": {"of_start": "momentum_n_m_s"}, "what": {"first_below": part}}
    found = fly_table(scenario, starts, {"below_s": below}, workers=1)
    return [digits(each / 3600.0) for each in found["below_s"].values]


def fly(name: str, orbits: int | None = None) -> list[dict]:
    """Hours of the starts on each orbit of a case, by laws."""
    case = CASES[name]
    numbers = range(case.first, case.first + (orbits or case.orbits))

    def of(number: int) -> dict:
        starts, laws = table(number, case), INSTRUMENTS if case.instruments else LAWS
        return {law: hours_below(of_orbit(number, law, case), starts, LEFT) for law in laws}

    return fly_all(of, numbers)
