"""The motions of the work-precision benchmark, as scenarios.

Attitudes are compared at a few instants: the error is the greatest angle [rad] there.
"""

import copy
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from torquer.maths.geometry.quaternion import angle_between
from torquer.scenario.load import scenario_from_data
from torquer.scenario.spec import Scenario

START = "2012-03-04T10:31:47Z"
INERTIA = (1.0255, 1.5393, 1.8172)
ORBIT = {"kind": "circular", "altitude_km": 500.0, "inclination_deg": 51.7}
OFF = {"kind": "off"}

FINEST = {"integrator": "auto", "tolerance_deg": 1e-10}
#: The reference, and the other one that shows how good it is.
REFERENCES = (FINEST, {"integrator": "dop853", "tolerance": 1e-14})


class Task(NamedTuple):
    """A motion: its picture's title, scenario without `simulation`, length, interval of records.

    `least_step_s`, `most_step_s`: of those that are tried with fixed steps.
    """

    title: str
    data: dict
    duration_s: float
    record_s: float
    least_step_s: float
    most_step_s: float
    references: tuple = REFERENCES

    @property
    def times_s(self) -> np.ndarray:
        """Instants at which attitudes are compared."""
        return np.arange(1, round(self.duration_s / self.record_s) + 1) * self.record_s

    @property
    def inertia(self) -> np.ndarray:
        """Moments of inertia [kg m^2] about the body's axes."""
        return np.array(self.data["spacecraft"]["body"]["inertia_kg_m2"])

    @property
    def wheel(self) -> np.ndarray:
        """Momentum [N m s] that the body carries."""
        return np.array(self.data["spacecraft"]["body"].get("wheel_momentum_n_m_s", (0, 0, 0)))

    @property
    def rate(self) -> np.ndarray:
        """Rate at the start [rad/s, body]; the attitude is that of the inertial frame."""
        return np.radians(self.data["initial"]["rate_deg_s"])

    @property
    def is_free(self) -> bool:
        """Whether nothing turns the body."""
        around, craft = self.data["environment"], self.data["spacecraft"]
        return not around["gravity_gradient"] and not {"coils", "wheels"} & set(craft)

    def scenario(self, simulation: dict) -> Scenario:
        """The task by an integrator; ScenarioError if that refuses it."""
        keys = {"duration_s": self.duration_s, "record_s": self.record_s} | simulation
        return scenario_from_data(copy.deepcopy(self.data) | {"simulation": keys})


def _data(body, rate_deg_s, sample_s, law=OFF, gravity=True, **craft) -> dict:
    around = {"gravity_gradient": gravity}
    if "coils" not in craft:  # nothing feels the field: the one that is quickest to tabulate
        around["field"] = {"kind": "averaged"}
    return {
        "start": START,
        "orbit": ORBIT,
        "environment": around,
        "spacecraft": {"body": body} | craft,
        "initial": {"rate_deg_s": rate_deg_s},
        "control": {"law": law, "sample_s": sample_s},
    }


def tip_off(rate_deg_s: float) -> Task:
    """B-dot by gyro and magnetometer every 3 s, two revolutions."""
    law = {"kind": "bdot_rate", "gain_a_m2_s_per_t": 4e4}
    body, coils = {"inertia_kg_m2": INERTIA}, {"limit_a_m2": 3.2}
    data = _data(body, 3 * [rate_deg_s], 3.0, law, coils=coils)
    title = f"Tip-off at {rate_deg_s:g} deg/s about each axis, B-dot"
    return Task(title, data, 11340.0, 1134.0, 0.02, 3.0)


def gyrostat() -> Task:
    """A sphere with a wheel: nutation of 38 deg/s, one revolution."""
    body = {"inertia_kg_m2": 3 * [0.05], "wheel_momentum_n_m_s": [0.0, 0.0, 0.0331]}
    data = _data(body, [1.0, 0.0, 0.5], 720.0, gravity=False)
    return Task("Gyrostat: nutation at 38 deg/s", data, 5760.0, 720.0, 0.01, 300.0)


def spinner(torque: bool) -> Task:
    """An asymmetric body at 300 deg/s; torque: gravity, and a residual dipole across the spin."""
    coils = {"limit_a_m2": 1.0, "residual_dipole_a_m2": [0.02, 0.01, 0.05]}
    body = {"inertia_kg_m2": [0.5, 0.6, 0.8]}
    craft = {"coils": coils} if torque else {}
    data = _data(body, [4.0, 2.0, 300.0], 300.0, gravity=torque, **craft)
    if torque:
        title = "Spinner at 300 deg/s, gravity and a dipole"
        return Task(title, data, 900.0, 300.0, 0.002, 300.0)
    exact = ({"integrator": "splitting", "step_s": 300.0}, REFERENCES[1])
    return Task("Spinner at 300 deg/s, no torque", data, 900.0, 300.0, 0.002, 300.0, exact)


def wheels_in_friction() -> Task:
    """A CubeSat takes up its attitude on four wheels with friction, one at rest at the start."""
    wheels = {
        "layout": {"kind": "four_sided_pyramid", "alpha_deg": 54.7356, "beta_deg": 45.0},
        "momentum_limit_n_m_s": 0.012,
        "speed_limit_rpm": 6000,
        "torque_limit_n_m": 0.002,
        "coulomb_friction_n_m": 2e-5,
        "viscous_friction_n_m_s": 3e-8,
        "stiction_n_m": 3e-5,
        "initial_speed_rpm": [200.0, -100.0, 0.0, 50.0],
    }
    inertia = [0.126, 0.167, 0.061]
    law = {"kind": "wheel_pd", "bandwidth_rad_s": 0.05, "inertia_kg_m2": inertia}
    data = _data({"inertia_kg_m2": inertia}, [0.0, 0.0, 0.0], 5.0, law, wheels=wheels)
    data["initial"] |= {
        "reference": "orbital",
        "euler_deg": [0.0, 0.0, 60.0],
        "rate_relative_to": "orbital",
    }
    finest = (FINEST, {"integrator": "rk4", "step_s": 1e-3})
    return Task("Four wheels with friction", data, 1200.0, 300.0, 0.01, 5.0, finest)


def slow(days: int = 30) -> Task:
    """Slow rotation under gravity alone, readings every 5 minutes.

    About the axis of least inertia, fast enough to be regular: a body that tumbles at 0.1 deg/s,
    1.6 times the orbital rate, does so chaotically, and its attitude after days is anyone's guess.
    """
    data = _data({"inertia_kg_m2": INERTIA}, [0.2, 0.05, 0.05], 300.0)
    title = f"{days} days of slow rotation under gravity"
    return Task(title, data, days * 86400.0, 5 * 86400.0, 2.0, 300.0)


TASKS = {
    "tip_off_10": tip_off(10.0),
    "tip_off_1": tip_off(1.0),
    "tip_off_0.1": tip_off(0.1),
    "gyrostat": gyrostat(),
    "spinner": spinner(torque=False),
    "spinner_torque": spinner(torque=True),
    "wheels": wheels_in_friction(),
    "slow": slow(),
}


def exact_gyrostat(task: Task) -> np.ndarray:
    """Attitudes (x, y, z, w) of a free sphere with a wheel.

    The momentum L is fixed; the body turns at L/A in space, and back at h/A about its wheel.
    """
    a = task.inertia[0]
    around_momentum = task.times_s[:, None] * (a * task.rate + task.wheel) / a
    around_wheel = -task.times_s[:, None] * task.wheel / a
    turn = Rotation.from_rotvec(around_momentum) * Rotation.from_rotvec(around_wheel)
    return turn.as_quat()


def angle(p: np.ndarray, q: np.ndarray) -> float:
    """Greatest angle [rad] between attitudes."""
    return float(angle_between(p, q).max())
