"""Periodic linear-quadratic regulator of a held attitude: Riccati's equation along the orbit.

The cost is the integral over u of (theta/a)^2 + (w/b)^2 + (m/c)^2, with weights a [rad], b [in
orbital rates], c [A m^2]. The dipole m = -c^2 B^T P x follows from the periodic solution P of

    P' + A^T P + P A - c^2 P B B^T P + Q = 0,

here A, B of the whole state. P at the start spans, as x -> (x, P x), the stable subspace of the
Hamiltonian system's monodromy matrix; the same system, step by step backwards, gives P along the
orbit, and takes out what rounding has left in it.
"""

import contextlib
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import schur

from torquer.compile.engine import inlined, kernel
from torquer.theory.periodic.collocation import solve_in_place
from torquer.theory.periodic.floquet import degree_of_stability, multipliers
from torquer.theory.three_axis.floquet import STAGES, room, stage_points
from torquer.theory.three_axis.hold import AttitudeHold
from torquer.theory.validity import Limit, within

_FIRST_STEPS = 32
#: Backward passes over the period, the change of P at which they end, and the most that is allowed.
_MOST_PASSES, _SETTLED, _CLOSED = 1000, 1e-12, 1e-9
_POSITIVE = {name: Limit(name, 0.0, open=True) for name in ("angle", "rate", "dipole")}


class Weights(NamedTuple):
    """Errors that cost as much as each other: angle [rad], rate [orbital rates], dipole [A m^2]."""

    angle: float
    rate: float
    dipole: float

    @property
    def of_state(self) -> np.ndarray:
        """Diagonal of Q `[6]`."""
        return np.array([self.angle**-2] * 3 + [self.rate**-2] * 3)


@inlined
def hamiltonian_rates(slopes, drive, q, push, y, dy):
    """dy = H y for columns (x, lambda): x' = A x - S lambda, lambda' = -Q x - A^T lambda.

    `slopes` `[3, 6]` of A, `drive` `[3, 3]` C, S = push C C^T in its lower corner, q `[6]`.
    """
    n = y.shape[1]
    for c in range(n):
        for r in range(3):
            dy[r, c] = y[3 + r, c]
            dy[9 + r, c] = -y[6 + r, c]
            dy[3 + r, c] = dy[6 + r, c] = 0.0
        for r in range(6):
            dy[6 + r, c] -= q[r] * y[r, c]
    for r in range(3):
        for k in range(6):
            a = slopes[r, k]
            for c in range(n):
                dy[3 + r, c] += a * y[k, c]
                dy[6 + k, c] -= a * y[9 + r, c]
        for k in range(3):
            s = 0.0
            for j in range(3):
                s += drive[r, j] * drive[k, j]
            for c in range(n):
                dy[3 + r, c] -= push * s * y[9 + k, c]


@kernel
def hamiltonian_steps(slopes, drive, q, push, h, tableau, rates, trial, out):
    """Transition matrices `[steps, 12, 12]` of the Hamiltonian system over equal steps h."""
    for step in range(out.shape[0]):
        y = out[step]
        for r in range(12):
            for c in range(12):
                y[r, c] = 1.0 if r == c else 0.0
        for s in range(STAGES + 1):
            for r in range(12):
                for c in range(12):
                    trial[r, c] = y[r, c]
            for j in range(s):
                factor = h * tableau[s, j]
                if factor != 0.0:
                    for r in range(12):
                        for c in range(12):
                            trial[r, c] += factor * rates[j, r, c]
            if s < STAGES:
                node = step * STAGES + s
                hamiltonian_rates(slopes[node], drive[node], q, push, trial, rates[s])
        for r in range(12):
            for c in range(12):
                y[r, c] = trial[r, c]


@kernel
def backwards(transitions, path, lhs):
    """Fill P `[n + 1, 6, 6]` along the period from its last row; greatest asymmetry before it is
    taken out. Infinite where steps are so long that they grow without bound. `lhs` `[6, 6]`: room.
    """
    worst = 0.0
    for step in range(transitions.shape[0]):
        k = transitions.shape[0] - 1 - step
        t, after, p = transitions[k], path[k + 1], path[k]
        for r in range(6):
            for c in range(6):
                lhs[r, c], p[r, c] = t[6 + r, 6 + c], -t[6 + r, c]
                for j in range(6):
                    lhs[r, c] -= after[r, j] * t[j, 6 + c]
                    p[r, c] += after[r, j] * t[j, c]
        solve_in_place(lhs, p)
        size = uneven = 0.0
        for r in range(6):
            for c in range(r + 1):
                size, uneven = max(size, abs(p[r, c])), max(uneven, abs(p[r, c] - p[c, r]))
                p[r, c] = p[c, r] = 0.5 * (p[r, c] + p[c, r])
        if not size < np.inf:
            return np.inf
        worst = max(worst, uneven / size)
    return worst


@dataclass(frozen=True)
class PeriodicLqr:
    """The regulator along the orbit.

    At `u` `[n + 1]`, equidistant from 0 to the period: `riccati` P `[n + 1, 6, 6]`, and `feedback`
    F `[n + 1, 3, 6]` [A m^2/T] with m = (F x) x B. `degree` [1/rad of u] of the loop.

    How good P is: `residual` of Riccati's equation over the greatest of its terms, P differentiated
    by nine points; `unclosed`: change over the last pass of the period; `asymmetry` before it is
    taken out; `least` eigenvalue over the greatest, the worst along the orbit.
    """

    u: np.ndarray
    riccati: np.ndarray
    feedback: np.ndarray
    degree: float
    residual: float
    unclosed: float
    asymmetry: float
    least: float


def periodic_lqr(
    hold: AttitudeHold, weights: Weights, tolerance: float = 1e-10, most_steps: int = 2048
) -> PeriodicLqr:
    """The regulator for weights, whatever the law of the hold is.

    `tolerance`: relative, of P; the residual is at most a hundred times that. `most_steps`: of a
    revolution; the faster the motion that the weights ask for, the more it takes. ArithmeticError
    if no periodic solution is found.
    """
    for name, value in weights._asdict().items():
        within(_POSITIVE[name], value)
    steps, before = _FIRST_STEPS * hold.revolutions, None
    reached = "none was found (a motion that can neither decay nor be controlled, or too few steps)"
    while steps <= most_steps * hold.revolutions:
        made = _with_steps(hold, weights, steps)
        if made is not None and before is not None:
            change = np.abs(made.riccati[::2] - before.riccati).max()
            # halved steps leave a 2^-8th of the change
            size = np.abs(made.riccati).max()
            if change <= 200.0 * tolerance * size and made.residual <= 100.0 * tolerance:
                return made
            reached = (
                f"with {steps // hold.revolutions} it changed by {change / size:.2g} still, with a "
                f"residual of {made.residual:.2g}"
            )
        before, steps = made, 2 * steps
    raise ArithmeticError(
        f"periodic LQR: the Riccati equation must have a periodic solution that settles to "
        f"{tolerance:g} within most_steps = {most_steps} steps a revolution; {reached}"
    )


def monodromy_steps(hold: AttitudeHold, weights: Weights, steps: int) -> np.ndarray:
    """Transition matrices `[steps, 12, 12]` of the Hamiltonian system along the period."""
    h = hold.period / steps
    free, out = hold.free(stage_points(h, steps)), np.empty((steps, 12, 12))
    rates, trial = np.empty((STAGES, 12, 12)), np.empty((12, 12))
    push, q = weights.dipole**2, weights.of_state
    tableau = room(0).tableau
    hamiltonian_steps(free.slopes, free.drive, q, push, h, tableau, rates, trial, out)
    return out


def _with_steps(hold: AttitudeHold, weights: Weights, steps: int) -> PeriodicLqr | None:
    """The regulator by so many steps; None where they are too few, or there is none."""
    transitions = monodromy_steps(hold, weights, steps)
    path, lhs, unclosed = np.empty((steps + 1, 6, 6)), np.empty((6, 6)), np.inf
    path[-1] = _first_solution(transitions, weights)
    for _ in range(_MOST_PASSES):
        asymmetry, before = backwards(transitions, path, lhs), unclosed
        if not asymmetry < np.inf:
            return None
        unclosed = float(np.abs(path[0] - path[-1]).max() / np.abs(path[0]).max())
        if unclosed <= _SETTLED or unclosed > 0.99 * before:  # or rounding keeps it from settling
            break
        path[-1] = path[0]
    if not unclosed <= _CLOSED:
        return None
    u = np.arange(steps + 1) * (hold.period / steps)
    free = hold.free(u)
    # m = -c^2 C^T P x, and C = -J^-1 [B x] / n^2
    feedback = (weights.dipole / hold.rate_rad_s) ** 2 * hold.inverse_inertia @ path[:, 3:]
    degree = degree_of_stability(multipliers(_close(transitions, path)), hold.period)
    eigenvalues = np.linalg.eigvalsh(path)
    least = float((eigenvalues[:, 0] / eigenvalues[:, -1]).min())
    residual = _residual(free, weights, path, hold.period / steps)
    return PeriodicLqr(u, path, feedback, float(degree), residual, unclosed, asymmetry, least)


def _first_solution(transitions, weights: Weights) -> np.ndarray:
    """P at the start, from the stable subspace of the monodromy matrix.

    Where that matrix is too stiff for it Q itself: the passes over the period bring it to P, too.
    """
    monodromy = np.eye(12)
    with np.errstate(over="ignore", invalid="ignore"):
        for each in transitions:
            monodromy = each @ monodromy
    if np.isfinite(monodromy).all():
        with contextlib.suppress(np.linalg.LinAlgError):  # of an order that rounding upsets
            _, vectors, inside = schur(monodromy, sort="iuc")
            p = np.linalg.solve(vectors[:6, :6].T, vectors[6:, :6].T).T
            p = 0.5 * (p + p.T)
            if inside == 6 and np.linalg.eigvalsh(p)[0] > 0.0:
                return p
    return np.diag(weights.of_state)


def _close(transitions, path) -> np.ndarray:
    """Monodromy matrix of the regulated motion: lambda = P x in every step.

    Not finite where the steps are too few for a fast motion.
    """
    x = np.eye(6)
    with np.errstate(over="ignore", invalid="ignore"):
        for t, p in zip(transitions, path[:-1], strict=True):
            x = (t[:6, :6] + t[:6, 6:] @ p) @ x
    return x


#: Derivative by nine equidistant points, of order 8.
_DIFFERENCES = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])


def _residual(free, weights: Weights, p, h: float) -> float:
    """Residual of Riccati's equation at equidistant points, over its greatest term."""
    n = len(p)
    slope = sum(d * p[k : n - 8 + k] for k, d in enumerate(_DIFFERENCES)) / h
    a, b = np.zeros((n, 6, 6)), np.zeros((n, 6, 3))
    a[:, :3, 3:], a[:, 3:], b[:, 3:] = np.eye(3), free.slopes, free.drive
    pa, pb = p @ a, weights.dipole * p @ b
    terms = (slope, *(x[4:-4] for x in (pa + pa.transpose(0, 2, 1), -pb @ pb.transpose(0, 2, 1))))
    q = np.diag(weights.of_state)
    return float(np.abs(sum(terms) + q).max() / max(np.abs(x).max() for x in (*terms, q)))
