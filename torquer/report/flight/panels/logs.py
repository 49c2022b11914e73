"""Quantities logged by laws and estimators, over time."""

import numpy as np

from torquer.report.common.colours import BLUE, GREEN, GREY, ORANGE, PINK, RED, SKY
from torquer.report.common.scales import prefixed
from torquer.report.flight.panels.panel import Panel, Picture, line_of, whole, xyz
from torquer.report.flight.view import View

_COLOURS = (BLUE, RED, GREEN, ORANGE, SKY, PINK)


def logged(view: View) -> list[str]:
    """Names of logged variables: key of the law or estimator, a dot, name of the quantity."""
    names = map(str, view.result.data_vars)
    return [name for name in names if name.partition(".")[0] in view.laws and "." in name]


def logs(view: View) -> Picture:
    """A panel for each logged quantity, of several states one for each."""
    caption = (
        "Quantities logged by laws and estimators, each under the name of its law or estimator. "
        "Of a covariance, the standard deviations."
    )
    panels = (panel for name in logged(view) for panel in _panels(view, name))
    return Picture("logs", "Logs", caption, tuple(panels))


def _panels(view: View, name: str) -> list[Panel]:
    variable, values, of = view.result[name], view.values(name), name
    labels = [view.result[dim].values.tolist() for dim in variable.dims[1:] if _named(view, dim)]
    if len(labels) == 2 and labels[0] == labels[1]:
        values, of = np.sqrt(np.einsum("kii->ki", values)), f"{name}, standard deviation"
    elif len(labels) != 1 or values.ndim != 2:
        unit = variable.attrs.get("units", "1")
        return [_panel(view, name, values.reshape(len(values), -1), unit)]
    units = view.result[f"{variable.dims[1]}_units"].values
    return [
        _panel(view, f"{of}, {stem}", values[:, columns], str(units[columns.start]))
        for stem, columns in _groups(labels[0])
    ]


def _named(view: View, dim) -> bool:
    """Whether the places along a dimension have names, and units of their own."""
    return f"{dim}_units" in view.result.coords


def _groups(labels: list[str]) -> list[tuple[str, slice]]:
    """What belongs on one panel: three components of a vector, or a single number."""
    found, k = [], 0
    while k < len(labels):
        stem = labels[k].removesuffix("_x")
        vector = labels[k : k + 3] == [f"{stem}_{c}" for c in "xyz"]
        found.append((stem, slice(k, k + (3 if vector else 1))))
        k = found[-1][1].stop
    return found


def _panel(view: View, title: str, values: np.ndarray, unit: str) -> Panel:
    """A panel of the columns of an array (k, n)."""
    factor = 1.0
    if unit.replace(" ", "").isalpha():  # of powers and quotients a prefix would be ambiguous
        factor, unit = prefixed(values, unit)
    values = factor * values
    if (columns := values.shape[1]) == 3:
        lines = xyz(view.t_s, values)
    elif columns == 1:
        lines = (line_of(title.partition(".")[2], view.t_s, values[:, 0], GREY, 1.2),)
    else:
        colours = [_COLOURS[k % len(_COLOURS)] for k in range(columns)]
        lines = tuple(
            line_of(str(k), view.t_s, values[:, k], each) for k, each in enumerate(colours)
        )
    return whole(view, title=title, y_label=f"[{unit}]", lines=lines)
