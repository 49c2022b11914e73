"""Interactive pictures as plotly figures, written as plain data: no server, no network.

A figure is the dictionary that plotly.js takes. Numbers travel as base64 of binary arrays,
which plotly.js decodes itself.
"""

import base64

import numpy as np

from torquer.report import panel as drawn
from torquer.report.panel import MEASUREMENT, Line, Panel
from torquer.report.series import (
    clock_for,
    label_places,
    level_places,
    only_where,
    split_at_dateline,
)
from torquer.report.view import View

PANEL_PX, TRACK_PX = 300, 440
#: Width of the axes on a page that is as wide as can be.
_PLOT_WIDTH_PX = 930.0
#: Seen on light and on dark paper alike.
GRID = "rgba(128,128,128,0.25)"
_BANDS = {MEASUREMENT: "rgba(214,170,80,0.18)"}
_NIGHT = "rgba(110,125,180,0.20)"
#: More shaded bands than this are too narrow to tell apart.
_MOST_BANDS = 400
_MARGIN = {"l": 62, "r": 46, "t": 34, "b": 42}
_FIELD_COLOURS = [[0.0, "#fbfaf5"], [0.5, "#cfe0e4"], [1.0, "#9dbccb"]]


def packed(values, kind: str = "f4") -> dict:
    """Numbers as plotly.js reads them: type and base64 of the bytes (little-endian)."""
    array = np.ascontiguousarray(values, dtype=f"<{kind}")
    return {"dtype": kind, "bdata": base64.b64encode(array.tobytes()).decode("ascii")}


def layout(height_px: int, **keys) -> dict:
    """What all figures share; the page's script sets the colours of light or dark paper."""
    return {
        "height": height_px,
        "margin": dict(_MARGIN),
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "rgba(0,0,0,0)",
        "font": {"family": "system-ui, sans-serif", "size": 12, "color": "#555555"},
        "hoverlabel": {"namelength": -1},
        "separators": ". ",
        "legend": {"orientation": "h", "x": 0.0, "xanchor": "left", "y": 1.02, "yanchor": "bottom"},
        "modebar": {"bgcolor": "rgba(0,0,0,0)", "color": "#909090", "activecolor": "#0072B2"},
        **keys,
    }


def axis(title: str, **keys) -> dict:
    """An axis with its title, on a quiet grid."""
    return {
        "title": {"text": title, "standoff": 6},
        "gridcolor": GRID,
        "zerolinecolor": GRID,
        "linecolor": "#8a8a8a",
        "showline": True,
        "ticks": "outside",
        "tickcolor": "#8a8a8a",
        "exponentformat": "power",
        "minexponent": 6,
        "automargin": True,
        **keys,
    }


def panel_figure(view: View, panel: Panel) -> dict:
    """One panel over time."""
    began, ended = panel.window or (0.0, view.end_s)
    if ended == began:
        began, ended = began - 0.5, ended + 0.5
    clock = clock_for(ended - began)
    data = [trace for line in panel.lines for trace in _traces(line, clock.seconds)]
    bands = panel.bands if len(panel.bands) <= _MOST_BANDS else ()
    if bands:
        data.append(_band_in_legend(panel))
    keys = _y_keys(panel)
    x_range = [began / clock.seconds, ended / clock.seconds]
    levels, notes = _levels(panel)
    marks, labels = _marks(panel, x_range, clock.seconds)
    return {
        "data": data,
        "layout": layout(
            PANEL_PX,
            hovermode="x unified",
            xaxis=axis(f"time [{clock.unit}]", range=x_range, hoverformat=".6~g"),
            yaxis=axis(panel.y_label, hoverformat=".4~g", **keys),
            shapes=[_band(panel, a / clock.seconds, b / clock.seconds) for a, b in bands]
            + levels
            + marks,
            annotations=notes + labels,
        ),
    }


def _y_keys(panel: Panel) -> dict:
    """Scale, range and ticks of a panel's y axis."""
    if panel.y_range is None:
        return {}
    low, high = (float(y) for y in panel.y_range)
    if panel.log:
        ticks = "D2" if high < 20.0 * low else 1
        return {
            "type": "log",
            "range": [float(np.log10(low)), float(np.log10(high))],
            "dtick": ticks,
            "tickformat": "~g",
        }
    return {"range": [low, high], **({"dtick": 45} if (low, high) == (0.0, 180.0) else {})}


def _traces(line: Line, clock_s: float) -> list[dict]:
    """A line, below it its range where it has one."""
    series = line.course
    base = {"type": "scatter", "x": packed(series.t / clock_s, "f8"), "legendgroup": line.label}
    mode = "markers" if line.style == "dots" else "lines"
    many = len(series.t) > 200
    return [
        *_range_traces(line, base),
        {
            **base,
            "y": packed(series.y),
            "name": line.label,
            "mode": "lines+markers" if len(series.t) < 4 else mode,
            "cliponaxis": many,
            "line": {
                "color": line.colour,
                "width": line.width + 0.5,
                "shape": "hv" if line.style == "steps" else "linear",
                "dash": "dash" if line.style == "dashed" else "solid",
            },
            "marker": {
                "color": line.colour,
                "size": 3 if many else 6,
                "opacity": 0.5 if many else 1.0,
            },
        },
    ]


def _range_traces(line: Line, base: dict) -> list[dict]:
    """Shade from least to greatest, with its edges drawn where the series is fast."""
    series = line.course
    if series.low is None:
        return []
    unseen = {
        **base,
        "mode": "lines",
        "line": {"width": 0, "color": line.colour},
        "showlegend": False,
    }
    fill = {"fill": "tonexty", "fillcolor": _translucent(line.colour)}
    traces = [
        {**unseen, "y": packed(series.low), "name": f"{line.label} least"},
        {**unseen, **fill, "y": packed(series.high), "name": f"{line.label} greatest"},
    ]
    if not series.fast.any():
        return traces
    drawn_edge = {**unseen, "line": {"width": 1, "color": line.colour}, "hoverinfo": "skip"}
    return traces + [
        {**drawn_edge, "y": packed(np.where(series.fast, edge, np.nan))}
        for edge in (series.low, series.high)
    ]


def _translucent(colour: str, part: float = 0.18) -> str:
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red},{green},{blue},{part})"


def _band(panel: Panel, began: float, ended: float) -> dict:
    return {
        "type": "rect",
        "layer": "below",
        "line": {"width": 0},
        "xref": "x",
        "x0": began,
        "x1": ended,
        "yref": "paper",
        "y0": 0,
        "y1": 1,
        "fillcolor": _BANDS.get(panel.bands_label, _NIGHT),
    }


def _band_in_legend(panel: Panel) -> dict:
    marker = {"symbol": "square", "size": 12, "color": _BANDS.get(panel.bands_label, _NIGHT)}
    return {
        "type": "scatter",
        "x": [None],
        "y": [None],
        "mode": "markers",
        "marker": marker,
        "name": panel.bands_label,
        "hoverinfo": "skip",
    }


def _levels(panel: Panel) -> tuple[list[dict], list[dict]]:
    """Lines and labels of the marked levels; labels are moved apart where they would overlap."""
    y_range = panel.y_range or (-np.inf, np.inf)
    shown = sorted((v for v in panel.levels if y_range[0] <= v.y <= y_range[1]), key=lambda v: v.y)
    plot_px = PANEL_PX - _MARGIN["t"] - _MARGIN["b"]
    lines = [
        {
            "type": "line",
            "xref": "paper",
            "x0": 0,
            "x1": 1,
            "y0": v.y,
            "y1": v.y,
            "line": {"color": "#8a8a8a", "width": 1, "dash": "solid" if v.solid else "dash"},
        }
        for v in shown
    ]
    shifts = [0.0] * len(shown)
    if panel.y_range:
        heights = [v.y for v in shown]
        places, moved = level_places(heights, panel.y_range, panel.log, 15.0 / plot_px)
        shifts = [plot_px * (m - p) for p, m in zip(places, moved, strict=True)]
    labels = [
        {
            "xref": "paper",
            "x": 1.0,
            "xanchor": "left",
            "yref": "y",
            "yshift": shift,
            "y": float(np.log10(v.y) if panel.log else v.y),
            "text": v.label,
            "showarrow": False,
            "font": {"size": 11},
        }
        for v, shift in zip(shown, shifts, strict=True)
        if v.label
    ]
    return lines, labels


def _marks(panel: Panel, x_range, clock_s: float) -> tuple[list[dict], list[dict]]:
    """Upright lines at marked instants, and their labels beside them."""
    at = [mark.t_s / clock_s for mark in panel.marks]
    places = [(x - x_range[0]) / (x_range[1] - x_range[0]) for x in at]
    lines = [
        {
            "type": "line",
            "xref": "x",
            "x0": x,
            "x1": x,
            "yref": "paper",
            "y0": 0,
            "y1": 1,
            "line": {"color": "#8a8a8a", "width": 1.5, "dash": "dot"},
        }
        for x in at
    ]
    widths = [(6.2 * len(mark.label) + 10.0) / _PLOT_WIDTH_PX for mark in panel.marks]
    labels = [
        {
            "xref": "x",
            "x": x,
            "xanchor": "left" if left >= place else "right",
            "yref": "paper",
            "y": 1.0,
            "yanchor": "top",
            "yshift": -14 * row,
            "text": mark.label,
            "showarrow": False,
            "font": {"size": 11},
        }
        for mark, x, place, (left, row) in zip(
            panel.marks, at, places, label_places(places, widths), strict=True
        )
        if mark.label
    ]
    return lines, labels


def track_figure(view: View) -> dict:
    """Ground track over the map of the field."""
    grid = view.field_map
    data = [] if grid is None else [_field_contours(*grid)]
    lon, lat, lit = (view.values(k) for k in ("longitude", "latitude", "lit"))
    stride = max(1, len(lon) // 6000)
    clock = clock_for(view.end_s)
    split = split_at_dateline(
        lon[::stride], lat[::stride], lit[::stride], view.t_s[::stride] / clock.seconds
    )
    hover = f"%{{y:.1f}}°, %{{x:.1f}}°<br>%{{customdata:.1f}} {clock.unit}"
    for label, colour, lit_here in (("sunlit", drawn.RED, True), ("in eclipse", "#1b3a6b", False)):
        mask = (split[2] >= 0.5) if lit_here else (split[2] < 0.5)
        if mask.any():
            x, y, t = only_where(mask, split[0], split[1], split[3])
            data.append(
                {
                    "type": "scatter",
                    "x": packed(x),
                    "y": packed(y),
                    "customdata": packed(t),
                    "mode": "lines" if len(lon) > 1 else "markers",
                    "name": label,
                    "line": {"color": colour, "width": 2},
                    "hovertemplate": hover,
                }
            )
    for label, row, symbol in (("start", 0, "circle"), ("end", -1, "square")):
        ring = {"color": "#222222", "width": 2}
        marker = {"symbol": symbol, "size": 11, "color": "white", "line": ring}
        data.append(
            {
                "type": "scatter",
                "x": [float(lon[row])],
                "y": [float(lat[row])],
                "mode": "markers",
                "marker": marker,
                "name": label,
            }
        )
    keys = {"dtick": 30, "constrain": "domain"}
    return {
        "data": data,
        "layout": layout(
            TRACK_PX,
            hovermode="closest",
            xaxis=axis("longitude [deg]", range=[-180, 180], **keys),
            yaxis=axis("latitude [deg]", range=[-90, 90], scaleanchor="x", **keys),
        ),
    }


def _field_contours(lon, lat, strength) -> dict:
    return {
        "type": "contour",
        "x": packed(lon),
        "y": packed(lat),
        "z": {**packed(strength), "shape": f"{len(lat)}, {len(lon)}"},
        "colorscale": _FIELD_COLOURS,
        "opacity": 0.9,
        "name": "|B|",
        "contours": {
            "start": 5,
            "end": 200,
            "size": 5,
            "coloring": "heatmap",
            "showlabels": True,
            "labelfont": {"size": 10, "color": "#4f6873"},
        },
        "line": {"width": 0.7, "color": "#7f98a3"},
        "zmin": float(strength.min()),
        "zmax": float(strength.max()),
        "colorbar": {
            "title": {"text": "|B| [µT]"},
            "thickness": 12,
            "len": 0.8,
            "dtick": 5,
            "x": 1.01,
            "outlinewidth": 0,
        },
        "hovertemplate": "|B| %{z:.1f} µT<extra></extra>",
    }
