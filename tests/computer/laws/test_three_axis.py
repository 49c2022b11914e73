"""Three-axis magnetic law: equilibrium, torque across the field, and that it settles in flight."""

import numpy as np
import pytest
from law_cases import inputs
from scipy.spatial.transform import Rotation

import torquer
from torquer.computer.laws.three_axis import ThreeAxis
from torquer.maths.geometry import euler

R, V = (7e6, 0.0, 0.0), (0.0, 2e3, 7e3)
NORMAL = np.cross(R, V) / np.linalg.norm(np.cross(R, V))
TO_INERTIAL = Rotation.from_matrix(
    np.column_stack([np.cross(NORMAL, [1, 0, 0]), NORMAL, [1, 0, 0]])
)
B = (1e-5, -2e-5, 3e-5)


def answer(spec, attitude, omega):
    return np.array(spec.law()(inputs(b=B, omega=omega, q=attitude.as_quat(), r=R, v=V)))


@pytest.mark.parametrize("reference", ["orbital", "inertial"])
def test_at_the_wanted_attitude_it_asks_for_nothing(reference):
    spec = ThreeAxis(
        rate_gain_n_m_s_per_t2=1e5,
        angle_gain_n_m_per_t2=1e2,
        reference=reference,
        euler_deg=(40.0, -20.0, 10.0),
    )
    wanted = Rotation.from_quat(euler.to_quaternion("321", np.radians([40.0, -20.0, 10.0])))
    turning = np.cross(R, V) / np.dot(R, R)
    if reference == "orbital":
        wanted = TO_INERTIAL * wanted
    else:
        turning = np.zeros(3)
    m = answer(spec, wanted, wanted.inv().apply(turning))
    assert m == pytest.approx(np.zeros(3), abs=1e-12)


def test_small_errors_meet_a_spring_and_damper_across_field():
    """M = m x B = -(B^2 - B B.)(k w + 2 k_a phi) to first order in the turn phi."""
    k, k_a = 1e5, 30.0
    spec = ThreeAxis(rate_gain_n_m_s_per_t2=k, angle_gain_n_m_per_t2=k_a, reference="inertial")
    phi, omega = np.array([1e-4, -2e-4, 0.5e-4]), np.array([1e-5, 3e-5, -2e-5])
    b = np.array(B)
    torque = np.cross(answer(spec, Rotation.from_rotvec(phi), omega), b)
    asked = -(k * omega + 2.0 * k_a * phi)
    expected = b @ b * asked - b * (b @ asked)
    assert torque == pytest.approx(expected, rel=1e-6, abs=0.0)  # torques of 1e-9 N m


def test_a_satellite_settles_in_the_orbital_frame():
    """MAG 4.4: on a steep orbit the angles go to zero in some revolutions."""
    scenario = torquer.scenario_from_text("""
start = 2025-03-01T00:00:00Z
[orbit]
kind = "circular"
altitude_km = 350
inclination_deg = 70.0
[environment]
field = { kind = "averaged" }
gravity_gradient = false
table_tolerance = 1e-7
[spacecraft.body]
inertia_kg_m2 = [1.0, 2.0, 1.5]
[spacecraft.coils]
limit_a_m2 = 100.0
[initial]
reference = "orbital"
rate_relative_to = "orbital"
euler_deg = [15.0, -10.0, 12.0]
rate_deg_s = [0.01, -0.02, 0.01]
[control]
law = { kind = "three_axis", rate_gain_n_m_s_per_t2 = 2e5, angle_gain_n_m_per_t2 = 50.0 }
[simulation]
revolutions = 20
record_s = 60
""")
    result = torquer.simulate(scenario)
    normal = np.cross(result.position_inertial, result.velocity_inertial)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    y_axis = Rotation.from_quat(result.q_body_to_inertial).apply([0.0, 1.0, 0.0])
    off = np.degrees(np.arccos(np.clip(np.sum(y_axis * normal, axis=1), -1.0, 1.0)))
    assert off[0] > 10.0
    assert off[-90:].max() < 0.5


def test_gains_and_sequence_are_checked():
    with pytest.raises(ValueError, match="rate_gain_n_m_s_per_t2"):
        ThreeAxis(rate_gain_n_m_s_per_t2=0.0, angle_gain_n_m_per_t2=1.0)
    with pytest.raises(ValueError, match="sequence"):
        ThreeAxis(rate_gain_n_m_s_per_t2=1.0, angle_gain_n_m_per_t2=1.0, sequence="112")
