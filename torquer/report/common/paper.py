"""Figures for one column of a journal: 88 mm wide, text of 8 pt, as PNG, PDF and SVG.

What a figure shows is told by its caption, not on it: `captions.txt` has a line for each.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from textwrap import wrap
from typing import Any

from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.text import Text

from torquer.report.common.figure import Sheet, save_figure, save_vector, tell_figure
from torquer.simulation.results.file import own_folder, put

MM = 1.0 / 25.4
#: Width of a column [inch], size of its text [pt], dots per inch of its PNG.
WIDTH, TEXT, DPI = 88.0 * MM, 8.0, 300
#: Height of a plot with its labels, and what each row of a legend adds [inch].
_PLOT, _ROW = 56.0 * MM, 4.0 * MM
#: Letters of a label that fit into a line below a plot.
_LETTERS_A_LINE = 46
#: Letters of a PDF as outlines of the font, which publishers ask for; the same names in each SVG.
_LETTERS: dict = {"pdf.fonttype": 42, "svg.hashsalt": "torquer", "svg.fonttype": "path"}


def column(draw: Callable[[Any], str], height: float = _PLOT) -> Figure:
    """A figure of one column; `draw` fills its axes and tells the caption, the figure's label.

    A legend takes as many rows as it needs.
    """
    margins = ConstrainedLayoutEngine(w_pad=0.04, h_pad=0.03)
    figure = Sheet(figsize=(WIDTH, height), dpi=DPI, facecolor="white", layout=margins)
    axes = figure.subplots()
    figure.set_label(draw(axes))
    axes.set_title("", loc="left")
    return _finished(figure)


def as_column(figure: Figure, height: float | None = None) -> Figure:
    """A figure of panels, as `stack_panels` makes it, made as wide as a column; its title becomes
    the caption.

    `height` [inch]: of all panels together [one plot's for each].
    """
    figure.set_label(figure.get_suptitle())
    figure.suptitle("")
    figure.set_size_inches(WIDTH, height or _PLOT * len(figure.axes))
    figure.set_dpi(DPI)
    for axes in figure.axes:
        axes.set_xlabel("\n".join(wrap(axes.get_xlabel(), _LETTERS_A_LINE)))
    return _finished(figure)


def _finished(figure: Figure) -> Figure:
    """Text of one size, legends above the axes, and the layout fixed, once for all three files.

    The texts are told before: others need other room.
    """
    tell_figure(figure)
    for axes in figure.axes:
        axes.xaxis.labelpad = axes.yaxis.labelpad = 2.0
    for text in figure.findobj(Text):
        text.set_fontsize(TEXT)
    for axes in figure.axes:
        if axes.get_legend():
            _fit_legend(axes)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    return figure


def _fit_legend(axes) -> None:
    """As many columns as fit above the axes, from the left edge of the figure."""
    figure, old = axes.figure, axes.get_legend()
    handles, labels = old.legend_handles, [text.get_text() for text in old.get_texts()]
    old.remove()
    height = figure.get_figheight()
    for columns in range(len(handles), 0, -1):
        legend = figure.legend(
            handles, labels, loc="outside upper left", ncols=columns, frameon=False,
            fontsize=TEXT, borderaxespad=0.0, borderpad=0.1, handlelength=1.2,
            handletextpad=0.4, columnspacing=0.9, labelspacing=0.2,
        )  # fmt: skip
        rows = -(-len(handles) // columns)
        figure.set_figheight(height + rows * _ROW)
        box = legend.get_window_extent(FigureCanvasAgg(figure).get_renderer())
        if columns == 1 or box.width <= figure.bbox.width:
            return
        legend.remove()


def save_drawn(figures: Mapping[str, Figure], folder: Path, paper: object = None) -> list[Path]:
    """Write pictures of an answer as NAME.png and, with `paper`, also each as one of a column.

    Those stand in the folder `paper`. Returns what was written: files, and that folder.
    """
    written = [save_figure(figure, folder / f"{name}.png") for name, figure in figures.items()]
    if not paper:
        return written
    save_paper({name: as_column(figure) for name, figure in figures.items()}, folder / "paper")
    return [*written, folder / "paper"]


def save_paper(figures: Mapping[str, Figure], folder: Path) -> list[Path]:
    """Write each figure as NAME.png, NAME.pdf and NAME.svg, captions.txt; always the same bytes."""
    own_folder(folder)
    written = []
    for name, figure in figures.items():
        written.append(save_figure(figure, folder / f"{name}.png"))
        with rc_context(_LETTERS):
            written += [save_vector(figure, folder / f"{name}.{kind}") for kind in ("pdf", "svg")]
    captions = "".join(f"{name}: {figure.get_label()}\n" for name, figure in figures.items())
    return [*written, put(folder / "captions.txt", captions)]
