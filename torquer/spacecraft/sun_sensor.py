"""Sun sensors: each sees the Sun within a cone about its axis, while the satellite is lit."""

import math
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import AfterValidator, Field

from torquer import validate
from torquer.engine import inlined
from torquer.geometry.vec3 import add_scaled, as_vector, dot, unit
from torquer.spacecraft.sampling import Sampled
from torquer.spec import Vector

STREAM = 4


class SunSensorSet(NamedTuple):
    """Constants of the Sun sensors for kernels; one row per sensor."""

    axes: np.ndarray
    cos_half_field: float
    noise_rad: float


@inlined
def read_sun(sensors, sun_body, lit, drawn):
    """Unit vector to the Sun [body], or zeros where no sensor sees it.

    `lit` is the visible fraction of the Sun's disc; half a disc is enough to read. `drawn`: three
    standard normal numbers.
    """
    axes, best = sensors.axes, -1.0
    for i in range(axes.shape[0]):
        best = max(best, dot((axes[i, 0], axes[i, 1], axes[i, 2]), sun_body))
    if best < sensors.cos_half_field or lit < 0.5:
        return (0.0, 0.0, 0.0)
    if sensors.noise_rad == 0.0:
        return sun_body
    return unit(add_scaled(sun_body, sensors.noise_rad, drawn))


def _checked_axes(value):
    rows = validate.unit_rows("axes", value)
    return tuple(as_vector(row) for row in rows)


class SunSensors(Sampled):
    """Sun sensors by their axes in the body, half field of view [deg] and noise [deg]."""

    axes: Annotated[tuple[Vector, ...], AfterValidator(_checked_axes)]
    half_field_deg: float = Field(gt=0.0, le=180.0)
    noise_deg: float = Field(default=0.0, ge=0.0)

    def pack(self) -> SunSensorSet:
        """Constants for kernels."""
        return SunSensorSet(
            np.array(self.axes),
            math.cos(math.radians(self.half_field_deg)),
            math.radians(self.noise_deg),
        )


#: For kernels: a Sun sensor that no law reads; and an ideal one, which sees all the sky.
NO_SUN_SENSORS = SunSensorSet(np.empty((0, 3)), 1.0, 0.0)
IDEAL_SUN_SENSOR = SunSensorSet(np.array([[0.0, 0.0, 1.0]]), -2.0, 0.0)
