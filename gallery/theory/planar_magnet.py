"""Pitch of a satellite with a permanent magnet on a polar orbit: does it follow the field?

The magnet lies on the body axis x1, which moves in the orbit plane at the angle alpha from the
radius vector towards the motion; x3 is the orbit normal; J = diag(A, B, C). With u as time,

  eta     = 3 (A - B) / C            gravity gradient over inertia, -3 < eta < 3;
  lambda2 = m B0 / (C omega0^2)      magnet over inertia, B0 = 1.5 mu_e / r^3 the averaged field;
  mu      = 0: averaged field, 1: direct dipole, whose equator has the strength 2/3 B0.

The averaged field has the direction alpha = pi/2 + u at all times. The direct dipole leads and lags
it by up to 19.5 deg; near a node it turns by 2u, not u. FIELD linearises about pi/2 + u for both
(`uniform_rotation`), and says that for the dipole this holds near the nodes. In fact it is the
linearisation about the uniform rotation over the whole orbit, not about the field; that one is
`along_field`. `tracking_motion` is the motion itself, and `motion_edges` where it is lost.
"""

import math
from collections.abc import Callable

import numpy as np
from pydantic import Field
from scipy.optimize import brentq

from gallery.theory.mathieu import edges, half_trace, hill_equation
from torquer.base.spec import Moments, Spec
from torquer.compile.engine import kernel
from torquer.environment.field.averaged import mean_of_extremes
from torquer.environment.field.tilted_dipole import M3_IN_KM3
from torquer.environment.orbit.circular import Circular
from torquer.environment.orbit.kepler import FARTHEST_KM
from torquer.theory.periodic.floquet import transitions
from torquer.theory.periodic.periodic_systems import PeriodicSystem, periodic_system
from torquer.theory.periodic.poincare import equidistant_points, periodic_motion
from torquer.theory.validity import Limit, within

#: Strength over the equator as a part of the averaged B0, for mu = 0 and mu = 1.
STRENGTH = (1.0, 2.0 / 3.0)


class PlanarMagnet(Spec):
    """Satellite with a permanent magnet on x1, on a circular polar orbit; J = diag(A, B, C)."""

    inertia_kg_m2: Moments
    dipole_a_m2: float = Field(gt=0.0)
    altitude_km: float = Field(gt=0.0, le=FARTHEST_KM)
    mu_e_t_km3: float = Field(7.812e6, gt=0.0)

    @property
    def eta(self) -> float:
        """Gravity gradient over inertia, 3 (A - B) / C."""
        a, b, c = self.inertia_kg_m2
        return 3.0 * (a - b) / c

    @property
    def lambda2(self) -> float:
        """Magnet over inertia, m B0 / (C omega0^2), B0 the averaged field's on a polar orbit."""
        orbit = Circular(altitude_km=self.altitude_km, inclination_deg=90.0)
        equatorial_t = self.mu_e_t_km3 * M3_IN_KM3 / orbit.radius_m**3
        b0_t = mean_of_extremes(equatorial_t, 0.5 * math.pi)
        return self.dipole_a_m2 * b0_t / (self.inertia_kg_m2[2] * orbit.rate_rad_s() ** 2)


#: Ranges of a body and a magnet.
ETA = Limit("eta", -3.0, 3.0, "3 (A - B)/C of a body")
LAMBDA2 = Limit("lambda2", 0.0, why="m B0/(C omega0^2)", open=True)


def _strength(mu) -> float:
    if mu not in (0, 1):
        raise ValueError(f"mu: must be 0 (averaged field) or 1 (direct dipole); received {mu!r}")
    return STRENGTH[int(mu)]


def pitch_acceleration(u, alpha, eta, lambda2, mu):
    """alpha'' (d/du): gravity gradient and magnet, polar orbit. Source: FIELD (2.6)."""
    gravity = eta * np.sin(alpha) * np.cos(alpha)
    across = np.cos(u) * np.cos(alpha) + (1.0 + mu) * np.sin(u) * np.sin(alpha)
    return gravity + lambda2 * _strength(mu) * across


def uniform_rotation_forcing(u, eta, lambda2, mu):
    """Right-hand side of y'' + (c0 + c1 cos 2u) y = forcing, y = alpha - pi/2 - u small.

    The left-hand side is that of `uniform_rotation`; for mu = 0 the equation is
    y'' + (lambda^2 + eta cos 2u) y = -eta/2 sin 2u. Source: FIELD (2.7).
    """
    return -0.5 * (eta - mu * _strength(mu) * lambda2) * np.sin(2.0 * u)


@kernel
def along_field_stiffness(u, eta, lambda2):
    """Stiffness of alpha about the direct dipole's own direction, over the whole orbit."""
    s2 = math.sin(u) ** 2
    w2 = 1.0 + 3.0 * s2
    cos_twice = (5.0 * s2 - 1.0) / w2
    return lambda2 * (2.0 / 3.0) * math.sqrt(w2) - eta * cos_twice


def dipole_direction(u):
    """alpha0, direction of the direct dipole in the orbit plane; it grows by 2 pi a revolution."""
    u = np.asarray(u, dtype=np.float64)
    ahead = np.arctan2(
        np.sin(2.0 * u), 3.0 - np.cos(2.0 * u)
    )  # of the uniform rotation, at most 19.5 deg
    return 0.5 * math.pi + u + ahead


@periodic_system(order=2, period=math.pi, parameters={"eta": 0.0, "lambda2": 1.0, "mu": 0.0})
def uniform_rotation(u, parameters, out):
    """Free motion about alpha = pi/2 + u; mu = 0 averaged field, mu = 1 direct dipole.

    Mathieu's equation y'' + (c0 + c1 cos 2u) y = 0 with c0 = lambda2, c1 = eta - mu lambda2/3.
    """
    eta, lambda2, mu = parameters[0], parameters[1], parameters[2]
    out[0, 0], out[0, 1] = 0.0, 1.0
    out[1, 0] = -lambda2 - (eta - mu * lambda2 / 3.0) * math.cos(2.0 * u)
    out[1, 1] = 0.0


@periodic_system(order=2, period=math.pi, parameters={"eta": 0.0, "lambda2": 1.0})
def along_field(u, parameters, out):
    """Free motion about the direct dipole's direction, over the whole orbit (Hill's equation)."""
    out[0, 0], out[0, 1] = 0.0, 1.0
    out[1, 0] = -along_field_stiffness(u, parameters[0], parameters[1])
    out[1, 1] = 0.0


def tracking_motion(eta: float, lambda2: float, mu: int, samples: int = 63) -> np.ndarray:
    """(y, y') `[samples, 2]` over u in 0..pi of the motion that follows the field: periodic.

    y = alpha - pi/2 - u. Newton's method, for lambda2 below 4 from the forced oscillation about the
    uniform rotation, above from the field's direction. Where sqrt(lambda2) is near an even number
    the free and the forced oscillation resonate: the motion found is large, or none is
    (ArithmeticError; also if it swings more than 90 deg off the field, which it then does not
    follow).
    """
    within(ETA, eta)
    within(LAMBDA2, lambda2)
    u = equidistant_points(math.pi, samples)
    swing = uniform_rotation_forcing(0.25 * math.pi, eta, lambda2, mu) / (lambda2 - 4.0 - 1e-9)
    ahead = mu * (dipole_direction(u) - 0.5 * math.pi - u)
    if lambda2 < 4.0:
        guess = np.stack([swing * np.sin(2.0 * u), 2.0 * swing * np.cos(2.0 * u)], axis=1)
    else:
        rate = mu * (2.0 / (1.0 + 3.0 * np.sin(u) ** 2) - 1.0)
        guess = np.stack([ahead, rate], axis=1)

    def rates(u, x):
        alpha = 0.5 * math.pi + u + x[..., 0]
        return np.stack([x[..., 1], pitch_acceleration(u, alpha, eta, lambda2, mu)], axis=-1)

    found = periodic_motion(rates, guess, math.pi)
    off = np.abs(found[:, 0] - ahead).max()
    if off > 0.5 * math.pi:
        raise ArithmeticError(
            f"tracking_motion: must stay within 90 deg of the field; the motion found at eta = "
            f"{eta:g}, lambda2 = {lambda2:g} swings {math.degrees(off):.0f} deg off it"
        )
    return found


def tracking_half_trace(eta: float, lambda2: float, mu: int) -> float:
    """A of small motion about `tracking_motion` (mu = 0, 1): it is stable where |A| < 1."""
    return float(half_trace(_about_motion(eta, lambda2, mu, math.pi)))


def _about_motion(eta, lambda2, mu, span):
    """Transition matrix of the equation in variations along the periodic motion."""
    y = tracking_motion(eta, lambda2, mu)[:, 0]
    u = equidistant_points(math.pi, len(y))
    alpha = 0.5 * math.pi + u + y
    slope = np.imag(pitch_acceleration(u, alpha + 1e-30j, eta, lambda2, mu)) / 1e-30
    series = np.fft.rfft(-slope).real * (2.0 / len(y))
    series[0] *= 0.5
    found = transitions(hill_equation.with_data(series), span=span, tolerance=1e-13)
    return found.matrices[0]


def motion_edges(eta: float, mu: int, around: tuple[float, float]) -> tuple[float, float]:
    """Edges (cosine's, sine's) in lambda2 of the first tongue of the true periodic motion.

    `around` = (low, high) must hold both (ValueError otherwise).
    """
    return _motion_edge(eta, mu, around, 0), _motion_edge(eta, mu, around, 1)


def _motion_edge(eta, mu, around, place):
    """Where y of the cosine (0), or y' of the sine (1), vanishes after half a period."""

    def left(lambda2):
        return _about_motion(eta, lambda2, mu, 0.5 * math.pi)[place, place]

    if left(around[0]) * left(around[1]) > 0.0:
        raise ValueError(f"motion_edges: around must hold both edges; received {around}")
    return brentq(left, *around, xtol=1e-12)


def tongue_edges(
    system: PeriodicSystem, eta: float, lambda2=(-4.0, 6.0), knots: int = 101
) -> tuple[float, float]:
    """Edges (cosine's, sine's) in lambda2 of the first tongue of a system of this module."""
    within(ETA, eta)
    grid = np.linspace(*lambda2, knots) + 1e-3 * math.sqrt(2.0)
    found = edges(system.with_parameters(eta=float(eta)), "lambda2", grid)
    if not (found.even_2pi.size and found.odd_2pi.size):
        raise ValueError(
            f"tongue_edges: lambda2 must hold the first tongue at eta = {eta}; received {lambda2}"
        )
    return float(found.even_2pi[0]), float(found.odd_2pi[0])


def closed_tongue(
    edges_at: Callable[[float], tuple[float, float]], low: float, high: float
) -> tuple[float, float]:
    """(eta, lambda2) at which the tongue whose edges `edges_at(eta)` gives has no width.

    The sine's edge must be the lower one at eta = low, the higher one at eta = high.
    """

    def width(eta):
        cosine, sine = edges_at(eta)
        return sine - cosine

    eta = brentq(width, low, high, xtol=1e-10)
    return eta, edges_at(eta)[0]
