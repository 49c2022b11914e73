"""Wheels of members in lanes: their computers drive them one after another.

How a torque is shared among wheels is a search, each member's own: there is nothing to take vectors
of. So it works on arrays as in a single run, to which a member's numbers are copied and back.
"""

from typing import NamedTuple, TypeVar

import numpy as np

from torquer.compile.arguments import Entry, record_at
from torquer.compile.engine import called, inlined
from torquer.computer.allocation import Allocation, allocate_torque, switch_off_motors
from torquer.maths.geometry.vec3 import is_finite
from torquer.simulation.loop.members import member_in
from torquer.simulation.loop.state import Plan
from torquer.simulation.propagate.adaptive import Auto

_Integrator = TypeVar("_Integrator", bound=NamedTuple)


@inlined
def _copy(to, source):
    for k in range(source.shape[0]):
        to[k] = source[k]


@called
def drive_step(member, allocation, space, torque, hold_s, step):
    """Let a member's computer set its motors; `space`: arrays to work on."""
    state, own, believed = member.state, member.state.allocation, space.believed
    _copy(believed.momentum, own.momentum)
    _copy(believed.momentum_limit, own.momentum_limit)
    _copy(believed.torque_limit, own.torque_limit)
    _copy(believed.bias, own.bias)
    allocate_torque(allocation, believed, space.rotors, torque, hold_s, step)
    _copy(own.momentum_limit, believed.momentum_limit)
    _copy(own.torque_limit, believed.torque_limit)
    _copy(own.bias, believed.bias)
    _copy(own.motor, believed.motor)
    for k in range(believed.motor.shape[0]):
        state.rotors[k].motor = believed.motor[k]


@inlined
def _leaves_off(boards, lane):
    """Whether a member's modes leave its wheels off; computers in vectors have no modes."""
    if boards.numbers.shape[0] == 0:
        return False
    return boards.all.chosen[lane, 0].wheels == 0.0


def _drive_wheels(address, hold_steps, step):
    """Set the motors of all members' wheels until the next control step.

    As in a single run; a member whose command is not finite has ended.
    """
    loop = record_at(address)
    members, boards, allocation = loop.members, loop.boards, loop.plan.allocation
    hold_s = hold_steps * loop.plan.step_s
    for lane in range(members.lanes):
        member = member_in(members, lane)
        c = member.state.cells[0]
        torque = (c.torque_x, c.torque_y, c.torque_z)
        if _leaves_off(boards, lane) and torque == (0.0, 0.0, 0.0):
            switch_off_motors(member.state.allocation, member.state.rotors)
        elif allocation.driven and is_finite(torque):
            drive_step(member, allocation, boards.wheels, torque, hold_s, step)
    return 0


#: Called by its address, as that of a single run is.
drive_wheels = Entry(_drive_wheels, 2)


def same_allocation(one: Allocation, other: Allocation) -> bool:
    """Whether the computers of two members share a torque in the same way, but for the limits."""

    def parts(allocation: Allocation) -> list:
        steering, *rest = allocation
        return [*steering.wheels, steering.bias_after, *rest]

    return all(map(np.array_equal, parts(one), parts(other)))


def own_space(plan: Plan, integrator: _Integrator) -> tuple[Plan, _Integrator]:
    """A plan and an integrator with arrays to work on that no other thread has."""
    allocation, steering = plan.allocation, plan.allocation.steering
    steering = steering._replace(work=np.zeros_like(steering.work))
    if isinstance(integrator, Auto):
        integrator = integrator._replace(work=np.zeros_like(integrator.work))
    return plan._replace(allocation=allocation._replace(steering=steering)), integrator
