"""Cases inside, at and beyond the conditions of the averaged motion, with what truly happens.

The truth is the median of nine true motions from other phases than those that the product flies;
the time is the last at which the quantity is still on the wrong side, of all points.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from torquer.computer.laws.built_in import BUILT_IN
from torquer.theory.averaged.answer import LawMotion, law_motion
from torquer.theory.averaged.requests import LawRequest
from torquer.theory.slow.full_motion import by_euler_from

#: A formula is right within the first factor, and wrong beyond the second.
RIGHT, WRONG = 1.25, 1.5
_POINTS = 3000
_PHASES = [(0.4 + 0.7 * k, 1.0 + 0.7 * (k % 3)) for k in range(9)]
_ORBIT = {"altitude_km": 600.0}


class WhereCase(NamedTuple):
    """What is asked, and the condition that it tries."""

    about: str
    law: str
    asked: dict
    part: float = 0.1


def _bdot(about, inclination, rate, rho, gain=1e5, part=0.1, inertia=(1.0, 1.0, 1.5)):
    asked = {"inclination_deg": inclination, "rate_deg_s": (rate,) * 3, "rho_deg": rho}
    return WhereCase(about, "bdot", {**asked, "gain": gain, "inertia": inertia}, part)


def _spun(about, law, gain, inclination, inertia=(1.0, 1.0, 1.5), rate=(1.0, 1.0, 6.0), **more):
    part = 2.0 if law == "spin_up" else 0.1
    asked = {"inclination_deg": inclination, "gain": gain, "inertia": inertia, "rate_deg_s": rate}
    return WhereCase(about, law, {"rho_deg": 40.0, **asked, **more}, part)


CASES = [
    *(_bdot("turning field", 51.6, rate, 30.0) for rate in (8, 6, 4, 3, 2, 1.5, 1, 0.7, 0.5)),
    *(_bdot("tilt", i, 3, 0.0, part=0.2) for i in (0, 2, 5, 10, 15, 20, 25, 30, 40, 51.6, 70, 90)),
    *(_bdot("direction", 70.0, 5, rho) for rho in (30.0, 60.0, 90.0)),
    *(_bdot("gain", 65.0, 8, 50.0, gain) for gain in (1e5, 2e5, 4e5, 8e5, 1.6e6, 4e6)),
    *(_spun("moments", "nutation_damping", 1e5, 80.0, (1.0, 1.0 + x, 1.5))
      for x in (0.0, 0.05, 0.1, 0.2, 0.3, 0.4)),
    *(_spun("moments", "nutation_damping", 1e5, 60.0, (2.0, 2.0 + x, 1.2))
      for x in (0.1, 0.5, 0.9)),
    *(_spun("tilt", "nutation_damping", 1e5, i) for i in (0.0, 10.0, 30.0, 50.0, 70.0, 90.0)),
    *(_spun("nutation", "reorientation", 5e4, 70.0, rate=(x, 0.0, 6.0))
      for x in (0.0, 0.3, 1.0, 2.0, 4.0)),
    *(_spun("Sun", "sdot", 3.0, 60.0, sun_deg=sun) for sun in (0.0, 20.0, 60.0, 80.0)),
    *(_spun("Sun", "sdot", 3.0, 10.0, sun_deg=sun) for sun in (0.0, 30.0, 60.0, 89.0)),
    *(_spun("spin", "spin_up", gain, 60.0) for gain in (500.0, 2000.0)),
]  # fmt: skip
REFUSED = [
    _spun("order", law, gain, 80.0, (1.0, 2.0, 1.5), **more)
    for law, gain, more in (
        ("nutation_damping", 5e5, {}), ("spin_up", 50.0, {}), ("reorientation", 5e5, {}),
        ("preliminary_1", 50.0, {}), ("preliminary_2", 50.0, {}), ("sdot", 3.0, {"sun_deg": 30.0}),
    )
]  # fmt: skip


def answer(case: WhereCase) -> LawMotion:
    """The product's answer."""
    asked = LawRequest(**_ORBIT, **case.asked, to=100.0 * case.part)
    return law_motion(case.law, asked)


def truth(case: WhereCase, found: LawMotion) -> float:
    """Revolutions that it takes: the median of true motions; infinite if most do not come there."""
    formula = found.found["revolutions"]["median"]
    span = 3.0 * formula if formula is not None else 150.0
    return sorted(_flown(case, found, span, *phase) for phase in _PHASES)[len(_PHASES) // 2]


def _flown(case: WhereCase, found: LawMotion, span: float, angle: float, day: float) -> float:
    spinner, gain = found.case.spinner, case.asked["gain"]
    inclination = math.radians(spinner.inclination_deg)
    w = math.sqrt(1.0 + 3.0 * math.sin(inclination) ** 2)
    cone = math.atan2(math.sin(inclination) * (2.0 + w), math.cos(inclination) * (1.0 + w))
    to_y = Rotation.from_euler("x", cone)
    true_field = {"field": "tilted_dipole", "field_turn": True, "tilt_deg": 170.8,
                  "strength_t": 2.0 * spinner.strength_t / (1.0 + w)}  # fmt: skip
    inertia, rate = np.diag(case.asked["inertia"]), np.radians(case.asked["rate_deg_s"])
    target = np.array([0.0, 0.0, 1.0])
    if case.law == "sdot":
        sun = math.radians(case.asked["sun_deg"])
        target = np.array([math.sin(sun), 0.0, math.cos(sun)])
        true_field["sun"] = tuple(to_y.apply(target))
    rho = math.radians(case.asked["rho_deg"])
    along = to_y.apply([math.sin(rho), 0.0, math.cos(rho)])
    momentum = inertia @ rate
    attitude = Rotation.align_vectors([along], [momentum / np.linalg.norm(momentum)])[0]
    attitude = Rotation.from_rotvec(angle * along) * attitude
    u = np.linspace(0.0, 2.0 * math.pi * span, _POINTS)
    states = by_euler_from(
        _law(case, gain, tuple(to_y.apply(target)), inertia, float(np.linalg.norm(momentum))),
        spinner.model_copy(update=true_field), inertia, [*attitude.as_quat(), *rate], u, day=day,
        rtol=1e-8,
    )  # fmt: skip
    value = _value(case, states, inertia, to_y.apply(target))
    short = value > case.part * value[0] if case.part < 1.0 else value < case.part * value[0]
    last = np.flatnonzero(short)[-1]
    return math.inf if last == _POINTS - 1 else u[last + 1] / (2.0 * math.pi)


def _law(case: WhereCase, gain, target, inertia, length):
    moments = tuple(np.diag(inertia).tolist())
    return {
        "bdot": lambda: BUILT_IN["bdot_derivative"](gain_a_m2_s_per_t=gain),
        "nutation_damping": lambda: BUILT_IN["nutation_damping_derivative"](gain_a_m2_s_per_t=gain),
        "spin_up": lambda: BUILT_IN["spin_up"](gain_a_m2_per_t=gain),
        "sdot": lambda: BUILT_IN["sdot_rate"](gain_a_m2_s=gain),
        "reorientation": lambda: BUILT_IN["reorientation"](
            gain_a_m2_per_n_m_s_t=gain, target=target, momentum_n_m_s=length, inertia_kg_m2=moments
        ),
    }[case.law]().law()


def _value(case: WhereCase, states, inertia, target) -> np.ndarray:
    body = states[:, 4:] @ inertia
    if case.law == "bdot":
        return np.linalg.norm(body, axis=1)
    if case.law == "nutation_damping":
        return np.hypot(body[:, 0], body[:, 1])
    if case.law == "spin_up":
        return body[:, 2]
    momentum = Rotation.from_quat(states[:, :4]).apply(body)
    cosine = momentum @ target / np.linalg.norm(momentum, axis=1)
    angle = np.arccos(np.clip(cosine, -1.0, 1.0))
    return np.minimum(angle, math.pi - angle) if case.law == "sdot" else angle
