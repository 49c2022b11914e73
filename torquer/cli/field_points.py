"""Work of `field point --points`: the elements at many places and dates, from and to CSV."""

import csv
import io
import sys
from pathlib import Path

import numpy as np

from torquer.cli.field_options import ELEMENTS, check_earth_fixed, check_place, label, moment
from torquer.cli.field_work import check_dates
from torquer.cli.output import json_text
from torquer.environment.field.at_point import point_field
from torquer.time import decimal_year

#: Names of a column, the first of which is written.
_COLUMNS = {
    "lat": ("lat", "latitude", "lat_deg", "latitude_deg"),
    "lon": ("lon", "longitude", "lon_deg", "longitude_deg"),
    "alt_km": ("alt_km", "altitude_km", "height_km"),
    "date": ("date", "time", "utc"),
}
_MOST = 1_000_000


def points(path: Path, alt_km: float, date: str | None, model, geocentric, as_json: bool) -> int:
    """Print the elements at every place of a CSV file, as CSV or JSON."""
    check_earth_fixed(model)
    rows = _read(path, alt_km, date)
    places = np.array([row[:3] for row in rows], dtype=np.float64)
    dates = [row[3] for row in rows]
    elements, rates = _elements(model, places, dates, geocentric)
    columns = {"lat": places[:, 0], "lon": places[:, 1], "alt_km": places[:, 2]}
    numbers = columns | elements | rates
    if as_json:
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
    check_dates(model, float(years.min()), float(years.max()))
    count = len(years)
    found: dict[str, np.ndarray] = {}
    rates: dict[str, np.ndarray] = {}
    for year in np.unique(years):
        here = np.flatnonzero(years == year)
        lat, lon, alt = places[here].T
        answer = point_field(model, float(year), lat, lon, alt, geocentric)
        for letter, values in zip(ELEMENTS, answer.elements, strict=True):
            found.setdefault(_column(letter), np.full(count, np.nan))[here] = values
        for letter, values in zip(ELEMENTS, answer.rates or (), strict=False):
            rates.setdefault(f"{_column(letter)}_per_year", np.full(count, np.nan))[here] = values
    return found, rates


def _column(letter: str) -> str:
    return f"{letter}_{'deg' if letter in 'DI' else 'nT'}"


def _read(path: Path, alt_km: float, date: str | None) -> list[tuple]:
    """(latitude, longitude, height, date) of each row; `alt_km`, `date` where a file has none."""
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
    if columns["date"] is None and date is None:
        raise ValueError("--date: must be given where --points has no column date; received none")
    rows = [_row(line, columns, alt_km, date, reader.line_num) for line in reader]
    if not 0 < len(rows) <= _MOST:
        raise ValueError(f"--points: must have 1 to {_MOST} places; received {len(rows)}")
    return rows


def _row(line: dict, columns: dict, alt_km: float, date: str | None, number: int) -> tuple:
    where = f"--points, line {number}"

    def number_at(key: str, default: float | None = None) -> float:
        text = line.get(columns[key]) if columns[key] else None
        if (text is None or not text.strip()) and default is not None:
            return default
        try:
            return float(text or "")
        except ValueError:
            raise ValueError(f"{where}: {key} must be a number; received {text!r}") from None

    place = number_at("lat"), number_at("lon"), number_at("alt_km", alt_km)
    try:
        check_place(*place)
    except ValueError as error:
        raise ValueError(f"{where}: {str(error).removeprefix('--')}") from None
    given = (line.get(columns["date"]) or "").strip() if columns["date"] else ""
    if not given and date is None:
        raise ValueError(f"{where}: date must be given, or --date; received nothing")
    return *place, moment(given or date or "", where if given else "--date")
