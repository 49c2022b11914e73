"""Work of `field point` and `field map`: elements of the field at places, tables, CSV, JSON.

Also what all commands on the field read: dates and field models.
"""

import csv
import io
import re
import sys
from datetime import UTC, date, datetime
from pathlib import Path

import numpy as np

from torquer.base.strict_json import json_text
from torquer.base.time import decimal_year, parse_utc
from torquer.cli.commands.field import HEIGHT, LATITUDE, LONGITUDE, MapOptions, PointOptions
from torquer.cli.output import make_writable, writing_to
from torquer.environment.field import FIELDS
from torquer.environment.field.at_point import point_field
from torquer.environment.field.coefficients import check_date, max_degree
from torquer.environment.field.drift import coefficients_of
from torquer.environment.field.gauss import Gauss

_NAMES = {
    "X": "north", "Y": "east", "Z": "down", "H": "horizontal", "F": "total",
    "D": "declination", "I": "inclination",
}  # fmt: skip
#: Names of a column, the first of which is written.
_COLUMNS = {
    "lat": ("lat", "latitude", "lat_deg", "latitude_deg"),
    "lon": ("lon", "longitude", "lon_deg", "longitude_deg"),
    "alt_km": ("alt_km", "altitude_km", "height_km"),
    "date": ("date", "time", "utc"),
}
_MOST = 1_000_000

# ------------------------------------------------------------ dates and models


def moment(text: str, option: str = "--date") -> datetime:
    """UTC of a date (at 00:00), a time with a zone, or a decimal year."""
    try:
        instant = _moment(text)
        if 1900 <= instant.year < 2100:
            return instant
    except (ValueError, OverflowError):
        pass
    raise ValueError(
        f"{option}: must be a date (2025-07-01), a time with a zone (2025-07-01T12:00Z) or a "
        f"decimal year (2025.5), within 1900 to 2099; received {text!r}"
    )


def _moment(text: str) -> datetime:
    if re.fullmatch(r"\d{4}(\.\d*)?", text):
        year = int(text[:4])
        begin, end = (datetime(y, 1, 1, tzinfo=UTC) for y in (year, year + 1))
        return begin + (end - begin) * (float(text) - year)
    try:
        day = date.fromisoformat(text)
    except ValueError:
        return parse_utc(text)
    return datetime(day.year, day.month, day.day, tzinfo=UTC)


def model_of(text: str, degree: int | None = None):
    """The field model of `name` or `name:degree`."""
    name, _, digits = text.partition(":")
    if name not in FIELDS:
        raise ValueError(f"--model: must be one of {', '.join(FIELDS)}; received {name!r}")
    degree = _degree(text, digits) if digits or text.endswith(":") else degree
    if degree is None:
        return FIELDS[name]()
    if not issubclass(FIELDS[name], Gauss):
        raise ValueError(f"--degree: must go with igrf14 or wmm2025; received it with {name}")
    if not 1 <= degree <= max_degree(name):
        raise ValueError(
            f"--degree: must lie within 1..{max_degree(name)} for {name}; received {degree}"
        )
    return FIELDS[name](degree=degree)


def _degree(text: str, digits: str) -> int:
    if not re.fullmatch(r"\d{1,4}", digits):
        raise ValueError(f"--model: must end with a degree, as in igrf14:6; received {text!r}")
    return int(digits)


def label(model) -> str:
    """A model's name in tables and pictures, marked where it is not the plain model."""
    if getattr(model, "extrapolate", False):
        model = model.model_copy(update={"extrapolate": False})
    if model == FIELDS[model.kind]():
        return model.kind
    if isinstance(model, Gauss) and model == FIELDS[model.kind](degree=model.degree):
        whole = model.degree == max_degree(model.kind)
        return model.kind if whole else f"{model.kind}:{model.degree}"
    return f"{model.kind} (scenario)"


def stamp(utc: datetime) -> str:
    """A date and time as text."""
    return f"{utc:%Y-%m-%d %H:%M} UTC"


def _model(how: PointOptions | MapOptions):
    """The model that has values at points, to be used beyond its validity if so asked."""
    model = model_of(how.model, how.degree)
    if isinstance(how, PointOptions) and how.extrapolate:
        if "extrapolate" not in type(model).model_fields:
            raise ValueError(
                f"--extrapolate: must go with a model that has dates; received it with {model.kind}"
            )
        model = model.model_copy(update={"extrapolate": True})
    if not hasattr(model, "b_earth_fixed"):
        others = ", ".join(k for k, v in FIELDS.items() if hasattr(v, "b_earth_fixed"))
        raise ValueError(
            f"--model: {model.kind} is defined along an orbit only; must be one of {others}"
        )
    return model


def _check_dates(model, *years: float) -> None:
    """ValueError naming the option, for dates beyond a model's validity."""
    source = coefficients_of(model)
    if source is None or model.extrapolate:  # the model itself reports that it extrapolates
        return
    for year in years:
        try:
            check_date(source, year, False)
        except ValueError as error:
            raise ValueError(f"--date: {error} (--extrapolate allows it)") from None


# ------------------------------------------------------------ one place


def point(how: PointOptions) -> int:
    """Print the elements at a place."""
    if how.lat is None or how.lon is None or how.date is None:
        missing = "--lat" if how.lat is None else "--lon" if how.lon is None else "--date"
        raise ValueError(f"{missing}: must be given, or --points; received nothing")
    model, utc = _model(how), moment(how.date)
    year = decimal_year(utc)
    _check_dates(model, year)
    found = point_field(model, year, how.lat, how.lon, how.alt_km, how.geocentric)
    rates = found.rates and {f"{k}_per_year": _number(v) for k, v in found.rates._asdict().items()}
    data = {
        "model": label(model),
        "date": utc.isoformat(),
        "decimal_year": year,
        "coordinates": "geocentric" if how.geocentric else "geodetic",
        "latitude_deg": how.lat,
        "longitude_deg": how.lon,
        "altitude_km": how.alt_km,
        "elements": {k: _number(v) for k, v in found.elements._asdict().items()},
        "rates": rates,
    }
    if how.json:
        print(json_text(data))
        return 0
    where = "geocentric latitude, height above 6371.2 km" if how.geocentric else "geodetic, WGS84"
    print(f"{label(model)}, {stamp(utc)} ({year:.4f})")
    print(f"latitude {how.lat:g}, longitude {how.lon:g} deg, height {how.alt_km:g} km ({where})")
    print("\n".join(_point_lines(data)))
    return 0


def _point_lines(data: dict) -> list[str]:
    lines = []
    for letter, (key, value) in zip(_NAMES, data["elements"].items(), strict=True):
        unit, digits = ("nT", 1) if key.endswith("_nt") else ("deg", 4)
        line = f"{letter}  {_NAMES[letter]:<12}{_fixed(value, digits):>12} {unit:<3}"
        if data["rates"]:
            line += f"{_fixed(data['rates'][f'{key}_per_year'], digits, '+'):>12} {unit}/yr"
        lines.append(line.rstrip())
    return lines


def _number(value) -> float | None:
    return float(value) if np.isfinite(value) else None


def _fixed(value: float | None, digits: int, sign: str = "") -> str:
    return "undefined" if value is None else f"{value:{sign}.{digits}f}"


# ------------------------------------------------------------ many places


def points(path: Path, how: PointOptions) -> int:
    """Print the elements at every place of a CSV file, as CSV or JSON."""
    if how.lat is not None or how.lon is not None:
        raise ValueError("--points: must not be given with --lat and --lon; received both")
    model, rows = _model(how), _read(path, how)
    places = np.array([row[:3] for row in rows], dtype=np.float64)
    dates = [row[3] for row in rows]
    elements, rates = _elements(model, places, dates, how.geocentric)
    columns = {"lat": places[:, 0], "lon": places[:, 1], "alt_km": places[:, 2]}
    numbers = columns | elements | rates
    if how.json:
        data = {name: [float(x) for x in values] for name, values in numbers.items()}
        print(json_text({"model": label(model), "date": [d.isoformat() for d in dates], **data}))
        return 0
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow([*columns, "date", *elements, *rates])
    for k, when in enumerate(dates):
        shown = {name: f"{values[k]:.10g}" for name, values in numbers.items()}
        place = [shown.pop(name) for name in columns]
        writer.writerow([*place, when.strftime("%Y-%m-%dT%H:%M:%SZ"), *shown.values()])
    return 0


def _elements(model, places, dates, geocentric: bool) -> tuple[dict, dict]:
    """Elements [nT, deg] and their rates, by name; places of one date are computed at once."""
    years = np.array([decimal_year(when) for when in dates])
    _check_dates(model, float(years.min()), float(years.max()))
    count = len(years)
    found: dict[str, np.ndarray] = {}
    rates: dict[str, np.ndarray] = {}
    for year in np.unique(years):
        here = np.flatnonzero(years == year)
        lat, lon, alt = places[here].T
        answer = point_field(model, float(year), lat, lon, alt, geocentric)
        for letter, values in zip(_NAMES, answer.elements, strict=True):
            found.setdefault(_column(letter), np.full(count, np.nan))[here] = values
        for letter, values in zip(_NAMES, answer.rates or (), strict=False):
            rates.setdefault(f"{_column(letter)}_per_year", np.full(count, np.nan))[here] = values
    return found, rates


def _column(letter: str) -> str:
    return f"{letter}_{'deg' if letter in 'DI' else 'nT'}"


def _read(path: Path, how: PointOptions) -> list[tuple]:
    """(latitude, longitude, height, date) of each row; the options', where a file has none."""
    from torquer.scenario.load import text_of

    reader = csv.DictReader(io.StringIO(text_of(path, "--points")), skipinitialspace=True)
    names = {name.strip().lower(): name for name in reader.fieldnames or ()}
    columns = {
        key: next((names[each] for each in known if each in names), None)
        for key, known in _COLUMNS.items()
    }
    for key in ("lat", "lon"):
        if columns[key] is None:
            raise ValueError(
                f"--points: must have a first line with the columns lat, lon, and as needed alt_km "
                f"and date; received {path} without {key}"
            )
    if columns["date"] is None and how.date is None:
        raise ValueError("--date: must be given where --points has no column date; received none")
    rows = [_row(line, columns, how, reader.line_num) for line in reader]
    if not 0 < len(rows) <= _MOST:
        raise ValueError(f"--points: must have 1 to {_MOST} places; received {len(rows)}")
    return rows


def _row(line: dict, columns: dict, how: PointOptions, number: int) -> tuple:
    where = f"--points, line {number}"
    texts = {key: (line.get(name) or "").strip() if name else "" for key, name in columns.items()}
    place = []
    for key, limit in (("lat", LATITUDE), ("lon", LONGITUDE), ("alt_km", HEIGHT)):
        try:
            value = how.alt_km if key == "alt_km" and not texts[key] else float(texts[key])
        except ValueError:
            raise ValueError(f"{where}: {key} must be a number; received {texts[key]!r}") from None
        limit.check(f"{where}: {key.replace('_', '-')}", value)
        place.append(value)
    if texts["date"]:
        return *place, moment(texts["date"], where)
    if how.date is None:
        raise ValueError(f"{where}: date must be given, or --date; received nothing")
    return *place, moment(how.date)


# ------------------------------------------------------------ the globe


def globe(how: MapOptions) -> int:
    """Draw a map; print its extremes."""
    if how.element not in _NAMES:
        raise ValueError(f"--element: must be one of {', '.join(_NAMES)}; received {how.element!r}")
    model, utc = _model(how), moment(how.date)
    make_writable(how.out)
    from torquer.analysis.field.field_map import field_map
    from torquer.report.field.map import draw_map

    grid = field_map(model, decimal_year(utc), how.alt_km)
    title = f"{label(model)}, {utc:%Y-%m-%d}, {how.alt_km:g} km"
    with writing_to(how.out):
        path = draw_map(grid, how.element, title, how.out / f"map_{how.element}.png")
    data = {
        "model": label(model), "date": utc.isoformat(), "altitude_km": how.alt_km,
        "element": how.element, "unit": grid.unit_of(how.element), **grid.extremes(how.element),
        "picture": str(path),
    }  # fmt: skip
    if how.json:
        print(json_text(data))
        return 0
    for name in ("least", "greatest"):
        at = data[name]
        print(
            f"{name:<9}{how.element} {at['value']:.6g} {data['unit']} at latitude "
            f"{at['latitude_deg']:g}, longitude {at['longitude_deg']:g} deg"
        )
    print(path)
    return 0
