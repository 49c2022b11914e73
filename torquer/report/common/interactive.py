"""Interactive pictures as plotly figures, written as plain data: no server, no network.

A figure is the dictionary that plotly.js takes. Numbers travel as base64 of binary arrays,
which plotly.js decodes itself.
"""

import base64

import numpy as np

#: Visible on light and dark backgrounds.
GRID = "rgba(128,128,128,0.25)"
#: Look of a menu over a figure: plotly highlights its entries in pale colours, light or dark.
MENU = {"showactive": True, "bgcolor": "#f4f6f8", "font": {"color": "#333333"}}
MARGIN_PX = {"l": 62, "r": 46, "t": 34, "b": 42}
#: Where no Sun reaches or is seen; more shaded bands than this are too narrow to distinguish.
NIGHT, MOST_BANDS = "rgba(110,125,180,0.20)", 400


def pack_numbers(values, kind: str = "f4") -> dict:
    """Numbers as plotly.js reads them: type and base64 of the bytes (little-endian)."""
    array = np.ascontiguousarray(values, dtype=f"<{kind}")
    return {"dtype": kind, "bdata": base64.b64encode(array.tobytes()).decode("ascii")}


def packed_times(t) -> dict:
    """Ascending numbers, in four bytes each where these clearly separate neighbours."""
    least = np.diff(t).min(initial=np.inf)
    return pack_numbers(t, "f4" if least > 1e-4 * np.abs(t).max(initial=0.0) else "f8")


def layout(height_px: int, **keys) -> dict:
    """Layout shared by all figures; the page's script sets light or dark colours."""
    return {
        "height": height_px,
        "margin": dict(MARGIN_PX),
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
    """An axis with its title and a faint grid."""
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


def line(x, y, name: str, colour: str, width: float = 1.5, **keys) -> dict:
    """A line; `keys` as plotly has them."""
    return {
        "type": "scatter",
        "mode": "lines",
        "x": pack_numbers(x, "f8"),
        "y": pack_numbers(y),
        "name": name,
        "legendgroup": name,
        "line": {"color": colour, "width": width, **keys.pop("line", {})},
        **keys,
    }


def band(x, low, high, name: str, colour: str, opacity: float = 0.2, shape="linear") -> list[dict]:
    """The area between two curves: two traces, one entry in the legend."""
    edge = {"line": {"width": 0, "shape": shape, "color": colour}, "hoverinfo": "skip"}
    fill = {"fill": "tonexty", "fillcolor": translucent(colour, opacity)}
    lower, upper = (line(x, y, name, colour) for y in (low, high))
    return [{**lower, **edge, "showlegend": False}, {**upper, **edge, **fill}]


def figure(data: list[dict], height_px: int, xaxis: dict, yaxis: dict, **keys) -> dict:
    """A figure of one panel; `keys` of its layout. The pointer reads all lines at once."""
    keys = {"hovermode": "x unified", **keys}
    return {"data": data, "layout": layout(height_px, xaxis=xaxis, yaxis=yaxis, **keys)}


def point(x: float | None, y: float | None, name: str, **marker) -> dict:
    """A single point with its entry in the legend."""
    return {"type": "scatter", "mode": "markers", "x": [x], "y": [y], "name": name,
            "marker": marker}  # fmt: skip


def note(text: str, **keys) -> dict:
    """A text at a place, without an arrow."""
    return {"text": text, "showarrow": False, "font": {"size": 11}, **keys}


def guide(dash: str, width: float, **keys) -> dict:
    """A shape: a grey line at a level or an instant."""
    return {"type": "line", "line": {"color": "#8a8a8a", "width": width, "dash": dash}, **keys}


def square(name: str, colour: str) -> dict:
    """An entry in the legend for what is shaded."""
    entry = point(None, None, name, symbol="square", size=12, color=colour)
    return {**entry, "hoverinfo": "skip"}


def shade(x0: float, x1: float, colour: str) -> dict:
    """A shape: a stretch of the x axis, over the whole height."""
    return {"type": "rect", "layer": "below", "line": {"width": 0}, "fillcolor": colour,
            "xref": "x", "x0": x0, "x1": x1, "yref": "paper", "y0": 0, "y1": 1}  # fmt: skip


def vertical(x: float, colour: str, dash: str = "solid") -> dict:
    """A shape: a vertical line over the whole height."""
    return {**shade(x, x, colour), "type": "line", "layer": "above",
            "line": {"color": colour, "width": 1.2, "dash": dash}}  # fmt: skip


def stack_traces(
    panels: list[tuple[list[dict], dict]], panel_px: int, x_axis: dict, **keys
) -> dict:
    """A figure of panels, one below the other over the same x: (traces, y axis) of each.

    A name is once in the legend, whatever the number of panels that have it.
    """
    count, gap, seen, data, axes = len(panels), 0.08, set(), [], {}
    share = (1.0 - gap * (count - 1)) / count
    for k, (traces, y_axis) in enumerate(panels):
        top = 1.0 - k * (share + gap)
        number = "" if k == 0 else str(k + 1)
        axes[f"yaxis{number}"] = {**y_axis, "domain": [max(top - share, 0.0), top]}
        for trace in traces:
            shown = trace.get("showlegend", True) and trace["name"] not in seen
            seen |= {trace["name"]} if shown else set()
            data.append({**trace, "yaxis": f"y{number}", "showlegend": shown})
    last = f"y{count}" if count > 1 else "y"
    height = panel_px * count + MARGIN_PX["t"] + MARGIN_PX["b"]
    return {
        "data": data,
        "layout": layout(height, xaxis={**x_axis, "anchor": last}, **axes, **keys),
    }


def translucent(colour: str, part: float = 0.18) -> str:
    """A colour "#rrggbb" that lets part of the background through."""
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red},{green},{blue},{part})"
