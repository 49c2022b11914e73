"""How well a law held its attitude: the wanted one, and how far the body was from it."""

import json
from typing import NamedTuple

import numpy as np
import xarray as xr

from torquer.analysis.series import angle_deg
from torquer.control.three_axis import ThreeAxis
from torquer.control.wheel_lyapunov import WheelLyapunov
from torquer.control.wheel_pd import WheelPd

#: Attributes that name a run's laws, those of the wheels first, and the laws that hold an attitude.
_HOLDERS = {
    "wheel_law": {spec.model_fields["kind"].default for spec in (WheelPd, WheelLyapunov)},
    "law": {ThreeAxis.model_fields["kind"].default},
}


class Held(NamedTuple):
    """An attitude that a law held, and the deviation from it at the records; n records."""

    orbital: bool
    """Whether the reference is the orbital frame; else it is the inertial one."""
    error_deg: np.ndarray
    """(n, 3): turn vectors from the wanted attitude to the body, in body axes."""
    rate_rad_s: np.ndarray
    """(n, 3): rate relative to the reference, in body axes."""

    @property
    def angle_deg(self) -> np.ndarray:
        """Angle of the whole turn (n,)."""
        return np.linalg.norm(self.error_deg, axis=1)


def held_in(result: xr.Dataset) -> Held | None:
    """The attitude that a built-in law of the run held; None if there was no such law.

    What was wanted is told by the parameters that were flown, not by the scenario: another law
    may have taken the place of the scenario's own.
    """
    for name, kinds in _HOLDERS.items():
        if result.attrs.get(name) in kinds:
            return _held_by(result, json.loads(result.attrs[f"{name}_parameters"]))
    return None


def _held_by(result: xr.Dataset, parameters: dict) -> Held | None:
    if not {"orbital", "q_x", "q_y", "q_z", "q_w"} <= set(parameters):
        return None  # a law of the user's own with a name of ours
    orbital = parameters["orbital"] != 0.0
    wanted = [parameters[f"q_{c}"] for c in "xyzw"]
    frame = None
    if orbital:
        frame = orbital_axes(result["position_inertial"].values, result["velocity_inertial"].values)
    error = attitude_error_deg(result["q_body_to_inertial"].values, wanted, frame)
    rate = result["omega_orbital" if orbital else "omega_body"].values
    return Held(orbital, error, rate)


def orbital_axes(position, velocity):
    """Attitudes of the orbital frame X to the inertial one, as scipy's `Rotation` [n]."""
    from scipy.spatial.transform import Rotation

    up, normal = np.asarray(position, dtype=float), np.cross(position, velocity)
    up = up / np.linalg.norm(up, axis=1, keepdims=True)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return Rotation.from_matrix(np.stack([np.cross(normal, up), normal, up], axis=2))


def attitude_error_deg(q_body_to_inertial, wanted, reference=None) -> np.ndarray:
    """Turn vectors [deg] (n, 3), in body axes, from the wanted attitude to the body's.

    `wanted`: quaternion from the body to the reference; `reference`: attitudes of that frame to
    the inertial one (`Rotation`), None for the inertial frame itself.
    """
    from scipy.spatial.transform import Rotation

    target = Rotation.from_quat(wanted)
    if reference is not None:
        target = reference * target
    return np.degrees((target.inv() * Rotation.from_quat(q_body_to_inertial)).as_rotvec())


def orbit_normals(result: xr.Dataset) -> np.ndarray:
    """Direction of the orbital momentum [n, 3] in J."""
    return np.cross(result["position_inertial"].values, result["velocity_inertial"].values)


def body_axes_from_vertical_deg(result: xr.Dataset) -> np.ndarray:
    """Angle [deg] of the body's x, y, z axes [n, 3] from the local vertical (up)."""
    from scipy.spatial.transform import Rotation

    up = result["position_inertial"].values
    axes = Rotation.from_quat(result["q_body_to_inertial"].values).as_matrix()
    return np.stack([angle_deg(axes[:, :, i], up) for i in range(3)], axis=1)
