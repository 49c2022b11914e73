"""The result of a slow motion: variables within their ranges, drifts, notes on validity."""

import math

import numpy as np

from torquer.theory.slow.evolution.model import Case, Evolution, Slow
from torquer.theory.validity import AVERAGES_ERR, SLOW_CHANGE

#: Change of a first integral, over itself, that is rounding.
_ROUNDING = 16.0 * np.finfo(float).eps
#: Shifts of the variables that are tried where a smaller one changes an integral by less than the
#: motion did: near its extremum the change goes with the shift's square.
_WIDER = (1e-6, 1e-4)


class SlowMotion(Slow):
    """Slow variables along a motion (arrays), and how far they are to be trusted.

    `u`: the points. `ended`: where the motion left the domain of the variables and stopped (None:
    nowhere); rows beyond are NaN. `drift`: of each first integral, the change of a
    variable (l, or radians) that would change the integral as much as it has changed on the way;
    NaN where the integral is infinite. `notes`: one line per caveat.
    """

    def __new__(cls, l, rho, sigma, theta, *, u=None, ended=None, drift=None, notes=()):  # noqa: E741
        """The four arrays make the tuple, the rest are attributes."""
        self = super().__new__(cls, l, rho, sigma, theta)
        self.u, self.ended, self.drift, self.notes = u, ended, drift or {}, tuple(notes)
        return self


def in_range(path, slack: float) -> Slow:
    """rho and theta within 0..pi: (-rho, sigma) is (rho, sigma + pi), and -theta is theta.

    Beyond the ends by less than `slack`, which is rounding, sigma stays.
    """
    l, rho, sigma, theta = path  # noqa: E741
    turned = np.remainder(rho + math.pi, 2.0 * math.pi) - math.pi
    through = (turned < 0.0) & (np.abs(np.sin(turned)) > slack)
    sigma = np.where(through, sigma + math.pi, sigma)
    return Slow(l, np.abs(turned), sigma, np.clip(theta, 0.0, math.pi))


def exit_notes(ended, path) -> tuple[str, ...]:
    if ended is None:
        return ()
    at = np.flatnonzero(np.isfinite(path.l))[-1]
    return (
        f"stops at u = {ended:.6g}: the motion leaves the domain of its variables there (l > 0, "
        f"theta within 0..pi, no singular point); before, at l = {path.l[at]:.3g}, rho = "
        f"{path.rho[at]:.3g}, theta = {path.theta[at]:.3g}",
    )


def validity_notes(change: float, eps: float | None = None) -> tuple[str, ...]:
    if change <= SLOW_CHANGE:
        return ()
    small = "" if eps is None or abs(eps) < SLOW_CHANGE else f"eps = {eps:.3g} is not small: "
    err = f"err by about {AVERAGES_ERR * change:.2g}" if change < 1.0 else "do not hold"
    return (
        f"{small}the momentum changes by up to {change:.3g} of itself per radian of the orbit, "
        f"above {SLOW_CHANGE:g}: the averages {err}",
    )


def drifts(evolution: Evolution, case: Case, path: Slow, rtol: float) -> dict[str, float]:
    """Drift of each first integral that holds in a case, along a path: see `drift`."""
    if not evolution.integrals_hold(case):
        return {}
    scale = max(10.0 * rtol, 1e-9)
    return {name: drift(of, case, path, scale) for name, of in evolution.integrals.items()}


def drift(integral, case: Case, path: Slow, scale: float) -> float:
    """Greatest change of an integral, in terms of the variables: l, or radians.

    It is the change from the start over what shifts of each variable by `scale` change the
    integral, times the scale: the distance of the path from the surface on which it should lie.
    (Relative to the integral itself it would mean nothing: most are sums of logarithms, which pass
    through zero.) A change by rounding alone counts as none. Where a shift changes the integral by
    less than the motion did, as next to its extremum, wider ones are tried. NaN where the integral
    is infinite.
    """
    known = Slow(*(np.asarray(x)[np.isfinite(path.l)] for x in path))
    with np.errstate(all="ignore"):
        value = integral(known, case)
        if not np.all(np.isfinite(value)):
            return math.nan
        change = np.abs(value - value[0])
        change[change <= _ROUNDING * np.abs(value[0])] = 0.0
        far, least = np.where(change == 0.0, 0.0, np.inf), 0.0
        for by in (scale, *(wider for wider in _WIDER if wider > scale)):
            moved = sum(np.abs(integral(_shift(known, k, by), case) - value) for k in range(4))
            nearer = np.maximum(np.fmin(far, by * change / moved), least)
            far, least = np.where(far > least, nearer, far), by
    return float(np.max(far, initial=0.0))


def _shift(path: Slow, k: int, by: float) -> Slow:
    """A variable shifted; l relative to itself, so that it stays positive."""
    values = list(path)
    values[k] = values[k] * (1.0 + by) if k == 0 else values[k] + by
    return Slow(*values)


def drift_notes(drift, eps) -> tuple[str, ...]:
    return tuple(
        f"first integral {name} drifts by {value:.2g}, more than a hundredth of eps: rtol is too "
        "coarse"
        for name, value in drift.items()
        if value > 0.01 * abs(eps)
    )
