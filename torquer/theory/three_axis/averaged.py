"""Averaged equations of three-axis magnetic control in closed form: exponents, degree, best gains.

About a reference attitude fixed in the frame in which the field is averaged (the inertial one), and
without gravity gradient, the turn vector theta obeys, averaged over the orbit,

    J theta'' + k S theta' + 2 k_a S theta = 0,  S = <B^2 1 - B B^T> in body axes.

Damping and stiffness are proportional to each other, so that for any field and any attitude the
motion has three independent channels, the eigenvectors of J^-1 S, with its eigenvalues mu as
factors: s^2 + mu k s + 2 mu k_a = 0.
"""

import numpy as np
from scipy.linalg import eigvalsh

from torquer.base import validate
from torquer.theory.validity import Limit, within

_GAIN = Limit("gain", 0.0)
_FACTOR = Limit("channel factor", 0.0)


def mean_damping(b_body_t) -> np.ndarray:
    """S = <B^2 1 - B B^T> [T^2] of fields `[n, 3]` [T] at equidistant instants, body axes.

    Coils damp a rate across the field only: along e in the mean by the part e.S e.
    """
    b = validate.finite("b_body_t", b_body_t)
    products = b.T @ b / len(b)
    return np.trace(products) * np.eye(3) - products


def mean_projection(b_body_t) -> np.ndarray:
    """Mean of 1 - b b^T, b a unit vector along the field, of fields `[n, 3]` at equidistant
    instants: the part of a torque that coils give in the mean (`control.projected_pd`)."""
    b = validate.finite("b_body_t", b_body_t)
    return mean_damping(b / np.linalg.norm(b, axis=1)[:, None])


def channel_factors(inertia_kg_m2, damping_t2) -> np.ndarray:
    """Factors mu [T^2/(kg m^2)] of the three channels, ascending. Source: MAG (4.3.4).

    In the averaged field, with the body's principal axes along Z, they are B0^2 times (p + q)/A,
    (p + q)/B and 2p/C; in MAG's notation K mu_i / (k mu_1) is K, K/rho1 and K/rho2.
    """
    inertia = validate.inertia_tensor("inertia_kg_m2", inertia_kg_m2)
    damping = validate.finite("damping_t2", damping_t2, (3, 3))
    return np.maximum(eigvalsh(damping, inertia), 0.0)


def _check(mu, rate_gain, angle_gain=0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Factors [3], gains with a new last axis for the channels."""
    mu = validate.finite("mu", mu, (3,))
    within(_FACTOR, mu)
    for gain in (rate_gain, angle_gain):
        within(_GAIN, gain)
    return mu, np.asarray(rate_gain)[..., None], np.asarray(angle_gain)[..., None]


def channel_exponents(mu, rate_gain, angle_gain) -> np.ndarray:
    """Exponents s [1/s] `[..., 3, 2]` of the channels. Source: MAG (4.3.5).

    `rate_gain` k [N m s/T^2] and `angle_gain` k_a [N m/T^2] as in `control.three_axis`: numbers or
    arrays of one shape.
    """
    mu, k, k_a = _check(mu, rate_gain, angle_gain)
    half = 0.5 * mu * k
    root = np.sqrt((half**2 - 2.0 * mu * k_a).astype(complex))
    fast = -half - root
    # the slow one as a quotient, where the difference would cancel
    slow = np.where(root.real > 0.0, 2.0 * mu * k_a / np.where(fast == 0.0, 1.0, fast), root - half)
    return np.stack([fast, slow], axis=-1)


def averaged_degree(mu, rate_gain, angle_gain) -> np.ndarray:
    """Degree of stability [1/s]: decay rate of the slowest averaged motion."""
    return -channel_exponents(mu, rate_gain, angle_gain).real.max(axis=(-2, -1))


def plateau_edge(mu, rate_gain) -> np.ndarray:
    """Least k_a [N m/T^2] with the greatest averaged degree k mu_min/2 that a gain k can have.

    k^2 mu_min (2 mu_max - mu_min)/(8 mu_max): with r = mu_1/mu in MAG's notation
    K_a = K^2 (2 r_max - r_min)/(8 r_max^2), the printed forms for three orders of the moments.
    Above it the averaged degree stays. Source: MAG (4.3.6), MAG (4.3.7), and MAG (4.3.8).
    """
    mu, k, _ = _check(mu, rate_gain)
    least, most = mu.min(), mu.max()
    within(Limit("greatest channel factor", 0.0, open=True), most)
    return k[..., 0] ** 2 * least * (2.0 * most - least) / (8.0 * most)
