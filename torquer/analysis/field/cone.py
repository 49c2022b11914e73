"""The averaged field's cone on a circular orbit, and the paths of field vectors around it."""

import math
from dataclasses import asdict, dataclass, fields

import numpy as np
import xarray as xr

from torquer.analysis.field.orbit import CIRCLE, field_dataset, find_models, instants, make_circle
from torquer.analysis.field.requests import FieldConeRequest
from torquer.base.limits import given_values
from torquer.environment.field.along import angles_deg
from torquer.environment.field.averaged import Averaged, cone_angle, mean_strength
from torquer.maths.geometry.frames import dcm_z_to_y

#: Models that `field_cone` compares if none are named.
CONE_MODELS = ("igrf14", "tilted_dipole", "direct_dipole", "averaged")
_AROUND = np.radians(np.arange(0.0, 361.0, 5.0))
#: Instants in a revolution.
_STEPS = 360.0


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


def averaged_cone(orbit) -> ConeShape:
    """The cone of `torquer.environment.field.averaged` for a circular orbit."""
    inclination = math.radians(orbit.inclination_deg)
    b0_t = mean_strength(Averaged().prepare(0.0), orbit.radius_m, inclination)
    return ConeShape(math.degrees(cone_angle(inclination)), b0_t, orbit.inclination_deg)


def cone_in(paths: xr.Dataset) -> ConeShape:
    """The cone beside which the paths of `field_cone` run."""
    return ConeShape(**{each.name: paths.attrs[each.name] for each in fields(ConeShape)})


def field_cone(asked: FieldConeRequest) -> xr.Dataset:
    """Paths of the field vector over a circular orbit, and the cone of the averaged field.

        from torquer.analysis.field import FieldConeRequest, field_cone
        field_cone(FieldConeRequest(inclination_deg=51.6))["off_cone"].max("time")

    The Dataset of `field_orbit` with the angle of each vector from the cone, `off_cone`
    `[model, time]` deg; the cone itself is `cone_in(paths)`.
    """
    case = make_circle(given_values(asked, *CIRCLE), asked.date, "date")
    models = find_models(case, asked.model, CONE_MODELS)
    period_s = case.orbit.period_s
    t_s = instants(period_s, asked.revolutions, None, period_s / _STEPS)
    return with_cone(field_dataset(models, case, t_s, "date"), averaged_cone(case.orbit))


def with_cone(paths: xr.Dataset, shape: ConeShape) -> xr.Dataset:
    """Paths beside a cone: with their angles from it, and the cone among the attributes."""
    off = np.abs(angles_deg(paths["b_y"].values, shape.axis_y) - shape.half_angle_deg)
    found = paths.assign(off_cone=(("model", "time"), off, {"units": "deg"}))
    return found.assign_attrs(asdict(shape))
