"""Kalman filters without a gyro: Euler's equations carry the rate on.

States: attitude error, rate, and where they are asked for residual dipole and magnetometer's bias.
Torques that the filter knows: gravity gradient, dipoles of the coils and of the body, the wheels by
their tachometers; all others are white noise to it.
"""

import math
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field

from torquer.earth.gravity import gravity_gradient_at, gravity_gradient_torque
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
    rotate_inverse,
    to_dcm,
)
from torquer.geometry.vec3 import (
    add,
    add_scaled,
    as_symmetric,
    as_vector,
    cross,
    norm,
    put_vector,
    scale,
    sub,
    sym_vec,
    vector_of,
)
from torquer.interface import UNKNOWN_ESTIMATE, Estimate
from torquer.spec import Inertia, Vector

#: Greatest turn [rad] in one step of the equations of motion.
_LONGEST_TURN = 0.1
_NO_DIPOLE = (0.0, 0.0, 0.0)


class DynamicsParameters(NamedTuple):
    """The body as the filter knows it, its noise and variances at the start.

    `inertia` [kg m^2] and its inverse as `sym_vec` takes them; `fixed`: momentum of the body that
    no tachometer tells [N m s]; `torque`: noise [N^2 m^2 s]; `rate` [rad^2/s^2], `dipole`
    [A^2 m^4], `field_bias` [T^2]; `dipole_at`: place of the residual dipole (0: none).
    """

    inertia: tuple
    inverse: tuple
    fixed: tuple
    torque: float
    rate: float
    dipole: float
    field_bias: float
    dipole_at: float
    sensing: Sensing


class Surroundings(NamedTuple):
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
def carried(p, q, omega, before, after, around, dipole, dt):
    """(Attitude, rate) after dt seconds by the midpoint rule; wheels' momentum before and after.

    The momentum of body and wheels is carried on: so their torques need not be known.
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
    return normalised(turned), omega_after


@inlined
def linearised(p, q, omega, wheels, around, dipole, dt):
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
def propagate_covariance(p, n, linear, noise, dipole_at, dt):
    """Covariance after a step; `noise`: of the angular acceleration [rad^2/s^3], 3x3."""
    k, kt = linear, transpose(linear.rate_by_dipole)
    p00, p03, p33 = block(p, n, 0, 0), block(p, n, 0, 3), block(p, n, 3, 3)
    p30 = transpose(p03)
    x00 = mat_add(mat_mul(k.turn, p00), 1.0, mat_mul(k.attitude_by_rate, p30))
    x03 = mat_add(mat_mul(k.turn, p03), 1.0, mat_mul(k.attitude_by_rate, p33))
    x30 = mat_add(mat_mul(k.rate_by_attitude, p00), 1.0, mat_mul(k.rate_by_rate, p30))
    x33 = mat_add(mat_mul(k.rate_by_attitude, p03), 1.0, mat_mul(k.rate_by_rate, p33))
    at = int(dipole_at)
    for c in range(6, n, 3):
        p0, p3 = block(p, n, 0, c), block(p, n, 3, c)
        x0 = mat_add(mat_mul(k.turn, p0), 1.0, mat_mul(k.attitude_by_rate, p3))
        x3 = mat_add(mat_mul(k.rate_by_attitude, p0), 1.0, mat_mul(k.rate_by_rate, p3))
        if at > 0:
            x3 = mat_add(x3, 1.0, mat_mul(k.rate_by_dipole, block(p, n, at, c)))
            if c == at:
                x30 = mat_add(x30, 1.0, mat_mul(k.rate_by_dipole, transpose(p0)))
                x33 = mat_add(x33, 1.0, mat_mul(k.rate_by_dipole, transpose(p3)))
        put_block(p, n, 0, c, x0)
        put_block(p, n, 3, c, x3)
    rate_t, spin_t = transpose(k.attitude_by_rate), transpose(k.rate_by_rate)
    p00 = mat_add(mat_mul(x00, transpose(k.turn)), 1.0, mat_mul(x03, rate_t))
    by_attitude_t = transpose(k.rate_by_attitude)
    p03 = mat_add(mat_mul(x00, by_attitude_t), 1.0, mat_mul(x03, spin_t))
    p33 = mat_add(mat_mul(x30, by_attitude_t), 1.0, mat_mul(x33, spin_t))
    if at > 0:
        p03 = mat_add(p03, 1.0, mat_mul(block(p, n, 0, at), kt))
        p33 = mat_add(p33, 1.0, mat_mul(block(p, n, 3, at), kt))
    put_symmetric(p, n, 0, mat_add(p00, dt * dt * dt / 3.0, noise))
    put_block(p, n, 0, 3, mat_add(p03, 0.5 * dt * dt, noise))
    put_symmetric(p, n, 3, mat_add(p33, dt, noise))


@inlined
def dipole_of(p, memory):
    """The estimated residual dipole [A m^2]."""
    if p.dipole_at == 0.0:
        return _NO_DIPOLE
    return (memory.states[3], memory.states[4], memory.states[5])


@inlined
def propagate(inputs, p, memory):
    """Carry attitude, rate and covariance on to now."""
    interval, place = inputs.t_s - memory.t_s, inputs.ephemeris
    wheels, after = vector_of(memory.wheels), add(inputs.wheel_momentum_body_n_m_s, p.fixed)
    q, omega = quaternion_of(memory.q), vector_of(memory.states)
    dipole = add(dipole_of(p, memory), inputs.coil_dipole_body_a_m2)
    steps = 1 + int(min(norm(omega) * interval / _LONGEST_TURN, 1000.0))
    dt = interval / steps
    gained = scale(1.0 / steps, sub(after, wheels))
    inverse, n = full(p.inverse), memory.correction.shape[0]
    noise = mat_scale(p.torque, mat_mul(inverse, inverse))
    for k in range(steps):
        ago = interval - (k + 0.5) * dt
        around = Surroundings(
            gravity_gradient_at(add_scaled(place.r_inertial_m, -ago, place.v_inertial_m_s)),
            add_scaled(place.b_inertial_t, -ago, place.b_rate_inertial_t_s),
        )
        linear = linearised(p, q, omega, wheels, around, dipole, dt)
        propagate_covariance(memory.covariance, n, linear, noise, p.dipole_at, dt)
        later = add(wheels, gained)
        q, omega = carried(p, q, omega, wheels, later, around, dipole, dt)
        wheels = later
    put_quaternion(memory.q, q)
    put_vector(memory.states, omega)
    put_vector(memory.wheels, after)
    memory.t_s = inputs.t_s


@inlined
def start(inputs, p, memory, anew):
    """Begin; whether there is an attitude to begin with. `anew`: forget dipole and bias, too.

    The rate is that of an estimator which is taken over, else zero, and as uncertain as said.
    """
    sensing, n, first = p.sensing, memory.correction.shape[0], memory.starts == 0.0
    by_other = takes_over(inputs, sensing, memory)
    known = by_other or start_by_triad(inputs, sensing, memory)
    if not (known or start_by_field(inputs, sensing, memory, UNINFORMED)):
        return False
    if anew or first:
        for i in range(3, n - 3):
            memory.states[i] = 0.0
        if p.dipole_at > 0.0:
            put_uncorrelated(memory.covariance, n, int(p.dipole_at), mat_scale(p.dipole, IDENTITY))
        if sensing.bias_at > 0.0:
            put_uncorrelated(
                memory.covariance, n, int(sensing.bias_at), mat_scale(p.field_bias, IDENTITY)
            )
    e, omega, variance = inputs.estimate, (0.0, 0.0, 0.0), p.rate
    if by_other:
        omega = e.omega_body_rad_s
        if e.sigma_rad_s > 0.0:
            variance = min(variance, 3.0 * e.sigma_rad_s * e.sigma_rad_s)
    put_vector(memory.states, omega)
    put_uncorrelated(memory.covariance, n, 3, mat_scale(variance, IDENTITY))
    put_vector(memory.wheels, add(inputs.wheel_momentum_body_n_m_s, p.fixed))
    return True


@kernel
def kalman_dynamics(inputs, parameters, memory):
    """One step: propagate, then take what has been read of field and Sun."""
    sensing, n = parameters.sensing, memory.correction.shape[0]
    if must_begin(inputs, sensing, memory):
        if not start(inputs, parameters, memory, False):
            return UNKNOWN_ESTIMATE
    elif is_refusing(sensing, memory):
        start(inputs, parameters, memory, True)
    elif is_lost(sensing, memory):
        start_by_triad(inputs, sensing, memory)
    if inputs.t_s > memory.t_s:
        propagate(inputs, parameters, memory)
    omega = vector_of(memory.states)
    take_field(inputs, sensing, memory, omega)
    take_sun(inputs, sensing, memory, omega)
    return Estimate(
        memory.t_s,
        quaternion_of(memory.q),
        vector_of(memory.states),
        (0.0, 0.0, 0.0),
        math.sqrt(variance_of(memory.covariance, n, 0)),
        math.sqrt(variance_of(memory.covariance, n, 3)),
    )


class KalmanDynamics(Filter):
    """Multiplicative Kalman filter without a gyro: magnetometer and Sun sensors, or one of both."""

    __doc__ = f"{__doc__}{keys_of(Filter)}"

    kind: Literal["kalman_dynamics"] = "kalman_dynamics"
    gives: ClassVar = frozenset({"attitude", "rate"})
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

    def estimator(self) -> Estimator:
        """The filter, not yet started."""
        inertia = np.array(self.inertia_kg_m2)
        dipole_at = 6 if self.dipole_sigma_a_m2 else 0
        bias_at = 9 if dipole_at else 6
        parameters = DynamicsParameters(
            as_symmetric(inertia),
            as_symmetric(np.linalg.inv(inertia)),
            as_vector(self.wheel_momentum_n_m_s),
            self.torque_noise_n_m_sqrt_s**2,
            math.radians(self.rate_sigma_deg_s) ** 2,
            (self.dipole_sigma_a_m2 or 0.0) ** 2,
            self.bias_variance_t2,
            float(dipole_at),
            self.sensing(bias_at),
        )
        states = bias_at + (3 if self.magnetometer_bias_sigma_nt else 0) - 3
        memory = memory_of((0.0,) * states, wheels=(0.0, 0.0, 0.0))
        return Estimator(
            self.kind, kalman_dynamics, parameters, memory, self.logs(), self.needs, spec=self
        )
