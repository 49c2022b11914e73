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
#: A turn of the body is told from that of the field along the orbit if it is so many times larger;
#: the rate of the latter in low orbit [rad/s].
_LEAST_TURNS, _FIELD_RATE = 4.0, 2.2e-3
_LEAST_ROWS = 10
#: Another way is named if its error is below this part of the stated one's and this angle [deg],
#: and the stated one is the best in less than this part of the draws.
_CLEARLY, _GREATEST_DEG, _BY_CHANCE = 0.6, 10.0, 0.01
#: Blocks of time, draws of them, and rows that are used at most by each judge.
_BLOCKS, _DRAWS, _MOST_ROWS = 8, 400, 2000
#: Ways that are shown, and the share from which on one is said to be right.
_SHOWN, _SURE = 4, 0.95
_NAMES = ("x", "y", "z")


class Axes(NamedTuple):
    """Ways to name the axes, the best first, with their error [deg] and how probable each is, and
    by what they were judged.

    `order` is what a mapping's `order.b_measured` must be for the readings as they are here.
    `shares`: how often each is the best one where blocks of time are drawn again, with replacement.
    """

    orders: tuple[tuple[str, str, str], ...]
    errors_deg: np.ndarray
    shares: np.ndarray
    by: tuple[str, ...]

    @property
    def stated_deg(self) -> float:
        """Error of the axes as they are stated [deg]."""
        return float(self.errors_deg[self.orders.index(_NAMES)])

    @property
    def is_wrong(self) -> bool:
        """Whether another way fits better than the one stated by a clear margin, and well."""
        is_well = self.errors_deg[0] < min(_CLEARLY * self.stated_deg, _GREATEST_DEG)
        return is_well and bool(self.shares[self.orders.index(_NAMES)] < _BY_CHANCE)

    @property
    def said(self) -> str:
        """What the axes are, or that they are not as stated."""
        known = self.shares[0] > _SURE
        return (
            f"the axes of the magnetometer are {list(self.orders[0])}"
            if known
            else ("the axes of the magnetometer are not as stated")
        )

    @property
    def text(self) -> str:
        """The ranking in words."""
        ways = (
            f"{' '.join(order)} {error:.1f} deg ({100.0 * share:.0f} %)"
            for order, error, share in zip(self.orders, self.errors_deg, self.shares, strict=True)
        )
        return f"by {' and '.join(self.by)}: " + ", ".join(list(ways)[:_SHOWN])


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
    gyro = _pairs(data, b, environment)
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
    each = np.array([[judge(matrix) for judge in judges.values()] for _, matrix in ways])
    errors = np.sqrt(np.mean(np.median(each, axis=2) ** 2, axis=1))
    rank = np.argsort(errors, kind="stable")
    orders = tuple(ways[k][0] for k in rank)
    return Axes(orders, np.degrees(errors[rank]), _shares(each)[rank], tuple(judges))


def _shares(each: np.ndarray) -> np.ndarray:
    """How often each way is the best one: `each` [ways, judges, blocks] of medians."""
    drawn = np.random.default_rng(0).integers(0, _BLOCKS, (_DRAWS, _BLOCKS))
    means = each[:, :, drawn].mean(axis=3)  # ways, judges, draws
    errors = np.sqrt(np.mean(means**2, axis=1))
    best = errors <= errors.min(axis=0) * (1.0 + 1e-9)
    return (best / best.sum(axis=0)).mean(axis=1)


def _by_blocks(off: np.ndarray) -> np.ndarray:
    """Median of angles [n] in each block of time."""
    return np.array([np.median(part) for part in np.array_split(off, _BLOCKS)])


def _units(vectors):
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-30)


def _pairs(data, b, environment):
    """Errors [blocks] rad of carrying each reading into the next by the gyro; None with too few."""
    if "omega_measured" not in data:
        return None
    from scipy.spatial.transform import Rotation

    omega, t_s = data["omega_measured"].values, data["time"].values
    turn = 0.5 * (omega[1:] + omega[:-1]) * np.diff(t_s)[:, None]
    known = np.isfinite(b).all(axis=1)
    size = np.linalg.norm(turn, axis=1)
    used = known[1:] & known[:-1] & (size < _MOST_TURN) & (np.diff(t_s) < 1.5 * _cadence(t_s))
    used &= size > _LEAST_TURNS * _own_turn(t_s, environment)
    if np.sum(used) < _LEAST_ROWS or not np.nanmedian(size[used]) > 0.02:
        return None
    used = _thinned(used)
    back = Rotation.from_rotvec(-turn[used])
    first, second = _units(b[:-1][used]), _units(b[1:][used])

    def error(matrix) -> np.ndarray:
        carried = back.apply(first @ matrix.T)
        return _by_blocks(np.radians(angles_deg(carried, second @ matrix.T)))

    return error


def _own_turn(t_s, environment):
    """Angle [n - 1] rad by which the field along the orbit turns from row to row by itself."""
    if environment is None:
        return _FIELD_RATE * np.diff(t_s)
    field = environment.field(t_s, *environment.state(t_s))
    return np.radians(angles_deg(field[:-1], field[1:]))


def _sun(data, b, environment):
    """Errors [blocks] rad of the angle between field and Sun; None where it is seen too seldom."""
    if "sun_measured" not in data:
        return None
    sun, t_s = data["sun_measured"].values, data["time"].values
    seen = np.isfinite(sun).all(axis=1) & (np.abs(sun).sum(axis=1) > 0.5) & np.isfinite(b).all(1)
    if np.sum(seen) < _LEAST_ROWS:
        return None
    seen = _thinned(seen)
    r, v = environment.state(t_s[seen])
    b_j, to_sun = environment.field(t_s[seen], r, v), environment.sun(t_s[seen]) - r
    true_deg = angles_deg(b_j, to_sun)
    ours, theirs = b[seen], sun[seen]

    def error(matrix) -> np.ndarray:
        off_deg = np.abs(angles_deg(ours @ matrix.T, theirs) - true_deg)
        return _by_blocks(np.radians(off_deg))

    return error


def _thinned(rows: np.ndarray) -> np.ndarray:
    """Indices of rows, not too many."""
    found = np.flatnonzero(rows)
    return found[np.linspace(0, len(found) - 1, min(len(found), _MOST_ROWS)).astype(int)]


def _cadence(t_s) -> float:
    return float(np.median(np.diff(t_s)))
