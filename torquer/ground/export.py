"""Archives written as NetCDF or Parquet, a file a packet, in parts: any size in little memory.

Columns: `time` (on-board time) and `received` (both ms since 1970, UTC), `quality`, `status`, then
the numbers of the packet with unit and description. What was not known is NaN, in whole numbers
the fill value (NetCDF) or null (Parquet).
"""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from torquer.flight.packets.dictionary import Field, Packet
from torquer.flight.packets.received import field_attributes
from torquer.ground.archive import dictionary_in, quote_names, read_only

#: Rows that are written at a time.
_PART = 65_536
_LEAST, _GREATEST = -(2**63), 2**63 - 1
_DATE = {"units": "milliseconds since 1970-01-01", "calendar": "proleptic_gregorian"}
_QUALITY = {
    "long_name": "trust in the frame",
    "flag_values": [0, 1, 2],
    "flag_meanings": "suspect unchecked authentic",
}


class _Column(NamedTuple):
    """A column of a file: its name there, in the archive, its type, what stands for no number."""

    name: str
    source: str
    type: str
    fill: Any
    attributes: dict


def export_archive(
    archive: Path,
    out: Path,
    format: str = "netcdf",
    packets: Sequence[str] | None = None,
    start_ms: int | None = None,
    end_ms: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[tuple[Path, int]]:
    """Write the packets of an archive that have rows; the files with their numbers of rows.

    `format`: netcdf or parquet. ValueError for a packet that the archive does not have.
    """
    write = {"netcdf": _write_netcdf, "parquet": _write_parquet}[format]
    span = (_LEAST if start_ms is None else start_ms, _GREATEST if end_ms is None else end_ms)
    files = []
    with closing(read_only(archive)) as db:
        dictionary = dictionary_in(db)
        for name in packets or ():
            if name not in dictionary.down:
                raise ValueError(
                    f"--packet: must be one of {', '.join(dictionary.down)}; received {name}"
                )
        wanted = [dictionary.down[name] for name in packets or dictionary.down]
        for number, packet in enumerate(wanted):
            path = out / f"{packet.name}.{'nc' if format == 'netcdf' else 'parquet'}"
            about = {"satellite": dictionary.name, "packet": packet.name}
            about["description"] = packet.description
            parts = _parts(db, packet, span)
            first = next(parts, None)
            if first is not None:
                files.append((path, write(path, about, _columns(packet), chain([first], parts))))
            if progress:
                progress((number + 1) / len(wanted))
    return files


def _columns(packet: Packet) -> list[_Column]:
    taken = {"time", "received", "quality", "status"} & set(packet.names)
    end = "_of_frame" if taken else ""  # where the packet has a field of such a name
    own = [
        _Column(f"time{end}", "_time_ms", "i8", None, {"long_name": "on-board time", **_DATE}),
        _Column(
            f"received{end}", "_received_ms", "i8", _LEAST, {"long_name": "reception", **_DATE}
        ),
        _Column(f"quality{end}", "_quality", "u1", None, _QUALITY),
        _Column(f"status{end}", "_status", "u1", None, {"long_name": "0 INFO, 1 ALARM, 2 STOP"}),
    ]
    return own + [
        _Column(name, name, *_kind(field), _without_unknown(field_attributes(field)))
        for name, field, _ in packet.numbers()
    ]


def _without_unknown(attributes: dict) -> dict:
    """Attributes of a column in which numbers that were not known are no numbers."""
    return {key: value for key, value in attributes.items() if key != "unknown"}


def _kind(field: Field) -> tuple[str, Any]:
    """Type of a column, and what stands for a number that was not known."""
    if field.type == "bytes":
        return "str", None
    return field.dtype, field.unknown_value if field.is_whole else np.nan


def _parts(db: sqlite3.Connection, packet: Packet, span: tuple[int, int]) -> Iterator[list]:
    """The columns of the rows, a stretch at a time, in order of time."""
    sources = [column.source for column in _columns(packet)]
    rows = db.execute(
        f'SELECT {quote_names(sources)} FROM "{packet.name}" WHERE _time_ms BETWEEN ? AND ? '
        "ORDER BY _time_ms, _digest",
        span,
    )
    while part := rows.fetchmany(_PART):
        yield list(zip(*part, strict=True))


def _write_netcdf(path: Path, about: dict, columns: list[_Column], parts: Iterable) -> int:
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


def _add_variable(file, column: _Column) -> None:
    import h5py

    kind = h5py.string_dtype() if column.type == "str" else np.dtype(column.type)
    fill = column.fill if column.type != "str" else None
    chunks = None if column.type == "str" else (4096,)
    keys = {} if chunks is None else {"chunks": chunks, "compression": "gzip"}
    variable = file.create_variable(column.name, ("frame",), kind, fillvalue=fill, **keys)
    for key, value in column.attributes.items():
        variable.attrs[key] = np.array(value) if isinstance(value, list) else value


def _fill(column: _Column, values: tuple) -> np.ndarray:
    if column.type == "str":
        return np.array(values, dtype=object)
    numbers = (column.fill if v is None else v for v in _numbers(column, values))
    return np.array(list(numbers), dtype=column.type)


def _numbers(column: _Column, values: tuple) -> Sequence:
    """Values in which large whole numbers, which the archive has as texts, are numbers again."""
    return [int(v) for v in values] if column.type == "u8" else values


def _write_parquet(path: Path, about: dict, columns: list[_Column], parts: Iterable) -> int:
    import pyarrow as pa
    import pyarrow.parquet as pq

    schema = pa.schema([_arrow_field(pa, column) for column in columns], metadata=about)
    count = 0
    with pq.ParquetWriter(path, schema, compression="zstd") as writer:
        for part in parts:
            numbers = map(_numbers, columns, part)
            arrays = [*map(pa.array, numbers, schema.types)]
            writer.write_table(pa.Table.from_arrays(arrays, schema=schema))
            count += len(part[0])
    return count


def _arrow_field(pa, column: _Column):
    types = {"str": pa.string(), "f8": pa.float64(), "i8": pa.timestamp("ms", "UTC")}
    kind = types.get(column.type) or pa.from_numpy_dtype(column.type)
    about = {key: str(value) for key, value in column.attributes.items()}
    return pa.field(column.name, kind, metadata=about)
