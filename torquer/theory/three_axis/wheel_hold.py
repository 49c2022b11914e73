"""A satellite at the attitude that a law of wheels is to hold: its linear equations.

As `hold`, with a torque M on the body in place of the dipole:

    w' = A x + J^-1 M/n^2 + f,  M = G x + g,

where g is what the law asks for at the wanted attitude (what it knows of the reference's motion and
of gravity). Laws of wheels take on the gyroscopic torque of the wheels' momentum, as read: in the
slopes it cancels, and those of wheels at rest are theirs. What remains of it is in
`effects.Wheels`.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from torquer.theory.three_axis.hold import AttitudeHold
from torquer.theory.three_axis.linearise import Instants


@dataclass(frozen=True)
class WheelHold(AttitudeHold):
    """A law of wheels that holds an attitude, the body, and the environment along its orbit."""

    answers: ClassVar[str] = "torque"

    def gains(self, at: Instants) -> np.ndarray:
        """G `[n, 3, 6]` [N m]: slopes of the law's torque; ValueError if it has none."""
        return self.slopes_and_rest(at)[0]

    def torque_of_answer(self, b_body_t) -> np.ndarray:
        """Torque per unit of what the law asks for `[n, 3, 3]`: a torque is itself."""
        return np.tile(np.eye(3), (len(b_body_t), 1, 1))
