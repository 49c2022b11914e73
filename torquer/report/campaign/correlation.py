"""Which inputs outcomes depend on: scatter of members, rank correlations."""

import math

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from torquer.campaign.contents import failed_in, member_inputs, member_outcomes, succeeded_in
from torquer.campaign.statistics import as_columns
from torquer.report.campaign.shared import (
    axis_label,
    bar_axes,
    bar_labels,
    correlated,
    fit_label,
    input_labels,
    is_wide,
    outcome_in_words,
)
from torquer.report.common.colours import BLUE, GREY, ORANGE
from torquer.report.common.figure import INK, SMALL, foot, place, quiet, sheet

#: Most inputs and outcomes that are scattered against each other, and most points of a kind.
_MOST_INPUTS, _MOST_OUTCOMES, _MOST_POINTS = 4, 6, 2000
#: Most bars of an outcome.
_MOST_BARS = 10
_CELL, _TALL, _GAP, _HEAD = 2.15, 1.5, 0.22, 0.75
#: Letters of a line, and lines, of labels below a cell and beside it.
_IN_LINES, _BESIDE = (34, 2), (22, 2)


def draw_scatter(result: xr.Dataset, summary: dict) -> Figure | None:
    """Outcomes over the inputs most correlated with them; None without correlations."""
    pairs = correlated(result)
    names = [name for name in member_outcomes(result) if name in pairs][:_MOST_OUTCOMES]
    if not names:
        return None
    keys = most_correlated([pairs[name] for name in names])
    columns, labels = columns_and_labels(result, keys)
    width, height = 1.1 + len(keys) * (_CELL + _GAP), _HEAD + len(names) * (_TALL + _GAP) + 0.75
    figure = sheet(max(width, 6.4), height, f"Members · {summary['name']}")
    kinds = ways_of_ending(result)
    for i, name in enumerate(names):
        values = member_outcomes(result)[name]
        for j, key in enumerate(keys):
            left, top = 0.85 + j * (_CELL + _GAP), _HEAD + i * (_TALL + _GAP)
            axes = place(figure, left, top, _CELL, _TALL)
            _draw_cell(axes, columns[key], values, kinds)
            above = f"{pairs[name][key]:+.2f}" if key in pairs[name] else ""
            axes.set_title(above, fontsize=SMALL - 1, loc="right", color=INK, pad=4)
            axes.tick_params(labelbottom=i == len(names) - 1, labelleft=j == 0, labelsize=7)
            if i == len(names) - 1:
                axes.set_xlabel(fit_label(labels[key], *_IN_LINES), fontsize=SMALL - 1)
            if j == 0:
                label = axis_label(name, summary["outcomes"][name]["unit"])
                axes.set_ylabel(fit_label(label, *_BESIDE), fontsize=SMALL - 1)
    _legend(figure, kinds)
    foot(figure, _about(kinds))
    return figure


def columns_and_labels(result: xr.Dataset, keys: list[str]) -> tuple[dict, dict[str, str]]:
    """Numbers [n] and labels of inputs; times count in days."""
    columns = as_columns(member_inputs(result))
    labels = input_labels(keys)
    for key in keys:
        if key in result and result[key].dtype.kind == "M":
            columns[key] = (columns[key] - columns[key].min()) / 86400.0
            labels[key] = f"{labels[key]} [d after the earliest]"
    return columns, labels


def _about(kinds) -> str:
    text = "above each: rank correlation; triangles at the edge: members without a value"
    if any(len(rows) > _MOST_POINTS for _, _, rows in kinds):
        text += f"; at most {_MOST_POINTS} of each kind are shown"
    return text


def most_correlated(found: list[dict[str, float]], count: int = _MOST_INPUTS) -> list[str]:
    """Inputs in order of their greatest correlation with any outcome."""
    greatest = {key: max(abs(each.get(key, 0.0)) for each in found) for key in found[0]}
    return sorted(greatest, key=lambda key: -greatest[key])[:count]


def ways_of_ending(result: xr.Dataset) -> list[tuple[str, str, np.ndarray]]:
    """Label, colour and rows of members, by how they ended."""
    failed, succeeded = failed_in(result), succeeded_in(result)
    if succeeded is None:
        kinds = [("complete", BLUE, ~failed)]
    else:
        kinds = [("successful", BLUE, succeeded & ~failed),
                 ("unsuccessful", ORANGE, ~succeeded & ~failed)]  # fmt: skip
    kinds.append(("failed", INK, failed))
    return [(label, colour, np.flatnonzero(which)) for label, colour, which in kinds if which.any()]


def _draw_cell(axes, x, y, kinds) -> None:
    """Members as points; those without a value as triangles at the upper edge."""
    quiet(axes)
    axes.set_xscale("log" if is_wide(x) else "linear")
    axes.set_yscale("log" if is_wide(y) else "linear")
    for _, colour, rows in kinds:
        shown = rows[:: math.ceil(len(rows) / _MOST_POINTS)]
        opacity = 0.35 if len(shown) > 500 and colour == BLUE else 0.75
        size = 3.5 if len(x) > 100 else 6.0
        axes.plot(x[shown], y[shown], ".", ms=size, mew=0, color=colour, alpha=opacity)
        missing = shown[np.isnan(y[shown])]
        axes.plot(x[missing], np.full(len(missing), 1.0), "v", ms=4, mew=0, color=colour,
                  transform=axes.get_xaxis_transform(), clip_on=False)  # fmt: skip
    for axis, values in (("x", x), ("y", y)):
        if not is_wide(values):
            axes.locator_params(axis=axis, nbins=4)


def _legend(figure: Figure, kinds) -> None:
    handles = [
        Line2D([], [], marker="o", ls="", ms=4, mew=0, color=colour, label=f"{label}: {len(rows)}")
        for label, colour, rows in kinds
    ]
    top = 1.0 - 0.3 / figure.get_figheight()
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.0, top), ncols=3,
                  frameon=False, fontsize=SMALL, handletextpad=0.2)  # fmt: skip


# ------------------------------------------------------------------ bars


def draw_correlations(result: xr.Dataset, summary: dict) -> Figure | None:
    """Rank correlations of each outcome as bars, and their size by chance alone."""
    pairs = correlated(result)
    if not pairs:
        return None
    bars = {
        name: {key: found[key] for key in most_correlated([found], _MOST_BARS)}
        for name, found in pairs.items()
    }
    heights = [0.45 + 0.19 * len(found) for found in bars.values()]
    figure = sheet(7.2, 0.5 + sum(heights) + 0.65, f"Rank correlations · {summary['name']}")
    top, chance = 0.5, summary["chance_correlation"]
    make_axes = bar_axes(figure, bars.values())
    for (name, found), height in zip(bars.items(), heights, strict=True):
        axes = make_axes(top + 0.3, height - 0.35, outcome_in_words(summary, name))
        _draw_bars(axes, found, chance)
        top += height
        axes.tick_params(labelbottom=top > sum(heights))
    axes.set_xlabel("Spearman's rank correlation", fontsize=SMALL)
    foot(figure, f"grey band: up to {chance:.2g}, which one in "
                 f"{1.0 / (1.0 - summary['confidence']):.3g} exceeds by chance")  # fmt: skip
    return figure


def _draw_bars(axes, found: dict[str, float], chance: float) -> None:
    quiet(axes)
    axes.grid(False, axis="y")
    axes.axvspan(-chance, chance, color=GREY, alpha=0.2, lw=0)
    axes.axvline(0.0, color=INK, lw=0.8)
    colours = [BLUE if abs(r) > chance else GREY for r in found.values()]
    axes.barh(range(len(found)), list(found.values()), 0.7, color=colours)
    axes.set_yticks(range(len(found)), bar_labels(found), fontsize=7.5)
    axes.set_ylim(len(found) - 0.45, -0.55)
    axes.set_xlim(-1.0, 1.0)
