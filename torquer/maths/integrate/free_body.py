"""Exact free rotation of a rigid body: Jacobi elliptic functions and one smooth quadrature.

The rates follow from the addition theorems of sn, cn, dn, so no inverse function is needed.
The attitude is q = q_L (turn by psi about a) (shortest turn of L to the axis a), where a is
the principal axis about which the momentum circulates; psi' = omega.(a + l)/(1 + a.l) with
l = L/|L| in the body, which is a constant plus another one over 1 + a.l. Differences are written
as sums of positive terms wherever they could cancel, so spheres, axisymmetric bodies, pure
spins and the neighbourhood of the separatrix need no special treatment but one.
"""

import math

from torquer.compile.engine import kernel
from torquer.maths.geometry.quaternion import from_rotation_vector, multiply, normalise
from torquer.maths.geometry.vec3 import cross, dot, norm, scale

#: Nodes and weights of the six-point Gauss-Legendre rule on [0, 1].
_NODES = (
    0.033765242898423975,
    0.16939530676686776,
    0.38069040695840156,
    0.6193095930415985,
    0.8306046932331322,
    0.966234757101576,
)
_WEIGHTS = (
    0.0856622461895852,
    0.18038078652406933,
    0.23395696728634552,
    0.23395696728634552,
    0.18038078652406933,
    0.0856622461895852,
)
#: Beyond this argument sech is held, so that its square does not vanish.
_FAR = 350.0
#: Below this angular momentum [N m s] a body counts as at rest: squares would vanish.
_AT_REST = 1e-150
#: Longest panel of the quadrature in the argument of sn; the nearest pole lies pi/2 away.
_PANEL = 0.5


@kernel
def _landen(u, k):
    """(sn, cn, dn)(u | 1 - k^2): k goes to one within ten levels or so."""
    if not k < 1.0 - 4e-16:  # one to rounding (or not a number)
        return math.sin(u), math.cos(u), 1.0
    s, c, d = _landen(0.5 * (1.0 + k) * u, 2.0 * math.sqrt(k) / (1.0 + k))
    modulus, rest = (1.0 - k) / (1.0 + k), 2.0 * k / (1.0 + k)  # their sum is one
    part = modulus * s * s
    w = 1.0 / (1.0 + part)
    left = 1.0 - part if part < 0.5 else c * c + rest * s * s  # keeps the digits of both ends
    return (1.0 + modulus) * s * w, c * d * w, left * w


@kernel
def jacobi_elliptic(u, m_complement):
    """(sn, cn, dn)(u | m) for m = 1 - m_complement in [0, 1], by Landen transformations.

    The complement is the argument, because it is what decides near the separatrix.
    """
    if m_complement <= 0.0:
        c = 1.0 / math.cosh(min(abs(u), _FAR))
        return math.tanh(u), c, c
    return _landen(u, math.sqrt(min(m_complement, 1.0)))


@kernel
def _excess(moments, omega):
    """L^2 - 2 E I1."""
    (i1, i2, i3), (_, w2, w3) = moments, omega
    return i2 * (i2 - i1) * w2 * w2 + i3 * (i3 - i1) * w3 * w3


@kernel
def _frequency(moments, omega):
    """Growth [1/s] of the argument of sn, cn, dn in circulation about the third axis."""
    i1, i2, i3 = moments
    return math.sqrt((i3 - i2) * _excess(moments, omega) / (i1 * i2 * i3))


@kernel
def _circulating_rates(moments, omega, t):
    """Rates [rad/s] after t seconds when the momentum circulates about the third axis.

    Also right with all axes in the reverse order: the mirror image runs by the same formulas,
    because both the signs of the differences and the handedness turn. Addition theorems of sn, cn,
    dn with the amplitudes cancelled: a vanishing amplitude (pure spin) does no harm.
    """
    (i1, i2, i3), (w1, w2, w3) = moments, omega
    excess = _excess(moments, omega)
    if (i3 - i2) * excess == 0.0:
        return omega  # the momentum lies along a principal axis of a symmetric body
    complement = (i3 - i1) * (i3 * (i3 - i2) * w3 * w3 - i1 * (i2 - i1) * w1 * w1)
    complement = complement / ((i3 - i2) * excess)
    ratio = math.sqrt(i1 * (i3 - i1) / (i2 * (i3 - i2)))  # amplitude of w2 over that of w1
    top = math.copysign(math.sqrt(excess / (i3 * (i3 - i1))), w3)  # amplitude of w3
    m_scaled = (i2 - i1) * i2 / excess  # m over the squared amplitude of w2
    sense, dn0 = math.copysign(1.0, w3), w3 / top
    sn, cn, dn = jacobi_elliptic(_frequency(moments, omega) * t, complement)
    s = 1.0 / (cn * cn + sn * sn * dn0 * dn0)  # 1 - m sn0^2 sn^2
    return (
        s * (w1 * cn - sense * w2 / ratio * sn * dn * dn0),
        s * (w2 * cn * dn + sense * ratio * w1 * sn * dn0),
        s * top * (dn0 * dn - sense * m_scaled * ratio * w1 * w2 * sn * cn),
    )


@kernel
def _circulates_about_third(moments, omega):
    i1, i2, i3 = moments
    return i3 * (i3 - i2) * omega[2] * omega[2] >= i1 * (i2 - i1) * omega[0] * omega[0]


@kernel
def free_rates(moments, omega, t):
    """Rates [rad/s] in ascending principal axes after t seconds without torque."""
    if _circulates_about_third(moments, omega):
        return _circulating_rates(moments, omega, t)
    (i1, i2, i3), (w1, w2, w3) = moments, omega
    w3, w2, w1 = _circulating_rates((i3, i2, i1), (w3, w2, w1), t)
    return (w1, w2, w3)


@kernel
def _momentum(moments, omega):
    return (moments[0] * omega[0], moments[1] * omega[1], moments[2] * omega[2])


@kernel
def _shortest_turn(a, b):
    """Quaternion of the shortest turn of the unit vector a to the unit vector b (not opposite)."""
    n = cross(a, b)
    return normalise((n[0], n[1], n[2], 1.0 + dot(a, b)))


@kernel
def _twist(moments, omega, t):
    """Integral of psi' over t seconds when the momentum circulates about the third axis.

    psi' = L/I3 + excess/(1 + |l3|), where the excess vanishes for a pure spin. Compensated sum.
    """
    (i1, i2, i3), (w1, w2, _) = moments, omega
    size = norm(_momentum(moments, omega))
    excess = (i1 * (i3 - i1) * w1 * w1 + i2 * (i3 - i2) * w2 * w2) / (size * i3)
    panels = int(abs(t) * _frequency(moments, omega) / _PANEL) + 1
    h = t / panels
    total = lost = 0.0
    for panel in range(panels):
        for node in range(6):
            w = _circulating_rates(moments, omega, h * (panel + _NODES[node]))
            part = _WEIGHTS[node] * size / (size + i3 * abs(w[2])) - lost
            grown = total + part
            lost = (grown - total) - part
            total = grown
    return t * size / i3 + excess * h * total


@kernel
def free_rotation(moments, q, omega, t):
    """Attitude and rates after t seconds of torque-free motion, to rounding.

    `moments` are the principal moments of inertia [kg m^2] in ascending order, q the attitude
    of the principal axes (to inertial), omega their absolute rate [rad/s].
    """
    start = _momentum(moments, omega)
    size = norm(start)
    if not _AT_REST <= size < math.inf:  # at rest, or not a number: not to be made worse
        return q, omega
    start = scale(1.0 / size, start)
    ahead = free_rates(moments, omega, t)
    end = scale(1.0 / size, _momentum(moments, ahead))
    if _circulates_about_third(moments, omega):
        axis = (0.0, 0.0, math.copysign(1.0, start[2]))
        psi = _twist(moments, omega, t)
    else:
        (i1, i2, i3), (w1, w2, w3) = moments, omega
        axis = (math.copysign(1.0, start[0]), 0.0, 0.0)
        psi = _twist((i3, i2, i1), (w3, w2, w1), t)
    turn = from_rotation_vector(scale(psi, axis))
    to_axis = _shortest_turn(end, axis)
    from_axis = _shortest_turn(axis, start)
    return normalise(multiply(q, multiply(from_axis, multiply(turn, to_axis)))), ahead
