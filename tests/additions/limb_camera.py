"""Limb camera: the direction to the Earth's centre from an image of its limb."""

import math
from typing import ClassVar, NamedTuple

from pydantic import Field

from torquer.base.spec import unit_vector
from torquer.compile.engine import inlined
from torquer.environment.table import lookup3
from torquer.maths.geometry.quaternion import rotate_inverse
from torquer.maths.geometry.vec3 import add_scaled, dot, scale, unit
from torquer.spacecraft.data_sheet import DataSheet
from torquer.spacecraft.failures import DirectionFailure
from torquer.spacecraft.sensors.device import Device
from torquer.spacecraft.sensors.sampling import Sampled

STREAM = 53


class LimbCameraSet(NamedTuple):
    """Constants for kernels: axis [body], cosine of the half field, noise of a component."""

    axis: tuple
    cosine: float
    noise_rad: float


@inlined
def nadir_around(camera, around):
    """Direction (inertial) to the Earth's centre."""
    return scale(-1.0, unit(lookup3(around.orbit, around.t_s)))


@inlined
def read(camera, here, nadir, noise_sample):
    """Unit vector to the Earth's centre [body], or zeros where the Earth is out of the field."""
    seen = rotate_inverse(here.motion.q, nadir)
    if dot(camera.axis, seen) < camera.cosine:
        return (0.0, 0.0, 0.0)
    return unit(add_scaled(seen, camera.noise_rad, noise_sample))


class LimbCamera(Sampled):
    """Limb camera: the direction to the Earth's centre in body axes."""

    sheet: ClassVar = DataSheet(
        name="limb camera", senses="nadir", unit="deg", noise="noise_deg", axes="axis"
    )
    failures: tuple[DirectionFailure, ...] = ()
    """Intervals in which its readings are missing or wrong."""
    axis: unit_vector("axis") = (0.0, 0.0, -1.0)
    """Axis of the field of view in the body, of any length."""
    half_field_deg: float = Field(default=90.0, gt=0.0, le=90.0)
    """Greatest angle between the axis and the direction to the Earth's centre."""
    noise_deg: float = Field(default=0.0, ge=0.0)
    """Standard deviation of the reading about each axis perpendicular to it."""

    def pack(self) -> LimbCameraSet:
        """Constants for kernels."""
        cosine = math.cos(math.radians(self.half_field_deg))
        return LimbCameraSet(self.axis, cosine, math.radians(self.noise_deg))


DEVICE = Device(
    "limb_camera",
    given="limb_body",
    said="limb camera",
    symbol="limb",
    units="1",
    meaning="last reading of the limb camera, a unit vector; zeros where the Earth is not seen",
    spec=LimbCamera,
    absent=LimbCameraSet((0.0, 0.0, -1.0), 2.0, 0.0),
    need="limb",
    read=read,
    sky=nadir_around,
    draws=((STREAM, ("noise_rad",)),),
    nothing="zeros",
    turned=True,
    several="limb_cameras",
    measurement="limb_camera",
)
