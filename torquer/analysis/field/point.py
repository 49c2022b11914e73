"""The field at a place and date, or at every place of a file."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from datetime import datetime
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from torquer.analysis.field.models import (
    check_years,
    file_text,
    label,
    model_at_points,
    moment,
    stamp,
)
from torquer.analysis.field.requests import (
    ELEMENTS,
    HEIGHT,
    LATITUDE,
    LONGITUDE,
    FieldPointRequest,
    element_unit,
)
from torquer.base.language import message
from torquer.base.limits import RequestError
from torquer.base.rows import Row, as_data, as_html
from torquer.base.time import decimal_year
from torquer.environment.field.at_point import point_field
from torquer.environment.field.globe import Elements

if TYPE_CHECKING:
    import xarray as xr

#: Names of a column, the first of which is written.
_COLUMNS = {
    "lat": ("lat", "latitude", "lat_deg", "latitude_deg"),
    "lon": ("lon", "longitude", "lon_deg", "longitude_deg"),
    "alt_km": ("alt_km", "altitude_km", "height_km"),
    "date": ("date", "time", "utc"),
}
_MOST = 1_000_000
_HINT = " ({extrapolate} allows it)"


@dataclass(frozen=True)
class FieldPoint:
    """The field at a place: rows of X, Y, Z, H, F, D, I, and of their changes per year.

    A value is NaN where it is undefined, as the declination of a vertical field. A model without
    dates has no `rates`.
    """

    model: str
    utc: datetime
    geocentric: bool
    latitude_deg: float
    longitude_deg: float
    altitude_km: float
    elements: tuple[Row, ...]
    rates: tuple[Row, ...]

    def data(self) -> dict:
        """Plain data, with units in the keys."""
        return {
            "model": self.model,
            "date": self.utc.isoformat(),
            "decimal_year": decimal_year(self.utc),
            "coordinates": "geocentric" if self.geocentric else "geodetic",
            "latitude_deg": self.latitude_deg,
            "longitude_deg": self.longitude_deg,
            "altitude_km": self.altitude_km,
            "elements": as_data(self.elements),
            "rates": as_data(self.rates) or None,
        }

    def lines(self) -> list[str]:
        """Text: model, date and place, then a line for each element."""
        where = "geodetic, WGS84"
        if self.geocentric:
            where = "geocentric latitude, height above 6371.2 km"
        return [
            f"{self.model}, {stamp(self.utc)} ({decimal_year(self.utc):.4f})",
            f"latitude {self.latitude_deg:g}, longitude {self.longitude_deg:g} deg, height "
            f"{self.altitude_km:g} km ({where})",
            *(_line(*rows) for rows in zip_longest(self.elements, self.rates)),
        ]

    def _repr_html_(self) -> str:
        """In notebooks: a row for each element."""
        pairs = zip_longest(self.elements, self.rates)
        return as_html([_entry(*rows) for rows in pairs], self.lines()[:2])


def _line(now: Row, change: Row | None) -> str:
    letter, name = now.label.split()
    given = {"letter": letter, "name": name, "now": now.text, "unit": now.unit}
    if change is None:
        return message("{letter}  {name:<12}{now:>12} {unit}", **given)
    return message(
        "{letter}  {name:<12}{now:>12} {unit:<3}{change:>12} {unit_a_year}",
        **given, change=change.text, unit_a_year=change.unit,
    )  # fmt: skip


def _entry(now: Row, change: Row | None) -> list[Row]:
    """An element as a row of a table."""
    texts = {"element": now.label, "value": f"{now.text} {now.unit}"}
    texts |= {"change": f"{change.text} {change.unit}"} if change else {}
    return [Row("", label, text=text) for label, text in texts.items()]


def _rows(values: Elements | None, per: str = "", sign: str = "") -> tuple[Row, ...]:
    """Rows of elements, or of their changes per year."""
    keys, suffix = Elements._fields, "_per_year" if per else ""
    return tuple(
        Row(f"{key}{suffix}", f"{letter} {ELEMENTS[letter]}", float(value),
            element_unit(letter) + per, _fix(float(value), element_unit(letter), sign))
        for key, letter, value in zip(keys, ELEMENTS, values or (), strict=values is not None)
    )  # fmt: skip


def _fix(value: float, unit: str, sign: str) -> str:
    digits = 1 if unit == "nT" else 4
    return f"{value:{sign}.{digits}f}" if np.isfinite(value) else "undefined"


def field_point(asked: FieldPointRequest) -> FieldPoint:
    """Elements of the field [nT, deg] at a place and date, with their change per year.

        from torquer.analysis.field import FieldPointRequest, field_point
        found = field_point(FieldPointRequest(lat=55.75, lon=37.62, date="2025-07-01"))
        print(*found.lines(), sep="\\n")

    `RequestError` without a place and a date, and for a model that has no value there.
    """
    for key in ("lat", "lon", "date"):
        if getattr(asked, key) is None:
            raise RequestError(key, "must be given, or {points}; received nothing")
    assert asked.lat is not None and asked.lon is not None and asked.date is not None
    model, utc = _model(asked), moment(asked.date)
    year = decimal_year(utc)
    check_years(model, year, hint=_HINT)
    found = point_field(model, year, asked.lat, asked.lon, asked.alt_km, asked.geocentric)
    return FieldPoint(
        label(model), utc, asked.geocentric, asked.lat, asked.lon, asked.alt_km,
        _rows(found.elements), _rows(found.rates, "/yr", "+"),
    )  # fmt: skip


def _model(asked: FieldPointRequest):
    return model_at_points(asked.model, asked.degree, asked.extrapolate)


def field_points(asked: FieldPointRequest) -> xr.Dataset:
    """Elements of the field at every place of a CSV file, each at its date.

    A Dataset over `place` with X to I [nT, deg] and their changes, `X_per_year` and so on, if the
    model has dates. `RequestError` for a file that cannot be read, with the line of a mistake.
    """
    import xarray as xr  # takes as long to load as all the rest that one place needs

    if asked.points is None:
        raise RequestError("points", "must be given; received nothing")
    if asked.lat is not None or asked.lon is not None:
        raise RequestError("points", "must not be given with {lat} and {lon}; received both")
    model, rows = _model(asked), _read(asked.points, asked)
    places, dates = np.array([row[:3] for row in rows]), [row[3] for row in rows]
    columns = _element_columns(model, places, dates, asked.geocentric)
    coordinates = {
        "lat": ("place", places[:, 0], {"units": "deg"}),
        "lon": ("place", places[:, 1], {"units": "deg"}),
        "alt_km": ("place", places[:, 2], {"units": "km"}),
        "date": ("place", np.array([d.replace(tzinfo=None) for d in dates], "datetime64[us]")),
    }
    return xr.Dataset(columns, coordinates, {"model": label(model)})


def _element_columns(model, places, dates, geocentric: bool) -> dict[str, tuple]:
    """Elements and rates by name; places of one date are computed at once."""
    years = np.array([decimal_year(when) for when in dates])
    check_years(model, float(years.min()), float(years.max()), hint=_HINT)
    found: dict[str, np.ndarray] = {}
    for year in np.unique(years):
        here = np.flatnonzero(years == year)
        lat, lon, alt_km = places[here].T
        answer = point_field(model, float(year), lat, lon, alt_km, geocentric)
        for suffix, elements in (("", answer.elements), ("_per_year", answer.rates)):
            for letter, values in zip(ELEMENTS, elements or (), strict=False):
                name = f"{letter}{suffix}"
                found.setdefault(name, np.full(len(years), np.nan))[here] = values
    units = {name: element_unit(name[0]) + ("/yr" if name[1:] else "") for name in found}
    elements_first = sorted(found, key=lambda name: name.endswith("_per_year"))
    return {name: ("place", found[name], {"units": units[name]}) for name in elements_first}


def _read(path: Path, asked: FieldPointRequest) -> list[tuple]:
    """(latitude, longitude, height, date) of each row; the request's, where a file has none."""
    reader = csv.DictReader(io.StringIO(file_text(path, "points")), skipinitialspace=True)
    names = {name.strip().lower(): name for name in reader.fieldnames or ()}
    columns = {
        key: next((names[each] for each in known if each in names), None)
        for key, known in _COLUMNS.items()
    }
    for key in ("lat", "lon"):
        if columns[key] is None:
            raise RequestError(
                "points",
                "must have a first line with the columns lat, lon, and as needed alt_km "
                f"and date; received {path} without {key}",
            )
    if columns["date"] is None and asked.date is None:
        raise RequestError("date", "must be given where {points} has no column date; received none")
    rows = [_row(line, columns, asked, reader.line_num) for line in reader]
    if not 0 < len(rows) <= _MOST:
        raise RequestError("points", f"must have 1 to {_MOST} places; received {len(rows)}")
    return rows


def _row(line: dict, columns: dict, asked: FieldPointRequest, number: int) -> tuple:
    where = f"points, line {number}"
    texts = {key: (line.get(name) or "").strip() if name else "" for key, name in columns.items()}
    place = []
    for key, limit in (("lat", LATITUDE), ("lon", LONGITUDE), ("alt_km", HEIGHT)):
        try:
            value = asked.alt_km if key == "alt_km" and not texts[key] else float(texts[key])
        except ValueError:
            raise RequestError(where, f"{key} must be a number; received {texts[key]!r}") from None
        limit.check(f"{where}: {key}", value)
        place.append(value)
    if texts["date"]:
        return *place, moment(texts["date"], where)
    if asked.date is None:
        raise RequestError(where, "date must be given, or {date}; received nothing")
    return *place, moment(asked.date)
