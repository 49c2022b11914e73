"""Wheel steering within torque and speed limits, away from zero speed. Kernels.

Wheels beyond three have a null space: momenta that sum to zero. A bias in it keeps the
wheels spinning: momenta = minimax + fade * bias, where fade = 1 as long as the limits
allow, and less near the surface of the envelope, so that all of the envelope stays reachable.
With a bias at equal shares of the limits, every wheel stays above its idle share e for all
demands within (1 - e)/2 of the envelope; with an unequal one, see `Bias.keeps_off_zero_up_to`.
"""

import functools
from typing import NamedTuple

import numpy as np

from torquer.compile.engine import inlined, kernel
from torquer.maths.geometry.vec3 import add_scaled, cross, dot, norm, scale, sub
from torquer.spacecraft.wheel_array.allocation import (
    WheelSet,
    least_squares,
    minimax,
    row_bound,
    wheel_set,
)
from torquer.spacecraft.wheel_array.envelope import THIN
from torquer.spacecraft.wheel_array.planes import authority, span_axes

#: Rows of the work space: middle and half of the torques that are allowed; what is wanted; 1 for
#: wheels that are within.
CENTRE, HALF, WANTED, FREE, ROWS = range(5)
#: Most rounds of `steer_nearest`, and the part of the torque that is small enough to end them.
ROUNDS, CLOSE = 50, 1e-10


class Bias(NamedTuple):
    """Null-space momenta of the wheels that keep them away from zero speed."""

    momenta_n_m_s: np.ndarray
    """(n,); zeros where the array has no such momenta."""
    keeps_off_zero_up_to: float
    """Part of the envelope within which every wheel stays above its idle share; 0: none."""


def steering_bias(array, minimum_speed_fraction: float = 0.05) -> Bias:
    """The bias that keeps the wheels of a `WheelArray` away from zero for the most demands.

    `minimum_speed_fraction`: part of its limit below which a wheel should not be. Of all null
    vectors with shares up to 1 the one is taken whose least share is greatest (a mixed-integer
    program: the directions of rotation are its whole numbers).
    """
    if not 0.0 <= minimum_speed_fraction < 1.0:
        raise ValueError(
            f"minimum_speed_fraction: must be from 0 to below 1; received {minimum_speed_fraction}"
        )
    return _bias(np.array(array.axes), array.momentum_limits(), minimum_speed_fraction)


def _bias(axes: np.ndarray, limits: np.ndarray, minimum_speed_fraction: float) -> Bias:
    """The same for axes (n, 3) and limits (n,), 0 for lost wheels."""
    works = limits > 0.0
    # in parts of the greatest: arrays that differ in size alone have the same program
    vectors = axes[works] * (limits[works] / limits.max())[:, None]
    shares, least = _most_even_null_shares(tuple(map(tuple, vectors.tolist())))
    momenta = np.zeros(len(axes))
    if least <= minimum_speed_fraction:
        return Bias(momenta, 0.0)
    size = (1.0 + minimum_speed_fraction) / (1.0 + least)
    momenta[works] = size * shares * limits[works]
    return Bias(momenta, (least - minimum_speed_fraction) / (1.0 + least))


@functools.lru_cache(256)
def _most_even_null_shares(rows: tuple):
    """Shares c, |c| <= 1, of vectors (n, 3) that add up to zero, with the greatest least |c|.

    Kept, as every run of an array with n wheels asks for n + 1 of these programs.
    """
    from scipy.optimize import Bounds, LinearConstraint, milp  # a fifth of a second of importing

    vectors, n = np.array(rows), len(rows)
    if n == 0:
        return np.zeros(0), 0.0
    unit = np.eye(n)
    ones, size = np.ones((n, 1)), np.linalg.norm(vectors, axis=1).max()
    # unknowns: c, direction (1 forward, 0 backward), least |c|
    null = np.hstack([vectors.T / size, np.zeros((3, n + 1))])
    forward, backward = np.hstack([-unit, 2.0 * unit, ones]), np.hstack([unit, -2.0 * unit, ones])
    found = milp(
        np.append(np.zeros(2 * n), -1.0),
        constraints=[
            LinearConstraint(null, 0.0, 0.0),
            LinearConstraint(forward, -np.inf, 2.0),
            LinearConstraint(backward, -np.inf, 0.0),
        ],
        integrality=np.concatenate([np.zeros(n), np.ones(n), [0.0]]),
        # the first wheel turns forward: the opposite bias is as good
        bounds=Bounds(np.concatenate([-np.ones(n), [1.0], np.zeros(n)]), np.ones(2 * n + 1)),
    )
    shares = found.x[:n] - np.linalg.pinv(vectors.T) @ (vectors.T @ found.x[:n])
    shares /= max(np.abs(shares).max(), 1.0)
    return shares, float(np.abs(shares).min())


class Steering(NamedTuple):
    """An array in flight, for kernels; `lose` and `steer` write to its arrays."""

    wheels: WheelSet
    momentum_limit: np.ndarray
    """(n,) [N m s], 0 for lost wheels."""
    torque_limit: np.ndarray
    """(n,) [N m], 0 for lost wheels."""
    bias: np.ndarray
    """(n,) [N m s], a null vector of the working wheels."""
    bias_after: np.ndarray
    """(n, n) [N m s]: row k is the bias to take when wheel k is lost."""
    work: np.ndarray
    """(ROWS, n): space to write to."""


def make_steering(array, minimum_speed_fraction: float | None = 0.05) -> Steering:
    """Steering state of a `WheelArray` with torque limits, for kernels.

    `minimum_speed_fraction`: as in `steering_bias`, None for no bias.
    """
    count = array.count
    bias, after = np.zeros(count), np.zeros((count, count))
    if minimum_speed_fraction is not None:
        bias = steering_bias(array, minimum_speed_fraction).momenta_n_m_s
        axes, limits = np.array(array.axes), array.momentum_limits()
        for k in range(count):
            without = np.where(np.arange(count) == k, 0.0, limits)
            after[k] = _bias(axes, without, minimum_speed_fraction).momenta_n_m_s
    return Steering(
        wheel_set(array),
        array.momentum_limits(),
        array.torque_limits(),
        bias,
        after,
        np.zeros((ROWS, count)),
    )


@kernel
def lose(steering, wheel):
    """Mark a wheel as lost: its limits become zero, the bias the one prepared for its loss.

    After earlier losses that bias is projected on the remaining null space: still a null vector,
    but not the most uniform one.
    """
    axes, limit, bias = steering.wheels.axes, steering.momentum_limit, steering.bias
    limit[wheel] = steering.torque_limit[wheel] = 0.0
    for k in range(limit.shape[0]):
        bias[k] = steering.bias_after[wheel, k]
    least_squares(axes, limit, _total(axes, limit, bias), steering.work[WANTED])
    for k in range(limit.shape[0]):
        bias[k] = bias[k] - steering.work[WANTED, k] if limit[k] > 0.0 else 0.0


@inlined
def _axis(axes, k):
    return (axes[k, 0], axes[k, 1], axes[k, 2])


@inlined
def _total(axes, limit, momenta):
    """Vector that the working wheels hold."""
    held = (0.0, 0.0, 0.0)
    for k in range(limit.shape[0]):
        if limit[k] > 0.0:
            held = add_scaled(held, momenta[k], _axis(axes, k))
    return held


@inlined
def add_bias(wheels, limit, bias, demand, out):
    """Minimax momenta and as much of the bias as the limits allow; into out (n,).

    Returns the greatest share of the minimax part. The bias must be a null vector of the
    working wheels.
    """
    greatest, fade = minimax(wheels, limit, demand, out), 1.0
    for k in range(limit.shape[0]):
        if bias[k] != 0.0:
            room = limit[k] - out[k] if bias[k] > 0.0 else limit[k] + out[k]
            fade = min(fade, room / abs(bias[k]))
    for k in range(limit.shape[0]):
        out[k] += max(fade, 0.0) * bias[k]
    return greatest


@inlined
def _room(reach, normal, bound, middle, demand):
    """That reach, or less where a half-space about the middle ends before."""
    along = dot(normal, demand)
    room = bound + dot(normal, middle) if along > 0.0 else bound - dot(normal, middle)
    room = max(room, 0.0)
    return room / abs(along) if room < abs(along) * reach else reach


@inlined
def _reach(wheels, half, middle, demand, held):
    """Greatest s up to 1 with s * demand = middle + a sum within half (n,) of the wheels.

    `held`: the `authority` of the working wheels, which spans the demand.
    """
    (first, second, _), sizes = held
    reach, least = 1.0, 0.0
    for k in range(half.shape[0]):
        least += THIN * half[k]
    if sizes[2] > 0.0:
        for f in range(wheels.faces.shape[0]):
            bound = row_bound(wheels.faces, f, half)
            if bound > least:
                reach = _room(reach, _axis(wheels.faces, f), bound, middle, demand)
        return reach
    for edge in range(half.shape[0]):  # in a plane: its edges; on a line, all of it
        line = _axis(wheels.axes, edge)
        wall, bound = cross(cross(first, second), line) if sizes[1] > 0.0 else line, 0.0
        for k in range(half.shape[0]):
            bound += half[k] * abs(dot(wall, _axis(wheels.axes, k)))
        if half[edge] > 0.0 and bound > least:
            reach = _room(reach, wall, bound, middle, demand)
    return reach


@inlined
def _torque_box(momentum_limit, torque_limit, step_s, momenta, work):
    """Torques that keep both limits for a step: rows CENTRE and HALF of work."""
    for k in range(momenta.shape[0]):
        most = torque_limit[k]
        high = max(min(most, (momentum_limit[k] - momenta[k]) / step_s), -most)
        low = min(max(-most, (-momentum_limit[k] - momenta[k]) / step_s), most)
        work[CENTRE, k], work[HALF, k] = 0.5 * (high + low), 0.5 * (high - low)


@kernel
def steer(steering, step_s, momenta, torque, out):
    """Torques [N m] on the wheels for a step: write out (n,), return the part of `torque` given.

    Their vector sum is `torque` (a tuple; the body feels the opposite), or, where the limits of
    torque or of momentum at the step's end forbid it, the greatest part of it that they allow:
    the direction is kept. All torque that is then left goes into the null space, towards
    `biased`. `momenta` (n,): of the wheels now [N m s], within their limits; those of lost
    wheels are left out.
    """
    wheels, limit, work = steering.wheels, steering.torque_limit, steering.work
    _torque_box(steering.momentum_limit, limit, step_s, momenta, work)
    held, middle = authority(wheels.axes, limit), _total(wheels.axes, limit, work[CENTRE])
    torque = span_axes(held, torque)
    part = _reach(wheels, work[HALF], middle, torque, held)
    minimax(wheels, work[HALF], sub(scale(part, torque), middle), out)
    for k in range(limit.shape[0]):
        out[k] = _bound(work, k, out[k])
    _into_null_space(steering, step_s, momenta, scale(part, torque), out)
    return part


@kernel
def steer_nearest(steering, step_s, momenta, torque, out):
    """`steer` for a torque beyond the limits, giving the nearest torque to it: write out.

    What the motors cannot produce is cut with the direction kept. Of the rest the nearest torque is
    given that saturated wheels allow, so that wheels saturated in one direction do not limit the
    others: least squares with bounds, wheel by wheel in turn, then with all that are within theirs
    at once, iterated.
    """
    wheels, limit, work = steering.wheels, steering.torque_limit, steering.work
    axes, held = wheels.axes, authority(wheels.axes, limit)
    torque = span_axes(held, torque)
    torque = scale(_reach(wheels, limit, (0.0, 0.0, 0.0), torque, held), torque)
    minimax(wheels, limit, torque, out)
    _torque_box(steering.momentum_limit, limit, step_s, momenta, work)
    for k in range(limit.shape[0]):
        out[k] = _bound(work, k, out[k] - work[CENTRE, k])
    missing, close = sub(torque, _total(axes, limit, out)), CLOSE * norm(torque)
    for _ in range(ROUNDS):
        moved = 0.0
        for k in range(limit.shape[0]):
            axis, before = _axis(axes, k), out[k]
            out[k] = _bound(work, k, before + dot(axis, missing) - work[CENTRE, k])
            missing = add_scaled(missing, before - out[k], axis)
            moved = max(moved, abs(out[k] - before))
        if moved <= close:
            break
        missing = _all_at_once(axes, work, missing, out)
    _into_null_space(steering, step_s, momenta, sub(torque, missing), out)


@kernel
def _all_at_once(axes, work, missing, out):
    """Add what is missing with the wheels within their bounds, to the first bound that is met.

    Returns what is then missing. (Wheel by wheel, axes that nearly make up for each other would
    creep towards their bounds.)
    """
    for k in range(out.shape[0]):
        inside = abs(out[k] - work[CENTRE, k]) < work[HALF, k] * (1.0 - 1e-12)
        work[FREE, k] = 1.0 if inside else 0.0
    least_squares(axes, work[FREE], missing, work[WANTED])
    part = _go(work, out)
    for k in range(out.shape[0]):
        missing = add_scaled(missing, -part * work[WANTED, k], _axis(axes, k))
    return missing


@inlined
def _into_null_space(steering, step_s, momenta, torque, out):
    """Go from torques in out, whose vector sum is given, towards the bias within the limits."""
    wheels, limit, work = steering.wheels, steering.torque_limit, steering.work
    wanted = add_scaled(_total(wheels.axes, limit, momenta), step_s, torque)
    add_bias(wheels, steering.momentum_limit, steering.bias, wanted, work[WANTED])
    for k in range(limit.shape[0]):
        way = (work[WANTED, k] - momenta[k]) / step_s - out[k]
        work[WANTED, k] = way if limit[k] > 0.0 else 0.0
    _go(work, out)


@inlined
def _bound(work, k, side):
    """Torque of a wheel that far from the middle of its bounds, or at the bound."""
    return work[CENTRE, k] + min(max(side, -work[HALF, k]), work[HALF, k])


@inlined
def _go(work, out):
    """Go from torques in out along row WANTED of work to the first bound; the part that is gone."""
    part = 1.0
    for k in range(out.shape[0]):
        side = np.sign(work[WANTED, k])
        room = max(work[HALF, k] - (out[k] - work[CENTRE, k]) * side, 0.0)
        if room < part * abs(work[WANTED, k]):
            part = room / abs(work[WANTED, k])
    for k in range(out.shape[0]):
        out[k] += part * work[WANTED, k]
    return part
