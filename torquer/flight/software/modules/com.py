"""COM, communications: commands in, acknowledgements and packets out.

After SDOT 3.4, App. A. A command goes through the link's frames, is judged, waits for its
execution time if it has one, and is put into the queue of its module. Each rejected one is counted
and entered into the error log; where the frame shows which command it was, the ground is answered.
The recovery key changes the key of the other commands, and nothing else.

A time stamp of 0 means at once. Delayed commands are kept in the processor's memory: a reboot loses
them, with the clock by which they would be executed. One that asks for an acknowledgement has two:
that it waits (WAITING, not accepted), and when it has been executed.
"""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import Field

from torquer.base.spec import Spec
from torquer.flight.packets.frames import Frame, Rejected
from torquer.flight.packets.reasons import REJECTIONS, Reason
from torquer.flight.software.modules.module import Module
from torquer.flight.software.state import Telecommand


class ComSettings(Spec):
    """Settings of communications."""

    oldest_command_s: float = Field(default=600.0, ge=0.0)
    """A command whose execution time has passed for longer is rejected."""
    latest_command_s: float = Field(default=604800.0, gt=0.0)
    """A command whose execution time is farther ahead is rejected."""
    delayed: int = Field(default=10, ge=1, le=100)
    """Delayed commands that can wait; a further one is rejected."""
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
        self.delayed: list[Telecommand] = []
        self.received = self.rejected = self.refused = self.sent_bytes = 0
        self.heard_s: float | None = None

    def start(self, core) -> None:
        """Begin with an empty stream."""
        self.link = core.new_link()

    def step(self, core) -> None:
        """Receive, let delayed commands go, send."""
        received = core.take_uplink()
        if received:
            self.heard_s = core.t_s
            self._receive(core, self.link.receive(received, core.memory))
        elif self.heard_s is not None and core.t_s - self.heard_s >= self.settings.silence_s:
            self.heard_s = None
            self._receive(core, self.link.silence(core.memory))
        for code, argument in self.link.take_events():
            core.report("com", code, argument)
        if self.delayed:
            self._release(core)
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
            "delayed": len(self.delayed),
            "lost_bytes": 0 if self.link is None else self.link.lost_bytes,
        }

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
        """Hand a command on now or later, or reject it."""
        self.received += 1
        packet, now_s = frame.packet, core.clock.now_s
        asks, *values = frame.values
        command = Telecommand(
            *(packet.name, packet.id, frame.module, frame.time_s, bool(asks)),
            *(tuple(values), frame.raw),
        )
        code = self._fault(core, command, now_s)
        if code:
            self._reject(core, command, code)
        elif frame.time_s > now_s:
            self.delayed.append(command)
            self.delayed.sort(key=lambda each: each.time_s)
            self._answer(core, command, Reason.WAITING)
        else:
            self._hand_on(core, command)

    def _fault(self, core, command: Telecommand, now_s: int) -> Reason:
        """Why a command is rejected; DONE if it is not."""
        if code := self.link.fault(command.packet):
            return code
        module = _module(core, command)
        if module not in core.modules:
            return Reason.MODULE
        if not core.is_running(module):
            return Reason.STATE
        if command.time_s == 0:
            return Reason.DONE
        code = self._check_time(command, now_s)
        if not code and command.time_s > now_s and len(self.delayed) >= self.settings.delayed:
            return Reason.QUEUE_FULL
        return code

    def _check_time(self, command: Telecommand, now_s: int) -> Reason:
        """Why an execution time cannot be kept; DONE if it can."""
        ahead = command.time_s - now_s
        if ahead < -self.settings.oldest_command_s:
            return Reason.LATE
        return Reason.TIME if ahead > self.settings.latest_command_s else Reason.DONE

    def _release(self, core) -> None:
        """Hand on the delayed commands whose time has come, as many as their queues take.

        A clock that has been set in between may have left their times behind, or out of reach.
        """
        waiting, self.delayed, now_s = self.delayed, [], core.clock.now_s
        for command in waiting:
            if code := self._check_time(command, now_s):
                self._reject(core, command, code)
            elif command.time_s > now_s or core.cdh.is_full(_module(core, command)):
                self.delayed.append(command)
            else:
                self._hand_on(core, command)

    def _hand_on(self, core, command: Telecommand) -> None:
        """Into the module's queue; if that is full its oldest command is dropped, and answered."""
        module = _module(core, command)
        self.link.judged(command, Reason.DONE)
        if not core.cdh.put(module, command):
            self._reject(core, core.cdh.take_dropped(module), Reason.QUEUE_FULL)

    def _reject(self, core, command: Telecommand, code: Reason) -> None:
        self.rejected += 1
        core.report("com", code, command.id)
        self._answer(core, command, code)

    def _answer(self, core, command: Telecommand, code: Reason) -> None:
        """Tell the ground, by the link or by an acknowledgement, what COM has decided."""
        if not self.link.judged(command, code):
            core.acknowledge(command, code)

    def _answer_header(self, core, header: Rejected) -> None:
        """A frame that is no command: nobody knows whether an answer is asked for."""
        self.received += 1
        code = REJECTIONS.get(header.reason, Reason.REJECTED)
        asked = Telecommand("", header.id, header.code, header.time_s, True, ())
        self._reject(core, asked, code)

    def _send(self, core) -> None:
        """Acknowledgements first, then what waits for the ground."""
        take, waiting = core.cdh.take, core.cdh.queues
        frames = []
        while waiting["acks"]:
            frames.append(core.frame("acknowledgement", (*take("acks"), self.received)))
        while waiting["ground"]:
            frames.append(take("ground"))
        if frames or self.link.waiting:
            for sent in self.link.wrapped(frames, core.memory, core.clock.now_s):
                self.sent_bytes += len(sent)
                core.transmit(sent)


def _module(core, command: Telecommand) -> str:
    """Name of the module to which a command goes."""
    return core.dictionary.up[command.packet].module
