"""A run in pieces of a fraction of a second, between which signals and the clock are looked at."""

import time
import warnings
from collections.abc import Callable

from torquer.simulation.loop.members import COARSE_STEP, RUNNING
from torquer.simulation.outside.host import HostFailed
from torquer.simulation.results.file import NotStorable
from torquer.simulation.setup.run import (
    NoNextPiece,
    Run,
    next_event,
    record_this_instant,
)
from torquer.simulation.setup.signals import noted_signals
from torquer.simulation.setup.stopped import reason

#: Computing time of a piece [s]: it doubles up to this, and is halved where it takes longer.
_PIECE_S = 0.05
_FIRST_STEPS = 16
#: Time [s] from one checkpoint on the disk to the next, and what part they may take of it.
CHECKPOINT_S = 5.0
_CHECKPOINT_SHARE = 0.01


class NotSaved(UserWarning):
    """A checkpoint could not be written; the run goes on."""


class Checkpoints:
    """Saves a run every so often, and less often where that takes long."""

    def __init__(self, save: Callable[[Run], None], interval_s: float):
        if not interval_s > 0.0:
            raise ValueError(f"checkpoint_s: must be greater than 0; received {interval_s}")
        self.save, self.interval_s = save, interval_s
        self._due_s = time.monotonic() + interval_s

    def look(self, run: Run) -> None:
        """Save the run if it is time to."""
        begun_s = time.monotonic()
        if begun_s < self._due_s:
            return
        run.enter()
        record_this_instant(run)
        try:
            self.save(run)
        except (OSError, NotStorable) as error:  # the run itself can go on
            reason = getattr(error, "strerror", None) or error
            warnings.warn(
                f"nothing saved at t = {run.now_s:g} s: {reason}",
                NotSaved,
                stacklevel=4,
            )
        ended_s = time.monotonic()
        self._due_s = ended_s + max(self.interval_s, (ended_s - begun_s) / _CHECKPOINT_SHARE)


def advance_in_pieces(
    run: Run, last: int, progress: Callable[[float], None] | None, checkpoints: Checkpoints
) -> str:
    """Run on to a step; what made it stop, or "". Raises KeyboardInterrupt on a signal."""
    try:
        return _advance(run, last, progress, checkpoints)
    except NoNextPiece as error:
        return f"{error}; nothing is known of what follows t = {run.now_s:g} s"


def _advance(
    run: Run, last: int, progress: Callable[[float], None] | None, checkpoints: Checkpoints
) -> str:
    signals, steps = noted_signals(), _FIRST_STEPS
    while (done := int(run.state.at[0])) < min(last, run.steps):
        if signals.asked:
            raise KeyboardInterrupt
        begun_s = time.perf_counter()
        try:
            ended = run.advance_to(next_event(run.plan, min(done + steps, last)))
        except HostFailed as error:
            return f"{error} at t = {run.now_s:g} s"
        if ended != RUNNING:
            return reason(run, ended)
        took_s = time.perf_counter() - begun_s
        steps = max(steps // 2, 1) if took_s > 2.0 * _PIECE_S else steps
        steps = 2 * steps if took_s < _PIECE_S else steps
        if progress:
            progress(int(run.state.at[0]) / run.steps)
        checkpoints.look(run)
    complete = run.state.at[0] == run.steps  # where the loop does not look
    return reason(run, COARSE_STEP) if complete and not run.is_followed() else ""
