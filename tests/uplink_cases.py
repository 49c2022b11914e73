"""A calm Chibis-M for tests of what the ground sends up: soon in science mode; its elements."""

import numpy as np
from onboard_ground import scenario

from torquer.maths.geometry.quaternion import angle_between

#: Elements of about the orbit of the example, and of a place 3 deg ahead on it.
TLE = (
    "1 00001U          12064.43873843  .00000000  00000-0  00000+0 0    06",
    "2 00001  51.7752 324.8824 0000000 274.3043  85.6546 15.21896588    01",
)
AHEAD = (TLE[0], "2 00001  51.7752 324.8824 0000000 274.3043  88.6546 15.21896588    04")
#: Of another satellite: its orbit has another plane.
OTHER = (
    "1 25544U 98067A   12064.50000000  .00016717  00000-0  10270-3 0  9005",
    "2 25544  51.6400 100.0000 0007000  10.0000  50.0000 15.50000000    14",
)
#: From then on [s] it holds its attitude.
SCIENCE_S = 1100


def calm(duration_s=1500.0, **keys):
    """The example, which has been left almost at rest by the launcher."""
    start = {"initial__euler_deg": (10.0, -10.0, 10.0), "initial__rate_deg_s": (0.0, -0.06, 0.0)}
    return scenario(duration_s, **(start | keys))


def in_bytes(elements):
    """Two lines as a command has them."""
    return tuple(line.encode() for line in elements)


def errors_deg(result, truth=None):
    """Angles [deg] between estimated and true attitude of a flight at its records."""
    truth = result if truth is None else truth
    q, own = (r[n].values for r, n in ((result, "q_estimated"), (truth, "q_body_to_inertial")))
    return np.degrees(angle_between(q, own))
