"""The verdict: goals by mission and laws, when they are reached, what limits were met."""

import json

import numpy as np
import pytest

from torquer.analysis.goals import NAMED, angle_from_axis_deg, find_goals, goal_signal
from torquer.analysis.series import stays_from
from torquer.analysis.summary import summarise
from torquer.analysis.verdict import clock_text, judge_run, limits_met
from torquer.scenario.load import scenario_from_text
from torquer.scenario.spec import Scenario
from torquer.simulation.setup.simulate import simulate

BASE = {
    "start": "2020-03-01T00:00:00Z",
    "orbit": {"kind": "circular", "altitude_km": 500, "inclination_deg": 51.6},
    "environment": {"earth_rotation": "sidereal", "field": {"kind": "direct_dipole"}},
    "spacecraft": {"body": {"inertia_kg_m2": [1.0, 1.2, 1.5]}, "coils": {"limit_a_m2": 3.0}},
    "initial": {"rate_deg_s": [0.0, 0.0, 0.0]},
    "control": {"law": {"kind": "bdot", "gain_a_m2_s_per_t": 2e6}},
    "simulation": {"revolutions": 2.0, "record_s": 10.0},
}
T = np.arange(0.0, 12000.0, 10.0)


def scenario(**sections) -> Scenario:
    return Scenario.model_validate(BASE | sections)


def judge(signal, mission=None, **found):
    given = scenario(mission=mission or {"rate_below_deg_s": 1.0})
    return judge_run(given, find_goals(given), T, {"goal 0": signal, **found}, True)


def test_decaying_rate_settles_where_its_exponential_crosses_the_limit():
    verdict = judge(10.0 * np.exp(-T / 1000.0))
    (goal,) = verdict["goals"]
    assert verdict["done"] and goal["stays_from_s"] == goal["first_s"] == verdict["settled_s"]
    assert goal["stays_from_s"] == 10.0 * np.ceil(100.0 * np.log(10.0))  # the next record
    assert verdict["headline"] == "Achieved: rate below 1 deg/s from 38.5 min to the end."
    # over the last revolution of length P: the mean of an exponential
    p = scenario().orbit.period_s
    mean = 10.0 * np.exp(-T[-1] / 1e3) * 1e3 * (np.exp(p / 1e3) - 1.0) / p
    assert goal["mean_last_revolution"] == pytest.approx(mean, rel=0.01)


def test_what_rises_again_is_not_achieved():
    verdict = judge(2.0 + 1.9 * np.cos(T / 1500.0))
    (goal,) = verdict["goals"]
    assert verdict["done"] is False and goal["first_s"] < T[-1] and goal["stays_from_s"] is None
    assert verdict["headline"].startswith("Not achieved: rate first below 1 deg/s at 5")
    assert "first below" in verdict["headline"]
    never = judge(np.full(len(T), 7.0))["headline"]
    assert never == "Not achieved: rate never below 1 deg/s, 7 deg/s at the end."


def test_a_limit_may_have_to_hold_by_a_time():
    signal = 10.0 * np.exp(-T / 1000.0)
    mission = {"rate_below_deg_s": 1.0, "within_s": 1800.0}
    verdict = judge(signal, mission)
    assert verdict["done"] is False and "later than 30 min" in verdict["headline"]
    assert judge(signal, mission | {"within_s": 2400.0})["done"]


def test_limits_met_are_counted_until_the_goal_is_reached():
    share = np.where(T < 1000.0, 1.0, 0.2)
    lines = judge(10.0 * np.exp(-T / 1000.0), coil_share=share)["limits_met"]
    assert lines == ["a coil was at its limit in 43 % of the time until then"]  # 100 of 232
    assert limits_met(T, {"share": share}, None) == [
        "a wheel was at its momentum limit in 8 % of the run"
    ]
    assert limits_met(T, {"coil_share": 0.5 * share}, None) == []


def test_missed_goal_says_that_coils_had_much_in_reserve():
    late, share = {"rate_below_deg_s": 1.0, "within_s": 1800.0}, np.where(T < 1000.0, 0.24, 0.2)
    signal = 10.0 * np.exp(-T / 1000.0)
    line = "no recorded dipole of a coil exceeds 24 % of its limit"
    assert judge(signal, late, coil_share=share)["limits_met"] == [line]
    assert judge(signal, coil_share=share)["limits_met"] == []  # achieved
    assert judge(signal, late, coil_share=3.0 * share)["limits_met"] == []
    assert judge(signal, late)["limits_met"] == []


@pytest.mark.parametrize(
    ("law", "signal", "below"),
    [
        ({"kind": "bdot", "gain_a_m2_s_per_t": 1e5}, "rate", 0.1903),
        ({"kind": "sun_cross", "gain_n_m": 1e-6}, "angle to the Sun", 15.0),
        (
            {"kind": "reorientation", "gain_a_m2_per_n_m_s_t": 1e5, "momentum_n_m_s": 0.1,
             "inertia_kg_m2": [1.0, 1.2, 1.5], "target": [0.0, 1.0, 0.0]},
            "angle to the target", 15.0,
        ),
        (
            {"kind": "three_axis", "rate_gain_n_m_s_per_t2": 1e5, "angle_gain_n_m_per_t2": 1e2},
            "attitude error", 10.0,
        ),
    ],
)  # fmt: skip
def test_without_a_mission_the_laws_tell_the_goal(law, signal, below):
    (goal,) = find_goals(scenario(control={"law": law}))
    assert goal.signal == signal and goal.below == pytest.approx(below, rel=1e-3)
    assert goal.why != NAMED


def test_a_usual_limit_can_be_kept_but_not_missed():
    given = scenario()
    signal = np.full(len(T), 7.0)
    verdict = judge_run(given, find_goals(given), T, {"goal 0": signal}, True)
    assert verdict["done"] is None
    assert verdict["headline"] == (
        "No verdict (no limits in [mission]). The usual limit was not met: rate never below 0.19 "
        "deg/s, "
        "7 deg/s at the end."
    )
    assert judge_run(given, find_goals(given), T, {"goal 0": 0.01 * signal}, True)["done"]


def test_regions_side_by_side_imply_no_limit():
    control = {
        "laws": {"damping": {"kind": "bdot", "gain_a_m2_s_per_t": 1e5}},
        "modes": {
            "regions": {
                name: {"states": {"on": {"laws": laws, "final": True}}}
                for name, laws in (("a", ["damping"]), ("b", []))
            }
        },
    }
    assert find_goals(scenario(control=control)) == []


def test_without_control_there_is_no_verdict():
    free = scenario(control={"law": {"kind": "off"}})
    assert find_goals(free) == []
    verdict = judge_run(free, [], T, {}, True)
    assert verdict["done"] is None and verdict["headline"].startswith("No verdict")
    assert "did not reach its end" in judge_run(free, [], T, {}, False)["headline"]


def test_a_mission_has_limits_within_the_run():
    with pytest.raises(ValueError, match=r"mission: must have one of rate_below_deg_s"):
        scenario(mission={"within_s": 10.0})
    with pytest.raises(ValueError, match=r"mission.within_s: must not exceed the run's length"):
        scenario(mission={"rate_below_deg_s": 1.0, "within_s": 1e6})
    text = f"{json.dumps('x')} = 1"
    with pytest.raises(ValueError, match="x: must be a known key"):
        scenario_from_text(text)


def test_the_summary_of_a_run_judges_its_own_record():
    run = scenario(
        initial={"rate_deg_s": [0.5, -0.3, 0.4]},
        mission={"rate_below_deg_s": 0.3, "sun_angle_below_deg": 170.0, "axis": [0, 0, 5]},
    )
    result = simulate(run)
    summary = summarise(result)
    rate, sun = summary["verdict"]["goals"]
    t, omega = result["time"].values, result["omega_body"].values
    speed = np.degrees(np.linalg.norm(omega, axis=1))
    assert rate["stays_from_s"] == stays_from(t, speed < 0.3)
    # the angle by the body's third axis, as the rotation matrix has it
    x, y, z, w = result["q_body_to_inertial"].values.T
    axis = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)
    angle = np.degrees(np.arccos(np.sum(axis * result["sun_inertial"].values, axis=1)))
    np.testing.assert_allclose(angle_from_axis_deg(result, (0.0, 0.0, 1.0)), angle, atol=1e-6)
    assert sun["final"] == pytest.approx(angle[-1], abs=1e-6)
    assert goal_signal(find_goals(run)[1], result, run) == pytest.approx(angle, abs=1e-6)


@pytest.mark.parametrize(
    ("t_s", "words"), [(0.0, "0 s"), (90.0, "90 s"), (1800.0, "30 min"), (86400.0, "24 h")]
)
def test_times_are_reported_in_units_that_suit_them(t_s, words):
    assert clock_text(t_s) == words
