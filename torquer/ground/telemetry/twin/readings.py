"""Readings to which a twin is fitted: magnetometer, gyro and, where it is seen, the Sun."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import xarray as xr

from torquer.base.limits import RequestError
from torquer.base.time import seconds_between
from torquer.environment.field.along import angles_deg
from torquer.ground.telemetry.modulus import session_start
from torquer.ground.telemetry.twin.flights import States
from torquer.maths.geometry.attitudes import to_body
from torquer.scenario.spec import Scenario

#: Seconds and rows of the first window; rows that are fitted at most.
_FIRST_S, _FIRST_ROWS, _MOST_ROWS = 60.0, 4, 240
#: Readings beyond this many standard deviations of the field's strength, or of its angle to the
#: Sun, are left out.
_OUTLIER = 5.0
#: Least errors of a gyro [rad/s] and of a Sun sensor [rad].
_LEAST_GYRO, _LEAST_SUN = 2e-5, 1e-4
#: Part of the Sun's disc, and of a unit vector's length, below which the Sun is not seen.
_DARK = 0.5


class Sunlight(NamedTuple):
    """Rows [m]: unit vectors to the Sun, read in the body (NaN where it is not seen) and in J; the
    standard deviation of a reading about each axis across it [rad]."""

    seen: np.ndarray
    to_sun_j: np.ndarray
    sigma: float

    def across(self) -> np.ndarray:
        """Two unit vectors [m, 2, 3] across each reading."""
        least = np.eye(3)[np.argmin(np.abs(np.nan_to_num(self.seen)), axis=1)]
        one = np.cross(self.seen, least)
        one /= np.linalg.norm(one, axis=1)[:, None]
        return np.stack([one, np.cross(self.seen, one)], axis=1)


class Readings(NamedTuple):
    """Rows [m]: seconds since the flights' start, field [T] and rate [rad/s] in the body (NaN where
    there is none), field in J [T]; standard deviations of the readings and of both biases; what Sun
    sensors read, if there are any."""

    t_s: np.ndarray
    b: np.ndarray
    omega: np.ndarray
    b_j: np.ndarray
    sigma_b: float
    sigma_omega: float
    bias_b: float
    bias_omega: float
    sun: Sunlight | None = None

    def take(self, rows) -> Readings:
        """Some of the rows."""
        t_s, b, omega, b_j = (each[rows] for each in self[:4])
        sun = self.sun
        if sun is not None:
            sun = sun._replace(seen=sun.seen[rows], to_sun_j=sun.to_sun_j[rows])
        return self._replace(t_s=t_s, b=b, omega=omega, b_j=b_j, sun=sun)

    def until(self, t_s: float) -> Readings:
        """The rows until an instant."""
        return self.take(self.t_s <= t_s)

    @property
    def there(self) -> np.ndarray:
        """Which of a row's numbers were read: [6 m] or, with Sun sensors, [8 m]."""
        return np.isfinite(self._in_rows(self.b, self.omega, self._seen).ravel())

    def rows(self) -> np.ndarray:
        """The row of each number that is fitted [k]."""
        return np.repeat(np.arange(len(self.t_s)), 6 if self.sun is None else 8)[self.there]

    def measured(self) -> np.ndarray:
        """Numbers that are fitted [k], over their standard deviations."""
        return self._numbers(self.b, self.omega, self._seen)

    @property
    def _seen(self) -> np.ndarray | None:
        return None if self.sun is None else self.sun.seen

    def motion_sizes(self) -> np.ndarray:
        """Rotation vector [rad] and rate [rad/s] of about the size of the readings' errors [6]."""
        turn = self.sigma_b / float(np.linalg.norm(self.b_j, axis=1).mean())
        return np.repeat([turn, self.sigma_omega], 3)

    def predicted(self, states: States) -> np.ndarray:
        """What n twins have in their place [n, k]; of instants after the rows nothing is taken."""
        q, omega = (each[: len(self.t_s)] for each in states)
        b = to_body(q, self.b_j[:, None, :])
        sun = None if self.sun is None else to_body(q, self.sun.to_sun_j[:, None, :])
        return np.array([
            self._numbers(b[:, n], omega[:, n], None if sun is None else sun[:, n])
            for n in range(q.shape[1])
        ])  # fmt: skip

    def _numbers(self, b, omega, sun) -> np.ndarray:
        return self._in_rows(b, omega, sun).ravel()[self.there]

    def _in_rows(self, b, omega, sun) -> np.ndarray:
        """Numbers of each row over their standard deviations; of the Sun what is across the
        reading."""
        parts = [b / self.sigma_b, omega / self.sigma_omega]
        if self.sun is not None:
            parts.append(np.einsum("mij,mj->mi", self.sun.across(), sun) / self.sun.sigma)
        return np.hstack(parts)

    def shared(self) -> np.ndarray:
        """What both biases [6], over their standard deviations, add to the numbers [k, 6]."""
        size = 3 * [self.bias_b / self.sigma_b] + 3 * [self.bias_omega / self.sigma_omega]
        of_row = np.vstack([np.diag(size), np.zeros((0 if self.sun is None else 2, 6))])
        return np.tile(of_row, (len(self.t_s), 1))[self.there]

    def noise(self) -> np.ndarray:
        """Covariance [k, k] of the readings' errors, over their standard deviations."""
        shared = self.shared()
        return np.eye(len(shared)) + shared @ shared.T


def select_readings(
    data: xr.Dataset, scenario: Scenario, sigma_b: float, bias_b: float, shift_s: float
) -> tuple[Readings, float]:
    """The rows of a session that can be fitted, and when the flights start [s]."""
    for name in ("b_measured", "omega_measured"):
        if name not in data:
            raise RequestError("twin", f"needs {name} in the telemetry; received none")
    first_s = seconds_between(scenario.start, session_start(data)) + shift_s
    if first_s < 0.0:
        raise RequestError(
            "twin",
            "`start` must be at or before the first row of the telemetry; received "
            f"{-first_s:.6g} s after it",
        )
    t_s = data["time"].values + first_s
    b, omega = data["b_measured"].values, data["omega_measured"].values
    along = scenario.orbit_environment()
    b_j = along.field(t_s, *along.state(t_s))
    off = np.abs(np.linalg.norm(b, axis=1) - np.linalg.norm(b_j, axis=1))
    rows = np.flatnonzero(off < _OUTLIER * math.hypot(sigma_b, bias_b))
    rows = rows[np.cumsum(np.isfinite(omega[rows]).all(axis=1)) > 0]
    if len(rows) < 2 * _FIRST_ROWS:
        raise RequestError(
            "twin",
            f"needs {2 * _FIRST_ROWS} rows with the field of the scenario's orbit, the "
            f"first of them with a rate; received {len(rows)}",
        )
    cycle_s = scenario.control.cycle_s
    start_s = cycle_s * math.floor(t_s[rows[0]] / cycle_s + 1e-9)
    gyro = scenario.spacecraft.gyro
    sigma_omega = max(math.radians(gyro.noise_deg_s), _LEAST_GYRO)
    bias_omega = math.hypot(sigma_omega, *np.radians(gyro.bias_deg_s))
    sun = _sunlight(data, scenario, t_s, b, b_j, math.hypot(sigma_b, bias_b))
    found = Readings(t_s - start_s, b, omega, b_j, sigma_b, sigma_omega, bias_b, bias_omega, sun)
    return _thin(found.take(rows)), start_s


def _sunlight(data, scenario: Scenario, t_s, b, b_j, off_b) -> Sunlight | None:
    """What Sun sensors read, where the Sun may be seen and is at the right angle to the field.

    `off_b` [T]: error of the magnetometer. None of sensors that are misled by more than noise.
    """
    sensors = scenario.spacecraft.sun_sensors
    if sensors is None or "sun_measured" not in data or sensors.albedo or np.any(sensors.bias_deg):
        return None
    sigma = max(math.radians(sensors.noise_deg), _LEAST_SUN)
    along = scenario.orbit_environment()
    r, _ = along.state(t_s)
    to_sun = along.sun(t_s) - r
    to_sun /= np.linalg.norm(to_sun, axis=1)[:, None]
    length = np.linalg.norm(data["sun_measured"].values, axis=1)
    seen = data["sun_measured"].values / np.where(length > _DARK, length, np.nan)[:, None]
    off = np.radians(angles_deg(seen, b) - angles_deg(to_sun, b_j))
    bearable = _OUTLIER * np.hypot(sigma, off_b / np.linalg.norm(b_j, axis=1))
    good = (along.sunlit_fraction(t_s, r) > _DARK) & (np.abs(off) < bearable)
    return Sunlight(np.where(good[:, None], seen, np.nan), to_sun, sigma) if good.any() else None


def _thin(readings: Readings) -> Readings:
    """At most so many rows that the first window keeps enough of them."""
    first = int(np.sum(readings.t_s <= first_end(readings)))
    parts = np.split(np.arange(len(readings.t_s)), [first])
    few = [each[np.unique(np.linspace(0, len(each) - 1, _MOST_ROWS // 2).astype(int))]
           for each in parts if len(each)]  # fmt: skip
    return readings.take(np.concatenate(few))


def first_end(readings: Readings) -> float:
    """End of the first window [s]."""
    return float(max(readings.t_s[0] + _FIRST_S, readings.t_s[_FIRST_ROWS - 1]))
