"""R. Fonod, E. Gill (2018): a PocketQube that tumbles at 312 deg/s, plain and weighted B-dot.

The members are drawn from the distributions that the study publishes, with draws of our own: mass,
inertias on top of it, coils, residual dipole, bias of the magnetometers. The gain follows from the
mass. Its data files are not here; whoever has them makes a table of them, one row a member.
"""

import math
from pathlib import Path

import numpy as np
from scipy.optimize import brentq
from scipy.stats import truncnorm

from gallery.studies.flying import UNDER_WAY, digits, fly_all, fly_table
from torquer.campaign.store import remove
from torquer.scenario.change import with_values
from torquer.scenario.load import load_scenario
from torquer.simulation.setup.simulate import simulate

NAME = "pocketqube"
SCENARIO = Path(__file__).with_suffix(".toml")
LAWS = {"plain": 0.0, "weighted": 1.0}
#: Bounds of the normal distributions, in standard deviations.
_CUT = 3.0
_MASS_KG, _MASS_SIGMA = 0.6, 0.1
#: Standard deviations of an inertia, of a coil's dipole, of the residual dipole, as parts.
_INERTIA, _COIL, _RESIDUAL = 1.0 / 20.0, 1.0 / 15.0, 1.0 / 10.0
_COIL_A_M2, _RESIDUAL_A_M2, _BIAS_NT = 0.002, 1e-4, 400.0
_GAIN = "control.law.parameters.gain_a_m2_t_s"
_FULL = "control.law.parameters.full_a_m2"

#: What is flown: members, and changes to the scenario for each.
CASES: dict[str, tuple[int, dict]] = {
    "as published": (500, {"simulation.integrator": "rk4"}),
    "converged": (128, {"simulation.integrator": "splitting"}),
    "10 Hz": (48, {"simulation.integrator": "splitting", "simulation.step_s": 0.1,
                   "simulation.revolutions": 72.0, "control.sample_s": 0.1,
                   "control.law.parameters.sample_s": 0.1}),
}  # fmt: skip
#: Of each member. A flight ends where it is detumbled: then no axis is faster than 5 deg/s.
OUTCOMES = {
    "stopped_s": {"signal": "rate_fastest_axis_deg_s", "what": {"first_below": 5.0}},
    "on_s": {"signal": "law.on_s", "what": {"at_end": True}},
    "greatest_deg_s": {"signal": "rate_deg_s", "what": {"greatest_after_s": 0.0}},
    "final_deg_s": {"signal": "rate_deg_s", "what": {"at_end": True}},
}


def table(count: int) -> dict[str, list]:
    """The first `count` members by keys of the scenario, one row each."""
    nominal = load_scenario(SCENARIO)
    rows = [_possible(nominal, np.random.default_rng([2018, member])) for member in range(count)]
    return {key: [row[key] for row in rows] for key in rows[0]}


def _possible(nominal, rng) -> dict:
    """The first draw that is a body: with three inertias drawn apart some are of no mass at all."""
    while True:
        row = _drawn(nominal, rng)
        if is_body(row["spacecraft.body.inertia_kg_m2"]):
            return row


def is_body(inertia: list[float]) -> bool:
    """Whether no principal moment exceeds the sum of the two others."""
    return 2.0 * max(inertia) <= sum(inertia)


def _drawn(nominal, rng) -> dict:
    mass = 1.0 + _MASS_SIGMA / _MASS_KG * _cut_normal(rng)
    own = np.diag(nominal.spacecraft.body.inertia_kg_m2)
    coils = _COIL_A_M2 * (1.0 + _COIL * np.array([_cut_normal(rng) for _ in range(3)]))
    bias = 0.5 * _BIAS_NT * (_direction(rng) + _direction(rng))
    return {
        "spacecraft.body.inertia_kg_m2": [
            float(j) * mass * (1.0 + _INERTIA * _cut_normal(rng)) for j in own
        ],
        "spacecraft.coils.limit_a_m2": coils.tolist(),
        _FULL: coils.tolist(),
        "spacecraft.coils.residual_dipole_a_m2": (
            _RESIDUAL_A_M2 * (1.0 + _RESIDUAL * _cut_normal(rng)) * _direction(rng)
        ).tolist(),
        "spacecraft.magnetometer.bias_nt": bias.tolist(),
        _GAIN: gain_a_m2_t_s(nominal.orbit, mass * float(own.min())),
    }


def _cut_normal(rng) -> float:
    """A normal number within bounds whose standard deviation is 1 there."""
    return float(truncnorm.ppf(rng.random(), -_CUT / _WIDTH, _CUT / _WIDTH) * _WIDTH)


_WIDTH = brentq(lambda s: s * truncnorm.std(-_CUT / s, _CUT / s) - 1.0, 1.0, 1.2)


def _direction(rng) -> np.ndarray:
    """As the study draws it, by two angles: denser at the poles than an isotropic one."""
    a, b = rng.uniform(0.0, 2.0 * math.pi, 2)
    return np.array([math.sin(a) * math.cos(b), math.sin(a) * math.sin(b), math.cos(a)])


def gain_a_m2_t_s(orbit, least_inertia: float) -> float:
    """Gain of B-dot by the field's direction: G. Avanzini, F. Giulietti (2012), (25)."""
    tilt, inclination = math.radians(11.44), math.radians(orbit.inclination_deg)
    to_dipole = math.acos(math.cos(inclination - tilt))
    return 2.0 * 2.0 * math.pi / orbit.period_s * (1.0 + math.sin(to_dipole)) * least_inertia


def of_law(case: str, law: str):
    """The nominal satellite in a case, with a law."""
    changes = CASES[case][1] | {"control.law.parameters.weighted": LAWS[law]}
    return with_values(load_scenario(SCENARIO), changes)


def flown(case: str, law: str, count: int, to: Path | None = None) -> list[dict]:
    """When members stopped [h], time on of all coils until then [h], rates [deg/s]."""
    found = fly_table(of_law(case, law), table(count), OUTCOMES, workers=1, to=to)
    stopped_h, on_h = (found[key].values / 3600.0 for key in ("stopped_s", "on_s"))
    columns = {
        "stopped_h": stopped_h,
        "on_h": np.where(np.isfinite(stopped_h), on_h, np.nan),
        "greatest_deg_s": found["greatest_deg_s"].values,
        "final_deg_s": found["final_deg_s"].values,
    }
    return [{key: digits(values[k]) for key, values in columns.items()} for k in range(count)]


def fly(case: str, count: int | None = None) -> list[dict]:
    """All members of a case with both laws."""
    count = count or CASES[case][0]
    files = {law: UNDER_WAY / f"{NAME} {case} {law}.nc" for law in LAWS}
    rows = fly_all(lambda law: flown(case, law, count, files[law]), LAWS)
    for file in files.values():
        remove(file)
    return [dict(zip(LAWS, member, strict=True)) for member in zip(*rows, strict=True)]


def damped_part(hours: float, integrator: str) -> float:
    """Part of its momentum that the nominal body loses by the steps alone, without any torque."""
    free = with_values(load_scenario(SCENARIO), {
        "spacecraft.coils": None, "control.law": {"kind": "off"},
        "simulation.integrator": integrator, "simulation.revolutions": None,
        "simulation.duration_s": 3600.0 * hours, "simulation.record_s": 60.0,
    })  # fmt: skip
    first, last = simulate(free)["momentum_inertial"].values[[0, -1]]
    return float(1.0 - np.linalg.norm(last) / np.linalg.norm(first))


def impossible_part(draws: int) -> float:
    """Part of the draws whose inertias no distribution of mass has."""
    nominal = load_scenario(SCENARIO)
    rows = (_drawn(nominal, np.random.default_rng([2018, k])) for k in range(draws))
    return float(np.mean([not is_body(row["spacecraft.body.inertia_kg_m2"]) for row in rows]))


def fly_alone(draws: int | None = None) -> list[dict]:
    """What the steps do by themselves, and how many draws are no bodies."""
    draws = draws or 500
    return [
        {"hours": 1.0, "rk4": digits(damped_part(1.0, "rk4")),
         "splitting": digits(damped_part(1.0, "splitting"))},
        {"draws": draws, "impossible": digits(impossible_part(draws))},
    ]  # fmt: skip
