"""Interactive pictures as plotly figures, written as plain data: no server, no network.

A figure is the dictionary that plotly.js takes. Numbers travel as base64 of binary arrays,
which plotly.js decodes itself.
"""

import base64

import numpy as np

#: Visible on light and dark backgrounds.
GRID = "rgba(128,128,128,0.25)"
MARGIN_PX = {"l": 62, "r": 46, "t": 34, "b": 42}


def packed(values, kind: str = "f4") -> dict:
    """Numbers as plotly.js reads them: type and base64 of the bytes (little-endian)."""
    array = np.ascontiguousarray(values, dtype=f"<{kind}")
    return {"dtype": kind, "bdata": base64.b64encode(array.tobytes()).decode("ascii")}


def packed_times(t) -> dict:
    """Ascending numbers, in four bytes each where these clearly separate neighbours."""
    least = np.diff(t).min(initial=np.inf)
    return packed(t, "f4" if least > 1e-4 * np.abs(t).max(initial=0.0) else "f8")


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
