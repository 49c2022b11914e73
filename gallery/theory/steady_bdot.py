"""Steady motion under B-dot where the gravity gradient rules: a small offset from the vertical.

An axisymmetric satellite (A = B > C, axis up) on a circular orbit, by Poincare's method. Resal's
axes R leave out the turn gamma about the symmetry axis: from the orbital frame X they are turned by
the pitch alpha about the orbit normal, forward positive, then by the roll beta about the first
axis. Rates by the argument of latitude u in units of omega0; lambda = C/A,
eps = k B0^2/(omega0 A).

B-dot drags the satellite along with the field, which turns in X: its mean torque is about the orbit
normal and tilts the axis forward, its oscillation tilts it sideways.
"""

import functools
import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from pydantic import Field
from scipy.integrate import solve_ivp

from gallery.theory.limits import HELD, check_regular
from torquer.base import validate
from torquer.base.spec import Spec
from torquer.environment.field.averaged import b_orbital, cone_angle
from torquer.theory.periodic.poincare import Response, equidistant_points, small_parameter
from torquer.theory.validity import LEAN, Limit, broken_limits, within

#: Relative change of a mean tilt.
STEADY = Limit("change", 0.0, 0.1, "the initial oscillation has not decayed")
#: Indices in the state: absolute rates along R, then pitch, roll, rotation about the axis.
OMEGA, PITCH, ROLL, YAW = slice(0, 3), 3, 4, 5
REST = np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0])


class SteadyBdot(Spec):
    """A gravity-gradient-stabilised satellite under B-dot in the averaged field.

    `cone_deg`: half-angle of the field's cone; left out, that of the inclination. MAG 2.2 takes
    the inclination itself for it.
    """

    ratio: float = Field(gt=0.0, lt=1.0)
    eps: float = Field(gt=0.0)
    inclination_deg: float = Field(ge=0.0, le=180.0)
    cone_deg: float | None = Field(default=None, ge=0.0, le=180.0)

    @property
    def angles(self) -> tuple[float, float]:
        """Inclination and half-angle of the cone [rad]."""
        i = math.radians(self.inclination_deg)
        return i, cone_angle(i) if self.cone_deg is None else math.radians(self.cone_deg)

    def as_published(self) -> "SteadyBdot":
        """The satellite in the field of MAG 2.2, whose cone has the inclination for half-angle."""
        return self.model_copy(update={"cone_deg": self.inclination_deg})


class Offset(NamedTuple):
    """Constant tilt [rad] of the axis: forward in the orbit plane, and sideways; notes."""

    pitch: float
    roll: float
    notes: tuple[str, ...] = ()


class Swing(NamedTuple):
    """Tilt angles [rad] at points of u; notes."""

    pitch: np.ndarray
    roll: np.ndarray
    notes: tuple[str, ...] = ()


#: The first order has no damping: its oscillation is off by a tenth from here on.
OVER = Limit("eps u", 0.0, 10.0, "the oscillation has decayed by then")
UNDAMPED = Limit(
    "eps u", 0.0, 0.1, "the oscillation decays, which the first order neglects",
    of="oscillation from rest (MAG 2.2)", shown="full equations: off by a tenth",
)  # fmt: skip


def published_offset(case: SteadyBdot) -> Offset:
    """Tilt for a cone whose half-angle is the inclination (MAG 2.2, after (2.1.17)).

    Pitch eps sin^2 i/(3 - 3 lambda), roll -eps sin i cos i/(4 - 3 lambda). The text has X2
    with the opposite sign, and prints the digits 3 and 2 in the divisor of the roll, where the
    gravity gradient and the orbital motion give 4 - 3 lambda.

    Both are linear in the tilt: noted above 0.34 rad, where that is off by a tenth; ValueError
    above 0.5, where no tilt balances the torque.
    """
    s, c = math.sin(case.angles[0]), math.cos(case.angles[0])
    free = 3.0 - 3.0 * case.ratio
    pitch, roll = case.eps * s * s / free, -case.eps * s * c / (1.0 + free)
    within(HELD, (pitch, roll))
    return Offset(pitch, roll, broken_limits((LEAN, pitch), (LEAN, roll)))


def published_swing(case: SteadyBdot, u) -> Swing:
    """Pitch and roll [rad] at u from rest at the vertical, to the first power of eps (MAG 2.2).

    The oscillation reaches twice the offset, which must be small, too, and does not decay
    (noted from eps u = 0.1 on; ValueError above 10).
    """
    u, lean = validate.finite("u", u), published_offset(case)
    free, longest = 3.0 - 3.0 * case.ratio, case.eps * float(np.max(np.abs(u), initial=0.0))
    within(OVER, longest)
    pitch = lean.pitch * (1.0 - np.cos(math.sqrt(free) * u))
    roll = lean.roll * (1.0 - np.cos(math.sqrt(1.0 + free) * u))
    notes = broken_limits((LEAN, 2.0 * lean.pitch), (LEAN, 2.0 * lean.roll), (UNDAMPED, longest))
    return Swing(pitch, roll, notes)


def gravity_rates(ratio: float, x) -> np.ndarray:
    """Derivatives by u of states `[..., 6]` without the magnetic torque. Source: MAG (2.1.17)."""
    w1, w2, w3 = (x[..., k] for k in range(3))
    alpha, beta = x[..., PITCH], x[..., ROLL]
    sb, cb = np.sin(beta), np.cos(beta)
    check_regular("roll", cb)
    spin = -w2 * sb / cb  # of R about its third axis
    up1, up2, up3 = -np.sin(alpha), np.cos(alpha) * sb, np.cos(alpha) * cb
    pull = 3.0 * (1.0 - ratio)
    return np.stack(
        [
            spin * w2 - ratio * w2 * w3 - pull * up2 * up3,
            ratio * w1 * w3 - spin * w1 + pull * up1 * up3,
            0.0 * w3,
            w2 / cb - 1.0,
            w1,
            w3 - spin,
        ],
        axis=-1,
    )


@functools.cache
def _harmonics(angles) -> np.ndarray:
    """Fourier coefficients `[4, 3]` of the field over B0 in X: it has no harmonics above 3."""
    u = equidistant_points(2.0 * math.pi, 8)
    given = np.fft.rfft([b_orbital(1.0, float(each), *angles) for each in u], axis=0)[:4] / 8.0
    given[1:] *= 2.0
    return given


def _field(u, angles):
    """Field over B0, and its derivative by u as X sees it: `[..., 3]` in X."""
    k = np.arange(4)
    turn = np.exp(1j * np.multiply.outer(u, k))
    return (turn @ _harmonics(angles)).real, ((1j * k * turn) @ _harmonics(angles)).real


def _to_resal(vectors, alpha, beta):
    """Vectors `[..., 3]` of X in Resal's axes."""
    ca, sa, cb, sb = np.cos(alpha), np.sin(alpha), np.cos(beta), np.sin(beta)
    x, y, z = (vectors[..., k] for k in range(3))
    across = x * sa + z * ca
    return np.stack([x * ca - z * sa, y * cb + across * sb, across * cb - y * sb], axis=-1)


def magnetic_rates(case: SteadyBdot, u, x) -> np.ndarray:
    """What m = -k dB/dt adds to the derivatives by u, over eps, with the body's own turn in dB/dt.

    dB/dt in the body is the field's rate in X less (omega - omega of X) x B, here resolved in R.
    """
    u = np.asarray(u, dtype=np.float64)
    b, turning = (_to_resal(v, x[..., PITCH], x[..., ROLL]) for v in _field(u, case.angles))
    normal = _to_resal(np.array([0.0, 1.0, 0.0]) + 0.0 * b, x[..., PITCH], x[..., ROLL])
    relative = x[..., OMEGA] - normal
    m = np.cross(relative, b) - turning
    torque = np.cross(m, b) / np.array([1.0, 1.0, case.ratio])
    return np.concatenate([torque, 0.0 * torque], axis=-1)


def steady_bdot_response(case: SteadyBdot) -> Response:
    """Forced motion per unit of eps around the vertical, by Poincare's method.

    `notes` has resonances, and angles beyond the linear range of the gravity gradient.
    """
    found = small_parameter(
        lambda x: gravity_rates(case.ratio, x),
        lambda u, x: magnetic_rates(case, u, x),
        REST,
        samples=63,
    )
    angles = case.eps * found.amplitudes[:, [PITCH, ROLL]].sum(axis=0)
    return replace(found, notes=(*found.notes, *broken_limits(*((LEAN, x) for x in angles))))


def motion_from_rest(case: SteadyBdot, revolutions: float, per_revolution: int = 60):
    """u, and states `[n, 6]` of the full equations from rest at the vertical.

    ValueError if the axis reaches the horizontal, where the gravity gradient does not restore it.
    """
    within(Limit("revolutions", 0.0, 1e4, open=True), revolutions)
    within(Limit("per_revolution", 1), per_revolution)
    within(Limit("eps", 0.0, 100.0, "beyond, the equations are stiff"), case.eps)
    end = 2.0 * math.pi * revolutions
    u = np.linspace(0.0, end, round(per_revolution * revolutions) + 1)
    run = solve_ivp(
        lambda u, x: gravity_rates(case.ratio, x) + case.eps * magnetic_rates(case, u, x),
        (0.0, end), REST, method="DOP853", rtol=1e-10, atol=1e-12, t_eval=u,
        events=_horizontal,
    )  # fmt: skip
    if run.status != 0:
        raise ValueError(
            f"eps: must keep the axis above the horizontal, where gravity restores it; received "
            f"{case.eps:g}, which tips it over by u = {run.t_events[0][-1]:.4g}"
        )
    return u, run.y.T


def _horizontal(u, x) -> float:
    """Upward part of the axis."""
    return math.cos(x[PITCH]) * math.cos(x[ROLL])


_horizontal.terminal = True


def mean_offset(case: SteadyBdot, revolutions: int = 24, last: int = 8) -> Offset:
    """Mean tilt [rad] by the full equations over the last revolutions.

    Noted if the mean over as many before differs by a tenth: the start has not decayed.
    """
    within(Limit("last", 1, revolutions // 2, "of at most half of the revolutions"), last)
    _, x = motion_from_rest(case, revolutions)
    before, tail = (x[-60 * k * last - 1 : -60 * (k - 1) * last - 1] for k in (2, 1))
    (pitch, roll), was = (part[:, [PITCH, ROLL]].mean(axis=0) for part in (tail, before))
    changed = abs(pitch - was[0]) / max(abs(pitch), 1e-6 * case.eps)
    return Offset(float(pitch), float(roll), broken_limits((STEADY, changed)))
