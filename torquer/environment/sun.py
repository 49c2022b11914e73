"""The Sun as seen from an Earth satellite: apparent position, and visible fraction of its disc."""

import math
from datetime import datetime
from typing import NamedTuple

import numpy as np

from torquer.base.conventions import (
    EARTH_FLATTENING,
    EARTH_RADIUS_M,
    SUN_RADIUS_M,
)
from torquer.base.time import julian_dates
from torquer.compile.engine import kernel
from torquer.environment.earth import rotation
from torquer.environment.earth.apparent_sun import apparent_sun_gcrf
from torquer.environment.earth.rotation import check_mode
from torquer.maths.geometry.vec3 import add_scaled, as_vector, cross, dot, norm, read_vector, sub

#: Models of the Earth's shadow: cone of a sphere, cone of the ellipsoid WGS84, cylinder, no shadow.
ECLIPSES = ("conical", "oblate", "cylindrical", "none")
#: Slope above that of any ray that touches Earth and Sun: 0.0048 at perihelion.
_PENUMBRA = 0.006
#: Equatorial over polar radius of the Earth, less one.
_OBLATENESS = EARTH_FLATTENING / (1.0 - EARTH_FLATTENING)


class Shadow(NamedTuple):
    """The Earth's shadow for kernels: a cylinder, or the cone of a body oblate along `pole`.

    `radius_m`: equatorial radius, 0 for no shadow; `oblateness`: equatorial over polar radius, less
    one; `pole`: unit vector, inertial.
    """

    cylinder: bool
    radius_m: float
    oblateness: float
    pole: tuple


def find_shadow(model: str = "conical", pole=(0.0, 0.0, 1.0)) -> Shadow:
    """The shadow by its model's name; `ValueError` for an unknown one."""
    if model not in ECLIPSES:
        raise ValueError(f"eclipse: must be one of {', '.join(ECLIPSES)}; received {model!r}")
    radius_m = 0.0 if model == "none" else EARTH_RADIUS_M
    oblateness = _OBLATENESS if model == "oblate" else 0.0
    return Shadow(model in ("cylindrical", "none"), radius_m, oblateness, as_vector(pole))


def sun_position(t_s, start_utc: str | datetime, mode: str = "precise") -> np.ndarray:
    """Apparent position of the Sun from the Earth's centre [n, 3] m, at times [n] s, in J.

    J is GCRF (mode "precise") or the frame of date TEME ("sidereal"). Light time and aberration
    are included; the direction is good to about 0.1 arcsec for 1900-2100.
    """
    check_mode(mode)
    ut1, tt = julian_dates(start_utc, np.atleast_1d(t_s))
    if mode == "precise":
        return rotation.interpolate_slow(apparent_sun_gcrf, *tt)
    lag = float(ut1[1][0] - tt[1][0])
    return rotation.interpolate_slow(_apparent_teme, *tt, lag)


def sunlit_fraction(r_m, sun_m, shadow: Shadow | str = "conical") -> np.ndarray:
    """Visible fraction of the Sun's disc, 0 (umbra) to 1, at positions [n, 3] m; Sun at [n, 3] m.

    "conical": the Earth (a sphere of the equatorial radius) and the Sun are flat discs on the
    sky; the overlap is exact, also where the Earth lies wholly inside the Sun. "oblate": the same
    for the ellipsoid, its pole along axis 3 unless the `Shadow` has another. "cylindrical":
    0 in the cylinder behind the Earth, 1 elsewhere. "none": 1 everywhere. All in one inertial
    frame.
    """
    shadow = find_shadow(shadow) if isinstance(shadow, str) else shadow
    r, sun = np.broadcast_arrays(np.atleast_2d(r_m), np.atleast_2d(sun_m))
    r, sun = (np.ascontiguousarray(x, np.float64) for x in (r, sun))
    out = np.empty(len(r))
    _sunlit_fractions(shadow, r, sun, out)
    return out


def _apparent_teme(day, fraction, ut1_minus_tt_days) -> np.ndarray:
    turn = rotation.gcrf_to_teme_on_grid(ut1_minus_tt_days, day, fraction)
    return (turn @ apparent_sun_gcrf(day, fraction)[..., None])[..., 0]


@kernel
def sunlit_fraction_at(shadow, r, sun):
    """Visible fraction of the Sun's disc at a position; both vectors in m, one inertial frame.

    Stretched along its pole the ellipsoid becomes a sphere, and rays stay straight, so that which
    of them are blocked is exact. The Sun, stretched as well, is treated as round: its rim is then
    in error by up to 0.34 % of its radius, 3 arcsec.
    """
    if shadow.cylinder:
        off_axis = norm(cross(r, sun)) / norm(sun)
        return 0.0 if dot(r, sun) < 0.0 and off_axis < shadow.radius_m else 1.0
    pole = shadow.pole
    r = add_scaled(r, shadow.oblateness * dot(r, pole), pole)
    sun = add_scaled(sun, shadow.oblateness * dot(sun, pole), pole)
    side = _penumbra_side(shadow.radius_m, r, sun)
    if side != 0.0:
        return max(side, 0.0)
    to_sun = sub(sun, r)
    size_sun = math.asin(SUN_RADIUS_M / norm(to_sun))
    size_earth = math.asin(min(shadow.radius_m / norm(r), 1.0))
    apart = math.atan2(norm(cross(to_sun, r)), -dot(to_sun, r))
    return 1.0 - _overlap(size_sun, size_earth, apart) / (math.pi * size_sun * size_sun)


@kernel
def _penumbra_side(radius, r, sun):
    """1 in full sunlight, -1 in the umbra, 0 near the penumbra: the discs must be compared."""
    behind = -dot(r, sun) / norm(sun)
    square = dot(r, r)
    margin = _PENUMBRA * math.sqrt(square)
    if behind < -margin:
        return 1.0
    off_axis = square - behind * behind
    outer, inner = radius + margin, radius - margin
    if off_axis > outer * outer:
        return 1.0
    if behind > margin and inner > 0.0 and off_axis < inner * inner:
        return -1.0
    return 0.0


@kernel
def _overlap(a, b, c):
    """Common area of discs of radii a and b whose centres lie c apart [rad^2, flat sky]."""
    if c >= a + b:
        return 0.0
    if c <= abs(a - b):
        least = min(a, b)
        return math.pi * least * least
    x = (c * c + (a - b) * (a + b)) / (2.0 * c)
    y = math.sqrt(max((a - x) * (a + x), 0.0))
    return a * a * math.atan2(y, x) + b * b * math.atan2(y, c - x) - c * y


@kernel
def _sunlit_fractions(shadow, r, sun, out):
    for i in range(out.size):
        out[i] = sunlit_fraction_at(shadow, read_vector(r[i]), read_vector(sun[i]))
