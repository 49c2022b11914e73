"""Error of stage 2 along the orbit: under noise, and under constant torque, bias or dipole.

The loop is tabulated at equal steps of a revolution and its transitions taken by the classical
Runge-Kutta method; noise is put in at the middle of each step.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import solve_discrete_lyapunov

from torquer.compile.engine import released
from torquer.theory.magneto_gyro.stage_2 import (
    INPUTS,
    ORDER,
    stage_2_inputs,
    stage_2_matrix,
)
from torquer.theory.periodic.floquet import degree_of_stability, multipliers
from torquer.theory.periodic.periodic_systems import PeriodicSystem

#: Steps of a revolution; those whose matrices are computed at a time (a tenth faster than all).
STEPS, _TOGETHER = 360, 60


@dataclass(frozen=True)
class Revolution:
    """A loop over a revolution: step; transition matrices `[steps, 15, 15]`; what inputs of each
    step make of the state at its end, over its length, `[steps, 15, 6]`."""

    step: float
    transitions: np.ndarray
    inputs: np.ndarray

    @cached_property
    def monodromy(self) -> np.ndarray:
        """Transition matrix of the revolution `[15, 15]`."""
        whole = np.eye(ORDER)
        with np.errstate(over="ignore", invalid="ignore"):  # of a loop that grows beyond floats
            for part in self.transitions:
                whole = part @ whole
        return whole

    @cached_property
    def degree(self) -> float:
        """Floquet degree of stability per 1/nu0; minus infinity where it grows beyond floats."""
        whole = self.monodromy
        if not np.isfinite(whole).all():
            return -math.inf
        return float(degree_of_stability(multipliers(whole), 2.0 * math.pi))


@released
def _tabulate(parameters, taus, matrices, inputs):
    for i in range(len(taus)):
        stage_2_matrix(taus[i], parameters, matrices[i])
        stage_2_inputs(taus[i], parameters, inputs[i])


def follow_revolution(loop: PeriodicSystem, steps: int = STEPS) -> Revolution:
    """A loop of stage 2 over a revolution."""
    taus = np.linspace(0.0, 2.0 * math.pi, 2 * steps + 1)
    a, g = np.empty((len(taus), ORDER, ORDER)), np.empty((len(taus), ORDER, INPUTS))
    _tabulate(loop.pack(), taus, a, g)
    h = taus[2]
    inputs = (np.eye(ORDER) + 0.5 * h * a[1::2]) @ g[1::2]
    return Revolution(h, transition_matrices(a, h), inputs)


def transition_matrices(matrices: np.ndarray, step: float) -> np.ndarray:
    """Transition matrices `[n, k, k]` over steps, from A at their ends and middles.

    `matrices` `[2n + 1, k, k]`. By the classical Runge-Kutta method.
    """
    h, one = step, np.eye(matrices.shape[-1])
    found = np.empty((len(matrices) // 2, *one.shape))
    for start in range(0, len(found), _TOGETHER):
        some = matrices[2 * start : 2 * (start + _TOGETHER) + 1]
        first, middle, last = some[:-1:2], some[1::2], some[2::2]
        k2 = middle @ (one + 0.5 * h * first)
        k3 = middle @ (one + 0.5 * h * k2)
        k4 = last @ (one + h * k3)
        found[start : start + _TOGETHER] = one + h / 6.0 * (first + 2.0 * (k2 + k3) + k4)
    return found


def covariances(around: Revolution, intensities) -> np.ndarray:
    """Covariances of the state at the steps `[steps, 15, 15]` under white noise of the inputs.

    `intensities` `[6]`: of torque and reading about t, w, s, squares times 1/nu0. ArithmeticError
    for a loop that is not stable.
    """
    if not around.degree > 0.0:
        raise ArithmeticError(
            f"covariance: the loop must be stable; its degree is {around.degree:.3g}"
        )
    noise = around.inputs * np.sqrt(around.step * np.asarray(intensities))
    added = noise @ noise.transpose(0, 2, 1)
    total = np.zeros((ORDER, ORDER))
    for part, each in zip(around.transitions, added, strict=True):
        total = part @ total @ part.T + each
    path = [solve_discrete_lyapunov(around.monodromy, total)]
    for part, each in zip(around.transitions[:-1], added[:-1], strict=True):
        path.append(part @ path[-1] @ part.T + each)
    return np.array(path)


def noise_error(around: Revolution, intensities) -> np.ndarray:
    """Root mean square of roll, pitch, yaw [rad] `[3]` under white noise of the inputs."""
    variances = np.einsum("nii->ni", covariances(around, intensities))[:, :3]
    return np.sqrt(variances.mean(axis=0))


def steady_motion(around: Revolution, inputs) -> np.ndarray:
    """Periodic state `[steps, 15]` under inputs, constant `[6]` or at the steps `[steps, 6]`."""
    pushed = np.einsum(
        "nij,nj->ni", around.inputs, np.broadcast_to(inputs, (len(around.inputs), 6))
    )
    pushed = around.step * pushed
    total = np.zeros(ORDER)
    for part, each in zip(around.transitions, pushed, strict=True):
        total = part @ total + each
    path = [np.linalg.solve(np.eye(ORDER) - around.monodromy, total)]
    for part, each in zip(around.transitions[:-1], pushed[:-1], strict=True):
        path.append(part @ path[-1] + each)
    return np.array(path)
