"""A coupling matrix that was flown is found again in the telemetry of the flight."""

from datetime import timedelta

import numpy as np
import pytest
from telemetry_session import START, TLE, environment

from torquer import Law, simulate
from torquer.compile import engine
from torquer.ground.telemetry.calibration import GROUPS, calibrate
from torquer.ground.telemetry.modulus import FieldAlong
from torquer.ground.telemetry.reading.quantities import make_session
from torquer.scenario.load import scenario_from_data

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

#: Field [nT per A m^2] of three coils, a row each; hard iron [nT].
COUPLING = np.array([[420.0, -140.0, 60.0], [75.0, 380.0, -260.0], [-125.0, 90.0, 500.0]])
BIAS = np.array([1500.0, -900.0, 2200.0])
NOISE_NT, EVERY_S = 40.0, 10.0
SCENARIO = {
    "start": START.isoformat(),
    "seed": 5,
    "orbit": {"kind": "sgp4", "tle": list(TLE)},
    "spacecraft": {
        "body": {"inertia_kg_m2": [1.5, 1.3, 1.7]},
        "coils": {"limit_a_m2": 1.0},
        "magnetometer": {"noise_nt": NOISE_NT, "bias_nt": BIAS.tolist()},
    },
    "initial": {"rate_deg_s": [1.0, -0.6, 0.8]},
    "control": {"sample_s": EVERY_S, "law": {"kind": "off"}},
    "simulation": {"duration_s": 8000.0, "record_s": EVERY_S, "record_inputs": True},
}


def telemetry(**keys):
    """Session of a flight with coils that step through their patterns, as the computer knows it."""
    craft = SCENARIO["spacecraft"]
    magnetometer = craft["magnetometer"] | {"coil_coupling_nt_per_a_m2": COUPLING.tolist()} | keys
    scenario = scenario_from_data(SCENARIO | {"spacecraft": craft | {"magnetometer": magnetometer}})
    patterns = np.random.default_rng(3).choice([-0.9, 0.0, 0.9], (801, 3))
    ask = Law("ask", lambda now, p, m: tuple(patterns[round(now.t_s / EVERY_S)]), compiled=False)
    result = simulate(scenario, ask).isel(time=slice(1, -1))
    readings, dipole = result["b_measured"].values, result["coil_dipole_on_board"].values
    values = {"b_measured": readings, "dipole_body": dipole}
    utc = np.datetime64(START.replace(tzinfo=None), "ns")
    utc = utc + (1e9 * result["time"].values).astype("timedelta64[ns]")
    return make_session(utc, values, source="simulation")


def test_a_flown_coupling_matrix_is_found_within_the_stated_uncertainty():
    data = telemetry()
    start = START + timedelta(seconds=EVERY_S)  # that of the first row
    field = FieldAlong(environment(start), data["time"].values)
    found = calibrate(data, field, ("bias", "scale", "coils"))
    matrix = np.array([found.of(name) for name in GROUPS["coils"].names]).reshape(3, 3)
    stated = np.array([found.sigmas[name] for name in GROUPS["coils"].names]).reshape(3, 3)
    error = matrix - 1e-9 * COUPLING.T
    assert stated.max() < 15e-9  # 3 % of the matrix
    assert np.abs(error / stated).max() < 4.0
    assert 0.3 < np.mean((error / stated) ** 2) < 2.5
    assert found.bias == pytest.approx(1e-9 * BIAS, abs=20e-9)
    assert found.rms == pytest.approx(1e-9 * NOISE_NT, rel=0.1)
