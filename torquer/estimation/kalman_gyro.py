"""Kalman filter with a gyro: its rate, less its estimated bias, propagates the attitude.

States: attitude error, gyro bias, and if requested the magnetometer's bias. Noise of the gyro:
white (angle random walk) and a random walk of the bias (rate random walk), discrete as R.
Farrenkopf, 'Analytic steady-state accuracy solutions for two common spacecraft attitude
estimators' (1978).
"""

import math
from typing import ClassVar, Literal, NamedTuple

from pydantic import Field

from torquer.compile.engine import inlined, kernel
from torquer.estimation.covariance import (
    ATTITUDE,
    IDENTITY,
    States,
    block,
    mat_add,
    mat_scale,
    put_block,
    put_state,
    put_uncorrelated,
    put_variance,
    skew,
    state_of,
    variance_of,
)
from torquer.estimation.hypotheses import memory_of_hypotheses, step_by_field
from torquer.estimation.kalman import Filter, keys_of, step
from torquer.estimation.measurements.measurement import Sensing
from torquer.estimation.triad import put_quaternion, quaternion_of
from torquer.geometry.frames import mat_mul, transpose
from torquer.geometry.quaternion import (
    conjugate,
    from_rotation_vector,
    multiply,
    normalised,
    to_dcm,
)
from torquer.geometry.vec3 import add, dot, put_vector, scale, sub, vector_of

#: First row of the gyro's bias.
BIAS = 3


class GyroParameters(NamedTuple):
    """Noise of the gyro, and what all filters have.

    `white`: [rad^2/s], square of the angle random walk; `walk`: [rad^2/s^3], of the rate random
    walk.
    """

    white: float
    walk: float
    prior: States
    sensing: Sensing


@inlined
def propagate_covariance(p, turn, dt, white, walk):
    """Covariance after a turn [rad, body] in dt seconds."""
    r = to_dcm(conjugate(from_rotation_vector(turn)))
    g = mat_scale(-dt, mat_add(IDENTITY, -0.5, skew(turn)))
    rt, gt = transpose(r), transpose(g)
    aa, ab, bb = block(p, ATTITUDE, ATTITUDE), block(p, ATTITUDE, BIAS), block(p, BIAS, BIAS)
    upper = mat_add(mat_mul(r, ab), 1.0, mat_mul(g, bb))
    left = mat_add(mat_mul(r, aa), 1.0, mat_mul(g, transpose(ab)))
    aa = mat_add(mat_mul(left, rt), 1.0, mat_mul(upper, gt))
    put_variance(p, ATTITUDE, mat_add(aa, white * dt + walk * dt * dt * dt / 3.0, IDENTITY))
    put_block(p, ATTITUDE, BIAS, mat_add(upper, -0.5 * walk * dt * dt, IDENTITY))
    put_variance(p, BIAS, mat_add(bb, walk * dt, IDENTITY))
    for c in range(BIAS + 3, p.shape[0], 3):
        am, bm = block(p, ATTITUDE, c), block(p, BIAS, c)
        put_block(p, ATTITUDE, c, mat_add(mat_mul(r, am), 1.0, mat_mul(g, bm)))


@inlined
def begin(inputs, parameters, memory, taken_over, idle_s, afresh):
    """The gyro's bias ages over the idle time; that of another estimator is taken over."""
    p = memory.covariance
    aged = mat_add(block(p, BIAS, BIAS), parameters.walk * idle_s, IDENTITY)
    put_variance(p, BIAS, aged)
    bias, sigma = inputs.estimate.gyro_bias_rad_s, inputs.estimate.sigma_rad_s
    if taken_over and dot(bias, bias) > 0.0 and sigma > 0.0:
        put_state(memory.states, BIAS, bias)
        put_uncorrelated(p, BIAS, min(3.0 * sigma * sigma, parameters.prior.gyro_bias))
    if not afresh:  # the reading of the previous step is out of date
        put_vector(memory.omega_read, inputs.omega_body_rad_s)


@inlined
def propagate(inputs, parameters, memory, dt):
    """Propagate attitude and covariance by dt seconds with the mean of the gyro's two readings."""
    read = add(vector_of(memory.omega_read), inputs.omega_body_rad_s)
    turn = scale(dt, sub(scale(0.5, read), state_of(memory.states, BIAS)))
    q = multiply(quaternion_of(memory.q), from_rotation_vector(turn))
    put_quaternion(memory.q, normalised(q))
    propagate_covariance(memory.covariance, turn, dt, parameters.white, parameters.walk)
    put_vector(memory.omega_read, inputs.omega_body_rad_s)


@inlined
def rate_of(inputs, parameters, memory, dt):
    """The gyro's rate less its bias, the bias, variance of the rate dt after the last step."""
    bias, variance = state_of(memory.states, BIAS), variance_of(memory.covariance, BIAS)
    if dt > 0.0:
        variance += parameters.white / dt
    return sub(inputs.omega_body_rad_s, bias), bias, variance


@inlined
def remembered(memory):
    """What `propagate` reads of the step before."""
    return vector_of(memory.omega_read)


@inlined
def put_remembered(memory, before):
    """Put back what `remembered` gave."""
    put_vector(memory.omega_read, before)


@kernel
def kalman_gyro(inputs, parameters, memory):
    """One step of the filter with a gyro."""
    return step(inputs, parameters, memory, begin, propagate, rate_of)


@kernel
def kalman_gyro_by_field(inputs, parameters, memory):
    """The same of one that uses the magnetometer alone."""
    return step_by_field(
        inputs, parameters, memory, begin, propagate, rate_of, remembered, put_remembered
    )


class KalmanGyro(Filter):
    """Multiplicative Kalman filter with a gyro: magnetometer and Sun sensors, or one of them.

    `torquer.estimation.gyro_noise.filter_noise` makes the two noises from a data sheet.
    """

    __doc__ = f"{__doc__}{keys_of(Filter)}"

    kind: Literal["kalman_gyro"] = "kalman_gyro"
    kernel: ClassVar = kalman_gyro
    by_field: ClassVar = (kalman_gyro_by_field, memory_of_hypotheses)
    remembers: ClassVar = {"omega_read": (0.0, 0.0, 0.0)}
    angle_random_walk_deg_sqrt_s: float = Field(gt=0.0)
    """White noise of the gyro, deg/sqrt(s); readings with a standard deviation sigma, taken every T
    seconds, have sigma sqrt(T).
    """
    rate_random_walk_deg_s_sqrt_s: float = Field(ge=0.0)
    """Random walk of the gyro's bias: standard deviation of its change after one second."""
    gyro_bias_sigma_deg_s: float = Field(gt=0.0)
    """Standard deviation of the gyro's bias about zero at the start."""

    def constants(self) -> GyroParameters:
        """Parameters for the kernel."""
        return GyroParameters(
            math.radians(self.angle_random_walk_deg_sqrt_s) ** 2,
            math.radians(self.rate_random_walk_deg_s_sqrt_s) ** 2,
            self.prior(gyro_bias=math.radians(self.gyro_bias_sigma_deg_s) ** 2),
            self.sensing(),
        )
