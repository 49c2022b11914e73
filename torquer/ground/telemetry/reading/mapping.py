"""How the columns of a file become the quantities of a session: a small TOML file."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Annotated

from pydantic import Field, ValidationError, field_validator, model_validator

from torquer.base.explain import explain
from torquer.base.spec import Spec, Vector
from torquer.base.time import parse_utc
from torquer.ground.telemetry.reading.epochs import check_formats, find_epoch, is_clock, is_counted
from torquer.ground.telemetry.reading.positions import FORMS, PLACE, check_place
from torquer.ground.telemetry.reading.quantities import COLUMNS, parse_unit, units_for
from torquer.ground.telemetry.reading.zones import parse_zone
from torquer.scenario.toml_text import parse_toml, read_text, to_toml

#: Orders of the numbers of a quaternion in a row.
QUATERNIONS = ("xyzw", "wxyz")
_AXES = {"x", "y", "z", "-x", "-y", "-z"}
Names = list[str] | str


class Long(Spec):
    """Of a file with a row for each number: the column with its name, the one with the number, and
    the one with its unit."""

    name: str
    """Column of the names; `columns` then lists what stands in it."""
    value: str
    """Column of the numbers."""
    unit: str | None = None
    """Column of their units, which count as those in cells do."""

    @property
    def columns(self) -> list[str]:
        """The columns that are named."""
        return [each for each in (self.name, self.value, self.unit) if each is not None]


class Mapping(Spec):
    """How to read a file of telemetry: how it is written, what its columns are.

    Only `time` and `columns` must be given, and `units` of what is no pure number. The rest is for
    files that leave a choice: a message then names the key.
    """

    member: str | None = None
    """File to be read of a ZIP that holds several."""
    encoding: str | None = None
    """Encoding of the text, such as "latin-1", "cp1251", "utf-16-le"; left out: UTF-8, or what the
    first bytes say."""
    skip: Annotated[int, Field(ge=0)] = 0
    """Lines before the head, which names the columns. A head with all columns of the mapping is
    found without it."""
    skip_lines: tuple[Annotated[int, Field(ge=1)] | str, ...] = ()
    """Lines anywhere that are no rows: their numbers, from 1 on, or how they begin."""
    comment: str = "#"
    """Sign with which comments begin; a head may begin with it too."""
    separator: str | None = None
    """What separates the columns: a text, or "whitespace". Left out: the one of comma, semicolon,
    tab, | and white space with which the head has the columns of the mapping."""
    decimal: str | None = None
    """Decimal sign, "." or ","; the other one, blanks and apostrophes may then group digits. Left
    out: what the numbers themselves say."""
    names: list[str] | None = None
    """Names of the columns of a file without a head."""
    missing: tuple[str, ...] = ("", "N/A", "NA", "nan", "NaN", "null", "-")
    """Texts that stand for a number that is missing; a number such as "-9999" stands for any
    spelling of it."""
    long: Long | None = None
    """Of a file with a row for each number: {name = COLUMN, value = COLUMN}, and unit = COLUMN
    where it states units."""
    only: dict[str, str] = Field(default_factory=dict)
    """Rows to be read: those that hold this text in this column, for each column named."""
    packet: str | None = None
    """Packet of a ground archive (table of another database)."""
    time: Names
    """Column of the time stamps; several texts, such as date and time, are joined with a blank,
    several counts added."""
    time_format: Names = "iso"
    """'iso' (ISO 8601, also RFC 2822), a format of `strptime` such as '%d-%m-%Y %H:%M:%S', or a
    count: an origin and its ticks such as 'unix_ms' or 'gps_s', or a date such as 'mjd'. Counts in
    several columns: the first one's, then ticks, such as ["gps_weeks", "s"] or
    ["year", "day_of_year", "s"]."""
    epoch: datetime | None = None
    """Instant from which a count begins, in place of its own: a time with a zone. Must be given for
    'since_s' and 'elapsed_s', and as the day of the first stamp for a clock without a date, such as
    '%H:%M:%S'."""
    zone: str | None = None
    """Zone of stamps that do not state one: 'UTC', an offset such as '+04:00', or a name such as
    'Europe/Moscow'."""
    columns: dict[str, Names]
    """Columns of each quantity, in the order x, y, z unless `order` states another. One column may
    hold all numbers of a quantity."""
    split: dict[str, str] = Field(default_factory=dict)
    """What separates the numbers of a quantity whose numbers are joined in one column; left out:
    blanks, commas, semicolons, with or without brackets."""
    units: dict[str, str] = Field(default_factory=dict)
    """Unit of each quantity; required unless it is a pure number. Units beside the numbers in the
    cells count first. Of `position_geodetic` it is the height's; its angles are in degrees."""
    scale: dict[str, float | list[float]] = Field(default_factory=dict)
    """Factor of the numbers of a quantity, one or one for each column: scale * number + offset is
    in its unit."""
    offset: dict[str, float | list[float]] = Field(default_factory=dict)
    """What is added to the scaled numbers of a quantity, in its unit, one or one for each
    column."""
    order: dict[str, Names] = Field(default_factory=dict)
    """Of vectors: which axis of the body each column is, such as ["y", "-x", "z"]. Of quaternions:
    "xyzw" or "wxyz"."""
    inverse: tuple[str, ...] = ()
    """Quaternions that are logged as J to body."""
    place: Vector | None = None
    """Place on the ground where all rows were taken, as at a test: geodetic latitude and longitude
    in degrees, height in metres."""

    @property
    def time_columns(self) -> list[str]:
        """Columns of the stamps."""
        return names_in(self.time)

    @property
    def time_formats(self) -> list[str]:
        """Format of the stamps; of counts in several columns one for each."""
        return names_in(self.time_format)

    @field_validator("separator", "comment", "encoding", "member")
    @classmethod
    def _not_empty(cls, text):
        if text == "":
            raise ValueError("must not be empty")
        return text

    @field_validator("encoding")
    @classmethod
    def _known_encoding(cls, name):
        import codecs

        try:
            text = name is None or codecs.lookup(name)._is_text_encoding
        except LookupError:
            text = False
        if not text:
            raise ValueError(f"must be one that Python knows, such as 'cp1251'; received {name!r}")
        return name

    @field_validator("decimal")
    @classmethod
    def _known_sign(cls, sign):
        if sign not in (None, ".", ","):
            raise ValueError(f'must be "." or ","; received {sign!r}')
        return sign

    @field_validator("zone")
    @classmethod
    def _known_zone(cls, zone):
        if zone is not None:
            parse_zone(zone)
        return zone

    @field_validator("epoch", mode="before")
    @classmethod
    def _instant(cls, epoch):
        return None if epoch is None else parse_utc(epoch, "epoch")

    @field_validator("place")
    @classmethod
    def _on_ground(cls, place):
        if place is not None:
            check_place(place)
        return place

    @model_validator(mode="after")
    def _fits(self):
        for table in ("columns", "split", "units", "order", "scale", "offset"):
            for name in getattr(self, table):
                _check_name(table, name)
                if name not in self.columns:
                    raise ValueError(f"{table}.{name}: must have columns.{name} too; received none")
        for name in self.inverse:
            if COLUMNS.get(name, COLUMNS["temperature"]).dimension != "component":
                raise ValueError(f"inverse: must name quaternions; received {name!r}")
        for name in self.columns:
            self._check_quantity(name)
        if not self.columns:
            raise ValueError("columns: must name a quantity; received none")
        self._check_positions()
        self._check_time()
        return self

    def _check_positions(self) -> None:
        given = [name for name in ("position_j", *FORMS) if name in self.columns]
        given += [PLACE] * (self.place is not None)
        if len(given) > 1:
            raise ValueError(
                f"{given[0]}: must be the only form of the position; received also "
                f"{', '.join(given[1:])}"
            )

    def _check_time(self) -> None:
        first, formats = self.time_formats[0], self.time_formats
        if is_counted(first) or len(formats) > 1:
            check_formats(formats, len(self.time_columns))
        of = find_epoch(first)
        if is_clock(first):
            if self.epoch is None:
                raise ValueError(f"epoch: must be given for time_format {first!r}; received none")
            return
        if of is None and self.epoch is not None:
            raise ValueError(f"epoch: must be left out for time_format {first!r}; received it")
        if of is not None and not of.start and self.epoch is None:
            raise ValueError(f"epoch: must be given for time_format {first!r}; received none")

    def _check_quantity(self, name: str) -> None:
        quantity, columns = COLUMNS[name], names_in(self.columns[name])
        wanted = 1 if name in self.split else quantity.size
        fits = len(columns) in (1, wanted) or (name == "cells_measured" and len(columns) <= wanted)
        if not fits:
            raise ValueError(
                f"columns.{name}: must name {wanted} column{'s' * (wanted > 1)}; "
                f"received {len(columns)}"
            )
        for table in ("scale", "offset"):
            given = getattr(self, table).get(name, 0.0)
            if isinstance(given, list) and len(given) != quantity.size:
                raise ValueError(
                    f"{table}.{name}: must be a number or {quantity.size}; received {len(given)}"
                )
        self._check_unit(name, self.units.get(name))
        self._check_order(name, quantity.dimension)

    def _check_unit(self, name: str, unit: str | None) -> None:
        if unit is None and COLUMNS[name].units != "1":
            raise ValueError(
                f"units.{name}: must be one of {', '.join(units_for(name))}; received none"
            )
        if unit is not None and parse_unit(unit) not in units_for(name):
            raise ValueError(
                f"units.{name}: must be one of {', '.join(units_for(name))}; received {unit!r}"
            )

    def _check_order(self, name: str, dimension: str) -> None:
        order = self.order.get(name)
        if order is None:
            return
        if dimension == "component":
            if order not in QUATERNIONS:
                raise ValueError(
                    f"order.{name}: must be one of {', '.join(QUATERNIONS)}; received {order!r}"
                )
            return
        given = names_in(order)
        right = dimension == "axis" and len(given) == 3 and set(given) <= _AXES
        if not right or {each[-1] for each in given} != set("xyz"):
            raise ValueError(
                f'order.{name}: must name each axis once, such as ["y", "-x", "z"]; '
                f"received {order!r}"
            )


def _check_name(table: str, name: str) -> None:
    if name not in COLUMNS:
        raise ValueError(f"{table}.{name}: must be one of {', '.join(COLUMNS)}; received {name}")


def names_in(given: Names) -> list[str]:
    """A name or several as a list."""
    return [given] if isinstance(given, str) else list(given)


def load_mapping(path: Path | str) -> Mapping:
    """The mapping of a TOML file; ValueError with a line for each mistake."""
    return make_mapping(parse_toml(read_text(Path(path), "mapping"), "mapping"))


def make_mapping(data: dict) -> Mapping:
    """The mapping of plain data; ValueError with a line for each mistake."""
    try:
        return Mapping.model_validate(data)
    except ValidationError as error:
        lines = explain(error, data, Mapping)
        raise ValueError("\n".join(f"mapping: {line}" for line in lines)) from None


def write_mapping(mapping: Mapping, guesses: list[str], others: list[str] | None = None) -> str:
    """A mapping file: what was guessed and the other readings as comments, then its keys."""
    notes = [f"# guessed: {guess}\n" for guess in guesses]
    notes += [f"# also possible: {other}\n" for other in others or ()]
    kept = mapping.model_dump(exclude_defaults=True)
    return (
        "# Mapping of telemetry: `torquer telemetry FILE --mapping` reads it,\n"
        "# `torquer explain mapping` lists its keys.\n"
        f"{''.join(notes)}\n{to_toml(kept)}"
    )
