"""The distribution of an outcome: histogram and empirical distribution function.

That of a time is drawn to the end of the run where members had not arrived by then, which are
censored; unless the end is so far that the times of the others would not show.
"""

import math

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from torquer.base.language import told
from torquer.campaign.contents import campaign_table, end_s, is_time, missing_as_worst
from torquer.campaign.statistics import rate_interval
from torquer.campaign.summary import percent
from torquer.report.campaign.shared import axis_label, in_words, is_wide, steps
from torquer.report.common.colours import BLUE, GREEN, ORANGE
from torquer.report.common.figure import INK, SMALL, foot, place, quiet, sheet

_WIDTH, _HEIGHT, _LEFT, _WIDE = 7.2, 4.7, 0.75, 6.2
#: An end of the run that is farther beyond the last member, over their range, is not drawn.
_FARTHEST = 2.0
#: Room for the name of a quantile [inch].
_NAME_IN = 0.45
_LABELS = {"0.01": "1 %", "0.05": "5 %", "0.5": "50 %", "0.95": "95 %", "0.99": "99 %"}


def draw_distribution(result: xr.Dataset, summary: dict, name: str) -> Figure:
    """An outcome's histogram above its distribution function, quantiles marked in both."""
    named = in_words(name, summary["outcomes"][name]["unit"])
    figure = sheet(_WIDTH, _HEIGHT, f"{named} · {summary['name']}")
    upper = place(figure, _LEFT, 0.75, _WIDE, 1.65)
    lower = place(figure, _LEFT, 2.55, _WIDE, 1.45)
    values = missing_as_worst(result, name)
    known = values[np.isfinite(values)]
    upper.hist(known, bins(known), color=BLUE, alpha=0.75, lw=0.5, edgecolor="white")
    upper.yaxis.set_major_locator(MaxNLocator(5, integer=True))
    upper.set_ylabel("members", fontsize=SMALL)
    _frame(upper, result, summary, name)
    upper.tick_params(labelbottom=False)
    name_marks(upper, result, summary, name)
    foot(figure, draw_shares(lower, result, summary, name))
    return figure


def draw_shares(axes, result: xr.Dataset, summary: dict, name: str) -> str:
    """The distribution function of an outcome, quantiles marked; what the marks mean."""
    each, values = summary["outcomes"][name], missing_as_worst(result, name)
    x, share = steps(values)
    axes.set_ylabel("share of members", fontsize=SMALL)
    axes.set_ylim(0.0, 1.02)
    axes.set_xlabel(axis_label(name, each["unit"]), fontsize=SMALL)
    levels = _frame(axes, result, summary, name)
    beyond = [*x, axes.get_xlim()[1]], [*share, share[-1]]
    is_censored = is_time(result, name)
    if is_censored and each["members"] > 1:
        low, high = share_band(beyond[1], len(values), summary["confidence"])
        axes.fill_between(beyond[0], low, high, step="post", color=BLUE, alpha=0.22, lw=0)
    axes.plot(*beyond, color=BLUE, lw=1.4, drawstyle="steps-post")
    words = _words(each, levels, axes.get_xlim())
    if is_censored:
        words = f"{words}; band: {percent(summary['confidence'])} confidence interval"
    return words


def _frame(axes, result: xr.Dataset, summary: dict, name: str) -> list[float]:
    """Scale, range and marks of an axis over the values of an outcome; its condition's levels."""
    each, values = summary["outcomes"][name], missing_as_worst(result, name)
    known = values[np.isfinite(values)]
    levels = _levels(result, name)
    edges, end = bins(known), end_s(result) if is_time(result, name) else None
    quiet(axes)
    axes.set_xscale("log" if is_wide(known) else "linear")
    axes.set_xlim(edges[0], _right_end(axes, edges, end if each["missing"] else None))
    _mark(axes, each, levels)
    return levels


def share_band(share, members: int, confidence: float) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the confidence interval of the share at each time.

    A member that has not arrived is censored at the end of the run; one whose run failed counts as
    one that never arrives. At each time the number of those that have arrived is binomial.
    """
    found = [rate_interval(round(part * members), members, confidence) for part in share]
    return tuple(np.array(found).T)


def _levels(result: xr.Dataset, name: str) -> list[float]:
    """What an outcome must be below or above to be a success."""
    condition = (campaign_table(result).get("success") or {}).get(name) or {}
    return [level for level in condition.values() if level is not None]


def _right_end(axes, edges, end: float | None) -> float:
    """The end of the run, or a little beyond the last member, so that its step shows."""
    first, last = float(edges[0]), float(edges[-1])
    if axes.get_xscale() == "log":
        beyond, farthest = last * (last / first) ** 0.02, last * (last / first) ** _FARTHEST
    else:
        beyond, farthest = last + 0.02 * (last - first), last + _FARTHEST * (last - first)
    return max(beyond, end) if end is not None and end <= farthest else beyond


def bins(known: np.ndarray) -> np.ndarray:
    """Edges of a histogram's bins, by Rice's rule; in equal ratios for values of a wide range."""
    low, high = float(known.min()), float(known.max())
    if low == high:
        half = 0.5 * abs(low) or 0.5
        low, high = low - half, high + half
    count = min(max(math.ceil(2.0 * len(known) ** (1.0 / 3.0)), 5), 60)
    return (
        np.geomspace(low, high, count + 1) if is_wide(known) else np.linspace(low, high, count + 1)
    )


def _mark(axes, each: dict, levels: list[float]) -> None:
    """Quantiles, the mean, and what the outcome must be below or above."""
    for found in each["quantiles"].values():
        if found["value"] is not None:
            axes.axvline(found["value"], color=ORANGE, lw=1.0)
    if not each["missing"]:
        axes.axvline(each["mean"], color=INK, lw=1.0, ls=(0, (4, 3)))
    low, high = axes.get_xlim()
    for level in levels:
        if low < level < high:
            axes.axvline(level, color=GREEN, lw=1.6)


def name_marks(axes, result: xr.Dataset, summary: dict, name: str) -> None:
    """Names above the lines; one for several lines whose names would overlap."""
    each = summary["outcomes"][name]
    known = {_LABELS[k]: q["value"] for k, q in each["quantiles"].items() if q["value"] is not None}
    if not each["missing"]:
        known[told("mean")] = each["mean"]
    levels = _levels(result, name)
    known |= {told("limit") if len(levels) == 1 else f"{level:.4g}": level for level in levels}
    room = _NAME_IN * axes.figure.dpi / axes.get_window_extent().width
    places = {label: _along(axes, value) for label, value in known.items()}
    shown = {label: at for label, at in places.items() if 0.0 <= at <= 1.0}
    for label, at in apart(dict(sorted(shown.items(), key=lambda one: one[1])), room):
        axes.text(at, 1.02, label, transform=axes.transAxes, ha="center", fontsize=SMALL - 1,
                  color=INK)  # fmt: skip


def apart(ascending: dict[str, float], room: float) -> list[tuple[str, float]]:
    """Names and their middles, 0..1, of lines along an axis, within it; neighbours closer than the
    room of a name are joined."""
    groups: list[tuple[list[str], list[float]]] = []
    for label, at in ascending.items():
        labels, places = [label], [at]
        while groups:
            before, beside = groups[-1]
            free = _middle(places, room) - _middle(beside, room)
            if free >= 0.5 * room * (len(before) + len(labels)):
                break
            groups.pop()
            labels, places = before + labels, beside + places
        groups.append((labels, places))
    return [(", ".join(labels), _middle(places, room)) for labels, places in groups]


def _middle(places: list[float], room: float) -> float:
    """Where the names of lines stand, as near to these as the ends of the axis allow."""
    half = min(0.5 * room * len(places), 0.5)
    return float(np.clip(np.mean(places), half, 1.0 - half))


def _along(axes, x: float) -> float:
    """Place of a value along the axis, 0..1."""
    return float(axes.transAxes.inverted().transform(axes.transData.transform((x, 0.0)))[0])


def _words(each: dict, levels: list[float], shown: tuple[float, float]) -> str:
    words = ["orange: percentiles"] + ([] if each["missing"] else ["dashed: mean"])
    if any(shown[0] < level < shown[1] for level in levels):
        words.append("green: condition of success")
    words += [
        f"condition of success ({level:.4g}) outside the axis"
        for level in levels
        if not shown[0] < level < shown[1]
    ]
    if each["missing"]:
        words.append(f"{each['missing']} members without a value")
    return "; ".join(words)
