"""Rotations between the frames of `torquer.base.conventions`, and geodetic coordinates (WGS84).

`dcm_a_to_b` takes components in frame a to components in frame b, v_b = dcm_a_to_b v_a; its
columns are the axes of a in b. Kernels return tuples of rows; angles are in radians. The geodetic
functions work on arrays of any shape.
"""

import math

import numpy as np

from torquer.base.conventions import EARTH_FLATTENING, EARTH_RADIUS_M
from torquer.compile.engine import inlined, kernel
from torquer.maths.geometry.vec3 import cross, mat_t_vec, unit

_POLAR_RADIUS_M = EARTH_RADIUS_M * (1.0 - EARTH_FLATTENING)
_ECCENTRICITY_2 = EARTH_FLATTENING * (2.0 - EARTH_FLATTENING)
_SECOND_ECCENTRICITY_2 = _ECCENTRICITY_2 / (1.0 - _ECCENTRICITY_2)


@kernel
def rot_x(angle):
    """Rotation by an angle about axis 1: components in the rotated frame to those in the old."""
    c, s = math.cos(angle), math.sin(angle)
    return ((1.0, 0.0, 0.0), (0.0, c, -s), (0.0, s, c))


@kernel
def rot_y(angle):
    """Rotation by an angle about axis 2: components in the rotated frame to those in the old."""
    c, s = math.cos(angle), math.sin(angle)
    return ((c, 0.0, s), (0.0, 1.0, 0.0), (-s, 0.0, c))


@kernel
def rot_z(angle):
    """Rotation by an angle about axis 3: components in the rotated frame to those in the old."""
    c, s = math.cos(angle), math.sin(angle)
    return ((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0))


@kernel
def transpose(m):
    """Transposed 3x3 matrix: the inverse rotation."""
    return (
        (m[0][0], m[1][0], m[2][0]),
        (m[0][1], m[1][1], m[2][1]),
        (m[0][2], m[1][2], m[2][2]),
    )


@inlined
def mat_mul(m, n):
    """Product m n of two 3x3 matrices: first n, then m."""
    return (mat_t_vec(n, m[0]), mat_t_vec(n, m[1]), mat_t_vec(n, m[2]))


@kernel
def dcm_z_to_y(cone_angle):
    """Z to Y: Z3 = (0, -sin Theta, cos Theta) in Y, Theta the field cone's angle."""
    return rot_x(cone_angle)


@kernel
def dcm_s_to_y(inclination):
    """S to Y: S3 is the orbit normal (0, -sin i, cos i) in Y, S1 = Y1 the ascending node."""
    return rot_x(inclination)


@kernel
def dcm_orbital_to_inertial(r, v):
    """X to the inertial frame of position r and velocity v (any units, not parallel).

    X3 along the radius vector, X2 along the orbit normal r x v, X1 = X2 x X3 (along the motion).
    """
    x3 = unit(r)
    x2 = unit(cross(r, v))
    return transpose((cross(x2, x3), x2, x3))


@kernel
def dcm_l_to_z(rho, sigma):
    """L to Z: L3 (angular momentum) at polar angle rho and azimuth sigma. Source: MAG (1.3.1)."""
    return mat_mul(rot_z(sigma), rot_y(rho))


@kernel
def dcm_body_to_l(phi, psi, theta):
    """x to L: Euler rotations 3-1-3 by psi, theta (nutation), phi. Source: MAG (1.3.2)."""
    return mat_mul(rot_z(psi), mat_mul(rot_x(theta), rot_z(phi)))


def argument_of_latitude(r, v) -> float:
    """Angle [rad] along the orbit from the ascending node; on an equatorial orbit from axis 1."""
    normal = np.cross(r, v)
    node = np.cross([0.0, 0.0, 1.0], normal)
    if np.linalg.norm(node) < 1e-12 * np.linalg.norm(normal):
        node = np.array([1.0, 0.0, 0.0])
    ahead = np.cross(normal / np.linalg.norm(normal), node)
    return math.atan2(float(ahead @ r), float(node @ r))


def ecef_from_geodetic(lat_rad, lon_rad, height_m) -> np.ndarray:
    """Earth-fixed position [..., 3] m of geodetic latitude, longitude and height (WGS84)."""
    lat, lon, height = np.broadcast_arrays(lat_rad, lon_rad, height_m)
    sin_lat = np.sin(lat)
    normal = EARTH_RADIUS_M / np.sqrt(1.0 - _ECCENTRICITY_2 * sin_lat**2)
    across = (normal + height) * np.cos(lat)
    up = (normal * (1.0 - _ECCENTRICITY_2) + height) * sin_lat
    return np.stack([across * np.cos(lon), across * np.sin(lon), up], axis=-1)


def geodetic_from_ecef(r_m) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Geodetic latitude, longitude [rad] and height [m] (WGS84) of Earth-fixed positions [..., 3].

    Bowring's iteration on the parametric latitude: three rounds reach rounding error at any
    height above -5000 km. On the axis the longitude is zero.
    """
    x, y, z = np.moveaxis(np.asarray(r_m, dtype=np.float64), -1, 0)
    across = np.hypot(x, y)
    # the first guess is already exact on the equator, at the poles and far away (Bowring 1985)
    tilt_z = z * (1.0 + _SECOND_ECCENTRICITY_2 * _POLAR_RADIUS_M / np.hypot(across, z))
    tilt_across = across / (1.0 - EARTH_FLATTENING)
    for _ in range(3):
        length = np.hypot(tilt_across, tilt_z)
        sin_b, cos_b = tilt_z / length, tilt_across / length
        lat_z = z + _SECOND_ECCENTRICITY_2 * _POLAR_RADIUS_M * sin_b**3
        lat_across = across - _ECCENTRICITY_2 * EARTH_RADIUS_M * cos_b**3
        tilt_z, tilt_across = (1.0 - EARTH_FLATTENING) * lat_z, lat_across
    lat = np.arctan2(lat_z, lat_across)
    sin_lat = np.sin(lat)
    # this form of the height keeps its digits at every latitude, the poles included
    height = across * np.cos(lat) + z * sin_lat
    height = height - EARTH_RADIUS_M * np.sqrt(1.0 - _ECCENTRICITY_2 * sin_lat**2)
    return lat, np.arctan2(y, x), height


def dcm_ecef_to_ned(lat_rad, lon_rad) -> np.ndarray:
    """Earth-fixed to north-east-down [..., 3, 3] at a geodetic (or geocentric) latitude."""
    lat, lon = np.broadcast_arrays(lat_rad, lon_rad)
    sin_lat, cos_lat, sin_lon, cos_lon = np.sin(lat), np.cos(lat), np.sin(lon), np.cos(lon)
    north = np.stack([-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat], axis=-1)
    east = np.stack([-sin_lon, cos_lon, np.zeros_like(sin_lon)], axis=-1)
    down = np.stack([-cos_lat * cos_lon, -cos_lat * sin_lon, -sin_lat], axis=-1)
    return np.stack([north, east, down], axis=-2)
