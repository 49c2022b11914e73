"""The field at one place: its elements and their secular variation."""

from typing import NamedTuple

import numpy as np

from torquer.environment.field.coefficients import pieces, published_epochs
from torquer.environment.field.drift import coefficients_name
from torquer.environment.field.globe import Elements, at_geodetic, elements

#: Horizontal over total intensity below which the field counts as vertical, without declination.
_VERTICAL = 1e-9


class PointField(NamedTuple):
    """Elements [nT, deg] and their secular variation [nT/yr, deg/yr]; None for a constant model."""

    elements: Elements
    rates: Elements | None


def yearly_change(model, decimal_year: float, *place, geocentric: bool = False):
    """dB/dt [T/yr] `[..., 3]` in north-east-down axes; None for a constant model.

    The published coefficients are linear in time between their epochs, and so is the field: its
    difference between two epochs over the years between them is exact. At an epoch, that of the
    years that follow. `place` as in `at_geodetic`.
    """
    source = coefficients_name(model)
    if source is None:
        return None
    years = published_epochs(source).years
    k = int(pieces(source, decimal_year))
    first, last = (at_geodetic(model, y, *place, geocentric=geocentric) for y in years[k : k + 2])
    return (last - first) / (years[k + 1] - years[k])


def element_rates(now: Elements, b_rate_ned) -> Elements:
    """Rates of the elements [nT/yr, deg/yr] of a field that changes by `b_rate_ned` [T/yr]."""
    x, y, z = np.moveaxis(1e9 * np.asarray(b_rate_ned, dtype=np.float64), -1, 0)
    with np.errstate(invalid="ignore", divide="ignore"):
        h = (now.x_nt * x + now.y_nt * y) / now.h_nt
        f = (now.x_nt * x + now.y_nt * y + now.z_nt * z) / now.f_nt
        d = np.degrees((now.x_nt * y - now.y_nt * x) / now.h_nt**2)
        i = np.degrees((now.h_nt * z - now.z_nt * h) / now.f_nt**2)
    return Elements(x, y, z, h, f, d, i)


def point_field(
    model, decimal_year: float, lat_deg, lon_deg, alt_km, geocentric: bool = False
) -> PointField:
    """Elements and their secular variation at places (numbers or arrays), as for `at_geodetic`.

    D and what depends on the direction of H are NaN where the field is vertical.
    """
    place = (lat_deg, lon_deg, alt_km)
    now = elements(at_geodetic(model, decimal_year, *place, geocentric=geocentric))
    change = yearly_change(model, decimal_year, *place, geocentric=geocentric)
    rates = None if change is None else element_rates(now, change)
    upright = now.h_nt <= _VERTICAL * now.f_nt
    now = now._replace(d_deg=np.where(upright, np.nan, now.d_deg))
    if rates is not None:
        lost = {name: np.where(upright, np.nan, getattr(rates, name)) for name in _OF_H}
        rates = rates._replace(**lost)
    return PointField(now, rates)


_OF_H = ("h_nt", "d_deg", "i_deg")
