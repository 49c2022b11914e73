"""Rows of a number for plots: all of few, of many the least and the greatest of each bin.

Bins divide the stretches in which there are rows, again and again until there are enough of them:
however wide the span, what is far from the rest has bins of its own. Infinities are no extremes:
the first of either sign in a bin is a row of its own beside them. Where nothing was known in a bin
there is a row without a value, and where rows are missing one that stands for none.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

#: Columns of time that an interval may be of.
TIMES = {"time": "_time_ms", "received": "_received_ms"}
#: Rows are missing where the next one comes later than so many usual times between two.
_GAP = 10
#: Usual is the median of so many steps before and after.
_ABOUT = 10
#: The share of all rows that gaps may add.
_GAPS = 0.1
#: What SQLite reads as infinite.
_INFINITE = "9e999"


class Point(NamedTuple):
    """A row of one number; times in ms since 1970.

    `rows`: how many it stands for; 0: a gap, whose times are between two rows.
    """

    time_ms: int
    received_ms: int | None
    value: float | str | None
    quality: int | None
    rows: int = 1


class _Source(NamedTuple):
    """Where the rows are: connection, table, column of the times, column of the number."""

    db: sqlite3.Connection
    packet: str
    at: str
    value: str

    def select(self, what: str, where: str, *values) -> list[tuple]:
        """Rows of an interval; `where`: further conditions, and order."""
        return self.db.execute(
            f'SELECT {what} FROM "{self.packet}" WHERE {self.at} BETWEEN ? AND ? {where}', values
        ).fetchall()

    def place(self, point: Point) -> tuple[int, int]:
        """What puts points in order: the time that is asked for, then on-board time."""
        if self.at == TIMES["received"]:
            return point.received_ms or 0, point.time_ms
        return point.time_ms, 0

    def edge(self, order: str, start_ms: int, end_ms: int) -> int | None:
        """The first (ASC) or last (DESC) time of an interval; None if there is none."""
        found = self.select(self.at, f"ORDER BY {self.at} {order} LIMIT 1", start_ms, end_ms)
        return found[0][0] if found else None

    def tight(self, first: int, end_ms: int) -> tuple[int, int]:
        """An interval that begins with a row, up to its last one."""
        last = self.edge("DESC", first, end_ms)
        return first, first if last is None else last


def points(
    db: sqlite3.Connection,
    packet: str,
    number: str,
    start_ms: int,
    end_ms: int,
    size: int,
    by: str = "time",
) -> list[Point]:
    """Rows of a number from start to end, in order of time: about `size` at most, see above.

    Names must be of the dictionary, `by` of `TIMES`.
    """
    source = _Source(db, packet, TIMES[by], f'"{number}"')
    rows = source.select(
        f"_time_ms, _received_ms, {source.value}, _quality",
        f"ORDER BY {source.at} LIMIT ?",
        *(start_ms, end_ms, size + 1),
    )
    most_gaps = max(1, int(_GAPS * size))
    if len(rows) <= size:
        groups = [[Point(*row)] for row in rows]
        at = np.array([row[TIMES[by] == "_received_ms"] for row in rows], np.int64)
        wide = np.diff(at) > _GAP * usual_steps(np.diff(at))
        return _with_gaps(groups, np.diff(at), wide, most_gaps)
    return _with_gaps(*_binned(source, start_ms, end_ms, size), most_gaps)


def _binned(
    source: _Source, start_ms: int, end_ms: int, size: int
) -> tuple[list[list[Point]], np.ndarray, np.ndarray]:
    """Points of each bin; from the last row of each to the next one [ms]; whether it is a gap.

    A gap is longer than the usual times between rows, and than the bins beside it: others would
    not be seen.
    """
    infinite = f"AND {source.value} IN ({_INFINITE}, -{_INFINITE})"
    has_infinite = source.select("1", f"{infinite} LIMIT 1", start_ms, end_ms)
    ends = _ends_and_infinities if has_infinite else _ends
    groups, edges = [], []
    for first, end in _bins(source, start_ms, end_ms, size // (4 if has_infinite else 2)):
        groups.append(sorted(ends(source, first, end), key=source.place))
        edges.append(source.tight(first, end))
    firsts, lasts = np.array(edges, np.int64).T
    steps, spans = firsts[1:] - lasts[:-1], lasts - firsts
    counts = np.array([group[0].rows for group in groups])
    usual = spans / np.maximum(counts - 1, 1)
    known = usual[spans > 0]
    usual[spans == 0] = np.quantile(known, 0.5, method="lower") if len(known) else np.inf
    least = np.maximum(_GAP * usual, spans)
    return groups, steps, steps > np.maximum(least[1:], least[:-1])


def _bins(source: _Source, start_ms: int, end_ms: int, most: int) -> list[tuple[int, int]]:
    """Time of the first row and end of each bin that has rows: up to `most` bins."""
    bins = [*_stretches(source, [(start_ms, end_ms)], 1)]
    while (parts := most // len(bins)) > 1:
        finer = [*_stretches(source, [source.tight(*each) for each in bins], parts)]
        if len(finer) == len(bins):
            break
        bins = finer
    return bins


def _stretches(
    source: _Source, spans: Sequence[tuple[int, int]], parts: int
) -> Iterator[tuple[int, int]]:
    """Spans in equal parts, each from its first row to its end; none without rows."""
    for start_ms, end_ms in spans:
        width, at = max(1, -(-(end_ms - start_ms + 1) // parts)), start_ms
        while at <= end_ms and (first := source.edge("ASC", at, end_ms)) is not None:
            at = start_ms + ((first - start_ms) // width + 1) * width
            yield first, min(at - 1, end_ms)


def _ends(source: _Source, first: int, last: int) -> set[Point]:
    """The least and the greatest value of a bin, or that none is known."""
    # SQLite takes the other columns from the row that has the least or greatest value
    what = f"_time_ms, _received_ms, {{}}({source.value}), _quality"
    (low,) = source.select(f"{what.format('min')}, count(*)", "", first, last)
    if low[2] is None:
        return {Point(*low)}
    (high,) = source.select(what.format("max"), f"AND {source.value} IS NOT NULL", first, last)
    return {Point(*low), Point(*high)._replace(rows=low[4])}


def _ends_and_infinities(source: _Source, first: int, last: int) -> set[Point]:
    """The same of the finite values, and the first infinity of either sign."""
    value, count = source.value, f"sum({source.value} IN ({_INFINITE}, -{_INFINITE}))"
    finite = f"CASE WHEN {value} NOT IN ({_INFINITE}, -{_INFINITE}) THEN {value} END"
    what = "_time_ms, _received_ms, {}, _quality, count(*)"
    ((*low, infinite),) = source.select(
        f"{what.format(f'min({finite})')}, {count}", "", first, last
    )
    if low[2] is None and not infinite:
        return {Point(*low)}
    found = set() if low[2] is None else {Point(*low)}
    if low[2] is not None:
        ((*high,),) = source.select(what.format(f"max({finite})"), "", first, last)
        found.add(Point(*high))
    for sign in ("", "-") if infinite else ():
        row = f"_time_ms, _received_ms, {value}, _quality"
        found |= {
            Point(*each)._replace(rows=low[4])
            for each in source.select(row, f"AND {value} = {sign}{_INFINITE} LIMIT 1", first, last)
        }
    return found


def _with_gaps(
    groups: list[list[Point]], steps: np.ndarray, wide: np.ndarray, most: int
) -> list[Point]:
    """Points with one that stands for no row in each of the widest gaps between groups."""
    at = np.flatnonzero(wide)
    widest = {*at[np.argsort(-steps[at], kind="stable")][:most].tolist()}
    found: list[Point] = []
    for k, group in enumerate(groups):
        found += group
        if k in widest:
            found.append(_gap(group[-1], groups[k + 1][0]))
    return found


def usual_steps(steps: np.ndarray) -> np.ndarray:
    """The usual step about each: satellites send now more, now less often."""
    some = steps[steps > 0]
    if len(some) < 2:
        return np.full(len(steps), np.inf)
    # at the ends the steps are mirrored: a step that stands alone there is not usual
    about = min(_ABOUT, len(steps) - 1)
    around = np.pad(steps, about, "reflect")
    windows = np.lib.stride_tricks.sliding_window_view(around, 2 * about + 1)
    middle = np.quantile(some, 0.5, method="lower")
    return np.maximum(np.median(windows, axis=1), middle)


def _gap(before: Point, after: Point) -> Point:
    received_ms = None
    if before.received_ms is not None and after.received_ms is not None:
        received_ms = (before.received_ms + after.received_ms) // 2
    return Point((before.time_ms + after.time_ms) // 2, received_ms, None, None, 0)
