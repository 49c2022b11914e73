"""The command stack of a satellite: steps that go up one by one, stepped or run.

A stack is held     loaded, or halted: by an operator, a command that failed, a start of the
                  ground, an archive that takes nothing
           running  its steps go up, each after its pause and what it waits for, while the archive
                  takes them; an operator who knows that it does not may run it all the same
           over     all its steps have gone or were skipped
           aborted  by an operator: nothing more goes up

All of it is archived before a command is made, where the archive takes it, and a command names the
step that it comes from. So a ground that starts again finds what has gone, and holds: it sends
nothing by itself.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Sequence
from typing import Protocol

from torquer.base.explain import ScenarioError
from torquer.flight.packets.commands import Sent
from torquer.ground.commands import (
    CANCELLED,
    EXECUTED,
    RECEIVED,
    REFUSED,
    UNANSWERED,
    WAITING,
    Commands,
)
from torquer.ground.ground_clock import now_ms
from torquer.ground.spool import Spool
from torquer.ground.stack_file import StackFile
from torquer.ground.stack_record import (
    ABORTED,
    DONE,
    FAILED,
    GOING,
    HELD,
    OVER,
    READY,
    RUNNING,
    SKIPPED,
    Line,
    StackRecord,
)

#: Time between two looks at a stack [s].
LOOK_S = 0.1
#: What operators can do with a stack, and whether it is about its next step.
ACTIONS = {"next": True, "skip": True, "run": False, "hold": False, "abort": False}
#: States of a command by what a step waits for; those that are failures; those that remain.
_ENOUGH = {"executed": (EXECUTED,), "received": (RECEIVED, EXECUTED), "none": (), None: ()}
_FAILED = (REFUSED, UNANSWERED, CANCELLED)
_FINAL = (EXECUTED, REFUSED, CANCELLED)
_RESTARTED = "the ground has started again"
_UNARCHIVED = "nothing is archived, so a ground that starts again would not know what has gone"


class Orders(Protocol):
    """What a stack needs of the contact with its satellite."""

    spool: Spool
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


class Stack:
    """The stack of one satellite, if there is one; `changed(stack)` is called with its state."""

    def __init__(self, orders: Orders, changed: Callable[[dict], None]):
        self._orders, self._changed = orders, changed
        self._record, self._failed = StackRecord(orders.spool), 0
        self._may_go_unarchived = False
        if self._record.state == RUNNING:
            self._record.put(HELD, _RESTARTED)

    async def serve(self) -> None:
        """Go on with the stack until cancelled."""
        while True:
            self.advance(now_ms())
            await asyncio.sleep(LOOK_S)

    def load(self, stack: StackFile, name: str, by: str) -> dict:
        """Take a stack that was checked, held; `ScenarioError` while there is another."""
        if self._record.is_open:
            raise ScenarioError(
                "stack: must be over or aborted before another is loaded; received one that is "
                f"{self._record.state}"
            )
        self._record.replace(stack.commands, name, stack.stop_on, by)
        self._failed = 0
        return self._tell("info", f"loaded by {by}")

    def act(self, action: str, number: int, place: int | None, by: str) -> dict:
        """Do one of `ACTIONS`; `number`: of the stack, `place`: of its next step, as they are seen.

        `ScenarioError` with one line for what is not possible, as when somebody else was quicker.
        """
        following, record = self._checked(action, number, place), self._record
        if action == "hold":
            record.put(HELD, f"held by {by}")
        elif action == "abort":
            self._abort(by)
        elif action == "run":
            assert record.head is not None
            record.pause_until_s, self._failed = 0.0, 0
            self._may_go_unarchived = self._orders.spool.is_failing
            begun_ms = record.head.begun_ms or now_ms()
            record.put(RUNNING, f"run by {by}", by=by, begun_ms=begun_ms)
        elif action == "skip":
            record.put_step(following, SKIPPED, f"skipped by {by}")
        else:
            record.put(record.state, record.reason, by=by)
            self._go(following)
        return self._tell("info", f"{action} by {by}")

    def advance(self, at_ms: int) -> None:
        """Look at the commands of the stack, and send the next one if it is time."""
        record = self._record
        self._may_go_unarchived &= self._orders.spool.is_behind
        if record.head is None or not record.is_open:
            return
        self._look()
        if record.state == RUNNING and self._failed and record.head.stop_on != "never":
            self._hold_after(self._failed)
        going = any(line.state == GOING for line in record.lines)
        if record.following is None and not going:
            failed = sum(line.state == FAILED for line in record.lines)
            record.put(OVER, f"{failed} of {len(record.lines)} steps failed" if failed else "")
            self._tell("info", " - ".join(filter(None, ("over", record.reason))))
        elif record.state == RUNNING and record.following and not going:
            self._run(record.following, at_ms)

    def state(self) -> dict | None:
        """The stack with its steps, as users see it; None if none was ever loaded."""
        if self._record.head is None:
            return None
        self._look()
        return self._record.summary() | {"steps": self._record.steps()}

    def _checked(self, action: str, number: int, place: int | None) -> int:
        """The place of the next step, 0 for none, if an action is possible."""
        record, following = self._record, self._record.following or 0
        if action not in ACTIONS:
            raise ScenarioError(f"action: must be one of {', '.join(ACTIONS)}; received {action!r}")
        if record.head is None:
            raise ScenarioError(f"stack: must be loaded before {action}; received none")
        if number != record.head.id:
            raise ScenarioError(
                f"stack: must be the one that is loaded, that is {record.head.id}; received "
                f"{number}"
            )
        if not record.is_open:
            raise ScenarioError(f"stack: must be loaded; received one that is {record.state}")
        if ACTIONS[action] and (place != following or not following):
            raise ScenarioError(
                f"place: must be that of the next step, {following or 'there is none'}; received "
                f"{place}"
            )
        wanted = RUNNING if action == "hold" else HELD
        if action != "abort" and record.state != wanted:
            raise ScenarioError(f"stack: must be {wanted} for {action}; received {record.state}")
        return following

    def _run(self, place: int, now_ms: int) -> None:
        """Send a step if it is time; hold if its command cannot be made."""
        record = self._record
        assert record.head is not None
        at_ms = (record.head.begun_ms or now_ms) + 1e3 * record.lines[place - 1].step.at_s
        if time.monotonic() < record.pause_until_s or now_ms < at_ms:
            return
        spool = self._orders.spool
        if spool.is_behind and not self._may_go_unarchived:
            if spool.is_failing:
                self._hold(_UNARCHIVED)
            return
        try:
            self._go(place)
        except ScenarioError as error:
            self._hold(f"step {place} was not taken: {error}")

    def _go(self, place: int) -> None:
        """Have the command of a step made; `ScenarioError` if it cannot be, and it stays ready."""
        record = self._record
        assert record.head is not None
        line = record.lines[place - 1]
        if not line.step.command:
            self._done(place)
            return
        record.put_step(place, GOING)
        record.settle()
        try:
            order = line.step.model_copy(update={"at_s": 0.0})
            (made,) = self._orders.order([order], f"{record.head.by}, {self._mark(place)}")
        except ScenarioError as error:
            record.put_step(place, READY, str(error))
            raise
        line.became = made["state"]
        record.put_step(place, GOING, command=made["id"])
        if line.step.wait_for == "none":
            self._done(place)

    def _done(self, place: int) -> None:
        pause_s = self._record.lines[place - 1].step.pause_s
        self._record.pause_until_s = time.monotonic() + pause_s
        self._record.put_step(place, DONE)
        self._tell()

    def _find_command(self, place: int) -> None:
        """Whether the command of a step was made, of which this was to be noted."""
        mark = self._mark(place)
        number = self._orders.commands.made_by(mark)
        self._record.put_step(place, GOING if number else READY, command=number)

    def _look(self) -> None:
        """See what has become of the commands; `_failed`: the place of the last that has failed."""
        for place, line in enumerate(self._record.lines, 1):
            if line.state == GOING and line.command is None:
                self._find_command(place)
            if line.command is not None and line.became not in _FINAL:
                self._look_at(place, line, line.command)

    def _look_at(self, place: int, line: Line, number: int) -> None:
        shown = self._orders.commands.shown(number)
        became, line.why = shown["state"], shown["reason"]
        is_news, line.became = became != line.became, became
        if is_news and became in _FAILED and line.state in (GOING, DONE):
            self._failed = place
            self._record.put_step(place, FAILED)
        elif line.state in (GOING, FAILED) and became in _ENOUGH[line.step.wait_for]:
            self._done(place)
        if is_news:
            self._tell()

    def _hold_after(self, place: int) -> None:
        line = self._record.lines[place - 1]
        why = f" ({line.why})" if line.why else ""
        self._hold(f"step {place}, command {line.command}, is {line.became}{why}")

    def _hold(self, reason: str) -> None:
        self._record.put(HELD, reason)
        self._tell("warning", reason)

    def _abort(self, by: str) -> None:
        """Nothing more goes up; commands that wait here are cancelled, too."""
        self._record.put(ABORTED, f"aborted by {by}")
        for line in self._record.lines:
            if line.command is not None and line.became == WAITING:
                try:
                    self._orders.cancel(line.command, by)
                except ScenarioError:
                    continue  # it has just been sent

    def _mark(self, place: int) -> str:
        """What ends the author of the command of a step."""
        assert self._record.head is not None
        return f"stack {self._record.head.id} step {place}"

    def _tell(self, severity: str = "", text: str = "") -> dict:
        """Tell who follows, and with a text the log; the stack without its steps."""
        told = self._record.summary()
        self._changed(told)
        if text:
            self._orders.note(severity, f"stack {told['name'] or told['id']}: {text}")
        return told
