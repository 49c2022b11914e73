"""The attitude motion of a body: what an integrator advances."""

from typing import NamedTuple


class Motion(NamedTuple):
    """Attitude quaternion (body to inertial) and absolute angular velocity [rad/s] in the body."""

    q: tuple
    omega: tuple
