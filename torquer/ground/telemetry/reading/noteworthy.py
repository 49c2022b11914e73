"""What is noteworthy in the rows of telemetry: their order, gaps, odd numbers and quaternions."""

from __future__ import annotations

import numpy as np

from torquer.ground.telemetry.reading.quantities import ABSURD, COLUMNS, QUANTITIES
from torquer.ground.telemetry.reading.repeats import describe_repeats, say_span
from torquer.ground.telemetry.reading.table import Finding

#: A quaternion shorter than this states no attitude.
_NO_QUATERNION = 0.5
#: Departure from length 1 that rounding in telemetry does not explain.
_NOT_UNIT = 0.02
#: A step longer than this many times the cadence is a gap.
_GAP = 1.5
#: Rows farther than this from nearly all others, and fewer than this part of all, are of a clock
#: that was not set.
_ASTRAY, _FEW = np.timedelta64(31, "D"), 0.1
#: A row is a jump where it differs from both neighbours by so many times the usual step.
_JUMP = 12.0


def order_rows(utc, values, findings) -> tuple[np.ndarray, dict]:
    """Rows in order of time; of rows with one stamp the first."""
    back = int(np.sum(np.diff(utc) < np.timedelta64(0)))
    if back:
        findings.append(
            Finding(
                "not in order", back, f"stamps go back {back} time{'s' * (back > 1)}: rows sorted"
            )
        )
    order = np.argsort(utc, kind="stable")
    utc, values = utc[order], {name: each[order] for name, each in values.items()}
    doubled = np.append(False, np.diff(utc) == np.timedelta64(0))
    if np.any(doubled):
        rows = np.flatnonzero(doubled)
        same = np.ones(len(rows), dtype=bool)
        for each in values.values():
            equal = np.isclose(each[rows], each[rows - 1], rtol=0.0, atol=0.0, equal_nan=True)
            same &= equal if equal.ndim == 1 else equal.all(axis=1)
        findings.append(
            Finding(
                "doubled stamps",
                len(rows),
                f"{_count(rows)} the stamp of the row before, {say_span(utc, rows)} "
                f"({int(np.sum(~same))} of them with other values): the first of each is used",
            )
        )
        utc, values = utc[~doubled], {name: each[~doubled] for name, each in values.items()}
    return utc, values


def without_strays(utc, values, findings) -> tuple[np.ndarray, dict]:
    """Rows without those few whose stamps are more than a month from nearly all others."""
    groups = np.append(0, np.cumsum(np.diff(utc) > _ASTRAY))[: len(utc)]
    stray = groups != np.argmax(np.bincount(groups, minlength=1))
    if not 0 < np.sum(stray) < _FEW * len(utc):
        return utc, values
    days = ", ".join(sorted({str(each)[:10] for each in utc[stray]})[:3])
    findings.append(
        Finding(
            "clock not set",
            int(np.sum(stray)),
            f"{np.sum(stray)} rows are more than 31 days from all others ({days}) and left out: of "
            "a clock that was not set?",
        )
    )
    return utc[~stray], {name: each[~stray] for name, each in values.items()}


def check_quaternions(values: dict, findings: list[Finding]) -> None:
    for name, each in values.items():
        if QUANTITIES[name].dimension != "component":
            continue
        length = np.linalg.norm(each, axis=1)
        none = length < _NO_QUATERNION
        odd = ~none & (np.abs(length - 1.0) > _NOT_UNIT)
        if np.any(none):
            text = f"{name}: {int(none.sum())} quaternions near zero are taken for missing"
            findings.append(Finding("near-zero quaternions", int(none.sum()), text))
        if np.any(odd):
            text = f"{name}: {int(odd.sum())} quaternions are not of length 1: normalised"
            findings.append(Finding("quaternions not of length 1", int(odd.sum()), text))
        length = np.where(none, np.nan, length)
        values[name] = each / length[:, None]


def describe_stamps(utc: np.ndarray) -> list[Finding]:
    if len(utc) < 3:
        return []
    steps = np.diff(utc) / np.timedelta64(1, "s")
    cadence = float(np.median(steps))
    gaps = np.flatnonzero(steps > _GAP * cadence)
    if not len(gaps):
        return []
    longest = gaps[np.argmax(steps[gaps])]
    count = f"{len(gaps)} gap{'s' * (len(gaps) > 1)}"
    text = (
        f"{count}: steps longer than {_GAP:g} times the cadence of {cadence:.6g} s, the "
        f"longest {steps[longest]:.6g} s after {np.datetime_as_string(utc[longest], unit='s')}Z"
    )
    return [Finding("gaps", len(gaps), text)]


def describe_values(utc: np.ndarray, values: dict[str, np.ndarray]) -> list[Finding]:
    """What is odd in the numbers of rows at UTC stamps [n] that ascend."""
    found = []
    for name, each in values.items():
        rows = each if each.ndim == 2 else each[:, None]
        missing = np.isnan(rows).any(axis=1)
        if np.any(missing):
            count = int(missing.sum())
            text = f"{name}: {count} row{'s' * (count > 1)} without a number"
            found.append(Finding("missing", count, text))
        if name not in ("b_measured", "omega_measured"):
            continue
        zero = (rows == 0.0).all(axis=1)
        if np.any(zero):
            text = f"{name}: {int(zero.sum())} rows of zeros"
            found.append(Finding("zeros", int(zero.sum()), text))
        jumps = _jumps(utc, rows)
        if jumps:
            verb = "rows jump" if jumps > 1 else "row jumps"
            text = f"{name}: {jumps} {verb} out of the course of the rows beside"
            found.append(Finding("jumps", jumps, text))
        found += describe_repeats(name, utc[~missing], rows[~missing])
    return found


def _count(rows) -> str:
    return f"{len(rows)} rows have" if len(rows) > 1 else "1 row has"


def _jumps(utc: np.ndarray, rows: np.ndarray) -> int:
    """Rows whose second difference is far beyond the usual one, each counted once; not at gaps."""
    if len(rows) < 8:
        return 0
    steps = np.diff(utc)
    whole = np.maximum(steps[:-1], steps[1:]) <= _GAP * np.median(steps)
    bend = np.linalg.norm(rows[1:-1] - 0.5 * (rows[:-2] + rows[2:]), axis=1) * whole
    usual = np.nanmedian(bend[whole]) if whole.any() else 0.0
    before = np.nan_to_num(np.append(0.0, bend[:-1]))
    after = np.nan_to_num(np.append(bend[1:], 0.0))
    peak = (bend > _JUMP * usual) & (bend >= before) & (bend >= after)
    return int(np.sum(peak)) if usual > 0.0 else 0


def without_absurd(name: str, values: np.ndarray, notes: list[Finding]) -> np.ndarray:
    """Numbers [n] or [n, k], SI, without those that are infinite or beyond `ABSURD`."""
    with np.errstate(invalid="ignore"):
        absurd = ~np.isnan(values) & ~(np.abs(values) < ABSURD)
    if not absurd.any():
        return values
    rows = np.flatnonzero(absurd.reshape(len(values), -1).any(axis=1))
    first = values.reshape(len(values), -1)[rows[0]]
    worst = first[absurd.reshape(len(values), -1)[rows[0]]][0]
    text = (
        f"{name}: {name_rows(rows)} a number that no sensor sends, such as {worst:.3g} "
        f"{COLUMNS[name].units}: taken for missing"
    )
    notes.append(Finding("absurd numbers", len(rows), text))
    return np.where(absurd, np.nan, values)


def name_rows(rows) -> str:
    """Rows [k], counted from 0, in words: the first ones by their numbers, counted from 1."""
    numbers = ", ".join(str(row + 1) for row in rows[:3])
    if len(rows) == 1:
        return f"row {numbers} has"
    return f"rows {numbers}{f' and {len(rows) - 3} more' if len(rows) > 3 else ''} have"
