"""Boot: what happens between a reset of the processor and the packet 'ready', and for how long.

Source of the order: SDOT App. A. The durations are chosen. Until the boot has ended nothing is
controlled and nothing received. The computer starts again with it: parameters, memory and modes.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

from torquer.flight.packets.reasons import Reason
from torquer.flight.software.clock import Clock
from torquer.flight.software.containment import Unmade
from torquer.flight.software.log import Log
from torquer.flight.software.memory import Memory, unseal
from torquer.flight.software.modules.clk import TIME
from torquer.flight.software.modules.module import Module
from torquer.flight.software.modules.svr import ERRORS
from torquer.flight.software.plan import PLAN
from torquer.flight.software.services import Services, save_settings, settings_file
from torquer.flight.software.software import Software
from torquer.flight.software.state import Cause, State
from torquer.flight.software.strikes import NO_STRIKES, STRIKES, Strikes, read_strikes
from torquer.flight.software.update import take_up
from torquer.simulation.outside.flight import Flight

#: Files of the non-volatile memory that the boot reads.
VARIABLES, FPGA = "variables", "fpga.lib"
#: Content of the FPGA's file as delivered.
FPGA_AS_DELIVERED = bytes(range(256))
#: Global variables: counter of reboots, whether the reserve file system is to be mounted.
_VARIABLES = struct.Struct("<HB")
#: Order in which the supervisor starts modules; drivers and others come before.
STARTED_LAST = ("cdh", "tm", "mod", "aos", "stb", "com", "svr", "wdt")


class AnyCore(Protocol):
    """What a boot works on: see `torquer.flight.software.core.Core`."""

    flight: Flight
    memory: Memory
    services: Services
    software: Software
    state: State

    def keep(self, name: str, error: BaseException) -> None: ...


class Step(NamedTuple):
    """A step of the boot: what it is, how long it takes [s], what it does."""

    name: str
    duration_s: float
    work: Callable[[AnyCore], None]


def _nothing(core: AnyCore) -> None:
    """Hardware that has no part in a simulation."""


def _read_variables(core: AnyCore) -> None:
    """Global variables: the counter of reboots goes on; from zero if it cannot be read."""
    data = core.memory.read(VARIABLES)
    valid = data is not None and len(data) == _VARIABLES.size
    reboots, reserve = _VARIABLES.unpack(data) if data is not None and valid else (0, 0)
    state = core.state
    if state.cause is not Cause.POWER_ON:
        reboots = min(reboots + 1, 0xFFFF)
    if state.cause in (Cause.POWER_ON, Cause.FAULT):  # without power, the processor forgets them
        state.strikes = _read_strikes(core)
    state.reboots = reboots
    state.from_reserve = bool(reserve) or state.strikes.from_reserve
    core.memory.write(VARIABLES, variables(reboots))


def _read_strikes(core: AnyCore) -> Strikes:
    """The strikes of the memory; none, and an event, where they cannot be read."""
    data = core.memory.read(STRIKES)
    if data is None:  # which the memory reports
        return NO_STRIKES
    found = read_strikes(data)
    if found is None:
        core.services.report("svr", Reason.SETTINGS_DAMAGED)
        return NO_STRIKES
    return found


def variables(reboots: int, from_reserve: bool = False) -> bytes:
    """The global variables as the memory keeps them."""
    return _VARIABLES.pack(reboots, from_reserve)


def _mount(core: AnyCore) -> None:
    """Files whose main or reserve copy is damaged are written again; the log is taken up.

    Mounted from the reserve, the copies there count, and the main ones are written from them.
    """
    memory = core.memory
    if core.state.from_reserve:
        main, reserve = memory.places["main"], memory.places["reserve"]
        for name in memory.names():
            if name in main and name in reserve and unseal(name, reserve[name]):
                main.pop(name)
    memory.mend(tells=not core.state.from_reserve)
    log = core.state.log
    begun = list(log.entries)
    log.restore(memory.read(ERRORS))
    for entry in begun:
        log.add(*entry)
    core.services.report("svr", Reason.BOOTED, core.state.reboots)
    if core.state.strikes.from_reserve:
        core.services.report("svr", Reason.FROM_RESERVE)


def _load_fpga(core: AnyCore) -> None:
    if core.memory.read(FPGA) is None:
        core.services.report("fs", Reason.FILE_MISSING)


def _load_modules(core: AnyCore) -> None:
    """Make all modules, with the settings of the memory, or their defaults."""
    strikes = core.state.strikes
    if strikes.all_defaults:
        core.services.report("svr", Reason.DEFAULTS_USED)
    found: dict[str, Any] = {}
    for name in core.software.modules:
        found[name] = None if strikes.uses_defaults(name) else _settings(core, name)
        if strikes.uses_defaults(name) and not strikes.all_defaults:
            core.services.report(name, Reason.DEFAULTS_USED)
    _take_up_update(core, found)
    for name, one in core.software.modules.items():
        settings = one.settings if found[name] is None else found[name]
        module = _make(core, name, settings)
        core.state.add(name, module, one.period_s, is_default=found[name] is None)


def _take_up_update(core: AnyCore, found: dict[str, Any]) -> None:
    """Change settings as the update has them that the ground has marked, and keep them.

    Modules that are to have their defaults have them, and what is kept when they no longer are.
    """
    modules = core.software.modules
    present = {name: one.settings for name, one in modules.items()}
    present |= {name: settings for name, settings in found.items() if settings is not None}
    update = take_up(core.memory, present)
    if update is None:
        return
    for name, settings in update.settings.items():
        save_settings(core.memory, name, settings)
        if not core.state.strikes.uses_defaults(name):
            found[name] = settings
    core.services.report("svr", update.code, update.number)


def _make(core: AnyCore, name: str, settings):
    """A module; in place of one that cannot be made one that does not start."""
    try:
        made = core.software.modules[name].make(settings)
        if not isinstance(made, Module):
            raise TypeError(f"must make a Module; received {type(made).__name__}")
        return made
    except BaseException as error:
        core.keep(name, error)
        return Unmade(name, settings, error)


def _settings(core: AnyCore, name: str):
    """The settings of a module in the memory; None, and an event, without."""
    defaults = core.software.modules[name].settings
    if not type(defaults).model_fields:
        return defaults
    data = core.memory.read(settings_file(name))
    try:
        return type(defaults).model_validate_json(data or b"")
    except BaseException as error:  # a validator of the user's may raise anything
        if not isinstance(error, ValueError):
            core.keep(name, error)
        is_there = data is not None or settings_file(name) in core.memory.names()
        code = Reason.SETTINGS_DAMAGED if is_there else Reason.SETTINGS_MISSING
        core.services.report(name, code)
        return None


def _restore_time(core: AnyCore) -> None:
    """The time as it was last saved: it has lost what has passed since."""
    if core.state.clock.restore(core.memory.read(TIME)) is Reason.TIME_LOST:
        core.services.report("clk", Reason.TIME_LOST)


def _start_modules(core: AnyCore) -> None:
    """Start the modules, drivers first, in the source's order; one that fails does not start."""
    if core.state.cause is not Cause.POWER_ON:
        core.flight.restart_computer()
    names = list(core.software.modules)
    ordered = [name for name in names if name not in STARTED_LAST]
    for name in ordered + [name for name in STARTED_LAST if name in names]:
        if core.software.modules[name].on:
            start_module(core, name)


def start_module(core: AnyCore, name: str) -> None:
    """Start a module, unless its strikes keep it off; one that fails does not start."""
    slot = core.state.slots[name]
    slot.is_off = core.state.strikes.is_off(name)
    if slot.is_off:
        core.services.report(name, Reason.KEPT_OFF, core.state.strikes.modules[name])
        return
    was_ending = core.services.is_ending
    try:
        core.services.start(name)
    except BaseException as error:
        core.keep(name, error)
        core.services.report(name, Reason.MODULE_FAILED)
    core.services.blame_for_reboot(name, was_ending)


def _start_watchdog(core: AnyCore) -> None:
    core.services.feed_hardware()


def _ready(core: AnyCore) -> None:
    """The packet 'ready', with the number of events of this boot, itself included."""
    state, services = core.state, core.services
    services.report("svr", Reason.READY)
    events = state.log.total - state.log.told
    reserve, now_ms = int(state.from_reserve), state.clock.now_ms
    services.send("ready", (state.reboots, state.cause, reserve, now_ms, events))


STEPS = (
    Step("processor", 1.0, _nothing),
    Step("drivers: SPI, parallel bus, ADC", 1.0, _nothing),
    Step("global variables", 0.1, _read_variables),
    Step("current sensors", 0.5, _nothing),
    Step("file system", 3.0, _mount),
    Step("FPGA", 2.0, _load_fpga),
    Step("modules", 1.0, _load_modules),
    Step("time", 0.1, _restore_time),
    Step("supervisor: power switches", 1.0, _nothing),
    Step("supervisor: modules", 1.0, _start_modules),
    Step("supervisor: watchdog", 0.1, _start_watchdog),
    Step("ready", 0.1, _ready),
)
#: Time of a boot [s].
BOOT_S = sum(step.duration_s for step in STEPS)


def has_ended(core: AnyCore) -> bool:
    """Whether the boot has ended."""
    return core.state.boot_step == len(STEPS)


def go_on(core: AnyCore, t_s: float) -> bool:
    """Take the steps of the boot that end until a time of the run [s]; whether it has ended."""
    state = core.state
    while state.boot_step < len(STEPS):
        ends_s = state.boot_s + sum(step.duration_s for step in STEPS[: state.boot_step + 1])
        if ends_s > t_s + 1e-6:
            return False
        core.services.t_s = ends_s
        state.clock.run_to(ends_s)
        STEPS[state.boot_step].work(core)
        state.boot_step += 1
    return True


def deliver(core: AnyCore, now_ms: int) -> None:
    """Fill an empty memory as it is delivered: settings of all modules, the FPGA's file, time."""
    for name, one in core.software.modules.items():
        if type(one.settings).model_fields:
            save_settings(core.memory, name, one.settings)
    core.memory.write(FPGA, FPGA_AS_DELIVERED)
    core.memory.write(TIME, Clock(now_ms=now_ms).save())
    core.memory.write(STRIKES, NO_STRIKES.save())
    core.memory.write(PLAN, b"")
    core.memory.write(VARIABLES, variables(0))
    core.memory.write(ERRORS, Log().save())
