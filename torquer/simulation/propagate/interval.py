"""The motion from one event of the loop to the next.

`propagate` is compiled for each kind of body and integrator and called by its address: the loop,
with sensors, computer and record, does not know them and is compiled once.
"""

import math
from typing import NamedTuple

import numpy as np
from numba.extending import overload

from torquer.compile.arguments import Entry, entry_caller, record_at
from torquer.compile.engine import called, inlined, kernel, whole
from torquer.compile.numba_private import INLINED_OPTIONS
from torquer.maths.geometry.quaternion import rotate_inverse
from torquer.maths.geometry.vec3 import dot
from torquer.simulation.loop.members import (
    BAD_STATE,
    COARSE_STEP,
    RUNNING,
    TILTED,
    Many,
    One,
    each,
    first_member,
    must_stop,
)
from torquer.simulation.loop.state import local_in, put_local, put_motion, read_motion
from torquer.simulation.propagate.adaptive import Auto, by_auto, next_death
from torquer.simulation.propagate.adaptive_lanes import auto_in_lanes
from torquer.simulation.propagate.fixed_steps import (
    Rk4,
    Splitting,
    add_up_step,
    by_rk4,
    by_splitting,
    is_followed,
    left_in_step,
    rk4_with,
)
from torquer.simulation.propagate.forces import (
    EnvironmentTables,
    as_wheels,
    environment_at,
    environment_with,
    forces_now,
    look_up,
    wheel_spin,
)
from torquer.simulation.propagate.lane_stages import put_spin, spin_in
from torquer.simulation.propagate.switched import by_switching
from torquer.spacecraft.actuators.coils import advance_coils
from torquer.spacecraft.disturbance.acting import leaves_bearing, magnets_in
from torquer.spacecraft.disturbance.held import draw_held, hold_end
from torquer.spacecraft.disturbance.magnets import next_memory, remember_field
from torquer.spacecraft.disturbance.unmodelled import draw_coefficients, next_jump

#: Whether `propagate` looks if the step follows the motion before it starts: no; yes, and adds up
#: what the steps to the next record do by themselves; yes, and nothing else.
GO_ON, LOOK, LOOK_ONLY = 0, 1, 2


class Problem(NamedTuple):
    """What `propagate` takes: integrator, members with their `Dynamics`, tables, time grid.

    `local`: field and gravity-gradient vector at the start of the interval, and later at its end.
    """

    integrator: Auto | Rk4 | Splitting
    members: One | Many
    tables: EnvironmentTables
    local: np.ndarray
    step_s: float
    record_steps: int


def _auto_steps(integrator, forces, cells, x, local, first, last, h):
    x = by_auto(integrator, forces, cells, x, local, first, last, h)
    return x, look_up(forces.tables, last * h)


def _rk4_steps(integrator, forces, cells, x, local, first, last, h):
    return by_rk4(forces, x, local, first, last, h)


def _splitting_steps(integrator, forces, cells, x, local, first, last, h):
    moments, axes = integrator.moments, integrator.q_principal_to_body
    x = by_splitting(forces, moments, axes, x, first, last, h)
    return x, look_up(forces.tables, last * h)


_STEPS = {Auto: _auto_steps, Rk4: _rk4_steps, Splitting: _splitting_steps}


def steps_by(integrator, forces, cells, x, local, first, last, h):
    """(Motion, what `look_up` finds) after steps first..last-1, by the integrator's type."""
    return _STEPS[type(integrator)](integrator, forces, cells, x, local, first, last, h)


@overload(steps_by, jit_options=INLINED_OPTIONS)
def _choose_steps(integrator, forces, cells, x, local, first, last, h):
    return _STEPS[integrator.instance_class]


@inlined
def next_draw(dynamics, step, last):
    """The step at which a random torque jumps next, or rods look at the field; at most `last`.

    The interval up to it is propagated by itself: every integrator meets a torque that is smooth.
    """
    jump = next_jump(dynamics.unmodelled, step, hold_end(dynamics.held, step, last))
    return next_memory(magnets_in(dynamics.rigid.acting), step, jump)


@inlined
def steps_or_switchings(switching, integrator, member, forces, local, step, until, h):
    """The same after steps step..until-1; of coils that are switched, with all that they do."""
    cells = member.state.cells
    if len(switching) == 0:
        return steps_by(integrator, forces, cells[0], read_motion(cells), local, step, until, h)
    x = by_switching(integrator, member, forces, step, until, h)
    return x, look_up(forces.tables, until * h)


@inlined
def next_dead_motor(switching, rotors, step, last):
    """The step at which the next motor dies while coils are switched, `last` at the latest."""
    if len(switching) == 0:
        return last
    if len(rotors) == 0:
        return last
    return next_death(rotors.rows, step, last)


@inlined
def draw_torques_step(member, step):
    """Draw the torques of a member that jump at a step."""
    state, dynamics = member.state, member.constants
    draw_held(dynamics.held, member.seed, step, state.held)
    draw_coefficients(dynamics.unmodelled, member.seed, step, state.coefficients)


@inlined
def remember_step(member, b_inertial):
    """Let the rods of a member, if it has any, remember the field where it stands."""
    b_body = rotate_inverse(read_motion(member.state.cells).q, b_inertial)
    remember_field(magnets_in(member.constants.rigid.acting), member.state.rods, b_body)


@inlined
def is_finite(x):
    """Whether a motion is one of finite numbers."""
    return math.isfinite(dot(x.omega, x.omega) + x.q[0] + x.q[1] + x.q[2] + x.q[3])


@inlined
def has_motion(member):
    """Whether a member's motion is one of finite numbers."""
    return is_finite(read_motion(member.state.cells))


@inlined
def rk4_phase(member, local, middle, end, left, h):
    """A member's step of RK4 between these environments; see `rk4_with`."""
    cells = member.state.cells
    forces, spin = forces_now(member, ()), spin_in(member.state.spun[0], member.constants.rotors)
    x = rk4_with(forces, spin, read_motion(cells), local, middle, end, left, h)
    put_motion(cells, x)


@called
def spin_phase(member, step, h):
    """Run a member's rotors for a step of RK4; which of them stand or stop is each one's own."""
    state = member.state
    wheels, omega = as_wheels(member.constants.rotors, state), read_motion(state.cells).omega
    put_spin(state.spun[0], wheel_spin(wheels, omega, step, h))


@inlined
def spin_wheels(members, rotors, step, h):
    """Run the rotors of all members, if they have any."""
    if len(rotors) > 0:
        each(members, spin_phase, step, h)


@inlined
def strikes_ring(acting, tables, x, t):
    """Whether a body on a bearing is tilted beyond its limit at a time t [s]."""
    if len(acting) == 0:
        return False
    return leaves_bearing(acting, environment_at(tables, t), x.q)


@inlined
def stays_on_bearing(member, tables, t):
    """Whether a member's body is not tilted beyond a limit."""
    return not strikes_ring(
        member.constants.rigid.acting, tables, read_motion(member.state.cells), t
    )


def advance(members, problem, local, step, until):
    """Advance the motion; (RUNNING, or how it ended, what `look_up` finds then).

    If it has ended the state keeps the motion before.
    """
    member, h = members.member, problem.step_s
    cells, forces = member.state.cells, forces_now(member, problem.tables)
    switching, by = member.constants.switching, problem.integrator
    x, found = steps_or_switchings(switching, by, member, forces, local, step, until, h)
    if not is_finite(x):
        return BAD_STATE, found
    if strikes_ring(forces.rigid.acting, problem.tables, x, until * h):
        return TILTED, found
    put_motion(cells, x)
    return RUNNING, found


@inlined
def rk4_in_lanes(members, problem, local, step, until):
    """Advance members over steps step..until-1 of the time grid by RK4; what is looked up then."""
    constants, h = first_member(members).constants, problem.step_s
    found = (local.b_t, local.gravity_gradient)
    for k in range(step, until):
        middle = environment_at(problem.tables, (k + 0.5) * h)
        found = look_up(problem.tables, (k + 1) * h)
        end = environment_with(problem.tables, found, (k + 1) * h)
        left = left_in_step(constants.coils.lag_s, (k - step) * h, h)
        spin_wheels(members, constants.rotors, k, h)
        each(members, rk4_phase, local, middle, end, left, h)
        local = end
    return found


#: Integrators of members in lanes.
IN_LANES = {Auto: auto_in_lanes, Rk4: rk4_in_lanes}


@overload(advance, jit_options=INLINED_OPTIONS)
def _advance(members, problem, local, step, until):
    if members.instance_class is One:
        return advance
    steps = IN_LANES[problem[problem.fields.index("integrator")].instance_class]

    def in_lanes(members, problem, local, step, until):
        found = steps(members, problem, local, step, until)
        must_stop(members, has_motion, BAD_STATE, until)
        must_stop(members, stays_on_bearing, TILTED, until, problem.tables, until * problem.step_s)
        return RUNNING, found

    return in_lanes


@inlined
def actuators_step(member, t_s):
    """Let the coils go on to their targets, and add up what they take; switched ones have."""
    cells, coils = member.state.cells[0], member.constants.coils
    if coils.pwm_period_s > 0.0:
        return
    energy, greatest = cells.goal_power_w * t_s, cells.goal_greatest_a_m2
    if coils.lag_s > 0.0:
        energy, greatest = advance_coils(coils, member.state.coils, t_s)
    cells.coil_energy_j += energy
    cells.peak_dipole_a_m2 = max(cells.peak_dipole_a_m2, greatest)


def is_too_coarse(integrator, problem, b_inertial, step, look):
    """Whether the integrator's step does not follow the motion."""
    if not isinstance(integrator, Rk4):
        return False
    return _rk4_is_too_coarse(integrator, problem, b_inertial, step, look)


@kernel
def _rk4_is_too_coarse(integrator, problem, b_inertial, step, look):
    members, h = problem.members, problem.step_s
    if look == LOOK:
        each(members, add_up_step, b_inertial, h, problem.record_steps)
    return must_stop(members, is_followed, COARSE_STEP, step, integrator, b_inertial, h)


@overload(is_too_coarse, jit_options=INLINED_OPTIONS)
def _is_too_coarse(integrator, problem, b_inertial, step, look):
    if integrator.instance_class is Rk4:
        return _rk4_is_too_coarse.py_func
    return lambda integrator, problem, b_inertial, step, look: False


def _propagate(address, step, last, look):
    """Go on from a step to `last`, or to where a torque jumps before; the step reached.

    Negative if it ended there: less BAD_STATE, COARSE_STEP or TILTED. `look`: one of those above.
    """
    problem = whole(record_at(address))
    members, h = problem.members, problem.step_s
    local = environment_with(problem.tables, local_in(problem.local), step * h)
    if look != GO_ON and is_too_coarse(problem.integrator, problem, local.b_t, step, look):
        return -COARSE_STEP
    if step == last:
        return step
    constants = first_member(members).constants
    until = next_draw(constants, step, last)
    until = next_dead_motor(constants.switching, constants.rotors, step, until)
    each(members, draw_torques_step, step)
    ended, found = advance(members, problem, local, step, until)
    if ended != RUNNING:
        return -ended
    each(members, actuators_step, (until - step) * h)
    each(members, remember_step, found[0])
    put_local(problem.local, found)
    return until


#: `(address of a Problem, step, last, look) -> step`, from Python and from the loop.
propagate = Entry(_propagate, 3)
call_propagate = entry_caller(3)
