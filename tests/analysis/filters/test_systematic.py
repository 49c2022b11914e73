"""What models on board do to filters: predicted and flown; in checks, budgets and notes."""

import numpy as np
import pytest
from filter_cases import DISTURBANCE, DYNAMICS, GYRO, SCENARIO
from scipy.stats import ncx2

from torquer import simulate
from torquer.analysis.budget import as_plain, budget_along_run, budget_while_held
from torquer.analysis.filters.filter_check import check_filter
from torquer.analysis.filters.filter_flights import fly_filter
from torquer.analysis.filters.filter_members import make_members
from torquer.analysis.filters.linear_covariance import Motion, error_95_rad, expected_accuracy
from torquer.analysis.filters.sensor_sets import as_plain as sets_as_plain, expect_accuracy
from torquer.analysis.filters.systematic import systematic_error
from torquer.analysis.notes.filter_notes import filter_notes
from torquer.compile import engine
from torquer.report.flight.budget_rows import models_in_words
from torquer.scenario.load import scenario_from_data

WHOLE_RUNS = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
COARSE = {"field": {"kind": "igrf14", "degree": 8}}
BEHIND = {"along_track_error_m": -20e3}
BIASED = GYRO | {"magnetometer_bias_sigma_nt": 300.0}


def scenario(estimator, ephemeris, **changes):
    return scenario_from_data(
        {
            **SCENARIO,
            "disturbance": DISTURBANCE,
            "control": {"law": {"kind": "off"}, "estimator": estimator, "ephemeris": ephemeris},
            "simulation": {**SCENARIO["simulation"], "duration_s": 1500.0, **changes},
        }
    )


def motion_of(flown):
    """The motion of a run, at every second."""
    one = simulate(flown.replace("simulation.record_s", 1.0))
    own = (one[name].values for name in ("time", "q_body_to_inertial", "omega_body"))
    return Motion(*own, np.zeros((len(one.time), 3)))


@WHOLE_RUNS
@pytest.mark.parametrize(
    ("estimator", "ephemeris"),
    [
        (GYRO, COARSE),
        (DYNAMICS, BEHIND),
        pytest.param(BIASED, {"clock_error_s": 3.0}, marks=pytest.mark.slow),
    ],
    ids=["gyro, degree 8", "dynamics, along the track", "magnetometer bias, clock"],
)
def test_the_systematic_error_is_the_mean_of_monte_carlo(estimator, ephemeris):
    """In units of the scatter of a mean of 40 runs, and much greater than it."""
    runs, flown = 40, scenario(estimator, ephemeris, record_s=20.0)
    errors = fly_filter(make_members(flown, runs)).errors[..., :3]
    motion = motion_of(flown)
    expected = expected_accuracy(flown, motion)
    found = systematic_error(flown, expected, motion)[::20][: errors.shape[1]]
    sigma = expected.attitude_sigma_rad[::20][: errors.shape[1], None] / np.sqrt(runs)
    later = slice(20, None)
    away = (np.mean(errors, axis=0) - found)[later] / sigma[later]
    assert np.sqrt(np.mean(away**2)) < 1.6
    assert np.sqrt(np.mean((found[later] / sigma[later]) ** 2)) > 5.0


def test_models_that_are_the_truth_cause_no_error():
    honest = scenario(GYRO, {}, duration_s=60.0)
    expected = expected_accuracy(honest)
    assert not systematic_error(honest, expected).any()
    assert expect_accuracy(honest, "all").systematic_deg == 0.0


def test_the_expected_error_has_the_part_that_models_cause():
    honest, coarse = (
        expect_accuracy(scenario(GYRO, models, duration_s=1400.0), "all") for models in ({}, COARSE)
    )
    assert coarse.light_deg > honest.light_deg
    assert coarse.light_deg >= coarse.systematic_deg > 0.03
    assert sets_as_plain([coarse])[0]["systematic_deg"] == coarse.systematic_deg


@pytest.mark.parametrize("mean", [0.0, 0.5, 2.0, 10.0])
def test_95_percent_of_errors_about_a_mean(mean):
    """Alike about all axes: the noncentral chi-square distribution; about one: its own mean."""
    exact = 0.01 * np.sqrt(ncx2.ppf(0.95, 3, max(mean, 1e-9) ** 2))
    axis = np.array([[0.6, 0.0, -0.8]])
    assert error_95_rad(1e-4 * np.eye(3)[None], 0.01 * mean * axis) == pytest.approx(
        [exact], rel=0.015
    )
    nothing = np.zeros((1, 3, 3))
    assert error_95_rad(nothing, 0.01 * mean * axis) == pytest.approx([0.01 * mean], abs=1e-12)


@WHOLE_RUNS
def test_a_filter_that_trusts_a_coarse_field_is_found_out():
    """The truth to degree 13, degree 6 on board, and a noise that leaves no room for it.

    Its innovations do not show it: NIS stays in its band.
    """
    trusting = scenario(GYRO, {"field": {"kind": "igrf14", "degree": 6}}, duration_s=1200.0)
    found = {check.name: check for check in check_filter(trusting, 20).checks}
    assert not found["NEES of the attitude"].passed
    assert found["NEES of the attitude"].value > 3.0
    assert found["NIS of the magnetometer"].passed
    honest = trusting.replace("control.ephemeris", {})
    assert {check.name: check for check in check_filter(honest, 20).checks}[
        "NEES of the attitude"
    ].passed


def test_noise_without_room_for_model_errors_is_noted():
    assert filter_notes(scenario(GYRO, {})) == []
    (note,) = filter_notes(scenario(GYRO, COARSE))
    models = scenario(GYRO, COARSE).model_errors()
    whole = np.hypot(1e9 * models.field_t / np.sqrt(3.0), 50.0)
    assert note.startswith(f"magnetometer_noise_nt = 50 is below the {whole:.3g} nT")
    assert filter_notes(scenario(GYRO | {"magnetometer_noise_nt": 1.01 * whole}, COARSE)) == []
    sun = {k: v for k, v in GYRO.items() if k != "magnetometer_noise_nt"} | {"sensors": ["sun"]}
    assert filter_notes(scenario(sun, COARSE)) == []


def test_the_budget_has_the_errors_of_the_models_on_board():
    off = scenario(GYRO, {"along_track_error_m": 1e4})
    budget = budget_while_held(off)
    plain = as_plain(budget)["models_on_board"]
    assert plain["position_km"] == pytest.approx(10.0, rel=1e-5)
    assert 0.0 < plain["strength_nt"] < plain["field_nt"]
    assert f"{plain['field_nt']:.3g} nT" in models_in_words(budget.models)
    same = as_plain(budget_while_held(scenario(GYRO, {})))
    assert same["models_on_board"] is None and models_in_words(None) == ""


@WHOLE_RUNS
def test_the_budget_of_a_run_has_what_its_result_says():
    result = simulate(scenario(GYRO, COARSE, duration_s=600.0))
    off = np.linalg.norm(result.b_believed.values - result.b_inertial.values, axis=1)
    assert budget_along_run(result).models.field_t == pytest.approx(np.sqrt(np.mean(off**2)))


#: Numerical orbits: without air, and low with much of it.
ORBITS = {
    "550 km": {"altitude_km": 550.0, "inclination_deg": 60.0},
    "450 km": {"altitude_km": 450.0, "inclination_deg": 97.4},
}
DRAG = {"mass_kg": 4.0, "area_m2": 0.03, "atmosphere": {"kind": "exponential"}}


@WHOLE_RUNS
@pytest.mark.parametrize(("name", "drag"), [("550 km", None), ("450 km", DRAG)])
def test_older_two_line_elements_on_board_are_worse(name, drag):
    """Half a kilometre to a kilometre at their epoch, as is said of published ones, and more of it
    in a week; nearly all of the growth is along the track."""
    orbit = {"kind": "numerical", "start": {"kind": "circular", **ORBITS[name]}, "drag": drag}
    away_km, along_km = {}, {}
    for days in (0.0, 7.0):
        aged = scenario(GYRO, {}, duration_s=12000.0).replace("orbit", orbit)
        aged = aged.replace("control.ephemeris.tle_age_days", days)
        away_km[days] = 1e-3 * aged.model_errors().position_m
        t_s = np.linspace(0.0, 12000.0, 200)
        (r, v), (own, _) = (e.state(t_s) for e in (aged.orbit_environment(),
                                                   aged.believed_environment()))  # fmt: skip
        ahead = np.sum((own - r) * v, axis=1) / np.linalg.norm(v, axis=1)
        along_km[days] = 1e-3 * np.sqrt(np.mean(ahead**2))
    assert 0.3 < away_km[0.0] < 1.2
    assert 4.0 < away_km[7.0] < 15.0
    assert along_km[7.0] > 0.95 * away_km[7.0]
