"""Rotors as part of the motion that a multi-stage integrator advances.

A rotor that spins has its own equation: the rate of its momentum is the torque of motor and
friction, with the sense of the friction held for the step. A rotor at rest, or kept at its greatest
speed by its motor, rotates with the body and is a part of it. A step ends where a rotor changes
from one to the other.
"""

import math
from typing import NamedTuple

import numpy as np

from torquer.compile.engine import inlined, kernel
from torquer.maths.geometry.vec3 import add_scaled, dot, sub, sym_inverse, sym_vec
from torquer.spacecraft.actuators.rotors import rotor_axis, time_to_stand

#: Rows of the scratch space: derivatives of the stages, then these of each rotor: momentum at the
#: start; 1 if it turns by itself; sense of its friction; speed at which it is held; motor torque;
#: 1 if a step has shown that the body's rotation alone drives it over its limit.
_START, _FREE, _SIDE, _HELD, _MOTOR, _DRIVEN = range(12, 18)
WORK_ROWS = 18
#: A rotor this close [s] to a change has changed; the rounding of its greatest speed.
_AT_ONCE_S, _ROUNDING = 1e-9, 1e-12


class Turning(NamedTuple):
    """The rotors for a step: constants, scratch space (WORK_ROWS, n), weights of the stages.

    `tensor`: inertia of those that spin by themselves; `inverse`: of the body with all others.
    """

    rows: np.ndarray
    work: np.ndarray
    tableau: np.ndarray
    tensor: tuple
    inverse: tuple


@inlined
def forget_driven(work):
    """Make space that another satellite has used one for a new flight."""
    for k in range(work.shape[1]):
        work[_DRIVEN, k] = 0.0


@inlined
def _rubs(rotor):
    """Whether zero speed is anything special to a rotor."""
    return rotor.coulomb > 0.0 or rotor.breakaway > 0.0


@inlined
def _changes(rotor, state, speed, motor, driven):
    """(Whether a rotor spins by itself, sense of its friction, whether it is at rest)."""
    side = np.sign(speed) if speed != 0.0 else np.sign(motor)
    if _rubs(rotor):
        resting = state.stands == 1.0 or speed == 0.0
        if not resting:
            # one that is about to pass zero speed is there
            stopping = (motor - rotor.coulomb * side) * side < 0.0
            near = abs(speed) * rotor.inertia <= _AT_ONCE_S * abs(motor - rotor.coulomb * side)
            resting = stopping and near
        if resting:
            return abs(motor) > rotor.breakaway, np.sign(motor), abs(motor) <= rotor.breakaway
    torque = motor - rotor.coulomb * side - rotor.viscous * speed
    left = (rotor.speed_limit - abs(speed)) * rotor.inertia
    full = torque * side > 0.0 and left <= _AT_ONCE_S * abs(torque)
    return not (full or driven), side, False


@inlined
def _sum(s, inertia, axis):
    """Symmetric matrix s + inertia times axis axis^T."""
    x, y, z = axis
    a, b, c = inertia * x, inertia * y, inertia * z
    return (
        s[0] + a * x, s[1] + b * y, s[2] + c * z, s[3] + a * y, s[4] + a * z, s[5] + b * z
    )  # fmt: skip


@inlined
def _difference(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3], a[4] - b[4], a[5] - b[5])


@inlined
def begin_turning(rotors, state, work, tableau, inertia, omega, step):
    """The rotors at the start of a step: which of them spin by themselves."""
    rows, tensor = rotors.rows, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for k in range(rows.shape[0]):
        rotor, axis = rows[k], rotor_axis(rows, k)
        motor = state[k].motor if step < rotor.dead_from else 0.0
        speed = state[k].momentum / rotor.inertia - dot(axis, omega)
        free, side, stands = _changes(rotor, state[k], speed, motor, work[_DRIVEN, k] == 1.0)
        # without friction a rotor is never held
        free = free or (rotor.breakaway == 0.0 and stands)
        state[k].stands = 1.0 if stands and not free else 0.0
        work[_START, k], work[_MOTOR, k] = state[k].momentum, motor
        work[_FREE, k], work[_SIDE, k], work[_HELD, k] = (1.0 if free else 0.0), side, speed
        if free:
            tensor = _sum(tensor, rotor.inertia, axis)
    inverse = sym_inverse(_difference(inertia, tensor))
    return Turning(rows, work, tableau, tensor, inverse)


@inlined
def _momentum(turning, stage, h, k):
    """Momentum of rotor k where a stage is evaluated; stage 12: after the step."""
    total = 0.0
    for j in range(stage):
        total += turning.tableau[stage, j] * turning.work[j, k]
    return turning.work[_START, k] + h * total


@inlined
def turn(turning, stage, h, omega):
    """(Momentum of the rotors relative to the body, their torque on it) at a stage."""
    held, torque, work = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), turning.work
    for k in range(turning.rows.shape[0]):
        rotor, axis = turning.rows[k], rotor_axis(turning.rows, k)
        if work[_FREE, k] == 0.0:
            held = add_scaled(held, rotor.inertia * work[_HELD, k], axis)
            continue
        momentum = _momentum(turning, stage, h, k)
        speed = momentum / rotor.inertia - dot(axis, omega)
        given = work[_MOTOR, k] - rotor.coulomb * work[_SIDE, k] - rotor.viscous * speed
        work[stage, k] = given
        held, torque = add_scaled(held, momentum, axis), add_scaled(torque, -given, axis)
    return sub(held, sym_vec(turning.tensor, omega)), torque


@inlined
def end_turning(turning, state, h, omega):
    """Keep the momenta after a step; `omega`: the rate of the body then."""
    for k in range(turning.rows.shape[0]):
        rotor = turning.rows[k]
        if turning.work[_FREE, k] == 1.0:
            state[k].momentum = _momentum(turning, 12, h, k)
        else:
            carried = dot(rotor_axis(turning.rows, k), omega)
            state[k].momentum = rotor.inertia * (turning.work[_HELD, k] + carried)
        turning.work[_DRIVEN, k] = 0.0


@kernel
def time_to_change(turning):
    """Time [s] until the first rotor stops or is at its limit, if the body's rate stays."""
    first = math.inf
    for k in range(turning.rows.shape[0]):
        if turning.work[_FREE, k] == 0.0 or turning.work[_SIDE, k] == 0.0:
            continue
        rotor, side = turning.rows[k], turning.work[_SIDE, k]
        speed = turning.work[_HELD, k]
        torque = turning.work[_MOTOR, k] - rotor.coulomb * side
        if _rubs(rotor) and torque * side < 0.0 < speed * side:
            first = min(first, time_to_stand(speed, torque, rotor.viscous, rotor.inertia))
        elif torque * side > rotor.viscous * rotor.speed_limit:
            first = min(first, _time_to_limit(rotor, abs(speed), abs(torque)))
    return first


@inlined
def _time_to_limit(rotor, speed, torque):
    if rotor.viscous == 0.0:
        return (rotor.speed_limit - speed) * rotor.inertia / torque
    end = torque / rotor.viscous
    return rotor.inertia / rotor.viscous * math.log((end - speed) / (end - rotor.speed_limit))


@kernel
def part_to_change(turning, h, omega):
    """Fraction of a step after which the first rotor has passed zero speed or its limit; 1: none.

    0: one that was at its limit has passed it, and is held there from then on.
    """
    part = 1.0
    for k in range(turning.rows.shape[0]):
        if turning.work[_FREE, k] == 0.0:
            continue
        rotor, side = turning.rows[k], turning.work[_SIDE, k]
        before = turning.work[_HELD, k] * side
        carried = dot(rotor_axis(turning.rows, k), omega)
        after = (_momentum(turning, 12, h, k) / rotor.inertia - carried) * side
        near = _AT_ONCE_S * (abs(turning.work[_MOTOR, k]) + rotor.coulomb) / rotor.inertia
        near_limit = near + _ROUNDING * rotor.speed_limit
        if _rubs(rotor) and after < -near and before > 0.0:
            part = min(part, before / (before - after))
        elif after > rotor.speed_limit + near_limit and after > before:
            if before >= rotor.speed_limit - near_limit:
                turning.work[_DRIVEN, k] = 1.0
                part = 0.0
            else:
                part = min(part, (rotor.speed_limit - before) / (after - before))
    return part
