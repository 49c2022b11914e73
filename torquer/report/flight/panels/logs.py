"""Quantities logged by laws and estimators, over time."""

from typing import NamedTuple

import numpy as np

from torquer.base.language import joined, message
from torquer.report.common.colours import GREY, curve_colour
from torquer.report.common.scales import choose_prefix
from torquer.report.flight.panels.panel import Panel, Picture, make_line, whole, xyz
from torquer.report.flight.view import View


def logged_names(view: View) -> list[str]:
    """Names of logged variables: key of the law or estimator, a dot, name of the quantity."""
    names = map(str, view.result.data_vars)
    return [name for name in names if name.partition(".")[0] in view.laws and "." in name]


class Quantity(NamedTuple):
    """What goes on one panel: its title, its values (k, n) in a unit."""

    title: str
    values: np.ndarray
    unit: str


def logs(view: View) -> Picture:
    """A panel for each logged quantity that changes, of several states one for each."""
    found = [each for name in logged_names(view) for each in _quantities(view, name)]
    shown = [each for each in found if not _is_constant(each)]
    still: dict[str, list[str]] = {}
    for each in found:
        if _is_constant(each):
            still.setdefault(_constant_in_words(each), []).append(each.title)
    caption = message(
        "Quantities logged by laws and estimators, each under the name of its law or estimator. "
        "Of a covariance, the standard deviations."
    )
    constant = [
        message("{words}: {titles}.", words=words, titles=", ".join(titles))
        for words, titles in still.items()
    ]
    caption = joined(" ", [caption, *constant])
    return Picture(
        "logs", message("Logs"), caption, tuple(_panel(view, each) for each in shown or found)
    )


def _is_constant(quantity: Quantity) -> bool:
    values = quantity.values
    return np.array_equal(values, np.broadcast_to(values[0], values.shape), equal_nan=True)


def _constant_in_words(quantity: Quantity) -> str:
    first, unit = quantity.values[0], quantity.unit
    if np.isnan(first).all():
        return message("Without a value")
    shown = " / ".join(f"{value:g}" for value in dict.fromkeys(first))
    if unit == "1":
        return message("Always {shown}", shown=shown)
    return message("Always {shown} {unit}", shown=shown, unit=unit)


def _quantities(view: View, name: str) -> list[Quantity]:
    """What a logged variable gives to show, angles in degrees."""
    variable, values, of = view.result[name], view.values(name), name
    # places along a dimension that have names have units of their own
    named = [dim for dim in variable.dims[1:] if f"{dim}_units" in view.result.coords]
    labels = [view.result[dim].values.tolist() for dim in named]
    if len(labels) == 2 and labels[0] == labels[1]:
        values, of = np.sqrt(np.einsum("kii->ki", values)), f"{name}, standard deviation"
    elif len(labels) != 1 or values.ndim != 2:
        unit = variable.attrs.get("units", "1")
        return [_in_degrees(name, values.reshape(len(values), -1), unit)]
    units = view.result[f"{variable.dims[1]}_units"].values
    return [
        _in_degrees(f"{of}, {stem}", values[:, columns], str(units[columns.start]))
        for stem, columns in _groups(labels[0])
    ]


def _in_degrees(title: str, values: np.ndarray, unit: str) -> Quantity:
    """A quantity, angles in degrees unless its own name says radians."""
    if unit.split("/")[0] == "rad" and "rad" not in title.split("_"):
        return Quantity(title, np.degrees(values), f"deg{unit.removeprefix('rad')}")
    return Quantity(title, values, unit)


def _groups(labels: list[str]) -> list[tuple[str, slice]]:
    """What belongs on one panel: three components of a vector, or a single number."""
    found, k = [], 0
    while k < len(labels):
        stem = labels[k].removesuffix("_x")
        vector = labels[k : k + 3] == [f"{stem}_{c}" for c in "xyz"]
        found.append((stem, slice(k, k + (3 if vector else 1))))
        k = found[-1][1].stop
    return found


def _panel(view: View, quantity: Quantity) -> Panel:
    """A panel of a quantity."""
    title, values, unit = quantity
    # of powers and quotients a prefix would be ambiguous; millidegrees are unusual
    if unit.replace(" ", "").isalpha() and unit != "deg":
        factor, unit = choose_prefix(values, unit)
        values = factor * values
    if (columns := values.shape[1]) == 3:
        lines = xyz(view.t_s, values)
    elif columns == 1:
        lines = (make_line(title.partition(".")[2], view.t_s, values[:, 0], GREY, 1.2),)
    else:
        lines = tuple(
            make_line(str(k), view.t_s, values[:, k], curve_colour(k)) for k in range(columns)
        )
    owner = title.partition(".")[0]
    return whole(view, title, f"[{unit}]", lines, fold=owner)
