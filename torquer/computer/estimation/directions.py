"""The latest readings of directions, by the sensors' numbers: what a start needs of them."""

import math
from typing import NamedTuple

from torquer.compile.engine import inlined
from torquer.computer.estimation.measurements.horizon_sensor import nadir_at
from torquer.computer.estimation.measurements.measurement import (
    FIELD_CHANNEL,
    FIRST_CELL,
    NADIR_CHANNEL,
    SUN_CHANNEL,
    is_usable,
    turn_to_now,
)
from torquer.computer.estimation.measurements.sun_cells import sun_by_cells
from torquer.computer.estimation.triad import CONTRADICTION_RAD, field_at
from torquer.maths.geometry.quaternion import rotate
from torquer.maths.geometry.vec3 import cross, dot, norm

_ZERO = (0.0, 0.0, 0.0)
#: Square [T^2] below which a reading is no field.
_NO_FIELD = 1e-30


class Direction(NamedTuple):
    """The latest reading of a direction.

    `is_used`: whether the filter has the sensor; `is_usable`: whether its reading is a direction
    and not too old. `read_s`: its time; `v`: in body axes of that time, `reference`: by the
    model (inertial), both of any length; `r`: variance [rad^2] about each axis across.
    """

    is_used: bool
    is_usable: bool
    read_s: float
    v: tuple
    reference: tuple
    r: float


@inlined
def read_direction(inputs, parameters, sensor):
    """The latest reading of a sensor of directions; of any other it is not used."""
    sensing, at = parameters.sensing, inputs.read_at
    read_s, v, reference, r, per, cells_used = 0.0, _ZERO, _ZERO, 0.0, 1.0, False
    if sensor == FIELD_CHANNEL:
        read_s, v, r = at.magnetometer_s, inputs.b_body_t, sensing.r_field
        reference, per = field_at(inputs, read_s), max(dot(v, v), _NO_FIELD)
    elif sensor == SUN_CHANNEL:
        read_s, v, r = at.sun_sensors_s, inputs.sun_body, sensing.r_sun
        reference = inputs.ephemeris.sun_inertial
    elif sensor == NADIR_CHANNEL:
        read_s, v, r = at.horizon_sensor_s, inputs.nadir_body, sensing.r_nadir
        reference = nadir_at(inputs, read_s)
    elif sensor == FIRST_CELL:  # the first one stands for all together
        v, r = sun_by_cells(inputs, sensing)
        read_s, reference, cells_used = at.sun_cells_s, inputs.ephemeris.sun_inertial, True
    usable = is_usable(r, v, inputs.t_s - read_s, sensing.gap)
    prior, bias, mounting = parameters.prior, 0.0, 0.0
    if sensor == FIELD_CHANNEL:
        bias = prior.magnetometer_bias
        mounting = prior.magnetometer_scale + prior.magnetometer_misalignment
    used = sensing.r_cell > 0.0 if cells_used else r > 0.0
    return Direction(used, usable, read_s, v, reference, (r + bias) / per + mounting)


@inlined
def contradicts(q, d, turned):
    """Whether a direction is not where an attitude has it; `turned`: rotation since its reading.

    A misalignment that users leave out does not count, see `CONTRADICTION_RAD`.
    """
    seen = rotate(q, turn_to_now(turned, 1.0, d.v))
    angle = math.atan2(norm(cross(seen, d.reference)), dot(seen, d.reference))
    return angle > CONTRADICTION_RAD + 6.0 * math.sqrt(d.r)
