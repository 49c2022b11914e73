"""The same code without the compiler gives the same numbers (coverage is measured that way)."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import torquer
from torquer.compile import engine

#: Runs in this process, compiled, and in another one as plain Python; leaves `found`.
PROBE = """
import numpy as np
import torquer
from torquer.maths.integrate.free_body import free_rotation
from torquer.maths.geometry.motion import Motion
from torquer.maths.integrate.splitting import drift, kick
from torquer.base.noise import normal3
from torquer.scenario.change import with_values
from torquer.spacecraft.body import Body

Q = (0.5, -0.5, 0.5, 0.5)
found = {}
for name, omega in {
    "about the third axis": (0.1, -0.2, 0.9),
    "about the first axis": (0.9, 0.1, -0.1),
    "near the middle axis": (1e-7, 0.6, 1e-7),
    "at rest": (0.0, 0.0, 0.0),
    "on the middle axis": (0.0, 0.6, 0.0),
}.items():
    q, after = free_rotation((1.0, 1.3, 1.7), Q, omega, 21.0)
    found[name] = [*q, *after]
body = Body(
    inertia_kg_m2=((1.0, 0.05, -0.08), (0.05, 1.3, 0.04), (-0.08, 0.04, 1.7)),
    wheel_momentum_n_m_s=(0.02, -0.05, 0.03),
)
rigid, principal = body.pack(), body.pack_principal()
x = drift(*principal, Motion(Q, (0.1, -0.2, 0.9)), 3.0)
x = kick(rigid.inertia, rigid.wheel_momentum, (1e-3, 2e-3, -1e-3), x, 3.0)
found["splitting"] = [*x.q, *x.omega]
found["noise"] = [*normal3(2**40 + 7, 3, 2**33 + 5)]

scenario = torquer.Scenario.model_validate(
    {
        "start": "2026-01-01T00:00:00Z",
        "seed": 42,
        "orbit": {"kind": "circular", "altitude_km": 500.0, "inclination_deg": 52.0},
        "spacecraft": {
            "body": body.model_dump(),
            "coils": {
                "limit_a_m2": [0.6, 1.5, 1.0, 0.8],
                "axes": [[1, 0, 0], [0, 1, 0.2], [0, 0, 1], [1, 1, 1]],
                "lag_s": 0.7,
                "residual_dipole_a_m2": [0.01, 0.0, -0.02],
                "power_at_limit_w": 0.5,
            },
            "permanent_magnet_a_m2": [0.1, 0.0, -0.2],
            "hysteresis_rods": [
                {"axis": [0, 1, 0], "volume_m3": 1e-6, "coercive_a_m": 12.0,
                 "remanence_t": 0.004, "saturation_t": 0.025},
                {"axis": [1, 1, 0], "volume_m3": 2e-6, "coercive_a_m": 9.0, "power": 4.75,
                 "least_slope": 0.1, "remanence_t": 0.004, "saturation_t": 0.025},
            ],
            "magnetometer": {
                "noise_nt": 50.0,
                "bias_nt": [100, -200, 50],
                "misalignment_deg": [0.5, -0.2, 0.1],
                "resolution_nt": 8.0,
                "range_nt": 60000.0,
                "coil_disturbance_nt_per_a_m2": 30.0,
            },
            "gyro": {"noise_deg_s": 0.01, "bias_drift_deg_s_sqrt_s": 0.001},
            "sun_sensors": {
                "axes": [[0, 0, 1], [0, 0, -1]], "half_field_deg": [90, 89], "noise_deg": 0.5,
                "bias_deg": [[0.1, 0, 0], [0, 0.2, 0]], "albedo": 0.3,
                "blind_zones": [{"axis": [0, 0, 1], "half_angle_deg": 5}],
            },
        },
        "disturbance": {
            "constant_torque_n_m": [1e-6, 0, 0],
            "random_torque_n_m": 1e-6,
            "random_hold_s": 2.0,
            "solar_pressure": {
                "parts": [
                    {"kind": "plate", "axis": [0, 1, 1], "area_m2": 20.0, "centre_m": [0, 0, 5],
                     "specular_reflectivity": 0.3, "diffuse_reflectivity": 0.4},
                    {"kind": "cylinder", "axis": [1, 0, 1], "radius_m": 2.0, "length_m": 5.0,
                     "centre_m": [4, 0, 0], "specular_reflectivity": 0.5},
                ]
            },
            "residual_dipole": {"amplitude_a_m2": [0.1, 0, 0], "phase_deg": 50.0},
            "energy_sink": {"damper_kg_m2": 0.1, "time_constant_s": 0.2},
            "eddy_currents": {"damping_n_m_s_per_t2": [1e5, 2e5, 3e5]},
            "unmodelled": {"constant_n_m": 1e-6, "harmonic_1_n_m": 1e-6, "hold_s": 3.0},
        },
        "initial": {"rate_deg_s": [2.0, -1.0, 3.0], "euler_deg": [20, -35, 70]},
        "control": {
            "law": {"kind": "bdot", "gain_a_m2_s_per_t": 2e5},
            "sample_s": 1.0,
            "measure_s": 2.0,
            "actuate_s": 3.0,
        },
        "simulation": {"duration_s": 10.0, "step_s": 1.0, "record_s": 1.0},
    }
)
result = torquer.simulate(scenario)
NAMES = (
    "q_body_to_inertial", "omega_body", "dipole_body", "b_measured", "omega_measured",
    "sun_measured", "command_body", "momentum_inertial",
)
for name in NAMES:
    found[name] = result[name].values.ravel().tolist()
found["coils"] = [float(result["coil_energy"]), float(result["peak_coil_dipole"])]
failed = torquer.simulate(with_values(scenario, {
    "spacecraft.magnetometer.failures": [
        {"kind": "swapped", "axes": "yz"}, {"kind": "noise", "noise_nt": 900.0, "from_s": 4.0},
    ],
    "spacecraft.gyro.failures": [{"kind": "reversed"}, {"kind": "bias", "bias_deg_s": [1, 2, 3]}],
    "spacecraft.sun_sensors.failures": [{"kind": "noise", "noise_deg": 9.0}],
    "spacecraft.coils.failures": [
        {"coil": 0, "kind": "stuck", "dipole_a_m2": 0.4, "from_s": 1.0},
        {"coil": 3, "kind": "reversed"},
    ],
    "control.failures": [{"kind": "restarted", "from_s": 4.0, "until_s": 6.0}],
}))
for name in NAMES:
    found[f"failed {name}"] = failed[name].values.ravel().tolist()
driven = torquer.simulate(with_values(scenario, {
    "spacecraft.coils": {
        "windings": {"turns": 400, "area_m2": 0.006, "current_a": 0.5, "resistance_ohm": 3.0},
        "resolution_a_m2": 0.05, "dead_band_a_m2": 0.02, "random_error": 0.05,
        "pwm_period_s": 0.3, "lag_s": 0.05,
    },
    "spacecraft.magnetometer": {
        "coil_coupling_nt_per_a_m2": [[30, 2, 1], [-2, 40, 3], [5, 6, 50]],
        "coil_offset_nt": [5, -6, 7], "soft_iron": [[1.02, 0, 0], [0, 1, 0], [0.03, 0, 0.99]],
    },
    "spacecraft.attitude_sensor": {"boresight": [0, 0, 1], "moon_exclusion_deg": 60.0},
    "control.measure_s": 0.0, "control.actuate_s": None,
}))
for name in NAMES:
    found[f"driven {name}"] = driven[name].values.ravel().tolist()
found["driven coils"] = [float(driven["coil_energy"]), float(driven["peak_coil_dipole"])]
NOISE = {"magnetometer_noise_nt": 500.0, "sun_noise_deg": 15.0}
FILTERS = {
    "kalman_gyro": {
        "angle_random_walk_deg_sqrt_s": 0.01,
        "rate_random_walk_deg_s_sqrt_s": 1e-3,
        "gyro_bias_sigma_deg_s": 0.05,
    },
    "kalman_dynamics": {
        "inertia_kg_m2": body.inertia_kg_m2,
        "torque_noise_n_m_sqrt_s": 1e-2,
        "rate_sigma_deg_s": 3.0,
    },
}
for kind, keys in FILTERS.items():
    filtered = scenario.replace("control.estimator", {"kind": kind, **NOISE, **keys})
    smoothed = torquer.smooth_run(
        torquer.simulate(filtered.replace("simulation.record_inputs", True))
    )
    for name in ("q_smoothed", "states_smoothed", "covariance_smoothed"):
        found[f"{kind} {name}"] = smoothed[name].values.ravel().tolist()
"""


def by_this_process():
    names = {}
    exec(compile(PROBE, "probe", "exec"), names)
    return names["found"]


def by_plain_python():
    script = PROBE + "\nimport json\nprint(json.dumps(found))\n"
    here = str(Path(torquer.__file__).parents[1])
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": here, "NUMBA_DISABLE_JIT": "1"},
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.skipif(not engine.COMPILED, reason="compares compiled code with plain Python")
def test_plain_python_gives_the_numbers_of_compiled_code():
    """The compiler neither fuses nor reorders."""
    compiled, plain = by_this_process(), by_plain_python()
    assert compiled.keys() == plain.keys()
    assert max(np.abs(compiled["dipole_body"])) > 0.1  # the coils were driven
    assert np.ptp(np.abs(compiled["sun_measured"])) > 0.1  # the Sun was seen
    assert np.isfinite(compiled["kalman_dynamics q_smoothed"]).all()
    for name, values in compiled.items():
        assert np.array_equal(plain[name], values), name
