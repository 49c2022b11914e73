"""Attitude error of the laws that hold an attitude, and directions relative to the orbit."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from torquer.analysis.series import Variables, angle_deg
from torquer.computer.laws.held import Attitude
from torquer.computer.laws.targets import Targets, reference_along
from torquer.maths.geometry.attitudes import dcm_body_to_reference
from torquer.maths.geometry.quaternion import angle_between
from torquer.maths.geometry.vec3 import as_matrix
from torquer.scenario.control import Control
from torquer.scenario.held import (
    NONE_HELD,
    Holding,
    attitudes_in_order,
    held_over_time,
    holds_attitude,
)
from torquer.scenario.spec import Scenario
from torquer.simulation.results.flown import flown_scenario

if TYPE_CHECKING:  # half a second of importing, which notes need not wait for
    import xarray as xr

#: Place, velocity and Sun, by which what is held is known.
_PLACE = ("position_inertial", "velocity_inertial", "sun_inertial")
#: Variables of `with_held`: the number of the attitude held, the error from what is commanded.
_HELD, _COMMANDED = "held_attitude", "commanded_error"


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
    commanded_deg: np.ndarray
    """(n,): angle from the attitude that the law steers meanwhile, along a slew to the one that it
    holds; NaN for a law that knows no slews."""

    @property
    def frames(self) -> str:
        """The reference frames in words."""
        return " or ".join(sorted({attitude.frame for attitude in self.attitudes}, reverse=True))

    @property
    def has_slews(self) -> bool:
        """Whether a law steered an attitude on the way to the one that it holds."""
        return bool(np.isfinite(self.commanded_deg).any())

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
    error = attitude_error_in(result, flown_scenario(result))
    return error if error is not None and error.is_held.any() else None


def attitude_error_in(result: Variables, scenario: Scenario) -> AttitudeError | None:
    """Error of variables relative to the attitude that the scenario's built-in laws held.

    None where they hold none, whatever the states. Of a part of a run: see `with_held`.
    """
    if not holds_attitude(scenario.control):
        return None
    held, which = _holding(result, scenario.control)
    q = result["q_body_to_inertial"].values
    error, rate = np.full((len(q), 3), np.nan), np.full((len(q), 3), np.nan)
    for number, attitude in enumerate(held):
        rows = which == number
        if rows.any():
            error[rows], rate[rows] = _error_from(attitude, result, rows, scenario)
    return AttitudeError(held, which, error, rate, _commanded_deg(result, Holding(held, which)))


def _commanded_deg(result: Variables, holding: Holding) -> np.ndarray:
    """Angles (n,) from what is steered; NaN where no law steers."""
    if _COMMANDED in result:
        return result[_COMMANDED].values
    q, which = result["q_body_to_inertial"].values, holding.which
    found = np.full(len(q), np.nan)
    for number, attitude in enumerate(holding.attitudes):
        rows = which == number
        if attitude.steered_in in result and rows.any():
            steered = result[attitude.steered_in].values[rows]
            found[rows] = np.degrees(angle_between(q[rows], steered))
    if len(q) > 1 and which[-1] == which[-2]:
        # no control step follows the last record: its log is of the step before
        found[-1] = found[-2]
    return found


def _error_from(attitude: Attitude, result: Variables, rows, scenario: Scenario):
    """Rotation vectors [deg] and relative rates [rad/s] of some records, (n, 3) each."""
    q, place = result["q_body_to_inertial"].values[rows], [result[k].values[rows] for k in _PLACE]
    if attitude.targets:
        t_s = result["time"].values[rows].astype(float)
        wanted, turning = targets_along(attitude.targets, scenario, t_s, *place)
        omega = result["omega_body"].values[rows]
        error = attitude_error_deg(q, wanted)
        return error, omega - _turned_back(error, turning)
    frame = orbital_axes(*place[:2]) if attitude.orbital else None
    rate = result["omega_orbital" if attitude.orbital else "omega_body"].values[rows]
    return attitude_error_deg(q, attitude.q_wanted, frame), rate


def _turned_back(error_deg, vectors) -> np.ndarray:
    """Vectors (n, 3) in the axes of a reference, in those of a body turned away from it."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_rotvec(error_deg, degrees=True).inv().apply(vectors)


def targets_along(targets: Targets, scenario: Scenario, t_s, position, velocity, sun):
    """Attitudes (n, 4) that targets give, and their rates (n, 3) in their own axes [rad/s].

    From where the satellite is, not from where its computer takes it to be.
    """
    earth = scenario.orbit_environment().dcm_to_ecef(np.zeros(1))[0]
    seen = targets._replace(to_ecef=as_matrix(earth))
    return reference_along(seen, t_s, position, velocity, sun)


def with_held(result: xr.Dataset) -> xr.Dataset:
    """A run with what is held and the error from what is commanded, so that parts of it know them.

    A state may set an attitude that later states keep: it follows from the states before.
    """
    control = flown_scenario(result).control
    if not holds_attitude(control):
        return result
    holding = _holding(result, control)
    commanded = _commanded_deg(result, holding)
    return result.assign({_HELD: ("time", holding.which), _COMMANDED: ("time", commanded)})


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
