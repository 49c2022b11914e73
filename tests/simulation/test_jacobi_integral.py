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
record_s = 10
"""


needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="20 000 s of flight")


@pytest.fixture(scope="module")
def motion(tmp_path_factory):
    """(Times, body rates, inertia, orbital rate; up, normal and motion in body axes)."""
    path = tmp_path_factory.mktemp("jacobi") / "free.toml"
    path.write_text(FREE)
    scenario = load_scenario(path)
    result = simulate(scenario)
    t, q = result["time"].values, result["q_body_to_inertial"].values
    r, v = scenario.orbit.state(t, scenario.start)
    axes = [to_body(q, x / np.linalg.norm(x, axis=1)[:, None]) for x in (r, np.cross(r, v), v)]
    inertia = np.array(scenario.spacecraft.body.inertia)
    return t, result["omega_body"].values, inertia, scenario.orbit.rate_rad_s(scenario.start), axes


def spread(values):
    """Range over the mean's modulus."""
    return np.ptp(values) / abs(values.mean())


def parts(motion, second):
    """T, G and K = omega0 (e2, J omega) along the motion, with `second` as e2."""
    _, omega, inertia, rate, (up, *_) = motion
    kinetic = np.einsum("ni,ij,nj->n", omega, inertia, omega)
    gravity = 3.0 * rate**2 * np.einsum("ni,ij,nj->n", up, inertia, up)
    return kinetic, gravity, rate * np.einsum("ni,ij,nj->n", second, inertia, omega)


@needs_jit
def test_the_integral_has_twice_the_last_term(motion):
    kinetic, gravity, coupled = parts(motion, motion[-1][1])
    assert spread(kinetic + gravity - 2.0 * coupled) < 1e-6
    assert 0.0155 < spread(kinetic + gravity - coupled) < 0.0165  # the errata's 0.016


@needs_jit
def test_its_second_axis_is_the_normal_not_the_velocity(motion):
    """The text after (1.11) has e2 along the velocity; stability after (1.13) needs the normal."""
    kinetic, gravity, along = parts(motion, motion[-1][2])
    assert min(spread(kinetic + gravity - n * along) for n in (1.0, 2.0)) > 0.01


@needs_jit
def test_the_equation_before_it_needs_the_inertia(motion):
    """dw/dt + w x Jw = M as printed: its first term has another unit; J dw/dt does."""
    t, omega, inertia, rate, (up, *_) = motion
    turning = np.gradient(omega, t, axis=0)[1:-1]
    torque = 3.0 * rate**2 * np.cross(up, up @ inertia)[1:-1]
    carried = np.cross(omega, omega @ inertia)[1:-1]
    scale = np.abs(torque).max()
    assert np.abs(turning @ inertia + carried - torque).max() < 0.002 * scale
    assert np.abs(turning + carried - torque).max() > 0.2 * scale
