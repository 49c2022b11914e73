"""The loop for `LANES` members of one orbit at once, with the kernels and the bits of a single run.

What the orbit brings is looked up once for all; each phase of the loop (readings, laws, coils, a
step) runs over the members, in vectors. RK4 only: steps are shared.
"""

import math

import numpy as np
from numba import types

from torquer.adapter import ARRAY
from torquer.control.computer import NO_ESTIMATOR, take_readings
from torquer.engine import caller, internal, released, without_reference_counts
from torquer.environment.table import rate_from
from torquer.geometry.vec3 import dot, sub
from torquer.interface import UNKNOWN_ESTIMATE, put_ephemeris, put_estimate
from torquer.lanes import LANES, lane_plant, lane_state
from torquer.noise import normal3
from torquer.simulation.advance import left_in_step, resolves, rk4_step
from torquer.simulation.draws import draw_torques, next_draw
from torquer.simulation.forces import (
    DipolePath,
    Forces,
    environment_at,
    environment_tables,
    with_drawn,
)
from torquer.simulation.sensors import (
    attitude_sensor_step,
    deliver,
    ephemeris_at,
    gyro_step,
    magnetometer_step,
    search_coil_step,
    sun_sensors_step,
    sunlight_at,
)
from torquer.simulation.state import goal_dipole, motion_of, put_goal, put_motion
from torquer.simulation.step import (
    BAD_COMMAND,
    BAD_STATE,
    COARSE_STEP,
    RUNNING,
    advance_actuators,
    drive_coils,
    finite3,
)
from torquer.simulation.timetable import (
    ANY_DELIVERY,
    ATTITUDE_SENSOR,
    COILS_OFF,
    COILS_ON,
    CONTROL,
    GYRO,
    MAGNETOMETER,
    READ,
    SEARCH_COIL,
    SUN_SENSORS,
    row_from,
)
from torquer.spacecraft import attitude_sensor, gyro, magnetometer, sun_sensor
from torquer.spacecraft.coils import present_dipole, switch_off_coils
from torquer.spacecraft.disturbance.held import present_torque

#: A law for all lanes: cells, how many, first place of its parameters and of its memory, what it
#: needs.
LANES_LAW = types.void(ARRAY, *[types.int64] * 5)
call_law = caller(LANES_LAW)
#: Of a member: how it ended, and the step.
END = np.dtype([("how", np.int64), ("step", np.int64)])


@internal
def deliver_in_lanes(layout, cells, actions):
    """Let late readings arrive."""
    for lane in range(LANES):
        state = lane_state(layout, cells, lane)
        deliver(state.sensors, state.board.known[0], actions)


@internal
def draw_in_lanes(layout, cells, seeds, sensor, stream, drawn):
    """Draw the errors of the next readings of a sensor."""
    for lane in range(LANES):
        count = int(lane_state(layout, cells, lane).sensors[sensor].count)
        x, y, z = normal3(seeds[lane], stream, count)
        drawn[0, lane], drawn[1, lane], drawn[2, lane] = x, y, z


@internal
def of_lane(drawn, lane):
    """What was drawn for a member."""
    return (drawn[0, lane], drawn[1, lane], drawn[2, lane])


@internal
def magnetometers(layout, shared, late, cells, drawn, here, t):
    """Read the magnetometers."""
    for lane in range(LANES):
        state, plant = lane_state(layout, cells, lane), lane_plant(layout, cells, lane, shared)
        magnetometer_step(plant, late, state, motion_of(state.cells), here, t, of_lane(drawn, lane))


@internal
def search_coils(layout, cells, here, b_rate_inertial, t):
    """Read the search coils."""
    for lane in range(LANES):
        state = lane_state(layout, cells, lane)
        search_coil_step(state, motion_of(state.cells), here, b_rate_inertial, t)


@internal
def gyros(layout, shared, late, cells, drawn, drawn_walk, t):
    """Read the gyros."""
    for lane in range(LANES):
        state, plant = lane_state(layout, cells, lane), lane_plant(layout, cells, lane, shared)
        x, walk = motion_of(state.cells), of_lane(drawn_walk, lane)
        gyro_step(plant, late, state, x, t, of_lane(drawn, lane), walk)


@internal
def sun_sensors(layout, shared, late, cells, drawn, sunlight, t):
    """Read the Sun sensors."""
    for lane in range(LANES):
        state, plant = lane_state(layout, cells, lane), lane_plant(layout, cells, lane, shared)
        x = motion_of(state.cells)
        sun_sensors_step(plant, late, state, x, sunlight, t, of_lane(drawn, lane))


@internal
def attitude_sensors(layout, shared, late, cells, drawn, t):
    """Read the attitude sensors."""
    for lane in range(LANES):
        state, plant = lane_state(layout, cells, lane), lane_plant(layout, cells, lane, shared)
        attitude_sensor_step(plant, late, state, motion_of(state.cells), t, of_lane(drawn, lane))


@internal
def draw_if(sigma, layout, cells, seeds, sensor, stream, drawn):
    """Draw errors where there are any; `drawn` (streams, 3, LANES) is zero at first."""
    if sigma > 0.0:
        draw_in_lanes(layout, cells, seeds, sensor, stream, drawn[stream])
    return drawn[stream]


@internal
def read_in_lanes(layout, plan, tables, cells, seeds, drawn, here, actions, step):
    """Read the sensors that are due."""
    t, late, shared = step * plan.step_s, plan.timetable.late, plan.plant
    if actions & ANY_DELIVERY:
        deliver_in_lanes(layout, cells, actions)
    if actions & (READ << MAGNETOMETER):
        sigma, stream = shared.magnetometer.noise_t, magnetometer.STREAM
        error = draw_if(sigma, layout, cells, seeds, MAGNETOMETER, stream, drawn)
        magnetometers(layout, shared, late, cells, error, here, t)
    if actions & (READ << SEARCH_COIL):
        search_coils(layout, cells, here, rate_from(tables.orbit, t, 3), t)
    if actions & (READ << GYRO):
        sigma, stream = shared.gyro.noise_rad_s, gyro.NOISE_STREAM
        error = draw_if(sigma, layout, cells, seeds, GYRO, stream, drawn)
        sigma, stream = shared.gyro.drift_rad_s_sqrt_s, gyro.DRIFT_STREAM
        walk = draw_if(sigma, layout, cells, seeds, GYRO, stream, drawn)
        gyros(layout, shared, late, cells, error, walk, t)
    if actions & (READ << SUN_SENSORS):
        sunlight = sunlight_at(shared, tables, t)
        sigma, stream = shared.sun_sensors.noise_rad, sun_sensor.STREAM
        error = draw_if(sigma, layout, cells, seeds, SUN_SENSORS, stream, drawn)
        sun_sensors(layout, shared, late, cells, error, sunlight, t)
    if actions & (READ << ATTITUDE_SENSOR):
        sigma, stream = shared.attitude_sensor.noise_rad, attitude_sensor.STREAM
        error = draw_if(sigma, layout, cells, seeds, ATTITUDE_SENSOR, stream, drawn)
        attitude_sensors(layout, shared, late, cells, error, t)


@internal
def tell_ephemeris(layout, cells, count, ephemeris):
    """Tell the computers where they are."""
    for lane in range(count):
        put_ephemeris(lane_state(layout, cells, lane).board.known[0], ephemeris)


@internal
def estimate_in_lanes(layout, cells, count, estimator):
    """The estimates: the readings of attitude sensor and gyro, or none."""
    if estimator == NO_ESTIMATOR:
        for lane in range(count):
            put_estimate(lane_state(layout, cells, lane).board.known[0], UNKNOWN_ESTIMATE)
    else:
        for lane in range(count):
            take_readings(lane_state(layout, cells, lane).board.known[0])


@internal
def begin_in_lanes(layout, plan, tables, cells, count, step, estimator):
    """Tell the computers the time, their estimate and their ephemeris; ask for nothing yet.

    `count`: LANES; a number that the compiler knows would make it write out this short loop, member
    by member, instead of taking vectors.
    """
    t = step * plan.step_s
    for lane in range(count):
        state = lane_state(layout, cells, lane)
        known, c = state.board.known[0], state.cells[0]
        known.t_s = t
        c.dipole_x, c.dipole_y, c.dipole_z = 0.0, 0.0, 0.0
    estimate_in_lanes(layout, cells, count, estimator)
    if plan.needs_ephemeris:
        tell_ephemeris(layout, cells, count, ephemeris_at(plan.plant, tables, t))


@internal
def has_command(layout, cells, lane):
    """Whether a member's command is finite."""
    c = lane_state(layout, cells, lane).cells[0]
    return finite3((c.dipole_x, c.dipole_y, c.dipole_z))


@internal
def accept_commands(layout, cells, count, ends, step):
    """End the members whose command is not finite."""
    bad = 0
    for lane in range(count):
        bad += not has_command(layout, cells, lane)
    if bad > 0:
        for lane in range(count):
            if not has_command(layout, cells, lane):
                end(ends, lane, BAD_COMMAND, step)


@internal
def control_in_lanes(layout, computer, cells, count, ends, step):
    """Commands of all laws, added."""
    for number in range(computer.law_blocks.shape[0]):
        block = computer.law_blocks[number]
        needs = (block.needs_attitude, block.needs_rate)
        call_law(computer.laws[block.function], cells, count, block.p0, block.m0, *needs)
    accept_commands(layout, cells, count, ends, step)


@internal
def end(ends, lane, how, step):
    """Note how and when a member ended, if it had not before."""
    if ends[lane].how == RUNNING:
        ends[lane].how, ends[lane].step = how, step


@internal
def coils_off(layout, shared, cells, count):
    """Let the coils go to zero; `count` as above."""
    for lane in range(count):
        state, plant = lane_state(layout, cells, lane), lane_plant(layout, cells, lane, shared)
        put_goal(state.cells, switch_off_coils(plant.coils, state.coils))


@internal
def coils_in_lanes(layout, shared, cells, count):
    """Hand the commands to the coils; `count` as above."""
    for lane in range(count):
        state, plant = lane_state(layout, cells, lane), lane_plant(layout, cells, lane, shared)
        drive_coils(plant.coils, state)


@internal
def draw_torques_in_lanes(layout, shared, cells, seeds, step):
    """Draw the torques that jump at a step."""
    for lane in range(LANES):
        state, plant = lane_state(layout, cells, lane), lane_plant(layout, cells, lane, shared)
        draw_torques(plant, state, seeds[lane], step)


@internal
def step_in_lanes(layout, shared, cells, here, middle, end, left, step, h):
    """A step of RK4; `left`: parts of the dipoles' ways that are still to go."""
    for lane in range(LANES):
        state, plant = lane_state(layout, cells, lane), lane_plant(layout, cells, lane, shared)
        target, way = goal_dipole(state.cells), (0.0, 0.0, 0.0)
        if shared.coils.lag_s > 0.0:
            way = sub(present_dipole(plant.coils, state.coils), target)
        path = DipolePath(target, way, shared.coils.lag_s)
        rigid = with_drawn(plant.rigid, plant.rigid.acting, state.coefficients)
        held = present_torque(plant.held, state.held)
        forces = Forces(rigid, (), path, held, ())  # type: ignore[arg-type]
        x = motion_of(state.cells)
        put_motion(state.cells, rk4_step(forces, x, here, middle, end, left, step, h))


@internal
def has_motion(layout, cells, lane):
    """Whether a member's motion is finite."""
    x = motion_of(lane_state(layout, cells, lane).cells)
    return math.isfinite(dot(x.omega, x.omega) + x.q[0] + x.q[1] + x.q[2] + x.q[3])


@internal
def finish_event(layout, shared, cells, count, ends, step, t_s):
    """Let the coils go on for t_s; end the members whose state is not finite."""
    bad = 0
    for lane in range(count):
        state, plant = lane_state(layout, cells, lane), lane_plant(layout, cells, lane, shared)
        advance_actuators(plant.coils, state, t_s)
        bad += not has_motion(layout, cells, lane)
    if bad > 0:
        for lane in range(count):
            if not has_motion(layout, cells, lane):
                end(ends, lane, BAD_STATE, step)


@internal
def record_in_lanes(layout, cells, kept):
    """Keep attitudes and rates."""
    for lane in range(LANES):
        x = motion_of(lane_state(layout, cells, lane).cells)
        for k in range(4):
            kept[k, lane] = x.q[k]
        for k in range(3):
            kept[4 + k, lane] = x.omega[k]


@internal
def check_in_lanes(layout, integrator, plan, cells, here, ends, step, steps):
    """End the members whose motion the step does not resolve in the next `steps`."""
    shared = plan.plant
    for lane in range(LANES):
        state, plant = lane_state(layout, cells, lane), lane_plant(layout, cells, lane, shared)
        if not resolves(integrator, plant, plan.step_s, steps, state, motion_of(state.cells), here):
            end(ends, lane, COARSE_STEP, step)


@released
def run_lanes(
    layout, integrator, plan, tables, cells, seeds, drawn, ends, kept, first, last, estimator
):
    """Run all lanes from step `first` to `last`; `kept` (rows, 7, LANES): attitude and rate.

    `plan`: of one of the members; `ends`: `END` of each.
    """
    plan, tables = without_reference_counts(plan), without_reference_counts(tables)
    cells, kept = without_reference_counts(cells), without_reference_counts(kept)
    around, timetable, h = environment_tables(plan, tables), plan.timetable, plan.step_s
    shared = plan.plant
    step = first
    here = environment_at(around, step * h)
    number, cycle = row_from(timetable, step)
    due = cycle + timetable.rows[number].step
    to_record, place = step + -step % plan.record_steps, 0
    while step < last:
        if step == due:
            actions = timetable.rows[number].actions
            if actions & COILS_OFF:
                coils_off(layout, shared, cells, len(seeds))
            read_in_lanes(layout, plan, tables, cells, seeds, drawn, here, actions, step)
            if actions & CONTROL:
                begin_in_lanes(layout, plan, tables, cells, len(seeds), step, estimator)
                control_in_lanes(layout, plan.computer, cells, len(seeds), ends, step)
            if actions & COILS_ON:
                coils_in_lanes(layout, shared, cells, len(seeds))
            number += 1
            if number == timetable.rows.shape[0]:
                number, cycle = 0, cycle + timetable.cycle_steps
            due = cycle + timetable.rows[number].step
        if step == to_record:
            record_in_lanes(layout, cells, kept[place])
            place += 1
            to_record += plan.record_steps
            check_in_lanes(layout, integrator, plan, cells, here, ends, step, plan.record_steps)
        until = next_draw(shared, step, min(due, to_record, last))
        draw_torques_in_lanes(layout, shared, cells, seeds, step)
        for each in range(step, until):
            middle = environment_at(around, (each + 0.5) * h)
            after = environment_at(around, (each + 1) * h)
            left = left_in_step(shared.coils.lag_s, (each - step) * h, h)
            step_in_lanes(layout, shared, cells, here, middle, after, left, each, h)
            here = after
        finish_event(layout, shared, cells, len(seeds), ends, until, (until - step) * h)
        step = until


@released
def finish_lanes(layout, integrator, plan, tables, cells, ends, kept, last):
    """Record the end of all lanes in a row (7, LANES), and whether the step follows them there."""
    here = environment_at(environment_tables(plan, tables), last * plan.step_s)
    record_in_lanes(layout, cells, kept)
    check_in_lanes(layout, integrator, plan, cells, here, ends, last, 0)
