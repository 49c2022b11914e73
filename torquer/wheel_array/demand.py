"""What is demanded of an array: a set of momentum (or torque) vectors, in the body frame.

A demand knows two things: how far it goes along a direction, and the greatest value that a
quadratic form takes on it. All measures of a layout follow from these, exactly.
"""

from dataclasses import dataclass

import numpy as np

from torquer import validate
from torquer.wheel_array.envelope import support


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

    def greatest_form(self, form) -> float:
        """Greatest x . form x of the demand: at one of the corners."""
        signs = np.array([(1, 1, 1), (1, 1, -1), (1, -1, 1), (1, -1, -1)])
        return _greatest_of(signs * self.half, form)


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

    def greatest_form(self, form) -> float:
        """Greatest x . form x of the demand: an eigenvalue."""
        return float(np.linalg.eigvalsh(self.matrix.T @ form @ self.matrix)[-1])

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
        return np.abs(np.asarray(directions) @ self.samples.T).max(axis=-1)

    def greatest_form(self, form) -> float:
        """Greatest x . form x of the demand."""
        return _greatest_of(self.samples, form)


def _greatest_of(vectors, form) -> float:
    return float(np.einsum("pi,ij,pj->p", vectors, form, vectors).max())


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
    """By how much the envelope must be scaled to hold the demand; up to 1 it does.

    Source: WHEEL (0.1).
    """
    normals, bounds = envelope.half_spaces
    return _greatest_quotient(demand.support(normals), bounds)


def greatest_share_of(generators, demand) -> float:
    """The same for the envelope of vectors (n, 3) that span space, without building it: quick."""
    i, j = np.triu_indices(len(generators), 1)
    normals = np.cross(generators[i], generators[j])
    normals = normals[np.linalg.norm(normals, axis=1) > 1e-9 * np.abs(normals).max()]
    return _greatest_quotient(demand.support(normals), support(generators, normals))


def _greatest_quotient(wanted, bounds) -> float:
    wanted[wanted < 1e-12 * wanted.max(initial=0.0)] = 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.nan_to_num(wanted / bounds, nan=0.0, posinf=np.inf).max())


def greatest_norm(axes, demand) -> float:
    """Greatest root of the sum of squares of the wheels' momenta, shared by least squares.

    Source: WHEEL (6.9).
    """
    axes = np.asarray(axes)
    return demand.greatest_form(np.linalg.inv(axes.T @ axes)) ** 0.5


def greatest_momentum(axes, demand) -> float:
    """Greatest momentum of a wheel, shared by least squares."""
    return float(demand.support(np.linalg.pinv(np.asarray(axes).T)).max())
