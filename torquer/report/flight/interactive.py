"""Panels over time as plotly figures."""

import numpy as np

from torquer.base.language import told, translated
from torquer.report.common.interactive import (
    MARGIN_PX,
    MOST_BANDS,
    NIGHT,
    axis,
    figure,
    guide,
    note,
    pack_numbers,
    packed_times,
    shade,
    square,
    translucent,
)
from torquer.report.common.scales import clock_for, label_places, level_places
from torquer.report.flight.panels.panel import MEASUREMENT, Bar, Line, Panel, shown_times
from torquer.report.flight.view import View

PANEL_PX, STRIP_PX = 300, 70
#: Width of the axes on a page that is as wide as can be.
_PLOT_WIDTH_PX = 930.0
_BANDS = {MEASUREMENT: "rgba(214,170,80,0.18)"}


def panel_figure(view: View, panel: Panel) -> dict:
    """One panel over time."""
    if panel.bars:
        return strip_figure(view, panel)
    began, ended = shown_times(view, panel)
    clock = clock_for(ended - began)
    data = [trace for line in panel.lines for trace in _traces(line, clock.seconds)]
    night = _BANDS.get(panel.bands_label, NIGHT)
    bands = panel.bands if len(panel.bands) <= MOST_BANDS else ()
    if bands:
        data.append(square(told(panel.bands_label), night))
    x_range = [began / clock.seconds, ended / clock.seconds]
    levels, notes = _levels(panel)
    marks, labels = _marks(panel, x_range, clock.seconds)
    shades = [shade(a / clock.seconds, b / clock.seconds, night) for a, b in bands]
    x_axis = axis(translated("time [{unit}]", unit=clock.unit), range=x_range, hoverformat=".6~g")
    y_axis = axis(panel.y_label, hoverformat=".4~g", **_y_keys(panel))
    shapes, annotations = [*shades, *levels, *marks], notes + labels
    return figure(data, PANEL_PX, x_axis, y_axis, shapes=shapes, annotations=annotations)


def strip_figure(view: View, panel: Panel) -> dict:
    """A strip of states, without time labels: it is placed above a panel that has them."""
    began, ended = shown_times(view, panel)
    clock = clock_for(ended - began)
    x_range = [began / clock.seconds, ended / clock.seconds]
    x_axis = axis("", range=x_range, showticklabels=False, ticks="", showgrid=False)
    y_axis = {"visible": False, "range": [0, 1], "fixedrange": True}
    bars, margin = [_bar_trace(bar, clock.seconds) for bar in panel.bars], {**MARGIN_PX, "b": 8}
    keys = {"hovermode": "closest", "showlegend": True, "margin": margin}
    return figure(bars, STRIP_PX, x_axis, y_axis, **keys)


def _bar_trace(bar: Bar, clock_s: float) -> dict:
    """A step function, 1 within the spans and 0 without, filled."""
    edges = np.repeat(np.array(bar.spans) / clock_s, 2)
    colour = translucent(bar.colour, bar.opacity)
    return {
        "type": "scatter",
        "x": pack_numbers(edges, "f8"),
        "y": pack_numbers(np.tile([0.0, 1.0, 1.0, 0.0], len(bar.spans))),
        "name": bar.label,
        "mode": "lines",
        "line": {"width": 0, "color": colour},
        "fill": "tozeroy",
        "fillcolor": colour,
        "hoveron": "fills",
        "hoverinfo": "name",
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
    series = line.series
    base = {"type": "scatter", "x": packed_times(series.t / clock_s), "legendgroup": line.label}
    mode = "markers" if line.style == "dots" else "lines"
    many = len(series.t) > 200
    return [
        *_range_traces(line, base),
        {
            **base,
            "y": pack_numbers(series.y),
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
    """Shading from minimum to maximum, with its edges drawn where the series is fast."""
    series = line.series
    if series.low is None or series.high is None or series.fast is None:
        return []
    unseen = {
        **base,
        "mode": "lines",
        "line": {"width": 0, "color": line.colour},
        "showlegend": False,
    }
    fill = {"fill": "tonexty", "fillcolor": translucent(line.colour)}
    traces = [
        {**unseen, "y": pack_numbers(series.low), "name": f"{line.label} min"},
        {**unseen, **fill, "y": pack_numbers(series.high), "name": f"{line.label} max"},
    ]
    if not series.fast.any():
        return traces
    drawn_edge = {**unseen, "line": {"width": 1, "color": line.colour}, "hoverinfo": "skip"}
    return traces + [
        {**drawn_edge, "y": pack_numbers(np.where(series.fast, edge, np.nan))}
        for edge in (series.low, series.high)
    ]


def _levels(panel: Panel) -> tuple[list[dict], list[dict]]:
    """Lines and labels of the marked levels; labels are moved apart where they would overlap."""
    y_range = panel.y_range or (-np.inf, np.inf)
    shown = sorted((v for v in panel.levels if y_range[0] <= v.y <= y_range[1]), key=lambda v: v.y)
    plot_px = PANEL_PX - MARGIN_PX["t"] - MARGIN_PX["b"]
    lines = [
        guide("solid" if v.solid else "dash", 1, xref="paper", x0=0, x1=1, y0=v.y, y1=v.y)
        for v in shown
    ]
    shifts = [0.0] * len(shown)
    if panel.y_range:
        heights = [v.y for v in shown]
        places, moved = level_places(heights, panel.y_range, panel.log, 15.0 / plot_px)
        shifts = [plot_px * (m - p) for p, m in zip(places, moved, strict=True)]
    labels = [
        note(
            v.label, xref="paper", x=1.0, xanchor="left", yref="y", yshift=shift,
            y=float(np.log10(v.y) if panel.log else v.y),
        )
        for v, shift in zip(shown, shifts, strict=True)
        if v.label
    ]  # fmt: skip
    return lines, labels


def _marks(panel: Panel, x_range, clock_s: float) -> tuple[list[dict], list[dict]]:
    """Vertical lines at marked instants, with labels next to them."""
    at = [mark.t_s / clock_s for mark in panel.marks]
    places = [(x - x_range[0]) / (x_range[1] - x_range[0]) for x in at]
    lines = [guide("dot", 1.5, xref="x", x0=x, x1=x, yref="paper", y0=0, y1=1) for x in at]
    widths = [(6.2 * len(mark.label) + 10.0) / _PLOT_WIDTH_PX for mark in panel.marks]
    labels = [
        note(
            mark.label, xref="x", x=x, xanchor="left" if left >= place else "right",
            yref="paper", y=1.0, yanchor="top", yshift=-14 * row,
        )
        for mark, x, place, (left, row) in zip(
            panel.marks, at, places, label_places(places, widths), strict=True
        )
        if mark.label
    ]  # fmt: skip
    return lines, labels
