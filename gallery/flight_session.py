"""The session of 4 March 2012, MAG section 5.3, from simulated telemetry.

Printed: the two-line elements, the date, the cycle (6 s of measurement, 3 s of actuation), a row
each 30 to 32 s, seven rows of the gyros. Not printed, and chosen here: the gain and the attitude,
which is drawn; the rate is that of the first of the seven rows.
"""

from functools import cache
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from torquer import load_scenario
from torquer.simulation.setup.simulate import simulate

EXAMPLE = Path(__file__).parents[1] / "examples" / "chibis_m_detumble.toml"
#: First row of Table 5.3.1: its time, 14:33:50 in Moscow (UTC+4), and the rate [deg/s].
FIRST_ROW, RATE_DEG_S = "2012-03-04T10:33:50Z", (0.1738, 0.2119, 0.0803)
DURATION_S, CADENCE_S, GAIN = 3600.0, 31.0, 5e6
ATTITUDES = 12


@cache
def session(number: int, bias_nt=(0.0, 0.0, 0.0), noise_nt=50.0, gain=GAIN):
    """The result of a session from one of the attitudes; the gain in A m^2 s/T."""
    scenario = load_scenario(EXAMPLE).replace("start", FIRST_ROW)
    quaternion = tuple(Rotation.random(random_state=number).as_quat().tolist())
    for key, value in {
        "seed": number,
        "initial.rate_deg_s": RATE_DEG_S,
        "initial.quaternion": quaternion,
        "spacecraft.magnetometer.bias_nt": bias_nt,
        "spacecraft.magnetometer.noise_nt": noise_nt,
        "control.law.gain_a_m2_s_per_t": gain,
        "simulation": {"duration_s": DURATION_S, "record_s": CADENCE_S, "record_inputs": True},
    }.items():
        scenario = scenario.replace(key, value)
    return simulate(scenario)


def rate_deg_s(result) -> np.ndarray:
    """Absolute rate [deg/s]."""
    return np.degrees(np.linalg.norm(result["omega_body"].values, axis=1))
