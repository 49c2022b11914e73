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
    if len(rows) <= size:
        found = [Point(*row) for row in rows]
    else:
        found = _binned(source, start_ms, end_ms, size)
    return _with_gaps(found, TIMES[by] == "_received_ms", max(1, int(_GAPS * size)))


def _binned(source: _Source, start_ms: int, end_ms: int, size: int) -> list[Point]:
    infinite = f"AND {source.value} IN ({_INFINITE}, -{_INFINITE})"
    has_infinite = source.select("1", f"{infinite} LIMIT 1", start_ms, end_ms)
    ends = _ends_and_infinities if has_infinite else _ends
    found: list[Point] = []
    for first, last in _bins(source, start_ms, end_ms, size // (4 if has_infinite else 2)):
        found += sorted(ends(source, first, last), key=lambda point: point.time_ms)
    return found


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


def _with_gaps(found: list[Point], by_reception: bool, most: int) -> list[Point]:
    """Points with one that stands for no row in each of the widest gaps."""
    at = [(p.received_ms or 0) if by_reception else p.time_ms for p in found]
    steps = np.diff(np.array(at, np.int64))
    wide = np.flatnonzero(steps > _GAP * _usual(steps))
    widest = wide[np.argsort(-steps[wide], kind="stable")][:most]
    for k in sorted(widest.tolist(), reverse=True):
        found.insert(k + 1, _gap(found[k], found[k + 1]))
    return found


def _usual(steps: np.ndarray) -> np.ndarray:
    """The usual step about each: satellites send now more, now less often."""
    some = steps[steps > 0]
    if len(some) < 2:
        return np.full(len(steps), np.inf)
    around = np.pad(steps, _ABOUT, "reflect" if len(steps) > _ABOUT else "edge")
    windows = np.lib.stride_tricks.sliding_window_view(around, 2 * _ABOUT + 1)
    return np.maximum(np.median(windows, axis=1), np.median(some))


def _gap(before: Point, after: Point) -> Point:
    received_ms = None
    if before.received_ms is not None and after.received_ms is not None:
        received_ms = (before.received_ms + after.received_ms) // 2
    return Point((before.time_ms + after.time_ms) // 2, received_ms, None, None, 0)
