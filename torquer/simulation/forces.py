"""What moves the body between two events of the loop, and its rates at an instant.

Functions take just the numbers that they need, not the whole plan: every array that crosses a call
costs reference counting, and a smaller function compiles to better code.
"""

from typing import NamedTuple

import numpy as np

from torquer.engine import inlined, internal
from torquer.environment.local import LocalEnvironment
from torquer.environment.table import Table, lookup3, lookup6
from torquer.geometry.vec3 import add, add_scaled, scale
from torquer.spacecraft.body import Rigid, motion_rates
from torquer.spacecraft.coils import remaining
from torquer.spacecraft.disturbance import DisturbanceTorque
from torquer.spacecraft.rotors import Rotors, carried_momentum, reaction, step_rotors


class DipolePath(NamedTuple):
    """Dipole [A m^2, body] from an event on: `target` + `way` exp(-t/lag)."""

    target: tuple
    way: tuple
    lag_s: float


@internal
def dipole_after(path, t):
    """Dipole t seconds after the event."""
    return add_scaled(path.target, remaining(path.lag_s, t), path.way)


class EnvironmentTables(NamedTuple):
    """What the orbit brings: table of position, field and gravity-gradient vector; of the air's
    flow, () for none.

    `gravity`: 1, or 0 for a run without gravity gradient.
    """

    orbit: Table
    air: Table | tuple
    gravity: float


class Wheels(NamedTuple):
    """The rotors of the wheels and their state, which a step changes."""

    rotors: Rotors
    state: np.ndarray


class Forces(NamedTuple):
    """What moves the body between two events; `disturbance`, `wheels`: () for none."""

    rigid: Rigid
    tables: EnvironmentTables
    path: DipolePath
    disturbance: DisturbanceTorque | tuple
    seed: int
    wheels: Wheels | tuple


@internal
def spin_of(wheels, omega, step, h):
    """What the wheels do during a step, a `Spin`; () for a satellite without wheels."""
    if len(wheels) == 0:
        return ()
    return step_rotors(wheels.rotors, wheels.state, omega, step, h)


@internal
def with_wheel_momentum(rigid, spin, omega, since):
    """The body with the momentum that its wheels have `since` seconds into the step."""
    if len(spin) == 0:
        return rigid
    momentum = add(rigid.wheel_momentum, carried_momentum(spin, omega, since))
    return Rigid(rigid.inertia, rigid.inverse_inertia, momentum, rigid.surface)


@internal
def with_reaction(disturbance, spin):
    """The disturbance torque and that of the wheels' motors on the body; () for none of both."""
    if len(spin) == 0:
        return disturbance
    if len(disturbance) == 0:
        return reaction(spin)
    return add(disturbance, reaction(spin))


@internal
def _flow_at(air, t):
    if len(air) == 0:
        return ()
    return lookup3(air, t)


@inlined
def environment_at(tables, t):
    """The environment at time t [s]."""
    b, gravity_gradient = lookup6(tables.orbit, t, 3)
    return LocalEnvironment(b, scale(tables.gravity, gravity_gradient), _flow_at(tables.air, t))


@internal
def rates_at(rigid, spin, here, dipole, into, x, torque):
    """Rates of a motion under a dipole [A m^2, body], `into` seconds into the wheels' step."""
    body = with_wheel_momentum(rigid, spin, x.omega, into)
    return motion_rates(body, here, dipole, x, torque)


@internal
def wheels_of(rotors, state):
    """The wheels as the integrators take them, () for none."""
    if len(rotors) == 0:
        return ()
    return Wheels(rotors, state)


@internal
def environment_tables(plan, tables):
    """The tables that move the body."""
    return EnvironmentTables(tables.orbit, tables.air, plan.plant.gravity)
