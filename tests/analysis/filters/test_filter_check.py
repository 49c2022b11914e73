"""Statistics of filters, on numbers of known distribution; expected accuracy beside Monte Carlo."""

import numpy as np
import pytest
from filter_cases import DISTURBANCE, DYNAMICS, GYRO, HANDED_OVER, SCENARIO, without
from slow_cases import slow_after

from torquer import simulate
from torquer.analysis.filters.filter_check import as_plain, check_filter
from torquer.analysis.filters.filter_flights import fly_filter
from torquer.analysis.filters.filter_members import make_members
from torquer.analysis.filters.filter_statistics import (
    FilterRuns,
    autocorrelation,
    band,
    consistency,
    nees,
    nis,
)
from torquer.analysis.filters.filter_verdict import REJECTED
from torquer.analysis.filters.linear_covariance import (
    Motion,
    error_95_rad,
    expected_accuracy,
    held_attitude,
)
from torquer.compile import engine
from torquer.scenario.load import scenario_from_data

NOT_FLOWN = Motion(np.zeros(0), *(np.zeros((0, n)) for n in (4, 3, 3)))
WHOLE_RUNS = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


def drawn(runs=50, samples=400, n=4, factor=1.0):
    """Errors of a random covariance, stated `factor` times as large."""
    rng = np.random.default_rng(4)
    root = rng.normal(size=(n, n)) * np.array([[1.0], [1e-3], [1e-6], [1e3]])[:n]
    errors = rng.normal(size=(runs, samples, n)) @ root.T
    covariance = np.broadcast_to(factor * root @ root.T, (runs, samples, n, n))
    nothing = np.zeros((runs, samples))
    t_s = np.arange(float(samples))
    return FilterRuns(t_s, errors, covariance, {}, nothing, nothing, nothing, [NOT_FLOWN])


def test_consistent_errors_lie_in_band_at_95_percent_of_instants():
    found = consistency(nees(drawn()), 4)
    assert found.consistent and found.inside == pytest.approx(0.95, abs=0.035)
    assert found.overall == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("factor", [0.7, 1.4])
def test_a_covariance_stated_wrongly_is_found_out(factor):
    found = consistency(nees(drawn(factor=factor)), 4)
    assert not found.consistent and found.inside < 0.5
    assert found.overall == pytest.approx(1.0 / factor, rel=0.03)


def test_the_band_is_that_of_the_chi_square_distribution():
    """200 runs of 3 freedoms: printed tables give 0.890 and 1.116."""
    assert band(3, 200) == pytest.approx((0.890, 1.116), abs=1e-3)


def test_instants_of_which_few_runs_know_are_left_out():
    values = nees(drawn())
    values[:30, 10] = np.nan
    assert len(consistency(values, 4).mean) == 399


def test_innovations_that_are_missing_count_for_nothing():
    rng = np.random.default_rng(1)
    innovations = rng.normal(size=(40, 300, 3))
    innovations[..., 2] = np.nan
    innovations[:, ::3] = np.nan
    square, freedoms = nis(innovations)
    assert freedoms == 2 and np.isnan(square[:, 0]).all()
    assert np.nanmean(square) == pytest.approx(2.0, abs=0.06)


def test_correlation_is_of_readings_one_after_another():
    rng = np.random.default_rng(1)
    white = rng.normal(size=(10, 2000, 3))
    walked = white.copy()
    for k in range(1, 2000):
        walked[:, k] = 0.5 * walked[:, k - 1] + white[:, k]
    gaps = np.full((10, 4000, 3), np.nan)
    gaps[:, ::2] = walked
    for lag in (1, 2):
        assert autocorrelation(gaps, lag)[0] == pytest.approx(0.5**lag, abs=0.02)
        value, sigma = autocorrelation(white, lag)
        assert abs(value) < 4.0 * sigma
        assert sigma == pytest.approx(1.0 / np.sqrt(60_000.0), rel=0.01)


def scenario(estimator, **changes):
    return scenario_from_data(
        {
            **SCENARIO,
            "disturbance": DISTURBANCE,
            "control": {"law": {"kind": "off"}, "estimator": estimator},
            "simulation": {**SCENARIO["simulation"], "duration_s": 2400.0, **changes},
        }
    )


@WHOLE_RUNS
@pytest.mark.parametrize(
    "estimator",
    slow_after(1, [GYRO, GYRO | {"magnetometer_bias_sigma_nt": 300.0}, DYNAMICS]),
    ids=["gyro", "gyro and magnetometer bias", "dynamics"],
)
def test_expected_accuracy_is_that_of_monte_carlo(estimator):
    """Within 10 %, in light and shadow: 200 runs tell it to 3 % at an instant."""
    flown = scenario(estimator, record_s=20.0)
    runs = fly_filter(make_members(flown, 200))
    one = simulate(flown.replace("simulation.record_s", 1.0))
    own = (one[name].values for name in ("time", "q_body_to_inertial", "omega_body"))
    expected = expected_accuracy(flown, Motion(*own, np.zeros((len(one.time), 3))))
    assert expected.sun_seen[100] and not expected.sun_seen[2000]
    square = np.mean(np.sum(runs.errors[..., :3] ** 2, axis=2), axis=0) / 3.0
    ratio = square / expected.attitude_sigma_rad[::20][: len(square)] ** 2
    over_200_s = ratio[10:110].reshape(-1, 10).mean(axis=1)
    assert np.all(np.abs(np.sqrt(over_200_s) - 1.0) < 0.1)


def test_a_held_attitude_is_that_of_the_motion():
    """Steady in body axes; or turning with the orbital frame."""
    data = scenario(GYRO).replace("initial.rate_deg_s", [0.0, 0.0, 0.06])
    t_s = np.linspace(0.0, 3000.0, 31)
    q, omega = held_attitude(data, t_s)
    assert omega == pytest.approx(np.tile(np.radians([0.0, 0.0, 0.06]), (31, 1)))
    data = data.replace("initial.reference", "orbital")
    q, omega = held_attitude(data, t_s)
    step = 1e-3
    later, _ = held_attitude(data, t_s + step)
    turned = 2.0 * np.sum(q * later, axis=1)
    assert np.linalg.norm(omega, axis=1) == pytest.approx(data.orbit.rate_rad_s(), rel=1e-6)
    assert turned == pytest.approx(2.0 * np.cos(0.5 * step * data.orbit.rate_rad_s()), abs=1e-12)


def test_only_filters_have_statistics():
    triad = {"kind": "triad", "magnetometer_noise_nt": 50.0, "sun_noise_deg": 0.1}
    for function in (check_filter, expected_accuracy):
        with pytest.raises(ValueError, match=r"control.estimator.kind: must be .*received 'triad'"):
            function(scenario(triad))


def test_statistics_need_two_runs():
    with pytest.raises(ValueError, match="runs: must be 2 or more; received 1"):
        check_filter(scenario(GYRO), 1)


@WHOLE_RUNS
def test_the_whole_check_passes_an_honest_filter_and_fails_another():
    answer = []
    found = check_filter(scenario(GYRO, duration_s=1200.0), 40, answer.append)
    honest = as_plain(found)
    assert answer == sorted(answer) and answer[-1] == 1.0 and len(answer) == 40
    assert found.consistent and honest["consistent"] and len(honest["checks"]) == 7
    assert honest["error_deg"] == pytest.approx(honest["sigma_deg"], rel=0.1)
    assert honest["error_deg"] == pytest.approx(honest["expected_deg"], rel=0.1)
    wrong = check_filter(scenario(GYRO | {"magnetometer_noise_nt": 500.0}, duration_s=1200.0), 40)
    failed = {check.name for check in wrong.checks if not check.passed}
    assert "NIS of the magnetometer" in failed and not wrong.consistent
    one = check_filter(scenario({**without(GYRO, "sun_noise_deg"), "sensors": ["magnetometer"]},
                                duration_s=600.0), 4)  # fmt: skip
    assert not any("sun" in check.name for check in one.checks)


@WHOLE_RUNS
def test_a_run_that_stops_is_an_error_with_its_reason(tmp_path):
    """A law whose answer is no number from 100 s on."""
    law = """
import torquer

@torquer.law()
def breaks(inputs, parameters, memory):
    return (0.0 if inputs.t_s < 100.0 else 0.0 / 0.0, 0.0, 0.0)
"""
    (tmp_path / "breaks.py").write_text(law)
    breaks = scenario(GYRO).replace(
        "control.law", {"kind": "user", "file": str(tmp_path / "breaks.py")}
    )
    with pytest.raises(ValueError, match=r"seed \d+: control\.law: .* at t = 100 s"):
        fly_filter(make_members(breaks, 1))


@WHOLE_RUNS
def test_runs_that_would_end_early_are_flown_whole():
    flown = scenario(GYRO)
    ends = flown.replace("simulation.end_when", {"signal": "rate_deg_s", "below": 10.0})
    whole, same = (fly_filter(make_members(each, 2)) for each in (flown, ends))
    assert np.array_equal(whole.t_s, same.t_s) and np.array_equal(whole.errors, same.errors)


@WHOLE_RUNS
def test_lost_single_runs_are_found_by_their_rejected_readings():
    """By the Sun and a gyro the turn about the Sun is known ever less: in a few runs of a
    revolution it is so wrong that readings are rejected for minutes. The means do not show it."""
    sun = {**without(GYRO, "magnetometer_noise_nt"), "sensors": ["sun"]}
    flown = scenario_from_data(
        {
            **SCENARIO,
            "control": {"estimator": sun, **HANDED_OVER},
            "simulation": {**SCENARIO["simulation"], "duration_s": 5760.0},
        }
    )
    found = check_filter(flown, 200)
    assert [check.name for check in found.checks if not check.passed] == [REJECTED]
    assert found.verdict.word == "not consistent"
    assert REJECTED in found.verdict.text


def with_windows(estimator, sample_s=1.0, measure_s=2.0, actuate_s=6.0, **changes):
    """Coils off while sensors are read, then B-dot."""
    control = {"sample_s": sample_s, "measure_s": measure_s, "actuate_s": actuate_s}
    return scenario_from_data(
        {
            **SCENARIO,
            "disturbance": DISTURBANCE,
            "control": {
                "law": {"kind": "bdot_rate", "gain_a_m2_s_per_t": 3e6},
                "estimator": estimator,
                **control,
            },
            "simulation": {**SCENARIO["simulation"], **changes},
        }
    )


#: Of readings every 2 s.
SLOW_GYRO = GYRO | {"angle_random_walk_deg_sqrt_s": 0.01 * np.sqrt(2.0)}


@WHOLE_RUNS
@pytest.mark.parametrize(
    ("estimator", "windows", "steps"),
    [
        pytest.param(DYNAMICS, (1.0, 2.0, 6.0), 3 * 150, id="dynamics", marks=pytest.mark.slow),
        pytest.param(SLOW_GYRO, (2.0, 6.0, 2.0), 4 * 150, id="gyro"),
    ],
)
def test_windows_of_measurement_and_actuation_change_nothing(estimator, windows, steps):
    """A filter that works at uneven steps, with coils on in between, is as honest; one with a gyro
    as long as its steps are even, which the gyro's noise is stated for."""
    found = check_filter(with_windows(estimator, *windows), 30)
    assert found.consistent and len(found.closely.t_s) == steps
    plain = as_plain(found)
    assert plain["error_deg"] == pytest.approx(plain["expected_deg"], rel=0.1)


@WHOLE_RUNS
def test_a_gyro_read_at_uneven_steps_is_found_out():
    """Its noise counts six times as much over 6 s as it was stated for steps of 1 s."""
    failed = [c.name for c in check_filter(with_windows(GYRO), 30).checks if not c.passed]
    assert "NEES of the attitude" in failed


def test_records_between_control_cycles_are_refused():
    with pytest.raises(ValueError, match=r"simulation.record_s: must be .* the control cycle = 8"):
        fly_filter(make_members(with_windows(GYRO, record_s=12.0), 2))


def test_95_percent_of_whole_errors():
    """One axis: 1.96 sigma; three alike: the chi distribution's 2.795."""
    covariance = np.array([np.diag([0.04, 0.0, 0.0]), 0.01 * np.eye(3), 9.0 * np.eye(3)])
    expected = [0.2 * 1.95996, 0.1 * 2.79548, np.pi]
    assert error_95_rad(covariance) == pytest.approx(expected, rel=0.01)
