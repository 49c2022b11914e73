"""Angular momentum of many members, of body and wheels: the same bits for one as for many."""

from typing import NamedTuple

import numpy as np

from torquer.base.user_source import plain_function
from torquer.maths.geometry.vec3 import sym_vec


class Carried(NamedTuple):
    """What gives n members momentum, each its own."""

    inertia_kg_m2: np.ndarray
    """(n, 6), as `sym_vec` takes it"""
    fixed_n_m_s: np.ndarray
    """(n, 3): that of wheels whose momentum is fixed"""
    wheel_axes: np.ndarray
    """(n, w, 3)"""


def momentum_size(carried: Carried, omega_body: np.ndarray, wheels_n_m_s: np.ndarray) -> np.ndarray:
    """Magnitude (r, n) [N m s] of the momentum of body and wheels, which have (r, n, w)."""
    body = plain_function(sym_vec)(carried.inertia_kg_m2.T, np.moveaxis(omega_body, -1, 0))
    fixed, wheels = carried.fixed_n_m_s.T, _of_wheels(carried, wheels_n_m_s)
    return _magnitude([body[k] + fixed[k] + wheels[k] for k in range(3)])


def wheel_momentum_size(carried: Carried, wheels_n_m_s: np.ndarray) -> np.ndarray:
    """Magnitude (r, n) [N m s] of the momentum of all wheels together, relative to the body."""
    return _magnitude(_of_wheels(carried, wheels_n_m_s))


def _of_wheels(carried: Carried, momenta: np.ndarray) -> list[np.ndarray]:
    """Components (r, n) of the wheels' momentum; summed one by one, so alike for any n."""
    axes, none = carried.wheel_axes, np.zeros(momenta.shape[:2])
    return [
        sum((axes[:, w, k] * momenta[..., w] for w in range(axes.shape[1])), start=none)
        for k in range(3)
    ]


def _magnitude(parts) -> np.ndarray:
    x, y, z = parts
    return np.sqrt(x * x + y * y + z * z)
