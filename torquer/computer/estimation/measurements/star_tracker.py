"""Star tracker: the whole attitude, with other noise about its boresight than across it."""

import math
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from torquer.base.spec import Spec, unit_vector
from torquer.compile.engine import inlined, kernel
from torquer.computer.estimation.covariance import RATE_ERROR, mat_scale
from torquer.computer.estimation.measurements.measured import Measured
from torquer.computer.estimation.measurements.measurement import (
    NO_MEASUREMENT,
    Measurement,
    frame_across,
)
from torquer.computer.estimation.triad import rate_between
from torquer.maths.geometry.quaternion import (
    from_rotation_vector,
    multiply,
    normalise,
    read_quaternion,
    rotate_inverse,
)
from torquer.maths.geometry.vec3 import dot, norm, read_vector, scale, unit
from torquer.spacecraft.sensors.attitude_sensor import earth_cosine, is_blind

#: A direction (inertial) that stands for the stars where readings are watched: about it no
#: satellite spins for long.
_STAR = (0.48, 0.6, 0.64)
#: Number of steps whose rotation is kept, to take late readings as of their time.
PAST = 16


class StarNoise(NamedTuple):
    """Variances [rad^2] of a reading across the boresight and about it, boresight [body]."""

    r: float
    r_about: float
    boresight: tuple


@inlined
def is_attitude(variance, q, t_s, since_s):
    """Whether a star tracker is used, its reading an attitude and taken after `since_s`."""
    square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]
    return variance > 0.0 and t_s > since_s and 0.0 < square < math.inf


@inlined
def keep_rotation(memory):
    """Keep the rotation propagated until now, in place of the oldest that is kept."""
    k = int(memory.past_next)
    row = memory.past[k]
    row[0] = memory.t_s
    row[1], row[2], row[3], row[4] = read_quaternion(memory.rotation)
    memory.past_next = float(k + 1) if k + 1 < PAST else 0.0


@inlined
def turn_since(memory, since_s, omega):
    """Rotation (a quaternion) propagated since an earlier time.

    Between two steps the rate is steady; before the first one kept it is omega.
    """
    past, next_s, later = memory.past, memory.t_s, read_quaternion(memory.rotation)
    k, turn, left = int(memory.past_next), (0.0, 0.0, 0.0, 1.0), True
    for _ in range(PAST):
        k = k - 1 if k > 0 else PAST - 1
        row = past[k]
        if left and -math.inf < row[0] < next_s:
            earlier = (row[1], row[2], row[3], row[4])
            share = min((next_s - since_s) / (next_s - row[0]), 1.0)
            turned = scale(share, rate_between(earlier, later, 1.0))
            turn = multiply(from_rotation_vector(turned), turn)
            next_s, later, left = row[0], earlier, row[0] > since_s
    if left and next_s > since_s:
        turn = multiply(from_rotation_vector(scale(next_s - since_s, omega)), turn)
    return turn


@inlined
def measure_attitude(q, read, own, lever, since):
    """(z, H, R) of an attitude read: the rotation to it from the filter's, across and about.

    The three components are scaled to one variance, the greater one. `lever` [s]: what the error of
    the rate is multiplied by in a late reading, which has no part of it since; `since`: see
    `Measurement`.
    """
    turn, b = rate_between(q, read, 1.0), own.boresight
    r = max(own.r, own.r_about)
    t, u = frame_across(b)
    factor = math.sqrt(r / own.r)
    rows = (scale(factor, t), scale(factor, u), scale(math.sqrt(r / own.r_about), b))
    z = (dot(rows[0], turn), dot(rows[1], turn), dot(rows[2], turn))
    seen = rotate_inverse(read, _STAR)
    at = (RATE_ERROR if lever != 0.0 else 0, 0, 0)
    others = (mat_scale(lever, rows), rows, rows)
    return Measurement(z, rows, others, at, r, 3, seen, _STAR, since)


@inlined
def measure(inputs, parameters, memory, read, at_s, own, place, omega, walk):
    """(z, H, R) of the latest reading, if it is new, as of now.

    A tracker is so accurate that a rate times its reading's age would not do: the reading is turned
    as the filter has propagated its attitude since, with omega before the first step kept. `walk`:
    growth of the variance of the propagated rotation by white noise [rad^2/s].
    """
    if not is_attitude(own.r, read, at_s, memory.read_s[place.channel]):
        return NO_MEASUREMENT
    age = max(inputs.t_s - at_s, 0.0)
    turn = turn_since(memory, at_s, omega) if age > 0.0 else (0.0, 0.0, 0.0, 1.0)
    now = normalise(multiply(read, turn))
    # an error of the gyro turns the filter the other way
    lever = -age if parameters.prior.rate > 0.0 else age
    return measure_attitude(read_quaternion(memory.q), now, own, lever, age * walk)


@inlined
def expected(parameters, along, k, own, assumed, cell):
    """(z, H, R) of the attitude."""
    q = read_quaternion(along.q[k])
    return measure_attitude(q, q, own, 0.0, 0.0)


@kernel
def put_stars(sensor, q, omega, sun, moon, r, stars):
    """Whether a star tracker reads an attitude, into `stars` (k,).

    At attitudes (k, 4) and rates (k, 3), with directions to Sun and Moon and positions (k, 3) [m],
    inertial.
    """
    for k in range(stars.shape[0]):
        at, place = read_quaternion(q[k]), read_vector(r[k])
        to_sun, nadir = rotate_inverse(at, read_vector(sun[k])), rotate_inverse(at, unit(place))
        cosine = earth_cosine(sensor, norm(place))
        turning, to_moon = read_vector(omega[k]), rotate_inverse(at, read_vector(moon[k]))
        stars[k] = not is_blind(sensor, turning, to_sun, to_moon, scale(-1.0, nadir), cosine)


def visible(craft, seen):
    """Whether one of the trackers reads an attitude along a motion (k,)."""
    stars = np.zeros(len(seen.q), bool)
    for tracker in craft.each_of("attitude_sensor"):
        own = np.zeros(len(seen.q), bool)
        put_stars(tracker.pack(), seen.q, seen.omega, seen.sun, seen.moon, seen.r, own)
        stars |= own
    return stars


class StarTrackerKeys(Spec):
    """A filter's keys of the star tracker."""

    star_tracker_noise_deg: Annotated[float, Field(gt=0.0, le=180.0)] | None = None
    """Standard deviation of a reading of the star tracker about each axis across its boresight;
    given if the filter uses it.
    """
    star_tracker_boresight_noise_deg: Annotated[float, Field(gt=0.0, le=180.0)] | None = None
    """Standard deviation of a reading of the star tracker about its boresight; left out: the same
    as across it.
    """
    star_tracker_boresight: unit_vector("boresight") | None = None
    """Boresight of the star tracker in the body; given with its noise about it."""


def check(keys) -> None:
    """The noise about the boresight and the boresight are given together."""
    about = (keys.star_tracker_boresight_noise_deg, keys.star_tracker_boresight)
    used = keys.star_tracker_noise_deg is not None
    if (about[0] is None) != (about[1] is None) or (about[0] is not None and not used):
        raise ValueError(
            "star_tracker_boresight_noise_deg, star_tracker_boresight: must be given together, "
            f"with the star tracker among the sensors; received {about[0]}, {about[1]}"
        )


def constants(keys) -> StarNoise:
    """Constants for kernels."""
    across_deg = keys.star_tracker_noise_deg or 0.0
    about_deg = keys.star_tracker_boresight_noise_deg or across_deg
    boresight = keys.star_tracker_boresight or (0.0, 0.0, 1.0)
    return StarNoise(math.radians(across_deg) ** 2, math.radians(about_deg) ** 2, boresight)


def unit_constants(keys, spec) -> StarNoise:
    """Constants of one of several trackers: with its own boresight, as it is mounted."""
    own = constants(keys)
    return own if spec.boresight is None else own._replace(boresight=spec.boresight)


MEASURED = Measured(
    "star_tracker",
    said="star tracker",
    keys=StarTrackerKeys,
    noise="star_tracker_noise_deg",
    check=check,
    constants=constants,
    measure=measure,
    expected=expected,
    visible=visible,
    missing="no usable reading of the star tracker",
    says={
        "axes": "star_tracker_boresight",
        "noise_about": "star_tracker_boresight_noise_deg",
    },
    directions=2,
    unit_constants=unit_constants,
    colour="GREEN",
)
