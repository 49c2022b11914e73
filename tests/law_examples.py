"""An example of every kind of law, as a scenario gives it."""

#: One line per law: the keys of an example.
EXAMPLES = {
    "off": {},
    "bdot": {"gain_a_m2_s_per_t": 1e5},
    "bdot_rate": {"gain_a_m2_s_per_t": 1e5},
    "bdot_derivative": {"gain_a_m2_s_per_t": 1e5},
    "bdot_model": {"gain_a_m2_s_per_t": 1e5},
    "sdot": {"gain_a_m2_s": 6e3},
    "sdot_rate": {"gain_a_m2_s": 6e3},
    "sun_cross": {"gain_n_m": 1e-4, "axis": [0.0, 0.6, 0.8]},
    "spin_to_sun": {
        "gain_n_m": 1e-4,
        "momentum_n_m_s": 0.001,
        "begin_deg": 44.0,
        "axis": [0.0, 0.6, 0.8],
        "inertia_kg_m2": [[1.49, 0.054, 0.0442], [0.054, 1.51, 0.0], [0.0442, 0.0, 1.56]],
    },
    "nutation_damping": {"gain_a_m2_s_per_t": 1e5, "axis": [0.0, 0.6, 0.8]},
    "nutation_damping_rate": {"gain_a_m2_s_per_t": 1e5},
    "nutation_damping_derivative": {"relay_dipole_a_m2": 0.8, "axis": [1.0, 2.0, -2.0]},
    "spin_up": {
        "relay_dipole_a_m2": 0.1,
        "target_rate_deg_s": 2.0,
        "axis": [0.0, -1.0, 0.0],
        "first_coil": [1.0, 0.0, 1.0],
    },
    "reorientation": {
        "gain_a_m2_per_n_m_s_t": 1e6,
        "target": [1.0, 1.0, 0.0],
        "momentum_n_m_s": 0.05,
        "inertia_kg_m2": [[1.49, 0.054, 0.0442], [0.054, 1.51, 0.0], [0.0442, 0.0, 1.56]],
    },
    "preliminary_1": {"gain_a_m2_per_t": 5e5, "target": "sun", "axis": [0.0, 0.6, 0.8]},
    "preliminary_2": {
        "gain_a_m2_per_t": 5e5,
        "target": [0.0, -0.6, 0.8],
        "inertia_kg_m2": [[1.49, 0.054, 0.0442], [0.054, 1.51, 0.0], [0.0442, 0.0, 1.56]],
    },
    "three_axis": {
        "rate_gain_n_m_s_per_t2": 1e5,
        "angle_gain_n_m_per_t2": 30.0,
        "euler_deg": [40, 20, -10],
    },
    "periodic_gains": {
        "rate_gains_n_m_s_per_t2": [
            [[1e5, 2e4, 0.0], [-1e4, 9e4, 0.0], [0.0, 5e3, 8e4]],
            [[0.0, 1e4, 0.0], [0.0, 0.0, 2e4], [3e4, 0.0, 0.0]],
            [[1e4, 0.0, 0.0], [0.0, -2e4, 0.0], [0.0, 0.0, 1e4]],
        ],
        "angle_gains_n_m_per_t2": [
            [[30.0, 2.0, 0.0], [-1.0, 25.0, 0.0], [0.0, 5.0, 35.0]],
            [[0.0, 1.0, 0.0], [0.0, 0.0, 2.0], [3.0, 0.0, 0.0]],
            [[1.0, 0.0, 0.0], [0.0, -2.0, 0.0], [0.0, 0.0, 1.0]],
        ],
        "euler_deg": [40, 20, -10],
    },
    "projected_pd": {
        "rate_gain_n_m_s": 1e-3,
        "angle_gain_n_m": 1e-6,
        "mean_projection": [[0.7, 0.1, 0.0], [0.1, 0.9, -0.1], [0.0, -0.1, 0.4]],
        "euler_deg": [40, 20, -10],
    },
    "sliding_mode": {
        "manifold_rate_rad_s": 2e-3,
        "reaching_rate_per_s": 5e-3,
        "euler_deg": [40, 20, -10],
        "inertia_kg_m2": [[1.49, 0.054, 0.0442], [0.054, 1.51, 0.0], [0.0442, 0.0, 1.56]],
    },
    "wheel_pd": {
        "bandwidth_rad_s": 0.1,
        "euler_deg": [40, 20, -10],
        "orbital_rate_rad_s": 1e-3,
        "inertia_kg_m2": [[1.49, 0.054, 0.0442], [0.054, 1.51, 0.0], [0.0442, 0.0, 1.56]],
    },
    "wheel_lyapunov": {
        "rate_gain_n_m_s": 0.1,
        "angle_gain_n_m": 0.01,
        "euler_deg": [40, 20, -10],
        "inertia_kg_m2": [[1.49, 0.054, 0.0442], [0.054, 1.51, 0.0], [0.0442, 0.0, 1.56]],
    },
    "unloading": {
        "gain_per_s": 1e-3,
        "wanted_momentum_n_m_s": [0.1, 0.2, -0.1],
        "dead_band_n_m_s": 0.3,
    },
    "bias_momentum": {
        "pitch_axis": [0.0, 0.6, -0.8],
        "bias_momentum_n_m_s": 0.4,
        "pitch_inertia_kg_m2": 1.5,
        "bandwidth_rad_s": 0.05,
        "integral_time_s": 200.0,
        "nutation_gain_a_m2_s_per_t": 1e5,
        "unloading_gain_per_s": 1e-3,
        "euler_deg": [40, 20, -10],
    },
    "user": {"file": "law.py", "parameters": {"gain": 5e4}},
}
