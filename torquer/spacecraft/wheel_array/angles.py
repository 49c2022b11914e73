"""Angles of pyramids in closed form, in degrees: balanced rates, and least momenta of the wheels.

Heights of the pyramids are along x1, body axes are principal axes.
"""

import math

import numpy as np

#: Angle from height to edge at which a regular pyramid has its greatest volume, for any count.
GREATEST_VOLUME_DEG = math.degrees(math.atan(math.sqrt(2.0)))


def balanced_four_sided(inertia_kg_m2) -> tuple[float, float]:
    """(alpha, beta) at which the greatest rates about the three axes are equal.

    cos(alpha), sin(alpha) sin(beta), sin(alpha) cos(beta) are proportional to the moments of
    inertia.
    """
    i1, i2, i3 = inertia_kg_m2
    return math.degrees(math.atan2(math.hypot(i2, i3), i1)), math.degrees(math.atan2(i2, i3))


def balanced_regular(count: int, inertia_kg_m2) -> float:
    """gamma at which the greatest rates about x1 and x2 are equal (one angle equalises two).

    For six wheels tan(gamma) = 3 I2 / (2 I1).
    """
    i1, i2, _ = inertia_kg_m2
    across = np.abs(np.cos(2.0 * math.pi * np.arange(count) / count)).sum()
    return math.degrees(math.atan2(count * i2, across * i1))


def least_four_sided(momentum_n_m_s) -> tuple[float, float]:
    """(alpha, beta) with the least norm of the wheels' momenta, for greatest |H1|, |H2|, |H3|.

    The norm is then (H1 + H2 + H3) / 2. Source: WHEEL (6.10).
    """
    h1, h2, h3 = momentum_n_m_s
    alpha, beta = math.atan(math.sqrt((h2 + h3) / h1)), math.atan(math.sqrt(h2 / h3))
    return math.degrees(alpha), math.degrees(beta)


def least_regular(momentum_n_m_s) -> float:
    """gamma of a regular pyramid, any count, with the least norm of the wheels' momenta.

    Source: WHEEL (6.11).
    """
    h1, h2, h3 = momentum_n_m_s
    return math.degrees(math.atan((2.0 * (h2 * h2 + h3 * h3)) ** 0.25 / math.sqrt(h1)))
