"""The pictures of a campaign as plotly figures: the same numbers, light or dark."""

import math
from collections.abc import Sequence

import numpy as np
import xarray as xr

from torquer.campaign.contents import (
    campaign_table,
    end_s,
    failed_in,
    is_time,
    member_outcomes,
    missing_as_worst,
)
from torquer.campaign.summary import correlations, percent
from torquer.report.campaign.bands import bands_of, series_unit, signal_title, worst_lines
from torquer.report.campaign.convergence import mean_title
from torquer.report.campaign.correlation import columns_and_labels, most_correlated, ways_of_ending
from torquer.report.campaign.distribution import bins, share_band
from torquer.report.campaign.shared import (
    axis_label,
    correlated,
    in_words,
    input_labels,
    is_wide,
    outcome_in_words,
    settled_range,
    steps,
)
from torquer.report.campaign.sobol import greatest
from torquer.report.common.colours import BLUE, GREEN, GREY, ORANGE, RED, RUNS, SKY
from torquer.report.common.interactive import (
    MARGIN_PX,
    MENU,
    axis,
    band,
    figure,
    line,
    pack_numbers,
    shade,
    square,
    stack_traces,
    translucent,
    vertical,
)
from torquer.report.common.scales import clock_for

#: Colour of members that failed, which is dark on paper.
_FAILED = RED
#: Most instants of a line, most members of a kind, most inputs of a figure.
_MOST_INSTANTS, _MOST_POINTS, _MOST_INPUTS = 1000, 1000, 10


def distribution_figure(result: xr.Dataset, summary: dict, name: str) -> dict:
    """An outcome's histogram above its distribution function, quantiles marked in both."""
    each, values = summary["outcomes"][name], missing_as_worst(result, name)
    known = values[np.isfinite(values)]
    edges, (x, share) = bins(known), steps(values)
    counts = np.histogram(known, edges)[0]
    bars = line(np.repeat(edges, 2), [0, *np.repeat(counts, 2), 0], "members", BLUE, fill="tozeroy")
    found = [line(x, share, "share of members", BLUE, line={"shape": "hv"})]
    if is_time(result, name) and each["members"] > 1:
        x = np.append(x, max(x[-1], end_s(result) or 0.0) if each["missing"] else x[-1])
        share = np.append(share, share[-1])
        ends = share_band(share, len(values), summary["confidence"])
        label = f"{percent(summary['confidence'])} confidence interval"
        found = [*band(x, *ends, label, BLUE, shape="hv"),
                 line(x, share, "share of members", BLUE, line={"shape": "hv"})]  # fmt: skip
    shapes, marks = _marks(each, (campaign_table(result).get("success") or {}).get(name))
    panels = [([bars, *marks], axis("members")), (found, axis("share", range=[0, 1.02]))]
    x_axis = axis(axis_label(name, each["unit"]), type=_scale(known), hoverformat=".4~g")
    return stack_traces(panels, 190, x_axis, shapes=shapes, hovermode="x unified")


def _scale(values: np.ndarray) -> str:
    return "log" if is_wide(values) else "linear"


def _marks(each: dict, condition: dict | None) -> tuple[list[dict], list[dict]]:
    """Vertical lines at quantiles, mean and condition of success, and their entries."""
    quantiles = [found["value"] for found in each["quantiles"].values()]
    mean = [] if each["missing"] else [each["mean"]]
    shown = (
        ("percentiles: 1, 5, 50, 95, 99 %", quantiles, ORANGE, "solid"),
        ("mean", mean, GREY, "dash"),
        ("condition of success", (condition or {}).values(), GREEN, "solid"),
    )
    shapes, entries = [], []
    for name, places, colour, dash in shown:
        known = [place for place in places if place is not None]
        shapes += [vertical(place, colour, dash) for place in known]
        entries += [square(name, colour)] if known else []
    return shapes, entries


def bands_figure(result: xr.Dataset, summary: dict, names: list[str]) -> dict:
    """Percentiles of a signal over time, and the worst member of each outcome taken from it."""
    variable = result[f"series.{names[0]}"].transpose("member", "time")
    t_s = result["time"].values.astype(float)
    rows = np.unique(np.linspace(0, len(t_s) - 1, _MOST_INSTANTS).astype(int))
    clock = clock_for(float(t_s[-1] - t_s[0]))
    t, found = t_s[rows] / clock.seconds, bands_of(variable, ~failed_in(result), rows)
    data = [*band(t, found[0], found[4], "5 to 95 %", BLUE, 0.18),
            *band(t, found[1], found[3], "25 to 75 %", BLUE, 0.3),
            line(t, found[2], "median", BLUE, 2.0)]  # fmt: skip
    for row, label, colour in worst_lines(result, summary, names):
        data.append(line(t, variable.isel(member=row).values[rows], label, colour, 1.2))
    title = axis_label(signal_title(result, names), series_unit(result, names[0]))
    y_axis = axis(title, type=_scale(found), hoverformat=".4~g")
    x_axis = axis(f"time [{clock.unit}]", hoverformat=".4~g")
    return figure(data, 360, x_axis, y_axis)


def scatter_figure(result: xr.Dataset, summary: dict, name: str) -> dict | None:
    """An outcome over the inputs most correlated with it, one of them chosen from a menu."""
    pairs = correlations(result).get(name)
    if not pairs:
        return None
    keys, kinds = most_correlated([pairs]), ways_of_ending(result)
    columns, labels = columns_and_labels(result, keys)
    y = member_outcomes(result)[name]
    data = [_points(columns[key], y, kind, key == keys[0]) for key in keys for kind in kinds]
    buttons = [
        {"label": f"{labels[key]} ({pairs[key]:+.2f})", "method": "update", "args": [
            {"visible": [key == shown for shown in keys for _ in kinds]},
            {"xaxis.title.text": labels[key], "xaxis.type": _scale(columns[key]),
             "xaxis.autorange": True}]}
        for key in keys
    ]  # fmt: skip
    menu = {
        **MENU,
        "buttons": buttons,
        "x": 1.0,
        "xanchor": "right",
        "y": 1.02,
        "yanchor": "bottom",
    }
    y_axis = axis(axis_label(name, summary["outcomes"][name]["unit"]), type=_scale(y))
    x_axis = axis(labels[keys[0]], type=_scale(columns[keys[0]]))
    return figure(data, 340, x_axis, y_axis, updatemenus=[menu], hovermode="closest")


def _points(x: np.ndarray, y: np.ndarray, kind, visible: bool) -> dict:
    """Members of a kind that have a value, evenly thinned."""
    label, colour, rows = kind
    shown = rows[np.isfinite(y[rows])]
    missing = len(rows) - len(shown)
    shown = shown[:: math.ceil(max(len(shown), 1) / _MOST_POINTS)]
    name = f"{label}: {len(rows)}" + (f", {missing} without a value" if missing else "")
    marker = {"color": _FAILED if label == "failed" else colour, "size": 5, "opacity": 0.6}
    return {"type": "scatter", "mode": "markers", "x": pack_numbers(x[shown], "f8"),
            "y": pack_numbers(y[shown]), "name": name, "marker": marker, "visible": visible,
            "legendgroup": label}  # fmt: skip


def correlations_figure(result: xr.Dataset, summary: dict) -> dict | None:
    """Rank correlations of all outcomes with the inputs most correlated, as bars."""
    pairs = correlated(result)
    if not pairs:
        return None
    keys = most_correlated(list(pairs.values()), _MOST_INPUTS)
    chance = summary["chance_correlation"]
    data = [
        _bars(
            outcome_in_words(summary, name),
            input_labels(keys).values(),
            [found.get(key) for key in keys],
            RUNS[k % len(RUNS)],
        )
        for k, (name, found) in enumerate(pairs.items())
    ]
    data.append(square(f"up to {chance:.2g}: may be chance", translucent(GREY, 0.3)))
    x_axis = axis("Spearman's rank correlation", range=[-1.0, 1.0])
    shapes = [shade(-chance, chance, translucent(GREY, 0.3))]
    return _bars_figure(data, len(keys), len(pairs), x_axis, shapes=shapes)


def category_figure(found: dict, name: str) -> dict | None:
    """An outcome's median in each category and the range of 90 % of its members, as bars."""
    at = {
        each["value"]: [each["outcomes"][name][part]["value"] for part in ("0.05", "0.5", "0.95")]
        for each in found["categories"]
    }
    known = {value: parts for value, parts in at.items() if None not in parts}
    if not known:
        return None
    low, middle, high = np.array([*known.values()]).T
    spread = {"array": (high - middle).tolist(), "arrayminus": (middle - low).tolist()}
    error = {"type": "data", "symmetric": False, "color": GREY, "thickness": 1.2, **spread}
    label = f"median of {in_words(name, found['units'][name])}"
    data = [_bars(label, known, middle.tolist(), BLUE) | {"error_x": error}]
    return _bars_figure(data, len(known), 1, axis(axis_label(name, found["units"][name])))


def sobol_figure(groups: dict[str, dict]) -> dict:
    """First-order and total indices of an outcome with their intervals, the greatest first."""
    names, data = [*greatest(groups)], []
    for kind, colour, label in (("first", BLUE, "first-order, S1"), ("total", SKY, "total, ST")):
        sizes = [groups[name][kind] for name in names]
        ends = [[size if end is None else end for end in groups[name][f"{kind}_interval"]]
                for name, size in zip(names, sizes, strict=True)]  # fmt: skip
        low, high = np.abs(np.array(ends) - np.array(sizes)[:, None]).T.tolist()
        beyond = {"array": high, "arrayminus": low}
        error = {"type": "data", "symmetric": False, "color": GREY, "thickness": 1.2, **beyond}
        data.append(_bars(label, input_labels(names).values(), sizes, colour) | {"error_x": error})
    return _bars_figure(data, len(names), 2, axis("share of the variance"))


def _bars(name: str, keys, sizes, colour: str) -> dict:
    return {"type": "bar", "orientation": "h", "y": list(keys), "x": list(sizes), "name": name,
            "marker": {"color": colour}}  # fmt: skip


def _bars_figure(data: list[dict], rows: int, bars: int, x_axis: dict, **keys) -> dict:
    """Rows of horizontal bars, the first row on top."""
    height = MARGIN_PX["t"] + MARGIN_PX["b"] + rows * (14 * bars + 12)
    y_axis = axis("", autorange="reversed", type="category", showgrid=False)
    keys = {"barmode": "group", "hovermode": "y unified", **keys}
    return figure(data, max(height, 180), x_axis, y_axis, **keys)


def convergence_figure(name: str, counts, found: np.ndarray, result, summary: dict) -> dict:
    """A mean or the success rate of the first members, with its interval."""
    label = f"{percent(summary['confidence'])} confidence interval"
    data = [*band(counts, found[:, 1], found[:, 2], label, BLUE),
            line(counts, found[:, 0], "estimate", BLUE)]  # fmt: skip
    stop = campaign_table(result).get("stop") or {}
    if stop.get("outcome") == name:
        ends = [found[-1, 0] + sign * stop["half_width"] for sign in (-1.0, 1.0)]
        data += [line(counts[[0, -1]], [end] * 2, "requested width", GREEN) for end in ends]
        data[-1]["showlegend"] = False
    x_axis = axis("members", type="log")
    y_axis = axis(mean_title(summary, name), hoverformat=".4~g")
    if shown := settled_range(counts, found):
        y_axis["range"] = [*shown]
    return figure(data, 260, x_axis, y_axis)


def cdf_figure(
    results: Sequence[xr.Dataset], labels: list[str], name: str, unit: str
) -> dict | None:
    """Distribution functions of an outcome in campaigns; None if no member has a value."""
    values = [missing_as_worst(each, name) for each in results]
    known = np.concatenate([each[np.isfinite(each)] for each in values])
    if not len(known):
        return None
    data = [
        line(*steps(each), label, colour, 2.0, line={"shape": "hv"})
        for each, label, colour in zip(values, labels, RUNS, strict=False)
        if np.isfinite(each).any()
    ]
    x_axis = axis(axis_label(name, unit), type=_scale(known), hoverformat=".4~g")
    y_axis = axis("share of members", range=[0.0, 1.02])
    return figure(data, 320, x_axis, y_axis)


def difference_figure(label: str, middle: float, low: float, high: float) -> dict:
    """A difference B - A with its interval, zero marked: orange if the interval excludes it."""
    colour = BLUE if low <= 0.0 <= high else ORANGE
    reach = 1.1 * max(abs(low), abs(high)) or 1.0
    data = [line([low, high], [0, 0], "interval", colour, 5.0),
            {**line([middle], [0], "difference", colour), "mode": "markers",
             "marker": {"color": colour, "size": 12}}]  # fmt: skip
    y_axis = {"visible": False, "range": [-1, 1], "fixedrange": True}
    zero, x_axis = vertical(0.0, GREY), axis(label, range=[-reach, reach])
    return figure(data, 110, x_axis, y_axis, shapes=[zero], hovermode="closest")
