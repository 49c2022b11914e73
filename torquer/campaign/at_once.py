"""Many members prepared at once: what varies goes through specs and setup as columns of numbers."""

from collections.abc import Mapping

import numpy as np

from torquer.base.columns import Mixed, Own, as_column
from torquer.base.computing import Computing
from torquer.base.shared import Sharing
from torquer.campaign.sampling import Drawn
from torquer.campaign.variation import ATTITUDE
from torquer.scenario.change import with_columns
from torquer.simulation.lanes.group import Lanes, why_not_in_lanes
from torquer.simulation.setup.run import Piece, Run, prepare

#: Members below which it is not worth while, and how often some are computed apart.
_FEW, _MOST_PARTS = 8, 6


class AtOnce:
    """Prepares members for their lanes. Those that it leaves out have to be prepared one by one.

    What refuses columns is remembered.
    """

    def __init__(self, base: Run, sharing: Sharing, piece: Piece | None):
        self._base, self._sharing, self._piece = base, sharing, piece
        self._one_by_one: set = set()

    def numbers(self, lanes: Lanes, drawn: Drawn, seeds: np.ndarray) -> dict[int, np.ndarray]:
        """Numbers (size,) of members in their lanes, by their rows; all of them, some or none."""
        found: dict[int, np.ndarray] = {}
        parts, tried = [np.arange(len(seeds))], 0
        while parts and tried < _MOST_PARTS:
            rows, tried = parts.pop(0), tried + 1
            if len(rows) < _FEW:
                continue
            try:
                numbers = self._numbers_of(lanes, _of_rows(drawn, rows), seeds[rows])
            except Mixed as mixed:
                parts += [rows[mixed.one], rows[~mixed.one]]
            except Exception:  # alone they can be prepared, or say why not
                continue
            else:
                found |= {} if numbers is None else dict(zip(rows.tolist(), numbers, strict=True))
        return found

    def _numbers_of(self, lanes: Lanes, drawn: Drawn, seeds: np.ndarray) -> np.ndarray | None:
        """Numbers (n, size) of members; None if they do not fit into the lanes."""
        computing = Computing(len(seeds), self._one_by_one)
        own = {"seed": Own(seeds.tolist())}
        values = {**own, **_columns(drawn)}
        with computing.present(), self._sharing.used():
            member = with_columns(computing, self._base.scenario, values)
            run = prepare(member, piece=self._piece, library=self._base.library)
            packed = None if why_not_in_lanes(run) else lanes.takes(run)
        if packed is None or computing.has_refused:
            return None
        return np.broadcast_to(packed.numbers, (len(seeds), packed.numbers.shape[-1]))


def _of_rows(drawn: Drawn, rows: np.ndarray) -> Drawn:
    return {
        key: values[rows] if isinstance(values, np.ndarray) else [values[row] for row in rows]
        for key, values in drawn.items()
    }


def _columns(drawn: Drawn) -> Mapping:
    """Columns by the scenario's keys, as `as_changes` has values of one member."""
    changes: dict = {}
    for key, values in drawn.items():
        if not isinstance(values, np.ndarray):
            if any(type(each) is not float for each in values):
                raise TypeError("no numbers")
            values = np.array(values)
        column = as_column(values)
        if key == ATTITUDE:
            changes |= {"initial.quaternion": column, "initial.euler_deg": (0.0, 0.0, 0.0)}
        else:
            changes[key] = column
    return changes
