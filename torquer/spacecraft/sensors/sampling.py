"""When a sensor is read, and how late its reading reaches the computer."""

from typing import ClassVar

from pydantic import Field, model_validator

from torquer.base.spec import Spec
from torquer.spacecraft.data_sheet import DataSheet
from torquer.spacecraft.failures import SensorFailure


class Sampled(Spec):
    """A sensor that is read at its own rate."""

    #: Its keys for the rules that hold for every device.
    sheet: ClassVar[DataSheet]
    sample_s: float | None = Field(default=None, gt=0.0)
    """Interval between readings; left out: a reading at every control step."""
    delay_s: float = Field(default=0.0, ge=0.0)
    """Time from a reading until the computer has it, at most one interval."""
    failures: tuple[SensorFailure, ...] = ()
    """Intervals in which its readings are missing or wrong."""

    @model_validator(mode="after")
    def _delay_within_interval(self):
        if self.sample_s is not None and self.delay_s > self.sample_s * (1.0 + 1e-9):
            raise ValueError(
                f"delay_s: must not exceed sample_s = {self.sample_s:g} s; "
                f"received {self.delay_s:g} s"
            )
        if self.sample_s is None and self.delay_s > 0.0:
            raise ValueError("sample_s: must be given with delay_s; received none")
        return self
