"""The envelope: all sums of x_k a_k with |x_k| <= 1, a zonotope, for any vectors a_k.

With a_k = limit times axis it is the set of momenta (or torques) that an array can make. Any
number of vectors, of any directions: parallel and coplanar ones are merged into longer edges and
larger faces; a set that spans a plane or a line gives a flat envelope.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from torquer import validate
from torquer.wheel_array.planes import Plane, parallel_classes, planes_of

#: A bound below this part of the sum of all lengths is zero: the envelope is flat there.
THIN = 1e-12


def support(generators, directions) -> np.ndarray:
    """Greatest u . x over the envelope, for directions u (..., 3): sum of |u . a_k|."""
    return np.abs(np.asarray(directions) @ np.asarray(generators).T).sum(axis=-1)


def volume(generators) -> float:
    """Volume of the envelope: 8 times the sum of |det| over all threes of vectors."""
    a = np.asarray(generators, dtype=np.float64)
    i, j, k = np.array(list(combinations(range(len(a)), 3)), dtype=int).reshape(-1, 3).T
    return float(8.0 * np.abs(np.einsum("pi,pi->p", a[i], np.cross(a[j], a[k]))).sum())


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
    def merged(self) -> np.ndarray:
        """Vectors (m, 3) with the same envelope, none of them zero and no two parallel."""
        lengths = np.linalg.norm(self.generators, axis=1)
        works = lengths > THIN * lengths.max(initial=0.0)
        used = self.generators[works]
        axes = used / lengths[works, None]
        groups = parallel_classes(axes)
        return np.array(
            [axes[g[0]] * sum(abs(used[k] @ axes[g[0]]) for k in g) for g in groups]
        ).reshape(-1, 3)

    @cached_property
    def planes(self) -> list[Plane]:
        """Planes of the faces, each one for two opposite faces; members are of `merged`."""
        return planes_of(self._axes)

    @cached_property
    def _axes(self) -> np.ndarray:
        return self.merged / np.linalg.norm(self.merged, axis=1, keepdims=True)

    @cached_property
    def rank(self) -> int:
        """Dimension of the envelope: 3, or 2, 1, 0 for a flat one."""
        if not self.planes:
            return len(self.merged)
        return 2 if len(self.planes[0].members) == len(self.merged) else 3

    @cached_property
    def half_spaces(self) -> tuple[np.ndarray, np.ndarray]:
        """Unit normals (f, 3) and bounds (f,): the envelope is where all |n . x| <= bound."""
        normals = [plane.normal for plane in self.planes]
        if self.rank == 2:
            normals += [np.cross(normals[0], axis) for axis in self._axes]
        elif self.rank < 2:
            normals = list(np.linalg.svd(np.vstack([self.merged, np.zeros((3, 3))]))[2])
        normals = np.array(normals)
        bounds = support(self.merged, normals)
        bounds[bounds < THIN * np.linalg.norm(self.merged, axis=1).sum()] = 0.0
        return normals, bounds

    @cached_property
    def _shape(self) -> tuple[np.ndarray, tuple[tuple[int, ...], ...]]:
        """Vertices (v, 3) and faces; a vertex is known by the signs of its vectors."""
        numbers: dict[tuple[int, ...], int] = {}
        faces = [
            tuple(numbers.setdefault(signs, len(numbers)) for signs in _loop(self.merged, p, side))
            for p in self.planes
            for side in (1, -1)
        ]
        if self.rank < 2:
            numbers = {(1,) * self.rank: 0} | {(-1,) * self.rank: self.rank}
        signs = np.array(list(numbers), dtype=np.float64).reshape(len(numbers), -1)
        return signs @ self.merged, tuple(faces)

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
        return volume(self.merged) if self.rank == 3 else 0.0

    def support(self, directions) -> np.ndarray:
        """Greatest u . x inside, for directions u (..., 3)."""
        return support(self.merged, directions)

    def share(self, points) -> np.ndarray:
        """By how much the envelope must be scaled to have the points (..., 3) on its surface.

        Up to 1 they are inside; infinite where a flat envelope does not reach at any scale.
        """
        points = np.asarray(points, dtype=np.float64)
        normals, bounds = self.half_spaces
        along = np.abs(points @ normals.T)
        along[along < 1e-9 * np.linalg.norm(points, axis=-1, keepdims=True)] = 0.0
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.nan_to_num(along / bounds, nan=0.0, posinf=np.inf).max(axis=-1)

    def extent(self, directions) -> np.ndarray:
        """Distance from the centre to the surface along directions (..., 3), of any length."""
        with np.errstate(divide="ignore"):
            return np.linalg.norm(directions, axis=-1) / self.share(directions)

    @property
    def inner_radius(self) -> float:
        """Radius of the greatest ball inside: what is reached in every direction."""
        return float(self.half_spaces[1].min())

    def contains(self, points, tolerance: float = 1e-12) -> np.ndarray:
        """Whether points (..., 3) are inside, or outside by no more than that part of the size."""
        return self.share(points) <= 1.0 + tolerance

    def triangles(self) -> np.ndarray:
        """The faces cut into triangles (t, 3) of vertex numbers, for drawing."""
        cut = [(f[0], f[k], f[k + 1]) for f in self.faces for k in range(1, len(f) - 1)]
        return np.array(cut, dtype=np.int64).reshape(-1, 3)


def _loop(vectors, plane: Plane, side: int):
    """Signs of the vectors at the vertices of one face, counter-clockwise seen from outside."""
    normal = side * plane.normal
    signs = np.sign(vectors @ normal).astype(int)
    members = np.array(plane.members)
    first = vectors[members[0]]
    x, y = vectors[members] @ first, vectors[members] @ np.cross(normal, first)
    y[0] = 0.0
    turned = np.where(y < 0.0, -1, 1)
    order = np.argsort(np.arctan2(np.abs(y), turned * x))
    signs[members] = -turned
    for direction in (1, -1):
        for k in order:
            signs[members[k]] = direction * turned[k]
            yield tuple(int(s) for s in signs)


def momentum_envelope(array) -> Envelope:
    """Momenta [N m s] that the working wheels of a `WheelArray` can hold.

    Source: WHEEL (1.2), which has them in units of the limit.
    """
    return Envelope(array.momentum_limits()[:, None] * np.array(array.axes))


def torque_envelope(array) -> Envelope:
    """Torques [N m] that the working wheels of a `WheelArray` can give."""
    return Envelope(array.torque_limits()[:, None] * np.array(array.axes))
