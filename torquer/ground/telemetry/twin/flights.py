"""Flights of a satellite's twin: a scenario flown from any motion at its start, by any parameters.

Steps are fixed, so that results depend smoothly on what is fitted: differences through adaptive
steps are not derivatives. Twins that differ only in numbers fly side by side.
"""

from __future__ import annotations

import math
from datetime import timedelta
from typing import NamedTuple

import numpy as np

from torquer.base.limits import RequestError
from torquer.maths.geometry.quaternion import from_rotation_vector, multiply
from torquer.scenario.change import with_values
from torquer.scenario.spec import Scenario
from torquer.simulation.lanes.group import Lanes, Pieces, why_not_in_lanes
from torquer.simulation.lanes.laws import CELLS_AT
from torquer.simulation.setup.run import prepare

#: Elements of the logarithm of the inertia's change, and the residual dipole.
INERTIA = ("xx", "yy", "zz", "xy", "xz", "yz")
_ROWS, _COLUMNS = (0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)
#: Place of each parameter among the physical ones.
OF_INERTIA, OF_GAIN, OF_DIPOLE, COUNT = slice(0, 6), 6, slice(7, 10), 10
OF_MOMENTS = slice(0, 3)
#: Place of the motion at the start among the numbers of a lane.
_MOTION = slice(CELLS_AT, CELLS_AT + 7)
#: Angle [rad] of a fixed step.
TURN = 0.12
_NOISE = {
    "magnetometer": "noise_nt",
    "gyro": "noise_deg_s",
    "sun_sensors": "noise_deg",
}


class Points(NamedTuple):
    """Twins: attitude [n, 4] (body to J) and rate [n, 3] rad/s at the start, physical parameters
    [n, 10]: logarithms of the changes of the inertia (six elements) and of gain over inertia, which
    shows first, change of the residual dipole [A m^2]."""

    q: np.ndarray
    omega: np.ndarray
    physical: np.ndarray

    def moved(self, steps: np.ndarray) -> Points:
        """Twins [n] moved by steps [n, 16]: rotation vector in the body [rad], rate, physical."""
        q = np.array([
            multiply(tuple(each), from_rotation_vector(tuple(turn)))
            for each, turn in zip(self.q, steps[:, :3], strict=True)
        ])  # fmt: skip
        q /= np.linalg.norm(q, axis=1)[:, None]
        return Points(q, self.omega + steps[:, 3:6], self.physical + steps[:, 6:])

    def take(self, rows) -> Points:
        """Some of the twins."""
        return Points(*(each[rows] for each in self))

    def where(self, which: np.ndarray, others: Points) -> Points:
        """These twins, others [n] where `which` [n] is true."""
        pairs = zip(others, self, strict=True)
        return Points(*(np.where(which[:, None], new, old) for new, old in pairs))

    def parameters(self) -> np.ndarray:
        """Departures [n, 16] from what is known beforehand: none of the start."""
        return np.hstack([np.zeros((len(self.q), 6)), self.physical])


def join_points(parts: list[Points]) -> Points:
    """All twins of some lists."""
    return Points(*(np.concatenate(each) for each in zip(*parts, strict=True)))


class States(NamedTuple):
    """Attitude [m, n, 4] and rate [m, n, 3] rad/s of n twins at m instants; NaN where a twin cannot
    be flown."""

    q: np.ndarray
    omega: np.ndarray

    def take(self, rows) -> States:
        """Some of the twins."""
        return States(self.q[:, rows], self.omega[:, rows])


def twin_gain(scenario: Scenario, physical: np.ndarray) -> float:
    """Gain of the only law of a twin; 0 if it has none."""
    key = gain_key(scenario)
    own = 0.0 if key is None else getattr(scenario.control.law, key)
    return own * math.exp(physical[OF_GAIN] + np.mean(physical[OF_MOMENTS]))


def gain_key(scenario: Scenario) -> str | None:
    """Key of the gain of a twin's only law; None if it has none."""
    law = scenario.control.law
    names = [] if law is None else [name for name in type(law).model_fields if "gain_" in name]
    given = [name for name in names if isinstance(getattr(law, name), float)]
    return given[0] if len(given) == 1 else None


def twin_dipole(scenario: Scenario, physical: np.ndarray) -> np.ndarray:
    """Residual dipole [3] A m^2 of a twin."""
    coils = scenario.spacecraft.coils
    return (0.0 if coils is None else np.array(coils.residual_dipole_a_m2)) + physical[OF_DIPOLE]


def twin_inertia(scenario: Scenario, physical: np.ndarray) -> np.ndarray:
    """Inertia [3, 3] kg m^2 of a twin: E J E with E the exponential of half the change."""
    half = np.zeros((3, 3))
    half[_ROWS, _COLUMNS] = half[_COLUMNS, _ROWS] = 0.5 * physical[OF_INERTIA]
    values, vectors = np.linalg.eigh(half)
    change = (vectors * np.exp(values)) @ vectors.T
    found = change @ np.array(scenario.spacecraft.body.inertia) @ change
    return 0.5 * (found + found.T)


def change_scenario(scenario: Scenario, physical: np.ndarray) -> Scenario:
    """The scenario with the physical parameters [10] of a twin."""
    own = scenario.spacecraft.body.keys_with_inertia(twin_inertia(scenario, physical))
    values: dict = {f"spacecraft.body.{key}": value for key, value in own.items()}
    if scenario.spacecraft.coils:
        values["spacecraft.coils.residual_dipole_a_m2"] = twin_dipole(scenario, physical).tolist()
    if gain_key(scenario) is not None:
        values[f"control.law.{gain_key(scenario)}"] = twin_gain(scenario, physical)
    return with_values(scenario, values)


class Flights:
    """Flights of a scenario's twins from `start_s` after its start for `duration_s` [s].

    `noisy`: with the noise of the sensors. `like`: flights of the same scenario from another
    instant, whose numbers of twins are shared. ValueError for a scenario that cannot be a twin.
    """

    def __init__(
        self,
        scenario: Scenario,
        start_s: float,
        duration_s: float,
        rate_rad_s: float,
        noisy: bool = False,
        like: Flights | None = None,
    ):
        self.scenario = _template(scenario, start_s, duration_s, rate_rad_s, noisy)
        self._run = prepare(self.scenario)
        why = "they have wheels" if self.scenario.spacecraft.wheels else ""  # of unknown speeds
        if why := why or why_not_in_lanes(self._run):
            raise RequestError("twin", f"must be a scenario whose members fly together; {why}")
        self._lanes = Lanes(self._run, Pieces(self._run))
        self._known: dict[bytes, np.ndarray | None] = {} if like is None else like._known
        self.step_s = self._run.plan.step_s

    def _numbers(self, physical: np.ndarray) -> np.ndarray | None:
        """Numbers of a twin in its lane; None for parameters that no satellite has."""
        key = physical.tobytes()
        if key not in self._known:
            try:
                run = prepare(change_scenario(self.scenario, physical), piece=self._run.piece)
                taken = self._lanes.takes(run)
                self._known[key] = None if taken is None else taken.numbers
            except ValueError:
                self._known[key] = None
        return self._known[key]

    def fly(self, points: Points, t_s: np.ndarray, seeds: np.ndarray | None = None) -> States:
        """Fly twins to instants [m] s after the start of the flights, ascending."""
        count = len(points.q)
        shape = (len(t_s), count)
        found = States(np.full((*shape, 4), np.nan), np.full((*shape, 3), np.nan))
        numbers = [self._numbers(each) for each in points.physical]
        good = np.flatnonzero([each is not None for each in numbers])
        if not len(good):
            return found
        rows = np.array([numbers[k] for k in good])
        rows[:, _MOTION] = np.hstack([points.q, points.omega])[good]
        flown = self._lanes.fly(rows, good if seeds is None else seeds[good])
        q, omega = _between(flown.motion, self.step_s, t_s)
        q[:, flown.failed] = omega[:, flown.failed] = np.nan
        found.q[:, good], found.omega[:, good] = q, omega
        return found


def _template(scenario, start_s, duration_s, rate_rad_s, noisy) -> Scenario:
    """The scenario with a fixed step that follows the rate, recorded at every step."""
    start = scenario.start + timedelta(seconds=start_s)
    record_s = scenario.control.sample_s
    plain = with_values(scenario, {
        "start": start,
        "mission": None,
        "simulation": {"duration_s": duration_s, "record_s": record_s},
        "initial": {"rate_deg_s": [0.0, 0.0, 0.0]},
    })  # fmt: skip
    step_s = plain.grid_s / math.ceil(plain.grid_s * max(rate_rad_s, 1e-4) / TURN)
    values: dict = {"simulation": {"duration_s": duration_s, "step_s": step_s, "record_s": step_s}}
    for sensor, key in _NOISE.items():
        if not noisy and sensor in scenario.spacecraft.model_fields_set:
            values[f"spacecraft.{sensor}.{key}"] = 0.0
    return with_values(plain, values)


def _between(motion: np.ndarray, step_s: float, t_s: np.ndarray):
    """Attitudes [m, n, 4] and rates [m, n, 3] at instants, from records [r, 7, n] at every step.

    The rate is taken to change evenly over the part of a step that is left.
    """
    from scipy.spatial.transform import Rotation

    last = len(motion) - 1
    before = np.minimum((t_s / step_s + 1e-9).astype(int), last)
    part = (t_s - step_s * before)[:, None, None]
    now, after = (np.swapaxes(motion[np.minimum(k, last)], 1, 2) for k in (before, before + 1))
    rise = (after[..., 4:] - now[..., 4:]) / step_s
    turn = part * now[..., 4:] + 0.5 * part**2 * rise
    q = Rotation.from_quat(now[..., :4].reshape(-1, 4)) * Rotation.from_rotvec(turn.reshape(-1, 3))
    return q.as_quat().reshape(now[..., :4].shape), now[..., 4:] + part * rise
