"""How the columns of a file become the quantities of a session: a small TOML file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated
from zoneinfo import ZoneInfo

from pydantic import Field, ValidationError, field_validator, model_validator

from torquer.base.spec import Spec
from torquer.ground.telemetry.quantities import QUANTITIES, parse_unit, units_for
from torquer.scenario.explain import explain
from torquer.scenario.toml_text import parse_toml, read_text, to_toml

#: Time formats other than `strptime`'s: numbers that count from an instant in UTC, and ISO 8601.
COUNTED = {"unix_s": 1.0, "unix_ms": 1e3, "unix_us": 1e6, "unix_ns": 1e9}
#: Dates that count days: the number at the beginning of 1970.
DAYS = {"julian": 2440587.5, "mjd": 40587.0}
#: Orders of the numbers of a quaternion in a row.
QUATERNIONS = ("xyzw", "wxyz")
_AXES = {"x", "y", "z", "-x", "-y", "-z"}
Names = list[str] | str


class Mapping(Spec):
    """The keys of a mapping file."""

    skip: Annotated[int, Field(ge=0)] = 0
    """Lines before the head, which names the columns."""
    comment: str = "#"
    """Sign with which comments begin; a head may begin with it too."""
    separator: str = ","
    """What separates the columns: a text, or "whitespace"."""
    names: list[str] | None = None
    """Names of the columns of a file without a head."""
    missing: tuple[str, ...] = ("", "N/A", "NA", "nan", "NaN", "null", "-")
    """Texts that stand for a number that is missing."""
    packet: str | None = None
    """Packet of a ground archive (table of another database)."""
    time: Names
    """Column of the time stamps; several, such as date and time, are joined with a blank."""
    time_format: str = "iso"
    """'iso', 'unix_s', 'unix_ms', 'unix_us', 'unix_ns', 'julian', 'mjd', or a format of `strptime`
    such as '%d-%m-%Y %H:%M:%S'."""
    zone: str | None = None
    """Zone of stamps that do not state one: 'UTC', an offset such as '+04:00', or a name such as
    'Europe/Moscow'."""
    columns: dict[str, Names]
    """Columns of each quantity, in the order x, y, z unless `order` states another."""
    split: dict[str, str] = Field(default_factory=dict)
    """What separates the numbers of a quantity whose numbers are joined in one column."""
    units: dict[str, str] = Field(default_factory=dict)
    """Unit of each quantity; required unless it is a pure number."""
    order: dict[str, Names] = Field(default_factory=dict)
    """Of vectors: which axis of the body each column is, such as ["y", "-x", "z"]. Of quaternions:
    "xyzw" or "wxyz"."""
    inverse: tuple[str, ...] = ()
    """Quaternions that are logged as J to body."""

    @field_validator("separator", "comment")
    @classmethod
    def _not_empty(cls, text):
        if not text:
            raise ValueError("must not be empty")
        return text

    @field_validator("zone")
    @classmethod
    def _known_zone(cls, zone):
        if zone is not None:
            parse_zone(zone)
        return zone

    @model_validator(mode="after")
    def _fits(self):
        for table in ("columns", "split", "units", "order"):
            for name in getattr(self, table):
                _check_name(table, name)
                if name not in self.columns:
                    raise ValueError(f"{table}.{name}: must have columns.{name} too; received none")
        for name in self.inverse:
            if QUANTITIES.get(name, QUANTITIES["temperature"]).dimension != "component":
                raise ValueError(f"inverse: must name quaternions; received {name!r}")
        for name in self.columns:
            self._check_quantity(name)
        if not self.columns:
            raise ValueError("columns: must name a quantity; received none")
        return self

    def _check_quantity(self, name: str) -> None:
        quantity, columns = QUANTITIES[name], names_in(self.columns[name])
        wanted = 1 if name in self.split else quantity.size
        fits = len(columns) == wanted or (name == "cells_measured" and len(columns) <= wanted)
        if not fits:
            raise ValueError(
                f"columns.{name}: must name {wanted} column{'s' * (wanted > 1)}; "
                f"received {len(columns)}"
            )
        unit = self.units.get(name)
        if unit is None and quantity.units != "1":
            raise ValueError(
                f"units.{name}: must be one of {', '.join(units_for(name))}; received none"
            )
        if unit is not None and parse_unit(unit) not in units_for(name):
            raise ValueError(
                f"units.{name}: must be one of {', '.join(units_for(name))}; received {unit!r}"
            )
        self._check_order(name, quantity.dimension)

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
    if name not in QUANTITIES:
        raise ValueError(f"{table}.{name}: must be one of {', '.join(QUANTITIES)}; received {name}")


def names_in(given: Names) -> list[str]:
    """A name or several as a list."""
    return [given] if isinstance(given, str) else list(given)


def parse_zone(text: str):
    """The zone of a text: 'UTC', '+04:00' or 'Europe/Moscow'. ValueError for any other."""
    from datetime import UTC, datetime

    if text in ("UTC", "Z"):
        return UTC
    try:
        if text[:1] in "+-":
            return datetime.fromisoformat(f"2000-01-01T00:00:00{text}").tzinfo
        return ZoneInfo(text)
    except (ValueError, OSError, KeyError):
        raise ValueError(
            "must be 'UTC', an offset such as '+04:00', or a name such as 'Europe/Moscow'; "
            f"received {text!r}"
        ) from None


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


def write_mapping(mapping: Mapping, guesses: list[str]) -> str:
    """A mapping file: what was guessed as comments, then its keys."""
    notes = "".join(f"# guessed: {guess}\n" for guess in guesses)
    kept = mapping.model_dump(exclude_defaults=True)
    return f"# Mapping of telemetry: `torquer telemetry FILE --mapping` reads it.\n{notes}\n" + (
        to_toml(kept)
    )
