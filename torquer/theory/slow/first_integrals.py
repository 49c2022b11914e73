"""First integrals along a slow motion: how far they drift numerically."""

import math

import numpy as np

from torquer.theory.slow.evolution.model import Case, Evolution, Slow

_ROUNDING = 16.0 * np.finfo(float).eps


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
    through zero.) A change by rounding alone counts as none, as at an extremum of the integral no
    shift changes it. NaN where the integral is infinite.
    """
    known = Slow(*(np.asarray(x)[np.isfinite(path.l)] for x in path))
    with np.errstate(all="ignore"):
        value = integral(known, case)
        moved = sum(np.abs(integral(_shift(known, k, scale), case) - value) for k in range(4))
        change = np.abs(value - value[0])
        change[change <= _ROUNDING * np.abs(value[0])] = 0.0
        return float(np.max(np.where(change == 0.0, 0.0, scale * change / moved), initial=0.0)
                     if np.all(np.isfinite(value)) else math.nan)  # fmt: skip


def _shift(path: Slow, k: int, by: float) -> Slow:
    """A variable shifted; l relative to itself, so that it stays positive."""
    values = list(path)
    values[k] = values[k] * (1.0 + by) if k == 0 else values[k] + by
    return Slow(*values)
