"""Linear covariance analysis: the accuracy to expect of a filter, before anything is simulated.

The covariance of a Kalman filter depends on where it flies and how it is turned, not on what it
reads. So it is carried along a nominal motion by the filter's own kernels.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from torquer.earth.gravity import gravity_gradient_vector
from torquer.estimation.expected import Nominal, fill_dynamics, fill_gyro
from torquer.estimation.kalman import UNINFORMED
from torquer.estimation.kalman_dynamics import KalmanDynamics
from torquer.estimation.kalman_gyro import KalmanGyro
from torquer.estimation.usque import Usque
from torquer.geometry.vec3 import as_vector
from torquer.scenario.spec import Scenario
from torquer.spacecraft.sun_sensor import sensor_that_sees


class Expected(NamedTuple):
    """Expected accuracy along a motion.

    `t_s` (k,); `covariance` (k, n, n) of the filter's states, attitude error first; `sun_seen`
    (k,): whether a Sun sensor sees the Sun.
    """

    t_s: np.ndarray
    covariance: np.ndarray
    sun_seen: np.ndarray

    @property
    def attitude_sigma_rad(self) -> np.ndarray:
        """Standard deviation (k,) of the attitude about each axis, as filters state it."""
        return np.sqrt(np.einsum("kii->k", self.covariance[:, :3, :3]) / 3.0)

    @property
    def worst_axis_body(self) -> np.ndarray:
        """Axis (k, 3) about which the attitude is known worst."""
        return np.linalg.eigh(self.covariance[:, :3, :3])[1][:, :, -1]


def held_attitude(scenario: Scenario, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Attitudes (k, 4) and rates (k, 3) of a satellite that goes on as it begins.

    With an initial attitude relative to the orbital frame it is held there; else the initial rate
    stays as it is in body axes.
    """
    r, v = scenario.surroundings().state(t_s)
    first = scenario.initial.motion(r[0], v[0])
    start = Rotation.from_quat(first[:4])
    if scenario.initial.reference == "inertial":
        turned = start * Rotation.from_rotvec(np.outer(t_s, first[4:]))
        return turned.as_quat(), np.tile(first[4:], (len(t_s), 1))
    normal = np.cross(r, v)
    up = r / np.linalg.norm(r, axis=1)[:, None]
    side = normal / np.linalg.norm(normal, axis=1)[:, None]
    frames = Rotation.from_matrix(np.stack([np.cross(side, up), side, up], axis=2))
    turned = frames * (frames[0].inv() * start)
    turning = normal / np.sum(r * r, axis=1)[:, None]
    return turned.as_quat(), turned.inv().apply(turning)


def expected_accuracy(
    scenario: Scenario, motion: tuple[np.ndarray, np.ndarray] | None = None
) -> Expected:
    """Covariance of the scenario's filter at its control steps, along a nominal motion.

    `motion`: attitudes (k, 4) and rates (k, 3) [rad/s] at the control steps from the start on;
    left out, `held_attitude`. All sensors are read at each control step, and the attitude is not
    known at the start. ValueError unless `control.estimator` is a Kalman filter.
    """
    spec = scenario.control.estimator
    if not isinstance(spec, KalmanGyro | Usque | KalmanDynamics):
        raise ValueError(
            "control.estimator.kind: must be that of a Kalman filter for its expected accuracy; "
            f"received {spec.kind!r}"
        )
    dt = scenario.control.sample_s
    count = math.floor(scenario.steps() * scenario.grid_s / dt + 1e-9) + 1
    t_s = dt * np.arange(count if motion is None else len(motion[0]))
    q, omega = held_attitude(scenario, t_s) if motion is None else motion
    seen = nominal(scenario, t_s, q, omega)
    block = spec.estimator()
    assert isinstance(block.memory, Mapping)
    parameters, n = block.parameters, len(block.memory["correction"])
    out = np.zeros((len(t_s), n * n))
    if isinstance(spec, KalmanDynamics):
        first = [parameters.rate, parameters.dipole, parameters.field_bias]
        if not parameters.dipole_at:
            del first[1]
        carry = fill_dynamics
    else:
        first, carry = [parameters.bias, parameters.field_bias], fill_gyro
    put_first(out[0], n, np.array([UNINFORMED, *first])[: n // 3])
    carry(parameters, seen, dt, np.zeros(3 * n), np.zeros(n), out)
    return Expected(t_s, out.reshape(-1, n, n), seen.seen)


def put_first(p: np.ndarray, n: int, variances: np.ndarray) -> None:
    """A diagonal covariance, as cells: a variance for each three states."""
    p[:: n + 1] = np.repeat(variances, 3)


def nominal(scenario: Scenario, t_s: np.ndarray, q: np.ndarray, omega: np.ndarray) -> Nominal:
    """What sensors would see along a motion."""
    around, sensors = scenario.surroundings(), scenario.spacecraft.sun_sensors
    r, v = around.state(t_s)
    sun = around.sun(t_s) - r
    sun /= np.linalg.norm(sun, axis=1)[:, None]
    seen = around.lit(t_s, r) >= 0.5
    if sensors is not None:
        in_body = Rotation.from_quat(q).inv().apply(sun)
        packed = sensors.pack()
        seen &= [sensor_that_sees(packed, as_vector(row)) >= 0 for row in in_body]
    b = around.field(t_s, r, v)
    rows = [np.ascontiguousarray(x) for x in (q, omega, b, gravity_gradient_vector(r), sun)]
    return Nominal(rows[0], rows[1], rows[2], rows[3], rows[4], seen)
