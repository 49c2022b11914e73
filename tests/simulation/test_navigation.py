"""What a law knows of attitude and orbit: the truth of the models, if it asks."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import torquer
from torquer.control.law import Law

SCENARIO = """
start = 2025-03-01T00:00:00Z
[orbit]
kind = "kepler"
perigee_altitude_km = 400
apogee_altitude_km = 900
inclination_deg = 63.0
[spacecraft.body]
inertia_kg_m2 = [1.0, 1.5, 1.8]
[spacecraft.coils]
limit_a_m2 = 1.0
[initial]
rate_deg_s = [1.0, 2.0, -1.0]
[control]
law = { kind = "off" }
[simulation]
duration_s = 600
record_s = 60
"""


def watched(navigates):
    """What a law in plain Python was told, at every second, and the run's result."""
    seen = []

    def watch(measured, parameters, memory):
        seen.append(measured)
        return (0.0, 0.0, 0.0)

    law = Law("watch", watch, compiled=False, navigates=navigates)
    result = torquer.simulate(torquer.scenario_from_text(SCENARIO), law)
    return seen[::60], result


def rotation(measured):
    return Rotation.from_quat(measured.q_body_to_inertial).as_matrix()


def test_a_navigating_law_knows_attitude_position_and_velocity():
    seen, result = watched(True)
    for row, measured in enumerate(seen[:10]):
        there = result.isel(time=row)
        assert measured.q_body_to_inertial == pytest.approx(
            tuple(there.q_body_to_inertial.values), abs=1e-15
        )
        r, v = np.array(measured.r_inertial_m), np.array(measured.v_inertial_m_s)
        assert np.linalg.norm(r - there.position_inertial.values) < 1e-9 * np.linalg.norm(r)
        b, b_rate = np.array(measured.b_inertial_t), np.array(measured.b_rate_inertial_t_s)
        assert np.linalg.norm(b - there.b_inertial.values) < 1e-9 * np.linalg.norm(b)
        seen = rotation(measured) @ measured.b_rate_body_t_s
        turned = b_rate - np.cross(rotation(measured) @ measured.omega_body_rad_s, b)
        assert seen == pytest.approx(turned, abs=1e-18)
        assert np.linalg.norm(v - there.velocity_inertial.values) < 1e-6 * np.linalg.norm(v)


def test_other_laws_are_not_told_where_they_are():
    seen, _ = watched(False)
    assert np.isnan([*seen[3].r_inertial_m, *seen[3].v_inertial_m_s, *seen[3].b_inertial_t]).all()
    assert np.isfinite(seen[3].q_body_to_inertial).all()
