"""Confidence intervals cover what they say; correlations are those of scipy; the stopping rule."""

import math
from datetime import UTC, datetime

import numpy as np
import pytest
from artificial_campaign import artificial
from hypothesis import given, settings, strategies as st
from scipy import stats
from scipy.spatial.transform import Rotation

from torquer.campaign.comparison import _rank_test
from torquer.campaign.spec import Stop
from torquer.campaign.statistics import (
    as_columns,
    chance_correlation,
    is_enough,
    mean_interval,
    quantile,
    quantile_interval,
    rank_correlations,
    rate_interval,
    varies,
)
from torquer.campaign.summary import correlations

TRIALS = 4000


def part_covered(intervals, truth) -> float:
    return np.mean([interval.low <= truth <= interval.high for interval in intervals])


def by_chance(part: float) -> float:
    """What a part of the trials is off by with four standard deviations."""
    return 4.0 * math.sqrt(part * (1.0 - part) / TRIALS)


@pytest.mark.parametrize("confidence", [0.8, 0.95, 0.99])
@pytest.mark.parametrize("members", [5, 40])
def test_interval_of_a_mean_has_its_stated_coverage(confidence, members):
    samples = np.random.default_rng(1).normal(3.0, 2.0, (TRIALS, members))
    covered = part_covered([mean_interval(row, confidence) for row in samples], 3.0)
    assert abs(covered - confidence) < by_chance(confidence)


@pytest.mark.parametrize("confidence", [0.8, 0.95])
@pytest.mark.parametrize("members", [30, 300])
def test_interval_of_a_rate_has_its_stated_coverage(confidence, members):
    """Summed over all numbers of successes; for single rates it varies, as these are whole."""
    counts = np.arange(members + 1)
    low, high = np.array([rate_interval(int(k), members, confidence) for k in counts]).T
    rates = (np.arange(500) + 0.5) / 500.0
    inside = (low <= rates[:, None]) & (rates[:, None] <= high)
    covered = np.sum(stats.binom.pmf(counts, members, rates[:, None]) * inside, axis=1)
    assert abs(covered.mean() - confidence) < 0.01
    assert covered[50:450].min() > confidence - 0.1


def test_the_interval_of_a_rate_is_wilsons():
    for successes, members in ((0, 10), (10, 10), (3, 10), (999, 1000), (1, 1)):
        known = stats.binomtest(successes, members).proportion_ci(0.9, "wilson")
        assert rate_interval(successes, members, 0.9) == pytest.approx(known, abs=1e-14)
    assert rate_interval(0, 0) == (0.0, 1.0)


@pytest.mark.parametrize("part", [0.05, 0.5, 0.95])
@pytest.mark.parametrize("members", [20, 200])
def test_the_interval_of_a_quantile_covers_it_for_any_distribution(part, members):
    rng = np.random.default_rng(2)
    for distribution in (stats.expon(), stats.t(1.5), stats.uniform()):
        samples = distribution.rvs((TRIALS // 4, members), random_state=rng)
        intervals = [quantile_interval(row, part, 0.9) for row in samples]
        covered = part_covered(intervals, distribution.ppf(part))
        # never less than it says; more, as the number of values below is a whole one
        assert covered > 0.9 - 2.0 * by_chance(0.9)
        width = stats.binom.interval(0.9, members, part)
        exact = stats.binom.cdf(width[1], members, part) - stats.binom.cdf(
            width[0] - 1, members, part
        )
        assert abs(covered - exact) < 2.0 * by_chance(exact) + 1e-9


@settings(max_examples=100, deadline=None)
@given(st.integers(1, 60), st.floats(0.01, 0.99), st.floats(0.5, 0.999))
def test_order_statistics_are_the_narrowest_that_leave_each_tail(members, part, confidence):
    """The definition, tried for every order statistic."""
    values = np.arange(1.0, members + 1.0)
    tail = 0.5 * (1.0 - confidence)
    below = stats.binom.cdf(np.arange(-1, members + 1), members, part)  # P(B <= k - 1) at k
    lows = [k for k in range(1, members + 1) if below[k] <= tail * (1.0 - 1e-9)]
    highs = [k for k in range(1, members + 1) if below[k] >= (1.0 - tail) * (1.0 + 1e-9)]
    low, high = quantile_interval(values, part, confidence)
    assert low in (max(lows, default=-math.inf), max(lows, default=0) + 1)  # at a tie either
    assert low == max(lows, default=-math.inf) or below[int(low)] == pytest.approx(tail)
    assert high == min(highs, default=math.inf) or below[int(high)] == pytest.approx(1.0 - tail)


def test_never_settled_is_late_in_quantiles_and_absent_from_means():
    values = [1.0, 2.0, 3.0, np.nan]
    assert (quantile(values, 0.5), quantile(values, 0.75), quantile(values, 1.0)) == (2, 3, np.inf)
    assert quantile_interval(values * 5, 0.9).high == math.inf
    assert quantile_interval([np.nan, 1.0] * 50, 0.2).high == 1.0
    assert mean_interval(values) == mean_interval([1.0, 2.0, 3.0])
    assert math.isnan(quantile([], 0.5))
    assert quantile_interval([], 0.5) == (-math.inf, math.inf)


def test_an_interval_stays_within_bounds():
    values = [0.1, 0.2, 9.0]
    low, high = mean_interval(values)
    assert low < 0.0 and mean_interval(values, 0.95, (0.0, math.inf)) == (0.0, high)


def test_mean_with_a_missing_value_is_never_precise_enough():
    stop = Stop(outcome="settling_s", half_width=1.0, least=10)
    values = np.full(50, 100.0)
    assert is_enough(stop, values)
    values[3] = np.nan
    assert not is_enough(stop, values)


def test_too_few_members_tell_nothing():
    assert mean_interval([1.0]) == (-math.inf, math.inf)
    assert mean_interval([]).half_width == math.inf
    assert quantile_interval([1.0, 2.0, 3.0], 0.9) == (1.0, math.inf)


def test_a_quantile_is_one_of_the_values():
    values = np.random.default_rng(3).permutation(10) + 1.0
    assert [quantile(values, part) for part in (0.0, 0.1, 0.11, 0.3, 0.5, 1.0)] == [
        1, 1, 2, 3, 5, 10,
    ]  # fmt: skip


def test_rank_correlations_are_those_of_scipy():
    rng = np.random.default_rng(4)
    x, noise = rng.normal(size=(500, 3)), rng.normal(size=500)
    size = np.linalg.norm(x, axis=1)
    inputs = {"a": x, "b": rng.integers(0, 4, 500), "same": np.ones(500), "words": ["x"] * 500}
    outcome = np.exp(x[:, 1]) + 0.1 * noise
    outcome[::7] = np.nan
    found = rank_correlations(inputs, {"time": outcome, "constant": np.zeros(500)})
    assert [*found] == ["time"]
    late = np.where(np.isnan(outcome), np.inf, outcome)
    known = {f"a[{k}]": x[:, k] for k in range(3)} | {"|a|": size, "b": inputs["b"]}
    known |= {f"a.direction[{k}]": x[:, k] / size for k in range(3)}
    assert set(found["time"]) == set(known)
    for name, values in known.items():
        assert found["time"][name] == pytest.approx(stats.spearmanr(values, late).statistic)


def test_correlations_by_chance_stay_within_their_bound():
    rng = np.random.default_rng(5)
    inputs = {"x": rng.random((50, TRIALS))}
    columns = {f"{k}": inputs["x"][:, k] for k in range(TRIALS)}
    (found,) = rank_correlations(columns, {"y": rng.random(50)}).values()
    beyond = np.mean(np.abs([*found.values()]) > chance_correlation(50, 0.9))
    assert abs(beyond - 0.1) < by_chance(0.1)


def test_columns_of_what_was_drawn():
    quaternions = Rotation.random(5, random_state=np.random.default_rng(6)).as_quat()
    drawn = {
        "initial.attitude": quaternions,
        "inertia": np.ones((5, 3, 3)),
        "start": [datetime(2020, 1, 1, 0, 0, k, tzinfo=UTC) for k in range(5)],
        "none": np.zeros((5, 2)),
        "lists": [[1.0], [1.0, 2.0]] * 2 + [[1.0]],
        "tables": [{"kind": "off"}] * 5,
    }
    columns = as_columns(drawn)
    same = as_columns(drawn | {"initial.attitude": -quaternions})
    assert np.array_equal(columns["initial.attitude[0][2]"], same["initial.attitude[0][2]"])
    assert columns["|inertia|"].tolist() == [3.0] * 5
    assert np.diff(columns["start"]).tolist() == [1.0] * 4
    assert columns["none.direction[1]"].tolist() == [0.0] * 5
    assert not any(name.startswith(("lists", "tables")) for name in columns)


def test_a_campaign_stops_once_the_interval_is_narrow_enough():
    of_rate = Stop(outcome="success", half_width=0.05, least=50)
    half = {n: rate_interval(n // 2, n).half_width for n in (50, 300, 400)}
    assert half[300] > 0.05 > half[400]
    assert [is_enough(of_rate, np.arange(n) % 2 == 0) for n in half] == [False, False, True]
    of_mean = Stop(outcome="x", half_width=0.5, confidence=0.99, least=100)
    values = np.random.default_rng(7).normal(size=100)
    assert is_enough(of_mean, values) and not is_enough(of_mean, values[:99])
    assert not is_enough(of_mean, 10.0 * values)
    assert not is_enough(of_mean, np.full(1000, np.nan))


def test_members_that_both_campaigns_have_are_compared_one_by_one():
    """Whatever their rows are in each of them. (Otherwise nothing is left of a shift.)"""
    rng = np.random.default_rng(3)
    one = rng.normal(scale=100.0, size=30)
    order = rng.permutation(30)
    other = (one + rng.normal(1.0, 0.5, 30))[order]
    rows = order, np.arange(30)
    expected = stats.wilcoxon(other - one[order]).pvalue
    assert _rank_test(one, other, rows) == {"name": "Wilcoxon signed-rank", "p": expected}
    assert expected < 1e-4 < stats.wilcoxon(other - one).pvalue


def test_three_members_have_no_correlations():
    assert correlations(artificial(3)) == {} != correlations(artificial(4))


def test_what_varies_by_rounding_alone_does_not_vary():
    rng = np.random.default_rng(11)
    directions = rng.normal(size=(200, 3))
    directions *= 30.0 / np.linalg.norm(directions, axis=1)[:, None]
    assert np.ptp(np.linalg.norm(directions, axis=1)) > 0.0
    sizes = rng.uniform(0.1, 1.0, 200)[:, None]
    inputs = {"rate": directions, "dipole": sizes * [0.36, 0.48, 0.8], "axis": sizes * [1.0, 0, 0]}
    outcome = rng.random(200)
    (found,) = rank_correlations(inputs, {"y": outcome}).values()
    assert "|rate|" not in found and {"rate[0]", "rate.direction[0]"} <= set(found)
    assert "|dipole|" in found and not any(key.startswith("dipole.direction") for key in found)
    assert {key for key in found if "axis" in key} == {"axis[0]", "|axis|"}
    rounded = 311.8 * (1.0 + 1e-13 * rng.random(200))
    assert rank_correlations(inputs, {"greatest": rounded}) == {}
    assert rank_correlations(inputs, {"greatest": 311.8 * (1.0 + 1e-6 * outcome)}) != {}


def test_members_without_a_value_differ_from_those_with_one():
    assert not varies([np.inf] * 4) and not varies([]) and not varies([2.0] * 4)
    assert varies([2.0, np.inf]) and varies([-np.inf, np.inf]) and varies([0.0, 1e-30])
