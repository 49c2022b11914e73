"""Disturbance torque in body axes: a constant one, and a random one held for an interval."""

from typing import NamedTuple

from pydantic import Field

from torquer import noise
from torquer.engine import inlined
from torquer.geometry.vec3 import add_scaled, as_vector
from torquer.spec import Spec, Vector

STREAM = 6


class DisturbanceTorque(NamedTuple):
    """Constants of the disturbance torque for kernels; the random part is held `hold_steps`."""

    constant_n_m: tuple
    random_n_m: float
    hold_steps: int


@inlined
def disturbance_torque_at(disturbance, step, seed):
    """Torque [N m, body] during a step; () for a satellite that nothing disturbs.

    An empty tuple is a type of its own: zeros cost 5 to 9 ns of the 68 of an RK4 step.
    """
    if len(disturbance) == 0:
        return ()
    drawn = noise.normal3(seed, STREAM, step // disturbance.hold_steps)
    return add_scaled(disturbance.constant_n_m, disturbance.random_n_m, drawn)


class Disturbance(Spec):
    """Disturbance torque fixed in the body.

    `constant_torque_n_m`: always there. `random_torque_n_m`: standard deviation about each axis
    of a torque drawn anew every `random_hold_s` (left out: every `control.sample_s`). What a random
    torque does depends on how long it is held: its spectral density is sigma^2 times that interval.
    """

    constant_torque_n_m: Vector = (0.0, 0.0, 0.0)
    random_torque_n_m: float = Field(default=0.0, ge=0.0)
    random_hold_s: float | None = Field(default=None, gt=0.0)

    def pack(self, hold_steps: int) -> DisturbanceTorque:
        """Constants for kernels."""
        constant = as_vector(self.constant_torque_n_m)
        return DisturbanceTorque(constant, self.random_torque_n_m, hold_steps)
