"""The air as kernels take it: its density, one type for all models that compile; its velocity."""

import math
from typing import NamedTuple

import numpy as np

from torquer.base.conventions import EARTH_FLATTENING, EARTH_RADIUS_M, EARTH_RATE_RAD_S
from torquer.compile.engine import kernel
from torquer.maths.geometry.vec3 import cross, dot, norm, scale, sub

NONE, EXPONENTIAL, GOST = 0, 1, 2
_POLAR_RADIUS_M = EARTH_RADIUS_M * (1.0 - EARTH_FLATTENING)
_ECCENTRICITY_2 = EARTH_FLATTENING * (2.0 - EARTH_FLATTENING)
_SECOND_ECCENTRICITY_2 = _ECCENTRICITY_2 / (1.0 - _ECCENTRICITY_2)


class GostAir(NamedTuple):
    """Constants of GOST R 25645.166-2004 at given indices of activity; heights in km.

    `polynomials` [low or high, group, power] for the groups a, l, c, d, b, e; `above_km` [group]:
    from where the high ones hold; `bulge_power`: n0, n1, n2; `lag_rad`: of the density behind
    the Sun; `annual`: A0..A8; `level`, `flux`, `storm`: factors of the groups l, b and e.
    """

    night: float
    polynomials: np.ndarray
    above_km: np.ndarray
    bulge_power: tuple
    lag_rad: float
    annual: np.ndarray
    level: float
    flux: float
    storm: float


class Air(NamedTuple):
    """A model of the density for kernels; fields that its kind does not use are empty.

    `layers` [n, 3]: height [km], logarithm of the density, its decrease per km above that height.
    """

    kind: int
    lowest_km: float
    highest_km: float
    layers: np.ndarray
    gost: GostAir


NO_GOST = GostAir(
    0.0, np.zeros((2, 6, 7)), np.zeros(6), (0.0, 0.0, 0.0), 0.0, np.zeros(9), 0.0, 0.0, 0.0
)
NO_AIR = Air(NONE, -math.inf, math.inf, np.zeros((1, 3)), NO_GOST)


@kernel
def height_m(r_ecef_m):
    """Height above the ellipsoid WGS84 [m]: Bowring's formula once (below 1 mm under 3000 km)."""
    across, z = math.hypot(r_ecef_m[0], r_ecef_m[1]), r_ecef_m[2]
    s, c = z * EARTH_RADIUS_M, across * _POLAR_RADIUS_M
    size = math.hypot(s, c)
    s, c = s / size, c / size
    s = z + _SECOND_ECCENTRICITY_2 * _POLAR_RADIUS_M * s * s * s
    c = across - _ECCENTRICITY_2 * EARTH_RADIUS_M * c * c * c
    size = math.hypot(s, c)
    s, c = s / size, c / size
    return across * c + z * s - EARTH_RADIUS_M * math.sqrt(1.0 - _ECCENTRICITY_2 * s * s)


@kernel
def layer(layers, h_km):
    """Density [kg/m^3] that decays exponentially in each layer; the outermost extrapolate."""
    row = 0
    while row + 1 < layers.shape[0] and h_km >= layers[row + 1, 0]:
        row += 1
    return math.exp(layers[row, 1] - layers[row, 2] * (h_km - layers[row, 0]))


@kernel
def _polynomial(gost, group, h_km):
    row = gost.polynomials[1 if h_km > gost.above_km[group] else 0, group]
    total = row[6]
    for down in range(1, 7):
        total = total * h_km + row[6 - down]
    return total


@kernel
def bulge_angle_cosine(lag_rad, r_ecef, sun_ecef):
    """Cosine of the angle from the apex of the diurnal bulge, which lags behind the Sun."""
    c, s = math.cos(lag_rad), math.sin(lag_rad)
    densest = (c * sun_ecef[0] - s * sun_ecef[1], s * sun_ecef[0] + c * sun_ecef[1], sun_ecef[2])
    return dot(r_ecef, densest) / (norm(r_ecef) * norm(sun_ecef))


@kernel
def gost_density(gost, h_km, cos_bulge, day):
    """Density [kg/m^3] by the standard's formula: night density times its corrections.

    `h_km` above the ellipsoid, `cos_bulge` as `bulge_angle_cosine` gives it, `day` of the year.
    """
    night = gost.night * math.exp(_polynomial(gost, 0, h_km))
    level = 1.0 + _polynomial(gost, 1, h_km) * gost.level
    n = gost.bulge_power
    power = n[0] + h_km * (n[1] + h_km * n[2])
    cos_half = math.sqrt(max(0.5 * (1.0 + cos_bulge), 0.0))
    daily = _polynomial(gost, 2, h_km) * cos_half**power
    annual = gost.annual[8]
    for down in range(1, 9):
        annual = annual * day + gost.annual[8 - down]
    annual *= _polynomial(gost, 3, h_km)
    active = _polynomial(gost, 4, h_km) * gost.flux + _polynomial(gost, 5, h_km) * gost.storm
    return night * level * (1.0 + daily + annual + active)


@kernel
def density(air, r_ecef_m, sun_ecef, day):
    """Density [kg/m^3] at an Earth-fixed position [m]; NaN outside the model's heights.

    `sun_ecef`: direction of the Sun, Earth-fixed; `day`: number of the day of the year.
    """
    if air.kind == NONE:
        return 0.0
    h_km = 1e-3 * height_m(r_ecef_m)
    if not air.lowest_km <= h_km <= air.highest_km:
        return math.nan
    if air.kind == EXPONENTIAL:
        return layer(air.layers, h_km)
    return gost_density(
        air.gost, h_km, bulge_angle_cosine(air.gost.lag_rad, r_ecef_m, sun_ecef), day
    )


@kernel
def air_velocity(r, v, pole):
    """Velocity [m/s] relative to an atmosphere that co-rotates about the pole (unit vector)."""
    return sub(v, scale(EARTH_RATE_RAD_S, cross(pole, r)))


@kernel
def air_velocities(r, v, pole):
    """Velocities [n, 3] m/s as of `air_velocity`, for positions, velocities and poles [n, 3]."""
    out = np.empty_like(v)
    for i in range(len(v)):
        place, velocity = (r[i, 0], r[i, 1], r[i, 2]), (v[i, 0], v[i, 1], v[i, 2])
        found = air_velocity(place, velocity, (pole[i, 0], pole[i, 1], pole[i, 2]))
        out[i, 0], out[i, 1], out[i, 2] = found
    return out
