"""The stages of Dormand-Prince 8(5,3), written out for motions in registers.

The stages are evaluated by the caller, as those of RK4 are: derivative `k0` at x, `k1` at
`stage_1(x, h, k0)` and time `C[1]` of the step, and so on to `k11` at the end of the step. Unrolled
over tuples a stage costs half of one that loops over arrays. `dop853_tableau` has the numbers.

Twelve stages made by the compiler from the tableau were tried instead of these written-out ones:
the bits are the same, but compiling takes 13.6 s instead of 3.5 s and a step 886 ns instead of 647.
"""

from torquer.compile.engine import inlined
from torquer.maths.geometry.motion import Motion
from torquer.maths.integrate import dop853_tableau as tableau
from torquer.maths.integrate.rk4 import advance

#: Times of the stages within a step; rows of the tableau; weights of the sum and of the two
#: error estimates.
C = tuple(map(float, tableau.C))
_A1 = tuple(map(float, tableau.A[1]))
_A2 = tuple(map(float, tableau.A[2]))
_A3 = tuple(map(float, tableau.A[3]))
_A4 = tuple(map(float, tableau.A[4]))
_A5 = tuple(map(float, tableau.A[5]))
_A6 = tuple(map(float, tableau.A[6]))
_A7 = tuple(map(float, tableau.A[7]))
_A8 = tuple(map(float, tableau.A[8]))
_A9 = tuple(map(float, tableau.A[9]))
_A10 = tuple(map(float, tableau.A[10]))
_A11 = tuple(map(float, tableau.A[11]))
_B = tuple(map(float, tableau.B))
_E5, _E3 = tuple(map(float, tableau.ERROR_5)), tuple(map(float, tableau.ERROR_3))
_ZERO = Motion((0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@inlined
def stage_1(x, h, k0):
    """Where stage 1 is evaluated."""
    return advance(x, h * _A1[0], k0)


@inlined
def stage_2(x, h, k0, k1):
    """Where stage 2 is evaluated."""
    y = advance(x, h * _A2[0], k0)
    return advance(y, h * _A2[1], k1)


@inlined
def stage_3(x, h, k0, k2):
    """Where stage 3 is evaluated."""
    y = advance(x, h * _A3[0], k0)
    return advance(y, h * _A3[2], k2)


@inlined
def stage_4(x, h, k0, k2, k3):
    """Where stage 4 is evaluated."""
    y = advance(x, h * _A4[0], k0)
    y = advance(y, h * _A4[2], k2)
    return advance(y, h * _A4[3], k3)


@inlined
def stage_5(x, h, k0, k3, k4):
    """Where stage 5 is evaluated."""
    y = advance(x, h * _A5[0], k0)
    y = advance(y, h * _A5[3], k3)
    return advance(y, h * _A5[4], k4)


@inlined
def stage_6(x, h, k0, k3, k4, k5):
    """Where stage 6 is evaluated."""
    y = advance(x, h * _A6[0], k0)
    y = advance(y, h * _A6[3], k3)
    y = advance(y, h * _A6[4], k4)
    return advance(y, h * _A6[5], k5)


@inlined
def stage_7(x, h, k0, k3, k4, k5, k6):
    """Where stage 7 is evaluated."""
    y = advance(x, h * _A7[0], k0)
    y = advance(y, h * _A7[3], k3)
    y = advance(y, h * _A7[4], k4)
    y = advance(y, h * _A7[5], k5)
    return advance(y, h * _A7[6], k6)


@inlined
def stage_8(x, h, k0, k3, k4, k5, k6, k7):
    """Where stage 8 is evaluated."""
    y = advance(x, h * _A8[0], k0)
    y = advance(y, h * _A8[3], k3)
    y = advance(y, h * _A8[4], k4)
    y = advance(y, h * _A8[5], k5)
    y = advance(y, h * _A8[6], k6)
    return advance(y, h * _A8[7], k7)


@inlined
def stage_9(x, h, k0, k3, k4, k5, k6, k7, k8):
    """Where stage 9 is evaluated."""
    y = advance(x, h * _A9[0], k0)
    y = advance(y, h * _A9[3], k3)
    y = advance(y, h * _A9[4], k4)
    y = advance(y, h * _A9[5], k5)
    y = advance(y, h * _A9[6], k6)
    y = advance(y, h * _A9[7], k7)
    return advance(y, h * _A9[8], k8)


@inlined
def stage_10(x, h, k0, k3, k4, k5, k6, k7, k8, k9):
    """Where stage 10 is evaluated."""
    y = advance(x, h * _A10[0], k0)
    y = advance(y, h * _A10[3], k3)
    y = advance(y, h * _A10[4], k4)
    y = advance(y, h * _A10[5], k5)
    y = advance(y, h * _A10[6], k6)
    y = advance(y, h * _A10[7], k7)
    y = advance(y, h * _A10[8], k8)
    return advance(y, h * _A10[9], k9)


@inlined
def stage_11(x, h, k0, k3, k4, k5, k6, k7, k8, k9, k10):
    """Where stage 11 is evaluated."""
    y = advance(x, h * _A11[0], k0)
    y = advance(y, h * _A11[3], k3)
    y = advance(y, h * _A11[4], k4)
    y = advance(y, h * _A11[5], k5)
    y = advance(y, h * _A11[6], k6)
    y = advance(y, h * _A11[7], k7)
    y = advance(y, h * _A11[8], k8)
    y = advance(y, h * _A11[9], k9)
    return advance(y, h * _A11[10], k10)


@inlined
def sum_8(x, h, k0, k5, k6, k7, k8, k9, k10, k11):
    """Motion after the step; the length of q is not set back."""
    y = advance(x, h * _B[0], k0)
    y = advance(y, h * _B[5], k5)
    y = advance(y, h * _B[6], k6)
    y = advance(y, h * _B[7], k7)
    y = advance(y, h * _B[8], k8)
    y = advance(y, h * _B[9], k9)
    y = advance(y, h * _B[10], k10)
    return advance(y, h * _B[11], k11)


@inlined
def error_5(h, k0, k5, k6, k7, k8, k9, k10, k11):
    """Estimate of order 5."""
    y = advance(_ZERO, h * _E5[0], k0)
    y = advance(y, h * _E5[5], k5)
    y = advance(y, h * _E5[6], k6)
    y = advance(y, h * _E5[7], k7)
    y = advance(y, h * _E5[8], k8)
    y = advance(y, h * _E5[9], k9)
    y = advance(y, h * _E5[10], k10)
    return advance(y, h * _E5[11], k11)


@inlined
def error_3(h, k0, k5, k6, k7, k8, k9, k10, k11):
    """Estimate of order 3."""
    y = advance(_ZERO, h * _E3[0], k0)
    y = advance(y, h * _E3[5], k5)
    y = advance(y, h * _E3[6], k6)
    y = advance(y, h * _E3[7], k7)
    y = advance(y, h * _E3[8], k8)
    y = advance(y, h * _E3[9], k9)
    y = advance(y, h * _E3[10], k10)
    return advance(y, h * _E3[11], k11)
