"""Runs that check a filter: a scenario with other noise, start and sensor errors in each."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from torquer.analysis.filters.linear_covariance import kalman_filter
from torquer.computer.estimation.kalman_dynamics import KalmanDynamics
from torquer.computer.estimation.kalman_gyro import KalmanGyro
from torquer.maths.geometry import euler
from torquer.maths.geometry.quaternion import from_rotation_vector, multiply, normalise
from torquer.scenario.change import with_values
from torquer.scenario.spec import Scenario
from torquer.spacecraft.data_sheet import FIXED

#: Of these no example is drawn where they are no states.
_ONLY_STATES = (("gyro", "bias"), ("coils", "bias"))
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

    `about`: the mean, zero or the scenario's value, NaN for none; `stated`: the scenario's value;
    `sigma_key`: the filter's key for the standard deviation, "" where none has stated it;
    `factor`: by which a value of the key becomes one in the unit.
    """

    name: str
    key: str
    sigma: float
    unit: str
    about: np.ndarray
    stated: np.ndarray
    sigma_key: str = ""
    factor: float = 1.0

    @property
    def sigmas(self) -> float:
        """How far the scenario's value is from the mean of the runs, in standard deviations."""
        return float(np.linalg.norm(self.stated - self.about)) / self.sigma

    @property
    def replaced_in_words(self) -> str:
        """The scenario's value where runs do not have it on average; "" where they do."""
        if not np.any(self.stated - self.about):
            return ""
        if self.key == "initial":
            return self.name
        size = f"{np.linalg.norm(self.stated):.3g}{' ' * bool(self.unit)}{self.unit}"
        if not self.sigma_key:
            return f"{self.name} of {size}"
        return f"{self.name} of {size}, {self.sigmas:.3g} sigma by {self.sigma_key}"

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
    found = [*_draw_errors(scenario)]
    attitude_deg, rate_deg_s = _spread_at_start(scenario, start)
    if attitude_deg > 0.0:
        found.append(_draw_attitude(scenario, attitude_deg))
    if rate_deg_s > 0.0:
        stated = np.array(scenario.initial.rate_deg_s)
        found.append(Drawn("rate", "initial.rate_deg_s", rate_deg_s, "deg/s", stated, stated))
    return found


def _draw_errors(scenario: Scenario) -> list[Drawn]:
    """Errors of devices: first those that are states of the filter, then examples of others."""
    spec, devices = kalman_filter(scenario), scenario.spacecraft.devices()
    sigmas = {(each.device, each.what): each.key for each in spec.states_of_devices}
    states: list[Drawn] = []
    examples: list[Drawn] = []
    for name, what in _fixed_errors(scenario):
        kind = scenario.spacecraft.kind_of(name)
        sheet, sigma_key = devices[name].sheet, sigmas.get((kind, what), "")
        key, stated = f"spacecraft.{name}.{getattr(sheet, what)}", sheet.value(devices[name], what)
        sigma, about = getattr(spec, sigma_key, None), np.zeros(stated.shape)
        is_state = sigma is not None
        if not is_state and (kind, what) not in _ONLY_STATES:
            sigma = float(np.sqrt(np.mean(stated**2)))
        if sigma:
            own = f" of {name.partition('.')[2]}" if "." in name else ""
            said = f"{sheet.in_words(what)}{own}"
            keys = (said, key, sigma, sheet.unit_of(what), about, stated)
            own_key, factor = sigma_key if is_state else "", sheet.factors.get(what, 1.0)
            (states if is_state else examples).append(Drawn(*keys, own_key, factor))
    return [*states, *examples]


def _fixed_errors(scenario: Scenario) -> list[tuple[str, str]]:
    """Fixed errors of the devices: names of device and error, those that may be states first.

    Random numbers are drawn in this order.
    """
    may_be = [each for kind in (KalmanGyro, KalmanDynamics) for each in kind.states_of_devices]
    devices = scenario.spacecraft.devices()
    own = [(name, what) for name, each in devices.items() for what in FIXED
           if getattr(each.sheet, what)]  # fmt: skip
    first = dict.fromkeys(
        (key, each.what) for each in may_be for key in scenario.spacecraft.of_kind(each.device)
    )
    return [*dict.fromkeys([*first, *own])]


def _draw_attitude(scenario: Scenario, sigma_deg: float) -> Drawn:
    """The attitude at the start, about the scenario's; any at all are about none that is given."""
    is_given = {"euler_deg", "quaternion"} & scenario.initial.model_fields_set
    is_lost = sigma_deg >= _ANY_DEG and is_given
    about = np.full(3, math.nan) if is_lost else np.zeros(3)
    return Drawn("attitude", "initial", sigma_deg, "deg", about, np.zeros(3))


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
    value = drawn.about + drawn.sigma * rng.normal(size=drawn.about.shape)
    return (value / drawn.factor).tolist()


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
