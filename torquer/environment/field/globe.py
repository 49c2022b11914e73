"""The field at places on the globe, and the magnetic elements that observatories publish."""

from typing import NamedTuple

import numpy as np

from torquer.base.conventions import FIELD_RADIUS_M
from torquer.maths.geometry.frames import dcm_ecef_to_ned, ecef_from_geodetic


class Elements(NamedTuple):
    """North, east, down, horizontal and total intensity [nT]; declination, inclination [deg]."""

    x_nt: np.ndarray
    y_nt: np.ndarray
    z_nt: np.ndarray
    h_nt: np.ndarray
    f_nt: np.ndarray
    d_deg: np.ndarray
    i_deg: np.ndarray


def elements(b_ned_t) -> Elements:
    """X, Y, Z, H, F, D, I of flux-density vectors `[..., 3]` in north-east-down axes [T]."""
    x, y, z = np.moveaxis(1e9 * np.asarray(b_ned_t, dtype=np.float64), -1, 0)
    h = np.hypot(x, y)
    declination, inclination = np.degrees(np.arctan2(y, x)), np.degrees(np.arctan2(z, h))
    return Elements(x, y, z, h, np.hypot(h, z), declination, inclination)


def at_geodetic(
    model, decimal_year: float, lat_deg, lon_deg, alt_km, geocentric: bool = False
) -> np.ndarray:
    """Flux density [T] `[..., 3]` in north-east-down axes at places (numbers or arrays).

    Geodetic: WGS84 latitude and height. Geocentric: latitude from the Earth's centre, height
    above the sphere of 6371.2 km, down towards the centre. `ValueError` for a model that is
    defined along an orbit only.
    """
    if not hasattr(model, "b_earth_fixed"):
        raise ValueError(
            f"field model {model.kind}: must have an Earth-fixed form; received one that "
            "is defined along an orbit only"
        )
    lat, lon, height = np.broadcast_arrays(
        np.radians(lat_deg), np.radians(lon_deg), 1e3 * np.asarray(alt_km, dtype=np.float64)
    )
    dcm = dcm_ecef_to_ned(lat, lon)
    r = ecef_from_geodetic(lat, lon, height)
    if geocentric:
        r = -(FIELD_RADIUS_M + height[..., None]) * dcm[..., 2, :]
    b_ecef = model.b_earth_fixed(model.prepare(decimal_year), r.reshape(-1, 3)).reshape(r.shape)
    return np.einsum("...ij,...j->...i", dcm, b_ecef)
