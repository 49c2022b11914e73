"""The state vector that AOS makes, as the other modules find it in its queue."""

from __future__ import annotations

import math
from typing import NamedTuple

#: Age [s] from which on a state vector is out of date.
OLDEST_S = 10.0


class StateVector(NamedTuple):
    """Estimated attitude and rate; not numbers where they are unknown.

    `t_s`: time of the estimate in the run; quaternions body to orbital frame and body to inertial
    frame, scalar last; rates [rad/s] relative to the orbital frame and absolute, in body axes;
    magnitudes of the first rate [rad/s] and of the vector part of the first quaternion.
    """

    t_s: float
    q_orbital: tuple
    q_inertial: tuple
    omega_orbital_rad_s: tuple
    omega_rad_s: tuple
    rate_rad_s: float
    q_size: float
    sigma_rad: float
    sunlit: bool

    def is_valid(self, t_s: float) -> bool:
        """Whether it is defined and not out of date at a time of the run [s]."""
        return math.isfinite(self.rate_rad_s + self.q_size) and t_s - self.t_s <= OLDEST_S


def newest_state(core) -> StateVector | None:
    """The newest state vector; None without one, or if a module of the user's put there what is
    none."""
    state = core.cdh.newest("state")
    return state if isinstance(state, StateVector) else None
