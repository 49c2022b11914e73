"""The motion while coils are switched on and off: pulse-width modulation, each switching exact.

What lies between two switchings is propagated by itself, as between two events: every integrator
meets a dipole that is constant or approaches a constant one.
"""

import math

from numba.extending import overload

from torquer.compile.engine import inlined, kernel
from torquer.compile.numba_private import INLINED_OPTIONS
from torquer.maths.geometry.motion import Motion
from torquer.maths.geometry.quaternion import normalise
from torquer.maths.geometry.vec3 import sub
from torquer.maths.integrate.splitting import NODES, drift
from torquer.simulation.loop.state import read_motion
from torquer.simulation.propagate.adaptive import Auto, propagate_in_light
from torquer.simulation.propagate.dormand_prince import Smooth
from torquer.simulation.propagate.fixed_steps import Rk4, Splitting, kick_at, left_in_step, rk4_step
from torquer.simulation.propagate.forces import (
    DipolePath,
    Forces,
    environment_at,
)
from torquer.spacecraft.actuators.coil_driver import next_switch, switch_coils
from torquer.spacecraft.actuators.coils import advance_coils, present_dipole

#: Fixed steps over the lag of the dipoles while they change, and lags after which they do not.
_SHORT, _SETTLED = 0.25, 40.0


@inlined
def short_steps(lag_s, length_s, h):
    """Fixed steps that follow dipoles that change [s], and for how long they are needed [s]."""
    if lag_s == 0.0:
        return h, 0.0
    return min(h, _SHORT * lag_s), min(_SETTLED * lag_s, length_s)


def auto_between(integrator, forces, cells, x, start_s, length_s, h, step):
    """Motion after an interval by adaptive steps."""
    rigid, tables, path, held, wheels = forces
    smooth = Smooth(rigid, tables, path, held, (), start_s, 0.0)
    local = environment_at(tables, start_s)
    return propagate_in_light(
        integrator, smooth, tables.light, cells, wheels, x, local, length_s, step
    )


@kernel
def rk4_part(forces, x, start_s, since_s, length_s, h, step):
    """Motion after a part of an interval, from since_s into it, by equal steps of at most h."""
    count = math.ceil(length_s / h * (1.0 - 1e-9))
    first, part = start_s + since_s, length_s / max(count, 1)
    local = environment_at(forces.tables, first)
    for k in range(count):
        middle = environment_at(forces.tables, first + (k + 0.5) * part)
        end = environment_at(forces.tables, first + (k + 1) * part)
        left = left_in_step(forces.path.lag_s, since_s + k * part, part)
        x = rk4_step(forces, x, local, middle, end, left, step, part)
        local = end
    return x


def rk4_between(integrator, forces, cells, x, start_s, length_s, h, step):
    """Motion after an interval by steps of RK4 of at most h, short ones while dipoles change."""
    short, fine = short_steps(forces.path.lag_s, length_s, h)
    x = rk4_part(forces, x, start_s, 0.0, fine, short, step)
    return rk4_part(forces, x, start_s, fine, length_s - fine, h, step)


@kernel
def splitting_part(integrator, forces, x, start_s, since_s, length_s, h):
    """The same about the exact free rotation."""
    count, (early, late) = math.ceil(length_s / h * (1.0 - 1e-9)), NODES
    moments, axes = integrator.moments, integrator.q_principal_to_body
    part = length_s / max(count, 1)
    sooner, later, half = early * part, late * part, 0.5 * part
    for k in range(count):
        since = since_s + k * part
        x = drift(moments, axes, x, sooner)
        x = kick_at(forces, x, start_s + since + sooner, since + sooner, half)
        x = drift(moments, axes, x, later - sooner)
        x = kick_at(forces, x, start_s + since + later, since + later, half)
        x = drift(moments, axes, x, sooner)
        x = Motion(normalise(x.q), x.omega)
    return x


def splitting_between(integrator, forces, cells, x, start_s, length_s, h, step):
    """The same about the exact free rotation."""
    short, fine = short_steps(forces.path.lag_s, length_s, h)
    x = splitting_part(integrator, forces, x, start_s, 0.0, fine, short)
    return splitting_part(integrator, forces, x, start_s, fine, length_s - fine, h)


_BETWEEN = {Auto: auto_between, Rk4: rk4_between, Splitting: splitting_between}


def between(integrator, forces, cells, x, start_s, length_s, h, step):
    """Motion after an interval from start_s on, within `step` of the grid, by the integrator."""
    return _BETWEEN[type(integrator)](integrator, forces, cells, x, start_s, length_s, h, step)


@overload(between, jit_options=INLINED_OPTIONS)
def _choose_between(integrator, forces, cells, x, start_s, length_s, h, step):
    return _BETWEEN[integrator.instance_class]


@inlined
def switched_path(coils, state, goal):
    """The dipole from a switching on."""
    way = (0.0, 0.0, 0.0)
    if coils.lag_s > 0.0:
        way = sub(present_dipole(coils, state), goal.dipole_a_m2)
    return DipolePath(goal.dipole_a_m2, way, coils.lag_s)


@kernel
def by_switching(integrator, member, forces, step, until, h):
    """Motion after steps step..until-1, with all that the coils do meanwhile."""
    cells, state = member.state.cells[0], member.state.coils
    coils, x = member.constants.coils, read_motion(member.state.cells)
    t, end = step * h, until * h
    while t < end:
        goal = switch_coils(coils, state, t)
        later = min(next_switch(coils, state, t), end)
        path = switched_path(coils, state, goal)
        now = Forces(forces.rigid, forces.tables, path, forces.held, forces.wheels)
        x = between(integrator, now, cells, x, t, later - t, h, max(step, int(t / h)))
        energy, greatest = goal.power_w * (later - t), goal.greatest_a_m2
        if coils.lag_s > 0.0:
            energy, greatest = advance_coils(coils, state, later - t)
        cells.coil_energy_j += energy
        cells.peak_dipole_a_m2 = max(cells.peak_dipole_a_m2, greatest)
        t = later
    return x
