"""The envelope: all sums of x_k a_k with |x_k| <= 1, a zonotope, for any vectors a_k.

With a_k = limit times axis it is the set of momenta (or torques) that an array can make. Any
number of vectors, of any directions: parallel and coplanar ones are merged into longer edges and
larger faces; a set that spans a plane or a line gives a flat envelope.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from torquer.base import validate
from torquer.spacecraft.wheel_array.faces import flat, solid, triangles, volume
from torquer.spacecraft.wheel_array.planes import FLAT, face_rows, span

#: A bound below this part of the sum of all lengths is zero: the envelope is flat there.
THIN = 1e-12


def support(generators, directions) -> np.ndarray:
    """Greatest u . x over the envelope, for directions u (..., 3): sum of |u . a_k|."""
    return np.abs(np.asarray(directions) @ np.asarray(generators).T).sum(axis=-1)


@dataclass(frozen=True)
class Envelope:
    """Zonotope of the vectors `generators` (n, 3): vertices, edges, faces and what is inside."""

    generators: np.ndarray

    def __post_init__(self):
        checked = validate.finite("generators", self.generators)
        if checked.ndim != 2 or checked.shape[1] != 3:
            raise ValueError(f"generators: must have shape (n, 3); received {checked.shape}")
        object.__setattr__(self, "generators", checked)

    @cached_property
    def _used(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Unit axes (m, 3) and lengths of the vectors that count, and their `span`.

        Axes of a flat envelope are projected on its span.
        """
        lengths = np.linalg.norm(self.generators, axis=1)
        works = lengths > THIN * lengths.max(initial=0.0)
        axes = self.generators[works] / lengths[works, None]
        held, rest = span(axes, lengths[works])
        return axes if len(held) == 3 else axes @ held.T @ held, lengths[works], held, rest

    @property
    def rank(self) -> int:
        """Dimension of the envelope: 3, or 2, 1, 0 for a flat one."""
        return len(self._used[2])

    @cached_property
    def half_spaces(self) -> tuple[np.ndarray, np.ndarray]:
        """Unit normals (f, 3) and bounds (f,): the envelope is where all |n . x| <= bound.

        First the normals of a flat one; some others may be those of an edge or a vertex.
        """
        axes, lengths, held, rest = self._used
        walls = face_rows(axes)[:, :3] if self.rank == 3 else held[:1]
        if self.rank == 2:
            walls = np.cross(rest[0], axes)
            walls /= np.linalg.norm(walls, axis=1, keepdims=True)
        normals = np.vstack([rest, walls])
        bounds = support(lengths[:, None] * axes, normals)
        bounds[: len(rest)] = 0.0
        bounds[bounds < THIN * lengths.sum()] = 0.0
        return normals, bounds

    @cached_property
    def _shape(self) -> tuple[np.ndarray, tuple[tuple[int, ...], ...]]:
        """Vertices (v, 3) and faces."""
        axes, lengths, held, rest = self._used
        vectors = lengths[:, None] * axes
        if self.rank == 3:
            return solid(vectors)
        if self.rank == 2:
            return flat(vectors, rest[0])
        end = lengths.sum() * held.sum(axis=0)
        return np.array([end, -end][: 1 + self.rank]), ()

    @property
    def vertices(self) -> np.ndarray:
        """Vertices (v, 3)."""
        return self._shape[0]

    @property
    def faces(self) -> tuple[tuple[int, ...], ...]:
        """Faces as loops of vertex numbers, counter-clockwise seen from outside, in opposite pairs.

        A flat envelope of rank 2 has two, one upon the other; one of lower rank has none.
        """
        return self._shape[1]

    @cached_property
    def edges(self) -> tuple[tuple[int, int], ...]:
        """Edges as pairs of vertex numbers, the smaller first."""
        if self.rank == 1:
            return ((0, 1),)
        pairs = {(min(p), max(p)) for f in self.faces for p in zip(f, f[1:] + f[:1], strict=True)}
        return tuple(sorted(pairs))

    @property
    def volume(self) -> float:
        """Volume, 0 for a flat envelope."""
        return volume(self.generators) if self.rank == 3 else 0.0

    def support(self, directions) -> np.ndarray:
        """Greatest u . x inside, for directions u (..., 3)."""
        return support(self.generators, directions)

    def share(self, points) -> np.ndarray:
        """Factor by which the envelope must be scaled to have the points (..., 3) on its surface.

        Up to 1 they are inside; infinite where a flat envelope does not reach at any scale, and
        NaN for points that are NaN.
        """
        points = np.asarray(points, dtype=np.float64)
        known = np.all(np.isfinite(points), axis=-1)
        normals, bounds = self.half_spaces
        along = np.abs(np.where(known[..., None], points, 0.0) @ normals.T)
        in_span = along <= FLAT * np.linalg.norm(points, axis=-1, keepdims=True)
        along[in_span & (bounds == 0.0)] = 0.0
        with np.errstate(divide="ignore", invalid="ignore"):
            shares = np.nan_to_num(along / bounds, nan=0.0, posinf=np.inf).max(axis=-1)
        return np.where(known, shares, np.nan)[()]

    def extent(self, directions) -> np.ndarray:
        """Distance from the centre to the surface along directions (..., 3), of any length."""
        directions = validate.finite("directions", directions)
        if not np.all(np.any(directions != 0.0, axis=-1)):
            raise ValueError(f"directions: must not be zero; received {directions.tolist()}")
        with np.errstate(divide="ignore"):
            return np.linalg.norm(directions, axis=-1) / self.share(directions)

    @property
    def inner_radius(self) -> float:
        """Radius of the greatest ball inside: reached in every direction."""
        return float(self.half_spaces[1].min())

    def contains(self, points, tolerance: float = 1e-12) -> np.ndarray:
        """Whether points (..., 3) are inside, or outside by no more than that part of the size."""
        return self.share(points) <= 1.0 + tolerance

    def triangles(self) -> np.ndarray:
        """The faces cut into triangles (t, 3) of vertex numbers, for drawing."""
        return triangles(self.faces)


def momentum_envelope(array) -> Envelope:
    """Momenta [N m s] that the working wheels of a `WheelArray` can hold.

    Source: WHEEL (1.2), which has them in units of the limit.
    """
    return Envelope(array.momentum_limits()[:, None] * np.array(array.axes))


def torque_envelope(array) -> Envelope:
    """Torques [N m] that the working wheels of a `WheelArray` can give."""
    return Envelope(array.torque_limits()[:, None] * np.array(array.axes))
