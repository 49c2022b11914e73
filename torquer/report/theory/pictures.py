"""Pictures of the averaged motion: slow variables over revolutions, maps with isolines."""

import math
from collections.abc import Mapping

import numpy as np
from matplotlib.colors import LinearSegmentedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from torquer.report.common.colours import RED, SIGNED, curve_colour
from torquer.report.common.figure import legend_at_left, stack_panels
from torquer.theory.slow.evolution.model import Slow

_PALE = LinearSegmentedColormap.from_list("pale", ["#ffffff", "#cfe3f2", "#7fb3d8", "#2f74a8"])
_SIGNED = LinearSegmentedColormap.from_list("signed", SIGNED)
_TURN = 2.0 * math.pi


def isolines(axes, x, y, values, levels, form: str = "%g", norm=None, signed=False):
    """Labelled isolines of `values` `[x, y]` on a pale colour map.

    `signed`: values of either sign have two hues, pale at zero; `norm` is not used then. Returns
    the colour map, for a colour bar.
    """
    values = np.asarray(values).T
    palette = _PALE
    if signed:
        greatest = float(np.nanmax(np.abs(values)))
        norm, palette = Normalize(-greatest, greatest), _SIGNED
    axes.grid(False)
    ground = axes.pcolormesh(
        x, y, values, cmap=palette, norm=norm, shading="gouraud", rasterized=True
    )
    lines = axes.contour(x, y, values, levels=levels, colors="#222222", linewidths=1.0)
    texts = axes.clabel(lines, fmt=form, fontsize=9, inline_spacing=4)
    for text in texts:
        text.set_rotation_mode("anchor")
    axes.set_xlim(x[0], x[-1])
    axes.set_ylim(y[0], y[-1])
    return ground


_RHO = ("rho [deg]", lambda slow: np.degrees(slow.rho))


def draw_evolution(u, paths: Mapping[str, Slow], title: str, angle=_RHO) -> Figure:
    """l, an angle and theta over revolutions, one line for each named path.

    `angle`: its name with the unit, and a function of the slow variables. A cross marks where a
    motion stops (see `SlowMotion.ended`).
    """
    figure, axes = stack_panels(title, 3, 6.6, sharex=True)
    shown = (
        ("l = L / L₀", lambda slow: slow.l),
        angle,
        ("theta [deg]", lambda slow: np.degrees(slow.theta)),
    )
    for each, (name, of) in zip(axes, shown, strict=True):
        for number, (label, slow) in enumerate(paths.items()):
            colour = curve_colour(number)
            turns, values = np.asarray(u) / _TURN, of(slow)
            each.plot(turns, values, color=colour, lw=1.4, label=label)
            if getattr(slow, "ended", None) is not None:
                last = np.flatnonzero(np.isfinite(values))[-1]
                each.plot(turns[last], values[last], "x", color=colour, ms=8, mew=2)
        each.set_ylabel(name, fontsize=10)
        each.yaxis.set_major_locator(MaxNLocator(5, steps=(1, 2, 2.5, 5, 10)))
        _room(each)
    axes[-1].set_xlabel("revolutions", fontsize=10)
    axes[-1].set_xlim(u[0] / _TURN, u[-1] / _TURN)
    legend_at_left(axes[0], min(6, len(paths)), 9.5)
    return figure


def _room(axes) -> None:
    """At least one per cent of room for a constant line."""
    low, high = axes.get_ylim()
    least = 1e-2 * max(abs(low), abs(high), 1.0)
    if high - low < least:
        axes.set_ylim(low - least, high + least)


def draw_map(inclination_deg, rho_deg, values, unit: str, title: str, here: tuple | None) -> Figure:
    """Isolines over (inclination, rho0); `here`: inclination (and rho0 or None)."""
    figure, (axes,) = stack_panels(title, 1, 4.6)
    values = np.asarray(values)
    known = values[np.isfinite(values)]
    levels, norm = _levels(float(known.min()), float(known.max()))
    isolines(axes, inclination_deg, rho_deg, values, levels, f"%g{unit}", norm)
    if here:
        axes.axvline(here[0], color=RED, lw=1.3, ls=(0, (5, 3)), label="this orbit")
        if here[1] is not None:
            axes.plot(*here, "o", color=RED, ms=7, clip_on=False, label="this start")
        legend_at_left(axes, 2)
    axes.set_xlabel("inclination [deg]", fontsize=10)
    axes.set_ylabel("initial momentum from cone axis [deg]", fontsize=10)
    axes.set_xticks(_degrees_between(*axes.get_xlim()))
    axes.set_yticks(_degrees_between(*axes.get_ylim()))
    return figure


def _levels(low: float, high: float) -> tuple[np.ndarray, LogNorm | None]:
    """Even levels; 1, 2, 5, 10, ... down to a thousandth where the values span decades."""
    if low >= 0.2 * high:
        even = MaxNLocator(9, steps=(1, 2, 2.5, 5, 10)).tick_values(low, high)
        return np.asarray(even)[1:-1], None
    low = max(low, 1e-3 * high)
    decades = 10.0 ** np.arange(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    levels = np.multiply.outer(decades, [1.0, 2.0, 5.0]).ravel()
    return levels[(levels > low) & (levels < high)], LogNorm(low, high, clip=True)


def _degrees_between(low, high) -> np.ndarray:
    step = 15.0 if high - low <= 90.0 else 30.0
    return np.arange(math.ceil(low / step) * step, high + 1e-9, step)
