"""Sun sensors: the direction to the Sun in body axes, while one of them sees it."""

from torquer.compile.engine import inlined
from torquer.computer.estimation.measurements.measurement import (
    NO_MEASUREMENT,
    SUN_CHANNEL,
    direction_measurement,
    is_new,
    turn_to_now,
)
from torquer.computer.estimation.triad import read_quaternion


@inlined
def sun_sensors(inputs, parameters, memory, omega):
    """(z, H, R) of the latest reading, if it is new; the body has turned with omega since."""
    sun, at_s, r = inputs.sun_body, inputs.read_at.sun_sensors_s, parameters.sensing.r_sun
    if not is_new(r, sun, at_s, memory.read_s[SUN_CHANNEL]):
        return NO_MEASUREMENT
    read = turn_to_now(omega, inputs.t_s - at_s, sun)
    return direction_measurement(read_quaternion(memory.q), inputs.ephemeris.sun_inertial, read, r)
