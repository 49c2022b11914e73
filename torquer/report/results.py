"""Functions that give results, as `torquer` offers them: importing them registers the accessor.

To type checkers and editors their results are datasets that have `result.torquer`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, ParamSpec

import torquer.report.accessor  # registers itself
from torquer.analysis import side_by_side
from torquer.simulation.results import file
from torquer.simulation.setup import simulate as flying

if TYPE_CHECKING:
    import xarray as xr

    class Result(xr.Dataset):
        """A result: a Dataset with derived quantities and pictures."""

        @property
        def torquer(self) -> torquer.report.accessor.Torquer: ...


P = ParamSpec("P")


def _with_methods(function: Callable[P, xr.Dataset]) -> Callable[P, Result]:
    return function  # type: ignore[return-value]


simulate = _with_methods(flying.simulate)
resume = _with_methods(flying.resume)
load = _with_methods(file.load)
concat = _with_methods(side_by_side.concat)
pick_run = _with_methods(side_by_side.pick_run)
