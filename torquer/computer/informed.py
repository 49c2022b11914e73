"""What is no number is no reading: whether a law has what it waits for.

A reading with a component that is no finite number is as good as none. A law that comes with the
package is not called without a reading that it needs: it commands nothing, and its memory stays.
A user's law sees what the sensors read.
"""

import math
from typing import NamedTuple

from torquer.compile.engine import inlined
from torquer.computer.interface import (
    MAGNETOMETER,
    SEARCH_COIL,
    SUN_SENSORS,
    TACHOMETERS,
    reading3,
)
from torquer.maths.geometry.vec3 import is_finite


class Waits(NamedTuple):
    """What a law waits for, of what it may need: 1 or 0."""

    waits_attitude: int
    waits_rate: int
    waits_magnetometer: int
    waits_search_coil: int
    waits_sun: int
    waits_tachometers: int
    waits_coil_dipole: int
    waits_place: int
    waits_model_field: int
    waits_model_sun: int


#: What a law needs that takes position and velocity, the model's field or its direction to the Sun
#: from the ephemeris.
PLACE, MODEL_FIELD, MODEL_SUN = (
    frozenset({"ephemeris", part}) for part in ("place", "model_field", "model_sun")
)


def find_waits(needs: frozenset[str]) -> Waits:
    """What a law waits for that is not called without these."""
    return Waits(*(int(name.removeprefix("waits_") in needs) for name in Waits._fields))


@inlined
def is_reading(v, read_s):
    """Whether a vector and the time at which it was read are numbers."""
    return is_finite(v) and read_s < math.inf


@inlined
def is_row(k, sensor):
    """Whether a sensor's reading of three numbers in the record, and its time, are numbers."""
    return is_reading(reading3(k, sensor), k.read_s[sensor])


@inlined
def has_field(inputs):
    """Whether the magnetometer reads a field."""
    return is_reading(inputs.b_body_t, inputs.read_at.magnetometer_s)


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
def is_informed(waits, k):
    """Whether the record of what is known has all that a law waits for; see `Waits`."""
    q = (k.estimate_q_x, k.estimate_q_y, k.estimate_q_z, k.estimate_q_w)
    omega = (k.estimate_omega_x, k.estimate_omega_y, k.estimate_omega_z)
    coils, to_sun = (k.coils_x, k.coils_y, k.coils_z), (k.to_sun_x, k.to_sun_y, k.to_sun_z)
    r, v = (k.position_x, k.position_y, k.position_z), (k.velocity_x, k.velocity_y, k.velocity_z)
    field = (k.model_b_x, k.model_b_y, k.model_b_z)
    field_rate = (k.model_b_rate_x, k.model_b_rate_y, k.model_b_rate_z)
    return (
        (waits.waits_attitude == 0 or is_known(q))
        and (waits.waits_rate == 0 or is_finite(omega))
        and (waits.waits_magnetometer == 0 or is_row(k, MAGNETOMETER))
        and (waits.waits_search_coil == 0 or is_row(k, SEARCH_COIL))
        and (waits.waits_sun == 0 or is_row(k, SUN_SENSORS))
        and (waits.waits_tachometers == 0 or is_row(k, TACHOMETERS))
        and (waits.waits_coil_dipole == 0 or is_finite(coils))
        and (waits.waits_place == 0 or (is_finite(r) and is_finite(v)))
        and (waits.waits_model_field == 0 or (is_finite(field) and is_finite(field_rate)))
        and (waits.waits_model_sun == 0 or is_finite(to_sun))
    )
