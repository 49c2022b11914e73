"""Disturbance torques over time."""

from itertools import cycle

import numpy as np

from torquer.analysis.budget import NAMES
from torquer.base.language import joined, message
from torquer.report.common.colours import BLUE, GREEN, GREY, ORANGE, PINK, RED, SKY
from torquer.report.common.scales import choose_prefix
from torquer.report.flight.budget_rows import reach_in_words
from torquer.report.flight.panels.panel import Panel, Picture, log_panel, whole, xyz
from torquer.report.flight.view import View

#: Panels of the sizes and the torques in them; few enough for a legend.
_ENVIRONMENTAL = ("gravity_gradient", "aerodynamic", "solar_pressure")
_PANELS = {
    message("Environmental torques"): _ENVIRONMENTAL,
    message("Torques of the satellite itself"): tuple(
        name for name in NAMES if name not in (*_ENVIRONMENTAL, "all", "coils")
    ),
}
#: Colour of each torque; the eighth has that of the first, in another panel.
_COLOURS = (BLUE, SKY, ORANGE, GREEN, PINK, RED, "#8B6D3F")
COLOURS = dict(zip(NAMES, cycle(_COLOURS), strict=False))


def torques(view: View) -> Picture:
    """Sizes of the disturbance torques, and the sum of all in body axes."""
    total = view.budget.total
    factor, unit = choose_prefix(total, "N m")
    lines = xyz(view.t_s, factor * total)
    parts = whole(view, message("Sum of all in body axes"), message("[{unit}]", unit=unit), lines)
    caption = message("Along the recorded motion, by the kernels of the simulation. ")
    if reach := reach_in_words(view.budget):
        caption = joined("", [caption, reach])
    sizes = (
        _sizes(view, title, [name for name in names if name in view.budget.disturbance])
        for title, names in _PANELS.items()
    )
    panels = (*(panel for panel in sizes if panel), parts)
    return Picture("torques", message("Disturbance torques"), caption, panels)


def _sizes(view: View, title: str, names: list[str]) -> Panel | None:
    """Sizes of some torques, with what the coils can give; None without torques."""
    if not names:
        return None
    budget = view.budget
    sizes = {name: np.linalg.norm(budget.disturbance[name], axis=1) for name in names}
    factor, unit = choose_prefix(np.concatenate([*sizes.values()]), "N m")
    series = [
        (message(NAMES[name]), factor * size, COLOURS[name], 1.0) for name, size in sizes.items()
    ]
    if budget.available is not None:
        series.append((message("coils, at most"), factor * budget.available, GREY, 1.2))
    return log_panel(view, title, message("|M| [{unit}]", unit=unit), series)
