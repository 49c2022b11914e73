"""Parts of a mission's design on pointing: a flight with the laws of the file, and its budget."""

import math
from pathlib import Path

import pytest

import torquer
from torquer.compile import engine
from torquer.design.mission_parts import FAILS, HOLDS, LEFT_OUT, walk
from torquer.design.mission_pointing import FlownLaws, error_that_counts, flown_in_words
from torquer.design.requests import MissionRequest

EXAMPLES = Path(torquer.__file__).parents[1] / "examples"
LOOKS = torquer.load_scenario(EXAMPLES / "looks_at_a_station.toml")


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
@pytest.mark.parametrize(("within_deg", "state"), [(0.2, HOLDS), (0.01, FAILS)])
def test_slews_are_judged_by_what_is_commanded(within_deg, state):
    """The first slew begins 95 deg from its target: its own error is 0.07 deg at most."""
    short = LOOKS.replace("simulation.revolutions", 1.1)
    part = walk("pointing in flight", short, MissionRequest(pointing_deg=within_deg))
    summary = part.answer.summary
    assert part.state == state
    assert summary["peak_attitude_error_last_revolution_deg"] > 90.0
    assert 0.01 < summary["peak_commanded_error_last_revolution_deg"] < 0.2
    for words in ("from what is commanded, slews included", "of its momentum", "coils "):
        assert words in part.words
    assert not part.answer.saturates and part.open == ()


@pytest.mark.parametrize("summary", [{}, {"final_attitude_error_deg": None}])
def test_a_flight_whose_modes_hold_nothing_says_so(summary):
    """Modes may stay in states that hold no attitude, all the time or at the end."""
    found = FlownLaws(None, summary)
    assert flown_in_words(found, 1.0) == "no attitude held at the end; asked: 1 deg"
    assert error_that_counts(found) == math.inf


def test_what_has_no_law_that_holds_or_no_one_loop_is_left_out():
    part = walk("pointing budget", LOOKS, MissionRequest())
    assert (part.state, part.words) == (LEFT_OUT, "modes: no one loop all the time")
    tumbles = torquer.load_scenario(EXAMPLES / "satellites/small_150kg.toml")
    for name in ("pointing in flight", "pointing budget"):
        part = walk(name, tumbles, MissionRequest())
        assert (part.state, part.words) == (LEFT_OUT, "laws that hold none (bdot)")


def test_where_wheels_hold_no_hold_by_coils_is_designed():
    part = walk("hold by coils", LOOKS, MissionRequest())
    assert (part.state, part.words) == (LEFT_OUT, "reaction wheels: coils alone need not hold")
    assert part.open == ()
