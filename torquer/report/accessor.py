"""`result.torquer`: derived quantities and the report's pictures of a result, in notebooks.

result = torquer.simulate(scenario)
result.torquer.rate()             # deg/s over time
result.torquer.sun_angle([0, 0, 1])
result.torquer.plot.rate()        # a matplotlib figure, shown by a notebook
"""

from __future__ import annotations

import base64
from collections.abc import Callable, Sequence
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING

import xarray as xr

from torquer.analysis import derived
from torquer.analysis.summary import summary_of
from torquer.report.flight.summary_rows import rows_of
from torquer.scenario.spec import Scenario
from torquer.simulation.result import laws_of, scenario_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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

    def rate(self) -> xr.DataArray:
        """Size of the absolute angular velocity [deg/s] over `time`."""
        return derived.rate_of(self._result)

    def rate_body(self) -> xr.DataArray:
        """Absolute angular velocity [deg/s] in body axes over `time`, `axis`."""
        return derived.rate_body_of(self._result)

    def rate_orbital(self) -> xr.DataArray:
        """Angular velocity relative to the orbital frame [deg/s], in body axes."""
        return derived.rate_orbital_of(self._result)

    def attitude_error(self) -> xr.DataArray:
        """Angle [deg] from the attitude that the laws held; ValueError where they held none."""
        return derived.attitude_error_angle_of(self._result)

    def sun_angle(self, axis: Sequence[float] | None = None) -> xr.DataArray:
        """Angle [deg] of a body axis, or of x, y and z, from the direction to the Sun."""
        return derived.sun_angle_of(self._result, axis)

    def nutation(self, axis: Sequence[float] | None = None) -> xr.DataArray:
        """Angle [deg] of the angular momentum from a body axis [that of the greatest moment]."""
        return derived.nutation_of(self._result, axis)

    def vertical_angle(self) -> xr.DataArray:
        """Angles [deg] of the body's x, y and z axes from the local vertical."""
        return derived.vertical_angle_of(self._result)

    def wheel_speed(self) -> xr.DataArray:
        """Speed of each wheel [rpm]; ValueError for a satellite without wheels."""
        return derived.wheel_speed_of(self._result)

    def mode(self, region: str | None = None) -> xr.DataArray:
        """Name of the state of a region of modes over `time`."""
        return derived.mode_of(self._result, region)

    def derived(self) -> xr.Dataset:
        """All of these that apply to the run, as one data set."""
        return derived.derived_of(self._result)

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
