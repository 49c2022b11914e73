"""The closed loop of a scenario along its flight, and what acts on it there."""

import math
from typing import NamedTuple

import numpy as np

from torquer.analysis.budget import budget_while_held
from torquer.analysis.causes import GAPS, SAMPLING, acting_causes
from torquer.analysis.pointing.causes import holder_of
from torquer.computer.blocks.law import Law
from torquer.computer.estimation.sensors import SensorReadings
from torquer.computer.laws.wheel_tracking import WheelTracking
from torquer.maths.geometry.attitudes import to_body, to_reference
from torquer.scenario.change import value_at, with_values
from torquer.scenario.spec import Scenario
from torquer.theory.three_axis.effects import Loop, Wheels, decay_s, make_loop, part_left
from torquer.theory.three_axis.hold import AttitudeHold
from torquer.theory.three_axis.linearise import wanted_motion
from torquer.theory.three_axis.sampled import Cycle, SampledHold
from torquer.theory.three_axis.wheel_hold import WheelHold

#: Causes that change the loop on the way.
_CHANGES = (GAPS, SAMPLING)
#: What is part of the loop: the control cycle.
_CYCLE = "cycle"


class Setting(NamedTuple):
    """A scenario that starts in the attitude that it holds, and its linear loop, n commands.

    `torques` (n, 3) [N m] in the body at the wanted attitude, in the middle of each cycle, by key
    of `torquer.analysis.budget.NAMES`; `q_wanted` (n, 4), `rate_rad_s` (n, 3): the wanted motion;
    `momentum_n_m_s` (n, 3): of the wheels, in the body, None without; `size`: commands in a window
    of stability; `first`: the command from which on errors count, at the start of a window.
    """

    scenario: Scenario
    hold: AttitudeHold
    loop: Loop
    torques: dict[str, np.ndarray]
    q_wanted: np.ndarray
    rate_rad_s: np.ndarray
    momentum_n_m_s: np.ndarray | None
    size: int
    first: int


def held_scenario(scenario: Scenario) -> Scenario:
    """The scenario from the attitude that its law holds, at rest there, recorded at each cycle.

    ValueError for what a pointing budget has no theory of.
    """
    law = _linear_law(scenario)
    _check_devices(scenario)
    reference = "orbital" if law.values()["orbital"] else "inertial"
    still = {
        "reference": reference, "quaternion": law.values()["q_wanted"],
        "rate_deg_s": (0.0, 0.0, 0.0), "rate_relative_to": reference,
    }  # fmt: skip
    whole = {"simulation.record_s": scenario.control.cycle_s, "simulation.end_when": None}
    return with_values(scenario, {"initial": still, **whole})


def _linear_law(scenario: Scenario) -> Law:
    """The law that holds the attitude, as linear theory has it; ValueError for targets that move in
    both frames, along which its loop is not the same all the time."""
    name, spec = holder_of(scenario)
    if not isinstance(spec, WheelTracking):
        return spec.law()
    if (law := spec.at_rest()) is None:
        raise ValueError(
            f"control.{scenario.control.key_of(name)}.target: must be 'nadir' with 'orbit_normal' "
            "or 'velocity', or a direction with another direction, for a pointing budget, whose "
            "linear theory is of an attitude at rest in the orbital or the inertial frame; "
            f"received {' and '.join(str(each) for each in spec.targets)}"
        )
    return law


def _check_devices(scenario: Scenario) -> None:
    craft, control = scenario.spacecraft, scenario.control
    if not isinstance(control.estimator, SensorReadings):
        raise ValueError(
            "control.estimator: must be left out for a pointing budget, where attitude and rate "
            f"are those of attitude sensor and gyro; received {control.estimator.kind!r} "
            "(`torquer filter-check` has the errors of a filter)"
        )
    for key, flown in craft.flown().items():
        kind = flown.device.kind
        if kind in ("attitude_sensor", "gyro") and key != kind:
            raise ValueError(
                f"spacecraft.{key}: must be left out for a pointing budget, whose linear theory is "
                f"of one attitude_sensor and one gyro; received {flown.said}"
            )
    wheels, by_wheels = craft.wheels, holder_of(scenario)[1].answers == "torque"
    if craft.coils is not None and not by_wheels:
        craft.coils.check_axes("a pointing budget")
    keys = [
        key
        for cause in acting_causes(scenario)
        if cause.group in _CHANGES and cause.name != _CYCLE
        for key in cause.off
    ]
    keys += ["control.measure_s"] if by_wheels and control.measure_s else []
    if wheels is not None and wheels.minimum_speed_fraction is not None:
        keys.append("spacecraft.wheels.minimum_speed_fraction")
    for key in keys:
        raise ValueError(
            f"{key}: must be left out for a pointing budget, whose linear theory is of the same "
            f"loop all the time; received {value_at(scenario, key)}"
        )


def _check_range(scenario: Scenario, rates_rad_s: np.ndarray) -> None:
    """ValueError for a gyro that cannot read the wanted rates."""
    gyro = scenario.spacecraft.one_of("gyro")
    greatest = math.degrees(np.abs(rates_rad_s).max())
    if gyro.range_deg_s <= greatest:
        raise ValueError(
            f"spacecraft.gyro.range_deg_s: must be above the wanted rate, {greatest:.4g} deg/s, "
            f"for a pointing budget; received {gyro.range_deg_s:g}"
        )


def make_setting(scenario: Scenario, window_s: float) -> Setting:
    """The setting of a scenario by `held_scenario`.

    ValueError for a law without linear theory, and where errors at the start have not decayed by
    half of the run.
    """
    hold = _hold(scenario)
    sampled = SampledHold(hold, Cycle.of_control(scenario.control))
    at = hold.instants(sampled.starts)
    q, rates = np.empty((at.t_s.size, 4)), np.empty((at.t_s.size, 3))
    wanted_motion(hold.reference, at, q, rates)
    _check_range(scenario, rates)
    torques = _torques(scenario, at.t_s)
    momentum = _momentum(scenario, sampled, q, sum(torques.values()))
    try:
        wheels = None if momentum is None else Wheels(momentum, rates)
        whole = make_loop(sampled, wheels)
    except ArithmeticError as error:
        raise ValueError(str(error)) from None
    loop = whole.until(scenario.length_s)
    settled_s = decay_s(loop)
    if settled_s == math.inf:
        raise ValueError(_undecayed(scenario, whole, loop))
    size = max(2, round(window_s / loop.cycle_s))
    first = math.ceil(settled_s / loop.cycle_s / size) * size
    if len(loop.t_s) - first < max(2 * size, 0.5 * len(loop.t_s)):
        raise ValueError(
            "simulation: must last at least twice the time in which errors decay to 2 %, "
            f"{settled_s:.4g} s, and two windows of {window_s:g} s after it; received "
            f"{scenario.length_s:.6g} s"
        )
    count = len(loop.t_s)
    return Setting(
        scenario, hold, loop, {name: each[:count] for name, each in torques.items()},
        q[:count], rates[:count], None if momentum is None else momentum[:count], size, first,
    )  # fmt: skip


def _undecayed(scenario: Scenario, whole: Loop, loop: Loop) -> str:
    """Why errors at the start stay: by the loop over whole revolutions, or by that of the run."""
    left = part_left(whole)
    if left >= 1.0:
        name, _ = holder_of(scenario)
        over = f"{left:.3g} times in {whole.cycle_s * len(whole.t_s):.4g} s"
        return (
            f"control.{scenario.control.key_of(name)}: must have gains with which errors at the "
            "start decay, for a pointing budget; by linear theory they grow "
            f"{over if math.isfinite(left) else 'beyond all numbers'}"
        )
    return (
        "simulation: must last until errors at the start decay to 2 %, for a pointing budget; "
        f"received {scenario.length_s:.6g} s, after which {100.0 * part_left(loop):.2g} % are left "
        "(greater gains may decay sooner)"
    )


def _hold(scenario: Scenario) -> AttitudeHold:
    """The hold, over as many revolutions as the flight has."""
    craft, law = scenario.spacecraft, _linear_law(scenario)
    around = scenario.orbit_environment()
    revolutions = max(1, math.ceil(scenario.length_s / around.orbit.period_s - 1e-9))
    kind = WheelHold if law.answers == "torque" else AttitudeHold
    return kind(law, craft.body, around, revolutions=revolutions)


def _torques(scenario: Scenario, t_s: np.ndarray) -> dict[str, np.ndarray]:
    """Torques besides gravity at the wanted attitude, in the middle of the cycles."""
    found = budget_while_held(scenario)
    middle = t_s + 0.5 * (t_s[1] - t_s[0])
    return {
        name: np.stack([np.interp(middle, found.t_s, each[:, k]) for k in range(3)], axis=1)
        for name, each in found.disturbance.items()
        if name not in ("gravity_gradient", "constant_and_random", "unmodelled")
    }


def _momentum(scenario: Scenario, sampled: SampledHold, q, torque) -> np.ndarray | None:
    """Momentum of the wheels (n, 3) [N m s] in the body, while they hold the wanted attitude.

    In inertial axes its rate is the torque on the body that they take: what is given, and gravity
    with what turns the reference. Coils that unload them are left out.
    """
    wheels, hold = scenario.spacecraft.wheels, sampled.hold
    if wheels is None:
        return None
    spin = wheels.rotor_inertia_kg_m2() * wheels.initial_speeds_rad_s()
    first = to_reference(q[0], spin @ np.array(wheels.array().axes))
    inertia = np.array(hold.body.inertia)
    own = hold.free(sampled.starts).forcing @ inertia.T * hold.rate_rad_s**2
    gained = to_reference(q, own + torque) * sampled.maps.cycle_s
    return to_body(q, first + np.cumsum(gained, axis=0) - gained)


def torque_of(setting: Setting, name: str) -> np.ndarray:
    """A torque (n, 3) along the flight; zeros where there is none."""
    none = np.zeros((len(setting.loop.t_s), 3))
    return setting.torques.get(name, none)
