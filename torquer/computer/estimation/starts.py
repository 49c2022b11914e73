"""How Kalman filters find an attitude: at first, after a gap, when theirs is wrong or lost."""

import math

from torquer.compile.engine import inlined, plugged
from torquer.computer.estimation.channels import count_channels, is_field_alone, read_direction
from torquer.computer.estimation.covariance import (
    ATTITUDE,
    forget,
    make_uncertain,
    mean_variance,
    put_uncorrelated,
)
from torquer.computer.estimation.isolation import (
    directions_in_agreement,
    doubt_motion,
    is_broken,
    others_agree,
)
from torquer.computer.estimation.isolation_states import CONTRADICTS, USED
from torquer.computer.estimation.measurements.measurement import turn_to_now
from torquer.computer.estimation.measurements.star_tracker import PAST, is_attitude
from torquer.computer.estimation.measurements.table import (
    BY_NAME,
    CHANNELS,
    FIELD_CHANNEL,
    FIRST_CELL,
    STAR_CHANNEL,
)
from torquer.computer.estimation.triad import (
    CONTRADICTION_RAD,
    LEAST_SINE,
    by_two,
    contradict,
    sine_between,
)
from torquer.computer.informed import is_known
from torquer.maths.geometry.quaternion import (
    multiply,
    normalise,
    put_quaternion,
    read_quaternion,
    rotate,
)
from torquer.maths.geometry.vec3 import cross, dot, norm, scale, unit

#: Variance [rad^2] of an attitude of which nothing is known, in a linear filter.
UNINFORMED = math.pi * math.pi / 3.0
#: Variance above which a filter has no attitude: a start leaves at most UNINFORMED, and linear
#: propagation and corrections of more are meaningless.
_NOTHING_KNOWN = 2.0 * UNINFORMED
#: Variance before the readings of a start, over that of TRIAD: the readings count twice, which
#: makes the covariance too small by one part in this number.
_WIDER = 1000.0
#: Why a filter has not started, as it logs it.
_REASONS = (
    "it has started",
    "no reading of the gyro",
    "no usable reading of the magnetometer",
    "no usable reading of the Sun sensors",
    "the directions read are parallel",
    "the angle between two directions is not that of the models",
    "TRIAD is less accurate than lost_sigma_deg",
    "it needs a second sensor, or an attitude from another estimator",
    "no usable reading of the star tracker",
    "the star tracker contradicts a direction",
)
NOT_STARTED = (
    *_REASONS,
    *(each.missing for each in BY_NAME.values() if each.missing not in _REASONS),
)
STARTED, NO_RATE, NO_FIELD, NO_SUN, PARALLEL, CONTRADICTORY, INACCURATE, ONE_SENSOR = map(
    float, range(8)
)
NO_STARS, OTHER_STARS = 8.0, 9.0
#: The reason for each channel that has no usable reading.
_NOT_READ = tuple(
    float(NOT_STARTED.index(each.missing))
    for each in BY_NAME.values()
    for _ in range(each.channels)
)


@plugged
def has_attitude(inputs, parameters, memory, begin, rate_of):
    """Whether the filter has an attitude: its own, or one from a start or restart in this step."""
    sensing = parameters.sensing
    if not (mean_variance(memory.covariance, ATTITUDE) <= _NOTHING_KNOWN and is_whole(memory)):
        forget_all(parameters.prior, memory)
    must = must_begin(inputs, sensing, memory)
    rejected = rejected_sensor(sensing, memory)
    lost = 3.0 * mean_variance(memory.covariance, ATTITUDE) > sensing.lost
    if must or rejected >= 0 or lost:
        return find_attitude(inputs, parameters, memory, must, rejected, begin, rate_of)
    return True


@inlined
def is_whole(memory):
    """Whether attitude and states of a filter that has started are finite, as they must be."""
    doubt = 0.0
    for k in range(memory.q.shape[0]):
        doubt += 0.0 * memory.q[k]
    for k in range(memory.states.shape[0]):
        doubt += 0.0 * memory.states[k]
    return memory.t_s == -math.inf or doubt == 0.0


@inlined
def forget_all(prior, memory):
    """Nothing is known any more, of no state and no sensor: the filter must start as at first."""
    memory.t_s = -math.inf
    put_uncorrelated(memory.covariance, ATTITUDE, prior.attitude)
    forget(prior, memory.states, memory.covariance)
    memory.isolated[:] = USED
    memory.rejected_in_a_row[:] = 0.0
    memory.missed[:] = 0.0
    memory.rate_error = memory.unrest = memory.rate_corrected = 0.0
    if not is_known(read_quaternion(memory.rotation)):
        put_quaternion(memory.rotation, (0.0, 0.0, 0.0, 1.0))
    forget_readings(memory)


@inlined
def forget_readings(memory):
    """Readings and rotations before now are not compared with later ones."""
    for sensor in range(memory.watched.shape[0]):
        memory.watched[sensor, 0, 0] = -math.inf
    for k in range(PAST):
        memory.past[k, 0] = -math.inf


@inlined
def rejected_sensor(sensing, memory):
    """A sensor whose readings have been rejected all the time; -1 for none."""
    found = -1
    for sensor in range(count_channels(sensing, memory)):
        if (
            not is_broken(memory, sensor)
            and memory.rejected_in_a_row[sensor] >= sensing.most_rejected
        ):
            found = sensor
    return found


@inlined
def must_begin(inputs, sensing, memory):
    """Whether the filter must start: at first, after a long gap, or where others know better.

    It was away if the last estimate is not its own.
    """
    e, own = inputs.estimate, mean_variance(memory.covariance, ATTITUDE)
    away = e.t_s != memory.t_s
    gap = inputs.t_s - memory.t_s > sensing.gap
    better = e.t_s > memory.t_s and e.sigma_rad * e.sigma_rad < own
    return memory.t_s == -math.inf or (away and (gap or better))


@plugged
def find_attitude(inputs, parameters, memory, must, rejected, begin, rate_of):
    """Start the filter, or start it again; whether it has an attitude then.

    `must`: it has none; `rejected`: sensor that seems to be sound and whose readings are rejected,
    or -1; otherwise the attitude is too uncertain, and the other states stay as they are known.
    `begin(inputs, parameters, memory, taken_over, idle_s, afresh)` completes the start of a filter.
    `taken_over`: the attitude is that of another estimator; `idle_s`: time for which states that
    are kept have not been propagated; `afresh`: they are forgotten.
    """
    idle_since_s, first = memory.t_s, memory.t_s == -math.inf
    omega, _, variance, _ = rate_of(inputs, parameters, memory, 0.0)
    taken_over = must and variance < math.inf and takes_over(inputs, parameters.sensing, memory)
    memory.not_started = NO_RATE if not variance < math.inf else STARTED
    if not taken_over and variance < math.inf:
        memory.not_started = start_by_readings(inputs, parameters, memory, rejected, omega)
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

    A filter with the magnetometer alone starts by the field. A sensor whose readings are rejected
    while others agree with the filter is isolated. Otherwise the filter must be wrong: its attitude
    is turned to fit the rejected sensor's reading, and is as uncertain as before the first one; so
    are the other states, which keep their values.
    """
    alone = must and is_field_alone(parameters.sensing)
    if not must and others_agree(inputs, parameters.sensing, memory, rejected):
        memory.isolated[rejected] = CONTRADICTS
        memory.rejected_in_a_row[rejected] = 0.0
    elif alone or not must:
        sensor = FIELD_CHANNEL if must else rejected
        fits = start_by_direction(inputs, parameters, memory, sensor, omega)
        if fits and must:
            memory.not_started = STARTED
        elif fits:
            make_uncertain(parameters.prior, memory.covariance)
        else:
            memory.rejected_in_a_row[:] = 0.0


@inlined
def start_by_readings(inputs, parameters, memory, rejected, omega):
    """Attitude from the latest readings; STARTED, or why there is none.

    Where the other sensors determine the attitude and agree with the filter, the rejected one is
    wrong, and nothing is to be started. `rejected`: see `find_attitude`.
    """
    sensing, found = parameters.sensing, ONE_SENSOR
    if rejected >= 0 and directions_in_agreement(inputs, sensing, memory, rejected) > 1:
        return found
    if sensing.star_tracker.r > 0.0:
        found = start_by_stars(inputs, parameters, memory, rejected, omega)
    if found != STARTED:
        by_two_directions = start_by_triad(inputs, parameters, memory, omega)
        if by_two_directions != ONE_SENSOR:
            found = by_two_directions
    return found


@inlined
def contradicts(q, d, turned):
    """Whether a direction is not where an attitude has it; `turned`: rotation since its reading.

    A misalignment that users leave out does not count, see `CONTRADICTION_RAD`.
    """
    seen = rotate(q, turn_to_now(turned, 1.0, d.v))
    angle = math.atan2(norm(cross(seen, d.reference)), dot(seen, d.reference))
    return angle > CONTRADICTION_RAD + 6.0 * math.sqrt(d.r)


@inlined
def start_by_stars(inputs, parameters, memory, rejected, omega):
    """Attitude from the latest reading of the star tracker; STARTED, or why there is none.

    More directions must not contradict it than agree; that of a rejected sensor must agree.
    """
    sensing, read, at_s = (
        parameters.sensing,
        inputs.q_body_to_inertial,
        inputs.read_at.attitude_sensor_s,
    )
    usable = is_attitude(sensing.star_tracker.r, read, at_s, inputs.t_s - sensing.gap)
    if is_broken(memory, STAR_CHANNEL) or not usable:
        return NO_STARS
    q, contradicting = normalise(read), 0
    for sensor in range(FIRST_CELL + 1):
        d = read_direction(inputs, parameters, memory, sensor)
        if d.is_usable and not is_broken(memory, sensor):
            if not contradicts(q, d, scale(at_s - d.read_s, omega)):
                contradicting -= 1
            else:
                contradicting += CHANNELS if sensor == rejected else 1
    if contradicting > 0:
        return OTHER_STARS
    total = 2.0 * sensing.star_tracker.r + sensing.star_tracker.r_about
    memory.read_s[:] = -math.inf
    put_attitude(memory, at_s, q, min(_WIDER * total, UNINFORMED))
    return STARTED


@inlined
def start_by_triad(inputs, parameters, memory, omega):
    """Attitude by TRIAD from the latest readings; STARTED, or why there is none.

    Two directions are tried after another two, in the order of the sensors' numbers.
    """
    found = ONE_SENSOR
    for first in range(FIRST_CELL + 1):
        for second in range(first + 1, FIRST_CELL + 1):
            if found != STARTED:
                a = read_direction(inputs, parameters, memory, first)
                b = read_direction(inputs, parameters, memory, second)
                if a.is_used and b.is_used:
                    missing = not_read(memory, a, first)
                    if missing == STARTED:
                        missing = not_read(memory, b, second)
                    found = missing
                    if missing == STARTED:
                        once = second == FIRST_CELL
                        found = start_by_two(parameters, memory, a, b, omega, once)
    return found


@inlined
def not_read(memory, d, sensor):
    """Why a sensor has no usable reading; STARTED if it has."""
    if d.is_usable and not is_broken(memory, sensor):
        return STARTED
    return _NOT_READ[sensor]


@inlined
def start_by_two(parameters, memory, one, other, omega, once):
    """Attitude by TRIAD from two directions; STARTED, or why there is none.

    Readings of different times are turned to that of the later one, with omega; the uncertainty of
    the rate before the first estimate counts. The filter then takes the same readings, from a
    covariance so wide that they count once: thus its own covariance is right with a magnetometer
    bias, too; or, `once`, it takes those of TRIAD only, from the covariance of TRIAD: to a filter
    that is so uncertain single Sun cells say nothing. The more accurate direction comes first. The
    time of the filter becomes that of the later reading.
    """
    prior = parameters.prior
    later_s, apart = max(one.read_s, other.read_s), one.read_s - other.read_s
    a, b = turn_to_now(omega, -apart, one.v), turn_to_now(omega, apart, other.v)
    if not sine_between(a, b) > LEAST_SINE:
        return PARALLEL
    mounted = (prior.gyro_scale + prior.gyro_misalignment) * dot(omega, omega)
    carried = (prior.gyro_bias + prior.rate + mounted) * apart * apart
    r = one.r + (carried if apart < 0.0 else 0.0)
    s = other.r + (carried if apart > 0.0 else 0.0)
    if contradict(a, b, one.reference, other.reference, r + s):
        return CONTRADICTORY
    q, total = by_two(a, b, one.reference, other.reference, r, s, s <= r)
    if not total <= parameters.sensing.lost:
        return INACCURATE
    memory.read_s[:] = later_s if once else -math.inf
    put_attitude(memory, later_s, q, total if once else min(_WIDER * total, UNINFORMED))
    return STARTED


@inlined
def start_by_direction(inputs, parameters, memory, sensor, omega):
    """Attitude that fits a sensor's latest reading; whether there is one.

    It is the smallest rotation from the attitude that the filter has, or from the inertial axes.
    The remaining angle is found as the field turns along the orbit: see `hypotheses`. (The Sun's
    direction does not turn: from it alone that angle is never found.)
    """
    d, q = read_direction(inputs, parameters, memory, sensor), (0.0, 0.0, 0.0, 1.0)
    if not d.is_usable:
        return False
    read_s, v = d.read_s, d.v
    if memory.t_s > -math.inf:
        q = read_quaternion(memory.q)
        read_s, v = inputs.t_s, turn_to_now(omega, inputs.t_s - read_s, v)
    memory.read_s[:] = -math.inf
    put_attitude(memory, read_s, fit(q, v, d.reference), parameters.prior.attitude)
    return True


@inlined
def fit(q, v, reference):
    """The attitude next to q that gives a vector v (body) the direction of a reference (inertial).

    The quaternion takes the body into the inertial frame.
    """
    seen, wanted = unit(rotate(q, v)), unit(reference)
    cosine = dot(seen, wanted)
    x, y, z = cross(seen, wanted)
    turn = normalise((x, y, z, 1.0 + cosine))
    if cosine < -0.999999:  # half a turn about any axis across
        x, y, z = unit(cross(seen, (1.0, 0.0, 0.0) if abs(seen[0]) < 0.8 else (0.0, 1.0, 0.0)))
        turn = (x, y, z, 0.0)
    return normalise(multiply(turn, q))


@inlined
def takes_over(inputs, sensing, memory):
    """Take over an attitude of another estimator; whether one is known and not too old."""
    e = inputs.estimate
    age = inputs.t_s - e.t_s
    known = 0.0 <= e.sigma_rad * e.sigma_rad <= UNINFORMED
    if not (e.t_s > memory.t_s and age <= sensing.gap and known):
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
        forget_readings(memory)
    memory.t_s = t_s
    memory.starts += 1.0
    memory.rejected_in_a_row[:] = 0.0
    put_quaternion(memory.q, q)
    put_uncorrelated(memory.covariance, ATTITUDE, variance)
