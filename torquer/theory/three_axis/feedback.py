"""Matrix gains of a held attitude: as a law, and the constant ones that settle fastest.

m = (F x) x B with F `[3, 6]` [A m^2/T]: constant, or a trigonometric series along the orbit.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq, minimize

from torquer.computer.blocks.law import Law
from torquer.computer.laws.periodic_gains import PeriodicGains
from torquer.environment.field.averaged import argument_of_latitude
from torquer.maths.geometry import euler
from torquer.theory.periodic.floquet import degree_of_stability, multipliers
from torquer.theory.three_axis.averaged import channel_factors, mean_damping, plateau_edge
from torquer.theory.three_axis.floquet import NOTHING, room, stage_points, transitions_at
from torquer.theory.three_axis.hold import AttitudeHold
from torquer.theory.three_axis.periodic_lqr import PeriodicLqr, Weights, periodic_lqr
from torquer.theory.validity import Limit, within

SIZE = Limit("size", 0.0, open=True)
BOUND = Limit("bound", 6.0, why="the first period alone counts 6", open=True)
HARMONICS = Limit("harmonics", 0)
#: Parts of F that make less than this of its size in dipole are left out.
_FREE = 1e-4


def feedback_law(hold: AttitudeHold, series) -> Law:
    """The law of a series of F `[1 + 2 harmonics, 3, 6]`: a constant one, then cos u, sin u, ...

    It holds the attitude that the hold's law holds.
    """
    angles, rates = np.split(np.asarray(series, dtype=np.float64), 2, axis=2)
    return PeriodicGains(
        rate_gains_n_m_s_per_t2=(rates / hold.rate_rad_s).tolist(),
        angle_gains_n_m_per_t2=(0.5 * angles).tolist(),
        **attitude_keys(hold),
    ).law()


def attitude_keys(hold: AttitudeHold) -> dict:
    """The attitude that the hold's law holds, as the keys of another law that is to hold it."""
    angles = euler.from_quaternion("321", hold.reference.q_wanted)
    reference = "orbital" if hold.reference.orbital else "inertial"
    return {"reference": reference, "euler_deg": (np.degrees(angles) + 0.0).tolist()}


def lqr_law(hold: AttitudeHold, lqr: PeriodicLqr, harmonics: int = 4) -> Law:
    """The regulator as a law: F by so many harmonics of the argument of latitude."""
    within(HARMONICS, harmonics)
    return feedback_law(hold, _series(hold, lqr, harmonics))


def _series(hold: AttitudeHold, lqr: PeriodicLqr, harmonics: int) -> np.ndarray:
    """Series `[1 + 2 harmonics, 3, 6]` of a regulator's F.

    What of F is along the field makes no dipole and is free: the dipoles are fitted, by least
    squares; over all revolutions, for a field that turns with the Earth.
    """
    u, b = lqr.u[:-1], hold.free(lqr.u[:-1]).b_body_t
    at, across = hold.instants(u), np.zeros((len(u), 3, 3))
    for k, each in enumerate(np.eye(3)):
        across[:, :, k] = np.cross(each, b)
    normals = np.cross(at.r_m, at.v_m_s)
    place = [argument_of_latitude(r, h) for r, h in zip(at.r_m, normals, strict=True)]
    waves = _waves(np.array(place), harmonics)
    matrix = np.einsum("nw,nij->niwj", waves, across).reshape(3 * len(u), -1)
    dipoles = (across @ lqr.feedback[:-1]).reshape(3 * len(u), 6)
    return np.linalg.lstsq(matrix, dipoles, rcond=_FREE)[0].reshape(-1, 3, 6)


def _waves(u, harmonics: int) -> np.ndarray:
    """Columns 1, cos u, sin u, cos 2u, ... `[n, 1 + 2 harmonics]`."""
    columns = [np.ones_like(u)]
    for k in range(1, harmonics + 1):
        columns += [np.cos(k * u), np.sin(k * u)]
    return np.stack(columns, axis=1)


class Feedback(NamedTuple):
    """Constant F `[3, 6]` [A m^2/T] of a given size that settles fastest.

    `smoothed_degree` a [1/rad of u]: the greatest for which the sum over all periods of
    |exp(a u) Phi(u)|^2 (Frobenius) stays within `bound`; it lies below the exact `degree`. `slope`:
    greatest derivative of a by an entry over the size of F, at constant size: zero at a maximum.
    `others`: what the other starts came to.
    """

    f: np.ndarray
    degree: float
    smoothed_degree: float
    bound: float
    slope: float
    others: tuple[float, ...]


def best_feedback(
    hold: AttitudeHold, size: float, starts=(), bound: float = 100.0, steps: int = 64
) -> Feedback:
    """Constant F of the Frobenius norm `size` with the greatest smoothed degree of stability.

    The exact degree has no greatest value without a bound on F, and next to its maxima one where it
    is not differentiable (multipliers meet); the smoothed one is smooth, so that a maximum can be
    recognised by its gradient, and it keeps transients within bounds. Local maxima from `starts`
    (F `[3, 6]` of any size), from scalar gains and from a regulator; the best is returned.
    """
    within(SIZE, size)
    within(BOUND, bound)
    smoothed = _Smoothed(hold, size, bound, steps * hold.revolutions)
    found = []
    for f in (*starts, *_usual_starts(hold, size)):
        start = np.asarray(f, dtype=np.float64).ravel()
        options = {"maxiter": 1000, "gtol": 1e-7}
        made = minimize(smoothed, start / np.linalg.norm(start), jac=True, options=options)
        found.append((-made.fun, made.x / np.linalg.norm(made.x), float(np.abs(made.jac).max())))
    found.sort(key=lambda each: -each[0])
    value, z, slope = found[0]
    degree = degree_of_stability(multipliers(smoothed.monodromies(z[None])), hold.period)[0]
    others = tuple(float(each[0]) for each in found[1:])
    return Feedback(size * z.reshape(3, 6), float(degree), float(value), bound, slope, others)


def _usual_starts(hold: AttitudeHold, size: float) -> list[np.ndarray]:
    """Scalar gains on the plateau's edge and with four times its k_a; a regulator's constant F."""
    b = hold.free(np.linspace(0.0, hold.period, 64 * hold.revolutions, endpoint=False)).b_body_t
    mu = channel_factors(hold.body.inertia, mean_damping(b))
    k = hold.rate_rad_s / mu.max()
    edge, one = 2.0 * float(plateau_edge(mu, k)) / (hold.rate_rad_s * k), np.eye(3)
    error = 0.1
    lqr = periodic_lqr(hold, Weights(error, error, error * size * np.abs(b).max()), 1e-6)
    constant = _series(hold, lqr, 0)[0]
    return [np.hstack([edge * one, one]), np.hstack([4.0 * edge * one, one]), constant]


class _Smoothed:
    """Minus the smoothed degree, and its gradient, of F along directions z `[18]`."""

    def __init__(self, hold: AttitudeHold, size: float, bound: float, steps: int):
        self.bound, self.period, self.h = bound, hold.period, hold.period / steps
        free = hold.free(stage_points(self.h, steps))
        self.tables = np.zeros((19, len(free.slopes), 3, 6))
        self.tables[0] = free.slopes
        for k, each in enumerate(np.eye(3)):
            push = np.einsum("nij,nj->ni", free.drive, size * np.cross(each, free.b_body_t))
            for j in range(6):
                self.tables[1 + 6 * k + j, :, :, j] = push

    def monodromies(self, z) -> np.ndarray:
        """Matrices `[points, 6, 6]` for unit vectors `[points, 18]`."""
        out, slopes = np.empty((len(z), 6, 6)), np.empty(self.tables.shape[1:])
        transitions_at(self.tables, z, self.h, room(), slopes, NOTHING, out)
        return out

    def __call__(self, direction) -> tuple[float, np.ndarray]:
        length = np.linalg.norm(direction)
        z, step = direction / length, 1e-4
        moved = np.vstack([z, z + step * np.eye(18), z - step * np.eye(18)])
        m = self.monodromies(moved)
        a = self._smooth(m[0])
        grown = np.exp(a * self.period)
        slopes = grown * (m[1:19] - m[19:]) / (2.0 * step)
        x, y = _gramian(grown * m[0]), _gramian(grown * m[0].T)
        by_entry = 2.0 * np.einsum("ij,kjl,lm,im->k", y, slopes, x, grown * m[0])
        by_a = 2.0 * self.period * np.trace(y @ (x - np.eye(6)))
        slope = -by_entry / by_a
        return -a, -(slope - z * (slope @ z)) / length

    def _smooth(self, monodromy) -> float:
        """The greatest a with trace X = bound, X = I + A X A^T, A = exp(a period) monodromy."""
        most = float(degree_of_stability(multipliers(monodromy), self.period))

        def excess(below: float) -> float:
            x = _gramian(math.exp((most - below) * self.period) * monodromy)
            return math.log(np.trace(x) / self.bound)

        near, far = 1e-3, 2e-3
        while excess(near) < 0.0:
            near *= 0.5
        while excess(far) > 0.0:
            far *= 2.0
        return most - brentq(excess, near, far, xtol=1e-14, rtol=1e-14)


def _gramian(a) -> np.ndarray:
    """X = I + A X A^T = I + A A^T + A^2 A^2^T + ..., by doubling; A must be stable."""
    x = np.eye(len(a))
    while np.abs(a).max() > 1e-18:
        x = x + a @ x @ a.T
        a = a @ a
    return x
