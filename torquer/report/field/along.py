"""The field along an orbit as PNG: components and magnitude, angle to the first model."""

from pathlib import Path

import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, MultipleLocator

from torquer.report.common.colours import BLUE, GREEN, ORANGE, PINK, RED, SKY
from torquer.report.common.figure import SMALL, legend, place, quiet, save_figures, sheet
from torquer.report.common.scales import clock_for, split_where_wrapped

#: Colours of the models in the order given.
COLOURS = (BLUE, RED, GREEN, ORANGE, PINK, SKY)
#: Sizes [inch].
_WIDTH, _LEFT, _RIGHT = 9.0, 0.82, 0.25
_HEAD, _PLOT, _GAP, _FOOT = 0.62, 1.35, 0.16, 0.5


def draw_along(along: xr.Dataset, folder: Path) -> dict[str, Path]:
    """Write inertial.png (against time) and orbital.png (against argument of latitude) of what
    `field_orbit` found."""
    t_s = along["time"].values
    clock = clock_for(t_s[-1])
    time = (t_s / clock.seconds, f"time [{clock.unit}]", None)
    u = (along["argument_of_latitude"].values, "argument of latitude u [deg]", 360.0)
    figures = {"inertial": _draw(along, "inertial", time), "orbital": _draw(along, "orbital", u)}
    return save_figures(figures, folder)


def _draw(along: xr.Dataset, frame: str, against) -> Figure:
    """Three components, the magnitude, and with several models the angle to the first."""
    title, labels = along.attrs["title"], along["model"].values.tolist()
    title, b = f"Field in {frame} axes · {title}", along[f"b_{frame}"]
    names = b[b.dims[-1]].values.tolist()
    rows = [(f"{name} [µT]", 1e6 * b.values[:, :, k], 0) for k, name in enumerate(names)]
    rows.append(("|B| [µT]", 1e6 * along["strength"].values, 0))
    if len(labels) > 1:
        rows.append((f"angle to {labels[0]} [deg]", along["angle_to_first"].values, 1))
    height = _HEAD + len(rows) * (_PLOT + _GAP) + _FOOT
    figure = sheet(_WIDTH, height, title)
    top, x_label = _HEAD, against[1]
    for number, (label, values, first) in enumerate(rows):
        axes = place(figure, _LEFT, top, _WIDTH - _LEFT - _RIGHT, _PLOT)
        last = number == len(rows) - 1
        handles = _lines(axes, against, values, label, labels, first)
        axes.tick_params(labelbottom=last)
        if number == 0:
            legend(axes, handles)
        if last:
            axes.set_xlabel(x_label, fontsize=SMALL)
        top += _PLOT + _GAP
    return figure


def _lines(axes, against, values, label: str, labels, first: int) -> list:
    """One row of axes with the models from number `first` on; their handles."""
    x, _, whole = against
    quiet(axes)
    handles = []
    for m in range(first, len(labels)):
        line = (x, values[m]) if whole is None else split_where_wrapped(x, values[m], low=0.0)
        width, colour = 1.2 if m else 2.0, COLOURS[m % len(COLOURS)]
        handles += axes.plot(*line, lw=width, color=colour, label=labels[m])
    if whole:
        axes.set_xlim(0.0, whole)
        axes.xaxis.set_major_locator(MultipleLocator(45.0))
    else:
        axes.set_xlim(x[0], x[-1])
        axes.xaxis.set_major_locator(MaxNLocator(12, steps=(1, 2, 5, 10)))
    axes.yaxis.set_major_locator(MaxNLocator(5, steps=(1, 2, 5, 10)))
    axes.set_ylabel(label, fontsize=SMALL)
    axes.yaxis.set_label_coords(-0.066, 0.5)
    return handles
