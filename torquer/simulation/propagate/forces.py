"""What moves the body between two events of the loop, and its rates at an instant.

Functions take just the numbers that they need, not the whole plan: every array that crosses a call
costs reference counting, and a smaller function compiles to better code.
"""

from typing import NamedTuple

import numpy as np

from torquer.compile.engine import inlined
from torquer.environment.light import Light, between_edges, light_at
from torquer.environment.local import LocalEnvironment
from torquer.environment.table import Table, lookup3, lookup6
from torquer.maths.geometry.vec3 import add, add_scaled, scale, sub
from torquer.simulation.loop.state import goal_dipole
from torquer.spacecraft.actuators.coils import present_dipole, remaining
from torquer.spacecraft.actuators.rotors import Rotors, carried_momentum, reaction, step_rotors
from torquer.spacecraft.body import Rigid, motion_rates
from torquer.spacecraft.disturbance.acting import with_coefficients, with_memory


class DipolePath(NamedTuple):
    """Dipole [A m^2, body] from an event on: `target` + `way` exp(-t/lag)."""

    target: tuple
    way: tuple
    lag_s: float


@inlined
def dipole_after(path, t):
    """Dipole t seconds after the event."""
    return add_scaled(path.target, remaining(path.lag_s, t), path.way)


class EnvironmentTables(NamedTuple):
    """The tabulated environment that moves the body.

    `orbit`: position [m], B [T], gravity-gradient vector [1/s]; `air`: the flow [sqrt(Pa)],
    `light`: sunlight as it pushes, each () for none. `gravity`: 1, or 0 for a run without gravity
    gradient. `orbit_angle`: at the start [rad] and its rate [rad/s], () where no torque needs it.
    """

    orbit: Table
    air: Table | tuple
    gravity: float
    light: Light | tuple = ()
    orbit_angle: tuple = ()


class Wheels(NamedTuple):
    """The rotors of the wheels and their state, which a step changes."""

    rotors: Rotors
    state: np.ndarray


class Forces(NamedTuple):
    """What moves the body between two events; `held`: torque [N m, body]; `wheels`: () for none."""

    rigid: Rigid
    tables: EnvironmentTables
    path: DipolePath
    held: tuple
    wheels: Wheels | tuple


@inlined
def wheel_spin(wheels, omega, step, h):
    """What the wheels do during a step, a `Spin`; () for a satellite without wheels."""
    if len(wheels) == 0:
        return ()
    return step_rotors(wheels.rotors, wheels.state, omega, step, h)


@inlined
def with_wheel_momentum(rigid, spin, omega, since):
    """The body with the momentum that its wheels have `since` seconds into the step."""
    if len(spin) == 0:
        return rigid
    momentum = add(rigid.wheel_momentum, carried_momentum(spin, omega, since))
    return Rigid(rigid.inertia, rigid.inverse_inertia, momentum, rigid.surface, rigid.acting)


@inlined
def with_reaction(held, spin):
    """The held torque and that of the wheels' motors on the body [N m]."""
    if len(spin) == 0:
        return held
    return add(held, reaction(spin))


@inlined
def with_present(rigid, acting, coefficients, rods):
    """The body with what its torques `acting` are at present.

    `coefficients`: of the unmodelled torque; `rods`: what hysteresis rods remember.
    """
    if len(acting) == 0:
        return rigid
    present = with_memory(with_coefficients(acting, coefficients), rods)
    return Rigid(rigid.inertia, rigid.inverse_inertia, rigid.wheel_momentum, rigid.surface, present)


@inlined
def _flow_at(air, t):
    if len(air) == 0:
        return ()
    return lookup3(air, t)


@inlined
def _light_at(light, orbit, t):
    if len(light) == 0:
        return ()
    return light_at(light.shadow, lookup3(orbit, t), lookup3(light.sun, t))


@inlined
def _angle_at(orbit_angle, t):
    if len(orbit_angle) == 0:
        return ()
    return (orbit_angle[0] + orbit_angle[1] * t,)


@inlined
def look_up(tables, t):
    """Field and gravity-gradient vector at time t [s]."""
    return lookup6(tables.orbit, t, 3)


@inlined
def environment_at(tables, t):
    """The environment at time t [s]."""
    return environment_with(tables, look_up(tables, t), t)


@inlined
def environment_with(tables, found, t):
    """The environment at time t [s]; `found`: field and gravity-gradient vector there."""
    return LocalEnvironment(
        found[0],
        scale(tables.gravity, found[1]),
        _flow_at(tables.air, t),
        _light_at(tables.light, tables.orbit, t),
        _angle_at(tables.orbit_angle, t),
    )


@inlined
def with_light_between(tables, early, late):
    """The tables with the light that there is between two edges of the shadow."""
    light = between_edges(tables.light, tables.orbit, 0.5 * (early + late))
    return EnvironmentTables(tables.orbit, tables.air, tables.gravity, light, tables.orbit_angle)


@inlined
def rates_at(rigid, spin, local, dipole, into, x, torque):
    """Rates of a motion under a dipole [A m^2, body], `into` seconds into the wheels' step."""
    body = with_wheel_momentum(rigid, spin, x.omega, into)
    return motion_rates(body, local, dipole, x, torque)


@inlined
def as_wheels(rotors, state):
    """The wheels as the integrators take them, () for none."""
    if len(rotors) == 0:
        return ()
    return Wheels(rotors, state.rotors)


@inlined
def forces_now(member, tables):
    """What moves a member's body up to the next event, while the coils go to their targets."""
    state, dynamics, way = member.state, member.constants, (0.0, 0.0, 0.0)
    target = goal_dipole(state.cells)
    if dynamics.coils.lag_s > 0.0:
        way = sub(present_dipole(dynamics.coils, state.coils), target)
    path = DipolePath(target, way, dynamics.coils.lag_s)
    rigid = with_present(dynamics.rigid, dynamics.rigid.acting, state.coefficients, state.rods)
    held = (state.held[0], state.held[1], state.held[2])
    return Forces(rigid, tables, path, held, as_wheels(dynamics.rotors, state))
