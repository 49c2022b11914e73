"""The full motion that the averaged one approximates: same law, field and satellite.

Twice: in the variables of Beletsky and Chernousko, which separate slow from fast, and by Euler's
equations with a quaternion, which has no singular points. Both in u, for DOP853.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from torquer.base import validate
from torquer.compile.engine import kernel
from torquer.computer.blocks.law import Law
from torquer.maths.geometry.quaternion import derivative, multiply, rotate, rotate_inverse
from torquer.maths.geometry.vec3 import as_matrix, cross, mat_vec, scale, sub
from torquer.maths.integrate.dop853 import rates_of
from torquer.theory.slow.averaging import (
    averaged_motion,
    body_to_l,
    commanded_dipole,
    l_to_reference,
    models_at,
    nodes,
    spin_rate,
)
from torquer.theory.slow.evolution.model import Slow
from torquer.theory.slow.slow_motion import follow_path
from torquer.theory.slow.spinner import Spinner
from torquer.theory.validity import OFF_POLES, check_slow, within


class OsculatingMotion(NamedTuple):
    """Full motion in l, rho, sigma, theta, phi, psi. `day`: day angle at u = 0 [rad]."""

    law: object
    parameters: np.ndarray
    memory: np.ndarray
    setting: NamedTuple
    day: float


class EulerMotion(NamedTuple):
    """Full motion of a body of any inertia: quaternion body to the field's frame, rate [rad/s].

    `inertia` [kg m^2] and `inverse`: rows of the tensor and of its inverse.
    """

    law: object
    parameters: np.ndarray
    memory: np.ndarray
    setting: NamedTuple
    day: float
    inertia: tuple
    inverse: tuple


class Fast(NamedTuple):
    """Fast angles [rad]: own rotation phi, precession psi."""

    phi: float
    psi: float


@kernel
def torque_at(problem, u, q, omega):
    """Torque [N m] in the body at argument of latitude u."""
    setting = problem.setting
    day = problem.day + setting.days_per_orbit * u
    t_s, models = u / setting.orbital_rate, models_at(setting, u, day)
    b, m = commanded_dipole(problem.law, problem.parameters, problem.memory, t_s, q, omega, models)
    return cross(m, b)


@rates_of(OsculatingMotion)
def _osculating_rates(problem, t, y, dy):
    """Source: MAG (1.3.4), MAG (2.1.6), FIELD (2.1), in u and with l = L/L0."""
    setting, length, rho, theta = problem.setting, y[0], y[1], y[3]
    phi, psi = y[4], y[5]
    half_phi = (math.cos(0.5 * phi), math.sin(0.5 * phi))
    half_psi = (math.cos(0.5 * psi), math.sin(0.5 * psi))
    q_body = body_to_l(half_psi, (math.cos(0.5 * theta), math.sin(0.5 * theta)), half_phi)
    omega = spin_rate(setting, rotate_inverse(q_body, (0.0, 0.0, setting.momentum * length)))
    torque = torque_at(problem, t, multiply(l_to_reference(rho, y[2]), q_body), omega)
    unit = setting.momentum * setting.orbital_rate
    m1, m2, m3 = scale(1.0 / unit, rotate(q_body, torque))
    spin = setting.momentum / setting.orbital_rate
    cp, sp, cot = math.cos(psi), math.sin(psi), 1.0 / math.tan(theta)
    dy[0], dy[1], dy[2] = m3, m1 / length, m2 / (length * math.sin(rho))
    dy[3] = (m2 * cp - m1 * sp) / length
    own = spin * length * math.cos(theta) * (1.0 / setting.axial - 1.0 / setting.transverse)
    dy[4] = own + (m1 * cp + m2 * sp) / (length * math.sin(theta))
    dy[5] = spin * length / setting.transverse
    dy[5] -= (m1 * cp * cot + m2 * (1.0 / math.tan(rho) + sp * cot)) / length


@rates_of(EulerMotion)
def _euler_rates(problem, t, y, dy):
    setting, q, omega = problem.setting, (y[0], y[1], y[2], y[3]), (y[4], y[5], y[6])
    momentum = mat_vec(problem.inertia, omega)
    torque = sub(torque_at(problem, t, q, omega), cross(omega, momentum))
    per_u = 1.0 / setting.orbital_rate
    dy[0], dy[1], dy[2], dy[3] = scale4(per_u, derivative(q, omega))
    dy[4], dy[5], dy[6] = scale(per_u, mat_vec(problem.inverse, torque))


@kernel
def scale4(factor, q):
    """Four numbers times a factor."""
    return (factor * q[0], factor * q[1], factor * q[2], factor * q[3])


def osculating(law: Law, spinner: Spinner, start: Slow, fast: Fast, u, *, day=0.0, rtol=1e-10):
    """Full motion along the points `u`: (Slow, Fast) of arrays, in Beletsky-Chernousko variables.

    ValueError if it starts at a singular point (rho or theta 0 or pi, l = 0), RuntimeError if it
    comes too near one.
    """
    check_slow(start)
    within(OFF_POLES, start.rho)
    within(
        OFF_POLES._replace(name="theta", why="phi and psi are not distinct on the axis"),
        start.theta,
    )
    validate.finite("fast", fast, (2,))
    problem = OsculatingMotion(*averaged_motion(law, spinner, nodes(1, 1, 1))[:4], float(day))
    states = follow_path(problem, (*start, *fast), u, rtol).T
    return Slow(*states[:4]), Fast(*states[4:])


def full_state(spinner: Spinner, slow: Slow, fast: Fast) -> np.ndarray:
    """Quaternion (body to the field's frame) and rate [rad/s] of slow and fast variables."""
    check_slow(slow)
    validate.finite("fast", fast, (2,))
    q_l = Rotation.from_euler("ZY", [slow.sigma, slow.rho])
    q_body = Rotation.from_euler("ZXZ", [fast.psi, slow.theta, fast.phi])
    momentum = q_body.inv().apply([0.0, 0.0, spinner.momentum_n_m_s * slow.l])
    a, c = spinner.transverse_kg_m2, spinner.axial_kg_m2
    return np.concatenate([(q_l * q_body).as_quat(), momentum / np.array([a, a, c])])


def slow_variables(spinner: Spinner, states) -> Slow:
    """Slow variables (sigma within -pi..pi) of quaternions and rates [n, 7].

    Without momentum the angles are NaN.
    """
    return slow_variables_of(moments(spinner), spinner.momentum_n_m_s, states)


def moments(spinner: Spinner) -> np.ndarray:
    """Inertia tensor [kg m^2] of an axisymmetric satellite."""
    a, c = spinner.transverse_kg_m2, spinner.axial_kg_m2
    return np.diag([a, a, c])


def slow_variables_of(inertia, unit_n_m_s: float, states) -> Slow:
    """The same for a body of any inertia tensor, whose third axis is the spin axis.

    `unit_n_m_s`: L0, the unit of l.
    """
    states = np.atleast_2d(states)
    body = states[:, 4:] @ np.asarray(inertia)
    x, y, z = Rotation.from_quat(states[:, :4]).apply(body).T
    length, across = np.linalg.norm(body, axis=1), np.hypot(body[:, 0], body[:, 1])
    theta = np.arctan2(across, body[:, 2])
    known = np.where(length > 0.0, 0.0, np.nan)
    rho, sigma = np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)
    return Slow(length / unit_n_m_s, rho + known, sigma + known, theta + known)


def by_euler(law: Law, spinner: Spinner, start: Slow, fast: Fast, u, *, day=0.0, rtol=1e-10):
    """Full motion along the points `u` by Euler's equations: states [n, 7]; see
    `slow_variables`."""
    state = full_state(spinner, start, fast)
    return by_euler_from(law, spinner, moments(spinner), state, u, day=day, rtol=rtol)


def by_euler_from(law: Law, spinner: Spinner, inertia, state, u, *, day=0.0, rtol=1e-10):
    """The same for a body of any inertia tensor [kg m^2], from a state [7].

    Of the satellite only orbit and field count then.
    """
    tensor = np.asarray(inertia, dtype=np.float64)
    rows = (as_matrix(tensor), as_matrix(np.linalg.inv(tensor)))
    motion = averaged_motion(law, spinner, nodes(1, 1, 1))[:4]
    return follow_path(EulerMotion(*motion, float(day), *rows), state, u, rtol)
