"""Horizon sensor: the direction to the Earth's centre from its infrared horizon."""

import math
from typing import Annotated, ClassVar, NamedTuple

from pydantic import Field, model_validator

from torquer.base.spec import Vector, unit_vector
from torquer.compile.engine import inlined
from torquer.environment.table import lookup3
from torquer.maths.geometry.quaternion import from_rotation_vector, rotate, rotate_inverse
from torquer.maths.geometry.vec3 import add_scaled, as_vector, dot, norm, scale, unit
from torquer.spacecraft.data_sheet import DataSheet
from torquer.spacecraft.failures import DirectionFailure
from torquer.spacecraft.sensors.device import Device
from torquer.spacecraft.sensors.sampling import Sampled

STREAM = 9
#: Cosine of a field of view that is the whole sky: no rounding hides the Earth from it.
_WHOLE_SKY = -2.0


class HorizonSensorSet(NamedTuple):
    """Constants of the horizon sensor for kernels.

    `axis` [body] and cosine of the half field of view; `turn`: quaternion of the fixed rotation of
    its readings; `rate_limit_rad_s`: infinite for none; `higher_m`: see `HorizonSensor`.
    """

    axis: tuple
    turn: tuple
    cosine: float
    noise_rad: float
    higher_m: float
    rate_limit_rad_s: float


@inlined
def disc_centre(sensor, r_m):
    """Direction (inertial) to the centre of the Earth's infrared disc from a position [m].

    Seen at the latitude of each of its points, a horizon that is higher by h sin(latitude) has its
    centre h/r to the north, times the cosine of the satellite's latitude: to first order the
    direction to the Earth's centre plus h/r along the Earth's axis.
    """
    size = norm(r_m)
    nadir = scale(-1.0 / size, r_m)
    return unit(add_scaled(nadir, sensor.higher_m / size, (0.0, 0.0, 1.0)))


@inlined
def sees_horizon(sensor, omega_body, nadir_body):
    """Whether the Earth is in the field of view, and the body does not turn too fast."""
    too_fast = dot(omega_body, omega_body) > sensor.rate_limit_rad_s * sensor.rate_limit_rad_s
    return dot(sensor.axis, nadir_body) >= sensor.cosine and not too_fast


@inlined
def read_horizon(sensor, omega_body, centre_body, noise_sample):
    """Unit vector to the Earth's centre [body], or zeros where the sensor does not see the Earth.

    `centre_body`: by `disc_centre`; `noise_sample`: three standard normal numbers.
    """
    if not sees_horizon(sensor, omega_body, centre_body):
        return (0.0, 0.0, 0.0)
    reading = rotate(sensor.turn, centre_body)
    return unit(add_scaled(reading, sensor.noise_rad, noise_sample))


@inlined
def disc_around(sensor, around):
    """Direction (inertial) to the centre of the Earth's infrared disc."""
    return disc_centre(sensor, lookup3(around.orbit, around.t_s))


@inlined
def read(sensor, here, centre, noise_sample):
    """What the sensor reads of a disc with this centre (inertial)."""
    x = here.motion
    return read_horizon(sensor, x.omega, rotate_inverse(x.q, centre), noise_sample)


class HorizonSensor(Sampled):
    """Horizon sensor: the direction to the Earth's centre in body axes.

    There is no reading (zeros) while the Earth's centre is not in the field of view, nor while the
    body turns too fast.
    """

    sheet: ClassVar = DataSheet(
        name="horizon sensor",
        senses="nadir",
        unit="deg",
        noise="noise_deg",
        misalignment="bias_deg",
        height="horizon_km",
        rate_limit="rate_limit_deg_s",
        axes="axis",
        words={"height": "height of the horizon"},
    )
    failures: tuple[DirectionFailure, ...] = ()
    """Intervals in which its readings are missing or wrong."""
    axis: unit_vector("axis") | None = None
    """Axis of the field of view in the body, of any length; given with `half_field_deg`."""
    half_field_deg: Annotated[float, Field(gt=0.0, le=180.0)] | None = None
    """Greatest angle between the axis and the direction to the Earth's centre; left out: the Earth
    is seen in all directions.
    """
    noise_deg: float = Field(default=0.0, ge=0.0)
    """Standard deviation of the reading about each axis perpendicular to it."""
    bias_deg: Vector = (0.0, 0.0, 0.0)
    """Fixed small rotation of the reading about the body axes, a mounting error."""
    horizon_km: float = Field(default=0.0, ge=-100.0, le=100.0)
    """By how much the infrared horizon is higher at the north pole than at the equator, and lower
    at the south pole, as in northern summer (some kilometres). Between them it goes as the sine of
    the latitude. On board it is not known.
    """
    rate_limit_deg_s: float | None = Field(default=None, gt=0.0)
    """Rate of the body above which there is no reading; left out: none."""

    @model_validator(mode="after")
    def _axis_with_field(self):
        if (self.axis is None) != (self.half_field_deg is None):
            missing = "axis" if self.axis is None else "half_field_deg"
            raise ValueError(
                f"{missing}: axis and half_field_deg must be given together; received one of them"
            )
        return self

    def pack(self) -> HorizonSensorSet:
        """Constants for kernels."""
        half_deg, limit = self.half_field_deg, self.rate_limit_deg_s
        whole = half_deg is None or half_deg == 180.0
        return HorizonSensorSet(
            self.axis or (0.0, 0.0, 1.0),
            from_rotation_vector(scale(math.radians(1.0), as_vector(self.bias_deg))),
            _WHOLE_SKY if whole else math.cos(math.radians(half_deg or 0.0)),
            math.radians(self.noise_deg),
            1e3 * self.horizon_km,
            math.inf if limit is None else math.radians(limit),
        )


#: For kernels: an ideal horizon sensor, which sees all the sky. (`pack` would load kernels at the
#: import.)
IDEAL_HORIZON_SENSOR = HorizonSensorSet(
    axis=(0.0, 0.0, 1.0),
    turn=(0.0, 0.0, 0.0, 1.0),
    cosine=_WHOLE_SKY,
    noise_rad=0.0,
    higher_m=0.0,
    rate_limit_rad_s=math.inf,
)
DEVICE = Device(
    "horizon_sensor",
    given="nadir_body",
    said="horizon sensor",
    symbol="nadir",
    units="1",
    meaning="last reading of the horizon sensor, a unit vector; zeros where the Earth is not seen",
    spec=HorizonSensor,
    ideal=IDEAL_HORIZON_SENSOR,
    absent=IDEAL_HORIZON_SENSOR,
    need="horizon",
    read=read,
    sky=disc_around,
    draws=((STREAM, ("noise_rad",)),),
    nothing="zeros",
    turned=True,
    measurement="horizon_sensor",
    several="horizon_sensors",
)
