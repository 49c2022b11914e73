"""Files of any of the formats as tables of columns, nothing interpreted yet.

What a file is follows from its first bytes, not from its name. Pickles are refused: reading one
executes what it holds.
"""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    import pandas as pd

#: First bytes of each format, and of what is refused.
_SIGNS = (
    (b"SQLite format 3\0", "archive"),
    (b"PAR1", "parquet"),
    (b"\x89HDF\r\n\x1a\n", "netcdf"),
    (b"CDF\x01", "netcdf"),
    (b"CDF\x02", "netcdf"),
    (b"\xcd\xf3\x00\x01", "cdf"),
    (b"\xcd\xf2\x60\x02", "cdf"),
    (b"\x93NUMPY", "an array of NumPy, which may hold a pickle"),
    (b"PK\x03\x04", "an archive of files (ZIP)"),
    (b"\x1f\x8b", "compressed by gzip"),
    (b"\x80", "a pickle, which would be executed"),
)
_READABLE = ("archive", "parquet", "netcdf", "cdf", "text")
_PICKLES = (".pkl", ".pickle", ".joblib", ".pt", ".npy", ".npz")


class Table(NamedTuple):
    """Columns of a file, the units that it states for them, its format.

    `is_utc`: columns of dates without a zone that are UTC by the format's own definition.
    """

    data: pd.DataFrame
    units: dict[str, str]
    format: str
    is_utc: frozenset[str] = frozenset()


def find_format(path: Path) -> str:
    """archive, parquet, netcdf, cdf or text; ValueError for anything else."""
    with path.open("rb") as file:
        head = file.read(4096)
    found = next((name for sign, name in _SIGNS if head.startswith(sign)), "text")
    if found == "text" and path.suffix.lower() in _PICKLES:
        found = "a pickle by its name, which would be executed"
    if found == "text" and b"\0" in head:
        found = "binary data of an unknown format"
    if found not in _READABLE:
        raise ValueError(
            "FILE: must be text (CSV), Parquet, NetCDF, CDF or a ground archive; "
            f"received {path}: {found}"
        )
    return found


def read_table(path: Path, mapping=None) -> Table:
    """The columns of a file. `mapping` (`Mapping`): how its text is written, or which packet."""
    if not path.is_file():
        raise ValueError(f"FILE: must be a file; received {path}")
    kind = find_format(path)
    read = {"archive": _archive, "parquet": _parquet, "netcdf": _netcdf, "cdf": _cdf, "text": _text}
    return read[kind](path, mapping)


def _text(path: Path, mapping) -> Table:
    import pandas as pd

    skip, comment = (0, "#") if mapping is None else (mapping.skip, mapping.comment)
    separator = "," if mapping is None else mapping.separator
    names = None if mapping is None else mapping.names
    missing = [""] if mapping is None else mapping.missing
    with path.open(encoding="utf-8-sig", newline=None) as file:
        try:
            for _ in range(skip):
                file.readline()
            if names is None:
                head = file.readline().strip().removeprefix(comment).strip()
                parts = head.split(None if separator == "whitespace" else separator)
                names = [part.strip().strip('"') for part in parts]
            keys = {"sep": r"\s+"} if separator == "whitespace" else {"sep": separator}
            if len(comment) == 1:
                keys["comment"] = comment
            data = pd.read_csv(
                file,
                names=names,
                header=None,
                index_col=False,
                na_values=list(missing),
                keep_default_na=False,
                skipinitialspace=True,
                low_memory=False,
                **keys,
            )
        except (pd.errors.ParserError, pd.errors.EmptyDataError, UnicodeDecodeError) as error:
            reason = str(error).strip().removeprefix("Error tokenizing data. C error: ")
            raise ValueError(f"FILE: must be a table of text; received {path}: {reason}") from None
        except ValueError as error:  # names twice
            raise ValueError(
                f"FILE: must name each column once; received {path}: {error}"
            ) from None
    return Table(data, {}, "text")


def _parquet(path: Path, mapping) -> Table:
    try:
        import pyarrow.parquet as pq
    except ImportError:
        raise ValueError(
            "FILE: needs pyarrow, which `pip install 'torquer[parquet]'` adds"
        ) from None
    read = pq.read_table(path)
    about = {field.name: field.metadata or {} for field in read.schema}
    units = {name: each[b"units"].decode() for name, each in about.items() if b"units" in each}
    return Table(read.to_pandas(), units, "parquet")


def _netcdf(path: Path, mapping) -> Table:
    import pandas as pd
    import xarray as xr

    try:
        with xr.open_dataset(path) as opened:
            data = opened.load()
    except (OSError, ValueError, KeyError) as error:
        raise ValueError(f"FILE: must be NetCDF; received {path}: {error}") from None
    (size, dimension) = max((data.sizes[name], str(name)) for name in data.sizes)
    columns, units = {}, {}
    for name, variable in data.variables.items():
        if variable.dims[:1] != (dimension,) or variable.ndim > 2:
            continue
        if variable.ndim == 1:
            columns[str(name)] = variable.values
            units[str(name)] = str(variable.attrs.get("units", ""))
            continue
        labels = data[variable.dims[1]].values if variable.dims[1] in data.coords else None
        for k in range(variable.shape[1]):
            column = f"{name}_{k if labels is None else labels[k]}"
            columns[column] = variable.values[:, k]
            units[column] = str(variable.attrs.get("units", ""))
    frame = pd.DataFrame(columns, index=range(size))
    dates = {name for name, kind in frame.dtypes.items() if kind.kind == "M"}
    return Table(frame, {k: u for k, u in units.items() if u}, "netcdf", frozenset(dates))


def _archive(path: Path, mapping) -> Table:
    import pandas as pd

    from torquer.flight.packets.received import field_attributes
    from torquer.ground.archive import dictionary_in, quote_names, read_only

    with closing(read_only(path)) as db:
        down = dictionary_in(db).down
        name = None if mapping is None else mapping.packet
        if name not in down:
            received = "none" if name is None else repr(name)
            raise ValueError(f"packet: must be one of {', '.join(down)}; received {received}")
        packet = down[name]
        names = ("_time_ms", *packet.names)
        statement = f'SELECT {quote_names(names)} FROM "{name}" ORDER BY _time_ms, _digest'
        data = pd.DataFrame(db.execute(statement).fetchall(), columns=list(names))
    units = {each: field_attributes(field).get("units", "") for each, field, _ in packet.numbers()}
    return Table(data, {key: unit for key, unit in units.items() if unit}, "archive")


def _cdf(path: Path, mapping) -> Table:
    try:
        import cdflib
    except ImportError:
        raise ValueError("FILE: needs cdflib, which `pip install 'torquer[cdf]'` adds") from None
    import pandas as pd

    file = cdflib.CDF(path)
    columns, units, dates = {}, {}, set()
    for name in file.cdf_info().zVariables:
        values, about = np.asarray(file.varget(name)), file.varattsget(name)
        if str(file.varinq(name).Data_Type_Description).startswith(("CDF_EPOCH", "CDF_TIME")):
            values = cdflib.cdfepoch.to_datetime(values)
            dates.add(name)
        for column, each in (
            [(name, values)]
            if values.ndim == 1
            else [(f"{name}_{k}", values[:, k]) for k in range(values.shape[-1])]
            if values.ndim == 2
            else []
        ):
            columns[column] = each
            units[column] = str(about.get("UNITS", ""))
    size = max((len(each) for each in columns.values()), default=0)
    frame = pd.DataFrame({name: each for name, each in columns.items() if len(each) == size})
    return Table(frame, {k: u for k, u in units.items() if u}, "cdf", frozenset(dates))
