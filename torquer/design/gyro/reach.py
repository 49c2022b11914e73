"""What a magneto-gyroscopic design can do, by linear theory: errors, margins, orbits."""

import numpy as np

from torquer.design.gyro.case import GyroCase
from torquer.design.requests import MagnetoGyroRequest
from torquer.theory.magneto_gyro.accuracy import follow_revolution, noise_error, steady_motion
from torquer.theory.magneto_gyro.along_orbit import model_error
from torquer.theory.magneto_gyro.day import (
    ALTITUDES_KM,
    INCLINATIONS_DEG,
    DayLoop,
    Range,
    degree_over_a_day,
    stable_range,
)
from torquer.theory.magneto_gyro.satellite import noise_intensity
from torquer.theory.magneto_gyro.stage_2 import stage_2_loop
from torquer.theory.magneto_gyro.stage_2_gains import Stage2Design, design_stage_2

#: Other degrees, over the wanted one, for which the error is found; loops of their searches.
_OTHER_DEGREES, EVALUATIONS = (0.6, 1.2), 60
#: What is wrong with an orbit, up to its inclination.
EQUATOR = (
    "orbit: must not come so near to the magnetic equator that stage 2 is unstable; received an "
    "inclination of"
)


def stable_reach(case: GyroCase, loop: DayLoop) -> tuple[float, Range, Range]:
    """Degree over a day; inclinations and altitudes around the orbit's own with stable loops."""
    own = degree_over_a_day(loop, case.inclination_deg)
    if not own > 0.0:
        raise ValueError(
            f"{EQUATOR} {case.inclination_deg:.4g} deg, where its degree over a day is {own:.3g}"
        )
    inclinations = stable_range(
        lambda x: degree_over_a_day(loop, x), case.inclination_deg, INCLINATIONS_DEG
    )
    altitudes = stable_range(
        lambda x: degree_over_a_day(loop.at(x), case.inclination_deg), case.altitude_km,
        ALTITUDES_KM,
    )  # fmt: skip
    return own, inclinations, altitudes


def pointing_errors(case: GyroCase, second: Stage2Design, form: str) -> dict[str, np.ndarray]:
    """Root mean squares [deg] by what causes them, in the usual field."""
    scenario, craft, along = case.scenario, case.craft, case.along
    loop = stage_2_loop(
        craft.satellite(), craft.gyrostat, second.gains, normal=along.normal, form=form
    )
    around, meter = follow_revolution(loop), scenario.spacecraft.one_of("magnetometer")
    noise = noise_intensity(scenario, craft, along.strength_t)
    bias = [0.0, 0.0, 0.0, *(1e-9 / along.strength_t * np.array(meter.bias_nt))]
    disturbance = scenario.disturbance
    constant = np.zeros(3) if disturbance is None else disturbance.constant_torque_n_m
    torque = [*(np.array(constant) / craft.torque_unit), 0.0, 0.0, 0.0]
    radians = {
        "noise": noise_error(around, [0.0] * 3 + [noise] * 3),
        "field model": model_error(around, along),
        "bias": _rms(steady_motion(around, bias)),
        "torque": _rms(steady_motion(around, torque)),
    }
    return {name: np.degrees(error) for name, error in radians.items()}


def total_error(errors: dict[str, np.ndarray]) -> float:
    """Root mean square of the whole angle [deg], of errors by their independent causes."""
    return float(np.linalg.norm(list(errors.values())))


def degree_costs(case: GyroCase, request: MagnetoGyroRequest) -> list[tuple[float, float]]:
    """Degrees and errors of designs for other degrees, where a stable loop is found."""
    found = []
    for part in _OTHER_DEGREES:
        try:
            other = design_stage_2(
                case.craft, normals=case.along.normals, form=request.form,
                wanted_degree=part * request.degree,
                evaluations=min(EVALUATIONS, request.evaluations),
            )  # fmt: skip
        except ArithmeticError:
            continue
        found.append((other.degree, total_error(pointing_errors(case, other, request.form))))
    return found


def _rms(motion) -> np.ndarray:
    return np.sqrt(np.mean(motion[:, :3] ** 2, axis=0))


def find_margins(case: GyroCase, loop: DayLoop) -> dict[str, float]:
    """Degrees over a day of a satellite, or of an orbit, that is not what the law knows."""
    s, inclination = loop.craft.satellite(), case.inclination_deg
    others = {
        "inertia -20 %": s._replace(x=0.8 * s.x, y=0.8 * s.y, z=0.8 * s.z),
        "inertia +20 %": s._replace(x=1.2 * s.x, y=1.2 * s.y, z=1.2 * s.z),
        "wheel -10 %": s._replace(wheel=0.9 * s.wheel),
        "wheel +10 %": s._replace(wheel=1.1 * s.wheel),
    }
    found = {
        name: degree_over_a_day(loop._replace(actual=other), inclination)
        for name, other in others.items()
    }
    for change in (-10.0, 10.0):
        moved = degree_over_a_day(loop, inclination + change)
        found[f"inclination {change:+.0f} deg"] = moved
    return found
