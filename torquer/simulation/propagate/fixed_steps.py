"""Fixed steps between two events of the loop: RK4, and splitting about the exact free rotation."""

import math
from typing import NamedTuple

from torquer.compile.engine import inlined, kernel
from torquer.maths.geometry.motion import Motion
from torquer.maths.geometry.quaternion import normalise
from torquer.maths.geometry.vec3 import add_scaled, dot, sub, sym_vec
from torquer.maths.integrate.rk4 import advance, rk4_damping, rk4_lag, rk4_sum
from torquer.maths.integrate.splitting import NODES, drift, kick
from torquer.simulation.loop.state import goal_dipole, read_motion
from torquer.simulation.propagate.forces import (
    as_wheels,
    dipole_after,
    environment_at,
    environment_with,
    look_up,
    rates_at,
    wheel_spin,
    with_reaction,
)
from torquer.spacecraft.actuators.coils import remaining
from torquer.spacecraft.actuators.rotors import relative_momentum, rotor_axis
from torquer.spacecraft.body import momentum_body, torque_body
from torquer.spacecraft.frequencies import libration_fourth, nutation_square


class Rk4(NamedTuple):
    """Runge-Kutta of order 4 with fixed steps.

    Greatest turns within a step [rad] that it follows: of a nutation, of the body.
    """

    most_nutation: float
    most_turn: float


class Splitting(NamedTuple):
    """Exact free rotation between kicks: principal moments [kg m^2] and their axes' attitude."""

    moments: tuple
    q_principal_to_body: tuple


@inlined
def rk4_step(forces, x, local, middle, end, left, step, h):
    """Motion after a step of RK4 between the environments `local` and `end`, with its wheels.

    `left`: parts of the dipole's way that are still to go at start, middle and end.
    """
    spin = wheel_spin(forces.wheels, x.omega, step, h)
    return rk4_with(forces, spin, x, local, middle, end, left, h)


@inlined
def rk4_with(forces, spin, x, local, middle, end, left, h):
    """The same, for what the rotors of the wheels do."""
    rigid, _, path, held, _ = forces
    half = 0.5 * h
    torque = with_reaction(held, spin)
    m1 = add_scaled(path.target, left[0], path.way)
    m2 = add_scaled(path.target, left[1], path.way)
    m4 = add_scaled(path.target, left[2], path.way)
    k1 = rates_at(rigid, spin, local, m1, 0.0, x, torque)
    k2 = rates_at(rigid, spin, middle, m2, half, advance(x, half, k1), torque)
    k3 = rates_at(rigid, spin, middle, m2, half, advance(x, half, k2), torque)
    k4 = rates_at(rigid, spin, end, m4, h, advance(x, h, k3), torque)
    return rk4_sum(x, h, k1, k2, k3, k4)


@inlined
def left_in_step(lag_s, since, h):
    """Parts of a dipole's way that are still to go at start, middle and end of a step."""
    # before the stages: a call of `exp` between them would empty the registers
    return remaining(lag_s, since), remaining(lag_s, since + 0.5 * h), remaining(lag_s, since + h)


@kernel
def by_rk4(forces, x, local, first, last, h):
    """(Motion, what `look_up` finds) after steps first..last-1 by RK4; `local`: before them.

    The environment is looked up twice a step.
    """
    found = (local.b_t, local.gravity_gradient)
    for step in range(first, last):
        middle = environment_at(forces.tables, (step + 0.5) * h)
        found = look_up(forces.tables, (step + 1) * h)
        end = environment_with(forces.tables, found, (step + 1) * h)
        left = left_in_step(forces.path.lag_s, (step - first) * h, h)
        x = rk4_step(forces, x, local, middle, end, left, step, h)
        local = end
    return x, found


@kernel
def kick_at(forces, x, t, since, h):
    """Motion after a kick of h seconds by the torque at t, `since` seconds after the event."""
    rigid, local = forces.rigid, environment_at(forces.tables, t)
    torque = torque_body(rigid, local, dipole_after(forces.path, since), x, forces.held)
    return kick(rigid.inertia, rigid.wheel_momentum, torque, x, h)


@kernel
def by_splitting(forces, moments, axes, x, first, last, h):
    """Motion after steps first..last-1: exact free rotation between two kicks a step."""
    early, late = NODES
    for step in range(first, last):
        t, since = step * h, (step - first) * h
        sooner, later, half = early * h, late * h, 0.5 * h
        x = drift(moments, axes, x, sooner)
        x = kick_at(forces, x, t + sooner, since + sooner, half)
        x = drift(moments, axes, x, later - sooner)
        x = kick_at(forces, x, t + later, since + later, half)
        x = drift(moments, axes, x, sooner)
        x = Motion(normalise(x.q), x.omega)
    return x


@inlined
def momentum_now(rigid, wheels, omega):
    """Angular momentum [N m s, body] of the body and its wheels."""
    momentum = momentum_body(rigid, omega)
    if len(wheels) == 0:
        return momentum
    rows = wheels.rotors.rows
    for k in range(rows.shape[0]):
        held = relative_momentum(rows, wheels.state, omega, k)
        momentum = add_scaled(momentum, held, rotor_axis(rows, k))
    return sub(momentum, sym_vec(wheels.rotors.tensor, omega))


@kernel
def squared_rates(member, b_inertial):
    """Squares [1/s^2] of a member's rate and of its fastest oscillation: nutation, libration."""
    state, rigid, omega = (
        member.state,
        member.constants.rigid,
        read_motion(member.state.cells).omega,
    )
    wheels = as_wheels(member.constants.rotors, state)
    nutation = nutation_square(rigid.inverse_inertia, momentum_now(rigid, wheels, omega), omega)
    libration = libration_fourth(rigid.inverse_inertia, goal_dipole(state.cells), b_inertial)
    return dot(omega, omega), math.sqrt(nutation * nutation + libration)


@kernel
def add_up_step(member, b_inertial, h, steps):
    """Add up what the next steps of RK4 do to the motion by themselves."""
    cells, (turning, oscillation) = member.state.cells[0], squared_rates(member, b_inertial)
    cells.damping += rk4_damping(oscillation, h, steps)
    cells.lag += rk4_lag(turning, h, steps)


@kernel
def is_followed(member, integrator, b_inertial, h):
    """Whether a step of RK4 follows the motion."""
    turning, oscillation = squared_rates(member, b_inertial)
    turns = turning * h * h <= integrator.most_turn**2
    return turns and oscillation * h * h <= integrator.most_nutation**2
