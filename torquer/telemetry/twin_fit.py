"""Fits of twins to a window of readings: Levenberg and Marquardt's method, many twins at once.

Errors of readings are those of the sensors, biases that all rows share, and the way that noise in
the loop has moved the satellite until each row: flights with noise show it, as changes of the start
that would have moved it so.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from torquer.geometry.attitudes import rotation_vector, to_body
from torquer.telemetry.twin_flights import COUNT, Flights, Points, States

#: Parameters: rotation vector and rate at the start, physical ones.
PARAMETERS = 6 + COUNT
#: Steps of central differences: attitude [rad], rate [rad/s], physical parameters.
_STEPS = np.array([1e-6] * 3 + [1e-7] * 3 + [1e-6] * COUNT)
#: Flights with noise.
_NOISY = 32
#: Part of the greatest variance that rounding may have taken from the others.
_ROUNDING = 1e-10
_MOST_DAMPING, _SMALL = 1e8, 0.01
#: Standard deviations at which errors are checked, and the least rise of the squares there that is
#: taken for one.
_FAR, _LEAST_RISE = 3.0, 0.1


class Readings(NamedTuple):
    """Rows [m]: seconds since the flights' start, field [T] and rate [rad/s] in the body (NaN where
    there is none), field in J [T]; standard deviations of the readings and of both biases."""

    t_s: np.ndarray
    b: np.ndarray
    omega: np.ndarray
    b_j: np.ndarray
    sigma_b: float
    sigma_omega: float
    bias_b: float
    bias_omega: float

    def take(self, rows) -> Readings:
        """Some of the rows."""
        t_s, b, omega, b_j = (each[rows] for each in self[:4])
        return self._replace(t_s=t_s, b=b, omega=omega, b_j=b_j)

    def until(self, t_s: float) -> Readings:
        """The rows until an instant."""
        return self.take(self.t_s <= t_s)

    @property
    def there(self) -> np.ndarray:
        """Which of the numbers [6 m] that are fitted were read."""
        return np.isfinite(np.hstack([self.b, self.omega]).ravel())

    def measured(self) -> np.ndarray:
        """Numbers that are fitted [k], over their standard deviations."""
        return self._numbers(self.b, self.omega)

    def predicted(self, states: States) -> np.ndarray:
        """What n twins have in their place [n, k]."""
        b = to_body(states.q, self.b_j[:, None, :])
        pairs = zip(np.swapaxes(b, 0, 1), np.swapaxes(states.omega, 0, 1), strict=True)
        return np.array([self._numbers(*each) for each in pairs])

    def _numbers(self, b, omega) -> np.ndarray:
        return np.hstack([b / self.sigma_b, omega / self.sigma_omega]).ravel()[self.there]

    def noise(self) -> np.ndarray:
        """Covariance [k, k] of the readings' errors, over their standard deviations."""
        size = 3 * [self.bias_b / self.sigma_b] + 3 * [self.bias_omega / self.sigma_omega]
        shared = np.tile(np.diag(size), (len(self.t_s), 1))[self.there]
        return np.eye(len(shared)) + shared @ shared.T


class Fits(NamedTuple):
    """Twins fitted [n]: squares of the readings' errors [n], information of the readings
    [n, p, p]."""

    points: Points
    chi2: np.ndarray
    information: np.ndarray

    def take(self, rows) -> Fits:
        """Some of the twins."""
        return Fits(self.points.take(rows), self.chi2[rows], self.information[rows])


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
        least = _ROUNDING * float(np.max(np.diag(covariance)))
        self.root = np.linalg.cholesky(covariance + least * np.eye(len(covariance)))

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
        if stale.any():
            information[stale], _ = self._slopes(points.take(stale))
        return Fits(points, self._costs(points)[1], information)

    def failed(self, points: Points) -> Fits:
        """Twins that follow nothing."""
        count = len(points.q)
        size = (count, len(self.free), len(self.free))
        return Fits(points, np.full(count, np.inf), np.zeros(size))

    def covariance(self, fits: Fits) -> np.ndarray:
        """Covariance [p, p] of what is free of the first twin.

        Commands that begin to saturate make kinks, near which the slope says little of what lies
        beyond: where the readings fit a twin that is three standard deviations away better than
        the slope has it, these are larger.
        """
        normal = fits.information[0] + np.diag(1.0 / self.prior[self.free] ** 2)
        found = np.linalg.inv(normal)
        axes = _FAR * found / np.sqrt(np.diag(found))
        steps = np.zeros((2 * len(axes), PARAMETERS))
        steps[:, self.free] = np.concatenate([axes, -axes])
        points = fits.points.take(np.zeros(len(steps), int))
        rise = self._costs(points.moved(steps))[0] - self._costs(fits.points.take([0]))[0]
        least = np.clip(rise.reshape(2, -1).min(axis=0), _LEAST_RISE, _FAR**2)
        wider = _FAR / np.sqrt(least)
        return found * np.outer(wider, wider)

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
        miss = self._whitened(self.readings.measured() - self._predicted(points))
        chi2 = np.where(np.isfinite(miss).all(axis=1), np.sum(miss**2, axis=1), np.inf)
        known = points.parameters()[:, self.free] / self.prior[self.free]
        return chi2 + np.sum(known**2, axis=1), chi2

    def _predicted(self, points: Points) -> np.ndarray:
        return self.readings.predicted(self.flights.fly(points, self.readings.t_s))

    def _whitened(self, rows: np.ndarray) -> np.ndarray:
        """Rows [..., k] of numbers with independent errors of size 1."""
        from scipy.linalg import solve_triangular

        flat = rows.reshape(-1, rows.shape[-1])
        good = np.isfinite(flat).all(axis=1)
        found = np.full_like(flat, np.nan)
        found[good] = solve_triangular(self.root, flat[good].T, lower=True).T
        return found.reshape(rows.shape)

    def _slopes(self, points: Points) -> tuple[np.ndarray, np.ndarray]:
        """Information [n, p, p] of the readings and their pull [n, p] on what is free."""
        steps = _STEPS[self.free]
        moved = around(points, self.free)
        numbers = self._predicted(moved).reshape(len(points.q), 1 + 2 * len(steps), -1)
        miss = self._whitened(self.readings.measured() - numbers[:, 0])
        slope = (numbers[:, 1::2] - numbers[:, 2::2]) / (2.0 * steps[:, None])
        slope = np.nan_to_num(self._whitened(slope))
        return np.einsum("nik,njk->nij", slope, slope), np.einsum("nik,nk->ni", slope, miss)


def around(points: Points, free: np.ndarray) -> Points:
    """Each twin, and one step forth and back from it in each parameter: [n (1 + 2 p)]."""
    steps = np.zeros((1 + 2 * len(free), PARAMETERS))
    for k, place in enumerate(free):
        steps[1 + 2 * k, place], steps[2 + 2 * k, place] = _STEPS[place], -_STEPS[place]
    every = np.repeat(np.arange(len(points.q)), len(steps))
    return points.take(every).moved(np.tile(steps, (len(points.q), 1)))


def moved_by_noise(
    quiet: Flights, noisy: Flights, points: Points, readings: Readings
) -> np.ndarray:
    """Covariance [k, k] of what noise in the loop adds to the readings' errors.

    `points`: one twin. Each flight with noise departs from the one without it; the change of the
    start that would have led there changes from row to row by independent steps, whose covariances
    add up.
    """
    row_of = np.repeat(np.arange(len(readings.t_s)), 6)[readings.there]
    near = quiet.fly(around(points, np.arange(6)), readings.t_s)
    twice = 2.0 * _STEPS[:6]
    forth, back = near.take(slice(1, None, 2)), near.take(slice(2, None, 2))
    led = _departures(back, forth) / twice[:, None]
    seen = (readings.predicted(forth) - readings.predicted(back)) / twice[:, None]
    count = np.arange(_NOISY)
    flown = noisy.fly(points.take(0 * count), readings.t_s, seeds=count + 1)
    off = _departures(near.take(np.zeros_like(count)), flown)
    changes = np.linalg.solve(np.swapaxes(led, 1, 2), np.swapaxes(off, 1, 2))
    steps = np.diff(changes, axis=0, prepend=np.zeros_like(changes[:1]))
    each = np.einsum("mik,mjk->mij", steps, steps) / _NOISY
    found = np.zeros((len(row_of), len(row_of)))
    for row, covariance in enumerate(each):
        first = np.searchsorted(row_of, row)
        late = seen[:, first:]
        found[first:, first:] += late.T @ covariance @ late
    return found


def _departures(a: States, b: States) -> np.ndarray:
    """Rotation vectors [rad] and differences of the rate from twins a to b [m, n, 6]."""
    turn = rotation_vector(a.q.reshape(-1, 4), b.q.reshape(-1, 4)).reshape(a.omega.shape)
    return np.concatenate([turn, b.omega - a.omega], axis=2)
