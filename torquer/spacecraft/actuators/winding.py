"""Winding of a coil: its dipole and power at its greatest current, of turns, area, resistance."""

import numpy as np
from pydantic import Field, model_validator

from torquer.base.spec import Spec
from torquer.base.validate import out_of_range


class Winding(Spec):
    """Winding of a coil, in place of its limit: gain N I A, power I^2 R at the greatest current."""

    turns: int = Field(gt=0)
    """Number of turns."""
    area_m2: float = Field(gt=0.0)
    """Mean area of a turn."""
    current_a: float = Field(gt=0.0)
    """Greatest current."""
    core_gain: float = Field(default=1.0, gt=0.0)
    """Dipole with the core over that without; 1: no core."""
    resistance_ohm: float | None = Field(default=None, gt=0.0)
    """Resistance, for the electrical power; left out: not known."""

    @model_validator(mode="after")
    def _is_of_a_size(self):
        found = {"limit_a_m2": (self.limit_a_m2(), "A m^2")}
        if (power_w := self.power_w()) is not None:
            found["power_at_limit_w"] = power_w, "W"
        for key, (value, unit) in found.items():
            if must := out_of_range(key, value, 0.0):
                raise ValueError(
                    f"current_a: must give a coil of {must} {unit}; received {self.current_a:g}, "
                    f"which gives {value:g} {unit}"
                )
        return self

    def limit_a_m2(self) -> float:
        """Dipole at the greatest current [A m^2]."""
        return self.core_gain * self.turns * self.current_a * self.area_m2

    def power_w(self) -> float | None:
        """Power at the greatest current [W]; None if the resistance is not known."""
        return None if self.resistance_ohm is None else self.current_a**2 * self.resistance_ohm


def greatest_multiple(limits, steps) -> np.ndarray:
    """The greatest multiples of steps (n,) within limits (n,); the limits where a step is 0."""
    counts = np.floor(limits / np.where(steps > 0.0, steps, 1.0) * (1.0 + 1e-12))
    return np.where(steps > 0.0, np.minimum(counts * steps, limits), limits)
