"""The ground track over a map of |B| as a plotly figure, and its lines for any drawing."""

import numpy as np

from torquer.base.language import told, translated
from torquer.report.common.colours import RED
from torquer.report.common.interactive import axis, figure, pack_numbers, point
from torquer.report.common.scales import clock_for, split_where_wrapped
from torquer.report.flight.view import View

#: Height of the interactive map [px].
TRACK_PX = 440
#: Colours of the map: pale, so that the track stands out; perceptually even.
PALE = ("#fbfaf5", "#cfe0e4", "#9dbccb")
SUNLIT, DARK = RED, "#1b3a6b"


def track_figure(view: View) -> dict:
    """Ground track over the map of the field."""
    grid = view.field_map
    data = [] if grid is None else [_field_contours(*grid)]
    lon, lat, sunlit_fraction = (
        view.values(k) for k in ("longitude", "latitude", "sunlit_fraction")
    )
    stride = max(1, len(lon) // 6000)
    clock = clock_for(view.end_s)
    split = split_where_wrapped(
        lon[::stride], lat[::stride], sunlit_fraction[::stride], view.t_s[::stride] / clock.seconds
    )
    hover = f"%{{y:.1f}}°, %{{x:.1f}}°<br>%{{customdata:.1f}} {told(clock.unit)}"
    named = (
        (translated("sunlit"), SUNLIT, True),
        (translated("in eclipse"), DARK, False),
    )
    for label, colour, lit_here in named:
        mask = (split[2] >= 0.5) if lit_here else (split[2] < 0.5)
        if mask.any():
            x, y, t = only_where(mask, split[0], split[1], split[3])
            data.append(
                {
                    "type": "scatter",
                    "x": pack_numbers(x),
                    "y": pack_numbers(y),
                    "customdata": pack_numbers(t),
                    "mode": "lines" if len(lon) > 1 else "markers",
                    "name": label,
                    "line": {"color": colour, "width": 2},
                    "hovertemplate": hover,
                }
            )
    ring = {"color": "#222222", "width": 2}
    for label, row, symbol in (
        (translated("start"), 0, "circle"),
        (translated("end"), -1, "square"),
    ):
        marker = {"symbol": symbol, "size": 11, "color": "white", "line": ring}
        data.append(point(float(lon[row]), float(lat[row]), label, **marker))
    keys = {"dtick": 30, "constrain": "domain"}
    x_axis = axis(translated("longitude [{unit}]", unit="deg"), range=[-180, 180], **keys)
    y_axis = axis(
        translated("latitude [{unit}]", unit="deg"), range=[-90, 90], scaleanchor="x", **keys
    )
    return figure(data, TRACK_PX, x_axis, y_axis, hovermode="closest")


def _field_contours(lon, lat, strength) -> dict:
    return {
        "type": "contour",
        "x": pack_numbers(lon),
        "y": pack_numbers(lat),
        "z": {**pack_numbers(strength), "shape": f"{len(lat)}, {len(lon)}"},
        "colorscale": list(zip((0.0, 0.5, 1.0), PALE, strict=True)),
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
            "title": {"text": translated("|B| [{unit}]", unit="µT")},
            "thickness": 12,
            "len": 0.8,
            "dtick": 5,
            "x": 1.01,
            "outlinewidth": 0,
        },
        "hovertemplate": f"|B| %{{z:.1f}} {told('µT')}<extra></extra>",
    }


def only_where(mask, *series) -> tuple[np.ndarray, ...]:
    """The series with gaps wherever the line leaves the mask; end points belong to both sides."""
    mask = np.asarray(mask, dtype=bool)
    kept = mask | np.concatenate([[False], mask[:-1]])
    return tuple(np.where(kept, s, np.nan) for s in series)
