"""Whether a sensor's readings turn as the body does, found without the attitude.

A vector that was read some time ago is turned as the filter has propagated its attitude since; only
its change in the inertial frame, which is small, needs an attitude. A reading that stays while it
must turn is that of a stuck sensor; one that turns in another way shows that the motion which the
filter propagates is not the body's.
"""

import math
from typing import NamedTuple

from torquer.compile.engine import inlined
from torquer.maths.geometry.quaternion import conjugate, multiply, normalise, rotate_inverse
from torquer.maths.geometry.vec3 import add, dot, sub

#: Time [s] for which a reading is compared with later ones: in longer ones, smaller errors of the
#: rate show.
_BASELINE_S = 60.0
#: Time [s] in which an error of the rate is assumed to have grown when it is found.
GROWN_S = 3.0
#: A sensor is stuck if it must have turned by this many standard deviations; the motion is not the
#: body's if a reading misses the expected one by so many (while the filter rejects it).
_STUCK, _MISSED = 8.0, 4.0
#: Within this many standard deviations of the noise, a reading is still the same.
_SAME = 3.0
#: Cells of a reading to compare with: time; vector read [body], of the model [inertial]; attitude
#: and propagated rotation at that time.
WATCHED = 15


class Turned(NamedTuple):
    """What a sensor's readings show.

    `stuck`: they stay though they must turn; `moves`: the latest one does not stay; `rate_error`
    [rad/s]: of the propagated motion, 0 if they turn with it or stay.
    """

    stuck: bool
    moves: bool
    rate_error: float


@inlined
def put_reference(row, t_s, m, q, rotation):
    """Compare later readings with this one."""
    row[0] = t_s
    row[1], row[2], row[3] = m.read
    row[4], row[5], row[6] = m.reference
    row[7], row[8], row[9], row[10] = q
    row[11], row[12], row[13], row[14] = rotation


@inlined
def follow(cells, before, after):
    """Add the rotation between two attitudes to the propagated rotation in four cells."""
    turn = multiply(conjugate(before), after)
    rotation = multiply((cells[0], cells[1], cells[2], cells[3]), turn)
    cells[0], cells[1], cells[2], cells[3] = normalise(rotation)


@inlined
def expected_from(row, age, m, rotation, variances):
    """(Vector expected now by an earlier reading, that reading, variance of what is expected).

    `variances`: as for `watch`; the first one is that of the attitude.
    """
    read, change = (row[1], row[2], row[3]), sub(m.reference, (row[4], row[5], row[6]))
    q, before = (row[7], row[8], row[9], row[10]), (row[11], row[12], row[13], row[14])
    turn = multiply(conjugate(before), rotation)
    expected = rotate_inverse(turn, add(read, rotate_inverse(q, change)))
    spread = dot(m.reference, m.reference) * age * (variances[1] * age + variances[2])
    return expected, read, 2.0 * m.r + spread + variances[0] * dot(change, change)


@inlined
def rate_error(m, expected, spread):
    """Error of the rate [rad/s] that a reading shows which is not the expected one; 0 for none."""
    missed = sub(m.read, expected)
    square = dot(missed, missed)
    if square < _MISSED * _MISSED * spread:
        return 0.0
    return math.sqrt(square / dot(m.reference, m.reference)) / GROWN_S


@inlined
def watch(cells, t_s, m, q, rotation, variances):
    """Compare a measurement with the sensor's earlier ones, and keep it for later ones.

    `cells` (2, WATCHED): a reading up to a minute old, and the first of those that have stayed;
    `rotation`: propagated since the filter began; `variances` about each axis: of the attitude
    [rad^2], of the rate [rad^2/s^2], growth of that of the rotation by white noise [rad^2/s], and
    of the attitude [rad^2] where the motion is tested.
    """
    old, same = cells[0], cells[1]
    age = t_s - old[0]
    if not age < math.inf:
        put_reference(old, t_s, m, q, rotation)
        put_reference(same, t_s, m, q, rotation)
        return Turned(False, False, 0.0)
    expected, before, spread = expected_from(same, t_s - same[0], m, rotation, variances)
    moved, ahead = sub(m.read, before), sub(expected, before)
    if dot(moved, moved) < 2.0 * _SAME * _SAME * m.r:
        return Turned(dot(ahead, ahead) > _STUCK * _STUCK * spread, False, 0.0)
    doubted = (variances[3], variances[1], variances[2])
    expected, _, spread = expected_from(same, t_s - same[0], m, rotation, doubted)
    error = rate_error(m, expected, spread)
    put_reference(same, t_s, m, q, rotation)
    expected, _, spread = expected_from(old, age, m, rotation, doubted)
    error = max(error, rate_error(m, expected, spread))
    if age >= _BASELINE_S:
        put_reference(old, t_s, m, q, rotation)
    return Turned(False, True, error)
