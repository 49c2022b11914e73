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
    beyond which no reading is one.
    """

    Settings = PollSettings
    reading: ClassVar[str]
    taken: ClassVar[str]
    greatest: ClassVar[float]

    def __init__(self, settings: PollSettings):
        super().__init__(settings)
        self.polls = self.errors = self.in_row = 0
        self.is_lost = False

    def step(self, core) -> None:
        """Poll the sensor; events when it is lost."""
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

    def status(self) -> dict[str, float]:
        """Polls and failed ones since the boot, whether the sensor is lost."""
        return {"polls": self.polls, "errors": self.errors, "lost": float(self.is_lost)}


class Mag(Sensor):
    """Magnetometer."""

    name = "mag"
    reading, taken, greatest = "b_body_t", "magnetometer_s", 2e-4

    def on_mag_calibration(self, core, values) -> Reason:
        """The computer takes readings as they are: it has no place for a calibration."""
        return Reason.NOT_AVAILABLE


class Gyro(Sensor):
    """Gyro."""

    name = "gyro"
    reading, taken, greatest = "omega_body_rad_s", "gyro_s", 10.0

    def on_gyro_calibration(self, core, values) -> Reason:
        """The filters estimate the bias themselves: there is no place for another."""
        return Reason.NOT_AVAILABLE


class Sun(Sensor):
    """Sun sensors; that none sees the Sun is a reading, too."""

    name = "sun"
    reading, taken, greatest = "sun_body", "sun_sensors_s", 1.01


class AdcSettings(Spec):
    """Limits of temperatures and currents."""

    temperature_min: float = -40.0
    """Least temperature [degC]."""
    temperature_max: float = 85.0
    """Greatest temperature [degC]."""
    current_max: float = Field(default=2.0, gt=0.0)
    """Greatest current [A]."""


class Adc(Module):
    """Temperatures and currents: their limits are kept; the simulation has no such sensors."""

    name = "adc"
    Settings = AdcSettings
    period_s = 10.0

    def on_adc_limits(self, core, values) -> Reason:
        """Change the limits."""
        low, high, current = values
        if not low < high:
            return Reason.VALUE
        return self.change(core, temperature_min=low, temperature_max=high, current_max=current)
