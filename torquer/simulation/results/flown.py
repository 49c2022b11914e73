"""What was flown, as a result has it: for those who read results and simulate nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING

from torquer.scenario.spec import Scenario

if TYPE_CHECKING:
    import xarray as xr


def flown_scenario(result: xr.Dataset) -> Scenario:
    """The scenario that was flown, its laws named in it."""
    return Scenario.model_validate_json(result.attrs["scenario"])
