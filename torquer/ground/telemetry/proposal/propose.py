"""A mapping proposed for a file: readings of its columns, tested against what is plausible and
against the field along the orbit."""

from __future__ import annotations

import re
from html import escape
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from torquer.base.limits import RequestError
from torquer.ground.telemetry.proposal.column_names import group_columns, parse_name
from torquer.ground.telemetry.proposal.guess_columns import (
    HINTS,
    ColumnReading,
    column_readings,
    geodetic_reading,
    names_field,
    temperature_reading,
)
from torquer.ground.telemetry.proposal.guess_layout import Guessed, guess_text
from torquer.ground.telemetry.proposal.guess_time import time_readings
from torquer.ground.telemetry.proposal.rank_readings import Reading, rank
from torquer.ground.telemetry.reading.mapping import Mapping, make_mapping, write_mapping
from torquer.ground.telemetry.reading.quantities import COLUMNS
from torquer.ground.telemetry.reading.read import read
from torquer.ground.telemetry.reading.table import Table
from torquer.ground.telemetry.reading.tables import find_format, plain_file, read_table

#: Rows of a file by which readings are tested, readings of the columns that are, and pairs that
#: are tried to read the file.
_ROWS, _FIELDS, _TRIED = 400, 4, 24
#: Other readings that are shown.
_SHOWN = 4


#: Keys of a mapping without values.
_EMPTY = """time = ""
time_format = "iso"
zone = "UTC"

[columns]
b_measured = ["", "", ""]

[units]
b_measured = "nT"
"""


class Proposal(NamedTuple):
    """A mapping, in words what of it is a guess, and the other readings that were tested."""

    mapping: Mapping
    guesses: list[str]
    others: list[str]

    @property
    def text(self) -> str:
        """The mapping file: guesses and others as comments, then its keys."""
        return write_mapping(self.mapping, self.guesses, self.others)

    def _repr_html_(self) -> str:
        """The file for a notebook."""
        return f"<pre>{escape(self.text)}</pre>"


class NoProposal(ValueError):
    """No mapping can be proposed; `skeleton`: the text of one to be filled in."""

    def __init__(self, reason: str, skeleton: str):
        super().__init__(reason)
        self.skeleton = skeleton


def propose_mapping(
    path: Path | str, orbit: Path | None = None, satellite: str | None = None
) -> Proposal:
    """A mapping for a file of telemetry, to be checked and written to a file of its own.

    `orbit`: elements or positions as `torquer telemetry` takes them (`satellite`: of several),
    along which the readings are tested. ValueError for no file; NoProposal, with a skeleton, where
    no reading of the columns is plausible.

        print(propose_mapping("pass.csv", orbit="my_satellite.tle").text)
    """
    path = Path(path)
    if not path.is_file():
        raise ValueError(f"FILE: must be a file; received {path}")
    table = None
    try:
        guessed = _guess_table(path)
        table = guessed.table
        return _propose(path, guessed, orbit, satellite)
    except (NoProposal, RequestError):
        raise
    except ValueError as error:
        raise NoProposal(str(error), _skeleton(table, str(error))) from None


def _guess_table(path: Path) -> Guessed:
    with plain_file(path, None) as plain:
        kind = find_format(plain)
        if kind == "text":
            return guess_text(plain, names_field)
        if kind != "archive":
            return Guessed(read_table(plain), {}, [])
        return _archive(plain)


def _archive(path: Path) -> Guessed:
    """The first packet with rows and a magnetometer."""
    from contextlib import closing

    from torquer.ground.archive import dictionary_in, read_only

    with closing(read_only(path)) as db:
        down = dictionary_in(db).down
    fits = [name for name, each in down.items() if names_field(list(each.names))]
    if not fits:
        raise ValueError(f"FILE: must have a packet with the field; received {', '.join(down)}")
    drafts: dict[str, Any] = {name: {"packet": name} for name in fits}
    tables = {n: read_table(path, Mapping.model_construct(**each)) for n, each in drafts.items()}
    chosen = next((name for name in fits if len(tables[name].data)), fits[0])
    guess = f"packet {chosen}, the first with three numbers of a magnetometer"
    return Guessed(tables[chosen], {"packet": chosen}, [guess])


def _propose(path: Path, guessed: Guessed, orbit, satellite) -> Proposal:
    some = _sample(guessed.table)
    readings = _readings(some, orbit, satellite)
    reasons = []
    for reading in readings[:_TRIED]:
        proposal = _complete(reading, readings, some, guessed)
        try:
            read(path, proposal.mapping)
        except ValueError as error:
            reasons.append(str(error))
            continue
        return proposal
    raise ValueError(reasons[0])


def _sample(table: Table) -> Table:
    """Some rows of a table, spread over all of it."""
    if not len(table.data):
        raise ValueError("FILE: must hold rows; received none")
    rows = np.linspace(0, len(table.data) - 1, min(len(table.data), _ROWS)).astype(int)
    return table._replace(data=table.data.iloc[rows].reset_index(drop=True))


def _readings(table: Table, orbit, satellite) -> list[Reading]:
    """Readings of stamps and of the magnetometer together, the best first."""
    times = time_readings(table, table.format == "archive")
    columns = _columns(table)
    if not times:
        raise ValueError(
            "time: must be a column of time stamps, of which none gives plausible dates (`epoch` "
            f"is for counts from an instant of their own); received {', '.join(columns[:20])}"
        )
    fields = column_readings(table, "b_measured")
    firm = [each for each in fields if not each.is_doubtful]
    fields = (firm or fields)[:_FIELDS]
    if not fields:  # a file of other quantities
        fields = [each for name in HINTS if name != "b_measured"
                  for each in column_readings(table, name)[:1]][:1]  # fmt: skip
        if not fields:
            _refuse_counts(table, columns)
            raise ValueError(
                "FILE: must have columns whose names tell what they are, such as mag_x_nT; "
                f"received {', '.join(columns[:20])}"
            )
    return rank(times, fields, orbit, satellite)


def _refuse_counts(table: Table, columns: list[str]) -> None:
    """ValueError where columns are called those of a magnetometer, but no unit suits them."""
    hint = HINTS["b_measured"]
    for each in group_columns(columns, 3):
        if names_field(list(each.columns)):
            raise ValueError(
                f"scale: must be given, with the unit, for {', '.join(each.columns)}, whose "
                f"numbers are no field of {1e6 * hint.low:g} to {1e6 * hint.high:g} uT in any "
                "unit; received none"
            )


def _complete(best: Reading, readings: list[Reading], table: Table, guessed: Guessed) -> Proposal:
    """The mapping of a reading, with the other quantities of its file."""
    base: dict[str, Any] = guessed.keys | best.time.keys
    guesses = [*guessed.guesses, f"time is {_named(best.time.keys['time'])}", *best.time.guesses]
    used = {*np.atleast_1d(best.time.keys["time"])}
    for each in (best.field, *_others(table, best.field.name, used | {*best.field.columns})):
        for key, part in each.keys.items():
            base[key] = base.get(key, {}) | part if isinstance(part, dict) else part
        guesses += _describe(each, table)
        base |= _stated_convention(each, table)
    if "b_measured" not in base["columns"]:
        guesses.append("b_measured is none: no three columns x, y, z of a magnetometer were found")
    if best.misfit_nt is not None:
        fits = f"with a bias and one scale the strength fits the orbit's to {best.misfit_nt:.0f} nT"
        guesses.append(fits)
    others = [each.text for each in readings if each is not best][:_SHOWN]
    return Proposal(make_mapping(base), guesses, others)


def _stated_convention(reading: ColumnReading, table: Table) -> dict:
    """Keys for a quaternion of which the file says that it is not body to J, scalar last."""
    meaning = table.meanings.get(reading.columns[0], "").lower()
    if COLUMNS[reading.name].dimension != "component":
        return {}
    found: dict = {}
    if "scalar first" in meaning:
        found["order"] = {reading.name: "wxyz"}
    if re.search(r"(inertial|j2000|eci|j) (frame )?to body", meaning):
        found["inverse"] = [reading.name]
    return found


def _named(columns) -> str:
    return columns if isinstance(columns, str) else ", ".join(columns)


def _others(table: Table, first: str, used: set[str]) -> list[ColumnReading]:
    """The likeliest columns of all other quantities, no column twice."""
    found: list[ColumnReading] = []
    for name in HINTS:
        has_position = any(each.name.startswith("position") for each in found)
        if name == first or (name.startswith("position") and has_position):
            continue
        for each in column_readings(table, name):
            if not used & {*each.columns} and not each.is_doubtful:
                found.append(each)
                used |= {*each.columns}
                break
    place = None if any(e.name.startswith("position") for e in found) else geodetic_reading(table)
    warm = temperature_reading(table, tuple(used))
    return found + [each for each in (place, warm) if each is not None]


def _describe(reading: ColumnReading, table: Table) -> list[str]:
    """What of a reading is a guess."""
    name = reading.name
    found = [f"{name} is {', '.join(reading.columns)}"]
    if len(reading.columns) < COLUMNS[name].size:
        sign = "" if reading.split is None else f" with {reading.split!r} between"
        found = [f"{reading.columns[0]} holds {COLUMNS[name].size} numbers{sign}", *found]
    if reading.unit is not None and not reading.is_stated:
        found.append(f"the unit of {name} is {reading.unit}, by the size of its numbers")
    if reading.decimal is not None:
        found.append(
            f"the decimal sign of {name} is {reading.decimal!r}, by the size of its numbers"
        )
    if name == "q_measured" and "body" not in table.meanings.get(reading.columns[0], "").lower():
        found.append("q_measured is body to J, scalar last: |B| does not check it")
    return found


def _skeleton(table: Table | None, reason: str) -> str:
    """A mapping to be filled in: the reason, the columns there are, keys without values."""
    columns = [] if table is None else _columns(table)
    lines = [
        f"# No mapping could be proposed: {reason}".replace("\n", " "),
        "# Fill in what stands in quotes; `torquer explain mapping` lists the keys.",
        *(f"# column: {each}{_unit_of(table, each)}" for each in columns[:200]),
    ]
    return "\n".join([*lines, "", _EMPTY])


def _columns(table: Table) -> list[str]:
    return [str(each) for each in table.data if not str(each).startswith("\0")]


def _unit_of(table: Table | None, column: str) -> str:
    unit = parse_name(column).unit or ("" if table is None else table.units.get(column, ""))
    return f" [{unit}]" if unit else ""
