"""Whether a limit lies within the motion that remains: made signals with known answers."""

import numpy as np
import pytest

from torquer.analysis.goals import find_goals
from torquer.analysis.residual import find_residual
from torquer.analysis.series import times_above
from torquer.analysis.summary import summary_rows
from torquer.analysis.verdict import judge_run

REVOLUTION_S = 5700.0
T = np.arange(0.0, 6.0 * REVOLUTION_S, 10.0)
#: Decays within minutes to a swing of 0.05..0.25 ten times a revolution.
WITHIN = 10.0 * np.exp(-T / 400.0) + 0.15 + 0.1 * np.sin(20.0 * np.pi * T / REVOLUTION_S)


def test_a_swing_that_stays_has_the_limit_within_it():
    low, high = find_residual(T, WITHIN, 0.2, REVOLUTION_S)
    assert (low, high) == pytest.approx((0.05, 0.25), abs=1e-3)
    assert find_residual(T, WITHIN, 0.29, REVOLUTION_S) is None  # above it, with some room
    assert find_residual(T, WITHIN, 0.04, REVOLUTION_S) is None  # below all of it
    assert find_residual(T, 10.0 - T / T[-1], 9.5, REVOLUTION_S) is None  # once and for all


def test_a_swing_that_decays_has_no_residual():
    ringing = np.exp(-T / (2.0 * REVOLUTION_S)) * (1.0 + np.sin(20.0 * np.pi * T / REVOLUTION_S))
    assert times_above(ringing < 0.5) > 5
    assert find_residual(T, ringing, 0.5, REVOLUTION_S) is None
    assert find_residual(T[:600], WITHIN[:600], 0.2, REVOLUTION_S) is None  # too short to tell


def test_times_above_are_counted_after_the_first_time_below():
    below = np.array([0, 0, 1, 1, 0, 0, 1, 0, 1], bool)
    assert times_above(below) == 2
    assert times_above(np.ones(4, bool)) == times_above(np.zeros(4, bool)) == 0


def test_the_verdict_says_first_and_for_good_and_that_it_is_chance(make):
    given = make({"mission": {"rate_below_deg_s": 0.2}})
    verdict = judge_run(given, find_goals(given), T, {"goal 0": WITHIN}, True)
    (goal,) = verdict["goals"]
    assert goal["within_residual"] and goal["times_above"] > 40
    ends_low = np.where(T[-1] - 400.0 < T, 0.1, WITHIN)
    verdict = judge_run(given, find_goals(given), T, {"goal 0": ends_low}, True)
    (goal,) = verdict["goals"]
    assert verdict["done"] and goal["first_s"] < 3000.0 < goal["stays_from_s"]
    assert verdict["headline"].startswith("Achieved: rate below 0.2 deg/s from 9.")
    assert verdict["headline"].endswith(
        f"(first below 0.2 deg/s at {goal['first_s'] / 60.0:.3g} min, above it "
        f"{goal['times_above']} times since: the limit lies within the residual motion, "
        "0.05..0.25 deg/s in the last two revolutions)."
    )


def test_a_limit_missed_within_the_residual_motion_says_so(make):
    given = make({"mission": {"rate_below_deg_s": 0.2}})
    n = np.flatnonzero(WITHIN > 0.24)[-1] + 1  # ends above
    verdict = judge_run(given, find_goals(given), T[:n], {"goal 0": WITHIN[:n]}, True)
    assert verdict["done"] is False
    assert verdict["headline"].endswith(
        "at the end (the limit lies within the residual motion, 0.05..0.25 deg/s in the last two "
        "revolutions)."
    )
    rows = dict(summary_rows({"scenario": "", "verdict": verdict}))
    assert rows["  above it again"].endswith(
        "times: the limit lies within the residual motion, 0.05..0.25 deg/s"
    )
