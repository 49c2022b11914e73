"""Frozen models next to the exact periodic ones: stability, roots, error under noise.

Stability over the gains of stage 1, over h, over a factor of the gains. Degrees are per 1/nu0: the
least decay rate of the frozen model's roots, and of the periodic loop in the field of a dipole with
gravity gradient.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_continuous_lyapunov
from scipy.optimize import linear_sum_assignment

from torquer.computer.laws.magneto_gyro.stage_2 import Gyrostat, Stage2Gains
from torquer.theory.magneto_gyro.accuracy import follow_revolution
from torquer.theory.magneto_gyro.capture import DAMPING
from torquer.theory.magneto_gyro.craft import GyroCraft
from torquer.theory.magneto_gyro.frozen import (
    COMPENSATOR,
    STATES_2,
    frozen_1,
    frozen_2,
    frozen_2_inputs,
)
from torquer.theory.magneto_gyro.stage_1 import STAGE_1
from torquer.theory.magneto_gyro.stage_2 import stage_2_loop
from torquer.theory.periodic.floquet import degree_of_stability, multipliers, transitions
from torquer.theory.periodic.periodic_systems import PeriodicSystem


class Degrees(NamedTuple):
    """Degrees of stability per 1/nu0 of the frozen and of the exact model, arrays of one shape."""

    frozen: np.ndarray
    exact: np.ndarray


def decay(matrices) -> np.ndarray:
    """Least decay rate of constant models `[..., n, n]`; negative if one motion grows."""
    return -np.linalg.eigvals(matrices).real.max(axis=-1)


class CaptureGains(NamedTuple):
    """Gains of stage 1, numbers or arrays that are broadcast: K/(J nu0^2), N/(J nu0), frequency of
    the filters over nu0; their damping ratio."""

    angle_gain: np.ndarray | float
    rate_gain: np.ndarray | float
    frequency: np.ndarray | float
    damping: float = DAMPING


def stage_1_frozen(craft: GyroCraft, gains: CaptureGains, normal: float = 0.0) -> np.ndarray:
    """The frozen model of stage 1 `[12, 12]` for gains that are numbers."""
    k, n = (float(x) / (1.0 + normal**2) for x in gains[:2])
    h, i = craft.gyrostat
    return frozen_1(k, n, gains.damping, gains.frequency, stiffness=h, pitch_inertia=i, b=normal)


def stage_1_loop(craft: GyroCraft, gains: CaptureGains, normal: float = 0.0) -> PeriodicSystem:
    """The exact model of stage 1 for gains that are numbers."""
    return STAGE_1.with_parameters(**craft.satellite()._asdict(), **gains._asdict(), normal=normal)


def stage_1_degrees(
    craft: GyroCraft, gains: CaptureGains, stiffness=None, normal: float = 0.0
) -> Degrees:
    """Stage 1 at points; `stiffness`: h by the wheel, the satellite's own if left out; `normal`:
    the field's part along the orbit normal over A.

    Where the filters themselves are unstable, the exact degree is right in its sign alone.
    """
    h = craft.stiffness if stiffness is None else stiffness
    points = np.broadcast_arrays(*(np.asarray(x, float) for x in (*gains[:3], h)))
    columns = np.stack([each.ravel() for each in points], axis=1)
    crafts = [craft.with_wheel(craft.wheel_at(row[3])) for row in columns]
    frozen = decay(
        np.array(
            [
                stage_1_frozen(each, CaptureGains(row[0], row[1], row[2], gains.damping), normal)
                for each, row in zip(crafts, columns, strict=True)
            ]
        )
    )
    fixed = craft.satellite()._asdict() | {"damping": gains.damping, "normal": normal}
    values = dict(zip(("angle_gain", "rate_gain", "frequency"), columns[:, :3].T, strict=True))
    values["wheel"] = np.array([each.satellite().wheel for each in crafts])
    found = transitions(STAGE_1.with_parameters(**fixed), values, tolerance=1e-5)
    exact = degree_of_stability(multipliers(found.matrices), 2.0 * math.pi)
    return Degrees(frozen.reshape(points[0].shape), exact.reshape(points[0].shape))


def stage_2_degrees(
    crafts, gains_of: Callable[[Gyrostat], Stage2Gains], *, normal: float = 0.0, form: str = "field"
) -> Degrees:
    """Stage 2 of satellites, whose law knows them; NaN where `gains_of` finds no gains."""
    found = []
    for craft in crafts:
        try:
            gains = gains_of(craft.gyrostat)
        except ArithmeticError:
            found.append((math.nan, math.nan))
            continue
        h, i = craft.gyrostat
        loop = stage_2_loop(craft.satellite(), craft.gyrostat, gains, normal=normal, form=form)
        frozen = decay(frozen_2(gains, stiffness=h, pitch_inertia=i, b=normal))
        found.append((float(frozen), follow_revolution(loop).degree))
    return Degrees(*np.array(found).T)


def with_factor(gains: Stage2Gains, factor: float) -> Stage2Gains:
    """The gains with those of angles and rates, the first six, times a factor."""
    values = np.array(gains, float)
    values[:6] *= factor
    return Stage2Gains(*values.tolist())


def locus(matrices) -> np.ndarray:
    """Roots `[points, n]` of constant models `[points, n, n]`, each followed through the points."""
    roots = [np.sort_complex(np.linalg.eigvals(matrices[0]))]
    for matrix in matrices[1:]:
        found = np.linalg.eigvals(matrix)
        _, order = linear_sum_assignment(np.abs(roots[-1][:, None] - found[None, :]))
        roots.append(found[order])
    return np.array(roots)


def frozen_covariance(
    gains: Stage2Gains, craft: Gyrostat, intensities, normal: float = 0.0
) -> np.ndarray:
    """Covariance `[15, 15]` of the states of the frozen model of stage 2 under white noise.

    `intensities` `[6]`: of torque and reading about t', w, s', squares times 1/nu0. ArithmeticError
    for a model that is not stable.
    """
    h, i = craft
    whole = frozen_2(gains, stiffness=h, pitch_inertia=i, b=normal)
    if not decay(whole) > 0.0:
        raise ArithmeticError(
            f"covariance: the model must be stable; its degree is {decay(whole):.3g}"
        )
    driven = frozen_2_inputs(gains, pitch_inertia=i) * np.sqrt(intensities)
    return solve_continuous_lyapunov(whole, -driven @ driven.T)


def frozen_error(covariance: np.ndarray, tau) -> np.ndarray:
    """Root mean squares of roll, pitch, yaw [rad] `[..., 3]` at tau from the magnetic node."""
    phi, chi, theta = (STATES_2.index(name) for name in ("phi", "chi", "theta"))
    c, s = np.cos(tau), np.sin(tau)
    both = 2.0 * c * s * covariance[phi, chi]
    roll = c * c * covariance[phi, phi] + s * s * covariance[chi, chi] + both
    yaw = s * s * covariance[phi, phi] + c * c * covariance[chi, chi] - both
    pitch = np.full_like(roll, covariance[theta, theta])
    return np.sqrt(np.stack([roll, pitch, yaw], axis=-1))


def dipole_response(
    gains: Stage2Gains, craft: Gyrostat, frequencies, torque, normal: float = 0.0
) -> np.ndarray:
    """Amplitudes of phi, theta, chi [rad] `[n, 3]` under a torque that oscillates.

    `frequencies` over nu0; `torque` in J nu0^2 about t', w, s', complex, `[3]` or at each frequency
    `[n, 3]`. Where all gains of the compensator are zero it is left out.
    """
    h, i = craft
    matrix = frozen_2(gains, stiffness=h, pitch_inertia=i, b=normal)
    torques = np.broadcast_to(np.asarray(torque, complex), (len(frequencies), 3))
    pushed = torques @ frozen_2_inputs(gains, pitch_inertia=i)[:, :3].T
    kept = [k for k, name in enumerate(STATES_2) if any(gains[12:]) or name not in COMPENSATOR]
    angles = [kept.index(STATES_2.index(name)) for name in ("phi", "theta", "chi")]
    s = 1j * np.asarray(frequencies)[:, None, None]
    whole = s * np.eye(len(kept)) - matrix[np.ix_(kept, kept)]
    return np.abs(np.linalg.solve(whole, pushed[:, kept, None])[:, angles, 0])


def dipole_torque(frequencies, normal: float = 0.0) -> dict[str, np.ndarray]:
    """Torques `[n, 3]` about t', w, s' of a unit dipole of the body, complex.

    'along pitch': a dipole that oscillates with these frequencies; 'across pitch': one whose part
    along s' does; that of a constant dipole oscillates with nu0.
    """
    s, one = 1j * np.asarray(frequencies), np.ones(len(frequencies))
    return {
        "along pitch": np.stack([0.0 * one, 0.0 * one, -one], axis=1).astype(complex),
        "across pitch": np.stack([-normal * one, one, normal * s], axis=1),
    }
