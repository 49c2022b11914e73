"""The stages of a scheme in plain Python, by its own rules; a twin of the mode table it becomes."""

import math

import numpy as np
from scipy.spatial.transform import Rotation

_ROUNDING_S = 1e-6


class SchemeTwin:
    """Stage (from 1; one more than there are: done) after each reading.

    A stage's conditions are looked at from the reading after its first one on.
    """

    def __init__(self, scheme):
        self.scheme, self.stage, self.began_s, self.true_since_s = scheme, 0, 0.0, None

    def __call__(self, known):
        """The stage at these inputs."""
        done = self.stage > len(self.scheme.stages)
        if self.stage == 0 or (not done and self._is_over(known)):
            self.stage += 1
            self.began_s, self.true_since_s = known.t_s, None
        return self.stage

    def _is_over(self, known):
        until = self.scheme.stages[self.stage - 1].until
        if until is None:
            return False
        if not self._conditions_hold(until, known):
            self.true_since_s = None
        elif self.true_since_s is None:
            self.true_since_s = known.t_s
        spent_s = known.t_s - self.began_s
        if until.at_most_s is not None and spent_s >= until.at_most_s - _ROUNDING_S:
            return True
        if self.true_since_s is None or not (until.waits_for_something or until.at_least_s):
            return False
        held = known.t_s - self.true_since_s >= until.for_s - _ROUNDING_S
        return held and spent_s >= (until.at_least_s or 0.0) - _ROUNDING_S

    def _conditions_hold(self, until, known):
        scheme, omega = self.scheme, np.array(known.estimate.omega_body_rad_s)
        axis, momentum = np.array(scheme.axis), np.array(scheme.inertia_kg_m2 or np.eye(3)) @ omega
        target = self._target(known)
        along = axis if axis @ momentum >= 0.0 else -axis
        return (
            is_below(until.nutation_below_deg, along, momentum)
            and is_below(until.axis_to_target_below_deg, axis, target)
            and is_below(until.momentum_to_target_below_deg, momentum, target)
            and (
                until.spin_above_deg_s is None
                or axis @ omega > math.radians(until.spin_above_deg_s)
            )
            and (
                until.rate_below_deg_s is None
                or np.linalg.norm(omega) < math.radians(until.rate_below_deg_s)
            )
        )

    def _target(self, known):
        if self.scheme.target == "sun":
            return np.array(known.sun_body)
        attitude = Rotation.from_quat(known.estimate.q_body_to_inertial)
        return attitude.inv().apply(self.scheme.target or (0.0, 0.0, 1.0))


def is_below(limit_deg, a, b):
    """Whether an angle is below a limit; one with a vector of zeros never is."""
    if limit_deg is None:
        return True
    cosine = math.cos(math.radians(limit_deg))
    return a @ b > cosine * np.linalg.norm(a) * np.linalg.norm(b)
