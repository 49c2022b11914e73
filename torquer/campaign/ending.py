"""Members in lanes that a condition ends before their time: their parts until then, and no more."""

from collections.abc import Iterator

import numpy as np

from torquer.campaign.checks import CHECKS, ENDED_S
from torquer.campaign.outcomes import TOTALS
from torquer.campaign.signals import Flown
from torquer.scenario.ending import EndWhen
from torquer.simulation.setup.ending import NOT_YET, Seen, end_signal, has_ended

#: Cells of the state that outcomes and checks take at the end.
CELLS_AT_END = (*TOTALS, *(check.cell for check in CHECKS.values()))


class Ends:
    """Which of n members have ended, when, and what their cells were then.

    `when`: None where none can; `length_s`: of a whole flight, at whose end none is looked for.
    """

    def __init__(self, when: EndWhen | None, count: int, length_s: float):
        self._when, self._length_s = when, length_s
        self._seen = Seen(np.full(count, NOT_YET), np.full(count, NOT_YET))
        self.t_s = np.full(count, np.nan)
        self._cells = np.full((count, len(CELLS_AT_END)), np.nan)

    def parts(
        self, columns: slice, flown: Flown, cells: np.ndarray
    ) -> Iterator[tuple[slice, Flown]]:
        """The members that still fly, as far as each flies in this part; `cells` (r, n, k)."""
        if self._when is None:
            yield columns, flown
            return
        running = np.isnan(self.t_s[columns])
        until = self._ends_of(columns, flown, running)
        if running.all() and (until == len(flown.t_s)).all():
            yield columns, flown
        else:
            for column in np.flatnonzero(running).tolist():
                own = columns.start + column
                yield slice(own, own + 1), _cut(flown, column, until[column])
        for column in np.flatnonzero(~np.isnan(self.t_s[columns]) & running).tolist():
            self._cells[columns.start + column] = cells[until[column] - 1, column]

    def _ends_of(self, columns: slice, flown: Flown, running: np.ndarray) -> np.ndarray:
        """Records (n,) of this part that each member flies; notes when those end that do."""
        signal = end_signal(self._when, flown.omega_body, flown.carried, flown.wheels_n_m_s)
        seen = Seen(*(each[columns] for each in self._seen))
        until, t_s = np.full(len(running), len(flown.t_s)), self.t_s[columns]
        for row, at_s in enumerate(flown.t_s):
            if at_s >= self._length_s * (1.0 - 1e-12):
                break
            ends = has_ended(self._when, at_s, signal[row], seen) & np.isnan(t_s)
            until[ends], t_s[ends] = row + 1, at_s
            if not np.isnan(t_s).any():
                break
        return until

    def all_have(self, columns: slice) -> bool:
        """Whether all of these members have ended."""
        return not np.isnan(self.t_s[columns]).any()

    def checks(self) -> dict[str, np.ndarray]:
        """When each member ended (n,) [s]; NaN for one that flew to the end."""
        return {ENDED_S: self.t_s}

    def put(self, cells: np.ndarray) -> None:
        """Put what the cells of members (n,) were at their ends into those at the end of all."""
        rows = ~np.isnan(self.t_s)
        for k, name in enumerate(CELLS_AT_END):
            cells[name][rows] = self._cells[rows, k]


def _cut(flown: Flown, column: int, until: int) -> Flown:
    """What one of the members flew until a record."""
    own, rows = slice(column, column + 1), slice(0, until)
    along = {
        name: None if (each := getattr(flown, name)) is None else each[rows]
        for name in ("t_s", "position_inertial", "velocity_inertial", "b_inertial", "sun_inertial")
    }
    carried, wheels = flown.carried, flown.wheels_n_m_s
    return flown._replace(
        **along,
        q_body_to_inertial=flown.q_body_to_inertial[rows, own],
        omega_body=flown.omega_body[rows, own],
        carried=None if carried is None else type(carried)(*(each[own] for each in carried)),
        wheels_n_m_s=None if wheels is None else wheels[rows, own],
        logs={name: each[rows, own] for name, each in flown.logs.items()},
    )
