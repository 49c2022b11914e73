"""What data do not determine of a calibration or a twin, in words that follow "determine"."""

from __future__ import annotations

import numpy as np

#: Parameters that are said of a direction at most, and from what part of it on.
_SAID, _LARGE = 4, 0.3
#: Readings turn along a direction where they vary by so many times their noise.
_TURNED = 5.0


def unknown_directions(names, covariance) -> tuple[str, ...]:
    """Directions that are known no better than to their usual size, as `say_direction`."""
    values, vectors = np.linalg.eigh(covariance)
    found = []
    for value, vector in zip(values[::-1], vectors.T[::-1], strict=True):
        if value < 1.0:
            break
        found.append(say_direction(vector, names))
    return tuple(found)


def say_direction(vector, names) -> str:
    """What is not known where a direction [p] of parameters is not: in words, after "determine".

    One parameter, or the largest part of the direction apart from the rest of it.
    """
    large = np.argsort(-np.abs(vector))[:_SAID]
    first, *rest = [names[k] for k in large if abs(vector[k]) > _LARGE] or [names[large[0]]]
    if not rest:
        return first
    *some, last = rest
    return f"{first} apart from {', '.join(some)}{' and ' if some else ''}{last}"


def unturned_axes(m: np.ndarray, sigma: float) -> np.ndarray:
    """Directions [k, 3] along which readings [n, 3] T vary by no more than their noise [T].

    What fits their strength along them is the noise itself, which shrinks its own error.
    """
    spread, axes = np.linalg.eigh(np.cov(m.T))
    return axes.T[np.sqrt(np.maximum(spread, 0.0)) < _TURNED * sigma]


def say_unturned(axes: np.ndarray) -> list[str]:
    """Directions in which readings do not turn, in words."""
    if len(axes) == 3:
        return ["bias and scale, as the readings do not turn"]
    return [
        "bias and scale along "
        f"{say_direction(axis, 'xyz').replace(' apart from ', ' with ')}, where no reading turns to"
        for axis in axes
    ]
