"""What a module sees of the rest of the software: the `core` of its methods.

A module influences the compiled computer by the calls of `Computer` only, and actuators by
`take_over`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from torquer.base.spec import Spec
from torquer.computer.interface import SENSORS
from torquer.flight.packets.frames import ALARM, HEADER_BYTES, INFO, Downlink
from torquer.flight.packets.reasons import Reason
from torquer.flight.packets.software_file import SpaceLink
from torquer.flight.software.house_keeping import Analogue, Measured
from torquer.flight.software.link import Historical, Protected, new_link
from torquer.flight.software.memory import Memory
from torquer.flight.software.modules.telemetry import DEVICES
from torquer.flight.software.state import AnyModule, Cause, State, Telecommand, as_numbers
from torquer.flight.software.strikes import REQUIRED, STRIKES, Strikes
from torquer.simulation.outside.flight import three_numbers

if TYPE_CHECKING:
    from torquer.computer.inputs import Inputs
    from torquer.computer.interface import Command
    from torquer.simulation.outside.flight import Flight


#: Bytes of the longest frame: PUS adds headers of its own to what the link takes.
_LONGEST = 65000


def _bytes(data) -> bytes:
    """Bytes that a module hands over, checked where its own step answers for them."""
    if not isinstance(data, bytes | bytearray):
        raise TypeError(f"must be bytes; received {type(data).__name__}")
    return bytes(data)


def _is_frame(data) -> bool:
    return isinstance(data, bytes) and HEADER_BYTES <= len(data) <= _LONGEST


def settings_file(module: str) -> str:
    """Name of the file in the non-volatile memory that holds a module's settings."""
    return f"settings.{module}"


def save_settings(memory: Memory, module: str, settings: Spec) -> Reason:
    """Keep the settings of a module in the non-volatile memory, as JSON."""
    written = memory.write(settings_file(module), settings.model_dump_json().encode())
    return Reason.DONE if written else Reason.FAILED


class Computer:
    """The compiled computer as modules may touch it: each call is checked by name and value.

    `wheel_count`: number of the satellite's wheels.
    """

    __slots__ = (
        *("command_mode", "hold", "set_flag", "set_parameter", "wheel_count"),
        *("chosen_ephemeris", "ephemeris_apart", "set_ephemeris"),
        *("calibrate", "calibrate_coils", "calibrate_tachometers"),
    )

    def __init__(self, flight: Flight):
        for name in self.__slots__:
            setattr(self, name, getattr(flight, name))


class Services:
    """Inputs, clock, queues, memory, log, telemetry: what modules share.

    `inputs`: what the computer knows at this control step, with the new estimate; `t_s`: time of
    the run [s]; `now_ms`: on-board time [ms since 2010-01-01]; `regions` (name, states), `flags`,
    `parameters`: names of the computer, in the order in which commands number them. `defaults`:
    settings of modules as the software file has them.
    """

    inputs: Inputs

    def __init__(
        self,
        flight: Flight,
        memory: Memory,
        link: SpaceLink,
        defaults: Mapping[str, Spec],
        actuators: set[str],
        analogue: Analogue,
    ):
        self.memory, self.dictionary = memory, link.dictionary
        self.computer = Computer(flight)
        self.parameter = flight.parameter
        names = flight.names
        self.regions = [(name, list(states)) for name, (_, states) in names.regions.items()]
        self.flags, self.parameters = list(names.flags), names.all_parameters()
        self._link, self._defaults = link, defaults
        self._actuators, self._flight, self._analogue = actuators, flight, analogue
        self._absent = {"coils", "wheels", *SENSORS} - flight.devices
        self._frame = Downlink(link.dictionary).frame
        answers = link.dictionary.down.get("acknowledgement")
        self._answers = 0 if answers is None else len(answers.names)
        self._modes: dict[str, str] | None = None
        self._command: tuple[tuple, tuple] | None = None

    def bind(self, state: State, t_s: float) -> None:
        """Serve the modules of this state of the software from a time of the run [s] on."""
        self._state, self.t_s, self.now_ms = state, t_s, state.clock.now_ms
        self.cdh, self.clock, self.log = state.cdh, state.clock, state.log
        self.modules: dict[str, AnyModule] = state.modules
        self._modes = self._command = None

    def at(self, inputs: Inputs) -> None:
        """A new control step, after the computer has worked."""
        self.inputs, self.t_s = inputs, inputs.t_s
        self.now_ms = self.clock.run_to(inputs.t_s)
        self._modes = self._command = None

    # the computer

    @property
    def modes(self) -> dict[str, str]:
        """State of each region of the mode table, by name."""
        if self._modes is None:
            self._modes = self._flight.modes()
        return self._modes

    @property
    def commanded(self) -> tuple[tuple, tuple]:
        """Dipole [A m^2] and torque [N m] of this control step: a manual one goes first."""
        if self._command is None:
            answer, manual = self._flight.answer, self._state.manual
            dipole, torque = manual.get("dipole_a_m2"), manual.get("torque_n_m")
            self._command = (
                answer.dipole_a_m2 if dipole is None else dipole,
                answer.torque_n_m if torque is None else torque,
            )
        return self._command

    @property
    def answer(self) -> Command:
        """The computer's own command at this control step."""
        return self._flight.answer

    # devices

    def lacks(self, module: str) -> bool:
        """Whether a module drives a device that the satellite does not have."""
        try:
            device = getattr(self.modules.get(module), "device", "")
            return isinstance(device, str) and device in self._absent
        except BaseException:  # of its code
            self.count_failure(module)
            return False

    def silence(self, sensor: str, on: bool) -> bool:
        """Take the power of a sensor, by its name in the scenario, or give it back; False for one
        that the satellite does not have."""
        return self._flight.silence(sensor, on)

    def power(self, module: str, on: bool) -> Reason:
        """Switch the power of a driver's device; NOT_AVAILABLE for a module without one.

        FAILED if its code ends with an error, which is counted against it.
        """
        switch = getattr(self.modules.get(module), "power", None)
        if switch is None or self.lacks(module):
            return Reason.NOT_AVAILABLE
        try:
            return Reason(switch(self, on))
        except BaseException:
            self.count_failure(module)
            return Reason.FAILED

    def units(self, sensor: str) -> tuple[int, ...]:
        """Places in `inputs.units` of several devices of a kind."""
        return self._flight.units(sensor)

    @property
    def wheel_axes(self) -> tuple:
        """Axes of the wheels in the body; () for a satellite without any."""
        return self._flight.wheel_axes

    @property
    def wheel_inertia_kg_m2(self) -> tuple[float, ...]:
        """Inertia of each wheel's rotor."""
        return self._flight.wheel_inertia_kg_m2

    def wheels(self) -> tuple[list[float], list[float]]:
        """Of each wheel: momentum as read [N m s], motor torque [N m] since the last command."""
        return self._flight.wheels()

    def use_wheels(self, in_use: Sequence[bool]) -> None:
        """Which wheels the computer drives, from its next command on."""
        self._flight.use_wheels(in_use)

    def measure(self) -> Measured:
        """Currents and temperatures now."""
        powered = {name: bool(self.status(name).get("power", True)) for name in DEVICES}
        return self._analogue.measure(self.t_s, powered, self.commanded[0])

    def take_over(self, command: str, value: tuple | None) -> Reason:
        """Manual control until it is changed: `dipole_a_m2` or `torque_n_m`; None: the computer's.

        NOT_AVAILABLE on a satellite without such actuators. ValueError, here and not in the control
        step that would obey it, for what are not three finite numbers.
        """
        if command not in self._actuators:
            return Reason.NOT_AVAILABLE
        if value is not None:
            value = three_numbers(command, value, possible=True)
        self._state.manual[command], self._command = value, None
        return Reason.DONE

    # telemetry

    def frame(self, packet: str, values: Sequence, status: int = INFO, time_s: int = -1) -> bytes:
        """A frame of the downlink, made now or at a time [s since 2010-01-01]."""
        return self._frame(packet, self.clock.now_s if time_s < 0 else time_s, values, status)

    def put_frame(self, frame: bytes) -> bool:
        """Put a frame into the ground queue; False if another one was dropped. TypeError for what
        are no bytes, ValueError for more or fewer than a frame has."""
        data = _bytes(frame)
        if not _is_frame(data):
            raise ValueError(f"must have {HEADER_BYTES} to {_LONGEST} bytes; received {len(data)}")
        return self.cdh.put("ground", data)

    def send(self, packet: str, values: Sequence, status: int = INFO) -> bool:
        """Put a packet of the downlink into the ground queue; False if another was dropped."""
        return self.cdh.put("ground", self._frame(packet, self.clock.now_s, values, status))

    def sends(self, packet: str) -> bool:
        """Whether the dictionary of this satellite has a packet of the downlink."""
        return packet in self.dictionary.down

    def report(self, module: str, code: Reason, argument: int = 0) -> None:
        """Enter an event into the error log, from which COM sends it to the ground."""
        self.log.add(self.clock.now_ms, self.dictionary.modules[module], code, argument)
        if module in self._state.slots:
            self._state.slots[module].note(code)

    def event_frames(self) -> list[bytes]:
        """The frames of the events since the last call: the log holds more than a queue does."""
        news = self.log.take_news()
        return [
            self.frame("event", (each.module, each.code, each.argument, each.time_ms), ALARM)
            for each in (news if self.sends("event") else ())
        ]

    def acknowledge(self, command: Telecommand, code: Reason) -> None:
        """Answer a command of the ground that asks for it."""
        if command.acknowledge:
            self.cdh.put("acks", command.answer(code))

    def answer_frames(self, answers: Sequence[tuple], counter: int) -> list[bytes]:
        """The frames of acknowledgements (`Telecommand.answer`), as far as the packet goes.

        An element of the queue that is none, which a module of the user's put there, is left out.
        """
        found = []
        for answer in answers if self._answers else ():
            try:
                *known, request = answer
                values = (*known, counter, request)
                found.append(self.frame("acknowledgement", values[: self._answers]))
            except (TypeError, ValueError):
                self.report("com", Reason.VALUE)
        return found

    def whole_frames(self, frames: Sequence) -> list[bytes]:
        """Those of the frames that are some; an event for others, which are dropped."""
        found = [each for each in frames if _is_frame(each)]
        if len(found) < len(frames):
            self.report("com", Reason.VALUE, len(frames) - len(found))
        return found

    def new_link(self) -> Historical | Protected:
        """The link to the ground, with an empty stream."""
        return new_link(self._link.link, self.dictionary, self._link.keys, self.memory)

    def take_uplink(self) -> bytes:
        """What the receiver has received since the last call."""
        received = bytes(self._state.uplink)
        self._state.uplink.clear()
        return received

    def transmit(self, data: bytes) -> None:
        """Hand bytes to the transmitter; TypeError for anything else."""
        self._state.downlink.append(_bytes(data))

    # the other modules

    def status(self, module: str) -> Mapping[str, float]:
        """What a module reports in telemetry; empty for one that does not fly."""
        slot = self._state.slots.get(module)
        if slot is None:
            return {}
        try:
            status = slot.module.status()
            return as_numbers(status) if slot.is_own else status
        except BaseException:  # of its code, which is not to end the telemetry of all
            self.count_failure(module)
            return {}

    def count_failure(self, module: str) -> None:
        """One more error that the code of a module raised; each doubling is reported."""
        slot = self._state.slots[module]
        slot.failures += 1
        if slot.failures & (slot.failures - 1) == 0:  # 1, 2, 4, 8..: not to flood the log
            self.report(module, Reason.MODULE_FAILED, slot.failures)

    def module_of(self, number: int) -> str | None:
        """Name of the module with an id; None if none flies."""
        ids = self.dictionary.modules
        return next((name for name in self.modules if ids[name] == number), None)

    def is_running(self, module: str) -> bool:
        """Whether a module is started; False for one that does not fly."""
        slot = self._state.slots.get(module)
        return slot is not None and slot.runs

    def account(self, module: str) -> tuple:
        """Values of the packet `module_status`."""
        slot = self._state.slots[module]
        return (self.dictionary.modules[module], *slot.account())

    def send_in_force(self, module: str) -> None:
        """Send what of a module's settings has packets of this dictionary."""
        try:
            packets = [] if self.lacks(module) else list(self.modules[module].in_force(self))
            for packet, values in packets:
                if self.sends(packet):
                    self.send(packet, values)
        except BaseException:
            self.count_failure(module)

    def silent(self, after_s: float) -> list[str]:
        """Modules without a whole step for `after_s` [s] and for three of their periods: of those
        that run, and of those that must."""
        since_s = self.t_s - after_s
        late = [(name, slot) for name, slot in self._state.slots.items() if slot.fed_s < since_s]
        return [
            name
            for name, slot in late
            if (slot.runs or (name in REQUIRED and not slot.is_off))
            and self.t_s - slot.fed_s > slot.period_ms * 3e-3
        ]

    def period_s(self, module: str) -> float:
        """Time between two steps of a module [s]."""
        return self._state.slots[module].period_ms * 1e-3

    def restore_defaults(self, module: str) -> Reason:
        """Give a module its default settings, and keep them; NOT_AVAILABLE for one without any,
        or without its device."""
        one, defaults = self.modules[module], self._defaults[module]
        if self.lacks(module) or not type(defaults).model_fields:
            return Reason.NOT_AVAILABLE
        before, one.settings = one.settings, defaults
        code = one.take_up(self)
        if code is not Reason.DONE:
            one.settings = before
            return code
        return save_settings(self.memory, module, defaults)

    def start(self, module: str) -> None:
        """Start a module: it works from the next control step on."""
        slot = self._state.slots[module]
        slot.module.start(self)
        slot.runs, slot.is_off, slot.failures = True, False, 0
        slot.due_ms, slot.fed_s = round(self.t_s * 1e3), self.t_s

    def bring_back(self, module: str) -> Reason:
        """Start a module that does not run, and forget its strikes.

        STATE for one that runs; FAILED if its code ends with an error, or its strikes stay.
        """
        if self._state.slots[module].runs:
            return Reason.STATE
        try:
            self.start(module)
        except BaseException:
            self.count_failure(module)
            return Reason.FAILED
        return Reason.DONE if self.keep_strikes(self.strikes.without(module)) else Reason.FAILED

    @property
    def strikes(self) -> Strikes:
        """What resets speak against modules."""
        return self._state.strikes

    def keep_strikes(self, strikes: Strikes) -> bool:
        """Keep other strikes, in the processor and in the memory; False if that took none."""
        self._state.strikes = strikes
        return self.memory.write(STRIKES, strikes.save())

    def blame_for_reboot(self, module: str, was_ending: bool) -> None:
        """A strike against a module whose code, not the ground, asked for a reboot since then."""
        if self.is_ending and not was_ending:
            self.keep_strikes(self.strikes.against([module]))

    def kept_off(self) -> list[str]:
        """Modules that are kept off."""
        return [name for name, slot in self._state.slots.items() if slot.is_off]

    def stop(self, module: str) -> None:
        """Stop a module: it makes no step and takes no command until it is started.

        Commands that wait for it are answered: not possible.
        """
        for command in self._state.stop(module):
            self.acknowledge(command, Reason.STATE)
        try:
            self.modules[module].stop(self)
        except BaseException:
            self.count_failure(module)

    # watchdog and reboot

    @property
    def reboots(self) -> int:
        """Number of reboots so far."""
        return self._state.reboots

    @property
    def is_ending(self) -> bool:
        """Whether the computer starts again at the end of this control step."""
        return self._state.reboot is not None

    def feed_hardware(self) -> None:
        """Reset the timer of the hardware watchdog."""
        self._state.watchdog_s = self.t_s

    def reboot(self, from_reserve: bool = False) -> None:
        """Start the computer again at the end of this control step."""
        self._state.reboot, self._state.from_reserve = Cause.COMMAND, from_reserve
