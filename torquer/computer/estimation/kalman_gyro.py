"""Kalman filter with a gyro: its rate, less its estimated bias, propagates the attitude.

States: attitude error, gyro bias, and if requested the magnetometer's bias and scale factors and
misalignments of both sensors. Noise of the gyro: white (angle random walk) and a random walk of the
bias (rate random walk), discrete as R. Farrenkopf, 'Analytic steady-state accuracy solutions for
two common spacecraft attitude estimators' (1978).
"""

import math
from typing import Annotated, ClassVar, Literal, NamedTuple

from pydantic import Field

from torquer.compile.engine import inlined, kernel
from torquer.computer.blocks.parameters import NotNegative
from torquer.computer.estimation.channels import Sensing
from torquer.computer.estimation.covariance import (
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
    read_state,
    skew,
    state_slices,
)
from torquer.computer.estimation.filter import SIGMAS, Filter, describe_keys
from torquer.computer.estimation.hypotheses import hypotheses_memory, step_by_field
from torquer.computer.estimation.kalman import step
from torquer.computer.estimation.mounting import by_misalignment, by_scale, without_mounting
from torquer.maths.geometry.frames import mat_mul, transpose
from torquer.maths.geometry.quaternion import (
    conjugate,
    from_rotation_vector,
    multiply,
    normalise,
    put_quaternion,
    read_quaternion,
    to_dcm,
)
from torquer.maths.geometry.vec3 import (
    add_scaled,
    cross,
    dot,
    norm,
    put_vector,
    read_vector,
    scale,
    sub,
)
from torquer.spacecraft.data_sheet import Assumed

#: First row of the gyro's bias.
BIAS = 3
#: Age of the last reading, in intervals between readings, from which on one has failed to come.
_OVERDUE = 2.5


class GyroParameters(NamedTuple):
    """Noise of the gyro, and what all filters have.

    `white`: [rad^2/s], square of the angle random walk; `walk`: [rad^2/s^3], of the rate random
    walk.
    """

    white: NotNegative
    walk: NotNegative
    prior: States
    sensing: Sensing


@inlined
def rate_error_rows(p, at, omega, column):
    """E P, three columns of it: E makes the error of the rate of the errors of the gyro.

    The rate less the bias is omega; `at`: first rows of the states.
    """
    rows = block(p, BIAS, column)
    if at.gyro_scale > 0:
        rows = mat_add(rows, 1.0, mat_mul(by_scale(omega), block(p, at.gyro_scale, column)))
    if at.gyro_misalignment > 0:
        turned = block(p, at.gyro_misalignment, column)
        rows = mat_add(rows, 1.0, mat_mul(by_misalignment(omega), turned))
    return rows


@inlined
def rate_error_covariance(p, at, omega):
    """Covariance E P E^T of the rate's error by bias, scale factors and misalignment."""
    v = rate_error_rows(p, at, omega, BIAS)
    if at.gyro_scale > 0:
        by = rate_error_rows(p, at, omega, at.gyro_scale)
        v = mat_add(v, 1.0, mat_mul(by, by_scale(omega)))
    if at.gyro_misalignment > 0:
        by = rate_error_rows(p, at, omega, at.gyro_misalignment)
        v = mat_add(v, 1.0, mat_mul(by, transpose(by_misalignment(omega))))
    return v


@inlined
def propagate_covariance(parameters, p, omega, turn, dt):
    """Covariance after a turn [rad, body] in dt seconds, with a mean rate omega."""
    white, walk, at = parameters.white, parameters.walk, state_slices(parameters.prior)
    r = to_dcm(conjugate(from_rotation_vector(turn)))
    g = mat_scale(-dt, mat_add(IDENTITY, -0.5, skew(turn)))
    ae = transpose(rate_error_rows(p, at, omega, ATTITUDE))
    ee = rate_error_covariance(p, at, omega)
    upper = mat_add(mat_mul(r, ae), 1.0, mat_mul(g, ee))
    left = mat_add(mat_mul(r, block(p, ATTITUDE, ATTITUDE)), 1.0, mat_mul(g, transpose(ae)))
    aa = mat_add(mat_mul(left, transpose(r)), 1.0, mat_mul(upper, transpose(g)))
    put_variance(p, ATTITUDE, mat_add(aa, white * dt + walk * dt * dt * dt / 3.0, IDENTITY))
    for c in range(BIAS, p.shape[0], 3):
        am, em = block(p, ATTITUDE, c), rate_error_rows(p, at, omega, c)
        put_block(p, ATTITUDE, c, mat_add(mat_mul(r, am), 1.0, mat_mul(g, em)))
    ab = block(p, ATTITUDE, BIAS)
    put_block(p, ATTITUDE, BIAS, mat_add(ab, -0.5 * walk * dt * dt, IDENTITY))
    put_variance(p, BIAS, mat_add(block(p, BIAS, BIAS), walk * dt, IDENTITY))


@inlined
def forget_gyro(inputs, parameters, memory):
    """Forget readings and errors of the gyros used so far: the rate is of others."""
    prior, at = parameters.prior, state_slices(parameters.prior)
    zero = (0.0, 0.0, 0.0)
    put_state(memory.states, BIAS, zero)
    put_uncorrelated(memory.covariance, BIAS, prior.gyro_bias)
    if at.gyro_scale > 0:
        put_state(memory.states, at.gyro_scale, zero)
        put_uncorrelated(memory.covariance, at.gyro_scale, prior.gyro_scale)
    if at.gyro_misalignment > 0:
        put_state(memory.states, at.gyro_misalignment, zero)
        put_uncorrelated(memory.covariance, at.gyro_misalignment, prior.gyro_misalignment)
    for k in range(3):
        memory.gyro_s[k] = -math.inf


@inlined
def keep_reading(inputs, parameters, memory):
    """Keep the gyro's latest reading if it is new and finite; the two before stay if they are its.

    The first reading of other gyros than before: what was known of their errors is not theirs.
    """
    omega, at = inputs.omega_body_rad_s, inputs.read_at.gyro_s
    if at > memory.gyro_s[2] and math.isfinite(omega[0] + omega[1] + omega[2]):
        if inputs.gyro_units != memory.gyro_units and memory.gyro_s[2] > -math.inf:
            forget_gyro(inputs, parameters, memory)
        for k in range(2):
            memory.gyro_s[k] = memory.gyro_s[k + 1]
            put_vector(memory.gyro_rad_s[k], read_vector(memory.gyro_rad_s[k + 1]))
        memory.gyro_s[2], memory.gyro_units = at, inputs.gyro_units
        put_vector(memory.gyro_rad_s[2], omega)


class Course(NamedTuple):
    """Course of the rate w + slope x + bend x (x + step), x [s] the time since the last reading."""

    w: tuple
    slope: tuple
    bend: tuple
    step: float


@inlined
def rate_course(memory):
    """The course of the rate through the gyro's last three readings, or as many as there are."""
    t, c = memory.gyro_s, read_vector(memory.gyro_rad_s[2])
    slope, bend, step = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0
    if t[1] > -math.inf:
        step, b = t[2] - t[1], read_vector(memory.gyro_rad_s[1])
        slope = scale(1.0 / step, sub(c, b))
        if t[0] > -math.inf:
            before = scale(1.0 / (t[1] - t[0]), sub(b, read_vector(memory.gyro_rad_s[0])))
            bend = scale(1.0 / (t[2] - t[0]), sub(slope, before))
    return Course(c, slope, bend, step)


@inlined
def rate_at(course, x):
    """Rate [rad/s] at x seconds after the last reading."""
    w = add_scaled(course.w, x, course.slope)
    return add_scaled(w, x * (x + course.step), course.bend)


@inlined
def mean_rate(course, x0, x1):
    """Mean rate [rad/s] between two times, in seconds after the last reading."""
    w = add_scaled(course.w, 0.5 * (x0 + x1), course.slope)
    mean = (x0 * x0 + x0 * x1 + x1 * x1) / 3.0 + 0.5 * course.step * (x0 + x1)
    return add_scaled(w, mean, course.bend)


@inlined
def calibrate(parameters, states, omega):
    """A reading of the gyro [rad/s] without its errors as they are known."""
    at = state_slices(parameters.prior)
    v = sub(omega, read_state(states, BIAS))
    return without_mounting(states, at.gyro_scale, at.gyro_misalignment, v)


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


@inlined
def propagate(inputs, parameters, memory, dt):
    """Propagate attitude and covariance by dt seconds with the course of the gyro's readings.

    The rotation vector is the integral of the rate and, where its direction changes, the coning
    term of J. Bortz, 'A new mathematical formulation for strapdown inertial navigation' (1971).
    Without new readings for longer than usual, the last rate is held.
    """
    course, x1 = rate_course(memory), inputs.t_s - memory.gyro_s[2]
    x0 = x1 - dt
    if is_overdue(course, x1):
        coast(memory.covariance, course, x0, x1)
        course = Course(course.w, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0)
    first = calibrate(parameters, memory.states, rate_at(course, x0))
    last = calibrate(parameters, memory.states, rate_at(course, x1))
    mean = calibrate(parameters, memory.states, mean_rate(course, x0, x1))
    turn = add_scaled(scale(dt, mean), dt * dt / 12.0, cross(first, last))
    q = multiply(read_quaternion(memory.q), from_rotation_vector(turn))
    put_quaternion(memory.q, normalise(q))
    propagate_covariance(parameters, memory.covariance, mean, turn, dt)


@inlined
def is_overdue(course, x):
    """Whether a reading has failed to come x seconds after the last one."""
    return x > _OVERDUE * course.step and course.step > 0.0


@inlined
def held_rate_error(course, x):
    """Error [rad/s] of the last rate, held for x seconds.

    The true rate leaves it with its last slope, and is no larger than the last rate.
    """
    return min(norm(course.slope) * x, norm(course.w))


@inlined
def coast(p, course, x0, x1):
    """Uncertainty of the attitude by a rate held from x0 to x1 seconds after the last reading."""
    before, after = held_rate_error(course, x0) * x0, held_rate_error(course, x1) * x1
    for i in range(3):
        p[i, i] += after * after - before * before


@inlined
def read_rate(inputs, parameters, memory, dt):
    """The gyro's last finite rate without its errors, its bias, variances of the rate.

    `dt`: time since the last step [s]. The variances are those of the error that lasts, infinite
    before the first reading, and of the noise over dt.
    """
    bias, noise = read_state(memory.states, BIAS), 0.0
    omega = calibrate(parameters, memory.states, read_vector(memory.gyro_rad_s[2]))
    of_errors = rate_error_covariance(memory.covariance, state_slices(parameters.prior), omega)
    lasting = (of_errors[0][0] + of_errors[1][1] + of_errors[2][2]) / 3.0
    if dt > 0.0:
        noise = parameters.white / dt
    course, age = rate_course(memory), inputs.t_s - memory.gyro_s[2]
    if memory.gyro_s[2] == -math.inf:
        lasting = math.inf
    elif is_overdue(course, age):
        error = held_rate_error(course, age)
        noise += error * error
    return omega, bias, lasting, noise


@inlined
def remember(memory):
    """What `propagate` reads of the step before and writes: nothing, readings are kept first."""
    return 0.0


@inlined
def put_remembered(memory, before):
    """Put back what `remembered` gave."""


@inlined
def kalman_gyro(inputs, parameters, memory):
    """One step of the filter with a gyro."""
    keep_reading(inputs, parameters, memory)
    return step(inputs, parameters, memory, begin, propagate, read_rate)


@kernel
def kalman_gyro_by_field(inputs, parameters, memory):
    """One step of a filter with a gyro that uses the magnetometer alone."""
    keep_reading(inputs, parameters, memory)
    return step_by_field(
        inputs, parameters, memory, begin, propagate, read_rate, remember, put_remembered
    )


class KalmanGyro(Filter):
    """Multiplicative Kalman filter with a gyro and any of the sensors of `Filter`.

    `torquer.computer.estimation.gyro_noise.filter_noise` makes the two noises from a data sheet.
    """

    __doc__ = f"{__doc__}{describe_keys(Filter)}"

    kind: Literal["kalman_gyro"] = "kalman_gyro"
    has_gyro: ClassVar = True
    kernel: ClassVar = kalman_gyro
    remembers: ClassVar = {
        "gyro_s": (-math.inf, -math.inf, -math.inf),
        "gyro_rad_s": ((0.0, 0.0, 0.0),) * 3,
        "gyro_units": 0.0,
    }
    by_field: ClassVar = (kalman_gyro_by_field, hypotheses_memory)
    states_of_devices: ClassVar = (
        Assumed("gyro_bias_sigma_deg_s", "gyro", "bias", SIGMAS),
        *Filter.states_of_devices,
        Assumed("gyro_scale_sigma", "gyro", "scale", SIGMAS),
        Assumed("gyro_misalignment_sigma_deg", "gyro", "misalignment", SIGMAS),
    )
    angle_random_walk_deg_sqrt_s: float = Field(gt=0.0)
    """White noise of the gyro, deg/sqrt(s); readings with a standard deviation sigma, taken every T
    seconds, have sigma sqrt(T).
    """
    rate_random_walk_deg_s_sqrt_s: float = Field(ge=0.0)
    """Random walk of the gyro's bias: standard deviation of its change after one second."""
    gyro_bias_sigma_deg_s: float = Field(gt=0.0)
    """Standard deviation of the gyro's bias about zero at the start."""
    gyro_scale_sigma: Annotated[float, Field(gt=0.0, lt=1.0)] | None = None
    """Relative standard deviation of the gyro's scale factors, as a further state of the filter;
    left out: no scale errors.
    """
    gyro_misalignment_sigma_deg: Annotated[float, Field(gt=0.0, lt=30.0)] | None = None
    """Standard deviation of the gyro's misalignment about each axis, as a further state of the
    filter; left out: no misalignment.
    """

    @property
    def assumes(self) -> tuple[Assumed, ...]:
        """What the keys say of devices, the gyro's noise among it."""
        white = Assumed("angle_random_walk_deg_sqrt_s", "gyro", "white")
        return (*super().assumes, white, Assumed("rate_random_walk_deg_s_sqrt_s", "gyro", "drift"))

    def variances(self) -> States:
        """Variances of all states at the start, 0 for those that the filter does not have."""
        return self.prior(
            gyro_bias=math.radians(self.gyro_bias_sigma_deg_s) ** 2,
            gyro_scale=(self.gyro_scale_sigma or 0.0) ** 2,
            gyro_misalignment=math.radians(self.gyro_misalignment_sigma_deg or 0.0) ** 2,
        )

    def constants(self) -> GyroParameters:
        """Parameters for the kernel."""
        return GyroParameters(
            math.radians(self.angle_random_walk_deg_sqrt_s) ** 2,
            math.radians(self.rate_random_walk_deg_s_sqrt_s) ** 2,
            self.variances(),
            self.sensing(),
        )
