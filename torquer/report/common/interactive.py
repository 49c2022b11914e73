"""Interactive pictures as plotly figures, written as plain data: no server, no network.

A figure is the dictionary that plotly.js takes. Numbers travel as base64 of binary arrays,
which plotly.js decodes itself.
"""

import base64

import numpy as np

#: Visible on light and dark backgrounds.
GRID = "rgba(128,128,128,0.25)"
#: The bits of a float32 that are rounded away, and half of the last place that is kept.
_LAST_BITS, _HALF_PLACE = np.uint32(0xFF), np.uint32(0x80)
MARGIN_PX = {"l": 62, "r": 46, "t": 34, "b": 42}


def packed(values) -> dict:
    """Numbers as plotly.js reads them, to 1 part in 65 000: what a plot shows and no more.

    Their last bits are noise, which does not compress: 4 % of a report.
    """
    bits = np.ascontiguousarray(values, dtype="<f4").view("<u4")
    return _as_read(((bits + _HALF_PLACE) & ~_LAST_BITS).view("<f4"), "f4")


def packed_exactly(values, kind: str = "f8") -> dict:
    """The same with all digits of the type."""
    return _as_read(np.ascontiguousarray(values, dtype=f"<{kind}"), kind)


def packed_times(t) -> dict:
    """Ascending numbers, in four bytes each where these clearly separate neighbours."""
    least = np.diff(t).min(initial=np.inf)
    return packed_exactly(t, "f4" if least > 1e-4 * np.abs(t).max(initial=0.0) else "f8")


def _as_read(array, kind: str) -> dict:
    """Type and base64 of the bytes (little-endian)."""
    return {"dtype": kind, "bdata": base64.b64encode(array.tobytes()).decode("ascii")}


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
