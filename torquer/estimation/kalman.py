"""What the Kalman filters share: one step with its start, gate and restart; their spec.

The filters are multiplicative: a quaternion is estimated, and a small rotation from it, which is
put back into the quaternion after every measurement. E. Lefferts, F. Markley, M. Shuster, 'Kalman
filtering for spacecraft attitude estimation' (1982).
"""

import math
from collections.abc import Callable
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from torquer.compile.engine import inlined, plugged
from torquer.estimation.covariance import (
    ATTITUDE,
    States,
    forget,
    make_uncertain,
    put_uncorrelated,
    turn_attitude,
    update,
    variance_of,
)
from torquer.estimation.estimator import Estimator
from torquer.estimation.measurements.magnetometer import (
    MAGNETOMETER,
    has_field_magnitude,
    magnetometer,
)
from torquer.estimation.measurements.measurement import Sensing, as_of_now, is_usable
from torquer.estimation.measurements.sun_sensors import SUN_SENSORS, sun_sensors
from torquer.estimation.state_names import axes_of
from torquer.estimation.triad import (
    CONTRADICTION_RAD,
    LEAST_SINE,
    by_two,
    contradict,
    field_at,
    put_quaternion,
    quaternion_of,
    sine_between,
)
from torquer.estimation.watch import CELLS, GROWN_S, follow, watch
from torquer.geometry.quaternion import from_rotation_vector, multiply, normalised, rotate
from torquer.geometry.vec3 import cross, dot, put_vector, unit
from torquer.interface import UNKNOWN_ESTIMATE, Estimate
from torquer.spec import Spec

#: Variance [rad^2] of an attitude of which nothing is known, in a linear filter.
UNINFORMED = math.pi * math.pi / 3.0
#: Variance before the readings of a start, over that of TRIAD: the readings count twice, which
#: makes the covariance too small by one part in this number.
_WIDER = 1000.0
NOTHING = (math.nan, math.nan, math.nan)
#: Key of each sensor's noise, in the order of the sensors' numbers.
NOISE_KEYS = {"magnetometer": "magnetometer_noise_nt", "sun": "sun_noise_deg"}
SENSORS = len(NOISE_KEYS)
#: First row of the error of the rate: of the gyro, or of the filter's own rate.
RATE_ERROR = 3
#: Number of rejected readings in a row from which on something is wrong; by chance it is not.
_FEW = 3.0
#: Doubts of the motion less than this time [s] apart are one.
_APART_S = 10.0
#: The unrest of the rate (spectral density of its random walk, rad^2/s^3) is measured in this time
#: [s], and over below this value.
_CALM_S, _AT_REST = 150.0, 1e-11
#: Variance [rad^2] of an attitude that may be wrong altogether, as from the field alone.
_ANY_ATTITUDE = 1.0
#: What a sensor is to the filter: used, or isolated because its readings do not turn with the body,
#: cannot be (a field of another magnitude, the Sun in the umbra), contradict those of others.
USED, STUCK, ODD, CONTRADICTS = 0.0, 1.0, 2.0, 3.0
#: Why a filter has not started, as it logs it.
NOT_STARTED = (
    "it has started",
    "no reading of the gyro",
    "no usable reading of the magnetometer",
    "no usable reading of the Sun sensors",
    "field and Sun are parallel",
    "the angle between field and Sun is not that of the models",
    "TRIAD is less accurate than lost_sigma_deg",
    "without a magnetometer it must be handed an attitude by another estimator",
)
STARTED, NO_RATE, NO_FIELD, NO_SUN, PARALLEL, CONTRADICTORY, INACCURATE, ONE_SENSOR = map(
    float, range(len(NOT_STARTED))
)


@plugged
def step(inputs, parameters, memory, begin, propagate, rate_of):
    """Estimate of a filter: propagated to now, then updated by new readings of the sensors.

    What differs between filters: `propagate(inputs, parameters, memory, dt)`; `rate_of`, of the
    same arguments: (rate, bias of the gyro, mean variance of the rate); `begin`: see `start`.
    """
    if not has_attitude(inputs, parameters, memory, begin, rate_of):
        return UNKNOWN_ESTIMATE
    dt = inputs.t_s - memory.t_s
    advance(inputs, parameters, memory, dt, propagate, rate_of)
    return stated(inputs, parameters, memory, dt, rate_of)


@plugged
def advance(inputs, parameters, memory, dt, propagate, rate_of):
    """Propagate a filter to now, dt seconds, and take the readings."""
    before = quaternion_of(memory.q)
    propagate(inputs, parameters, memory, dt)
    follow(memory.rotation, before, quaternion_of(memory.q))
    memory.t_s = inputs.t_s
    widen(memory, dt)
    omega, _, variance = rate_of(inputs, parameters, memory, dt)
    walk = dt * (variance - variance_of(memory.covariance, RATE_ERROR))
    take_readings(inputs, parameters, memory, omega, walk, True)


@plugged
def stated(inputs, parameters, memory, dt, rate_of):
    """What the filter states dt seconds after its last step."""
    omega, bias, variance = rate_of(inputs, parameters, memory, dt)
    sigma = math.sqrt(variance_of(memory.covariance, ATTITUDE))
    return Estimate(memory.t_s, quaternion_of(memory.q), omega, bias, sigma, math.sqrt(variance))


@inlined
def widen(memory, dt):
    """Allow for a motion that is not the body's: see `torquer.estimation.watch`."""
    p, variance = memory.covariance, memory.rate_error * memory.rate_error
    if variance > 0.0:
        for i in range(3):
            p[i, i] += variance * GROWN_S * GROWN_S
            k = RATE_ERROR + i
            p[k, k] = max(p[k, k], variance)
    if memory.unrest > 0.0:
        for i in range(RATE_ERROR, RATE_ERROR + 3):
            p[i, i] += memory.unrest * dt
        # in a consistent filter the corrections are as large as what the random walk adds
        found = memory.rate_corrected / (3.0 * dt) if dt > 0.0 else memory.unrest
        memory.unrest += min(dt / _CALM_S, 1.0) * (found - memory.unrest)
        if memory.unrest < _AT_REST:
            memory.unrest = 0.0
    memory.rate_corrected = 0.0


@inlined
def doubt_motion(memory, rate_error):
    """The propagated rate is wrong by so much [rad/s]: now, and again and again if so before.

    From the third time on the rate is a random walk of the size that explains them.
    """
    t_s, doubted_s = memory.t_s, memory.doubted_s
    memory.rate_error = rate_error
    if t_s - doubted_s[1] > _APART_S:
        memory.unrest = max(memory.unrest, rate_error * rate_error / (t_s - doubted_s[0]))
        doubted_s[0], doubted_s[1] = doubted_s[1], t_s


@inlined
def take_readings(inputs, parameters, memory, omega, walk, judged):
    """Update by each sensor that has been read since; the body turns with omega.

    `walk`: growth of the variance of the propagated rotation by white noise [rad^2/s]; `judged`:
    whether the sensors and the motion are tested, too.
    """
    at = inputs.read_at
    for sensor in range(SENSORS):
        if sensor == MAGNETOMETER:
            m = magnetometer(inputs, parameters, memory, omega)
            read_s, innovation = at.magnetometer_s, memory.innovation_magnetometer
        else:
            m = sun_sensors(inputs, parameters, memory, omega)
            read_s, innovation = at.sun_sensors_s, memory.innovation_sun
        put_vector(innovation, NOTHING)
        if m.count > 0:
            memory.read_s[sensor] = read_s
            if judged:
                judge(inputs, parameters, memory, m, sensor, walk)
            take(parameters.sensing, memory, m, sensor, innovation)


@inlined
def judge(inputs, parameters, memory, m, sensor, walk):
    """Whether the sensor seems to be sound, and the motion; tests that need no attitude.

    The motion is in doubt where a sensor that is not stuck turns in another way while its readings
    are being rejected; not if it turns by so much that others' readings would be rejected, too.
    """
    q, rotation = quaternion_of(memory.q), quaternion_of(memory.rotation)
    p, now = memory.covariance, memory.t_s
    attitude, rate = variance_of(p, ATTITUDE), variance_of(p, RATE_ERROR)
    doubted = attitude if parameters.sensing.r_sun > 0.0 else _ANY_ATTITUDE
    variances = (attitude, rate, walk, doubted)
    turned = watch(memory.watched[sensor], now, m, q, rotation, variances)
    odd, most = inputs.ephemeris.sunlit_fraction == 0.0, parameters.sensing.most_refused
    if sensor == MAGNETOMETER:
        odd = not has_field_magnitude(parameters, m.read, m.reference)
    status = status_of(memory.isolated[sensor], turned, odd, memory.rejected_in_a_row[sensor], most)
    if turned.moves:
        memory.missed[sensor] = turned.rate_error
    if status == USED and turned.moves:
        if turned.rate_error == 0.0:
            memory.rate_error = 0.0
        elif is_to_blame(inputs, parameters.sensing, memory, sensor, turned.rate_error):
            doubt_motion(memory, turned.rate_error)
    if status != memory.isolated[sensor]:
        memory.isolated[sensor] = status
        memory.rejected_in_a_row[sensor] = 0.0


@inlined
def is_to_blame(inputs, sensing, memory, sensor, rate_error):
    """Whether the motion is wrong by so much [rad/s], or the sensor that shows it.

    The readings are being rejected; an error that others would notice, too, they do notice.
    """
    if memory.rejected_in_a_row[sensor] < _FEW:
        return False
    b = inputs.ephemeris.b_inertial_t
    noticed = CONTRADICTION_RAD + 6.0 * math.sqrt(sensing.r_sun + sensing.r_field / dot(b, b))
    large = rate_error * GROWN_S > noticed
    return not (large and others_agree(inputs, sensing, memory, sensor))


@inlined
def status_of(status, turned, odd, in_a_row, most):
    """What a sensor is to the filter after a reading that is odd or not.

    A sensor is stuck until its readings move; so is one that has been odd for `most` readings.
    """
    if status == STUCK or turned.stuck:
        return USED if turned.moves and not odd else STUCK
    if odd:
        return ODD
    if status == ODD:
        return STUCK if in_a_row >= most and not turned.moves else USED
    return status


@inlined
def take(sensing, memory, m, sensor, innovation):
    """Update by a sensor's measurement, and correct the states, unless it is rejected.

    `innovation`: cells for the whitened innovation. A sensor that is isolated because it
    contradicts the others is still compared with the filter, and used again once it agrees.
    """
    row, status = memory.rejected_in_a_row, memory.isolated[sensor]
    if status in (STUCK, ODD):
        memory.refused += 1.0
        row[sensor] += 1.0
        return
    gate = sensing.gate_3 if m.count == 3 else sensing.gate_2
    used = gate if status == USED else -1.0
    nis, accepted, e = update(memory.covariance, memory.gain, memory.correction, m, used)
    put_vector(innovation, (e[0], e[1], e[2] if m.count == 3 else math.nan))
    if accepted:
        row[sensor] = 0.0
        put_back(memory)
        return
    memory.refused += 1.0
    row[sensor] = min(row[sensor], 0.0) - 1.0 if nis <= gate else max(row[sensor], 0.0) + 1.0
    if row[sensor] <= -sensing.most_refused:
        memory.isolated[sensor] = USED
        row[sensor] = 0.0


@inlined
def put_back(memory):
    """Move the change of the states into quaternion and states; refer the error to the new axes."""
    c = memory.correction
    turn = from_rotation_vector((c[0], c[1], c[2]))
    turn_attitude(memory.covariance, turn)
    put_quaternion(memory.q, normalised(multiply(quaternion_of(memory.q), turn)))
    for i in range(3, c.shape[0]):
        memory.states[i - 3] += c[i]
    for i in range(RATE_ERROR, RATE_ERROR + 3):
        memory.rate_corrected += c[i] * c[i]


@plugged
def has_attitude(inputs, parameters, memory, begin, rate_of):
    """Whether the filter has an attitude: its own, or one from a start or restart in this step."""
    sensing = parameters.sensing
    must = must_begin(inputs, sensing, memory)
    rejected = rejected_sensor(sensing, memory)
    lost = 3.0 * variance_of(memory.covariance, ATTITUDE) > sensing.lost
    if must or rejected >= 0 or lost:
        return find_attitude(inputs, parameters, memory, must, rejected, begin, rate_of)
    return True


@inlined
def rejected_sensor(sensing, memory):
    """A sensor whose readings have been rejected all the time; -1 for none."""
    found = -1
    for sensor in range(SENSORS):
        tested = memory.isolated[sensor] in (USED, CONTRADICTS)
        if tested and memory.rejected_in_a_row[sensor] >= sensing.most_refused:
            found = sensor
    return found


@inlined
def must_begin(inputs, sensing, memory):
    """Whether the filter must start: at first, after a long gap, or where others know better.

    It was away if the last estimate is not its own.
    """
    e, own = inputs.estimate, variance_of(memory.covariance, ATTITUDE)
    away = e.t_s != memory.t_s
    gap = inputs.t_s - memory.t_s > sensing.gap
    better = e.t_s > memory.t_s and e.sigma_rad * e.sigma_rad < own
    return memory.starts == 0.0 or (away and (gap or better))


@plugged
def find_attitude(inputs, parameters, memory, must, rejected, begin, rate_of):
    """Start the filter, or start it again; whether it has an attitude then.

    `must`: it has none; `rejected`: sensor that seems to be sound and whose readings are rejected,
    or -1; otherwise the attitude is too uncertain, and the other states stay as they are known.
    `begin(inputs, parameters, memory, taken_over, idle_s, afresh)` completes the start of a filter.
    `taken_over`: the attitude is that of another estimator; `idle_s`: time for which states that
    are kept have not been propagated; `afresh`: they are forgotten.
    """
    idle_since_s, first = memory.t_s, memory.starts == 0.0
    omega, _, variance = rate_of(inputs, parameters, memory, 0.0)
    taken_over = must and variance < math.inf and takes_over(inputs, parameters.sensing, memory)
    memory.not_started = NO_RATE if not variance < math.inf else STARTED
    if not taken_over and variance < math.inf:
        memory.not_started = start_by_triad(inputs, parameters, memory, omega)
        if memory.not_started != STARTED and (must or rejected >= 0):
            use_one_direction(inputs, parameters, memory, must, rejected, omega)
    started = memory.not_started == STARTED
    memory.not_started = memory.not_started if must else STARTED
    if started and (must or rejected >= 0):
        afresh = first or not must
        if afresh:
            forget(parameters.prior, memory.states, memory.covariance)
        if not must and memory.missed[rejected] > 0.0:
            doubt_motion(memory, memory.missed[rejected])
        idle_s = 0.0 if afresh else memory.t_s - idle_since_s
        begin(inputs, parameters, memory, taken_over, idle_s, not must)
    return started or not must


@inlined
def use_one_direction(inputs, parameters, memory, must, rejected, omega):
    """What a single direction allows.

    A filter without Sun sensors starts by the field. A sensor whose readings are rejected while
    others agree with the filter is isolated. Otherwise the filter must be wrong: its attitude is
    turned to fit the rejected sensor's reading, and is as uncertain as before the first one; so are
    the other states, which keep their values.
    """
    alone = must and parameters.sensing.r_sun == 0.0
    if not must and others_agree(inputs, parameters.sensing, memory, rejected):
        memory.isolated[rejected] = CONTRADICTS
        memory.rejected_in_a_row[rejected] = 0.0
    elif alone or not must:
        sensor = MAGNETOMETER if must else rejected
        fits = start_by_direction(inputs, parameters, memory, sensor, omega)
        if fits and must:
            memory.not_started = STARTED
        elif fits:
            make_uncertain(parameters.prior, memory.covariance)
        else:
            memory.rejected_in_a_row[:] = 0.0


@inlined
def others_agree(inputs, sensing, memory, sensor):
    """Whether the readings of another sensor have been accepted of late and turn as propagated."""
    agree = False
    for k in range(SENSORS):
        recent = inputs.t_s - memory.read_s[k] <= sensing.gap
        accepted = memory.isolated[k] == USED and memory.rejected_in_a_row[k] == 0.0
        turns = memory.missed[k] == 0.0
        agree = agree or (k != sensor and recent and accepted and turns)
    return agree


@inlined
def start_by_triad(inputs, parameters, memory, omega):
    """Attitude by TRIAD from the latest readings; STARTED, or why there is none.

    Readings of different times are turned to that of the later one, with omega; the uncertainty of
    the rate before the first estimate counts. The filter then takes the same readings, from a
    covariance so wide that they count once: thus its own covariance is right with a magnetometer
    bias, too. The more accurate direction comes first. The time of the filter becomes that of the
    later reading.
    """
    sensing, prior, at = parameters.sensing, parameters.prior, inputs.read_at
    field_s, sun_s, b, sun = at.magnetometer_s, at.sun_sensors_s, inputs.b_body_t, inputs.sun_body
    if min(sensing.r_field, sensing.r_sun) == 0.0:
        return ONE_SENSOR
    if memory.isolated[MAGNETOMETER] != USED and memory.isolated[MAGNETOMETER] != CONTRADICTS:
        return NO_FIELD
    if memory.isolated[SUN_SENSORS] != USED and memory.isolated[SUN_SENSORS] != CONTRADICTS:
        return NO_SUN
    if not is_usable(sensing.r_field, b, inputs.t_s - field_s, sensing.gap):
        return NO_FIELD
    if not is_usable(sensing.r_sun, sun, inputs.t_s - sun_s, sensing.gap):
        return NO_SUN
    later_s, apart = max(field_s, sun_s), field_s - sun_s
    b, sun = as_of_now(omega, -apart, b), as_of_now(omega, apart, sun)
    if not sine_between(b, sun) > LEAST_SINE:
        return PARALLEL
    b_inertial, sun_inertial = field_at(inputs, field_s), inputs.ephemeris.sun_inertial
    carried = (prior.gyro_bias + prior.rate) * apart * apart
    r = (sensing.r_field + prior.magnetometer_bias) / dot(b, b) + (carried if apart < 0.0 else 0.0)
    s = sensing.r_sun + (carried if apart > 0.0 else 0.0)
    if contradict(b, sun, b_inertial, sun_inertial, r + s):
        return CONTRADICTORY
    q, total = by_two(b, sun, b_inertial, sun_inertial, r, s, s <= r)
    if not total <= sensing.lost:
        return INACCURATE
    memory.read_s[:] = -math.inf
    put_attitude(memory, later_s, q, min(_WIDER * total, UNINFORMED))
    return STARTED


@inlined
def start_by_direction(inputs, parameters, memory, sensor, omega):
    """Attitude that fits a sensor's latest reading; whether there is one.

    It is the smallest rotation from the attitude that the filter has, or from the inertial axes.
    The remaining angle is found as the field turns along the orbit: see `hypotheses`. (The Sun's
    direction does not turn: from it alone that angle is never found.)
    """
    sensing, at, q = parameters.sensing, inputs.read_at, (0.0, 0.0, 0.0, 1.0)
    v, reference, read_s, r = inputs.sun_body, inputs.ephemeris.sun_inertial, 0.0, sensing.r_sun
    read_s = at.sun_sensors_s
    if sensor == MAGNETOMETER:
        read_s, r = at.magnetometer_s, sensing.r_field
        v, reference = inputs.b_body_t, field_at(inputs, read_s)
    if not is_usable(r, v, inputs.t_s - read_s, sensing.gap):
        return False
    if memory.starts > 0.0:
        q = quaternion_of(memory.q)
        read_s, v = inputs.t_s, as_of_now(omega, inputs.t_s - read_s, v)
    memory.read_s[:] = -math.inf
    put_attitude(memory, read_s, fitted(q, v, reference), parameters.prior.attitude)
    return True


@inlined
def fitted(q, v, reference):
    """The attitude next to q that gives a vector v (body) the direction of a reference (inertial).

    The quaternion takes the body into the inertial frame.
    """
    seen, wanted = unit(rotate(q, v)), unit(reference)
    cosine = dot(seen, wanted)
    x, y, z = cross(seen, wanted)
    turn = normalised((x, y, z, 1.0 + cosine))
    if cosine < -0.999999:  # half a turn about any axis across
        x, y, z = unit(cross(seen, (1.0, 0.0, 0.0) if abs(seen[0]) < 0.8 else (0.0, 1.0, 0.0)))
        turn = (x, y, z, 0.0)
    return normalised(multiply(turn, q))


@inlined
def takes_over(inputs, sensing, memory):
    """Take over an attitude of another estimator; whether there is one that is not too old."""
    e = inputs.estimate
    age = inputs.t_s - e.t_s
    if not (e.t_s > memory.t_s and age <= sensing.gap and e.sigma_rad >= 0.0):
        return False
    if not math.isfinite(e.q_body_to_inertial[0] + e.omega_body_rad_s[0]):
        return False
    # no variance exceeds the sum of all three, however unlike they are
    put_attitude(memory, e.t_s, e.q_body_to_inertial, 3.0 * e.sigma_rad * e.sigma_rad)
    memory.read_s[:] = e.t_s
    return True


@inlined
def put_attitude(memory, t_s, q, variance):
    """Start from an attitude of this variance about each axis; no reading is rejected so far."""
    if not t_s >= memory.t_s:
        for sensor in range(SENSORS):
            memory.watched[sensor, 0, 0] = -math.inf
    memory.t_s = t_s
    memory.starts += 1.0
    memory.rejected_in_a_row[:] = 0.0
    put_quaternion(memory.q, q)
    put_uncorrelated(memory.covariance, ATTITUDE, variance)


def memory_of(n: int) -> dict:
    """Memory of a filter of n states that has not started; `states`: those beyond the attitude."""
    row = (0.0,) * n
    return {
        "t_s": -math.inf,
        "read_s": (-math.inf,) * SENSORS,
        "q": (math.nan, *NOTHING),
        "states": row[3:],
        "covariance": (row,) * n,
        "gain": (row,) * 3,
        "correction": row,
        "innovation_magnetometer": NOTHING,
        "innovation_sun": NOTHING,
        "watched": (((-math.inf,) * CELLS,) * 2,) * SENSORS,
        "rotation": (0.0, 0.0, 0.0, 1.0),
        "missed": (0.0,) * SENSORS,
        "rate_error": 0.0,
        "doubted_s": (-math.inf, -math.inf),
        "unrest": 0.0,
        "rate_corrected": 0.0,
        "rejected_in_a_row": (0.0,) * SENSORS,
        "isolated": (0.0,) * SENSORS,
        "refused": 0.0,
        "starts": 0.0,
        "not_started": 0.0,
    }


#: What filters log.
LOG = dict.fromkeys(
    ("innovation_magnetometer", "innovation_sun", "refused", "starts", "isolated", "not_started"),
    "1",
)


def keys_of(spec: type[Spec]) -> str:
    """A spec's docstring after its first line, to be appended to those of its kinds."""
    return "\n\n" + (spec.__doc__ or "").partition("\n\n")[2]


class Filter(Spec):
    """A Kalman filter; noise as the filter believes it.

    The filter starts by TRIAD from the latest readings, unless their angle is not that of the
    models, and again where the standard deviation of the attitude, that of all axes together,
    exceeds `lost_sigma_deg`. Without Sun sensors it starts with several hypotheses about the turn
    around the field, and states their spread until they agree; without a magnetometer it must be
    handed an attitude. Where other estimators have worked before it, in other modes, it takes over
    an attitude that is not older than `longest_gap_s` and better than its own; after a longer gap
    it starts again.

    Sensors and motion are watched. A sensor is isolated while its readings stay though the body
    turns, while its field is not as large as that of the model, or while it sees the Sun in the
    umbra. Where readings turn otherwise than the propagated motion, the rate becomes uncertain.
    After `most_refused` readings of a sensor rejected one after another the filter starts again by
    TRIAD, or isolates the sensor if others agree with the filter, or turns its attitude to fit the
    readings and states that it does not know it.
    """

    gives: ClassVar = frozenset({"attitude", "rate"})
    #: The kernel, and what it remembers beyond `memory_of`.
    kernel: ClassVar[Callable]
    remembers: ClassVar[dict] = {}
    #: The kernel for the magnetometer alone, and what makes its further memory for n states.
    by_field: ClassVar[tuple[Callable, Callable[[int], dict]]]
    sensors: tuple[Literal["magnetometer", "sun"], ...] = ("magnetometer", "sun")
    """Sensors that the filter uses."""
    magnetometer_noise_nt: Annotated[float, Field(gt=0.0)] | None = None
    """Standard deviation of each component of a magnetometer reading, errors of the field model
    included; given if the filter uses the magnetometer.
    """
    sun_noise_deg: Annotated[float, Field(gt=0.0, le=180.0)] | None = None
    """Standard deviation of each component of a Sun reading; given if the filter uses Sun sensors.
    """
    magnetometer_bias_sigma_nt: Annotated[float, Field(gt=0.0)] | None = None
    """Estimate the magnetometer's bias, too, with this standard deviation about zero at the start;
    left out: no bias.
    """
    gate: float = Field(default=1e-5, gt=0.0, lt=1.0)
    """Probability of rejecting a reading although filter and reading are sound."""
    lost_sigma_deg: float = Field(default=30.0, gt=0.0, le=180.0)
    """Standard deviation of the attitude, of all axes together, above which the filter starts
    again.
    """
    most_refused: int = Field(default=30, ge=1)
    """Number of readings of a sensor rejected one after another, after which the filter starts
    again or isolates the sensor.
    """
    longest_gap_s: float = Field(default=10.0, gt=0.0)
    """Age up to which the filter takes over another estimator's attitude, or its own after a pause.
    """
    record_covariance: bool = False
    """Record the states beyond the attitude, and the covariance matrix of all errors."""

    @model_validator(mode="after")
    def _noise_of_each_sensor(self):
        if not self.sensors or len(set(self.sensors)) < len(self.sensors):
            raise ValueError(
                f"sensors: must name one or two different sensors; received {list(self.sensors)}"
            )
        for sensor, key in NOISE_KEYS.items():
            value = getattr(self, key)
            if (value is None) == (sensor in self.sensors):
                must = "given" if value is None else "left out"
                received = "none" if value is None else f"{value:g}"
                raise ValueError(
                    f"{key}: must be {must} with sensors = {list(self.sensors)}; "
                    f"received {received}"
                )
        if self.magnetometer_bias_sigma_nt is not None and "magnetometer" not in self.sensors:
            raise ValueError(
                "magnetometer_bias_sigma_nt: must be left out without the magnetometer among the "
                f"sensors; received {self.magnetometer_bias_sigma_nt:g}"
            )
        return self

    def prior(self, **others: float) -> States:
        """Variances of the states at the start; `others`: of those that filters do not share."""
        bias_t = 1e-9 * (self.magnetometer_bias_sigma_nt or 0.0)
        return States(UNINFORMED, magnetometer_bias=bias_t**2, **others)

    def sensing(self) -> Sensing:
        """Noise of the sensors and limits of the filter for the kernels."""
        from scipy.special import chdtri  # a third of a second of importing

        return Sensing(
            (1e-9 * (self.magnetometer_noise_nt or 0.0)) ** 2,
            math.radians(self.sun_noise_deg or 0.0) ** 2,
            float(chdtri(2, self.gate)),
            float(chdtri(3, self.gate)),
            math.radians(self.lost_sigma_deg) ** 2,
            float(self.most_refused),
            self.longest_gap_s,
        )

    def constants(self) -> Any:
        """Parameters for the kernel: `prior`, `sensing` and those of the filter's motion."""
        raise NotImplementedError

    def initial_variances(self) -> dict[str, float]:
        """Variance of each component of the filter's states at the start, by the states' names."""
        return {name: v for name, v in self.constants().prior._asdict().items() if v > 0.0}

    def estimator(self) -> Estimator:
        """The filter, not yet started."""
        cls, parameters = type(self), self.constants()
        n, kernel = 3 * len(self.initial_variances()), cls.kernel
        memory = memory_of(n) | cls.remembers
        if self.starts_by_field:
            kernel, more = cls.by_field
            # first: a record that begins as another does is a kind of it to Numba, which warns
            memory = more(n) | memory
        return Estimator(self.kind, kernel, parameters, memory, self.logs(), self.needs, spec=self)

    @property
    def starts_by_field(self) -> bool:
        """Whether the filter has the magnetometer alone: it starts with several hypotheses."""
        return self.sensors == ("magnetometer",)

    @property
    def needs(self) -> frozenset[str]:
        """Ephemeris, and the Sun sensors where they are used."""
        return frozenset({"ephemeris", *({"sun"} & set(self.sensors))})

    def logs(self) -> dict:
        """What is logged: names in the memory, units or axes."""
        by_field = {"hypotheses": "1"} if self.starts_by_field else {}
        covariance = axes_of(self.initial_variances()) if self.record_covariance else {}
        return LOG | by_field | covariance
