"""Allocation: how the computer shares a torque on the body among the wheels.

By minimax, with the limits of torque and momentum kept and the wheels' null space steered, or by
least squares. All that the computer believes of the wheels is here; it goes on asking wheels that
have died until their failure is noticed.
"""

from typing import NamedTuple

import numpy as np

from torquer.compile.engine import kernel
from torquer.maths.geometry.vec3 import scale
from torquer.spacecraft.actuators.reaction_wheels import ReactionWheels
from torquer.spacecraft.wheel_array.allocation import WheelSet, least_squares, within_limits
from torquer.spacecraft.wheel_array.steering import (
    Steering,
    lose,
    make_steering,
    steer,
    steer_nearest,
)


class Allocation(NamedTuple):
    """Constants of the allocation for kernels; n wheels."""

    steering: Steering
    """As it is at the start; limits and bias that hold now are in the state."""
    noticed_from: np.ndarray
    """(n,): the step from which on the computer knows that a wheel is dead."""
    driven: bool
    """False: nobody drives the wheels, the motors are off."""
    by_least_squares: bool


class AllocationState(NamedTuple):
    """What the computer believes of the wheels, (n,) each.

    Momenta as read [N m s], limits [N m s] and [N m] (0 for lost wheels), momenta that keep wheels
    off zero speed [N m s], motor torques asked for [N m].
    """

    momentum: np.ndarray
    momentum_limit: np.ndarray
    torque_limit: np.ndarray
    bias: np.ndarray
    motor: np.ndarray


_NONE = np.zeros(0)
#: Without wheels.
NO_ALLOCATION_STATE = AllocationState(*(_NONE.copy() for _ in AllocationState._fields))
_NO_STEERING = Steering(
    WheelSet(np.zeros((0, 3)), np.zeros((0, 3))), _NONE, _NONE, _NONE, np.zeros((0, 0)),
    np.zeros((0, 0)),
)  # fmt: skip

#: A satellite without wheels.
NO_ALLOCATION = Allocation(_NO_STEERING, _NONE, False, False)


@kernel
def allocate_torque(allocation, state, rotors, torque_body, interval_s, step):
    """Set the motors for an interval, so that the body gets a torque [N m] from the wheels.

    What is beyond the motors is cut with the direction kept; by minimax what would drive full
    wheels on is left out, too. `rotors`: their state, which takes the motors' torques.
    """
    if not allocation.driven:
        return
    first, wanted = allocation.steering, scale(-1.0, torque_body)
    limits = state.momentum_limit, state.torque_limit
    steering = Steering(first.wheels, *limits, state.bias, first.bias_after, first.work)
    for k in range(allocation.noticed_from.shape[0]):
        if step >= allocation.noticed_from[k] and state.torque_limit[k] > 0.0:
            lose(steering, k)
    if allocation.by_least_squares:
        limit = steering.torque_limit
        greatest = least_squares(steering.wheels.axes, limit, wanted, state.motor)
        within_limits(greatest, state.motor)
    else:
        part = steer(steering, interval_s, state.momentum, wanted, state.motor)
        if part < 1.0:
            steer_nearest(steering, interval_s, state.momentum, wanted, state.motor)
    for k in range(state.motor.shape[0]):
        rotors[k].motor = state.motor[k]


@kernel
def switch_off_motors(state, rotors):
    """Leave the wheels to their friction."""
    for k in range(state.motor.shape[0]):
        state.motor[k] = rotors[k].motor = 0.0


def make_allocation(wheels: ReactionWheels, step_s: float, driven: bool = True) -> Allocation:
    """Constants of the allocation; `driven`: whether a law drives the wheels."""
    return Allocation(
        steering=make_steering(wheels.array(), wheels.minimum_speed_fraction),
        noticed_from=wheels.noticed_from_step(step_s),
        driven=driven,
        by_least_squares=wheels.allocation == "least_squares",
    )


def first_allocation(allocation: Allocation) -> AllocationState:
    """What the computer believes at the start."""
    s, nothing = allocation.steering, np.zeros(len(allocation.noticed_from))
    limits = s.momentum_limit.copy(), s.torque_limit.copy()
    return AllocationState(nothing.copy(), *limits, s.bias.copy(), nothing.copy())
