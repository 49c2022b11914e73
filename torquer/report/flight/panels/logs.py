"""Quantities logged by laws and estimators, over time."""

from torquer.report.common.colours import GREY
from torquer.report.common.scales import prefixed
from torquer.report.flight.panels.panel import Panel, Picture, line_of, whole, xyz
from torquer.report.flight.view import View


def logged(view: View) -> list[str]:
    """Names of logged variables: key of the law or estimator, a dot, name of the quantity."""
    names = map(str, view.result.data_vars)
    return [name for name in names if name.partition(".")[0] in view.laws and "." in name]


def logs(view: View) -> Picture:
    """A panel for each logged quantity."""
    caption = (
        "Quantities logged by laws and estimators, each under the name of its law or estimator."
    )
    return Picture("logs", "Logs", caption, tuple(_panel(view, name) for name in logged(view)))


def _panel(view: View, name: str) -> Panel:
    values, unit = view.values(name), view.result[name].attrs["units"]
    factor = 1.0
    if unit.replace(" ", "").isalpha():  # of powers and quotients a prefix would be ambiguous
        factor, unit = prefixed(values, unit)
    lines = (
        xyz(view.t_s, factor * values)
        if values.ndim == 2
        else (line_of(name.partition(".")[2], view.t_s, factor * values, GREY, 1.2),)
    )
    return whole(view, title=name, y_label=f"[{unit}]", lines=lines)
