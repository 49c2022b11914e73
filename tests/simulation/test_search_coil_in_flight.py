"""A search coil with errors in flight: what laws read, and what B-dot makes of its noise."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import torquer
from torquer.campaign.fleet import Fleet
from torquer.campaign.sampling import member_scenario
from torquer.campaign.spec import Campaign
from torquer.compile import engine
from torquer.simulation.setup.simulate import simulate

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

GAIN = 2e7
#: A ball that damps in a minute, coils that never saturate, and nothing else that turns it.
BALL = {
    "spacecraft.body": {"inertia_kg_m2": [1.0, 1.0, 1.0]},
    "spacecraft.coils": {"limit_a_m2": 1e4},
    "control.law": {"kind": "bdot_derivative", "gain_a_m2_s_per_t": GAIN},
    "initial.rate_deg_s": [0.05, -0.03, 0.04],
    "simulation": {"duration_s": 20_000.0, "step_s": 1.0, "record_s": 1.0},
}


def flown(make, seed=0, more=(), **keys):
    return simulate(make({**BALL, "spacecraft.search_coil": keys, "seed": seed, **dict(more)}))


def errors_of(result):
    """Errors of the readings [T/s]: of what the coils were commanded, against the field's rate."""
    b = result.b_body.values
    rate = (b[:-4] - 8.0 * b[1:-3] + 8.0 * b[3:-1] - b[4:]) / 12.0  # per second, order 4
    return -result.command_body.values[2:-2] / GAIN - rate


def test_readings_in_flight_have_the_errors_that_were_asked_for(make):
    short = {"simulation.duration_s": 5000.0}
    errors = errors_of(flown(make, more=short, noise_nt_s=20.0, bias_nt_s=[5.0, -8.0, 2.0]))
    count = len(errors)
    assert errors.mean(axis=0) == pytest.approx(
        np.array([5e-9, -8e-9, 2e-9]), abs=4.0 * 20e-9 / np.sqrt(count)
    )
    errors -= errors.mean(axis=0)
    assert errors.std(axis=0) == pytest.approx(20e-9, rel=4.0 / np.sqrt(2.0 * count))
    together = np.mean(errors[1:] * errors[:-1], axis=0) / errors.var(axis=0)
    assert np.abs(together).max() < 4.0 / np.sqrt(count)
    rounded = flown(make, more=short, noise_nt_s=20.0, resolution_nt_s=15.0)
    steps = rounded.command_body.values / (GAIN * 15e-9)
    assert np.abs(steps - np.round(steps)).max() < 1e-6


def test_the_floor_of_bdot_is_that_of_its_noise(make):
    """Torques m x B, m = -k (dB/dt + n), let the momentum of a ball walk by k sigma B sqrt(T) in
    a step across the field, and damp it by k B^2/J in a second: of each component of the rate the
    variance k sigma^2 T/(2 J) remains, whatever the field is. The loop is linear: what noise adds
    is the difference from the flight without it."""
    sigma_t_s, seeds = 10e-9, range(6)

    def rate(result):
        turned = Rotation.from_quat(result.q_body_to_inertial.values)
        return turned.apply(result.omega_body.values)

    quiet = rate(flown(make, noise_nt_s=0.0))
    added = [rate(flown(make, seed, noise_nt_s=1e9 * sigma_t_s)) - quiet for seed in seeds]
    expected = GAIN * sigma_t_s**2 / 2.0
    # a minute's memory across the field, ten minutes' along it: some 400 independent in a flight
    assert np.mean(np.square(added)[:, 1000:]) == pytest.approx(expected, rel=0.12)
    short = {"simulation.duration_s": 1000.0}  # later the attitudes differ, and the noise with them
    twice = rate(flown(make, seeds[0], short, noise_nt_s=2e9 * sigma_t_s)) - quiet[:1001]
    assert np.abs(twice - 2.0 * added[0][:1001]).max() < 0.02 * np.abs(twice).max()


def test_members_whose_search_coils_differ_fly_together_as_alone(make):
    coil = {"noise_nt_s": 5.0, "resolution_nt_s": 3.0}
    few = {"simulation.duration_s": 600.0, "spacecraft.search_coil": coil}
    scenario = make({**BALL, **few})
    campaign = Campaign.model_validate({
        "runs": 20,
        "vary": {
            "spacecraft.search_coil.bias_nt_s": {"normal": {"mean": [0, 0, 0], "sigma": 10}},
            "spacecraft.search_coil.scale_error": {"uniform": [[-0.1] * 3, [0.1] * 3]},
        },
        "outcomes": {"rate": {"signal": "rate_deg_s", "what": {"at_end": True}}},
    })  # fmt: skip
    fleet = Fleet(scenario, campaign)
    assert fleet.why_not_in_lanes == ""
    found = fleet.fly(np.arange(20)).outcomes["rate"]
    assert len(np.unique(found)) == 20
    for member in (0, 7, 19):
        alone = simulate(member_scenario(scenario, campaign, member)).omega_body.values[-1]
        x, y, z = np.degrees(alone)
        assert found[member] == pytest.approx(np.sqrt(x * x + y * y + z * z), rel=1e-15)


@pytest.mark.parametrize("own", [{}, {"sample_s": 2.0, "delay_s": 1.0}])
def test_a_flight_is_resumed_bit_for_bit(make, own):
    keys = {"noise_nt_s": 20.0, "bias_nt_s": [5.0, -8.0, 2.0], "resolution_nt_s": 3.0, **own}
    failures = [{"kind": "noise", "noise_nt_s": 300.0, "from_s": 40.0, "until_s": 80.0}]
    scenario = make({**BALL, "simulation.duration_s": 120.0, "spacecraft.search_coil": {
        **keys, "failures": failures}})  # fmt: skip
    whole = simulate(scenario)
    parts = torquer.resume(simulate(scenario, until_s=61.0))
    assert np.array_equal(parts.q_body_to_inertial.values, whole.q_body_to_inertial.values)
    assert np.array_equal(parts.command_body.values, whole.command_body.values)


def test_an_ideal_one_that_is_described_reads_as_one_that_is_left_out(make):
    short = {**BALL, "simulation.duration_s": 300.0}
    without, ideal = simulate(make(short)), simulate(make({**short, "spacecraft.search_coil": {}}))
    for name in ("q_body_to_inertial", "omega_body", "command_body"):
        assert np.array_equal(without[name].values, ideal[name].values)
