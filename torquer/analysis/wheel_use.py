"""Reaction wheels in flight: shares of their limits, failures, total momentum."""

from dataclasses import dataclass

import numpy as np

from torquer.analysis.series import Variables
from torquer.base.language import joined, message
from torquer.scenario.spec import Scenario
from torquer.spacecraft.actuators.reaction_wheels import ReactionWheels
from torquer.spacecraft.wheel_array.envelope import momentum_envelope
from torquer.spacecraft.wheel_array.layout import total_momentum

#: Share of a limit from which a wheel is at it.
AT_LIMIT = 0.999


@dataclass(frozen=True)
class FlownWheels:
    """The wheels of a run at its n records; w wheels."""

    spec: ReactionWheels
    t_s: np.ndarray
    momentum: np.ndarray
    """(n, w): relative to the body [N m s]."""
    torque: np.ndarray
    """(n, w): commanded motor torque [N m]."""
    speed_rpm: np.ndarray
    """(n, w): relative to the body."""

    @property
    def count(self) -> int:
        """Number of wheels, failed ones included."""
        return self.momentum.shape[1]

    def limits(self, name: str) -> np.ndarray:
        """A limit of the spec, by its key, for every wheel (w,), failed ones included."""
        return np.full(self.count, getattr(self.spec, name), dtype=np.float64)

    @property
    def momentum_shares(self) -> np.ndarray:
        """(n, w): momentum as a share of its limit."""
        return np.abs(self.momentum) / self.limits("momentum_limit_n_m_s")

    @property
    def torque_shares(self) -> np.ndarray:
        """(n, w): motor torque as a share of its limit."""
        return np.abs(self.torque) / self.limits("torque_limit_n_m")

    @property
    def failed_at_s(self) -> np.ndarray:
        """(w,): time of each wheel's failure; infinite for a healthy one."""
        times = np.full(self.count, np.inf)
        times[list(self.spec.lost)] = 0.0
        for failure in self.spec.failures:
            times[failure.wheel] = failure.time_s
        return times

    @property
    def total_body(self) -> np.ndarray:
        """(n, 3): total momentum in body axes [N m s]."""
        return total_momentum(self.spec.array().axes, self.momentum)

    @property
    def minimax_share(self) -> np.ndarray:
        """(n,): smallest peak share with which the working wheels could store their total momentum.

        NaN while the working wheels do not span three dimensions.
        """
        working = self.t_s[:, None] < self.failed_at_s
        held = total_momentum(self.spec.array().axes, np.where(working, self.momentum, 0.0))
        share = np.full(len(self.t_s), np.nan)
        for state in np.unique(working, axis=0):
            rows = np.all(working == state, axis=1)
            envelope = momentum_envelope(self.spec.array().without(*np.flatnonzero(~state)))
            if envelope.rank == 3:
                share[rows] = envelope.share(held[rows])
        return share

    @property
    def spin_sign(self) -> np.ndarray:
        """(n, w): sign of each wheel's speed; 0 at rest, within rounding."""
        spins = np.abs(self.speed_rpm) > 1e-6 * self.spec.speed_limit_rpm
        return np.where(spins, np.sign(self.speed_rpm), 0.0).astype(np.int8)

    def events(self, end_s: float) -> list[tuple[float, str]]:
        """(Time [s], event) until the end: failures of wheels and their detection."""
        happened: dict[float, list[str]] = {}
        for failure in self.spec.failures:
            happened.setdefault(failure.time_s, []).append(
                message("wheel {number} fails", number=failure.wheel)
            )
            if failure.noticed_after_s > 0.0:
                detected = happened.setdefault(failure.time_s + failure.noticed_after_s, [])
                detected.append(message("wheel {number}: failure detected", number=failure.wheel))
        return [(t, joined(", ", events)) for t, events in sorted(happened.items()) if t <= end_s]


def zero_crossings(spin_sign: np.ndarray) -> int:
    """Sign changes of speed between records, over all wheels.

    `spin_sign` (n, w): sign of each wheel's speed at the records, 0 at rest.
    """
    signs = (column[column != 0] for column in spin_sign.T)
    return sum(int(np.count_nonzero(sign[1:] != sign[:-1])) for sign in signs)


def recorded_wheels(result: Variables, scenario: Scenario) -> FlownWheels | None:
    """The wheels of a result; None for a satellite without wheels."""
    if scenario.spacecraft.wheels is None:
        return None
    return FlownWheels(
        spec=scenario.spacecraft.wheels,
        t_s=result["time"].values,
        momentum=result["wheel_momentum"].values,
        torque=result["wheel_torque"].values,
        speed_rpm=result["wheel_speed"].values * (30.0 / np.pi),
    )
