"""What the author of a scenario with reaction wheels should know before the run."""

import math
from collections.abc import Iterator

import numpy as np

from torquer.analysis.notes.assess import assess
from torquer.analysis.notes.uses import Use, notes_on_laws
from torquer.base.spec import Spec
from torquer.computer.laws.bias_momentum import BiasMomentum
from torquer.computer.laws.pointing import HeldByWheels
from torquer.computer.laws.unloading import Unloading
from torquer.computer.laws.wheel_one_axis import WheelOneAxis
from torquer.computer.laws.wheel_pd import WheelPd
from torquer.computer.laws.wheel_tracking import WheelTracking
from torquer.maths.geometry import euler
from torquer.maths.geometry.frames import dcm_orbital_to_inertial
from torquer.maths.geometry.quaternion import conjugate, from_dcm, multiply
from torquer.maths.geometry.vec3 import as_matrix
from torquer.scenario.resolution import momentum_at_start
from torquer.scenario.spec import Scenario
from torquer.spacecraft.actuators.reaction_wheels import ReactionWheels
from torquer.spacecraft.wheel_array.envelope import momentum_envelope, torque_envelope
from torquer.spacecraft.wheel_array.steering import steering_bias

#: Part of a law's own time for which a torque may be held before the motion is another one.
_COARSE = 0.3
#: Part of the torque at which damper and spring are in balance at the greatest rate that a turn is
#: braked with at its end, for a damping of 0.7 or more.
_BRAKING = 0.33
#: Laws with a greatest rate.
_TURNING = HeldByWheels | WheelOneAxis | WheelTracking


def wheel_notes(scenario: Scenario) -> list[str]:
    """Notes on the wheels and on the laws that drive or unload them, one line each."""
    if scenario.spacecraft.wheels is None:
        return []
    return [*assess(_CHECKS, scenario), *notes_on_laws(scenario, _LAW_CHECKS)]


def _motor_notes(scenario: Scenario) -> Iterator[str]:
    """Notes if nothing drives the wheels; 'off' marks this as intended."""
    program = scenario.control.named()
    specs, known = program.laws.values(), program.known_laws()
    may_drive = len(known) < len(specs) or any(law.drives_wheels for law in known.values())
    if may_drive or any(spec.kind == "off" for spec in specs):
        return
    if any(isinstance(spec, Unloading) for spec in specs):
        yield (
            "no wheel law compensates the torque of the coils: 'unloading' rotates the body and "
            "leaves the wheels' momentum as it is"
        )
    yield "no law drives the wheels (control.laws): their motors are off"


def _friction_notes(scenario: Scenario) -> Iterator[str]:
    """The greatest friction that the weakest motor cannot overcome."""
    wheels = scenario.spacecraft.wheels
    limit, coulomb = float(np.min(wheels.torque_limit_n_m)), wheels.coulomb_friction_n_m
    top = wheels.viscous_friction_n_m_s * wheels.speed_limit_rad_s
    motor = f"is not below the torque limit of {limit:g} N m"
    if coulomb >= limit:
        yield f"the wheels' Coulomb friction of {coulomb:g} N m {motor}: no motor can speed one up"
    elif (wheels.stiction_n_m or 0.0) >= limit:
        yield f"the wheels' stiction of {wheels.stiction_n_m:g} N m {motor}: none starts from rest"
    elif coulomb + top >= limit:
        yield (
            f"the wheels' friction at the highest speed, {coulomb + top:.3g} N m, {motor}: they "
            "cannot reach their momentum limit"
        )


def _idle_notes(scenario: Scenario) -> Iterator[str]:
    wheels = scenario.spacecraft.wheels
    if wheels.minimum_speed_fraction is None:
        return
    if steering_bias(wheels.array(), wheels.minimum_speed_fraction).keeps_off_zero_up_to <= 0.0:
        yield (
            f"minimum_speed_fraction has no effect: these wheels cannot all spin above "
            f"{wheels.minimum_speed_fraction:.0%} of their limits with zero total momentum"
        )


def _hold_notes(scenario: Scenario, use: Use) -> Iterator[str]:
    """The effect on the law's motion of holding torques from reading to reading.

    About an axis the angle x follows x'' = -(d x' + p x) with the right-hand side held for T. The
    roots of this sampled motion lie within the unit circle while d T < 2 and p T < 2 d.
    """
    if not isinstance(use.law, _TURNING | BiasMomentum):
        return
    hold_s = scenario.control.longest_hold_s
    damping, stiffness = (use.factor * part for part in _loop(scenario, use.law))
    fastest = max(0.5 * damping, math.sqrt(stiffness))
    if damping * hold_s >= 2.0 or stiffness * hold_s >= 2.0 * damping:
        yield (
            f"the wheel law is unstable with torques held for {hold_s:g} s: its damping "
            f"of {damping:.3g} 1/s must be below {2.0 / hold_s:.3g}, its stiffness of "
            f"{stiffness:.3g} 1/s^2 below {2.0 * damping / hold_s:.3g}"
        )
    elif fastest * hold_s > _COARSE:
        yield (
            f"the wheel law has a time constant of {1.0 / fastest:.3g} s, and torques are held for "
            f"{hold_s:g} s: the loop will not have its nominal bandwidth and damping"
        )


def _age_notes(scenario: Scenario, use: Use) -> Iterator[str]:
    """Sensors whose readings are old for the loop, of which no estimator makes them of now."""
    if not isinstance(use.law, _TURNING | BiasMomentum):
        return
    control, sensors = scenario.control, scenario.spacecraft.sensors()
    if control.estimator.kind != "attitude_sensor" or control.estimators:
        return
    damping, stiffness = (use.factor * part for part in _loop(scenario, use.law))
    fastest = max(0.5 * damping, math.sqrt(stiffness))
    for name, sensor in sensors.items():
        age_s = (sensor.sample_s or 0.0) + sensor.delay_s
        if sensor.sheet.senses in use.law.needs and fastest * age_s > _COARSE:
            yield (
                f"the wheel law has a time constant of {1.0 / fastest:.3g} s, and readings of "
                f"spacecraft.{name} are up to {age_s:g} s old (sample_s and delay_s): the loop "
                "will not have its nominal damping, or none"
            )


def _loop(scenario: Scenario, law: Spec) -> tuple[float, float]:
    """Damping [1/s] and stiffness [1/s^2] of small motion about the fastest axis."""
    if isinstance(law, BiasMomentum):
        return 2.0 * law.damping_ratio * law.bandwidth_rad_s, law.bandwidth_rad_s**2
    if isinstance(law, WheelPd | WheelTracking):
        return 2.0 * law.damping * law.bandwidth_rad_s, law.bandwidth_rad_s**2
    least = float(scenario.spacecraft.body.principal()[0][0])
    return law.rate_gain_n_m_s / least, 0.5 * law.angle_gain_n_m / least


def _turn_notes(scenario: Scenario, use: Use) -> Iterator[str]:
    """Whether the wheels have the momentum and the torque for slews at the greatest rate."""
    law = use.law
    if not isinstance(law, _TURNING) or law.greatest_rate_deg_s is None:
        return
    wheels, moments = scenario.spacecraft.wheels, scenario.spacecraft.body.principal()[0]
    momentum = math.radians(law.greatest_rate_deg_s) * float(moments[-1])
    least = momentum_envelope(wheels.array()).inner_radius
    rate = f"a slew at greatest_rate_deg_s = {law.greatest_rate_deg_s:g}"
    if momentum > least:
        yield (
            f"{rate} may take {momentum:.3g} N m s, but the wheels hold {least:.3g} N m s about "
            "their weakest axis"
        )
    if isinstance(law, WheelTracking):  # its slews end as they begin: see `tracking_notes`
        return
    braking = _BRAKING * _loop(scenario, law)[0] * momentum
    weakest = torque_envelope(wheels.array()).inner_radius
    if braking > weakest:
        yield (
            f"{rate} takes up to {braking:.3g} N m to stop, but the wheels give {weakest:.3g} N m "
            "about their weakest axis: it may overshoot"
        )


def _start_notes(scenario: Scenario, use: Use) -> Iterator[str]:
    """Whether the wheels have the torque and the momentum for acquisition."""
    law = use.law
    if not (use.at_start and isinstance(law, HeldByWheels)):
        return
    wheels = scenario.spacecraft.wheels
    r, v = (x[0] for x in scenario.orbit_environment().state(np.zeros(1)))
    motion = scenario.initial.motion(r, v)
    torque = _spring_torque(law, motion[:4], r, v)
    share = _torque_share(wheels, torque)
    if share > 1.0 and law.greatest_rate_deg_s is None:  # else see `_turn_notes`
        yield (
            f"at the start the law demands {np.linalg.norm(torque):.3g} N m, {share:.3g} times "
            "what the wheels can give about that axis: the torque saturates during acquisition, "
            "and the attitude may overshoot"
        )
    excess, reach = _excess_momentum(scenario, law, motion[4:], r, v)
    if excess > reach:
        yield (
            f"the satellite starts with {excess:.3g} N m s more than the body has in the wanted "
            f"attitude, but the wheels hold {reach:.3g} N m s at most: they cannot absorb it all"
        )


def _spring_torque(law: HeldByWheels, q, r, v) -> np.ndarray:
    """Size and axis of the spring's torque [N m] on the body."""
    wanted = euler.to_quaternion(law.sequence, np.radians(law.euler_deg))
    if law.orbital:
        wanted = multiply(from_dcm(as_matrix(dcm_orbital_to_inertial(r, v))), wanted)
    half = np.array(multiply(conjugate(wanted), tuple(q.tolist())))[:3]
    if isinstance(law, WheelPd):
        return 2.0 * law.bandwidth_rad_s**2 * np.array(law.inertia_kg_m2) @ half
    return law.angle_gain_n_m * half


def _torque_share(wheels: ReactionWheels, torque) -> float:
    """The torque as a share of the greatest in that direction, as allocated to the wheels."""
    array = wheels.array()
    if wheels.allocation == "minimax":
        return float(torque_envelope(array).share(torque))
    limits = array.torque_limits()
    works = limits > 0.0
    asked = np.linalg.pinv(np.array(array.axes)[works].T) @ torque
    return float(np.max(np.abs(asked) / limits[works]))


def _excess_momentum(scenario: Scenario, law: HeldByWheels, omega, r, v) -> tuple[float, float]:
    """(Least momentum that is left for the wheels in the wanted attitude, most that they hold)."""
    wheels, body = scenario.spacecraft.wheels, scenario.spacecraft.body
    momentum = momentum_at_start(scenario.spacecraft, omega)
    size = float(np.linalg.norm(momentum) - np.linalg.norm(body.wheel_momentum_n_m_s))
    if law.orbital:
        turning = float(np.linalg.norm(np.cross(r, v)) / (r @ r))
        size -= turning * float(body.principal()[0][-1])
    return size, float(np.linalg.norm(momentum_envelope(wheels.array()).vertices, axis=1).max())


_CHECKS = {
    "what drives the wheels": _motor_notes,
    "the friction of the wheels": _friction_notes,
    "the least speed of the wheels": _idle_notes,
}
_LAW_CHECKS = {
    "the wheel law with held torques": _hold_notes,
    "the wheel law with old readings": _age_notes,
    "slews at the greatest rate": _turn_notes,
    "acquisition by the wheels": _start_notes,
}
