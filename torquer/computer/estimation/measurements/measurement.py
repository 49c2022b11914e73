"""A measurement of vectors, z = H x + noise of covariance R, and how readings become one."""

import math
from typing import NamedTuple

from torquer.compile.engine import inlined
from torquer.computer.estimation.covariance import IDENTITY, skew
from torquer.computer.estimation.mounting import by_misalignment, by_scale
from torquer.computer.interface import (
    ATTITUDE_SENSOR,
    HORIZON_SENSOR,
    MAGNETOMETER,
    SUN_CELLS,
    SUN_SENSORS,
)
from torquer.maths.geometry.quaternion import from_rotation_vector, rotate_inverse
from torquer.maths.geometry.vec3 import cross, dot, scale, sub, unit
from torquer.spacecraft.sensors.sun_cells import CELLS

#: Sensors of filters by the names that users give them there, and their numbers on board.
SENSOR_OF = {
    "magnetometer": MAGNETOMETER,
    "sun": SUN_SENSORS,
    "star_tracker": ATTITUDE_SENSOR,
    "horizon": HORIZON_SENSOR,
    "sun_cells": SUN_CELLS,
}
#: Channels of a filter, in the order of its memory: one for each of these sensors, but one for each
#: single Sun cell; number of those whose readings are vectors, and of all.
FIELD_CHANNEL, SUN_CHANNEL, STAR_CHANNEL, NADIR_CHANNEL, FIRST_CELL = range(len(SENSOR_OF))
VECTORS = FIRST_CELL
CHANNELS = VECTORS + CELLS
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


class Sensing(NamedTuple):
    """Noise of the sensors as filters assume it, and limits beyond which filters reject or restart.

    `r_field` [T^2], `r_sun`, `r_star`, `r_nadir` [rad^2]: variance of each component, 0 for a
    sensor that is not used; `r_star` of a star tracker across its boresight, `star_boresight`
    [body], and `r_star_about` about it; `r_cell`: variance of a cell's signal; `cell_albedo`, and
    the relative error of the Earth's light by it; `cells`: normal and cosine of the half field of
    each; `after_last`: number after that of the last sensor used; `gate_1` to `gate_3`: greatest
    normalised innovations squared of 1 to 3 components; `lost`: greatest sum of the attitude's
    variances [rad^2]; `most_rejected`: number of readings rejected one after another, `gap`: time
    without a step [s], after which the filter starts again; `has_gyro`: 1 for a filter whose motion
    is that of a gyro, else 0; `considered`: first row of the covariance that is not estimated, only
    considered, 0 for none.
    """

    r_field: float
    r_sun: float
    r_star: float
    r_star_about: float
    star_boresight: tuple
    r_nadir: float
    r_cell: float
    cell_albedo: float
    cell_albedo_error: float
    cells: tuple
    after_last: float
    gate_1: float
    gate_2: float
    gate_3: float
    lost: float
    most_rejected: float
    gap: float
    has_gyro: float
    considered: float


@inlined
def estimated_rows(sensing, p):
    """Number of rows of a covariance that are estimated, not only considered."""
    return int(sensing.considered) if sensing.considered > 0.0 else p.shape[0]


@inlined
def is_field_alone(sensing):
    """Whether a filter uses the magnetometer alone."""
    others = sensing.r_sun + sensing.r_star + sensing.r_nadir + sensing.r_cell
    return others == 0.0 and sensing.r_field > 0.0


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
