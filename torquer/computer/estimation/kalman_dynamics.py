"""Kalman filter without a gyro: Euler's equations propagate the rate.

States: attitude error, rate, and if requested residual dipole and magnetometer's bias. Torques that
the filter knows: gravity gradient, dipoles of the coils and of the body, the wheels by their
tachometers; all others are white noise to it.
"""

import math
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field

from torquer.base.spec import Inertia, Vector
from torquer.compile.engine import inlined, kernel
from torquer.computer.blocks.parameters import (
    InertiaNumbers,
    InverseInertiaNumbers,
    MomentumNumbers,
    NotNegative,
)
from torquer.computer.estimation.channels import Sensing
from torquer.computer.estimation.covariance import (
    ATTITUDE,
    IDENTITY,
    States,
    block,
    mat_add,
    mat_scale,
    mean_variance,
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
from torquer.environment.earth.gravity import gravity_gradient_at, gravity_gradient_torque
from torquer.maths.geometry.frames import mat_mul, transpose
from torquer.maths.geometry.quaternion import (
    conjugate,
    from_rotation_vector,
    multiply,
    normalise,
    put_quaternion,
    read_quaternion,
    rotate_inverse,
    to_dcm,
)
from torquer.maths.geometry.vec3 import (
    add,
    add_scaled,
    as_symmetric,
    as_vector,
    cross,
    is_finite,
    norm,
    put_vector,
    read_vector,
    scale,
    sub,
    sym_vec,
)
from torquer.spacecraft.data_sheet import Assumed

#: First row of the rate.
RATE = 3
#: Greatest turn [rad] in one step of the equations of motion.
_LONGEST_TURN = 0.05


class DynamicsParameters(NamedTuple):
    """The body as the filter knows it, its noise, and what all filters have.

    `inertia` [kg m^2] and its inverse as `sym_vec` takes them; `fixed`: momentum of the body that
    no tachometer measures [N m s]; `torque`: noise [N^2 m^2 s].
    """

    inertia: InertiaNumbers
    inverse: InverseInertiaNumbers
    fixed: MomentumNumbers
    torque: NotNegative
    prior: States
    sensing: Sensing


class ModelEnvironment(NamedTuple):
    """What acts on the body, inertial: radius vector of `gravity_gradient_at`, field [T]."""

    gravity: tuple
    b: tuple


class Linear(NamedTuple):
    """Motion of small errors in a step: what attitude, rate, dipole do to attitude and rate."""

    turn: tuple
    attitude_by_rate: tuple
    rate_by_attitude: tuple
    rate_by_rate: tuple
    rate_by_dipole: tuple


@inlined
def full(s):
    """A symmetric matrix, given by six numbers, by its rows."""
    return ((s[0], s[3], s[4]), (s[3], s[1], s[5]), (s[4], s[5], s[2]))


@inlined
def torque_on(p, q, around, dipole):
    """Torque [N m] of gravity gradient and dipole in the body."""
    gravity = gravity_gradient_torque(p.inertia, rotate_inverse(q, around.gravity))
    return add(gravity, cross(dipole, rotate_inverse(q, around.b)))


@inlined
def step_motion(p, q, omega, before, after, around, dipole, dt):
    """(Attitude, rate) after dt seconds by the midpoint rule; wheels' momentum before and after.

    The momentum of body and wheels together is propagated: the wheels' torques need not be known.
    """
    h = add(sym_vec(p.inertia, omega), before)
    rate = sub(torque_on(p, q, around, dipole), cross(omega, h))
    halfway = add_scaled(h, 0.5 * dt, rate)
    wheels = scale(0.5, add(before, after))
    omega_mid = sym_vec(p.inverse, sub(halfway, wheels))
    q_mid = multiply(q, from_rotation_vector(scale(0.5 * dt, omega)))
    rate = sub(torque_on(p, q_mid, around, dipole), cross(omega_mid, halfway))
    omega_after = sym_vec(p.inverse, sub(add_scaled(h, dt, rate), after))
    turned = multiply(q, from_rotation_vector(scale(dt, omega_mid)))
    return normalise(turned), omega_after


@inlined
def linearise(p, q, omega, wheels, around, dipole, dt):
    """How small errors move in dt seconds."""
    inertia, inverse = full(p.inertia), full(p.inverse)
    turn = scale(dt, omega)
    g, b = rotate_inverse(q, around.gravity), rotate_inverse(q, around.b)
    gravity = mat_add(mat_mul(skew(g), inertia), -1.0, skew(sym_vec(p.inertia, g)))
    by_attitude = mat_add(mat_mul(gravity, skew(g)), 1.0, mat_mul(skew(dipole), skew(b)))
    momentum = skew(add(sym_vec(p.inertia, omega), wheels))
    spin = mat_mul(inverse, mat_add(momentum, -1.0, mat_mul(skew(omega), inertia)))
    spin = mat_scale(dt, spin)
    grown = mat_add(mat_add(IDENTITY, 1.0, spin), 0.5, mat_mul(spin, spin))
    return Linear(
        to_dcm(conjugate(from_rotation_vector(turn))),
        mat_scale(dt, mat_add(IDENTITY, -0.5, skew(turn))),
        mat_scale(dt, mat_mul(inverse, by_attitude)),
        grown,
        mat_scale(-dt, mat_mul(inverse, skew(b))),
    )


@inlined
def move_covariance(p, linear, column, dipole):
    """Attitude and rate rows of the covariance times the motion, in three columns."""
    k, attitude, rate = linear, block(p, ATTITUDE, column), block(p, RATE, column)
    x = mat_add(mat_mul(k.turn, attitude), 1.0, mat_mul(k.attitude_by_rate, rate))
    y = mat_add(mat_mul(k.rate_by_attitude, attitude), 1.0, mat_mul(k.rate_by_rate, rate))
    if dipole > 0:
        y = mat_add(y, 1.0, mat_mul(k.rate_by_dipole, block(p, dipole, column)))
    return x, y


@inlined
def propagate_covariance(p, linear, torque, inverse, dipole, dt):
    """Covariance after a step; `torque`: noise, `inverse`: of the inertia, by rows.

    `dipole`: first row of the residual dipole, 0 if it is no state.
    """
    x00, x30 = move_covariance(p, linear, ATTITUDE, dipole)
    x03, x33 = move_covariance(p, linear, RATE, dipole)
    for c in range(RATE + 3, p.shape[0], 3):
        x, y = move_covariance(p, linear, c, dipole)
        put_block(p, ATTITUDE, c, x)
        put_block(p, RATE, c, y)
    turn_t, rate_t = transpose(linear.turn), transpose(linear.attitude_by_rate)
    attitude_t, spin_t = transpose(linear.rate_by_attitude), transpose(linear.rate_by_rate)
    p00 = mat_add(mat_mul(x00, turn_t), 1.0, mat_mul(x03, rate_t))
    p03 = mat_add(mat_mul(x00, attitude_t), 1.0, mat_mul(x03, spin_t))
    p33 = mat_add(mat_mul(x30, attitude_t), 1.0, mat_mul(x33, spin_t))
    if dipole > 0:
        dipole_t = transpose(linear.rate_by_dipole)
        p03 = mat_add(p03, 1.0, mat_mul(block(p, ATTITUDE, dipole), dipole_t))
        p33 = mat_add(p33, 1.0, mat_mul(block(p, RATE, dipole), dipole_t))
    noise = mat_scale(torque, mat_mul(inverse, inverse))
    put_variance(p, ATTITUDE, mat_add(p00, dt * dt * dt / 3.0, noise))
    put_block(p, ATTITUDE, RATE, mat_add(p03, 0.5 * dt * dt, noise))
    put_variance(p, RATE, mat_add(p33, dt, noise))


@inlined
def known_momentum(inputs, parameters, memory):
    """Momentum of all wheels [N m s]; the one before where the tachometers read no number."""
    h = inputs.wheel_momentum_body_n_m_s
    return add(h, parameters.fixed) if is_finite(h) else read_vector(memory.wheels)


@inlined
def begin(inputs, parameters, memory, taken_over, idle_s, afresh):
    """Start the rate: that of an estimator taken over, or zero with the prior's variance."""
    e, omega, variance = inputs.estimate, (0.0, 0.0, 0.0), parameters.prior.rate
    if taken_over:
        omega = e.omega_body_rad_s
        if e.sigma_rad_s > 0.0:
            variance = min(variance, 3.0 * e.sigma_rad_s * e.sigma_rad_s)
    put_state(memory.states, RATE, omega)
    put_uncorrelated(memory.covariance, RATE, variance)
    put_vector(memory.wheels, known_momentum(inputs, parameters, memory))


@inlined
def or_zero(v):
    """A vector as it is; zero where the ephemeris has none."""
    return v if is_finite(v) else (0.0, 0.0, 0.0)


@inlined
def propagate(inputs, parameters, memory, dt):
    """Propagate attitude, rate and covariance by dt seconds, in steps of small rotations."""
    if dt <= 0.0:
        return
    p, place, dipole_at = (
        parameters,
        inputs.ephemeris,
        state_slices(parameters.prior).residual_dipole,
    )
    wheels, after = read_vector(memory.wheels), known_momentum(inputs, p, memory)
    q, omega = read_quaternion(memory.q), read_state(memory.states, RATE)
    dipole = read_state(memory.states, dipole_at)
    if is_finite(inputs.coil_dipole_body_a_m2):
        dipole = add(dipole, inputs.coil_dipole_body_a_m2)
    steps = 1 + int(min(norm(omega) * dt / _LONGEST_TURN, 1000.0))
    h = dt / steps
    gained = scale(1.0 / steps, sub(after, wheels))
    for k in range(steps):
        ago = dt - (k + 0.5) * h
        around = ModelEnvironment(
            or_zero(
                gravity_gradient_at(add_scaled(place.r_inertial_m, -ago, place.v_inertial_m_s))
            ),
            or_zero(add_scaled(place.b_inertial_t, -ago, place.b_rate_inertial_t_s)),
        )
        linear = linearise(p, q, omega, wheels, around, dipole, h)
        propagate_covariance(memory.covariance, linear, p.torque, full(p.inverse), dipole_at, h)
        later = add(wheels, gained)
        q, omega = step_motion(p, q, omega, wheels, later, around, dipole, h)
        wheels = later
    put_quaternion(memory.q, q)
    put_state(memory.states, RATE, omega)
    put_vector(memory.wheels, after)


@inlined
def read_rate(inputs, parameters, memory, dt):
    """The rate, no bias of a gyro, the rate's variance, no noise."""
    omega, variance = read_state(memory.states, RATE), mean_variance(memory.covariance, RATE)
    return omega, (0.0, 0.0, 0.0), variance, 0.0


@inlined
def remember(memory):
    """What `propagate` reads of the step before."""
    return read_vector(memory.wheels)


@inlined
def put_remembered(memory, before):
    """Put back what `remembered` gave."""
    put_vector(memory.wheels, before)


@inlined
def kalman_dynamics(inputs, parameters, memory):
    """One step of the filter without a gyro."""
    return step(inputs, parameters, memory, begin, propagate, read_rate)


@kernel
def kalman_dynamics_by_field(inputs, parameters, memory):
    """One step of a filter without a gyro that uses the magnetometer alone."""
    return step_by_field(
        inputs, parameters, memory, begin, propagate, read_rate, remember, put_remembered
    )


class KalmanDynamics(Filter):
    """Multiplicative Kalman filter without a gyro, with any of the sensors of `Filter`."""

    __doc__ = f"{__doc__}{describe_keys(Filter)}"

    kind: Literal["kalman_dynamics"] = "kalman_dynamics"
    kernel: ClassVar = kalman_dynamics
    by_field: ClassVar = (kalman_dynamics_by_field, hypotheses_memory)
    remembers: ClassVar = {"wheels": (0.0, 0.0, 0.0)}
    states_of_devices: ClassVar = (
        *Filter.states_of_devices,
        Assumed("dipole_sigma_a_m2", "coils", "bias", SIGMAS),
    )
    inertia_kg_m2: Inertia
    """Inertia of the body with its wheels: three moments or 3x3."""
    wheel_momentum_n_m_s: Vector = (0.0, 0.0, 0.0)
    """Fixed momentum of the body's wheels, in body axes."""
    torque_noise_n_m_sqrt_s: float = Field(gt=0.0)
    """Square root of the spectral density of all torques but gravity gradient, wheels, coils and
    the residual dipole that is estimated; a random torque sigma, held for T seconds, has sigma
    sqrt(T).
    """
    rate_sigma_deg_s: float = Field(gt=0.0)
    """Standard deviation of the rate about zero at the start."""
    dipole_sigma_a_m2: Annotated[float, Field(gt=0.0)] | None = None
    """Estimate the residual dipole, too, with this standard deviation about zero at the start; left
    out: no dipole.
    """

    @property
    def assumes(self) -> tuple[Assumed, ...]:
        """What the keys say of devices, and of the rate at the start."""
        return (*super().assumes, Assumed("rate_sigma_deg_s", "initial", "rate", SIGMAS))

    def variances(self) -> States:
        """Variances of all states at the start, 0 for those that the filter does not have."""
        return self.prior(
            rate=math.radians(self.rate_sigma_deg_s) ** 2,
            residual_dipole=(self.dipole_sigma_a_m2 or 0.0) ** 2,
        )

    def constants(self) -> DynamicsParameters:
        """Parameters for the kernel."""
        inertia = np.array(self.inertia_kg_m2)
        return DynamicsParameters(
            as_symmetric(inertia),
            as_symmetric(np.linalg.inv(inertia)),
            as_vector(self.wheel_momentum_n_m_s),
            self.torque_noise_n_m_sqrt_s**2,
            self.variances(),
            self.sensing(),
        )
