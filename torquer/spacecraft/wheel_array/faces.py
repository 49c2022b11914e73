"""Faces of a zonotope as a closed polyhedron, from the orientations of triples of its vectors.

What is an edge or a vertex is decided by signs of determinants alone: zero within a tolerance, so
that axes which are coplanar but for rounding make one face. Inconsistent signs (three nearly
coplanar axes next to two nearly parallel ones) make no closed surface, or one of another volume;
then the tolerance is reduced, finally to exact arithmetic, whose signs are always consistent.
"""

from collections.abc import Iterator
from fractions import Fraction
from itertools import combinations

import numpy as np

#: Tolerances on determinants of unit vectors, tried in turn; the last one is exact arithmetic.
TOLERANCES = (1e-12, 1e-13, 1e-14, 1e-15, 0.0)
#: Vectors this close to a line are merged at least: duplicates that were rounded.
SAME_LINE = 1e-15


def merge_parallel(vectors, tolerance: float) -> np.ndarray:
    """Vectors (m, 3) with the same zonotope but for the tolerance, none parallel to another."""
    lines: list[np.ndarray] = []
    for vector in np.asarray(vectors, dtype=np.float64):
        for number, line in enumerate(lines):
            size = np.linalg.norm(line) * np.linalg.norm(vector)
            if np.linalg.norm(np.cross(line, vector)) <= max(tolerance, SAME_LINE) * size:
                lines[number] = line + (vector if line @ vector > 0.0 else -vector)
                break
        else:
            lines.append(vector)
    return np.array(lines).reshape(-1, 3)


def orientations(vectors, tolerance: float) -> np.ndarray:
    """Signs (m, m, m) of the determinants of all triples of vectors (m, 3)."""
    axes = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    signs = np.zeros((len(axes),) * 3, dtype=int)
    exact = [[Fraction(x) for x in row] for row in vectors.tolist()] if tolerance == 0.0 else None
    for three in combinations(range(len(axes)), 3):
        a, b, c = (exact or axes)[three[0]], (exact or axes)[three[1]], (exact or axes)[three[2]]
        value = _determinant(a, b, c)
        sign = 0 if abs(value) <= tolerance else (1 if value > 0 else -1)
        i, j, k = three
        signs[i, j, k] = signs[j, k, i] = signs[k, i, j] = sign
        signs[j, i, k] = signs[i, k, j] = signs[k, j, i] = -sign
    return signs


def _determinant(a, b, c):
    return (
        a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
    )


def volume(vectors) -> float:
    """Volume of a zonotope: 8 times the sum of |det| over all triples of its vectors (n, 3)."""
    a = np.asarray(vectors, dtype=np.float64)
    i, j, k = np.array(list(combinations(range(len(a)), 3)), dtype=int).reshape(-1, 3).T
    return float(8.0 * np.abs(np.einsum("pi,pi->p", a[i], np.cross(a[j], a[k]))).sum())


def triangles(faces) -> np.ndarray:
    """Faces cut into triangles (t, 3) of vertex numbers."""
    cut = [(f[0], f[k], f[k + 1]) for f in faces for k in range(1, len(f) - 1)]
    return np.array(cut, dtype=np.int64).reshape(-1, 3)


def _encloses(vertices, faces, vectors) -> bool:
    """Whether a closed surface has the volume of the vectors' zonotope, to the first tolerance."""
    a, b, c = (vertices[k] for k in triangles(faces).T)
    within = np.einsum("ti,ti->", a, np.cross(b, c)) / 6.0
    size = np.linalg.norm(vectors, axis=1).sum()
    return abs(within - volume(vectors)) <= TOLERANCES[0] * size**3


def solid(vectors) -> tuple[np.ndarray, tuple[tuple[int, ...], ...]]:
    """Vertices (v, 3) and faces, loops of their numbers, for vectors that span space."""
    for tolerance in TOLERANCES:
        lines = merge_parallel(vectors, tolerance)
        numbers: dict[tuple[int, ...], int] = {}
        faces = _number(_loops(orientations(lines, tolerance)), numbers)
        closed = is_closed(len(numbers), faces)  # if not, there may be no face at all
        if closed and _encloses(_places(numbers, lines), faces, vectors):
            break
    return _places(numbers, lines), faces


def flat(vectors, normal) -> tuple[np.ndarray, tuple[tuple[int, ...], ...]]:
    """Vertices (v, 3) and two faces, one upon the other, for vectors in the plane of a normal."""
    for tolerance in TOLERANCES:
        lines = merge_parallel(vectors, tolerance)
        numbers: dict[tuple[int, ...], int] = {}
        signs = orientations(np.vstack([lines, normal]), tolerance)
        signs[:-1, :-1, :-1] = 0
        around = signs[:-1, :-1, -1]
        members, none = np.arange(len(lines)), np.zeros(len(lines), dtype=int)
        loops = [_loop(members, side * around, none) for side in (1, -1)]
        faces = _number(loops, numbers)
        if len(numbers) == 2 * len(lines):
            break
    return _places(numbers, lines), faces


def is_closed(vertices: int, faces) -> bool:
    """Whether each edge has one face on either side, and Euler's formula holds."""
    pairs = [pair for face in faces for pair in zip(face, face[1:] + face[:1], strict=True)]
    there = set(pairs)
    paired = len(there) == len(pairs) and all((b, a) in there for a, b in pairs)
    return paired and vertices - len(pairs) // 2 + len(faces) == 2


def _number(loops, numbers: dict) -> tuple[tuple[int, ...], ...]:
    """The loops with vertices by number; a vertex is known by the signs of its vectors."""
    return tuple(tuple(numbers.setdefault(s, len(numbers)) for s in loop) for loop in loops)


def _places(numbers: dict, lines) -> np.ndarray:
    """Vertices (v, 3), known by the signs of the vectors."""
    return np.array(list(numbers), dtype=np.float64) @ lines


def _loops(signs) -> Iterator:
    """Loops of signs round all faces, in opposite pairs."""
    for i, j in combinations(range(len(signs)), 2):
        members = np.flatnonzero(signs[i, j] == 0)
        outside = np.flatnonzero(signs[i, j])
        if members[0] == i and members[1] == j and len(outside):  # else seen from others
            around = signs[:, :, outside[0]] * signs[i, j, outside[0]]
            for side in (1, -1):
                yield _loop(members, side * around[np.ix_(members, members)], side * signs[i, j])


def _loop(members, around, sides) -> list[tuple[int, ...]]:
    """Signs of all vectors at the vertices of a face, counter-clockwise seen from outside.

    `around` (m, m): 1 where the second member is within half a turn after the first.
    """
    turned = np.where(around[0] < 0, -1, 1)  # all within half a turn after the first
    before = (around * turned[:, None] * turned > 0).sum(axis=0)
    signs, loop = sides.copy(), []
    signs[members] = -turned
    for direction in (1, -1):
        for k in np.argsort(before, kind="stable"):
            signs[members[k]] = direction * turned[k]
            loop.append(tuple(int(s) for s in signs))
    return loop
