"""Gains that end the range that was searched are said to: beyond it nothing is known."""

from types import SimpleNamespace

import pytest

from torquer.design.gyro.notes import _on_search
from torquer.design.three_axis_answer import ThreeAxisAnswer
from torquer.theory.magneto_gyro.capture import (
    ANGLE_GAINS,
    GREATER_ANGLE_GAINS,
    GREATER_RATE_GAINS,
    RATE_GAINS,
    Stage1Design,
)
from torquer.theory.three_axis.gain_search import WEIGHTS

LEAST, GREATEST = "the least tried", "the greatest tried"


@pytest.mark.parametrize(
    ("ends", "told"),
    [
        ((0, 0), {}),
        ((1, 0), {"rate_gain_n_m_s_per_t2": GREATEST}),
        ((0, -1), {"angle_gain_n_m_per_t2 over that of the formula": LEAST}),
    ],
)
def test_the_refined_pair_names_what_ends_its_range(ends, told):
    answer = SimpleNamespace(design=SimpleNamespace(search=SimpleNamespace(ends=ends)))
    assert ThreeAxisAnswer._ends(answer) == told


@pytest.mark.parametrize(
    ("weight", "told"),
    [(float(WEIGHTS[0]), GREATEST), (float(WEIGHTS[-1]), LEAST), (float(WEIGHTS[3]), "")],
)
def test_a_weight_of_the_regulator_at_an_end_is_told(weight, told):
    answer = SimpleNamespace(design=SimpleNamespace(weight=weight))
    assert ThreeAxisAnswer._weight_is(answer) == told


@pytest.mark.parametrize(
    ("angle", "rate", "told"),
    [
        (ANGLE_GAINS[1], RATE_GAINS[1], {}),
        (ANGLE_GAINS[0], RATE_GAINS[-1], {"angle": LEAST, "rate": GREATEST}),
        (GREATER_ANGLE_GAINS[-1], GREATER_RATE_GAINS[2], {"angle": GREATEST}),
    ],
)
def test_gains_of_stage_1_at_an_end_of_their_grid_are_a_note(angle, rate, told):
    first = Stage1Design(angle, rate, 0.1, 0.5)
    law = {"capture_angle_gain": angle, "capture_rate_gain": rate}
    notes = _on_search(SimpleNamespace(first=first, law=law, failure=None))
    values = {"angle": angle, "rate": rate}
    assert notes == [
        f"stage 1: its capture_{name}_gain of {values[name]:g} is {words}"
        for name, words in told.items()
    ]
