"""Elements of the field on a grid over the globe: extremes and dip poles."""

import numpy as np
import xarray as xr

from torquer.analysis.field.models import check_years, label, model_at_points, moment
from torquer.analysis.field.requests import ELEMENTS, FieldMapRequest, element_unit
from torquer.base.time import decimal_year
from torquer.environment.field.globe import at_geodetic, elements


def field_map(asked: FieldMapRequest) -> xr.Dataset:
    """All elements of the field over the globe on a grid of 1 deg; `element` is the one to draw.

        from torquer.analysis.field import FieldMapRequest, extremes, field_map
        extremes(field_map(FieldMapRequest(element="F")))

    A Dataset over `lat` and `lon` with X to I [nT, deg]. `RequestError` for a model that has no
    values at places, and for a date beyond its validity.
    """
    model, utc = model_at_points(asked.model, asked.degree), moment(asked.date)
    check_years(model, decimal_year(utc))
    grid = elements_on_grid(model, decimal_year(utc), asked.alt_km)
    return grid.assign_attrs(
        title=f"{label(model)}, {utc:%Y-%m-%d}, {asked.alt_km:g} km", model=label(model),
        date=utc.isoformat(), altitude_km=asked.alt_km, element=asked.element,
    )  # fmt: skip


def elements_on_grid(
    model, decimal_year: float, alt_km: float, step_deg: float = 1.0
) -> xr.Dataset:
    """The elements `[lat, lon]` at a height above the ellipsoid; `step_deg` divides 180.

    The grid includes both poles and both 180 deg.
    """
    lat = np.linspace(-90.0, 90.0, round(180.0 / step_deg) + 1)
    lon = np.linspace(-180.0, 180.0, round(360.0 / step_deg) + 1)
    found = elements(at_geodetic(model, decimal_year, lat[:, None], lon[None, :], alt_km))
    return xr.Dataset(
        {
            name: (("lat", "lon"), values, {"units": element_unit(name)})
            for name, values in zip(ELEMENTS, found, strict=True)
        },
        {"lat": ("lat", lat, {"units": "deg"}), "lon": ("lon", lon, {"units": "deg"})},
    )


def extremes(grid: xr.Dataset, element: str = "") -> dict:
    """`least` and `greatest` of an element on the grid, that of the request if left out, with
    their positions."""
    values = grid[element or grid.attrs["element"]]
    return {
        name: {
            "value": float(values[at]),
            "latitude_deg": float(values["lat"][at["lat"]]),
            "longitude_deg": float(values["lon"][at["lon"]]),
        }
        for name, at in (("least", values.argmin(...)), ("greatest", values.argmax(...)))
    }


def dip_poles(grid: xr.Dataset) -> tuple[tuple[float, float], ...]:
    """Latitude and longitude of the dip poles, north and south, where H is smallest."""
    found = []
    for side in (grid["lat"] >= 0.0, grid["lat"] < 0.0):
        at = grid["H"].where(side, np.inf).argmin(...)
        found.append((float(grid["lat"][at["lat"]]), float(grid["lon"][at["lon"]])))
    return tuple(found)
