"""Rotation about a principal axis along the Sun's line under S-dot: for which bodies it is stable.

Along S, towards the Sun or away from it, omega x S = 0: such a rotation is undisturbed in any
field, and the equations linear about it are exact. With the axis i of the rotation, the moments of
inertia J_i, J_j, J_k in cyclic order, s = the change of S in the body and w that of the rate,
both across the axis,

    s' = -Omega e x s - w x e,   (J w)' = Euler's terms - c (w - Omega s),   c = k B0 cos^2(alpha).

The phase of the rotation does not enter, so that their period is that of cos^2(alpha), pi in u. On
average c is k B0 a, a = S.<b b^T>.S. The momentum then turns to the Sun's line at the rate c/J_i,
and the nutation decays at the rate c (1/J_j + 1/J_k - 2/J_i)/2: it grows about any axis but that
of the greatest moment.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from torquer.base import validate
from torquer.compile.engine import kernel
from torquer.theory.periodic.periodic_systems import periodic_system
from torquer.theory.slow.evolution.model import Case, Slow
from torquer.theory.slow.evolution.sdot import sdot_rates, sun_weight


@kernel
def _fill(out, spin, second, third, damping):
    """Matrix of (s_j, s_k, w_j, w_k); moments over that about the axis, damping c/J_i."""
    out[:] = 0.0
    out[0, 1], out[0, 3] = spin, -1.0
    out[1, 0], out[1, 2] = -spin, 1.0
    out[2, 3], out[3, 2] = spin * (third - 1.0) / second, spin * (1.0 - second) / third
    out[2, 0], out[2, 2] = spin * damping / second, -damping / second
    out[3, 1], out[3, 3] = spin * damping / third, -damping / third


@periodic_system(
    order=4,
    period=math.pi,
    parameters={"spin": 5.0, "second": 0.9, "third": 0.8, "eps": 0.1, "cone": 1.0, "sun": 1.3},
)
def sun_spin_system(u, parameters, out):
    """Linear motion about a rotation along the Sun's line in the averaged field, by u.

    `spin`: Omega/omega0; `second`, `third`: J_j/J_i, J_k/J_i; `eps`: k B0/(omega0 J_i); `cone`:
    half-angle of the field's cone; `sun`: angle of the Sun from its axis [rad].
    """
    spin, second, third, eps, cone, sun = parameters
    turning = math.sin(sun) * math.sin(cone) * math.cos(2.0 * u)
    cos_alpha = math.cos(sun) * math.cos(cone) + turning
    _fill(out, spin, second, third, eps * cos_alpha * cos_alpha)


def mean_matrix(moments_kg_m2, axis: int, spin: float, damping: float) -> np.ndarray:
    """The matrix [4, 4] with a constant c (`damping`), about the principal axis 0, 1 or 2."""
    here, second, third = np.roll(validate.finite("moments_kg_m2", moments_kg_m2, (3,)), -axis)
    out = np.empty((4, 4))
    _fill(out, spin, second / here, third / here, damping / here)
    return out


class Decay(NamedTuple):
    """Rates of decay, below zero of growth: of the momentum's angle to the Sun, of nutation."""

    direction: float
    nutation: float


def mean_decay(moments_kg_m2, axis: int, damping: float) -> Decay:
    """Rates of decay to the first order in c (`damping`) about an axis 0, 1 or 2.

    Of nutation about the intermediate axis it means nothing: that is unstable without S-dot.
    """
    here, second, third = np.roll(validate.finite("moments_kg_m2", moments_kg_m2, (3,)), -axis)
    nutation = 0.5 * damping * (1.0 / second + 1.0 / third - 2.0 / here)
    return Decay(damping / here, float(nutation))


def stable_axes(moments_kg_m2, spin: float = 1.0, damping: float = 1e-3) -> tuple[bool, ...]:
    """Whether a rotation along the Sun's line about each principal axis attracts, by eigenvalues.

    `damping`: c over the greatest moment, `spin` in the same unit. Of equal moments none does: the
    axis may drift among theirs.
    """
    moments = np.asarray(moments_kg_m2) / np.max(moments_kg_m2)
    largest = [
        np.linalg.eigvals(mean_matrix(moments, axis, spin, damping)).real.max() for axis in range(3)
    ]
    return tuple(bool(value < -1e-6 * damping) for value in largest)


@dataclass(frozen=True)
class AxisEquilibrium:
    """A row of SDOT's Table 2.1: angles of the axes to a momentum along the Sun's line [rad].

    `phi` None: arbitrary. `eigenvalues` of (theta, phi), of theta alone where phi is fast or
    arbitrary; in units of the orbital rate.
    """

    theta: float
    phi: float | None
    eigenvalues: np.ndarray

    @property
    def stable(self) -> bool:
        """Whether all eigenvalues have negative real parts."""
        return bool(np.all(self.eigenvalues.real < 0.0))


def nearly_axisymmetric_rates(slow: Slow, phi: float, case: Case, asymmetry: float, eta):
    """(Derivatives of the slow variables, that of phi) by u for B = A + asymmetry C.

    To the first order in eps and in the asymmetry, without their product; `eta` = (eta1, eta2) of
    the spinner. Source: SDOT (2.19), whose phi' lacks l in two terms and 1/C in one, and has twice
    the last term; its theta' lacks l.
    """
    rates, unequal = sdot_rates(slow, case), asymmetry * case.ratio * eta[1] * slow.l
    swing = unequal * math.sin(slow.theta) * math.sin(phi) * math.cos(phi)
    p, _, q, *_ = case.moments
    across = case.target[1] * math.cos(slow.sigma) - case.target[0] * math.sin(slow.sigma)
    drag = 0.5 * case.eps * (1.0 - case.ratio) * (q - p) * case.target[2] * across
    spin = slow.l * eta[0] + unequal * math.cos(phi) ** 2 - drag * math.sin(slow.rho)
    return rates._replace(theta=rates.theta + swing), math.cos(slow.theta) * spin


def axis_equilibria(case: Case, asymmetry: float, eta, length: float = 1.0) -> list:
    """Equilibria of theta and phi for a momentum along the Sun's line, |asymmetry| << 1.

    Source: SDOT (2.20), SDOT (2.21). On the axis of the almost equal moments theta decays as for
    equal ones; across it small changes of (pi/2 - theta, phi - phi0) follow a matrix.
    """
    fall = -case.eps * (1.0 - case.ratio) * sun_weight(case)
    along = [AxisEquilibrium(theta, None, np.array([-fall + 0j])) for theta in (0.0, math.pi)]
    if asymmetry == 0.0:
        return [*along, AxisEquilibrium(0.5 * math.pi, None, np.array([fall + 0j]))]
    found = []
    for phi in (0.0, 0.5 * math.pi, math.pi, 1.5 * math.pi):
        unequal = asymmetry * case.ratio * eta[1] * length
        spin = length * eta[0] + unequal * math.cos(phi) ** 2
        matrix = np.array([[fall, -unequal * math.cos(2.0 * phi)], [spin, 0.0]])
        found.append(AxisEquilibrium(0.5 * math.pi, phi, np.linalg.eigvals(matrix)))
    return along + found
