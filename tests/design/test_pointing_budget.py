"""A pointing budget: predicted beside flown, what it refuses, what has no number."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

from torquer import load_scenario, plot, simulate
from torquer.analysis.pointing.asked import COILS_GIVE, WHEELS_PUSH, WHEELS_TURN
from torquer.analysis.pointing.setting import held_scenario, make_setting
from torquer.base.limits import RequestError
from torquer.campaign.fleet import Fleet
from torquer.campaign.sampling import member_scenario
from torquer.campaign.spec import Campaign
from torquer.compile import engine
from torquer.design import PointingRequest, pointing_budget, three_axis
from torquer.design.pointing_budget_flights import Flights
from torquer.maths.geometry.attitudes import rotation_vector

EXAMPLE = Path(__file__).parents[2] / "examples/pointing_budget.toml"
needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
ALONE = PointingRequest(flights=0)
WHEELS = {
    "layout": {"kind": "axes", "axes": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]},
    "momentum_limit_n_m_s": 0.012,
    "torque_limit_n_m": 0.002,
    "initial_speed_rpm": [3000, 2500, 3500],
}
INERTIA = [0.13, 0.17, 0.06]
KALMAN = {"kind": "kalman_dynamics", "inertia_kg_m2": INERTIA, "torque_noise_n_m_sqrt_s": 1e-7,
          "rate_sigma_deg_s": 1.0, "sensors": ["magnetometer"],
          "magnetometer_noise_nt": 50.0}  # fmt: skip
BLIND = {"boresight": [1, 0, 0], "sun_exclusion_deg": 30.0}
#: An inertial attitude, held without gravity: closed forms.
HELD = {
    "environment.gravity_gradient": False,
    "spacecraft.body.inertia_kg_m2": INERTIA,
    "spacecraft.wheels": WHEELS,
    "initial": {"rate_deg_s": [0.0, 0.0, 0.0]},
    "control": {
        "law": {"kind": "wheel_pd", "bandwidth_rad_s": 0.05, "reference": "inertial",
                "inertia_kg_m2": INERTIA},
        "sample_s": 1.0,
    },
    "simulation": {"duration_s": 1500.0, "step_s": 1.0, "record_s": 10.0},
}  # fmt: skip


def rows(budget):
    return budget.data()["causes"]


@pytest.fixture(scope="module")
def predicted(make):
    given = {
        "disturbance": {"constant_torque_n_m": [1e-6, 1e-6, 1e-6]},
        "spacecraft.attitude_sensor": {"error_deg": [0.1, 0.1, 0.1], "noise_deg": 0.02},
        "spacecraft.gyro": {"bias_deg_s": [0.0, 0.001, 0.001]},
    }
    return pointing_budget(make(HELD | given), ALONE)


def test_closed_forms(predicted):
    """J^-1 T/kappa^2, the mounting itself, 2/kappa times the bias."""
    found, kappa = rows(predicted), 0.05
    torque = [math.degrees(1e-6 / j / kappa**2) for j in INERTIA]
    axes = found["constant_torque"]["ape"]["predicted"]["axes_deg"]
    assert axes == pytest.approx(torque, rel=0.02)
    for kind in ("ape", "ake"):
        assert found["attitude_sensor_mounting"][kind]["predicted"]["axes_deg"] == pytest.approx(
            [0.1] * 3, rel=0.02
        )
    # the wheels' momentum takes part in it: an error e of the rate leaves the torque e x h
    momentum = 0.012 / 6000.0 * np.array([3000.0, 2500.0, 3500.0])
    by_momentum = np.cross(np.eye(3), momentum).T / np.array(INERTIA)[:, None] / kappa**2
    units = 0.001 * math.sqrt(2.0 / 3.0) * (by_momentum - 2.0 / kappa * np.eye(3))
    bias = np.sqrt(np.sum(units**2, axis=1))
    assert found["gyro_bias"]["ape"]["predicted"]["axes_deg"] == pytest.approx(bias, rel=0.05)
    noise = found["attitude_sensor_noise"]["ake"]["predicted"]
    assert noise["rms_deg"] == pytest.approx(0.02 * math.sqrt(3.0))
    # 95 % of the lengths of three normal numbers
    assert noise["quantile_deg"] == pytest.approx(0.02 * 2.7955, rel=0.01)


def test_constant_errors_are_steady_and_squares_add(predicted):
    data = predicted.data()
    for name in ("constant_torque", "attitude_sensor_mounting", "gyro_bias"):
        row = data["causes"][name]
        assert row["rpe"]["predicted"]["rms_deg"] < 0.05 * row["ape"]["predicted"]["rms_deg"]
        assert row["class"] == "constant"
    squares = [row["ape"]["predicted"]["rms_deg"] ** 2 for row in data["causes"].values()]
    assert data["all"]["ape"]["predicted"]["rms_deg"] == pytest.approx(math.sqrt(sum(squares)))


def test_no_error_of_knowledge_is_predicted_beyond_the_linear_theory(make):
    """The loop filters a noise of 15 deg to little, but what is known is off by 26 deg."""
    noisy = {"spacecraft.attitude_sensor": {"noise_deg": 15.0},
             "control.law.bandwidth_rad_s": 0.002, "simulation.duration_s": 9000.0}  # fmt: skip
    found = pointing_budget(make(HELD | noisy), ALONE)
    noise, whole = rows(found)["attitude_sensor_noise"], found.data()["all"]
    for each in (noise, whole):
        assert each["why_none"].startswith("beyond 19 deg, where the linear theory ends")
        assert [each[kind]["predicted"] for kind in ("ape", "rpe", "ake")] == [None] * 3
    assert found.verdict.state == "doubtful"


def test_no_bar_reaches_the_edge_of_its_picture(make, predicted):
    """Equal bars, too: one cause makes all of an error."""
    one = {"spacecraft.attitude_sensor": {"noise_deg": 0.02}}
    for budget in (predicted, pointing_budget(make(HELD | one), ALONE)):
        for axes in plot(budget).axes:
            assert 1.03 * max(bar.get_width() for bar in axes.patches) < axes.get_xlim()[1]


def test_an_error_that_is_rounding_is_shown_as_none(make):
    """The same inertia about all axes: no torque of gravity but rounding of the equations."""
    like = HELD | {"environment.gravity_gradient": True, "spacecraft.body.inertia_kg_m2": [0.1] * 3}
    like["control"] = HELD["control"] | {
        "law": HELD["control"]["law"] | {"inertia_kg_m2": [0.1] * 3, "reference": "orbital"}
    }
    like["initial"] = {"reference": "orbital", "rate_deg_s": [0.0, 0.0, 0.0]}
    found = pointing_budget(make(like | {"spacecraft.gyro": {"noise_deg_s": 0.01}}), ALONE)
    assert not any("e-1" in line or "e-2" in line for line in found.lines())
    assert "over 60 s" in found.lines()[0]


def test_the_answer_in_all_forms(predicted):
    json.dumps(predicted.data(), allow_nan=False)
    text = "\n".join(predicted.lines())
    assert "mixed: over all instants" in text and "attitude sensor: mounting" in text
    lines = predicted.csv().splitlines()
    assert lines[0].startswith("cause,class,ape_predicted_rms_deg") and len(lines) == 7
    assert lines[-1].startswith("all,,") and "<table>" in predicted._repr_html_()
    assert plot(predicted).axes


def test_causes_that_are_not_there_are_not_listed(make):
    assert [*rows(pointing_budget(make(HELD), ALONE))] == ["gravity_and_reference"]


def test_imbalance_needs_wheels_that_turn_fast(make):
    asked = PointingRequest(flights=0, dynamic_imbalance_g_mm2=500.0)
    found = rows(pointing_budget(make(HELD), asked))["imbalance"]
    assert found["ape"]["predicted"]["rms_deg"] > 0.0
    assert found["rpe"]["predicted"]["rms_deg"] == pytest.approx(
        found["ape"]["predicted"]["rms_deg"]
    )
    at_rest = make(HELD | {"spacecraft.wheels": {**WHEELS, "initial_speed_rpm": 0}})
    found = rows(pointing_budget(at_rest, asked))["imbalance"]
    assert found["ape"]["predicted"] is None and "must be at most 0.02" in found["why_none"]


def test_friction_of_wheels_shared_by_a_search_has_no_number(make):
    four = {**WHEELS, "layout": {"kind": "four_sided_pyramid", "alpha_deg": 54.7, "beta_deg": 45.0},
            "initial_speed_rpm": 0, "coulomb_friction_n_m": 1e-6}  # fmt: skip
    found = rows(pointing_budget(make(HELD | {"spacecraft.wheels": four}), ALONE))[
        "wheels_friction"
    ]
    assert found["ape"]["predicted"] is None and "minimax" in found["why_none"]


def test_steps_of_coils_have_no_number(make):
    coils = {"limit_a_m2": 3.0, "resolution_a_m2": 0.01, "random_error": 0.01,
             "dead_band_a_m2": 0.02}  # fmt: skip
    found = rows(pointing_budget(make(HELD | {"spacecraft.coils": coils}), ALONE))
    for name in ("coils_resolution", "coils_random_error", "coils_dead_band"):
        assert found[name]["why_none"] and found[name]["ape"]["predicted"] is None


def test_no_number_beyond_small_turns(make):
    given = {"disturbance": {"constant_torque_n_m": [1e-4, 0.0, 0.0]}}
    found = pointing_budget(make(HELD | given), ALONE)
    row = rows(found)["constant_torque"]
    assert row["ape"]["predicted"] is None and "beyond 19 deg" in row["why_none"]
    assert found.verdict.state == "doubtful"


def test_wheels_that_saturate_are_told_without_flights(make):
    """Gravity gives them some 1e-4 N m s in an inertial attitude, of 0.012 that they can have."""
    law = {**HELD["control"]["law"], "euler_deg": [20, 35, 70]}
    held = HELD | {"environment.gravity_gradient": True, "control.law": law}
    for speed_rpm, state in ((3000.0, "valid"), (5990.0, "doubtful")):
        wheels = {**WHEELS, "initial_speed_rpm": speed_rpm}
        verdict = pointing_budget(make(held | {"spacecraft.wheels": wheels}), ALONE).verdict
        assert verdict.state == state
    assert "speed of a wheel over its limit" in verdict.lines()[0]


def test_motors_that_saturate_are_told_without_flights(make):
    """A held torque of 1e-6 N m a flight on each axis: twice that with two sigma."""
    given = HELD | {"disturbance": {"constant_torque_n_m": [1e-6, 1e-6, 1e-6]}}
    for limit, state in ((2.2e-6, "valid"), (1e-6, "doubtful")):
        wheels = {**WHEELS, "torque_limit_n_m": limit}
        verdict = pointing_budget(make(given | {"spacecraft.wheels": wheels}), ALONE).verdict
        assert verdict.state == state
    (doubt,) = verdict.doubts
    assert doubt.limit is WHEELS_PUSH and doubt.value == pytest.approx(2.0, rel=0.03)
    assert re.search(r"^wheel \d is asked for \S+e-06 N m \(mean and 2 sigma.* of 1e-06: ",
                     doubt.text)  # fmt: skip


def test_wheels_beyond_their_speed_are_told_beside_errors_beyond_the_theory(make):
    """Errors are not told, but why they may not hold is, for every number that is."""
    law = {**HELD["control"]["law"], "euler_deg": [20, 35, 70]}
    given = {"environment.gravity_gradient": True, "control.law": law,
             "disturbance": {"constant_torque_n_m": [1e-4, 0.0, 0.0]}}  # fmt: skip
    wheels = {**WHEELS, "initial_speed_rpm": 5990.0}
    verdict = pointing_budget(make(HELD | given | {"spacecraft.wheels": wheels}), ALONE).verdict
    assert len(verdict.doubts) == 2 and verdict.doubts[1].limit is WHEELS_TURN


@needs_jit
@pytest.mark.slow
def test_coils_that_saturate_are_told_without_flights():
    """Of the air, which is no chance, the greatest that a flight asks for in the same time."""
    weak = load_scenario(EXAMPLE.parent / "magnetic_hold.toml").replace(
        "spacecraft.coils", {"limit_a_m2": 0.2})  # fmt: skip
    found = pointing_budget(weak.replace("spacecraft.coils.limit_a_m2", 5e-5), ALONE)
    (doubt,) = found.verdict.doubts
    assert doubt.limit is COILS_GIVE and "is asked for" in doubt.text
    assert pointing_budget(weak, ALONE).verdict.state == "valid"
    flown = simulate(held_scenario(weak).replace("simulation.record_s", 0.5))
    dipole = flown["dipole_body"].values[flown.time.values >= found.from_s]
    assert 5e-5 * doubt.value == pytest.approx(np.abs(dipole).max(), rel=0.1)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"control.law": {"kind": "off"}}, "control: must have one law that holds an attitude"),
        (
            {"simulation.duration_s": 30.0},
            r"^simulation: must last until errors at the start decay to 2 %.*; received 30 s, "
            r"after which \d\d % are left",
        ),
        (
            {"control.sample_s": 100.0, "simulation": {"duration_s": 1500.0, "record_s": 100.0}},
            r"^control.law: must have gains with which errors at the start decay.* they grow .* in",
        ),
        ({"spacecraft.gyro": {"sample_s": 2.0}}, r"spacecraft.gyro.sample_s: must be left out"),
        ({"control.estimator": KALMAN}, "control.estimator: must be left out"),
        ({"spacecraft.attitude_sensor": BLIND}, "attitude_sensor.sun_exclusion_deg: must be left"),
        ({"spacecraft.coils.lag_s": 0.5}, "spacecraft.coils.lag_s: must be left out"),
        ({"spacecraft.wheels": {**WHEELS, "lost": [1]}}, "spacecraft.wheels.lost: must be left"),
        (
            {"spacecraft.wheels": {**WHEELS, "minimum_speed_fraction": 0.1}},
            "spacecraft.wheels.minimum_speed_fraction: must be left out",
        ),
        (
            {"spacecraft.star_trackers": {"up": {}}},
            r"star_trackers.up: must be left out for a poin",
        ),
        ({"spacecraft.integrating_gyro": {}}, "spacecraft.integrating_gyro: must be left out"),
        ({"spacecraft.attitude_sensor.rate_limit_deg_s": 1.0}, "rate_limit_deg_s: must be left"),
        ({"spacecraft.coils.polarity": [1, -1, 1]}, "spacecraft.coils.polarity: must be left out"),
        ({"control.measure_s": 1.0, "control.actuate_s": 1.0}, "control.measure_s: must be left"),
    ],
)
def test_what_has_no_linear_theory_is_refused(make, changes, text):
    with pytest.raises(ValueError, match=text):
        pointing_budget(make(HELD | changes), ALONE)


def test_a_gyro_that_cannot_read_the_wanted_rate_is_refused():
    scenario = load_scenario(EXAMPLE).replace("spacecraft.gyro.range_deg_s", 0.05)
    text = r"^spacecraft.gyro.range_deg_s: must be above the wanted rate, 0\.06\d* deg/s, for a "
    with pytest.raises(ValueError, match=text):
        pointing_budget(scenario, ALONE)


@pytest.mark.parametrize("coils", [2, 1])
def test_coils_that_do_not_span_three_axes_have_no_linear_theory(coils):
    """Their numbers would be those of three coils."""
    scenario = load_scenario(EXAMPLE.parent / "magnetic_hold.toml")
    axes = [[1, 0, 0], [0, 1, 0]][:coils]
    few = scenario.replace("spacecraft.coils", {"axes": axes, "limit_a_m2": 0.2})
    for answer, purpose in (
        (lambda: pointing_budget(few, ALONE), "a pointing budget"),
        (lambda: three_axis(few), "gains of three axes"),
    ):
        says = f"coils.axes: must span all three axes for {purpose}, .* {coils} that span {coils}"
        with pytest.raises(ValueError, match=says):
            answer()


def test_imbalance_of_a_satellite_without_wheels_is_refused():
    scenario = load_scenario(EXAMPLE.parent / "magnetic_hold.toml")
    asked = PointingRequest(flights=0, static_imbalance_g_mm=1.0)
    with pytest.raises(RequestError, match="static_imbalance_g_mm: must be left out"):
        pointing_budget(scenario, asked)


def compared(budget, kinds=("ape", "rpe", "ake")):
    """Flown over predicted of each cause and kind that amounts to something."""
    data = budget.data()
    lines = data["causes"] | {"all": data["all"]}
    return {
        (name, kind): row[kind]["flown_over_predicted"]
        for name, row in lines.items() for kind in kinds
        if row[kind]["flown_over_predicted"] is not None
    }  # fmt: skip


@needs_jit
def test_what_computers_know_is_the_same_in_lanes_and_alone(make):
    """Attitudes as read, to the bit: a budget has the errors of knowledge from lanes."""
    noise = {"spacecraft.attitude_sensor": {"noise_deg": 0.02}}
    given = held_scenario(make(HELD | noise))
    flights = Flights(make_setting(given, 10.0), 0.95)
    campaign = Campaign(runs=3, seed=1)
    fleet, names = Fleet(given, campaign), tuple(f"estimate_q_{c}" for c in "xyzw")
    seen = np.zeros((3, fleet.rows, 11))

    def take(rows, first, motion):
        seen[rows, first : first + len(motion)] = motion.transpose(2, 0, 1)

    assert fleet.fly_motion(np.arange(3), take, names).all()
    for number in range(3):
        one = flights.alone(member_scenario(given, campaign, number))
        own = seen[number, : len(one.knowledge)]  # the last record of lanes is that of the end
        knowledge = rotation_vector(own[:, :4], own[:, 7:])
        assert np.array_equal(knowledge, one.knowledge, equal_nan=True)
        assert np.linalg.norm(knowledge[1:], axis=1).std() > 0.0


@needs_jit
def test_computers_that_choose_a_sensor_are_flown_alone(make):
    """They answer one by one, and lanes do not tell what they know."""
    chosen = {
        "spacecraft.attitude_sensor": {"noise_deg": 0.02},
        "spacecraft.magnetometers": {"a": {}, "b": {}},
        "control": HELD["control"] | {"select": {"magnetometer": {"kind": "spare"}}},
    }
    budget = pointing_budget(make(HELD | chosen), PointingRequest(flights=2))
    assert compared(budget)["attitude_sensor_noise", "ake"] == pytest.approx(1.0, abs=0.2)


@needs_jit
@pytest.mark.slow
def test_noise_flown_is_noise_predicted(make):
    """Within a few percent with eight flights: noise averages out in each of them."""
    given = {
        "spacecraft.attitude_sensor": {"noise_deg": 0.02},
        "spacecraft.gyro": {"noise_deg_s": 0.002},
    }
    budget = pointing_budget(make(HELD | given), PointingRequest(flights=8))
    found = compared(budget)
    names = {"attitude_sensor_noise", "gyro_noise", "all"}
    assert {name for name, _ in found} == names
    assert np.array([*found.values()]) == pytest.approx(np.ones(len(found)), abs=0.06)


@needs_jit
@pytest.mark.slow
def test_flown_in_200_flights_is_what_was_predicted():
    """Each cause of the example, and all: within 20 %."""
    budget = pointing_budget(load_scenario(EXAMPLE), PointingRequest(flights=200))
    found = compared(budget)
    assert len(found) > 20
    assert {key: ratio for key, ratio in found.items() if not 0.8 < ratio < 1.2} == {}
