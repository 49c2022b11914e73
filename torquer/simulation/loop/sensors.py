"""Reading the sensors, and what the on-board computer knows at a control step.

What ends in `_step` is a phase of the loop, for one member: see `torquer.simulation.loop.members`.
"""

from torquer.compile.arguments import record_at
from torquer.compile.engine import inlined, kernel
from torquer.computer.interface import TACHOMETERS, Ephemeris, put_ephemeris
from torquer.environment.table import lookup3, lookup6, rate_from
from torquer.simulation.loop.calibrated import calibrate
from torquer.simulation.loop.due import BY_READERS, around_at, call_reader, read_usual
from torquer.simulation.loop.members import each
from torquer.simulation.loop.readings import change_readings, deliver_step, sensors_at_work
from torquer.simulation.loop.state import read_motion
from torquer.simulation.loop.timetable import ANY_DELIVERY, READ
from torquer.spacecraft.actuators.reaction_wheels import read_tachometers
from torquer.spacecraft.sensors.sunlight import sun_and_light


@kernel
def tachometers_step(member, t):
    """A reading of the tachometers: momenta for the allocation, their vector sum for laws."""
    state, plant = member.state, member.constants
    known, sensor = state.board.known[0], state.sensors[TACHOMETERS]
    number, noise_rad_s = int(sensor.count), plant.tachometer_noise_rad_s
    sensor.count += 1.0
    momentum = read_tachometers(
        plant.rotors, noise_rad_s, state.rotors, read_motion(state.cells).omega, member.seed,
        number, state.allocation.momentum,
    )  # fmt: skip
    readings = known.readings
    readings[TACHOMETERS, 0], readings[TACHOMETERS, 1], readings[TACHOMETERS, 2] = momentum
    known.read_s[TACHOMETERS] = t


@inlined
def read_sensors(address, actions, step):
    """Read the sensors that are due, in this order; what their noise is, state and step decide."""
    loop = record_at(address)
    members, plan = loop.members, loop.plan
    t, late, plant = step * plan.step_s, plan.timetable.late, plan.plant
    if actions & ANY_DELIVERY:
        each(members, deliver_step, actions)
    failures = plant.failures.sensors
    actions = sensors_at_work(members, failures, late, actions, t)
    read_usual(members, plant, around_at(loop, step), late, actions)
    if actions & BY_READERS:
        for number in range(loop.readers.shape[0]):
            call_reader(loop.readers[number], address, actions, step)
    if actions & (READ << TACHOMETERS):
        each(members, tachometers_step, t)
    change_readings(members, failures, late, actions, t)
    calibrate(members, late, actions)


@kernel
def ephemeris_at(plant, tables, t):
    """Where the computer believes the satellite to be, and what its models give there."""
    orbit, sun = tables.believed_orbit, tables.believed_sun
    b, _ = lookup6(orbit, t, 3)
    direction, sunlit_fraction = sun_and_light(plant.shadow, orbit, sun, t)
    v, b_rate = rate_from(orbit, t, 0), rate_from(orbit, t, 3)
    return Ephemeris(lookup3(orbit, t), v, b, b_rate, direction, sunlit_fraction)


@inlined
def update_step(member, left, mean, t):
    """Give the computer the time and what its coils have done since the control step before.

    `left`, `mean`: see `remaining_and_mean`.
    """
    k, c = member.state.board.known[0], member.state.cells[0]
    x, y, z = c.reached_x - c.set_x, c.reached_y - c.set_y, c.reached_z - c.set_z
    k.coils_x, k.coils_y, k.coils_z = c.set_x + mean * x, c.set_y + mean * y, c.set_z + mean * z
    c.reached_x, c.reached_y, c.reached_z = (
        c.set_x + left * x,
        c.set_y + left * y,
        c.set_z + left * z,
    )
    k.t_s = t


@inlined
def ephemeris_step(member, ephemeris):
    """Give the computer its ephemeris."""
    put_ephemeris(member.state.board.known[0], ephemeris)
