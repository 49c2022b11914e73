"""Which columns hold which quantity: by their names, the units and meanings that the file states,
and the size of their numbers."""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from torquer.ground.telemetry.proposal.column_names import group_columns, parse_name
from torquer.ground.telemetry.reading.cells import NumberCells, read_numbers, split_cell_numbers
from torquer.ground.telemetry.reading.mapping import Mapping
from torquer.ground.telemetry.reading.quantities import COLUMNS, in_si, parse_unit, units_for
from torquer.ground.telemetry.reading.table import Table

_MISSING = Mapping.model_fields["missing"].default
#: The unit that only one quantity of `HINTS` has, and no other device aboard.
_TELLING = "T"
#: Signs that may stand between joined numbers.
_SIGNS = ("\\", ";", ",", "|", "/", " ")


class Hint(NamedTuple):
    """What names and meanings of a quantity's columns hold, and of no other's."""

    words: str
    """one of them must be there"""
    likely: str
    """the more of them the better"""
    never: str
    """of another quantity"""
    doubtful: str = r"$^"
    """of the quantity, but not measured or not the vehicle's"""
    low: float = 0.0
    """least median length in SI"""
    high: float = np.inf
    """greatest median length in SI"""
    usual: tuple[str, ...] = ()
    """units, the likeliest first, where none is stated; the first that gives a usual length"""


_NOT_MEASURED = (
    r"model|igrf|wmm|ref(?![a-z]*l)|pred|calc|theor|simul|true|expect|target|desired|demand|"
    r"cmd|setpoint|bias|offset|sigma|std|err|resid|deriv|dot|rate_of|estimat|filter"
)
#: Frames that no sensor measures in.
_ELSEWHERE = r"|eci(?![a-z])|ecef|(?<![a-z])ned(?![a-z])|orbital|lvlh|(?<![a-z])orf|inertial|j2000"
#: Hints by quantity, in the order in which columns are given away.
HINTS = {
    "b_measured": Hint(
        words=r"mag|field|mtm|(?<![a-z])b(?![a-w])|tesla|(?<![a-z])(fgm|h)(?![a-z])|магн",
        likely=r"meas|sens|read|mag|obs|cal",
        never=r"torq|mtq|coil|dip|rod|temp|curr|volt|power|status|flag|quat|gyro|sun|wheel|moment|"
        r"polls|errors|count|magnitude|magnetis",
        doubtful=_NOT_MEASURED + _ELSEWHERE,
        low=8e-6,
        high=1.2e-4,
        usual=("nT", "uT", "mG", "G", "T", "mT"),
    ),
    "omega_measured": Hint(
        words=r"gyr|omega|rate|angular|ang_?vel|imu|(?<![a-z])w(?![a-w])",
        likely=r"gyr|meas|imu|inertial|abs",
        never=r"orbital|relative|wheel|(?<![a-z])rw|speed|temp|sun|mag|quat|rate_class|moment|torq|"
        r"polls|errors|bit|sample|data|tick|(?<![a-z])dip",
        doubtful=_NOT_MEASURED,
        high=20.0,
        usual=("deg/s", "rad/s", "mdeg/s", "mrad/s", "rpm", "deg/h"),
    ),
    "q_measured": Hint(
        words=r"quat|(?<![a-z])(att|q(?![a-v]))",
        likely=r"inertial|eci|j2000|star|body|est",
        never=r"orbital|lvlh|wheel|curr|temp|class",
        doubtful=r"target|desired|cmd|ref|err|command|demand",
        low=0.7,
        high=1.4,
    ),
    "sun_measured": Hint(
        words=r"sun|(?<![a-z])s(?![a-z])|(?<![a-z])ss(?![a-z])",
        likely=r"meas|vec|dir|sens|body",
        never=r"temp|curr|volt|lit|flag|status|shadow|in_view|mag|sync",
        doubtful=_NOT_MEASURED + _ELSEWHERE,
        high=1.8,
    ),
    "dipole_body": Hint(
        words=r"dip|mtq|torquer|coil|torqrod|(?<![a-z])mtb",
        likely=r"dip|moment|m2|body",
        never=r"temp|curr|volt|power|duty|resist|status|flag|pwm|max|limit|mag_?field",
        high=1e4,
        usual=("A m^2", "mA m^2"),
    ),
    "position_j": Hint(
        words=r"pos|eci|j2000|gcrf|(?<![a-z])r(?![a-w])",
        likely=r"eci|j2000|gcrf|pos",
        never=r"mag|field|(?<![a-z])b(?![a-z])|ecef|ecr|itrf|fixed|teme|lat|lon|vel|torq|rod|raw|"
        r"sun|moon|error|rate|bias|gyr",
        doubtful=r"model|target|pred",
        low=6.4e6,
        high=1e8,
        usual=("m", "km"),
    ),
    "position_ecef": Hint(
        words=r"ecef|ecr|itrf|earth_?fixed|wgs",
        likely=r"pos|(?<![a-z])r(?![a-w])",
        never=r"mag|field|(?<![a-z])b(?![a-z])|vel|(?<![a-z])v(?![a-w])",
        doubtful=r"target|pred",
        low=6.3e6,
        high=1e8,
        usual=("m", "km"),
    ),
    "position_teme": Hint(
        words=r"teme",
        likely=r"pos",
        never=r"mag|field|(?<![a-z])b(?![a-z])|vel|(?<![a-z])v(?![a-w])",
        doubtful=r"target|pred",
        low=6.4e6,
        high=1e8,
        usual=("m", "km"),
    ),
}


class ColumnReading(NamedTuple):
    """Columns of a quantity, with what is needed to read them, how likely they are it."""

    name: str
    columns: tuple[str, ...]
    unit: str | None
    is_stated: bool
    """whether the file states the unit"""
    split: str | None
    decimal: str | None
    values: np.ndarray
    """in SI [n, k]"""
    score: float
    is_doubtful: bool

    @property
    def keys(self) -> dict:
        """Its part of a mapping."""
        columns = list(self.columns) if len(self.columns) > 1 else self.columns[0]
        keys: dict = {"columns": {self.name: columns}}
        if self.unit is not None:
            keys["units"] = {self.name: self.unit}
        if self.split is not None:
            keys["split"] = {self.name: self.split}
        if self.decimal is not None:
            keys["decimal"] = self.decimal
        return keys

    @property
    def text(self) -> str:
        """Columns, unit, and the decimal sign where the cells leave it open."""
        unit = "" if self.unit is None else f" in {self.unit}"
        sign = "" if self.decimal is None else f" with decimal {self.decimal!r}"
        return f"{self.name} is {', '.join(self.columns)}{unit}{sign}"


def names_field(names: list[str]) -> bool:
    """Whether three of the names are those of a magnetometer's axes."""
    hint = HINTS["b_measured"]
    stems = [group.stem for group in group_columns(names, 3)]
    return any(re.search(hint.words, s) and not re.search(hint.never, s) for s in stems)


def column_readings(table: Table, name: str) -> list[ColumnReading]:
    """What columns of a table may hold a quantity, the likeliest first, unit by unit."""
    hint, size = HINTS[name], COLUMNS[name].size
    columns = [str(c) for c in table.data if not str(c).startswith("\0")]
    groups = [(g.stem, g.columns, g.unit) for g in group_columns(columns, size)]
    groups += [(parse_name(c).stem, (c,), parse_name(c).unit) for c in columns]
    found = []
    for stem, members, unit in groups:
        stated = unit or parse_unit(table.units.get(members[0], ""))
        tells = stated in units_for(name) and COLUMNS[name].units == _TELLING
        score = _score(hint, stem, table.meanings.get(members[0], ""), tells)
        if score is None or (stated not in ("", "1") and stated not in units_for(name)):
            continue
        found += _readings(table, name, members, stated, score)
    return sorted(found, key=lambda each: (each.is_doubtful, -each.score))


def _score(hint: Hint, stem: str, meaning: str, unit_tells: bool) -> float | None:
    """How well names and meaning fit; None if they are another quantity's.

    `unit_tells`: whether the unit that the file states is this quantity's alone.
    """
    said = f"{stem} {meaning.lower()}"
    if re.search(hint.never, said) or not (unit_tells or re.search(hint.words, said)):
        return None
    likely = len(set(re.findall(hint.likely, said)))
    return likely + 2.0 * bool(re.search(hint.words, stem))


def _readings(table: Table, name: str, members, stated: str, score: float):
    hint = HINTS[name]
    doubtful = bool(re.search(hint.doubtful, f"{members[0].lower()} {_meaning(table, members)}"))
    for split, decimal, numbers, beside in _numbers(table, name, members):
        said = beside or stated
        if said not in ("", "1") and said not in units_for(name):
            continue
        units = [said] if said in units_for(name) else list(hint.usual)
        units = ["1"] if COLUMNS[name].units == "1" else units
        for k, unit in enumerate(units):
            values = in_si(name, unit, numbers)
            with np.errstate(invalid="ignore"):
                length = np.linalg.norm(values, axis=1)
            known = length[np.isfinite(length)]
            fits = len(known) > 0 and hint.low <= np.median(known) <= hint.high
            if not fits and (said not in units_for(name) or not len(known)):
                continue
            yield ColumnReading(
                name=name,
                columns=members,
                unit=None if COLUMNS[name].units == "1" else unit,
                is_stated=said in units_for(name),
                split=split,
                decimal=decimal,
                values=values,
                score=score - 0.3 * k - 2.0 * (not fits),
                is_doubtful=doubtful,
            )
            if name not in ("b_measured",):
                break


def _meaning(table: Table, members) -> str:
    return table.meanings.get(members[0], "").lower()


def _numbers(table: Table, name: str, members):
    """(split, decimal, numbers [n, k], their unit in the cells or "") of columns, each way in
    which they can be read."""
    size = COLUMNS[name].size
    if len(members) == size:
        for decimal in (None, ".", ","):
            try:
                cells = [read_numbers(table.data[each], _MISSING, decimal) for each in members]
            except ValueError:
                continue
            if not any(each.odd.mean() > 0.05 for each in cells):
                yield None, decimal, *_in_one_unit(name, cells)
                if decimal is None:
                    return
        return
    for sign in (None, *_SIGNS):
        values, odd = split_cell_numbers(table.data[members[0]], sign, size, _MISSING, None)
        if odd.mean() < 0.05 and np.isfinite(values).any():
            yield sign, None, values, ""
            return


def _in_one_unit(name: str, cells: list[NumberCells]) -> tuple[np.ndarray, str]:
    """Numbers [n, k] of cells, those with another unit beside them than the first in its, and that
    unit: "" if none is beside them, one of another quantity where no other is."""
    numbers = np.stack([each.values for each in cells], axis=1).astype(float)
    beside = [u for each in cells if each.units is not None for u in each.units if u]
    known = [each for each in beside if each in units_for(name)]
    for k, each in enumerate(cells):
        for unit in () if each.units is None else set(each.units) & set(known):
            rows = each.units == unit
            factor = in_si(name, unit, np.ones(1)) / in_si(name, known[0], np.ones(1))
            numbers[rows, k] *= factor[0]
    return numbers, next(iter([*known, *beside]), "")


def temperature_reading(table: Table, field: tuple[str, ...]) -> ColumnReading | None:
    """The temperature of the magnetometer: a column that names both, or that names nothing else."""
    for column in map(str, table.data):
        parsed = parse_name(column)
        said = f"{column.lower()} {table.meanings.get(column, '').lower()}"
        alone = re.fullmatch(r"t|temp|temperature|temp_sensor", parsed.stem) is not None
        of_field = re.search(r"temp", said) and re.search(r"mag(?!.*torq)|mtm|field", said)
        if not (alone or of_field) or column in field:
            continue
        try:
            cells = read_numbers(table.data[column], _MISSING, None)
        except ValueError:
            continue
        known = cells.values[np.isfinite(cells.values)]
        stated = parsed.unit or parse_unit(table.units.get(column, ""))
        if len(known) and not cells.odd.any():
            guessed = "K" if np.median(known) > 180.0 else "degC"
            unit = stated if stated in units_for("temperature") else guessed
            values = in_si("temperature", unit, cells.values)[:, None]
            return ColumnReading(
                "temperature", (column,), unit, bool(stated), None, None, values, 0.0, False
            )
    return None


def geodetic_reading(table: Table) -> ColumnReading | None:
    """Columns of latitude, longitude and height."""
    by = {str(c).lower(): str(c) for c in table.data}
    patterns = (r"(?<![a-z])lat(itude)?(?![a-z])", r"(?<![a-z])lon(g|gitude)?(?![a-z])",
                r"(?<![a-z])(alt|altitude|height|hgt|h)(?![a-z])")  # fmt: skip
    members = [next((by[c] for c in by if re.search(p, c)), None) for p in patterns]
    if None in members:
        return None
    columns = tuple(each for each in members if each is not None)
    try:
        cells = [read_numbers(table.data[each], _MISSING, None) for each in columns]
    except ValueError:
        return None
    numbers = np.stack([each.values for each in cells], axis=1)
    if any(each.odd.any() for each in cells) or not np.isfinite(numbers).any():
        return None
    if np.nanmax(np.abs(numbers[:, 0])) > 90.0 or np.nanmax(np.abs(numbers[:, 1])) > 360.0:
        return None
    stated = parse_name(columns[2]).unit or parse_unit(table.units.get(columns[2], ""))
    guessed = "km" if 100 < np.nanmedian(numbers[:, 2]) < 6e4 else "m"
    unit = stated if stated in ("m", "km") else guessed
    return ColumnReading(
        "position_geodetic", columns, unit, stated in ("m", "km"), None, None, numbers, 0.0, False
    )
