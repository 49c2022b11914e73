"""Drivers of actuators: manual control, power. Those of the coils."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar

from pydantic import Field

from torquer.base.spec import Spec
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.modules.module import Supplier
from torquer.flight.software.modules.telemetry import calibration


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

    def stop(self, core) -> None:
        """Nobody would end manual control."""
        self.automatic(core)

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
        before, self.is_powered = self.is_powered, on
        code = self.automatic(core)
        if code is not Reason.DONE:
            self.is_powered = before
        return code

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

    name = device = "coils"
    Settings = CoilSettings
    command = "dipole_a_m2"

    @property
    def supplies(self) -> bool:
        """Whether there is a calibration."""
        return self.settings.factors != _ONE

    def supply(self, computer) -> None:
        """Give the computer the factors."""
        computer.calibrate_coils(self.settings.factors)

    def in_force(self, core):
        """The factors."""
        return [calibration(core, self.name, self.settings.factors)]

    def on_coils_calibration(self, core, values) -> Reason:
        """Factors of the commanded dipole, one for each body axis."""
        return self.change(core, factors=tuple(values))

    def on_coils_manual(self, core, values) -> Reason:
        """A dipole [A m^2] for a time."""
        return self.manual(core, values)

    def on_coils_automatic(self, core, values) -> Reason:
        """The laws command the dipole again."""
        return self.automatic(core)
