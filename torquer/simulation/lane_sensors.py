"""The sensors of `LANES` members of one orbit at once, with the kernels of a single run."""

from torquer.engine import internal
from torquer.environment.table import rate_from
from torquer.lanes import LANES, lane_plant, lane_state
from torquer.noise import normal3
from torquer.simulation.sensors import (
    attitude_sensor_step,
    deliver,
    gyro_step,
    magnetometer_step,
    search_coil_step,
    sensors_at_work,
    spoil_readings,
    sun_sensors_step,
    sunlight_at,
)
from torquer.simulation.state import motion_of
from torquer.simulation.timetable import (
    ANY_DELIVERY,
    ATTITUDE_SENSOR,
    GYRO,
    MAGNETOMETER,
    READ,
    SEARCH_COIL,
    SUN_SENSORS,
)
from torquer.spacecraft import attitude_sensor, gyro, magnetometer, sun_sensor


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
def working_in_lanes(layout, shared, late, cells, actions, t):
    """The actions without the readings that a failure prevents: the same for all members."""
    if len(shared.failures) == 0:
        return actions
    left = actions
    for lane in range(LANES):
        state = lane_state(layout, cells, lane)
        left = sensors_at_work(shared.failures, late, state, actions, t)
    return left


@internal
def spoil_in_lanes(layout, shared, late, cells, actions, t):
    """Zeros in place of what has been read, where a failure says so."""
    if len(shared.failures) == 0:
        return
    for lane in range(LANES):
        spoil_readings(shared.failures, late, lane_state(layout, cells, lane), actions, t)


@internal
def read_in_lanes(layout, plan, tables, cells, seeds, drawn, here, actions, step):
    """Read the sensors that are due."""
    t, late, shared = step * plan.step_s, plan.timetable.late, plan.plant
    if actions & ANY_DELIVERY:
        deliver_in_lanes(layout, cells, actions)
    actions = working_in_lanes(layout, shared, late, cells, actions, t)
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
    spoil_in_lanes(layout, shared, late, cells, actions, t)
