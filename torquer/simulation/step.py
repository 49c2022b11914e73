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
from torquer.engine import inlined, kernel, without_reference_counts
from torquer.environment.sun import Shadow, lit_fraction_at
from torquer.environment.table import Table, lookup3, lookup6, rate_from
from torquer.geometry.motion import Motion
from torquer.geometry.quaternion import rotate_inverse
from torquer.geometry.vec3 import add_scaled, cross, dot, sub, sym_vec, unit
from torquer.integrate.rk4 import (
    MOST_NUTATION,
    MOST_TURN,
    damping_of_steps,
    lag_of_steps,
)
from torquer.simulation.advance import (
    Around,
    DipolePath,
    Wheels,
    by_dop853,
    by_rk4,
    by_splitting,
    environment_at,
)
from torquer.spacecraft.attitude_sensor import AttitudeSensorSet, read_attitude
from torquer.spacecraft.body import Rigid, momentum_body
from torquer.spacecraft.coils import NOW, TARGET, CoilSet, dipole_of, drive, follow
from torquer.spacecraft.disturbance import DisturbanceTorque
from torquer.spacecraft.frequencies import libration_fourth, nutation_square
from torquer.spacecraft.gyro import GyroSet, read_rate, walked_bias
from torquer.spacecraft.magnetometer import MagnetometerSet, read_field
from torquer.spacecraft.rotors import MOTOR, axis_of, relative_momentum
from torquer.spacecraft.sun_sensor import SunSensorSet, read_sun
from torquer.spacecraft.wheels import Driver, drive_wheels, read_wheels

#: How a piece of the run ended.
RUNNING, BAD_STATE, BAD_LAW, BAD_WHEEL_LAW, COARSE_STEP = 0, 1, 2, 3, 4
#: Columns of the record: step, quaternion, rate, dipole, measured field, rate, Sun, wanted dipole;
#: with wheels then the torque asked of them, and momentum and motor torque of each.
COLUMNS = 1 + 4 + 3 + 3 + 3 + 3 + 3 + 3


class Tables(NamedTuple):
    """The tabulated environment: `orbit` has position [m], B [T], gravity-gradient vector [1/s],
    `sun` the Sun.

    `air`: the flow [sqrt(Pa)], () where the air does not count.
    """

    orbit: Table
    sun: Table
    air: Table | tuple


class Plan(NamedTuple):
    """All that stays the same during a run; `wheels`: () for a satellite without them."""

    rigid: Rigid
    coils: CoilSet
    wheels: Driver | tuple
    magnetometer: MagnetometerSet
    gyro: GyroSet
    sun_sensors: SunSensorSet
    shadow: Shadow
    attitude_sensor: AttitudeSensorSet
    navigates: bool
    parameters: np.ndarray
    step_s: float
    cycle_steps: int
    measure_steps: int
    sample_steps: int
    record_steps: int
    tolerance: float
    gravity: float
    disturbance: DisturbanceTorque | tuple
    seed: int


#: Places in `State.cells`: quaternion and rate, what the laws last asked for (dipole, torque of the
#: wheels), drift of the gyro, what was measured last (t, B, dB/dt, rate, Sun), coil energy [J],
#: greatest coil dipole, and what RK4 did by itself: damping of oscillations, lag of the rotation.
MOTION, COMMAND, TORQUE, DRIFT, MEASURED, ENERGY, PEAK, DAMPING, LAG, CELLS = (
    0, 7, 10, 13, 16, 29, 30, 31, 32, 33,
)  # fmt: skip


class State(NamedTuple):
    """All that changes: a few arrays, so that a run can be stored and resumed exactly.

    `coils`: dipole of each coil, now and wanted. `wheels`: rows as in `rotors`. `memory` and
    `wheel_memory`: the laws'. `step`: how many steps are done.
    """

    cells: np.ndarray
    coils: np.ndarray
    wheels: np.ndarray
    memory: np.ndarray
    wheel_memory: np.ndarray
    step: np.ndarray


@inlined
def get3(array, first):
    """Three cells as a vector."""
    return (array[first], array[first + 1], array[first + 2])


@inlined
def put3(array, first, v):
    """Write a vector into three cells."""
    array[first], array[first + 1], array[first + 2] = v


@inlined
def finite3(v):
    """Whether all three components are finite."""
    return math.isfinite(v[0]) and math.isfinite(v[1]) and math.isfinite(v[2])


@inlined
def motion_of(cells):
    """Motion held in the state."""
    q = (cells[MOTION], cells[MOTION + 1], cells[MOTION + 2], cells[MOTION + 3])
    return Motion(q, get3(cells, MOTION + 4))


@inlined
def put_motion(cells, x):
    """Write the motion into the state."""
    cells[MOTION], cells[MOTION + 1], cells[MOTION + 2], cells[MOTION + 3] = x.q
    put3(cells, MOTION + 4, x.omega)


@kernel
def see_sun(plan, tables, q, t, step):
    """What the Sun sensors read at time t."""
    r, sun = lookup3(tables.orbit, t), lookup3(tables.sun, t)
    direction = rotate_inverse(q, unit(sub(sun, r)))
    lit = lit_fraction_at(plan.shadow, r, sun)
    return read_sun(plan.sun_sensors, direction, lit, plan.seed, step)


@inlined
def navigation(wanted, orbit, t):
    """(Position, velocity, field, its rate), all inertial, for a law that navigates."""
    if wanted:
        b, _ = lookup6(orbit, t, 3)
        return lookup3(orbit, t), rate_from(orbit, t, 0), b, rate_from(orbit, t, 3)
    unknown = (math.nan, math.nan, math.nan)
    return unknown, unknown, unknown, unknown


@inlined
def wheel_momentum(driver, wheels, omega, seed, step):
    """What the tachometers tell of the wheels' momentum, as a vector."""
    if len(driver) == 0:
        return (0.0, 0.0, 0.0)
    return read_wheels(driver, wheels, omega, seed, step)


@inlined
def sense(plan, tables, state, x, here, step):
    """(Measured, gyro drift) at a sampling instant: a pure function of the state and the step."""
    cells, coils = state.cells, state.coils
    t = step * plan.step_s
    q, omega = x
    b_body = rotate_inverse(q, here.b_t)
    field_turning = rotate_inverse(q, rate_from(tables.orbit, t, 3))
    dipole = (0.0, 0.0, 0.0)
    if plan.magnetometer.coupling_t_per_a_m2 != 0.0:
        dipole = dipole_of(plan.coils, coils, NOW)
    since_last_s = t - cells[MEASURED]
    drift = walked_bias(plan.gyro, get3(cells, DRIFT), since_last_s, plan.seed, step)
    sun_body = (0.0, 0.0, 0.0)
    if plan.sun_sensors.axes.shape[0] > 0:
        sun_body = see_sun(plan, tables, q, t, step)
    measured = Measured(
        t,
        read_field(plan.magnetometer, b_body, dipole, plan.seed, step),
        sub(field_turning, cross(omega, b_body)),
        read_rate(plan.gyro, omega, drift, plan.seed, step),
        sun_body,
        read_attitude(plan.attitude_sensor, q, plan.seed, step),
        *navigation(plan.navigates, tables.orbit, t),
        wheel_momentum(plan.wheels, state.wheels, omega, plan.seed, step),
    )
    return measured, drift


@inlined
def think(law, wheel_law, plan, tables, state, x, here, step):
    """Sensors and on-board computer at a sampling instant; how it ended.

    The answers of the laws of coils [A m^2] and wheels [N m] are left in the cells.
    """
    cells = state.cells
    measured, drift = sense(plan, tables, state, x, here, step)
    command = law(measured, plan.parameters, state.memory)
    put3(cells, COMMAND, command)
    ended = RUNNING if finite3(command) else BAD_LAW
    if wheel_law is not None:
        torque = wheel_law(measured, plan.wheels.parameters, state.wheel_memory)
        put3(cells, TORQUE, torque)
        if ended == RUNNING and not finite3(torque):
            ended = BAD_WHEEL_LAW
    put3(cells, DRIFT, drift)
    cells[MEASURED] = measured.t_s
    put3(cells, MEASURED + 1, measured.b_body_t)
    put3(cells, MEASURED + 4, measured.b_rate_body_t_s)
    put3(cells, MEASURED + 7, measured.omega_body_rad_s)
    put3(cells, MEASURED + 10, measured.sun_body)
    return ended


@inlined
def switch_off(coil_set, coils):
    """Coils off: what a measurement window begins with."""
    for i in range(coils.shape[1]):
        coils[TARGET, i] = 0.0
        if coil_set.lag_s == 0.0:
            coils[NOW, i] = 0.0


@kernel
def record_wheels(driver, cells, wheels, record, row):
    """Write what is kept of the wheels."""
    if len(driver) == 0:
        return
    rows, omega = driver.rotors.rows, get3(cells, MOTION + 4)
    for i in range(3):
        record[row, COLUMNS + i] = cells[TORQUE + i]
    for k in range(rows.shape[0]):
        at = COLUMNS + 3 + k
        record[row, at] = relative_momentum(rows, wheels, omega, k)
        record[row, at + rows.shape[0]] = wheels[MOTOR, k]


@kernel
def record_row(plan, state, coils, step, record, row):
    """Write what is kept of this instant into a row of the record."""
    cells, dipole = state.cells, dipole_of(plan.coils, coils, NOW)
    record_wheels(plan.wheels, cells, state.wheels, record, row)
    record[row, 0] = step
    for i in range(7):
        record[row, 1 + i] = cells[MOTION + i]
    for i in range(3):
        record[row, 8 + i] = dipole[i]
        record[row, 11 + i] = cells[MEASURED + 1 + i]
        record[row, 14 + i] = cells[MEASURED + 7 + i]
        record[row, 17 + i] = cells[MEASURED + 10 + i]
        record[row, 20 + i] = cells[COMMAND + i]


@inlined
def wheels_of(driver, state):
    """The wheels as the integrators take them, () for none."""
    if len(driver) == 0:
        return ()
    return Wheels(driver.rotors, state)


@inlined
def momentum_now(rigid, driver, wheels, omega):
    """Angular momentum [N m s, body] of the body and its wheels."""
    momentum = momentum_body(rigid, omega)
    if len(driver) == 0:
        return momentum
    rotors = driver.rotors
    for k in range(rotors.rows.shape[0]):
        held = relative_momentum(rotors.rows, wheels, omega, k)
        momentum = add_scaled(momentum, held, axis_of(rotors.rows, k))
    return sub(momentum, sym_vec(rotors.tensor, omega))


@kernel
def resolves(plan, state, x, here):
    """Whether RK4's step resolves the motion; what it does until the next record is added up."""
    cells, h, inverse = state.cells, plan.step_s, plan.rigid.inverse_inertia
    momentum = momentum_now(plan.rigid, plan.wheels, state.wheels, x.omega)
    square = nutation_square(inverse, momentum, x.omega)
    dipole = dipole_of(plan.coils, state.coils, TARGET)
    square = math.sqrt(square * square + libration_fourth(inverse, dipole, here.b_t))
    turning = dot(x.omega, x.omega)
    cells[DAMPING] += damping_of_steps(square, h, plan.record_steps)
    cells[LAG] += lag_of_steps(turning, h, plan.record_steps)
    return square * h * h <= MOST_NUTATION**2 and turning * h * h <= MOST_TURN**2


@inlined
def coast(plan, around, state, x, here, first, last, principal, work):
    """(Motion, environment) after steps first..last-1, in which the coils follow their targets.

    What an integrator needs says which one it is: `principal` axes for the splitting, `work`
    for DOP853, neither for RK4. None is a type of its own, so that only one is compiled.
    """
    rigid, disturbance, coils, h = plan.rigid, plan.disturbance, state.coils, plan.step_s
    wheels = wheels_of(plan.wheels, state.wheels)
    target = dipole_of(plan.coils, coils, TARGET)
    way = (0.0, 0.0, 0.0)
    if plan.coils.lag_s > 0.0:
        way = sub(dipole_of(plan.coils, coils, NOW), target)
    path = DipolePath(target, way, plan.coils.lag_s)
    if principal is not None:
        x = by_splitting(rigid, principal, around, path, disturbance, x, first, last, h)
        return x, environment_at(around, last * h)
    if work is not None:
        x = by_dop853(
            rigid, around, path, disturbance, wheels, x, first, last, h, plan.tolerance, work
        )
        return x, environment_at(around, last * h)
    return by_rk4(rigid, around, path, disturbance, wheels, x, here, first, last, h)


@kernel
def run_steps(law, wheel_law, plan, tables, state, record, last, principal, work):
    """Run on to step `last`; return how it ended. `state.step` tells how far it came.

    `law` of the coils, `wheel_law` of the wheels, None for a satellite without; `principal`,
    `work`: see `coast`.
    """
    plan, tables, state, record = without_reference_counts((plan, tables, state, record))
    cells, coils = state.cells, state.coils
    around = Around(tables.orbit, tables.air, plan.gravity)
    step = state.step[0]
    x = motion_of(cells)
    here = environment_at(around, step * plan.step_s)
    phase = step % plan.cycle_steps
    to_sample = (plan.cycle_steps - phase) % plan.cycle_steps
    if phase <= plan.measure_steps:
        to_sample = -phase % plan.sample_steps
    to_record = -step % plan.record_steps
    while step < last:
        if phase == 0 and plan.measure_steps > 0:
            switch_off(plan.coils, coils)
        if to_sample == 0:
            ended = think(law, wheel_law, plan, tables, state, x, here, step)
            if ended != RUNNING:
                return ended
            on = phase == plan.measure_steps
            if on:
                drive(plan.coils, get3(cells, COMMAND), coils)
            to_sample = plan.cycle_steps - phase if on else plan.sample_steps
            wanted, interval_s = get3(cells, TORQUE), to_sample * plan.step_s
            drive_wheels(plan.wheels, state.wheels, wanted, interval_s, step)
        if to_record == 0:
            row = step // plan.record_steps % record.shape[0]  # the record of a piece of the run
            record_row(plan, state, coils, step, record, row)
            to_record = plan.record_steps
            fixed = principal is None and work is None
            if fixed and not resolves(plan, state, x, here):
                return COARSE_STEP
        ahead = min(to_sample, to_record, last - step)
        x, here = coast(plan, around, state, x, here, step, step + ahead, principal, work)
        if not math.isfinite(dot(x.omega, x.omega) + x.q[0] + x.q[1] + x.q[2] + x.q[3]):
            return BAD_STATE
        put_motion(cells, x)
        energy, greatest = follow(plan.coils, coils, ahead * plan.step_s)
        cells[ENERGY] += energy
        cells[PEAK] = max(cells[PEAK], greatest)
        to_sample -= ahead
        to_record -= ahead
        phase += ahead
        if phase == plan.cycle_steps:
            phase = 0
        step += ahead
        state.step[0] = step
    return RUNNING
