"""Picture of a sweep: guaranteed rate and momentum over an angle of the layout."""

from pathlib import Path

import numpy as np

from torquer.design.wheel_file import WheelDesign
from torquer.design.wheel_sweep import Sweep
from torquer.report.common.colours import BLUE, GREY, ORANGE
from torquer.report.common.figure import INK, legend_at_left, save_figure, stack_panels


def draw_sweep(design: WheelDesign, sweep: Sweep, path: Path) -> Path:
    """Write the picture: the whole array, and the array after its worst single failure."""
    title = f"{sweep.key} swept · {design.description or design.name}"
    figure, (upper, lower) = stack_panels(title, 2, 5.4, sharex=True)
    angles = np.array([point.value for point in sweep.points])
    for name, colour in (("whole", BLUE), ("one_failed", ORANGE)):
        able = np.array([getattr(point, name) for point in sweep.points])
        label = "all wheels" if name == "whole" else "worst single failure"
        lower.plot(angles, able[:, 0], color=colour, lw=1.6)
        upper.plot(angles, able[:, 1], color=colour, lw=1.6, label=label)
    best = sweep.best()
    upper.plot(best.value, best.whole.rate_deg_s, "o", color=BLUE, ms=5)
    upper.annotate(
        f"{best.value:.4g} deg: {best.whole.rate_deg_s:.4g} deg/s",
        (best.value, best.whole.rate_deg_s), (0, 7), textcoords="offset points", fontsize=9,
        color=INK, ha="right" if best.value > angles.mean() else "left",
    )  # fmt: skip
    if design.demand.rate_deg_s is not None:
        upper.axhline(design.demand.rate_deg_s, color=GREY, lw=1.1, ls="--", label="demand")
    upper.set_ylabel("rate about any axis [deg/s]", fontsize=10)
    lower.set_ylabel("momentum [N m s]", fontsize=10)
    lower.set_xlabel(f"{sweep.key.removesuffix('_deg')} [deg]", fontsize=10)
    for axes in (upper, lower):
        axes.set_ylim(0.0, 1.12 * axes.get_ylim()[1])
        axes.set_xlim(angles[0], angles[-1])
    legend_at_left(upper, 3)
    return save_figure(figure, path)
