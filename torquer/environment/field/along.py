"""Several field models along one orbit, side by side: inertial and orbital components."""

from dataclasses import dataclass
from datetime import datetime
from functools import cached_property

import numpy as np

from torquer.environment.along_orbit import Environment, OrbitEnvironment
from torquer.maths.geometry.frames import geodetic_from_ecef

#: Rounding may place a point at the node this far before it [deg].
_NODE_DEG = 1e-9


@dataclass(frozen=True)
class FieldsAlong:
    """Fields of models `[m]` at instants `[n]` of an orbit.

    Axis 3 of the inertial frame is the Earth's; `node` [3] is the unit vector to the ascending
    node at the first instant (axis 1 if the orbit is equatorial).
    """

    models: tuple
    t_s: np.ndarray
    r_inertial: np.ndarray
    v_inertial: np.ndarray
    lat_deg: np.ndarray
    lon_deg: np.ndarray
    height_km: np.ndarray
    b_inertial: np.ndarray

    @cached_property
    def b_orbital(self) -> np.ndarray:
        """Flux density `[m, n, 3]` T in X: along the motion, orbit normal, up."""
        return np.einsum("nij,mnj->mni", self.axes_of_x, self.b_inertial)

    @cached_property
    def axes_of_x(self) -> np.ndarray:
        """Axes of X `[n, axis, 3]` in the inertial frame."""
        up, normal = _units(self.r_inertial), _units(np.cross(self.r_inertial, self.v_inertial))
        return np.stack([np.cross(normal, up), normal, up], axis=1)

    @cached_property
    def strength(self) -> np.ndarray:
        """Length of the flux-density vectors `[m, n]` T."""
        return np.linalg.norm(self.b_inertial, axis=-1)

    @cached_property
    def angle_to_first_deg(self) -> np.ndarray:
        """Angle `[m, n]` between each model's vector and the first model's."""
        return angles_deg(self.b_inertial, self.b_inertial[:1])

    @cached_property
    def u_deg(self) -> np.ndarray:
        """Argument of latitude `[n]`, 0..360 (the node itself is 0), in the osculating plane."""
        normal = np.cross(self.r_inertial, self.v_inertial)
        node = _nodes(normal)
        across = np.cross(_units(normal), node)
        u = np.arctan2(_dots(self.r_inertial, across), _dots(self.r_inertial, node))
        u_deg = np.degrees(u) % 360.0
        return np.where(u_deg > 360.0 - _NODE_DEG, 0.0, u_deg)

    @property
    def node(self) -> np.ndarray:
        """Unit vector `[3]` to the ascending node at the first instant, inertial."""
        return _nodes(np.cross(self.r_inertial[:1], self.v_inertial[:1]))[0]

    @property
    def b_y(self) -> np.ndarray:
        """Flux density `[m, n, 3]` T in Y at the first instant: node, across it, Earth's axis."""
        c, s, _ = self.node
        return self.b_inertial @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def fields_along(
    models, orbit, start: datetime, t_s, earth_rotation: str = "precise", dut1_s: float = 0.0
) -> FieldsAlong:
    """The models' fields along an orbit at times `t_s` [n] s after the start, each at its date.

    `dut1_s` is UT1 - UTC at the start. `ValueError` for a date that a model does not cover, or a
    time without an orbit.
    """
    t_s = np.ascontiguousarray(t_s, dtype=np.float64)
    turning = {"earth_rotation": earth_rotation, "ut1_minus_utc_s": dut1_s}
    met = [OrbitEnvironment(Environment(field=m, **turning), orbit, start) for m in models]
    r, v = met[0].state(t_s)
    lat, lon, height = geodetic_from_ecef(np.einsum("nij,nj->ni", met[0].dcm_to_ecef(t_s), r))
    return FieldsAlong(
        models=tuple(models),
        t_s=t_s,
        r_inertial=r,
        v_inertial=v,
        lat_deg=np.degrees(lat),
        lon_deg=np.degrees(lon),
        height_km=1e-3 * height,
        b_inertial=np.stack([each.field(t_s, r, v) for each in met]),
    )


def angles_deg(a, b) -> np.ndarray:
    """Angles [deg] between vectors along the last axis, exact for small ones too."""
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), _dots(a, b)))


def _dots(a, b) -> np.ndarray:
    return np.sum(a * b, axis=-1)


def _units(vectors) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _nodes(normals) -> np.ndarray:
    """Unit vectors to the ascending nodes of orbits with these normals `[n, 3]`."""
    x, y, z = normals.T
    equatorial = np.hypot(x, y) <= 1e-100 * np.abs(z)  # the squares of less would be zero
    across = np.stack(
        [np.where(equatorial, 1.0, -y), np.where(equatorial, 0.0, x), np.zeros_like(x)], axis=-1
    )
    return _units(across)
