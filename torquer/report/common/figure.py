"""Matplotlib figures: sheets with a title, axes at given places, plain axes, legends.

The object interface only: no global state, any thread, no display.
"""

import base64
import io
from collections.abc import Iterable, Mapping
from pathlib import Path
from textwrap import shorten
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure, SubFigure
from matplotlib.text import Text
from PIL import Image

from torquer.base.language import ENGLISH, language, told
from torquer.simulation.results.file import put

DPI, FINE_DPI = 150, 160
INK, FAINT = "#222222", "#8a8a8a"
SMALL = 8.5
#: Mark of a figure, or of a text in one, that is in the language of the reader already.
TOLD = "told"


def sheet(width: float, height: float, title: str, is_told: bool = False) -> Figure:
    """A white figure [inch] with its title at the upper left, shortened to fit.

    Dollar signs are plain text. `is_told`: all texts are in the language of the reader already.
    """
    figure = Sheet(figsize=(width, height), dpi=DPI, facecolor="white")
    figure.set_gid(TOLD if is_told else None)
    figure.text(
        0.12 / width,
        1.0 - 0.1 / height,
        shorten(title, round(7.5 * width), placeholder=" …"),
        fontsize=12,
        fontweight="bold",
        color=INK,
        va="top",
        parse_math=False,
    )
    return figure


class Sheet(Figure):
    """A figure that shows itself in notebooks, with or without pyplot."""

    def _repr_png_(self) -> bytes:
        return encode_png(self)


def encode_png(figure: Figure) -> bytes:
    """A figure as PNG. Without transparency, lightly compressed: as small, and faster to write."""
    canvas, data = FigureCanvasAgg(tell_figure(figure)), io.BytesIO()
    canvas.draw()
    pixels = np.ascontiguousarray(np.asarray(canvas.buffer_rgba())[:, :, :3])
    dots = (figure.dpi, figure.dpi)
    Image.fromarray(pixels).save(data, "PNG", compress_level=4, dpi=dots)
    return data.getvalue()


def tell_figure(figure: Figure) -> Figure:
    """Put the texts of a figure into the language of the reader."""
    if language() != ENGLISH and figure.get_gid() != TOLD:
        for each in figure.findobj(Text):
            if each.get_gid() != TOLD and (words := told(each.get_text())) != each.get_text():
                each.set_text(words)
    return figure


def image(figure: Figure, words: str) -> str:
    """A figure as an element of HTML, for notebooks."""
    data = base64.b64encode(encode_png(figure)).decode("ascii")
    return f'<img alt="{words}" src="data:image/png;base64,{data}">'


def save_figure(figure: Figure, path) -> Path:
    """Write a figure as a PNG file."""
    return put(path, encode_png(figure))


#: What a format states of the moment of drawing.
_MOMENT = {"pdf": "CreationDate", "svg": "Date"}


def save_vector(figure: Figure, path: Path) -> Path:
    """Write a figure as a PDF or SVG file, as its name says, the same bytes each time."""
    data, kind = io.BytesIO(), path.suffix[1:]
    tell_figure(figure).savefig(data, format=kind, metadata={_MOMENT[kind]: None})
    return put(path, data.getvalue())


def save_figures(figures: Mapping[str, Figure | None], folder: Path) -> dict[str, Path]:
    """Write figures into a folder as `NAME.png`, without those that are None; paths by name."""
    return {
        name: save_figure(figure, folder / f"{name}.png")
        for name, figure in figures.items()
        if figure is not None
    }


def place(figure: Figure | SubFigure, left: float, top: float, width: float, height: float, **keys):
    """Axes at a place given in inches from the upper left corner of a figure or a part of one."""
    w, h = figure.bbox.width / figure.dpi, figure.bbox.height / figure.dpi
    return figure.add_axes((left / w, 1.0 - (top + height) / h, width / w, height / h), **keys)


def stack_panels(
    title: str, panels: int = 1, height: float = 3.9, on: SubFigure | None = None, **keys
) -> tuple[Any, list]:
    """A figure of panels one under the other, 7.2 inches wide; (figure, list of axes).

    `on`: the part of a page that is drawn on, in place of a figure of its own.
    """
    figure: Figure | SubFigure = on or Sheet(
        figsize=(7.2, height), dpi=FINE_DPI, facecolor="white", layout="constrained"
    )
    size = 12 if on is None else 10
    figure.suptitle(title, x=0.012, ha="left", fontsize=size, fontweight="bold", parse_math=False)
    axes = list(np.atleast_1d(figure.subplots(panels, 1, **keys)))
    for each in axes:
        quiet(each, 9.5)
    return figure, axes


def quiet(axes, labelsize: float = SMALL) -> None:
    """Faint grid and frame; the power of ten of the ticks stands beside the title, not below it."""
    axes.grid(True, color="#d9d9d9", lw=0.5)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(FAINT)
    axes.tick_params(labelsize=labelsize, color=FAINT)
    axes.yaxis.get_offset_text().set(ha="right", fontsize=labelsize)


def legend(axes, handles, **keys) -> None:
    """Legend in one row, above the axes to the right."""
    axes.legend(
        handles=handles,
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=len(handles),
        frameon=False,
        fontsize=SMALL,
        borderaxespad=0.1,
        **{"handlelength": 1.3, "columnspacing": 1.2, **keys},
    )


def legend_at_left(axes, ncols: int, fontsize: float = 9) -> None:
    """Legend of all that has a label, above the axes to the left."""
    axes.legend(
        loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=ncols, frameon=False,
        fontsize=fontsize, borderaxespad=0.1, handlelength=1.4, columnspacing=1.2,
    )  # fmt: skip


def label_time(panels: Iterable, unit: str, columns: int = 3) -> None:
    """Each panel over time, with its legend."""
    for axes in panels:
        axes.set_xlabel(f"time [{unit}]", fontsize=10)
        axes.margins(x=0)
        legend_at_left(axes, columns)


def foot(figure: Figure, text: str, size: float = 7.5) -> None:
    """A line of text at the lower left."""
    width, height = figure.get_size_inches()
    figure.text(0.12 / width, 0.09 / height, text, fontsize=size, color="#555555")
