"""What the averaged motion of a law assumes of a case: limits that the case itself is held to."""

import math

from torquer.theory.validity import Limit

OF = "averaged motion of a law"
TABLE = "`tests/theory/averaged/test_where_it_holds.py`: 60 cases inside, at and beyond the bounds"

SYMMETRIC = Limit(
    "difference of the moments across the axis, over their mean", most=0.2,
    why="their mean is used", of=OF, shown=TABLE,
)  # fmt: skip
SPINS = Limit(
    "nutation at the start [deg]", most=math.degrees(0.15),
    why="reorientation assumes a spin about the axis", of="reorientation",
    shown="averages of the law itself: the direction's rate is off by a tenth",
)  # fmt: skip
WITHIN_LIMITS = Limit(
    "commanded dipole over the coils' limit", most=1.0,
    why="saturated coils act more slowly", of=OF, shown="the definition of saturation",
)  # fmt: skip
CIRCULAR = Limit(
    "eccentricity", most=0.1, why="the orbit is taken for a circle", of=OF,
    shown="the mean of 1/r^6 over an orbit: a circle's times 1 + 7.5 e^2",
)  # fmt: skip
TO_CONE_AXIS = Limit(
    "angle of the target to the cone axis [deg]", most=1.0,
    why="the answer is for a target along the cone axis", of="preliminary reorientation",
    shown="the equations, which are closed for that target alone",
)  # fmt: skip
#: Those of the assumptions that true motions do without.
FLOWN_TOO = (SYMMETRIC, SPINS)
