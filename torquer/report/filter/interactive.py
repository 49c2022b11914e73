"""The pictures of a filter's statistics as plotly figures: the same numbers, light or dark."""

import numpy as np

from torquer.analysis.filters.filter_check import FilterCheck
from torquer.analysis.filters.filter_statistics import autocorrelation
from torquer.analysis.series import bands_where
from torquer.computer.estimation.sensor_keys import SENSOR_WORDS
from torquer.report.common.colours import BLUE, GREEN, GREY, RED
from torquer.report.common.interactive import (
    MOST_BANDS,
    NIGHT,
    axis,
    band,
    figure,
    line,
    shade,
    square,
    stack_traces,
)
from torquer.report.common.scales import Clock, clock_for
from torquer.report.filter.pictures import (
    COLOURS,
    LAGS,
    UNITS,
    by_name,
    consistency_range,
    measures,
    state_errors,
)

#: Runs drawn one by one, most instants of these, most instants of other lines.
RUNS, _OF_RUNS, _MOST_INSTANTS = 10, 400, 1500


def errors_figure(found: FilterCheck, name: str, first: int) -> dict:
    """Three states: errors of some runs within three sigma of all runs and of linear covariance."""
    flown, expected = found.flown, found.expected
    clock = clock_for(flown.t_s[-1])
    few, rows = _rows(flown.t_s, _OF_RUNS), _rows(flown.t_s, _MOST_INSTANTS)
    others = _rows(expected.t_s, _MOST_INSTANTS)
    panels = []
    for k in range(3):
        errors, spread, linear, reach = state_errors(found, name, first + k)
        traces = [_runs(flown.t_s[few] / clock.seconds, errors[:RUNS, few])]
        for x, y, label, colour, dash in (
            (flown.t_s[rows], spread[rows], "±3 sigma of the runs", BLUE, "solid"),
            (expected.t_s[others], linear[others], "±3 sigma, linear covariance", RED, "dash"),
        ):
            both = [line(x / clock.seconds, sign * y, label, colour, line={"dash": dash})
                    for sign in (1.0, -1.0)]  # fmt: skip
            traces += [both[0], both[1] | {"showlegend": False}]
        label = f"{'xyz'[k]} [{UNITS[name][0]}]"
        panels.append((traces, axis(label, range=[-float(reach), float(reach)])))
    return _over_time(found, panels, 190, clock)


def _rows(t_s, most: int) -> np.ndarray:
    """Rows of at most so many instants, evenly spread."""
    return np.unique(np.linspace(0, len(t_s) - 1, most).astype(int))


def _runs(t, errors: np.ndarray) -> dict:
    """Single runs as one broken line."""
    gap = np.full((len(errors), 1), np.nan)
    x, y = np.hstack([np.tile(t, (len(errors), 1)), gap]), np.hstack([errors, gap])
    thin = line(x.ravel(), y.ravel(), f"{len(errors)} of the runs", GREY, 0.6, hoverinfo="skip")
    return {**thin, "opacity": 0.6}


def _over_time(found: FilterCheck, panels, panel_px: int, clock: Clock) -> dict:
    """Panels over time, shaded where no Sun sensor sees the Sun."""
    expected = found.expected
    hidden = bands_where(expected.t_s, 1.0 - np.asarray(expected.sun_seen, dtype=float))
    if 0 < len(hidden) <= MOST_BANDS:
        panels[0][0].append(square("Sun not in view", NIGHT))
    shapes = [shade(a / clock.seconds, b / clock.seconds, NIGHT) for a, b in hidden]
    ended = float(found.flown.t_s[-1]) / clock.seconds
    x_axis = axis(f"time [{clock.unit}]", range=[0.0, ended], hoverformat=".4~g")
    return stack_traces(panels, panel_px, x_axis, shapes=shapes[:MOST_BANDS], hovermode="x unified")


def consistency_figure(found: FilterCheck) -> dict:
    """NEES and NIS per degree of freedom, mean over the runs, with 95 % bands."""
    clock, panels = clock_for(found.flown.t_s[-1]), []
    rows = _rows(found.flown.t_s, _MOST_INSTANTS)
    t = found.flown.t_s[rows] / clock.seconds
    for name, (all_means, low, high) in measures(found).items():
        mean = all_means[rows]
        within = "95 % band of a consistent filter"
        traces = [*band(t[[0, -1]], [low] * 2, [high] * 2, within, GREEN, 0.25),
                  line(t, mean, "this filter", BLUE, 1.0)]  # fmt: skip
        keys = {}
        if np.isfinite(mean).any():
            keys["range"] = [*consistency_range(mean, high)]
        panels.append((traces, axis(name.replace(", ", "<br>"), hoverformat=".3~g", **keys)))
    return _over_time(found, panels, 150, clock)


def whiteness_figure(found: FilterCheck) -> dict:
    """Correlation of innovations over the number of readings between them."""
    lags, data = np.arange(1, LAGS + 1), []
    for sensor, innovations in found.closely.innovations.items():
        rows = np.array([autocorrelation(innovations, int(lag)) for lag in lags])
        if not np.isfinite(rows).any():
            continue
        colour, name = COLOURS.get(sensor, GREY), SENSOR_WORDS.get(sensor, sensor)
        white = f"95 % band of white noise, {name}"
        data += band(lags, -2.0 * rows[:, 1], 2.0 * rows[:, 1], white, colour, 0.15)
        data.append(line(lags, rows[:, 0], name, colour, mode="lines+markers"))
    x_axis = axis("lag [readings]", dtick=1)
    y_axis = axis("correlation", hoverformat=".3~f")
    return figure(data, 320, x_axis, y_axis)


def make_figures(found: FilterCheck) -> dict[str, dict]:
    """All figures of a check by the names of its pictures; none if nothing started."""
    return by_name(found, errors_figure, consistency_figure, whiteness_figure)
