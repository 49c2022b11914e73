"""What outcomes need of members beside their motion: momenta that they carry, and logs."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from torquer.base.explain import suggestion
from torquer.campaign.outcomes import log_names
from torquer.campaign.spec import Campaign
from torquer.simulation.lanes.packing import Packed
from torquer.simulation.loop.state import Record
from torquer.simulation.results.momenta import Carried
from torquer.simulation.setup.prepare import make_log
from torquer.simulation.setup.run import Run


class LogCell(NamedTuple):
    """A number that is logged: its cell of the board's memory, and its unit."""

    cell: int
    unit: str


def log_cells(run: Run) -> dict[str, LogCell]:
    """All numbers that the laws and estimators of a run log, by their names: KEY.NAME[k]."""
    found = {}
    for name, _, part, cells in make_log(run.blocks):
        for place, cell in zip(np.ndindex(*part.shape), cells, strict=True):
            units = [axis.units[k] for axis, k in zip(part.axes, place, strict=False)]
            unit = " ".join(units) if units else part.unit
            found[name + "".join(f"[{k}]" for k in place)] = LogCell(cell, unit)
    return found


def find_logs(campaign: Campaign, run: Run) -> dict[str, LogCell]:
    """The logs that outcomes are taken from, by name; ValueError for one that a run has not.

    A campaign over laws may name what only some of them log.
    """
    known, asked = log_cells(run), log_names(campaign.outcomes)
    for log, outcome in asked.items():
        if log not in known and not any(key.startswith("control") for key in campaign.varied_keys):
            near = suggestion(log, [*known]) if known else ": they log nothing"
            raise ValueError(
                f"campaign.outcomes.{outcome}.signal: must be a number that a law or an estimator "
                f"logs; received {log!r}{near}"
            )
    return {log: known[log] for log in asked if log in known}


def recorded_logs(record: Record, run: Run, rows: slice, asked: Iterable[str]) -> dict:
    """Logs (r, 1) of a run by itself at some rows; NaN of one that its law does not log."""
    known, kept = log_cells(run), run.plan.log_cells.tolist()
    unknown = np.full((len(record.rows[rows]), 1), np.nan)
    columns = {name: kept.index(known[name].cell) for name in asked if name in known}
    return {
        name: record.log[rows, columns[name], None] if name in columns else unknown
        for name in asked
    }


def carried_in(packed: Packed, numbers: np.ndarray) -> Carried:
    """What members (n, size) in lanes carry, as `packed` tells where it stands."""
    inertia, _, fixed, *_ = packed.of_dynamics.plant.parts[0].parts
    rows_at, rows = packed.of_loop.plant.parts[1].parts[0]
    firsts = rows_at + rows.size * np.arange(rows.shape[0])
    axes = numbers[:, firsts[:, None] + np.arange(3)]
    return Carried(numbers[:, list(inertia.parts)], numbers[:, list(fixed.parts)], axes)
