"""Exact stability of a held attitude: Floquet multipliers of its linear periodic equations.

The equations are tabulated at the stages of Dormand and Prince's method of order 8 with equal
steps, so that all gains share one table; the steps are halved until the monodromy matrices settle.
(`theory.floquet` takes any system and finds the steps of each point, in ten times the time.)
"""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import xarray as xr

from torquer.base import validate
from torquer.compile.engine import inlined, kernel, released
from torquer.maths.integrate import dop853_tableau as tableau
from torquer.theory.periodic.floquet import degree_of_stability, multipliers
from torquer.theory.three_axis.hold import AttitudeHold, affine_gains

STAGES = 12
#: Steps of a revolution: first tried, and most.
_FIRST_STEPS, _MOST_STEPS = 16, 2048
#: No inputs, for `advance`.
NOTHING = np.empty((0, 3, 0))


class Room(NamedTuple):
    """Tableau `[14, 12]` (A, then B and C), the stages' derivatives and a trial state."""

    tableau: np.ndarray
    rates: np.ndarray
    trial: np.ndarray


def room(columns: int = 6) -> Room:
    """What the kernels need for so many columns."""
    rows = np.vstack([tableau.A[:STAGES, :STAGES], tableau.B, tableau.C[:STAGES]])
    return Room(rows, np.empty((STAGES, 6, columns)), np.empty((6, columns)))


@inlined
def add_stages(stages, weights, h, start, work, out):
    """out = start + h sum of weights times the first derivatives."""
    for r in range(6):
        for c in range(out.shape[1]):
            out[r, c] = start[r, c]
    for j in range(stages):
        factor = h * weights[j]
        if factor != 0.0:
            for r in range(6):
                for c in range(out.shape[1]):
                    out[r, c] += factor * work.rates[j, r, c]


@kernel
def advance(slopes, inputs, first, h, work, y):
    """A step of theta' = w, w' = D x + inputs for all columns of y; nodes from `first` on.

    D `[nodes, 3, 6]`; `inputs` `[nodes, 3, n]` for the columns of y after the sixth.
    """
    for s in range(STAGES):
        add_stages(s, work.tableau[s], h, y, work, work.trial)
        for r in range(3):
            for c in range(y.shape[1]):
                work.rates[s, r, c] = work.trial[3 + r, c]
                work.rates[s, 3 + r, c] = 0.0
            for k in range(6):
                factor = slopes[first + s, r, k]
                for c in range(y.shape[1]):
                    work.rates[s, 3 + r, c] += factor * work.trial[k, c]
            for c in range(inputs.shape[2]):
                work.rates[s, 3 + r, 6 + c] += inputs[first + s, r, c]
    add_stages(STAGES, work.tableau[STAGES], h, y, work, y)


@inlined
def set_identity(y):
    """Identity in the first columns, zeros in the others."""
    for r in range(y.shape[0]):
        for c in range(y.shape[1]):
            y[r, c] = 1.0 if r == c else 0.0


@released
def transitions_at(tables, weights, h, work, slopes, nothing, out):
    """Transition matrices `[points, 6, 6]` over all nodes of the tables `[1 + m, nodes, 3, 6]`.

    D = first table + weights `[points, m]` times the others; `slopes`: room for D; `nothing`: no
    inputs.
    """
    for point in range(weights.shape[0]):
        for i in range(tables.shape[1]):
            for r in range(3):
                for c in range(6):
                    total = tables[0, i, r, c]
                    for j in range(weights.shape[1]):
                        total += weights[point, j] * tables[1 + j, i, r, c]
                    slopes[i, r, c] = total
        set_identity(out[point])
        for step in range(tables.shape[1] // STAGES):
            advance(slopes, nothing, step * STAGES, h, work, out[point])


def stage_points(h: float, steps: int) -> np.ndarray:
    """Points of u, from 0, at which equal steps need the equations, in order."""
    return (h * (np.arange(steps)[:, None] + room(0).tableau[STAGES + 1])).ravel()


def gain_tables(hold: AttitudeHold, at, corners: Mapping) -> np.ndarray | None:
    """Tables of G `[1 + m, nodes, 3, 6]`; without corners that of the law as it is."""
    return affine_gains(hold, at, corners) if corners else hold.gains(at)[None]


@dataclass(frozen=True)
class Family:
    """Monodromy matrices of a hold for any values of some parameters of its law.

    `corners`: least and greatest value of each, between which the steps suffice. `tables`
    `[1 + m, nodes, 3, 6]`: D of the equations, constant part and one per parameter; None for a law
    that is not affine in them, which is linearised again for every point.
    """

    hold: AttitudeHold
    corners: Mapping[str, tuple[float, float]]
    steps: int
    tables: np.ndarray | None

    def monodromies(self, values) -> np.ndarray:
        """Matrices `[points, 6, 6]` for values `[points, m]`, in the order of the corners."""
        values = np.ascontiguousarray(values, dtype=np.float64)
        if self.tables is None:
            return np.concatenate([self._linearised_for(row) for row in values])
        out = np.empty((len(values), 6, 6))
        slopes, h = np.empty(self.tables.shape[1:]), self.hold.period / self.steps
        transitions_at(self.tables, values, h, room(), slopes, NOTHING, out)
        return out

    def at(self, row) -> AttitudeHold:
        """The hold with these values."""
        return self.hold.with_parameters(**dict(zip(self.corners, row.tolist(), strict=True)))

    def _linearised_for(self, row) -> np.ndarray:
        return tabulate(self.at(row), {}, self.steps).monodromies(np.empty((1, 0)))

    def degrees(self, values) -> np.ndarray:
        """Degrees of stability [1/rad of u] for values `[points, m]`; minus infinity where the
        motion grows beyond floats."""
        found = degree_of_stability(multipliers(self.monodromies(values)), self.hold.period)
        return np.where(np.isnan(found), -np.inf, found)


def tabulate(hold: AttitudeHold, corners: Mapping, steps: int) -> Family:
    """The family with a given number of steps."""
    u = stage_points(hold.period / steps, steps)
    free, gains = hold.free(u), gain_tables(hold, hold.instants(u), corners)
    if gains is None:
        return Family(hold, corners, steps, None)
    tables = free.drive @ gains
    tables[0] += free.slopes
    return Family(hold, corners, steps, np.ascontiguousarray(tables))


def fit_family(
    hold: AttitudeHold, corners: Mapping | None = None, tolerance: float = 1e-9
) -> Family:
    """The family with steps that give its monodromy matrices at all corners to `tolerance`.

    `corners`: (least, greatest) of each parameter that is to vary. The tolerance is relative to a
    matrix's greatest entry. ArithmeticError if 2048 steps a revolution do not suffice.
    """
    corners = {name: (float(a), float(b)) for name, (a, b) in (corners or {}).items()}
    points = np.array([*itertools.product(*corners.values())])
    steps, before = _FIRST_STEPS * hold.revolutions, None
    while steps <= _MOST_STEPS * hold.revolutions:
        made = tabulate(hold, corners, steps)
        found = made.monodromies(points)
        if before is not None and np.all(np.isfinite(found)):
            size = np.abs(found).max(axis=(1, 2), keepdims=True)
            # halved steps leave a 2^-8th of the change
            if (np.abs(found - before) / size).max() <= 200.0 * tolerance:
                return made
        steps, before = 2 * steps, found
    raise ArithmeticError(
        f"law {hold.law.name}: the monodromy matrix must settle to {tolerance:g} within "
        f"{_MOST_STEPS} steps a revolution; it does not (gains too high)"
    )


class Stability(NamedTuple):
    """Floquet multipliers `[6]`, greatest first; degree [1/rad of u], and of the averaged
    equations; time [s] in which the slowest motion falls e-fold, infinite if it does not."""

    multipliers: np.ndarray
    degree: float
    averaged_degree: float
    e_fold_s: float


def exact_stability(hold: AttitudeHold, tolerance: float = 1e-12) -> Stability:
    """Exact stability of a hold, and that of its equations averaged over u."""
    made = fit_family(hold, tolerance=tolerance)
    rho = multipliers(made.monodromies(np.empty((1, 0))))[0]
    degree = float(degree_of_stability(rho, hold.period))
    e_fold = 1.0 / (degree * hold.rate_rad_s) if degree > 0.0 else math.inf
    return Stability(rho, degree, float(mean_degrees(made, np.empty((1, 0)))[0]), e_fold)


def mean_degrees(made: Family, values) -> np.ndarray:
    """Degrees [1/rad of u] of the equations averaged over u, gravity gradient included."""
    weights = np.tile(room(0).tableau[STAGES], made.steps) / made.steps
    values = np.asarray(values, dtype=np.float64)
    if made.tables is None:
        each = (tabulate(made.at(row), {}, made.steps) for row in values)
        return np.concatenate([mean_degrees(one, np.empty((1, 0))) for one in each])
    means = np.einsum("n,jnrc->jrc", weights, made.tables)
    matrices = np.zeros((len(values), 6, 6))
    matrices[:, :3, 3:] = np.eye(3)
    matrices[:, 3:] = means[0] + np.einsum("pj,jrc->prc", values, means[1:])
    return -np.linalg.eigvals(matrices).real.max(axis=-1)


def stability_chart(hold: AttitudeHold, x: tuple, y: tuple, tolerance: float = 1e-8) -> xr.Dataset:
    """Exact and averaged degree of stability [1/rad of u] over two parameters of the law.

    `x`, `y`: (name, values), y down the rows. Variables `degree_of_stability`, `averaged_degree`.
    """
    (x_name, xs), (y_name, ys) = x, y
    xs, ys = validate.finite(x_name, xs), validate.finite(y_name, ys)
    if x_name == y_name or xs.ndim != 1 or ys.ndim != 1 or min(len(xs), len(ys)) < 2:
        raise ValueError(
            f"chart: x and y must be two parameters with two values or more each; received "
            f"{x_name!r} with shape {xs.shape} and {y_name!r} with shape {ys.shape}"
        )
    corners = {x_name: (xs.min(), xs.max()), y_name: (ys.min(), ys.max())}
    made = fit_family(hold, corners, tolerance)
    grid_y, grid_x = np.meshgrid(ys, xs, indexing="ij")
    values = np.stack([grid_x.ravel(), grid_y.ravel()], axis=1)
    results = {
        "degree_of_stability": made.degrees(values),
        "averaged_degree": mean_degrees(made, values),
    }
    return xr.Dataset(
        {name: ((y_name, x_name), row.reshape(grid_x.shape)) for name, row in results.items()},
        coords={x_name: xs, y_name: ys},
        attrs={"law": hold.law.name, "orbital_rate_rad_s": hold.rate_rad_s,
               "revolutions": hold.revolutions},
    )  # fmt: skip
