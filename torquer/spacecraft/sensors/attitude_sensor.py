"""Attitude sensor: a star tracker, or a stand-in for a filter of known accuracy."""

import math
from typing import Annotated, ClassVar, NamedTuple

from pydantic import Field, model_validator

from torquer.base.conventions import EARTH_RADIUS_M
from torquer.base.noise import cos_sin
from torquer.base.spec import Vector, unit_vector
from torquer.compile.engine import inlined, kernel
from torquer.environment.table import lookup3
from torquer.maths.geometry.quaternion import from_rotation_vector, multiply, rotate_inverse
from torquer.maths.geometry.vec3 import add_scaled, as_vector, dot, norm, scale, sub, unit
from torquer.spacecraft.data_sheet import DataSheet
from torquer.spacecraft.failures import DirectionFailure
from torquer.spacecraft.sensors.device import XYZW, Device
from torquer.spacecraft.sensors.sampling import Sampled
from torquer.spacecraft.sensors.sunlight import sun_and_light

STREAM = 5
#: Cosine that no angle exceeds: of a zone that blinds nothing.
_NO_ZONE = 2.0


class AttitudeSensorSet(NamedTuple):
    """Constants of the attitude sensor for kernels.

    `boresight`: zeros where it has none; `noise_rad`, `boresight_noise_rad`: standard deviations
    about axes across the boresight and about it; `sun_cosine`, `moon_cosine`: of the exclusion
    angles, 2 for none; `earth_rad`: exclusion angle from the limb, -1 for none;
    `rate_limit_rad_s`: infinite for none.
    """

    q_error: tuple
    boresight: tuple
    noise_rad: float
    boresight_noise_rad: float
    sun_cosine: float
    moon_cosine: float
    earth_rad: float
    rate_limit_rad_s: float


class Sky(NamedTuple):
    """What may blind an attitude sensor, seen from the satellite (inertial).

    Directions to Sun, Moon and the Earth's centre; cosine of the angle from the latter within
    which the sensor is blinded, 2 for none.
    """

    sun: tuple
    moon: tuple
    nadir: tuple
    earth_cosine: float


@inlined
def excludes_sun(sensor):
    """Whether the Sun may blind a sensor."""
    return sensor.sun_cosine < _NO_ZONE


@inlined
def excludes_moon(sensor):
    """Whether the Moon may blind a sensor."""
    return sensor.moon_cosine < _NO_ZONE


@inlined
def earth_cosine(sensor, distance_m):
    """Cosine of the angle from nadir within which the Earth blinds a sensor; 2 for none."""
    if sensor.earth_rad < 0.0:
        return _NO_ZONE
    disc = math.asin(min(EARTH_RADIUS_M / distance_m, 1.0))
    return math.cos(min(disc + sensor.earth_rad, math.pi))


@inlined
def is_blind(sensor, omega_body, sun_body, moon_body, nadir_body, earth_cosine):
    """Whether the sensor finds no stars: it turns too fast, or Sun, Moon or Earth are too near."""
    too_fast = dot(omega_body, omega_body) > sensor.rate_limit_rad_s * sensor.rate_limit_rad_s
    by_sun = dot(sensor.boresight, sun_body) > sensor.sun_cosine
    by_moon = dot(sensor.boresight, moon_body) > sensor.moon_cosine
    by_earth = dot(sensor.boresight, nadir_body) > earth_cosine
    return too_fast or by_sun or by_moon or by_earth


@inlined
def read_attitude(sensor, q_body_to_inertial, noise_sample):
    """Measured attitude: the true one after the fixed and the random rotation, in body axes.

    `noise_sample`: three standard normal numbers.
    """
    q = multiply(q_body_to_inertial, sensor.q_error)
    if sensor.noise_rad == 0.0 and sensor.boresight_noise_rad == 0.0:
        return q
    along = dot(sensor.boresight, noise_sample)
    turn = scale(sensor.noise_rad, noise_sample)
    more = along * (sensor.boresight_noise_rad - sensor.noise_rad)
    return multiply(q, _turn(add_scaled(turn, more, sensor.boresight)))


@inlined
def _turn(phi):
    """`from_rotation_vector` up to 720 deg without branches or calls, which lanes need."""
    angle = norm(phi)
    cosine, sine = cos_sin(angle / (4.0 * math.pi))
    s = sine / (angle + 1e-300)
    return (s * phi[0], s * phi[1], s * phi[2], cosine)


@kernel
def sky_around(sensor, around):
    """What may blind the sensor."""
    nothing, t = (0.0, 0.0, 0.0), around.t_s
    sun, moon, nadir, cosine = nothing, nothing, nothing, earth_cosine(sensor, EARTH_RADIUS_M)
    if excludes_sun(sensor):
        sun, _ = sun_and_light(around.shadow, around.orbit, around.sun, t)
    if excludes_moon(sensor):
        moon = unit(sub(lookup3(around.moon, t), lookup3(around.orbit, t)))
    if sensor.earth_rad >= 0.0:
        r = lookup3(around.orbit, t)
        nadir, cosine = scale(-1.0, unit(r)), earth_cosine(sensor, norm(r))
    return Sky(sun, moon, nadir, cosine)


@inlined
def read(sensor, here, sky, noise_sample):
    """What the sensor reads under this sky; NaN where it is blinded."""
    x = here.motion
    sun_body, nadir_body = rotate_inverse(x.q, sky.sun), rotate_inverse(x.q, sky.nadir)
    moon_body = rotate_inverse(x.q, sky.moon)
    blind = is_blind(sensor, x.omega, sun_body, moon_body, nadir_body, sky.earth_cosine)
    qx, qy, qz, qw = read_attitude(sensor, x.q, noise_sample)
    return (
        math.nan if blind else qx,
        math.nan if blind else qy,
        math.nan if blind else qz,
        math.nan if blind else qw,
    )


_Exclusion = Annotated[float, Field(ge=0.0, le=180.0)]


class AttitudeSensor(Sampled):
    """Attitude sensor; ideal by default.

    A star tracker reads no attitude (not a number) while it turns faster than `rate_limit_deg_s`
    and while Sun, Moon or Earth are within their exclusion angles from its boresight.
    """

    sheet: ClassVar = DataSheet(
        name="star tracker",
        senses="attitude",
        unit="deg",
        noise="noise_deg",
        noise_about="boresight_noise_deg",
        misalignment="error_deg",
        rate_limit="rate_limit_deg_s",
        axes="boresight",
    )
    failures: tuple[DirectionFailure, ...] = ()
    """Intervals in which its readings are missing or wrong."""

    error_deg: Vector = (0.0, 0.0, 0.0)
    """Fixed rotation about the body axes between true and measured attitude, a mounting error."""
    noise_deg: float = Field(default=0.0, ge=0.0)
    """Standard deviation of a random rotation about each axis, drawn at every reading; about axes
    across the boresight if `boresight_noise_deg` is given.
    """
    boresight: unit_vector("boresight") | None = None
    """Axis of a star tracker in the body, of any length; left out: the sensor has none."""
    boresight_noise_deg: float | None = Field(default=None, ge=0.0)
    """Standard deviation of the random rotation about the boresight; left out: `noise_deg`."""
    sun_exclusion_deg: _Exclusion | None = None
    """Angle between boresight and Sun below which there is no reading, in eclipse, too; left out:
    none.
    """
    moon_exclusion_deg: _Exclusion | None = None
    """Angle between boresight and Moon, at whatever phase, below which there is no reading; left
    out: none. The Moon's place is good to 0.4 deg.
    """
    earth_exclusion_deg: _Exclusion | None = None
    """Angle between boresight and the Earth's limb below which there is no reading; the Earth's
    disc itself is excluded, too. Left out: none.
    """
    rate_limit_deg_s: float | None = Field(default=None, gt=0.0)
    """Rate of the body above which there is no reading; left out: none."""

    @model_validator(mode="after")
    def _boresight_given(self):
        zones = (f"{body}_exclusion_deg" for body in ("sun", "moon", "earth"))
        for key in ("boresight_noise_deg", *zones):
            value = getattr(self, key)
            if value is not None and self.boresight is None:
                raise ValueError(f"{key}: must be left out without boresight; received {value:g}")
        return self

    def pack(self) -> AttitudeSensorSet:
        """Constants for kernels."""
        error = scale(math.radians(1.0), as_vector(self.error_deg))
        about_deg = self.noise_deg if self.boresight_noise_deg is None else self.boresight_noise_deg
        moon = self.moon_exclusion_deg
        sun, earth, limit = self.sun_exclusion_deg, self.earth_exclusion_deg, self.rate_limit_deg_s
        return AttitudeSensorSet(
            from_rotation_vector(error),
            self.boresight or (0.0, 0.0, 0.0),
            math.radians(self.noise_deg),
            math.radians(about_deg),
            _NO_ZONE if sun is None else math.cos(math.radians(sun)),
            _NO_ZONE if moon is None else math.cos(math.radians(moon)),
            -1.0 if earth is None else math.radians(earth),
            math.inf if limit is None else math.radians(limit),
        )


DEVICE = Device(
    "attitude_sensor",
    given="q_body_to_inertial",
    said="attitude sensor",
    symbol="q",
    units="1",
    meaning="last reading of the attitude sensor",
    frame="body to J",
    parts=XYZW,
    spec=AttitudeSensor,
    read=read,
    sky=sky_around,
    draws=((STREAM, ("noise_rad", "boresight_noise_rad")),),
    by_sunlight=lambda sensor: sensor.sun_cosine < _NO_ZONE,
    by_moon=lambda sensor: sensor.moon_cosine < _NO_ZONE,
    nothing="nan",
    turned=True,
    measurement="star_tracker",
    several="star_trackers",
)
