"""The stages of Dormand-Prince 5(4), written out for motions in registers: for slow motion.

The stages are evaluated by the caller, as those of `dop853_stages`: `k0` at x, `k1` at
`stage_1(x, h, k0)` and time `C[1]` of the step, ..., `k6` at `sum_5` and the end of the step.
"""

from torquer.compile.engine import inlined
from torquer.maths.geometry.motion import Motion
from torquer.maths.integrate.rk4 import advance

#: Times of the stages within a step.
C = (0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0, 1.0)
_ZERO = Motion((0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@inlined
def stage_1(x, h, k0):
    """Where stage 1 is evaluated."""
    return advance(x, h * (1.0 / 5.0), k0)


@inlined
def stage_2(x, h, k0, k1):
    """Where stage 2 is evaluated."""
    y = advance(x, h * (3.0 / 40.0), k0)
    return advance(y, h * (9.0 / 40.0), k1)


@inlined
def stage_3(x, h, k0, k1, k2):
    """Where stage 3 is evaluated."""
    y = advance(x, h * (44.0 / 45.0), k0)
    y = advance(y, h * (-56.0 / 15.0), k1)
    return advance(y, h * (32.0 / 9.0), k2)


@inlined
def stage_4(x, h, k0, k1, k2, k3):
    """Where stage 4 is evaluated."""
    y = advance(x, h * (19372.0 / 6561.0), k0)
    y = advance(y, h * (-25360.0 / 2187.0), k1)
    y = advance(y, h * (64448.0 / 6561.0), k2)
    return advance(y, h * (-212.0 / 729.0), k3)


@inlined
def stage_5(x, h, k0, k1, k2, k3, k4):
    """Where stage 5 is evaluated."""
    y = advance(x, h * (9017.0 / 3168.0), k0)
    y = advance(y, h * (-355.0 / 33.0), k1)
    y = advance(y, h * (46732.0 / 5247.0), k2)
    y = advance(y, h * (49.0 / 176.0), k3)
    return advance(y, h * (-5103.0 / 18656.0), k4)


@inlined
def sum_5(x, h, k0, k2, k3, k4, k5):
    """Motion after the step, of order 5; the length of q is not set back."""
    y = advance(x, h * (35.0 / 384.0), k0)
    y = advance(y, h * (500.0 / 1113.0), k2)
    y = advance(y, h * (125.0 / 192.0), k3)
    y = advance(y, h * (-2187.0 / 6784.0), k4)
    return advance(y, h * (11.0 / 84.0), k5)


@inlined
def error_4(h, k0, k2, k3, k4, k5, k6):
    """The motions of orders 5 and 4 after the step, one less the other."""
    y = advance(_ZERO, h * (71.0 / 57600.0), k0)
    y = advance(y, h * (-71.0 / 16695.0), k2)
    y = advance(y, h * (71.0 / 1920.0), k3)
    y = advance(y, h * (-17253.0 / 339200.0), k4)
    y = advance(y, h * (22.0 / 525.0), k5)
    return advance(y, h * (-1.0 / 40.0), k6)
