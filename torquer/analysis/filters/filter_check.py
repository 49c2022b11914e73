"""A scenario's filter checked: the statistics (`filter_statistics`) of many flights of it."""

import math
import os
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from torquer.analysis.citations import cited_in_words
from torquer.analysis.filters.filter_flights import control_rows, finest_record_s, fly_filter
from torquer.analysis.filters.filter_members import Drawn, Start, make_members, what_runs_draw
from torquer.analysis.filters.filter_statistics import (
    FilterRuns,
    autocorrelation,
    consistency,
    nees,
    nis,
)
from torquer.analysis.filters.filter_verdict import (
    OF_ERRORS,
    REJECTED,
    Check,
    Verdict,
    judge_filter,
)
from torquer.analysis.filters.linear_covariance import (
    Expected,
    Motion,
    expected_accuracy,
    kalman_filter,
)
from torquer.base.limits import at_least
from torquer.scenario.spec import Scenario
from torquer.simulation.setup.simulate import flown_by

#: Number of runs that are flown with a record at every control step, for their innovations.
_CLOSELY = 4
#: Arrays of `FilterRuns` over runs and instants.
_OVER_RUNS = ("errors", "covariance", "rejected", "starts", "why_not_started")
#: Share of the instants at which the mean over the runs must be in its band: elsewhere errors that
#: are too large at times and too small at others would make up for each other.
_LEAST_INSIDE = 0.5


class FilterCheck(NamedTuple):
    """A filter evaluated over many runs.

    `drawn`: what each run draws; `flown`: at about 200 instants; `closely`: the first few runs at
    every control step, with the accuracy `expected` by linear covariance along their motions.
    """

    scenario: Scenario
    runs: int
    drawn: list[Drawn]
    checks: list[Check]
    flown: FilterRuns
    closely: FilterRuns
    expected: Expected

    @property
    def verdict(self) -> Verdict:
        """What the statistics mean."""
        return judge_filter(kalman_filter(self.scenario), self.flown, self.checks)

    @property
    def consistent(self) -> bool:
        """Whether the filter knows the attitude as well as it states, in every run."""
        return self.verdict.word == "consistent"


def check_filter(
    scenario: Scenario,
    runs: int = 200,
    progress: Callable[[float], None] | None = None,
    start: Start = Start(),  # noqa: B008  a tuple
    computer: str | os.PathLike | None = None,
) -> FilterCheck:
    """Statistics of a scenario's filter over runs.

    Each run draws noise, initial attitude and rate (see `Start`), and the errors of the sensors
    (`torquer.analysis.filters.filter_members.what_runs_draw`).

    Checks errors (NEES) of the attitude and of all states, and innovations (NIS) of each sensor,
    per degree of freedom: mean over runs and instants, its 95 % band at one instant, share of the
    instants inside it; and the correlation of innovations one reading apart, against five sigma
    of white noise (but not where errors are only considered: then innovations are correlated as
    these errors are). A mean inside its band does not pass if that is so at less than half of the
    instants. Readings rejected in a run: no more than by chance and five sigma. `progress` is
    called with the fraction done, 0..1. `computer`: as of `torquer.simulate`, in all runs.
    """
    at_least(2).check("runs", runs)
    library = flown_by(computer, scenario).library if computer is not None else None
    done, few = 0, min(runs, _CLOSELY)

    def one_more() -> None:
        nonlocal done
        done += 1
        if progress:
            progress(done / runs)

    every = scenario.replace("simulation.record_s", finest_record_s(scenario))
    closely = fly_filter(make_members(every, few, start), one_more, library)
    coarse = scenario.replace(*_record(scenario))
    others = [*make_members(coarse, runs, start)][few:]
    flown = _at(closely, control_rows(coarse) * coarse.simulation.record_s)
    if others:
        flown = _together(flown, fly_filter(others, one_more, library))
    checks = [*_check_errors(flown)]
    if not kalman_filter(scenario).considered_states:
        checks += _check_whiteness(closely)
    if flown.started.any():
        checks.append(_check_rejected(flown, rejected_by_chance(scenario, closely)))
    drawn, expected = what_runs_draw(scenario, start), _expect(scenario, closely.motions)
    return FilterCheck(scenario, runs, drawn, checks, flown, closely, expected)


def _at(runs: FilterRuns, t_s: np.ndarray) -> FilterRuns:
    """These runs at some of their instants."""
    rows = np.searchsorted(runs.t_s, t_s - 1e-6)
    motions = [Motion(*(part[rows] for part in motion)) for motion in runs.motions]
    return runs._replace(
        t_s=runs.t_s[rows],
        innovations={sensor: each[:, rows] for sensor, each in runs.innovations.items()},
        motions=motions,
        **{name: getattr(runs, name)[:, rows] for name in _OVER_RUNS},
    )


def _together(some: FilterRuns, others: FilterRuns) -> FilterRuns:
    """Runs at the same instants, as one."""
    both = some.innovations, others.innovations
    over_runs: dict[str, Any] = {
        key: np.concatenate([getattr(some, key), getattr(others, key)]) for key in _OVER_RUNS
    }
    return some._replace(
        innovations={key: np.concatenate([each[key] for each in both]) for key in both[0]},
        motions=some.motions + others.motions,
        steps=some.steps or others.steps,
        **over_runs,
    )


def _expect(scenario: Scenario, motions: list[Motion]) -> Expected:
    """Expected accuracy along several motions: mean covariance, and whether most see the Sun."""
    each = [expected_accuracy(scenario, motion) for motion in motions]
    covariance = np.mean([one.covariance for one in each], axis=0)
    seen = np.mean([one.sun_seen for one in each], axis=0) > 0.5
    return Expected(each[0].t_s, covariance, seen)


def _check_errors(flown: FilterRuns) -> Iterator[Check]:
    if not flown.started.any():
        return
    for name, states in zip(OF_ERRORS, (3, flown.errors.shape[-1]), strict=True):
        if np.isfinite(nees(flown, states)).any():
            yield _check(name, nees(flown, states), states)
    for sensor, innovations in flown.innovations.items():
        if np.isfinite(innovations).any():
            yield _check(f"NIS of the {sensor.replace('_', ' ')}", *nis(innovations))


def _check_whiteness(closely: FilterRuns) -> Iterator[Check]:
    for sensor, innovations in closely.innovations.items():
        value, sigma = autocorrelation(innovations)
        if math.isfinite(value):
            passed = abs(value) < 5.0 * sigma
            name = f"correlation of the {sensor.replace('_', ' ')}"
            yield Check(name, value, -5.0 * sigma, 5.0 * sigma, math.nan, passed)


def rejected_by_chance(scenario: Scenario, closely: FilterRuns) -> float:
    """Number of readings in a run that a sound filter rejects by its gate."""
    readings = sum(np.isfinite(each[..., 0]).sum() for each in closely.innovations.values())
    return float(kalman_filter(scenario).gate * readings / len(closely.errors))


def _check_rejected(flown: FilterRuns, by_chance: float) -> Check:
    runs, rejected = len(flown.errors), float(flown.rejected[:, -1].mean())
    most = by_chance + 5.0 * (math.sqrt(by_chance * runs) + 1.0) / runs  # few are not normal
    return Check(REJECTED, rejected, 0.0, most, math.nan, rejected <= most)


def as_plain(found: FilterCheck) -> dict:
    """A check as plain data.

    `not_flown`: what of the scenario no run has, as each draws its own. `rejected_mean`,
    `rejected_most`: readings rejected in a run; `rejected_by_chance`: as many as a sound filter
    rejects by its `gate`. `restarted_runs`, `restarts_most`: runs in which the filter started
    again, and how often at most.

    Attitude errors about each axis without the first tenth of the time: `error_deg`, root mean
    square over the runs; `sigma_deg`: as the filter stated; `expected_deg`: by linear covariance.
    `error_95_deg`: 95th percentile of the total error. NaN if the filter never started.
    """
    flown, (word, text) = found.flown, found.verdict
    restarts = np.maximum(flown.starts[:, -1] - 1.0, 0.0)
    return {
        "scenario": found.scenario.name,
        "estimator": found.scenario.control.estimator.kind,
        "runs": found.runs,
        "drawn": {each.name: {"sigma": each.sigma, "unit": each.unit} for each in found.drawn},
        "not_flown": [each.replaced_in_words for each in found.drawn if each.replaced_in_words],
        "checks": [check._asdict() for check in found.checks],
        "verdict": word,
        "verdict_text": text,
        "notes": [*flown.steps],
        "consistent": found.consistent,
        "runs_never_started": int(np.count_nonzero(~flown.started)),
        "rejected_mean": float(flown.rejected[:, -1].mean()),
        "rejected_most": int(flown.rejected[:, -1].max()),
        "rejected_by_chance": rejected_by_chance(found.scenario, found.closely),
        "restarted_runs": int(np.count_nonzero(restarts)),
        "restarts_most": int(restarts.max()),
        "cite": cited_in_words(found.scenario),
        **_accuracy(flown, found.expected),
    }


def drawn_in_words(found: FilterCheck) -> str:
    """What each run draws."""
    return ", ".join(["noise", *(each.in_words for each in found.drawn)])


def replaced_in_words(found: FilterCheck) -> str:
    """What of the scenario no run flies, as each draws its own about zero; "" for nothing."""
    return "; ".join(filter(None, (each.replaced_in_words for each in found.drawn)))


def rejected_in_words(plain: dict) -> str:
    """Readings rejected, of a check as plain data."""
    return (
        f"{plain['rejected_mean']:.3g} in a run, at most {plain['rejected_most']} "
        f"({plain['rejected_by_chance']:.2g} by chance)"
    )


def restarts_in_words(plain: dict) -> str:
    """Restarts of the filter, of a check as plain data."""
    if not plain["restarted_runs"]:
        return "none"
    return f"in {plain['restarted_runs']} of {plain['runs']} runs, at most {plain['restarts_most']}"


def _accuracy(flown: FilterRuns, expected: Expected) -> dict[str, float]:
    """Errors of the attitude, as stated and as expected, for `as_plain`."""
    keys = ("error_deg", "error_95_deg", "sigma_deg", "expected_deg")
    if not flown.started.any():
        return dict.fromkeys(keys, math.nan)
    later = flown.t_s >= 0.1 * flown.t_s[-1]
    error = np.degrees(np.linalg.norm(flown.errors[:, later, :3], axis=2))
    sigma = np.einsum("rkii->rk", flown.covariance[:, later, :3, :3]) / 3.0
    linear = np.interp(flown.t_s[later], expected.t_s, expected.attitude_sigma_rad**2)
    values = (
        np.sqrt(np.nanmean(error**2) / 3.0), np.nanquantile(error, 0.95),
        np.degrees(np.sqrt(np.nanmean(sigma))), np.degrees(np.sqrt(np.mean(linear))),
    )  # fmt: skip
    return dict(zip(keys, map(float, values), strict=True))


def _record(scenario: Scenario) -> tuple[str, float]:
    """Record interval for about 200 instants of a run: whole control cycles."""
    cycle_s = scenario.control.cycle_s
    length_s = scenario.length_s
    return "simulation.record_s", cycle_s * max(round(length_s / cycle_s / 200.0), 1)


def _check(name: str, values: np.ndarray, freedoms: int) -> Check:
    found = consistency(values, freedoms)
    passed = found.consistent and found.inside >= _LEAST_INSIDE
    return Check(name, found.overall, found.low, found.high, found.inside, passed)
