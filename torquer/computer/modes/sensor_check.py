"""Which sensor is not to be believed, found without an attitude and without a filter.

Each sensor by itself: silent, not a number, or the same numbers again and again, which a sensor
with noise does not send (`sensor_alone`). Then sensor against sensor: the gyro's rate must turn the
directions to the field and to the Sun (`estimation.watch`), the angle between the two and
the field's magnitude must be those of the models. Of three sensors, the one is to blame that
contradicts both others; where the Sun is not in view, it is the gyro, without which laws of
differences work, unless the field contradicted the Sun when it was last seen.
"""

import math

import numpy as np

from torquer.compile.engine import inlined, kernel
from torquer.computer.estimation.measurements.magnetometer import has_magnitude
from torquer.computer.estimation.measurements.measurement import (
    NO_MEASUREMENT,
    Measurement,
    turn_to_now,
)
from torquer.computer.estimation.triad import (
    both_read_s,
    contradict,
    field_at,
)
from torquer.computer.estimation.watch import WATCHED, watch
from torquer.computer.informed import is_known
from torquer.computer.inputs import read_inputs
from torquer.computer.interface import GYRO, MAGNETOMETER, SUN_SENSORS
from torquer.computer.modes.coil_check import follow_coils, forget_coils, has_field_reversed
from torquer.computer.modes.sensor_alone import fails_by_itself
from torquer.computer.modes.turning import follow_turning
from torquer.maths.geometry.quaternion import (
    from_rotation_vector,
    multiply,
    normalise,
    put_quaternion,
    read_quaternion,
)
from torquer.maths.geometry.vec3 import add, dot, norm, put_vector, read_vector, scale, unit

#: A suspicion lasts for this time [s] after the last sign of the failure.
SUSPECTED_S = 120.0
#: A test has failed once its readings have failed for this time [s] (each that passes takes half
#: of its interval off): single readings do so by chance.
_FAILED_S, _PASSED = 20.0, 0.5
#: Longest interval of readings [s] that counts, and across which the gyro's rate is integrated.
_LONGEST_S = 10.0
#: Time [s] over which the gyro's interval is averaged.
_AVERAGED_S = 60.0
#: The field's direction turns by up to three orbital rates [rad/s] by itself, in a polar orbit.
_FIELD_RATE = 3.6e-3
#: Part of the rate by which the gyro's may be off (scale factor, time of the readings).
_SCALE = 0.03
#: Time [s] for which coils are not judged after gyro or magnetometer have failed.
_UNSURE_S = 1800.0
#: Time [s] without a contradiction after which it is forgotten who lied.
_TRUSTED_S = 14400.0
#: Standard deviations that `watch` takes for a contradiction.
_SIGMAS = 4.0
#: What directions are compared with, as only their change counts.
_FIXED = (1.0, 0.0, 0.0)
_NO_TURN = (0.0, 0.0, 0.0, 1.0)

#: The tests: the gyro's rate against the turn of the field and of the Sun; angle between field and
#: Sun and magnitude of the field against the models; a Sun seen in the umbra.
FIELD_TURN, SUN_TURN, ANGLE, MAGNITUDE, UMBRA = range(5)

#: What is compared: time of the first control step; the gyro's reading that the rotation `q` is
#: propagated to, and its mean interval, by the time that each takes; how long each test has failed
#: [s], and the control step at which it was last made; time of the readings whose angle was tested
#: last; whose direction is wrong, 1 the field's and -1 the Sun's by its sign, twice as much by its
#: turn, and when they last contradicted each other; when the field was last wrong, in another way
#: than by its sign; see `watch`.
SENSORS_NOW = [
    ("first_s", np.float64),
    ("gyro_s", np.float64),
    ("gyro_interval_s", np.float64),
    ("omega", np.float64, (3,)),
    ("q", np.float64, (4,)),
    ("failed_for_s", np.float64, (5,)),
    ("tested_s", np.float64, (5,)),
    ("angle_s", np.float64),
    ("liar", np.float64),
    ("liar_s", np.float64),
    ("no_field_s", np.float64),
    ("watched", np.float64, (2, 2, WATCHED)),
]


def first_sensors(checks: np.ndarray) -> None:
    """Nothing read and compared yet."""
    checks["first_s"] = checks["gyro_s"] = checks["angle_s"] = -math.inf
    checks["liar_s"] = checks["no_field_s"] = checks["tested_s"] = -math.inf
    checks["q"][:, 3] = 1.0
    checks["watched"][..., 0] = -math.inf


@inlined
def put_test(now, test, fails, interval_s, t_s):
    """Take note of one more reading that a test has been made with."""
    failed_for_s, interval_s = now.failed_for_s[test], min(interval_s, _LONGEST_S)
    if fails:
        failed_for_s = min(failed_for_s + interval_s, 2.0 * _FAILED_S)
    else:
        failed_for_s = max(failed_for_s - _PASSED * interval_s, 0.0)
    now.failed_for_s[test], now.tested_s[test] = failed_for_s, t_s


@inlined
def has_failed(now, test):
    """Whether a test has failed for long enough, when it was last made."""
    return now.failed_for_s[test] >= _FAILED_S


@inlined
def fails_now(now, test, t_s):
    """Whether a test that has failed was made at this control step, so that it says so again."""
    return has_failed(now, test) and now.tested_s[test] == t_s


@inlined
def follow_gyro(now, gyro, inputs):
    """Propagate the rotation to the gyro's latest reading; whether it is known.

    What has been kept to compare with is forgotten where it is not.
    """
    omega = inputs.omega_body_rad_s
    stays = gyro.read_s - gyro.same_since_s > 3.0 * gyro.interval_s
    if gyro.failed_s == inputs.t_s or stays or not gyro.read_s > -math.inf:
        now.gyro_s = -math.inf
        return False
    if inputs.t_s - gyro.read_s > _LONGEST_S:
        return False
    interval_s = gyro.read_s - now.gyro_s
    if interval_s > _LONGEST_S:
        now.watched[0, :, 0] = now.watched[1, :, 0] = -math.inf
    elif interval_s > 0.0:
        turn = scale(0.5 * interval_s, add(omega, read_vector(now.omega)))
        q = normalise(multiply(read_quaternion(now.q), from_rotation_vector(turn)))
        if not is_known(q):  # a rate whose square is beyond all numbers: the rotation is lost
            q = (0.0, 0.0, 0.0, 1.0)
            now.watched[0, :, 0] = now.watched[1, :, 0] = -math.inf
        put_quaternion(now.q, q)
        part = min(interval_s / _AVERAGED_S, 1.0) if now.gyro_interval_s > 0.0 else 1.0
        now.gyro_interval_s += part * (interval_s - now.gyro_interval_s)
    put_vector(now.omega, omega)
    now.gyro_s = gyro.read_s
    return True


@inlined
def turns_otherwise(now, cells, v, read_s, sigma, tolerance, gyro_variance):
    """Whether a direction turns in another way than the gyro says, or stays.

    `tolerance`: difference of the rates [rad/s] that is allowed; `gyro_variance`: of the rotation
    by the gyro's noise [rad^2/s].
    """
    omega = read_vector(now.omega)
    seen = turn_to_now(omega, now.gyro_s - read_s, unit(v))
    seen = turn_to_now(scale(-1.0, omega), read_s - now.gyro_s, seen)  # read after the gyro
    none = NO_MEASUREMENT
    m = Measurement(none.z, none.h, none.h_other, none.at, sigma * sigma, 2, seen, _FIXED, 0.0)
    rate = (tolerance + _SCALE * norm(omega)) / _SIGMAS
    variances = (0.0, rate * rate, gyro_variance, 0.0)
    turned = watch(cells, now.gyro_s, m, _NO_TURN, read_quaternion(now.q), variances)
    return turned.stuck or turned.rate_error > 0.0


@inlined
def is_seen(v):
    """Whether a reading is a direction: neither nothing nor what is no number."""
    return 0.0 < dot(v, v) < math.inf


@inlined
def compare_turns(now, sensors, noise, inputs):
    """The gyro's rate against the turn of field and Sun.

    How the Sun has turned is forgotten where it stays out of view, but not in each turn of a
    tumbling satellite.
    """
    b, sun, t_s = inputs.b_body_t, inputs.sun_body, inputs.t_s
    field, light = sensors[MAGNETOMETER], sensors[SUN_SENSORS]
    gyro_variance = noise.rate_rad_s * noise.rate_rad_s * now.gyro_interval_s
    if field.is_new == 1.0 and is_seen(b):
        sigma, tolerance = noise.field_t / norm(b), noise.rate_tolerance + _FIELD_RATE
        cells, read_s = now.watched[0], field.read_s
        fails = turns_otherwise(now, cells, b, read_s, sigma, tolerance, gyro_variance)
        put_test(now, FIELD_TURN, fails, field.interval_s, t_s)
    if dot(sun, sun) == 0.0:
        now.watched[1, :, 0] = -math.inf
        if t_s - now.tested_s[SUN_TURN] > SUSPECTED_S:
            now.failed_for_s[SUN_TURN] = 0.0
    elif light.is_new == 1.0 and is_seen(sun):
        sigma, tolerance = noise.sun_rad, noise.rate_tolerance
        cells, read_s = now.watched[1], light.read_s
        fails = turns_otherwise(now, cells, sun, read_s, sigma, tolerance, gyro_variance)
        put_test(now, SUN_TURN, fails, light.interval_s, t_s)


@inlined
def compare_with_models(now, sensors, noise, inputs):
    """Field and Sun against the models; what the models do not know does not fail."""
    b, sun, place, t_s = inputs.b_body_t, inputs.sun_body, inputs.ephemeris, inputs.t_s
    field, light = sensors[MAGNETOMETER], sensors[SUN_SENSORS]
    if field.is_new == 1.0 and math.isfinite(place.b_inertial_t[0]):
        odd = not has_magnitude(b, place.b_inertial_t, noise.field_t)
        put_test(now, MAGNITUDE, odd, field.interval_s, t_s)
    if light.is_read == 1.0:
        seen = place.sunlit_fraction == 0.0 and is_seen(sun)
        put_test(now, UMBRA, seen, light.interval_s, t_s)
    at_s, new = both_read_s(inputs, now.angle_s), field.is_new * light.is_new == 1.0
    if new and at_s > -math.inf and is_seen(sun) and is_seen(b):
        variance = noise.sun_rad * noise.sun_rad + noise.field_t * noise.field_t / dot(b, b)
        fails = contradict(b, sun, field_at(inputs, at_s), place.sun_inertial, variance)
        put_test(now, ANGLE, fails, at_s - now.angle_s, t_s)
        now.angle_s = at_s


@inlined
def is_field_doubtful(now):
    """Whether the field is not where the models have it, or not where the Sun sensors say.

    It is not doubtful where it is known that the Sun sensors are wrong: they do not turn as the
    gyro says, or the coils work by this field as they should.
    """
    is_of_sun = now.liar == -2.0 or (now.liar == -1.0 and has_field_reversed(now) < 0.0)
    return has_failed(now, MAGNITUDE) or (has_failed(now, ANGLE) and not is_of_sun)


@inlined
def blame(now, sensors, t_s):
    """(Magnetometer, gyro, Sun sensors): whether each is to blame for what does not agree.

    A contradiction with a sensor that fails by itself says nothing about the others. Only a test of
    this control step blames, with one exception: whoever was to blame when field and Sun
    contradicted each other stays so while the Sun is not seen. (A field of the wrong sign would be
    used again in every umbra.)
    """
    no_field = sensors[MAGNETOMETER].failed_s == t_s or has_failed(now, MAGNITUDE)
    no_sun = sensors[SUN_SENSORS].failed_s == t_s or has_failed(now, UMBRA)
    by_field = not no_field and has_failed(now, FIELD_TURN)
    by_sun = not no_sun and has_failed(now, SUN_TURN)
    field, sun = fails_now(now, MAGNITUDE, t_s), fails_now(now, UMBRA, t_s)
    if t_s - now.liar_s > _TRUSTED_S:
        now.liar = 0.0
    if no_field or no_sun or not has_failed(now, ANGLE):
        gyro = by_field and fails_now(now, FIELD_TURN, t_s)
        return field, gyro or (by_sun and fails_now(now, SUN_TURN, t_s)), sun
    if now.tested_s[ANGLE] == t_s:
        now.liar, now.liar_s = find_liar(now, by_field, by_sun), t_s
    return field or now.liar > 0.0, False, sun or now.liar < 0.0


@inlined
def find_liar(now, by_field, by_sun):
    """Whose direction is wrong where field and Sun contradict each other: see `SENSORS_NOW`.

    The one that does not turn as the gyro says, now or earlier; where neither was found to, a sign
    is wrong, which does not change how a direction turns: the field's if the coils work against the
    command, else that of the Sun sensors.
    """
    if by_field != by_sun:
        return 2.0 if by_field else -2.0
    known = has_field_reversed(now)
    is_known = abs(now.liar) == 2.0 or (now.liar != 0.0 and known == 0.0)
    if is_known or now.failed_for_s[ANGLE] < 2.0 * _FAILED_S:
        return now.liar
    return 1.0 if known > 0.0 else -1.0


@inlined
def has_no_field(now, sensors, t_s):
    """Whether the field that is read is wrong in another way than by its sign."""
    fails = sensors[MAGNETOMETER].failed_s == t_s or fails_now(now, MAGNITUDE, t_s)
    by_more = now.liar != 1.0 or fails_now(now, FIELD_TURN, t_s)
    return fails or (by_more and sensors[MAGNETOMETER].blamed_s == t_s)


@inlined
def are_sound(now, sensors, t_s):
    """Whether gyro and magnetometer are read and may be believed, but for the field's sign."""
    known = now.gyro_s > -math.inf and sensors[MAGNETOMETER].read_s > -math.inf
    failed_s = max(now.no_field_s, sensors[GYRO].failed_s, sensors[GYRO].blamed_s)
    agree = now.failed_for_s[FIELD_TURN] == 0.0 and not has_failed(now, MAGNITUDE)
    agree = agree and (now.failed_for_s[SUN_TURN] == 0.0 or now.liar == -2.0)
    return known and agree and t_s - failed_s > _UNSURE_S


@inlined
def forget_turns(now):
    """Begin the comparison with the gyro's rate again once it is known again."""
    now.failed_for_s[FIELD_TURN] = now.failed_for_s[SUN_TURN] = 0.0


@kernel
def check_sensors(table, state, k):
    """Bring all suspicions up to date, once per control step, before the modes are switched."""
    now, sensors, noise, t_s = state.checks[0], state.sensors, table.noise, k.t_s
    inputs = read_inputs(k)
    if now.first_s == -math.inf:
        now.first_s = t_s
    for i in range(len(sensors)):
        kind, oldest_s = table.kinds[i], table.oldest_s[i]
        if fails_by_itself(sensors[i], i, kind, k, now.first_s, oldest_s):
            sensors[i].failed_s = t_s
    follow_turning(now, sensors, inputs)
    if follow_gyro(now, sensors[GYRO], inputs):
        compare_turns(now, sensors, noise, inputs)
    else:
        forget_turns(now)
    compare_with_models(now, sensors, noise, inputs)
    field, gyro, sun = blame(now, sensors, t_s)
    for i, is_blamed in ((MAGNETOMETER, field), (GYRO, gyro), (SUN_SENSORS, sun)):
        if is_blamed:
            sensors[i].blamed_s = t_s
    if has_no_field(now, sensors, t_s):
        now.no_field_s = t_s
    if gyro or now.no_field_s == t_s or not now.gyro_s > -math.inf:
        forget_coils(now)
    follow_coils(table, now, inputs, are_sound(now, sensors, t_s))
