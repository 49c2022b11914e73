"""Picture of the expected accuracy of sensor sets, and of the gaps in their observability."""

from pathlib import Path

import numpy as np

from torquer.analysis.filters.sensor_sets import SensorSet
from torquer.report.common.colours import BLUE, GREEN, ORANGE, PINK, RED, SKY
from torquer.report.common.figure import legend_at_left, stack_panels
from torquer.report.common.scales import clock_for
from torquer.report.filter.pictures import save_figure, shade

_COLOURS = (BLUE, RED, GREEN, ORANGE, SKY, PINK)


def draw_expected(sets: list[SensorSet], title: str, path: Path) -> Path:
    """95th percentile of the attitude error over time, weakest singular value of each window."""
    clock = clock_for(sets[0].t_s[-1])
    figure, (error, weakest) = stack_panels(title, 2, 5.6, sharex=True)
    for k, each in enumerate(sets):
        colour, seen = _COLOURS[k % len(_COLOURS)], each.observability
        error.semilogy(each.t_s / clock.seconds, each.error_deg, color=colour, label=each.name)
        middle = 0.5 * (seen.from_s + seen.to_s) / clock.seconds
        weakest.semilogy(middle, np.maximum(seen.singular[:, -1], 1e-9), "o-", color=colour, ms=3)
    for axes in (error, weakest):
        axes.margins(x=0)
        shade(axes, sets[0].t_s, sets[0].sun_seen, clock)
    error.set_ylabel("error, 95th percentile [deg]", fontsize=10)
    weakest.axhline(1.0, color="#222222", lw=0.9, ls=":")
    weakest.set_ylabel("weakest singular value", fontsize=10)
    weakest.set_xlabel(f"time [{clock.unit}]; grey: Sun not in view", fontsize=10)
    legend_at_left(error, 2)
    return save_figure(figure, path)
