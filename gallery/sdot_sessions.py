"""S-dot sessions as flown by Chibis-M, SDOT Figs. 3.27 to 3.33, from starts drawn at random.

The figures are telemetry whose values are lost. The text prints what it ends at, and that the
session of 9 November 2013 had worked for about 25 minutes when the satellite was stabilised, 90 min
with the gap after them; neither attitude, rate, orbit nor gain. So attitude, direction of the rate,
node and argument of latitude are drawn evenly, the rate from 0.2 to 1.5 deg/s evenly in its
logarithm, such that the first 25 minutes are in sunlight. Kept are the body, coils, Sun sensors and
law (1.17) of the text, 350 km and 51.7 deg of its simulations. Gravity gradient, IGRF and a
residual dipole of 0.024 A m^2 act; the coils rest where no sensor sees the Sun.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from gallery.sdot_runs import ALTITUDE_KM, CONE, INCLINATION_DEG, spinner
from torquer.maths.geometry.frames import dcm_z_to_y
from torquer.scenario.load import scenario_from_data
from torquer.simulation.setup.simulate import simulate
from torquer.theory.slow.evolution import SDOT, sdot
from torquer.theory.slow.evolution.model import Slow

#: Times [s] that the text states: of the session, and of session and gap together.
SESSION_S, WHOLE_S = 1500.0, 5400.0
RECORD_S = 20.0
RATES_DEG_S = (0.2, 1.5)
#: Within this angle [deg] of 0 or 180 an angle counts as there.
NEAR_DEG = 20.0
_START = "2013-11-09T12:00:00Z"


@dataclass(frozen=True)
class Session:
    """Histories of a session: time [s], angle of the momentum to the Sun [deg], of axis 3 to the
    momentum [deg], momentum [N m s]; rate at the start [deg/s], final momentum by (2.18) [N m s].
    """

    t_s: np.ndarray
    gamma_deg: np.ndarray
    theta_deg: np.ndarray
    momentum: np.ndarray
    rate_deg_s: float
    predicted: float

    def near(self, t_s: float, gamma_deg: float | None = None, theta_deg: float | None = None):
        """Whether both angles are near 0 or 180 deg at a time, or near those given."""
        at = int(np.searchsorted(self.t_s, t_s))
        wanted = ((self.gamma_deg[at], gamma_deg), (self.theta_deg[at], theta_deg))
        return all(_is_near(angle, end) for angle, end in wanted)


def _is_near(angle_deg: float, end_deg: float | None) -> bool:
    if end_deg is None:
        return min(angle_deg, 180.0 - angle_deg) < NEAR_DEG
    return abs(angle_deg - end_deg) < NEAR_DEG


def sessions(gain: float, count: int, rates_deg_s=RATES_DEG_S) -> list[Session]:
    """So many sessions with a gain [A m^2 s]; the starts are the same for every gain."""
    return [_flown(gain, number, rates_deg_s) for number in range(count)]


def _start(rng, gain: float, number: int, rates_deg_s):
    """A start, whether it is lit for 25 minutes or not."""
    low, high = np.log(rates_deg_s)
    direction = rng.normal(size=3)
    rate = np.exp(rng.uniform(low, high)) * direction / np.linalg.norm(direction)
    return scenario_from_data({
        "start": _START,
        "seed": number,
        "orbit": {"kind": "circular", "altitude_km": ALTITUDE_KM,
                  "inclination_deg": INCLINATION_DEG, "raan_deg": rng.uniform(0.0, 360.0),
                  "argument_of_latitude_deg": rng.uniform(0.0, 360.0)},
        "environment": {"field": {"kind": "igrf14", "degree": 10}, "gravity_gradient": True},
        "spacecraft": {
            "body": {"preset": "chibis_m_body"},
            "coils": {"preset": "chibis_m_coils", "residual_dipole_a_m2": [0.01, -0.02, 0.01]},
            "sun_sensors": {"preset": "dss3"},
        },
        "initial": {"quaternion": Rotation.random(random_state=rng).as_quat().tolist(),
                    "rate_deg_s": rate.tolist()},
        "control": {"law": {"kind": "sdot", "gain_a_m2_s": gain}, "sample_s": 1.0},
        "simulation": {"duration_s": WHOLE_S, "record_s": RECORD_S},
    })  # fmt: skip


def lit_start(gain: float, number: int, rates_deg_s=RATES_DEG_S):
    """The first start drawn with this number whose first 25 minutes are in sunlight."""
    rng = np.random.default_rng(number)
    while True:
        scenario = _start(rng, gain, number, rates_deg_s)
        surroundings, t_s = scenario.orbit_environment(), np.linspace(0.0, SESSION_S, 26)
        r, _ = surroundings.state(t_s)
        if surroundings.sunlit_fraction(t_s, r).min() > 0.5:
            return scenario


def _flown(gain: float, number: int, rates_deg_s) -> Session:
    scenario = lit_start(gain, number, rates_deg_s)
    result = simulate(scenario)
    momentum, sun = result["momentum_inertial"].values, result["sun_inertial"].values
    turn = Rotation.from_quat(result["q_body_to_inertial"].values)
    length = np.linalg.norm(momentum, axis=1)
    return Session(
        result["time"].values,
        _between_deg(momentum, sun),
        _between_deg(momentum, turn.apply([0.0, 0.0, 1.0])),
        length,
        float(np.degrees(np.linalg.norm(result["omega_body"].values[0]))),
        _predicted(gain, scenario.orbit.raan_deg, momentum[0], sun[0]),
    )


def _between_deg(a, b) -> np.ndarray:
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.sum(a * b, axis=1)))


def _predicted(gain: float, raan_deg: float, momentum, sun) -> float:
    """Final momentum [N m s] by (2.18) from the momentum and Sun at the start, inertial."""
    to_z = Rotation.from_matrix(dcm_z_to_y(CONE)).inv() * Rotation.from_euler(
        "z", -raan_deg, degrees=True
    )
    length = float(np.linalg.norm(momentum))
    first, s = to_z.apply(momentum) / length, to_z.apply(sun) / np.linalg.norm(sun)
    here = spinner().model_copy(update={"sun": tuple(s.tolist()), "momentum_n_m_s": length})
    slow = Slow(1.0, math.acos(first[2]), math.atan2(first[1], first[0]), 0.0)
    return length * abs(float(sdot.final_momentum(slow, SDOT.case(gain, here))))
