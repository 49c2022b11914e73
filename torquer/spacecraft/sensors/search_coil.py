"""Search coil: the field's rate of change as the body sees it. It has no errors."""

from torquer.compile.engine import inlined
from torquer.environment.table import rate_from
from torquer.maths.geometry.quaternion import rotate_inverse
from torquer.maths.geometry.vec3 import cross, sub
from torquer.spacecraft.sensors.device import Device


@inlined
def field_and_rate(sensor, around):
    """The field [T] and its rate of change along the orbit [T/s], inertial."""
    return around.b_inertial, rate_from(around.orbit, around.t_s, 3)


@inlined
def read(sensor, here, sky):
    """Rate of change of the field [T/s] in body axes."""
    (b_inertial, b_rate_inertial), x = sky, here.motion
    turning = rotate_inverse(x.q, b_rate_inertial)
    return sub(turning, cross(x.omega, rotate_inverse(x.q, b_inertial)))


DEVICE = Device(
    "search_coil",
    given="b_rate_body_t_s",
    said="search coil",
    symbol="b_rate",
    units="T/s",
    meaning="last reading of the search coil",
    ideal=0.0,
    absent=0.0,
    need="search_coil",
    read=read,
    sky=field_and_rate,
    late=False,
    may_stay=True,
    by_coils=True,
)
