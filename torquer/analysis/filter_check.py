"""Runs of a scenario's filter, and their statistics (`torquer.analysis.filter_statistics`)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from torquer.analysis.control_cycle import control_times
from torquer.analysis.filter_statistics import (
    FilterRuns,
    autocorrelation,
    consistency,
    nees,
    nis,
)
from torquer.analysis.linear_covariance import (
    Expected,
    Motion,
    expected_accuracy,
    kalman_filter,
)
from torquer.scenario.control import common_divisor, whole_steps
from torquer.scenario.spec import Scenario
from torquer.simulation.gyro_drift import fill_drift
from torquer.simulation.prepare import log_of
from torquer.simulation.run import Run, prepare
from torquer.spacecraft.gyro import GyroSet
from torquer.spacecraft.rotors import axis_of

_ESTIMATOR = "control.estimator"
#: Number of runs that are flown with a record at every control step, for their innovations.
_CLOSELY = 4


def members_of(scenario: Scenario, runs: int) -> Iterator[Scenario]:
    """The scenario with other random numbers in each run, and other biases where they are states.

    The biases are drawn from the filter's initial covariance. ValueError for an estimator other
    than a Kalman filter.
    """
    spec = kalman_filter(scenario)
    scenario = scenario.replace(f"{_ESTIMATOR}.record_covariance", True)
    drawn = {
        "spacecraft.gyro.bias_deg_s": getattr(spec, "gyro_bias_sigma_deg_s", None),
        "spacecraft.magnetometer.bias_nt": getattr(spec, "magnetometer_bias_sigma_nt", None),
        "spacecraft.coils.residual_dipole_a_m2": getattr(spec, "dipole_sigma_a_m2", None),
    }
    for number in range(runs):
        rng = np.random.default_rng([scenario.seed, number])
        member = scenario.replace("seed", int(rng.integers(2**62)))
        for key, sigma in drawn.items():
            if sigma is not None:
                member = member.replace(key, [float(x) for x in sigma * rng.normal(size=3)])
        yield member


def fly_filter(members: Iterable[Scenario], flown: Callable[[], None] | None = None) -> FilterRuns:
    """Fly runs with a filter on one orbit; its estimates and the truth.

    At the records that fall on control steps: ValueError if not all do (`simulation.record_s` must
    be a multiple of the control cycle), unless there are some at every control step. `flown` is
    called after each run.
    """
    piece, found, motion = None, [], None
    for member in members:
        run = prepare(member, piece=piece)
        piece = piece or run.piece
        rows = control_rows(member)
        parts = _recorded(run)
        motion = motion or _motion(run, parts, rows)
        found.append([part[rows] for part in _flown(run, parts)])
        if flown:
            flown()
    errors, covariance, field, sun = (np.stack(part) for part in zip(*found, strict=True))
    assert motion is not None
    return FilterRuns(motion.t_s, errors, covariance, {"magnetometer": field, "sun": sun}, motion)


def control_rows(scenario: Scenario) -> np.ndarray:
    """Numbers of the records to evaluate: those on control steps; see `fly_filter`."""
    control, record_s = scenario.control, scenario.simulation.record_s
    count = math.ceil(scenario.steps() * scenario.grid_s / record_s - 1e-9)
    if record_s == finest_record_s(scenario):
        rows = np.round(control_times(scenario) / record_s).astype(int)
        return rows[rows < count]
    cycle = "control.sample_s" if control.measure_s == 0.0 else "the control cycle"
    whole_steps("simulation.record_s", record_s, control.cycle_s, cycle)
    return np.arange(count)


def finest_record_s(scenario: Scenario) -> float:
    """Record interval that has every control step among its records."""
    control = scenario.control
    if control.measure_s == 0.0:
        return control.sample_s
    assert control.actuate_s is not None
    return common_divisor({"sample_s": control.sample_s, "actuate_s": control.actuate_s})


class Recorded(NamedTuple):
    """The record of a run: rows, wheels, log, what is known; see `Record`."""

    rows: np.ndarray
    wheels: np.ndarray
    log: np.ndarray
    known: np.ndarray


def _recorded(run: Run) -> Recorded:
    parts: list = []
    run.keep = lambda run: parts.append(run.rows())
    run.advance_to(run.steps)
    parts.append(run.rows())
    return Recorded(
        *(np.concatenate([getattr(part, name) for part in parts]) for name in Recorded._fields)
    )


def _motion(run: Run, recorded: Recorded, at: np.ndarray) -> Motion:
    """The motion that was flown."""
    rows, rotors = recorded.rows[at], run.plan.plant.rotors
    count = len(rotors.rows)
    axes = np.reshape([axis_of(rotors.rows, k) for k in range(count)], (count, 3))
    momentum = recorded.wheels[at, :count] @ axes
    q = np.stack([rows[f"q_{c}"] for c in "xyzw"], axis=1)
    omega = np.stack([rows[f"omega_{c}"] for c in "xyz"], axis=1)
    return Motion(run.scenario.simulation.record_s * at, q, omega, momentum)


def _flown(run: Run, recorded: Recorded) -> tuple[np.ndarray, ...]:
    """Errors, covariance and innovations of a run."""
    rows, _, log, known = recorded
    logged = _logged(run, log)
    n = math.isqrt(logged["covariance"].shape[1])
    own = np.stack([known[f"estimate_q_{c}"] for c in "xyzw"], axis=1)
    true = np.stack([rows[f"q_{c}"] for c in "xyzw"], axis=1)
    turn, started = np.full((len(rows), 3), np.nan), np.isfinite(own[:, 0])
    between = Rotation.from_quat(own[started]).inv() * Rotation.from_quat(true[started])
    turn[started] = between.as_rotvec()
    truth = _truth(run, rows)
    _, *states = kalman_filter(run.scenario).initial_variances()
    others = [truth[name] for name in states]
    errors = np.hstack([turn, np.hstack(others) - logged["states"]])
    covariance = logged["covariance"].reshape(-1, n, n)
    errors[~started], covariance[~started] = np.nan, np.nan
    return errors, covariance, logged["innovation_magnetometer"], logged["innovation_sun"]


def _logged(run: Run, log: np.ndarray) -> dict[str, np.ndarray]:
    """What the estimator logged, by name."""
    found, first = {}, 0
    for name, _, _, cells in log_of(run.blocks):
        if name.startswith("estimator."):
            found[name.removeprefix("estimator.")] = log[:, first : first + len(cells)]
        first += len(cells)
    return found


def _truth(run: Run, rows: np.ndarray) -> dict[str, np.ndarray]:
    """True values (samples, 3) of the states that a filter has."""
    scenario, plant = run.scenario, run.plan.plant
    spec, count = scenario.control.estimator, len(rows)
    t_s = scenario.simulation.record_s * np.arange(count)
    read_s = control_times(scenario)
    if own_s := scenario.spacecraft.gyro.sample_s:
        read_s = np.arange(0.0, t_s[-1] + own_s, own_s)
    truth = {
        "gyro_bias": _drifted(plant.gyro, scenario.seed, read_s, t_s),
        "rate": np.stack([rows[f"omega_{c}"] for c in "xyz"], axis=1),
    }
    if getattr(spec, "dipole_sigma_a_m2", None):
        truth["residual_dipole"] = np.tile(plant.coils.residual_a_m2, (count, 1))
    if spec.magnetometer_bias_sigma_nt:
        truth["magnetometer_bias"] = np.tile(plant.magnetometer.bias_t, (count, 1))
    return truth


def _drifted(gyro: GyroSet, seed: int, read_s: np.ndarray, t_s: np.ndarray) -> np.ndarray:
    """The gyro's bias (samples, 3) at its latest reading of those at times `read_s`."""
    latest = np.searchsorted(read_s, t_s * (1.0 + 1e-12) + 1e-9, side="right") - 1
    out = np.zeros((len(read_s), 3))
    fill_drift(gyro, seed, read_s, out)
    return out[latest] + np.array(gyro.bias_rad_s)


class Check(NamedTuple):
    """A statistic of a filter, and whether it is that of a consistent filter."""

    name: str
    value: float
    low: float
    high: float
    inside: float
    passed: bool


class FilterCheck(NamedTuple):
    """A filter evaluated over many runs.

    `flown`: at about 200 instants; `closely`: a few runs at every control step, with the accuracy
    `expected` by linear covariance along the first one's motion.
    """

    scenario: Scenario
    runs: int
    checks: list[Check]
    flown: FilterRuns
    closely: FilterRuns
    expected: Expected

    @property
    def consistent(self) -> bool:
        """Whether all statistics are those of a consistent filter."""
        return all(check.passed for check in self.checks)


def check_filter(
    scenario: Scenario, runs: int = 200, progress: Callable[[float], None] | None = None
) -> FilterCheck:
    """Statistics of a scenario's filter over runs.

    Checks errors (NEES) of the attitude and of all states, and innovations (NIS) of each sensor,
    per degree of freedom: mean over runs and instants, its 95 % band at one instant, share of the
    instants inside it; and the correlation of innovations one reading apart, against five sigma
    of white noise. `progress` is called with the fraction done, 0..1.
    """
    done, total = 0, runs + min(runs, _CLOSELY)

    def one_more() -> None:
        nonlocal done
        done += 1
        if progress:
            progress(done / total)

    flown = fly_filter(members_of(scenario.replace(*_record(scenario)), runs), one_more)
    every = scenario.replace("simulation.record_s", finest_record_s(scenario))
    closely = fly_filter(members_of(every, min(runs, _CLOSELY)), one_more)
    checks = [*_checks_of_errors(flown), *_checks_of_whiteness(closely)]
    expected = expected_accuracy(scenario, closely.motion)
    return FilterCheck(scenario, runs, checks, flown, closely, expected)


def _checks_of_errors(flown: FilterRuns) -> Iterator[Check]:
    n = flown.errors.shape[-1]
    for name, states in {"NEES of the attitude": 3, "NEES of all states": n}.items():
        yield _check(name, nees(flown, states), states)
    for sensor, innovations in flown.innovations.items():
        if np.isfinite(innovations).any():
            yield _check(f"NIS of the {sensor}", *nis(innovations))


def _checks_of_whiteness(closely: FilterRuns) -> Iterator[Check]:
    for sensor, innovations in closely.innovations.items():
        value, sigma = autocorrelation(innovations)
        if math.isfinite(value):
            passed = abs(value) < 5.0 * sigma
            name = f"correlation of the {sensor}"
            yield Check(name, value, -5.0 * sigma, 5.0 * sigma, math.nan, passed)


def as_plain(found: FilterCheck) -> dict:
    """A check as plain data.

    Attitude errors about each axis without the first tenth of the time: `error_deg`, root mean
    square over the runs; `sigma_deg`: as the filter stated; `expected_deg`: by linear covariance.
    `error_95_deg`: 95th percentile of the total error.
    """
    flown, expected = found.flown, found.expected
    later = flown.t_s >= 0.1 * flown.t_s[-1]
    error = np.degrees(np.linalg.norm(flown.errors[:, later, :3], axis=2))
    sigma = np.einsum("rkii->rk", flown.covariance[:, later, :3, :3]) / 3.0
    linear = np.interp(flown.t_s[later], expected.t_s, expected.attitude_sigma_rad**2)
    return {
        "scenario": found.scenario.name,
        "estimator": found.scenario.control.estimator.kind,
        "runs": found.runs,
        "checks": [check._asdict() for check in found.checks],
        "consistent": found.consistent,
        "error_deg": float(np.sqrt(np.nanmean(error**2) / 3.0)),
        "error_95_deg": float(np.nanquantile(error, 0.95)),
        "sigma_deg": float(np.degrees(np.sqrt(np.nanmean(sigma)))),
        "expected_deg": float(np.degrees(np.sqrt(np.mean(linear)))),
    }


def _record(scenario: Scenario) -> tuple[str, float]:
    """Record interval for about 200 instants of a run: whole control cycles."""
    cycle_s = scenario.control.cycle_s
    length_s = scenario.steps() * scenario.grid_s
    return "simulation.record_s", cycle_s * max(round(length_s / cycle_s / 200.0), 1)


def _check(name: str, values: np.ndarray, freedoms: int) -> Check:
    found = consistency(values, freedoms)
    return Check(name, found.overall, found.low, found.high, found.inside, found.consistent)
