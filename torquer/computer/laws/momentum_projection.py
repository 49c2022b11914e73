"""Detumbling by the momentum's projection: brake hard where the momentum is across the field.

m = k'/|B|^2 (h x B), h = J omega, has the torque -k' (h - b (b.h)), b = B/|B|. While it works
d|h|^2/dt = 2 h.M = -2 k' |h x b|^2 (gravity and the like left out; J omega x omega does not change
|h|), so the magnitude of the momentum never grows. The gain

    k' = k exp(-c |b.h|/|h|)

rests where the momentum lies along the field, which braking there would only align further:
D. Invernizzi, M. Lovera, "A projection-based controller for fast spacecraft detumbling using
magnetic actuation", Automatica 113 (2020) 108779, in the form of the comparison by J. Willis and
others, "Building a better B-dot", IEEE Aerospace Conference (2024).

Valid with an inertia that is known well enough for the direction of h, a gyro without bias to speak
of, and coils that are not at their limit all the time. k T must be below 1 for control steps of T.
"""

import math
from typing import ClassVar, Literal, NamedTuple

from pydantic import Field

from torquer.base.spec import Inertia
from torquer.compile.engine import kernel
from torquer.computer.blocks.parameters import InertiaNumbers
from torquer.computer.laws.law_spec import LawSpec
from torquer.maths.geometry.vec3 import as_symmetric, cross, dot, norm, scale, sym_vec


class ProjectionParameters(NamedTuple):
    """k [1/s], c [1], J."""

    gain: float
    slope: float
    inertia: InertiaNumbers


@kernel
def momentum_projection(inputs, parameters, memory):
    """m = k exp(-c |b.h|/|h|) / |B|^2 (h x B); without a field or a momentum no dipole."""
    p, b = parameters, inputs.b_body_t
    h = sym_vec(p.inertia, inputs.estimate.omega_body_rad_s)
    size, length = norm(b), norm(h)
    if size == 0.0 or length == 0.0:
        return (0.0, 0.0, 0.0)
    gain = p.gain * math.exp(-p.slope * abs(dot(b, h)) / (size * length))
    return scale(gain / (size * size), cross(h, b))


class MomentumProjection(LawSpec):
    """Detumbling whose gain falls as the momentum comes to lie along the field."""

    kind: Literal["momentum_projection"] = "momentum_projection"
    kernel: ClassVar = momentum_projection
    needs: ClassVar = frozenset({"magnetometer", "rate"})
    gain_per_s: float = Field(gt=0.0)
    """Gain k: the rate at which momentum across the field is taken out."""
    slope: float = Field(default=4.0, ge=0.0)
    """How much the gain falls towards a momentum along the field: to exp(-slope) of it."""
    inertia_kg_m2: Inertia
    """Inertia tensor of the body that the computer assumes, in the frame of its axes."""

    def parameters(self) -> ProjectionParameters:
        """Gain, slope, inertia."""
        return ProjectionParameters(self.gain_per_s, self.slope, as_symmetric(self.inertia_kg_m2))
