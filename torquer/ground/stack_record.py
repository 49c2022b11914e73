"""What is known of the command stack of a satellite, kept as it changes.

A step is ready, going (its command is on its way), done, failed, or skipped.
"""

from __future__ import annotations

import json
import sqlite3
import time
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, replace

from torquer.ground.archive import ArchiveError, read_only
from torquer.ground.ground_clock import now_ms
from torquer.ground.spool import PATIENCE_S, Spool
from torquer.ground.stack_file import Step

HELD, RUNNING, OVER, ABORTED = "held", "running", "over", "aborted"
READY, GOING, DONE, FAILED, SKIPPED = "ready", "going", "done", "failed", "skipped"
_COUNTER = "stack"
_PUT = "INSERT OR REPLACE INTO _stack (place, what, state, command, reason) VALUES (?, ?, ?, ?, ?)"


@dataclass
class Line:
    """A step and what has become of it; `became`, `why`: of its command."""

    step: Step
    state: str = READY
    command: int | None = None
    reason: str = ""
    became: str = ""
    why: str = ""


@dataclass
class Head:
    """The stack itself; `begun_ms`: when it first ran; `by`: who had it run or took a step."""

    id: int
    name: str
    stop_on: str
    loaded_by: str
    loaded_ms: int
    by: str = ""
    begun_ms: int | None = None


class StackRecord:
    """The stack of an archive, its state and its steps; without one `head` is None.

    `pause_until_s`: monotonic time before which no step goes, which no start outlives.
    """

    def __init__(self, spool: Spool):
        self._spool = spool
        self.head: Head | None = None
        self.state, self.reason, self.pause_until_s = OVER, "", 0.0
        self.lines: list[Line] = []
        self._number = spool.found.counters.get(_COUNTER, 0) if spool.found else 0
        if rows := _stored(spool):
            (what, self.state, _, self.reason), *steps = rows
            self.head = Head(**json.loads(what))
            self.lines = [Line(Step.model_validate_json(step), *rest) for step, *rest in steps]

    @property
    def is_open(self) -> bool:
        """Whether something may still go up."""
        return self.state in (HELD, RUNNING)

    @property
    def following(self) -> int | None:
        """The place of the next step, from 1; None if there is none."""
        return next((n for n, line in enumerate(self.lines, 1) if line.state == READY), None)

    def replace(self, steps: Sequence[Step], name: str, stop_on: str, by: str) -> None:
        """Another stack, held."""
        self._number += 1
        self._spool.add_counters({_COUNTER: self._number})
        self.head = Head(self._number, name, stop_on, by, now_ms())
        self.lines = [Line(step) for step in steps]
        self.state, self.reason, self.pause_until_s = HELD, "loaded", 0.0
        self._spool.keep(("stack",), "DELETE FROM _stack", ())
        for place in range(len(steps) + 1):
            self._keep(place)

    def put(self, state: str, reason: str, **head) -> None:
        """A state of the stack, and changes of its head."""
        assert self.head is not None
        self.head, self.state, self.reason = replace(self.head, **head), state, reason
        self._keep(0)

    def put_step(self, place: int, state: str, reason: str = "", command: int | None = None):
        """A state of a step, and the command that was made for it, once it was."""
        line = self.lines[place - 1]
        line.command = line.command if command is None else command
        line.state, line.reason = state, reason
        self._keep(place)

    def settle(self) -> None:
        """Wait a moment for what has changed to be archived."""
        self._spool.flush()

    def _keep(self, place: int) -> None:
        row: tuple
        if place == 0:
            row = json.dumps(vars(self.head)), self.state, None, self.reason
        else:
            line = self.lines[place - 1]
            what = line.step.model_dump_json(exclude_none=True)
            row = what, line.state, line.command, line.reason
        self._spool.keep(("stack", place), _PUT, (place, *row))

    def summary(self) -> dict:
        """The stack without its steps, as users see it."""
        assert self.head is not None
        head = {key: value for key, value in vars(self.head).items() if key != "begun_ms"}
        pause_s = max(0.0, self.pause_until_s - time.monotonic())
        return head | {
            "state": self.state,
            "reason": self.reason,
            "next": self.following if self.is_open else None,
            "pause_s": round(pause_s, 1) if self.state == RUNNING else 0.0,
        }

    def steps(self) -> list[dict]:
        """The steps, as users see them."""
        return [
            {
                "place": place,
                **line.step.model_dump(mode="json", exclude_none=True),
                "state": line.state,
                "id": line.command,
                "became": line.became,
                "reason": line.reason or line.why,
            }
            for place, line in enumerate(self.lines, 1)
        ]


def _stored(spool: Spool) -> list[tuple]:
    """Rows of the archive; none where it cannot be read."""
    statement = "SELECT what, state, command, reason FROM _stack ORDER BY place"
    try:
        with closing(read_only(spool.path, PATIENCE_S)) as db:
            return db.execute(statement).fetchall()
    except (sqlite3.Error, ArchiveError):
        return []
