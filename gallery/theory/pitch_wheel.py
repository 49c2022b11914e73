"""Satellite with a pitch wheel and B-dot: how far the weak magnetic torque tilts it.

Body axes, near the orbital frame's: x1 up the radius vector, x2 along the motion, x3 along the
orbit normal, as in FIELD (X of `conventions` has the order x2, x3, x1). J = diag(A, B, C), wheel
momentum h along x3. The argument of latitude u is the time, rates are in units of omega0.

State x = (w1, w2, w3, alpha, beta, gamma): absolute rates; angles of the turns about x2, x3, x1,
in this order, from the orbital frame. beta is pitch. The equilibrium is (0, 0, 1, 0, 0, 0).

The control is m = -k dB_x/dt, so M = -k dB_x/dt x B_x (k > 0 damps). The small parameter is
eps = k (mu_e/r^3)^2 / (C omega0). The field drags the satellite forward: it turns about the
normal at about twice the orbital rate, and pitch settles where the gravity gradient balances it.
"""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from pydantic import Field

from torquer.base.spec import Moments, Spec
from torquer.environment.field import averaged, direct_dipole
from torquer.environment.field.tilted_dipole import M3_IN_KM3
from torquer.environment.orbit.circular import Circular
from torquer.environment.orbit.kepler import FARTHEST_KM
from torquer.theory.periodic.poincare import Response, equidistant_points, small_parameter
from torquer.theory.validity import INCLINATION, LEAN, broken_limits, check_regular, within

MODELS = ("direct_dipole", "averaged")
EQUILIBRIUM = (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
PITCH = 4


class PitchWheel(Spec):
    """Satellite with a wheel on the pitch axis and B-dot, on a circular orbit.

    `inertia_kg_m2` = (A, B, C) about x1 (up), x2 (along the motion), x3 (normal).
    """

    inertia_kg_m2: Moments
    wheel_momentum_n_m_s: float = 0.0
    gain_a_m2_s_t: float = Field(ge=0.0)
    altitude_km: float = Field(gt=0.0, le=FARTHEST_KM)
    inclination_deg: float = Field(ge=0.0, le=180.0)
    mu_e_t_km3: float = Field(7.812e6, gt=0.0)

    @property
    def inclination(self) -> float:
        """Inclination [rad]."""
        return math.radians(self.inclination_deg)

    @property
    def epsilon(self) -> float:
        """Small parameter: k (mu_e/r^3)^2 / (C omega0)."""
        orbit = Circular(altitude_km=self.altitude_km, inclination_deg=self.inclination_deg)
        equatorial_t = self.mu_e_t_km3 * M3_IN_KM3 / orbit.radius_m**3
        return self.gain_a_m2_s_t * equatorial_t**2 / (self.inertia_kg_m2[2] * orbit.rate_rad_s())

    @property
    def wheel(self) -> float:
        """Wheel momentum over omega0 [kg m^2]."""
        orbit = Circular(altitude_km=self.altitude_km, inclination_deg=self.inclination_deg)
        return self.wheel_momentum_n_m_s / orbit.rate_rad_s()

    @property
    def theta_c(self) -> float:
        """Gravity-gradient stiffness in pitch, (B - A) / C; positive where it is stable."""
        a, b, c = self.inertia_kg_m2
        return (b - a) / c


def dcm_orbital_to_body(alpha, beta, gamma) -> np.ndarray:
    """Direction cosines `[..., 3, 3]` of the turns by alpha, beta, gamma about x2, x3, x1.

    Transposed, body to orbital. Source: MAG (1.3.5).
    """
    sa, ca, sb, cb = np.sin(alpha), np.cos(alpha), np.sin(beta), np.cos(beta)
    sg, cg = np.sin(gamma), np.cos(gamma)
    rows = (
        (ca * cb, sb, -sa * cb),
        (-ca * sb * cg + sa * sg, cb * cg, sa * sb * cg + ca * sg),
        (ca * sb * sg + sa * cg, -cb * sg, -sa * sb * sg + ca * cg),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _unpacked(x):
    """(direction cosines, absolute and relative rates) of states `[..., 6]`."""
    dcm = dcm_orbital_to_body(x[..., 3], x[..., 4], x[..., 5])
    return dcm, x[..., :3], x[..., :3] - dcm[..., :, 2]


def free_rates(x, inertia, wheel: float) -> np.ndarray:
    """dx/du `[..., 6]` under gravity gradient and the wheel's gyroscopic torque.

    J w' + w x (J w + h) = 3 e x J e + M / omega0^2, h = (0, 0, wheel), e the radius vector;
    the control M is `bdot_rates`. Source: FIELD (2.15).
    """
    x, inertia = np.asarray(x), np.asarray(inertia)
    dcm, w, relative = _unpacked(x)
    momentum = inertia * w + np.array([0.0, 0.0, wheel])
    up = dcm[..., :, 0]
    turning = (3.0 * np.cross(up, inertia * up) - np.cross(w, momentum)) / inertia
    sb, cb, sg, cg = np.sin(x[..., 4]), np.cos(x[..., 4]), np.sin(x[..., 5]), np.cos(x[..., 5])
    check_regular("beta", cb)
    across = relative[..., 1] * cg - relative[..., 2] * sg
    pitch = relative[..., 1] * sg + relative[..., 2] * cg
    angles = (across / cb, pitch, relative[..., 0] - across * sb / cb)
    return np.concatenate([turning, np.stack(angles, axis=-1)], axis=-1)


def orbital_field(model: str, inclination: float) -> np.ndarray:
    """Fourier coefficients `[4, 3]` of B / (mu_e/r^3) along (up, motion, normal) over u.

    In the orbital frame both models are trigonometric polynomials: three harmonics hold all.
    """
    if model not in MODELS:
        raise ValueError(f"model: must be one of {', '.join(MODELS)}; received {model!r}")
    within(INCLINATION, inclination)
    u = equidistant_points(2.0 * math.pi, 16)
    if model == "direct_dipole":
        rows = [direct_dipole.b_orbital(1.0, v, inclination) for v in u]
    else:
        b0 = averaged.mean_of_extremes(1.0, inclination)
        cone = averaged.cone_angle(inclination)
        rows = [averaged.b_orbital(b0, v, inclination, cone) for v in u]
    series = np.fft.rfft(np.array(rows)[:, [2, 0, 1]], axis=0)[:4] / len(u)
    series[1:] *= 2.0
    return series


def bdot_rates(u, x, series, inertia) -> np.ndarray:
    """dx/du `[..., 6]` from the control torque -dB_x/dt x B_x, per unit of eps.

    `series` from `orbital_field`, or of any field over the orbit in units of mu_e/r^3.
    """
    x, inertia = np.asarray(x), np.asarray(inertia)
    dcm, _, relative = _unpacked(x)
    harmonics = 1j * np.arange(len(series))
    turn = np.exp(np.multiply.outer(np.asarray(u), harmonics))
    b_orbital, slope = (turn @ series).real, (turn @ (harmonics[:, None] * series)).real
    b = np.einsum("...ij,...j->...i", dcm, b_orbital)
    b_rate = np.einsum("...ij,...j->...i", dcm, slope) - np.cross(relative, b)
    turning = -np.cross(b_rate, b) * inertia[2] / inertia
    return np.concatenate([turning, np.zeros_like(x[..., 3:])], axis=-1)


def equations(satellite: PitchWheel, model: str = "direct_dipole") -> tuple[Callable, Callable]:
    """(f, g) of dx/du = f(x) + eps g(u, x), as the tools of `theory.poincare` take them."""
    series = orbital_field(model, satellite.inclination)
    inertia, wheel = satellite.inertia_kg_m2, satellite.wheel
    return (
        lambda x: free_rates(x, inertia, wheel),
        lambda u, x: bdot_rates(u, x, series, inertia),
    )


def pitch_wheel_response(satellite: PitchWheel, model: str = "direct_dipole") -> Response:
    """Forced periodic motion per unit of eps, all axes, any inclination (resonances listed).

    `notes` also has angles beyond the linear range of the gravity gradient, and an unstable
    equilibrium.
    """
    f, g = equations(satellite, model)
    found = small_parameter(f, g, EQUILIBRIUM)
    angles = satellite.epsilon * found.amplitudes[:, 3:].sum(axis=0)
    return replace(found, notes=(*found.notes, *broken_limits(*((LEAN, x) for x in angles))))


def pitch_offset_direct_dipole(satellite: PitchWheel) -> float:
    """Steady pitch [rad] in the direct dipole: 2 eps sin^2 i / (3 theta_C), constant.

    Forward, in the sense of the orbital motion, for a damping k > 0. ValueError above 0.34 rad,
    where the linear law of gravity is off by a tenth. Source: FIELD (2.16).
    """
    pull = 2.0 * satellite.epsilon * math.sin(satellite.inclination) ** 2
    return _leaning(satellite, pull)


def pitch_offset_averaged_polar(satellite: PitchWheel) -> float:
    """Steady pitch [rad] in the averaged field on a polar orbit, B0 = 1.5 mu_e/r^3: constant.

    9/8 of the direct dipole's: 1 * (9/4) over 2 (FIELD, after (2.16)). ValueError above 0.34 rad.
    """
    if abs(satellite.inclination_deg - 90.0) > 1e-9:
        raise ValueError(
            f"inclination_deg: must be 90 for this formula; received {satellite.inclination_deg}"
        )
    pull = satellite.epsilon * averaged.mean_of_extremes(1.0, satellite.inclination) ** 2
    return _leaning(satellite, pull)


def _leaning(satellite: PitchWheel, pull: float) -> float:
    """Pitch [rad] at which the gravity gradient balances a torque [C omega0^2]."""
    if satellite.theta_c <= 0.0:
        raise ValueError(
            f"inertia_kg_m2: B must exceed A for pitch to be stable; received "
            f"{satellite.inertia_kg_m2}"
        )
    pitch = pull / (3.0 * satellite.theta_c)
    within(LEAN, pitch)
    return pitch
