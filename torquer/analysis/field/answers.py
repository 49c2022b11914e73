"""Datasets of the field as text, JSON and CSV."""

import csv
import io
from datetime import UTC
from json import loads

import numpy as np
import xarray as xr

from torquer.analysis.field.globe import extremes
from torquer.analysis.field.requests import element_unit
from torquer.base.rows import Row, as_data

#: Rows of the thinned table along an orbit.
_ROWS = 19

# ------------------------------------------------------------ at places


def places_data(places: xr.Dataset) -> dict:
    """Places of `field_points` for JSON, a list for each column."""
    numbers = {name: values.tolist() for name, values in _columns(places).items()}
    dates = [date.isoformat() for date in _dates(places)]
    return {"model": places.attrs["model"], "date": dates, **numbers}


def places_csv(places: xr.Dataset) -> str:
    """Places of `field_points` as CSV."""
    columns = {name: [f"{x:.10g}" for x in values] for name, values in _columns(places).items()}
    place = {name: columns.pop(name) for name in ("lat", "lon", "alt_km")}
    dates = [f"{date:%Y-%m-%dT%H:%M:%SZ}" for date in _dates(places)]
    table = {**place, "date": dates, **columns}
    writer = csv.writer(text := io.StringIO(), lineterminator="\n")
    writer.writerows([table, *zip(*table.values(), strict=True)])
    return text.getvalue()


def _columns(places: xr.Dataset) -> dict[str, np.ndarray]:
    """Numbers by column: the place, then the elements, with their units in the names."""
    elements = {f"{name[0]}_{element_unit(name[0])}{name[1:]}": name for name in map(str, places)}
    columns = {"lat": "lat", "lon": "lon", "alt_km": "alt_km", **elements}
    return {column: places[name].values for column, name in columns.items()}


def _dates(places: xr.Dataset) -> list:
    dates = places["date"].values.astype("datetime64[us]").tolist()
    return [date.replace(tzinfo=UTC) for date in dates]


# ------------------------------------------------------------ the globe


def map_data(grid: xr.Dataset) -> dict:
    """What `field_map` was asked, and the extremes of the element."""
    about = {key: grid.attrs[key] for key in ("model", "date", "altitude_km", "element")}
    return {**about, "unit": element_unit(grid.attrs["element"]), **extremes(grid)}


def map_lines(grid: xr.Dataset) -> list[str]:
    """The extremes of the element in text."""
    data = map_data(grid)
    return [
        f"{name:<9}{data['element']} {data[name]['value']:.6g} {data['unit']} at latitude "
        f"{data[name]['latitude_deg']:g}, longitude {data[name]['longitude_deg']:g} deg"
        for name in ("least", "greatest")
    ]


# ------------------------------------------------------------ along an orbit


def orbit_data(along: xr.Dataset) -> dict:
    """What `field_orbit` found: the orbit once, then the field of each model [nT]."""
    fields = (along.isel(model=m) for m in range(along.sizes["model"]))
    return {
        "orbit": loads(along.attrs["orbit"]),
        "start": along.attrs["start"],
        "time_s": _round_off(along["time"], 6),
        "argument_of_latitude_deg": _round_off(along["argument_of_latitude"], 6),
        "latitude_deg": _round_off(along["latitude"], 6),
        "longitude_deg": _round_off(along["longitude"], 6),
        "height_km": _round_off(along["height"], 6),
        "fields": [
            {
                "model": str(field["model"].values),
                "b_inertial_nt": _round_off(1e9 * field["b_inertial"], 4),
                "b_orbital_nt": _round_off(1e9 * field["b_orbital"], 4),
                "strength_nt": _round_off(1e9 * field["strength"], 4),
                "angle_to_first_deg": _round_off(field["angle_to_first"], 6),
            }
            for field in fields
        ],
    }


def _round_off(values: xr.DataArray, digits: int) -> list:
    return np.round(values.values, digits).tolist()


def orbit_lines(along: xr.Dataset) -> list[str]:
    """What `field_orbit` found in text: the size of each model's field, the first in some rows."""
    name, from_, start = along.attrs["title"].rpartition(", from ")
    kind, minutes = loads(along.attrs["orbit"])["kind"], float(along["time"][-1]) / 60.0
    head = f"{name}, {kind} orbit{from_}{start}, {minutes:.4g} min"
    return [head, "", *_size_lines(along), "", *_row_lines(along)]


def _sizes(strength) -> list[Row]:
    """Least, mean and greatest size of a model's field."""
    return [
        Row(key, label, nt := float(1e9 * of(strength)), "nT", f"{nt:.0f}")
        for key, label, of in (
            ("least_nt", "|B| min", np.min),
            ("mean_nt", "mean", np.mean),
            ("greatest_nt", "max nT", np.max),
        )
    ]


def _size_lines(along: xr.Dataset) -> list[str]:
    labels = along["model"].values.tolist()
    wide, first = max(14, *map(len, labels)), labels[0]
    head = f"{'':<{wide}}{'|B| min':>11}{'mean':>9}{'max nT':>13}"
    lines = [head + (f"   angle to {first}: mean, max deg" if len(labels) > 1 else "")]
    for m, name in enumerate(labels):
        least, mean, most = _sizes(along["strength"].values[m])
        line = f"{name:<{wide}}{least.text:>11}{mean.text:>9}{most.text:>13}"
        if name != first:
            angle = along["angle_to_first"].values[m]
            line += f"{'':<{len(first) + 5}}{angle.mean():>14.3f}{angle.max():>14.3f}"
        lines.append(line)
    return lines


def _row_lines(along: xr.Dataset) -> list[str]:
    """A thinned table of the first model."""
    rows = np.unique(np.linspace(0, along.sizes["time"] - 1, _ROWS).round().astype(int))
    first = along.isel(model=0, time=rows)
    b = np.hstack([first["b_inertial"], first["b_orbital"], first["strength"].values[:, None]])
    places = [first[key] for key in ("argument_of_latitude", "latitude", "longitude", "height")]
    numbers = np.column_stack([first["time"] / 60.0, *places, 1e9 * b])
    form = (
        "{:>8.2f}{:>7.1f}{:>7.1f}{:>8.1f}{:>7.0f}"
        "{:>9.0f}{:>8.0f}{:>8.0f}{:>9.0f}{:>8.0f}{:>8.0f}{:>8.0f}"
    )
    return [
        f"{first['model'].values} in nT, inertial (x y z) and orbital (along-track, orbit normal, "
        "radial)",
        f"{'t min':>8}{'u deg':>7}{'lat':>7}{'lon':>8}{'km':>7}"
        f"{'x':>9}{'y':>8}{'z':>8}{'along':>9}{'normal':>8}{'radial':>8}{'|B|':>8}",
        *(form.format(*row) for row in numbers.tolist()),
    ]


# ------------------------------------------------------------ the cone


def _cone_rows(paths: xr.Dataset) -> dict[str, list[Row]]:
    """Rows of each model: its sizes, and its greatest angle from the cone."""
    found = {}
    for m, name in enumerate(paths["model"].values.tolist()):
        off = float(paths["off_cone"][m].max())
        last = Row("greatest_off_cone_deg", "from the cone", off, "deg", f"{off:.3f}")
        found[name] = [*_sizes(paths["strength"].values[m]), last]
    return found


def cone_data(paths: xr.Dataset) -> dict:
    """The cone of `field_cone`, and how far each model leaves it."""
    return {
        "orbit": loads(paths.attrs["orbit"]),
        "start": paths.attrs["start"],
        "half_angle_deg": paths.attrs["half_angle_deg"],
        "b0_nt": 1e9 * paths.attrs["b0_t"],
        "models": [{"model": name, **as_data(rows)} for name, rows in _cone_rows(paths).items()],
    }


def cone_lines(paths: xr.Dataset) -> list[str]:
    """The same in text."""
    title, angle, b0_t = (paths.attrs[key] for key in ("title", "half_angle_deg", "b0_t"))
    lines = [f"{title}: cone of half-angle {angle:.3f} deg, {1e9 * b0_t:.0f} nT"]
    lines.append(
        f"{'':<15}{'|B| min':>10}{'mean':>8}{'max nT':>13}{'from the cone':>15} deg at most"
    )
    for name, rows in _cone_rows(paths).items():
        texts = zip(rows, (10, 8, 13, 15), strict=True)
        lines.append(f"{name:<15}" + "".join(f"{row.text:>{wide}}" for row, wide in texts))
    return lines
