"""Poincare's small-parameter method: forced periodic motion near an equilibrium.

x' = f(x) + eps g(u, x), f(x0) = 0, g periodic in u. To the first power of eps the motion is
x0 + eps x1(u), where x1' = F x1 + g(u, x0) and F is the Jacobian of f. Each harmonic of g gives
its own: X_k = (i k w - F)^-1 G_k, w = 2 pi / period; where i k w comes near an eigenvalue of
F, a resonance, the response grows and the method breaks down.

f and g take arrays whose last axis holds the components (and u of the shape before it), so that
all samples are evaluated at once; they should take complex numbers too, for exact derivatives.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from torquer.base import validate
from torquer.theory.validity import Limit, broken_limits, within

#: Harmonics of the forcing below this fraction of the greatest count as rounding errors.
_SILENT = 1e-13


PERIOD = Limit("period", 0.0, open=True)
#: Harmonics above this fraction of the greatest are not small.
TAIL = Limit(
    "tail", 0.0, 1e-3, "the forcing has harmonics beyond those sampled",
    of="forced periodic motion", shown="the spectrum of the forcing",
)  # fmt: skip
RESOLVED = Limit(
    "highest harmonics of the motion, over the greatest", most=1e-4,
    why="the samples do not resolve it", refuses=True,
    of="periodic motion", shown="the spectrum of the motion",
)  # fmt: skip
GROWTH = Limit(
    "growth of a free motion", most=1e-6, why="the motion departs from the periodic one",
    of="forced periodic motion", shown="eigenvalues of the free motion",
)  # fmt: skip


class Resonance(NamedTuple):
    """A harmonic of the forcing, the eigenvalue of F near i k w, and their distance."""

    harmonic: int
    eigenvalue: complex
    distance: float


@dataclass(frozen=True)
class Response:
    """Forced periodic motion x1 per unit of eps around x0.

    `coefficients` `[harmonics, n]`: x1 = Re sum of coefficients_k exp(i k w u). `tail` is the
    forcing's highest sampled quarter of harmonics over its greatest: if not small, sample more
    densely. `notes`: one line per caveat: a resonance, an unresolved forcing, a growing free
    motion.
    """

    x0: np.ndarray
    period: float
    coefficients: np.ndarray
    eigenvalues: np.ndarray
    resonances: tuple[Resonance, ...]
    tail: float
    notes: tuple[str, ...] = ()

    @property
    def offset(self) -> np.ndarray:
        """Constant part of x1 `[n]`."""
        return self.coefficients[0].real

    @property
    def amplitudes(self) -> np.ndarray:
        """Amplitude of every harmonic of x1 `[harmonics, n]`; of the zeroth, the offset's size."""
        return np.abs(self.coefficients)

    def at(self, u) -> np.ndarray:
        """x1 at u: `[..., n]`."""
        k = np.arange(len(self.coefficients))
        turn = np.exp(2j * math.pi / self.period * np.multiply.outer(np.asarray(u), k))
        return (turn @ self.coefficients).real


def equidistant_points(period: float, count: int) -> np.ndarray:
    """`count` equidistant points of a period, from 0, the end left out."""
    within(PERIOD, period)
    within(Limit("samples", 1), count)
    return np.arange(count) * (period / count)


def derivatives(function: Callable, x, by: str = "complex") -> np.ndarray:
    """Jacobians `[..., n, n]` of `function` at the points x `[..., n]`.

    `by`: "complex" steps are exact but need a function that takes complex numbers (no modulus,
    no comparison); "difference" takes any smooth function, at about ten digits.
    """
    x = np.asarray(x, dtype=np.float64)
    if by not in ("complex", "difference"):
        raise ValueError(f"derivatives: by must be 'complex' or 'difference'; received {by!r}")
    rows = [_along(function, x, axis, by) for axis in range(x.shape[-1])]
    return np.stack(rows, axis=-1)


def _along(function, x, axis, by):
    step = np.zeros(x.shape[-1])
    step[axis] = 1.0
    if by == "complex":
        return np.imag(function(x + 1e-30j * step)) / 1e-30
    h = 2e-3 * max(1.0, np.abs(x[..., axis]).max())

    def slope(h):
        return (function(x + h * step) - function(x - h * step)) / (2.0 * h)

    coarse, middle, fine = slope(2.0 * h), slope(h), slope(0.5 * h)
    # twice Richardson: errors of h^2 and h^4 go
    once, again = (4.0 * middle - coarse) / 3.0, (4.0 * fine - middle) / 3.0
    return (16.0 * again - once) / 15.0


def forced_response(
    jacobian, forcing, period: float = 2.0 * math.pi, x0=None, near: float = 0.05
) -> Response:
    """Periodic solution of x1' = F x1 + g(u) for sampled g `[samples, n]`, by Fourier series.

    A harmonic that drives an eigenmotion of F and lies within `near` (per unit of u) of its
    eigenvalue is listed as a resonance; at an exact one no periodic solution exists:
    ArithmeticError.
    """
    within(PERIOD, period)
    within(Limit("near", 0.0), near)
    jacobian = validate.finite("jacobian", jacobian)
    n = len(jacobian)
    jacobian = validate.finite("jacobian", jacobian, (n, n))
    forcing = validate.finite("forcing", forcing)
    if forcing.ndim != 2 or forcing.shape[1] != n or len(forcing) < 3:
        raise ValueError(
            f"forcing: must have shape (3 samples or more, {n}); received shape {forcing.shape}"
        )
    given = np.fft.rfft(forcing, axis=0) / len(forcing)
    given[1:] *= 2.0
    if len(forcing) % 2 == 0:
        given[-1] *= 0.5
    size = np.abs(given).max(axis=1)
    given[size <= _SILENT * size.max()] = 0.0
    eigenvalues, left = np.linalg.eig(jacobian.T)
    rate = 2.0 * math.pi / period
    heard = np.flatnonzero(np.any(given != 0.0, axis=1))
    resonances = tuple(
        Resonance(int(k), complex(value), float(abs(1j * k * rate - value)))
        for k in heard
        for value, vector in zip(eigenvalues, left.T, strict=True)
        if abs(1j * k * rate - value) < near
        and abs(vector @ given[k]) > 1e-9 * np.linalg.norm(given[k])
    )
    lhs = 1j * rate * np.arange(len(given))[:, None, None] * np.eye(n) - jacobian
    found = np.zeros_like(given)
    for k in heard:
        found[k] = _solve(lhs[k], given[k], k)
    origin = np.zeros(n) if x0 is None else validate.finite("x0", x0, (n,))
    tail = size[-max(1, len(size) // 4) :].max() / size.max() if size.max() > 0.0 else 0.0
    growth = float(np.max(eigenvalues.real, initial=0.0))
    notes = (*map(_text, resonances), *broken_limits((TAIL, tail), (GROWTH, growth)))
    return Response(origin, float(period), found, eigenvalues, resonances, float(tail), notes)


def _text(resonance: Resonance) -> str:
    return (
        f"harmonic {resonance.harmonic} is {resonance.distance:.2g} from an eigenvalue "
        f"{resonance.eigenvalue:.3g}: a resonance, near which the first order may not suffice"
    )


def _solve(lhs, rhs, k):
    """Solution of lhs x = rhs; of least norm if lhs is singular and rhs leaves its mode alone."""
    found = np.linalg.lstsq(lhs, rhs, rcond=1e-13)[0]
    if np.linalg.norm(lhs @ found - rhs) > 1e-9 * np.linalg.norm(rhs):
        raise ArithmeticError(
            f"forced_response: harmonic {k} of the forcing must not drive an eigenmotion of the "
            f"Jacobian at its own frequency; it does, and no periodic motion exists"
        )
    return found


def small_parameter(
    f: Callable, g: Callable, x0, period: float = 2.0 * math.pi, *, samples: int = 63,
    by: str = "complex", near: float = 0.05,
) -> Response:  # fmt: skip
    """First-order periodic motion of x' = f(x) + eps g(u, x) at the equilibrium x0 of f."""
    x0 = validate.finite("x0", x0)
    jacobian = derivatives(f, x0, by)
    left = np.abs(f(x0)).max()
    if not left <= 1e-9 * max(1.0, np.abs(jacobian).max()):
        raise ValueError(f"x0: must be an equilibrium of f; received one with |f| = {left:.3g}")
    within(Limit("samples", 3), samples)
    u = equidistant_points(period, samples)
    forcing = g(u, np.broadcast_to(x0, (samples, x0.size)))
    return forced_response(jacobian, forcing, period, x0, near)


def periodic_motion(
    rates: Callable, guess, period: float = 2.0 * math.pi, *, by: str = "complex",
    tolerance: float = 1e-11,
) -> np.ndarray:  # fmt: skip
    """Periodic solution of x' = rates(u, x) at equidistant samples, near `guess` `[samples, n]`.

    Newton's method on the Fourier collocation equations (the derivative of the trigonometric
    polynomial equals the rates at every sample); the number of samples must be odd.
    ArithmeticError if it does not converge.
    """
    x = validate.finite("guess", guess).copy()
    if x.ndim != 2 or len(x) % 2 == 0:
        raise ValueError(f"guess: must have an odd number of samples; received shape {x.shape}")
    count, n = x.shape
    u = equidistant_points(period, count)
    slope = _differentiation(count, period)
    spread = np.einsum("ij,ab->iajb", slope, np.eye(n))
    places = np.arange(count)
    for _ in range(30):
        now = rates(u, x)
        residual = slope @ x - now
        if np.abs(residual).max() <= 1e-2 * tolerance * max(1.0, np.abs(now).max()):
            return _resolve(x)
        lhs = spread.copy()
        lhs[places, :, places, :] -= derivatives(lambda y: rates(u, y), x, by)
        try:
            change = np.linalg.solve(lhs.reshape(count * n, -1), residual.ravel()).reshape(x.shape)
        except np.linalg.LinAlgError:
            break
        x -= change
        if not np.abs(x).max() < 1e12:
            break
        if np.abs(change).max() <= tolerance * max(1.0, np.abs(x).max()):
            return _resolve(x)
    raise ArithmeticError(
        f"periodic_motion: Newton's steps must fall below {tolerance:g}; they did not, from this "
        f"guess"
    )


def _resolve(x) -> np.ndarray:
    """The samples; ArithmeticError if their highest harmonics show that they are too few."""
    size = np.abs(np.fft.rfft(x, axis=0)).max(axis=1)
    highest = size[-(len(size) // 4) :].max() if len(size) > 4 else 0.0
    if highest > RESOLVED.most * size.max():
        raise ArithmeticError(
            f"periodic_motion: the samples must resolve the motion; {len(x)} leave "
            f"{size[-1] / size.max():.2g} of it in the highest harmonic"
        )
    return x


def _differentiation(count: int, period: float) -> np.ndarray:
    """Matrix that differentiates trigonometric polynomials at an odd number of samples."""
    k = np.fft.fftfreq(count, 1.0 / count) * (2j * math.pi / period)
    return np.fft.ifft(k[:, None] * np.fft.fft(np.eye(count), axis=0), axis=0).real


def remainder(f: Callable, g: Callable, response: Response, epsilon: float, samples: int = 63):
    """Greatest |true periodic motion - (x0 + eps x1)| per component `[n]`: falls as eps^2."""
    u = equidistant_points(response.period, samples)
    predicted = response.x0 + epsilon * response.at(u)
    true = periodic_motion(lambda u, x: f(x) + epsilon * g(u, x), predicted, response.period)
    return np.abs(true - predicted).max(axis=0)


def departure(f: Callable, g: Callable, response: Response, epsilon: float, periods: float = 3.0):
    """Greatest |integrated motion - (x0 + eps x1)| per component `[n]`, from a start on the latter.

    Falls as eps^2 over a given time; where free oscillations are not damped it may grow with it.
    """
    end = periods * response.period
    u = np.linspace(0.0, end, int(64 * periods) + 1)
    predicted = response.x0 + epsilon * response.at(u)
    found = solve_ivp(
        lambda u, x: f(x) + epsilon * g(u, x),
        (0.0, end), predicted[0], method="DOP853", rtol=1e-11, atol=1e-14, t_eval=u,
    )  # fmt: skip
    if not found.success:
        raise ArithmeticError(
            f"departure: the motion must stay finite over {periods:g} periods; it met a singular "
            f"point at u = {found.t[-1] if len(found.t) else 0.0:.6g}"
        )
    return np.abs(found.y.T - predicted).max(axis=0)
