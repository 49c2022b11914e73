"""The result of a slow motion: variables within their ranges, drifts, notes on validity."""

import math

import numpy as np

from torquer.theory.slow.evolution.model import Slow
from torquer.theory.validity import AVERAGES_ERR, SLOW_CHANGE


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


def drift_notes(drift, eps) -> tuple[str, ...]:
    return tuple(
        f"first integral {name} drifts by {value:.2g}, more than a hundredth of eps: rtol is too "
        "coarse"
        for name, value in drift.items()
        if value > 0.01 * abs(eps)
    )
