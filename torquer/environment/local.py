"""The environment at one instant, as it acts on the body."""

from typing import NamedTuple

from torquer.compile.engine import inlined
from torquer.maths.geometry.quaternion import rotate_inverse


class LocalEnvironment(NamedTuple):
    """What acts on the body at one instant; vectors in the inertial frame.

    `b_t`: field [T]; `gravity_gradient`: the radius vector with the length sqrt(3 mu/r^3) [1/s];
    `flow`: velocity relative to the air times the root of its density [sqrt(Pa)], () without air;
    `light`: the direction to the Sun with the length of the pressure of its light [Pa], zero in the
    umbra; `orbit_angle`: one number, the argument of latitude at the start, and on by the mean
    orbital rate, not reduced [rad]; both () where no torque asks.
    """

    b_t: tuple
    gravity_gradient: tuple
    flow: tuple
    light: tuple = ()
    orbit_angle: tuple = ()


@inlined
def _turn(q, v_inertial):
    if len(v_inertial) == 0:
        return ()
    return rotate_inverse(q, v_inertial)


@inlined
def in_body(local, q):
    """This environment with its vectors in body axes, for an attitude (body to inertial)."""
    return LocalEnvironment(
        rotate_inverse(q, local.b_t),
        rotate_inverse(q, local.gravity_gradient),
        _turn(q, local.flow),
        _turn(q, local.light),
        local.orbit_angle,
    )
