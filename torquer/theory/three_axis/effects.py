"""What torques and errors of the readings do to a held attitude along a flight, from its start on.

`response` finds the steady state of what repeats; here nothing need repeat. The loop begins at the
wanted attitude, at rest, and each cause is carried through it, cycle by cycle: a given torque or
error of the readings as a series, white noise as a covariance, a random walk as one more state.

The mean over a window, and so the error relative to it, comes with it: the covariance is carried
with the sum of the turns since the window began.
"""

import math
from typing import NamedTuple

import numpy as np

from torquer.compile.engine import kernel
from torquer.theory.three_axis.response import walk
from torquer.theory.three_axis.sampled import SampledHold

#: Part of an error that is left when it counts as decayed.
_LEFT = 0.02


class Loop(NamedTuple):
    """A closed loop from command to command, n of them.

    `t_s` (n,): the commands; x_next = step x + torque t + reading e + own: `steps` (n, 6, 6);
    `torque` (n, 6, 3): of one held for the cycle [N m]; `reading` (n, 6, 6): of errors of the
    readings, turn [rad] and rate [rad/s]; `own` (n, 6): of gravity, the gyroscopic torque and what
    the law asks for at the wanted attitude. `answer` (n, 6, 3): of what the law asks for, `gains`
    (n, 3, 6). `b_body_t` (n, 3): field at the wanted attitude.
    """

    t_s: np.ndarray
    steps: np.ndarray
    torque: np.ndarray
    reading: np.ndarray
    own: np.ndarray
    answer: np.ndarray
    gains: np.ndarray
    b_body_t: np.ndarray

    @property
    def cycle_s(self) -> float:
        """Time from command to command."""
        return float(self.t_s[1] - self.t_s[0])

    def until(self, last_s: float) -> "Loop":
        """The loop up to a time."""
        count = int(np.searchsorted(self.t_s, last_s + 0.5 * self.cycle_s))
        return Loop(*(part[:count] for part in self))


class Wheels(NamedTuple):
    """What wheels do while the attitude is held: their momentum (n, 3) [N m s] in the body, and the
    wanted rate (n, 3) [rad/s], which turns it."""

    momentum_n_m_s: np.ndarray
    rate_rad_s: np.ndarray

    def reading(self) -> np.ndarray:
        """Torque (n, 3, 3) per error e of the rate that a law of wheels reads: e x h."""
        return -np.cross(self.momentum_n_m_s[:, None, :], np.eye(3)).transpose(0, 2, 1)

    def late(self) -> np.ndarray:
        """Torque (n, 3) that remains as the law takes on -w x h of the cycle's start."""
        gained = np.gradient(self.momentum_n_m_s, axis=0)
        return -np.cross(self.rate_rad_s, 0.5 * gained)


def make_loop(sampled: SampledHold, wheels: Wheels | None = None) -> Loop:
    """The loop of a sampled hold over its revolutions; `wheels`: what they do under their law."""
    hold, maps = sampled.hold, sampled.maps
    gains, rest = hold.slopes_and_rest(hold.instants(sampled.starts))
    per_rate = np.diag([1.0] * 3 + [1.0 / hold.rate_rad_s] * 3)
    asked = gains @ sampled.readout @ per_rate
    if wheels is not None:
        asked[:, :, 3:] += wheels.reading()
        rest = rest + wheels.late()
    own = maps.disturbed[:, :, 0] + np.einsum("nij,nj->ni", maps.dipole, rest)
    return Loop(
        sampled.starts / hold.rate_rad_s,
        maps.free + maps.dipole @ gains,
        maps.torque,
        maps.dipole @ asked,
        own,
        maps.dipole,
        gains,
        maps.b_body_t,
    )


def decay_s(loop: Loop) -> float:
    """Time [s] after which no initial state leaves more than 2 % of itself; infinite if none is."""
    x = np.eye(6)
    for k in range(len(loop.steps)):
        x = loop.steps[k] @ x
        if not np.isfinite(x).all():
            break
        if k % 16 == 0 and np.linalg.norm(x, 2) < _LEFT:
            return float(loop.t_s[k])
    return math.inf


def part_left(loop: Loop) -> float:
    """What the loop leaves by its end of the state that decays least, over whole revolutions above
    1 if it is unstable; infinite where numbers overflow."""
    x = np.eye(6)
    for step in loop.steps:
        x = step @ x
        if not np.isfinite(x).all():
            return math.inf
    return float(np.abs(np.linalg.eigvals(x)).max())


def states_under(loop: Loop, pushes: np.ndarray) -> np.ndarray:
    """States (n, 6, m), turn [rad] and rate over n, under pushes (n, 6, m), from zero on."""
    x = np.zeros((len(pushes) + 1, 6, pushes.shape[2]))
    walk(loop.steps, np.ascontiguousarray(pushes), x)
    return x[:-1]


class Spread(NamedTuple):
    """Covariances (n, 3, 3) [rad^2] of turns at the commands; of their means (w, 3, 3) over
    consecutive windows."""

    turns: np.ndarray
    means: np.ndarray

    @property
    def size(self) -> int:
        """Commands in a window."""
        return len(self.turns) // len(self.means)

    def within(self) -> np.ndarray:
        """Covariances (w, 3, 3) of the turns less the mean of their window, averaged over it."""
        each = self.turns[: self.size * len(self.means)].reshape(-1, self.size, 3, 3)
        return each.mean(axis=1) - self.means


@kernel
def walk_windows(steps, added, size, p, turns, means):
    """Carry a covariance p (s, s) through n cycles, next = M p M^T + added; the first three states
    are the turns. Fill their covariances `turns` (n, 3, 3), and of their means over windows of
    `size` cycles `means` (w, 3, 3).

    With the sum z of the turns of a window: z' = z + H x before each step.
    """
    states = p.shape[0]
    half, cross = np.zeros((states, states)), np.zeros((states, 3))
    moved, total = np.zeros((states, 3)), np.zeros((3, 3))
    for k in range(steps.shape[0]):
        if k % size == 0:
            cross[:, :], total[:, :] = 0.0, 0.0
        for i in range(3):
            for j in range(3):
                turns[k, i, j] = p[i, j]
                total[i, j] += cross[i, j] + cross[j, i] + p[i, j]
        for i in range(states):
            for j in range(3):
                cross[i, j] += p[i, j]
        if k % size == size - 1 and k // size < means.shape[0]:
            for i in range(3):
                for j in range(3):
                    means[k // size, i, j] = total[i, j] / (size * size)
        np.dot(steps[k], cross, moved)
        cross[:, :] = moved
        np.dot(steps[k], p, half)
        np.dot(half, steps[k].T, p)
        p += added[k]


def spread_under(steps: np.ndarray, added: np.ndarray, size: int, first=None) -> Spread:
    """Spread of the first three states (n, s, s) under white noise of covariance `added`.

    `first` (s, s): covariance at the start, zero if left out.
    """
    states = steps.shape[1]
    p = np.zeros((states, states)) if first is None else np.array(first, dtype=float)
    turns, means = np.zeros((len(steps), 3, 3)), np.zeros((len(steps) // size, 3, 3))
    steps, added = np.ascontiguousarray(steps), np.ascontiguousarray(added)
    walk_windows(steps, added, size, p, turns, means)
    return Spread(turns, means)


def under_white(loop: Loop, pushes: np.ndarray, size: int) -> Spread:
    """Under independent numbers of variance one at each command, pushes (n, 6, m)."""
    return spread_under(loop.steps, pushes @ pushes.transpose(0, 2, 1), size)


def under_walk(loop: Loop, pushes: np.ndarray, size: int) -> Spread:
    """Under three random walks that gain a variance of one a second, pushes (n, 6, 3)."""
    count, states = len(pushes), 9
    steps, added = np.zeros((count, states, states)), np.zeros((count, states, states))
    steps[:, :6, :6], steps[:, :6, 6:], steps[:, 6:, 6:] = loop.steps, pushes, np.eye(3)
    added[:, 6:, 6:] = np.eye(3) * loop.cycle_s
    return spread_under(steps, added, size)


def relative_to_mean(turns: np.ndarray, size: int) -> np.ndarray:
    """Turns (n, ...) less the mean of their window of `size` commands; what fills none is left
    out."""
    count, rest = len(turns) // size, turns.shape[1:]
    each = turns[: count * size].reshape(count, size, *rest)
    return (each - each.mean(axis=1, keepdims=True)).reshape(count * size, *rest)
