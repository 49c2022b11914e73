"""What is no number is no reading: whether a law has what it waits for.

A reading with a component that is no finite number is as good as none. A law that comes with the
package is not called without a reading that it needs: it commands nothing, and its memory stays.
A user's law sees what the sensors read.
"""

import math

from torquer.compile.engine import inlined
from torquer.computer.interface import (
    MAGNETOMETER,
    SEARCH_COIL,
    SUN_SENSORS,
    TACHOMETERS,
    reading3,
)
from torquer.maths.geometry.vec3 import doubt_of, is_finite

#: What a law may need and wait for, a bit each: the usual ones first.
NEEDS = (
    *("attitude", "rate", "magnetometer", "sun", "search_coil", "tachometers"),
    *("coil_dipole", "place", "model_field", "model_sun"),
)
_ATTITUDE, _RATE, _FIELD, _SUN, _SEARCH_COIL, _TACHOMETERS, _COILS, _PLACE, _MODEL, _MODEL_SUN = (
    1 << bit for bit in range(len(NEEDS))
)
#: What a law needs that takes position and velocity, the model's field or its direction to the Sun
#: from the ephemeris.
PLACE, MODEL_FIELD, MODEL_SUN = (
    frozenset({"ephemeris", part}) for part in ("place", "model_field", "model_sun")
)


def find_waits(needs: frozenset[str]) -> int:
    """What a law waits for that is not called without these: bits, see `NEEDS`."""
    return sum((name in needs) << bit for bit, name in enumerate(NEEDS))


@inlined
def has_field(inputs):
    """Whether the magnetometer reads a field: numbers, at a time that is one."""
    return is_finite(inputs.b_body_t) and inputs.read_at.magnetometer_s < math.inf


@inlined
def is_known(q):
    """Whether a quaternion is one of finite numbers."""
    return is_finite((q[0], q[1], q[2])) and math.isfinite(q[3])


@inlined
def known_vector(v):
    """A vector as it is; unknown, NaN, if a component is no finite number."""
    return v if is_finite(v) else (math.nan, math.nan, math.nan)


@inlined
def known_attitude(q):
    """A quaternion as it is; unknown, NaN, if a component is no finite number."""
    return q if is_known(q) else (math.nan, math.nan, math.nan, math.nan)


@inlined
def doubt_of_row(k, sensor):
    """Zero if a sensor's reading of three numbers in the record, and its time, are numbers."""
    late = 0.0 if k.read_s[sensor] < math.inf else math.nan  # before the first reading: -inf
    return doubt_of(reading3(k, sensor)) + late


@inlined
def doubt_of_rest(waits, k):
    """What `doubt_of_law` adds for what few laws wait for."""
    doubt = 0.0
    if waits & _SEARCH_COIL:
        doubt += doubt_of_row(k, SEARCH_COIL)
    if waits & _TACHOMETERS:
        doubt += doubt_of_row(k, TACHOMETERS)
    if waits & _COILS:
        doubt += doubt_of((k.coils_x, k.coils_y, k.coils_z))
    if waits & _PLACE:
        doubt += doubt_of((k.position_x, k.position_y, k.position_z))
        doubt += doubt_of((k.velocity_x, k.velocity_y, k.velocity_z))
    if waits & _MODEL:
        doubt += doubt_of((k.model_b_x, k.model_b_y, k.model_b_z))
        doubt += doubt_of((k.model_b_rate_x, k.model_b_rate_y, k.model_b_rate_z))
    if waits & _MODEL_SUN:
        doubt += doubt_of((k.to_sun_x, k.to_sun_y, k.to_sun_z))
    return doubt


@inlined
def doubt_of_law(waits, k):
    """Zero if the record has all that a law waits for, bits of `NEEDS`; else NaN."""
    doubt = 0.0
    if waits & _ATTITUDE:
        doubt += doubt_of((k.estimate_q_x, k.estimate_q_y, k.estimate_q_z))
        doubt += 0.0 * k.estimate_q_w
    if waits & _RATE:
        doubt += doubt_of((k.estimate_omega_x, k.estimate_omega_y, k.estimate_omega_z))
    if waits & _FIELD:
        doubt += doubt_of_row(k, MAGNETOMETER)
    if waits & _SUN:
        doubt += doubt_of_row(k, SUN_SENSORS)
    if waits >= _SEARCH_COIL:
        doubt += doubt_of_rest(waits, k)
    return doubt


@inlined
def is_informed(waits, k):
    """Whether the record of what is known has all that a law waits for, bits of `NEEDS`."""
    return doubt_of_law(waits, k) == 0.0
