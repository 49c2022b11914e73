"""Guesses of twins, and their fits to a window of readings by Levenberg and Marquardt's method.

Errors of readings are those of the sensors, biases that all rows share, and the way that noise in
the loop has moved the satellite until each row: flights with noise show it, as changes of the start
that would have moved it so.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from torquer.ground.telemetry.twin.flights import (
    COUNT,
    Flights,
    Points,
    States,
    join_points,
    twin_inertia,
)
from torquer.ground.telemetry.twin.readings import Readings
from torquer.maths.geometry.attitudes import rotation_vector
from torquer.scenario.spec import Scenario

#: Parameters: rotation vector and rate at the start, physical ones.
PARAMETERS = 6 + COUNT
#: Steps of central differences: attitude [rad], rate [rad/s], physical parameters.
STEPS = np.array([1e-6] * 3 + [1e-7] * 3 + [1e-6] * COUNT)
#: Flights with noise.
_NOISY = 32
#: Part of the greatest variance that rounding may have taken from the others.
_ROUNDING = 1e-10
_MOST_DAMPING, _SMALL = 1e8, 0.01
#: Of guesses: logarithms of the changes of two ratios of moments, angles about the field.
_RATIOS, _ANGLES = np.linspace(-0.3, 0.3, 5), 8
_BACK_S = 0.05


class Fits(NamedTuple):
    """Twins fitted [n]: squares of the readings' errors [n]."""

    points: Points
    chi2: np.ndarray

    def take(self, rows) -> Fits:
        """Some of the twins."""
        return Fits(self.points.take(rows), self.chi2[rows])


class Problem:
    """Readings of a window and flights through it.

    `prior` [p]: standard deviations of what is known beforehand of the physical parameters, inf for
    nothing; `free` [p]: what is fitted; `covariance`: of the readings, of `Readings.noise`.
    """

    def __init__(
        self, flights: Flights, readings: Readings, prior: np.ndarray, free: np.ndarray, covariance
    ):
        self.flights, self.readings, self.prior = flights, readings, prior
        self.free = np.flatnonzero(free)
        self.root = triangular_root(covariance)

    def fit(self, points: Points, rounds: int) -> Fits:
        """Twins improved for some rounds."""
        count = len(points.q)
        damping, cost = np.full(count, 1e-3), self._costs(points)[0]
        information = np.zeros((count, len(self.free), len(self.free)))
        pull = np.zeros((count, len(self.free)))
        stale = np.isfinite(cost)
        going = stale.copy()
        for _ in range(rounds):
            if stale.any():
                information[stale], pull[stale] = self._slopes(points.take(stale))
                stale[:] = False
            steps = self._steps(points, information, pull, damping)
            tried = points.moved(steps)
            new = np.full(count, np.inf)
            new[going] = self._costs(tried.take(going))[0]
            better = going & (new < cost)
            gain = np.where(better, cost - new, np.inf)
            points = points.where(better, tried)
            cost = np.where(better, new, cost)
            damping = np.where(better, 0.1 * damping, 10.0 * damping)
            stale = better & (gain > _SMALL)
            going &= (gain > _SMALL) & (damping < _MOST_DAMPING)
            if not going.any():
                break
        return Fits(points, self._costs(points)[1])

    def _steps(self, points, information, pull, damping) -> np.ndarray:
        """Steps [n, p] of Levenberg and Marquardt's method."""
        prior = 1.0 / self.prior[self.free] ** 2
        known = points.parameters()[:, self.free]
        normal = information + np.diag(prior)
        scale = np.einsum("nii->ni", normal) + 1e-9
        damped = normal + damping[:, None, None] * scale[:, :, None] * np.eye(len(self.free))
        steps = np.zeros((len(damping), PARAMETERS))
        steps[:, self.free] = np.linalg.solve(damped, (pull - prior * known)[..., None])[..., 0]
        return steps

    def _costs(self, points: Points) -> tuple[np.ndarray, np.ndarray]:
        """Squares of errors and departures from what was known [n]; those of the errors alone."""
        miss = self._whiten(self.readings.measured() - self._predict(points))
        chi2 = np.where(np.isfinite(miss).all(axis=1), np.sum(miss**2, axis=1), np.inf)
        known = points.parameters()[:, self.free] / self.prior[self.free]
        return chi2 + np.sum(known**2, axis=1), chi2

    def _predict(self, points: Points) -> np.ndarray:
        return self.readings.predicted(self.flights.fly(points, self.readings.t_s))

    def _whiten(self, rows: np.ndarray) -> np.ndarray:
        """Rows [..., k] turned into numbers with independent errors of size 1; NaN for rows with
        one that is not finite."""
        from scipy.linalg import solve_triangular

        flat = rows.reshape(-1, rows.shape[-1])
        good = np.isfinite(flat).all(axis=1)
        found = np.full_like(flat, np.nan)
        found[good] = solve_triangular(self.root, flat[good].T, lower=True).T
        return found.reshape(rows.shape)

    def _slopes(self, points: Points) -> tuple[np.ndarray, np.ndarray]:
        """Information [n, p, p] of the readings and their pull [n, p] on what is free."""
        steps = STEPS[self.free]
        moved = around(points, self.free)
        numbers = self._predict(moved).reshape(len(points.q), 1 + 2 * len(steps), -1)
        miss = self._whiten(self.readings.measured() - numbers[:, 0])
        slope = (numbers[:, 1::2] - numbers[:, 2::2]) / (2.0 * steps[:, None])
        slope = np.nan_to_num(self._whiten(slope))
        return np.einsum("nik,njk->nij", slope, slope), np.einsum("nik,nk->ni", slope, miss)


def triangular_root(covariance: np.ndarray) -> np.ndarray:
    """Lower triangular root of a covariance [k, k], with what rounding may have taken from it."""
    least = _ROUNDING * float(np.max(np.diag(covariance)))
    return np.linalg.cholesky(covariance + least * np.eye(len(covariance)))


def around(points: Points, free: np.ndarray) -> Points:
    """Each twin, and one step forth and back from it in each parameter: [n (1 + 2 p)]."""
    steps = np.zeros((1 + 2 * len(free), PARAMETERS))
    for k, place in enumerate(free):
        steps[1 + 2 * k, place], steps[2 + 2 * k, place] = STEPS[place], -STEPS[place]
    every = np.repeat(np.arange(len(points.q)), len(steps))
    return points.take(every).moved(np.tile(steps, (len(points.q), 1)))


class Moved(NamedTuple):
    """What noise in the loop does: covariance [k, k] of what it adds to the readings' errors, over
    their standard deviations, and to the motion at the end, where it is asked for; the greatest
    angle [rad] by which it turns the satellite, as root mean square."""

    covariance: np.ndarray
    angle: float


def moved_by_noise(
    quiet: Flights,
    noisy: Flights,
    points: Points,
    readings: Readings,
    end_s: float | None = None,
    seed: int = 0,
) -> Moved:
    """What noise in the loop adds to readings, and to the motion (rotation vector, rate) at `end_s`
    over `readings.motion_sizes()`.

    `points`: one twin. Each flight with noise departs from the one without it; the change of the
    start that would have led there changes from row to row by independent steps, whose covariances
    add up. `seed`: of the noise.
    """
    t_s, row_of = readings.t_s, readings.rows()
    if end_s is not None:
        t_s, row_of = np.append(t_s, end_s), np.append(row_of, 6 * [len(t_s)])
    near = quiet.fly(around(points, np.arange(6)), t_s)
    twice = 2.0 * STEPS[:6]
    forth, back = near.take(slice(1, None, 2)), near.take(slice(2, None, 2))
    led = departures(back, forth) / twice[:, None]
    seen = (readings.predicted(forth) - readings.predicted(back)) / twice[:, None]
    if end_s is not None:
        seen = np.hstack([seen, led[-1] / readings.motion_sizes()])
    count = np.arange(_NOISY)
    flown = noisy.fly(points.take(0 * count), t_s, seeds=_NOISY * seed + count + 1)
    off = departures(near.take(np.zeros_like(count)), flown)
    changes = np.linalg.solve(np.swapaxes(led, 1, 2), np.swapaxes(off, 1, 2))
    steps = np.diff(changes, axis=0, prepend=np.zeros_like(changes[:1]))
    each = np.einsum("mik,mjk->mij", steps, steps) / _NOISY
    found = np.zeros((len(row_of), len(row_of)))
    for row, covariance in enumerate(each):
        first = np.searchsorted(row_of, row)
        late = seen[:, first:]
        found[first:, first:] += late.T @ covariance @ late
    angles = np.mean(np.sum(off[..., :3] ** 2, axis=-1), axis=1)
    return Moved(found, float(np.sqrt(angles.max())))


def departures(a: States, b: States) -> np.ndarray:
    """Rotation vectors [rad] and differences of the rate from twins a to b [m, n, 6]."""
    turn = rotation_vector(a.q.reshape(-1, 4), b.q.reshape(-1, 4)).reshape(a.omega.shape)
    return np.concatenate([turn, b.omega - a.omega], axis=2)


def guesses(scenario: Scenario, readings: Readings) -> Points:
    """Twins that have the field and the rate of the first row, whatever the rest may be.

    Rate and attitude are carried back to the flights' start by free rotation.
    """
    turns = Rotation.from_rotvec(
        np.outer(np.arange(_ANGLES) * 2.0 * np.pi / _ANGLES, _unit(readings.b_j[0]))
    )
    at_first = turns * _turning(_unit(readings.b[0]), _unit(readings.b_j[0]))
    parts = []
    for change in _changes():
        omega, back = _carried_back(
            twin_inertia(scenario, change), readings.omega[0], float(readings.t_s[0])
        )
        q = (at_first * back).as_quat()
        parts.append(Points(q, np.tile(omega, (_ANGLES, 1)), np.tile(change, (_ANGLES, 1))))
    return join_points(parts)


def _changes() -> list[np.ndarray]:
    """Physical parameters [10] with other ratios of the moments, whose product stays."""
    found = []
    for first in _RATIOS:
        for second in _RATIOS:
            change = np.zeros(COUNT)
            change[:3] = np.array([first, second, 0.0]) - (first + second) / 3.0
            found.append(change)
    return found


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


def _turning(a: np.ndarray, b: np.ndarray) -> Rotation:
    """The shortest rotation that takes a unit vector into another."""
    return Rotation.align_vectors(b[None], a[None])[0]


def _carried_back(inertia: np.ndarray, omega: np.ndarray, t_s: float) -> tuple:
    """Rate t_s earlier in free rotation, and the rotation from then until now reversed, such that
    the attitude then is that of now times it."""
    inverse, back = np.linalg.inv(inertia), Rotation.identity()
    steps = max(1, int(np.ceil(t_s / _BACK_S)))
    h = t_s / steps

    def rise(w):
        return -inverse @ np.cross(w, inertia @ w)

    for _ in range(steps if t_s > 0.0 else 0):
        middle = omega - 0.5 * h * rise(omega)
        back = back * Rotation.from_rotvec(-h * middle)
        omega = omega - h * rise(middle)
    return omega, back
