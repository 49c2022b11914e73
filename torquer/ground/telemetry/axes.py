"""Which axes of the body the axes of a magnetometer are, from the gyro and the Sun sensors.

|B| is the same however the axes are named. The gyro carries one reading into the next, and the
angle between field and Sun is known from the models: all 48 ways to name three axes are tried.
Without a Sun sensor a reversal of all three axes cannot be seen.
"""

from __future__ import annotations

from itertools import permutations, product
from typing import NamedTuple

import numpy as np
import xarray as xr

from torquer.environment.field.along import angles_deg

#: Rotation from row to row [rad] beyond which the gyro's mean rate says little.
_MOST_TURN = 1.5
_LEAST_ROWS = 10
_NAMES = ("x", "y", "z")


class Axes(NamedTuple):
    """Ways to name the axes, the best first, with their error [deg], and by what they were judged.

    `order` is what a mapping's `order.b_measured` must be for the readings as they are here.
    """

    orders: tuple[tuple[str, str, str], ...]
    errors_deg: np.ndarray
    stated_deg: float
    by: tuple[str, ...]

    @property
    def is_wrong(self) -> bool:
        """Whether another way fits better than the one stated, by a clear margin."""
        return self.orders[0] != _NAMES and self.errors_deg[0] < 0.6 * self.stated_deg


def _signed_permutations() -> tuple[np.ndarray, ...]:
    matrices = []
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            matrices.append(matrix)
    return tuple(matrices)


#: The 24 rotations and 24 reflections that take axes into axes.
SIGNED_PERMUTATIONS = _signed_permutations()


def axis_names(matrix: np.ndarray) -> tuple[str, str, str]:
    """The axis that each row of a signed permutation takes, such as ("x", "-z", "y")."""
    x, y, z = (("-" if row.sum() < 0.0 else "") + _NAMES[np.abs(row).argmax()] for row in matrix)
    return x, y, z


def rank_axes(data: xr.Dataset, b: np.ndarray, environment=None) -> Axes | None:
    """Rank the ways to name the axes of readings `b` [n, 3] T; None without gyro and Sun sensor.

    `environment`: for the angle between field and Sun.
    """
    judges = {}
    gyro = _pairs(data, b)
    if gyro is not None:
        judges["gyro"] = gyro
    sun = None if environment is None else _sun(data, b, environment)
    if sun is not None:
        judges["Sun"] = sun
    if not judges:
        return None
    ways = [(axis_names(matrix), matrix.T) for matrix in SIGNED_PERMUTATIONS]
    if "Sun" not in judges:  # of a way and its reverse the one with fewer signs
        ways = [way for way in ways if sum(name[0] == "-" for name in way[0]) < 2]
    errors = np.array(
        [np.sqrt(np.mean([judge(matrix) ** 2 for judge in judges.values()])) for _, matrix in ways]
    )
    rank = np.argsort(errors, kind="stable")
    stated = next(e for (order, _), e in zip(ways, errors, strict=True) if order == _NAMES)
    orders = tuple(ways[k][0] for k in rank)
    return Axes(orders, np.degrees(errors[rank]), float(np.degrees(stated)), tuple(judges))


def _units(vectors):
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-30)


def _pairs(data, b):
    """Error [rad] of carrying each reading into the next by the gyro; None with too few pairs."""
    if "omega_measured" not in data:
        return None
    from scipy.spatial.transform import Rotation

    omega, t_s = data["omega_measured"].values, data["time"].values
    turn = 0.5 * (omega[1:] + omega[:-1]) * np.diff(t_s)[:, None]
    known = np.isfinite(b).all(axis=1)
    size = np.linalg.norm(turn, axis=1)
    used = known[1:] & known[:-1] & (size < _MOST_TURN) & (np.diff(t_s) < 1.5 * _cadence(t_s))
    if np.sum(used) < _LEAST_ROWS or not np.nanmedian(size[used]) > 0.02:
        return None
    back = Rotation.from_rotvec(-turn[used])
    first, second = _units(b[:-1][used]), _units(b[1:][used])

    def error(matrix) -> float:
        carried = back.apply(first @ matrix.T)
        return float(np.median(np.radians(angles_deg(carried, second @ matrix.T))))

    return error


def _sun(data, b, environment):
    """Error [rad] of the angle between field and Sun; None where the Sun is seen too seldom."""
    if "sun_measured" not in data:
        return None
    sun, t_s = data["sun_measured"].values, data["time"].values
    seen = np.isfinite(sun).all(axis=1) & (np.abs(sun).sum(axis=1) > 0.5) & np.isfinite(b).all(1)
    if np.sum(seen) < _LEAST_ROWS:
        return None
    r, v = environment.state(t_s[seen])
    b_j, to_sun = environment.field(t_s[seen], r, v), environment.sun(t_s[seen]) - r
    true_deg = angles_deg(b_j, to_sun)
    ours, theirs = b[seen], sun[seen]

    def error(matrix) -> float:
        off_deg = np.abs(angles_deg(ours @ matrix.T, theirs) - true_deg)
        return float(np.radians(np.median(off_deg)))

    return error


def _cadence(t_s) -> float:
    return float(np.median(np.diff(t_s)))
