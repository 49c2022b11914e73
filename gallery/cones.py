"""The cone of the averaged field and how far other fields' vectors are from it."""

import math

import numpy as np

from torquer.environment.field import averaged, direct_dipole
from torquer.maths.geometry.frames import dcm_z_to_y


def cone_axis_y(inclination_deg: float) -> np.ndarray:
    """Axis of the averaged field's cone [3] in Y."""
    turn = dcm_z_to_y(averaged.cone_angle(math.radians(inclination_deg)))
    return np.array(turn)[:, 2]


def angle_to_cone_deg(b_y, inclination_deg: float) -> np.ndarray:
    """Angle [n] deg of vectors `[n, 3]` in Y to the cone's axis, less the cone's half-angle."""
    axis = cone_axis_y(inclination_deg)
    b_y = np.asarray(b_y)
    away = np.arctan2(np.linalg.norm(np.cross(b_y, axis), axis=-1), b_y @ axis)
    return np.degrees(away - averaged.cone_angle(math.radians(inclination_deg)))


def dipole_y(u_deg, inclination_deg: float) -> np.ndarray:
    """Direct dipole's vectors `[n, 3]` in Y for mu_e/r^3 = 1."""
    turn = math.radians(inclination_deg)
    return np.array([direct_dipole.b_y(1.0, u, turn) for u in np.radians(u_deg)])


def averaged_y(u_deg, inclination_deg: float) -> np.ndarray:
    """Averaged field's vectors `[n, 3]` in Y, of length one."""
    cone = averaged.cone_angle(math.radians(inclination_deg))
    return np.array([averaged.b_y(1.0, u, cone) for u in np.radians(u_deg)])


def deviation_deg(u_deg, inclination_deg: float) -> np.ndarray:
    """How far the direct dipole's vector is outside the cone [deg] at arguments of latitude."""
    return angle_to_cone_deg(dipole_y(u_deg, inclination_deg), inclination_deg)


def angle_between_deg(a, b) -> np.ndarray:
    """Angles [n] deg between vectors `[n, 3]`, exact for small ones too."""
    across = np.linalg.norm(np.cross(a, b), axis=-1)
    return np.degrees(np.arctan2(across, np.sum(np.asarray(a) * b, axis=-1)))
