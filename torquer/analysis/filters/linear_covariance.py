"""Linear covariance analysis: the expected accuracy of a filter, before anything is simulated.

The covariance of a Kalman filter depends on the orbit and the attitude, not on the readings. So it
is propagated along a nominal motion by the filter's own kernels.
"""

from typing import NamedTuple

import numpy as np

from torquer.analysis.attitude import orbital_axes
from torquer.analysis.control_cycle import control_times
from torquer.computer.estimation import ESTIMATORS
from torquer.computer.estimation.expected import (
    Nominal,
    fill_dynamics,
    fill_gyro,
    put_earthlight,
)
from torquer.computer.estimation.filter import Filter
from torquer.computer.estimation.kalman_dynamics import KalmanDynamics
from torquer.computer.estimation.measurements.table import BY_NAME
from torquer.environment.earth.gravity import gravity_gradient_vector
from torquer.scenario.spec import Scenario

#: Number of random errors from which the 95th percentile of an attitude error is computed.
_DRAWN = 20_000


class Along(NamedTuple):
    """What decides along a motion whether a device reads anything: attitudes (k, 4), rates
    (k, 3) [rad/s], directions to Sun and Moon (k, 3), visible part of the Sun (k,), positions
    (k, 3) [m], inertial."""

    q: np.ndarray
    omega: np.ndarray
    sun: np.ndarray
    moon: np.ndarray
    sunlit: np.ndarray
    r: np.ndarray


class Motion(NamedTuple):
    """A nominal motion at control steps: times (k,) [s], attitudes (k, 4), rates (k, 3) [rad/s],
    momentum of the wheels (k, 3) [N m s, body]."""

    t_s: np.ndarray
    q: np.ndarray
    omega: np.ndarray
    wheels: np.ndarray


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


def error_95_rad(covariance: np.ndarray, mean: np.ndarray | None = None) -> np.ndarray:
    """Angle [rad] below which 95 % of the total attitude errors lie, for covariances (k, 3, 3).

    From normally distributed rotation vectors of at most 180 deg, one sample for all covariances;
    accurate to 1 %. `mean` (k, 3): systematic errors [rad], in the axes of the covariances.
    """
    drawn = np.random.default_rng(0).normal(size=(_DRAWN, 3))
    if mean is not None and np.any(mean):
        both = zip(covariance, mean, strict=True)
        return np.minimum([_error_95(drawn, *each) for each in both], np.pi)
    axes = np.maximum(np.linalg.eigvalsh(covariance), 0.0)
    whole = np.array([np.sqrt(np.quantile(drawn**2 @ each, 0.95)) for each in axes])
    return np.minimum(whole, np.pi)


def _error_95(drawn: np.ndarray, covariance: np.ndarray, mean: np.ndarray) -> float:
    variances, axes = np.linalg.eigh(covariance)
    errors = drawn * np.sqrt(np.maximum(variances, 0.0)) + mean @ axes
    return float(np.sqrt(np.quantile(np.sum(errors**2, axis=1), 0.95)))


def held_attitude(scenario: Scenario, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Attitudes (k, 4) and rates (k, 3) of a satellite that keeps its initial motion.

    An initial attitude relative to the orbital frame is held there; otherwise the initial rate
    stays constant in body axes.
    """
    from scipy.spatial.transform import Rotation  # a third of a second of importing

    r, v = scenario.orbit_environment().state(t_s)
    first = scenario.initial.motion(r[0], v[0])
    start = Rotation.from_quat(first[:4])
    if scenario.initial.reference == "inertial":
        turned = start * Rotation.from_rotvec(np.outer(t_s, first[4:]))
        return turned.as_quat(), np.tile(first[4:], (len(t_s), 1))
    frames = orbital_axes(r, v)
    turned = frames * (frames[0].inv() * start)
    turning = np.cross(r, v) / np.sum(r * r, axis=1)[:, None]
    return turned.as_quat(), turned.inv().apply(turning)


def held_motion(scenario: Scenario) -> Motion:
    """`held_attitude` at the control steps, with the wheels at their initial speeds."""
    t_s = control_times(scenario)
    wheels, momentum = scenario.spacecraft.wheels, np.zeros(3)
    if wheels is not None:
        spin = wheels.rotor_inertia_kg_m2() * wheels.initial_speeds_rad_s()
        momentum = spin @ np.array(wheels.array().axes)
    return Motion(t_s, *held_attitude(scenario, t_s), np.tile(momentum, (len(t_s), 1)))


def kalman_filter(scenario: Scenario) -> Filter:
    """The scenario's filter; ValueError for another estimator."""
    spec = scenario.control.estimator
    if not isinstance(spec, Filter):
        kinds = ", ".join(kind for kind, each in ESTIMATORS.items() if issubclass(each, Filter))
        raise ValueError(
            f"control.estimator.kind: must be one of {kinds} for a stated accuracy; "
            f'received {spec.kind!r} (a table [control.estimator] with kind = "kalman_dynamics", '
            "inertia_kg_m2, torque_noise_n_m_sqrt_s and rate_sigma_deg_s is enough: "
            "`torquer explain kalman_dynamics`)"
        )
    return spec


def expected_accuracy(scenario: Scenario, motion: Motion | None = None) -> Expected:
    """Covariance of the scenario's filter at its control steps, along a nominal motion.

    `motion`: that of `held_motion` unless another is given. All sensors are read at each control
    step, and the attitude is not known at the start. ValueError unless `control.estimator` is a
    Kalman filter.
    """
    spec = kalman_filter(scenario).with_units(scenario.spacecraft.units())
    seen = nominal(scenario, motion or held_motion(scenario))
    variances = first_variances(spec)
    out = np.zeros((len(seen.t_s), len(variances), len(variances)))
    out[0] = np.diag(variances)
    fill = fill_dynamics if isinstance(spec, KalmanDynamics) else fill_gyro
    fill(spec.constants(), seen, true_surroundings(seen), out)
    return Expected(seen.t_s, out, seen.visible[list(BY_NAME).index("sun")])


def first_variances(spec: Filter) -> np.ndarray:
    """Initial variances (n,) of a filter's states, attitude first."""
    return np.repeat(list(spec.initial_variances().values()), 3)


def nominal(scenario: Scenario, motion: Motion) -> Nominal:
    """What sensors would measure along a motion."""
    environment, craft = scenario.orbit_environment(), scenario.spacecraft
    t_s, q, omega, wheels = motion
    r, v = environment.state(t_s)
    sun = environment.sun(t_s) - r
    sun /= np.linalg.norm(sun, axis=1)[:, None]
    sunlit = environment.sunlit_fraction(t_s, r)
    light = np.zeros((len(t_s), 3))
    if craft.sun_cells is not None and craft.sun_cells.albedo > 0.0:
        put_earthlight(craft.sun_cells.albedo, r, sun, light)
    moon = environment.moon(t_s) - r
    moon /= np.linalg.norm(moon, axis=1)[:, None]
    along = Along(q, omega, sun, moon, sunlit, r)
    visible = np.array([each.visible(craft, along) for each in BY_NAME.values()])
    b = environment.field(t_s, r, v)
    rows = (t_s, q, omega, wheels, b, gravity_gradient_vector(r), sun)
    return Nominal(
        *(np.ascontiguousarray(row, dtype=float) for row in rows), visible, sunlit, light
    )  # type: ignore[call-arg]


def surroundings(b: np.ndarray, sun: np.ndarray, nadir: np.ndarray) -> np.ndarray:
    """The vector of the surroundings that each channel of a filter reads (channels, k, 3).

    Of field [T], directions to the Sun and to the Earth's centre (k, 3); zeros where it reads none.
    """
    given = {"field": b, "sun": sun, "nadir": nadir, "": np.zeros_like(b)}
    rows = [given[each.reference] for each in BY_NAME.values() for _ in range(each.channels)]
    return np.ascontiguousarray(rows, dtype=float)


def true_surroundings(seen: Nominal) -> np.ndarray:
    """`surroundings` along a motion, as they are."""
    nadir = -seen.gravity / np.linalg.norm(seen.gravity, axis=1)[:, None]
    return surroundings(seen.b, seen.sun, nadir)
