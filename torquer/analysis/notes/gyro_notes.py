"""What the author of a scenario with the law `magneto_gyro` should know before the run."""

import cmath
import math
from collections.abc import Callable, Iterator

import numpy as np

from torquer.analysis.notes.uses import Use, notes_on_laws
from torquer.computer.laws.magneto_gyro.law import MagnetoGyro
from torquer.computer.laws.magneto_gyro.stage_1 import filtered_component
from torquer.maths.geometry.quaternion import to_dcm
from torquer.scenario.spec import Scenario
from torquer.theory.magneto_gyro.craft import GyroCraft, greatest_tip_off

#: Part by which the satellite's wheel, the orbital rate and the time with coils on may differ from
#: what the law knows. Within it errors grow little.
_KNOWN = 0.2
#: Inclination [deg] to the equator below which some starts were not captured within 25 revolutions.
_LEAST_INCLINATION_DEG = 25.0
#: Part of the damping of stage 1 that holds must leave.
_LEAST_DAMPING = 0.05


def gyro_notes(scenario: Scenario) -> list[str]:
    """Notes on every law of this kind, one line each."""
    return [*notes_on_laws(scenario, _CHECKS)]


def _of_this_kind(check) -> Callable[[Scenario, Use], list[str]]:
    """A check of this law's parameters as one of any law in use."""
    return lambda scenario, use: (
        [*check(scenario, use.law)] if isinstance(use.law, MagnetoGyro) else []
    )


def _wheel_notes(scenario: Scenario, law: MagnetoGyro) -> Iterator[str]:
    """A wheel too weak for stage 1, or not the one that the law knows; none with driven wheels."""
    if scenario.spacecraft.wheels is not None:
        return
    turn = np.array(to_dcm(law.q_wanted()))
    inertia = np.diag(turn @ np.array(scenario.spacecraft.body.inertia) @ turn.T).tolist()
    wheel = float((turn @ np.array(scenario.spacecraft.body.wheel_momentum_n_m_s))[1])
    rate = scenario.orbit.rate_rad_s(scenario.start)
    craft, known = GyroCraft(tuple(inertia), wheel, rate), law.bias_momentum_n_m_s
    if craft.stiffness <= 0.0:
        yield (
            f"a wheel of {wheel:g} N m s along the orbit normal cannot hold roll and yaw: stage 1 "
            f"needs more than {craft.wheel_at(0.0):.4g} N m s (h > 0)"
        )
    elif abs(wheel - known) > _KNOWN * abs(known):
        yield (
            f"the wheel has {wheel:g} N m s along the orbit normal, and bias_momentum_n_m_s of the "
            f"law is {known:g}"
        )


def _orbit_notes(scenario: Scenario, law: MagnetoGyro) -> Iterator[str]:
    orbit = scenario.orbit
    rate, known = orbit.rate_rad_s(scenario.start), law.orbital_rate_rad_s
    if abs(rate - known) > _KNOWN * rate:
        yield (
            f"the mean orbital rate is {rate:.4g} rad/s, and orbital_rate_rad_s of the law is "
            f"{known:.4g}"
        )
    extent = orbit.extent(scenario.start)
    tilt_deg = math.degrees(extent.inclination_rad) if extent else 90.0
    if min(tilt_deg, 180.0 - tilt_deg) < _LEAST_INCLINATION_DEG:
        yield (
            f"an inclination of {tilt_deg:g} deg is too near to the equator for magneto_gyro: the "
            f"field hardly turns in the orbit's plane, and below {_LEAST_INCLINATION_DEG:g} deg "
            "some starts are not captured"
        )


def _duty_notes(scenario: Scenario, law: MagnetoGyro) -> Iterator[str]:
    duty = scenario.control.coil_duty
    if abs(duty - law.coil_duty) > _KNOWN * duty:
        yield (
            f"the coils are on for {100.0 * duty:.3g} % of the time, and coil_duty of the law is "
            f"{law.coil_duty:g}: stage 2 points worse"
        )


def _rate_notes(scenario: Scenario, use: Use) -> Iterator[str]:
    """A tip-off rate beyond the filters of stage 1, or holds that leave no damping."""
    law = use.law
    if not (use.at_start and isinstance(law, MagnetoGyro)):
        return
    initial = scenario.initial
    if initial.rate_relative_to != "inertial":
        return
    rate = math.radians(float(np.linalg.norm(initial.rate_deg_s)))
    limit = greatest_tip_off(law.filter_rate_rad_s)
    if rate > limit:
        yield (
            f"the initial rate of {math.degrees(rate):.3g} deg/s is above the "
            f"{math.degrees(limit):.3g} deg/s that stage 1 brakes with filters of "
            f"{law.filter_rate_rad_s:g} rad/s"
        )
        return
    hold_s = scenario.control.longest_hold_s
    grid = np.geomspace(min(2.0 * law.orbital_rate_rad_s, 0.5 * limit), limit, 60).tolist()
    left = min((damping_left(law, each, hold_s) for each in grid if each <= rate), default=1.0)
    if left <= _LEAST_DAMPING:
        yield (
            f"dipoles held for {hold_s:g} s leave stage 1 no damping at some rates up to the "
            f"initial {math.degrees(rate):.3g} deg/s"
        )


def damping_left(law: MagnetoGyro, rate_rad_s: float, hold_s: float) -> float:
    """Part of its damping that stage 1 keeps at a rate across the field, by filters and holds.

    Im F(z)/w sin(w T)/(w T), z = exp(i w T), with the filters' response F when each reading is
    taken for the field since the last: x_{k+1} = A x_k + b u_{k+1}.
    """

    def after(low, slope, value):
        link = law.filter_rate_rad_s, law.filter_damping, hold_s
        return filtered_component(low, slope, value, *link)

    a = np.array([after(1.0, 0.0, 0.0), after(0.0, 1.0, 0.0)]).T
    angle = rate_rad_s * hold_s
    z = cmath.exp(1j * angle)
    response = np.linalg.solve(z * np.eye(2) - a, z * np.array(after(0.0, 0.0, 1.0)))[1]
    return float(response.imag / rate_rad_s * np.sinc(angle / math.pi))


_CHECKS = {
    "the wheel of magneto_gyro": _of_this_kind(_wheel_notes),
    "the orbit of magneto_gyro": _of_this_kind(_orbit_notes),
    "the duty of the coils": _of_this_kind(_duty_notes),
    "the tip-off rate": _rate_notes,
}
