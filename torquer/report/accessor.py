"""`result.torquer`: derived quantities and the report's pictures of a result, in notebooks.

result = torquer.simulate(scenario)
result.torquer.rate()             # deg/s over time
result.torquer.sun_angle([0, 0, 1])
result.torquer.plot.rate()        # a matplotlib figure, shown by a notebook
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, wraps
from html import escape
from typing import TYPE_CHECKING, Concatenate, ParamSpec, TypeVar

import xarray as xr

from torquer.analysis import derived
from torquer.analysis.citations import citations
from torquer.analysis.summary import summarise, summary_rows, told_rows
from torquer.analysis.table import to_dataframe
from torquer.scenario.spec import Scenario
from torquer.simulation.results.dataset import flown_laws, flown_scenario

if TYPE_CHECKING:
    from matplotlib.figure import Figure


P = ParamSpec("P")
R = TypeVar("R")


def _method(
    function: Callable[Concatenate[xr.Dataset, P], R],
) -> Callable[Concatenate[Torquer, P], R]:
    """A function of a result as a method of its accessor, with the function's documentation."""

    @wraps(function)
    def method(self: Torquer, *given: P.args, **named: P.kwargs) -> R:
        return function(self._result, *given, **named)

    return method


@xr.register_dataset_accessor("torquer")
class Torquer:
    """Derived quantities and pictures of a result; registered with xarray by `import torquer`."""

    def __init__(self, result: xr.Dataset):
        self._result = result

    @property
    def scenario(self) -> Scenario:
        """The scenario that was flown."""
        return flown_scenario(self._result)

    @property
    def laws(self) -> dict[str, dict]:
        """Laws and estimators that were flown, as `torquer.flown_laws` gives them."""
        return flown_laws(self._result)

    @property
    def summary(self) -> dict:
        """The key numbers, as `torquer.summarise` gives them."""
        return summarise(self._result)

    rate = _method(derived.rate_size)
    rate_body = _method(derived.body_rate)
    rate_orbital = _method(derived.orbital_rate)
    attitude_error = _method(derived.attitude_error_angle)
    commanded_error = _method(derived.commanded_error_angle)
    sun_angle = _method(derived.angle_from_sun)
    nutation = _method(derived.nutation_angle)
    vertical_angle = _method(derived.angle_from_vertical)
    wheel_speed = _method(derived.wheel_speeds)
    mode = _method(derived.mode_over_time)
    derived = _method(derived.derive)
    citations = _method(citations)
    to_dataframe = _method(to_dataframe)

    @property
    def plot(self) -> Plots:
        """The report's pictures, by name: `plot.rate()`, `plot.overview()`; `dir` lists them."""
        return Plots(self._result)

    def page(self) -> Figure:
        """One page of A4 about the run, as `torquer.page` gives it."""
        from torquer.report.common.one_page import draw_page
        from torquer.report.flight.one_page import run_page

        return draw_page(run_page(self._result))

    def _repr_html_(self) -> str:
        from torquer.report.common.figure import image

        rows = "".join(
            f"<tr><th>{escape(label)}</th><td>{escape(value)}</td></tr>"
            for label, value in told_rows(summary_rows(self.summary))
        )
        picture = image(self.plot.overview(), "Overview of the run")
        return f"<h4>{escape(self.scenario.name)}</h4><table>{rows}</table>{picture}"


class Plots:
    """The report's pictures of a result: each name is a function that gives a matplotlib figure."""

    def __init__(self, result: xr.Dataset):
        self._result = result

    @cached_property
    def _drawn(self) -> tuple:
        from torquer.report.flight.panels import pictures
        from torquer.report.flight.png import picture_functions
        from torquer.report.flight.view import make_view

        view = make_view(self._result)
        return view, picture_functions(pictures(view))

    def __getattr__(self, name: str) -> Callable[[], Figure]:
        if name.startswith("_"):
            raise AttributeError(name)
        view, figures = self._drawn
        if name not in figures:
            raise AttributeError(
                f"plot: must be one of {', '.join(figures)} for this run; received {name!r}"
            )
        return lambda: figures[name](view)

    def __dir__(self) -> list[str]:
        return sorted(self._drawn[1])
