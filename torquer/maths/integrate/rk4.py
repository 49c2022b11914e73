"""Runge-Kutta of order 4 for the attitude motion, with the environment shared between stages.

Two of the four stages lie at the middle of the step and the last one opens the next step, so
a step needs the environment at two new times only.

A fixed step h changes the motion by itself. An oscillation of frequency w shrinks by the factor
|R(i w h)| = 1 - (w h)^6/144 + ..., where R is RK4's polynomial: a fast nutation is damped, though
nothing damps it. An attitude that turns at the rate w lags by 2 (w h/2)^5/120 a step.
"""

import math

from torquer.compile.engine import inlined
from torquer.maths.geometry.motion import Motion
from torquer.maths.geometry.quaternion import normalise
from torquer.maths.geometry.vec3 import add_scaled

#: Turns within one step [rad] beyond which RK4 does not follow: of a nutation (it loses half a
#: per cent of its amplitude in every step), and of the body (it lags by a degree in every step).
MOST_NUTATION, MOST_TURN = 1.0, 2.0


@inlined
def rk4_damping(square, h, steps):
    """What RK4 takes of the logarithm of an amplitude; `square` of the frequency [1/s^2]."""
    z = square * h * h
    return steps * z * z * z / 144.0


@inlined
def rk4_lag(square, h, steps):
    """Phase lag [rad] of a rotation under RK4; `square` of the rate [1/s^2]."""
    z = square * h * h
    return steps * z * z * math.sqrt(z) / 1920.0


@inlined
def advance(x, h, rate):
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
    y = advance(advance(advance(advance(x, h / 6.0, k1), h / 3.0, k2), h / 3.0, k3), h / 6.0, k4)
    return Motion(normalise(y.q), y.omega)
