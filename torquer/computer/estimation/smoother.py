"""Smoother of a Kalman filter: what the readings of a whole run tell about every instant of it.

Before each step the filter's errors are copied into its covariance, as states that stay as they
are. The filter's own step then finds how the errors before and after it are correlated, whatever it
does in between; a pass backwards uses that. S. Roumeliotis, J. Burdick, 'Stochastic cloning: a
generalized framework for processing relative state measurements' (2002); H. Rauch, F. Tung,
C. Striebel, 'Maximum likelihood estimates of linear dynamic systems' (1965). The attitude's error
is a small rotation in the filter's body axes, as in the filter.
"""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from torquer.compile.engine import inlined, kernel
from torquer.computer.estimation.covariance import ATTITUDE, put_uncorrelated, turn_attitude
from torquer.computer.estimation.estimator import Estimator, call_estimator
from torquer.computer.estimation.filter import filter_memory
from torquer.computer.estimation.measurements.star_tracker import PAST
from torquer.computer.estimation.measurements.table import WATCHERS
from torquer.computer.estimation.starts import UNINFORMED
from torquer.computer.estimation.triad import rate_between
from torquer.computer.estimation.watch import WATCHED
from torquer.computer.inputs import read_estimate
from torquer.computer.interface import UNKNOWN_ESTIMATE, put_estimate
from torquer.maths.geometry.quaternion import (
    conjugate,
    from_rotation_vector,
    multiply,
    normalise,
    put_quaternion,
    read_quaternion,
)
from torquer.maths.geometry.vec3 import put_matrix, put_row

#: Share of a variance below which what is left of it, once others are known, is rounding.
_ROUNDING = 1e-13


class Places(NamedTuple):
    """First cells of parts of a filter's memory; `n`: number of its errors, without copies."""

    t_s: int
    q: int
    states: int
    covariance: int
    watched: int
    past: int
    n: int


class Forward(NamedTuple):
    """What a filter knew after each of k steps, and about the instant before each.

    `q` (k, 4), NaN before the start; `states` (k, n - 3); `covariance` (k, n, n) of the errors;
    `cross` (k, n, n): covariance of the errors after the step (rows) and before it; `change` (k,
    n), `before` (k, n, n): what the step's readings change in the errors before it, and the
    covariance of what remains of them.
    """

    q: np.ndarray
    states: np.ndarray
    covariance: np.ndarray
    cross: np.ndarray
    change: np.ndarray
    before: np.ndarray


def empty_forward(k: int, n: int) -> Forward:
    """Room for k steps of a filter with n errors."""
    shapes = ((4,), (n - 3,), (n, n), (n, n), (n,), (n, n))
    return Forward(*(np.full((k, *shape), np.nan) for shape in shapes))


def with_copies(filter_: Estimator) -> tuple[Estimator, Places]:
    """The filter with room for copies of its errors in its memory, and where they stand."""
    n = len(filter_.memory["covariance"])
    memory = dict(filter_.memory)
    for name, doubled in filter_memory(2 * n).items():
        if np.shape(doubled) != np.shape(memory[name]):
            memory[name] = doubled
    larger = replace(filter_, memory=memory, log={}, spec=None)
    first = [larger.memory_places()[name][0] for name in Places._fields[:-1]]
    return larger, Places(*first, n)


@inlined
def copy_errors(p, change, n):
    """Copy the first n errors of a covariance (2 n, 2 n) into the others; no change of these."""
    for i in range(n):
        change[i] = 0.0
        for j in range(n):
            p[n + i, n + j] = p[i, n + j] = p[n + i, j] = p[i, j]


@inlined
def begin_at(p, memory, places, t_s, seed):
    """How the body has turned since the step before is not known: nothing is, of the attitude.

    `seed`: attitude near which it is sought, of which nothing is known otherwise, and what the
    variance of the next state gains meanwhile; NaN for no attitude: the filter starts by itself.
    """
    for i in range(4):
        memory[places.q + i] = seed[i]
    memory[places.t_s] = t_s if math.isfinite(seed[0]) else -math.inf
    put_uncorrelated(p, ATTITUDE, UNINFORMED)
    for i in range(3, 6):
        p[i, i] += seed[4]
    for i in range(2 * WATCHERS * WATCHED):
        memory[places.watched + i] = -math.inf
    for i in range(PAST):
        memory[places.past + 5 * i] = -math.inf


@kernel
def fly(estimator, known, parameters, memory, places, works, seeds, out, logged, log):
    """Let a filter with copies of its errors work on what the computer knew; fill a `Forward`.

    `estimator`: its address; `known` (k,): `KNOWN` at each step, in which the filter's estimates
    are put; `works` (k,): whether it works then, otherwise the estimate in `known` is another's;
    `seeds` (k, 5): see `begin_at`, NaN where the filter goes on; `logged` (m,): cells of the memory
    that are kept in `log` (k, m).
    """
    n = places.n
    first = places.covariance
    p = memory[first : first + 4 * n * n].reshape((2 * n, 2 * n))
    states = memory[places.states : places.states + 2 * n - 3]
    q = memory[places.q : places.q + 4]
    before = UNKNOWN_ESTIMATE
    for k in range(known.shape[0]):
        copy_errors(p, states[n - 3 :], n)
        if math.isfinite(seeds[k, 4]):
            begin_at(p, memory, places, known[k].t_s, seeds[k])
        after = read_estimate(known[k])
        if works[k]:
            put_estimate(known[k], before)
            after = call_estimator(estimator, known[k : k + 1], parameters, memory)
            put_estimate(known[k], after)
        before = after
        put_row(out.q[k], q)
        put_row(out.states[k], states)
        put_row(out.change[k], states[n - 3 :])
        put_matrix(out.covariance[k], p)
        put_matrix(out.cross[k], p[:n, n:])
        put_matrix(out.before[k], p[n:, n:])
        for i in range(logged.shape[0]):
            log[k, i] = memory[logged[i]]


@inlined
def put_gain(p, cross, gain, factor, sigma):
    """gain = cross^T p^-1 (n, n), by the Cholesky factor of p, scaled by its standard deviations.

    A combination of errors that is known exactly tells nothing about others.
    """
    n = p.shape[0]
    for i in range(n):
        sigma[i] = math.sqrt(p[i, i]) if p[i, i] > 0.0 else 1.0
    for i in range(n):
        for j in range(i + 1):
            s = p[i, j] / (sigma[i] * sigma[j])
            for k in range(j):
                s -= factor[i, k] * factor[j, k]
            if i > j:
                factor[i, j] = s / factor[j, j] if factor[j, j] > 0.0 else 0.0
            else:
                factor[i, i] = math.sqrt(s) if s > _ROUNDING else 0.0
    for row in range(n):  # of the gain: a column of cross, solved forwards, then backwards
        for i in range(n):
            s = cross[i, row] / sigma[i]
            for k in range(i):
                s -= factor[i, k] * gain[row, k]
            gain[row, i] = s / factor[i, i] if factor[i, i] > 0.0 else 0.0
        for i in range(n - 1, -1, -1):
            s = gain[row, i]
            for k in range(i + 1, n):
                s -= factor[k, i] * gain[row, k]
            gain[row, i] = s / factor[i, i] if factor[i, i] > 0.0 else 0.0
        for i in range(n):
            gain[row, i] /= sigma[i]


@inlined
def put_better(p, gain, better, half):
    """p += gain better gain^T, symmetric to the bit; `half` (n, n) to work in."""
    n = p.shape[0]
    for i in range(n):
        for j in range(n):
            s = 0.0
            for k in range(n):
                s += gain[i, k] * better[k, j]
            half[i, j] = s
    for i in range(n):
        for j in range(i, n):
            s = 0.5 * (p[i, j] + p[j, i])
            for k in range(n):
                s += half[i, k] * gain[j, k]
            p[i, j] = p[j, i] = s


@kernel
def smooth(forward, q, states, covariance):
    """Fill attitudes (k, 4), states (k, n - 3), covariance (k, n, n) of the errors, backwards.

    The errors of the attitude are in the axes of the smoothed attitude.
    """
    last, n = forward.q.shape[0] - 1, forward.change.shape[1]
    room, apart, sigma = np.zeros((4, n, n)), np.zeros(n), np.zeros(n)
    gain, factor, better, half = room[0], room[1], room[2], room[3]
    put_row(q[last], forward.q[last])
    put_row(states[last], forward.states[last])
    put_matrix(covariance[last], forward.covariance[last])
    for k in range(last - 1, -1, -1):
        if not math.isfinite(forward.q[k, 0]):
            return  # not started: what is before is not known either
        own, later = read_quaternion(forward.q[k + 1]), read_quaternion(q[k + 1])
        turn = rate_between(own, later, 1.0)
        apart[0], apart[1], apart[2] = turn
        for i in range(3, n):
            apart[i] = states[k + 1, i - 3] - forward.states[k + 1, i - 3]
        put_matrix(better, covariance[k + 1])
        turn_attitude(better, conjugate(from_rotation_vector(turn)))
        better -= forward.covariance[k + 1]
        put_gain(forward.covariance[k + 1], forward.cross[k + 1], gain, factor, sigma)
        change = forward.change[k + 1]
        for i in range(n):
            for j in range(n):
                change[i] += gain[i, j] * apart[j]
        put_matrix(covariance[k], forward.before[k + 1])
        put_better(covariance[k], gain, better, half)
        turn = from_rotation_vector((change[0], change[1], change[2]))
        turn_attitude(covariance[k], turn)
        put_quaternion(q[k], normalise(multiply(read_quaternion(forward.q[k]), turn)))
        for i in range(3, n):
            states[k, i - 3] = forward.states[k, i - 3] + change[i]
