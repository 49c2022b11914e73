"""Runge-Kutta of order 4 for the attitude motion, with the environment shared between stages.

Two of the four stages lie at the middle of the step and the last one opens the next step, so
a step needs the environment at two new times only.
"""

from typing import NamedTuple

from torquer.engine import inlined
from torquer.geometry.quaternion import normalised
from torquer.geometry.vec3 import add_scaled


class Motion(NamedTuple):
    """Attitude quaternion (body to inertial) and absolute angular velocity [rad/s] in the body."""

    q: tuple
    omega: tuple


@inlined
def moved(x, h, rate):
    """x + h rate for a motion."""
    p, d = x.q, rate.q
    q = (p[0] + h * d[0], p[1] + h * d[1], p[2] + h * d[2], p[3] + h * d[3])
    return Motion(q, add_scaled(x.omega, h, rate.omega))


@inlined
def rk4_sum(x, h, k1, k2, k3, k4):
    """Motion after a step h from the rates at its four stages; |q| is set back to one.

    The stages are evaluated by the caller: k1 at x, k2 at moved(x, h/2, k1), k3 at
    moved(x, h/2, k2), k4 at moved(x, h, k3). (A right-hand side handed over as an argument
    would be called through a pointer, three times slower, and could not be cached.)
    """
    y = moved(moved(moved(moved(x, h / 6.0, k1), h / 3.0, k2), h / 3.0, k3), h / 6.0, k4)
    return Motion(normalised(y.q), y.omega)
