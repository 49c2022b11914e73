"""Members of the loop: one satellite, or several side by side in lanes.

The loop is written once. What it does with a satellite is a *phase*, a kernel
`(member, *arguments)`; `each` lets it work for the one member, or for every lane in turn, in a loop
that the compiler turns into vectors. Which of the two is the type of `members`.
"""

from typing import NamedTuple

import numpy as np
from numba.extending import overload

from torquer.base.noise import normal3
from torquer.compile.engine import LOOP_OPTIONS, inlined, whole
from torquer.compile.lanes import LaneLayout, Rows, lane_maker, lane_plant, lane_state
from torquer.compile.numba_private import INLINED_OPTIONS
from torquer.spacecraft.sensors.devices import STREAMS

#: How a run can stand: it goes on; the motion is not finite; a command is not; the step does not
#: follow the motion; a command from outside is awaited; the body strikes the ring of a test bench;
#: a sensor of the user's own has failed.
RUNNING, BAD_STATE, BAD_COMMAND, COARSE_STEP, WAITING, TILTED, BAD_READING = range(7)
_drawn_in = lane_maker(Rows((STREAMS, 3), 1))


class Member(NamedTuple):
    """What a phase works on: a state and constants, of one satellite or shown so from a lane.

    `constants`: a `Plant` or, where it is propagated, its `Dynamics`; `drawn` (STREAMS, 3): normal
    random numbers for the next readings, zeros where there is no noise.
    """

    state: tuple
    constants: tuple
    seed: int
    drawn: np.ndarray


class One(NamedTuple):
    """One satellite."""

    member: Member


#: How a member ended, and at which step.
END = np.dtype([("how", np.int64), ("step", np.int64)])


class Many(NamedTuple):
    """LANES satellites side by side; `constants`: what is not in their cells.

    `drawn` (STREAMS, 3, LANES). `ends`: `END` of each. `lanes`: LANES; a number that the compiler
    knows would make it write out short loops, member by member, instead of taking vectors.
    """

    layout: LaneLayout
    cells: np.ndarray
    constants: tuple
    seeds: np.ndarray
    drawn: np.ndarray
    ends: np.ndarray
    lanes: int


@inlined
def member_in(members, lane):
    """The member in a lane."""
    return Member(
        lane_state(members.layout, members.cells, lane),
        lane_plant(members.layout, members.cells, lane, whole(members.constants)),
        members.seeds[lane],
        _drawn_in(members.drawn, 0, lane),
    )


def each(members, phase, *arguments):
    """Let a phase work for every member."""
    phase(members.member, *arguments)


@overload(each, jit_options=INLINED_OPTIONS)
def _each_one(members, phase, *arguments):
    return each if members.instance_class is One else None


@overload(each, jit_options=LOOP_OPTIONS)
def _each_many(members, phase, *arguments):
    if members.instance_class is One:
        return None

    def in_lanes(members, phase, *arguments):
        for lane in range(members.lanes):
            phase(member_in(members, lane), *arguments)

    return in_lanes


def count(members, phase, *arguments):
    """Sum over the members of what a phase answers."""
    return phase(members.member, *arguments)


@overload(count, jit_options=LOOP_OPTIONS)
def _count_many(members, phase, *arguments):
    if members.instance_class is One:
        return count

    def in_lanes(members, phase, *arguments):
        found = 0
        for lane in range(members.lanes):
            found += phase(member_in(members, lane), *arguments)
        return found

    return in_lanes


def first_member(members):
    """The first member."""
    return members.member


@overload(first_member, jit_options=INLINED_OPTIONS)
def _first_of(members):
    if members.instance_class is One:
        return first_member
    return lambda members: member_in(members, 0)


def must_stop(members, test, how, step, *arguments):
    """Whether the loop must stop since a test, a phase that answers True or False, fails.

    One satellite stops the loop. Of several, those that fail are noted as ended, and the loop goes
    on with all: they do not touch each other.
    """
    return not test(members.member, *arguments)


@overload(must_stop, jit_options=INLINED_OPTIONS)
def _one_must_stop(members, test, how, step, *arguments):
    return must_stop if members.instance_class is One else None


@overload(must_stop, jit_options=LOOP_OPTIONS)
def _many_must_stop(members, test, how, step, *arguments):
    if members.instance_class is One:
        return None

    def in_lanes(members, test, how, step, *arguments):
        failed = 0
        for lane in range(members.lanes):
            failed += not test(member_in(members, lane), *arguments)
        if failed > 0:
            for lane in range(members.lanes):
                passes = test(member_in(members, lane), *arguments)
                if not passes and members.ends[lane].how == 0:
                    members.ends[lane].how, members.ends[lane].step = how, step
        return False

    return in_lanes


@inlined
def _draw(member, sensor, stream):
    count = int(member.state.sensors[sensor].count)
    x, y, z = normal3(member.seed, stream, count)
    member.drawn[stream, 0], member.drawn[stream, 1], member.drawn[stream, 2] = x, y, z


@inlined
def draw(members, sigma, sensor, stream):
    """Draw the errors of a sensor's next readings, if they have any."""
    if sigma > 0.0:
        each(members, _draw, sensor, stream)


@inlined
def drawn_for(member, stream):
    """What was drawn from a stream."""
    return (member.drawn[stream, 0], member.drawn[stream, 1], member.drawn[stream, 2])
