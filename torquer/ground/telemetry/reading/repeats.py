"""Numbers that repeat: rows held, sequences logged again under other stamps, axes that stand still.

They are noted, not left out: which of two equal sequences is where it belongs is not known here.
"""

from __future__ import annotations

import numpy as np

from torquer.ground.telemetry.reading.table import Finding

#: A sequence is logged again from so many rows on, and so many different ones in it.
_AGAIN_ROWS, _AGAIN_NUMBERS = 8, 4
#: An axis stands still from so many rows on, and so many times as long as is usual for it.
_STILL_ROWS, _STILL_TIMES = 20, 10


def describe_repeats(name: str, utc: np.ndarray, rows: np.ndarray) -> list[Finding]:
    """What repeats in rows [n, 3] without missing numbers, at UTC stamps [n] that ascend."""
    if len(rows) < 2:
        return []
    changes = np.diff(rows, axis=0) != 0.0
    found = []
    held = 1 + np.flatnonzero(~changes.any(axis=1))
    if len(held):
        verb = "rows repeat" if len(held) > 1 else "row repeats"
        span = say_span(utc, held)
        text = f"{name}: {len(held)} {verb} the row before, number for number, {span}"
        found.append(Finding("repeated", len(held), text))
    fresh = np.append(0, 1 + np.flatnonzero(changes.any(axis=1)))
    return [*found, *_again(name, utc[fresh], rows[fresh]), *_still_axes(name, utc, changes)]


def say_span(utc: np.ndarray, rows) -> str:
    """The first and the last of some rows in words."""
    first, last = (f"{np.datetime_as_string(utc[k], unit='s')}Z" for k in (rows[0], rows[-1]))
    return f"at {first}" if first == last else f"from {first} to {last}"


def _again(name: str, utc: np.ndarray, rows: np.ndarray) -> list[Finding]:
    """Sequences of rows that repeat an earlier sequence under other stamps."""
    _, first, which = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    first = first[which.reshape(-1)]
    apart = np.arange(len(rows)) - first
    runs = np.split(np.arange(len(rows)), 1 + np.flatnonzero(np.diff(apart)))
    runs = [run for run in runs if apart[run[0]] > 1 and _is_sequence(first[run])]
    if not runs:
        return []
    count, longest = sum(map(len, runs)), max(runs, key=len)
    more = f"; and {len(runs) - 1} more such parts" if len(runs) > 1 else ""
    text = (
        f"{name}: {count} rows repeat earlier ones under other stamps, number for number: those "
        f"{say_span(utc, longest)} are those {say_span(utc, first[longest])}{more}"
    )
    return [Finding("logged again", count, text)]


def _is_sequence(first: np.ndarray) -> bool:
    return len(first) >= _AGAIN_ROWS and len(np.unique(first)) >= _AGAIN_NUMBERS


def _still_axes(name: str, utc: np.ndarray, changes: np.ndarray) -> list[Finding]:
    """Axes that stand still for long while another changes; `changes` [n - 1, 3]."""
    found = []
    for k, axis in enumerate("xyz"):
        length = np.diff(np.append(-1, np.flatnonzero(np.append(changes[:, k], True))))
        longest = int(np.argmax(length))
        rest = np.delete(length, longest)
        usual = float(np.median(rest)) if len(rest) else 0.0
        if length[longest] < max(_STILL_ROWS, _STILL_TIMES * usual):
            continue
        run = length[:longest].sum() + np.arange(length[longest])
        if changes[run[:-1]].any(axis=1).mean() > 0.5:
            text = (
                f"{name}: {axis} stands still in {len(run)} rows, {say_span(utc, run)}, while "
                "another axis changes: is it frozen, or the wrong column?"
            )
            found.append(Finding("axis stands still", len(run), text))
    return found
