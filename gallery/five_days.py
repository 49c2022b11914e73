"""The five-day flight of WHEEL section 7, as scenarios, and what is read off them.

Lost in the text: the formula (7.2), its gain, the rate omega0 that it knows, the ballistic
coefficient; and (6.6), so that the sense of x1 along the motion is open. The text has the air at
rest (after (6.3)) as well as turning (V in (6.3), section 7). Hence four readings, all flown.
Half a turn about x1 changes nothing of the body, so that the sense of x3 makes no fifth.

Taken for all: the PD law whose every axis has the polynomial (s + kappa)^2, and the drag of the
cylinder's end for the orbit.

Chosen with the printed angles, and the momenta that the text implies, in view: kappa, omega0 and
what the law's rates refer to (omega0 about the orbit normal; tried were also the orbital frame at
the instant and omega0 about the body's third axis). So the angles and the size of H3 are no test.
"""

import functools
import math
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from gallery.wheels import INERTIA
from torquer.analysis.attitude import find_attitude_error
from torquer.base.conventions import EARTH_RADIUS_M
from torquer.environment.orbit.kepler import mean_motion
from torquer.scenario.load import scenario_from_data
from torquer.simulation.setup.simulate import simulate
from torquer.spacecraft.wheel_array.layout import total_momentum

PERIGEE_KM, APOGEE_KM, PERIGEE_DEG = 400.0, 450.0, 53.5
AIR = {"kind": "gost", "f107": 150.0, "ap": 12.0}
CYLINDER = {"kind": "cylinder", "axis": [1.0, 0.0, 0.0], "radius_m": 1.3, "length_m": 5.0,
            "centre_m": [-1.0, 0.0, 0.0]}  # fmt: skip
PANELS = {"kind": "plate", "axis": [0.0, 0.0, 1.0], "area_m2": 33.0, "centre_m": [0.3, 0.0, 0.0]}
REST, TURNS, NONE = "at rest", "turning", "none"
RECORD_S = 10.0
#: The loop has settled after this time; the printed flight ends; records of a revolution.
SETTLED_S, END_S, REVOLUTION = 20_000.0, 432_000.0, 560


def rate_at_start() -> float:
    """Rate [rad/s] of the circular orbit through the node, where the flight starts."""
    near, far = (EARTH_RADIUS_M + 1e3 * h for h in (PERIGEE_KM, APOGEE_KM))
    axis, eccentricity = 0.5 * (near + far), (far - near) / (far + near)
    parameter = axis * (1.0 - eccentricity**2)
    return mean_motion(parameter / (1.0 + eccentricity * math.cos(math.radians(PERIGEE_DEG))))


class Case(NamedTuple):
    """What the text leaves open: a reading of it, and numbers that it has lost."""

    against: bool
    """Whether x1 points against the motion; x3 lies along the orbit normal."""
    air: str
    """REST, TURNS (with the Earth) or NONE."""
    kappa: float
    """Of the law [1/s]."""
    rate: float | None
    """omega0 of the law [rad/s], None for the rate of the orbit at the instant."""

    @property
    def attitude(self) -> dict:
        """Turn of the body from the orbital frame, as keys of a scenario."""
        return {"sequence": "123", "euler_deg": [-90.0, 0.0, 180.0 if self.against else 0.0]}


def scenario(case: Case, days: float, sample_s: float):
    """The flight, with wheels that do not saturate."""
    kinds = {"kind": "kepler", "perigee_altitude_km": PERIGEE_KM, "apogee_altitude_km": APOGEE_KM}
    angles = {"inclination_deg": 63.0, "raan_deg": 164.0, "argument_of_perigee_deg": PERIGEE_DEG,
              "true_anomaly_deg": -PERIGEE_DEG}  # fmt: skip
    drag = {"mass_kg": 6440.0, "area_m2": math.pi * 1.3**2, "drag_coefficient": 2.0,
            "atmosphere": AIR}  # fmt: skip
    law = {"kind": "wheel_pd", "bandwidth_rad_s": case.kappa, "orbital_rate_rad_s": case.rate,
           "inertia_kg_m2": INERTIA, **case.attitude}  # fmt: skip
    wheels = {
        "layout": {"kind": "four_sided_pyramid", "alpha_deg": 80.5, "beta_deg": 45.5},
        "momentum_limit_n_m_s": 100.0, "torque_limit_n_m": 0.2, "speed_limit_rpm": 6000.0,
        "allocation": "least_squares",
    }  # fmt: skip
    spacecraft = {"body": {"inertia_kg_m2": INERTIA}, "wheels": wheels}
    if case.air != NONE:
        spacecraft["aerodynamics"] = {"parts": [CYLINDER, PANELS]}
    return scenario_from_data({
        "name": "five_days",
        "start": "2007-09-21T09:10:34Z",
        "orbit": {"kind": "numerical", "start": {**kinds, **angles}, "start_frame": "TEME",
                  "degree": 16, "drag": drag},
        "environment": {"atmosphere": AIR, "co_rotating_atmosphere": case.air == TURNS},
        "spacecraft": spacecraft,
        "initial": {"reference": "orbital", **case.attitude, "rate_deg_s": [0.0, 0.0, 0.0],
                    "rate_relative_to": "orbital"},
        "control": {"law": law, "sample_s": sample_s},
        # fixed steps: exact to 2e-10 deg in a day, and 3.5 times as fast as adaptive ones
        "simulation": {"duration_s": days * 86400.0, "step_s": sample_s, "record_s": RECORD_S},
    })  # fmt: skip


class Flight(NamedTuple):
    """Time histories of a flight: times [s], angles [deg] off about x1, x2, x3, H [N m s].

    `node`: direction (n, 3), body frame, to the ascending node of the orbit as it is then.
    """

    time_s: np.ndarray
    angle_deg: np.ndarray
    total: np.ndarray
    node: np.ndarray

    def settled(self, values) -> np.ndarray:
        """Values of the five days from when the loop has settled."""
        return values[(self.time_s >= SETTLED_S) & (self.time_s <= END_S)]

    def at_the_end(self, values) -> np.ndarray:
        """Values of the last revolution of the five days."""
        last = REVOLUTION * RECORD_S
        return values[(self.time_s > END_S - last) & (self.time_s <= END_S)]

    def by_revolution(self, values) -> np.ndarray:
        """Values (n,) of the five days as (revolution, record), whole revolutions only."""
        count = int(END_S / RECORD_S) // REVOLUTION
        return values[: count * REVOLUTION].reshape(count, REVOLUTION)


@functools.lru_cache(maxsize=16)
def fly(case: Case, days: float, sample_s: float) -> Flight:
    """The flight, computed once and cached; the law is computed every `sample_s`."""
    flown = scenario(case, days, sample_s)
    result = simulate(flown)
    momenta = result["wheel_momentum"].values
    total = total_momentum(flown.spacecraft.wheels.array().axes, momenta)
    return Flight(
        result["time"].values, find_attitude_error(result).error_deg, total, _node(result)
    )


def _node(result) -> np.ndarray:
    normal = np.cross(result["position_inertial"].values, result["velocity_inertial"].values)
    node = np.cross([0.0, 0.0, 1.0], normal)
    node /= np.linalg.norm(node, axis=1, keepdims=True)
    return Rotation.from_quat(result["q_body_to_inertial"].values).inv().apply(node)


def with_steady_torque(flight: Flight, gathered: float) -> Flight:
    """The flight under a further torque along the line of nodes, compensated by the wheels.

    `gathered`: momentum [N m s] that it adds in the five days, along the ascending node.
    """
    added = gathered * flight.time_s[:, None] / END_S * flight.node
    return flight._replace(total=flight.total + added)
