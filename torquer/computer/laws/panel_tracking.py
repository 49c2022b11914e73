"""Sun pointing by the currents of the solar panels alone: the brightest one, and a difference.

M_ref = k1 delta e3 + k2 e1 x s_max of SDOT's introduction (the law of UKube-1): e1 is the axis to
be turned to the Sun, s_max the normal of the panel with the greatest current, delta the difference
of the currents of the panels on both sides of e1, across e3. The coils make what of M_ref lies
across the field. Nothing brakes: B-dot works alongside it.

Six panels, on both sides of e1, e2 = e3 x e1 and e3; their currents follow the cosine law, here of
the direction that the Sun sensors read. The text has the norm of the difference; one without a sign
would push the axis past the Sun on one side, so that the difference is meant (it is s.e2).

While the panel on e1 is the brightest, delta alone works, about e3: the angle of the Sun out of the
plane of e1 and e2 is not controlled until it exceeds 45 deg.
"""

import math
from typing import ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from torquer.base.spec import unit_vector
from torquer.compile.engine import inlined, kernel
from torquer.computer.blocks.parameters import UnitNumbers
from torquer.computer.laws.law_spec import LawSpec
from torquer.computer.laws.sun_cross import dipole_for
from torquer.maths.geometry.vec3 import add_scaled, cross, dot, scale


class PanelTrackingParameters(NamedTuple):
    """Gains k1 and k2 [N m], axes e1 and e3 in the body."""

    difference: float
    brightest: float
    e1: UnitNumbers
    e3: UnitNumbers


@inlined
def panel_torque(parameters, sun):
    """k1 delta e3 + k2 e1 x s_max [N m]; of panels equally bright, one on e1 or else on e2."""
    p = parameters
    e2 = cross(p.e3, p.e1)
    along, s2, s3 = dot(sun, p.e1), dot(sun, e2), dot(sun, p.e3)
    wanted = scale(p.difference * s2, p.e3)
    greatest = max(abs(along), abs(s2), abs(s3))
    if abs(along) == greatest:
        return wanted
    if abs(s2) == greatest:  # e1 x e2 = e3
        return add_scaled(wanted, math.copysign(p.brightest, s2), p.e3)
    return add_scaled(wanted, -math.copysign(p.brightest, s3), e2)  # e1 x e3 = -e2


@kernel
def panel_tracking(inputs, parameters, memory):
    """m = B x M/B^2, M by the panels' currents; off without the Sun."""
    return dipole_for(panel_torque(parameters, inputs.sun_body), inputs.b_body_t)


class PanelTracking(LawSpec):
    """Sun pointing by the currents of six solar panels."""

    kind: Literal["panel_tracking"] = "panel_tracking"
    kernel: ClassVar = panel_tracking
    needs: ClassVar = frozenset({"magnetometer", "sun"})
    difference_gain_n_m: float = Field(gt=0.0)
    """Torque k1 at the difference of the currents of a panel that faces the Sun."""
    brightest_gain_n_m: float = Field(gt=0.0)
    """Torque k2 towards the brightest panel, while that is none on the axis."""
    axis: unit_vector("axis") = (0.0, 0.0, 1.0)
    """Axis e1 in the body to be turned to the Sun."""
    turning_axis: unit_vector("turning_axis") = (1.0, 0.0, 0.0)
    """Axis e3 at right angles to `axis`, about which the difference of the currents on both sides
    turns it.
    """

    @model_validator(mode="after")
    def _axes_at_right_angles(self):
        if abs(np.dot(self.turning_axis, self.axis)) > 1e-9:
            raise ValueError(
                f"turning_axis: must be at right angles to the axis {list(self.axis)}; "
                f"received {list(self.turning_axis)}"
            )
        return self

    def parameters(self) -> PanelTrackingParameters:
        """Gains and axes."""
        return PanelTrackingParameters(
            self.difference_gain_n_m, self.brightest_gain_n_m, self.axis, self.turning_axis
        )
