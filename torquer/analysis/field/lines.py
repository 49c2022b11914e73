"""Field lines through points along an orbit."""

import numpy as np

from torquer.environment.along_orbit import OrbitEnvironment
from torquer.environment.field.drift import b_inertial_along

#: Step along a line, as a part of the distance from the Earth's centre.
_STEP = 0.04
#: Lines are traced down to the ground and up to this distance [m], or as far as the steps lead.
_GROUND_M, _FARTHEST_M = 6.371e6, 5.0e7
_MOST_STEPS = 160


def field_lines(environment: OrbitEnvironment, t_s, r, v) -> np.ndarray | None:
    """Field lines [n, m, 3] m, J, through points r [n, 3] at times t [n] s, from south to north.

    Each is the line at its own instant; points beyond its ends are NaN. None for a field that is
    defined along the orbit only.
    """
    if not hasattr(environment.environment.field, "b_earth_fixed"):
        return None
    dcm = environment.dcm_to_ecef(np.asarray(t_s))
    forth, back = (_half(environment, t_s, r, v, dcm, sign) for sign in (1.0, -1.0))
    return np.concatenate([back[::-1], np.asarray(r)[None], forth]).transpose(1, 0, 2)


def _half(environment: OrbitEnvironment, t_s, r, v, dcm, sign: float) -> np.ndarray:
    """The path from the points along the field, or against it: [m, n, 3]."""

    def direction(at):
        b = b_inertial_along(environment.environment.field, environment.start, t_s, at, v, dcm)
        return sign * b / np.linalg.norm(b, axis=1, keepdims=True)

    at, going = np.array(r, dtype=float), np.ones(len(t_s), dtype=bool)
    points: list[np.ndarray] = []
    while going.any() and len(points) < _MOST_STEPS:
        step = _STEP * np.linalg.norm(at, axis=1, keepdims=True)
        middle = direction(at + 0.5 * step * direction(at))  # midpoint rule: error step^3
        at = np.where(going[:, None], at + step * middle, at)
        size = np.linalg.norm(at, axis=1)
        going &= (size > _GROUND_M) & (size < _FARTHEST_M)
        points.append(np.where(going[:, None], at, np.nan))
    return np.array(points).reshape(-1, len(t_s), 3)
