"""Gains of stage 2: four weights, four Riccati equations, 15 parameters; weights by Floquet.

In a field without a part along the orbit normal the text's constant model parts into four problems:
torque about the turning axes, and about pitch, by a linear-quadratic regulator; the estimator of
the pitch axis with a constant dipole along pitch, and that of pitch with a dipole that turns in
those axes, by a Kalman filter. What is optimal there may be unstable in the field of a dipole: the
weights are chosen by the exact periodic model.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, schur
from scipy.optimize import minimize

from torquer.computer.laws.magneto_gyro.stage_2 import Gyrostat, Stage2Gains
from torquer.theory.magneto_gyro.accuracy import Revolution, follow_revolution, noise_error
from torquer.theory.magneto_gyro.craft import GyroCraft
from torquer.theory.magneto_gyro.stage_2 import stage_2_loop

#: Share of a rate's square in the regulator's cost, to that of the angle's.
_RATE = 0.1
#: Distance of h from 2 within which the Riccati equations have no solution, up to rounding.
_NO_SOLUTION = 1e-3
#: White torque in J nu0^2 for which a loop is designed, over the noise of the readings in A: one
#: at which both make errors of about the same size.
TORQUE_NOISE = 5.0
#: Where the search begins: the second is that of a quicker loop.
_STARTS = ((8.0, 40.0, 60.0, 60.0), (50.0, 100.0, 60.0, 60.0))


class Stage2Weights(NamedTuple):
    """What the four Riccati equations balance, in units of the satellite.

    `angle`: square of an angle over that of a torque; `torque`, `turning`, `constant`: roots of the
    intensities of a white torque and of random walks of the dipole across and along the pitch axis,
    over that of the noise of the angles that the field shows.
    """

    angle: float
    torque: float
    turning: float
    constant: float


def stage_2_gains(craft: Gyrostat, weights: Stage2Weights) -> Stage2Gains:
    """The 15 parameters for weights; ArithmeticError where a Riccati equation has no solution."""
    w = Stage2Weights(*weights)
    if abs(craft.stiffness - 2.0) <= _NO_SOLUTION:
        raise ArithmeticError(
            f"weights: h must be farther than {_NO_SOLUTION:g} from 2, where roll and yaw part; "
            f"received {craft.stiffness:.6g}"
        )
    try:
        d1, n1, d3, n3 = _axis_regulator(craft, w)
        d2, n2 = _pitch_regulator(craft, w)
        k5, k6, k3, k4, e3 = _axis_filter(craft, w)
        k1, k2, e2, e1 = _pitch_filter(craft, w)
    except (LinAlgError, ValueError) as error:
        raise ArithmeticError(
            f"weights: the Riccati equations must have solutions; for h = {craft.stiffness:.4g} "
            f"and {w} they have none ({error})"
        ) from error
    found = d1, d2, d3, n1, n2, n3, k1, k2, k3, k4, k5, k6, e1, e2, e3
    return Stage2Gains(*(float(x) for x in found))


def axis_matrix(stiffness: float) -> np.ndarray:
    """Motion of the pitch axis in the turning axes `[4, 4]`: phi, phi', chi, chi'."""
    h = stiffness
    return np.array(
        [[0, 1, 0, 0], [-2 * h, 0, 0, h - 2], [0, 0, 0, 1], [0, -(h - 2), -2 * h, 0]], float
    )


def _regulator(a, b, q) -> np.ndarray:
    """Gains B^T X with A^T X + X A - X B B^T X + Q = 0, by Schur's method.

    SciPy's `solve_continuous_are` takes 3.4 ms for these small matrices, this 0.06 ms.
    """
    n = len(a)
    _, u, stable = schur(np.block([[a, -b @ b.T], [-np.diag(q), -a.T]]), sort="lhp")
    if stable != n:
        raise LinAlgError(f"{stable} of {2 * n} eigenvalues are stable")
    return np.linalg.solve(u[:n, :n].T, u[n:, :n].T @ b)[:, 0]


def _filter(a, c, q) -> np.ndarray:
    """Gains X C^T of the Kalman filter, the regulator of the transposed matrices."""
    return _regulator(a.T, c.T, q)


def _axis_regulator(craft, w):
    cost = [w.angle, _RATE * w.angle]
    return _regulator(axis_matrix(craft.stiffness), np.array([[0, 0, 0, 1.0]]).T, cost + cost)


def _pitch_regulator(craft, w):
    b = np.array([[0.0], [1.0 / craft.pitch_inertia]])
    return _regulator(np.array([[0, 1.0], [0, 0]]), b, [w.angle, _RATE * w.angle])


def _axis_filter(craft, w):
    """k5, k6, k3, k4, e3: chi is seen, a constant torque about s' is estimated, too."""
    a = np.zeros((5, 5))
    a[:4, :4], a[3, 4] = axis_matrix(craft.stiffness), 1.0
    noise = [0.0, w.torque**2, 0.0, w.torque**2, w.constant**2]
    return _filter(a, np.array([[0, 0, 1.0, 0, 0]]), noise)


def _pitch_filter(craft, w):
    """k1, k2, e2, e1: pitch is seen, a torque that oscillates with nu0 is estimated, too."""
    i = craft.pitch_inertia
    a = np.array([[0, 1, 0, 0], [0, 0, 1 / i, 0], [0, 0, 0, 1], [0, 0, -1, 0]], float)
    noise = [0.0, (w.torque / i) ** 2, w.turning**2, w.turning**2]
    k1, k2, e2, e1 = _filter(a, np.array([[1.0, 0, 0, 0]]), noise)
    return k1, i * k2, e2, e1


class Stage2Design(NamedTuple):
    """Chosen weights and gains; least Floquet degree per 1/nu0 over the fields designed for."""

    weights: Stage2Weights
    gains: Stage2Gains
    degree: float
    evaluations: int


def search_cost(rounds: Sequence[Revolution], wanted_degree: float) -> float:
    """What the search makes least, of the loop in each of the fields designed for.

    The logarithm of the error in the first of them, under white noise of the readings and a white
    torque `TORQUE_NOISE` times as strong; and a penalty where the least degree is below the wanted
    one, or the loop is not stable.
    """
    degree = min(around.degree for around in rounds)
    lack = max(0.0, wanted_degree - degree) / wanted_degree
    if not degree > 0.0:
        return 100.0 + 100.0 * min(lack, 1e3)
    error = noise_error(rounds[0], [TORQUE_NOISE**2] * 3 + [1.0] * 3)
    return math.log(float(np.linalg.norm(error))) + 10.0 * lack + 100.0 * lack**2


def design_stage_2(
    craft: GyroCraft,
    *,
    normals: Sequence[float] = (0.0,),
    form: str = "field",
    wanted_degree: float = 0.25,
    evaluations: int = 120,
) -> Stage2Design:
    """Gains of stage 2 for a satellite; ArithmeticError if no loop found is stable.

    `normals`: parts of the field along the orbit normal (over A) that it is to meet, the usual one
    first: they change with the tilt of the dipole as the Earth turns. `wanted_degree` per 1/nu0;
    `evaluations`: most of each of the two searches.
    """

    def rounds(weights):
        gains = stage_2_gains(craft.gyrostat, weights)
        loops = (
            stage_2_loop(craft.satellite(), craft.gyrostat, gains, normal=b, form=form)
            for b in normals
        )
        return [follow_revolution(loop) for loop in loops]

    def cost(logs):
        try:
            return search_cost(rounds(Stage2Weights(*np.exp(logs).tolist())), wanted_degree)
        except ArithmeticError:
            return 1e6

    options = {"maxfev": evaluations, "xatol": 0.03, "fatol": 2e-3}
    tried = [minimize(cost, np.log(w), method="Nelder-Mead", options=options) for w in _STARTS]
    best = Stage2Weights(*np.exp(min(tried, key=lambda found: found.fun).x).tolist())
    degree = min(around.degree for around in rounds(best))
    if not degree > 0.0:
        raise ArithmeticError(
            f"design: a stable loop must be found for h = {craft.stiffness:.4g}; the best has a "
            f"degree of {degree:.3g}"
        )
    count = sum(found.nfev for found in tried)
    return Stage2Design(best, stage_2_gains(craft.gyrostat, best), degree, count)
