"""Averaged motion under S-dot, m = k cos(alpha) (omega x S), in the averaged field (Z).

`Case.target` is the direction to the Sun, a unit vector S. With e the direction of the momentum,
v = <b b^T> S = (p S1, p S2, q S3), a = S.v and g = cos^2 theta + (C/A) sin^2 theta, the vector l e
follows a linear equation:

    (l e)' = eps g (S v.(l e) - a l e).

So v.(l e) is constant, and the momentum goes straight to l_term S, as exp(-a s) with the phase
s = integral of eps g du: towards the Sun where v.e > 0, away from it where v.e < 0.
"""

import math

import numpy as np

from torquer.compile.engine import kernel
from torquer.maths.geometry.vec3 import dot, sym_vec
from torquer.theory.slow.evolution.model import Evolution, Slow, rate_reach
from torquer.theory.validity import Limit, within


def small_parameter(gain, spinner):
    """eps = k B0/(omega0 C), of the equations in u. Source: SDOT (2.3), which prints k B0 L0/C."""
    return gain * spinner.strength_t / (spinner.orbital_rate_rad_s * spinner.axial_kg_m2)


def rotation_parameter(gain, spinner):
    """k B0/L0: the change of the momentum over itself in a radian of the initial rotation.

    'eps is close to 0.2' (SDOT 3.2) is this one.
    """
    return gain * spinner.strength_t / spinner.momentum_n_m_s


@kernel
def sdot_rates(slow, case):
    """Derivatives by u. Source: SDOT (2.11), with sigma in place of gamma."""
    sr, cr, ss, cs = (
        math.sin(slow.rho),
        math.cos(slow.rho),
        math.sin(slow.sigma),
        math.cos(slow.sigma),
    )
    sun, e = case.target, (sr * cs, sr * ss, cr)
    v = sym_vec(case.moments, sun)
    a, c, d = dot(sun, v), dot(sun, e), dot(v, e)
    cosine, sine = math.cos(slow.theta), math.sin(slow.theta)
    pace = case.eps * (cosine * cosine + case.ratio * sine * sine)
    return Slow(
        -pace * slow.l * (a - c * d),
        pace * d * dot(sun, (cr * cs, cr * ss, -sr)),
        pace * d * (sun[1] * cs - sun[0] * ss) / sr,
        0.5 * case.eps * (1.0 - case.ratio) * (a + c * d) * sine * cosine,
    )


def direction(slow):
    """Unit vectors `[..., 3]` along the momentum, in Z."""
    across = np.sin(slow.rho)
    rows = across * np.cos(slow.sigma), across * np.sin(slow.sigma), np.cos(slow.rho)
    return np.stack(np.broadcast_arrays(*rows), axis=-1)


def sun_angle(slow, case):
    """gamma [rad], angle between momentum and Sun. Source: SDOT (2.5)."""
    e, sun = direction(slow), np.asarray(case.target)
    return np.arctan2(np.linalg.norm(np.cross(e, sun), axis=-1), e @ sun)


def pull(case) -> np.ndarray:
    """v = <b b^T> S: the half-space v.e > 0 turns to the Sun."""
    return np.array(sym_vec(case.moments, case.target))


def sun_weight(case) -> float:
    """a = S.<b b^T>.S, the mean of cos^2(alpha): SDOT's A1."""
    return float(pull(case) @ np.asarray(case.target))


def plane_integral(slow, case):
    """I1 = (cos rho - S3 cos gamma)/sin gamma, of the plane that holds momentum and Sun.

    Source: SDOT (2.12).
    """
    gamma = sun_angle(slow, case)
    return (np.cos(slow.rho) - case.target[2] * np.cos(gamma)) / np.sin(gamma)


def length_integral(slow, case):
    """I2 = l |p cos gamma + (q - p) S3 cos rho|. Source: SDOT (2.13)."""
    return slow.l * np.abs(direction(slow) @ pull(case))


def nutation_integral(slow, case):
    """(lam/2) ln(sin^2 gamma/|d|) + ln sin theta - (C/A) ln cos theta, lam = 1 - C/A, d = v.e.

    It is lam/2 times I3 of SDOT 2.2 (no number), which prints the last two terms with the other
    sign: that is not constant.
    """
    gamma, d = sun_angle(slow, case), direction(slow) @ pull(case)
    path = 2.0 * np.log(np.abs(np.sin(gamma))) - np.log(np.abs(d))
    sine, cosine = np.log(np.abs(np.sin(slow.theta))), np.log(np.abs(np.cos(slow.theta)))
    return 0.5 * (1.0 - case.ratio) * path + sine - case.ratio * cosine


#: On an equatorial orbit the field does not turn: a Sun across it has v = 0.
SUN_SEEN = Limit("mean of cos^2(alpha)", 1e-9, 1.0, "the Sun lies across the field at all times")


def final_momentum(slow, case):
    """Final momentum over L0 along the Sun, below zero away from it. Source: SDOT (2.18)."""
    within(SUN_SEEN, sun_weight(case))
    return slow.l * (direction(slow) @ pull(case)) / sun_weight(case)


def momentum_at(phase, slow, case):
    """l e `[..., 3]` at phases s (integral of eps g du; eps u for a sphere) from a slow state."""
    first = slow.l * direction(slow)
    last = final_momentum(slow, case) * np.asarray(case.target)
    left = np.exp(-sun_weight(case) * np.asarray(phase))[..., None]
    return last + left * (first - last)


_CAPTURED = Limit("angle", 0.0, 0.5 * math.pi, "from 90 deg on nothing is captured", open=True)


def capture_phase(slow, case, angle):
    """Phase s after which the momentum stays within `angle` [rad] of its end; inf if it has none.

    It lies between u = s/(eps max(1, C/A)) and s/(eps min(1, C/A)). A momentum normal to v keeps
    its direction and vanishes.
    """
    within(_CAPTURED, angle)
    first, sun = slow.l * direction(slow), np.asarray(case.target)
    end = float(final_momentum(slow, case))
    if end == 0.0:
        return math.inf
    along, across = math.copysign(1.0, end) * (first @ sun), np.linalg.norm(np.cross(first, sun))
    # with x = exp(-a s): tan(gamma) = x across/(|end| + x (along - |end|))
    share = float(across - math.tan(angle) * (along - abs(end)))
    x = math.tan(angle) * abs(end) / share if share > 0.0 else 1.0
    return max(0.0, -math.log(x) / sun_weight(case))


SDOT = Evolution(
    "sdot",
    sdot_rates,
    small_parameter,
    {"plane": plane_integral, "length": length_integral, "nutation": nutation_integral},
    to_sun=True,
    reach=rate_reach,
)
