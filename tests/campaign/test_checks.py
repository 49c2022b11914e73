"""What a campaign says beside its success: the work of RK4's steps, and bodies spun up."""

import numpy as np
import pytest
import xarray as xr
from tip_off import SCENARIO

import torquer
from torquer.analysis.spin_up import has_grown, limit_text, may_be_spun_up, spin_up_notes
from torquer.campaign.checks import CHECKS, check_rows, check_summary, checks_for, column
from torquer.campaign.comparison import comparison
from torquer.campaign.load import campaign_from_data
from torquer.campaign.sampling import member_scenario
from torquer.campaign.summary import campaign_summary, headline_rows
from torquer.compile import engine
from torquer.report.campaign.tables import comparison_grid
from torquer.scenario.load import scenario_from_text

#: Members without a torque, which RK4 damps by up to an eighth, some of them hardly.
DAMPED = {
    "control.law": {"kind": "off"}, "environment.gravity_gradient": False,
    "spacecraft.body.inertia_kg_m2": [0.02, 0.02, 0.004], "simulation.duration_s": 3600.0,
    "simulation.step_s": 1.0,
}  # fmt: skip
RATES = {
    "runs": 12,
    "vary": {"initial.rate_deg_s": {"values": [[2, 0, 5], [2, 0, 20], [2, 0, 25], [2, 0, 30]]}},
    "outcomes": {"final": {"signal": "rate_deg_s", "what": {"at_end": True}}},
    "success": {"final": {"below": 100.0}},
}
#: A small body that B-dot of 1 Hz spins up: it brakes up to 90 deg/s.
FAST = {
    "spacecraft.body.inertia_kg_m2": [0.004, 0.004, 0.003], "spacecraft.coils.limit_a_m2": 0.2,
    "initial.rate_deg_s": [0.0, 120.0, 10.0],
    "control": {"law": {"kind": "bdot", "gain_a_m2_s_per_t": 1e6}, "sample_s": 1.0},
    "simulation": {"duration_s": 900.0, "record_s": 5.0},
}  # fmt: skip
flown = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


@pytest.fixture(scope="module")
def damped(make):
    """A campaign of `RATES`, and its scenario."""
    scenario = make(DAMPED)
    campaign = campaign_from_data(RATES, scenario)
    return scenario, campaign, torquer.fly_campaign(scenario, campaign, workers=1)


@flown
def test_each_member_has_the_damping_of_its_run(damped):
    scenario, campaign, result = damped
    for member in range(12):
        alone = torquer.simulate(member_scenario(scenario, campaign, member))
        assert result[column("rk4_damping")].values[member] == float(alone["rk4_damping"])
        lag_deg = float(np.degrees(alone["rk4_lag"]))
        assert result[column("rk4_lag_deg")].values[member] == lag_deg
    assert column("integration_error_deg") not in result


@flown
def test_no_success_rate_without_the_damping(damped):
    summary = campaign_summary(damped[2])
    labels = [label for label, _ in headline_rows(summary)]
    assert labels[labels.index("Success rate") + 1] == "Damping by the steps of RK4"
    damping = damped[2][column("rk4_damping")].values
    worst = int(np.argmax(damping))
    text = dict(check_rows(summary))["Damping by the steps of RK4"]
    assert damping[worst] > 0.1
    assert f"worst {100 * damping[worst]:.3g} % (member {worst}); take shorter" in text
    quiet = damped[2].isel(member=[int(np.argmin(damping))])
    assert damping.min() < CHECKS["rk4_damping"].quiet
    assert not [row for row in check_rows(campaign_summary(quiet)) if "Damping" in row[0]]


@flown
def test_two_campaigns_compared_tell_the_damping_of_either(damped):
    quiet = damped[2].isel(member=np.flatnonzero(damped[2][column("rk4_damping")] < 0.01))
    rows = comparison_grid(comparison(quiet, damped[2]))[1]
    (told,) = [row for row in rows if row[0] == "Damping by the steps of RK4"]
    assert told[1] == "" and "take shorter steps" in told[2]


@flown
def test_each_member_has_the_error_of_adaptive_steps(make):
    scenario = make({"simulation": {"duration_s": 300.0, "record_s": 10.0}})
    campaign = campaign_from_data({**RATES, "runs": 2}, scenario)
    result = torquer.fly_campaign(scenario, campaign, workers=1)
    for member in range(2):
        alone = torquer.simulate(member_scenario(scenario, campaign, member))
        error_deg = float(np.degrees(alone["integration_error"]))
        assert result[column("integration_error_deg")].values[member] == error_deg > 0.0
    assert check_rows(campaign_summary(result)) == []


@flown
def test_steps_that_vary_have_the_checks_of_all(make):
    scenario = make({"simulation": {"duration_s": 60.0, "step_s": 1.0, "integrator": "splitting"}})
    varied = {"simulation.integrator": {"values": ["rk4", "splitting"]}}
    result = torquer.fly_campaign(
        scenario, campaign_from_data({"runs": 6, "vary": varied}, scenario), workers=1
    )
    by_rk4 = result["simulation.integrator"].values == "rk4"
    assert 0 < by_rk4.sum() < 6
    assert np.array_equal(np.isfinite(result[column("rk4_damping")].values), by_rk4)
    assert not np.isfinite(result[column("integration_error_deg")].values).any()


@flown
@pytest.mark.parametrize("sample_s, faster", [(1.0, True), (0.25, False)])
def test_bodies_that_coils_spin_up_are_told(make, sample_s, faster):
    limit = "brakes rotation up to 90 deg/s"
    scenario = make({**FAST, "control.sample_s": sample_s})
    varied = {"initial.attitude": "uniform"}
    campaign = campaign_from_data({**RATES, "runs": 3, "vary": varied, "success": {}}, scenario)
    result = torquer.fly_campaign(scenario, campaign, workers=1)
    summary = campaign_summary(result)
    assert summary["checks"]["spun_up"]["count"] == 3 * faster
    slow = result.assign({column("last_rate_deg_s"): 0.1 * result[column("last_rate_deg_s")]})
    text = dict(check_rows(campaign_summary(slow))).get("Spun up", "deg/s")
    assert text.endswith("deg/s") and limit not in text  # far below it explains nothing
    told = dict(check_rows(summary)).get("Spun up", "")
    assert told.startswith("3 of 3 members rotate faster") and limit in told if faster else not told
    notes = [*spin_up_notes(torquer.simulate(member_scenario(scenario, campaign, 0)))]
    assert len(notes) == faster and all(limit in note for note in notes)


@flown
def test_whatever_the_law(make):
    """A user's that pushes along the rotation spins the body up; one that brakes does not."""
    note = {}
    for sign in (1.0, -1.0):
        law = torquer.Law(f"pushing{sign:+g}", _pushing, parameters={"gain": 2e6 * sign})
        result = torquer.simulate(make({"initial.rate_deg_s": [0.0, 3.0, 1.0]}), law=law)
        note[sign] = [*spin_up_notes(result)]
    assert [len(note[sign]) for sign in (1.0, -1.0)] == [1, 0]
    (told,) = note[1.0]
    assert told.startswith("the body rotates faster at the end, ")
    assert told.endswith("while the coils worked")  # far below the limit of sampled control


def _pushing(inputs, parameters, memory):
    """Torque along the part of the rate across the field."""
    wx, wy, wz = inputs.estimate.omega_body_rad_s
    bx, by, bz = inputs.b_body_t
    k = parameters.gain
    return (k * (by * wz - bz * wy), k * (bz * wx - bx * wz), k * (bx * wy - by * wx))


def test_a_law_that_is_to_spin_the_body_up_is_not_told(make):
    spin_up = {"kind": "spin_up", "gain_a_m2_per_t": 1e4}
    assert may_be_spun_up(make()) and not may_be_spun_up(make({"control.law": spin_up}))
    assert not may_be_spun_up(make({"spacecraft.coils": None}))
    wheels = {
        "layout": {"kind": "orthogonal"},
        "momentum_limit_n_m_s": 1.0,
        "torque_limit_n_m": 0.1,
    }
    assert not may_be_spun_up(make({"spacecraft.wheels": wheels}))


def test_the_orbital_rotation_and_what_a_dipole_lends_are_no_growth(make):
    scenario = make()
    orbital, greatest = scenario.orbit.rate_rad_s(scenario.start), 1.75
    slow = 0.5 * greatest * (2.0 * orbital) ** 2
    assert not has_grown(scenario, 0.0, slow) and has_grown(scenario, 0.0, 100.0 * slow)
    lent = make({"spacecraft.coils.residual_dipole_a_m2": [0.0, 0.0, 1.0]})
    assert has_grown(scenario, 1e-4, 2e-4) and not has_grown(lent, 1e-4, 2e-4)
    assert has_grown(scenario, np.array([1.0, 1.0]), np.array([1.05, 1.2])).tolist() == [
        False,
        True,
    ]


def test_the_limit_is_that_of_differences_of_readings(make):
    scenario = make({"control.sample_s": 0.25, "simulation.step_s": 0.25})
    assert limit_text(scenario, 400.0).endswith("brakes rotation up to 360 deg/s")


def test_no_column_is_an_outcome():
    scenario = scenario_from_text(SCENARIO)
    steps = ["rk4_damping", "rk4_lag_deg"]
    assert checks_for(scenario, []) == [*steps, "spun_up", "last_rate_deg_s"]
    for name in ("seed", "ended", "member", "succeeded"):
        with pytest.raises(ValueError, match=rf"and not 'success', .*; received '{name}'"):
            campaign_from_data(
                {"runs": 1, "outcomes": {name: RATES["outcomes"]["final"]}}, scenario
            )


@pytest.mark.parametrize(
    "name, advice",
    [("rk4_damping", "or adaptive ones"), ("integration_error_deg", "simulation.tolerance_deg")],
)
def test_the_advice_is_for_the_steps_that_were_taken(name, advice):
    result = xr.Dataset({column(name): ("member", [2.0, 3.0])}, {"member": [0, 1]})
    ((_, text),) = check_rows({"members": 2, "checks": check_summary(result)})
    assert advice in text and "(member 1)" in text


def test_a_result_without_checks_has_none():
    data = xr.Dataset(coords={"member": [0, 1]})
    assert check_rows({"members": 2, "checks": check_summary(data)}) == []
