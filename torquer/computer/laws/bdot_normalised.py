"""Normalised B-dot: the field's direction in place of the field, so that a weak one brakes, too.

With b = B/|B| the dipole is m = -k/|B| db/dt. In a body that turns fast db/dt = -omega x b, and
the torque is -k (omega - b (b.omega)): the same brake k [N m s] at any strength of the field, and
never one that adds energy, as omega.M = -k |omega x b|^2. Where the field turns as fast as the body
this brakes relative to the field, as B-dot does.

The weighted form lets the gain fall while the body tumbles fast, which saves power and costs little
time, since coils at their limit brake no more for a higher gain:

    k' = k / (1 + w (u - u_0)),  u = mean of |db/dt|

with the weight w [s], the rate u_0 at which k' = k, and a mean that forgets over a time. R. Fonod,
E. Gill, "Magnetic detumbling of fast-tumbling picosatellites", IAC-18-C1.3.11 (2018), who take the
mean of each component by itself; that of the whole does not depend on the body's axes.

Valid while the body turns by less than about half a turn in the time between two readings and until
the dipole acts (see the note on the rate that a law can brake); k/J must be low against the rate of
control steps; the coils' limit changes the torque's direction unless it scales.
"""

import math
from typing import ClassVar, Literal, NamedTuple

from pydantic import Field, model_validator

from torquer.compile.engine import inlined, kernel
from torquer.computer.blocks.parameters import Positive
from torquer.computer.laws.bdot import GAP, PREVIOUS_READING, shortest_with
from torquer.computer.laws.law_spec import LawSpec
from torquer.maths.geometry.vec3 import (
    norm,
    put_vector,
    read_vector,
    scale,
    sub,
    unit,
)


class Brake(NamedTuple):
    """`gain`: k [N m s]."""

    gain: Positive


class WeightedBrake(NamedTuple):
    """k [N m s], w [s], u_0 [rad/s], time of the mean [s]."""

    gain: Positive
    weight_s: float
    reference_rad_s: float
    averaging_s: float


@inlined
def _follows(has_reading, interval_s, shortest_s):
    """Whether a reading follows another without a gap; see `bdot_difference`."""
    return has_reading == 1.0 and (shortest_s == 0.0 or interval_s <= GAP * shortest_s)


@inlined
def _shortest(has_reading, interval_s, shortest_s):
    """The shortest interval [s] so far, with this reading."""
    return shortest_with(shortest_s, interval_s) if has_reading == 1.0 else shortest_s


@kernel
def bdot_normalised(inputs, parameters, memory):
    """m = -k/|B| (b - b_before) / (t - t_before); without a field no dipole.

    Memory: see `PREVIOUS_READING`, with directions for fields; between two readings, and after a
    gap, as in `bdot_difference`.
    """
    b, t_s = inputs.b_body_t, inputs.read_at.magnetometer_s
    m, size, interval_s = read_vector(memory.dipole_a_m2), norm(b), t_s - memory.t_s
    if size == 0.0:
        return (0.0, 0.0, 0.0)
    if memory.has_reading == 0.0 or interval_s > 0.0:
        m, along = (0.0, 0.0, 0.0), unit(b)
        if _follows(memory.has_reading, interval_s, memory.shortest_s):
            turned = sub(along, read_vector(memory.b_body_t))
            m = scale(-parameters.gain / (size * interval_s), turned)
        memory.shortest_s = _shortest(memory.has_reading, interval_s, memory.shortest_s)
        memory.has_reading, memory.t_s = 1.0, t_s
        put_vector(memory.b_body_t, along)
        put_vector(memory.dipole_a_m2, m)
    return m


@kernel
def bdot_weighted(inputs, parameters, memory):
    """m = -k'/|B| (b - b_before) / (t - t_before), with the gain k' of the mean of |db/dt|.

    The mean begins with the first difference. Memory as that of `bdot_normalised`, and the mean.
    """
    p, b, t_s = parameters, inputs.b_body_t, inputs.read_at.magnetometer_s
    m, size, interval_s = read_vector(memory.dipole_a_m2), norm(b), t_s - memory.t_s
    if size == 0.0:
        return (0.0, 0.0, 0.0)
    if memory.has_reading == 0.0 or interval_s > 0.0:
        m, along = (0.0, 0.0, 0.0), unit(b)
        if _follows(memory.has_reading, interval_s, memory.shortest_s):
            rate = scale(1.0 / interval_s, sub(along, read_vector(memory.b_body_t)))
            part = min(1.0, interval_s / p.averaging_s) if memory.has_mean == 1.0 else 1.0
            memory.mean_rad_s += part * (norm(rate) - memory.mean_rad_s)
            memory.has_mean = 1.0
            above = memory.mean_rad_s - p.reference_rad_s
            m = scale(-p.gain / ((1.0 + p.weight_s * above) * size), rate)
        memory.shortest_s = _shortest(memory.has_reading, interval_s, memory.shortest_s)
        memory.has_reading, memory.t_s = 1.0, t_s
        put_vector(memory.b_body_t, along)
        put_vector(memory.dipole_a_m2, m)
    return m


class BdotNormalised(LawSpec):
    """B-dot of the field's direction: one brake k at any strength of the field."""

    kind: Literal["bdot_normalised"] = "bdot_normalised"
    kernel: ClassVar = bdot_normalised
    memory: ClassVar = PREVIOUS_READING
    needs: ClassVar = frozenset({"magnetometer"})
    gain_n_m_s: float = Field(gt=0.0)
    """Gain k of m = -k/|B| db/dt: the torque across the field per unit of rate."""

    def parameters(self) -> NamedTuple:
        """The gain."""
        return Brake(self.gain_n_m_s)


class BdotWeighted(BdotNormalised):
    """Normalised B-dot whose gain falls while the body tumbles fast."""

    kind: Literal["bdot_weighted"] = "bdot_weighted"
    kernel: ClassVar = bdot_weighted
    memory: ClassVar = PREVIOUS_READING | {"has_mean": 0.0, "mean_rad_s": 0.0}
    weight_s: float = Field(gt=0.0)
    """Weight of the mean rate of the field's direction, by which the gain falls."""
    reference_deg_s: float = Field(gt=0.0)
    """Mean rate of the field's direction at which the gain is `gain_n_m_s`; below it the gain is
    higher.
    """
    averaging_s: float = Field(gt=0.0)
    """Time over which the mean forgets what came before."""

    @model_validator(mode="after")
    def _gain_is_positive(self):
        reference = math.radians(self.reference_deg_s)
        if not self.weight_s * reference < 1.0:
            raise ValueError(
                f"weight_s: must be below {1.0 / reference:.4g} s with reference_deg_s = "
                f"{self.reference_deg_s:g}, so that the gain stays positive; received "
                f"{self.weight_s:g}"
            )
        return self

    def parameters(self) -> NamedTuple:
        """Gain, weight, reference, time of the mean."""
        reference = math.radians(self.reference_deg_s)
        return WeightedBrake(self.gain_n_m_s, self.weight_s, reference, self.averaging_s)
