"""What a run showed by itself, whatever was foretold: one line each."""

from collections.abc import Iterator

import xarray as xr

from torquer.analysis.notes.assess import assess
from torquer.analysis.spin_up import spin_up_notes
from torquer.scenario.resolution import notes_on_steps

_CHECKS = {"the steps of the run": notes_on_steps, "the energy of rotation": spin_up_notes}


def run_notes(result: xr.Dataset) -> Iterator[str]:
    """Notes on a result: what its steps did to the motion, and a rotation that grew."""
    yield from assess(_CHECKS, result)
