"""What the readings of a window alone reveal of a filter's states: the observability Gramian.

G = sum over the readings of (H Phi)^T R^-1 (H Phi), Phi the transition from the window's start. Its
states are scaled by their standard deviations at the filter's start. A singular value s then means
that the readings of the window alone would give this combination of states a standard deviation of
1/sqrt(s) times its initial one. Below one they add little: a gap. P. Maybeck, 'Stochastic models,
estimation, and control', vol. 1 (1979), 2.5 and 5.4.
"""

from typing import NamedTuple

import numpy as np

from torquer.analysis.filters.linear_covariance import (
    first_variances,
    held_motion,
    kalman_filter,
    nominal,
    true_surroundings,
)
from torquer.computer.estimation.covariance import state_slices
from torquer.computer.estimation.expected import Nominal, fill_information
from torquer.computer.estimation.kalman_dynamics import KalmanDynamics
from torquer.maths.geometry.attitudes import to_body
from torquer.scenario.spec import Scenario


class Observability(NamedTuple):
    """Windows of a motion: from `from_s` to `to_s` (w,).

    `singular` (w, n): singular values of the scaled Gramian, greatest first; `weakest` (w, n): the
    unit combination of scaled states that belongs to the last one; `states`: names, of three each.
    """

    from_s: np.ndarray
    to_s: np.ndarray
    singular: np.ndarray
    weakest: np.ndarray
    states: tuple[str, ...]

    @property
    def gaps(self) -> np.ndarray:
        """Windows (w,) whose readings leave some combination of states as unknown as it was."""
        return self.singular[:, -1] < 1.0

    def weakest_state(self, window: int) -> str:
        """Name of the states that contribute most to the weakest combination."""
        parts = np.sum(self.weakest[window].reshape(-1, 3) ** 2, axis=1)
        return self.states[int(np.argmax(parts))]


def observability(scenario: Scenario, window_s: float) -> Observability:
    """Observability of the states of the scenario's filter in consecutive windows.

    The motion is that of `held_motion`. ValueError unless `control.estimator` is a Kalman filter,
    or for a window that is longer than the motion or shorter than two readings.
    """
    spec = kalman_filter(scenario)
    seen = nominal(scenario, held_motion(scenario))
    steps = round(window_s * (len(seen.t_s) - 1) / (seen.t_s[-1] - seen.t_s[0]))
    if not 2 <= steps < len(seen.t_s):
        raise ValueError(
            f"window_s: must hold two control steps or more and fit into the run of "
            f"{seen.t_s[-1]:g} s; received {window_s:g} s"
        )
    sigma = np.sqrt(first_variances(spec))
    each = transitions(spec, seen), information(spec, seen)
    first = np.arange(0, len(seen.t_s) - steps, steps)
    scaled = sigma[:, None] * gramians(*each, first, steps) * sigma
    values, vectors = np.linalg.eigh(scaled)
    singular = np.maximum(values[:, ::-1], 0.0)
    return Observability(
        seen.t_s[first], seen.t_s[first + steps], singular, vectors[:, :, 0], filter_states(spec)
    )


def filter_states(spec) -> tuple[str, ...]:
    """Names of a filter's states, of three components each."""
    return tuple(name.replace("_", " ") for name in spec.initial_variances())


def gramians(phi: np.ndarray, gained: np.ndarray, first: np.ndarray, steps: int) -> np.ndarray:
    """Gramians (w, n, n) of windows of `steps` readings that begin at the indices `first` (w,).

    `phi` (k - 1, n, n): transitions; `gained` (k, n, n): information of each instant's readings.
    """
    g = gained[first + steps - 1]
    for k in range(steps - 2, -1, -1):
        f = phi[first + k]
        g = gained[first + k] + np.swapaxes(f, 1, 2) @ g @ f
    return g


def information(spec, seen: Nominal) -> np.ndarray:
    """H^T R^-1 H (k, n, n) of each instant's readings."""
    return reading_information(spec, seen, true_surroundings(seen))[0]


def reading_information(spec, seen: Nominal, assumed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """H^T R^-1 H (k, n, n) of each instant's readings, and H^T R^-1 d (k, n).

    `assumed` (channels, k, 3): what the filter assumes, see
    `torquer.analysis.filters.linear_covariance.surroundings`; d: what true readings differ from it.
    """
    n = len(first_variances(spec))
    gained, pulled = np.zeros((len(seen.t_s), n, n)), np.zeros((len(seen.t_s), n))
    fill_information(spec.constants(), seen, assumed, gained, pulled)
    return gained, pulled


def transitions(spec, seen: Nominal) -> np.ndarray:
    """Transition matrices (k - 1, n, n) of small errors from one control step to the next."""
    f = rates_of_change(spec, seen)[:-1]
    by = f * np.diff(seen.t_s)[:, None, None]
    return np.eye(f.shape[1]) + by + by @ by / 2.0 + by @ by @ by / 6.0


def rates_of_change(spec, seen: Nominal) -> np.ndarray:
    """F (k, n, n) of the linear motion of small errors, dx/dt = F x."""
    n = len(first_variances(spec))
    f = np.zeros((len(seen.t_s), n, n))
    f[:, :3, :3] = -cross_matrices(seen.omega)
    if not isinstance(spec, KalmanDynamics):
        f[:, :3, 3:6] = -np.eye(3)
        at = state_slices(spec.variances())
        if at.gyro_scale:
            f[:, :3, at.gyro_scale : at.gyro_scale + 3] = -np.eye(3) * seen.omega[:, None, :]
        if at.gyro_misalignment:
            columns = slice(at.gyro_misalignment, at.gyro_misalignment + 3)
            f[:, :3, columns] = -cross_matrices(seen.omega)
        return f
    inertia = np.array(spec.inertia_kg_m2)
    inverse = np.linalg.inv(inertia)
    g = to_body(seen.q, seen.gravity)
    across = cross_matrices(g)
    gravity = (across @ inertia - cross_matrices(g @ inertia)) @ across
    momentum = seen.omega @ inertia + seen.wheels + np.array(spec.wheel_momentum_n_m_s)
    f[:, :3, 3:6] = np.eye(3)
    f[:, 3:6, :3] = inverse @ gravity
    f[:, 3:6, 3:6] = inverse @ (cross_matrices(momentum) - cross_matrices(seen.omega) @ inertia)
    if spec.dipole_sigma_a_m2:
        f[:, 3:6, 6:9] = -inverse @ cross_matrices(to_body(seen.q, seen.b))
    return f


def cross_matrices(v: np.ndarray) -> np.ndarray:
    """v x, as matrices (k, 3, 3) of vectors (k, 3)."""
    return np.cross(np.eye(3), v[:, None, :])
