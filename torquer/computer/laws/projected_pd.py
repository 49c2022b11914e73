"""Three-axis attitude by magnetorquers alone: what coils can make of a spring and a damper.

A spring and a damper ask for a torque; the coils give its part across the field, whatever the
field's strength. Lovera and Astolfi show that the attitude is reached from almost everywhere if the
gains are low enough: "Spacecraft attitude control using magnetic actuators", Automatica 40 (2004)
1405-1414; in the orbital frame under gravity gradient, IEEE Trans. Aerospace and Electronic Systems
42 (2006) 796-805. There the gains are e^2 k_p and e k_v with a small e, and the inverse of the mean
of 1 - b b^T, b along the field, may weight the torque: in the mean the coils then give the whole
of it.
"""

from typing import ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field, field_validator

from torquer.compile.engine import kernel
from torquer.computer.blocks.parameters import AnyNumbers, OnOff, UnitNumbers
from torquer.computer.laws.periodic_gains import Matrix
from torquer.computer.laws.pointing import HeldAttitude, deviation, reference_motion, short_way
from torquer.maths.geometry.quaternion import rotate, rotate_inverse
from torquer.maths.geometry.vec3 import add, as_matrix, cross, dot, mat_vec, scale

_ONE = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class ProjectedPdParameters(NamedTuple):
    """k_v, k_p, weight (3x3), 1 for an orbital reference, wanted attitude to it (quaternion)."""

    rate_gain: float
    angle_gain: float
    weight: AnyNumbers
    orbital: OnOff
    q_wanted: UnitNumbers


@kernel
def projected_pd(inputs, parameters, memory):
    """m = (B x u)/B^2, u = -W (k_p e + k_v w): the torque is u less its part along B.

    e: vector part of the turn from the wanted attitude, the short way round (half the turn vector
    where it is small); w the rate relative to the reference; W in the wanted attitude's axes.
    Without a field no dipole. Lovera and Astolfi take e from one of the two quaternions of the
    turn; a sensor may read either.
    """
    p, b = parameters, inputs.b_body_t
    square = dot(b, b)
    if square == 0.0:
        return (0.0, 0.0, 0.0)
    q_reference, turning = reference_motion(inputs, p.orbital)
    error, omega = deviation(inputs, p.q_wanted, q_reference, turning)
    turn, relative = rotate(error, short_way(error)), rotate(error, omega)
    asked = mat_vec(p.weight, add(scale(p.angle_gain, turn), scale(p.rate_gain, relative)))
    return scale(-1.0 / square, cross(b, rotate_inverse(error, asked)))


class ProjectedPd(HeldAttitude):
    """Three-axis attitude by the part of a PD torque across the field."""

    kind: Literal["projected_pd"] = "projected_pd"
    kernel: ClassVar = projected_pd
    rate_gain_n_m_s: float = Field(gt=0.0)
    """Gain k_v of the rate."""
    angle_gain_n_m: float = Field(ge=0.0)
    """Gain k_p of the angle: twice the torque per radian of a small turn."""
    mean_projection: Matrix = _ONE
    """Mean of 1 - b b^T along the orbit, b a unit vector along the field, in the axes of the wanted
    attitude (`torquer.theory.mean_projection`): the torque is weighted by its inverse; left out, it
    is not.
    """

    @field_validator("mean_projection")
    @classmethod
    def _positive_definite(cls, rows):
        matrix = np.array(rows)
        values = np.linalg.eigvalsh(matrix)
        if not (np.allclose(matrix, matrix.T, atol=1e-9) and values[0] > 1e-6):
            raise ValueError(
                "must be symmetric and positive definite, with eigenvalues above 1e-6; received "
                f"{matrix.tolist()}"
            )
        return rows

    def parameters(self) -> ProjectedPdParameters:
        """Gains, weight, wanted attitude."""
        gains = self.rate_gain_n_m_s, self.angle_gain_n_m
        weight = as_matrix(np.linalg.inv(np.array(self.mean_projection)))
        return ProjectedPdParameters(*gains, weight, float(self.orbital), self.q_wanted())
