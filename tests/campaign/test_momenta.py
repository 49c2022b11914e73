"""Outcomes of momenta, logs, single axes and fractions of the start: in lanes as in each result."""

import numpy as np
import pytest
from simulation.lanes.test_wheels_in_lanes import COILS, HEAD, HELD, MODES, RK4, THREE
from tip_off import campaign

import torquer
from torquer.campaign import fleet
from torquer.campaign.fly import fly_campaign
from torquer.campaign.sampling import member_scenario
from torquer.campaign.summary import campaign_summary
from torquer.compile import engine
from torquer.scenario.load import scenario_from_text
from torquer.simulation.results.dataset import flown_scenario

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
LAW = """
import torquer

@torquer.law(parameters={"gain": 5.0}, memory={"on_s": (0.0, 0.0, 0.0), "calls": 0.0},
             log={"on_s": "s", "calls": "1"})
def own(inputs, parameters, memory):
    memory.calls += 1.0
    out = [0.0, 0.0, 0.0]
    for k in range(3):
        out[k] = -parameters.gain * inputs.omega_body_rad_s[k]
        memory.on_s[k] += 2.0 * min(1.0, abs(out[k]))
    return out[0], out[1], out[2]
"""
RATE = {"initial.rate_deg_s": {"direction": "uniform", "magnitude": {"uniform": [0.5, 5.0]}}}
VARY = RATE | {
    "spacecraft.body.inertia_kg_m2": {"relative": {"uniform": [0.8, 1.2]}},
    "control.laws.coils.parameters.gain": {"uniform": [1.0, 9.0]},
}
END = {"at_end": True}
OUTCOMES = {
    "momentum": {"signal": "momentum_n_m_s", "what": {"mean_after_s": 40.0}},
    "wheels": {"signal": "wheel_momentum_n_m_s", "what": END},
    "left": {"signal": {"of_start": "momentum_n_m_s"}, "what": END},
    "about_y": {"signal": "rate_y_deg_s", "what": {"greatest_after_s": 0.0}},
    "on_s": {"signal": "coils.on_s[1]", "what": END},
    "calls": {"signal": "coils.calls", "what": {"first_below": 30.0}},
    "on_share": {"signal": {"of_start": "coils.on_s[0]"}, "what": END},
}


@pytest.fixture
def scenario(tmp_path, request):
    """Wheels that hold and a user's law that logs, with modes or without."""
    (tmp_path / "law.py").write_text(LAW)
    own = f'[control.laws.coils]\nkind = "user"\nfile = "{tmp_path / "law.py"}"\n'
    modes = MODES if request.param == "modes" else ""
    text = HEAD + COILS + THREE + HELD + own + "parameters = { gain = 5.0 }\n" + modes + RK4
    return scenario_from_text(text)


def expected(result):
    """The same numbers from a result."""
    momentum = np.linalg.norm(result["momentum_inertial"].values, axis=1)
    axes = np.array(flown_scenario(result).spacecraft.wheels.array().axes)
    on_s = result["coils.on_s"].values
    return {
        "momentum": momentum[result["time"].values >= 40.0].mean(),
        "wheels": np.linalg.norm(result["wheel_momentum"].values[-1] @ axes),
        "left": momentum[-1] / momentum[0],
        "about_y": np.degrees(result["omega_body"].values[:, 1].max()),
        "on_s": on_s[-1, 1],
        "calls": 0.0,
        "on_share": on_s[-1, 0] / on_s[0, 0] if on_s[0, 0] else np.nan,
    }


@pytest.mark.parametrize("scenario", ["laws", "modes"], indirect=True)
def test_members_in_lanes_have_the_numbers_of_their_results(scenario):
    made = campaign(scenario, runs=18, vary=VARY, outcomes=OUTCOMES, success={})
    flying, alone = fleet.Fleet(scenario, made), fleet.Fleet(scenario, made)
    assert flying.why_not_in_lanes == ""
    alone._lanes = None
    members = np.arange(18)
    beside, each = flying.fly(members), alone.fly(members[:3])
    assert np.ptp(beside.outcomes["momentum"]) > 0.0, "inertia and rates differ"
    for name in OUTCOMES:
        same = np.array_equal(beside.outcomes[name][:3], each.outcomes[name], equal_nan=True)
        assert same, name
        assert np.array_equal(beside.series.get(name, members[:3])[:3],
                              each.series.get(name, members[:3]), equal_nan=True)  # fmt: skip
    for member in (0, 2):
        known = expected(torquer.simulate(member_scenario(scenario, made, member)))
        for name, value in known.items():
            assert beside.outcomes[name][member] == pytest.approx(value, rel=1e-12, nan_ok=True)


@pytest.mark.parametrize("scenario", ["laws"], indirect=True)
def test_a_summary_has_units_of_logs_and_bounds_with_signs(scenario, tmp_path):
    made = campaign(scenario, runs=8, vary=RATE, outcomes=OUTCOMES, success={})
    flown = fly_campaign(scenario, made, to=tmp_path / "c.nc")
    found = campaign_summary(flown)["outcomes"]
    units = {name: each["unit"] for name, each in found.items()}
    assert units == {"momentum": "N m s", "wheels": "N m s", "left": "", "about_y": "deg/s",
                     "on_s": "s", "calls": "s", "on_share": ""}  # fmt: skip
    assert found["left"]["definition"] == "momentum_n_m_s as a fraction of its start, at end"
    assert flown["series.on_s"].attrs["units"] == "s"


@pytest.mark.parametrize("scenario", ["laws"], indirect=True)
@pytest.mark.parametrize(
    ("log", "told"),
    [
        ("coils.on_s", r"known: coils\.on_s\[0\], "),
        ("coils.calls[0]", r"did you mean coils\.calls\?"),
        ("other.x", r"known: coils\.on_s\[0\], "),
    ],
)
def test_a_log_that_no_law_has_is_one_line(scenario, log, told):
    outcome = {"x": {"signal": log, "what": END}}
    made = campaign(scenario, runs=8, vary=RATE, outcomes=outcome, success={})
    line = rf"^campaign.outcomes.x.signal: must be a number that a law .* received '.*'.*{told}"
    with pytest.raises(ValueError, match=line):
        fly_campaign(scenario, made)
