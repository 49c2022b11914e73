"""COM, communications: commands in, acknowledgements and packets out.

After SDOT 3.4, App. A. A command goes through the link's frames, is judged, waits for its
execution time if it has one, and is put into the queue of its module. Each rejected one is counted
and entered into the error log; where the frame shows which command it was, the ground is answered.
The recovery key changes the key of the other commands, and nothing else.

A time stamp of 0 means at once. Commands with a later one are the plan, which outlives a reboot.
One that asks for an acknowledgement has two: that it waits (WAITING, not accepted), and when it has
been executed. No more commands are handed on than the queues of modules and of answers take: the
others wait here, in their order.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence

from pydantic import Field

from torquer.base.spec import Spec
from torquer.flight.packets.commands import ANSWERS
from torquer.flight.packets.frames import Frame, Rejected, seconds_late
from torquer.flight.packets.reasons import REJECTIONS, Reason
from torquer.flight.software.modules.module import Module
from torquer.flight.software.plan import Plan
from torquer.flight.software.state import COMMANDS, Telecommand

#: The command after which the computer starts again.
REBOOT = "reboot"
#: Packets on the plan in a step, so that a long one leaves room for the rest.
_PLAN_AT_ONCE = 10


class ComSettings(Spec):
    """Settings of communications."""

    oldest_command_s: float = Field(default=600.0, ge=0.0)
    """A command whose execution time has passed for longer is rejected."""
    latest_command_s: float = Field(default=604800.0, gt=0.0)
    """A command whose execution time is farther ahead is rejected."""
    delayed: int = Field(default=100, ge=1, le=1000)
    """Commands that the plan takes; a further one is rejected."""
    waiting: int = Field(default=100, ge=1, le=1000)
    """Commands that may wait for room in the queues; a further one is rejected."""
    silence_s: float = Field(default=2.0, gt=0.0)
    """Time without a byte after which the rest of a frame is no longer waited for."""


class Com(Module):
    """Judges what is received, sends what waits for the ground."""

    name = "com"
    Settings = ComSettings
    period_s = 0.1

    def __init__(self, settings: ComSettings):
        super().__init__(settings)
        self.link = None
        self.plan = Plan()
        self.waiting: list[Telecommand] = []
        self.answers: list[tuple] = []
        self.listed: list[tuple] = []
        self.received = self.rejected = self.refused = self.sent_bytes = 0
        self.heard_s: float | None = None

    def start(self, core) -> None:
        """Begin with an empty stream, and with the plan that the memory holds."""
        self.link = core.new_link()
        if not self.plan.restore(core.memory, core.dictionary):
            core.report("com", Reason.PLAN_LOST)

    def step(self, core) -> None:
        """Receive, let commands go whose time has come, send."""
        received = core.take_uplink()
        if received:
            self.heard_s = core.t_s
            self._receive(core, self.link.receive(received, core.memory))
        elif self.heard_s is not None and core.t_s - self.heard_s >= self.settings.silence_s:
            self.heard_s = None
            self._receive(core, self.link.silence(core.memory))
        for code, argument in self.link.take_events():
            core.report("com", code, argument)
        if not core.is_ending:  # what is handed on now would be lost
            if self.plan.commands:
                self._release(core)
            if self.waiting:
                self._hand_on(core)
        self._send(core)

    def on_change_key(self, core, values) -> Reason:
        """The key of commands with a number takes the place of the present one."""
        code = self.link.change_key(*values, core.memory)
        if code == Reason.DONE:
            core.report("com", Reason.KEY_CHANGED, *values)
        return code

    def status(self) -> dict[str, float]:
        """Commands received and rejected, frames refused, commands that wait, lost bytes."""
        return {
            "received": self.received,
            "rejected": self.rejected,
            "refused": self.refused,
            "delayed": len(self.plan),
            "lost_bytes": 0 if self.link is None else self.link.lost_bytes,
        }

    def on_plan_list(self, core, values) -> Reason:
        """Send a packet on each command of the plan."""
        size = len(self.plan)
        self.listed = [
            (size, place, each.request, each.id, each.module, each.time_s)
            for place, each in enumerate(self.plan.commands)
        ] or [(0,) * 6]
        return Reason.DONE

    def on_plan_cancel(self, core, values) -> Reason:
        """Take the commands of a number out of the plan; VALUE if there is none."""
        (request,) = values
        if not any(each.request == request for each in self.plan.commands):
            return Reason.VALUE
        return self._cancel(core, lambda each: each.request == request)

    def on_plan_clear(self, core, values) -> Reason:
        """Take all commands out of the plan."""
        return self._cancel(core, lambda each: True) if self.plan.commands else Reason.DONE

    def _cancel(self, core, wanted: Callable[[Telecommand], bool]) -> Reason:
        """Each of these commands is answered, too; FAILED if the memory did not take the change."""
        taken = self.plan.take(wanted, core.memory, core.dictionary)
        for command in taken:
            self._answer(core, command, Reason.CANCELLED)
        return Reason.DONE if taken else Reason.FAILED

    def _receive(self, core, frames: Iterator[Frame]) -> None:
        """Judge commands; answer, count and report what was none."""
        for frame in frames:
            self._judge(core, frame)
        for header in self.link.take_rejected():
            self._answer_header(core, header)
        if refused := self.link.take_refused():
            self.refused += refused
            core.report("com", Reason.REJECTED, refused)

    def _judge(self, core, frame: Frame) -> None:
        """Take a command for now or later, or reject it."""
        self.received += 1
        packet, now_s = frame.packet, core.clock.now_s
        asks, *values = frame.values
        command = Telecommand(
            *(packet.name, packet.id, frame.module, frame.time_s, bool(asks)),
            *(tuple(values), frame.raw, frame.request, frame.valid_until),
        )
        code = self._fault(core, command, now_s)
        if not code and command.time_s > now_s:
            is_kept = self.plan.add(command, core.memory, core.dictionary)
            code = Reason.WAITING if is_kept else Reason.FAILED
        if code is Reason.WAITING:
            self._answer(core, command, code)
        elif code:
            self._reject(core, command, code)
        else:
            self.link.judged(command, code)
            self.waiting.append(command)

    def _fault(self, core, command: Telecommand, now_s: int) -> Reason:
        """Why a command is rejected; DONE if it is not."""
        if code := self.link.fault(command.packet):
            return code
        module = _module(core, command)
        if module not in core.modules:
            return Reason.MODULE
        if not core.is_running(module):
            return Reason.STATE
        if seconds_late(now_s, command.valid_until) > 0:
            return Reason.LATE
        is_later = command.time_s > now_s
        if is_later and command.time_s - now_s > self.settings.latest_command_s:
            return Reason.TIME
        if command.time_s and self._is_late(command, now_s):
            return Reason.LATE
        kept, most = (len(self.waiting), self.settings.waiting)
        if is_later:
            kept, most = len(self.plan), self.settings.delayed
        return Reason.DONE if kept < most else Reason.QUEUE_FULL

    def _is_late(self, command: Telecommand, now_s: int) -> bool:
        return now_s - command.time_s > self.settings.oldest_command_s

    def _release(self, core) -> None:
        """Take commands out of the plan whose time has come, in order, as many as can be executed
        now: what waits here a reboot would lose.

        A clock that has been set in between may have left their times behind, or out of reach; one
        that has only lost its time has not. Of a memory that takes no change, nothing is released:
        a reboot would release it again.
        """
        now_s, latest_s = core.clock.now_s, math.inf
        if core.clock.is_set:
            latest_s = now_s + self.settings.latest_command_s
        times = self.plan.commands[0].time_s, self.plan.commands[-1].time_s
        if times[0] > now_s and times[1] <= latest_s:
            return
        room = _Room(core, self.waiting)

        def is_due(each: Telecommand) -> bool:
            if now_s < each.time_s <= latest_s:
                return False
            in_time = each.time_s <= now_s and not self._is_late(each, now_s)
            can_go = in_time and core.is_running(_module(core, each))
            return not can_go or room.takes(each)

        for command in self.plan.take(is_due, core.memory, core.dictionary):
            if self._is_late(command, now_s) or command.time_s > latest_s:
                code = Reason.TIME if command.time_s > now_s else Reason.LATE
                self._reject(core, command, code)
            elif not core.is_running(_module(core, command)):
                self._reject(core, command, Reason.STATE)
            else:
                self.link.judged(command, Reason.DONE)
                self.waiting.append(command)

    def _hand_on(self, core) -> None:
        """Into the queues of modules, as many as these and the answers have room for."""
        room, left = _Room(core), []
        for command in self.waiting:
            module = _module(core, command)
            if not core.is_running(module):
                self._reject(core, command, Reason.STATE)
            elif room.takes(command):
                core.cdh.put(module, command)
            else:
                left.append(command)
        self.waiting = left

    def _reject(self, core, command: Telecommand, code: Reason) -> None:
        self.rejected += 1
        core.report("com", code, command.id)
        self._answer(core, command, code)

    def _answer(self, core, command: Telecommand, code: Reason) -> None:
        """Tell the ground, by the link or by an acknowledgement, what COM has decided."""
        if not self.link.judged(command, code) and command.acknowledge:
            self.answers.append(command.answer(code))

    def _answer_header(self, core, header: Rejected) -> None:
        """A frame that is no command: nobody knows whether an answer is asked for."""
        self.received += 1
        code = REJECTIONS.get(header.reason, Reason.REJECTED)
        asked = Telecommand(
            *("", header.id, header.code, header.time_s, True, (), b"", header.request)
        )
        self._reject(core, asked, code)

    def _send(self, core) -> None:
        """Acknowledgements first, then events, then what waits for the ground."""
        take, waiting = core.cdh.take, core.cdh.queues
        answers, self.answers = self.answers, []
        while waiting["acks"]:
            answers.append(take("acks"))
        frames = core.answer_frames(answers, self.received)
        frames += core.event_frames()
        for each in self.listed[:_PLAN_AT_ONCE]:
            frames.append(core.frame("plan", each))
        del self.listed[:_PLAN_AT_ONCE]
        while waiting["ground"]:
            frames.append(take("ground"))
        frames = core.whole_frames(frames)
        if frames or self.link.waiting:
            for sent in self.link.wrapped(frames, core.memory, core.clock.now_s):
                self.sent_bytes += len(sent)
                core.transmit(sent)


class _Room:
    """What the queues of modules and of answers can still take in this step.

    After a reboot by command nothing more is handed on: it would be lost. `first`: commands that go
    before those that are asked for.
    """

    def __init__(self, core, first: Sequence[Telecommand] = ()):
        self._core, self._ends = core, False
        self._answers = ANSWERS - len(core.cdh.queues["acks"])
        self._taken: Counter[str] = Counter()
        for command in first:
            self.takes(command)

    def takes(self, command: Telecommand) -> bool:
        """Whether there is room for one more, which then has it."""
        module = _module(self._core, command)
        free = COMMANDS - len(self._core.cdh.queues[module]) - self._taken[module]
        if self._ends or free <= 0 or self._answers < command.acknowledge:
            return False
        self._taken[module] += 1
        self._answers -= command.acknowledge
        self._ends = command.packet == REBOOT
        return True


def _module(core, command: Telecommand) -> str:
    """Name of the module to which a command goes."""
    return core.dictionary.up[command.packet].module
