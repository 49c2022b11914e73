"""Rows of a magnetometer that say something: not missing, held, frozen or at the end of the range.

A reading that is logged again before the sensor has a new one is held; one that stands still for
far longer than is usual in the file is frozen. Neither is judged by a model of the field.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

#: A reading that repeats is frozen from so many rows on, and so many times as often as is usual.
_FROZEN_ROWS, _FROZEN_TIMES = 4, 6
#: An axis is saturated where its greatest or least number stands in so many rows and this part of
#: all, and so many times as often as the next number: near a turning point that is 2.4 times.
_END_ROWS, _END_PART, _END_TIMES = 4, 0.01, 5
#: A row jumps where it is so many times as far from the middle of its neighbours as is usual, and
#: the steps to both are alike within this factor.
_JUMP, _EVEN = 6.0, 1.5
#: Parts of the rows from which on frozen and saturated ones are reported.
WORTH_SAYING = 0.01


class Usable(NamedTuple):
    """Which rows [n] are usable, and which of the others are frozen and saturated."""

    kept: np.ndarray
    frozen: np.ndarray
    saturated: np.ndarray


def find_usable(t_s: np.ndarray, m: np.ndarray) -> Usable:
    """Rows of readings `m` [n, 3] at times [n] s that say something of the field."""
    known = np.isfinite(m).all(axis=1) & (np.abs(m).sum(axis=1) > 0.0)
    same = np.append(False, (m[1:] == m[:-1]).all(axis=1))[: len(m)]
    frozen = _frozen(same) & known
    saturated = np.zeros(len(m), bool)
    for axis in m.T:
        saturated |= _at_end(axis, known & ~same) | _at_end(-axis, known & ~same)
    saturated &= known & ~frozen
    kept = np.flatnonzero(known & ~frozen & ~same & ~saturated)
    calm = np.zeros(len(m), bool)
    calm[kept[~_jumps(t_s[kept], m[kept])]] = True
    return Usable(calm, frozen, saturated)


def _frozen(same: np.ndarray) -> np.ndarray:
    """Rows of the long stretches in which all repeat the row before; the first is one of them."""
    starts = np.flatnonzero(~same)
    if not len(starts):
        return np.zeros(len(same), bool)
    length = np.diff(np.append(starts, len(same)))
    usual = float(np.median(length))
    long = length - 1 >= max(_FROZEN_ROWS, _FROZEN_TIMES * usual)
    return np.repeat(long, length)


def _jumps(t_s: np.ndarray, m: np.ndarray) -> np.ndarray:
    """Rows that jump out of the course of their neighbours."""
    found = np.zeros(len(m), bool)
    if len(m) < 5:
        return found
    before, after = np.diff(t_s)[:-1], np.diff(t_s)[1:]
    even = (before < _EVEN * after) & (after < _EVEN * before)
    bend = np.linalg.norm(m[1:-1] - 0.5 * (m[:-2] + m[2:]), axis=1) * even
    beside = np.maximum(np.append(0.0, bend[:-1]), np.append(bend[1:], 0.0))
    usual = np.median(bend[even]) if even.any() else np.inf
    found[1:-1] = (bend > _JUMP * usual) & (bend >= beside)
    return found


def _at_end(values: np.ndarray, fresh: np.ndarray) -> np.ndarray:
    """Rows at the greatest number of an axis where it is the end of the sensor's range; few gross
    ones may be beyond."""
    if not fresh.any():
        return np.zeros(len(values), bool)
    numbers, counts = np.unique(values[fresh], return_counts=True)
    beyond = max(1, int(_END_PART * fresh.sum()))
    end = len(counts) - 1 - int(np.argmax(counts[: -beyond - 2 : -1]))
    following = counts[end - 1] if end > 0 else 0
    least = max(_END_ROWS, _END_PART * fresh.sum(), _END_TIMES * following)
    return (values == numbers[end]) & (end > 0) & (counts[end] >= least)
