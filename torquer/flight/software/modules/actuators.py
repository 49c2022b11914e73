"""Drivers of coils and wheels: manual control, and what tachometers show of the wheels."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar

from pydantic import Field

from torquer.base.spec import Spec
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.modules.module import Supplier


class ManualSettings(Spec):
    """Settings of an actuator's driver."""

    longest_s: float = Field(default=900.0, gt=0.0)
    """Longest manual command."""


class Actuator(Supplier):
    """An actuator that the ground can command for a while in place of the laws.

    `command`: what it takes, as `Services.take_over` names it.
    """

    Settings: ClassVar[type[Spec]] = ManualSettings
    command: ClassVar[str]

    def __init__(self, settings):
        super().__init__(settings)
        self.polls = self.errors = 0
        self.until_s: float | None = None
        self.is_powered = True

    def step(self, core) -> None:
        """Give the actuator back to the laws in time."""
        self.polls += 1
        if self.until_s is not None and core.t_s >= self.until_s:
            self.automatic(core)

    def manual(self, core, values) -> Reason:
        """Three numbers and a duration [s]."""
        *vector, duration_s = values
        if not all(map(math.isfinite, values)) or not 0 < duration_s <= self.settings.longest_s:
            return Reason.VALUE
        if not self.is_powered:
            return Reason.STATE
        code = core.take_over(self.command, tuple(vector))
        if code is Reason.DONE:
            self.until_s = core.t_s + duration_s
        return code

    def automatic(self, core) -> Reason:
        """The laws command again; nothing, while the power is off."""
        self.until_s = None
        return core.take_over(self.command, None if self.is_powered else (0.0, 0.0, 0.0))

    def power(self, core, on: bool) -> Reason:
        """Switch the power: without it nothing is commanded."""
        self.is_powered = on
        return self.automatic(core)

    def status(self) -> dict[str, float]:
        """Polls and failed ones since the boot, power, whether it is under manual control."""
        return {
            "polls": self.polls,
            "errors": self.errors,
            "power": float(self.is_powered),
            "manual": float(self.until_s is not None),
        }


#: A factor of a calibration.
Factor = Annotated[float, Field(ge=0.1, le=10.0)]
_ONE = (1.0, 1.0, 1.0)


class CoilSettings(ManualSettings):
    """Settings of the coils' driver."""

    factors: tuple[Factor, Factor, Factor] = _ONE
    """By what the dipole is multiplied on its way to the coils, for each body axis."""


class Coils(Actuator):
    """Magnetic coils; telemetry has the dipole that was asked for, not what drives the coils."""

    name = "coils"
    Settings = CoilSettings
    command = "dipole_a_m2"

    @property
    def supplies(self) -> bool:
        """Whether there is a calibration."""
        return self.settings.factors != _ONE

    def supply(self, computer) -> None:
        """Give the computer the factors."""
        computer.calibrate_coils(self.settings.factors)

    def on_coils_calibration(self, core, values) -> Reason:
        """Factors of the commanded dipole, one for each body axis."""
        return self.change(core, factors=tuple(values))

    def on_coils_manual(self, core, values) -> Reason:
        """A dipole [A m^2] for a time."""
        return self.manual(core, values)

    def on_coils_automatic(self, core, values) -> Reason:
        """The laws command the dipole again."""
        return self.automatic(core)


class WheelSettings(ManualSettings):
    """Settings of the wheels' driver."""

    window_s: float = Field(default=60.0, gt=0.0)
    """Time over which change of momentum and commanded torque are compared."""
    least_n_m_s: float = Field(default=2e-3, gt=0.0)
    """Commanded change of momentum about an axis below which nothing is concluded."""
    following: float = Field(default=0.3, gt=0.0, lt=1.0)
    """Part of the commanded change that wheels must make to follow."""
    full_n_m_s: float = Field(default=0.035, gt=0.0)
    """Momentum about an axis beyond which wheels may be full, and need not follow."""
    failures: int = Field(default=3, ge=1)
    """Windows in a row without following after which the wheels of an axis are lost."""
    tachometers: tuple[Factor, ...] = ()
    """By what the readings of the tachometers are multiplied, one for each wheel; none: by 1."""


class Wheels(Actuator):
    """Reaction wheels; their tachometers show whether they follow.

    About each body axis the change of the wheels' momentum over a window is compared with the
    impulse that was commanded: wheels that make too small a part of it in several windows in a row
    are lost. One wheel of a pair shows only where it makes less than its part.
    """

    name = "wheels"
    Settings = WheelSettings
    command = "torque_n_m"

    def __init__(self, settings: WheelSettings):
        super().__init__(settings)
        self.lost = [False, False, False]
        self.in_row = [0, 0, 0]
        self.first: tuple | None = None
        self.torque = (0.0, 0.0, 0.0)
        self.impulse = [0.0, 0.0, 0.0]
        self.first_s = self.last_s = 0.0

    def step(self, core) -> None:
        """Add up the commanded impulse; compare at the end of a window."""
        super().step(core)
        momentum = core.inputs.wheel_momentum_body_n_m_s
        if not math.isfinite(core.inputs.read_at.tachometers_s + sum(momentum)):
            self.first = None
            return
        self._add(core)
        if self.first is None:
            self._begin(core, momentum)
        elif core.t_s - self.first_s >= self.settings.window_s:
            self._compare(core, momentum)
            self._begin(core, momentum)

    def _begin(self, core, momentum) -> None:
        self.first, self.first_s, self.impulse = momentum, core.t_s, [0.0, 0.0, 0.0]

    def _add(self, core) -> None:
        """What was commanded at the last step has acted since; the wheels take its reaction."""
        interval_s, self.last_s = core.t_s - self.last_s, core.t_s
        for axis in range(3):
            self.impulse[axis] -= self.torque[axis] * interval_s
        self.torque = core.commanded[1]

    def _compare(self, core, momentum) -> None:
        for axis in range(3):
            wanted, made = self.impulse[axis], momentum[axis] - self.first[axis]
            is_full = momentum[axis] * math.copysign(1.0, wanted) > self.settings.full_n_m_s
            if abs(wanted) < self.settings.least_n_m_s or is_full:
                continue
            follows = made / wanted > self.settings.following
            self.in_row[axis] = 0 if follows else self.in_row[axis] + 1
            self.errors += not follows
            if self.in_row[axis] >= self.settings.failures and not self.lost[axis]:
                self.lost[axis] = True
                core.report("wheels", Reason.WHEEL_FAILED, axis)

    @property
    def supplies(self) -> bool:
        """Whether there is a calibration."""
        return bool(self.settings.tachometers)

    def supply(self, computer) -> None:
        """Give the computer the tachometers' factors."""
        computer.calibrate_tachometers(self.settings.tachometers or (1.0,) * computer.wheels)

    def on_wheels_calibration(self, core, values) -> Reason:
        """A factor of the readings of one wheel's tachometer."""
        wheel, factor = values
        factors = list(self.settings.tachometers or (1.0,) * core.computer.wheels)
        if not factors:
            return Reason.NOT_AVAILABLE
        if wheel >= len(factors):
            return Reason.VALUE
        factors[wheel] = factor
        return self.change(core, tachometers=tuple(factors))

    def on_wheels_manual(self, core, values) -> Reason:
        """A torque on the body [N m] for a time."""
        return self.manual(core, values)

    def on_wheels_automatic(self, core, values) -> Reason:
        """The laws command the torque again; wheels that were lost get another chance."""
        self.lost, self.in_row = [False, False, False], [0, 0, 0]
        return self.automatic(core)

    def status(self) -> dict[str, float]:
        """As of every actuator, and the axes whose wheels are lost."""
        axes = {f"lost_{axis}": float(lost) for axis, lost in zip("xyz", self.lost, strict=True)}
        return super().status() | axes | {"lost": float(all(self.lost))}
