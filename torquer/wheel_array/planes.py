"""Planes that pairs of axes span: they name the faces of a zonotope, and hence all the rest."""

from typing import NamedTuple

import numpy as np

from torquer.wheel_array.layout import FLAT


class Plane(NamedTuple):
    """A plane through the origin spanned by axes: unit normal (3,), and the axes in it."""

    normal: np.ndarray
    members: tuple[int, ...]


def parallel_classes(axes) -> list[tuple[int, ...]]:
    """Numbers of the axes (n, 3), unit, grouped by line; each group begins with its first."""
    classes: list[list[int]] = []
    for k, axis in enumerate(axes):
        for group in classes:
            if np.linalg.norm(np.cross(axes[group[0]], axis)) < FLAT:
                group.append(k)
                break
        else:
            classes.append([k])
    return [tuple(group) for group in classes]


def planes_of(axes) -> list[Plane]:
    """Every plane spanned by axes (n, 3), unit, once, with all axes that lie in it."""
    axes = np.asarray(axes, dtype=np.float64)
    classes, found = parallel_classes(axes), []
    for a, first in enumerate(classes):
        for b in range(a + 1, len(classes)):
            normal = np.cross(axes[first[0]], axes[classes[b][0]])
            normal /= np.linalg.norm(normal)
            inside = [c for c, group in enumerate(classes) if _flat(normal, axes[group[0]])]
            inside = sorted({a, b, *inside})
            if inside[:2] == [a, b]:  # seen from its first two lines only
                found.append(Plane(normal, tuple(sorted(k for c in inside for k in classes[c]))))
    return found


def _flat(normal, axis) -> bool:
    return abs(normal @ axis) < FLAT
