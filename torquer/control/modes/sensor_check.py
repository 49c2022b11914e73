"""Which sensor is not to be believed, found without an attitude and without a filter.

Each sensor by itself: silent, not a number, or the same numbers again and again, which a sensor
with noise does not send. Then sensor against sensor: the gyro's rate must turn the directions to
the field and to the Sun (`torquer.estimation.watch`), the angle between the two and the field's
magnitude must be those of the models. Of three sensors, the one is to blame that contradicts both
others; where the Sun is not in view, it is the gyro, without which laws of differences work.
"""

import math

import numpy as np

from torquer.compile.engine import inlined, inner, internal
from torquer.control.modes.coil_check import follow_coils, forget_coils, has_field_reversed
from torquer.estimation.measurements.magnetometer import has_magnitude
from torquer.estimation.measurements.measurement import NO_MEASUREMENT, Measurement, as_of_now
from torquer.estimation.triad import (
    both_read_s,
    contradict,
    field_at,
    put_quaternion,
    quaternion_of,
)
from torquer.estimation.watch import CELLS, watch
from torquer.geometry.quaternion import from_rotation_vector, multiply, normalised
from torquer.geometry.vec3 import add, dot, norm, put_vector, scale, unit, vector_of

#: Numbers of the sensors, in the order of `ReadingTimes`.
MAGNETOMETER, SEARCH_COIL, GYRO, SUN_SENSORS, ATTITUDE_SENSOR, TACHOMETERS = range(6)
HORIZON_SENSOR, SUN_CELLS = 6, 7
#: A sensor is silent after this time [s], or after so many of its intervals if that is longer.
_SILENT_S, _INTERVALS = 30.0, 3.0
#: Time [s] after which the same numbers again are those of a stuck sensor.
_SAME_S = 30.0
#: A suspicion lasts for this time [s] after the last sign of the failure.
SUSPECTED_S = 120.0
#: A test has failed once its readings have failed for this time [s] (each that passes takes half
#: of its interval off): single readings do so by chance.
_FAILED_S, _PASSED = 20.0, 0.5
#: Longest interval of readings [s] that counts, and across which the gyro's rate is integrated.
_LONGEST_S = 10.0
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

#: A sensor: its last reading, when it was taken and how long after the one before; since when it
#: has sent these numbers, and whether they are new at this control step; when it last failed by
#: itself, and when it was last to blame.
SENSOR_NOW = np.dtype(
    [
        (name, np.float64)
        for name in (
            *("read_s", "interval_s", "x", "y", "z", "w", "same_since_s", "is_new"),
            *("failed_s", "blamed_s"),
        )
    ]
)
#: What is compared: time of the first control step; the gyro's reading that the rotation `q` is
#: propagated to; how long each test has failed [s]: turn of field and Sun, angle between them, the
#: field's magnitude, a Sun seen in the umbra; when that angle was last tested; whose direction is
#: wrong, 1 the field's and -1 the Sun's by its sign, twice as much by its turn, and when they
#: last contradicted each other; see `watch`.
SENSORS_NOW = [
    ("first_s", np.float64),
    ("gyro_s", np.float64),
    ("omega", np.float64, (3,)),
    ("q", np.float64, (4,)),
    ("turn", np.float64, (2,)),
    ("angle", np.float64),
    ("angle_s", np.float64),
    ("magnitude", np.float64),
    ("umbra", np.float64),
    ("liar", np.float64),
    ("liar_s", np.float64),
    ("watched", np.float64, (2, 2, CELLS)),
]


def first_sensors(checks: np.ndarray) -> None:
    """Nothing read and compared yet."""
    checks["first_s"] = checks["gyro_s"] = checks["angle_s"] = -math.inf
    checks["liar_s"] = -math.inf
    checks["q"][:, 3] = 1.0
    checks["watched"][..., 0] = -math.inf


@internal
def reading_of(inputs, sensor):
    """(Time of a sensor's latest reading, its numbers)."""
    at = inputs.read_at
    x, y, z = inputs.b_body_t
    t_s, w = at.magnetometer_s, 0.0
    if sensor == SEARCH_COIL:
        t_s, (x, y, z) = at.search_coil_s, inputs.b_rate_body_t_s
    elif sensor == GYRO:
        t_s, (x, y, z) = at.gyro_s, inputs.omega_body_rad_s
    elif sensor == SUN_SENSORS:
        t_s, (x, y, z) = at.sun_sensors_s, inputs.sun_body
    elif sensor == ATTITUDE_SENSOR:
        t_s, (x, y, z, w) = at.attitude_sensor_s, inputs.q_body_to_inertial
    elif sensor == TACHOMETERS:
        t_s, (x, y, z) = at.tachometers_s, inputs.wheel_momentum_body_n_m_s
    elif sensor == HORIZON_SENSOR:
        t_s, (x, y, z) = at.horizon_sensor_s, inputs.nadir_body
    elif sensor == SUN_CELLS:
        cells = inputs.sun_cells
        t_s, (x, y, z, w) = at.sun_cells_s, cells[:4]
        w += math.pi * (cells[4] + math.pi * cells[5])  # one number that changes with each
    return t_s, (x, y, z, w)


@internal
def may_stay(sensor, v):
    """Whether a sound sensor may send the same numbers for long: nothing seen, wheels at rest."""
    of_sight = sensor in (SUN_SENSORS, HORIZON_SENSOR, SUN_CELLS)
    nothing = of_sight and v[0] == 0.0 and v[1] == 0.0 and v[2] == 0.0 and v[3] == 0.0
    return nothing or sensor in (SEARCH_COIL, TACHOMETERS)


@internal
def fails_by_itself(now, sensor, inputs, first_s):
    """Whether a sensor is silent, stuck, or reads what is not a number."""
    read_s, v = reading_of(inputs, sensor)
    now.is_new = 0.0
    if read_s > now.read_s:
        same = v[0] == now.x and v[1] == now.y and v[2] == now.z and v[3] == now.w
        now.is_new = 0.0 if same else 1.0
        now.same_since_s = now.same_since_s if same and not may_stay(sensor, v) else read_s
        now.interval_s = read_s - now.read_s if now.read_s > -math.inf else 0.0
        now.read_s = read_s
        now.x, now.y, now.z, now.w = v
    silent_s = inputs.t_s - max(now.read_s, first_s)
    is_silent = silent_s > max(_SILENT_S, _INTERVALS * now.interval_s)
    is_stuck = now.read_s - now.same_since_s > _SAME_S
    return is_silent or is_stuck or not math.isfinite(v[0] + v[1] + v[2] + v[3])


@inlined
def failed_for(failed_s, fails, interval_s):
    """How long a test has failed [s], after one more reading."""
    interval_s = min(interval_s, _LONGEST_S)
    if fails:
        return min(failed_s + interval_s, 2.0 * _FAILED_S)
    return max(failed_s - _PASSED * interval_s, 0.0)


@internal
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
        turn = scale(0.5 * interval_s, add(omega, vector_of(now.omega)))
        q = multiply(quaternion_of(now.q), from_rotation_vector(turn))
        put_quaternion(now.q, normalised(q))
    put_vector(now.omega, omega)
    now.gyro_s = gyro.read_s
    return True


@internal
def turns_otherwise(now, cells, v, read_s, sigma, tolerance, gyro_sigma):
    """Whether a direction turns in another way than the gyro says, or stays.

    `tolerance`: difference of the rates [rad/s] that is allowed.
    """
    omega = vector_of(now.omega)
    seen = as_of_now(omega, now.gyro_s - read_s, unit(v))
    seen = as_of_now(scale(-1.0, omega), read_s - now.gyro_s, seen)  # read after the gyro
    none = NO_MEASUREMENT
    m = Measurement(none.z, none.h, none.h_other, none.at, sigma * sigma, 2, seen, _FIXED, 0.0)
    rate = (tolerance + _SCALE * norm(omega)) / _SIGMAS
    variances = (0.0, rate * rate, gyro_sigma * gyro_sigma, 0.0)
    turned = watch(cells, now.gyro_s, m, _NO_TURN, quaternion_of(now.q), variances)
    return turned.stuck or turned.rate_error > 0.0


@internal
def compare_turns(now, sensors, noise, inputs):
    """The gyro's rate against the turn of field and Sun."""
    b, sun = inputs.b_body_t, inputs.sun_body
    field, light = sensors[MAGNETOMETER], sensors[SUN_SENSORS]
    if field.is_new == 1.0 and dot(b, b) > 0.0:
        sigma, tolerance = noise.field_t / norm(b), noise.rate_tolerance + _FIELD_RATE
        fails = turns_otherwise(
            now, now.watched[0], b, field.read_s, sigma, tolerance, noise.rate_rad_s
        )
        now.turn[0] = failed_for(now.turn[0], fails, field.interval_s)
    if dot(sun, sun) == 0.0:
        now.watched[1, :, 0] = -math.inf
    elif light.is_new == 1.0:
        fails = turns_otherwise(
            now, now.watched[1], sun, light.read_s, noise.sun_rad, noise.rate_tolerance,
            noise.rate_rad_s,
        )  # fmt: skip
        now.turn[1] = failed_for(now.turn[1], fails, light.interval_s)


@internal
def compare_with_models(now, sensors, noise, inputs):
    """Field and Sun against the models; what the models do not know does not fail."""
    b, sun, place = inputs.b_body_t, inputs.sun_body, inputs.ephemeris
    field, light = sensors[MAGNETOMETER], sensors[SUN_SENSORS]
    if field.is_new == 1.0 and math.isfinite(place.b_inertial_t[0]):
        odd = not has_magnitude(b, place.b_inertial_t, noise.field_t)
        now.magnitude = failed_for(now.magnitude, odd, field.interval_s)
    if light.is_new == 1.0:
        seen = place.sunlit_fraction == 0.0 and dot(sun, sun) > 0.0
        now.umbra = failed_for(now.umbra, seen, light.interval_s)
    at_s, new = both_read_s(inputs, now.angle_s), field.is_new * light.is_new == 1.0
    if new and at_s > -math.inf and dot(sun, sun) > 0.0 and dot(b, b) > 0.0:
        variance = noise.sun_rad * noise.sun_rad + noise.field_t * noise.field_t / dot(b, b)
        fails = contradict(b, sun, field_at(inputs, at_s), place.sun_inertial, variance)
        now.angle = failed_for(now.angle, fails, at_s - now.angle_s)
        now.angle_s = at_s


@inlined
def contradict_models(now):
    """Whether field or Sun is not where the models have it, by magnitude or angle."""
    return now.angle >= _FAILED_S or now.magnitude >= _FAILED_S


@internal
def blamed(now, sensors, t_s):
    """(Magnetometer, gyro, Sun sensors): whether each is to blame for what does not agree.

    A contradiction with a sensor that fails by itself says nothing about the others. A wrong sign
    does not change how a direction turns: that of the field shows in what the coils do.
    """
    no_field = sensors[MAGNETOMETER].failed_s == t_s or now.magnitude >= _FAILED_S
    no_sun = sensors[SUN_SENSORS].failed_s == t_s or now.umbra >= _FAILED_S
    by_field = not no_field and now.turn[0] >= _FAILED_S
    by_sun = not no_sun and now.turn[1] >= _FAILED_S
    field, gyro, sun = now.magnitude >= _FAILED_S, False, now.umbra >= _FAILED_S
    if t_s - now.liar_s > _TRUSTED_S:
        now.liar = 0.0
    if not no_field and not no_sun and now.angle >= _FAILED_S:
        now.liar, now.liar_s = liar_of(now, by_field, by_sun), t_s
        field, sun = field or now.liar > 0.0, sun or now.liar < 0.0
    elif by_field or by_sun:
        gyro = True
    return field, gyro, sun


@internal
def liar_of(now, by_field, by_sun):
    """Whose direction is wrong where field and Sun contradict each other: see `SENSORS_NOW`.

    The one that does not turn as the gyro says, now or earlier; where neither was found to, a sign
    is wrong: the field's if the coils work against the command, else that of the Sun sensors.
    """
    if by_field != by_sun:
        return 2.0 if by_field else -2.0
    known = has_field_reversed(now)
    is_known = abs(now.liar) == 2.0 or (now.liar != 0.0 and known == 0.0)
    if is_known or now.angle < 2.0 * _FAILED_S:
        return now.liar
    return 1.0 if known > 0.0 else -1.0


@internal
def are_sound(now, sensors, t_s):
    """Whether gyro and magnetometer may be believed, but for the sign of the field."""
    field, gyro = sensors[MAGNETOMETER], sensors[GYRO]
    failed_s = max(field.failed_s, gyro.failed_s, gyro.blamed_s)
    agree = now.turn[0] == 0.0 and now.turn[1] == 0.0 and now.magnitude < _FAILED_S
    return agree and t_s - failed_s > _UNSURE_S


@internal
def forget_turns(now):
    """Begin the comparison with the gyro's rate again once it is known again."""
    now.turn[0] = now.turn[1] = 0.0


@inner
def check_sensors(table, state, inputs):
    """Bring all suspicions up to date, once per control step, before the modes are switched."""
    now, sensors, noise = state.checks[0], state.sensors, table.noise
    if now.first_s == -math.inf:
        now.first_s = inputs.t_s
    for i in range(len(sensors)):
        if fails_by_itself(sensors[i], i, inputs, now.first_s):
            sensors[i].failed_s = inputs.t_s
    if follow_gyro(now, sensors[GYRO], inputs):
        compare_turns(now, sensors, noise, inputs)
    else:
        forget_turns(now)
    compare_with_models(now, sensors, noise, inputs)
    field, gyro, sun = blamed(now, sensors, inputs.t_s)
    for i, is_blamed in ((MAGNETOMETER, field), (GYRO, gyro), (SUN_SENSORS, sun)):
        if is_blamed:
            sensors[i].blamed_s = inputs.t_s
    if gyro or sensors[MAGNETOMETER].failed_s == inputs.t_s or not now.gyro_s > -math.inf:
        forget_coils(now)
    follow_coils(table, now, inputs, are_sound(now, sensors, inputs.t_s))
