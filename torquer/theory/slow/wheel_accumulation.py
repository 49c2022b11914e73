"""Momentum that wheels accumulate while a satellite keeps its attitude to the orbital frame.

The orbit is circular, the attitude constant. Nominal attitude: x1 along the motion, x3 along the
orbit normal, hence x2 down; the satellite deviates from it by small constant angles. The gravity
gradient, the rotation with the orbit and the air then cause torques that the wheels absorb: their
momentum grows along the normal and oscillates across it. If the atmosphere co-rotates, its cross
wind alternates once a revolution, and its torque across the normal accumulates, too.
"""

from typing import NamedTuple

import numpy as np

from torquer.base import validate
from torquer.environment.earth.atmosphere.air import air_velocities
from torquer.environment.earth.gravity import gravity_gradient_torque
from torquer.maths.geometry.quaternion import from_rotation_vector, to_dcm
from torquer.maths.geometry.vec3 import as_symmetric, as_vector
from torquer.spacecraft.aerodynamics import aerodynamic_force_and_torque, flow
from torquer.theory.validity import Limit, within

#: Instants of a revolution at which the torque is evaluated.
PHASES = 720


RATE = Limit("rate_rad_s", 0.0, open=True)
DENSITY, RADIUS = Limit("density_kg_m3", 0.0), Limit("radius_m", 0.0, open=True)
LENGTH = Limit("length of the normal", 1.0 - 1e-9, 1.0 + 1e-9)
#: Fewest instants of a revolution that resolve the first harmonics of the torque.
FEWEST = Limit("instants of a revolution", 12)


class Held(NamedTuple):
    """A satellite that keeps its attitude, over one revolution from the ascending node."""

    rate_rad_s: float
    """Orbital rate."""
    normal: np.ndarray
    """(3,) orbit normal in the body frame."""
    torque_n_m: np.ndarray
    """(N, 3): torque on the wheels, body frame, at N equidistant arguments of latitude from 0."""

    @property
    def period_s(self) -> float:
        """Time of a revolution [s]."""
        return 2.0 * np.pi / self.rate_rad_s


def orbital_axes(offset_rad) -> np.ndarray:
    """Up, along the motion and orbit normal: rows of a (3, 3), in the body frame.

    `offset_rad`: rotation vector (3,) from the nominal attitude to the body's. Source: WHEEL (6.6).
    """
    validate.finite("offset_rad", offset_rad, (3,))
    turn = np.array(to_dcm(from_rotation_vector(as_vector(offset_rad))))
    nominal = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    return nominal @ turn


def held_torque(inertia_kg_m2, rate_rad_s: float, axes, push_n_m=(0.0, 0.0, 0.0)) -> np.ndarray:
    """Constant torque (3,) [N m] of gravity gradient, orbital rotation, and a given push (3,).

    For small angles (a, b, c) of the offset it is w^2 (-4 (I3 - I2) a, (I1 - I3) b,
    3 (I2 - I1) c) and the push; here for any. Source: WHEEL (6.7).
    """
    within(RATE, rate_rad_s)
    inertia, (up, _, normal) = np.asarray(inertia_kg_m2), np.asarray(axes)
    gravity_gradient = as_vector(np.sqrt(3.0) * rate_rad_s * up)
    gravity = np.array(gravity_gradient_torque(as_symmetric(inertia), gravity_gradient))
    return gravity - rate_rad_s**2 * np.cross(normal, inertia @ normal) + push_n_m


def air_torque(
    surface, density_kg_m3: float, radius_m: float, rate_rad_s: float, axes, inclination_rad=None
) -> np.ndarray:
    """Torques (PHASES, 3) [N m] of air of constant density over one revolution.

    The atmosphere co-rotates; without an inclination it is at rest, as in WHEEL.
    """
    within(RATE, rate_rad_s)
    within(DENSITY, density_kg_m3)
    within(RADIUS, radius_m)
    velocity = np.tile([0.0, radius_m * rate_rad_s, 0.0], (PHASES, 1))  # up, along, normal
    if inclination_rad is not None:
        u = 2.0 * np.pi * np.arange(PHASES) / PHASES
        sine, cosine = np.sin(inclination_rad), np.cos(inclination_rad)
        pole = np.column_stack([sine * np.sin(u), sine * np.cos(u), np.full(PHASES, cosine)])
        velocity = air_velocities(np.tile([radius_m, 0.0, 0.0], (PHASES, 1)), velocity, pole)
    velocity = velocity @ np.array(axes)
    flows = (flow(density_kg_m3, as_vector(v)) for v in velocity)
    return np.array([aerodynamic_force_and_torque(surface, each)[1] for each in flows])


def momentum_under(torque_n_m, normal, rate_rad_s: float, t_s) -> np.ndarray:
    """Momentum (..., 3) [N m s] under a torque that is constant in the body, from zero.

    Across the normal it rotates, along it it grows: with the normal along x3
    H1 = (m1 sin wt + m2 (1 - cos wt))/w, H2 = (m2 sin wt - m1 (1 - cos wt))/w, H3 = m3 t.
    Source: WHEEL (6.8).
    """
    t = np.asarray(t_s, dtype=np.float64)[..., None]
    sine, cosine = _round_trip(torque_n_m, normal, rate_rad_s)
    angle = rate_rad_s * t
    linear = np.dot(torque_n_m, normal) * t * np.asarray(normal)
    return sine * np.sin(angle) + cosine * (1.0 - np.cos(angle)) + linear


def cyclic_bounds(torque_n_m, normal, rate_rad_s: float) -> np.ndarray:
    """Bounds (3,) [N m s] on the components of the cyclic momentum under a constant torque."""
    sine, cosine = _round_trip(torque_n_m, normal, rate_rad_s)
    return np.abs(cosine) + np.hypot(sine, cosine)


def _check(normal, rate) -> None:
    within(RATE, rate)
    within(LENGTH, np.linalg.norm(validate.finite("normal", normal, (3,))))


def _round_trip(torque, normal, rate):
    """Factors of sin wt and of 1 - cos wt."""
    _check(normal, rate)
    across = np.asarray(torque) - np.dot(torque, normal) * np.asarray(normal)
    return across / rate, -np.cross(normal, across) / rate


class Growth(NamedTuple):
    """Momentum from zero: revolution k adds k times `gain` to that of the first revolution."""

    held: Held
    turns: np.ndarray
    """(N + 1, 3, 3): from axes that keep the directions at the node to the body frame."""
    first: np.ndarray
    """(N + 1, 3) [N m s] over the first revolution, in the axes of the node."""

    @property
    def gain_n_m_s(self) -> np.ndarray:
        """(3,) growth per revolution, in the axes of the node."""
        return self.first[-1]

    def over(self, revolution) -> np.ndarray:
        """Momenta (..., N + 1, 3), body frame, over revolutions with these numbers, from 0."""
        number = np.asarray(revolution)[..., None, None]
        return np.einsum("pij,...pj->...pi", self.turns, self.first + number * self.gain_n_m_s)

    def after(self, t_s) -> np.ndarray:
        """Momenta (..., 3) [N m s], body frame, at times [s] from the node."""
        t, steps = np.asarray(t_s, dtype=np.float64), len(self.first) - 1
        number, part = np.divmod(t / self.held.period_s, 1.0)
        phase = np.arange(steps + 1) / steps
        first = np.stack([np.interp(part, phase, x) for x in self.first.T], axis=-1)
        still = first + number[..., None] * self.gain_n_m_s
        turns = _turns(self.held.normal, 2.0 * np.pi * part)
        return np.einsum("...ij,...j->...i", turns, still)


def momentum_growth(held: Held) -> Growth:
    """Momentum that the wheels accumulate, revolution by revolution."""
    _check(held.normal, held.rate_rad_s)
    within(FEWEST, len(validate.finite("torque_n_m", held.torque_n_m)))
    steps = len(held.torque_n_m)
    turns = _turns(held.normal, 2.0 * np.pi * np.arange(steps + 1) / steps)
    torque = np.vstack([held.torque_n_m, held.torque_n_m[:1]])
    still = np.einsum("pji,pj->pi", turns, torque)
    step = 0.5 * (still[1:] + still[:-1]) * held.period_s / steps
    return Growth(held, turns, np.vstack([np.zeros(3), np.cumsum(step, axis=0)]))


def _turns(normal, angle) -> np.ndarray:
    """Matrices (..., 3, 3) to axes that have turned by angles about the normal."""
    n = np.asarray(normal)
    c, s = np.cos(angle)[..., None, None], np.sin(angle)[..., None, None]
    skew = np.array([[0.0, -n[2], n[1]], [n[2], 0.0, -n[0]], [-n[1], n[0], 0.0]])
    return c * np.eye(3) + (1.0 - c) * np.outer(n, n) - s * skew


def saturation_time(growth: Growth, half_spaces, most_revolutions: int = 100_000) -> float:
    """Time [s] at which the momentum leaves the set |row . H| <= 1, rows (m, 3); infinite: never.

    Also infinite if it takes more revolutions than the limit. Accurate to the first order within
    a step of the revolution, and good to a second or so.
    """
    rows = validate.finite("half_spaces", half_spaces)
    number, chunk = 0, 64
    while number < most_revolutions:
        share = np.abs(growth.over(np.arange(number, number + chunk)) @ rows.T).max(axis=-1)
        out = np.argwhere(share > 1.0)
        if len(out):
            k, p = out[0]
            before = share[k, p - 1] if p else 0.0
            part = (1.0 - before) / (share[k, p] - before)
            steps = share.shape[1] - 1
            return float((number + k + (max(p - 1, 0) + part * (p > 0)) / steps)
                         * growth.held.period_s)  # fmt: skip
        number += chunk
        number = max(number, _sooner(growth, rows, share, number))
    return float("inf")


def _sooner(growth: Growth, rows, share, number: int) -> int:
    """A revolution before which no saturation is possible, from the growth per revolution."""
    most = np.linalg.norm(rows, axis=1).max() * np.linalg.norm(growth.gain_n_m_s)
    if most == 0.0:
        return np.iinfo(np.int64).max
    return number + int(min(max((1.0 - share.max()) / most - 1.0, 0.0), 1e9))
