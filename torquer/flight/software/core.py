"""Flight software around the compiled computer, a control step at a time.

core = torquer.flight.software.core.Core(scenario)
while (received := core.tick(uplink)) is not None:
    ...
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from torquer.flight.packets.reasons import Reason
from torquer.flight.software.boot import (
    BOOT_S,
    VARIABLES,
    deliver,
    go_on,
    has_ended,
    start_module,
    variables,
)
from torquer.flight.software.clock import to_ms
from torquer.flight.software.containment import brief, where
from torquer.flight.software.house_keeping import Analogue
from torquer.flight.software.link import deliver_counters
from torquer.flight.software.memory import Memory
from torquer.flight.software.services import Services
from torquer.flight.software.software import Software, load_software
from torquer.flight.software.state import Cause, Slot, State, Telecommand
from torquer.flight.software.strikes import FORGIVEN_S, NO_STRIKES, REQUIRED
from torquer.scenario.spec import Scenario
from torquer.simulation.outside.flight import Flight
from torquer.spacecraft.house_keeping import HouseKeeping

if TYPE_CHECKING:
    import xarray as xr

#: A hardware watchdog that is not fed for so long [s] resets the processor.
WATCHDOG_S = 60.0
_ZERO = (0.0, 0.0, 0.0)


class Core:
    """The satellite of a scenario with its flight software, in lock-step.

    `software`: what `load_software` gives or takes; `memory`: the non-volatile memory, else an
    empty one. An empty one is filled as it is delivered, and the clock is then right. The first
    boot is over when the flight begins. `computer`: the computer in C, as of `torquer.simulate`.

    At each control step the compiled computer works first, then the modules that are due, in the
    order of `software.modules`: drivers of sensors, then each module after those whose output it
    takes, last telemetry and communications. What they change of the computer takes effect at its
    next control step. A command that is received now is executed at the next control step.

    `exceptions`: by module, the first exception that its code raised, for the author of the module:
    telemetry reports only a reason code.
    """

    def __init__(
        self,
        scenario: Scenario,
        software: Software | str | Path | Mapping | None = None,
        memory: Memory | None = None,
        computer: str | os.PathLike | None = None,
    ):
        loaded = software if isinstance(software, Software) else load_software(software)
        self.software = loaded.for_satellite(scenario)
        self.flight = Flight(scenario, keeps_computer=True, computer=computer)
        self.memory = Memory() if memory is None else memory
        craft = scenario.spacecraft
        actuators = {"dipole_a_m2": craft.coils, "torque_n_m": craft.wheels}
        there = {name for name, device in actuators.items() if device is not None}
        defaults = {name: one.settings for name, one in self.software.modules.items()}
        model = getattr(defaults.get("adc"), "model", HouseKeeping())
        self.analogue = Analogue(self.flight, craft, model)
        self.services = Services(
            self.flight, self.memory, self.software, defaults, there, self.analogue
        )
        self.exceptions: dict[str, str] = {}
        self._off = {name: _ZERO for name in there}
        is_new, start_ms = not self.memory.names(), to_ms(scenario.start)
        if is_new:
            deliver(self, start_ms)
            deliver_counters(self.memory)
        self._switch_on(-BOOT_S, Cause.POWER_ON)
        go_on(self, 0.0)
        self.state.clock.run_to(0.0)
        if is_new:
            self.state.clock.set(start_ms)

    @property
    def is_running(self) -> bool:
        """Whether the software runs, that is, does not boot."""
        return has_ended(self)

    def tick(self, uplink: bytes = b"") -> bytes | None:
        """One control step: what is received goes in, what is sent comes out; None at the end.

        Raises `RunStopped`, with the result so far, if the motion is lost.
        """
        inputs = self.flight.read()
        if inputs is None:
            return None
        state, services = self.state, self.services
        services.at(inputs)
        if has_ended(self) or go_on(self, inputs.t_s):
            if uplink:
                state.receive(uplink)
            self._step(inputs.t_s)
            if state.strikes.modules:
                self._mind_strikes(state)
            self.flight.command(**{k: v for k, v in state.manual.items() if v is not None})
        else:
            self.flight.command(**self._off)
        sent = b"".join(state.downlink)
        state.downlink.clear()
        if state.reboot is not None:
            self._end(state)
        elif self.is_running and inputs.t_s - state.watchdog_s > WATCHDOG_S:
            guilty = services.silent(WATCHDOG_S / 2)
            services.keep_strikes(state.strikes.against(guilty))
            self._switch_on(inputs.t_s, Cause.WATCHDOG)
        return sent

    def judge(self, frame: bytes) -> str:
        """Why the receiver would not accept a frame around commands now; "" if it would."""
        link = getattr(self.state.modules.get("com"), "link", None)
        return "booting" if link is None or not self.is_running else link.judge(frame)

    def reboot(self, cause: Cause = Cause.FAULT) -> None:
        """Switch off and on before the next control step; nothing is saved before."""
        self._switch_on(self.services.t_s, cause)

    def snapshot(self) -> tuple:
        """Flight, software and memory as they stand, to be restored any number of times."""
        software = self.services.t_s, self.state, self.analogue.state
        return self.flight.snapshot(software), self.memory.snapshot()

    def restore(self, snapshot: tuple) -> None:
        """Go back to a snapshot of this flight: what follows is the same, bit for bit."""
        flight, memory = snapshot
        t_s, self.state, self.analogue.state = self.flight.restore(flight)
        self.memory.restore(memory)
        self.services.bind(self.state, t_s)

    def result(self) -> xr.Dataset:
        """The flight so far, as `torquer.simulate` gives it."""
        return self.flight.result()

    def _switch_on(self, t_s: float, cause: Cause) -> None:
        had_power = cause in (Cause.WATCHDOG, Cause.COMMAND)
        strikes = self.state.strikes if had_power else NO_STRIKES
        self.state = State(self.software.modules, t_s, cause, strikes)
        self.services.bind(self.state, t_s)

    def _mind_strikes(self, state: State) -> None:
        """Feed the watchdog for a supervisor that is off; forgive after a long time."""
        services = self.services
        if not state.strikes.is_watched and not services.silent(WATCHDOG_S / 2):
            services.feed_hardware()
        if services.t_s - state.boot_s > FORGIVEN_S and services.t_s > state.forgiven_s:
            state.forgiven_s = services.t_s + FORGIVEN_S
            services.keep_strikes(state.strikes.forgiven())
            for name in REQUIRED:
                if state.slots[name].is_off:
                    start_module(self, name)

    def _end(self, state: State) -> None:
        """A reboot by command."""
        if state.from_reserve:
            self.memory.write(VARIABLES, variables(state.reboots, from_reserve=True))
        self._switch_on(self.services.t_s, state.reboot or Cause.COMMAND)

    def _step(self, t_s: float) -> None:
        """Let the modules execute their commands, and work if they are due."""
        now_ms = round(t_s * 1e3)
        for slot in self.state.slots.values():
            if slot.runs:
                if slot.commands:
                    self._execute(slot)
                if slot.due_ms <= now_ms:
                    slot.due_ms = max(slot.due_ms + slot.period_ms, now_ms + 1)
                    self._work(slot)

    def _work(self, slot: Slot) -> None:
        """A step of one module; an error in it costs this step only, but the watchdog counts."""
        core, was_ending = self.services, self.services.is_ending
        try:
            slot.module.step(core)
        except BaseException as error:
            self.keep(slot.name, error)
            core.count_failure(slot.name)
        else:
            slot.steps += 1
            slot.fed_s = core.t_s
        core.blame_for_reboot(slot.name, was_ending)

    def _execute(self, slot: Slot) -> None:
        """The commands that wait for a module, each with its answer.

        An event for what is none, which a module of the user's has put there. One that its own
        handler puts there waits for the next step.
        """
        core, name = self.services, slot.name
        for _ in range(len(slot.commands)):
            command = core.cdh.take(name)
            if not isinstance(command, Telecommand):
                core.report(name, Reason.VALUE)
                continue
            code = Reason.NOT_AVAILABLE
            try:
                if not core.lacks(name):
                    work = getattr(slot.module, f"on_{command.packet}")
                    code = Reason(work(core, command.values))
            except BaseException as error:
                self.keep(name, error)
                code = Reason.FAILED
            if code is Reason.DONE:
                slot.done += 1
            else:
                slot.rejected += 1
                core.report(name, code, command.id)
            core.acknowledge(command, code)

    def keep(self, name: str, error: BaseException) -> None:
        """Keep the first exception of a module, with its place."""
        if name not in self.exceptions:
            text = f"{brief(error)} ({where(error)}, t = {self.services.t_s:g} s)"
            self.exceptions[name] = text
