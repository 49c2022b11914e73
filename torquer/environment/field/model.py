"""The interface of all field models."""

from typing import Protocol

import numpy as np

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
