"""Work of the field commands: tables, JSON and pictures."""

from datetime import datetime
from pathlib import Path

import numpy as np

from torquer.cli.field_options import (
    ELEMENTS,
    OrbitCase,
    check_earth_fixed,
    check_place,
    label,
    moment,
)
from torquer.cli.output import json_text, make_writable, writing_to
from torquer.environment.field.along import FieldsAlong, angles_deg, fields_along
from torquer.environment.field.at_point import point_field
from torquer.environment.field.coefficients import check_date
from torquer.environment.field.drift import coefficients_of
from torquer.time import decimal_year

_NAMES = {
    "X": "north", "Y": "east", "Z": "down", "H": "horizontal", "F": "total",
    "D": "declination", "I": "inclination",
}  # fmt: skip
#: Rows of the thinned table.
_ROWS = 19


def check_dates(model, *years: float) -> None:
    """ValueError naming the option, for dates beyond a model's validity."""
    source = coefficients_of(model)
    if source is None or model.extrapolate:  # the model says itself that it extrapolates
        return
    for year in years:
        try:
            check_date(source, year, False)
        except ValueError as error:
            raise ValueError(f"--date: {error} (--extrapolate allows it)") from None


def point(
    place: tuple[float, float, float], when: str, model, geocentric: bool, as_json: bool
) -> int:
    """Print the elements at a place."""
    check_place(*place)
    check_earth_fixed(model)
    utc = moment(when)
    year = decimal_year(utc)
    check_dates(model, year)
    data = _point_data(place, utc, model, geocentric, point_field(model, year, *place, geocentric))
    if as_json:
        print(json_text(data))
        return 0
    where = "geocentric latitude, height above 6371.2 km" if geocentric else "geodetic, WGS84"
    lat, lon, alt_km = place
    print(f"{label(model)}, {_stamp(utc)} ({year:.4f})")
    print(f"latitude {lat:g}, longitude {lon:g} deg, height {alt_km:g} km ({where})")
    print("\n".join(_point_lines(data)))
    return 0


def _point_data(place, utc: datetime, model, geocentric: bool, found) -> dict:
    """Data of `--json`; null for an undefined element."""
    lat, lon, alt_km = place
    rates = found.rates and {f"{k}_per_year": _number(v) for k, v in found.rates._asdict().items()}
    return {
        "model": label(model),
        "date": utc.isoformat(),
        "decimal_year": decimal_year(utc),
        "coordinates": "geocentric" if geocentric else "geodetic",
        "latitude_deg": lat,
        "longitude_deg": lon,
        "altitude_km": alt_km,
        "elements": {k: _number(v) for k, v in found.elements._asdict().items()},
        "rates": rates,
    }


def _point_lines(data: dict) -> list[str]:
    lines = []
    for letter, (key, value) in zip(ELEMENTS, data["elements"].items(), strict=True):
        unit, digits = ("nT", 1) if key.endswith("_nt") else ("deg", 4)
        line = f"{letter}  {_NAMES[letter]:<12}{_fixed(value, digits):>12} {unit:<3}"
        if data["rates"]:
            line += f"{_fixed(data['rates'][f'{key}_per_year'], digits, '+'):>12} {unit}/yr"
        lines.append(line.rstrip())
    return lines


def orbit(case: OrbitCase, models: tuple, t_s, out: Path | None, as_json: bool) -> int:
    """Print the field along an orbit; draw it if a folder is given."""
    if out is not None:
        make_writable(out)
    along = _along(models, case, t_s, "--start")
    labels = [label(model) for model in models]
    if out is not None:
        from torquer.report.field.along import draw_along

        with writing_to(out):
            draw_along(along, labels, f"{case.name}, from {_stamp(case.start)}", out)
    if as_json:
        print(json_text(_along_data(case, along, labels), None))
        return 0
    print(
        f"{case.name}, {case.orbit.kind} orbit, from {_stamp(case.start)}, {t_s[-1] / 60.0:.4g} min"
    )
    print("\n".join(["", *_summary_lines(along, labels), "", *_row_lines(along, labels[0])]))
    if out is not None:
        print(f"\n{out}: inertial.png, orbital.png")
    return 0


def _along(models: tuple, case: OrbitCase, t_s, option: str) -> FieldsAlong:
    """The fields; the error for a date beyond a model's validity names the option that gave it."""
    try:
        return fields_along(models, case.orbit, case.start, t_s, case.earth_rotation, case.dut1_s)
    except ValueError as error:
        key, _, rest = str(error).partition("environment.field: ")
        if key or not rest:
            raise
        raise ValueError(f"{option}: {rest}") from None


def _along_data(case: OrbitCase, along: FieldsAlong, labels: list[str]) -> dict:
    """Data of `--json`: the orbit once, then the field of each model."""
    return {
        "orbit": case.orbit.model_dump(),
        "start": case.start.isoformat(),
        "time_s": _rounded(along.t_s, 6),
        "argument_of_latitude_deg": _rounded(along.u_deg, 6),
        "latitude_deg": _rounded(along.lat_deg, 6),
        "longitude_deg": _rounded(along.lon_deg, 6),
        "height_km": _rounded(along.height_km, 6),
        "fields": [
            {
                "model": name,
                "b_inertial_nt": _rounded(1e9 * along.b_inertial[m], 4),
                "b_orbital_nt": _rounded(1e9 * along.b_orbital[m], 4),
                "strength_nt": _rounded(1e9 * along.strength[m], 4),
                "angle_to_first_deg": _rounded(along.angle_to_first_deg[m], 6),
            }
            for m, name in enumerate(labels)
        ],
    }


def _summary_lines(along: FieldsAlong, labels: list[str]) -> list[str]:
    wide = max(14, *map(len, labels))
    compared = len(labels) > 1
    head = f"{'':<{wide}}{'|B| min':>11}{'mean':>9}{'max nT':>13}"
    lines = [head + (f"   angle to {labels[0]}: mean, max deg" if compared else "")]
    for name, size, angle in zip(labels, along.strength, along.angle_to_first_deg, strict=True):
        least, mean, most = (1e9 * f(size) for f in (np.min, np.mean, np.max))
        line = f"{name:<{wide}}{least:>11.0f}{mean:>9.0f}{most:>13.0f}"
        if compared and name != labels[0]:
            line += f"{'':<{len(labels[0]) + 5}}{angle.mean():>14.3f}{angle.max():>14.3f}"
        lines.append(line)
    return lines


def _row_lines(along: FieldsAlong, first: str) -> list[str]:
    """A thinned table of the first model."""
    rows = np.unique(np.linspace(0, len(along.t_s) - 1, _ROWS).round().astype(int))
    lines = [
        f"{first} in nT, inertial (x y z) and orbital (along-track, orbit normal, radial)",
        f"{'t min':>8}{'u deg':>7}{'lat':>7}{'lon':>8}{'km':>7}"
        f"{'x':>9}{'y':>8}{'z':>8}{'along':>9}{'normal':>8}{'radial':>8}{'|B|':>8}",
    ]
    for n in rows:
        place = f"{along.lat_deg[n]:>7.1f}{along.lon_deg[n]:>8.1f}{along.height_km[n]:>7.0f}"
        inertial, orbital = 1e9 * along.b_inertial[0, n], 1e9 * along.b_orbital[0, n]
        numbers = (*inertial, *orbital, 1e9 * along.strength[0, n])
        widths = (9, 8, 8, 9, 8, 8, 8)
        shown = "".join(f"{x:>{w}.0f}" for x, w in zip(numbers, widths, strict=True))
        lines.append(f"{along.t_s[n] / 60.0:>8.2f}{along.u_deg[n]:>7.1f}{place}{shown}")
    return lines


def globe(element: str, when: str, alt_km: float, model, out: Path, as_json: bool) -> int:
    """Draw a map; print its extremes."""
    if element not in ELEMENTS:
        raise ValueError(f"--element: must be one of {', '.join(ELEMENTS)}; received {element!r}")
    check_place(0.0, 0.0, alt_km)
    check_earth_fixed(model)
    utc = moment(when)
    make_writable(out)
    from torquer.analysis.field_map import field_map
    from torquer.report.field.map import draw_map

    grid = field_map(model, decimal_year(utc), alt_km)
    title = f"{label(model)}, {utc:%Y-%m-%d}, {alt_km:g} km"
    with writing_to(out):
        path = draw_map(grid, element, title, out / f"map_{element}.png")
    data = {
        "model": label(model), "date": utc.isoformat(), "altitude_km": alt_km, "element": element,
        "unit": grid.unit_of(element), **grid.extremes(element), "picture": str(path),
    }  # fmt: skip
    if as_json:
        print(json_text(data))
        return 0
    for name in ("least", "greatest"):
        at = data[name]
        print(
            f"{name:<9}{element} {at['value']:.6g} {data['unit']} at latitude "
            f"{at['latitude_deg']:g}, longitude {at['longitude_deg']:g} deg"
        )
    print(path)
    return 0


def cone(case: OrbitCase, models: tuple, t_s, out: Path, as_json: bool) -> int:
    """Draw the cone and the hodographs; print the largest deviation from the cone."""
    from torquer.analysis.field_cone import cone_of
    from torquer.report.field.cone import draw_cone, write_cone_page

    make_writable(out)
    along = _along(models, case, t_s, "--date")
    labels, title = [label(m) for m in models], f"{case.name}, from {_stamp(case.start)}"
    shape = cone_of(case.orbit)
    with writing_to(out):
        draw_cone(along, labels, shape, title, out / "cone.png")
        write_cone_page(along, labels, shape, title, out / "cone.html")
    data = _cone_data(case, along, labels, shape)
    if as_json:
        print(json_text(data))
        return 0
    print(f"{title}: cone of half-angle {shape.half_angle_deg:.3f} deg, {shape.b0_t * 1e9:.0f} nT")
    print(f"{'':<15}{'|B| min':>10}{'mean':>8}{'max nT':>13}{'from the cone':>15} deg at most")
    for each in data["models"]:
        sizes = (f"{each[k]:>{w}.0f}" for k, w in zip(_SIZES, (10, 8, 13), strict=True))
        print(f"{each['model']:<15}{''.join(sizes)}{each['greatest_off_cone_deg']:>15.3f}")
    print(f"{out}: cone.png, cone.html")
    return 0


_SIZES = ("least_nt", "mean_nt", "greatest_nt")


def _sizes_nt(strength_t) -> dict[str, float]:
    found = (np.min(strength_t), np.mean(strength_t), np.max(strength_t))
    return {key: float(1e9 * size) for key, size in zip(_SIZES, found, strict=True)}


def _cone_data(case: OrbitCase, along: FieldsAlong, labels: list[str], shape) -> dict:
    off = np.abs(angles_deg(along.b_y, shape.axis_y) - shape.half_angle_deg)
    models = [
        {
            "model": name,
            **_sizes_nt(size),
            "greatest_off_cone_deg": float(each.max()),
        }
        for name, size, each in zip(labels, along.strength, off, strict=True)
    ]
    return {
        "orbit": case.orbit.model_dump(),
        "start": case.start.isoformat(),
        "half_angle_deg": shape.half_angle_deg,
        "b0_nt": 1e9 * shape.b0_t,
        "models": models,
    }


def _number(value) -> float | None:
    return float(value) if np.isfinite(value) else None


def _fixed(value: float | None, digits: int, sign: str = "") -> str:
    return "undefined" if value is None else f"{value:{sign}.{digits}f}"


def _rounded(values, digits: int) -> list:
    return np.round(values, digits).tolist()


def _stamp(utc: datetime) -> str:
    return f"{utc:%Y-%m-%d %H:%M} UTC"
