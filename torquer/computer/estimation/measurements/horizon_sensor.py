"""Horizon sensor: the direction to the Earth's centre in body axes, while it sees the Earth."""

from torquer.compile.engine import inlined
from torquer.computer.estimation.measurements.measurement import (
    NADIR_CHANNEL,
    NO_MEASUREMENT,
    direction_measurement,
    is_new,
    turn_to_now,
)
from torquer.computer.estimation.triad import read_quaternion
from torquer.maths.geometry.vec3 import add_scaled, scale, unit


@inlined
def nadir_at(inputs, t_s):
    """Direction to the Earth's centre (inertial) by the computer's orbit, a little before now."""
    place = inputs.ephemeris
    r = add_scaled(place.r_inertial_m, t_s - inputs.t_s, place.v_inertial_m_s)
    return scale(-1.0, unit(r))


@inlined
def horizon_sensor(inputs, parameters, memory, omega):
    """(z, H, R) of the latest reading, if it is new; the body has turned with omega since."""
    nadir, at_s, r = inputs.nadir_body, inputs.read_at.horizon_sensor_s, parameters.sensing.r_nadir
    if not is_new(r, nadir, at_s, memory.read_s[NADIR_CHANNEL]):
        return NO_MEASUREMENT
    read = turn_to_now(omega, inputs.t_s - at_s, nadir)
    return direction_measurement(read_quaternion(memory.q), nadir_at(inputs, at_s), read, r)
