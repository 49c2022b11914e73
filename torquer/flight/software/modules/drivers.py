"""Drivers of the sensors: polls, errors, and whether a device is lost.

A driver notes what the polls show, for the supervisor. Its calibration is the compiled computer's:
that corrects readings as they come in, so that estimators, laws and telemetry have corrected ones.
"""

from __future__ import annotations

import math
from typing import Annotated, ClassVar

import numpy as np
from pydantic import AfterValidator, Field

from torquer.base.spec import Spec, Vector
from torquer.computer.calibration import IDENTITY, NO_BIAS
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.modules.module import Supplier
from torquer.flight.software.modules.telemetry import calibration
from torquer.maths.geometry.quaternion import from_rotation_vector, to_dcm

#: A calibration's matrix changes a reading's size by no more than this, either way.
_MOST = 10.0


def _checked_matrix(numbers: tuple[float, ...]) -> tuple[float, ...]:
    """A matrix that can be one of a calibration."""
    possible = all(abs(each) <= _MOST for each in numbers)
    size = abs(float(np.linalg.det(np.reshape(numbers, (3, 3))))) if possible else 0.0
    if not 1.0 / _MOST <= size <= _MOST:
        raise ValueError(
            f"matrix: must have numbers of at most {_MOST:g} and a determinant of "
            f"{1.0 / _MOST:g} to {_MOST:g}; received {numbers}"
        )
    return numbers


#: Type of a matrix of a calibration, row by row.
Matrix = Annotated[
    tuple[float, ...], Field(min_length=9, max_length=9), AfterValidator(_checked_matrix)
]


class PollSettings(Spec):
    """Settings of a sensor's driver."""

    oldest_s: float = Field(default=30.0, gt=0.0)
    """Age of the latest reading from which on a poll counts as failed."""
    failures: int = Field(default=10, ge=1, le=10000)
    """Failed polls in a row after which the sensor is lost; as many good ones bring it back."""


class Sensor(Supplier):
    """Polls a sensor: the age of its reading, and whether it can be one.

    `reading`, `taken`: its fields in the inputs and in their times; `greatest`: magnitude [SI]
    beyond which no reading is one. Without power it is not polled, and counts as lost.
    """

    Settings = PollSettings
    reading: ClassVar[str]
    taken: ClassVar[str]
    greatest: ClassVar[float]

    def __init__(self, settings: PollSettings):
        super().__init__(settings)
        self.polls = self.errors = self.in_row = 0
        self.is_lost = False
        self.is_powered = True

    def start(self, core) -> None:
        """Its power is as the driver has it, on after a boot; the calibration is handed over."""
        super().start(core)
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
        core.silence(self.device, not on)
        self.is_powered, self.in_row = on, 0
        return Reason.DONE

    def status(self) -> dict[str, float]:
        """Polls and failed ones since the boot, power, whether the sensor is lost."""
        return {
            "polls": self.polls,
            "errors": self.errors,
            "power": float(self.is_powered),
            "lost": float(self.is_lost or not self.is_powered),
        }


class CalibratedSettings(PollSettings):
    """Settings of a sensor whose readings are corrected: a matrix times reading less bias."""

    bias: Vector = NO_BIAS
    """What is subtracted from readings, body axes, in the unit of the command."""
    matrix: Matrix = IDENTITY
    """What readings less the bias are multiplied by, row by row."""


class CalibratedSensor(Sensor):
    """A sensor with a bias and a matrix; `unit`: of the bias.

    Filters that estimate a bias themselves estimate what is left of it.
    """

    Settings = CalibratedSettings
    unit: ClassVar[float]

    @property
    def supplies(self) -> bool:
        """Whether there is a calibration."""
        return (self.settings.matrix, self.settings.bias) != (IDENTITY, NO_BIAS)

    def supply(self, computer) -> None:
        """Give the computer matrix and bias."""
        bias = [self.unit * each for each in self.settings.bias]
        computer.calibrate(self.device, self.settings.matrix, bias)

    def in_force(self, core):
        """The calibration: bias, then matrix."""
        return [calibration(core, self.name, (*self.settings.bias, *self.settings.matrix))]

    def calibrate(self, core, bias) -> Reason:
        """Another bias; VALUE for one that no reading can have."""
        if not math.hypot(*bias) * self.unit <= self.greatest:
            return Reason.VALUE
        return self.change(core, bias=tuple(bias))


class Mag(CalibratedSensor):
    """Magnetometer."""

    name, device, unit = "mag", "magnetometer", 1e-9
    reading, taken, greatest = "b_body_t", "magnetometer_s", 2e-4

    def on_mag_calibration(self, core, values) -> Reason:
        """A bias [nT] to be subtracted from readings."""
        return self.calibrate(core, values)

    def on_mag_matrix(self, core, values) -> Reason:
        """A matrix for readings less the bias, row by row."""
        return self.change(core, matrix=tuple(values))


class Gyro(CalibratedSensor):
    """Gyro."""

    name, device, unit = "gyro", "gyro", math.radians(1.0)
    reading, taken, greatest = "omega_body_rad_s", "gyro_s", 10.0

    def on_gyro_calibration(self, core, values) -> Reason:
        """A bias [deg/s] to be subtracted from readings."""
        return self.calibrate(core, values)

    def on_gyro_matrix(self, core, values) -> Reason:
        """A matrix for readings less the bias, row by row."""
        return self.change(core, matrix=tuple(values))


class SunSettings(PollSettings):
    """Settings of the Sun sensors."""

    rotation_deg: Vector = NO_BIAS
    """Rotation vector by which readings are turned, body axes."""


class Sun(Sensor):
    """Sun sensors; that none sees the Sun is a reading, too."""

    name = "sun"
    Settings = SunSettings
    reading, taken, greatest = "sun_body", "sun_sensors_s", 1.01
    device = "sun_sensors"

    @property
    def supplies(self) -> bool:
        """Whether readings are turned."""
        return self.settings.rotation_deg != NO_BIAS

    def supply(self, computer) -> None:
        """Give the computer the rotation."""
        turn = from_rotation_vector(tuple(map(math.radians, self.settings.rotation_deg)))
        rows = to_dcm(turn) if self.supplies else (IDENTITY,)
        computer.calibrate(self.device, tuple(x for row in rows for x in row))

    def in_force(self, core):
        """The rotation vector."""
        return [calibration(core, self.name, self.settings.rotation_deg)]

    def on_sun_calibration(self, core, values) -> Reason:
        """A rotation vector [deg] by which readings are turned."""
        if not math.hypot(*values) <= 180.0:
            return Reason.VALUE
        return self.change(core, rotation_deg=tuple(values))
