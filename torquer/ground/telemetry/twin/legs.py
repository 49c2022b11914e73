"""The twin of a whole session, flown in legs that are too short for noise in the loop to bend.

In an hour noise of the sensors, through the law, turns a satellite so far from its flight without
noise that the readings are no longer linear in it. Each leg therefore has a motion of its own at
its start; where one ends the next begins, but for what noise does within a leg.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from torquer.ground.telemetry.twin.fit import (
    STEPS,
    Moved,
    around,
    departures,
    moved_by_noise,
    triangular_root,
)
from torquer.ground.telemetry.twin.flights import COUNT, Flights, Points, States, join_points
from torquer.ground.telemetry.twin.readings import Readings
from torquer.scenario.spec import Scenario

#: Least length of a leg [s]; it is a whole number of cycles.
_LEG_S = 300.0
#: Errors of the links between legs, over those of readings, beyond what noise makes of them, in the
#: rounds in which the covariance follows the fit: the first is led by the readings of each leg.
_LOOSE = (30.0, 1.0, 0.0, 0.0)
#: Rounds of the fit in each, dampings that are tried in one, and the least gain.
_INNER, _DAMPINGS, _SMALL = 20, 10.0 ** np.arange(-14.0, 2.0), 1e-2
#: Angle [rad] by which noise may turn the satellite within a leg: its square is that of the errors.
_BEND = 0.05
#: Errors of readings by which a computer that starts afresh with a leg may change the flight.
_AFRESH = 0.1
#: Standard deviations at which errors are checked, and the least rise of the squares there that is
#: taken for one.
_FAR, _LEAST_RISE = 3.0, 0.1


class Course(NamedTuple):
    """Motions at the starts of k legs, with the physical parameters that all have; the biases that
    all rows share, over their standard deviations [6]."""

    starts: Points
    biases: np.ndarray


class Leg(NamedTuple):
    """Flights without and with noise, the rows of the leg, its length [s]."""

    quiet: Flights
    noisy: Flights
    readings: Readings
    duration_s: float

    def fly(self, points: Points) -> tuple[np.ndarray, States]:
        """What twins [n] have in the place of the readings [n, k], and their motions at the end."""
        t_s = np.append(self.readings.t_s, self.duration_s)
        states = self.quiet.fly(points, t_s)
        return self.readings.predicted(states), States(states.q[-1:], states.omega[-1:])


class Fit(NamedTuple):
    """A twin fitted in legs: squares of the readings' errors; covariance [p, p] of the motions at
    the starts, of what is free of the physical parameters, and of the biases; why that cannot be
    relied on, "" if it can."""

    course: Course
    chi2: float
    covariance: np.ndarray
    doubt: str


class Legs:
    """A session in legs.

    `readings`: the rows, seconds since `start_s`; `prior` [16], `free` [16]: as of
    `twin_fit.Problem`.
    """

    def __init__(
        self,
        scenario: Scenario,
        start_s: float,
        rate_rad_s: float,
        readings: Readings,
        prior: np.ndarray,
        free: np.ndarray,
    ):
        self.free, self.prior = free, prior[free][6:]
        self.end_s, cycle_s = float(readings.t_s[-1]), scenario.control.cycle_s
        length_s = cycle_s * math.ceil(_LEG_S / cycle_s)
        every = length_s * np.arange(max(1, math.floor(self.end_s / length_s)))
        with_rows = np.unique(np.searchsorted(every, readings.t_s, side="right") - 1)
        self.firsts = every[with_rows]
        self.legs: list[Leg] = []
        quiet: Flights | None = None
        for first, last in zip(self.firsts, [*self.firsts[1:], self.end_s], strict=True):
            span = (start_s + first, last - first, rate_rad_s)
            quiet = Flights(scenario, *span, like=quiet)
            noisy = Flights(scenario, *span, noisy=True, like=quiet)
            rows = (readings.t_s >= first) & (readings.t_s < last)
            rows |= (readings.t_s == self.end_s) & (last == self.end_s)
            own = readings.take(rows)
            self.legs.append(Leg(quiet, noisy, own._replace(t_s=own.t_s - first), last - first))

    def along(self, flights: Flights, points: Points) -> Course:
        """The course of one twin's flight through all legs without noise."""
        flown = flights.fly(points, self.firsts)
        physical = np.repeat(points.physical, len(self.firsts), axis=0)
        return Course(Points(flown.q[:, 0], flown.omega[:, 0], physical), np.zeros(6))

    def fit(self, flights: Flights, points: Points) -> Fit:
        """A twin fitted from one twin's flight through all legs without noise."""
        course = self.along(flights, points)
        afresh = self._off_at_ends(flights, points, course)
        for loose in _LOOSE:
            whiteners, angle = self._whiteners(course, loose)
            course = self._improved(course, whiteners)
        normal, _ = self._slopes(course, whiteners)
        chi2 = float(self._costs([course], whiteners)[1][0])
        doubt = ""
        if afresh > _AFRESH:
            doubt = "its law remembers earlier cycles, without which legs begin"
        elif angle > _BEND:
            doubt = f"noise in the loop turns it by {math.degrees(angle):.1f} deg in five minutes"
        return Fit(course, chi2, self._covariance(course, whiteners, normal), doubt)

    def _off_at_ends(self, flights: Flights, points: Points, course: Course) -> float:
        """How far legs, each by itself, end from the one flight, over the readings' errors."""
        flown = flights.fly(points, np.append(self.firsts[1:], self.end_s))
        gaps = []
        for k, leg in enumerate(self.legs):
            _, end = leg.fly(course.starts.take([k]))
            off = departures(end, States(flown.q[k : k + 1], flown.omega[k : k + 1]))[0, 0]
            gaps.append(float(np.abs(off / leg.readings.motion_sizes()).max()))
        return max(gaps)

    def predicted(self, course: Course) -> States:
        """Motions of the twin at all rows."""
        flown = [
            leg.quiet.fly(course.starts.take([k]), leg.readings.t_s)
            for k, leg in enumerate(self.legs)
        ]
        return States(*(np.concatenate(each) for each in zip(*flown, strict=True)))

    def _whiteners(self, course: Course, loose: float) -> tuple[list[np.ndarray], float]:
        """What makes each leg's misses independent and of size 1, and how far noise turns."""
        found, angles = [], []
        for k, leg in enumerate(self.legs):
            end_s = None if k + 1 == len(self.legs) else leg.duration_s
            moved = moved_by_noise(
                leg.quiet, leg.noisy, course.starts.take([k]), leg.readings, end_s, k
            )
            if not np.isfinite(moved.covariance).all():
                moved = Moved(np.zeros_like(moved.covariance), math.inf)
            angles.append(moved.angle)
            own = np.full(len(moved.covariance), loose**2)
            own[: np.sum(leg.readings.there)] = 1.0
            found.append(np.linalg.inv(triangular_root(moved.covariance + np.diag(own))))
        return found, max(angles)

    def _improved(self, course: Course, whiteners) -> Course:
        """A course after some rounds of Levenberg and Marquardt's method."""
        cost = self._costs([course], whiteners)[0][0]
        for _ in range(_INNER):
            normal, pull = self._slopes(course, whiteners)
            size = np.sqrt(np.diag(normal))
            even = normal / np.outer(size, size) + _DAMPINGS[:, None, None] * np.eye(len(size))
            steps = np.linalg.solve(even, (pull / size)[:, None])[..., 0] / size
            tried = [self._moved(course, step) for step in steps]
            costs = self._costs(tried, whiteners)[0]
            best = int(np.argmin(costs))
            gain = cost - costs[best]
            if not gain > 0.0:
                break
            course, cost = tried[best], costs[best]
            if gain < _SMALL:
                break
        return course

    def _moved(self, course: Course, step: np.ndarray) -> Course:
        count = len(self.legs)
        steps = np.zeros((count, 6 + COUNT))
        steps[:, :6] = step[: 6 * count].reshape(count, 6)
        steps[:, np.flatnonzero(self.free)[6:]] = step[6 * count : -6]
        return Course(course.starts.moved(steps), course.biases + step[-6:])

    def _misses(self, course: Course, k: int, numbers: np.ndarray, end: States) -> np.ndarray:
        """What a leg's flight misses of its readings, and of the start of the next."""
        readings = self.legs[k].readings
        missed = readings.measured() - numbers - readings.shared() @ course.biases
        if k + 1 == len(self.legs):
            return missed
        after = course.starts.take([k + 1])
        onward = departures(end, States(after.q[None], after.omega[None]))[0, 0]
        return np.append(missed, onward / readings.motion_sizes())

    def _costs(self, courses: list[Course], whiteners) -> tuple[np.ndarray, np.ndarray]:
        """Squares of errors and departures from what was known [n]; those of the errors alone."""
        total = np.array([each.biases @ each.biases for each in courses])
        for k, (leg, whiten) in enumerate(zip(self.legs, whiteners, strict=True)):
            numbers, ends = leg.fly(join_points([each.starts.take([k]) for each in courses]))
            for n, each in enumerate(courses):
                missed = whiten @ self._misses(each, k, numbers[n], ends.take([n]))
                total[n] += missed @ missed
        total = np.where(np.isfinite(total), total, np.inf)
        known = [each.starts.physical[0][self.free[6:]] / self.prior for each in courses]
        return total + np.sum(np.square(known), axis=1), total

    def _slopes(self, course: Course, whiteners) -> tuple[np.ndarray, np.ndarray]:
        """Information and pull of readings, links and what was known."""
        count, size = len(self.legs), int(self.free.sum())
        normal = np.zeros((6 * count + size,) * 2)
        pull = np.zeros(len(normal))
        shared_at = 6 * count + np.arange(size)
        free, steps = np.flatnonzero(self.free), STEPS[self.free]
        for k, (leg, whiten) in enumerate(zip(self.legs, whiteners, strict=True)):
            numbers, ends = leg.fly(around(course.starts.take([k]), free))
            own = ends.take(slice(0, 1))
            missed = whiten @ self._misses(course, k, numbers[0], own)
            slope = (numbers[1::2] - numbers[2::2]) / (2.0 * steps[:, None])
            slope = np.vstack([slope, leg.readings.shared().T])
            at = np.concatenate([6 * k + np.arange(6), shared_at])
            if k + 1 < count:
                sizes = leg.readings.motion_sizes()
                forth, back = ends.take(slice(1, None, 2)), ends.take(slice(2, None, 2))
                led = departures(back, forth)[0] / (2.0 * steps[:, None] * sizes)
                onward = np.hstack([np.zeros((6, slope.shape[1])), -np.diag(1.0 / sizes)])
                slope = np.hstack([slope, np.vstack([led, np.zeros((6, 6))])])
                slope = np.vstack([slope, onward])
                at = np.append(at, 6 * (k + 1) + np.arange(6))
            slope = np.nan_to_num(slope @ whiten.T)
            normal[np.ix_(at, at)] += slope @ slope.T
            pull[at] += slope @ missed
        known = np.concatenate([1.0 / self.prior**2, np.ones(6)])
        normal[np.ix_(shared_at, shared_at)] += np.diag(known)
        values = np.append(course.starts.physical[0][self.free[6:]], course.biases)
        pull[shared_at] -= known * values
        return normal, pull

    def _covariance(self, course: Course, whiteners, normal: np.ndarray) -> np.ndarray:
        """Covariance of all parameters.

        Commands that begin to saturate make kinks, near which the slope says little of what lies
        beyond: where the readings fit a twin that is three standard deviations away better than
        the slope has it, these are larger.
        """
        size = np.sqrt(np.diag(normal))
        found = np.linalg.inv(normal / np.outer(size, size)) / np.outer(size, size)
        places = 6 * len(self.legs) + np.arange(len(self.prior))
        axes = _FAR * found[places] / np.sqrt(found[places, places])[:, None]
        far = [self._moved(course, step) for step in np.concatenate([axes, -axes])]
        cost, *costs = self._costs([course, *far], whiteners)[0]
        rise = np.min(np.reshape(costs, (2, -1)), axis=0) - cost
        wider = np.ones(len(found))
        wider[places] = _FAR / np.sqrt(np.clip(rise, _LEAST_RISE, _FAR**2))
        return found * np.outer(wider, wider)
