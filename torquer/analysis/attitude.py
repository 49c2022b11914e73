"""Attitude error of the laws that hold an attitude, and directions relative to the orbit."""

import json
from typing import NamedTuple

import numpy as np
import xarray as xr

from torquer.analysis.series import angle_deg
from torquer.control.three_axis import ThreeAxis
from torquer.control.wheel_lyapunov import WheelLyapunov
from torquer.control.wheel_pd import WheelPd

#: Attributes that name a run's laws, and the laws among them that hold an attitude.
_HOLDERS = {
    "wheel_law": {spec.model_fields["kind"].default for spec in (WheelPd, WheelLyapunov)},
    "law": {ThreeAxis.model_fields["kind"].default},
}


class AttitudeError(NamedTuple):
    """Deviation from the attitude that a law held, at the n records."""

    orbital: bool
    """Whether the reference is the orbital frame; else it is the inertial one."""
    error_deg: np.ndarray
    """(n, 3): rotation vectors from the reference attitude to the body, in body axes."""
    rate_rad_s: np.ndarray
    """(n, 3): rate relative to the reference, in body axes."""

    @property
    def angle_deg(self) -> np.ndarray:
        """Angle of the rotation (n,)."""
        return np.linalg.norm(self.error_deg, axis=1)


def attitude_error_of(result: xr.Dataset) -> AttitudeError | None:
    """Error relative to the attitude that a built-in law held; None if there was no such law.

    The reference comes from the parameters that were flown, not from the scenario, whose law may
    have been replaced.
    """
    for name, kinds in _HOLDERS.items():
        if result.attrs.get(name) in kinds:
            return _error_of(result, json.loads(result.attrs[f"{name}_parameters"]))
    return None


def _error_of(result: xr.Dataset, parameters: dict) -> AttitudeError | None:
    if not {"orbital", "q_x", "q_y", "q_z", "q_w"} <= set(parameters):
        return None  # a user law of the same name
    orbital = parameters["orbital"] != 0.0
    target = [parameters[f"q_{c}"] for c in "xyzw"]
    frame = None
    if orbital:
        frame = orbital_axes(result["position_inertial"].values, result["velocity_inertial"].values)
    error = attitude_error_deg(result["q_body_to_inertial"].values, target, frame)
    rate = result["omega_orbital" if orbital else "omega_body"].values
    return AttitudeError(orbital, error, rate)


def orbital_axes(position, velocity):
    """Attitudes of the orbital frame X to the inertial one, as scipy's `Rotation` [n]."""
    from scipy.spatial.transform import Rotation

    up, normal = np.asarray(position, dtype=float), np.cross(position, velocity)
    up = up / np.linalg.norm(up, axis=1, keepdims=True)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return Rotation.from_matrix(np.stack([np.cross(normal, up), normal, up], axis=2))


def attitude_error_deg(q_body_to_inertial, target, reference=None) -> np.ndarray:
    """Rotation vectors [deg] (n, 3), in body axes, from the reference attitude to the body.

    `target`: quaternion from the body to the frame; `reference`: attitudes of that frame to
    the inertial one (`Rotation`), None for the inertial frame itself.
    """
    from scipy.spatial.transform import Rotation

    aim = Rotation.from_quat(target)
    if reference is not None:
        aim = reference * aim
    return np.degrees((aim.inv() * Rotation.from_quat(q_body_to_inertial)).as_rotvec())


def orbit_normals(result: xr.Dataset) -> np.ndarray:
    """Direction of the orbital momentum [n, 3] in J."""
    return np.cross(result["position_inertial"].values, result["velocity_inertial"].values)


def body_axes_from_vertical_deg(result: xr.Dataset) -> np.ndarray:
    """Angle [deg] of the body's x, y, z axes [n, 3] from the local vertical (up)."""
    from scipy.spatial.transform import Rotation

    up = result["position_inertial"].values
    axes = Rotation.from_quat(result["q_body_to_inertial"].values).as_matrix()
    return np.stack([angle_deg(axes[:, :, i], up) for i in range(3)], axis=1)
