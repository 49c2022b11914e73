"""Smoothing of a recorded run: the filter works again on what the computer knew, then backwards."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from torquer.analysis.control_cycle import control_steps
from torquer.analysis.filters.filter_flights import finest_record_s
from torquer.analysis.filters.linear_covariance import first_variances, kalman_filter
from torquer.compile.engine import addresses, records
from torquer.computer.estimation.filter import Filter
from torquer.computer.estimation.smoother import Forward, empty_forward, fly, smooth, with_copies
from torquer.computer.estimation.state_names import state_axes
from torquer.computer.interface import KNOWN
from torquer.maths.geometry.quaternion import angle_between
from torquer.scenario.spec import Scenario
from torquer.simulation.results.dataset import flown_scenario
from torquer.simulation.results.variables import (
    INPUTS,
    KNOWN_READINGS,
    estimated,
    inputs,
    write,
)
from torquer.spacecraft.sensors.devices import Flown

#: What the computer knows of readings and surroundings, read from `KNOWN`, by name.
KNOWN_VARIABLES = {each.name: each for each in INPUTS} | KNOWN_READINGS
#: Difference of two attitudes, over the standard deviation of either, that is no rounding.
_OTHER = 1e-3


def smooth_run(result: xr.Dataset) -> xr.Dataset:
    """What the readings of a whole run tell about each of its control steps.

    `result`: of a run whose `control.estimator` is a Kalman filter, with `simulation.record_inputs`
    and a record at every control step. The filter works again on the recorded readings, from the
    start to the end; then a pass backwards improves what it found at each step by the readings
    after it (Rauch, Tung, Striebel 1965). Truth is not used.

    Variables over `time`, the control steps: `q_smoothed`, `omega_smoothed` [rad/s, body],
    `attitude_sigma_smoothed` [rad] and `rate_sigma_smoothed` [rad/s], standard deviations about
    each axis; `states_smoothed` over `state`, the states beyond the attitude;
    `covariance_smoothed` over `error` and `other_error`, of the errors in axes of the smoothed
    body; `state_units` and `error_units` hold their units. NaN before the filter has started. With
    a gyro the rate is its reading less the smoothed bias, and as noisy as the reading.

    ValueError for a result of another estimator, for a filter with the magnetometer alone or with
    errors that are only considered, for a result that lacks what the computer knew or a control
    step, and for one whose estimates the filter does not find again, as after a change of the
    package.

        >>> filtered = torquer.load_scenario("which_sensors.toml")  # `torquer init --example`
        >>> for key, value in {"duration_s": 300.0, "step_s": 1.0, "record_s": 1.0}.items():
        ...     filtered = filtered.replace(f"simulation.{key}", value)
        >>> filtered = filtered.replace("simulation.record_inputs", True)
        >>> smoothed = torquer.smooth_run(torquer.simulate(filtered))
        >>> smoothed["attitude_sigma_smoothed"].dims
        ('time',)
    """
    scenario = flown_scenario(result)
    spec = kalman_filter(scenario)
    check_can_be_smoothed(spec)
    rows = _control_rows(result, scenario)
    steps = result.isel(time=rows)
    works = _works(result, scenario, rows)
    units = scenario.spacecraft.units()
    found = fly_back_and_forth(spec, _read_known(steps, units), works, units=units)
    _check_found_again(steps, found.forward, works)
    for each in found[1:4]:
        each[~works] = np.nan
    return as_dataset(steps, found, {name: result.attrs[name] for name in ("scenario", "seed")})


def check_can_be_smoothed(spec: Filter) -> None:
    """ValueError for a filter with many hypotheses at first, or with errors only considered."""
    if spec.starts_by_field:
        raise ValueError(
            "control.estimator.sensors: must be more than the magnetometer in a run that is to be "
            "smoothed, with which alone the filter has many hypotheses at first; "
            f"received {list(spec.sensors)}"
        )
    if spec.considered_states:
        raise ValueError(
            "control.estimator.calibration: must be 'estimated' in a run that is to be smoothed: "
            "what is only considered cannot be improved by later readings; received 'considered'"
        )


def _control_rows(result: xr.Dataset, scenario: Scenario) -> np.ndarray:
    """Numbers of the records at control steps: all of them must be there."""
    if "control_time" not in result:
        raise ValueError(
            "simulation.record_inputs: must be true in a run that is to be smoothed; received a "
            "result without what the computer knew"
        )
    last = result["control_time"].values
    rows = np.flatnonzero(last == result["time"].values)
    wanted_s = control_steps(scenario, last[-1]) * scenario.grid_s
    if not np.array_equal(last[rows], wanted_s) and scenario.control.failures:
        raise ValueError(
            "control.failures: must be left out in a run that is to be smoothed, which has a "
            f"record at every control step; received {len(scenario.control.failures)}"
        )
    if not np.array_equal(last[rows], wanted_s):
        raise ValueError(
            f"simulation.record_s: must be {finest_record_s(scenario):g} s, to have a record at "
            f"every control step of a run that is to be smoothed; received "
            f"{scenario.simulation.record_s:g} s"
        )
    return rows


def _read_known(steps: xr.Dataset, units: Sequence[Flown]) -> np.ndarray:
    """What the computer knew after each control step; `units`: see `fly_back_and_forth`."""
    known = np.full(steps.sizes["time"], np.nan, KNOWN)
    known["gyro_units"] = 0.0
    given = {each.name: each for each in inputs(units)} | KNOWN_READINGS
    stated = [each for each in estimated(units) if each.name in steps]
    write(steps, [*given.values(), *stated], known, slice(None))
    return known


def _works(result: xr.Dataset, scenario: Scenario, rows: np.ndarray) -> np.ndarray:
    """Whether `control.estimator` worked at each control step: modes choose the next one's."""
    works = np.full(len(rows), True)
    modes = scenario.control.named().modes
    for name, region in modes.regions.items() if modes else ():
        state = result[f"mode_{name}"].values[rows[:-1]]
        for number, each in enumerate(region.states.values()):
            if each.estimator is not None:
                works[1:][state == number] = each.estimator == "estimator"
    return works


class BackAndForth(NamedTuple):
    """What filter and smoother find at k steps.

    `forward`: the filter's own; `q` (k, 4), `states` (k, n - 3), `covariance` (k, n, n): smoothed;
    `known` (k,): `KNOWN` with the filter's estimates; `log`: of its memory, by name.
    """

    forward: Forward
    q: np.ndarray
    states: np.ndarray
    covariance: np.ndarray
    known: np.ndarray
    log: dict[str, np.ndarray]
    spec: Filter


def fly_back_and_forth(
    spec: Filter,
    known: np.ndarray,
    works: np.ndarray,
    seeds: np.ndarray | None = None,
    log=(),
    units: Sequence[Flown] = (),
) -> BackAndForth:
    """Let a filter work on what the computer knew, from start to end and backwards.

    `known` (k,): see `KNOWN`; `works` (k,): whether the filter works then, otherwise the estimate
    in `known` is another's; `seeds` (k, 5): see `smoother.begin_at`, NaN where
    the filter goes on; `log`: parts of the filter's memory to be kept; `units`: several devices of
    a kind, each of which `known` has.
    """
    filter_, places = with_copies(spec.estimator(units))
    forward = empty_forward(len(known), places.n)
    known = known.copy()
    cells = {name: filter_.memory_places()[name] for name in log}
    logged = np.array([first + i for first, count in cells.values() for i in range(count)], int)
    rows = np.full((len(known), len(logged)), np.nan)
    memory = filter_.first_memory()
    if seeds is None:
        seeds = np.full((len(known), 5), np.nan)
    else:  # a filter that does not start by itself has not put what it knows at first
        here = slice(places.covariance, places.covariance + 4 * places.n**2)
        memory[here] = np.diag(np.pad(first_variances(spec), (0, places.n))).ravel()
    (address,) = addresses([filter_.in_loop()])
    fly(
        address, records(known), filter_.pack(), memory, places, works, seeds, forward, logged,
        rows,
    )  # fmt: skip
    ends = np.cumsum([count for _, count in cells.values()])
    parts = np.split(rows, ends[:-1], axis=1) if cells else []
    q, states, covariance = (np.full_like(each, np.nan) for each in forward[:3])
    smooth(forward, q, states, covariance)
    kept = dict(zip(cells, parts, strict=True))
    return BackAndForth(forward, q, states, covariance, known, kept, spec)


def _check_found_again(result: xr.Dataset, forward: Forward, works: np.ndarray) -> None:
    """ValueError unless the filter has found the recorded estimates again; `result`: its steps."""
    was, now = result["q_estimated"].values[works], forward.q[works]
    same = angle_between(was, now) <= _OTHER * result["attitude_sigma"].values[works]
    same |= np.isnan(was[:, 0]) & np.isnan(now[:, 0])
    if not same.all():
        raise ValueError(
            "result: must be of a run whose filter finds its estimates again from the recorded "
            "readings; received one with others from t = "
            f"{result['time'].values[works][~same][0]:g} s on, as of another version"
        )


def as_dataset(steps: xr.Dataset, found: BackAndForth, attributes: dict) -> xr.Dataset:
    """Smoothed attitudes, states and covariance, with what follows from them, as a Dataset.

    `steps`: with the coordinates `time`, `utc`, `axis` and `component`.
    """
    covariance = found.covariance
    axes = state_axes(found.spec.initial_variances())
    (state,), (error, other) = axes["states"], axes["covariance"]
    omega, rate_variance = _rate(found)
    variables = {
        "q_smoothed": (
            ("time", "component"), found.q, "1", "attitude quaternion, body to inertial",
        ),
        "omega_smoothed": (("time", "axis"), omega, "rad/s", "absolute angular velocity, body"),
        "attitude_sigma_smoothed": (
            ("time",), np.sqrt(_variance(covariance, 0)), "rad",
            "standard deviation of the attitude about each axis",
        ),
        "rate_sigma_smoothed": (
            ("time",), np.sqrt(rate_variance), "rad/s", "standard deviation of the rate",
        ),
        "states_smoothed": (("time", "state"), found.states, "", "states beyond the attitude"),
        "covariance_smoothed": (
            ("time", "error", "other_error"), covariance, "", "covariance of the errors",
        ),
    }  # fmt: skip
    coordinates: dict = {name: steps[name] for name in ("time", "utc", "axis", "component")}
    for axis in (state, error, other):
        units = (axis.name, list(axis.units))
        coordinates |= {axis.name: list(axis.labels), f"{axis.name}_units": units}
    return xr.Dataset(
        {
            name: (dims, values, {"long_name": said, **({"units": unit} if unit else {})})
            for name, (dims, values, unit, said) in variables.items()
        },
        coords=coordinates,
        attrs=attributes,
    )


def _variance(covariance: np.ndarray, first: int) -> np.ndarray:
    """Mean variance (k,) of the three components of a state."""
    return np.einsum("kii->k", covariance[:, first : first + 3, first : first + 3]) / 3.0


def _rate(found: BackAndForth):
    """(Rate (k, 3), its variance (k,)): a state, or the filter's with another bias."""
    variance = _variance(found.covariance, 3)
    if "rate" in found.spec.initial_variances():
        return found.states[:, :3], variance
    noise = found.known["sigma_rad_s"] ** 2 - _variance(found.forward.covariance, 3)
    filtered = np.stack([found.known[f"estimate_omega_{c}"] for c in "xyz"], axis=1)
    return filtered + found.forward.states[:, :3] - found.states[:, :3], variance + noise


class Accuracy(NamedTuple):
    """Attitude of filter and smoother against the truth, while both know it [deg].

    Errors about each axis, root mean square over time; standard deviations as stated, likewise;
    greatest whole angles.
    """

    scenario: str
    filter_deg: float
    smoothed_deg: float
    filter_sigma_deg: float
    smoothed_sigma_deg: float
    filter_greatest_deg: float
    smoothed_greatest_deg: float


def measure_accuracy(result: xr.Dataset, found: xr.Dataset) -> Accuracy:
    """How accurate filter and smoother were in a run; `found`: what `smooth_run` made of it.

    NaN if the filter has never started.
    """
    steps = result.sel(time=found["time"])
    q = (steps["q_estimated"].values, found["q_smoothed"].values)
    sigma = (steps["attitude_sigma"].values, found["attitude_sigma_smoothed"].values)
    known = np.isfinite(q[1][:, 0])
    numbers = [[math.nan] * 2] * 3
    if known.any():
        whole = [angle_between(each, steps["q_body_to_inertial"].values)[known] for each in q]
        numbers = [
            [math.degrees(_rms(each) / math.sqrt(3.0)) for each in whole],
            [math.degrees(_rms(each[known])) for each in sigma],
            [math.degrees(each.max()) for each in whole],
        ]
    return Accuracy(flown_scenario(result).name, *(x for pair in numbers for x in pair))


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
