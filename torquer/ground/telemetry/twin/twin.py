"""The twin of a satellite: its tip-off simulated alongside the telemetry, parameters fitted to it.

Attitude and rate at the start, inertia, gain of the law and residual dipole are fitted to the
readings of magnetometer and gyro. The motion depends so much on its start that a fit to a whole
session ends in a wrong valley: the window grows from the first minute. At the end the twin is
fitted in legs, from which the errors follow (`twin_legs`).

Coils that never saturate make a torque in proportion to the gain: inertia and gain times the same
factor then move alike, and their ratio is all that can be known.
"""

from __future__ import annotations

import math
from datetime import timedelta
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.special import chdtri

from torquer.ground.telemetry.twin.fit import Fits, Problem, guesses, moved_by_noise
from torquer.ground.telemetry.twin.flights import (
    COUNT,
    INERTIA,
    OF_DIPOLE,
    OF_GAIN,
    OF_MOMENTS,
    Flights,
    Points,
    States,
    change_scenario,
    gain_key,
    twin_dipole,
    twin_gain,
    twin_inertia,
)
from torquer.ground.telemetry.twin.legs import Legs
from torquer.ground.telemetry.twin.members import GAIN, SCALE, Twin, member_tables
from torquer.ground.telemetry.twin.readings import Readings, first_end, select_readings
from torquer.ground.telemetry.undetermined import say_direction
from torquer.maths.geometry.attitudes import rotation_vector, to_body
from torquer.scenario.change import with_values
from torquer.scenario.spec import Scenario
from torquer.simulation.setup.simulate import simulate

#: By what the first window grows, and the growth at which it stops.
_GROWTH, _LEAST_GROWTH = 1.6, 1.1
#: What is known beforehand, besides `SCALE` of the logarithms of moments of inertia and `GAIN` of
#: that of gain over inertia: standard deviations of the mixed elements of the inertia's logarithm
#: and of the residual dipole over the coils' limit.
_MIXED, _DIPOLE = 0.05, 0.1
#: Chance with which a good fit misses more than is taken for one, and than lets the window grow on
#: as fast; how much worse than noise a model may be.
_CHANCE, _USUAL, _SLACK = 1e-3, 1e-2, 1.15
#: Part of what was known beforehand above which the telemetry says nothing.
_NOTHING = 0.5
#: Part of the commands at a limit above which the few others say nothing of the gain that noise in
#: the loop does not hide.
_MOST_SATURATED = 0.9
#: Part of the session that a twin must follow.
_LEAST_PART = 0.5
#: Twins that are grown at most, and what they may miss at first.
_TRIED, _HOPELESS = 4, 5.0
#: Changes of the logarithm of all moments that are tried where a twin does not follow.
_SCALES = np.array([-0.3, -0.15, 0.15, 0.3])
#: Distance of guesses, and of twins that are not the same.
_APART, _SAME = 0.25, 0.01
#: Guesses that are fitted with all parameters free; rounds of rough fits
#: and of the others.
_GUESSES, _FIRST_ROUNDS, _ROUNDS = 12, 12, 30


def fit_twin(
    data: xr.Dataset,
    scenario: Scenario,
    sigma_b: float,
    bias_b: float = 0.0,
    shift_s: float = 0.0,
) -> Twin:
    """The twin of a session with `b_measured`, calibrated, and `omega_measured`.

    `scenario`: the satellite as it is believed to be, on its orbit; a control cycle begins at its
    `start`, at or before the first row. `sigma_b` [T]: noise of the magnetometer; `bias_b` [T]:
    standard deviation of the bias that is left. `shift_s`: of the stamps. ValueError for telemetry
    without a gyro, and for a scenario that cannot be a twin.
    """
    readings, start_s = select_readings(data, scenario, sigma_b, bias_b, shift_s)
    return _Search(scenario, start_s, readings).twin()


class _Step(NamedTuple):
    """A twin fitted to a window, and what it was fitted with."""

    fits: Fits
    problem: Problem
    window_s: float

    @property
    def freedoms(self) -> int:
        """Numbers fitted less those found; of a short window the latter are known beforehand."""
        count = len(self.problem.root)
        return max(count - len(self.problem.free), count // 4)

    def excess(self, chance: float) -> float:
        """Squares of what the first twin misses, over those that errors exceed by this chance."""
        return float(self.fits.chi2[0] / chdtri(self.freedoms, chance))


class _Search:
    """Windows that grow over the readings of a session."""

    def __init__(self, scenario: Scenario, start_s: float, readings: Readings):
        self.scenario, self.start_s, self.readings = scenario, start_s, readings
        coils = scenario.spacecraft.coils
        self.limit = float(np.min(coils.limits_a_m2())) if coils else 0.0
        self.rate = 1.2 * float(np.nanmax(np.linalg.norm(readings.omega, axis=1)))
        self.end_s = float(readings.t_s[-1])
        self.free = np.full(6 + COUNT, True)
        self.free[6 + OF_GAIN] = gain_key(scenario) is not None
        self.free[6:][OF_DIPOLE] = coils is not None
        dipole = 3 * [_DIPOLE * self.limit]
        self.prior = np.array(6 * [np.inf] + 3 * [SCALE] + 3 * [_MIXED] + [GAIN] + dipole)

    def twin(self) -> Twin:
        """The twin that follows the telemetry for longest."""
        best: _Step | None = None
        first = self._first()
        for k in _distinct(first.fits, _SAME)[:_TRIED]:
            own = first._replace(fits=first.fits.take([k]))
            if own.excess(_CHANCE) > _HOPELESS:
                break
            found = self._grown(own)
            if found is not None and (best is None or found.window_s > best.window_s):
                best = found
            if best is not None and best.window_s >= _LEAST_PART * self.end_s:
                return self._found(best)
        return self._none(best)

    def _flights(self, window_s: float, noisy: bool = False) -> Flights:
        return Flights(self.scenario, self.start_s, window_s, self.rate, noisy)

    def _first(self) -> _Step:
        """The best guesses, fitted to the first window with all parameters free."""
        window_s = first_end(self.readings)
        readings, flights = self.readings.until(window_s), self._flights(window_s)
        covariance = readings.noise()
        start = np.arange(6 + COUNT) < 6
        rough = Problem(flights, readings, self.prior, start, 25.0 * covariance)
        fits = rough.fit(guesses(flights.scenario, readings), 6)
        chosen = _distinct(fits, _APART)[:_GUESSES]
        problem = Problem(flights, readings, self.prior, self.free, covariance)
        return _Step(problem.fit(fits.points.take(chosen), _FIRST_ROUNDS), problem, window_s)

    def _grown(self, first: _Step) -> _Step | None:
        """A twin's last window that it follows; None if there is none after the first."""
        step, growth = first, _GROWTH
        while step.window_s < self.end_s:
            tried, growth = self._next(step, growth)
            if tried is None:
                break
            step, growth = tried, min(growth**1.5, _GROWTH)
        return None if step is first else step

    def _next(self, step: _Step, growth: float) -> tuple[_Step | None, float]:
        """A twin in a longer window, and the growth that led there.

        Where it misses more than one in a hundred would, it may be about to enter a wrong valley:
        smaller steps are tried before what one in a thousand would miss is taken.
        """
        bearable: _Step | None = None
        while growth > _LEAST_GROWTH:
            window_s = min(growth * step.window_s, self.end_s)
            tried = self._fitted(step.fits.points, window_s)
            if tried.excess(_USUAL) >= 1.0:
                others = self._fitted(_rescale(step.fits.points), window_s, _FIRST_ROUNDS)
                tried = min(tried, others, key=lambda each: each.excess(_USUAL))
            if tried.excess(_USUAL) < 1.0:
                return tried, growth
            if tried.excess(_CHANCE) < _SLACK and (
                bearable is None or tried.excess(_USUAL) < bearable.excess(_USUAL)
            ):
                bearable = tried
            growth = math.sqrt(growth)
        return bearable, _GROWTH

    def _fitted(self, points: Points, window_s: float, rounds: int = _ROUNDS) -> _Step:
        """The best of some twins fitted to a window."""
        readings, flights = self.readings.until(window_s), self._flights(window_s)
        covariance, noisy = readings.noise(), self._flights(window_s, True)
        moved = moved_by_noise(flights, noisy, points.take([0]), readings).covariance
        if not np.isfinite(moved).all():
            problem = Problem(flights, readings, self.prior, self.free, covariance)
            failed = Fits(points.take([0]), np.array([np.inf]))
            return _Step(failed, problem, window_s)
        problem = Problem(flights, readings, self.prior, self.free, covariance + moved)
        fits = problem.fit(points, rounds)
        return _Step(fits.take([np.argmin(fits.chi2)]), problem, window_s)

    def _found(self, step: _Step) -> Twin:
        """What a fitted twin says."""
        readings = step.problem.readings
        legs = Legs(self.scenario, self.start_s, self.rate, readings, self.prior, self.free)
        fit = legs.fit(step.problem.flights, step.fits.points)
        points = fit.course.starts.take([0])
        place = np.flatnonzero(self.free[6:])
        # motion at the start of the last leg, and what all legs share
        last = fit.covariance[-12 - len(place) : -6, -12 - len(place) : -6]
        inner = last[6:, 6:]
        undetermined, scale = _unknown_directions(inner, self.prior[6:][place], place)
        found = self._as_found(points)
        onward = self._as_found(fit.course.starts.take([-1]), legs.firsts[-1])
        saturated = _saturation(found, step.window_s)
        only_ratio = OF_GAIN in place and (scale or saturated == 0.0)
        shows_gain = OF_GAIN in place and not only_ratio and saturated < _MOST_SATURATED
        names, values, slopes = self._values(points.physical[0], place, only_ratio, shows_gain)
        doubt = fit.doubt
        if fit.chi2 > _SLACK * chdtri(step.freedoms, _CHANCE):
            doubt = f"squares of {fit.chi2:.0f} where {step.freedoms} are expected"
        return Twin(
            names, values, slopes @ inner @ slopes.T, only_ratio, saturated,
            fit.chi2, step.freedoms, step.window_s, self.end_s, undetermined, doubt,
            _side_by_side(readings, legs.predicted(fit.course)), found,
            onward, member_tables(onward, names, slopes, last, only_ratio),
        )  # fmt: skip

    def _as_found(self, points: Points, after_s: float = 0.0) -> Scenario:
        """The scenario of a twin, from its motion some seconds after the flights' start."""
        rate_deg_s = np.degrees(points.omega[0]).tolist()
        return with_values(change_scenario(self.scenario, points.physical[0]), {
            "start": self.scenario.start + timedelta(seconds=self.start_s + after_s),
            "initial": {"quaternion": points.q[0].tolist(), "rate_deg_s": rate_deg_s},
        })  # fmt: skip

    def _none(self, best: _Step | None) -> Twin:
        """What is said where no twin follows the telemetry."""
        window_s = 0.0 if best is None else best.window_s
        chi2, freedoms = (0.0, 0) if best is None else (float(best.fits.chi2[0]), best.freedoms)
        return Twin((), np.zeros(0), np.zeros((0, 0)), False, 0.0, chi2, freedoms, window_s,
                    self.end_s, (), "", None, None)  # fmt: skip

    def _values(self, physical, place, only_ratio: bool, shows_gain: bool):
        """Names of what is known, values, and derivatives by the physical parameters."""

        def values(given):
            inertia = twin_inertia(self.scenario, given)
            gain = twin_gain(self.scenario, given)
            parts = [inertia[np.triu_indices(3)][[0, 3, 5, 1, 2, 4]]]
            if shows_gain:
                parts.append(np.array([gain]))
            if self.limit:
                parts.append(twin_dipole(self.scenario, given))
            return np.concatenate(parts) / (gain if only_ratio else 1.0)

        names = [f"inertia_{each}" for each in INERTIA]
        names += ["gain"] if shows_gain else []
        names += [f"dipole_{each}" for each in "xyz"] if self.limit else []
        if only_ratio:
            names = [f"{name}/gain" for name in names]
        steps = 1e-5 * np.eye(COUNT)[place]
        slopes = [(values(physical + step) - values(physical - step)) / 2e-5 for step in steps]
        return tuple(names), values(physical), np.stack(slopes, axis=1)


def _rescale(points: Points) -> Points:
    """A twin with other inertia and the same ratios of moments and gain.

    As long as its coils do not saturate this changes nothing, and no slope leads to the twin whose
    coils do.
    """
    physical = np.repeat(points.physical, len(_SCALES), axis=0)
    physical[:, OF_MOMENTS] += _SCALES[:, None]
    return points.take(np.zeros(len(_SCALES), int))._replace(physical=physical)


def _distinct(fits: Fits, apart: float) -> list[int]:
    """Twins from the best on, without those near to a better one: attitudes [rad] and logarithms of
    ratios of moments together."""
    chosen: list[int] = []
    for k in np.argsort(fits.chi2):
        others = fits.points.take(chosen)
        turn = rotation_vector(np.tile(fits.points.q[k], (len(chosen), 1)), others.q)
        change = others.physical[:, OF_MOMENTS] - fits.points.physical[k, OF_MOMENTS]
        change -= change.mean(axis=1, keepdims=True)
        if np.isfinite(fits.chi2[k]) and np.all(np.sum(turn**2 + change**2, axis=1) > apart**2):
            chosen.append(int(k))
    return chosen


def _unknown_directions(covariance, prior, place) -> tuple[tuple[str, ...], bool]:
    """Directions, in words, of which the telemetry says nothing; whether inertia and gain times the
    same factor are among them."""
    names = [
        *(f"inertia_{each}" for each in INERTIA),
        "gain/inertia",
        *(f"dipole_{c}" for c in "xyz"),
    ]
    together = np.isin(place, [0, 1, 2]) / np.sqrt(3.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(prior, prior))
    unknown = np.sqrt(np.maximum(values, 0.0)) > _NOTHING
    fitted = [names[k] for k in place]
    found = tuple(say_direction(vector, fitted) for vector in vectors.T[unknown])
    hidden = float(np.linalg.norm(vectors.T[unknown] @ together))
    return found, hidden > _NOTHING


def _saturation(scenario: Scenario, window_s: float) -> float:
    """Part of the commands of a flight at the limit of a coil."""
    coils = scenario.spacecraft.coils
    if coils is None:
        return 0.0
    timing = {"duration_s": window_s, "record_s": scenario.control.sample_s}
    flown = simulate(with_values(scenario, {"simulation": timing, "mission": None}))
    dipole = flown["dipole_body"].values - coils.residual_dipole_a_m2
    shares = np.abs(dipole @ np.linalg.pinv(np.array(coils.axes))) / coils.limits_a_m2()
    greatest = shares.max(axis=1)
    on = greatest > 1e-9
    return float(np.mean(greatest[on] > 1.0 - 1e-6)) if on.any() else 0.0


def _side_by_side(readings: Readings, states: States) -> xr.Dataset:
    """Readings and the twin's field, rate and Sun at the rows that were fitted."""
    b = to_body(states.q[:, 0], readings.b_j)
    pairs = {
        "b_measured": (readings.b, "T"), "omega_measured": (readings.omega, "rad/s"),
        "b_body": (b, "T"), "omega_body": (states.omega[:, 0], "rad/s"),
    }  # fmt: skip
    if readings.sun is not None:
        pairs["sun_measured"] = (readings.sun.seen, "1")
        pairs["sun_body"] = (to_body(states.q[:, 0], readings.sun.to_sun_j), "1")
    variables = {
        name: (("time", "axis"), values, {"units": unit, "frame": "body"})
        for name, (values, unit) in pairs.items()
    }
    seconds = ("time", readings.t_s, {"units": "s", "long_name": "time since the twin's start"})
    return xr.Dataset(variables, {"time": seconds, "axis": list("xyz")})
