"""Quantities derived from a result: angles, rates in degrees, speeds in rpm, modes.

Each function gives an `xarray.DataArray` over the time of the result, with its unit; `derive`
gives all of them that apply, as one data set. `result.torquer` has them as methods.
"""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import xarray as xr

from torquer.analysis.attitude import body_axes_from_deg, find_attitude_error
from torquer.analysis.mode_use import find_regions
from torquer.analysis.series import angle_deg
from torquer.base.validate import unit_rows
from torquer.maths.geometry.attitudes import to_body
from torquer.simulation.results.dataset import flown_scenario

_RPM_PER_RAD_S = 30.0 / np.pi


def rate_size(result: xr.Dataset) -> xr.DataArray:
    """Size of the absolute angular velocity [deg/s] over `time`."""
    size = np.degrees(np.linalg.norm(result["omega_body"].values, axis=1))
    return _over_time(result, size, "deg/s", "absolute angular velocity")


def body_rate(result: xr.Dataset) -> xr.DataArray:
    """Absolute angular velocity [deg/s] in body axes over `time`, `axis`."""
    omega = np.degrees(result["omega_body"].values)
    return _over_time(result, omega, "deg/s", "absolute angular velocity in body axes")


def orbital_rate(result: xr.Dataset) -> xr.DataArray:
    """Angular velocity relative to the orbital frame [deg/s] in body axes over `time`, `axis`."""
    omega = np.degrees(result["omega_orbital"].values)
    return _over_time(result, omega, "deg/s", "angular velocity relative to the orbital frame")


def attitude_error_angle(result: xr.Dataset) -> xr.DataArray:
    """Angle [deg] from the attitude that the laws held, over `time`.

    With modes it is from the attitude that the laws of the present states hold, NaN while they
    hold none; of targets it is the one that these give at the time. ValueError where no built-in
    law held an attitude.
    """
    error = find_attitude_error(result)
    if error is None:
        raise ValueError(
            "attitude error: a built-in law must have held an attitude; received a run without"
        )
    return _over_time(result, error.angle_deg, "deg", "angle of the attitude error")


def commanded_error_angle(result: xr.Dataset) -> xr.DataArray:
    """Angle [deg] from the attitude that a law with slews steered, over `time`.

    Along a slew it is from where the slew is at the time; `attitude_error_angle` is from its end.
    ValueError where no law turned by slews.
    """
    error = find_attitude_error(result)
    if error is None or not error.has_slews:
        raise ValueError(
            "commanded error: a law must have turned by slews, as wheel_tracking does; received a "
            "run without"
        )
    meaning = "angle from the commanded attitude"
    return _over_time(result, error.commanded_deg, "deg", meaning)


def angle_from_sun(result: xr.Dataset, axis: Sequence[float] | None = None) -> xr.DataArray:
    """Angle [deg] of a body axis from the direction to the Sun, over `time`.

    `axis`: a direction in body axes, of any length; left out: the angles of x, y and z, over
    `time`, `axis`. The angle is given in eclipse, too: see
    `result["sunlit_fraction"]`.
    """
    sun = to_body(result["q_body_to_inertial"].values, result["sun_inertial"].values)
    meaning = "angle from the direction to the Sun"
    if axis is None:
        angles = [angle_deg(e, sun) for e in np.eye(3)]
        return _over_time(result, np.stack(angles, axis=1), "deg", meaning)
    along = unit_rows("axis", axis)[0]
    return _over_time(result, angle_deg(along, sun), "deg", meaning)


def nutation_angle(result: xr.Dataset, axis: Sequence[float] | None = None) -> xr.DataArray:
    """Angle [deg] of the angular momentum from a body axis, over `time`.

    `axis`: a direction in body axes; left out: the principal axis of the greatest moment, in the
    sense nearer to the final momentum. NaN where the momentum is zero.
    """
    momentum = to_body(result["q_body_to_inertial"].values, result["momentum_inertial"].values)
    if axis is None:
        moments, axes = flown_scenario(result).spacecraft.body.principal()
        along = np.asarray(axes)[:, int(np.argmax(moments))]
        along = along if momentum[-1] @ along >= 0.0 else -along
    else:
        along = unit_rows("axis", axis)[0]
    angle = angle_deg(along, momentum)
    return _over_time(result, angle, "deg", "nutation: angle of the momentum from a body axis")


def angle_from_vertical(result: xr.Dataset) -> xr.DataArray:
    """Angles [deg] of the body's x, y and z axes from the local vertical, over `time`, `axis`."""
    angles = body_axes_from_deg(result, "position_inertial")
    return _over_time(result, angles, "deg", "angle from the local vertical")


def wheel_speeds(result: xr.Dataset) -> xr.DataArray:
    """Speed of each wheel relative to the body [rpm] over `time`, `wheel`.

    ValueError for a satellite without wheels.
    """
    if "wheel_speed" not in result:
        raise ValueError("wheel speed: the satellite must have wheels; received a run without")
    speed = result["wheel_speed"] * _RPM_PER_RAD_S
    return speed.assign_attrs(units="rpm", long_name="speed relative to the body")


def mode_over_time(result: xr.Dataset, region: str | None = None) -> xr.DataArray:
    """Name of the state of a region of modes, over `time`; a single region need not be named.

    ValueError for a run whose laws always work, and for an unknown region.
    """
    found = {each.name: each for each in find_regions(result)}
    name = next(iter(found), None) if region is None and len(found) == 1 else region
    if name not in found:
        known = ", ".join(found) or "none: the laws of this run always work"
        raise ValueError(f"region: must be one of {known}; received {region!r}")
    states = np.array([*found[name].states, ""])  # the last for -1: not known
    return _over_time(result, states[found[name].numbers], "", f"state of the region {name}")


def derive(result: xr.Dataset) -> xr.Dataset:
    """All that applies to the run, as one data set over its time, with units.

    >>> torquer.derive(result)["rate"].attrs["units"]
    'deg/s'
    """
    return xr.Dataset({name: make(result) for name, make in makers(result).items()})


def makers(result: xr.Dataset) -> dict[str, Callable[[xr.Dataset], xr.DataArray]]:
    """What gives each quantity that applies to the run, by name."""
    found: dict[str, Callable[[xr.Dataset], xr.DataArray]] = {
        "rate": rate_size,
        "rate_body": body_rate,
        "rate_orbital": orbital_rate,
        "sun_angle": angle_from_sun,
        "nutation": nutation_angle,
        "vertical_angle": angle_from_vertical,
    }
    if (error := find_attitude_error(result)) is not None:
        found["attitude_error"] = attitude_error_angle
        if error.has_slews:
            found["commanded_error"] = commanded_error_angle
    if "wheel_speed" in result:
        found["wheel_speed"] = wheel_speeds
    modes = {f"mode_{each.name}": each.name for each in find_regions(result)}
    return found | {name: partial(mode_over_time, region=of) for name, of in modes.items()}


def _over_time(result: xr.Dataset, values: np.ndarray, unit: str, meaning: str) -> xr.DataArray:
    """Values over `time`, or over `time` and `axis`."""
    coordinates = {"time": result["time"], "utc": result["utc"]}
    if values.ndim == 2:
        coordinates["axis"] = result["axis"]
    attributes = {"units": unit, "long_name": meaning} if unit else {"long_name": meaning}
    return xr.DataArray(values, coordinates, ("time", "axis")[: values.ndim], attrs=attributes)
