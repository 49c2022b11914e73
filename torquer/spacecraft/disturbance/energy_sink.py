"""Energy sink: liquid or a flexible part that takes energy from a nutation, and no momentum."""

from typing import NamedTuple

import numpy as np
from pydantic import Field

from torquer.base.spec import Spec, damping_tensor, symmetric_tensor
from torquer.compile.engine import inlined
from torquer.maths.geometry.vec3 import add, as_symmetric, as_vector, cross, sym_vec


class Sink(NamedTuple):
    """Constants for kernels, symmetric matrices as `sym_vec` takes them; `is_on`: 1, or 0.

    `damping`: K = I_d tau [kg m^2 s]; `momentum`: fixed wheels' [N m s, body].
    """

    is_on: float
    damping: tuple
    inertia: tuple
    inverse_inertia: tuple
    momentum: tuple


NO_SINK = Sink(0.0, (0.0,) * 6, (0.0,) * 6, (0.0,) * 6, (0.0,) * 3)


@inlined
def energy_sink_torque(sink, local_body, omega_body):
    """Torque [N m, body] of a damper that follows the body at once: -(J^-1 K w') x (J w + h).

    A sphere of inertia I_d, of the body's J, turns in it against c times its relative rate d:
    I_d (w' + d' + w x d) = -c d. Where tau = I_d/c is short, d = -tau w', so that the momentum is
    J w + h - K w' with K = I_d tau. With the rate W of a rigid body of the same momentum,
    J W = J w - K w', the momentum's law H' = -w x H is J W' = -W x H - (J^-1 K W') x H. This omega
    is W; W' is that of the free motion. It keeps |H| and takes the energy W'.K W' a second: the
    energy sink of P. Likins, 'Attitude stability criteria for dual spin spacecraft' (1967).
    """
    if sink.is_on == 0.0:
        return (0.0, 0.0, 0.0)
    momentum = add(sym_vec(sink.inertia, omega_body), sink.momentum)
    free = sym_vec(sink.inverse_inertia, cross(momentum, omega_body))
    ahead = sym_vec(sink.inverse_inertia, sym_vec(sink.damping, free))
    return cross(momentum, ahead)


_KEY = "damper_kg_m2"


class EnergySink(Spec):
    """Internal damping: a slug of liquid or a flexible part that follows the body a little late.

    It turns energy of a nutation into heat and leaves the angular momentum as it is. A spin about
    any axis but that of the greatest inertia dies away, and the body falls over to that one. Take a
    body with J about its spin axis and J_t across. The tangent of the angle between the axis and
    the momentum H changes as exp(-t/T), with 1/T = I_d tau H^2 (J - J_t)/(J_t^3 J): it grows
    where J is the smaller. Valid where the nutation's rate times `time_constant_s` is far below 1
    and the damper's inertia far below the body's. The damper does not feel other torques.
    """

    damper_kg_m2: damping_tensor(_KEY, "damper")
    """Inertia I_d of what moves, which `spacecraft.body` contains: one number, three (about the
    body axes) or 3x3."""
    time_constant_s: float = Field(gt=0.0)
    """Time constant tau in which it takes up the body's rate."""

    def damper(self) -> np.ndarray:
        """Inertia I_d (3, 3) [kg m^2]."""
        return symmetric_tensor(_KEY, self.damper_kg_m2)

    def damping(self) -> np.ndarray:
        """K = I_d tau (3, 3) [kg m^2 s]."""
        return self.time_constant_s * self.damper()

    def pack(self, parts, body) -> Sink:
        """Constants for kernels; the body's `parts` do not matter."""
        inertia = np.array(body.inertia)
        return Sink(
            1.0,
            as_symmetric(self.damping()),
            as_symmetric(inertia),
            as_symmetric(np.linalg.inv(inertia)),
            as_vector(body.wheel_momentum_n_m_s),
        )
