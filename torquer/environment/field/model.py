"""The interface of all field models."""

from collections.abc import Callable
from typing import ClassVar, Protocol

import numpy as np

from torquer.base.spec import Spec
from torquer.compile.engine import kernel


class FieldModel(Protocol):
    """Interface of a field model: `prepare` once per date, then any number of points.

    `prepare` takes the decimal year and returns what the compiled code needs. `b_inertial`
    gives the flux density [T] in the inertial frame J at the points of an orbit; a model that
    does not need the velocities or the Earth's rotation ignores them.
    """

    kind: str

    def prepare(self, decimal_year: float) -> tuple: ...

    def b_inertial(
        self,
        packed: tuple,
        r_inertial: np.ndarray,
        v_inertial: np.ndarray,
        dcm_inertial_to_ecef: np.ndarray,
    ) -> np.ndarray: ...


class FixedInEarth(Spec):
    """A field that turns with the Earth, by two kernels: in Earth-fixed axes and in inertial ones.

    Both take what `prepare` makes and positions, the second also matrices to Earth-fixed axes, and
    fill an array.
    """

    in_earth: ClassVar[Callable]
    in_space: ClassVar[Callable]

    def b_earth_fixed(self, packed: tuple, r_ecef) -> np.ndarray:
        """Flux density [T] in Earth-fixed axes at `[n, 3]` points [m]."""
        r_ecef = rows("r_ecef", r_ecef, 3)
        out = np.empty_like(r_ecef)
        type(self).in_earth(packed, r_ecef, out)
        return out

    def b_inertial(self, packed, r_inertial, v_inertial, dcm_inertial_to_ecef) -> np.ndarray:
        """Flux density [T] in the inertial frame; the velocities are not used."""
        r_inertial = rows("r_inertial", r_inertial, 3)
        out = np.empty_like(r_inertial)
        dcm = rows("dcm_inertial_to_ecef", dcm_inertial_to_ecef, 3, 3, count=len(out))
        type(self).in_space(packed, r_inertial, dcm, out)
        return out


def rows(name: str, value, *shape: int, count: int | None = None) -> np.ndarray:
    """A contiguous float64 array of n rows (or exactly `count`), each of the given shape."""
    array = np.ascontiguousarray(value, dtype=np.float64)
    if array.shape[1:] != shape or (count is not None and len(array) != count):
        first = "n" if count is None else count
        wanted = ", ".join(str(size) for size in (first, *shape))
        raise ValueError(f"{name}: must have shape ({wanted}); received shape {array.shape}")
    return array


@kernel
def row_vector(a, i):
    """Row i of an `[n, 3]` array as a tuple."""
    return (a[i, 0], a[i, 1], a[i, 2])


@kernel
def row_matrix(a, i):
    """Matrix i of an `[n, 3, 3]` array as a tuple of rows."""
    return (
        (a[i, 0, 0], a[i, 0, 1], a[i, 0, 2]),
        (a[i, 1, 0], a[i, 1, 1], a[i, 1, 2]),
        (a[i, 2, 0], a[i, 2, 1], a[i, 2, 2]),
    )
