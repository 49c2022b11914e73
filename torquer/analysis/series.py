"""Functions of series: angles, spans of time, typical sizes."""

from typing import Any, Protocol

import numpy as np


class Variables(Protocol):
    """Variables of a result by their names, each with its `values`: a Dataset, or rows that were
    never put into one."""

    def __getitem__(self, name: str, /) -> Any:
        """A variable."""

    def __contains__(self, name: Any, /) -> bool:
        """Whether there is a variable of a name."""


def bands_where(t, inside) -> list[tuple[float, float]]:
    """Time spans [s] in which a series (1: inside, 0: outside) exceeds one half, interpolated."""
    t, inside = np.asarray(t, dtype=float), np.asarray(inside, dtype=float) - 0.5
    above = inside > 0.0
    change = np.flatnonzero(above[1:] != above[:-1])
    before, after = inside[change], inside[change + 1]
    edges = t[change] + (t[change + 1] - t[change]) * before / (before - after)
    if above[0]:
        edges = np.concatenate([[t[0]], edges])
    if above[-1]:
        edges = np.concatenate([edges, [t[-1]]])
    return [(float(a), float(b)) for a, b in edges.reshape(-1, 2) if b > a]


def angle_deg(a, b) -> np.ndarray:
    """Angle [deg] between the rows of a and b [n, 3]; NaN where either is zero."""
    across, along = np.linalg.norm(np.cross(a, b), axis=-1), np.sum(a * b, axis=-1)
    angle = np.degrees(np.arctan2(across, along))
    zero = (np.linalg.norm(a, axis=-1) == 0.0) | (np.linalg.norm(b, axis=-1) == 0.0)
    return np.where(zero, np.nan, angle)


def first_at(t_s: np.ndarray, holds: np.ndarray) -> np.ndarray:
    """Time at which a condition (r, ...) first holds; NaN where it never does."""
    return np.where(holds.any(axis=0), t_s[np.argmax(holds, axis=0)], np.nan)


def stays_from(t_s: np.ndarray, holds: np.ndarray) -> np.ndarray:
    """Time from which a condition (r, ...) holds until the end; NaN if it does not hold there."""
    records_since_it_failed = np.argmax(~holds[::-1], axis=0)
    first = np.where(holds.all(axis=0), 0, len(t_s) - records_since_it_failed)
    return np.where(holds[-1], t_s[np.minimum(first, len(t_s) - 1)], np.nan)


def times_above(holds: np.ndarray) -> np.ndarray:
    """How often a condition (r, ...) ceased to hold after it first held."""
    return np.count_nonzero(holds[:-1] & ~holds[1:], axis=0)


def none_if_never(t_s) -> float | None:
    """A time as plain data."""
    return None if np.isnan(t_s) else float(t_s)


def quiet_from(t, size) -> float | None:
    """Time from which a size stays below a tenth of its peak, if enough of the run is left."""
    loud = np.flatnonzero(size > 0.1 * np.max(size))
    first = int(loud[-1]) + 1 if loud.size else len(t)
    return float(t[first]) if first < 0.9 * len(t) and len(t) - first > 20 else None


def usual_size(values) -> float:
    """Size that only 2 % of the values exceed."""
    sizes = np.abs(np.asarray(values))
    finite = sizes[np.isfinite(sizes)]
    return float(np.quantile(finite, 0.98)) if finite.size else 0.0


def settled_from(t, size) -> float | None:
    """Time at which a size first drops to three times its median over the second half.

    A 300th of the initial value also counts as settled. None where it starts settled, or takes
    more than a fifth of the run.
    """
    size = np.asarray(size)
    level = max(3.0 * np.median(size[len(size) // 2 :]), size[0] / 300.0)
    first = int(np.argmax(size <= level))
    began, ended = float(t[0]), float(t[-1])
    return float(t[first]) if first and t[first] - began < 0.2 * (ended - began) else None
