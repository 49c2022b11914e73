"""The only gate for numbers: what must hold, and what was received.

Every function returns the checked value or raises `ValueError` with one clear line.
Kernels check nothing; objects call these once, on creation.
"""

import math
import re
import sys
import unicodedata
from functools import cache
from typing import NamedTuple

import numpy as np

from torquer.base.columns import guard, has_columns, stacked


class Range(NamedTuple):
    """What a quantity can be in size, generously: the least (0 apart) and the greatest."""

    least: float
    greatest: float


_ANY = Range(0.0, sys.float_info.max)
#: Ranges by how a key ends, which is its unit; the longest ending counts. They are far wider than
#: hardware, and narrow enough for products and quotients of the numbers to stay within floats.
RANGES = {
    "": Range(0.0, 1e9),  # pure numbers
    "b0": Range(1e-15, 1e3),  # T
    "deg": Range(0.0, 1e6),  # beyond, rounding takes from an angle what turns leave of it
    "deg_s": Range(1e-15, 1e6),  # 170 000 rpm tears any satellite apart
    "deg_s2": Range(1e-15, 1e9),
    "deg_s_sqrt_s": Range(1e-15, 1e6),
    "deg_h": Range(1e-15, 1e9),  # as data sheets of gyros state it
    "deg_h_sqrt_h": Range(1e-15, 1e9),
    "deg_sqrt_h": Range(1e-15, 1e9),
    "arcsec": Range(1e-9, 1e9),
    "quantum_deg": Range(1e-12, 1e6),  # an angle is counted in quanta: none is next to nothing
    "rad_s": Range(1e-15, 1e6),
    "rpm": Range(1e-9, 1e9),  # rotors of centimetres have been driven to 1e6
    "s": Range(1e-9, 1e10),  # 300 years
    "per_s": Range(1e-15, 1e9),
    "kg_m2": Range(1e-12, 1e12),  # a gram of 0.03 mm; 10 000 space stations
    "kg": Range(1e-9, 1e12),
    "kg_m3": Range(1e-30, 1e3),  # less than an atom per cubic metre; water
    "m": Range(1e-9, 1e6),
    "m2": Range(1e-15, 1e12),
    "height_km": Range(1e-6, 1.5e6),  # the Earth's Hill sphere
    "km": Range(0.0, 1e300),  # orbits are checked as a whole: from the ground to the Hill sphere,
    "km_s": Range(0.0, 1e300),  # up to escape; these numbers can be turned into metres
    "n_m": Range(1e-15, 1e9),  # a micrometre's weight of dust; 100 000 t at a metre
    "n_m_s": Range(1e-15, 1e12),
    "a_m2": Range(1e-12, 1e9),  # a loop of 1 uA and 1 mm^2; an MRI magnet has 1e7
    "m3": Range(1e-18, 1e15),
    "a_m": Range(1e-9, 1e12),  # the greatest fields made are of 1e9
    "a": Range(1e-12, 1e6),
    "ohm": Range(1e-9, 1e12),
    "t": Range(1e-15, 1e3),
    "nt": Range(1e-9, 1e12),  # 1e-18 T is below any magnetometer; 1000 T is above any field
    "nt_s": Range(1e-9, 1e12),
    "nt_per_a_m2": Range(1e-9, 1e12),
    "t_km3": Range(1e-9, 1e15),  # the Sun has 1e14
    "w": Range(1e-12, 1e12),
    "gain_a_m2_s": Range(1e-15, 1e20),
    "gain_a_m2_s_per_t": Range(1e-15, 1e20),
    "gain_a_m2_per_t": Range(1e-15, 1e20),
    "gain_a_m2_per_n_m_s_t": Range(1e-15, 1e20),
    "gain_a_m2_s_t": Range(1e-30, 1e20),
    "n_m_s_per_t2": Range(1e-15, 1e20),
    "n_m_per_t2": Range(1e-15, 1e20),
    "table_tolerance": Range(1e-12, 1.0),  # next to rounding
    "axis": _ANY,  # directions of any length
    "axes": _ANY,
    "direction": _ANY,
    "target": _ANY,
    "first_coil": _ANY,
    "parameters": _ANY,  # of a user's law: who knows
    "limits": _ANY,  # of telemetry, in any unit
}


@cache
def quantity_range(key: str) -> Range:
    """The range of the quantity that a key holds."""
    endings = (ending for ending in RANGES if f"_{key}".endswith(f"_{ending}") or not ending)
    return RANGES[max(endings, key=len)]


def out_of_range(key: str, value: float, low: float | None = None) -> str:
    """What must hold of a number of the key, "" if it does.

    `low`: 0 for a quantity that is not negative; only of such the least size is asked, as of
    others a rounding error may be left where 0 is meant.
    """
    least, greatest = quantity_range(key)
    if abs(value) > greatest:
        return f"at most {greatest:g}" if low == 0.0 else f"within -{greatest:g}..{greatest:g}"
    if low == 0.0 and 0.0 < value < least:
        return f"at least {least:g}"
    return ""


def finite(name: str, value, shape: tuple | None = None) -> np.ndarray:
    """A finite float64 array, of the given shape if one is given."""
    if type(value) is float and not shape and math.isfinite(value):
        return np.asarray(value)  # what follows takes twenty times as long
    try:
        array = np.asarray(value, dtype=np.float64)
        _no_text_no_truth(value)
    except (TypeError, ValueError):
        raise ValueError(f"{name}: must be numbers; received {value!r}") from None
    except OverflowError:
        raise ValueError(f"{name}: must be numbers that a float can hold") from None
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


#: Bytes of the longest name: two of them with a prefix fit the 256 of a name in NetCDF.
_LONGEST_NAME = 100


def storable_name(key: str, name: str) -> None:
    """ValueError unless a name can be a part of the name of a variable in a NetCDF file.

    NetCDF stores names in Unicode's composed form (NFC); another form would not be found again.
    """
    if not re.fullmatch(r"\w[\w-]*", name) or not unicodedata.is_normalized("NFC", name):
        raise ValueError(
            f"{key}: a name must be of letters, digits, '_' and '-' (not first), to be stored; "
            f"received {name!r}"
        )
    if len(name.encode()) > _LONGEST_NAME:
        raise ValueError(
            f"{key}: a name must have at most {_LONGEST_NAME} bytes, to be stored; received "
            f"{len(name.encode())}"
        )


def storable_text(key: str, text) -> None:
    """ValueError unless a value is a text that NetCDF can hold as it is."""
    if not isinstance(text, str) or as_storable(text) != text:
        raise ValueError(f"{key}: must be text without NUL, to be stored; received {text!r}")


def as_storable(text: str) -> str:
    """Text from anywhere as NetCDF can hold it: NUL and lone surrogates become escapes."""
    return text.encode("utf-8", "backslashreplace").decode().replace("\0", "\\x00")


def inertia_tensor(name: str, value) -> np.ndarray:
    """A physical inertia tensor [kg m^2]: symmetric, positive definite, triangle inequality.

    Three numbers are taken as a diagonal tensor in principal axes. Asymmetry of the size of
    rounding (1e-9 of the largest entry) is taken out. (n, 3, 3) of columns.
    """
    tensor = stacked(value) if has_columns(value) else finite(name, value)
    if tensor.shape[has_columns(value) :] == (3,):
        tensor = tensor[..., None] * np.eye(3)
    if tensor.shape[has_columns(value) :] != (3, 3):
        raise ValueError(
            f"{name}: must be 3 moments or a 3x3 tensor; received shape {tensor.shape}"
        )
    least, greatest = RANGES["kg_m2"]
    size = np.abs(tensor).max(axis=(-2, -1))
    if guard(size > greatest):
        raise ValueError(
            f"{name}: must be at most {greatest:g} kg m^2; received {np.abs(tensor).max():g}"
        )
    turned = np.swapaxes(tensor, -2, -1)
    if not guard(np.all(np.abs(tensor - turned) <= 1e-9 * size[..., None, None], axis=(-2, -1))):
        raise ValueError(f"{name}: must be symmetric; received {tensor.tolist()}")
    tensor = 0.5 * (tensor + turned)
    moments = np.moveaxis(np.linalg.eigvalsh(tensor), -1, 0)
    shown = ", ".join(f"{m:.6g}" for m in moments if not m.ndim)
    if guard(moments[0] <= 0.0):
        raise ValueError(
            f"{name}: must be positive definite; received principal moments {shown} kg m^2"
        )
    if guard(moments[0] < least):
        raise ValueError(
            f"{name}: principal moments must be at least {least:g} kg m^2; received {shown}"
        )
    if guard(moments[0] + moments[1] < moments[2] * (1.0 - 1e-12)):
        raise ValueError(
            f"{name}: the sum of two principal moments must not be below the third "
            f"(triangle inequality); received {shown} kg m^2"
        )
    return tensor


def unit_rows(name: str, value) -> np.ndarray:
    """Rows scaled to length one (rows that have it stay, to the bit); a zero row is an error."""
    rows = np.atleast_2d(finite(name, value))
    if rows.ndim != 2 or rows.shape[1] != 3 or not np.all(np.any(rows != 0.0, axis=1)):
        raise ValueError(f"{name}: must be non-zero vectors of 3 numbers; received {rows.tolist()}")
    greatest = np.abs(rows).max(axis=1, keepdims=True)
    extreme = (greatest < 1e-100) | (greatest > 1e100)  # whose squares are out of range
    rows = rows / np.where(extreme, greatest, 1.0)
    lengths = np.linalg.norm(rows, axis=1)
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
