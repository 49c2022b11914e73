"""Targets that give an attitude: nadir, Sun, velocity, orbit normal, a place, a direction.

One axis of the body points to the first, another one as near as can be to the second. What they
make of it at an instant follows from time, place and Sun alone: the law that follows them, the
modes that judge it and the analysis of its flight all ask `reference_of` for it.
"""

from typing import Annotated, NamedTuple

import numpy as np

from torquer.compile.engine import inlined, kernel
from torquer.computer.blocks.limits import Limits
from torquer.computer.blocks.parameters import AnyNumbers, Share, UnitNumbers
from torquer.computer.laws.guidance import (
    ground_track,
    nadir_track,
    sine_of_elevation,
    steered_by,
    velocity_track,
)
from torquer.environment.field.model import row_vector
from torquer.maths.geometry.quaternion import rotate_inverse
from torquer.maths.geometry.vec3 import add, cross, put_vector

#: What a target is called in the parameters: a fixed direction has 0.
NUMBERS = {"nadir": 1.0, "sun": 2.0, "velocity": 3.0, "orbit_normal": 4.0, "ground": 5.0}
_NADIR, _SUN, _VELOCITY, _NORMAL, _GROUND = NUMBERS.values()
_ZERO = (0.0, 0.0, 0.0)


class Aim(NamedTuple):
    """What is aimed at: its number (0 for a direction), or the direction (inertial)."""

    number: Annotated[float, Limits(0.0, 5.0)]
    direction: UnitNumbers


class Targets(NamedTuple):
    """Both targets, axes made of both to the body (quaternion), place on the ground.

    `place` [m, Earth-fixed]; `least_sine`: of the elevation from which on it is in sight;
    `to_ecef`: inertial to Earth-fixed axes (rows) at the start of the run. These stand among the
    parameters of a law that follows them, under the same names.
    """

    first: Aim
    second: Aim
    q_axes: UnitNumbers
    place: AnyNumbers
    least_sine: Share
    to_ecef: tuple

    def with_parameter(self, name: str, value) -> "Targets":
        """These after a command or a state has set a parameter; a value of another is none."""
        if name in ("first", "second"):
            value = Aim(value[0], tuple(value[1:]))
        return self._replace(**{name: value}) if name in self._fields else self


#: In the place of targets where none are followed.
NO_TARGETS = Targets(
    Aim(0.0, (1.0, 0.0, 0.0)),
    Aim(0.0, (0.0, 1.0, 0.0)),
    (0.0, 0.0, 0.0, 1.0),
    _ZERO,
    0.0,
    ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
)


@inlined
def _track(known, p, aim):
    """The track of a target; of a place on the ground that is not in sight, that of the nadir."""
    r, v, number = known.ephemeris.r_inertial_m, known.ephemeris.v_inertial_m_s, aim.number
    if number == _NADIR:
        return nadir_track(r, v)
    if number == _VELOCITY:
        return velocity_track(r, v)
    if number == _GROUND:
        nadir, at = nadir_track(r, v), ground_track(p.to_ecef, known.t_s, p.place)
        if sine_of_elevation(p.to_ecef, at[0], r) < p.least_sine:
            return nadir
        return add(at[0], nadir[0]), add(at[1], nadir[1]), add(at[2], nadir[2])
    if number == _SUN:
        return known.ephemeris.sun_inertial, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    if number == _NORMAL:
        return cross(r, v), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    return aim.direction, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)


@inlined
def reference_of(known, p):
    """The attitude that targets `p` give, its rate and angular acceleration (`Steered`).

    `known`: `t_s` and `ephemeris`, as the inputs of a law have them.
    """
    return steered_by(_track(known, p, p.first), _track(known, p, p.second), p.q_axes)


class _Ephemeris(NamedTuple):
    r_inertial_m: tuple
    v_inertial_m_s: tuple
    sun_inertial: tuple


class _Known(NamedTuple):
    t_s: float
    ephemeris: _Ephemeris


@kernel
def _fill(targets, t_s, r, v, sun, attitudes, rates):
    for i in range(t_s.size):
        place = _Ephemeris(row_vector(r, i), row_vector(v, i), row_vector(sun, i))
        found = reference_of(_Known(t_s[i], place), targets)
        q = found.q
        attitudes[i, 0], attitudes[i, 1], attitudes[i, 2], attitudes[i, 3] = q
        put_vector(rates[i], rotate_inverse(q, found.omega))


def reference_along(targets: Targets, t_s, position, velocity, sun):
    """Attitudes (n, 4), body to inertial frame, and their rates (n, 3) [rad/s, body].

    `position` [m], `velocity` [m/s], `sun` (direction): (n, 3), inertial, at the times `t_s` [s]
    since the start.

        q, rates = reference_along(law.held().targets, t_s, r, v, sun)
    """
    arrays = [np.ascontiguousarray(each, dtype=float) for each in (t_s, position, velocity, sun)]
    attitudes, rates = np.empty((arrays[0].size, 4)), np.empty((arrays[0].size, 3))
    _fill(targets, *arrays, attitudes, rates)
    return attitudes, rates
