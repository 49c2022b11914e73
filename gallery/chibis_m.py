"""Chibis-M under its automatic logic, SDOT Figs. 3.22 to 3.26: one day, and many starts.

The text shows telemetry and prints neither elements nor noise beyond Table 3.1. Chosen here: the
orbit, bias and drift of the gyros, field of the coils at the magnetometer, momentum of the wheels,
gains.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from torquer.analysis.attitude import orbital_axes
from torquer.scenario.load import scenario_from_data
from torquer.simulation.setup.simulate import simulate

INERTIA = [[1.0255, 0.0014, -0.0724], [0.0014, 1.5393, 0.0019], [-0.0724, 0.0019, 1.8172]]
BIAS_DEG_S, DRIFT_DEG_S_SQRT_S = [0.02, -0.015, 0.01], 1e-4
#: Places of the states in the shipped presets of regions.
BDOT, WAITING, TRIAD, MAG_DSS, MAG_WRATE = range(5)
DETUMBLING, ACQUISITION, SCIENCE = range(3)


def day() -> dict:
    """The scenario of `examples/chibis_m_day.toml`."""
    noise = {"magnetometer_noise_nt": 100.0}
    return {
        "name": "chibis_m_day",
        "start": "2012-03-04T10:31:47Z",
        "seed": 7,
        "orbit": {"kind": "circular", "altitude_km": 500, "inclination_deg": 51.7,
                  "raan_deg": 324.6},
        "environment": {"field": {"kind": "igrf14", "degree": 10}, "gravity_gradient": True},
        "spacecraft": {
            "body": {"preset": "chibis_m_body"},
            "wheels": {"preset": "chibis_m_wheels", "coulomb_friction_n_m": 2e-6,
                       "viscous_friction_n_m_s": 1e-9, "speed_noise_rpm": 5.0,
                       "minimum_speed_fraction": 0.1},
            "coils": {"preset": "chibis_m_coils", "residual_dipole_a_m2": [0.01, -0.02, 0.01]},
            "magnetometer": {"preset": "hmr2300r", "coil_disturbance_nt_per_a_m2": 500.0},
            "gyro": {"preset": "adis16130", "bias_deg_s": BIAS_DEG_S,
                     "bias_drift_deg_s_sqrt_s": DRIFT_DEG_S_SQRT_S},
            "sun_sensors": {"preset": "dss3"},
        },
        "initial": {"euler_deg": [40.0, -70.0, 110.0], "rate_deg_s": [3.0, -4.0, 2.0]},
        "control": {
            "sample_s": 1.0, "measure_s": 4.0, "actuate_s": 3.0, "control_while_actuating": True,
            "estimator": {"kind": "none"},
            "estimators": {
                "field_rate": {"kind": "rate_from_field", "interval_s": 4.0},
                "triad": {"kind": "triad", **noise, "sun_noise_deg": 0.15, "rate": "gyro"},
                "mag_dss": {
                    "kind": "kalman_dynamics", "sensors": ["magnetometer", "sun"], **noise,
                    "sun_noise_deg": 0.15, "inertia_kg_m2": INERTIA,
                    "torque_noise_n_m_sqrt_s": 2e-5, "rate_sigma_deg_s": 0.5,
                },
                "mag_wrate": {
                    "kind": "kalman_gyro", "sensors": ["magnetometer"], **noise,
                    "angle_random_walk_deg_sqrt_s": 0.01, "rate_random_walk_deg_s_sqrt_s": 1e-4,
                    "gyro_bias_sigma_deg_s": 0.03,
                },
            },
            "laws": {
                "damping": {"kind": "bdot", "gain_a_m2_s_per_t": 3e6},
                "hold": {"kind": "wheel_lyapunov", "rate_gain_n_m_s": 0.06,
                         "angle_gain_n_m": 0.0012, "greatest_rate_deg_s": 0.25,
                         "inertia_kg_m2": INERTIA},
                "unload": {"kind": "unloading", "gain_per_s": 1e-3},
            },
            "modes": {
                "attitude": {"reference": "orbital"},
                "regions": {
                    "determination": {"preset": "chibis_m_determination"},
                    "stabilisation": {"preset": "chibis_m_stabilisation"},
                },
            },
        },
        "simulation": {"duration_s": 86400, "record_s": 10.0},
    }  # fmt: skip


def a_start(number: int, hours: float, gyro: dict | None = None):
    """One of many starts: seed, node, attitude and rate of 2 to 6 deg/s drawn; another gyro."""
    rng, data = np.random.default_rng(number), day()
    rate = rng.normal(size=3)
    rate *= rng.uniform(2.0, 6.0) / np.linalg.norm(rate)
    data["seed"], data["orbit"]["raan_deg"] = 1000 + number, rng.uniform(0.0, 360.0)
    data["initial"] = {
        "quaternion": Rotation.random(random_state=number).as_quat().tolist(),
        "rate_deg_s": rate.tolist(),
    }
    data["spacecraft"]["gyro"] |= gyro or {}
    data["simulation"]["duration_s"] = 3600.0 * hours
    return scenario_from_data(data)


@dataclass(frozen=True)
class Course:
    """Histories of a flight.

    Time [s]; states of both regions; orbital frame to body, truth and estimate (invalid where there
    is none, see `known`); rate relative to the orbital frame, truth and estimate [deg/s], gyro
    [deg/s]; visible part of the Sun; estimator's own standard deviation [deg].
    """

    t_s: np.ndarray
    determination: np.ndarray
    stabilisation: np.ndarray
    turn: Rotation
    estimated_turn: Rotation
    known: np.ndarray
    rate_deg_s: np.ndarray
    estimated_rate_deg_s: np.ndarray
    gyro_deg_s: np.ndarray
    sunlit_fraction: np.ndarray
    sigma_deg: np.ndarray

    @property
    def error_deg(self) -> np.ndarray:
        """Turn from the orbital frame."""
        return np.degrees(self.turn.magnitude())

    @property
    def estimate_error_deg(self) -> np.ndarray:
        """Turn from the true attitude to the estimated one; not a number where there is none."""
        apart = np.degrees((self.estimated_turn.inv() * self.turn).magnitude())
        return np.where(self.known, apart, np.nan)

    def first_s(self, region: np.ndarray, state: int) -> float:
        """When a region was first in a state; infinite if never."""
        there = region == state
        return float(self.t_s[there.argmax()]) if there.any() else np.inf

    def longest_s(self, region: np.ndarray, state: int) -> float:
        """The longest time that a region was in a state without a break."""
        edges = np.flatnonzero(np.diff(np.concatenate([[0], region == state, [0]])))
        lengths = edges[1::2] - edges[::2]
        return float((self.t_s[1] - self.t_s[0]) * lengths.max(initial=0))


def flown(scenario) -> Course:
    """The course of a flight."""
    result = simulate(scenario)
    estimated = result["q_estimated"].values
    known = np.all(np.isfinite(estimated), axis=1)
    r, v = result["position_inertial"].values, result["velocity_inertial"].values
    orbital, turning = orbital_axes(r, v), np.cross(r, v) / np.sum(r * r, axis=1)[:, None]
    truth = Rotation.from_quat(result["q_body_to_inertial"].values)
    belief = Rotation.from_quat(np.where(known[:, None], estimated, [0.0, 0.0, 0.0, 1.0]))
    believed_rate = result["omega_estimated"].values - belief.inv().apply(turning)
    return Course(
        result["time"].values,
        result["mode_determination"].values.astype(int),
        result["mode_stabilisation"].values.astype(int),
        orbital.inv() * truth,
        orbital.inv() * belief,
        known,
        np.degrees(result["omega_orbital"].values),
        np.where(known[:, None], np.degrees(believed_rate), np.nan),
        np.degrees(result["omega_measured"].values),
        result["sunlit_fraction"].values,
        np.degrees(result["attitude_sigma"].values),
    )
