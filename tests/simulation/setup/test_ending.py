"""A condition that ends a run: where it holds, resume, the whole's prefix, members in lanes."""

import numpy as np
import pytest
from tip_off import SCENARIO, campaign

import torquer
from torquer.campaign.fleet import Fleet
from torquer.campaign.fly import fly_campaign
from torquer.campaign.sampling import member_scenario
from torquer.campaign.summary import campaign_summary, summary_rows
from torquer.compile import engine
from torquer.scenario.change import with_values
from torquer.scenario.ending import EndWhen
from torquer.scenario.load import scenario_from_text
from torquer.simulation.setup.ending import NOT_YET, Seen, has_ended

jit = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
BELOW = {"signal": "rate_deg_s", "below": 1.2, "for_s": 60.0}
AXES = {"signal": "rate_fastest_axis_deg_s", "below": 1.0}
HALF = {"signal": "momentum_n_m_s", "of_start": True, "below": 0.5}
OUTCOMES = {
    "end": {"signal": "rate_deg_s", "what": {"at_end": True}},
    "mean": {"signal": "rate_orbital_deg_s", "what": {"mean_after_s": 0.0}},
    "settled_s": {"signal": "rate_deg_s", "what": {"settles_below": 2.0}},
    "axes_s": {"signal": "rate_fastest_axis_deg_s", "what": {"first_below": 1.0}},
    "nadir": {"signal": {"axis": [0, 0, 1], "to": "nadir"}, "what": {"greatest_after_s": 40.0}},
    "energy_j": {"signal": "coil_energy_j"},
    "peak": {"signal": "peak_dipole_a_m2"},
}


def tip_off(when=None, **changes):
    """A satellite that coils brake by some deg/s in a quarter of an hour."""
    scenario = scenario_from_text(SCENARIO.replace("1e5", "2e6"))
    return with_values(scenario, {"simulation.end_when": when, **changes})


def looked_at(when, signal):
    """The record at which a condition ends a signal (r,) of one member, 10 s apart; None: never."""
    seen = Seen(np.full(1, NOT_YET), np.full(1, NOT_YET))
    for row, value in enumerate(signal):
        if has_ended(EndWhen(**when), 10.0 * row, np.array([value]), seen)[0]:
            return row
    return None


@pytest.mark.parametrize(
    ("when", "row"),
    [
        ({"below": 2.0}, 2),
        ({"below": 2.0, "for_s": 10.0}, 5),
        ({"below": 2.0, "for_s": 20.0}, 6),
        ({"below": 2.0, "for_s": 30.0}, None),
        ({"above": 5.0}, 7),
        ({"below": 0.5, "of_start": True}, 2),
        ({"above": 1.9, "of_start": True}, 7),
        ({"below": 1.0}, None),
        ({"below": 5.0}, 1),
        ({"above": 0.0, "for_s": 40.0}, 4),
    ],
)
def test_it_must_hold_at_all_records_of_the_time(when, row):
    signal = [4.0, 3.0, 1.0, 3.0, 1.5, 1.0, 1.9, 8.0]
    assert looked_at({"signal": "rate_deg_s", **when}, signal) == row


def test_a_signal_that_is_zero_at_the_start_has_no_fraction():
    assert looked_at({**HALF}, [0.0, 0.0, 1.0, -1.0]) is None


@pytest.mark.parametrize("keys", [{}, {"below": 1.0, "above": 2.0}])
def test_one_side_is_given(keys):
    with pytest.raises(ValueError, match=r"must have below or above; received (none|both)"):
        EndWhen(signal="rate_deg_s", **keys)


@pytest.mark.parametrize("value", [0.0, -1.0])
def test_what_no_size_is_below_is_refused(value):
    """Rate and momentum are sizes: such a run would never end early, and say nothing."""
    with pytest.raises(ValueError, match="greater than 0"):
        EndWhen(signal="rate_deg_s", below=value)


def test_it_is_told_in_words():
    assert EndWhen(**BELOW).in_words == "rate_deg_s below 1.2 for 60 s"
    assert EndWhen(**HALF).in_words == "momentum_n_m_s below 0.5 of its start"


def assert_prefix(ended, whole):
    """Every record up to the end, but for what the computer does at the last one."""
    count = ended.sizes["time"]
    assert 3 < count < whole.sizes["time"]
    for name in ("omega_body", "q_body_to_inertial", "b_inertial"):
        assert np.array_equal(ended[name].values, whole[name].values[:count]), name
    assert np.array_equal(ended["command_body"].values[:-1], whole["command_body"][: count - 1])


@jit
def test_a_run_that_fulfils_it_from_the_start_has_one_interval():
    always = {"signal": "rate_deg_s", "below": 100.0}
    ended = torquer.simulate(tip_off(always))
    assert ended["time"].values.tolist() == [0.0, 20.0]
    scenario = tip_off(always)
    made = campaign(scenario, runs=18, outcomes=OUTCOMES, success={})
    flown = Fleet(scenario, made).fly(np.arange(18))
    assert np.all(flown.checks["ended_s"] == 20.0)
    assert np.all(np.isfinite(flown.outcomes["end"]))


@jit
@pytest.mark.parametrize("when", [BELOW, AXES, HALF])
def test_a_run_ends_there_with_the_bits_of_the_whole(when):
    ended, whole = torquer.simulate(tip_off(when)), torquer.simulate(tip_off())
    assert_prefix(ended, whole)
    end_s = float(ended["time"][-1])
    until = torquer.simulate(tip_off(**{"simulation.duration_s": end_s}))
    for name in ("coil_energy", "peak_coil_dipole", "rk4_damping"):
        assert float(ended[name]) == float(until[name]), name
    omega_deg_s = np.degrees(whole["omega_body"].values)
    momentum = np.linalg.norm(whole["momentum_inertial"].values, axis=1)
    holds = {
        "rate_deg_s": np.linalg.norm(omega_deg_s, axis=1) < 1.2,
        "rate_fastest_axis_deg_s": (np.abs(omega_deg_s) < 1.0).all(axis=1),
        "momentum_n_m_s": momentum < 0.5 * momentum[0],
    }[when["signal"]]
    rows = int(when.get("for_s", 0.0) / 20.0)
    first = next(k for k in range(rows, len(momentum)) if holds[k - rows : k + 1].all())
    assert end_s == 20.0 * first
    assert ended.attrs["ended"] == ended.attrs["how_it_ended"] == "complete"
    assert ended.attrs["ended_by"] == EndWhen(**when).in_words
    assert "ended_by" not in whole.attrs
    summary = torquer.summarise(ended)
    assert summary["ended_by"] in str(summary) and summary["simulated_s"] == end_s


@jit
def test_a_run_goes_on_to_the_same_end_from_wherever_it_stopped(tmp_path):
    ended = torquer.simulate(tip_off(BELOW))
    end_s = float(ended["time"][-1])
    for stop_s in (0.0, end_s - 50.0, end_s - 20.0, end_s):
        part = torquer.simulate(tip_off(BELOW), until_s=stop_s, to=tmp_path / f"{stop_s:g}.nc")
        assert part.sizes["time"] <= ended.sizes["time"]
        part.close()
        again = torquer.resume(tmp_path / f"{stop_s:g}.nc")
        assert np.array_equal(again["omega_body"].values, ended["omega_body"].values)
        assert np.array_equal(
            again["checkpoint"].values, ended["checkpoint"].values, equal_nan=True
        )
        assert again.attrs["ended_by"] == ended.attrs["ended_by"]
    once_more = torquer.resume(ended)
    assert np.array_equal(once_more["omega_body"].values, ended["omega_body"].values)
    assert once_more.attrs["how_it_ended"] == "complete"


@jit
@pytest.mark.parametrize("when", [BELOW, AXES, HALF])
def test_members_side_by_side_end_each_at_its_own_time(when):
    """As alone and as in their own runs; those that never get there fly to the end."""
    scenario = tip_off(when)
    made = campaign(scenario, runs=40, outcomes=OUTCOMES, success={})
    flying, alone = Fleet(scenario, made), Fleet(scenario, made)
    assert flying.why_not_in_lanes == ""
    alone._lanes = None
    members = np.arange(40)
    beside, each = flying.fly(members), alone.fly(members[:12])
    times = beside.checks["ended_s"]
    if when is AXES:
        not_at_start_s = np.maximum(beside.outcomes["axes_s"], 20.0)
        assert np.array_equal(times, not_at_start_s, equal_nan=True)
    assert 1 < np.isfinite(times[:12]).sum() < 12 and len(np.unique(times)) > 3
    for kind in ("outcomes", "series", "checks"):
        for name, values in getattr(beside, kind).items():
            assert np.array_equal(values[:12], getattr(each, kind)[name], equal_nan=True), name
    row = int(np.flatnonzero(np.isfinite(times))[0])
    own = torquer.simulate(member_scenario(scenario, made, row))
    assert float(own["time"][-1]) == times[row]
    assert float(own["coil_energy"]) == beside.outcomes["energy_j"][row]


@jit
def test_a_campaign_tells_who_ended_early(tmp_path):
    scenario = tip_off(HALF)
    made = campaign(scenario, runs=40, outcomes=OUTCOMES, success={})
    flown = fly_campaign(scenario, made, to=tmp_path / "c.nc")
    found = campaign_summary(flown)
    ended = found["checks"]["ended_s"]
    assert 0 < ended["count"] <= 40 and ended["by"] == EndWhen(**HALF).in_words
    rows = dict(summary_rows(found))
    assert rows["Ended early"].startswith(
        f"{ended['count']} of 40 members, by momentum_n_m_s below"
    )
