"""Pictures of filters: errors, NEES and NIS, whiteness; expected accuracy; smoothed runs."""

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np
import xarray as xr
from matplotlib.figure import Figure, SubFigure

from torquer.analysis.filters.filter_check import FilterCheck
from torquer.analysis.filters.filter_statistics import (
    autocorrelation,
    band,
    mean_over_runs,
    nees,
    nis,
)
from torquer.analysis.filters.observability import filter_states
from torquer.analysis.filters.sensor_sets import SensorSet
from torquer.computer.estimation.measurements.table import BY_NAME
from torquer.computer.estimation.sensor_keys import SENSOR_WORDS
from torquer.maths.geometry.quaternion import angle_between
from torquer.report.common import colours
from torquer.report.common.colours import BLUE, GREEN, GREY, RED, curve_colour
from torquer.report.common.figure import (
    INK,
    legend_at_left,
    save_figure,
    save_figures,
    stack_panels,
)
from torquer.report.common.scales import Clock, clock_for
from torquer.simulation.results.dataset import flown_scenario

#: Runs drawn one by one; readings apart up to which correlation is shown.
_LINES, LAGS = 40, 20
#: What states are drawn in: name of the unit, its size.
UNITS = {
    "attitude": ("deg", np.pi / 180.0),
    "rate": ("deg/s", np.pi / 180.0),
    "gyro bias": ("deg/h", np.pi / 180.0 / 3600.0),
    "residual dipole": ("A m²", 1.0),
    "magnetometer bias": ("nT", 1e-9),
}
#: Colours of the sensors.
COLOURS = {name: getattr(colours, each.colour) for name, each in BY_NAME.items()}
_SHADE = "#e8ebf0"
_THRESHOLD = "below 1: some combination of states stays as unknown as it was"
Drawn = TypeVar("Drawn")


def draw_all(found: FilterCheck, folder: Path) -> dict[str, Path]:
    """All pictures of a check as PNG files; their paths by name; none if nothing started."""
    return save_figures(by_name(found, draw_errors, draw_consistency, _draw_whiteness), folder)


def by_name(
    found: FilterCheck,
    errors: Callable[[FilterCheck, str, int], Drawn],
    consistency: Callable[[FilterCheck], Drawn],
    whiteness: Callable[[FilterCheck], Drawn],
) -> dict[str, Drawn]:
    """What functions draw of a check, by the names of its pictures; none if nothing started.

    `errors` gets the name of three states, and the column of the first.
    """
    if not found.flown.started.any():
        return {}
    states = filter_states(found.scenario.control.estimator)
    drawn = {
        f"errors_{name.replace(' ', '_')}": errors(found, name, 3 * k)
        for k, name in enumerate(states)
        if np.isfinite(found.flown.errors[..., 3 * k]).any()
    }
    return drawn | {"consistency": consistency(found), "whiteness": whiteness(found)}


def shade(axes, t_s, seen, clock: Clock) -> None:
    """Grey where no Sun sensor sees the Sun."""
    axes.fill_between(
        np.asarray(t_s) / clock.seconds, 0.0, 1.0, where=~np.asarray(seen), step="post",
        transform=axes.get_xaxis_transform(), color=_SHADE, lw=0, zorder=0,
    )  # fmt: skip


def draw_errors(found: FilterCheck, name: str, first: int, on: SubFigure | None = None) -> Figure:
    """Three states: errors of runs within three sigma of Monte Carlo and linear covariance."""
    flown, expected = found.flown, found.expected
    clock = clock_for(flown.t_s[-1])
    figure, panels = stack_panels(
        f"{name.capitalize()} error of {found.runs} runs", 3, 6.4, on, sharex=True
    )
    t = flown.t_s / clock.seconds
    for k, axes in enumerate(panels):
        errors, spread, linear, reach = state_errors(found, name, first + k)
        shade(axes, expected.t_s, expected.sun_seen, clock)
        axes.plot(t, errors[:_LINES].T, color=GREY, lw=0.4, alpha=0.5)
        for sign in (-1.0, 1.0):
            axes.plot(t, sign * spread, color=BLUE, lw=1.6)
            axes.plot(expected.t_s / clock.seconds, sign * linear, color=RED, lw=1.1, ls="--")
        axes.set_ylim(-reach, reach)
        axes.set_ylabel(f"{'xyz'[k]} [{UNITS[name][0]}]", fontsize=10)
    panels[0].plot([], [], color=GREY, lw=0.8, label="runs")
    panels[0].plot([], [], color=BLUE, label="±3 sigma of the runs")
    panels[0].plot([], [], color=RED, ls="--", label="±3 sigma, linear covariance")
    _finish(panels, clock)
    return figure


def state_errors(found: FilterCheck, name: str, column: int) -> tuple[np.ndarray, ...]:
    """Errors (runs, instants) of a state, in its unit; three sigma of all runs, and of linear
    covariance; half the height of an axis on which the settled errors fill two thirds."""
    _, size = UNITS[name]
    errors = found.flown.errors[:, :, column] / size
    spread = 3.0 * np.sqrt(mean_over_runs(errors**2))
    linear = 3.0 * np.sqrt(found.expected.covariance[:, column, column]) / size
    return errors, spread, linear, 1.5 * np.nanmax(spread[len(spread) // 10 :])


def draw_consistency(
    found: FilterCheck, most: int | None = None, on: SubFigure | None = None
) -> Figure:
    """NEES and NIS per degree of freedom, mean over the runs, with 95 % bands; the first `most`."""
    flown, shown = found.flown, dict([*measures(found).items()][:most])
    clock = clock_for(flown.t_s[-1])
    title = f"NEES and NIS per degree of freedom, mean of {found.runs} runs"
    figure, panels = stack_panels(title, len(shown), 1.0 + 1.45 * len(shown), on, sharex=True)
    for axes, (name, (mean, low, high)) in zip(panels, shown.items(), strict=True):
        shade(axes, found.expected.t_s, found.expected.sun_seen, clock)
        axes.axhspan(low, high, color=GREEN, alpha=0.25, lw=0)
        axes.axhline(1.0, color=GREEN, lw=0.8)
        axes.plot(flown.t_s / clock.seconds, mean, color=BLUE, lw=0.9)
        axes.set_ylabel(name.replace(", ", "\n"), fontsize=9.5)
        if np.isfinite(mean).any():
            axes.set_ylim(*consistency_range(mean, high))
    panels[0].fill_between(
        [], [], color=GREEN, alpha=0.25, label="95 % band of a consistent filter"
    )
    panels[0].plot([], [], color=BLUE, lw=0.9, label="this filter")
    _finish(panels, clock)
    return figure


def consistency_range(mean: np.ndarray, high: float) -> tuple[float, float]:
    """Range of an axis with the band up to `high` and nearly all of the mean."""
    return 0.0, max(1.25 * high, 1.1 * float(np.nanquantile(mean, 0.98)))


def measures(found: FilterCheck) -> dict[str, tuple[np.ndarray, float, float]]:
    """NEES and NIS per degree of freedom, by what they are of: mean over the runs, 95 % band.

    Instants at which less than half of the runs have a value have none.
    """
    flown, n = found.flown, found.flown.errors.shape[-1]
    shown = {"NEES, attitude": (nees(flown, 3), 3)}
    if np.isfinite(every := nees(flown)).any():
        shown["NEES, all states"] = every, n
    for sensor, innovations in flown.innovations.items():
        if np.isfinite(innovations).any():
            shown[f"NIS, {SENSOR_WORDS.get(sensor, sensor)}"] = nis(innovations)
    return {name: _mean_and_band(*each) for name, each in shown.items()}


def _mean_and_band(values: np.ndarray, freedoms: int) -> tuple[np.ndarray, float, float]:
    there = np.isfinite(values).sum(axis=0) >= 0.5 * len(values)
    mean = np.where(there, mean_over_runs(values), np.nan) / freedoms
    return mean, *band(freedoms, len(values))


def _draw_whiteness(found: FilterCheck) -> Figure:
    """Correlation of innovations over the number of readings between them."""
    figure, (axes,) = stack_panels("Correlation of innovations", 1, 3.2)
    lags = np.arange(1, LAGS + 1)
    innovations_of = found.closely.innovations
    apart = 0.36 / max(len(innovations_of) - 1, 1)
    for k, (sensor, innovations) in enumerate(innovations_of.items()):
        rows = np.array([autocorrelation(innovations, int(lag)) for lag in lags])
        if not np.isfinite(rows).any():
            continue
        place = lags + apart * (k - 0.5 * (len(innovations_of) - 1))
        colour, name = COLOURS.get(sensor, GREY), SENSOR_WORDS.get(sensor, sensor)
        axes.vlines(place, 0.0, rows[:, 0], color=colour, lw=2.0, label=name)
        axes.fill_between(lags, -2.0 * rows[:, 1], 2.0 * rows[:, 1], color=colour, alpha=0.15, lw=0)
    axes.axhline(0.0, color=GREY, lw=0.8)
    axes.fill_between([], [], color=GREY, alpha=0.2, label="95 % band of white noise")
    axes.set_xticks(lags)
    axes.set_xlabel("lag [readings]", fontsize=10)
    axes.set_ylabel("correlation", fontsize=10)
    legend_at_left(axes, 3)
    return figure


def _finish(panels, clock: Clock) -> None:
    """Legend above, time below, and the meaning of the grey."""
    _name_grey(panels[0])
    legend_at_left(panels[0], 4)
    panels[-1].set_xlabel(f"time [{clock.unit}]", fontsize=10)
    panels[-1].margins(x=0)


def _name_grey(axes) -> None:
    axes.fill_between([], [], color=_SHADE, label="Sun not in view")


# ------------------------------------------------------------ expected and smoothed


def draw_expected(sets: list[SensorSet], title: str, path: Path) -> Path:
    """95th percentile of the attitude error over time, weakest singular value of each window."""
    clock = clock_for(sets[0].t_s[-1])
    figure, (error, weakest) = stack_panels(title, 2, 5.6, sharex=True)
    for k, each in enumerate(sets):
        colour, seen = curve_colour(k), each.observability
        error.semilogy(each.t_s / clock.seconds, each.error_deg, color=colour, label=each.name)
        middle = 0.5 * (seen.from_s + seen.to_s) / clock.seconds
        weakest.semilogy(middle, np.maximum(seen.singular[:, -1], 1e-9), "o-", color=colour, ms=3)
    for axes in (error, weakest):
        axes.margins(x=0)
        shade(axes, sets[0].t_s, sets[0].sun_seen, clock)
    error.set_ylabel("error, 95th percentile [deg]", fontsize=10)
    weakest.axhline(1.0, color=INK, lw=0.9, ls=":", label=_THRESHOLD)
    weakest.set_ylabel("weakest singular value", fontsize=10)
    _name_grey(error)
    legend_at_left(error, 2)
    legend_at_left(weakest, 1)
    weakest.set_xlabel(f"time [{clock.unit}]", fontsize=10)
    return save_figure(figure, path)


def draw_smoothed(result: xr.Dataset, smoothed: xr.Dataset, path: Path) -> Path:
    """Whole angle of the attitude error, and standard deviation stated, of filter and smoother."""
    steps = result.sel(time=smoothed["time"])
    t_s = steps["time"].values
    clock = clock_for(t_s[-1])
    title = f"{flown_scenario(result).name}: what later readings tell"
    figure, (error, stated) = stack_panels(title, 2, 5.6, sharex=True)
    true, t = steps["q_body_to_inertial"].values, t_s / clock.seconds
    kinds = (
        ("filter", RED, steps["q_estimated"], steps["attitude_sigma"]),
        ("smoothed", BLUE, smoothed["q_smoothed"], smoothed["attitude_sigma_smoothed"]),
    )
    for name, colour, q, sigma in kinds:
        whole = np.degrees(angle_between(q.values, true))
        error.semilogy(t, np.maximum(whole, 1e-9), color=colour, lw=0.8, label=name)
        stated.semilogy(t, np.degrees(sigma.values), color=colour, lw=1.3)
    seen = np.any(steps["sun_measured"].values != 0.0, axis=1)
    for axes in (error, stated):
        axes.margins(x=0)
        shade(axes, t_s, seen, clock)
    error.set_ylabel("attitude error [deg]", fontsize=10)
    stated.set_ylabel("stated, about each axis [deg]", fontsize=10)
    stated.set_xlabel(f"time [{clock.unit}]", fontsize=10)
    _name_grey(error)
    legend_at_left(error, 3)
    return save_figure(figure, path)
