"""Attitude from telemetry: a Kalman filter forwards, a smoother backwards, and whether they fit.

The filters are those of `computer.estimation`, the smoother that of simulated runs. A reading
belongs to the stamp of its row. What a filter states of its errors holds if its model does: the
innovations say whether the telemetry agrees, and where it does not, no accuracy is stated.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.special import chdtri

from torquer.analysis.filters.filter_statistics import autocorrelation
from torquer.analysis.filters.smoothing import (
    KNOWN_VARIABLES,
    as_dataset,
    check_can_be_smoothed,
    fly_back_and_forth,
)
from torquer.base.explain import validate_tables
from torquer.base.spec import Spec
from torquer.computer.estimation import ESTIMATORS, AnyEstimator
from torquer.computer.estimation.filter import Filter
from torquer.computer.estimation.kalman_gyro import KalmanGyro
from torquer.computer.estimation.measurements.table import DEVICE_OF
from torquer.computer.estimation.sensor_keys import SENSOR_WORDS
from torquer.computer.interface import GYRO, nothing_known
from torquer.environment.along_orbit import OrbitEnvironment
from torquer.ground.telemetry.environment import RowEnvironments, environments_at_rows
from torquer.ground.telemetry.request import mistakes_in_file
from torquer.scenario.toml_text import parse_toml, read_text
from torquer.simulation.results.variables import ESTIMATED, column, read

if TYPE_CHECKING:
    import xarray as xr

#: Variable of a session that each sensor of a filter reads.
_OF_SENSOR = {name: f"{device.symbol}_measured" for name, device in DEVICE_OF.items()} | {
    "gyro": "omega_measured"
}
#: A step longer than this many times the cadence is a gap over which no gyro is interpolated.
_GAP = 2.5
#: Beyond these the model does not fit: median of the innovations' squares over that of chi-square
#: variables, correlation of innovations from reading to reading, part of the readings rejected.
_GREATEST_SQUARE, _GREATEST_CORRELATION, _GREATEST_REJECTED = 1.5, 0.3, 0.2
#: Standard deviations by which the first two must exceed what chance gives.
_CLEARLY = 4.0
#: Innovations of a sensor from which something is concluded.
_LEAST = 20


class SensorFit(NamedTuple):
    """Innovations of a sensor: rows, median square over the expected one, correlation and sigma."""

    sensor: str
    rows: int
    square: float
    correlation: float
    correlation_sigma: float


class Fit(NamedTuple):
    """Whether a filter's model fits telemetry; `rejected`: part of the readings not used,
    `known`: of the rows with an attitude."""

    sensors: tuple[SensorFit, ...]
    rejected: float
    known: float

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why it does not fit; empty if it does."""
        found = []
        if self.known == 0.0:
            return ("the filter has never started",)
        for each in self.sensors:
            if each.rows < _LEAST:
                continue
            # a median of n squares of three components is uncertain by 1.1 / sqrt(n), relative
            if each.square > _GREATEST_SQUARE + _CLEARLY * 1.1 / np.sqrt(each.rows):
                found.append(
                    f"readings of the {SENSOR_WORDS[each.sensor]} miss the expected ones "
                    f"{np.sqrt(each.square):.1f} times as far as their stated noise explains"
                )
            least = max(_GREATEST_CORRELATION, _CLEARLY * each.correlation_sigma)
            # the variance of a mean of correlated errors is larger by (1 + c) / (1 - c)
            grown = each.square * (1.0 + each.correlation) / max(1.0 - each.correlation, 1e-9)
            if each.correlation > least and grown > _GREATEST_SQUARE:
                found.append(
                    f"what readings of the {SENSOR_WORDS[each.sensor]} miss is the same from row "
                    f"to row (correlation {each.correlation:.2f}): an error of the sensor or the "
                    "motion that is not noise"
                )
        if self.rejected > _GREATEST_REJECTED:
            found.append(f"{100.0 * self.rejected:.0f} % of the readings are rejected")
        if not any(each.rows >= _LEAST for each in self.sensors):
            found.append(f"fewer than {_LEAST} readings of any sensor: nothing to judge by")
        return tuple(found)

    @property
    def fits(self) -> bool:
        """Whether the errors that filter and smoother state can be believed."""
        return not self.reasons


class Attitude(NamedTuple):
    """What filter and smoother make of a session.

    `data` over `time`: `q_estimated`, `omega_estimated`, `attitude_sigma`, `rate_sigma` of the
    filter, and the variables of `torquer.smooth_run`, the attribute `fits`; `innovations` of each
    sensor (n, 1 to 6): whitened, NaN without a reading.
    """

    data: xr.Dataset
    fit: Fit
    innovations: dict[str, np.ndarray]

    @property
    def verdict(self) -> str:
        """The accuracy, or why none can be stated."""
        if not self.fit.fits:
            return f"the filter's model does not fit: {'; '.join(self.fit.reasons)}"
        filtered, smoothed = (
            np.degrees(np.sqrt(np.nanmean(self.data[name].values ** 2)))
            for name in ("attitude_sigma", "attitude_sigma_smoothed")
        )
        return (
            f"attitude to {smoothed:.3g} deg about each axis, the filter alone {filtered:.3g} deg "
            f"(stated, root mean square), known in {100.0 * self.fit.known:.0f} % of the rows"
        )


class _Control(Spec):
    estimator: AnyEstimator


class _Tables(Spec):
    """What a file must hold of a scenario."""

    control: _Control


def load_filter(path: Path | str) -> Filter:
    """The Kalman filter of a TOML file with a table [control.estimator], such as a scenario.

    RequestError for a file that has none, or another estimator.
    """
    with mistakes_in_file("filter"):
        return _filter_in(Path(path))


def _filter_in(path: Path) -> Filter:
    data = parse_toml(read_text(path, "filter"), "filter")
    table = data.get("control")
    table = table.get("estimator") if isinstance(table, dict) else None
    kinds = ", ".join(kind for kind, each in ESTIMATORS.items() if issubclass(each, Filter))
    if isinstance(table, dict) and table.get("kind") in kinds.split(", "):
        found = validate_tables(_Tables, {"control": {"estimator": table}}).control.estimator
        if isinstance(found, Filter):
            return found
    raise ValueError(f"must hold a table [control.estimator] of kind {kinds}; received {path}")


def estimate_attitude(data: xr.Dataset, spec: Filter, along: OrbitEnvironment) -> Attitude:
    """Attitude at every row of a session by a filter, and in hindsight.

    `data`: a session, calibrated where it needs to be; `along`: the environment along the orbit
    from the session's first row; its orbit is None where the session holds positions
    (`position_j`). A gyro is not interpolated over steps of more than 2.5 times the cadence: after
    them the attitude is sought again, and it remains unknown (NaN) in stretches between gaps in
    which it never shows. ValueError where a sensor of the filter has no readings, and for filters
    that cannot be smoothed.
    """
    check_can_be_smoothed(spec)
    used = [*spec.sensors, *(["gyro"] if spec.has_gyro else [])]
    for sensor in used:
        if _OF_SENSOR[sensor] not in data:
            raise ValueError(
                f"control.estimator.sensors: must have readings in the telemetry; received "
                f"{sensor!r} without {_OF_SENSOR[sensor]}"
            )
    t_s = data["time"].values
    if len(t_s) < 2:
        raise ValueError(f"FILE: must hold 2 rows or more for an attitude; received {len(t_s)}")
    known = known_by(data, along)
    log = ("rejected", *(f"innovation_{sensor}" for sensor in spec.sensors))
    works, seeds = np.full(len(t_s), True), None
    if isinstance(spec, KalmanGyro):
        works, seeds = _seeds(known, spec)
    found = fly_back_and_forth(spec, known, works, seeds, log)
    for each in (found.forward.q, *found[1:4]):
        each[~works] = np.nan
    innovations: dict[str, np.ndarray] = {
        sensor: np.where(works[:, None], found.log[f"innovation_{sensor}"], np.nan)
        for sensor in spec.sensors
    }
    fit = _fit(found, innovations)
    steps = data.assign_coords(axis=list("xyz"), component=list("xyzw"))
    smoothed = as_dataset(steps, found, {"fits": int(fit.fits)})
    own = {"q_estimated", "omega_estimated", "attitude_sigma", "rate_sigma"}
    filtered = read(found.known, [each for each in ESTIMATED if each.name in own])
    return Attitude(smoothed.assign(filtered), fit, innovations)


def _seeds(known, spec: KalmanGyro) -> tuple[np.ndarray, np.ndarray]:
    """Rows at which a filter with a gyro works, and attitudes near which it begins stretches.

    Before the first rows that show an attitude by themselves, as in the umbra, a filter on board
    knows none. In hindsight it is found: the filter is flown to the end of each stretch without
    gaps, and what it knows there is turned back by the gyro. That is where the linear model of the
    second flight is taken, no knowledge.
    """
    t_s, step = known["t_s"], np.diff(known["t_s"])
    starts = np.flatnonzero(np.append(True, step > _GAP * np.median(step)))
    aged = np.append(0.0, step)[starts] * spec.constants().walk
    seeds, works = np.full((len(t_s), 5), np.nan), np.full(len(t_s), True)
    seeds[starts, 4] = aged
    alone = fly_back_and_forth(spec, known, works, seeds).forward
    seeds[:] = np.nan
    for first, end, gained in zip(starts, np.append(starts[1:], len(t_s)), aged, strict=True):
        new = known["read_s"][:, GYRO][first:end] == t_s[first:end]
        begun = first + int(np.argmax(new))
        works[first:begun] = False
        if not new.any() or not np.isfinite(alone.q[end - 1, 0]):
            works[first:end] = False
            continue
        seeds[begun, :4] = _turned_back(known[begun:end], alone.q[end - 1], alone.states[end - 1])
        seeds[begun, 4] = gained
    return works, seeds


def _turned_back(known, q_last, states_last) -> np.ndarray:
    """Attitude at the first row from that at the last one, by the gyro less its bias."""
    from scipy.interpolate import make_interp_spline
    from scipy.spatial.transform import Rotation

    rows = np.flatnonzero(known["read_s"][:, GYRO] == known["t_s"])
    t_s = known["t_s"][rows]
    omega = known["readings"][rows, GYRO, :3] - states_last[:3]
    q = Rotation.from_quat(q_last)
    if len(rows) < 2:
        return q.as_quat()
    course = make_interp_spline(t_s, omega, min(3, len(rows) - 1)).antiderivative()
    between = np.diff(t_s)[:, None]
    coning = between**2 / 12.0 * np.cross(omega[:-1], omega[1:])
    for turn in (np.diff(course(t_s), axis=0) + coning)[::-1]:
        q = q * Rotation.from_rotvec(-turn)
    return q.as_quat()


def known_by(data: xr.Dataset, along: OrbitEnvironment) -> np.ndarray:
    """What a computer would have known at each row (n,), `KNOWN`; nothing is estimated yet."""
    t_s = data["time"].values
    known = np.repeat(nothing_known(), len(t_s))
    known["t_s"] = t_s
    for name in (*_OF_SENSOR.values(), "wheel_momentum_measured"):
        if name in data:
            _put_readings(known, KNOWN_VARIABLES[name], data[name].values, t_s)
    dipole = "coil_dipole_on_board" if "coil_dipole_on_board" in data else "dipole_body"
    if dipole in data:
        _put(
            known, KNOWN_VARIABLES["coil_dipole_on_board"].cells, np.nan_to_num(data[dipole].values)
        )
    _put_environments(known, environments_at_rows(data, along))
    return known


def _put_readings(known, variable, values, t_s) -> None:
    """The latest reading of each row that has one, and when it was taken."""
    rows = np.where(np.isfinite(values).all(axis=1), np.arange(len(t_s)), -1)
    latest = np.maximum.accumulate(rows)
    there = latest >= 0
    for cell, numbers in zip(variable.cells, values.T, strict=True):
        column(known, cell)[there] = numbers[latest[there]]
    known["read_s"][there, variable.row] = t_s[latest[there]]


def _put(known, cells, values) -> None:
    for cell, numbers in zip(cells, values.T, strict=True):
        column(known, cell)[:] = numbers


def _put_environments(known, around: RowEnvironments) -> None:
    """Put position, velocity, field, Sun and shadow of each row into what is known."""
    for name, values in (
        ("position_on_board", around.r), ("velocity_on_board", around.v), ("b_on_board", around.b),
        ("b_rate_on_board", around.b_rate), ("sun_on_board", around.sun),
    ):  # fmt: skip
        _put(known, KNOWN_VARIABLES[name].cells, values)
    known["sunlit_fraction"] = around.sunlit_fraction


def _fit(found, innovations: dict[str, np.ndarray]) -> Fit:
    """Whether what the filter expected agrees with what was read."""
    sensors = []
    for sensor, rows in innovations.items():
        there = np.isfinite(rows)
        count = there.sum(axis=1)
        read_ = count > 0
        if not read_.any():
            continue
        freedoms = int(count.max())
        square = np.nansum(rows[read_] ** 2, axis=1) * freedoms / count[read_]
        usual = float(np.median(square)) / float(chdtri(freedoms, 0.5))
        # one that is far out must not hide what the others share
        kept = np.where(there, np.clip(rows, -3.0, 3.0), np.nan)[None]
        sensors.append(SensorFit(sensor, int(read_.sum()), usual, *autocorrelation(kept)))
    rejected = float(found.log["rejected"][-1, 0])
    readings = max(sum(each.rows for each in sensors), rejected, 1.0)
    known = float(np.mean(np.isfinite(found.q[:, 0])))
    return Fit(tuple(sensors), rejected / readings, known)
