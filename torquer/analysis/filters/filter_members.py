"""Runs that check a filter: a scenario with other noise, start and sensor errors in each."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from torquer.analysis.filters.linear_covariance import kalman_filter
from torquer.maths.geometry import euler
from torquer.maths.geometry.quaternion import from_rotation_vector, multiply, normalise
from torquer.scenario.change import value_at, with_values
from torquer.scenario.spec import Scenario

#: Errors of sensors and coils: what they are called, their key in the spacecraft, their unit, and
#: the filter's key for their standard deviation where they may be states of a filter.
_ERRORS = (
    ("gyro bias", "gyro.bias_deg_s", "deg/s", "gyro_bias_sigma_deg_s"),
    ("magnetometer bias", "magnetometer.bias_nt", "nT", "magnetometer_bias_sigma_nt"),
    ("magnetometer scale", "magnetometer.scale_error", "", "magnetometer_scale_sigma"),
    ("magnetometer misalignment", "magnetometer.misalignment_deg", "deg",
     "magnetometer_misalignment_sigma_deg"),
    ("gyro scale", "gyro.scale_error", "", "gyro_scale_sigma"),
    ("gyro misalignment", "gyro.misalignment_deg", "deg", "gyro_misalignment_sigma_deg"),
    ("residual dipole", "coils.residual_dipole_a_m2", "A m^2", "dipole_sigma_a_m2"),
    ("Sun sensor misalignment", "sun_sensors.bias_deg", "deg", ""),
    ("star tracker misalignment", "attitude_sensor.error_deg", "deg", ""),
    ("horizon sensor misalignment", "horizon_sensor.bias_deg", "deg", ""),
    ("height of the horizon", "horizon_sensor.horizon_km", "km", ""),
    ("Sun cell scale", "sun_cells.scale_error", "", ""),
)  # fmt: skip
#: Of these no example is drawn where they are no states.
_ONLY_STATES = ("gyro bias", "residual dipole")
#: Standard deviation [deg] of a held attitude, about each axis; and from which on it is any.
_HELD_DEG, _ANY_DEG = 5.0, 180.0


class Start(NamedTuple):
    """Standard deviations of the initial attitude and rate about the scenario's, for each axis.

    `attitude_deg`: 180 or more means any attitude, all equally likely. None, the default: any
    attitude, or 5 deg where the scenario states it relative to the orbital frame. `rate_deg_s`:
    None, the default, means the greater of the orbital rate and a tenth of the scenario's rate, but
    no more than the filter's own `rate_sigma_deg_s`.
    """

    attitude_deg: float | None = None
    rate_deg_s: float | None = None


#: The start that the scenario states, in every run.
AS_STATED = Start(0.0, 0.0)


class Drawn(NamedTuple):
    """What each run draws for itself, besides noise: its name, key, standard deviation and unit.

    `about`: the mean, zero or the scenario's value.
    """

    name: str
    key: str
    sigma: float
    unit: str
    about: np.ndarray

    @property
    def in_words(self) -> str:
        """Name and size."""
        if self.key == "initial" and self.unit == "deg" and self.sigma >= _ANY_DEG:
            return "any attitude"
        return f"{self.name} ({self.sigma:.3g}{' ' * bool(self.unit)}{self.unit})"


def what_runs_draw(scenario: Scenario, start: Start = AS_STATED) -> list[Drawn]:
    """What the runs of a check draw.

    Biases that are states of the filter: about zero, as its initial covariance has them. Other
    errors of sensors, where the scenario has some: about zero, with the root mean square of the
    scenario's components. ValueError for an estimator other than a Kalman filter.
    """
    spec = kalman_filter(scenario)
    states, examples = [], []
    for name, place, unit, sigma_key in _ERRORS:
        key = f"spacecraft.{place}"
        if getattr(scenario.spacecraft, place.partition(".")[0]) is None:
            continue
        if (sigma := getattr(spec, sigma_key, None)) is not None:
            states.append(Drawn(name, key, sigma, unit, np.zeros(3)))
        elif name not in _ONLY_STATES:
            stated = np.array(value_at(scenario, key))
            if sigma := float(np.sqrt(np.mean(stated**2))):
                examples.append(Drawn(name, key, sigma, unit, np.zeros(stated.shape)))
    found = [*states, *examples]
    attitude_deg, rate_deg_s = _spread_at_start(scenario, start)
    if attitude_deg > 0.0:
        found.append(Drawn("attitude", "initial", attitude_deg, "deg", np.zeros(3)))
    if rate_deg_s > 0.0:
        stated = np.array(scenario.initial.rate_deg_s)
        found.append(Drawn("rate", "initial.rate_deg_s", rate_deg_s, "deg/s", stated))
    return found


def make_members(scenario: Scenario, runs: int, start: Start = AS_STATED) -> Iterator[Scenario]:
    """The scenario with other random numbers in each run, and what `what_runs_draw` says.

    The filter records its covariance. ValueError for an estimator other than a Kalman filter.
    """
    drawn = what_runs_draw(scenario, start)
    scenario = scenario.replace("control.estimator.record_covariance", True)
    for number in range(runs):
        rng = np.random.default_rng([scenario.seed, number])
        values = {"seed": int(rng.integers(2**62))}
        for each in drawn:
            values |= {each.key: _draw_value(each, scenario, rng)}
        yield with_values(scenario, values)


def _draw_value(drawn: Drawn, scenario: Scenario, rng: np.random.Generator):
    if drawn.key == "initial":
        return _turn(scenario, drawn.sigma, rng)
    return (drawn.about + drawn.sigma * rng.normal(size=drawn.about.shape)).tolist()


def _turn(scenario: Scenario, sigma_deg: float, rng: np.random.Generator) -> dict:
    """The initial motion with another attitude."""
    initial = scenario.initial
    q = initial.quaternion or euler.to_quaternion(initial.sequence, np.radians(initial.euler_deg))
    turn = from_rotation_vector(tuple(np.radians(sigma_deg) * rng.normal(size=3)))
    if sigma_deg >= _ANY_DEG:
        turn = tuple(rng.normal(size=4))
    turned = normalise(multiply(normalise(tuple(q)), turn))
    kept = initial.model_dump(exclude={"euler_deg", "sequence", "quaternion"})
    return {**kept, "quaternion": [float(x) for x in turned]}


def _spread_at_start(scenario: Scenario, start: Start) -> tuple[float, float]:
    """Standard deviations [deg, deg/s] of the start."""
    attitude_deg, rate_deg_s = start
    if attitude_deg is None:
        attitude_deg = _HELD_DEG if scenario.initial.reference == "orbital" else _ANY_DEG
    if rate_deg_s is None:
        orbital_deg_s = math.degrees(scenario.orbit.rate_rad_s(scenario.start))
        tenth_deg_s = 0.1 * float(np.linalg.norm(scenario.initial.rate_deg_s))
        known_deg_s = getattr(kalman_filter(scenario), "rate_sigma_deg_s", math.inf)
        rate_deg_s = min(max(orbital_deg_s, tenth_deg_s), known_deg_s)
    return attitude_deg, rate_deg_s
