"""The one loop: environment -> sensors -> on-board computer -> actuators -> integrate -> record.

A control cycle is a window of measurement (coils off) followed by a window of actuation; a
measurement window of no length gives plain sample-and-hold control. The law is called at every
sampling instant of the measurement window and at its end; the coils follow its latest answer.
All times are whole numbers of steps, so a run can stop at any step and go on bit for bit.
"""

import math
from typing import NamedTuple

import numpy as np

from torquer.conventions import Measured
from torquer.engine import inlined, kernel
from torquer.environment.sun import lit_fraction_at
from torquer.environment.table import Table, lookup3, lookup6, rate_of_second
from torquer.geometry.quaternion import rotate_inverse
from torquer.geometry.vec3 import cross, dot, sub, unit
from torquer.integrate.dop853 import Workspace
from torquer.integrate.rk4 import Motion
from torquer.simulation.advance import (
    DOP853,
    SPLITTING,
    DipolePath,
    by_dop853,
    by_rk4,
    by_splitting,
)
from torquer.spacecraft.body import Rigid
from torquer.spacecraft.coils import CoilSet, dipole_of, drive, energy_j, remaining
from torquer.spacecraft.gyro import GyroSet, read_rate, walked_bias
from torquer.spacecraft.magnetometer import MagnetometerSet, read_field
from torquer.spacecraft.sun_sensor import SunSensorSet, read_sun

#: How a piece of the run ended.
RUNNING, BAD_STATE, BAD_LAW = 0, 1, 2
#: Columns of the record: step, quaternion, rate, dipole, measured field, rate, Sun, wanted dipole.
COLUMNS = 1 + 4 + 3 + 3 + 3 + 3 + 3 + 3


class Tables(NamedTuple):
    """The tabulated environment: `orbit` has position [m] and B [T], `sun` the Sun's position."""

    orbit: Table
    sun: Table


class Plan(NamedTuple):
    """All that stays the same during a run."""

    rigid: Rigid
    coils: CoilSet
    magnetometer: MagnetometerSet
    gyro: GyroSet
    sun_sensors: SunSensorSet
    parameters: np.ndarray
    step_s: float
    cycle_steps: int
    measure_steps: int
    sample_steps: int
    record_steps: int
    integrator: int
    tolerance: float
    gravity: float
    seed: int


class State(NamedTuple):
    """All that changes: arrays, so that a run can be stored and resumed exactly.

    `motion`: quaternion, rate. `strengths`, `target`: dipole of each coil, now and wanted.
    `command`: what the law last asked for. `memory`: the law's. `drift`: of the gyro.
    `measured`: t, B, dB/dt, rate, Sun. `totals`: coil energy [J], greatest coil strength.
    `step`: how many steps are done. `work`: scratch, worth nothing between steps.
    """

    motion: np.ndarray
    strengths: np.ndarray
    target: np.ndarray
    command: np.ndarray
    memory: np.ndarray
    drift: np.ndarray
    measured: np.ndarray
    totals: np.ndarray
    step: np.ndarray
    work: Workspace


@inlined
def sense(plan, tables, state, step):
    """(Measured, gyro drift) at a sampling instant: a pure function of the state and the step."""
    t = step * plan.step_s
    q, omega = motion_of(state.motion)
    r, b = lookup6(tables.orbit, t)
    b_body = rotate_inverse(q, b)
    field_turning = rotate_inverse(q, rate_of_second(tables.orbit, t))
    dipole = dipole_of(plan.coils, state.strengths)
    drift = (state.drift[0], state.drift[1], state.drift[2])
    drift = walked_bias(plan.gyro, drift, plan.sample_steps * plan.step_s, plan.seed, step)
    sun_body = (0.0, 0.0, 0.0)
    if plan.sun_sensors.axes.shape[0] > 0:
        sun = lookup3(tables.sun, t)
        lit = lit_fraction_at(r, sun)
        sun_body = read_sun(
            plan.sun_sensors, rotate_inverse(q, unit(sub(sun, r))), lit, plan.seed, step
        )
    measured = Measured(
        t,
        read_field(plan.magnetometer, b_body, dipole, plan.seed, step),
        sub(field_turning, cross(omega, b_body)),
        read_rate(plan.gyro, omega, drift, plan.seed, step),
        sun_body,
    )
    return measured, drift


@inlined
def motion_of(m):
    """Motion held in an array: quaternion, rate."""
    return Motion((m[0], m[1], m[2], m[3]), (m[4], m[5], m[6]))


@inlined
def _put3(array, first, v):
    array[first], array[first + 1], array[first + 2] = v


@inlined
def think(law, plan, tables, state, step):
    """Sensors and on-board computer at a sampling instant; False if the law's answer is bad."""
    measured, drift = sense(plan, tables, state, step)
    _put3(state.drift, 0, drift)
    state.measured[0] = measured.t_s
    _put3(state.measured, 1, measured.b_body_t)
    _put3(state.measured, 4, measured.b_rate_body_t_s)
    _put3(state.measured, 7, measured.omega_body_rad_s)
    _put3(state.measured, 10, measured.sun_body)
    command = law(measured, plan.parameters, state.memory)
    _put3(state.command, 0, command)
    return math.isfinite(command[0] + command[1] + command[2])


@inlined
def switch_coils(plan, state, on):
    """Set the coils' targets: the latest command, or off."""
    if on:
        drive(plan.coils, (state.command[0], state.command[1], state.command[2]), state.target)
    else:
        state.target[:] = 0.0
    if plan.coils.lag_s == 0.0:
        state.strengths[:] = state.target


@inlined
def settle_coils(coils, strengths, target, totals, t_s):
    """Energy spent in t_s seconds, greatest strength, and strengths at the end."""
    totals[0] += energy_j(coils, strengths, target, t_s)
    to_go = remaining(coils.lag_s, t_s)
    for i in range(target.size):
        at_first = abs(strengths[i])
        strengths[i] = target[i] + (strengths[i] - target[i]) * to_go
        totals[1] = max(totals[1], at_first, abs(strengths[i]))


@inlined
def record_row(plan, state, step, row):
    """Write what is kept of this instant."""
    row[0] = step
    row[1:8] = state.motion
    _put3(row, 8, dipole_of(plan.coils, state.strengths))
    row[11:14] = state.measured[1:4]
    row[14:17] = state.measured[7:10]
    row[17:20] = state.measured[10:13]
    row[20:23] = state.command


@inlined
def next_event(plan, step, last):
    """First step after this one at which something but the motion happens."""
    phase = step % plan.cycle_steps
    ahead = plan.cycle_steps - phase
    if phase < plan.measure_steps:
        ahead = plan.sample_steps - phase % plan.sample_steps
    return min(step + ahead, step + plan.record_steps - step % plan.record_steps, last)


@inlined
def coast(plan, tables, state, first, last):
    """The motion over steps first..last-1, in which the coils follow their targets."""
    rigid, orbit, gravity, h = plan.rigid, tables.orbit, plan.gravity, plan.step_s
    start, target = dipole_of(plan.coils, state.strengths), dipole_of(plan.coils, state.target)
    path = DipolePath(start, target, plan.coils.lag_s)
    if plan.integrator == DOP853:
        by_dop853(
            rigid, orbit, gravity, path, state.motion, first, last, h, plan.tolerance, state.work
        )
        return motion_of(state.motion)
    x = motion_of(state.motion)
    if plan.integrator == SPLITTING:
        return by_splitting(rigid, orbit, gravity, path, x, first, last, h)
    return by_rk4(rigid, orbit, gravity, path, x, first, last, h)


@kernel
def run_steps(law, plan, tables, state, record, last):
    """Run on to step `last`; return how it ended. `state.step` tells how far it came."""
    step = state.step[0]
    while step < last:
        phase = step % plan.cycle_steps
        if phase == 0 and plan.measure_steps > 0:
            switch_coils(plan, state, False)
        if phase <= plan.measure_steps and phase % plan.sample_steps == 0:
            if not think(law, plan, tables, state, step):
                return BAD_LAW
        if phase == plan.measure_steps:
            switch_coils(plan, state, True)
        if step % plan.record_steps == 0:
            record_row(plan, state, step, record[step // plan.record_steps])
        after = next_event(plan, step, last)
        x = coast(plan, tables, state, step, after)
        if not math.isfinite(dot(x.omega, x.omega) + x.q[0] + x.q[1] + x.q[2] + x.q[3]):
            return BAD_STATE
        settle_coils(
            plan.coils, state.strengths, state.target, state.totals, (after - step) * plan.step_s
        )
        state.motion[0], state.motion[1], state.motion[2], state.motion[3] = x.q
        _put3(state.motion, 4, x.omega)
        step = after
        state.step[0] = step
    return RUNNING
