"""Switching: three-valued conditions, hold times, hysteresis, regions, checkpoints."""

import itertools
import math

import numpy as np
import pytest
from flown_modes import Flown, Z, reading, spinning, two_states

from torquer.compile import engine
from torquer.computer.modes.table import ModeState, switch_modes

SLOW = {"signal": "rate_deg_s", "below": 1.0}
AWAY = {"signal": "axis_to_sun_deg", "above": 160.0}


def letters(found):
    return "".join(found)


def rates(deg_s, step_s=1.0):
    return [reading(i * step_s, **spinning(x)) for i, x in enumerate(deg_s)]


def test_first_evaluation_enters_initial_states_without_checking_conditions():
    flown = Flown(**two_states(when=SLOW))
    assert flown(reading(5.0, **spinning(0.1))) and flown.now == ["a"]
    assert flown.state.regions["since_s"].tolist() == [5.0]
    assert flown(reading(6.0, **spinning(0.1))) and flown.now == ["b"]
    assert not flown(reading(7.0, **spinning(0.1)))


def test_conditions_must_hold_without_a_break():
    flown = Flown(**two_states(when=SLOW, for_s=3.0))
    found = flown.states(rates([0.1, 0.1, 0.1, 0.1, 9.0, 0.1, 0.1, 0.1, 0.1, 0.1]))
    assert letters(found) == "aaaaaaaabb"
    assert flown.state.states["entered_s"].tolist() == [0.0, 8.0]


def test_unknown_stops_the_hold_time_and_does_not_reset_it():
    """In the shadow no Sun sensor tells the angle: the time in the light alone counts."""
    flown = Flown(axis=Z, **two_states(when=AWAY, for_s=4.0))
    anti, unseen = (0.0, 0.0, -1.0), (0.0, 0.0, 0.0)
    suns = [anti, anti, anti, unseen, unseen, unseen, anti, anti, anti]
    assert letters(flown.states([reading(t, sun=s) for t, s in enumerate(suns)])) == "aaaaaaaab"
    suns[4] = Z
    flown = Flown(axis=Z, **two_states(when=AWAY, for_s=4.0))
    assert letters(flown.states([reading(t, sun=s) for t, s in enumerate(suns)])) == "aaaaaaaaa"


def test_one_false_condition_outweighs_an_unknown_one():
    anti, unseen = (0.0, 0.0, -1.0), (0.0, 0.0, 0.0)
    readings = [(anti, 0.1), (anti, 0.1), (anti, 0.1), (unseen, 9.0), (anti, 0.1), (anti, 0.1)]
    for for_s, expected in ((2.0, "aaaaaa"), (1.0, "aabbbb")):
        flown = Flown(axis=Z, **two_states(when=[AWAY, SLOW], for_s=for_s))
        rows = [reading(t, sun=s, **spinning(w)) for t, (s, w) in enumerate(readings)]
        assert letters(flown.states(rows)) == expected


def test_a_transition_does_not_fire_on_what_is_unknown():
    flown = Flown(axis=Z, **two_states(when=AWAY, at_least_s=3.0))
    anti, unseen = (0.0, 0.0, -1.0), (0.0, 0.0, 0.0)
    suns = [anti, anti, anti, unseen, unseen, anti]
    assert letters(flown.states([reading(t, sun=s) for t, s in enumerate(suns)])) == "aaaaab"


def test_hysteresis_keeps_a_condition_true_until_the_signal_is_beyond():
    fast = {"signal": "rate_deg_s", "above": 0.7, "back_below": 0.5}
    readings = rates([0.6, 0.6, 0.8, 0.6, 0.55, 0.5001, 0.6, 0.6, 0.6])
    assert letters(Flown(**two_states(when=fast, for_s=4.0)).states(readings)) == "aaaaaabbb"
    readings[4] = reading(4.0, **spinning(0.49))
    assert letters(Flown(**two_states(when=fast, for_s=4.0)).states(readings)) == "a" * 9
    slow = {"signal": "rate_deg_s", "below": 0.5, "back_above": 0.7}
    readings = rates([0.4, 0.4, 0.6, 0.69, 0.69, 0.69])
    assert letters(Flown(**two_states(when=slow, for_s=3.0)).states(readings)) == "aaaabb"


def test_condition_sees_the_change_since_its_state_was_entered():
    """From the first known value in the state on; entering the state once more restarts it."""
    grown = {"signal": "rate_deg_s", "above": 1.0, "since_entry": True}
    assert (
        letters(Flown(**two_states(when=grown)).states(rates([9, 5, 4, 5.9, 6.1, 6]))) == "aaaabb"
    )
    again = {"states": {"a": {"transitions": [
        {"to": "b", "when": grown}, {"to": "a", "at_most_s": 3.0}]}, "b": {}}}  # fmt: skip
    slow_growth = [1.0 + 0.3 * t for t in range(9)]
    assert letters(Flown(**again).states(rates(slow_growth))) == "a" * 9
    assert letters(Flown(**two_states(when=grown)).states(rates(slow_growth))) == "aaaaabbbb"


def test_a_state_has_its_least_and_its_greatest_length():
    never, always = {"signal": "rate_deg_s", "above": 1e3}, {"signal": "rate_deg_s", "below": 1e3}
    for keys, ends in (
        ({"when": always, "at_least_s": 4.0}, 4), ({"when": never, "at_most_s": 5.0}, 5),
        ({"at_least_s": 2.0, "at_most_s": 6.0}, 2), ({"at_most_s": 3.0}, 3),
        ({"when": always, "for_s": 2.0, "at_least_s": 3.0}, 3), ({"when": always, "for_s": 2.0}, 3),
        ({"when": always}, 1),
    ):  # fmt: skip
        found = Flown(**two_states(**keys)).states(rates([1.0] * 8))
        assert letters(found) == "a" * ends + "b" * (8 - ends), keys


def test_rounding_of_times_costs_no_reading():
    timed = {"to": "b", "at_most_s": 0.3}, {"to": "a", "at_most_s": 0.3}
    states = {"a": {"transitions": [timed[0]]}, "b": {"transitions": [timed[1]]}}
    found = Flown(states=states).states([reading(0.7 + i * 0.1) for i in range(27)])
    assert letters(found) == ("aaabbb" * 5)[:27]
    since = {"signal": "time_in_state_s", "above": 0.3}
    found = Flown(**two_states(when=since)).states([reading(0.7 + i * 0.1) for i in range(6)])
    assert letters(found) == "aaabbb"


def test_transitions_are_tried_in_order():
    first, second = {"to": "b", "when": SLOW}, {"to": "c", "when": SLOW}
    for ways, expected in (([first, second], "abb"), ([second, first], "acc")):
        states = {"a": {"transitions": ways}, "b": {}, "c": {}}
        assert letters(Flown(states=states).states(rates([0.1] * 3))) == expected
    states = {"a": {"transitions": [first]}, "b": {}, "c": {}}
    assert letters(Flown(states=states, transitions=[second]).states(rates([0.1] * 3))) == "acc"


def test_leaving_a_state_resets_its_timers():
    back = {"to": "a", "at_most_s": 2.0}
    ways = [{"to": "c", "when": SLOW, "for_s": 5.0}, {"to": "b", "at_most_s": 3.0}]
    states = {"a": {"transitions": ways}, "b": {"transitions": [back]}, "c": {}}
    found = Flown(states=states).states(rates([0.1] * 18))
    assert letters(found) == "aaabbaaabbaaabbaaa"


def test_timers_of_transitions_from_any_state_go_on():
    back = {"to": "a", "at_most_s": 2.0}
    away = {"to": "b", "at_most_s": 3.0}
    states = {"a": {"transitions": [away]}, "b": {"transitions": [back]}, "c": {}}
    safe = {"to": "c", "when": SLOW, "for_s": 5.0}
    found = Flown(states=states, transitions=[safe]).states(rates([9.0] + [0.1] * 8))
    assert letters(found) == "aaabbaccc"


def test_any_state_transition_pauses_in_its_target_and_then_restarts():
    states = {"a": {}, "b": {"transitions": [{"to": "a", "at_most_s": 3.0}]}}
    flown = Flown(states=states, transitions=[{"to": "b", "when": SLOW, "for_s": 2.0}])
    assert letters(flown.states(rates([0.1] * 14))) == "aaabbbaaabbbaa"
    assert flown.state.states["entries"].tolist() == [3.0, 2.0]


def test_a_state_that_leads_to_itself_begins_again():
    states = {"a": {"transitions": [{"to": "a", "at_most_s": 2.0}]}}
    flown = Flown(states=states)
    flown.states(rates([0.1] * 7))
    assert flown.state.states["entries"].tolist() == [4.0]
    assert flown.state.regions["since_s"].tolist() == [6.0]


def test_regions_see_each_other_as_they_were_before_the_evaluation():
    """Two that change places whenever the other is in its second state."""

    def region(this, other):
        to_second = {"to": this + "2", "when": {"signal": "in_state", "state": other, "above": 0.5}}
        to_first = {"to": this + "1", "when": {"signal": "in_state", "state": other, "below": 0.5}}
        states = {this + "1": {"transitions": [to_second]}, this + "2": {"transitions": [to_first]}}
        return states

    left = {"states": region("a", "b2"), "initial": "a2"}
    flown = Flown(regions={"left": left, "right": {"states": region("b", "a2")}})
    found = []
    for t in range(5):
        flown(reading(t))
        found.append(flown.now)
    assert found == [["a2", "b1"], ["a1", "b2"], ["a2", "b1"], ["a1", "b2"], ["a2", "b1"]]


def test_entries_are_counted():
    attempt = {"signal": "entries", "state": "b", "above": 2.5}
    states = {
        "a": {"transitions": [{"to": "c", "when": attempt}, {"to": "b", "at_most_s": 1.0}]},
        "b": {"transitions": [{"to": "a", "at_most_s": 1.0}]},
        "c": {"final": True},
    }
    assert letters(Flown(states=states).states(rates([0.1] * 9))) == "abababacc"


CYCLE = {
    "axis": Z,
    "states": {
        "a": {"transitions": [{"to": "b", "when": [AWAY], "for_s": 3.0}]},
        "b": {"transitions": [
            {"to": "a", "when": {"signal": "rate_deg_s", "above": 5.0, "back_below": 3.0},
             "for_s": 2.0},
            {"to": "a", "when": SLOW, "at_most_s": 20.0},
        ]},
    },
    "transitions": [{"to": "b", "when": {"signal": "field_nt", "below": 100.0}, "for_s": 4.0}],
}  # fmt: skip


def some_readings(count, seed=3):
    rng = np.random.default_rng(seed)
    anti, unseen, to_it = (0.0, 0.0, -1.0), (0.0, 0.0, 0.0), Z
    seen = rng.choice(3, count, p=[0.7, 0.2, 0.1])
    return [
        reading(t, sun=(anti, unseen, to_it)[s], b=(w * 1e-8, 0.0, 0.0), **spinning(w))
        for t, s, w in zip(range(count), seen, rng.uniform(0.5, 14.0, count), strict=True)
    ]


def test_a_copied_state_goes_on_alike():
    whole, part, rows = Flown(**CYCLE), Flown(**CYCLE), some_readings(300)
    expected = whole.states(rows)
    assert expected.count("b") > 20 and "ab" in letters(expected) and "ba" in letters(expected)
    for stop in (1, 57, 133):
        part = Flown(**CYCLE)
        part.states(rows[:stop])
        again = Flown(**CYCLE)
        again.state = ModeState(*(records.copy() for records in part.state))
        assert again.states(rows[stop:]) == expected[stop:]
        for gone_on, flown in zip(again.state, whole.state, strict=True):
            assert gone_on.tobytes() == flown.tobytes()


@pytest.mark.skipif(not engine.COMPILED, reason="counts what the compiler made")
def test_one_compiled_function_serves_every_table():
    for keys in (CYCLE, two_states(at_most_s=3.0), {"states": {"only": {}}}):
        Flown(**keys)(reading(0.0))
    assert len(switch_modes.signatures) == 1


def test_a_table_of_one_state_does_nothing():
    flown = Flown(states={"only": {"final": True}})
    assert [flown(reading(t)) for t in range(3)] == [True, False, False]
    assert math.isinf(flown.state.clock["evaluated_s"][0]) is False


RETRY = {
    "working": {"transitions": [{"to": "tripped", "when": {"signal": "rate_deg_s", "above": 1.0}}]},
    "tripped": {"transitions": [{"to": "working", "at_least_s": 10.0, "back_off": 2.0,
                                 "most_entries": 3}]},
}  # fmt: skip


def test_pauses_between_attempts_grow_and_attempts_are_counted():
    """Always too fast: 10, 20 and 40 s in the tripped state, then for ever."""
    flown = Flown(states=RETRY)
    found = flown.states(rates([9.0] * 200))
    lengths = [len(list(group)) for state, group in itertools.groupby(found) if state == "tripped"]
    assert lengths[:3] == [10, 20, 40] and len(lengths) == 4 and found[-1] == "tripped"


def test_an_attempt_that_succeeds_lasts():
    flown = Flown(states=RETRY)
    found = flown.states(rates([9.0] * 5 + [0.5] * 100))
    assert found.count("tripped") == 10 and found[-1] == "working"


def test_a_time_limit_grows_in_the_same_way():
    states = {"a": {"transitions": [{"to": "b", "at_most_s": 2.0, "back_off": 3.0}]},
              "b": {"transitions": [{"to": "a", "at_most_s": 1.0}]}}  # fmt: skip
    assert letters(Flown(states=states).states(rates([0.0] * 30)))[:29] == (
        "aab" + "aaaaaab" + "a" * 18 + "b"
    )


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"back_off": 0.5, "at_least_s": 1.0}, r"back_off: must be greater than or equal to 1"),
        ({"back_off": 2.0, "when": {"signal": "rate_deg_s", "above": 1.0}},
         "back_off: must be given with at_least_s or at_most_s.*received 2 alone"),
        ({"most_entries": 0, "at_least_s": 1.0},
         "most_entries: must be greater than or equal to 1"),
    ],
)  # fmt: skip
def test_attempts_are_checked(keys, message):
    with pytest.raises(ValueError, match=message):
        Flown(**two_states(**keys))


def test_only_a_states_own_transitions_count_its_attempts():
    any_state = [{"to": "a", "at_least_s": 1.0, "most_entries": 2}]
    with pytest.raises(ValueError, match=r"transitions\[0\]: back_off and most_entries must stand"):
        Flown(states={"a": {}}, transitions=any_state)
