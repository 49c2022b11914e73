"""An element of the field over the globe as a PNG map with its extremes."""

from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.colors import LinearSegmentedColormap, Normalize, TwoSlopeNorm
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FuncFormatter, MaxNLocator, MultipleLocator

from torquer.analysis.field.globe import dip_poles, extremes
from torquer.analysis.field.requests import element_unit
from torquer.report.common.colours import SIGNED
from torquer.report.common.figure import FAINT, INK, SMALL, foot, place, save_figure, sheet

_WIDTH, _LEFT, _RIGHT, _HEAD, _FOOT = 9.0, 0.62, 0.95, 0.5, 0.52
#: Dark where the field is weak, so that the South Atlantic anomaly stands out.
_SIZES = LinearSegmentedColormap.from_list(
    "sizes", ["#2b2a5a", "#3d6a96", "#74a9b8", "#bcd5cf", "#f4f1e4"]
)
_SIGNED = LinearSegmentedColormap.from_list("signed", SIGNED)
_NAMES = {
    "F": "Total intensity F",
    "X": "North component X",
    "Y": "East component Y",
    "Z": "Down component Z",
    "H": "Horizontal intensity H",
    "D": "Declination D",
    "I": "Inclination I",
}
_RED = "#b03a2e"
#: Landmarks in place of coastlines: name, latitude, longitude [deg].
PLACES = (
    ("London", 51.5, 0.0),
    ("Moscow", 55.8, 37.6),
    ("Tokyo", 35.7, 139.7),
    ("Delhi", 28.6, 77.2),
    ("Nairobi", -1.3, 36.8),
    ("Cape Town", -33.9, 18.4),
    ("Sydney", -33.9, 151.2),
    ("Singapore", 1.3, 103.8),
    ("New York", 40.7, -74.0),
    ("Los Angeles", 34.1, -118.2),
    ("Anchorage", 61.2, -149.9),
    ("São Paulo", -23.5, -46.6),
    ("Honolulu", 21.3, -157.9),
)


def draw_map(grid: xr.Dataset, element: str, path: Path) -> Path:
    """Write the map of an element from what `field_map` found; contours in µT or deg."""
    wide = _WIDTH - _LEFT - _RIGHT
    figure = sheet(_WIDTH, _HEAD + 0.5 * wide + _FOOT, f"{_NAMES[element]} · {grid.attrs['title']}")
    axes = place(figure, _LEFT, _HEAD, wide, 0.5 * wide)
    bar = place(figure, _LEFT + wide + 0.15, _HEAD + 0.25, 0.15, 0.5 * wide - 0.5)
    filled = _contours(axes, grid, element)
    _landmarks(axes)
    _dip_equator_and_poles(axes, grid)
    if element == "F":
        _mark_extremes(axes, grid, element)
    axes.set(xlim=(-180, 180), ylim=(-90, 90), aspect="equal")
    axes.tick_params(labelsize=SMALL, color=FAINT)
    for axis, name in ((axes.xaxis, "E W"), (axes.yaxis, "N S")):
        axis.set_major_locator(MultipleLocator(30))
        axis.set_major_formatter(_compass(*name.split()))
    axes.grid(True, color="#000000", alpha=0.12, lw=0.5)
    axes.spines[:].set_color(FAINT)
    figure.colorbar(filled, cax=bar, ticks=_ticks(grid, element)).outline.set_visible(False)
    bar.set_title("deg" if element_unit(element) == "deg" else "µT", fontsize=SMALL)
    bar.tick_params(labelsize=SMALL)
    key = "Dashed: dip equator (I = 0).   Triangles: dip poles (H = 0)."
    key += "   Rings: minimum and maximum." if element == "F" else ""
    foot(figure, key)
    return save_figure(figure, path)


def _compass(plus: str, minus: str) -> FuncFormatter:
    return FuncFormatter(lambda x, _: "0°" if x == 0 else f"{abs(x):g}°{plus if x > 0 else minus}")


def _on(grid: xr.Dataset, values) -> tuple:
    """Longitudes, latitudes and values, as matplotlib takes them."""
    return grid["lon"].values, grid["lat"].values, values


def _show(grid: xr.Dataset, element: str) -> np.ndarray:
    values = grid[element].values
    return values if element_unit(element) == "deg" else 1e-3 * values


def _contours(axes, grid: xr.Dataset, element: str):
    """Filled contours with labelled lines; returns the filling, for the colour bar."""
    values = _show(grid, element)
    if element == "D":
        return _declination(axes, grid, values)
    levels = _levels(values, element)
    if element in ("F", "H"):
        norm, colours = Normalize(levels[0], levels[-1]), _SIZES
    else:
        most = np.abs(levels).max()
        norm, colours = TwoSlopeNorm(0.0, -most, most), _SIGNED
    fine = np.linspace(levels[0], levels[-1], 4 * (len(levels) - 1) + 1)
    filled = axes.contourf(*_on(grid, values), fine, cmap=colours, norm=norm, zorder=0)
    _draw_lines(axes, grid, values, levels)
    return filled


def _ticks(grid: xr.Dataset, element: str) -> np.ndarray:
    if element_unit(element) == "deg":
        return np.arange(-90.0, 91.0, 30.0)
    return _levels(_show(grid, element), element)


def _levels(values, element: str) -> np.ndarray:
    if element == "I":
        return np.arange(-90.0, 91.0, 10.0)
    locator = MaxNLocator(14, steps=(1, 2, 5, 10))
    return np.asarray(locator.tick_values(values.min(), values.max()))


def _declination(axes, grid: xr.Dataset, values):
    """D jumps by 360 deg beyond the poles: filling up to 90 deg, lines only where it is smooth."""
    shown = np.clip(values, -90.0, 90.0)
    norm, fine = TwoSlopeNorm(0.0, -90.0, 90.0), np.arange(-90.0, 91.0, 5.0)
    filled = axes.contourf(*_on(grid, shown), fine, cmap=_SIGNED, norm=norm, zorder=0)
    levels = (-90, -60, -40, -30, -20, -10, 0, 10, 20, 30, 40, 60, 90)
    smooth = (np.abs(values) < 120.0) & (np.abs(grid["lat"].values)[:, None] < 84.0)
    _draw_lines(axes, grid, np.ma.masked_where(~smooth, values), levels)
    return filled


def _draw_lines(axes, grid: xr.Dataset, values, levels) -> None:
    look = {"colors": INK, "linewidths": 0.55, "alpha": 0.75, "negative_linestyles": "solid"}
    lines = axes.contour(*_on(grid, values), levels, zorder=0.6, **look)
    for text in axes.clabel(lines, fmt="%g", fontsize=7, colors=INK, inline=False):
        if _is_at_a_name(*text.get_position()):
            text.remove()
        else:
            _halo(text)


def _is_at_a_name(lon: float, lat: float) -> bool:
    """Whether the name of a place stands there, or nearly."""
    for name, north, east in PLACES:
        length = (6.0 + 2.6 * len(name)) * (1.0 if _reads_right(east) else -1.0)
        first, last = sorted((east - 0.15 * length, east + length))
        if first < lon < last and north - 4.0 < lat < north + 7.0:
            return True
    return False


def _reads_right(lon: float) -> bool:
    """Whether the name of a place stands to the right of it: there is room."""
    return lon < 130.0


def _halo(text, width: float = 1.8) -> None:
    text.set_path_effects([withStroke(linewidth=width, foreground="white", alpha=0.75)])


def _landmarks(axes) -> None:
    for name, lat, lon in PLACES:
        axes.plot(lon, lat, "o", ms=2.6, color=INK, mec="white", mew=0.5, zorder=2)
        right = _reads_right(lon)
        keys = {"ha": "left" if right else "right", "fontsize": 6.5, "color": INK, "zorder": 2}
        shift = (3.0 if right else -3.0, 2.0)
        _halo(axes.annotate(name, (lon, lat), shift, textcoords="offset points", **keys))


def _dip_equator_and_poles(axes, grid: xr.Dataset) -> None:
    keys = {"colors": _RED, "linewidths": 1.1, "linestyles": "dashed", "zorder": 1.5}
    axes.contour(*_on(grid, grid["I"].values), [0.0], **keys)
    for (lat, lon), marker in zip(dip_poles(grid), ("^", "v"), strict=True):
        keys = {"color": _RED, "mec": "white", "mew": 0.8, "zorder": 4, "clip_on": False}
        axes.plot(lon, lat, marker, ms=7, **keys)


def _mark_extremes(axes, grid: xr.Dataset, element: str) -> None:
    for at in extremes(grid, element).values():
        lat, lon = at["latitude_deg"], at["longitude_deg"]
        axes.plot(lon, lat, "o", ms=7, mfc="none", mec=INK, mew=2.4, zorder=5)
        axes.plot(lon, lat, "o", ms=7, mfc="none", mec="white", mew=1.0, zorder=5)
        side = "right" if lon > -120.0 else "left"
        keys = {"fontsize": 8, "fontweight": "bold", "color": INK, "ha": side, "zorder": 5}
        shift = (-7.0 if side == "right" else 7.0, -3.0)
        value = f"{1e-3 * at['value']:.2f} µT"
        text = axes.annotate(value, (lon, lat), shift, textcoords="offset points", **keys)
        _halo(text, 2.2)
