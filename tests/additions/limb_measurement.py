"""Limb camera: the direction to the Earth's centre in body axes, while it sees the Earth."""

import math
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from torquer.base.spec import Spec
from torquer.computer.estimation.measurements.horizon_sensor import direction, expected, measure
from torquer.computer.estimation.measurements.measured import Measured
from torquer.maths.geometry.attitudes import to_body


class LimbNoise(NamedTuple):
    """Variance of each component [rad^2]."""

    r: float


def visible(craft, seen):
    """Whether one of the cameras sees the Earth along a motion (k,)."""
    found = np.zeros(len(seen.q), bool)
    nadir = to_body(seen.q, -seen.r / np.linalg.norm(seen.r, axis=1, keepdims=True))
    for camera in craft.each_of("limb_camera"):
        constants = camera.pack()
        found |= nadir @ np.array(constants.axis) >= constants.cosine
    return found


class LimbKeys(Spec):
    """A filter's key of the limb camera."""

    limb_noise_deg: Annotated[float, Field(gt=0.0, le=180.0)] | None = None
    """Standard deviation of each component of a reading; given if the filter uses it."""


def constants(keys) -> LimbNoise:
    """Constants for kernels."""
    return LimbNoise(math.radians(keys.limb_noise_deg or 0.0) ** 2)


MEASURED = Measured(
    "limb",
    said="limb camera",
    keys=LimbKeys,
    noise="limb_noise_deg",
    constants=constants,
    measure=measure,
    expected=expected,
    visible=visible,
    missing="no usable reading of the limb camera",
    direction=direction,
    reference="nadir",
)
