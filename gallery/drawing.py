"""Figures of the entries in one style, as files: a picture in full and a small one for pages."""

import io

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from torquer.report.common.colours import BLUE, GREEN, GREY, ORANGE, PINK, RED, SKY
from torquer.report.common.figure import FINE_DPI, stack_panels
from torquer.report.theory.pictures import isolines

#: Colours of the field models, the same in every picture, best model first.
MODEL_COLOURS = {"IGRF-14": "#222222", "tilted dipole": RED, "direct dipole": BLUE,
                 "averaged": GREEN}  # fmt: skip
COLOURS = (BLUE, RED, GREEN, ORANGE, SKY, PINK)
_SMALL_DPI = 90
_COLOURS_OF_A_SMALL_ONE = 64

new_figure = stack_panels


def label(axes, x: str, y: str, *, legend: bool = True, columns: int = 4) -> None:
    """Labels with units, and the legend above the axes where it hides nothing."""
    axes.set_xlabel(x, fontsize=10)
    axes.set_ylabel(y, fontsize=10)
    if legend:
        axes.legend(
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            ncols=columns,
            frameon=False,
            fontsize=9.5,
            borderaxespad=0.1,
            handlelength=1.5,
            columnspacing=1.3,
        )


def shaded_map(axes, x, y, values, levels, name: str, form: str = "%g", signed=False) -> None:
    """A map with labelled isolines, and what its shades mean: a colour bar with name and unit.

    `signed`: values of either sign have two hues, pale at zero.
    """
    ground = isolines(axes, x, y, values, levels, form, signed=signed)
    bar = axes.figure.colorbar(ground, ax=axes, pad=0.02, aspect=30)
    bar.set_label(name, fontsize=10)
    bar.ax.tick_params(labelsize=9.5)
    bar.outline.set_visible(False)


def level(axes, y: float, text: str) -> None:
    """A horizontal mark with its label, at the right end and above the line."""
    axes.axhline(y, color=GREY, lw=0.9, ls=(0, (5, 3)), zorder=1.5)
    axes.annotate(
        text,
        (1.0, y),
        xycoords=("axes fraction", "data"),
        xytext=(0, 2),
        textcoords="offset points",
        ha="right",
        fontsize=9.5,
        color="#555555",
    )


def save(figure: Figure, path) -> None:
    """Write a figure in full size."""
    FigureCanvasAgg(figure).print_figure(path, dpi=FINE_DPI)


def save_small(figure: Figure, path) -> None:
    """Write a figure about 650 pixels wide in few colours, for pages: well below 60 kB."""
    from PIL import Image

    buffer = io.BytesIO()
    FigureCanvasAgg(figure).print_figure(buffer, dpi=_SMALL_DPI)
    picture = Image.open(buffer).convert("RGB")
    few = picture.quantize(  # one step of k-means: without it thin lines take on other colours
        _COLOURS_OF_A_SMALL_ONE, kmeans=1, dither=Image.Dither.NONE
    )
    few.save(path, optimize=True)
