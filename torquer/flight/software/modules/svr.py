"""SVR, the supervisor: modes by command, classes of the state vector, failures, watchdog, reboots.

After SDOT 3.3, Tables 3.2 to 3.4, App. A. Automatic transitions are the mode table's; the
supervisor raises its flags, changes its parameters and, in manual operation, commands its states.
"""

from __future__ import annotations

import math
from typing import Self

from pydantic import Field, model_validator

from torquer.base.spec import Spec
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.modules.module import Module
from torquer.flight.software.modules.state_vector import newest_state
from torquer.flight.software.modules.telemetry import DEG, bits, devices, states
from torquer.flight.software.strikes import REQUIRED

#: Classes of an element of the state vector, as telemetry numbers them.
NONE, MAX, NORM, MIN = range(4)
#: Modes of the supervisor, as telemetry numbers them.
MANUAL, AUTOMATIC = range(2)
#: Kinds of the command `reboot`.
REGULAR, IMMEDIATE, RESERVE = range(3)
#: File of the non-volatile memory that holds the error log.
ERRORS = "errors"
_ON = {0: False, 1: True}
#: Time after which the error log is saved where no packets on settings are sent [s].
_SAVED_S = 600.0


def _whole_angle_deg(q: float) -> float:
    """Angle of the turn whose quaternion has a vector part of this magnitude [deg]."""
    return 2.0 * DEG * math.asin(q)


#: Thresholds of the mode table that are settings of the supervisor, and what they are made of.
_IN_TABLES = {
    "rate_max_deg_s": ("modes.rate_max", float),
    "rate_min_deg_s": ("modes.rate_min", float),
    "q_max": ("modes.angle_max", _whole_angle_deg),
    "q_min": ("modes.angle_min", _whole_angle_deg),
}


class SvrSettings(Spec):
    """Settings of the supervisor."""

    rate_max_deg_s: float = Field(default=0.4, gt=0.0)
    """Rate to the orbital frame above which it is of class MAX."""
    rate_min_deg_s: float = Field(default=0.08, gt=0.0)
    """Rate below which it is of class MIN."""
    q_max: float = Field(default=0.15, gt=0.0, le=1.0)
    """Vector part of the attitude to the orbital frame above which it is of class MAX."""
    q_min: float = Field(default=0.02, gt=0.0, le=1.0)
    """Vector part below which it is of class MIN."""
    automatic: bool = True
    """Whether the boot ends in automatic operation."""
    regions: tuple[str, ...] = ("determination", "stabilisation")
    """Regions of the mode table that manual operation holds in their states."""
    supervisor: str = "supervisor"
    """Region of the mode table with the states 'automatic' and 'manual', if there is one: it
    follows the command `automatic`, and ends manual operation by itself."""
    flags: dict[str, str] = Field(
        default={
            "svr.anomaly": "anomaly",
            "mag.lost": "magnetometer_lost",
            "gyro.lost": "gyro_lost",
            "sun.lost": "sun_lost",
            "wheels.lost_x": "wheel_x_lost",
            "wheels.lost_y": "wheel_y_lost",
            "wheels.lost_z": "wheel_z_lost",
        }
    )
    """Flag of the mode table that a module's status raises, by `module.key`; those without such a
    flag in the scenario are left out."""
    silent_s: float = Field(default=10.0, gt=0.0)
    """Time without a step after which a module is silent: the watchdog is not fed any more."""
    report_s: float = Field(default=600.0, ge=0.0)
    """Time between two packets on settings and devices; 0: none."""
    states_s: float = Field(default=60.0, gt=0.0)
    """Longest time between two packets on the mode table; a change is sent at once."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.rate_min_deg_s >= self.rate_max_deg_s or self.q_min >= self.q_max:
            raise ValueError("rate_min_deg_s, q_min: must be less than rate_max_deg_s, q_max")
        return self


def classify_value(value: float, low: float, high: float) -> int:
    """Class of an element of the state vector. After SDOT, Table 3.2."""
    if not math.isfinite(value):
        return NONE
    return MAX if value > high else MIN if value < low else NORM


class Svr(Module):
    """The supervisor."""

    name = "svr"
    Settings = SvrSettings

    def __init__(self, settings: SvrSettings):
        super().__init__(settings)
        self.mode = AUTOMATIC if settings.automatic else MANUAL
        self.seen_manual = False
        self.rate_class = self.angle_class = NONE
        self.held: set[str] = set()
        self.raised: dict[str, bool] = {}
        self.by_hand: set[str] = set()
        self.silent: set[str] = set()
        self.well_s = 0.0
        self.due_s = 0.0
        self.errors_saved = -1
        self.sent_states: tuple[int, ...] = ()
        self.states_due_s = 0.0
        self.watched: list[tuple[str, str, str]] = []

    def start(self, core) -> None:
        """Operation as set; the first packets on settings and devices are due now."""
        self.well_s = self.due_s = core.t_s
        for key, flag in self.settings.flags.items():
            if flag in core.flags:
                module, _, what = key.partition(".")
                self.watched.append((module, what, flag))
        kept = {key: SvrSettings.model_fields[key].default for key in _IN_TABLES}
        changed = [key for key, value in kept.items() if getattr(self.settings, key) != value]
        if not self._change_tables(core, changed):
            core.report("svr", Reason.VALUE)
        if self.mode == MANUAL:
            self._operate(core, MANUAL)

    def step(self, core) -> None:
        """Classify the state vector, look for failures, watch the modules."""
        self._classify(core)
        self._follow(core)
        self._raise_flags(core)
        self._watch(core)
        if core.t_s >= self.due_s and not self._states_are_due(core):
            self.due_s = core.t_s + (self.settings.report_s or _SAVED_S)
            if self.settings.report_s:
                self._report(core)
            self._save_errors(core)
        else:  # not with the others: the ground queue is short
            self._send_states(core)

    def status(self) -> dict[str, float]:
        """Mode, classes of the state vector, when all modules were last well [s]; `anomaly`:
        whether a module is silent.
        """
        return {
            "mode": self.mode,
            "rate_class": self.rate_class,
            "angle_class": self.angle_class,
            "well_s": self.well_s,
            "anomaly": float(bool(self.silent)),
        }

    def on_set_mode(self, core, values) -> Reason:
        """A region enters a state, in manual operation only."""
        region, state = values
        regions = core.regions
        if region >= len(regions) or state >= len(regions[region][1]):
            return Reason.VALUE
        if self.mode == AUTOMATIC:
            return Reason.MODE
        name, states = regions[region]
        core.computer.command_mode(name, states[state])
        core.report("svr", Reason.MODE_CHANGED, region << 8 | state)
        return Reason.DONE

    def on_hold(self, core, values) -> Reason:
        """Hold or release a region, in manual operation only."""
        region, on = values
        if region >= len(core.regions) or on not in _ON:
            return Reason.VALUE
        if self.mode == AUTOMATIC:
            return Reason.MODE
        self._hold(core, core.regions[region][0], _ON[on])
        return Reason.DONE

    def on_automatic(self, core, values) -> Reason:
        """Manual operation holds the regions of determination and stabilisation."""
        (on,) = values
        if on not in _ON:
            return Reason.VALUE
        self._operate(core, AUTOMATIC if _ON[on] else MANUAL)
        return Reason.DONE

    def on_set_flag(self, core, values) -> Reason:
        """Raise or lower a flag; what a failure raises is then left to the ground."""
        flag, on = values
        if flag >= len(core.flags) or on not in _ON:
            return Reason.VALUE
        name = core.flags[flag]
        self.by_hand.add(name)
        self.raised[name] = _ON[on]
        core.computer.set_flag(name, _ON[on])
        return Reason.DONE

    def on_set_parameter(self, core, values) -> Reason:
        """Change a parameter of a law, or a threshold; until the next boot."""
        index, value = values
        if index >= len(core.parameters) or not math.isfinite(value):
            return Reason.VALUE
        try:
            core.computer.set_parameter(core.parameters[index], value)
        except ValueError:
            return Reason.VALUE
        return Reason.DONE

    def on_get_parameter(self, core, values) -> Reason:
        """Send a parameter that is one number."""
        (index,) = values
        if index >= len(core.parameters):
            return Reason.VALUE
        numbers = core.parameter(core.parameters[index])
        if len(numbers) != 1:
            return Reason.NOT_AVAILABLE
        core.send("parameter", (index, numbers[0]))
        return Reason.DONE

    def on_set_thresholds(self, core, values) -> Reason:
        """Change the thresholds of the classes, and those of the mode table of these names.

        VALUE, and no change, for what neither of them can take.
        """
        before = self.settings
        code = self.change(core, **dict(zip(_IN_TABLES, values, strict=True)))
        if code is Reason.DONE and not self._change_tables(core, _IN_TABLES):
            self.change(core, **before.model_dump())
            self._change_tables(core, _IN_TABLES)
            return Reason.VALUE
        if code is Reason.DONE:
            self._report(core)
        return code

    def on_reboot(self, core, values) -> Reason:
        """Start again at the end of this control step; all but an immediate one save the time."""
        (kind,) = values
        if kind > RESERVE:
            return Reason.VALUE
        core.report("svr", Reason.REBOOT, kind)
        if kind != IMMEDIATE:
            core.memory.write("time", core.clock.save())
            self._save_errors(core)
        core.reboot(from_reserve=kind == RESERVE)
        return Reason.DONE

    def on_restore_defaults(self, core, values) -> Reason:
        """A module returns to its default settings."""
        name = core.module_of(values[0])
        if name is None:
            return Reason.VALUE
        code = core.restore_defaults(name)
        if name == self.name:
            self._change_tables(core, _IN_TABLES)
        return code

    def on_report_status(self, core, values) -> Reason:
        """Send the status of a module, and what of its settings has a packet of its own."""
        name = core.module_of(values[0])
        if name is None:
            return Reason.VALUE
        core.send("module_status", core.account(name))
        core.send_in_force(name)
        return Reason.DONE

    def on_power(self, core, values) -> Reason:
        """Switch a device; NOT_AVAILABLE for a module that is the driver of none."""
        device, on = values
        name = core.module_of(device)
        if name is None or on not in _ON:
            return Reason.VALUE
        code = core.power(name, _ON[on])
        if code is Reason.DONE:
            core.report("svr", Reason.POWER_CHANGED, device | on << 8)
        return code

    def on_module_start(self, core, values) -> Reason:
        """Start a module that does not run; strikes that kept it off are forgotten."""
        name = core.module_of(values[0])
        return Reason.VALUE if name is None else core.bring_back(name)

    def on_module_stop(self, core, values) -> Reason:
        """Stop a module, but for those without which nothing can be commanded."""
        name = core.module_of(values[0])
        if name is None:
            return Reason.VALUE
        if name in REQUIRED or not core.is_running(name):
            return Reason.STATE
        core.stop(name)
        return Reason.DONE

    def _classify(self, core) -> None:
        state, settings = newest_state(core), self.settings
        if state is None or not state.is_valid(core.t_s):
            self.rate_class = self.angle_class = NONE
            return
        rate = state.rate_rad_s * DEG
        self.rate_class = classify_value(rate, settings.rate_min_deg_s, settings.rate_max_deg_s)
        self.angle_class = classify_value(state.q_size, settings.q_min, settings.q_max)

    def _raise_flags(self, core) -> None:
        """Raise and lower the flags of devices, but for those that the ground has set."""
        for module, what, flag in self.watched:
            on = bool(core.status(module).get(what, 0))
            if on != self.raised.get(flag, False) and flag not in self.by_hand:
                self.raised[flag] = on
                core.computer.set_flag(flag, on)

    def _watch(self, core) -> None:
        """Note that all modules are well, or which one is silent."""
        silent = set(core.silent(self.settings.silent_s)) - {"svr"}
        for module in sorted(silent - self.silent):
            core.report("svr", Reason.WATCHDOG, core.dictionary.modules[module])
            self._save_errors(core)
        self.silent = silent
        if not silent:
            self.well_s = core.t_s

    def _hold(self, core, region: str, on: bool) -> None:
        core.computer.hold(region, on)
        if on:
            self.held.add(region)
        else:
            self.held.discard(region)

    def _change_tables(self, core, keys) -> bool:
        """Give the mode table the thresholds of some settings, where it has them.

        False if the hysteresis of one of them does not allow it; the others may be changed.
        """
        try:
            for key in keys:
                name, of = _IN_TABLES[key]
                if name in core.parameters:
                    core.computer.set_parameter(name, of(getattr(self.settings, key)))
        except ValueError:
            return False
        return True

    def _operate(self, core, mode: int) -> None:
        """Automatic or manual operation, also of the mode table's own region of it."""
        self.mode, self.seen_manual = mode, False
        self._hold_all(core, mode == MANUAL)
        if self.settings.supervisor in core.modes:
            state = "manual" if mode == MANUAL else "automatic"
            core.computer.command_mode(self.settings.supervisor, state)

    def _follow(self, core) -> None:
        """Manual operation ends where the mode table ends it: on an anomaly, to safe mode."""
        state = core.modes.get(self.settings.supervisor)
        if self.mode == MANUAL and self.seen_manual and state == "automatic":
            self.mode = AUTOMATIC
            self._hold_all(core, False)
            core.report("svr", Reason.MODE_CHANGED, AUTOMATIC)
        self.seen_manual = state == "manual"

    def _hold_all(self, core, on: bool) -> None:
        """Hold the regions of manual operation, or release all."""
        known = [name for name, _ in core.regions]
        wanted = [name for name in self.settings.regions if name in known]
        for region in wanted if on else sorted(self.held):
            self._hold(core, region, on)

    def _report(self, core) -> None:
        """The packets on settings and devices."""
        settings, tm = self.settings, core.status("tm")
        names = [name for name, _ in core.regions]
        core.send(
            "settings",
            (
                self.mode,
                len(self.silent | set(core.kept_off())),
                bits(name in self.held for name in names[:32]),
                bits(self.raised.get(flag, False) for flag in core.flags[:32]),
                settings.rate_max_deg_s,
                settings.rate_min_deg_s,
                settings.q_max,
                settings.q_min,
                *(tm.get(key, 0.0) for key in ("beacon_s", "extended_s", "store_s")),
            ),
        )
        core.send("devices", devices(core))

    def _states_are_due(self, core) -> bool:
        """Whether the mode table has changed, or was last shown long ago; not at the beginning."""
        is_there = core.sends("modes") and core.regions and self.sent_states
        late = core.t_s >= self.states_due_s
        return bool(is_there) and (late or states(core) != self.sent_states)

    def _send_states(self, core) -> None:
        """The packet on the mode table, where it is known and there is one."""
        if core.sends("modes") and core.regions:
            now = states(core)
            if now != self.sent_states or core.t_s >= self.states_due_s:
                self.sent_states, self.states_due_s = now, core.t_s + self.settings.states_s
                core.send("modes", now)

    def _save_errors(self, core) -> None:
        if core.log.total != self.errors_saved:
            self.errors_saved = core.log.total
            core.memory.write(ERRORS, core.log.save())


class Wdt(Module):
    """WDT: feeds the hardware watchdog as long as the supervisor finds all modules well."""

    name = "wdt"

    def step(self, core) -> None:
        """Feed the watchdog."""
        if core.t_s - core.status("svr").get("well_s", -math.inf) <= core.period_s("svr") * 2.0:
            core.feed_hardware()
