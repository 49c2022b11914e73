"""Trim of the residual dipole: estimate it from the motion, and ask the coils for its opposite.

The dipole m_r is constant in the body, and an attitude held by coils alone gives way to it. The
momentum J w of the body, turned to the inertial frame, changes by the torques that the law knows
(the coils' dipole in the field that is read, gravity's gradient) and by m_r x B. An observer
follows the momentum; h, by which it is behind, shows the dipole:

    h' = (m_r - m) x B - l h,  m' = l/(T B^2) B x h,  l = 16/T

with the estimate m. V = |m_r - m|^2 + l/(T B^2) |h|^2 falls in any motion and under any law whose
dipole is known, as long as B does not fall at a rate above l; both errors end where the field
turns in the body. In the mean over an orbit m_r - m falls at the rate <1 - b b^T>/T, b along B.

The law asks for -m: it stands among `control.laws` beside the one that holds, and their dipoles are
added. Its gradient law is that of adaptive observers: Narendra and Annaswamy, "Stable adaptive
systems", Prentice Hall (1989). A Kalman filter with the dipole among its states does the same:
Inamori, Sako and Nakasuka, "Magnetic dipole moment estimation and compensation for an accurate
attitude control in nano-satellite missions", Acta Astronautica 68 (2011) 2038-2046.
"""

from typing import ClassVar, Literal, NamedTuple

from pydantic import Field

from torquer.base.spec import Inertia
from torquer.compile.engine import inlined, kernel
from torquer.computer.blocks.parameters import InertiaNumbers
from torquer.computer.informed import PLACE
from torquer.computer.laws.law_spec import LawSpec
from torquer.computer.laws.wheel_lyapunov import known_gravity_torque
from torquer.maths.geometry.quaternion import rotate, rotate_inverse
from torquer.maths.geometry.vec3 import (
    add,
    add_scaled,
    as_symmetric,
    cross,
    dot,
    is_finite,
    norm,
    put_vector,
    read_vector,
    scale,
    sub,
    sym_vec,
)

_ZERO = (0.0, 0.0, 0.0)
#: l T: the observer follows the momentum in this part of the time in which the estimate settles. It
#: must be fast against the turning of the field, twice an orbit.
FILTERS_IN_TIME = 16.0


class DipoleTrimParameters(NamedTuple):
    """J, T [s], greatest estimate [A m^2], part of the time in which the coils act."""

    inertia: InertiaNumbers
    time_s: float
    most: float
    coil_duty: float


@inlined
def within_length(v, most):
    """A vector as it is, or where it is longer than `most` one of this length along it."""
    size = norm(v)
    return scale(most / size, v) if size > most else v


@inlined
def _observe(inputs, p, memory, momentum, dt):
    """Follow the momentum (inertial) over dt seconds, and correct the dipole."""
    q, b = inputs.estimate.q_body_to_inertial, inputs.b_body_t
    square = dot(b, b)
    m, part = read_vector(memory.residual_dipole_a_m2), dt / p.time_s
    torque = cross(add(m, inputs.coil_dipole_body_a_m2), b)
    torque = add(torque, known_gravity_torque(inputs, p.inertia))
    foreseen = add_scaled(read_vector(memory.momentum_n_m_s), dt, rotate(q, torque))
    behind = sub(momentum, foreseen)
    # implicit steps: stable however long they are against T
    filtered = FILTERS_IN_TIME * part / (1.0 + FILTERS_IN_TIME * part)
    followed = add_scaled(foreseen, filtered, behind)
    gain = filtered * part / ((1.0 + part) * dt * square) if square > 0.0 else 0.0
    m = within_length(add_scaled(m, gain, cross(b, rotate_inverse(q, behind))), p.most)
    if is_finite(add(m, followed)):
        put_vector(memory.momentum_n_m_s, followed)
        put_vector(memory.residual_dipole_a_m2, m)


@kernel
def dipole_trim(inputs, parameters, memory):
    """m = -(estimate of the residual dipole)/duty, by the body's momentum since the last call.

    An interval in which the momentum would be forgotten is a gap: the law has rested in a mode, or
    lacked a reading. The estimate is kept, and the momentum is followed anew.
    """
    p, dt = parameters, inputs.t_s - memory.t_s
    q, omega = inputs.estimate.q_body_to_inertial, inputs.estimate.omega_body_rad_s
    momentum = rotate(q, sym_vec(p.inertia, omega))
    if memory.has_call == 0.0 or dt < 0.0 or FILTERS_IN_TIME * dt > p.time_s:
        put_vector(memory.momentum_n_m_s, momentum)
    elif dt > 0.0:
        _observe(inputs, p, memory, momentum, dt)
    memory.has_call, memory.t_s = 1.0, inputs.t_s
    return scale(-1.0 / p.coil_duty, read_vector(memory.residual_dipole_a_m2))


class DipoleTrim(LawSpec):
    """Trim of the residual dipole, beside a law of the coils; for a satellite without wheels."""

    kind: Literal["dipole_trim"] = "dipole_trim"
    kernel: ClassVar = dipole_trim
    memory: ClassVar = {
        "residual_dipole_a_m2": _ZERO, "has_call": 0.0, "t_s": 0.0, "momentum_n_m_s": _ZERO,
    }  # fmt: skip
    log: ClassVar = {"residual_dipole_a_m2": "A m^2"}
    needs: ClassVar = PLACE | {"magnetometer", "attitude", "rate", "coil_dipole"}
    inertia_kg_m2: Inertia
    """Inertia of the body as the law knows it: three moments or 3x3."""
    time_constant_s: float = Field(gt=0.0)
    """Time T in which the estimate approaches a dipole across the field: about a quarter of a
    revolution. It must be more than 16 times the longest interval between control steps.
    """
    greatest_dipole_a_m2: float = Field(gt=0.0)
    """Greatest length of the estimate: what the coils can give beside what the hold asks for."""
    coil_duty: float = Field(default=1.0, gt=0.0, le=1.0)
    """Part of the time in which the coils act: `actuate_s` over the whole cycle."""

    def parameters(self) -> DipoleTrimParameters:
        """Inertia, time, limit, duty."""
        known = as_symmetric(self.inertia_kg_m2)
        most = self.greatest_dipole_a_m2
        return DipoleTrimParameters(known, self.time_constant_s, most, self.coil_duty)
