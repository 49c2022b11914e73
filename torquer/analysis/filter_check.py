"""Is a filter honest? Its errors over many runs against the covariance that it states.

The error e of a consistent filter has the covariance P that the filter states, so that e P^-1 e
(normalised estimation error squared, NEES) is chi-square distributed with as many degrees of
freedom as there are states; so is the normalised innovation squared (NIS), with those of the
measurement; and whitened innovations are not correlated in time. Y. Bar-Shalom, X. Li, T.
Kirubarajan, 'Estimation with applications to tracking and navigation' (2001), 5.4.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from torquer.scenario.control import whole_steps
from torquer.scenario.spec import Scenario
from torquer.simulation.gyro_drift import fill_drift
from torquer.simulation.prepare import log_of
from torquer.simulation.run import Run, prepare
from torquer.spacecraft.gyro import GyroSet

#: Filters that state a covariance, and what their states are after the attitude error.
STATES = {
    "kalman_gyro": ("gyro_bias", "magnetometer_bias"),
    "kalman_dynamics": ("rate", "residual_dipole", "magnetometer_bias"),
    "usque": ("gyro_bias",),
}
_ESTIMATOR = "control.estimator"


class FilterRuns(NamedTuple):
    """Errors of a filter in many runs; NaN while it knows nothing.

    `t_s` (samples,); `errors` (runs, samples, n): attitude error in body axes [rad], then the
    other states; `covariance` (runs, samples, n, n): as stated; `innovations` of each sensor
    (runs, samples, 3): whitened, NaN where there was no reading or no such component.
    """

    t_s: np.ndarray
    errors: np.ndarray
    covariance: np.ndarray
    innovations: dict[str, np.ndarray]


class Consistency(NamedTuple):
    """A statistic over runs against its chi-square band.

    `mean` (samples,) over the runs, over the degrees of freedom: 1 in a consistent filter; `low`
    and `high`: what it lies between at an instant with the probability; `inside`: part of the
    instants at which it does; `overall`: mean over the instants.
    """

    mean: np.ndarray
    low: float
    high: float
    inside: float
    overall: float

    @property
    def consistent(self) -> bool:
        """Whether the mean over all instants lies in the band of a single one."""
        return self.low <= self.overall <= self.high


def members_of(scenario: Scenario, runs: int) -> Iterator[Scenario]:
    """The scenario with other random numbers in each run, and other biases where they are states.

    The biases are drawn as the filter believes at its start. ValueError for an estimator that is
    no Kalman filter, a control cycle with a measurement window, and records between control steps.
    """
    spec = scenario.control.estimator
    if spec.kind not in STATES:
        raise ValueError(
            f"{_ESTIMATOR}.kind: must be one of {', '.join(STATES)} for statistics of a filter; "
            f"received {spec.kind!r}"
        )
    control = scenario.control
    if control.measure_s > 0.0:
        raise ValueError(
            "control.measure_s: must be 0 for statistics of a filter; "
            f"received {control.measure_s:g} s"
        )
    whole_steps(
        "simulation.record_s", scenario.simulation.record_s, control.sample_s, "control.sample_s"
    )
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


def fly_filter(members: Iterable[Scenario]) -> FilterRuns:
    """Fly runs with a filter on one orbit; what the filter believed beside the truth."""
    piece, found = None, []
    for member in members:
        run = prepare(member, piece=piece)
        piece = piece or run.piece
        found.append(_flown(run))
    errors, covariance, field, sun = (np.stack(part) for part in zip(*found, strict=True))
    t_s = np.arange(errors.shape[1]) * member.simulation.record_s
    return FilterRuns(t_s, errors, covariance, {"magnetometer": field, "sun": sun})


def _flown(run: Run) -> tuple[np.ndarray, ...]:
    """Errors, covariance and innovations of a run."""
    parts: list = []
    run.keep = lambda run: parts.append(run.rows())
    run.advance_to(run.steps)
    parts.append(run.rows())
    rows, log, estimate = (
        np.concatenate([getattr(part, name) for part in parts])
        for name in ("rows", "log", "estimate")
    )
    logged = _logged(run, log)
    n = math.isqrt(logged["covariance"].shape[1])
    own = np.stack([estimate[f"estimate_q_{c}"] for c in "xyzw"], axis=1)
    true = np.stack([rows[f"q_{c}"] for c in "xyzw"], axis=1)
    turn, known = np.full((len(rows), 3), np.nan), np.isfinite(own[:, 0])
    between = Rotation.from_quat(own[known]).inv() * Rotation.from_quat(true[known])
    turn[known] = between.as_rotvec()
    truth = _truth(run, rows)
    states = STATES[run.scenario.control.estimator.kind]
    others = [truth[name] for name in states if name in truth][: (n - 3) // 3]
    errors = np.hstack([turn, np.hstack(others) - logged["states"]])
    covariance = logged["covariance"].reshape(-1, n, n)
    errors[~known], covariance[~known] = np.nan, np.nan
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
    """What states of a filter are in truth (samples, 3), those that it has."""
    scenario, plant = run.scenario, run.plan.plant
    spec, count = scenario.control.estimator, len(rows)
    read_s = scenario.spacecraft.gyro.sample_s or scenario.control.sample_s
    t_s = scenario.simulation.record_s * np.arange(count)
    truth = {
        "gyro_bias": _drifted(plant.gyro, scenario.seed, read_s, t_s),
        "rate": np.stack([rows[f"omega_{c}"] for c in "xyz"], axis=1),
    }
    if getattr(spec, "dipole_sigma_a_m2", None):
        truth["residual_dipole"] = np.tile(plant.coils.residual_a_m2, (count, 1))
    if spec.magnetometer_bias_sigma_nt:
        truth["magnetometer_bias"] = np.tile(plant.magnetometer.bias_t, (count, 1))
    return truth


def _drifted(gyro: GyroSet, seed: int, interval_s: float, t_s: np.ndarray) -> np.ndarray:
    """The gyro's bias (samples, 3) at its latest reading; it is read at intervals from 0 on."""
    latest = np.floor(t_s / interval_s + 1e-9).astype(int)
    out = np.zeros((latest[-1] + 1, 3))
    fill_drift(gyro, seed, interval_s, out)
    return out[latest] + np.array(gyro.bias_rad_s)


def nees(runs: FilterRuns, states: int | None = None) -> np.ndarray:
    """Normalised estimation error squared (runs, samples) of the first so many states (all)."""
    e, p = runs.errors[..., :states], runs.covariance[..., :states, :states]
    out = np.full(e.shape[:2], np.nan)
    known = np.isfinite(e[..., 0])
    # states differ in size by many orders: scaled by their standard deviations
    sigma = np.sqrt(np.einsum("kii->ki", p[known]))
    scaled, ratio = e[known] / sigma, p[known] / (sigma[:, :, None] * sigma[:, None, :])
    out[known] = np.einsum("ki,ki->k", scaled, np.linalg.solve(ratio, scaled[..., None])[..., 0])
    return out


def nis(innovations: np.ndarray) -> tuple[np.ndarray, int]:
    """Normalised innovation squared (runs, samples), NaN without a reading; its freedoms."""
    there = np.isfinite(innovations)
    freedoms = int(there.sum(axis=-1).max())
    square = np.where(there, innovations, 0.0) ** 2
    return np.where(there.any(axis=-1), square.sum(axis=-1), np.nan), freedoms


def consistency(values: np.ndarray, freedoms: int, probability: float = 0.95) -> Consistency:
    """Mean over runs (runs, samples) of a chi-square statistic against its band.

    Instants at which fewer than half of the runs have a value are left out.
    """
    there = np.isfinite(values).sum(axis=0)
    used = there >= 0.5 * len(values)
    mean = np.nanmean(values[:, used], axis=0) / freedoms
    low, high = band(freedoms, len(values), probability)
    inside = float(np.mean((mean >= low) & (mean <= high)))
    return Consistency(mean, low, high, inside, float(np.nanmean(mean)))


def band(freedoms: int, runs: int, probability: float = 0.95) -> tuple[float, float]:
    """What the mean of chi-square numbers of so many runs, over its freedoms, lies between."""
    tail, total = 0.5 * (1.0 - probability), freedoms * runs
    return float(chi2.ppf(tail, total) / total), float(chi2.ppf(1.0 - tail, total) / total)


def autocorrelation(innovations: np.ndarray, lag: int = 1) -> tuple[float, float]:
    """Correlation of whitened innovations (runs, samples, 3) `lag` readings apart, and its sigma.

    The sigma is what white noise would show.
    """
    product = square = 0.0
    pairs = 0
    for run in innovations:
        there = np.isfinite(run)
        readings = run[there.any(axis=1)][:, there.any(axis=0)]
        product += float(np.sum(readings[lag:] * readings[:-lag]))
        square += 0.5 * float(np.sum(readings[lag:] ** 2) + np.sum(readings[:-lag] ** 2))
        pairs += readings[lag:].size
    if not pairs:
        return math.nan, math.nan
    return product / square, 1.0 / math.sqrt(pairs)


class Check(NamedTuple):
    """A statistic of a filter and whether it is what a consistent filter shows."""

    name: str
    value: float
    low: float
    high: float
    inside: float
    passed: bool


def check_filter(scenario: Scenario, runs: int = 200) -> dict:
    """Statistics of a scenario's filter over runs, as plain data.

    `checks`: of errors (NEES) of the attitude and of all states, and of innovations (NIS) of each
    sensor, over their freedoms: mean over runs and instants, its 95 % band at one instant, part of
    the instants inside; of the correlation of innovations one reading apart, five sigma of white
    noise. `error_deg`: root mean square, and 95 % of all errors; `sigma_deg`: what the filter
    stated, both per axis, without the first tenth of the time.
    """
    checks = []
    flown = fly_filter(members_of(scenario.replace(*_record(scenario)), runs))
    n = flown.errors.shape[-1]
    for name, states in {"NEES of the attitude": 3, "NEES of all states": n}.items():
        checks.append(_check(name, nees(flown, states), states))
    for sensor, innovations in flown.innovations.items():
        if np.isfinite(innovations).any():
            checks.append(_check(f"NIS of the {sensor}", *nis(innovations)))
    every = scenario.replace("simulation.record_s", scenario.control.sample_s)
    for sensor, innovations in fly_filter(members_of(every, min(runs, 4))).innovations.items():
        value, sigma = autocorrelation(innovations)
        if math.isfinite(value):
            passed = abs(value) < 5.0 * sigma
            name = f"correlation of the {sensor}"
            checks.append(Check(name, value, -5.0 * sigma, 5.0 * sigma, math.nan, passed))
    later = flown.t_s >= 0.1 * flown.t_s[-1]
    error = np.degrees(np.linalg.norm(flown.errors[:, later, :3], axis=2))
    sigma = np.einsum("rkii->rk", flown.covariance[:, later, :3, :3]) / 3.0
    return {
        "scenario": scenario.name,
        "estimator": scenario.control.estimator.kind,
        "runs": runs,
        "checks": [check._asdict() for check in checks],
        "consistent": all(check.passed for check in checks),
        "error_deg": float(np.sqrt(np.nanmean(error**2) / 3.0)),
        "error_95_deg": float(np.nanquantile(error, 0.95)),
        "sigma_deg": float(np.degrees(np.sqrt(np.nanmean(sigma)))),
    }


def _record(scenario: Scenario) -> tuple[str, float]:
    """Record interval for about 200 instants of a run: whole control steps."""
    sample_s = scenario.control.sample_s
    length_s = scenario.steps() * scenario.grid_s
    return "simulation.record_s", sample_s * max(round(length_s / sample_s / 200.0), 1)


def _check(name: str, values: np.ndarray, freedoms: int) -> Check:
    found = consistency(values, freedoms)
    return Check(name, found.overall, found.low, found.high, found.inside, found.consistent)
