"""The only gate for numbers: what must hold, and what was received.

Every function returns the checked value or raises `ValueError` with one clear line.
Kernels check nothing; objects call these once, on creation.
"""

import numpy as np


def finite(name: str, value, shape: tuple | None = None) -> np.ndarray:
    """A finite float64 array, of the given shape if one is given."""
    try:
        array = np.asarray(value, dtype=np.float64)
        _no_text_no_truth(value)
    except (TypeError, ValueError):
        raise ValueError(f"{name}: must be numbers; received {value!r}") from None
    if shape is not None and array.shape != shape:
        raise ValueError(f"{name}: must have shape {shape}; received shape {array.shape}")
    if not np.all(np.isfinite(array)):
        raise ValueError(f"{name}: must be finite; received {value!r}")
    return array


def _no_text_no_truth(value) -> None:
    """TypeError for what NumPy takes for numbers and is none: "500", and true for 1."""
    if isinstance(value, np.ndarray) and value.dtype.kind in "fiu":
        return
    for one in np.asarray(value, dtype=object).flat:
        if isinstance(one, bool | np.bool_ | str | bytes):
            raise TypeError


def inertia_tensor(name: str, value) -> np.ndarray:
    """A physical inertia tensor [kg m^2]: symmetric, positive definite, triangle inequality.

    Three numbers are taken as a diagonal tensor in principal axes. Asymmetry of the size of
    rounding (1e-9 of the largest entry) is taken out.
    """
    tensor = finite(name, value)
    if tensor.shape == (3,):
        tensor = np.diag(tensor)
    if tensor.shape != (3, 3):
        raise ValueError(
            f"{name}: must be 3 moments or a 3x3 tensor; received shape {tensor.shape}"
        )
    if not np.allclose(tensor, tensor.T, rtol=0.0, atol=1e-9 * np.abs(tensor).max()):
        raise ValueError(f"{name}: must be symmetric; received {tensor.tolist()}")
    tensor = 0.5 * (tensor + tensor.T)
    moments = np.linalg.eigvalsh(tensor)
    shown = ", ".join(f"{m:.6g}" for m in moments)
    if moments[0] <= 0.0:
        raise ValueError(
            f"{name}: must be positive definite; received principal moments {shown} kg m^2"
        )
    if moments[0] + moments[1] < moments[2] * (1.0 - 1e-12):
        raise ValueError(
            f"{name}: the sum of two principal moments must not be below the third "
            f"(triangle inequality); received {shown} kg m^2"
        )
    return tensor


def unit_rows(name: str, value) -> np.ndarray:
    """Rows scaled to length one (rows that have it stay, to the bit); a zero row is an error."""
    rows = np.atleast_2d(finite(name, value))
    lengths = np.linalg.norm(rows, axis=1)
    if rows.ndim != 2 or rows.shape[1] != 3 or np.any(lengths == 0.0):
        raise ValueError(f"{name}: must be non-zero vectors of 3 numbers; received {rows.tolist()}")
    # what has length one already stays bit for bit: axes are stored and read back
    lengths[np.abs(lengths - 1.0) < 1e-15] = 1.0
    return rows / lengths[:, None]


def rotation_matrix(name: str, value) -> np.ndarray:
    """A proper rotation matrix, to 1e-9."""
    matrix = finite(name, value, (3, 3))
    error = np.abs(matrix @ matrix.T - np.eye(3)).max()
    if error > 1e-9 or np.linalg.det(matrix) < 0.0:
        raise ValueError(
            f"{name}: must be a right-handed rotation matrix; received one that is off by "
            f"{error:.3g} with determinant {np.linalg.det(matrix):.6g}"
        )
    return matrix
