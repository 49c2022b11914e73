"""Rate from two field readings: what a magnetometer alone reveals of the rotation.

The field's direction in the body turns with -omega. Of all rotations that take one reading to the
next, the one of least rate is about the normal of both: it is the part of the rate across the
field. The part along the field is not seen, and the field's own turn along the orbit, up to twice
the orbital rate, is taken for a rotation of the body.
"""

import math
from typing import ClassVar, Literal, NamedTuple

from pydantic import Field

from torquer.base.spec import Spec
from torquer.compile.engine import kernel
from torquer.computer.estimation.estimator import Estimator
from torquer.computer.interface import Estimate
from torquer.maths.geometry.vec3 import dot, put_vector, read_vector, turn_between

_UNKNOWN = (math.nan, math.nan, math.nan)


class RateFromFieldParameters(NamedTuple):
    """Least time between the two readings [s]."""

    interval: float


@kernel
def rate_from_field(inputs, parameters, memory):
    """The turn from one reading to the next.

    Not known before the second reading, nor where the field is zero or not of finite numbers.
    """
    b, t_s = inputs.b_body_t, inputs.read_at.magnetometer_s
    if memory.has_reading == 0.0 or not memory.t_s < math.inf:
        memory.has_reading, memory.t_s = 1.0, t_s
        put_vector(memory.b_body_t, b)
    # the half of a microsecond keeps rounding of the times from skipping a reading
    elif t_s > memory.t_s and t_s - memory.t_s > parameters.interval - 5e-7:
        before = read_vector(memory.b_body_t)
        omega = turn_between(before, b, t_s - memory.t_s)
        if not 0.0 < dot(b, b) * dot(before, before) < math.inf:
            omega = (math.nan, math.nan, math.nan)
        put_vector(memory.omega_body_rad_s, omega)
        put_vector(memory.b_body_t, b)
        memory.known_s = memory.t_s = t_s
    omega = read_vector(memory.omega_body_rad_s)
    q = (math.nan, math.nan, math.nan, math.nan)
    return Estimate(memory.known_s, q, omega, (0.0, 0.0, 0.0), math.nan, math.nan)


class RateFromField(Spec):
    """Rate across the field from two magnetometer readings.

    A rotation by more than 180 deg between them is taken for the shorter one; magnetometer noise
    gives a rate noise of sqrt(2) sigma_B/(B dt). The attitude stays unknown.
    """

    kind: Literal["rate_from_field"] = "rate_from_field"
    gives: ClassVar = frozenset({"rate"})
    interval_s: float = Field(default=0.0, ge=0.0)
    """Least time between the two readings; 0: from one reading to the next."""

    def estimator(self, units=()) -> Estimator:
        """The estimator with this interval."""
        return Estimator(
            self.kind,
            rate_from_field,
            RateFromFieldParameters(self.interval_s),
            {
                "has_reading": 0.0,
                "t_s": 0.0,
                "b_body_t": (0.0, 0.0, 0.0),
                "omega_body_rad_s": _UNKNOWN,
                "known_s": -math.inf,
            },
            spec=self,
        )
