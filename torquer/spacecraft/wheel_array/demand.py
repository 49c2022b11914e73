"""Demands on an array: a set of momentum (or torque) vectors, in the body frame.

A demand has a support function (its extent along a direction) and the greatest value of a
quadratic form on it. All measures of a layout follow from these, exactly. Either is the maximum of
smooth pieces, which a search for layouts needs one by one.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from torquer.base import validate
from torquer.spacecraft.wheel_array.envelope import support
from torquer.spacecraft.wheel_array.planes import FLAT, find_rank, pair_normals


@dataclass(frozen=True)
class Box:
    """All vectors whose components are within plus or minus `half` (3,)."""

    half: np.ndarray

    def __post_init__(self):
        half = validate.finite("half", self.half, (3,))
        if np.any(half < 0.0):
            raise ValueError(f"half: must not be negative; received {half.tolist()}")
        object.__setattr__(self, "half", half)

    def support(self, directions) -> np.ndarray:
        """Greatest u . x of the demand, for directions u (..., 3)."""
        return np.abs(directions) @ self.half

    def supports(self, directions) -> np.ndarray:
        """Smooth pieces (..., 4) of the support: one for each corner and its opposite."""
        return np.abs(np.asarray(directions) @ self._corners.T)

    def forms(self, form, near=None) -> np.ndarray:
        """Smooth pieces (4,) of the greatest x . form x: one for each corner."""
        return _forms(self._corners, form)

    @property
    def _corners(self) -> np.ndarray:
        return self.half * np.array([(1, 1, 1), (1, 1, -1), (1, -1, 1), (1, -1, -1)])


@dataclass(frozen=True)
class Ellipsoid:
    """All vectors E u with |u| <= 1; E: three semi-axes or a (3, 3) matrix."""

    matrix: np.ndarray

    def __post_init__(self):
        matrix = validate.finite("matrix", self.matrix)
        matrix = np.diag(matrix) if matrix.shape == (3,) else matrix
        object.__setattr__(self, "matrix", validate.finite("matrix", matrix, (3, 3)))

    def support(self, directions) -> np.ndarray:
        """Greatest u . x of the demand, for directions u (..., 3)."""
        return np.linalg.norm(np.asarray(directions) @ self.matrix, axis=-1)

    def supports(self, directions) -> np.ndarray:
        """The support as its only smooth piece (..., 1)."""
        return self.support(directions)[..., None]

    def forms(self, form, near=None) -> np.ndarray:
        """Smooth pieces (3,) of the greatest x . form x, an eigenvalue: at three points.

        They are where another form `near` is greatest and stationary; by default, this one.
        """
        near = form if near is None else near
        return _forms(np.linalg.eigh(self.matrix.T @ near @ self.matrix)[1].T @ self.matrix.T, form)

    def mesh(self, rows: int = 24, columns: int = 48) -> tuple[np.ndarray, np.ndarray]:
        """Points (p, 3) of the surface and triangles (t, 3) of point numbers, for drawing.

        The triangles are counter-clockwise seen from outside.
        """
        theta = np.pi * np.arange(1, rows)[:, None] / rows
        phi = 2.0 * np.pi * np.arange(columns) / columns
        x, y = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi)
        rings = np.stack([x, y, np.broadcast_to(np.cos(theta), x.shape)], axis=-1).reshape(-1, 3)
        sphere = np.vstack([[0.0, 0.0, 1.0], rings, [0.0, 0.0, -1.0]])
        triangles = _sphere_triangles(rows, columns)
        if np.linalg.det(self.matrix) < 0.0:
            triangles = triangles[:, ::-1]
        return sphere @ self.matrix.T, triangles


@dataclass(frozen=True)
class Series:
    """The vectors `samples` (N, 3), as of a simulation, and their opposites."""

    samples: np.ndarray

    def __post_init__(self):
        samples = validate.finite("samples", self.samples)
        if samples.ndim != 2 or samples.shape[1] != 3 or len(samples) == 0:
            raise ValueError(f"samples: must have shape (N, 3); received {samples.shape}")
        object.__setattr__(self, "samples", samples)

    def support(self, directions) -> np.ndarray:
        """Greatest u . x of the demand, for directions u (..., 3)."""
        return np.abs(np.asarray(directions) @ self._corners.T).max(axis=-1)

    def supports(self, directions) -> np.ndarray:
        """Smooth pieces (..., c) of the support: one for each corner of the samples' hull."""
        return np.abs(np.asarray(directions) @ self._corners.T)

    def forms(self, form, near=None) -> np.ndarray:
        """Smooth pieces (c,) of the greatest x . form x: one for each corner of the hull."""
        return _forms(self._corners, form)

    @cached_property
    def _corners(self) -> np.ndarray:
        """Samples on the hull of them and their opposites; all of them where it is flat."""
        from scipy.spatial import ConvexHull, QhullError  # a tenth of a second of importing

        both = np.vstack([self.samples, -self.samples])
        try:
            corners = ConvexHull(both).vertices
        except QhullError:
            return self.samples
        return self.samples[corners[corners < len(self.samples)]]


def _forms(vectors, form) -> np.ndarray:
    return np.einsum("pi,ij,pj->p", vectors, form, vectors)


def _sphere_triangles(rows, columns) -> np.ndarray:
    """Triangles of a globe: north pole 0, then rows - 1 rings, then the south pole."""
    here = np.arange(columns)
    after, last = np.roll(here, -1), (rows - 1) * columns + 1
    parts = [np.column_stack([np.zeros(columns, int), 1 + here, 1 + after])]
    for ring in range(rows - 2):
        a, b = 1 + ring * columns, 1 + (ring + 1) * columns
        parts.append(np.column_stack([a + here, b + here, b + after]))
        parts.append(np.column_stack([a + here, b + after, a + after]))
    a = last - columns
    parts.append(np.column_stack([np.full(columns, last), a + after, a + here]))
    return np.vstack(parts)


def greatest_share(envelope, demand) -> float:
    """Factor by which the envelope must be scaled to contain the demand; up to 1 it does.

    Source: WHEEL (0.1).
    """
    normals, bounds = envelope.half_spaces
    return _greatest_quotient(demand.support(normals), bounds)


def share_for_generators(generators, demand) -> float:
    """`greatest_share` for the envelope of vectors (n, 3) that span space, without building it."""
    return float(share_pieces(generators, demand).max())


def share_pieces(generators, demand) -> np.ndarray:
    """Its smooth pieces (p,): those of the demand over the bound, for all pairs of vectors."""
    generators = np.asarray(generators, dtype=np.float64)
    lengths = np.linalg.norm(generators, axis=1)
    used = generators[lengths > 0.0]
    normals = pair_normals(used / lengths[lengths > 0.0, None])
    return _quotients(demand.supports(normals), support(used, normals)[:, None]).ravel()


def _greatest_quotient(wanted, bounds) -> float:
    return float(_quotients(wanted, bounds).max())


def _quotients(wanted, bounds) -> np.ndarray:
    """Demand over capacity; 0 for 0/0."""
    nothing = (bounds == 0.0) & (wanted <= FLAT * wanted.max(initial=0.0))
    wanted = np.where(nothing, 0.0, wanted)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.nan_to_num(wanted / bounds, nan=0.0, posinf=np.inf)


def greatest_norm(axes, demand) -> float:
    """Greatest root of the sum of squares of the wheels' momenta under least squares.

    Infinite for axes that do not span space. Source: WHEEL (6.9).
    """
    return float(norm_pieces(axes, demand).max())


def norm_pieces(axes, demand, near=None) -> np.ndarray:
    """Its smooth pieces; those of an ellipsoid at its worst points for other axes, `near`."""
    forms = [_sharing(a).T @ _sharing(a) for a in (axes, axes if near is None else near)]
    return _if_spanned(axes, np.sqrt(np.maximum(demand.forms(*forms), 0.0)))


def greatest_momentum(axes, demand) -> float:
    """Greatest momentum of a wheel under least squares; infinite unless the axes span space."""
    return float(momentum_pieces(axes, demand).max())


def momentum_pieces(axes, demand) -> np.ndarray:
    """Its smooth pieces (p,): those of the demand for every wheel."""
    return _if_spanned(axes, demand.supports(_sharing(axes)).ravel())


def _if_spanned(axes, values) -> np.ndarray:
    return values if find_rank(axes) == 3 else np.full(values.shape, np.inf)


def _sharing(axes) -> np.ndarray:
    """Rows (n, 3) whose product with a vector is a wheel's momentum, shared by least squares."""
    return np.linalg.pinv(np.asarray(axes, dtype=np.float64).T)
