"""The `control` table of a scenario: laws, estimator, modes, and when they work."""

import math
from typing import Annotated, ClassVar

from pydantic import Field, model_validator

from torquer.control import AnyLaw
from torquer.estimation import AnyEstimator
from torquer.estimation.sensors import SensorReadings
from torquer.spec import Spec

Positive = Annotated[float, Field(gt=0.0)]
#: More steps than any run can take: years of computing.
MOST_STEPS = 10**13


class Control(Spec):
    """What the on-board computer does, and when.

    `law`: the only law; or `laws`: a table of laws by names of the author's choice, whose commands
    are added. `estimator`: where attitude and rate come from; left out, from attitude sensor and
    gyro.

    Plain sample and hold: leave `measure_s` at 0; a control step every `sample_s`, the command
    held until the next. With a measurement window the coils are off for `measure_s` while the laws
    are called every `sample_s`, then follow the latest dipole for `actuate_s`; wheels follow every
    command.
    """

    renamed: ClassVar = {"wheel_law": "one of laws, a table of laws by name ([control.laws.NAME])"}

    law: AnyLaw | None = None
    laws: dict[str, AnyLaw] = Field(default_factory=dict)
    estimator: AnyEstimator = SensorReadings()
    sample_s: Positive = 1.0
    measure_s: float = Field(default=0.0, ge=0.0)
    actuate_s: Positive | None = None

    @model_validator(mode="after")
    def _laws_given(self):
        if (self.law is None) == (not self.laws):
            received = "neither" if self.law is None else "both"
            raise ValueError(f"law: either it or laws must be given; received {received}")
        return self

    @model_validator(mode="after")
    def _windows_fit(self):
        if self.measure_s > 0.0:
            if self.actuate_s is None:
                raise ValueError("actuate_s: must be given with measure_s; received none")
            whole_steps("measure_s", self.measure_s, self.sample_s, "sample_s")
        elif self.actuate_s is not None and self.actuate_s != self.sample_s:
            raise ValueError(
                "actuate_s: without measure_s the dipole is held for sample_s = "
                f"{self.sample_s:g} s; received {self.actuate_s:g} s"
            )
        return self

    def specs(self) -> dict:
        """Laws by their keys in the table: 'law', or 'laws.NAME'."""
        if self.law is not None:
            return {"law": self.law}
        return {f"laws.{name}": spec for name, spec in self.laws.items()}

    @property
    def cycle_s(self) -> float:
        """Length of the whole cycle."""
        return self.measure_s + self.actuate_s if self.measure_s > 0.0 else self.sample_s


def whole_steps(name: str, length_s: float, step_s: float, step_name: str = "step_s") -> int:
    """Number of steps in a length; ValueError unless it is a whole number above zero."""
    ratio = length_s / step_s
    steps = round(ratio) if ratio < MOST_STEPS else 0
    if steps < 1 or not math.isclose(steps * step_s, length_s, rel_tol=1e-9):
        raise ValueError(
            f"{name}: must be a whole multiple of {step_name} = {step_s:g} s; "
            f"received {length_s:g} s"
        )
    return steps
