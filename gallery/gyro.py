"""What the entries of MGS share: the satellite, its flights, and how far they are from pointing.

The source prints no satellite, gains or numbers. Here those of `examples/magneto_gyro.toml`: two
tonnes, a wheel of 30 N m s, coils of 250 A m^2, 830 km and 98.8 deg, IGRF-14 of degree 13, on board
of degree 8.
"""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.spatial.transform import Rotation

from torquer.analysis.attitude import find_attitude_error
from torquer.computer.laws.magneto_gyro.stage_2 import Stage2Gains
from torquer.environment.earth.rotation import dcm_inertial_to_ecef
from torquer.scenario.load import load_scenario
from torquer.simulation.setup.simulate import simulate
from torquer.theory.magneto_gyro.along_orbit import field_along
from torquer.theory.magneto_gyro.comparison import CaptureGains
from torquer.theory.magneto_gyro.craft import GyroCraft

EXAMPLE = load_scenario(Path(__file__).parents[1] / "examples/magneto_gyro.toml")
PERIOD_S, RATE = EXAMPLE.orbit.period_s, EXAMPLE.orbit.rate_rad_s()
LAW = EXAMPLE.control.law
CRAFT = GyroCraft((3800.0, 2200.0, 3600.0), 30.0, RATE)
RESIDUAL = np.array([8.0, -6.0, 5.0])
GAINS = LAW.gains
CAPTURE = CaptureGains(
    LAW.capture_angle_gain, LAW.capture_rate_gain, LAW.filter_rate_rad_s / RATE, LAW.filter_damping
)
#: Pointed but for a few degrees, at rest in the orbital frame.
NEARLY = {
    "initial.euler_deg": (5.0, -4.0, 5.0), "initial.rate_deg_s": (0.0, 0.0, 0.0),
    "initial.rate_relative_to": "orbital",
}  # fmt: skip
#: The field is read and calculated without an error; the satellite has no dipole of its own.
EXACT = {"control.ephemeris.field": None, "spacecraft.magnetometer.noise_nt": 0.0}
NO_DIPOLE = {"spacecraft.coils.residual_dipole_a_m2": (0.0, 0.0, 0.0)}
STAGE_1_ALONE = {"control.law.stage_2_angle_deg": 1e-3}


class Flown(NamedTuple):
    """A flight: its result, times in orbits, errors (roll, pitch, yaw) [deg]."""

    result: xr.Dataset
    orbits: np.ndarray
    error_deg: np.ndarray

    @property
    def angle_deg(self) -> np.ndarray:
        """Size of the error."""
        return np.linalg.norm(self.error_deg, axis=1)

    @property
    def rate_deg_s(self) -> np.ndarray:
        """Rate relative to the orbital frame."""
        return np.degrees(np.linalg.norm(self.result["omega_orbital"].values, axis=1))

    def stays_below(self, limit_deg: float) -> float:
        """From when on [orbits]; infinite if not by the end."""
        above = np.flatnonzero(self.angle_deg > limit_deg)
        if above.size == 0:
            return 0.0
        return math.inf if above[-1] == len(self.orbits) - 1 else float(self.orbits[above[-1]])

    def rms_deg(self, after: float) -> np.ndarray:
        """Root mean square of each angle."""
        return np.sqrt(np.mean(self.error_deg[self.orbits > after] ** 2, axis=0))

    def logged(self, name: str) -> np.ndarray:
        """What the law recorded."""
        return self.result[f"law.{name}"].values


def fly(changes: dict, orbits: float) -> Flown:
    """The example, changed."""
    scenario = EXAMPLE.replace("simulation.revolutions", orbits)
    for key, value in changes.items():
        scenario = scenario.replace(key, value)
    result = simulate(scenario)
    return Flown(result, result["time"].values / PERIOD_S, find_attitude_error(result).error_deg)


def tip_off(number: int, rate_deg_s: float = 3.0) -> dict:
    """One of many starts: any attitude, a rate about any axis."""
    rng = np.random.default_rng(number)
    rate, attitude = rng.normal(size=3), Rotation.random(random_state=rng)
    return {
        "initial.euler_deg": tuple(attitude.as_euler("ZYX", degrees=True).tolist()),
        "initial.rate_deg_s": tuple((rate_deg_s * rate / np.linalg.norm(rate)).tolist()),
    }


def field():
    """The field along the orbit, and the error of the model on board."""
    return field_along(EXAMPLE.orbit_environment(), EXAMPLE.believed_environment())


def text_form(gains: Stage2Gains) -> dict:
    """The law of the text, which turns with the Earth's dipole (IGRF-14, 2025), with gains."""
    x, y, _ = dcm_inertial_to_ecef([0.0], EXAMPLE.start)[0, 0]
    keys = {
        "form": "text", "dipole_nt": (-29350.0, -1410.3, 4545.5),
        "meridian_deg": math.degrees(math.atan2(y, x)),
    }  # fmt: skip
    return {"control.law": LAW.model_copy(update=keys | keys_of(gains))}


def keys_of(gains: Stage2Gains) -> dict:
    """The 15 gains as keys of the law."""
    return {
        "angle_gains": gains[:3], "rate_gains": gains[3:6], "estimator_gains": gains[6:12],
        "compensator_gains": gains[12:],
    }  # fmt: skip
