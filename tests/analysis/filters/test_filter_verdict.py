"""The verdict on a filter in words, from statistics of known size."""

import numpy as np
import pytest
from filter_cases import GYRO, without

from torquer.analysis.filters.filter_check import _check_errors
from torquer.analysis.filters.filter_statistics import FilterRuns
from torquer.analysis.filters.filter_verdict import Check, judge_filter
from torquer.computer.estimation.kalman_gyro import KalmanGyro

SPEC = KalmanGyro.model_validate(GYRO)


def runs(factor=1.0, sigma_deg=1.0, known=20, count=20):
    """Errors `factor` times as large as stated, in `known` of `count` runs."""
    sigma = np.radians(sigma_deg) * np.ones(6)
    errors = factor * sigma * np.random.default_rng(1).normal(size=(count, 100, 6))
    covariance = np.tile(np.diag(sigma**2), (count, 100, 1, 1))
    errors[known:], covariance[known:] = np.nan, np.nan
    nothing, t_s = np.zeros((count, 100)), np.arange(100.0)
    return FilterRuns(t_s, errors, covariance, {}, nothing, nothing, nothing, [])


def verdict(flown, *others, spec=SPEC):
    return judge_filter(spec, flown, [*_check_errors(flown), *others])


def test_errors_as_stated_are_consistent():
    word, text = verdict(runs())
    assert word == "consistent" and text.startswith(
        "consistent; what goes wrong in less than 14% of"
    )
    assert text.endswith("may not show in 20 runs")
    assert pytest.approx(0.05, abs=2e-3) == (1.0 - 0.14) ** 20


@pytest.mark.parametrize("factor", [1.5, 20.0])
def test_an_optimistic_filter_is_reported_with_its_factor(factor):
    word, text = verdict(runs(factor))
    assert word == "optimistic"
    assert float(text.split(" times")[0].split()[-1]) == pytest.approx(factor, rel=0.05)
    # worse than not to know, or to start in some runs only
    assert verdict(runs(factor, sigma_deg=40.0)).word == "optimistic"
    assert verdict(runs(factor, known=15)).word == "optimistic"


def test_a_pessimistic_filter_is_called_pessimistic():
    word, text = verdict(runs(0.4))
    assert word == "conservative" and text == "conservative: errors are 0.4 times what it states"


def test_who_states_more_than_lost_does_not_know():
    word, text = verdict(runs(sigma_deg=25.0))
    assert word == "does not know" and "states 43.3 deg" in text
    assert "lost_sigma_deg is 30" in text
    assert verdict(runs(0.5, sigma_deg=25.0)).word == "does not know"
    assert verdict(runs(sigma_deg=15.0)).word == "consistent"


def test_runs_that_never_start_are_reported_with_the_reason():
    flown = runs(known=0)
    assert list(_check_errors(flown)) == []
    word, text = verdict(flown)
    assert word == "never started"
    assert text.startswith("never started: it needs a reading of the field and one of the Sun")
    some = runs(known=17)
    assert verdict(some).text.startswith("never started in 3 of 20 runs: it needs a reading")
    sun = {**without(GYRO, "magnetometer_noise_nt"), "sensors": ["sun"]}
    said = verdict(flown, spec=KalmanGyro.model_validate(sun)).text
    handed = "it needs a second sensor, or an attitude from another estimator"
    assert said == f"never started: {handed}"
    # where the filter itself gives reasons, those of the runs that never started
    some.why_not_started[17:] = [[2.0], [2.0], [5.0]]
    some.why_not_started[:17] = 7.0
    said = verdict(some).text
    assert said == (
        "never started in 3 of 20 runs: no usable reading of the magnetometer; "
        "the angle between two directions is not that of the models"
    )


def test_innovations_that_fail_alone_are_named():
    nis = Check("NIS of the sun", 1.44, 0.9, 1.1, 0.1, False)
    white = Check("correlation of the magnetometer", 0.3, -0.02, 0.02, float("nan"), False)
    word, text = verdict(runs(), nis, white)
    assert word == "not consistent"
    assert "innovations of the sun are 1.2 times what it predicts" in text
    assert "innovations of the magnetometer are correlated in time, 0.3" in text


def test_errors_that_make_up_for_each_other_do_not_pass():
    """Half of the time twice too large a square, half of it none to speak of."""
    flown = runs()
    flown.errors[:, ::2] *= np.sqrt(1.9)
    flown.errors[:, 1::2] *= np.sqrt(0.1)
    checks = list(_check_errors(flown))
    assert all(check.low < check.value < check.high for check in checks)
    assert not any(check.passed for check in checks)
    word, text = verdict(flown)
    assert word == "not consistent" and "in its band at 0% of instants only" in text
