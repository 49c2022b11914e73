"""The picture of the work-precision benchmark: a panel a task, a line an integrator."""

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from torquer.report.common.colours import BLUE, GREEN, GREY, ORANGE, PINK, RED, SKY
from torquer.report.common.figure import FINE_DPI, quiet

#: Name, colour, marker, line: ours in full, others broken.
STYLES = {
    "auto": ("adaptive (auto)", BLUE, "o", "-"),
    "dop853": ("DOP853", SKY, "s", "-"),
    "rk4": ("RK4", RED, "^", "-"),
    "splitting": ("splitting", GREEN, "D", "-"),
    "heyoka": ("heyoka, Taylor", "#222222", "v", "--"),
    "scipy": ("SciPy, DOP853", ORANGE, "P", "--"),
    "basilisk rk4": ("Basilisk, RK4", PINK, "<", "--"),
    "basilisk rkf78": ("Basilisk, RKF78", GREY, ">", "--"),
}
_COLUMNS = 3
#: Range of errors [rad] that is drawn.
_LEAST, _MOST = 1e-13, 1.0


def draw(tasks: dict, path: Path) -> None:
    """Write the picture."""
    rows = -(-(len(tasks) + 1) // _COLUMNS)
    figure = Figure(figsize=(13.0, 3.7 * rows), facecolor="white", layout="constrained")
    axes = figure.subplots(rows, _COLUMNS).ravel()
    for each, found in zip(axes, tasks.values(), strict=False):
        _panel(each, found)
    for each in axes[len(tasks) :]:
        each.set_axis_off()
    _legend(axes[len(tasks)])
    FigureCanvasAgg(figure).print_figure(path, dpi=0.7 * FINE_DPI)


def _panel(axes, found: dict) -> None:
    floor = found["floor_rad"]
    for name, curve in found["setting, us per s, rad"].items():
        _, cost, error = np.array(curve).T
        shown = error < _MOST
        _, colour, marker, line = STYLES[name]
        axes.plot(
            np.maximum(error, 0.7 * floor)[shown], cost[shown],
            color=colour, marker=marker, ls=line, ms=4.0, lw=1.2,
        )  # fmt: skip
    axes.set(xscale="log", yscale="log", xlim=(min(_LEAST, 0.3 * floor), _MOST))
    axes.axvspan(axes.get_xlim()[0], floor, color="#ececec", zorder=0)
    axes.set_title(found["title"], fontsize=10.5, loc="left", fontweight="bold")
    axes.set_xlabel("greatest error of the attitude [rad]", fontsize=9)
    axes.set_ylabel("µs per simulated second", fontsize=9)
    low, high = np.log10(axes.get_ylim())
    axes.set_ylim(10.0 ** np.floor(low), 10.0 ** np.ceil(high))
    quiet(axes)


def _legend(axes) -> None:
    handles = [
        Line2D([], [], color=colour, marker=marker, ls=line, ms=5.0, lw=1.4, label=label)
        for label, colour, marker, line in STYLES.values()
    ]
    handles.append(Patch(color="#e4e4e4", label="below what the reference is known to"))
    axes.legend(
        handles=handles, loc="center left", frameon=False, fontsize=11, alignment="left",
        title="Lower left is better.\nOne core, stepping alone.", title_fontsize=11,
    )  # fmt: skip
