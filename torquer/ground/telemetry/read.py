"""From files and a mapping to a session, with everything noteworthy reported."""

from __future__ import annotations

import json
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from torquer.base.limits import RequestError
from torquer.ground.telemetry.mapping import COUNTED, DAYS, Mapping, names_in, parse_zone
from torquer.ground.telemetry.quantities import QUANTITIES, RENAMED, in_si, make_session, parse_unit
from torquer.ground.telemetry.tables import Table, read_table

#: A quaternion shorter than this states no attitude.
_NO_QUATERNION = 0.5
#: Departure from length 1 that rounding in telemetry does not explain.
_NOT_UNIT = 0.02
#: A step longer than this many times the cadence is a gap.
_GAP = 1.5
#: Rows farther than this from nearly all others, and fewer than this part of all, are of a clock
#: that was not set.
_ASTRAY, _FEW = np.timedelta64(366, "D"), 0.1
#: A row is a jump where it differs from both neighbours by so many times the usual step.
_JUMP = 12.0


class Finding(NamedTuple):
    """Something noteworthy in telemetry: a short key, how many rows, what in words."""

    key: str
    rows: int
    text: str


class Session(NamedTuple):
    """Telemetry: the data (`telemetry.quantities`), what was noteworthy in it, and whether its
    stamps state their own zone."""

    data: xr.Dataset
    findings: tuple[Finding, ...]
    zone_is_stated: bool = False


def read(paths, mapping: Mapping | None = None) -> Session:
    """Read telemetry from one file or several.

    Without `mapping` the files must hold a session or a result of this package (NetCDF). Rows are
    ordered by time. ValueError for a file that cannot be read, a column that is not there, text
    where numbers must be, stamps without a zone.
    """
    files = [paths] if isinstance(paths, str | Path) else list(paths)
    if not files:
        raise ValueError("FILE: must be given; received none")
    parts = [_part(Path(each), mapping) for each in files]
    names = sorted(set.intersection(*(set(values) for _, values in parts)))
    utc = np.concatenate([stamps for stamps, _ in parts])
    values = {name: np.concatenate([each[name] for _, each in parts]) for name in names}
    findings: list[Finding] = []
    lost = sorted({name for _, each in parts for name in each} - set(names))
    if lost:
        findings.append(Finding("not in all files", 0, f"not in all files: {', '.join(lost)}"))
    utc, values = _order(utc, values, findings)
    utc, values = _without_strays(utc, values, findings)
    _check_quaternions(values, findings)
    data = make_session(utc, values, source=", ".join(each.name for each in map(Path, files)))
    findings += _describe_stamps(utc) + _describe_values(values)
    data.attrs["findings"] = json.dumps([each._asdict() for each in findings])
    return Session(data, tuple(findings))


def _part(path: Path, mapping: Mapping | None) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    table = read_table(path, mapping)
    if mapping is None:
        return _own(table, path)
    for column in [
        *names_in(mapping.time),
        *(c for each in mapping.columns.values() for c in names_in(each)),
    ]:
        if column not in table.data:
            known = ", ".join(map(str, table.data.columns[:30]))
            raise ValueError(f"mapping: {column!r} must be a column of {path.name}: {known}")
    values = {name: _quantity(table, mapping, name) for name in mapping.columns}
    return _stamps(table, mapping), values


def _own(table: Table, path: Path) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """A session or a result of this package: names, units and dates are its own."""
    columns: dict[str, list] = {}
    for column in table.data:
        name = RENAMED.get(str(column).rpartition("_")[0], str(column).rpartition("_")[0])
        if column in QUANTITIES:
            columns[str(column)] = [column]
        elif name in QUANTITIES and QUANTITIES[name].size > 1:
            columns.setdefault(name, []).append(column)
    fits = {n: c for n, c in columns.items() if len(c) == QUANTITIES[n].size}
    if "utc" not in table.is_utc or not fits:
        raise RequestError(
            "mapping",
            "must be given for files that are not results of torquer; received none "
            f"(`torquer telemetry init {path.name}` proposes one)",
        )
    values = {
        name: np.squeeze(table.data[each].to_numpy(dtype=float)).reshape(
            (len(table.data), -1) if QUANTITIES[name].dimension else len(table.data)
        )
        for name, each in fits.items()
    }
    if "sun_measured" in values:
        values["sun_measured"] = np.nan_to_num(values["sun_measured"])
    return table.data["utc"].to_numpy("datetime64[ns]"), values


def _quantity(table: Table, mapping: Mapping, name: str) -> np.ndarray:
    """Values of a quantity [n] or [n, k], SI, axes and components in order."""
    quantity, columns = QUANTITIES[name], names_in(mapping.columns[name])
    if name in mapping.split:
        values = split_numbers(table, columns[0], mapping.split[name], quantity.size)
    else:
        values = np.stack([_numbers(table, column) for column in columns], axis=1)
    values = in_si(name, parse_unit(mapping.units.get(name, quantity.units)), values)
    if quantity.dimension == "component":
        if mapping.order.get(name, "xyzw") == "wxyz":
            values = values[:, [1, 2, 3, 0]]
        return values * ([-1.0, -1.0, -1.0, 1.0] if name in mapping.inverse else 1.0)
    if quantity.dimension == "axis":
        return _on_axes(values, names_in(mapping.order.get(name, ["x", "y", "z"])))
    if quantity.dimension == "cell" and values.shape[1] < quantity.size:
        return np.pad(values, ((0, 0), (0, quantity.size - values.shape[1])))
    return values if quantity.dimension else values[:, 0]


def _on_axes(values: np.ndarray, order: list[str]) -> np.ndarray:
    found = np.empty_like(values)
    for k, axis in enumerate(order):
        found[:, "xyz".index(axis[-1])] = -values[:, k] if axis[0] == "-" else values[:, k]
    return found


def _numbers(table: Table, column: str) -> np.ndarray:
    import pandas as pd

    given = table.data[column]
    numbers = pd.to_numeric(given, errors="coerce")
    wrong = given.notna() & numbers.isna()
    if wrong.any():
        row = int(np.flatnonzero(wrong)[0])
        raise ValueError(
            f"{column}: must hold numbers; received {str(given.iloc[row])[:60]!r} in row {row + 1} "
            "(`missing` lists texts that stand for none, `split` separates joined numbers)"
        )
    return numbers.to_numpy(dtype=float)


def split_numbers(table: Table, column: str, sign: str, size: int) -> np.ndarray:
    """Numbers that are joined in one column, rows of NaN where it is empty."""
    found = np.full((len(table.data), size), np.nan)
    for row, text in enumerate(table.data[column]):
        if not isinstance(text, str):
            continue
        parts = text.strip().strip("[](){}").split(None if sign == " " else sign)
        try:
            found[row] = [float(part) for part in parts]
        except ValueError:
            raise ValueError(
                f"{column}: must hold {size} numbers separated by {sign!r}; received "
                f"{text[:60]!r} in row {row + 1}"
            ) from None
    return found


def _stamps(table: Table, mapping: Mapping) -> np.ndarray:
    """Time stamps as datetime64[ns] in UTC; ValueError for one without a zone."""
    import pandas as pd

    columns = names_in(mapping.time)
    if mapping.time_format in COUNTED:
        counted = _numbers(table, columns[0]) * (1e9 / COUNTED[mapping.time_format])
        _check_stamps(np.isfinite(counted), table.data[columns[0]], columns[0])
        return np.rint(counted).astype("int64").astype("datetime64[ns]")
    if mapping.time_format in DAYS:
        days = _numbers(table, columns[0])
        _check_stamps(np.isfinite(days), table.data[columns[0]], columns[0])
        days = days - DAYS[mapping.time_format]
        return np.rint(days * 86400e9).astype("int64").astype("datetime64[ns]")
    text = table.data[columns[0]]
    if text.dtype.kind != "M" and not isinstance(text.dtype, pd.DatetimeTZDtype):
        text = text.astype(str).str.strip()
        for column in columns[1:]:
            text = text + " " + table.data[column].astype(str).str.strip()
        is_iso = mapping.time_format == "iso"
        try:
            stamps = pd.to_datetime(text, format="ISO8601" if is_iso else mapping.time_format)
        except ValueError as error:
            reason = str(error).split("\n")[0].split(". You might")[0][:150]
            raise ValueError(
                f"{columns[0]}: must be times of format {mapping.time_format!r}; {reason}"
            ) from None
    else:
        stamps = text
    _check_stamps(stamps.notna().to_numpy(), text, columns[0])
    if stamps.dt.tz is None:
        zone = "UTC" if columns[0] in table.is_utc else mapping.zone
        if zone is None:
            raise ValueError(
                "zone: must be given, as the stamps state none; received none for "
                f"{str(text.iloc[0])!r}"
            )
        try:
            stamps = stamps.dt.tz_localize(parse_zone(zone), ambiguous="raise", nonexistent="raise")
        except Exception as error:
            raise ValueError(
                f"zone: must be one in which every stamp is an instant; received {zone}: "
                f"{str(error).splitlines()[0]}"
            ) from None
    elif mapping.zone is not None:
        raise ValueError(
            f"zone: must not be given, as the stamps state their own; received {mapping.zone}"
        )
    return stamps.dt.tz_convert("UTC").dt.tz_localize(None).to_numpy("datetime64[ns]")


def _check_stamps(known: np.ndarray, given, column: str) -> None:
    if not np.all(known):
        row = int(np.flatnonzero(~known)[0])
        raise ValueError(
            f"{column}: must hold a time in every row; received {str(given.iloc[row])!r} "
            f"in row {row + 1}"
        )


def _order(utc, values, findings) -> tuple[np.ndarray, dict]:
    """Rows in order of time; of rows with one stamp the first."""
    back = int(np.sum(np.diff(utc) < np.timedelta64(0)))
    if back:
        findings.append(Finding("not in order", back, f"stamps go back {back} times: rows sorted"))
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
                f"{len(rows)} rows have the stamp of the row before ({int(np.sum(~same))} of them "
                "with other values): the first of each is used",
            )
        )
        utc, values = utc[~doubled], {name: each[~doubled] for name, each in values.items()}
    return utc, values


def _without_strays(utc, values, findings) -> tuple[np.ndarray, dict]:
    """Rows without those few whose stamps are years from nearly all others."""
    groups = np.append(0, np.cumsum(np.diff(utc) > _ASTRAY))[: len(utc)]
    stray = groups != np.argmax(np.bincount(groups, minlength=1))
    if not 0 < np.sum(stray) < _FEW * len(utc):
        return utc, values
    days = ", ".join(sorted({str(each)[:10] for each in utc[stray]})[:3])
    findings.append(
        Finding(
            "clock not set",
            int(np.sum(stray)),
            f"{np.sum(stray)} rows are more than a year from all others ({days}) and left out: of "
            "a clock that was not set?",
        )
    )
    return utc[~stray], {name: each[~stray] for name, each in values.items()}


def _check_quaternions(values: dict, findings: list[Finding]) -> None:
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


def _describe_stamps(utc: np.ndarray) -> list[Finding]:
    if len(utc) < 3:
        return []
    steps = np.diff(utc) / np.timedelta64(1, "s")
    cadence = float(np.median(steps))
    gaps = np.flatnonzero(steps > _GAP * cadence)
    if not len(gaps):
        return []
    longest = gaps[np.argmax(steps[gaps])]
    text = (
        f"{len(gaps)} gaps: steps longer than {_GAP:g} times the cadence of {cadence:.6g} s, the "
        f"longest {steps[longest]:.6g} s after {np.datetime_as_string(utc[longest], unit='s')}Z"
    )
    return [Finding("gaps", len(gaps), text)]


def _describe_values(values: dict[str, np.ndarray]) -> list[Finding]:
    found = []
    for name, each in values.items():
        rows = each if each.ndim == 2 else each[:, None]
        missing = np.isnan(rows).any(axis=1)
        if np.any(missing):
            text = f"{name}: {int(missing.sum())} rows without a number"
            found.append(Finding("missing", int(missing.sum()), text))
        if name not in ("b_measured", "omega_measured"):
            continue
        zero = (rows == 0.0).all(axis=1)
        if np.any(zero):
            text = f"{name}: {int(zero.sum())} rows of zeros"
            found.append(Finding("zeros", int(zero.sum()), text))
        jumps = _jumps(rows)
        if jumps:
            text = f"{name}: {jumps} rows jump out of the course of their neighbours"
            found.append(Finding("jumps", jumps, text))
        frozen = int(np.sum((np.diff(rows[~missing], axis=0) == 0.0).all(axis=1)))
        if frozen:
            text = f"{name}: {frozen} rows repeat the row before, number for number"
            found.append(Finding("repeated", frozen, text))
    return found


def _jumps(rows: np.ndarray) -> int:
    """Rows whose second difference is far beyond the usual one, each counted once."""
    if len(rows) < 8:
        return 0
    bend = np.linalg.norm(rows[1:-1] - 0.5 * (rows[:-2] + rows[2:]), axis=1)
    usual = np.nanmedian(bend)
    before = np.nan_to_num(np.append(0.0, bend[:-1]))
    after = np.nan_to_num(np.append(bend[1:], 0.0))
    peak = (bend > _JUMP * usual) & (bend >= before) & (bend >= after)
    return int(np.sum(peak)) if usual > 0.0 else 0
