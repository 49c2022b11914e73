"""A pointing budget as a picture: each cause's errors, predicted beside flown."""

import math

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator

from torquer.design.pointing_answer import BudgetLine, PointingBudget
from torquer.report.common.colours import BLUE, ORANGE
from torquer.report.common.figure import stack_panels
from torquer.report.common.scales import log_ends

_TITLES = {
    "ape": "attitude (APE) [deg rms]",
    "rpe": "stability (RPE) [deg rms]",
    "ake": "knowledge (AKE) [deg rms]",
}
#: Decades of the axes below the greatest value.
_DECADES = 5.0
_ROW, _EDGE = 0.3, 0.75
#: An axis begins at this part of its greatest value at most, so that it has more than one tick.
_LEAST_SHOWN = 0.05
#: Ratio of an axis' ends below which its decades are too few to read it by.
_FEW_DECADES = 300.0


def draw_pointing(budget: PointingBudget) -> Figure:
    """Bars of each error by cause, predicted and flown, on logarithmic axes."""
    shown = {kind: _shown(budget, kind) for kind in _TITLES}
    shown = {kind: lines for kind, lines in shown.items() if lines}
    rows = [len(lines) for lines in shown.values()]
    height = _ROW * sum(rows) + _EDGE * len(rows) + 0.5
    figure, panels = stack_panels(
        f"Pointing budget of {budget.scenario.name}", len(rows), height, height_ratios=rows
    )
    for axes, (kind, lines) in zip(panels, shown.items(), strict=True):
        _draw_bars(axes, kind, lines)
    panels[0].legend(
        loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, frameon=False, fontsize=8.5,
        borderaxespad=0.1, handlelength=1.5,
    )  # fmt: skip
    return figure


def _shown(budget: PointingBudget, kind: str) -> list[BudgetLine]:
    """The lines that have such an error."""
    lines = [line for line in (*budget.causes, budget.total) if max(_sizes(line, kind)) > 0.0]
    greatest = max((max(_sizes(line, kind)) for line in lines), default=0.0)
    return [line for line in lines if max(_sizes(line, kind)) > 10.0**-_DECADES * greatest]


def _sizes(line: BudgetLine, kind: str) -> tuple[float, float]:
    """Predicted and flown [deg], zero for none."""
    predicted = 0.0 if line.predicted is None else line.predicted[kind].rms_rad
    measured = line.measured(kind)
    flown = 0.0 if measured is None else measured.errors.rms_rad
    return math.degrees(predicted), math.degrees(flown)


def _set_ticks(axes) -> None:
    """Numbers at the decades, of a few decades at 2 and 5 of each too: others overlap."""
    low, high = axes.get_xlim()
    subs = (1.0, 2.0, 5.0) if high < _FEW_DECADES * low else (1.0,)
    axes.xaxis.set_major_locator(LogLocator(subs=subs))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axes.xaxis.set_minor_formatter("")


def _draw_bars(axes, kind: str, lines: list[BudgetLine]) -> None:
    places, sizes = np.arange(len(lines)), np.array([_sizes(line, kind) for line in lines])
    pairs = [("predicted", BLUE, -0.19), ("flown", ORANGE, 0.19)]
    if not any(line.flown for line in lines):
        pairs = [("predicted", BLUE, 0.0)]
    for k, (label, colour, shift) in enumerate(pairs):
        axes.barh(places + shift, sizes[:, k], height=0.36, color=colour, label=label)
    ends = log_ends(sizes.ravel(), _DECADES, _LEAST_SHOWN)
    if ends is not None:
        axes.set_xscale("log")
        axes.set_xlim(*ends)
        _set_ticks(axes)
    axes.set_yticks(places, [line.cause.label for line in lines], fontsize=9)
    axes.invert_yaxis()
    axes.grid(False, axis="y")
    axes.set_xlabel(_TITLES[kind], fontsize=9.5)
