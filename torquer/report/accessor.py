"""`result.torquer`: derived quantities and the report's pictures of a result, in notebooks.

result = torquer.simulate(scenario)
result.torquer.rate()             # deg/s over time
result.torquer.sun_angle([0, 0, 1])
result.torquer.plot.rate()        # a matplotlib figure, shown by a notebook
"""

from __future__ import annotations

import base64
from collections.abc import Callable
from functools import cached_property, wraps
from html import escape
from typing import TYPE_CHECKING, Concatenate, ParamSpec, TypeVar

import xarray as xr

from torquer.analysis import derived
from torquer.analysis.citations import citations
from torquer.analysis.summary import summary_of
from torquer.analysis.summary_rows import rows_of
from torquer.scenario.spec import Scenario
from torquer.simulation.results.dataset import laws_of, scenario_of

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
        return scenario_of(self._result)

    @property
    def laws(self) -> dict[str, dict]:
        """Laws and estimators that were flown, as `torquer.laws_of` gives them."""
        return laws_of(self._result)

    @property
    def summary(self) -> dict:
        """The key numbers, as `torquer.summary_of` gives them."""
        return summary_of(self._result)

    rate = _method(derived.rate_of)
    rate_body = _method(derived.rate_body_of)
    rate_orbital = _method(derived.rate_orbital_of)
    attitude_error = _method(derived.attitude_error_angle_of)
    sun_angle = _method(derived.sun_angle_of)
    nutation = _method(derived.nutation_of)
    vertical_angle = _method(derived.vertical_angle_of)
    wheel_speed = _method(derived.wheel_speed_of)
    mode = _method(derived.mode_of)
    derived = _method(derived.derived_of)
    citations = _method(citations)

    @property
    def plot(self) -> Plots:
        """The report's pictures, by name: `plot.rate()`, `plot.overview()`; `dir` lists them."""
        return Plots(self._result)

    def _repr_html_(self) -> str:
        from torquer.report.common.figure import png_of

        rows = "".join(
            f"<tr><th>{escape(label)}</th><td>{escape(value)}</td></tr>"
            for label, value in rows_of(self.summary)
        )
        picture = base64.b64encode(png_of(self.plot.overview())).decode("ascii")
        return (
            f"<h4>{escape(self.scenario.name)}</h4><table>{rows}</table>"
            f'<img alt="Overview of the run" src="data:image/png;base64,{picture}">'
        )


class Plots:
    """The report's pictures of a result: each name is a function that gives a matplotlib figure."""

    def __init__(self, result: xr.Dataset):
        self._result = result

    @cached_property
    def _drawn(self) -> tuple:
        from torquer.report.flight.panels import pictures
        from torquer.report.flight.png import figures_of
        from torquer.report.flight.view import view_of

        view = view_of(self._result)
        return view, figures_of(pictures(view))

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
