"""Functions that give results, as `torquer` offers them: importing them registers the accessor.

To type checkers and editors their results are datasets that have `result.torquer`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, ParamSpec

import torquer.report.accessor  # registers itself
from torquer.analysis.side_by_side import concat as _concat, pick_run as _pick_run
from torquer.simulation.results.file import load as _load
from torquer.simulation.setup.simulate import resume as _resume, simulate as _simulate

if TYPE_CHECKING:
    import xarray as xr

    class Result(xr.Dataset):
        """A result: a Dataset with derived quantities and pictures."""

        @property
        def torquer(self) -> torquer.report.accessor.Torquer: ...


P = ParamSpec("P")


def _with_methods(function: Callable[P, xr.Dataset]) -> Callable[P, Result]:
    return function  # type: ignore[return-value]


simulate = _with_methods(_simulate)
resume = _with_methods(_resume)
load = _with_methods(_load)
concat = _with_methods(_concat)
pick_run = _with_methods(_pick_run)
