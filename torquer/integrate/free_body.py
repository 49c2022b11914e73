"""Exact free rotation of a rigid body: Jacobi elliptic functions and one smooth quadrature.

The rates follow from the addition theorems of sn, cn, dn, so no inverse function is needed.
The attitude is q = q_L (turn by psi about a) (shortest turn of L to the axis a), where a is
the principal axis about which the momentum circulates; psi' = omega.(a + l)/(1 + a.l) with
l = L/|L| in the body. All differences are written as sums of positive terms, so spheres,
axisymmetric bodies and pure spins need no special treatment but one.
"""

import math

from torquer.engine import kernel
from torquer.geometry.quaternion import from_rotation_vector, multiply, normalised
from torquer.geometry.vec3 import cross, dot, norm, scale

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
#: Longest panel of the quadrature in the argument of sn; the nearest pole lies pi/2 away.
_PANEL = 0.5


@kernel
def jacobi_elliptic(u, m_complement):
    """(sn, cn, dn)(u | m) for m = 1 - m_complement in [0, 1], by Landen transformations.

    The complement is the argument, because it is what decides near the separatrix.
    """
    if m_complement <= 0.0:
        c = 1.0 / math.cosh(u)
        return math.tanh(u), c, c
    # down to a modulus so small that sn, cn, dn are circular functions, then back up
    k1 = math.sqrt(min(m_complement, 1.0))
    k2 = 2.0 * math.sqrt(k1) / (1.0 + k1)
    k3 = 2.0 * math.sqrt(k2) / (1.0 + k2)
    k4 = 2.0 * math.sqrt(k3) / (1.0 + k3)
    k5 = 2.0 * math.sqrt(k4) / (1.0 + k4)
    k6 = 2.0 * math.sqrt(k5) / (1.0 + k5)
    v = u * (1.0 + k1) * (1.0 + k2) * (1.0 + k3) * (1.0 + k4) * (1.0 + k5) * (1.0 + k6) / 64.0
    s, c, d = math.sin(v), math.cos(v), 1.0
    for k in (k6, k5, k4, k3, k2, k1):
        modulus = (1.0 - k) / (1.0 + k)
        w = 1.0 / (1.0 + modulus * s * s)
        s, c, d = (1.0 + modulus) * s * w, c * d * w, (1.0 - modulus * s * s) * w
    return s, c, d


@kernel
def _circulating_rates(moments, omega, t):
    """Rates [rad/s] after t seconds when the momentum circulates about the third axis.

    Also right with all axes in the reverse order: the mirror image runs by the same formulas,
    because both the signs of the differences and the handedness turn. Addition theorems of sn, cn,
    dn with the amplitudes cancelled: a vanishing amplitude (pure spin) does no harm.
    """
    (i1, i2, i3), (w1, w2, w3) = moments, omega
    excess = i2 * (i2 - i1) * w2 * w2 + i3 * (i3 - i1) * w3 * w3  # L^2 - 2 E I1
    if i3 == i2 or excess == 0.0:
        return omega  # the momentum lies along a principal axis of a symmetric body
    complement = (i3 - i1) * (i3 * (i3 - i2) * w3 * w3 - i1 * (i2 - i1) * w1 * w1)
    complement = complement / ((i3 - i2) * excess)
    frequency = math.sqrt((i3 - i2) * excess / (i1 * i2 * i3))
    ratio = math.sqrt(i1 * (i3 - i1) / (i2 * (i3 - i2)))  # amplitude of w2 over that of w1
    top = math.copysign(math.sqrt(excess / (i3 * (i3 - i1))), w3)  # amplitude of w3
    m_scaled = (i2 - i1) * i2 / excess  # m over the squared amplitude of w2
    sense, dn0 = math.copysign(1.0, w3), w3 / top
    sn, cn, dn = jacobi_elliptic(frequency * t, complement)
    s = 1.0 / (1.0 - m_scaled * w2 * w2 * sn * sn)
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
def _momentum_direction(moments, omega):
    momentum = (moments[0] * omega[0], moments[1] * omega[1], moments[2] * omega[2])
    return scale(1.0 / norm(momentum), momentum)


@kernel
def _shortest_turn(a, b):
    """Quaternion of the shortest turn of the unit vector a to the unit vector b (not opposite)."""
    n = cross(a, b)
    return normalised((n[0], n[1], n[2], 1.0 + dot(a, b)))


@kernel
def _twist(moments, omega, axis, t):
    """Integral of psi' over t seconds, panel by panel."""
    spread = (moments[2] - moments[0]) / moments[0] * norm(omega)  # bounds the frequency of sn
    panels = int(abs(t) * spread / _PANEL) + 1
    h = t / panels
    psi = 0.0
    for panel in range(panels):
        for node in range(6):
            w = free_rates(moments, omega, h * (panel + _NODES[node]))
            along = _momentum_direction(moments, w)
            rate = (dot(w, axis) + dot(w, along)) / (1.0 + dot(axis, along))
            psi += _WEIGHTS[node] * h * rate
    return psi


@kernel
def free_rotation(moments, q, omega, t):
    """Attitude and rates after t seconds of torque-free motion, to rounding.

    `moments` are the principal moments of inertia [kg m^2] in ascending order, q the attitude
    of the principal axes (to inertial), omega their absolute rate [rad/s].
    """
    if dot(omega, omega) == 0.0:
        return q, omega
    start = _momentum_direction(moments, omega)
    if _circulates_about_third(moments, omega):
        axis = (0.0, 0.0, math.copysign(1.0, start[2]))
    else:
        axis = (math.copysign(1.0, start[0]), 0.0, 0.0)
    ahead = free_rates(moments, omega, t)
    end = _momentum_direction(moments, ahead)
    turn = from_rotation_vector(scale(_twist(moments, omega, axis, t), axis))
    to_axis = _shortest_turn(end, axis)
    from_axis = _shortest_turn(axis, start)
    return normalised(multiply(q, multiply(from_axis, multiply(turn, to_axis)))), ahead
