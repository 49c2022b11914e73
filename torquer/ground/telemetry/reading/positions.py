"""Positions as telemetry has them, and a place on the ground, as positions in J."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

#: The key of a place on the ground.
PLACE = "place"
#: Least and greatest height of a place on the ground [m]: below the Dead Sea, above balloons.
_HEIGHTS_M = (-5e3, 5e4)


class Form(NamedTuple):
    """A form of the position: what it is, and how it becomes a position in J.

    `to_j(values, t_s, start)`: values [n, 3], seconds [n] since `start` (a datetime in UTC).
    """

    meaning: str
    to_j: Callable


def _ecef_to_j(r, t_s, start) -> np.ndarray:
    from torquer.environment.earth.rotation import dcm_inertial_to_ecef

    return np.einsum("nji,nj->ni", dcm_inertial_to_ecef(t_s, start), r)


def _geodetic_to_j(values, t_s, start) -> np.ndarray:
    from torquer.maths.geometry.frames import ecef_from_geodetic

    lat, lon = np.radians(values[:, 0]), np.radians(values[:, 1])
    return _ecef_to_j(ecef_from_geodetic(lat, lon, values[:, 2]), t_s, start)


def _teme_to_j(r, t_s, start) -> np.ndarray:
    from torquer.environment.earth.rotation import teme_to_gcrf

    return np.einsum("nij,nj->ni", teme_to_gcrf(t_s, start), r)


#: Forms of a position other than `position_j`, by the names that mappings have for them.
FORMS = {
    "position_ecef": Form("Earth-fixed position from the Earth's centre", _ecef_to_j),
    "position_geodetic": Form(
        "geodetic latitude and longitude (degrees) and height above the ellipsoid, WGS84",
        _geodetic_to_j,
    ),
    "position_teme": Form("position in TEME, the frame of SGP4", _teme_to_j),
}


def check_place(place) -> None:
    """ValueError unless it is a latitude, a longitude [deg] and a height [m] of a place."""
    low, high = _HEIGHTS_M
    if abs(place[0]) > 90.0 or abs(place[1]) > 360.0 or not low <= place[2] <= high:
        raise ValueError(
            "must be latitude (within 90 deg), longitude (within 360 deg) and height "
            f"({low:g} to {high:g} m); received {list(place)}"
        )


def say_place(place) -> str:
    """A place on the ground in words."""
    return f"a place on the ground, {place[0]:g} {place[1]:g} deg, {place[2]:g} m"


def add_position(utc: np.ndarray, values: dict[str, np.ndarray], place=None) -> None:
    """Replace a form of the position in `values`, or a place on the ground, by `position_j`."""
    given = [name for name in FORMS if name in values]
    if place is not None:
        given, values["position_geodetic"] = ["position_geodetic"], np.tile(place, (len(utc), 1))
    if not given or not len(utc):
        return
    from datetime import UTC

    start = utc[0].astype("datetime64[us]").item().replace(tzinfo=UTC)
    t_s = (utc - utc[0]) / np.timedelta64(1, "s")
    (name,) = given
    values["position_j"] = FORMS[name].to_j(values.pop(name), t_s, start)
