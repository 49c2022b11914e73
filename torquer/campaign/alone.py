"""Members flown one by one: each to its end, reduced piece by piece while it flies."""

from collections.abc import Mapping, Sequence

import numpy as np

from torquer.campaign.along import Along, along_at
from torquer.campaign.checks import ENDED_S, Rotation
from torquer.campaign.chunk import Chunk
from torquer.campaign.momenta import recorded_logs
from torquer.campaign.outcomes import TOTALS, log_names, needs_modes
from torquer.campaign.reduction import Reduction
from torquer.campaign.signals import Flown
from torquer.campaign.spec import Campaign
from torquer.scenario.spec import Scenario
from torquer.simulation.lanes.group import RECORDS
from torquer.simulation.loop.state import Record
from torquer.simulation.results.dataset import mode_numbers
from torquer.simulation.setup.checkpoints import Checkpoints, advance_in_pieces
from torquer.simulation.setup.ending import carried_by
from torquer.simulation.setup.run import Run, record_this_instant

#: Members that fail are flown again from their start: nothing is saved on the way.
_UNSAVED = Checkpoints(lambda run: None, np.inf)


class Alone:
    """Flies members by themselves; those of the times and the orbit of `base` share its records.

    `kept`: numbers of the records at which signals are kept; `carries`: whether outcomes are of
    momenta that members carry.
    """

    def __init__(
        self, scenario: Scenario, campaign: Campaign, base: Run, kept: np.ndarray, carries: bool
    ):
        self._scenario, self._campaign, self._base = scenario, campaign, base
        self._kept, self._carries = kept, carries
        self._log_names = [*log_names(campaign.outcomes)]
        self._needs_modes = needs_modes(campaign.outcomes, scenario)
        self.along = Along(scenario, campaign, base)

    def fly(self, chunk: Chunk, row: int, run: Run) -> None:
        """Fly a member's run to its end, and put what it gives into its row."""
        taking = _Taking(self, run)
        run.keep = taking.take
        try:
            ended = advance_in_pieces(run, run.steps, None, _UNSAVED)
        except ValueError as error:
            ended = " ".join(str(error).split("\n"))
        if ended:
            chunk.ended[row] = ended
            return
        run.enter()
        record_this_instant(run)
        run.keep(run)
        rows = np.array([row])
        chunk.put(rows, taking.found, {name: np.array(run.state.cells[name]) for name in TOTALS})
        ended_s = np.array([run.now_s if run.steps < run.scenario.steps() else np.nan])
        also = taking.rotation.spun_up() | {ENDED_S: ended_s}
        chunk.put_checks(rows, run.scenario, run.state.cells, also)


class _Taking:
    """What is taken of one run, piece by piece.

    `shared`: its records' times and orbit are those of all members; `changes`: states of its
    regions so far, without records in which none changes.
    """

    def __init__(self, alone: Alone, run: Run):
        of_base, self._alone = alone._base, alone
        same_times = _times(run) == _times(of_base)
        kept = alone._kept if same_times else alone._kept[:0]
        self.found = Reduction(alone._campaign.outcomes, alone._scenario, 1, kept)
        self.rotation = Rotation(alone._scenario, 1, run.scenario.length_s)
        self._shared = same_times and run.piece.environment == of_base.piece.environment
        self._changes: dict[str, np.ndarray] = {}

    def take(self, run: Run) -> None:
        """Take what a piece of the run gives."""
        record = run.rows()
        modes = mode_numbers(run.scenario, record) if self._alone._needs_modes else {}
        for at in range(0, len(record.rows), RECORDS):
            here = slice(at, at + RECORDS)
            numbers = {name: each[here] for name, each in modes.items()}
            flown = self._flown(run, record, here, numbers)
            self.found.add(slice(0, 1), run.first_row + at, flown)
            self.rotation.add(slice(0, 1), flown)

    def _flown(
        self, run: Run, record: Record, here: slice, modes: Mapping[str, np.ndarray]
    ) -> Flown:
        """What the member flew at some records."""
        alone, rows = self._alone, record.rows[here]
        t_s = rows["step"] * run.plan.step_s
        if self._shared:
            along: Sequence = alone.along.records(run.first_row + here.start, len(rows))[1:]
        else:
            along = along_at(run.scenario, alone._campaign, t_s)
        q = np.stack([rows[f"q_{c}"] for c in "xyzw"], axis=1)[:, None]
        omega = np.stack([rows[f"omega_{c}"] for c in "xyz"], axis=1)[:, None]
        logs = recorded_logs(record, run, here, alone._log_names)
        flown = Flown(t_s, q, omega, *along)._replace(logs=logs, modes=self._states(modes))
        if not alone._carries:
            return flown
        wheels = record.wheels[here, None, : len(run.state.rotors)]
        carried = carried_by(run.dynamics, run.plan.plant.rotors)
        return flown._replace(carried=carried, wheels_n_m_s=wheels)

    def _states(self, modes: Mapping[str, np.ndarray]) -> dict[str, np.ndarray] | None:
        """States of the regions up to these records; None where they are not needed."""
        if not self._alone._needs_modes:
            return None
        known = {
            name: np.concatenate([self._changes.get(name, numbers[:0]), numbers])
            for name, numbers in modes.items()
        }
        self._changes = _where_changed(known)
        return {name: numbers[:, None] for name, numbers in known.items()}


def _times(run: Run) -> tuple:
    """What the times of a run's records follow from."""
    return run.steps, run.plan.step_s, run.plan.record_steps


def _where_changed(numbers: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Numbers (r,) by name, without those records that equal the one before in all of them."""
    if not numbers:
        return {}
    together = np.stack([*numbers.values()], axis=1)
    kept = np.append(True, (together[1:] != together[:-1]).any(axis=1))
    return {name: values[kept] for name, values in numbers.items()}
