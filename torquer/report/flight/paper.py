"""Each plot of a run as a figure of one column."""

import re

import xarray as xr
from matplotlib.figure import Figure

from torquer.report.common.paper import MM, column
from torquer.report.flight.panels import pictures
from torquer.report.flight.panels.panel import Panel
from torquer.report.flight.png import draw_panel, draw_strip
from torquer.report.flight.view import View, make_view

#: Height of the figure of a strip [inch].
_STRIP = 8.0 * MM


def run_figures(result: xr.Dataset) -> dict[str, Figure]:
    """The plots of a run, by the name of their picture; numbered, if that has several.

    A strip of modes stands above all pictures; here it is drawn once, by the name of its region.
    """
    view = make_view(result)
    found: dict[str, Figure] = {}
    for picture in pictures(view):
        plots = [panel for panel in picture.panels if not panel.bars]
        for i, panel in enumerate(plots, 1):
            found[picture.name + (f"_{i}" if len(plots) > 1 else "")] = _figure(view, panel)
        for strip in (panel for panel in picture.panels if panel.bars):
            if (name := _as_name(strip.title)) not in found:
                found[name] = _figure(view, strip)
    return found


def _as_name(title: str) -> str:
    """A title as part of a file's name."""
    return re.sub(r"\W+", "_", title).strip("_").lower()


def _figure(view: View, panel: Panel) -> Figure:
    draw = draw_strip if panel.bars else draw_panel

    def drawn(axes) -> str:
        draw(axes, view, panel)
        return panel.title

    return column(drawn, _STRIP) if panel.bars else column(drawn)
