"""The five-day flight of WHEEL section 7, as a scenario, and what is read off it.

Lost in the text: the formula (7.2), its gain, the rate omega0 that it knows, the ballistic
coefficient. Taken here: the PD law whose every axis has the polynomial (s + kappa)^2, kappa =
0.003 1/s; omega0 that of a circular orbit through the start; the drag of the cylinder's end. The
law is computed ten times a second, as good as continuously.

These were chosen with the printed angles, and the momenta that the text implies, in view. Tried
were kappa from 0.002 to 0.004 1/s, omega0 from 0.3 % below to 0.3 % above the mean rate of the
orbit, three references of the law's rates (the orbital frame at the instant; omega0 about the
orbit normal; omega0 about the body's third axis), air that rests and air that turns. So the
angles and the size of H3 are no test of anything; the ratio of the layouts, the time between
them, and H1 and H2 for that H3 are.
"""

import functools
import math
from typing import NamedTuple

import numpy as np

from torquer.conventions import EARTH_RADIUS_M
from torquer.gallery.wheels import INERTIA
from torquer.orbit.kepler import mean_motion
from torquer.report.held_attitude import held_in
from torquer.scenario.load import scenario_from_data
from torquer.simulation.simulate import simulate
from torquer.wheel_array.layout import total_momentum

KAPPA = 0.003
PERIGEE_KM, APOGEE_KM, PERIGEE_DEG = 400.0, 450.0, 53.5
AIR = {"kind": "gost", "f107": 150.0, "ap": 12.0}
#: Turns of the body from the orbital frame: x1 stays along the motion, x3 goes to the normal.
ATTITUDE = {"sequence": "123", "euler_deg": [-90.0, 0.0, 0.0]}
CYLINDER = {"kind": "cylinder", "axis": [1.0, 0.0, 0.0], "radius_m": 1.3, "length_m": 5.0,
            "centre_m": [-1.0, 0.0, 0.0]}  # fmt: skip
PANELS = {"kind": "plate", "axis": [0.0, 0.0, 1.0], "area_m2": 33.0, "centre_m": [0.3, 0.0, 0.0]}
REVOLUTION_S = 5600.0


def rate_at_start() -> float:
    """Rate [rad/s] of the circular orbit through the node, where the flight starts."""
    near, far = (EARTH_RADIUS_M + 1e3 * h for h in (PERIGEE_KM, APOGEE_KM))
    axis, eccentricity = 0.5 * (near + far), (far - near) / (far + near)
    parameter = axis * (1.0 - eccentricity**2)
    return mean_motion(parameter / (1.0 + eccentricity * math.cos(math.radians(PERIGEE_DEG))))


def scenario(days: float, air_turns: bool, rate_rad_s: float | None, kappa: float):
    """The flight, with wheels that do not saturate.

    `rate_rad_s`: omega0 of the law, None for the rate of the orbit as it is.
    """
    kinds = {"kind": "kepler", "perigee_altitude_km": PERIGEE_KM, "apogee_altitude_km": APOGEE_KM}
    angles = {"inclination_deg": 63.0, "raan_deg": 164.0, "argument_of_perigee_deg": PERIGEE_DEG,
              "true_anomaly_deg": -PERIGEE_DEG}  # fmt: skip
    drag = {"mass_kg": 6440.0, "area_m2": math.pi * 1.3**2, "drag_coefficient": 2.0,
            "atmosphere": AIR}  # fmt: skip
    law = {"kind": "wheel_pd", "bandwidth_rad_s": kappa, "inertia_kg_m2": INERTIA, **ATTITUDE}
    wheels = {
        "layout": {"kind": "four_sided_pyramid", "alpha_deg": 80.5, "beta_deg": 45.5},
        "momentum_limit_n_m_s": 100.0, "torque_limit_n_m": 0.2, "speed_limit_rpm": 6000.0,
        "allocation": "least_squares",
    }  # fmt: skip
    return scenario_from_data({
        "name": "five_days",
        "start": "2007-09-21T09:10:34Z",
        "orbit": {"kind": "numerical", "start": {**kinds, **angles}, "start_frame": "TEME",
                  "degree": 16, "drag": drag},
        "environment": {"atmosphere": AIR, "air_turns": air_turns},
        "spacecraft": {"body": {"inertia_kg_m2": INERTIA}, "wheels": wheels,
                       "aerodynamics": {"parts": [CYLINDER, PANELS]}},
        "initial": {"reference": "orbital", **ATTITUDE, "rate_deg_s": [0.0, 0.0, 0.0],
                    "rate_relative_to": "orbital"},
        "control": {"wheel_law": {**law, "orbital_rate_rad_s": rate_rad_s}, "sample_s": 0.1},
        "simulation": {"duration_s": days * 86400.0, "step_s": 0.1, "record_s": 10.0},
    })  # fmt: skip


class Flight(NamedTuple):
    """What is shown of a flight: times [s], angles [deg] off about x1, x2, x3, H [N m s]."""

    time_s: np.ndarray
    angle_deg: np.ndarray
    total: np.ndarray

    def from_on(self, time_s: float, values) -> np.ndarray:
        """Values after a time."""
        return values[self.time_s >= time_s]

    def last_revolution(self, values, end_s: float) -> np.ndarray:
        """Values of the revolution that ends at a time."""
        return values[(self.time_s > end_s - REVOLUTION_S) & (self.time_s <= end_s)]


@functools.lru_cache(maxsize=8)
def fly(days: float, air_turns: bool, rate_rad_s: float | None, kappa: float = KAPPA) -> Flight:
    """The flight, computed once for all who ask."""
    case = scenario(days, air_turns, rate_rad_s, kappa)
    result = simulate(case)
    momenta = result["wheel_momentum"].values
    total = total_momentum(case.spacecraft.wheels.array().axes, momenta)
    return Flight(result["time"].values, held_in(result).error_deg, total)
