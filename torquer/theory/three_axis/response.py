"""Steady pointing error of a held attitude, sampled: periodic response and covariance.

Under constant and periodic disturbances the linear equations have one periodic solution; under
noise the covariance becomes periodic, too. Both are found exactly, cycle by cycle. Angles are small
turns from the wanted attitude: beyond 0.34 rad gravity's linear torque is off by a tenth.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_discrete_lyapunov

from torquer.base import validate
from torquer.compile.engine import kernel
from torquer.theory.periodic.floquet import multipliers
from torquer.theory.three_axis.sampled import SOURCES, SampledHold
from torquer.theory.validity import LEAN, VALID, Doubt, Limit, Verdict, judge, within

CONSTANT, READINGS = "constant torque", "sensor offsets"


class Noise(NamedTuple):
    """Standard deviations about each axis, independent at every command: attitude [rad], rate
    [rad/s]; random torque [N m] held for `torque_hold_s`.
    """

    attitude_rad: float = 0.0
    rate_rad_s: float = 0.0
    torque_n_m: float = 0.0
    torque_hold_s: float = 1.0


class Offsets(NamedTuple):
    """Constant errors of what the law reads, in body axes: attitude [rad], rate [rad/s]."""

    attitude_rad: tuple = (0.0, 0.0, 0.0)
    rate_rad_s: tuple = (0.0, 0.0, 0.0)


@kernel
def walk(steps, pushes, x):
    """Fill the states x `[n + 1, 6, m]` after x[0]: next = step times state + push."""
    for cycle in range(steps.shape[0]):
        for r in range(6):
            for c in range(x.shape[2]):
                total = pushes[cycle, r, c]
                for k in range(6):
                    total += steps[cycle, r, k] * x[cycle, k, c]
                x[cycle + 1, r, c] = total


@kernel
def walk_covariance(steps, added, half, p):
    """Fill the covariances p `[n + 1, 6, 6]` after p[0]: next = M p M^T + added; `half`: room."""
    for cycle in range(steps.shape[0]):
        for r in range(6):
            for c in range(6):
                half[r, c] = 0.0
                for k in range(6):
                    half[r, c] += steps[cycle, r, k] * p[cycle, k, c]
        for r in range(6):
            for c in range(6):
                total = added[cycle, r, c]
                for k in range(6):
                    total += half[r, k] * steps[cycle, c, k]
                p[cycle + 1, r, c] = total


@dataclass(frozen=True)
class PointingError:
    """Steady error of a held attitude, at the commands of a period.

    `u` `[n]`; `turns` `[n, 3]`: small turn [rad] in body axes under all disturbances; `by_source`:
    the same of each (SOURCES, constant torque, sensor offsets); `noise_rad` `[n, 3]`: standard
    deviations; `dipoles_a_m2` `[n, 3]`: what the law asks for without noise. `verdict`: whether
    the linear theory and the coils' limit are kept.
    """

    u: np.ndarray
    turns: np.ndarray
    by_source: dict[str, np.ndarray]
    noise_rad: np.ndarray
    dipoles_a_m2: np.ndarray
    verdict: Verdict = VALID

    @property
    def greatest_rad(self) -> float:
        """Greatest angle without noise."""
        return greatest_angle(self.turns)

    @property
    def is_linear(self) -> bool:
        """Whether the greatest angle is one of which the linear theory can tell."""
        return LEAN.holds(self.greatest_rad)

    @property
    def rms_rad(self) -> float:
        """Root mean square of the angle, noise included."""
        return math.sqrt(float(np.mean(np.sum(self.turns**2 + self.noise_rad**2, axis=1))))

    @property
    def noise_rms_rad(self) -> float:
        """Root mean square of the angle by noise alone."""
        return math.sqrt(float(np.mean(np.sum(self.noise_rad**2, axis=1))))


def greatest_angle(turns) -> float:
    """Greatest length of turns `[n, 3]`."""
    return float(np.linalg.norm(turns, axis=1).max())


def pointing_error(
    sampled: SampledHold,
    constant_torque_n_m=(0.0, 0.0, 0.0),
    noise: Noise | None = None,
    offsets: Offsets | None = None,
    limit_a_m2: float = math.inf,
) -> PointingError:
    """Steady error under gravity gradient, residual dipole, air, constant torque, sensor errors.

    ArithmeticError for a loop that is not stable.
    """
    torque = validate.finite("constant_torque_n_m", constant_torque_n_m, (3,))
    maps, gains = sampled.maps, sampled.gains()[0]
    steps = maps.free + maps.dipole @ gains
    over_period = _over_period(steps)
    if not np.abs(multipliers(over_period)[0]) < 1.0:
        raise ArithmeticError(
            f"law {sampled.hold.law.name}: must be stable for a steady error to exist; it is not"
        )
    wrong = sampled.readout @ _wrong(sampled, offsets)
    asked = np.einsum("nij,nj->ni", gains, wrong)
    own = maps.torque @ torque, np.einsum("nij,nj->ni", maps.dipole, asked)
    pushes = np.concatenate([maps.disturbed, np.stack(own, axis=2)], axis=2)
    x = _periodic(steps, pushes, over_period)
    names, total = (*SOURCES, CONSTANT, READINGS), x.sum(axis=2)
    noisy = _noise(sampled, steps, gains, over_period, noise or Noise())
    dipoles = np.einsum("nij,nj->ni", gains, total) + asked
    return PointingError(
        sampled.starts,
        total[:, :3],
        {name: x[:, :3, k] for k, name in enumerate(names)},
        noisy,
        dipoles,
        _judge(total[:, :3], noisy, dipoles, limit_a_m2),
    )


def _wrong(sampled: SampledHold, offsets: Offsets | None) -> np.ndarray:
    """Errors of the readings `[6]`: turn, rate over n."""
    attitude, rate = offsets or Offsets()
    validate.finite("offsets: attitude_rad", attitude, (3,))
    validate.finite("offsets: rate_rad_s", rate, (3,))
    return np.append(attitude, np.asarray(rate) / sampled.hold.rate_rad_s)


def _over_period(steps) -> np.ndarray:
    x = np.empty((len(steps) + 1, 6, 6))
    x[0] = np.eye(6)
    walk(steps, np.zeros((len(steps), 6, 6)), x)
    return x[-1]


def _periodic(steps, pushes, over_period) -> np.ndarray:
    """Periodic states `[n, 6, m]` under pushes `[n, 6, m]`."""
    x = np.zeros((len(steps) + 1, 6, pushes.shape[2]))
    walk(steps, pushes, x)
    x[0] = np.linalg.solve(np.eye(6) - over_period, x[-1])
    walk(steps, pushes, x)
    return x[:-1]


def _noise(sampled: SampledHold, steps, gains, over_period, noise: Noise) -> np.ndarray:
    """Standard deviations `[n, 3]` [rad] of the periodic covariance."""
    for name, value in noise._asdict().items():
        within(Limit(f"noise: {name}", 0.0), value)
    maps, n = sampled.maps, sampled.hold.rate_rad_s
    spread = np.array([noise.attitude_rad] * 3 + [noise.rate_rad_s / n] * 3)
    by_reading = maps.dipole @ gains @ (sampled.readout * spread)
    # held for longer or shorter than a cycle, a random torque has the same spectral density
    held = noise.torque_n_m * math.sqrt(noise.torque_hold_s / maps.cycle_s)
    by_torque = maps.torque * held
    added = by_reading @ by_reading.transpose(0, 2, 1) + by_torque @ by_torque.transpose(0, 2, 1)
    p, half = np.zeros((len(steps) + 1, 6, 6)), np.empty((6, 6))
    if not added.any():
        return np.zeros((len(steps), 3))
    walk_covariance(steps, added, half, p)
    p[0] = solve_discrete_lyapunov(over_period, p[-1], method="bilinear")
    walk_covariance(steps, added, half, p)
    return np.sqrt(np.maximum(np.diagonal(p[:-1], axis1=1, axis2=2)[:, :3], 0.0))


SATURATES = Limit(
    "dipole asked for, over the coils' limit", most=1.0,
    why="the coils saturate, and the error is greater",
    of="steady error of a three-axis hold", shown="the definition of saturation",
)  # fmt: skip


def _judge(turns, noisy, dipoles, limit_a_m2) -> Verdict:
    """The verdict on the error; beyond the linear range it is not told, for it would mislead."""
    angle = math.hypot(greatest_angle(turns), greatest_angle(noisy))
    beyond = Doubt(LEAN, angle, f"error beyond {LEAN.most:g} rad: {LEAN.why}")
    lean = () if LEAN.holds(angle) else (beyond,)
    return Verdict((*lean, *judge((SATURATES, float(np.abs(dipoles).max()) / limit_a_m2)).doubts))
