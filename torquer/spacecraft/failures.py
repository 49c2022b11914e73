"""Failures of sensors: silent, stuck at the last reading, or one value, in an interval of the run.

The on-board computer does not know: it reads what the sensor sends.
"""

import math
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from torquer.spec import Spec

SILENT, STUCK, REPLACED = 0, 1, 2
#: Kind for kernels, and the value that replaces all components of a reading.
KINDS = {
    "silent": (SILENT, 0.0),
    "stuck": (STUCK, 0.0),
    "zeros": (REPLACED, 0.0),
    "nan": (REPLACED, math.nan),
    "infinite": (REPLACED, math.inf),
}
#: A failure for kernels: number of the sensor, kind, value, instants.
FAILURE = np.dtype(
    [
        ("sensor", np.int64),
        ("kind", np.int64),
        ("value", np.float64),
        ("from_s", np.float64),
        ("until_s", np.float64),
    ]
)


class SensorFailure(Spec):
    """A failure of a sensor in an interval of the run."""

    kind: Literal["silent", "stuck", "zeros", "nan", "infinite"]
    """'silent' (no new readings: the last one ages), 'stuck' (the last reading again and again,
    as if it were new), or what replaces each component of the measurement: 'zeros', 'nan' (not a
    number), 'infinite'.
    """
    from_s: float = Field(default=0.0, ge=0.0)
    """Time since the start at which the failure begins."""
    until_s: float | None = None
    """Time since the start at which the failure ends; left out: it lasts to the end of the run."""

    @model_validator(mode="after")
    def _ends_after_it_begins(self):
        if self.until_s is not None and self.until_s <= self.from_s:
            raise ValueError(
                f"until_s: must be above from_s, {self.from_s:g} s; received {self.until_s:g} s"
            )
        return self

    def row(self, sensor: int) -> tuple:
        """The failure for kernels; `sensor`: its number."""
        until_s = math.inf if self.until_s is None else self.until_s
        return sensor, *KINDS[self.kind], self.from_s, until_s
