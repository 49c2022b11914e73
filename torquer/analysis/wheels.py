"""Reaction wheels as they were flown: shares of the limits, failures, the momentum of all."""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from torquer.scenario.spec import Scenario
from torquer.spacecraft.wheels import ReactionWheels
from torquer.wheel_array.envelope import momentum_envelope
from torquer.wheel_array.layout import total_momentum

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
    """(n, w): what the motors were asked for [N m]."""
    speed_rpm: np.ndarray
    """(n, w): relative to the body."""

    @property
    def count(self) -> int:
        """Number of wheels, dead ones included."""
        return self.momentum.shape[1]

    def limits(self, name: str) -> np.ndarray:
        """A limit of the spec, by its key, for every wheel (w,), dead ones included."""
        return np.full(self.count, getattr(self.spec, name), dtype=np.float64)

    @property
    def momentum_shares(self) -> np.ndarray:
        """(n, w): size of the momentum in parts of its limit."""
        return np.abs(self.momentum) / self.limits("momentum_limit_n_m_s")

    @property
    def torque_shares(self) -> np.ndarray:
        """(n, w): size of the motor torque in parts of its limit."""
        return np.abs(self.torque) / self.limits("torque_limit_n_m")

    @property
    def dead_from_s(self) -> np.ndarray:
        """(w,): time of each wheel's death; infinite for one that lives on."""
        times = np.full(self.count, np.inf)
        times[list(self.spec.lost)] = 0.0
        for failure in self.spec.failures:
            times[failure.wheel] = failure.time_s
        return times

    @property
    def total_body(self) -> np.ndarray:
        """(n, 3): momentum of all wheels together, in body axes [N m s]."""
        return total_momentum(self.spec.array().axes, self.momentum)

    @property
    def needed_share(self) -> np.ndarray:
        """(n,): the least greatest share with which the working wheels could hold what they hold.

        Not a number while fewer than three wheels, or three in a plane, work.
        """
        alive = self.t_s[:, None] < self.dead_from_s
        held = total_momentum(self.spec.array().axes, np.where(alive, self.momentum, 0.0))
        share = np.full(len(self.t_s), np.nan)
        for state in np.unique(alive, axis=0):
            rows = np.all(alive == state, axis=1)
            envelope = momentum_envelope(self.spec.array().without(*np.flatnonzero(~state)))
            if envelope.rank == 3:
                share[rows] = envelope.share(held[rows])
        return share

    @property
    def turning(self) -> np.ndarray:
        """(n, w): sign of each wheel's speed; 0 for a standing one, which has a rounding error."""
        turns = np.abs(self.speed_rpm) > 1e-6 * self.spec.speed_limit_rpm
        return np.where(turns, np.sign(self.speed_rpm), 0.0).astype(np.int8)

    def events(self, end_s: float) -> list[tuple[float, str]]:
        """(Time [s], what happens) until the end: wheels fail, and the computer notices."""
        happened: dict[float, list[str]] = {}
        for failure in self.spec.failures:
            told = happened.setdefault(failure.time_s, [])
            told.append(f"wheel {failure.wheel} fails")
            if failure.noticed_after_s > 0.0:
                noticed = happened.setdefault(failure.time_s + failure.noticed_after_s, [])
                noticed.append(f"wheel {failure.wheel}: noticed")
        return [(t, ", ".join(told)) for t, told in sorted(happened.items()) if t <= end_s]


def zero_crossings(turning: np.ndarray) -> int:
    """How often a speed changes its sign from one record to another, all wheels together.

    `turning` (n, w): as `FlownWheels.turning` has it.
    """
    signs = (column[column != 0] for column in turning.T)
    return sum(int(np.count_nonzero(sign[1:] != sign[:-1])) for sign in signs)


def wheels_of(result: xr.Dataset, scenario: Scenario) -> FlownWheels | None:
    """The wheels of a result, None for a satellite without."""
    if scenario.spacecraft.wheels is None:
        return None
    return FlownWheels(
        spec=scenario.spacecraft.wheels,
        t_s=result["time"].values,
        momentum=result["wheel_momentum"].values,
        torque=result["wheel_torque"].values,
        speed_rpm=result["wheel_speed"].values * (30.0 / np.pi),
    )
