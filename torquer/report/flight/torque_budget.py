"""The torque budget as a picture: sizes over time, and RMS values against the coils' torque."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from torquer.analysis.budget import NAMES, Budget, budget_rows
from torquer.report.common.figure import FAINT, INK, legend_at_left, save_figure, stack_panels
from torquer.report.common.scales import clock_for, log_ends
from torquer.report.flight.panels.torques import COLOURS

#: Decades of the axes below the greatest value.
_DECADES = 5.0
#: Part of the greatest value at which an axis begins at most: it has a power of ten to read it by.
_LEAST_SHOWN = 0.1


def draw_budget(budget: Budget, title: str, path: Path) -> Path:
    """Write the picture as a PNG file."""
    bars = len(budget.disturbance) + 2
    figure, (over_time, by_size) = stack_panels(
        title, 2, 3.6 + 0.27 * bars, height_ratios=(3.0, 0.27 * bars)
    )
    _draw_sizes(over_time, budget)
    _draw_bars(by_size, budget)
    return save_figure(figure, path)


def _draw_sizes(axes, budget: Budget) -> None:
    """Size of each torque over time, on a logarithmic axis where any is above zero."""
    clock = clock_for(float(budget.t_s[-1]))
    t = budget.t_s / clock.seconds
    sizes = {k: np.linalg.norm(torque, axis=1) for k, torque in budget.disturbance.items()}
    for name, size in sizes.items():
        shown = np.where(size > 0.0, size, np.nan)
        axes.plot(t, shown, lw=1.2, color=COLOURS[name], label=NAMES[name])
    if budget.available is not None:
        axes.plot(t, budget.available, lw=1.2, color=INK, ls=(0, (4, 2)), label="coils, at most")
    others: Sequence[float] | np.ndarray = [] if budget.available is None else budget.available
    _log_axis(axes, "y", [*sizes.values()], others)
    axes.set_xlim(t[0], t[-1] if t[-1] > t[0] else t[0] + 1.0)
    axes.set_xlabel(f"time [{clock.unit}]", fontsize=9.5)
    axes.set_ylabel("|M| [N m]", fontsize=10)
    if not axes.lines:
        return
    legend_at_left(axes, 4, 8.5)


def _draw_bars(axes, budget: Budget) -> None:
    """RMS size of each torque, and the greatest as a mark."""
    rows = budget_rows(budget)
    places, sizes = np.arange(len(rows)), np.array([row.rms_size_n_m for row in rows.values()])
    axes.barh(places, sizes, height=0.62, color=[COLOURS.get(name, FAINT) for name in rows])
    greatest = [row.greatest_size_n_m for row in rows.values()]
    axes.plot(greatest, places, "|", color=INK, ms=9, label="greatest")
    usual = None if budget.available is None else float(budget.available.mean())
    if usual is not None:
        axes.axvline(usual, color=INK, lw=1.2, ls=(0, (4, 2)), label="coils, at most (mean)")
    _log_axis(axes, "x", [sizes], [*greatest, *filter(None, [usual])])
    axes.set_yticks(places, [NAMES[name] for name in rows], fontsize=9)
    axes.invert_yaxis()
    axes.grid(False, axis="y")
    axes.set_xlabel("RMS |M| [N m]", fontsize=9.5)
    axes.legend(
        loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, frameon=False, fontsize=8.5,
        borderaxespad=0.1, handlelength=1.5,
    )  # fmt: skip


def _log_axis(axes, which: str, series, others) -> None:
    values = np.concatenate(series) if series else np.zeros(1)
    ends = log_ends(values, _DECADES, _LEAST_SHOWN, others)
    if ends is None:
        return
    getattr(axes, f"set_{which}scale")("log")
    getattr(axes, f"set_{which}lim")(*ends)
