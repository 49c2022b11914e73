"""A measurement of vectors, z = H x + noise of covariance R, and how readings become one."""

import math
from typing import NamedTuple

from torquer.compile.engine import inlined
from torquer.computer.estimation.covariance import IDENTITY, skew
from torquer.computer.estimation.mounting import by_misalignment, by_scale
from torquer.maths.geometry.quaternion import from_rotation_vector, rotate_inverse
from torquer.maths.geometry.vec3 import cross, dot, scale, sub, unit

_ZERO = (0.0, 0.0, 0.0)


class Measurement(NamedTuple):
    """What a filter takes of a reading: z, H, R.

    `z`: measured less predicted; `h`: columns of H for the attitude error, by rows; `h_other`:
    those for three more states, from the columns `at` on (0: none); `r`: variance of each
    component; `count`: 2 or 3 components, 0 for no reading. `read`: the vector read, in body axes
    of now, less errors that are states; `reference`: what the model gives, inertial. `since`:
    variance [rad^2] about each axis that white noise has added to the attitude error since a late
    reading.
    """

    z: tuple
    h: tuple
    h_other: tuple
    at: tuple
    r: float
    count: int
    read: tuple
    reference: tuple
    since: float


NO_OTHER, NOWHERE = (IDENTITY, IDENTITY, IDENTITY), (0, 0, 0)
NO_MEASUREMENT = Measurement(_ZERO, IDENTITY, NO_OTHER, NOWHERE, 0.0, 0, _ZERO, _ZERO, 0.0)


class Direction(NamedTuple):
    """The latest reading of a direction.

    `is_used`: whether the filter has the sensor; `is_usable`: whether its reading is a direction
    and not too old. `read_s`: its time; `v`: in body axes of that time, `reference`: by the
    model (inertial), both of any length; `r`: variance [rad^2] about each axis across.
    """

    is_used: bool
    is_usable: bool
    read_s: float
    v: tuple
    reference: tuple
    r: float


NO_DIRECTION = Direction(False, False, 0.0, _ZERO, _ZERO, 0.0)


@inlined
def estimated_rows(sensing, p):
    """Number of rows of a covariance that are estimated, not only considered."""
    considered = max(0, min(int(sensing.considered), p.shape[0]))  # a state may be damaged
    return considered if sensing.considered > 0.0 else p.shape[0]


@inlined
def is_new(variance, v, t_s, taken_s):
    """Whether a sensor is used, its vector of finite length and read after `taken_s`."""
    return variance > 0.0 and t_s > taken_s and 0.0 < dot(v, v) < math.inf


@inlined
def is_usable(variance, v, age, oldest):
    """Whether a sensor is used and its latest reading is a vector of finite length, not too old."""
    return variance > 0.0 and age <= oldest and 0.0 < dot(v, v) < math.inf


@inlined
def turn_to_now(omega, age, v):
    """A vector read `age` seconds ago in body axes of now; the body turns with omega."""
    if age <= 0.0:
        return v
    return rotate_inverse(from_rotation_vector(scale(age, omega)), v)


@inlined
def frame_across(v):
    """Two vectors of length one across a vector: a right-handed frame with its direction."""
    x, y, z = abs(v[0]), abs(v[1]), abs(v[2])
    if x <= y and x <= z:
        t = (0.0, v[2], -v[1])
    elif y <= z:
        t = (-v[2], 0.0, v[0])
    else:
        t = (v[1], -v[0], 0.0)
    t = unit(t)
    return t, unit(cross(v, t))


@inlined
def direction_measurement(q, reference, measured, variance):
    """(z, H, R) of a direction: two components across the predicted vector, of any length.

    `q`: attitude; `reference`: the vector of the model, inertial; `measured`: in the body.

    The component along the prediction does not depend on the attitude.
    """
    predicted = rotate_inverse(q, reference)
    t, u = frame_across(predicted)
    z = (dot(t, measured), dot(u, measured), 0.0)
    rows = (cross(t, predicted), cross(u, predicted), _ZERO)
    return Measurement(z, rows, NO_OTHER, NOWHERE, variance, 2, measured, reference, 0.0)


@inlined
def vector_measurement(q, reference, measured, at, variance):
    """(z, H, R) of a vector by a sensor with a bias, scale errors and a misalignment as states.

    `at`: first rows of these three states, 0 for none; `measured`: without these errors as they are
    known.
    """
    predicted = rotate_inverse(q, reference)
    z = sub(measured, predicted)
    others = (IDENTITY, by_scale(predicted), by_misalignment(predicted))
    return Measurement(z, skew(predicted), others, at, variance, 3, measured, reference, 0.0)
