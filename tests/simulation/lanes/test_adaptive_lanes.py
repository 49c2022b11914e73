"""Members with adaptive steps side by side: each has the steps and the bits of its own flight."""

import numpy as np
import pytest
from simulation.lanes.test_lanes import (
    DISTURBANCES,
    FAILURES,
    HEAD,
    LAWS,
    MODES,
    MORE_DISTURBANCES,
    PLAIN,
    fly_both,
    motions,
    with_errors,
)
from slow_cases import slow_after

from torquer.compile import engine
from torquer.scenario.load import scenario_from_text
from torquer.simulation.lanes.group import Lanes, Pieces
from torquer.simulation.loop.state import CELLS
from torquer.simulation.setup.run import prepare

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="lanes are compiled code")


def adaptive(text):
    """A scenario without its fixed step."""
    return scenario_from_text(
        HEAD + text.replace(", step_s = 1.0", "").replace(", step_s = 0.5", "")
    )


#: Control steps of which one adaptive step is more, about the whole, a small part.
QUICK = PLAIN.replace("sample_s = 1.0", "sample_s = 0.25")
RARE = PLAIN.replace("sample_s = 1.0", "sample_s = 30.0").replace("1e5", "1e4")
LAGGING = RARE.replace("limit_a_m2 = 3.0", "limit_a_m2 = 3.0\nspacecraft.coils.lag_s = 2.0")
LIGHT = DISTURBANCES[DISTURBANCES.index("disturbance.solar_pressure") :]
SUNLIT = RARE.replace("duration_s = 900", "duration_s = 6300") + LIGHT
SCENARIOS = {
    "steps of a whole interval": PLAIN,
    "short intervals": QUICK,
    "several steps an interval": RARE,
    "coils with a lag, several steps": LAGGING,
    "sunlight with its edges": SUNLIT,
    "errors and disturbances of all kinds": with_errors(
        LAWS + DISTURBANCES + MORE_DISTURBANCES, {}
    ),
    "modes, an estimator, sensors that fail": with_errors(MODES + DISTURBANCES, FAILURES),
}


@pytest.mark.parametrize("name", slow_after(4, SCENARIOS))
def test_member_with_its_own_steps_matches_its_own_flights_bits(name):
    steps = []
    for beside, kept, cells, own in fly_both(adaptive(SCENARIOS[name])):
        assert np.array_equal(beside, kept)
        for number in CELLS.names:  # also the steps to try next, and the sums of errors
            assert cells[number] == own[number], number
        steps.append(cells["steps"])
    assert steps[0] > 0.0
    if "several" in name:
        assert steps[-1] > 1.5 * steps[0]


def test_a_members_bits_do_not_depend_on_its_neighbours():
    """In another order, among other members, alone in its lanes."""
    run = prepare(adaptive(RARE))
    lanes, seeds = Lanes(run, Pieces(run)), np.arange(21)
    numbers = lanes.numbers_of(motions(run))
    whole = lanes.fly(numbers, seeds)
    for rows in (np.arange(21)[::-1], np.array([20, 3, 20, 0]), np.array([13])):
        part = lanes.fly(numbers[rows], seeds[rows])
        assert np.array_equal(part.motion, whole.motion[..., rows])
        assert np.array_equal(part.cells, whole.cells[rows])


def test_a_member_too_fast_for_adaptive_steps_ends_alone():
    run = prepare(adaptive(PLAIN))
    lanes, first, seeds = Lanes(run, Pieces(run)), motions(run), np.zeros(21, np.int64)
    usual = lanes.fly(lanes.numbers_of(first), seeds)
    first[4, 4:] *= 1e12
    flown = lanes.fly(lanes.numbers_of(first), seeds)
    assert flown.failed.tolist() == [row == 4 for row in range(21)]
    others = ~flown.failed
    assert np.array_equal(flown.motion[..., others], usual.motion[..., others])
