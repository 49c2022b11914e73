"""Files of any of the formats as tables of columns, nothing interpreted yet.

What a file is follows from its first bytes, not from its name. Pickles are refused: reading one
executes what it holds.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import numpy as np

from torquer.ground.telemetry.reading.mapping import Long, Mapping, names_in
from torquer.ground.telemetry.reading.packed import find_encoding, is_packed, unpacked
from torquer.ground.telemetry.reading.table import Table
from torquer.ground.telemetry.reading.text_tables import INFLUX, Layout, pivot, read_text_table

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
    (b"\xd0\xcf\x11\xe0", "a workbook: export it as CSV"),
    (b"\x80", "a pickle, which would be executed"),
)
_READABLE = ("archive", "parquet", "netcdf", "cdf", "text", "packed")
_PICKLES = (".pkl", ".pickle", ".joblib", ".pt", ".npy", ".npz")


def find_format(path: Path, encoding: str | None = None) -> str:
    """archive, parquet, netcdf, cdf, text or packed; ValueError for anything else."""
    with path.open("rb") as file:
        head = file.read(4096)
    found = next((name for sign, name in _SIGNS if head.startswith(sign)), "text")
    if found == "text" and path.suffix.lower() in _PICKLES:
        found = "a pickle by its name, which would be executed"
    if is_packed(head):
        found = "packed"
    if found == "text" and b"\0" in head and not (encoding or find_encoding(head)):
        found = "binary data of an unknown format (`encoding` if it is text)"
    if found not in _READABLE:
        raise ValueError(
            "FILE: must be text (CSV), Parquet, NetCDF, CDF or a ground archive, gzip or ZIP; "
            f"received {path}: {found}"
        )
    return found


def read_table(path: Path, mapping: Mapping | None = None) -> Table:
    """The columns of a file. `mapping`: how its text is written, or which packet."""
    if not path.is_file():
        raise ValueError(f"FILE: must be a file; received {path}")
    with plain_file(path, None if mapping is None else mapping.member) as plain:
        kind = find_format(plain, None if mapping is None else mapping.encoding)
        if kind == "packed":
            raise ValueError(f"FILE: must be packed once; received {path}, packed again")
        read = {
            "archive": _archive, "parquet": _parquet, "netcdf": _netcdf, "cdf": _cdf, "text": _text,
        }  # fmt: skip
        table = read[kind](plain, mapping)
    return table if mapping is None or not mapping.only else _only(table, mapping.only)


@contextmanager
def plain_file(path: Path, member: str | None) -> Iterator[Path]:
    """The file itself, or within the block the one that it packs."""
    with path.open("rb") as file:
        head = file.read(8)
    if not is_packed(head):
        yield path
        return
    with unpacked(path, member) as plain:
        yield plain


def layout_of(mapping: Mapping) -> Layout:
    """How a mapping says that a text is written."""
    columns = [c for each in mapping.columns.values() for c in names_in(each)]
    if mapping.long is not None:
        columns = list(mapping.long.columns)
    return Layout(
        frozenset([*mapping.time_columns, *columns, *mapping.only]),
        mapping.skip,
        mapping.skip_lines,
        mapping.comment,
        mapping.separator,
        None if mapping.names is None else tuple(mapping.names),
        mapping.encoding,
    )


def _text(path: Path, mapping: Mapping | None) -> Table:
    if mapping is None:
        return read_text_table(path, Layout())
    layout, long = layout_of(mapping), mapping.long
    table = read_text_table(path, layout)
    if long is None and not layout.wanted <= set(table.data):
        influx = read_text_table(path, layout._replace(wanted=frozenset(INFLUX)))
        if set(INFLUX) <= set(influx.data):
            table, long = influx, Long(name=INFLUX[1], value=INFLUX[2])
    if long is None:
        return table
    needed = [*mapping.time_columns, *long.columns]
    check_columns(table, needed, path)
    if mapping.only:
        table = _only(table, mapping.only)
    wanted = [c for each in mapping.columns.values() for c in names_in(each)]
    known = table.data[long.name].dropna().unique()
    check_names(known, wanted, f"in column {long.name!r}")
    kept = table.data[[*needed, *mapping.only]]
    return pivot(table._replace(data=kept), mapping.time_columns, wanted, *long.columns)


def check_columns(table: Table, wanted, path: Path) -> None:
    """ValueError unless all columns are there, each once."""
    for column in wanted:
        if column not in table.data and (where := _where_named(table, column)):
            raise ValueError(
                "long: must name the columns of names and numbers of a file with a row for each "
                f'number, such as {{name = "{where}", value = "value"}}; received none'
            )
    check_names(list(table.data.columns), wanted, f"a column of {path.name}")
    for column in wanted:
        if any(str(c).startswith("\0") and str(c).endswith(f" {column}") for c in table.data):
            raise ValueError(f"names: must name each column once; received {column!r} twice")


def _where_named(table: Table, name: str) -> str:
    """The column in whose first rows a name stands; "" if none has it."""
    head = table.data.head(1000)
    return next((str(each) for each in head if (head[each].astype(str) == name).any()), "")


def check_names(known, wanted, what: str) -> None:
    """ValueError unless all names wanted are known."""
    known = [str(each) for each in known if not str(each).startswith("\0")]
    for each in wanted:
        if each not in known:
            raise ValueError(f"mapping: {each!r} must be {what}: {', '.join(known[:30])}")


def _only(table: Table, only: dict[str, str]) -> Table:
    """Rows of a table that hold the texts asked for."""
    data = table.data
    for column, text in only.items():
        if column not in data:
            continue  # a table with a row for each number was filtered before it was turned
        data = data[data[column].astype(str).str.strip() == text]
        if not len(data):
            raise ValueError(f"only.{column}: must be in a row; received {text!r}")
    return table._replace(data=data.reset_index(drop=True))


def _parquet(path: Path, mapping) -> Table:
    try:
        import pyarrow.parquet as pq
    except ImportError:
        raise ValueError(
            "FILE: needs pyarrow, which `pip install 'torquer[parquet]'` adds"
        ) from None
    read = pq.read_table(path)
    about = {field.name: field.metadata or {} for field in read.schema}
    units, meanings = (
        {name: each[key].decode() for name, each in about.items() if key in each}
        for key in (b"units", b"long_name")
    )
    return Table(read.to_pandas(), units, "parquet", meanings=meanings)


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
    about = {each: field_attributes(field) for each, field, _ in packet.numbers()}
    units = {name: each["units"] for name, each in about.items() if each.get("units")}
    meanings = {name: each["long_name"] for name, each in about.items() if each.get("long_name")}
    return Table(data, units, "archive", meanings=meanings)


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
