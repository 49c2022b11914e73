"""Attitude error of the laws that hold an attitude, and directions relative to the orbit."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from torquer.analysis.series import Variables, angle_deg
from torquer.maths.geometry.attitudes import dcm_body_to_reference
from torquer.scenario.control import Control
from torquer.scenario.held import (
    NONE_HELD,
    Attitude,
    Holding,
    attitudes_in_order,
    held_over_time,
    holds_attitude,
)
from torquer.simulation.results.flown import flown_scenario

if TYPE_CHECKING:  # half a second of importing, which notes need not wait for
    import xarray as xr

#: Place and velocity, by which the orbital frame is known.
_PLACE = ("position", "velocity")
#: Variable of `with_held`: the number of the attitude held.
_HELD = "held_attitude"


class AttitudeError(NamedTuple):
    """Deviation from the attitude that a law held at each of n records; NaN where none was held."""

    attitudes: tuple[Attitude, ...]
    """The attitudes that may be held."""
    which: np.ndarray
    """(n,): number of the attitude held, -1 for none."""
    error_deg: np.ndarray
    """(n, 3): rotation vectors from the reference attitude to the body, in body axes."""
    rate_rad_s: np.ndarray
    """(n, 3): rate relative to the reference, in body axes."""

    @property
    def orbital(self) -> bool:
        """Whether all references are the orbital frame; else one is the inertial one."""
        return all(attitude.orbital for attitude in self.attitudes)

    @property
    def frames(self) -> str:
        """The reference frames in words."""
        words = {"orbital" if attitude.orbital else "inertial" for attitude in self.attitudes}
        return " or ".join(sorted(words, reverse=True))

    @property
    def is_held(self) -> np.ndarray:
        """(n,): whether an attitude was held."""
        return self.which != NONE_HELD

    @property
    def angle_deg(self) -> np.ndarray:
        """Angle of the rotation (n,)."""
        return np.linalg.norm(self.error_deg, axis=1)


def find_attitude_error(result: xr.Dataset) -> AttitudeError | None:
    """Error relative to the attitude that built-in laws held at each record.

    With modes these are the laws of the present states. None if no such law worked at any record,
    or if laws held different attitudes all the time.
    """
    error = attitude_error_in(result, flown_scenario(result).control)
    return error if error is not None and error.is_held.any() else None


def attitude_error_in(result: Variables, control: Control) -> AttitudeError | None:
    """Error of variables relative to the attitude that the built-in laws of `control` held.

    None where they hold none, whatever the states. Of a part of a run: see `with_held`.
    """
    if not holds_attitude(control):
        return None
    held, which = _holding(result, control)
    q = result["q_body_to_inertial"].values
    error, rate = np.full((len(q), 3), np.nan), np.full((len(q), 3), np.nan)
    for number, attitude in enumerate(held):
        rows = which == number
        if rows.any():
            frame = None
            if attitude.orbital:
                place = (result[f"{name}_inertial"].values[rows] for name in _PLACE)
                frame = orbital_axes(*place)
            error[rows] = attitude_error_deg(q[rows], attitude.q_wanted, frame)
            rate[rows] = result["omega_orbital" if attitude.orbital else "omega_body"].values[rows]
    return AttitudeError(held, which, error, rate)


def with_held(result: xr.Dataset) -> xr.Dataset:
    """A run with the number of the attitude that is held, so that parts of it know what it is.

    A state may set an attitude that later states keep: it follows from the states before.
    """
    control = flown_scenario(result).control
    if not holds_attitude(control):
        return result
    return result.assign({_HELD: ("time", _holding(result, control).which)})


def _holding(result: Variables, control: Control) -> Holding:
    """What is held at the records of variables."""
    modes = control.named().modes
    regions = modes.regions if modes else ()
    if modes and _HELD in result:
        return Holding(attitudes_in_order(control), result[_HELD].values)
    numbers = {name: result[f"mode_{name}"].values for name in regions}
    return held_over_time(control, numbers, len(result["q_body_to_inertial"].values))


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
