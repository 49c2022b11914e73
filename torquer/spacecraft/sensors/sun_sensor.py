"""Sun sensors: each sees the Sun within a cone about its axis, unless something shades it."""

import math
from typing import Annotated, ClassVar, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from torquer.base.spec import Spec, Vector, unit_vector, unit_vectors
from torquer.compile.engine import inlined
from torquer.maths.geometry.quaternion import from_rotation_vector, rotate, rotate_inverse
from torquer.maths.geometry.vec3 import add_scaled, as_vector, dot, unit
from torquer.spacecraft.data_sheet import DataSheet
from torquer.spacecraft.failures import DirectionFailure
from torquer.spacecraft.sensors.device import Device
from torquer.spacecraft.sensors.sampling import Sampled
from torquer.spacecraft.sensors.sunlight import sunlight_at

STREAM = 4


class SunSensorSet(NamedTuple):
    """Constants of the Sun sensors for kernels.

    `rows` [n, 8], one per sensor: axis, cosine of the half field, quaternion of the fixed rotation
    of its readings. `zones` [m, 5]: number of a sensor; axis and cosine of a blind zone of it.
    """

    rows: np.ndarray
    zones: np.ndarray
    noise_rad: float
    albedo: float


@inlined
def _is_blind(zones, sensor, sun_body):
    """Whether the Sun is in a blind zone of a sensor."""
    blind = False
    for k in range(zones.shape[0]):
        inside = dot((zones[k, 1], zones[k, 2], zones[k, 3]), sun_body) > zones[k, 4]
        blind = blind or (zones[k, 0] == sensor and inside)
    return blind


@inlined
def sensor_that_sees(sensors, sun_body):
    """Number of the sensor that is read: the one that sees the Sun and best faces it; or -1."""
    rows, best, chosen = sensors.rows, -2.0, -1
    for i in range(rows.shape[0]):
        near = dot((rows[i, 0], rows[i, 1], rows[i, 2]), sun_body)
        if near >= rows[i, 3] and near > best and not _is_blind(sensors.zones, i, sun_body):
            best, chosen = near, i
    return chosen


@inlined
def read_sun(sensors, sun_body, sunlit_fraction, earthlight_body, noise_sample):
    """Unit vector to the Sun [body], or zeros where no sensor sees it.

    `sunlit_fraction` is the visible fraction of the Sun's disc; half a disc is enough to read.
    `earthlight_body`: as `torquer.environment.albedo` gives it, in the body. `noise_sample`: three
    standard normal numbers.
    """
    k, rows = sensor_that_sees(sensors, sun_body), sensors.rows
    if k < 0 or sunlit_fraction < 0.5:
        return (0.0, 0.0, 0.0)
    reading = sun_body
    if sensors.albedo > 0.0:
        reading = unit(add_scaled(earthlight_body, sunlit_fraction, sun_body))
    reading = rotate((rows[k, 4], rows[k, 5], rows[k, 6], rows[k, 7]), reading)
    if sensors.noise_rad == 0.0:
        return reading
    return unit(add_scaled(reading, sensors.noise_rad, noise_sample))


@inlined
def sunlight_around(sensors, around):
    """Direction to the Sun, visible part of it, light of the Earth."""
    return sunlight_at(sensors.albedo, around)


@inlined
def read(sensors, here, sunlight, noise_sample):
    """What the Sun sensors read in this light."""
    q, (direction, sunlit_fraction, of_earth) = here.motion.q, sunlight
    sun_body, earth_body = rotate_inverse(q, direction), rotate_inverse(q, of_earth)
    return read_sun(sensors, sun_body, sunlit_fraction, earth_body, noise_sample)


_HalfAngle = Annotated[float, Field(gt=0.0, le=180.0)]


class BlindZone(Spec):
    """A cone in the body in which a boom or a panel hides the Sun from Sun sensors.

    `sensors`: numbers, from 0, of those that it shades (left out: all).
    """

    axis: unit_vector("axis")
    """Axis of the cone in the body, of any length."""
    half_angle_deg: _HalfAngle
    """Half angle of the cone."""
    sensors: tuple[int, ...] | None = None
    """Numbers, from 0, of the sensors that it shades; left out: all."""

    def of(self, count: int) -> tuple[int, ...]:
        """Numbers of the sensors that it shades, out of `count`."""
        return tuple(range(count)) if self.sensors is None else self.sensors


class SunSensors(Sampled):
    """Sun sensors by their axes in the body.

    Where several see the Sun, the one that faces it most directly is read. Coarse sensors are
    misled by sunlight that the Earth reflects, by up to some 15 deg. A reading is the direction of
    the sum of both lights, as for cosine detectors on all sides and a Lambertian Earth
    (NASA Technical Memorandum 104596).
    """

    sheet: ClassVar = DataSheet(
        name="Sun sensor",
        senses="sun",
        unit="deg",
        noise="noise_deg",
        misalignment="bias_deg",
        albedo="albedo",
        axes="axes",
    )
    failures: tuple[DirectionFailure, ...] = ()
    """Intervals in which its readings are missing or wrong."""
    axes: unit_vectors("axes")
    """Axes of the sensors in the body, of any length."""
    half_field_deg: _HalfAngle | tuple[_HalfAngle, ...]
    """Half angle of the cone in which a sensor sees the Sun, one number or one per sensor."""
    blind_zones: tuple[BlindZone, ...] = ()
    """Cones in which something shades the sensors."""
    noise_deg: float = Field(default=0.0, ge=0.0)
    """Standard deviation of the reading about each axis perpendicular to the line of sight."""
    bias_deg: Vector | tuple[Vector, ...] = (0.0, 0.0, 0.0)
    """Fixed small rotation of the reading about the body axes, one vector or one per sensor."""
    albedo: float = Field(default=0.0, ge=0.0, le=1.0)
    """Albedo of the Earth, about 0.3; 0 for sensors that distinguish the Sun from the Earth."""

    @model_validator(mode="after")
    def _one_of_each_per_sensor(self):
        count = len(self.axes)
        if isinstance(self.half_field_deg, tuple) and len(self.half_field_deg) != count:
            raise ValueError(
                f"half_field_deg: must be one number or one per sensor ({count} axes); "
                f"received {len(self.half_field_deg)} numbers"
            )
        if np.shape(self.bias_deg) not in ((3,), (count, 3)):
            raise ValueError(
                f"bias_deg: must be one vector or one per sensor ({count} axes); "
                f"received {len(self.bias_deg)} vectors"
            )
        for k, zone in enumerate(self.blind_zones):
            wrong = [number for number in zone.of(count) if number not in range(count)]
            if wrong:
                raise ValueError(
                    f"blind_zones[{k}].sensors: must be numbers of sensors, 0 to {count - 1}; "
                    f"received {wrong[0]}"
                )
        return self

    def half_fields_deg(self) -> np.ndarray:
        """Half field of each sensor (n,)."""
        return np.full(len(self.axes), self.half_field_deg)

    def pack(self) -> SunSensorSet:
        """Constants for kernels."""
        count = len(self.axes)
        turns = np.radians(np.broadcast_to(self.bias_deg, (count, 3)))
        # no rounding of a product may hide the Sun from a sensor that sees all the sky
        cosines = [
            -2.0 if half_deg == 180.0 else math.cos(math.radians(half_deg))
            for half_deg in self.half_fields_deg()
        ]
        rows = np.column_stack(
            [self.axes, cosines, [from_rotation_vector(as_vector(turn)) for turn in turns]]
        )
        zones = [
            (sensor, *zone.axis, math.cos(math.radians(zone.half_angle_deg)))
            for zone in self.blind_zones
            for sensor in zone.of(count)
        ]
        return SunSensorSet(
            rows, np.reshape(np.array(zones), (-1, 5)), math.radians(self.noise_deg), self.albedo
        )


_NO_ZONES = np.empty((0, 5))
#: For kernels: a Sun sensor that no law reads; and an ideal one, which sees all the sky.
NO_SUN_SENSORS = SunSensorSet(np.empty((0, 8)), _NO_ZONES, 0.0, 0.0)
IDEAL_SUN_SENSOR = SunSensorSet(
    np.array([[0.0, 0.0, 1.0, -2.0, 0.0, 0.0, 0.0, 1.0]]), _NO_ZONES, 0.0, 0.0
)


class SunHeadSet(NamedTuple):
    """Constants of one of several Sun sensors for kernels: see `SunSensorSet`."""

    axis: tuple
    cosine: float
    turn: tuple
    noise_rad: float
    albedo: float


def one_head(sensors: SunSensors) -> SunHeadSet:
    """Constants of one of several Sun sensors."""
    packed = sensors.pack()
    row = packed.rows[0].tolist()
    return SunHeadSet(tuple(row[:3]), row[3], tuple(row[4:]), packed.noise_rad, packed.albedo)


@inlined
def read_head(head, here, sunlight, noise_sample):
    """What one of several Sun sensors reads in this light."""
    q, (direction, sunlit_fraction, of_earth) = here.motion.q, sunlight
    reading = rotate_inverse(q, direction)
    if dot(head.axis, reading) < head.cosine or sunlit_fraction < 0.5:
        return (0.0, 0.0, 0.0)
    if head.albedo > 0.0:
        earth_body = rotate_inverse(q, of_earth)
        reading = unit(add_scaled(earth_body, sunlit_fraction, reading))
    reading = rotate(head.turn, reading)
    if head.noise_rad == 0.0:
        return reading
    return unit(add_scaled(reading, head.noise_rad, noise_sample))


DEVICE = Device(
    "sun_sensors",
    given="sun_body",
    said="Sun sensors",
    symbol="sun",
    units="1",
    meaning="last reading of the Sun sensors, a unit vector; zeros where the Sun is not seen",
    spec=SunSensors,
    ideal=IDEAL_SUN_SENSOR,
    absent=NO_SUN_SENSORS,
    need="sun",
    read=read,
    sky=sunlight_around,
    draws=((STREAM, ("noise_rad",)),),
    by_sunlight=lambda sensors: True,
    nothing="zeros",
    turned=True,
    measurement="sun_sensors",
    several="sun_heads",
    to_unit=one_head,
    read_unit=read_head,
)
