"""Kalman filters with a gyro: its rate, less its estimated bias, carries the attitude on.

States: attitude error, gyro bias, and where it is asked for the magnetometer's bias. Noise of the
gyro: white (angle random walk) and a random walk of the bias (rate random walk), discrete as R.
Farrenkopf, 'Analytic steady-state accuracy solutions for two common spacecraft attitude
estimators' (1978).
"""

import math
from typing import ClassVar, Literal, NamedTuple

from pydantic import Field

from torquer.engine import inlined, kernel
from torquer.estimation.covariance import (
    IDENTITY,
    block,
    mat_add,
    mat_scale,
    put_block,
    put_symmetric,
    put_uncorrelated,
    skew,
    variance_of,
)
from torquer.estimation.estimator import Estimator
from torquer.estimation.kalman import (
    UNINFORMED,
    Filter,
    Sensing,
    is_lost,
    is_refusing,
    keys_of,
    memory_of,
    must_begin,
    start_by_field,
    start_by_triad,
    take_field,
    take_sun,
    takes_over,
)
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
from torquer.interface import UNKNOWN_ESTIMATE, Estimate


class GyroFilterParameters(NamedTuple):
    """Noise of the gyro, variances at the start.

    `white`: [rad^2/s], square of the angle random walk; `walk`: [rad^2/s^3], of the rate random
    walk; `bias`: variance of its bias [rad^2/s^2]; `field_bias`: of the magnetometer's [T^2].
    """

    white: float
    walk: float
    bias: float
    field_bias: float
    sensing: Sensing


@inlined
def propagate_covariance(p, n, turn, dt, white, walk):
    """Covariance after a turn [rad, body] in dt seconds."""
    r = to_dcm(conjugate(from_rotation_vector(turn)))
    g = mat_scale(-dt, mat_add(IDENTITY, -0.5, skew(turn)))
    rt, gt = transpose(r), transpose(g)
    aa, ab, bb = block(p, n, 0, 0), block(p, n, 0, 3), block(p, n, 3, 3)
    upper = mat_add(mat_mul(r, ab), 1.0, mat_mul(g, bb))
    left = mat_add(mat_mul(r, aa), 1.0, mat_mul(g, transpose(ab)))
    aa = mat_add(mat_mul(left, rt), 1.0, mat_mul(upper, gt))
    put_symmetric(p, n, 0, mat_add(aa, white * dt + walk * dt * dt * dt / 3.0, IDENTITY))
    put_block(p, n, 0, 3, mat_add(upper, -0.5 * walk * dt * dt, IDENTITY))
    put_symmetric(p, n, 3, mat_add(bb, walk * dt, IDENTITY))
    if n > 6:
        am, bm = block(p, n, 0, 6), block(p, n, 3, 6)
        put_block(p, n, 0, 6, mat_add(mat_mul(r, am), 1.0, mat_mul(g, bm)))


@inlined
def start(inputs, parameters, memory, prior, anew):
    """Begin; whether there is an attitude to begin with. `prior`: its variance
    where the field is all there is.

    `anew`: forget the biases, too. Else what is known of them stays, and ages; another filter's
    bias of the gyro is taken over.
    """
    sensing, n = parameters.sensing, memory.correction.shape[0]
    before_s, first = memory.t_s, memory.starts == 0.0
    by_other = takes_over(inputs, sensing, memory)
    known = by_other or start_by_triad(inputs, sensing, memory)
    if not (known or start_by_field(inputs, sensing, memory, prior)):
        return False
    if anew or first:
        for i in range(n - 3):
            memory.states[i] = 0.0
        put_uncorrelated(memory.covariance, n, 3, mat_scale(parameters.bias, IDENTITY))
        if n > 6:
            put_uncorrelated(memory.covariance, n, 6, mat_scale(parameters.field_bias, IDENTITY))
    else:
        aged = parameters.walk * (memory.t_s - before_s)
        put_symmetric(
            memory.covariance, n, 3, mat_add(block(memory.covariance, n, 3, 3), aged, IDENTITY)
        )
    bias, sigma = inputs.estimate.gyro_bias_rad_s, inputs.estimate.sigma_rad_s
    if by_other and dot(bias, bias) > 0.0 and sigma > 0.0:
        put_vector(memory.states, bias)
        variance = min(3.0 * sigma * sigma, parameters.bias)
        put_uncorrelated(memory.covariance, n, 3, mat_scale(variance, IDENTITY))
    return True


@inlined
def has_attitude(inputs, parameters, memory, prior):
    """Whether the filter has an attitude: its own, or one to begin with, at first or again."""
    sensing = parameters.sensing
    if must_begin(inputs, sensing, memory):
        if not start(inputs, parameters, memory, prior, False):
            return False
        put_vector(memory.omega_read, inputs.omega_body_rad_s)
    elif is_refusing(sensing, memory):
        start(inputs, parameters, memory, prior, True)
    elif is_lost(sensing, memory):
        start_by_triad(inputs, sensing, memory)  # the biases stay as they are known
    return True


@inlined
def estimate_of(inputs, parameters, memory, dt):
    """What a filter with a gyro believes, `dt` after its last step."""
    bias, n = vector_of(memory.states), memory.correction.shape[0]
    rate_variance = variance_of(memory.covariance, n, 3)
    if dt > 0.0:
        rate_variance += parameters.white / dt
    return Estimate(
        memory.t_s,
        quaternion_of(memory.q),
        sub(inputs.omega_body_rad_s, bias),
        bias,
        math.sqrt(variance_of(memory.covariance, n, 0)),
        math.sqrt(rate_variance),
    )


@inlined
def propagate(inputs, parameters, memory):
    """Carry the attitude on to now, by the mean of the gyro's readings then and now."""
    dt = inputs.t_s - memory.t_s
    read = add(vector_of(memory.omega_read), inputs.omega_body_rad_s)
    turn = scale(dt, sub(scale(0.5, read), vector_of(memory.states)))
    q = multiply(quaternion_of(memory.q), from_rotation_vector(turn))
    put_quaternion(memory.q, normalised(q))
    n = memory.correction.shape[0]
    propagate_covariance(memory.covariance, n, turn, dt, parameters.white, parameters.walk)
    memory.t_s = inputs.t_s
    return dt


@kernel
def kalman_gyro(inputs, parameters, memory):
    """One step: propagate, then take what has been read of field and Sun."""
    sensing = parameters.sensing
    if not has_attitude(inputs, parameters, memory, UNINFORMED):
        return UNKNOWN_ESTIMATE
    dt = propagate(inputs, parameters, memory)
    omega = sub(inputs.omega_body_rad_s, vector_of(memory.states))
    take_field(inputs, sensing, memory, omega)
    take_sun(inputs, sensing, memory, omega)
    put_vector(memory.omega_read, inputs.omega_body_rad_s)
    return estimate_of(inputs, parameters, memory, dt)


class GyroFilter(Filter):
    """A Kalman filter with a gyro, magnetometer and Sun sensors, or one of both.

    `torquer.estimation.gyro_noise.filter_noise` makes the two noises from a data sheet.
    """

    __doc__ = f"{__doc__}{keys_of(Filter)}"

    gives: ClassVar = frozenset({"attitude", "rate"})
    angle_random_walk_deg_sqrt_s: float = Field(gt=0.0)
    """White noise of the gyro, deg/sqrt(s); readings with a standard deviation sigma, taken every T
    seconds, have sigma sqrt(T).
    """
    rate_random_walk_deg_s_sqrt_s: float = Field(ge=0.0)
    """Random walk of the gyro's bias: standard deviation of its change after one second."""
    gyro_bias_sigma_deg_s: float = Field(gt=0.0)
    """Standard deviation of the gyro's bias about zero at the start."""

    def constants(self) -> GyroFilterParameters:
        """Constants for the kernels."""
        return GyroFilterParameters(
            math.radians(self.angle_random_walk_deg_sqrt_s) ** 2,
            math.radians(self.rate_random_walk_deg_s_sqrt_s) ** 2,
            math.radians(self.gyro_bias_sigma_deg_s) ** 2,
            self.bias_variance_t2,
            self.sensing(6),
        )


class KalmanGyro(GyroFilter):
    """Multiplicative extended Kalman filter."""

    __doc__ = f"{__doc__}{keys_of(GyroFilter)}"

    kind: Literal["kalman_gyro"] = "kalman_gyro"

    def estimator(self) -> Estimator:
        """The filter, not yet started."""
        states = (0.0,) * (6 if self.magnetometer_bias_sigma_nt else 3)
        memory = memory_of(states, omega_read=(0.0, 0.0, 0.0))
        return Estimator(
            self.kind, kalman_gyro, self.constants(), memory, self.logs(), self.needs, spec=self
        )
