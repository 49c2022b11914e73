"""Picture of a smoothed run: errors of the filter and of the smoother, and what they state."""

from pathlib import Path

import numpy as np
import xarray as xr

from torquer.maths.geometry.quaternion import angle_between
from torquer.report.common.colours import BLUE, RED
from torquer.report.common.figure import legend_at_left, stack_panels
from torquer.report.common.scales import clock_for
from torquer.report.filter.pictures import save_figure, shade
from torquer.simulation.results.dataset import flown_scenario


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
    stated.set_xlabel(f"time [{clock.unit}]; grey: Sun not in view", fontsize=10)
    legend_at_left(error, 2)
    return save_figure(figure, path)
