"""The environment at one instant, as it acts on the body."""

from typing import NamedTuple


class LocalEnvironment(NamedTuple):
    """What acts on the body at one instant; vectors in the inertial frame.

    `b_t`: field [T]; `gravity_gradient`: the radius vector with the length sqrt(3 mu/r^3) [1/s];
    `flow`: velocity relative to the air times the root of its density [sqrt(Pa)], () without air.
    """

    b_t: tuple
    gravity_gradient: tuple
    flow: tuple
