"""All that the software loses at a reboot; plain, copied with `copy.deepcopy`."""

from __future__ import annotations

from collections import deque
from enum import IntEnum
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol

from torquer.flight.packets.commands import ANSWERS
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.clock import Clock
from torquer.flight.software.log import Log
from torquer.flight.software.queues import Cdh
from torquer.flight.software.strikes import NO_STRIKES, Strikes

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

#: Sizes of the queues that no module owns: acknowledgements, frames for the ground, state vectors.
QUEUES = {"acks": ANSWERS, "ground": 10, "state": 3}
#: Size of a module's command queue.
COMMANDS = 5
#: Bytes that the receiver holds until they are read.
RECEIVED = 8192
_STOPPED, _RUNNING, _FAILED, _KEPT_OFF = range(4)


class AnyModule(Protocol):
    """What schedule and services see of a module: see `torquer.flight.software.modules.module`."""

    name: ClassVar[str]
    settings: Any

    def start(self, core: Any) -> None: ...
    def step(self, core: Any) -> None: ...
    def stop(self, core: Any) -> None: ...
    def take_up(self, core: Any) -> Reason: ...
    def status(self) -> dict[str, float]: ...
    def in_force(self, core: Any) -> Iterable[tuple[str, tuple]]: ...


def as_numbers(status: Mapping) -> dict[str, float]:
    """What a module reports of itself, as numbers; an exception of any kind for anything else."""
    return {str(key): float(value) for key, value in status.items()}


class Telecommand(NamedTuple):
    """A command of the ground as modules get it; `acknowledge`: whether it asks for an answer.

    `received`: the frame or packet that it came in; none for one that could not be read; `request`:
    its number in answers; `valid_until`: see `frames.last_second`.
    """

    packet: str
    id: int
    module: int
    time_s: int
    acknowledge: bool
    values: tuple
    received: bytes = b""
    request: int = 0
    valid_until: int = 0

    def answer(self, code: Reason) -> tuple:
        """What an acknowledgement states of it: id, module, accepted, code, time, request."""
        return self.id, self.module, code == Reason.DONE, code, self.time_s, self.request


class Cause(IntEnum):
    """Why the computer started, as telemetry numbers it."""

    POWER_ON = 0
    COMMAND = 1
    WATCHDOG = 2
    FAULT = 3


class Slot:
    """A module in the schedule, and what telemetry counts of it.

    `name`: by which it flies, whatever it calls itself; `is_own`: of the user's code;
    `commands`: its queue; `period_ms`: of its steps; `due_ms`: when it steps next [ms of the run];
    `fed_s`: its last whole step; `failures`: steps that an error ended; `is_off`: kept off, for the
    resets that it has caused.
    """

    def __init__(
        self, name: str, module: AnyModule, period_ms: int, commands: deque, is_default: bool
    ):
        self.name, self.module, self.commands = name, module, commands
        self.is_own = not type(module).__module__.startswith("torquer.flight.software.")
        self.period_ms, self.is_default = period_ms, is_default
        self.runs = self.is_off = False
        self.due_ms, self.fed_s = 0, 0.0
        self.steps = self.failures = self.errors = self.last_error = 0
        self.done = self.rejected = 0

    def note(self, code: Reason) -> None:
        """Count an entry in the error log."""
        self.errors, self.last_error = self.errors + 1, int(code)

    def account(self) -> tuple[int, ...]:
        """Values of the packet `module_status` after the id."""
        state = _FAILED if self.failures else _RUNNING
        if not self.runs:
            state = _KEPT_OFF if self.is_off else _STOPPED
        return (
            state,
            int(self.is_default),
            self.last_error,
            self.errors,
            self.done,
            self.rejected,
            self.steps,
        )


class State:
    """The memory of the processor: modules, queues, clock, log, boot.

    `slots`: the schedule, in the order of the steps; `manual`: commands of actuators by the
    ground; `watchdog_s`: when the hardware watchdog was last fed; `boot_step`: number of finished
    steps of the boot that began at `boot_s`; `reboot`: cause of one that is due; `strikes`: against
    modules, which a reset does not clear.
    """

    def __init__(
        self, modules: Iterable[str], t_s: float, cause: Cause, strikes: Strikes = NO_STRIKES
    ):
        self.cdh = Cdh({name: COMMANDS for name in modules} | QUEUES)
        self.clock, self.log = Clock(t_s), Log()
        self.modules: dict[str, AnyModule] = {}
        self.slots: dict[str, Slot] = {}
        self.manual: dict[str, tuple | None] = {}
        self.uplink, self.lost_uplink = bytearray(), 0
        self.downlink: list[bytes] = []
        self.boot_s, self.cause, self.boot_step = t_s, cause, 0
        self.watchdog_s = t_s
        self.reboots, self.from_reserve = 0, False
        self.strikes, self.forgiven_s = strikes, 0.0
        self.reboot: Cause | None = None

    def add(self, name: str, module: AnyModule, period_s: float, is_default: bool) -> None:
        """Take a module into the schedule."""
        self.modules[name] = module
        self.slots[name] = Slot(
            name, module, round(period_s * 1e3), self.cdh.queues[name], is_default
        )

    def receive(self, data: bytes) -> None:
        """Keep what the receiver has received; the newest of more than fits."""
        self.uplink += data
        beyond = len(self.uplink) - RECEIVED
        if beyond > 0:
            del self.uplink[:beyond]
            self.lost_uplink += beyond

    def stop(self, module: str) -> list[Telecommand]:
        """Stop a module; the commands that it leaves."""
        slot = self.slots[module]
        slot.runs = False
        left = [each for each in slot.commands if isinstance(each, Telecommand)]
        slot.commands.clear()
        return left
