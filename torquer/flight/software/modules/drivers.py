"""Drivers of the sensors: polls, errors, and whether a device is lost.

A driver does not touch readings: the compiled computer takes them as they are. It notes what the
polls show, for the supervisor.
"""

from __future__ import annotations

import math
from typing import ClassVar

from pydantic import Field

from torquer.base.spec import Spec
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.modules.module import Module


class PollSettings(Spec):
    """Settings of a sensor's driver."""

    oldest_s: float = Field(default=30.0, gt=0.0)
    """Age of the latest reading from which on a poll counts as failed."""
    failures: int = Field(default=10, ge=1, le=10000)
    """Failed polls in a row after which the sensor is lost; as many good ones bring it back."""


class Sensor(Module):
    """Polls a sensor: the age of its reading, and whether it can be one.

    `reading`, `taken`: its fields in the inputs and in their times; `greatest`: magnitude [SI]
    beyond which no reading is one; `device`: its name on board. Without power it is not polled, and
    counts as lost.
    """

    Settings = PollSettings
    reading: ClassVar[str]
    taken: ClassVar[str]
    greatest: ClassVar[float]
    device: ClassVar[str]

    def __init__(self, settings: PollSettings):
        super().__init__(settings)
        self.polls = self.errors = self.in_row = 0
        self.is_lost = False
        self.is_powered = True

    def start(self, core) -> None:
        """Its power is as the driver has it: on after a boot."""
        core.silence(self.device, not self.is_powered)

    def step(self, core) -> None:
        """Poll the sensor; events when it is lost."""
        if not self.is_powered:
            return
        age_s = core.t_s - getattr(core.inputs.read_at, self.taken)
        x, y, z = getattr(core.inputs, self.reading)
        size = math.sqrt(x * x + y * y + z * z)
        odd = not size <= self.greatest
        silent = not age_s <= self.settings.oldest_s
        self.polls += 1
        self.errors += odd or silent
        bad = (odd or silent) != self.is_lost  # one that speaks for a change
        self.in_row = self.in_row + 1 if bad else 0
        if self.in_row >= self.settings.failures:
            self.in_row, self.is_lost = 0, not self.is_lost
            if self.is_lost:
                core.report(self.name, Reason.SENSOR_SILENT if silent else Reason.SENSOR_ODD)

    def raw(self, core, unit: int) -> tuple | None:
        """Time [s] and numbers [SI] of the latest reading, of what laws read (0) or of one of
        several (from 1 on); None for one that there is not."""
        if unit == 0:
            taken_s = getattr(core.inputs.read_at, self.taken)
            return (taken_s, *getattr(core.inputs, self.reading))
        places = core.units(self.device)
        return core.inputs.units[places[unit - 1]][:4] if unit <= len(places) else None

    def power(self, core, on: bool) -> Reason:
        """Switch the power: without it there are no new readings."""
        self.is_powered, self.in_row = on, 0
        core.silence(self.device, not on)
        return Reason.DONE

    def status(self) -> dict[str, float]:
        """Polls and failed ones since the boot, power, whether the sensor is lost."""
        return {
            "polls": self.polls,
            "errors": self.errors,
            "power": float(self.is_powered),
            "lost": float(self.is_lost or not self.is_powered),
        }


class Mag(Sensor):
    """Magnetometer."""

    name = "mag"
    reading, taken, greatest = "b_body_t", "magnetometer_s", 2e-4
    device = "magnetometer"

    def on_mag_calibration(self, core, values) -> Reason:
        """The computer takes readings as they are: it has no place for a calibration."""
        return Reason.NOT_AVAILABLE


class Gyro(Sensor):
    """Gyro."""

    name = "gyro"
    reading, taken, greatest = "omega_body_rad_s", "gyro_s", 10.0
    device = "gyro"

    def on_gyro_calibration(self, core, values) -> Reason:
        """The filters estimate the bias themselves: there is no place for another."""
        return Reason.NOT_AVAILABLE


class Sun(Sensor):
    """Sun sensors; that none sees the Sun is a reading, too."""

    name = "sun"
    reading, taken, greatest = "sun_body", "sun_sensors_s", 1.01
    device = "sun_sensors"
