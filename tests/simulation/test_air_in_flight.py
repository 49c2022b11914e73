"""The air's torque in the loop: what it adds to the angular momentum is its integral."""

import numpy as np
import pytest
from scipy.integrate import simpson
from scipy.spatial.transform import Rotation
from slow_cases import slow_after

import torquer
from torquer.base.conventions import EARTH_RATE_RAD_S

SCENARIO = """
start = 2025-03-01T00:00:00Z
[orbit]
kind = "circular"
altitude_km = 350
inclination_deg = 51.6
[environment]
field = { kind = "direct_dipole" }
gravity_gradient = false
table_tolerance = 1e-7
earth_rotation = "sidereal"
AIR
[spacecraft.body]
inertia_kg_m2 = [1.0, 1.3, 1.6]
[spacecraft.coils]
limit_a_m2 = 1.0
# no torque, but what is compiled is what other flights with all torques need
[disturbance.solar_pressure]
parts = [{ kind = "sphere", radius_m = 1e-9, centre_m = [0.0, 0.0, 0.0] }]
[spacecraft.aerodynamics]
parts = [
  { kind = "plate", axis = [0, 0, 1], area_m2 = 0.5, centre_m = [0.2, 0.0, 0.1] },
  { kind = "sphere", radius_m = 0.3, centre_m = [0.0, -0.1, 0.0] },
]
[initial]
rate_deg_s = [0.2, -0.1, 0.15]
[control]
law = { kind = "off" }
[simulation]
duration_s = 3000
record_s = 5
integrator = "INTEGRATOR"
STEP
"""
GOST = 'atmosphere = { kind = "gost", f107 = 150, ap = 12 }'


def scenario(integrator="rk4", air=GOST):
    step = "" if integrator == "auto" else "step_s = 1.0"
    text = SCENARIO.replace("INTEGRATOR", integrator).replace("AIR", air).replace("STEP", step)
    return torquer.scenario_from_text(text)


def torque_inertial(made, result):
    """The torque at the records, written independently for a plate and a sphere."""
    r, v = result.position_inertial.values, result.velocity_inertial.values
    environment = made.orbit_environment()
    t = result.time.values
    to_ecef = environment.dcm_to_ecef(t)
    r_ecef = np.einsum("nij,nj->ni", to_ecef, r)
    rho = made.environment.atmosphere.density(t, made.start, r_ecef)
    speed = v - EARTH_RATE_RAD_S * np.cross([0.0, 0.0, 1.0], r)
    attitude = Rotation.from_quat(result.q_body_to_inertial.values)
    body = attitude.inv().apply(speed)
    size = np.linalg.norm(body, axis=1)
    along = body / size[:, None]
    plate = 0.5 * np.abs(along[:, 2])[:, None] * np.cross([0.2, 0.0, 0.1], along)
    sphere = np.pi * 0.3**2 * np.cross([0.0, -0.1, 0.0], along)
    return attitude.apply(-(rho * size**2)[:, None] * (plate + sphere))


@pytest.mark.parametrize("integrator", slow_after(1, ("rk4", "auto", "splitting")))
def test_momentum_gained_is_the_integral_of_the_torque(integrator):
    made = scenario(integrator)
    result = torquer.simulate(made)
    gained = result.momentum_inertial.values[-1] - result.momentum_inertial.values[0]
    expected = simpson(torque_inertial(made, result), x=result.time.values, axis=0)
    assert np.linalg.norm(gained) > 1e-4
    assert gained == pytest.approx(expected, abs=3e-3 * np.linalg.norm(expected))


def test_a_body_for_the_air_needs_an_atmosphere():
    with pytest.raises(ValueError, match=r"environment.atmosphere: must be given with spacecraft"):
        scenario(air="")
