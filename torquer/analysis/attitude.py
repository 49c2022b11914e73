"""Attitude error of the laws that hold an attitude, and directions relative to the orbit."""

from typing import NamedTuple

import numpy as np
import xarray as xr

from torquer.analysis.series import Variables, angle_deg
from torquer.computer.laws.pointing import HeldAttitude
from torquer.maths.geometry.attitudes import dcm_body_to_reference
from torquer.scenario.control import Control
from torquer.simulation.results.dataset import flown_scenario


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


def find_attitude_error(result: xr.Dataset) -> AttitudeError | None:
    """Error relative to the attitude that built-in laws held, from the first record on.

    None if there was no such law, or if laws held different attitudes.
    """
    return attitude_error_in(result, flown_scenario(result).control)


def attitude_error_in(result: Variables, control: Control) -> AttitudeError | None:
    """Error of variables relative to the attitude that the built-in laws of `control` held."""
    held = held_attitudes(control)
    if len(held) != 1:
        return None
    ((orbital, wanted),) = held
    frame = None
    if orbital:
        frame = orbital_axes(result["position_inertial"].values, result["velocity_inertial"].values)
    error = attitude_error_deg(result["q_body_to_inertial"].values, wanted, frame)
    rate = result["omega_orbital" if orbital else "omega_body"].values
    return AttitudeError(orbital, error, rate)


def held_attitudes(control: Control) -> set[tuple[bool, tuple[float, ...]]]:
    """The attitudes that laws hold at any time: (whether in the orbital frame, attitude in it)."""
    laws, modes = control.named()
    holders = {name: law for name, law in laws.items() if isinstance(law, HeldAttitude)}
    held: set[tuple[bool, tuple[float, ...]]] = set()
    held |= {(law.orbital, law.q_wanted()) for law in holders.values()}
    for state in modes.states() if modes else ():
        for key, wanted in state.set.items():
            name, _, parameter = key.partition(".")
            if name in holders and parameter == "q_wanted" and isinstance(wanted, tuple):
                held.add((holders[name].orbital, wanted))
    return held


def orbital_axes(position, velocity):
    """Attitudes of the orbital frame X relative to the inertial one, as scipy's `Rotation` [n]."""
    from scipy.spatial.transform import Rotation

    up, normal = np.asarray(position, dtype=float), np.cross(position, velocity)
    up = up / np.linalg.norm(up, axis=1, keepdims=True)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return Rotation.from_matrix(np.stack([np.cross(normal, up), normal, up], axis=2))


def attitude_error_deg(q_body_to_inertial, target, reference=None) -> np.ndarray:
    """Rotation vectors [deg] (n, 3), in body axes, from the reference attitude to the body.

    `target`: quaternion from the body to the frame; `reference`: attitudes of that frame
    relative to the inertial one (`Rotation`), None for the inertial frame itself.
    """
    from scipy.spatial.transform import Rotation

    aim = Rotation.from_quat(target)
    if reference is not None:
        aim = reference * aim
    return np.degrees((aim.inv() * Rotation.from_quat(q_body_to_inertial)).as_rotvec())


def body_axes_from_deg(result: Variables, to: str) -> np.ndarray:
    """Angle [deg] of the body's x, y, z axes [n, 3] from a direction in J of the result.

    `to`: "position_inertial", the local vertical (up); "sun_inertial", the Sun, also in eclipse.
    """
    axes = dcm_body_to_reference(result["q_body_to_inertial"].values)
    return np.stack([angle_deg(axes[:, :, i], result[to].values) for i in range(3)], axis=1)
