"""Packets as CSV and Parquet, in pieces of bytes: for files, and for whoever reads as they come."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator

import numpy as np

from torquer.ground.columns import Column

#: What begins a formula where spreadsheets read text.
_FORMULA = ("=", "+", "-", "@", "\t", "\r")


def csv_bytes(about: dict, columns: list[Column], parts: Iterable) -> Iterator[bytes]:
    """A packet as CSV, a piece for its head and one for each part."""
    yield _csv_lines([[*map(_title, columns)]])
    for part in parts:
        texts = [
            _dates(values) if "calendar" in column.attributes else values
            for column, values in zip(columns, part, strict=True)
        ]
        yield _csv_lines(zip(*texts, strict=True))


def plain_cell(text: str) -> str:
    """A text for a table that spreadsheets do not take for a formula."""
    return f"'{text}" if text.startswith(_FORMULA) else text


def _csv_lines(rows: Iterable) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue().encode()


def _title(column: Column) -> str:
    """Name and unit of a column."""
    unit = column.attributes.get("units", "1")
    return (
        column.name if unit == "1" or "calendar" in column.attributes else f"{column.name} [{unit}]"
    )


def _dates(values: list) -> list[str | None]:
    """Times in ISO 8601 with ms, UTC."""
    known = np.array([0 if v is None else v for v in values], "datetime64[ms]")
    texts = np.datetime_as_string(known, unit="ms").tolist()
    return [None if v is None else f"{t}Z" for v, t in zip(values, texts, strict=True)]


def parquet_bytes(about: dict, columns: list[Column], parts: Iterable) -> Iterator[bytes]:
    """A packet as Parquet, a piece for each part, and one for the end."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    schema = pa.schema([_arrow_field(pa, column) for column in columns], metadata=about)
    pieces = _Pieces()
    with pq.ParquetWriter(pieces, schema, compression="zstd") as writer:
        for part in parts:
            arrays = [*map(pa.array, part, schema.types)]
            writer.write_table(pa.Table.from_arrays(arrays, schema=schema))
            yield pieces.take()
    yield pieces.take()


class _Pieces(io.RawIOBase):
    """A file of which pieces are taken as they are written."""

    def __init__(self) -> None:
        super().__init__()
        self._written, self._waiting = 0, bytearray()

    def writable(self) -> bool:
        return True

    def tell(self) -> int:
        return self._written

    def write(self, data) -> int:
        self._waiting += data
        self._written += len(data)
        return len(data)

    def take(self) -> bytes:
        """What has been written since."""
        piece, self._waiting = bytes(self._waiting), bytearray()
        return piece


def _arrow_field(pa, column: Column):
    if "calendar" in column.attributes:
        kind = pa.timestamp("ms", "UTC")
    else:
        kind = pa.string() if column.type == "str" else pa.from_numpy_dtype(column.type)
    about = {key: str(value) for key, value in column.attributes.items()}
    return pa.field(column.name, kind, metadata=about)
