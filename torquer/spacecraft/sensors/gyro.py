"""Three-axis rate gyro with a bias that drifts as a random walk."""

import math
from typing import ClassVar, NamedTuple

from pydantic import Field

from torquer.base import noise
from torquer.base.spec import Vector
from torquer.compile.engine import inlined, kernel
from torquer.maths.geometry.vec3 import add, add_scaled, as_vector, mat_vec, scale
from torquer.spacecraft.data_sheet import DataSheet
from torquer.spacecraft.failures import RateFailure
from torquer.spacecraft.sensors.device import Device, nothing_around
from torquer.spacecraft.sensors.sampling import Sampled
from torquer.spacecraft.sensors.sensing import mounting_matrix, through_electronics

NOISE_STREAM, DRIFT_STREAM = 2, 3


class GyroSet(NamedTuple):
    """Constants of the gyro for kernels [rad/s]."""

    mounting: tuple
    bias_rad_s: tuple
    noise_rad_s: float
    drift_rad_s_sqrt_s: float
    range_rad_s: float
    resolution_rad_s: float


@inlined
def walked_bias(gyro, drift, interval_s, noise_sample):
    """Accumulated drift [rad/s] after one more sampling interval.

    `noise_sample`: three standard normal numbers.
    """
    if gyro.drift_rad_s_sqrt_s == 0.0:
        return drift
    step = gyro.drift_rad_s_sqrt_s * math.sqrt(interval_s)
    return add_scaled(drift, step, noise_sample)


@kernel
def fill_drift(gyro, seed, t_s, out):
    """Accumulated drift [rad/s] of a gyro at its readings (n, 3), as a simulation has it.

    `t_s` (n,): when it has been read. (The record of a run does not keep it.)
    """
    drift = (0.0, 0.0, 0.0)
    for k in range(out.shape[0]):
        drawn = noise.draw(gyro.drift_rad_s_sqrt_s, seed, DRIFT_STREAM, k)
        drift = walked_bias(gyro, drift, t_s[k] - t_s[max(k - 1, 0)], drawn)
        out[k, 0], out[k, 1], out[k, 2] = drift


@inlined
def read_rate(gyro, omega_body, drift, noise_sample):
    """Reading [rad/s] in body axes; `noise_sample`: three standard normal numbers."""
    reading = add(add(mat_vec(gyro.mounting, omega_body), gyro.bias_rad_s), drift)
    if gyro.noise_rad_s > 0.0:
        reading = add_scaled(reading, gyro.noise_rad_s, noise_sample)
    return through_electronics(reading, gyro.range_rad_s, gyro.resolution_rad_s)


@inlined
def read(gyro, here, sky, noise_sample, walk_sample):
    """What the gyro reads; its drift, kept with its time, goes on from its last reading."""
    own = here.own
    drift = walked_bias(gyro, (own[0], own[1], own[2]), here.t_s - own[3], walk_sample)
    own[0], own[1], own[2] = drift
    own[3] = here.t_s
    return read_rate(gyro, here.motion.omega, drift, noise_sample)


class Gyro(Sampled):
    """Three-axis gyro; ideal by default."""

    sheet: ClassVar = DataSheet(
        name="gyro",
        senses="rate",
        unit="deg/s",
        noise="noise_deg_s",
        bias="bias_deg_s",
        drift="bias_drift_deg_s_sqrt_s",
        range="range_deg_s",
        resolution="resolution_deg_s",
        scale="scale_error",
        misalignment="misalignment_deg",
    )
    failures: tuple[RateFailure, ...] = ()
    """Intervals in which its readings are missing or wrong."""

    range_deg_s: float = Field(default=1e6, gt=0.0)
    """Range: readings of each axis are clipped there."""
    noise_deg_s: float = Field(default=0.0, ge=0.0)
    """Standard deviation of each reading about each axis."""
    bias_deg_s: Vector = (0.0, 0.0, 0.0)
    """Bias at the start."""
    bias_drift_deg_s_sqrt_s: float = Field(default=0.0, ge=0.0)
    """Random walk of the bias: standard deviation of its change after one second."""
    scale_error: Vector = (0.0, 0.0, 0.0)
    """Relative scale-factor error of each axis."""
    misalignment_deg: Vector = (0.0, 0.0, 0.0)
    """Rotation vector of the misalignment, small."""
    resolution_deg_s: float = Field(default=0.0, ge=0.0)
    """Quantisation step; 0: none."""

    def pack(self) -> GyroSet:
        """Constants for kernels."""
        return GyroSet(
            mounting_matrix(self.scale_error, self.misalignment_deg),
            scale(math.radians(1.0), as_vector(self.bias_deg_s)),
            math.radians(self.noise_deg_s),
            math.radians(self.bias_drift_deg_s_sqrt_s),
            math.radians(self.range_deg_s),
            math.radians(self.resolution_deg_s),
        )


DEVICE = Device(
    "gyro",
    given="omega_body_rad_s",
    said="gyro",
    symbol="omega",
    units="rad/s",
    meaning="last gyro reading",
    spec=Gyro,
    read=read,
    sky=nothing_around,
    draws=((NOISE_STREAM, ("noise_rad_s",)), (DRIFT_STREAM, ("drift_rad_s_sqrt_s",))),
    quantum="resolution_rad_s",
    several="gyros",
)
