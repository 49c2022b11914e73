"""What is known of the command stack of a satellite, in the archive before it counts.

A step is ready, going (its command is on its way), done, failed, or skipped.
"""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

from torquer.ground.archive import Archive
from torquer.ground.stack_file import Step

HELD, RUNNING, OVER, ABORTED = "held", "running", "over", "aborted"
READY, GOING, DONE, FAILED, SKIPPED = "ready", "going", "done", "failed", "skipped"
_COUNTER = "stack"


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

    def __init__(self, archive: Archive):
        self._archive = archive
        self.head: Head | None = None
        self.state, self.reason, self.pause_until_s = OVER, "", 0.0
        self.lines: list[Line] = []
        rows = archive.read("SELECT what, state, command, reason FROM _stack ORDER BY place")
        if rows:
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
        number = self._archive.next_counter(_COUNTER)
        head = Head(number, name, stop_on, by, time.time_ns() // 1_000_000)
        rows = [(0, json.dumps(vars(head)), HELD, "loaded")]
        rows += [
            (place, step.model_dump_json(exclude_none=True), READY, "")
            for place, step in enumerate(steps, 1)
        ]
        with self._archive.writing() as db:
            db.execute("DELETE FROM _stack")
            db.executemany(
                "INSERT INTO _stack (place, what, state, reason) VALUES (?, ?, ?, ?)", rows
            )
        self.head, self.lines = head, [Line(step) for step in steps]
        self.state, self.reason, self.pause_until_s = HELD, "loaded", 0.0

    def put(self, state: str, reason: str, **head) -> None:
        """A state of the stack, and changes of its head."""
        assert self.head is not None
        changed = replace(self.head, **head)
        self._write(0, "what = ?, state = ?, reason = ?", json.dumps(vars(changed)), state, reason)
        self.head, self.state, self.reason = changed, state, reason

    def put_step(self, place: int, state: str, reason: str = "", command: int | None = None):
        """A state of a step, and the command that was made for it, once it was."""
        line = self.lines[place - 1]
        number = line.command if command is None else command
        self._write(place, "state = ?, reason = ?, command = ?", state, reason, number)
        line.state, line.reason, line.command = state, reason, number

    def _write(self, place: int, settings: str, *values) -> None:
        with self._archive.writing() as db:
            db.execute(f"UPDATE _stack SET {settings} WHERE place = ?", (*values, place))

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
