"""Parts of a mission's design on pointing: a flight with the laws of the file, and its budget."""

import math
from pathlib import Path
from types import SimpleNamespace

import pytest

import torquer
from torquer.campaign.faults.fly import fly_faults
from torquer.compile import engine
from torquer.design.failure import Failure, Flown
from torquer.design.mission_parts import DOUBTFUL, FAILS, HOLDS, LEFT_OUT, _bare, _of, walk
from torquer.design.mission_pointing import (
    FlownLaws,
    error_that_counts,
    flown_in_words,
    judged_by,
)
from torquer.design.requests import MissionRequest
from torquer.design.wheel_file import slews_of
from torquer.scenario.load import scenario_from_data

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


PUSHED_N_M = 1e-6


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
def test_momentum_that_nothing_takes_off_fills_the_wheels():
    """A torque of 1e-6 N m along the orbit's normal: 0.0864 N m s a day, 0.5 N m s in 5.8 days."""
    alone = torquer.load_scenario(EXAMPLES / "satellites/small_150kg_wheels.toml")
    data = alone.model_dump(mode="json", exclude_unset=True, exclude_none=True)
    craft, control = data["spacecraft"], data["control"]
    for name in ("coils", "aerodynamics", "magnetometer"):
        del craft[name]
    craft["wheels"] |= {"layout": {"kind": "axes", "axes": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]},
                        "momentum_limit_n_m_s": 0.5}  # fmt: skip
    del control["laws"]["unload"]
    data |= {"disturbance": {"constant_torque_n_m": [0.0, PUSHED_N_M, 0.0]},
             "simulation": {"revolutions": 1.2, "record_s": 10.0}}  # fmt: skip
    data["initial"]["euler_deg"] = [0.0, 0.0, 0.0]
    del data["environment"]["atmosphere"]
    part = walk("pointing in flight", scenario_from_data(data), MissionRequest())
    assert part.state == DOUBTFUL and part.open == (
        "nothing unloads the wheels: they gather 0.086 N m s a day, and have no more than 0.5 N m "
        "s about their weakest axis, for about 5.79 d",
    )
    still = scenario_from_data(data | {"disturbance": {}})
    part = walk("pointing in flight", still, MissionRequest())
    assert part.state == HOLDS and part.open == ()


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


def test_what_is_asked_limits_the_error_that_is_meant():
    """Where laws slew again and again that from what they command; a limit of the file stays."""

    def limits(given, **asked):
        mission = judged_by(given, MissionRequest(**asked)).mission
        return {} if mission is None else mission.model_dump(exclude_defaults=True)

    assert limits(LOOKS, pointing_deg=0.3)["commanded_error_below_deg"] == 0.3
    assert "attitude_error_below_deg" not in limits(LOOKS, pointing_deg=0.3)
    own = LOOKS.replace("mission", {"attitude_error_below_deg": 5.0, "rate_below_deg_s": 1.0})
    found = limits(own, pointing_deg=0.3)
    assert (found["attitude_error_below_deg"], found["rate_below_deg_s"]) == (0.3, 1.0)
    assert limits(own)["attitude_error_below_deg"] == 5.0
    holds = torquer.load_scenario(EXAMPLES / "pointing_budget.toml")
    assert "attitude_error_below_deg" in limits(holds, pointing_deg=0.3)
    tumbles = torquer.load_scenario(EXAMPLES / "satellites/small_150kg.toml")
    assert judged_by(tumbles, MissionRequest(pointing_deg=0.3)) is tumbles


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
def test_a_slew_without_a_fault_is_no_fault():
    short = LOOKS.replace("simulation.revolutions", 1.1)
    found = fly_faults(judged_by(short, MissionRequest(pointing_deg=0.5)), only=["gyro silent"])
    assert [goal.signal for goal in found.goals] == ["error from the commanded attitude"]
    assert found.verdict == ("safe", "")


@pytest.mark.parametrize(
    ("key", "value", "words", "state"),
    [
        ("momentum_limit_n_m_s", 0.012, "13.2 % of the momentum and 7.91 % of the torque", HOLDS),
        ("momentum_limit_n_m_s", 1e-3, ": the momentum limits", FAILS),
        ("torque_limit_n_m", 5e-5, ": the torque limits", FAILS),
    ],
)
def test_wheels_are_judged_by_the_momentum_and_the_torque_of_slews(key, value, words, state):
    part = walk(
        "reaction wheels", LOOKS.replace(f"spacecraft.wheels.{key}", value), MissionRequest()
    )
    assert part.state == state and words in part.words
    slews = slews_of(LOOKS)
    assert slews == {"rate_deg_s": 1.0, "acceleration_deg_s2": 0.1}
    assert any(f"would work: {key}" in point for point in part.open) == (state == FAILS)


def test_a_limit_of_the_attitude_is_none_of_the_gain_that_stops_it():
    """A file with wheels limits its attitude; B-dot, designed for it, holds none."""
    given = LOOKS.replace("mission", {"attitude_error_below_deg": 5.0, "within_s": 900.0})
    assert _bare(given).mission is None
    limits = {"attitude_error_below_deg": 5.0, "rate_below_deg_s": 0.2, "within_s": 900.0}
    left = _bare(LOOKS.replace("mission", limits)).mission
    assert (left.rate_below_deg_s, left.within_s) == (0.2, 900.0)
    assert left.attitude_error_below_deg is None
    part = walk("detumbling", given, MissionRequest(tip_off_deg_s=2.0, runs=2))
    assert "not designed" not in part.words and "releases stay below" in part.words


def test_causes_that_limit_together_alone_are_named():
    """A PocketQube at 300 km: air or dipole alone turn it over."""
    none, names = Flown(0, 16, 130.0), ("air and light", "residual dipole")
    answer = SimpleNamespace(lines=list, data=dict)
    for flown, said in ((Flown(16, 16, 0.0), f"; what limits together: {', '.join(names)}"),
                        (none, "")):  # fmt: skip
        failure = Failure("it", "error", "deg", none, dict.fromkeys(names, none), (names, flown))
        part = _of(answer, "it holds 0 of 2 starts", failure, (), ())
        assert (part.state, part.words) == (FAILS, f"it holds 0 of 2 starts{said}")
