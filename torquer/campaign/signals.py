"""Signals of many members at once: angles and rates at r records of n members, as (r, n).

A signal is a function `(scenario, flown)`; members share the orbit, and so all that is along it.
"""

from collections.abc import Callable, Mapping
from typing import Literal, NamedTuple

import numpy as np

from torquer.analysis.attitude import orbital_axes, targets_along
from torquer.analysis.series import angle_deg
from torquer.base.spec import Spec, unit_vector
from torquer.computer.laws.held import Attitude
from torquer.maths.geometry.attitudes import to_body, to_reference
from torquer.maths.geometry.quaternion import angle_between
from torquer.scenario.held import (
    Holding,
    always_held,
    attitudes_in_order,
    held_over_time,
)
from torquer.scenario.spec import Scenario
from torquer.simulation.results.momenta import Carried, momentum_size, wheel_momentum_size
from torquer.simulation.setup.ending import fastest_axis_deg_s


class Flown(NamedTuple):
    """The motion of n members at r records, which may be a part of their flight.

    `b_inertial`, `sun_inertial` (direction to the Sun): they may be None if no outcome uses them.
    """

    t_s: np.ndarray
    """(r,)"""
    q_body_to_inertial: np.ndarray
    """(r, n, 4)"""
    omega_body: np.ndarray
    """(r, n, 3), absolute [rad/s]"""
    position_inertial: np.ndarray
    """(r, 3) [m]"""
    velocity_inertial: np.ndarray
    """(r, 3) [m/s]"""
    b_inertial: np.ndarray | None
    """(r, 3) [T]"""
    sun_inertial: np.ndarray | None
    """(r, 3)"""
    modes: Mapping[str, np.ndarray] | None = None
    """Number of the state of each region, by region: (h + r, n), as states set what is kept later:
    all that came before, records without a change left out; None if no outcome uses it."""
    carried: Carried | None = None
    """None if no outcome uses a momentum."""
    wheels_n_m_s: np.ndarray | None = None
    """(r, n, w): momentum of each wheel relative to the body; None if no outcome uses it."""
    logs: Mapping[str, np.ndarray] = {}
    """What laws and estimators log (r, n), by the outcome's name for it."""


class Axis(Spec):
    """Angle [deg] from an `axis` of the body `to` a direction.

    'sun', 'nadir' (the Earth's centre), 'orbit_normal', 'field' (the geomagnetic field), or a
    vector in the inertial frame.
    """

    axis: unit_vector("axis")  # type: ignore[valid-type]
    """Axis in the body, a vector of any length."""
    to: Literal["sun", "nadir", "orbit_normal", "field"] | unit_vector("to")  # type: ignore[valid-type]
    """Direction to which the angle is measured: 'sun', 'nadir' (the Earth's centre),
    'orbit_normal', 'field' (the geomagnetic field) or a vector in the inertial frame.
    """


def rate(scenario: Scenario, flown: Flown) -> np.ndarray:
    """Absolute angular rate [deg/s]."""
    return np.degrees(np.linalg.norm(flown.omega_body, axis=-1))


def rate_fastest_axis(scenario: Scenario, flown: Flown) -> np.ndarray:
    """Greatest size of the absolute angular rates about the three axes of the body [deg/s]."""
    return fastest_axis_deg_s(flown.omega_body)


def rate_orbital(scenario: Scenario, flown: Flown) -> np.ndarray:
    """Angular rate relative to the orbital frame [deg/s]."""
    r, v = flown.position_inertial, flown.velocity_inertial
    turning = np.cross(r, v) / np.sum(r * r, axis=1, keepdims=True)
    relative = flown.omega_body - to_body(flown.q_body_to_inertial, turning[:, None])
    return np.degrees(np.linalg.norm(relative, axis=-1))


def rate_about(k: int) -> Callable[[Scenario, Flown], np.ndarray]:
    """The signal of the absolute angular rate about axis k of the body [deg/s], with its sign."""

    def component(scenario: Scenario, flown: Flown) -> np.ndarray:
        return np.degrees(flown.omega_body[..., k])

    return component


def momentum(scenario: Scenario, flown: Flown) -> np.ndarray:
    """Magnitude of the angular momentum of body and wheels [N m s]."""
    carried, wheels = _momenta(flown)
    return momentum_size(carried, flown.omega_body, wheels)


def wheel_momentum(scenario: Scenario, flown: Flown) -> np.ndarray:
    """Magnitude of the momentum of all wheels together, relative to the body [N m s]."""
    return wheel_momentum_size(*_momenta(flown))


def _momenta(flown: Flown) -> tuple[Carried, np.ndarray]:
    if flown.carried is None or flown.wheels_n_m_s is None:
        raise ValueError("carried, wheels_n_m_s: must be given for a momentum; received None")
    return flown.carried, flown.wheels_n_m_s


def attitude_error(scenario: Scenario, flown: Flown) -> np.ndarray:
    """Angle [deg] of the rotation from the attitude that the scenario's laws hold at the time.

    NaN while they hold none.
    """
    attitude = always_held(scenario.control)
    if attitude is not None:
        return _angle_from(attitude, scenario, flown)
    held, which = _held_by_members(scenario, flown)
    found = np.full(which.shape, np.nan)
    for number, each in enumerate(held):
        found = np.where(which == number, _angle_from(each, scenario, flown), found)
    return found


def _angle_from(attitude: Attitude, scenario: Scenario, flown: Flown) -> np.ndarray:
    """Angle [deg] of the rotation from one attitude (r, n)."""
    from scipy.spatial.transform import Rotation

    target = np.array(attitude.q_wanted)
    if attitude.targets:
        place = (flown.position_inertial, flown.velocity_inertial, _direction("sun", flown))
        target = targets_along(attitude.targets, scenario, flown.t_s, *place)[0][:, None]
    elif attitude.orbital:
        frames = orbital_axes(flown.position_inertial, flown.velocity_inertial)
        target = (frames * Rotation.from_quat(attitude.q_wanted)).as_quat()[:, None]
    return np.degrees(angle_between(flown.q_body_to_inertial, target))


def _held_by_members(scenario: Scenario, flown: Flown) -> Holding:
    """What the laws of each member hold at each record: numbers (r, n)."""
    if flown.modes is None:
        raise ValueError("modes: must be given for an attitude that depends on them; received none")
    count, members = flown.q_body_to_inertial.shape[:2]
    length = max([count, *map(len, flown.modes.values())])
    each = [
        held_over_time(
            scenario.control, {k: v[:, n] for k, v in flown.modes.items()}, length
        ).which[length - count :]
        for n in range(members)
    ]
    return Holding(attitudes_in_order(scenario.control), np.stack(each, axis=1))


def angle_to(axis: Axis, flown: Flown) -> np.ndarray:
    """Angle [deg] from an axis of the body to a direction."""
    direction = _direction(axis.to, flown)[:, None]
    return angle_deg(to_reference(flown.q_body_to_inertial, np.array(axis.axis)), direction)


def _direction(to, flown: Flown) -> np.ndarray:
    """Direction (r, 3) in the inertial frame, of any length."""
    r, v = flown.position_inertial, flown.velocity_inertial
    if to == "sun":
        if flown.sun_inertial is None:
            raise ValueError("sun_inertial: must be given for the angle to the Sun; received None")
        return flown.sun_inertial
    if to == "field":
        if flown.b_inertial is None:
            raise ValueError("b_inertial: must be given for the angle to the field; received None")
        return flown.b_inertial
    if to == "nadir":
        return -r
    if to == "orbit_normal":
        return np.cross(r, v)
    return np.tile(to, (len(flown.t_s), 1))
