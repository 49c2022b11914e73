"""Start of a filter by the field alone: hypotheses about what one direction does not reveal.

One reading leaves the turn about the field open. A filter that starts from any of these attitudes
linearises far from the truth, and states an accuracy that it does not have. So there are several
hypotheses, a Gaussian sum: each is propagated and updated as a filter of its own, and weighted by
the likelihood of the readings. One that becomes too wide for linear motion is split along its
widest direction, which separates the rates that lead to different turns, too; one without weight is
dropped. Estimate and covariance are those of the mixture, including the spread of the hypotheses.
Once the mixture is narrow it becomes the filter. D. Alspach, H. Sorenson, 'Nonlinear Bayesian
estimation using Gaussian sum approximations' (1972).

The mixture stands in a filter's memory where the filter's own estimate would, so that all who read
this memory see the mixture.
"""

import math

from torquer.compile.engine import inlined, plugged
from torquer.computer.estimation.covariance import (
    ATTITUDE,
    factor_innovation,
    mean_variance,
    put_gain,
)
from torquer.computer.estimation.isolation import isolate_what_is_no_number
from torquer.computer.estimation.kalman import (
    advance,
    latest,
    nothing_estimated,
    put_back,
    state_estimate,
    take_readings,
)
from torquer.computer.estimation.measurements.table import FIELD_CHANNEL
from torquer.computer.estimation.starts import UNINFORMED, has_attitude
from torquer.computer.estimation.triad import rate_between
from torquer.maths.geometry.quaternion import (
    from_rotation_vector,
    multiply,
    put_quaternion,
    read_quaternion,
)
from torquer.maths.geometry.vec3 import put_matrix, put_row, scale, unit

#: Hypotheses at the start, equally spaced about the field, and places for more.
_AT_START = 24
_PLACES = 48
#: Standard deviation of the turn in each at the start, over their spacing.
_SHARE = 0.6
#: Variance of the attitude [rad^2], all axes together, above which a hypothesis is split, and below
#: which the mixture becomes the filter.
_WIDE = math.radians(12.0) ** 2
_NARROW = math.radians(5.0) ** 2
#: Distance of both parts of a split hypothesis from their mean, in standard deviations.
_APART = 0.8
#: Logarithm of the weight below which a hypothesis is dropped.
_LEAST = math.log(1e-6)


@plugged
def step_by_field(
    inputs, parameters, memory, begin, propagate, rate_of, remembered, put_remembered
):
    """`torquer.computer.estimation.kalman.step` of a filter that uses the magnetometer alone.

    `remembered(memory)`: what `propagate` reads of the step before; `put_remembered(memory, it)`.
    """
    starts = memory.starts
    isolate_what_is_no_number(inputs, parameters.sensing, memory)
    if not has_attitude(inputs, parameters, memory, begin, rate_of):
        return nothing_estimated(inputs, parameters, memory)
    if memory.starts > starts:
        memory.hypotheses = 0.0
        # an attitude that is taken over includes the readings until then
        if memory.read_s[FIELD_CHANNEL] < memory.t_s:
            suppose(memory, unit(inputs.b_body_t))
    dt = inputs.t_s - memory.t_s
    if memory.hypotheses == 0.0:
        advance(inputs, parameters, memory, dt, propagate, rate_of)
        return state_estimate(inputs, parameters, memory, dt, rate_of)
    before, read_s = remembered(memory), memory.read_s[FIELD_CHANNEL]
    rejected, in_a_row = memory.rejected, memory.rejected_in_a_row[FIELD_CHANNEL]
    start_s, first = memory.t_s, likeliest(memory) + 1
    for i in range(_PLACES):
        k = (first + i) % _PLACES  # what the likeliest, the last one, leaves is the filter's
        if memory.log_weight[k] > -math.inf:
            put_remembered(memory, before)
            memory.t_s, memory.read_s[FIELD_CHANNEL] = start_s, read_s
            memory.rejected, memory.rejected_in_a_row[FIELD_CHANNEL] = rejected, in_a_row
            load(memory, k)
            propagate(inputs, parameters, memory, dt)
            omega, _, _, _ = rate_of(inputs, parameters, memory, dt)
            memory.log_weight[k] += log_likelihood(inputs, parameters, memory, omega)
            take_readings(inputs, parameters, memory, omega, (0.0, 0.0), False)
            store(memory, k)
    memory.t_s = inputs.t_s
    memory.watched[FIELD_CHANNEL, 0, 0] = -math.inf  # the next reading is compared with none before
    weigh(memory)
    split_the_wide(memory)
    mix(memory)
    return state_estimate(inputs, parameters, memory, dt, rate_of)


@inlined
def suppose(memory, along):
    """Hypotheses of equal weight at equal turns about the field (unit vector, body)."""
    p, q, spacing = memory.covariance, read_quaternion(memory.q), 2.0 * math.pi / _AT_START
    share = _SHARE * spacing
    known = UNINFORMED - share * share
    for i in range(3):
        for j in range(3):
            p[i, j] -= known * along[i] * along[j]
    memory.log_weight[:] = -math.inf
    for k in range(_AT_START):
        put_quaternion(memory.q, multiply(q, from_rotation_vector(scale(k * spacing, along))))
        store(memory, k)
        memory.log_weight[k] = -math.log(_AT_START)
    memory.hypotheses = float(_AT_START)


@inlined
def load(memory, k):
    """Make a hypothesis the filter's estimate."""
    put_row(memory.q, memory.hypothesis_q[k])
    put_row(memory.states, memory.hypothesis_states[k])
    put_matrix(memory.covariance, memory.hypothesis_covariance[k])


@inlined
def store(memory, k):
    """Keep the filter's estimate as a hypothesis."""
    put_row(memory.hypothesis_q[k], memory.q)
    put_row(memory.hypothesis_states[k], memory.states)
    put_matrix(memory.hypothesis_covariance[k], memory.covariance)


@inlined
def log_likelihood(inputs, parameters, memory, omega):
    """Logarithm of the likelihood of a new field reading, but for a constant; 0 without one.

    A reading beyond the gate counts as one at the gate: a fault must not decide.
    """
    m, _ = latest(inputs, parameters, memory, FIELD_CHANNEL, omega, 0.0)
    gain = memory.gain
    if m.count == 0:
        return 0.0
    put_gain(memory.covariance, gain, m)
    lower, d = factor_innovation(gain, m)
    e1 = m.z[0]
    e2 = m.z[1] - lower[0] * e1
    nis, gate = e1 * e1 / d[0] + e2 * e2 / d[1], parameters.sensing.gate_2
    if m.count == 3:
        e3 = m.z[2] - lower[1] * e1 - lower[2] * e2
        nis, gate = nis + e3 * e3 / d[2], parameters.sensing.gate_3
    bounded = nis if nis < gate else gate  # where the reading is not a number, too
    return -0.5 * (bounded + math.log(d[0] / m.r * (d[1] / m.r) * d[2]))


@inlined
def likeliest(memory):
    """Number of the hypothesis of greatest weight."""
    best = 0
    for k in range(_PLACES):
        if memory.log_weight[k] > memory.log_weight[best]:
            best = k
    return best


@inlined
def weigh(memory):
    """Make the weights' sum one, and drop hypotheses without weight."""
    w, greatest, total = memory.log_weight, memory.log_weight[likeliest(memory)], 0.0
    for k in range(_PLACES):
        total += math.exp(w[k] - greatest)
    for k in range(_PLACES):
        w[k] -= greatest + math.log(total)
        if w[k] < _LEAST:
            w[k] = -math.inf


@inlined
def split_the_wide(memory):
    """Split hypotheses that are too wide for linear motion as long as there are free places."""
    for k in range(_PLACES):
        wide = 3.0 * mean_variance(memory.hypothesis_covariance[k], ATTITUDE) > _WIDE
        if wide and memory.log_weight[k] > -math.inf:
            free = 0
            while free < _PLACES and memory.log_weight[free] > -math.inf:
                free += 1
            if free < _PLACES:
                split(memory, k, free)


@inlined
def split(memory, k, free):
    """Make two hypotheses of one, with the same mean and covariance together.

    They lie apart along the column of the covariance that belongs to the widest attitude axis.
    """
    load(memory, k)
    p, apart, axis = memory.covariance, memory.gain[0], 0
    for i in range(3):
        axis = i if p[i, i] > p[axis, axis] else axis
    for i in range(apart.shape[0]):
        apart[i] = _APART * p[i, axis] / math.sqrt(p[axis, axis])
    for i in range(apart.shape[0]):
        for j in range(apart.shape[0]):
            p[i, j] -= apart[i] * apart[j]
    memory.log_weight[k] = memory.log_weight[free] = memory.log_weight[k] - math.log(2.0)
    store(memory, free)
    shift(memory, k, 1.0)
    load(memory, free)
    shift(memory, free, -1.0)


@inlined
def shift(memory, k, factor):
    """Store the filter's estimate, moved by what stands in the first row of `gain`."""
    for i in range(memory.correction.shape[0]):
        memory.correction[i] = factor * memory.gain[0, i]
    put_back(memory)
    store(memory, k)


@inlined
def mix(memory):
    """Mean and covariance of the mixture, which becomes the filter once it is narrow.

    To first order in the turns from their mean to each hypothesis.
    """
    p, c, apart, count = memory.covariance, memory.correction, memory.gain[0], 0.0
    load(memory, likeliest(memory))
    c[:] = 0.0
    for k in range(_PLACES):
        if memory.log_weight[k] > -math.inf:
            count += 1.0
            put_apart(memory, k)
            for i in range(c.shape[0]):
                c[i] += math.exp(memory.log_weight[k]) * apart[i]
    put_back(memory)
    p[:] = 0.0
    for k in range(_PLACES):
        if memory.log_weight[k] > -math.inf:
            weight, own = math.exp(memory.log_weight[k]), memory.hypothesis_covariance[k]
            put_apart(memory, k)
            for i in range(c.shape[0]):
                for j in range(c.shape[0]):
                    p[i, j] += weight * (own[i, j] + apart[i] * apart[j])
    memory.hypotheses = count if 3.0 * mean_variance(p, ATTITUDE) > _NARROW else 0.0


@inlined
def put_apart(memory, k):
    """Write what takes the filter's estimate to a hypothesis into the first row of `gain`."""
    turn = rate_between(read_quaternion(memory.q), read_quaternion(memory.hypothesis_q[k]), 1.0)
    for i in range(3):
        memory.gain[0, i] = turn[i]
    for i in range(memory.states.shape[0]):
        memory.gain[0, 3 + i] = memory.hypothesis_states[k, i] - memory.states[i]


def hypotheses_memory(n: int) -> dict:
    """Memory beyond that of a filter of n states, before the start; see `filter_memory`.

    `hypotheses`: their number, 0 when the filter works alone.
    """
    row = (0.0,) * n
    return {
        "hypotheses": 0.0,
        "log_weight": (-math.inf,) * _PLACES,
        "hypothesis_q": ((0.0, 0.0, 0.0, 1.0),) * _PLACES,
        "hypothesis_states": (row[3:],) * _PLACES,
        "hypothesis_covariance": ((row,) * n,) * _PLACES,
    }
