"""S-dot: point to the Sun with coils, Sun sensors and models on board; no magnetometer.

SDOT 1.5: B-dot with the direction to the Sun in place of the field's; the angle alpha between the
two comes from the models. The angular momentum turns to the Sun or away from it, which of the two
depends on the start (`torquer.theory.slow.evolution.sdot`).

Without the Sun there is no dipole. The law without a gyro takes the difference of two successive
readings; after a reading without the Sun, and after a gap (an eclipse through which the law was not
called), it starts afresh.
"""

from typing import ClassVar, Literal, NamedTuple

from pydantic import Field

from torquer.compile.engine import inlined, kernel
from torquer.computer.informed import MODEL_FIELD, MODEL_SUN
from torquer.computer.laws.bdot import GAP, shortest_with
from torquer.computer.laws.law_spec import LawSpec
from torquer.maths.geometry.vec3 import cross, dot, norm, put_vector, read_vector, scale, sub

_ZERO = (0.0, 0.0, 0.0)
#: Memory of the law of differences: whether there was a reading, its time, its direction to the
#: Sun, dS/dt [1/s] since then, and the shortest interval of readings (0: none yet).
PREVIOUS_SUN = {
    "has_reading": 0.0, "t_s": 0.0, "sun_body": _ZERO, "sun_rate_body_per_s": _ZERO,
    "shortest_s": 0.0,
}  # fmt: skip


class Gain(NamedTuple):
    """`gain`: k [A m^2 s]."""

    gain: float


@inlined
def cos_alpha(ephemeris):
    """Cosine of the angle between field and Sun by the models; 0 without field.

    Source: SDOT (2.2).
    """
    strength = norm(ephemeris.b_inertial_t)
    if strength > 0.0:
        return dot(scale(1.0 / strength, ephemeris.b_inertial_t), ephemeris.sun_inertial)
    return 0.0


@kernel
def sdot_rate(inputs, parameters, memory):
    """m = k cos(alpha) (omega x S) from gyro and Sun sensors. Source: SDOT (1.16)."""
    turning = cross(inputs.estimate.omega_body_rad_s, inputs.sun_body)
    return scale(parameters.gain * cos_alpha(inputs.ephemeris), turning)


@inlined
def _difference(sun, interval_s, memory):
    """dS/dt [1/s] from the reading before; zero at the first one and after a gap."""
    if memory.has_reading == 1.0 and interval_s <= GAP * memory.shortest_s:
        return scale(1.0 / interval_s, sub(sun, read_vector(memory.sun_body)))
    return (0.0, 0.0, 0.0)


@kernel
def sdot_difference(inputs, parameters, memory):
    """m = -k cos(alpha) dS/dt, from two readings of the Sun sensors. Source: SDOT (1.17).

    Between two readings dS/dt is kept while alpha goes on. The first interval of all is taken for
    a gap. Memory: see `PREVIOUS_SUN`.
    """
    sun, t_s = inputs.sun_body, inputs.read_at.sun_sensors_s
    interval_s = t_s - memory.t_s
    if dot(sun, sun) == 0.0:
        memory.has_reading = 0.0
        put_vector(memory.sun_rate_body_per_s, (0.0, 0.0, 0.0))
    elif memory.has_reading == 0.0 or interval_s > 0.0:
        put_vector(memory.sun_rate_body_per_s, _difference(sun, interval_s, memory))
        if memory.has_reading == 1.0:
            memory.shortest_s = shortest_with(memory.shortest_s, interval_s)
        memory.has_reading, memory.t_s = 1.0, t_s
        put_vector(memory.sun_body, sun)
    factor = -parameters.gain * cos_alpha(inputs.ephemeris)
    return scale(factor, read_vector(memory.sun_rate_body_per_s))


class _Sdot(LawSpec):
    """S-dot; the gain k in A m^2 s (the same as N m s/T)."""

    gain_a_m2_s: float = Field(gt=0.0)
    """Gain k of the law; A m^2 s is the same as N m s/T."""
    gain_key: ClassVar = "gain_a_m2_s"
    needs: ClassVar = MODEL_FIELD | MODEL_SUN | {"sun"}

    def parameters(self) -> Gain:
        """The gain."""
        return Gain(self.gain_a_m2_s)


class Sdot(_Sdot):
    """On-board S-dot: finite difference of two readings of the Sun sensors."""

    kind: Literal["sdot"] = "sdot"
    kernel: ClassVar = sdot_difference
    memory: ClassVar = PREVIOUS_SUN


class SdotRate(_Sdot):
    """S-dot from gyro and Sun sensors."""

    kind: Literal["sdot_rate"] = "sdot_rate"
    kernel: ClassVar = sdot_rate
    needs: ClassVar = MODEL_FIELD | MODEL_SUN | {"sun", "rate"}
