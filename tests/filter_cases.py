"""Scenarios for tests of filters: sensors as on Chibis-M, filters that know their noise."""

SPACECRAFT = {
    "body": {"inertia_kg_m2": [[1.0, 0.05, -0.08], [0.05, 1.3, 0.04], [-0.08, 0.04, 1.7]]},
    "coils": {"limit_a_m2": 3.2},
    "magnetometer": {"noise_nt": 50.0},
    "gyro": {"noise_deg_s": 0.01, "bias_drift_deg_s_sqrt_s": 1e-4},
    "sun_sensors": {
        "axes": [[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]],
        "half_field_deg": 60.0,
        "noise_deg": 0.1,
    },
}
GYRO = {
    "kind": "kalman_gyro",
    "magnetometer_noise_nt": 50.0,
    "sun_noise_deg": 0.1,
    "angle_random_walk_deg_sqrt_s": 0.01,
    "rate_random_walk_deg_s_sqrt_s": 1e-4,
    "gyro_bias_sigma_deg_s": 0.05,
}
DYNAMICS = {
    "kind": "kalman_dynamics",
    "magnetometer_noise_nt": 50.0,
    "sun_noise_deg": 0.1,
    "inertia_kg_m2": SPACECRAFT["body"]["inertia_kg_m2"],
    "torque_noise_n_m_sqrt_s": 1e-6,
    "rate_sigma_deg_s": 0.2,
}
#: The noise that such a filter believes in.
DISTURBANCE = {"random_torque_n_m": 1e-6, "random_hold_s": 1.0}
#: Lit at the start, in the umbra from about 1500 s to 3600 s.
SCENARIO = {
    "start": "2026-03-04T10:31:47Z",
    "orbit": {"kind": "circular", "altitude_km": 550.0, "inclination_deg": 60.0},
    "environment": {"earth_rotation": "sidereal"},
    "spacecraft": SPACECRAFT,
    "initial": {"rate_deg_s": [0.1, -0.06, 0.08], "euler_deg": [20.0, -35.0, 70.0]},
    "control": {"law": {"kind": "off"}, "estimator": GYRO},
    "simulation": {"duration_s": 1200.0, "step_s": 1.0, "record_s": 10.0},
}
#: One TRIAD at the start; handing over to filters without one of the directions.
HANDED_OVER = {
    "laws": {"off": {"kind": "off"}},
    "estimators": {"triad": {"kind": "triad", "magnetometer_noise_nt": 50.0, "sun_noise_deg": 0.1}},
    "modes": {
        "regions": {
            "estimator": {
                "states": {
                    "start": {
                        "laws": ["off"],
                        "estimator": "triad",
                        "transitions": [{"to": "filter", "at_least_s": 3.0}],
                    },
                    "filter": {"laws": ["off"], "estimator": "estimator"},
                }
            }
        }
    },
}


def without(keys: dict, *names: str) -> dict:
    """The same keys less some."""
    return {key: value for key, value in keys.items() if key not in names}
