"""What a reader cannot read of a figure: texts over one another or off the sheet, data cut off."""

from itertools import combinations
from unittest.mock import patch

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from torquer.base.language import translated

#: Pixels at the edges of a text's box that have no ink.
_SLACK = 1.5


def texts_drawn(figure) -> list[tuple[str, np.ndarray]]:
    """Texts that a figure draws, with their boxes [pixel]: left, bottom, right, top."""
    found = []
    draw = Text.draw

    def noted(self, renderer, *args, **keys):
        if self.get_visible() and self.get_text().strip():
            box = self.get_window_extent(renderer).extents
            found.append((self.get_text(), box, self.get_rotation() % 90.0 == 0.0))
        return draw(self, renderer, *args, **keys)

    with patch.object(Text, "draw", noted):
        FigureCanvasAgg(figure).draw()
    return [(text, box) for text, box, upright in found if upright]


def overlapping(figure) -> list[str]:
    """Pairs of texts over one another."""
    found = []
    for (one, a), (other, b) in combinations(texts_drawn(figure), 2):
        width = min(a[2], b[2]) - max(a[0], b[0])
        height = min(a[3], b[3]) - max(a[1], b[1])
        if min(width, height) > 2.0 * _SLACK:
            found.append(f"{one!r} over {other!r}")
    return found


def off_the_sheet(figure) -> list[str]:
    """Texts that leave the figure."""
    width, height = figure.canvas.get_width_height()
    return [
        text
        for text, (left, bottom, right, top) in texts_drawn(figure)
        if left < -_SLACK or bottom < -_SLACK or right > width + _SLACK or top > height + _SLACK
    ]


def cut_data(figure) -> list[str]:
    """Lines and points of which a part lies outside their axes, which say nothing of it.

    On a logarithmic axis what lies decades below all else, rounding errors, may be left out.
    """
    found = []
    says_so = "cut off", translated("{title} (peaks cut off)", title="").strip()
    for axes in figure.axes:
        title = axes.get_title(loc="left")
        if any(words in title for words in says_so) or axes.name == "3d":
            continue
        low, high = axes.viewLim.min, axes.viewLim.max
        low = np.where([axes.get_xscale() == "log", axes.get_yscale() == "log"], -np.inf, low)
        slack = 1e-6 * np.abs(axes.viewLim.max - axes.viewLim.min)
        for line in axes.lines:
            if line.get_transform() == axes.transData and line.get_visible():
                found += _outside(axes, line, line.get_xydata(), low - slack, high + slack)
        for points in axes.collections:
            offsets = np.ma.filled(np.ma.asarray(points.get_offsets(), float), np.nan)
            if points.get_offset_transform() == axes.transData and len(offsets):
                found += _outside(axes, points, offsets, low - slack, high + slack)
    return found


def _outside(axes, artist, data, low, high) -> list[str]:
    data = np.asarray(data, float)
    data = data[np.isfinite(data).all(axis=1)]
    out = ((data < low) | (data > high)).any(axis=1)
    if not out.any():
        return []
    return [f"{axes.get_title() or axes.get_ylabel()}: {artist.get_label()}, {int(out.sum())} of "
            f"{len(out)} points, {data[out][0]}"]  # fmt: skip


def faults(figure) -> list[str]:
    """All faults of a figure."""
    return [
        *(f"overlap: {each}" for each in overlapping(figure)),
        *(f"off the sheet: {each!r}" for each in off_the_sheet(figure)),
        *(f"cut: {each}" for each in cut_data(figure)),
    ]
