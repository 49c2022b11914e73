"""The command stack of a satellite: steps that go up one by one, stepped or run.

A stack is held     loaded, or halted: by an operator, a command that failed, a start of the ground
           running  its steps go up, each after its pause and what it waits for
           over     all its steps have gone or were skipped
           aborted  by an operator: nothing more goes up

A step is ready, going (its command is on its way), done, failed, or skipped. All of it is in the
archive before a command is made, and a command names the step that it comes from. So a ground that
starts again finds what has gone, and holds: it sends nothing by itself.
"""

from __future__ import annotations

import asyncio
import json
import sqlite3
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from torquer.flight.packets.commands import Sent
from torquer.ground.archive import Archive
from torquer.ground.commands import (
    CANCELLED,
    EXECUTED,
    RECEIVED,
    REFUSED,
    UNANSWERED,
    WAITING,
    Commands,
)
from torquer.ground.stack_file import StackFile, Step
from torquer.scenario.explain import ScenarioError

#: Time between two looks at a stack [s].
LOOK_S = 0.1
HELD, RUNNING, OVER, ABORTED = "held", "running", "over", "aborted"
READY, GOING, DONE, FAILED, SKIPPED = "ready", "going", "done", "failed", "skipped"
#: What operators can do with a stack, and whether it is about its next step.
ACTIONS = {"next": True, "skip": True, "run": False, "hold": False, "abort": False}
#: States of a command by what a step waits for; those that are failures; those that remain.
_ENOUGH = {"executed": (EXECUTED,), "received": (RECEIVED, EXECUTED), "none": (), None: ()}
_FAILED = (REFUSED, UNANSWERED, CANCELLED)
_FINAL = (EXECUTED, REFUSED, CANCELLED)
_COUNTER = "stack"
_RESTARTED = "the ground has started again"


class Orders(Protocol):
    """What a stack needs of the contact with its satellite."""

    archive: Archive
    commands: Commands

    def order(self, commands: Sequence[Sent], by: str) -> list[dict]:
        """Take commands."""
        ...

    def cancel(self, number: int, by: str) -> dict:
        """Cancel a command."""
        ...

    def note(self, severity: str, text: str) -> None:
        """An entry of the log."""
        ...


@dataclass
class _Line:
    """A step and what has become of it; `became`, `why`: of its command."""

    step: Step
    state: str = READY
    command: int | None = None
    reason: str = ""
    became: str = ""
    why: str = ""


@dataclass
class _Head:
    """The stack itself; `begun_ms`: when it first ran; `by`: who had it run or took a step."""

    id: int
    name: str
    stop_on: str
    loaded_by: str
    loaded_ms: int
    by: str = ""
    begun_ms: int | None = None


class Stack:
    """The stack of one satellite, if there is one; `changed(stack)` is called with its state."""

    def __init__(self, orders: Orders, changed: Callable[[dict], None]):
        self._orders, self._changed = orders, changed
        self._head: _Head | None = None
        self._state, self._reason, self._pause_until_s = OVER, "", 0.0
        self._lines: list[_Line] = []
        self._failed = 0
        rows = orders.archive.read("SELECT what, state, command, reason FROM _stack ORDER BY place")
        if rows:
            (what, self._state, _, self._reason), *steps = rows
            self._head = _Head(**json.loads(what))
            self._lines = [
                _Line(Step.model_validate_json(step), *others) for step, *others in steps
            ]
        if self._state == RUNNING:
            self._set(HELD, _RESTARTED)

    async def serve(self) -> None:
        """Go on with the stack until cancelled."""
        while True:
            try:
                self.advance(_now_ms())
            except sqlite3.Error as error:
                # in memory only: what cannot be written cannot say so in the archive
                self._state, self._reason = HELD, f"the archive does not take its state ({error})"
            await asyncio.sleep(LOOK_S)

    def load(self, stack: StackFile, name: str, by: str) -> dict:
        """Take a stack that was checked, held; `ScenarioError` while there is another."""
        if self._is_open:
            raise ScenarioError(
                "stack: must be over or aborted before another is loaded; received one that is "
                f"{self._state}"
            )
        archive = self._orders.archive
        number = archive.next_counter(_COUNTER)
        self._head = _Head(number, name, stack.stop_on, by, _now_ms())
        self._lines = [_Line(step) for step in stack.commands]
        self._state, self._reason, self._pause_until_s = HELD, "loaded", 0.0
        rows = [(0, self._what(0), HELD, self._reason)]
        rows += [(n, self._what(n), READY, "") for n in range(1, len(self._lines) + 1)]
        with archive.writing() as db:
            db.execute("DELETE FROM _stack")
            db.executemany(
                "INSERT INTO _stack (place, what, state, reason) VALUES (?, ?, ?, ?)", rows
            )
        return self._tell("info", f"loaded by {by}")

    def act(self, action: str, number: int, place: int | None, by: str) -> dict:
        """Do one of `ACTIONS`; `number`: of the stack, `place`: of its next step, as they are seen.

        `ScenarioError` with one line for what is not possible, as when somebody else was quicker.
        """
        head, following = self._checked(action, number, place)
        if action == "hold":
            self._set(HELD, f"held by {by}")
        elif action == "abort":
            self._abort(by)
        elif action == "run":
            head.by, head.begun_ms = by, head.begun_ms or _now_ms()
            self._pause_until_s, self._failed = 0.0, 0
            self._set(RUNNING, f"run by {by}")
        elif action == "skip":
            self._put(following, SKIPPED, f"skipped by {by}")
        else:
            head.by = by
            self._put(0, self._state, self._reason)
            self._go(following)
        return self._tell("info", f"{action} by {by}")

    def advance(self, now_ms: int) -> None:
        """Look at the commands of the stack, and send the next one if it is time."""
        if self._head is None or not self._is_open:
            return
        self._look()
        if self._state == RUNNING and self._failed and self._head.stop_on != "never":
            self._hold_after(self._failed)
        going = any(line.state == GOING for line in self._lines)
        following = self._following()
        if following is None and not going:
            failed = sum(line.state == FAILED for line in self._lines)
            self._set(OVER, f"{failed} of {len(self._lines)} steps failed" if failed else "")
            self._tell("info", " - ".join(filter(None, ("over", self._reason))))
        elif self._state == RUNNING and following and not going:
            self._run(following, now_ms)

    def state(self) -> dict | None:
        """The stack with its steps, as users see it; None if none was ever loaded."""
        if self._head is None:
            return None
        self._look()
        steps = [
            {
                "place": place,
                **line.step.model_dump(mode="json", exclude_none=True, exclude={"at_s"}),
                "at_s": line.step.at_s,
                "state": line.state,
                "id": line.command,
                "became": line.became,
                "reason": line.reason or line.why,
            }
            for place, line in enumerate(self._lines, 1)
        ]
        return self._summary() | {"steps": steps}

    @property
    def _is_open(self) -> bool:
        return self._state in (HELD, RUNNING)

    def _summary(self) -> dict:
        assert self._head is not None
        head = {key: value for key, value in vars(self._head).items() if key != "begun_ms"}
        pause_s = max(0.0, self._pause_until_s - time.monotonic())
        return head | {
            "state": self._state,
            "reason": self._reason,
            "next": self._following() if self._is_open else None,
            "pause_s": round(pause_s, 1) if self._state == RUNNING else 0.0,
        }

    def _following(self) -> int | None:
        """The place of the next step, from 1; None if there is none."""
        return next((n for n, line in enumerate(self._lines, 1) if line.state == READY), None)

    def _checked(self, action: str, number: int, place: int | None) -> tuple[_Head, int]:
        """The stack and its next step, 0 for none, if an action is possible."""
        head, following = self._head, self._following() or 0
        if action not in ACTIONS:
            raise ScenarioError(f"action: must be one of {', '.join(ACTIONS)}; received {action!r}")
        if head is None or number != head.id:
            now = "there is none" if head is None else f"that is {head.id}"
            raise ScenarioError(f"stack: must be the one that is loaded, {now}; received {number}")
        if not self._is_open:
            raise ScenarioError(f"stack: must be loaded; received one that is {self._state}")
        if ACTIONS[action] and (place != following or not following):
            raise ScenarioError(
                f"place: must be that of the next step, {following or 'there is none'}; received "
                f"{place}"
            )
        wanted = RUNNING if action == "hold" else HELD
        if action != "abort" and self._state != wanted:
            raise ScenarioError(f"stack: must be {wanted} for {action}; received {self._state}")
        return head, following

    def _run(self, place: int, now_ms: int) -> None:
        """Send a step if it is time; hold if its command cannot be made."""
        head, step = self._head, self._lines[place - 1].step
        assert head is not None
        at_ms = (head.begun_ms or now_ms) + 1e3 * step.at_s
        if time.monotonic() < self._pause_until_s or now_ms < at_ms:
            return
        try:
            self._go(place)
        except ScenarioError as error:
            self._set(HELD, f"step {place} was not taken: {error}")
            self._tell("warning", self._reason)

    def _go(self, place: int) -> None:
        """Have the command of a step made; `ScenarioError` if it cannot be, and it stays ready."""
        assert self._head is not None
        line = self._lines[place - 1]
        if not line.step.command:
            self._done(place)
            return
        self._put(place, GOING)
        try:
            order = line.step.model_copy(update={"at_s": 0.0})
            (made,) = self._orders.order([order], f"{self._head.by}, {self._mark(place)}")
        except ScenarioError as error:
            self._put(place, READY, str(error))
            raise
        except sqlite3.Error:
            self._find_command(place, line)
            raise
        line.command, line.became = made["id"], made["state"]
        if line.step.wait_for == "none":
            self._done(place)
        else:
            self._put(place, GOING)

    def _done(self, place: int) -> None:
        self._pause_until_s = time.monotonic() + self._lines[place - 1].step.pause_s
        self._put(place, DONE)
        self._tell()

    def _find_command(self, place: int, line: _Line) -> None:
        """Whether the command of a step was made, of which this was to be noted."""
        found = self._orders.archive.read(
            "SELECT max(id) FROM _commands WHERE substr(made_by, -?) = ?",
            *(len(self._mark(place)), self._mark(place)),
        )
        line.command = found[0][0]
        self._put(place, GOING if line.command else READY)

    def _look(self) -> None:
        """See what has become of the commands; `_failed`: the place of the last that has failed."""
        for place, line in enumerate(self._lines, 1):
            if line.state == GOING and line.command is None:
                self._find_command(place, line)
            if line.command is not None and line.became not in _FINAL:
                self._look_at(place, line)

    def _look_at(self, place: int, line: _Line) -> None:
        assert line.command is not None
        shown = self._orders.commands.shown(line.command)
        became, line.why = shown["state"], shown["reason"]
        is_news, line.became = became != line.became, became
        if is_news and became in _FAILED and line.state in (GOING, DONE):
            self._failed = place
            self._put(place, FAILED)
        elif line.state in (GOING, FAILED) and became in _ENOUGH[line.step.wait_for]:
            self._done(place)
        if is_news:
            self._tell()

    def _hold_after(self, place: int) -> None:
        line = self._lines[place - 1]
        why = f" ({line.why})" if line.why else ""
        self._set(HELD, f"step {place}, command {line.command}, is {line.became}{why}")
        self._tell("warning", self._reason)

    def _abort(self, by: str) -> None:
        """Nothing more goes up; commands that wait here are cancelled, too."""
        self._set(ABORTED, f"aborted by {by}")
        for line in self._lines:
            if line.command is not None and line.became == WAITING:
                try:
                    self._orders.cancel(line.command, by)
                except ScenarioError:
                    continue  # it has just been sent

    def _mark(self, place: int) -> str:
        """What ends the author of the command of a step."""
        assert self._head is not None
        return f"stack {self._head.id} step {place}"

    def _what(self, place: int) -> str:
        if place:
            return self._lines[place - 1].step.model_dump_json(exclude_none=True)
        return json.dumps(vars(self._head))

    def _set(self, state: str, reason: str) -> None:
        self._state, self._reason = state, reason
        self._put(0, state, reason)

    def _put(self, place: int, state: str, reason: str = "") -> None:
        """A state of a step, or with place 0 of the stack, also in the archive."""
        what: tuple[Any, ...] = (self._what(place), state, None, reason)
        if place:
            line = self._lines[place - 1]
            line.state, line.reason = state, reason
            what = (*what[:2], line.command, reason)
        with self._orders.archive.writing() as db:
            db.execute(
                "UPDATE _stack SET what = ?, state = ?, command = ?, reason = ? WHERE place = ?",
                (*what, place),
            )

    def _tell(self, severity: str = "", text: str = "") -> dict:
        """Tell who follows, and with a text the log; the stack without its steps."""
        told = self._summary()
        self._changed(told)
        if text:
            self._orders.note(severity, f"stack {told['name'] or told['id']}: {text}")
        return told


def _now_ms() -> int:
    return time.time_ns() // 1_000_000
