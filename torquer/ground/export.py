"""Archives written as CSV, NetCDF or Parquet, a file a packet, in parts: any size in little memory.

Columns: `time` (on-board time) and `received`, `quality`, `status`, then the numbers of the packet
with unit and description. Times are ms since 1970, UTC, in CSV ISO 8601; CSV has units in its head,
`omega_x [deg/s]`. What was not known is NaN, in whole numbers the fill value (NetCDF) or null
(Parquet), in CSV nothing. Of a damaged archive all is written that can be read.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import numpy as np

from torquer.ground.columns import Column, as_numbers, fitting
from torquer.ground.pieces import csv_bytes, parquet_bytes
from torquer.ground.rescue import Losses, Rescue, Table

#: Rows that are written at a time.
_PART = 65_536
_LEAST, _GREATEST = -(2**63), 2**63 - 1


def export_archive(
    archive: Path,
    out: Path,
    format: str = "netcdf",
    packets: Sequence[str] | None = None,
    start_ms: int | None = None,
    end_ms: int | None = None,
    progress: Callable[[float], None] | None = None,
    lost: Callable[[str], None] = warnings.warn,
) -> list[tuple[Path, int]]:
    """Write the packets of an archive that have rows; the files with their numbers of rows.

    `format`: csv, netcdf or parquet; `lost`: called with a line for whatever of a damaged archive
    cannot be read. ValueError for a packet that the archive does not have.
    """
    span = (_LEAST if start_ms is None else start_ms, _GREATEST if end_ms is None else end_ms)
    losses, files = Losses(lost), []
    with closing(Rescue(archive, losses)) as rescue:
        known = rescue.packets
        packets = [*dict.fromkeys(packets or ())]
        for name in packets:
            if name not in known:
                raise ValueError(f"--packet: must be one of {', '.join(known)}; received {name}")
        wanted = packets or known
        rescue.tell_unnamed(wanted)
        for number, name in enumerate(wanted):
            files += _export(_Work(rescue, losses, span), name, out, FORMATS[format])
            if progress:
                progress((number + 1) / len(wanted))
    return files


class _Work(NamedTuple):
    """Where rows come from, what notes losses, and the interval."""

    rescue: Rescue
    losses: Losses
    span: tuple[int, int]

    def parts(self, table: Table, columns: list[Column], needs: bool) -> Iterator[list]:
        """The columns of the rows, a stretch at a time, in order of time, with values that fit.

        `needs`: whether the file cannot do without `fill` for a value that is missing.
        """
        for rows in self.rescue.rows(table, self.span, _PART):
            part, without = [], []
            for column, values in zip(columns, zip(*rows, strict=True), strict=True):
                kept, wrong = fitting(column, as_numbers(column, values))
                self.losses.add_values(f"{table.name}.{column.source}", wrong, column.wrong)
                part.append(kept)
                if needs and column.type[0] in "ui" and column.fill is None and None in kept:
                    without.append(column.name)
            if without:
                raise _MissingError(without)
            yield part


class _MissingError(Exception):
    """Columns of whole numbers, without a fill value, of which some are missing."""

    def __init__(self, names: list[str]):
        super().__init__(names)
        self.names = names


def _export(work: _Work, name: str, out: Path, format: _Format) -> list[tuple[Path, int]]:
    """Write a packet: the file with its number of rows, nothing without rows."""
    table = work.rescue.table(name)
    if table is None:
        return []
    path, columns = out / f"{name}.{format.ending}", table.columns
    while True:
        work.losses.forget_values()
        try:
            parts = work.parts(table, columns, format.needs_fill)
            first = next(parts, None)
            if first is None:
                found = []
            else:
                count = format.write(path, table.about, columns, chain([first], parts))
                found = [(path, count)]
        except _MissingError as error:  # once more, as floats
            columns = [c.as_float if c.name in error.names else c for c in columns]
            continue
        work.losses.tell_values()
        return found


def _write_netcdf(path: Path, about: dict, columns: list[Column], parts: Iterable) -> int:
    import h5netcdf

    count = 0
    with h5netcdf.File(path, "w") as file:
        file.attrs.update(about)
        file.dimensions["frame"] = None
        for column in columns:
            _add_variable(file, column)
        for part in parts:
            end = count + len(part[0])
            file.resize_dimension("frame", end)
            for column, values in zip(columns, part, strict=True):
                file.variables[column.name][count:end] = _fill(column, values)
            count = end
    return count


def _add_variable(file, column: Column) -> None:
    import h5py

    kind = h5py.string_dtype() if column.type == "str" else np.dtype(column.type)
    fill = column.fill if column.type != "str" else None
    chunks = None if column.type == "str" else (4096,)
    keys = {} if chunks is None else {"chunks": chunks, "compression": "gzip"}
    variable = file.create_variable(column.name, ("frame",), kind, fillvalue=fill, **keys)
    for key, value in column.attributes.items():
        variable.attrs[key] = np.array(value) if isinstance(value, list) else value


def _fill(column: Column, values: list) -> np.ndarray:
    if column.type == "str":
        return np.array(["" if v is None else v for v in values], dtype=object)
    return np.array([column.fill if v is None else v for v in values], dtype=column.type)


def _writer(pieces_of: Callable[[dict, list[Column], Iterable], Iterator[bytes]]):
    """What writes the pieces of a packet into a file, and counts its rows."""

    def write(path: Path, about: dict, columns: list[Column], parts: Iterable) -> int:
        count = 0

        def counted() -> Iterator:
            nonlocal count
            for part in parts:
                count += len(part[0])
                yield part

        with path.open("wb") as file:
            file.writelines(pieces_of(about, columns, counted()))
        return count

    return write


class _Format(NamedTuple):
    """A format: how a file is written, how its name ends.

    `needs_fill`: whether a number cannot be missing where nothing stands for it.
    """

    write: Callable[[Path, dict, list[Column], Iterable], int]
    ending: str
    needs_fill: bool


FORMATS = {
    "csv": _Format(_writer(csv_bytes), "csv", False),
    "netcdf": _Format(_write_netcdf, "nc", True),
    "parquet": _Format(_writer(parquet_bytes), "parquet", False),
}
