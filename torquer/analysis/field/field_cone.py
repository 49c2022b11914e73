"""The averaged field's cone on a circular orbit."""

import math
from dataclasses import dataclass

import mpl_toolkits.mplot3d  # noqa: F401  (makes the projection known)
import numpy as np

from torquer.environment.field import Averaged
from torquer.environment.field.averaged import cone_angle, mean_strength
from torquer.maths.geometry.frames import dcm_z_to_y

_AROUND = np.radians(np.arange(0.0, 361.0, 5.0))


@dataclass(frozen=True)
class ConeShape:
    """The averaged field's cone on a circular orbit; Y as in `torquer.base.conventions`."""

    half_angle_deg: float
    b0_t: float
    inclination_deg: float

    @property
    def y_from_z(self) -> np.ndarray:
        """Direction cosines Z to Y: the columns are the axes of Z."""
        return np.array(dcm_z_to_y(math.radians(self.half_angle_deg)))

    @property
    def axis_y(self) -> np.ndarray:
        """The cone's axis Z3 in Y."""
        return self.y_from_z[:, 2]

    @property
    def normal_y(self) -> np.ndarray:
        """The orbit normal S3 in Y."""
        i = math.radians(self.inclination_deg)
        return np.array([0.0, -math.sin(i), math.cos(i)])

    def rim_ut(self) -> np.ndarray:
        """Points `[n, 3]` µT of the cone's rim in Y."""
        s, c = (f(math.radians(self.half_angle_deg)) for f in (math.sin, math.cos))
        rim = np.stack([-s * np.sin(_AROUND), s * np.cos(_AROUND), np.full_like(_AROUND, c)])
        return 1e6 * self.b0_t * (self.y_from_z @ rim).T


def cone_of(orbit) -> ConeShape:
    """The cone of `torquer.environment.field.averaged` for a circular orbit."""
    inclination = math.radians(orbit.inclination_deg)
    b0_t = mean_strength(Averaged().prepare(0.0), orbit.radius_m, inclination)
    return ConeShape(math.degrees(cone_angle(inclination)), b0_t, orbit.inclination_deg)
