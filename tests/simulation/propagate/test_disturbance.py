"""Disturbing torques: what they do to the momentum, under every integrator."""

import numpy as np
import pytest
from integrators import INTEGRATORS

import torquer

SCENARIO = """
start = 2025-03-01T00:00:00Z
seed = {seed}
[orbit]
kind = "circular"
altitude_km = 500
inclination_deg = 63.0
[environment]
field = {{ kind = "direct_dipole" }}
gravity_gradient = false
table_tolerance = 1e-6
[spacecraft.body]
inertia_kg_m2 = {inertia}
[spacecraft.coils]
limit_a_m2 = 1.0
[disturbance]
{disturbance}
[initial]
rate_deg_s = {rate}
[control]
law = {{ kind = "off" }}
sample_s = 10
[simulation]
duration_s = {duration}
record_s = 10
integrator = "{integrator}"
{step}
"""
CONSTANT = "constant_torque_n_m = [1e-3, -2e-3, 0.5e-3]"
RANDOM = "random_torque_n_m = 1e-3\nrandom_hold_s = 2"


def run(disturbance, integrator="rk4", inertia=(1.0, 1.3, 1.6), rate=(0, 0, 0), **keys):
    text = SCENARIO.format(
        disturbance=disturbance,
        integrator=integrator,
        step="" if integrator == "auto" else "step_s = 1.0",
        inertia=list(inertia),
        rate=list(rate),
        seed=keys.get("seed", 1),
        duration=keys.get("duration", 200),
    )
    return torquer.simulate(torquer.scenario_from_text(text))


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_work_of_a_constant_torque_is_the_change_of_energy(integrator):
    """d/dt (w.J w / 2) = w.M, with the angle turned by the trapezoid rule over fine records."""
    inertia = np.array([1.0, 1.3, 1.6])
    result = run(CONSTANT, integrator, rate=(2.0, -1.0, 3.0))
    w = result.omega_body.values
    energy = 0.5 * np.sum(w * inertia * w, axis=1)
    power = w @ [1e-3, -2e-3, 0.5e-3]
    work = np.r_[0.0, np.cumsum(0.5 * (power[1:] + power[:-1]) * 10.0)]
    assert energy - energy[0] == pytest.approx(work, abs=0.02 * np.ptp(energy))
    assert np.ptp(energy) > 0.2 * energy[0]


@pytest.mark.parametrize("disturbance", [CONSTANT, RANDOM])
def test_integrators_agree(disturbance):
    rates = [
        run(disturbance, integrator, rate=(2.0, -1.0, 3.0)).omega_body.values[-1]
        for integrator in INTEGRATORS
    ]
    assert rates[0] == pytest.approx(rates[2], abs=2e-6)
    assert rates[1] == pytest.approx(rates[2], abs=2e-6)


def test_a_random_torque_makes_the_momentum_walk():
    """A sphere from rest, turning little: variance of each component grows as sigma^2 hold t."""
    ends = [
        run(RANDOM, inertia=(1e4, 1e4, 1e4), seed=seed).omega_body.values[-1] * 1e4
        for seed in range(40)
    ]
    expected = 1e-3 * np.sqrt(2.0 * 200.0)
    assert np.sqrt(np.mean(np.square(ends))) == pytest.approx(expected, rel=0.2)
    assert np.abs(np.mean(ends, axis=0)).max() < 3.5 * expected / np.sqrt(40)


def test_random_torque_depends_on_seed_and_not_on_stops():
    text = SCENARIO.format(
        disturbance=RANDOM, integrator="rk4", inertia=[1, 1.3, 1.6], rate=[1, 2, 3], seed=5,
        duration=100, step="step_s = 1.0",
    )  # fmt: skip
    scenario = torquer.scenario_from_text(text)
    whole = torquer.simulate(scenario)
    parts = torquer.resume(torquer.simulate(scenario, until_s=35.0))
    assert np.array_equal(whole.omega_body, parts.omega_body)
    other = run(RANDOM, rate=(1, 2, 3), seed=6, duration=100)
    assert not np.array_equal(whole.omega_body, other.omega_body)


def test_hold_that_is_no_multiple_of_step_is_refused():
    with pytest.raises(ValueError, match=r"disturbance.random_hold_s: must be a whole multiple"):
        run("random_torque_n_m = 1e-3\nrandom_hold_s = 1.5")
