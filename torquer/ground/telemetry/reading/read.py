"""From files and a mapping to a session, with everything noteworthy reported."""

from __future__ import annotations

import json
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from torquer.base.limits import RequestError
from torquer.ground.telemetry.reading.columns import Cells
from torquer.ground.telemetry.reading.mapping import Mapping, names_in
from torquer.ground.telemetry.reading.noteworthy import (
    check_quaternions,
    describe_stamps,
    describe_values,
    name_rows,
    order_rows,
    without_absurd,
    without_strays,
)
from torquer.ground.telemetry.reading.positions import add_position
from torquer.ground.telemetry.reading.quantities import QUANTITIES, RENAMED, make_session
from torquer.ground.telemetry.reading.stamps import Stamps, read_stamps
from torquer.ground.telemetry.reading.table import Finding as Finding, Table
from torquer.ground.telemetry.reading.tables import check_columns, read_table

#: Up to this part of the rows may have a stamp that is none: they are left out, and reported.
_FEW_ODD = 0.05


class Session(NamedTuple):
    """Telemetry: the data (`telemetry.quantities`), what was noteworthy in it, and whether its
    stamps state their own zone."""

    data: xr.Dataset
    findings: tuple[Finding, ...]
    zone_is_stated: bool = False


class Part(NamedTuple):
    """What one file holds: UTC of its rows [n], values by quantity, SI, what was noteworthy, and
    whether its stamps state their own zone."""

    utc: np.ndarray
    values: dict[str, np.ndarray]
    notes: list[Finding]
    zone_is_stated: bool


def read(paths, mapping: Mapping | None = None) -> Session:
    """Read telemetry from one file or several.

    Without `mapping` the files must hold a session or a result of this package (NetCDF). Rows are
    ordered by time. A few rows whose stamps or numbers are none are named in the findings.
    ValueError for a file that cannot be read, a column that is not there, text where numbers must
    be, stamps without a zone.
    """
    files = [paths] if isinstance(paths, str | Path) else list(paths)
    if not files:
        raise ValueError("FILE: must be given; received none")
    parts = [_part(Path(each), mapping) for each in files]
    names = sorted(set.intersection(*(set(each.values) for each in parts)))
    utc = np.concatenate([each.utc for each in parts])
    values = {name: np.concatenate([each.values[name] for each in parts]) for name in names}
    findings = [note for each in parts for note in each.notes]
    lost = sorted({name for each in parts for name in each.values} - set(names))
    if lost:
        findings.append(Finding("not in all files", 0, f"not in all files: {', '.join(lost)}"))
    values = {name: without_absurd(name, each, findings) for name, each in values.items()}
    utc, values = order_rows(utc, values, findings)
    utc, values = without_strays(utc, values, findings)
    add_position(utc, values, None if mapping is None else mapping.place)
    check_quaternions(values, findings)
    data = make_session(utc, values, source=", ".join(each.name for each in map(Path, files)))
    findings += describe_stamps(utc) + describe_values(utc, values)
    data.attrs["findings"] = json.dumps([each._asdict() for each in findings])
    return Session(data, tuple(findings), all(each.zone_is_stated for each in parts))


def _part(path: Path, mapping: Mapping | None) -> Part:
    table = read_table(path, mapping)
    if mapping is None:
        return _own(table, path)
    return interpret(table, mapping, path)


def interpret(table: Table, mapping: Mapping, path: Path) -> Part:
    """UTC and quantities of the columns of a table, by a mapping."""
    columns = [c for each in mapping.columns.values() for c in names_in(each)]
    check_columns(table, [*mapping.time_columns, *columns], path)
    if not len(table.data):
        raise ValueError(f"FILE: must hold rows below its head; received {path} with none")
    cells, notes = Cells(table, mapping), list(table.notes)
    stamps = read_stamps(table, mapping, cells.numbers)
    known = _known_rows(stamps, mapping, notes)
    values = {name: cells.quantity(name)[known] for name in mapping.columns}
    return Part(stamps.utc[known], values, notes + cells.notes, stamps.zone_is_stated)


def _known_rows(stamps: Stamps, mapping: Mapping, notes: list[Finding]) -> np.ndarray:
    """Rows with a stamp; ValueError where more than a few have none."""
    known = ~np.isnat(stamps.utc)
    column, form = mapping.time_columns[0], mapping.time_formats
    odd = np.flatnonzero(~known)
    if len(odd) > _FEW_ODD * len(known):
        raise ValueError(
            f"{column}: must be times of format {form[0] if len(form) == 1 else form!r}"
            f" (time_format); received {stamps.given[odd[0]]!r} in row {odd[0] + 1}"
        )
    if len(odd):
        text = f"{column}: {name_rows(odd)} no time, such as {stamps.given[odd[0]]!r}: left out"
        notes.append(Finding("no time", len(odd), text))
    if stamps.leap_seconds:
        count = stamps.leap_seconds
        rows = f"{count} row{'s' * (count > 1)}"
        text = f"{rows} in a leap second, 23:59:60: read as the second after it"
        notes.append(Finding("leap second", stamps.leap_seconds, text))
    return known


def _own(table: Table, path: Path) -> Part:
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
    return Part(table.data["utc"].to_numpy("datetime64[ns]"), values, [], False)
