"""Rotors of reaction wheels: motor torque, friction, standstill, a greatest speed, failure.

A rotor spins about an axis g fixed in the body; its state is the absolute momentum about it,
a = I (speed + g . omega), whose rate is the torque of its own motor and bearing alone. What a
rotor gains the body loses, so no rounding or friction model can create momentum.

Friction brakes with c + v |speed|. It can bring a rotor to rest, where it stays until the motor's
torque exceeds the breakaway torque. Within a step, motor torque and rate of the body are held; the
speed then follows in closed form, through standstill and back, whatever the step.
"""

import math
from typing import NamedTuple

import numpy as np

from torquer.compile.engine import inlined, kernel
from torquer.maths.geometry.vec3 import add_scaled, dot, scale, sub, sym_vec

#: Constants of a rotor: axis; inertia [kg m^2]; greatest speed [rad/s]; friction c [N m] and
#: v [N m s]; breakaway torque [N m]; the step from which on the motor is dead.
ROTOR = np.dtype(
    [
        (name, np.float64)
        for name in (
            "axis_x", "axis_y", "axis_z", "inertia", "speed_limit", "coulomb", "viscous",
            "breakaway", "dead_from",
        )
    ]
)  # fmt: skip
#: State of a rotor: absolute axial momentum [N m s], motor torque [N m], 1 where it stands.
ROTOR_STATE = np.dtype([(name, np.float64) for name in ("momentum", "motor", "stands")])


class Rotors(NamedTuple):
    """Constants of rotors for kernels: `ROTOR` of each, and the tensor sum I g g^T [kg m^2]."""

    rows: np.ndarray
    tensor: tuple


#: A satellite without wheels.
NO_ROTORS = Rotors(np.zeros(0, ROTOR), (0.0,) * 6)


class Spin(NamedTuple):
    """The rotors during a step: sum of absolute momenta at its start, its mean rate, the tensor.

    All as vectors in the body [N m s, N m].
    """

    momentum: tuple
    torque: tuple
    tensor: tuple


@inlined
def rotor_axis(rows, k):
    """Axis of rotor k."""
    rotor = rows[k]
    return (rotor.axis_x, rotor.axis_y, rotor.axis_z)


@inlined
def _along(speed, torque, viscous, inertia, t):
    """Speed after t under a constant torque [N m] and viscous friction."""
    if viscous == 0.0:
        return speed + torque * t / inertia
    return speed + (torque / viscous - speed) * -math.expm1(-viscous * t / inertia)


@inlined
def time_to_stand(speed, torque, viscous, inertia):
    """Time [s] until a torque against the speed has stopped it."""
    if viscous == 0.0:
        return -speed * inertia / torque
    return inertia / viscous * math.log1p(-viscous * speed / torque)


@kernel
def speed_after(rotor, speed, stands, motor, t):
    """(Speed [rad/s], whether it is at rest) of a rotor after t under a constant motor torque."""
    inertia, coulomb, viscous = rotor.inertia, rotor.coulomb, rotor.viscous
    breakaway, limit = rotor.breakaway, rotor.speed_limit
    if stands and abs(motor) <= breakaway:
        return 0.0, True
    side = np.sign(motor) if stands or speed == 0.0 else np.sign(speed)
    after = _along(speed, motor - coulomb * side, viscous, inertia, t)
    if after * side < 0.0:
        left = t - time_to_stand(speed, motor - coulomb * side, viscous, inertia)
        if abs(motor) <= breakaway:
            return 0.0, True
        after = _along(0.0, motor - coulomb * np.sign(motor), viscous, inertia, left)
    return min(max(after, -limit), limit), False


@kernel
def step_rotors(rotors, state, omega_body, step, t):
    """Run the motors for step number `step` of t seconds; `Spin` is the effect on the body."""
    rows, held, torque = rotors.rows, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for k in range(rows.shape[0]):
        axis, inertia, before = rotor_axis(rows, k), rows[k].inertia, state[k].momentum
        carried = dot(axis, omega_body)
        motor = state[k].motor if step < rows[k].dead_from else 0.0
        stands = state[k].stands == 1.0
        speed = 0.0 if stands else before / inertia - carried
        speed, stands = speed_after(rows[k], speed, stands, motor, t)
        after = inertia * (speed + carried)
        state[k].momentum, state[k].stands = after, 1.0 if stands else 0.0
        held = add_scaled(held, before, axis)
        torque = add_scaled(torque, (after - before) / t, axis)
    return Spin(held, torque, rotors.tensor)


@inlined
def relative_momentum(rows, state, omega_body, k):
    """Momentum [N m s] of rotor k relative to the body: what its tachometer measures."""
    return state[k].momentum - rows[k].inertia * dot(rotor_axis(rows, k), omega_body)


@inlined
def carried_momentum(spin, omega_body, since_s):
    """Momentum [N m s] of the rotors relative to the body, since_s into the step, as a vector."""
    absolute = add_scaled(spin.momentum, since_s, spin.torque)
    return sub(absolute, sym_vec(spin.tensor, omega_body))


@inlined
def reaction(spin):
    """Torque [N m] of the rotors on the body."""
    return scale(-1.0, spin.torque)
