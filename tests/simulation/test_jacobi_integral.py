"""The Jacobi integral of a free motion under gravity, circular orbit: SDOT (1.11), corrected."""

import numpy as np
import pytest

from torquer import simulate
from torquer.compile import engine
from torquer.maths.geometry.attitudes import to_body
from torquer.scenario.load import load_scenario

FREE = """
start = 2024-03-01T00:00:00Z
[orbit]
kind = "circular"
altitude_km = 700
inclination_deg = 60
[spacecraft.body]
inertia_kg_m2 = [1.0255, 1.5393, 1.8172]
[environment]
gravity_gradient = true
[initial]
rate_deg_s = [0.11, 0.17, -0.06]
[control]
law = { kind = "off" }
[simulation]
duration_s = 20000
record_s = 50
"""


@pytest.mark.skipif(not engine.COMPILED, reason="20 000 s of flight")
def test_the_integral_has_twice_the_last_term(tmp_path):
    path = tmp_path / "free.toml"
    path.write_text(FREE)
    scenario = load_scenario(path)
    result = simulate(scenario)
    t, q = result["time"].values, result["q_body_to_inertial"].values
    r, v = scenario.orbit.state(t, scenario.start)
    normal = np.cross(r, v)
    up, across = (x / np.linalg.norm(x, axis=1)[:, None] for x in (r, normal))
    up, across = to_body(q, up), to_body(q, across)
    rate, omega = scenario.orbit.rate_rad_s(scenario.start), result["omega_body"].values
    inertia = np.array(scenario.spacecraft.body.inertia)
    kinetic = np.einsum("ni,ij,nj->n", omega, inertia, omega)
    gravity = 3.0 * rate**2 * np.einsum("ni,ij,nj->n", up, inertia, up)
    coupled = rate * np.einsum("ni,ij,nj->n", across, inertia, omega)
    spread = [
        np.ptp(x) / abs(x.mean())
        for x in (kinetic + gravity - 2.0 * coupled, kinetic + gravity - coupled)
    ]
    assert spread[0] < 1e-6 and spread[1] > 0.01
