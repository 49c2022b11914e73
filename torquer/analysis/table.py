"""A result as a table: chosen variables at chosen times, a column a number, for other tools.

    frame = torquer.to_dataframe(result, ["omega_body", "rate"], every_s=10.0)
    torquer.write_table(result, "run.parquet", ["omega_body"])

A row is a record of a run, or a member of a campaign. `omega_body` gives the columns
`omega_body_x`, `omega_body_y` and `omega_body_z`. Variables of the whole run are left out.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from torquer.analysis.derived import makers
from torquer.base.replaced_files import replacing
from torquer.base.units import did_you_mean

if TYPE_CHECKING:
    import pandas

#: Greatest size of a table [bytes].
MOST_BYTES = 2 << 30
#: Variables named in an error.
_NAMED = 3
_FORMATS = (".csv", ".parquet")


def to_dataframe(
    result: xr.Dataset, variables: Sequence[str] | None = None, every_s: float | None = None
) -> pandas.DataFrame:
    """Variables of a result as columns, a row for each record or member, on its time or number.

    `variables`: of the result, or derived ones, as `torquer.derive` gives them [all of the result].
    `every_s`: of a run the records nearest to multiples of this time [all records]. Units are in
    `frame.attrs["units"]`, by column. ValueError for an unknown variable, for times closer than
    the records, and for a table above 2 GiB.

        >>> frame = torquer.to_dataframe(result, ["rate", "omega_body"], every_s=300.0)
        >>> list(frame.columns), len(frame)
        (['rate', 'omega_body_x', 'omega_body_y', 'omega_body_z'], 3)
    """
    import pandas

    rows = "member" if "campaign" in result.attrs else "time"
    names = _known(result, rows) if variables is None else [*dict.fromkeys(variables)]
    part = _at_rows(result, rows, every_s)
    _check_size({name: part[name] for name in names if name in part.variables}, part.sizes[rows])
    columns: dict[str, np.ndarray] = {}
    units = {}
    for name in names:
        variable = _find(part, rows, name)
        for column, values in _columns(name, variable, rows):
            columns[column], units[column] = values, str(variable.attrs.get("units", ""))
    index = pandas.Index(part[rows].values, name="time_s" if rows == "time" else rows)
    frame = pandas.DataFrame(columns, index=index)
    frame.attrs["units"] = units
    return frame


def write_table(
    result: xr.Dataset,
    path: str | os.PathLike,
    variables: Sequence[str] | None = None,
    every_s: float | None = None,
) -> Path:
    """Write variables of a result as CSV or Parquet, by the ending of `path`; the path.

    As `to_dataframe`; CSV has units in its head, `omega_body_x [rad/s]`, Parquet beside its
    columns. ValueError for another ending, and where Parquet lacks pyarrow.

        >>> path = torquer.write_table(result, "run.csv", ["rate"], every_s=300.0)
        >>> path.read_text().splitlines()[0]
        'time_s,rate [deg/s]'
    """
    path = Path(path)
    if path.suffix not in _FORMATS:
        raise ValueError(f"path: must end with .csv or .parquet; received {path}")
    write = _write_csv if path.suffix == ".csv" else _write_parquet
    with replacing(path) as unfinished:
        write(to_dataframe(result, variables, every_s), unfinished)
    return path


def csv_text(frame: pandas.DataFrame) -> str:
    """A table of `to_dataframe` as CSV with units in its head."""
    return frame.rename(columns=_with_units(frame)).to_csv(lineterminator="\n")


def _write_csv(frame: pandas.DataFrame, path: Path) -> None:
    frame.rename(columns=_with_units(frame)).to_csv(path, lineterminator="\n", encoding="utf-8")


def _with_units(frame: pandas.DataFrame) -> dict[str, str]:
    return {name: f"{name} [{unit}]" for name, unit in frame.attrs["units"].items() if unit}


def _write_parquet(frame: pandas.DataFrame, path: Path) -> None:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise ValueError(
            "path: must end with .csv where pyarrow is missing, which `pip install "
            "'torquer[parquet]'` adds; received .parquet"
        ) from None
    units = frame.attrs["units"]
    table = pyarrow.Table.from_pandas(frame.reset_index(), preserve_index=False)
    fields = [
        field.with_metadata({"units": units[field.name]}) if units.get(field.name) else field
        for field in table.schema
    ]
    pyarrow.parquet.write_table(table.cast(pyarrow.schema(fields)), path)


def _known(result: xr.Dataset, rows: str) -> list[str]:
    """The names of variables with a value, or a few, in each row."""
    return [
        str(name)
        for name, each in result.variables.items()
        if each.dims[:1] == (rows,) and name != rows and "time" not in each.dims[1:]
    ]


def _find(part: xr.Dataset, rows: str, name: str) -> xr.DataArray:
    """A variable of the result, or one derived from it; ValueError for none."""
    known = _known(part, rows)
    if name in known:
        return part[name]
    derived = makers(part) if rows == "time" else {}
    if name in derived:
        return derived[name](part)
    hint = did_you_mean(name, [*known, *derived]) or f"; known: {', '.join([*known, *derived])}"
    raise ValueError(f"variables: must be among those of the result{hint}; received {name}")


def _at_rows(result: xr.Dataset, rows: str, every_s: float | None) -> xr.Dataset:
    """The result at the records nearest to multiples of a time; all of it for None."""
    if every_s is None:
        return result
    if rows != "time":
        raise ValueError(f"every_s: must be left out for a campaign; received {every_s:g}")
    t = result["time"].values
    least = float(np.min(np.diff(t))) if len(t) > 1 else 0.0
    if not (math.isfinite(every_s) and every_s > 0.0 and every_s >= (1.0 - 1e-9) * least):
        raise ValueError(
            f"every_s: must be at least the time between records, {least:g} s; received {every_s:g}"
        )
    first, last = np.ceil(t[0] / every_s - 1e-9), np.floor(t[-1] / every_s + 1e-9)
    asked = every_s * np.arange(first, last + 1)
    return result.isel(time=np.unique(np.searchsorted(0.5 * (t[1:] + t[:-1]), asked)))


def _check_size(chosen: dict[str, xr.DataArray], count: int) -> None:
    """ValueError for a table that is too large, with its greatest variables."""
    sizes = {name: 8 * each.size for name, each in chosen.items()}
    if (total := sum(sizes.values())) <= MOST_BYTES:
        return
    most = sorted(sizes, key=lambda name: -sizes[name])[:_NAMED]
    named = ", ".join(f"{name} {_size(sizes[name])}" for name in most)
    raise ValueError(
        f"variables: must make a table of at most {_size(MOST_BYTES)}; received {_size(total)} in "
        f"{count} rows, of which {named}: choose fewer variables, or every_s"
    )


def _size(size: float) -> str:
    return f"{size / 2**30:.3g} GiB" if size >= 2**30 else f"{size / 2**20:.3g} MiB"


def _columns(name: str, variable: xr.DataArray, rows: str) -> Iterator[tuple[str, np.ndarray]]:
    """Name and values of each column of a variable."""
    values = variable.values
    others = [dim for dim in variable.dims if dim != rows]
    labels = [
        [str(label) for label in variable[dim].values]
        if dim in variable.coords
        else [str(k) for k in range(variable.sizes[dim])]
        for dim in others
    ]
    flat = values.reshape(len(values), -1)
    for number, cell in enumerate(product(*labels)):
        yield "_".join((name, *cell)), flat[:, number]
