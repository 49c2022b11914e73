"""What the checker finds, and that its bounds hold in flight."""

import functools
import operator

import numpy as np
import pytest
from flown_modes import Flown, Z, reading, spinning, two_states
from hypothesis import given, settings, strategies as st

from torquer.computer.modes.check import findings
from torquer.computer.modes.cycles import _back, endless, greatest_rate
from torquer.computer.modes.explore import Sight, Step
from torquer.computer.modes.finding import Facts
from torquer.computer.modes.graph import components, find_edges, reachable
from torquer.computer.modes.spec import Modes, Region

FAST, SLOW = {"signal": "rate_deg_s", "above": 0.7}, {"signal": "rate_deg_s", "below": 0.5}
AWAY = {"signal": "axis_to_sun_deg", "above": 160.0}


def found(**keys):
    return {(x.kind, x.states): x.message for x in findings(Modes(**keys))}


def there_and_back(there, back):
    a, b = {"transitions": [{"to": "b", **there}]}, {"transitions": [{"to": "a", **back}]}
    return {"a": a, "b": b}


def test_a_sound_table_has_no_faults():
    keys = two_states(when=SLOW)
    assert found(**keys) == {}


def test_a_state_that_nothing_leads_to_is_found():
    c = {"transitions": [{"to": "d", "when": SLOW}]}
    states = {**two_states(when=SLOW)["states"], "c": c, "d": {"final": True}}
    assert [*found(states=states)] == [("unreachable", ("c",)), ("unreachable", ("d",))]
    ways = [{"to": "c", "when": FAST}]
    assert {kind for kind, _ in found(states=states, transitions=ways)} == {"hysteresis"}


def test_a_commanded_state_is_reachable_and_needs_no_way_out():
    """What follows from it is explored too: here, a second region that waits for it."""
    states = {**there_and_back({"when": SLOW}, {"when": FAST}), "c": {"commanded": True}}
    follow = {"signal": "in_state", "state": "c", "region": "main", "above": 0.5}
    other = {"x": {"transitions": [{"to": "y", "when": follow}]}, "y": {"final": True}}
    modes = {"regions": {"main": {"states": states}, "other": {"states": other}}}
    assert {kind for kind, _ in found(**modes)} == {"hysteresis"}
    del states["c"]["commanded"]
    assert {"unreachable", "deadlock"} <= {kind for kind, _ in found(**modes)}


def test_coils_and_flags_are_looked_at_one_by_one():
    """Conditions on two of them are no contradiction; two on the same one are."""
    for signal, key, names in (("flag", "flag", "ab"), ("coil_suspected", "coil", "xy")):
        for first, second, contradicts in ((0, 1, False), (0, 0, True)):
            when = [
                {"signal": signal, key: names[first], "above": 0.5},
                {"signal": signal, key: names[second], "below": 0.5},
            ]
            keys = {
                "flags": ["a", "b"],
                "inertia_kg_m2": [1, 1, 1],
                "noise": {
                    "magnetometer_noise_nt": 1,
                    "sun_noise_deg": 1,
                    "gyro_noise_deg_s": 1,
                    "rate_tolerance_deg_s": 1,
                },
            }
            kinds = {kind for kind, _ in found(**two_states(when=when), **keys)}
            assert ("never" in kinds) == contradicts, (signal, first, second)  # fmt: skip


def test_state_without_exit_is_a_trap_unless_final():
    states = {"a": {"transitions": [{"to": "b", "when": SLOW}]}, "b": {}}
    assert [*found(states=states)] == [("trap", ("b",))]
    states["b"] = {"transitions": [{"to": "b", "at_most_s": 5.0}]}
    assert ("trap", ("b",)) in found(states=states)
    safe = [{"to": "a", "when": FAST, "for_s": 9.0}]
    assert ("trap", ("b",)) not in found(states=states, transitions=safe)
    assert found(states={"only": {"laws": ["bdot"]}}) == {}


def test_a_state_must_not_wait_for_what_may_stay_unknown():
    waits = ("waits for the unknown", ("a",))
    for way, expected in (
        ({"when": AWAY}, True), ({"when": [AWAY, SLOW]}, True), ({"when": SLOW}, False),
        ({"when": AWAY, "at_most_s": 9.0}, False),
    ):  # fmt: skip
        assert (waits in found(axis=Z, **two_states(**way))) == expected, way
    ways = [{"to": "b", "when": AWAY}, {"to": "b", "when": SLOW}]
    states = {"a": {"transitions": ways}, "b": {"final": True}}
    assert waits not in found(axis=Z, states=states)


def test_thresholds_that_leave_no_gap_chatter():
    for high, low, kind in (
        (0.7, 0.5, "hysteresis"), (0.7, 0.7, "chatter"), (0.5, 0.7, "chatter"),
    ):  # fmt: skip
        there, back = ({"when": {"signal": "rate_deg_s", **side}} for side in
                       ({"above": high}, {"below": low}))  # fmt: skip
        assert [*found(states=there_and_back(there, back))] == [(kind, ("a", "b"))]


def test_a_condition_that_stays_true_narrows_the_gap():
    """True above 0.7 until below 0.3, it may fire at 0.4, where the way back is open."""
    held, other = {**FAST, "back_below": 0.3}, {"signal": "sun_in_view", "above": 0.5}
    back = {"when": SLOW}
    for there, kind in ((held, "hysteresis"), ([held, other], "chatter")):
        assert [*found(states=there_and_back({"when": there}, back))] == [(kind, ("a", "b"))]


def test_times_around_a_cycle_bound_the_switching_rate():
    there, back = {"when": FAST, "for_s": 20.0}, {"when": FAST, "at_least_s": 50.0, "for_s": 10.0}
    message = found(states=there_and_back(there, back))["switching rate", ("a", "b")]
    assert message == (
        "main: a -> b -> a takes at least 70 s: at most 103 switches per hour on average"
    )
    back = {"when": FAST, "for_s": 90.0, "at_most_s": 40.0}
    message = found(states=there_and_back(there, back))["switching rate", ("a", "b")]
    assert "at least 60 s" in message


def test_cycle_following_another_region_is_as_slow_as_it():
    inside = {"signal": "in_state", "state": "b"}
    follower = {
        "c": {"transitions": [{"to": "d", "when": {**inside, "above": 0.5}}]},
        "d": {"transitions": [{"to": "c", "when": {**inside, "below": 0.5}}]},
    }
    for times, expected in (({"at_least_s": 30.0}, ["switching rate"] * 2), ({}, ["chatter"])):
        leader = there_and_back({"when": FAST}, {"when": FAST, **times})
        regions = {"x": {"states": leader}, "y": {"states": follower}}
        assert [kind for kind, _ in found(regions=regions)] == expected


def two_regions(one, two, **way):
    """Regions `x` and `y`, each of an idle state and one that does something."""

    def region(name, does):
        idle = {"transitions": [{"to": name, "when": FAST}]}
        active = {**does, "transitions": [{"to": f"{name}_idle", "when": SLOW}]}
        return {"states": {f"{name}_idle": idle, name: active}}

    return {"regions": {"x": region("a", one), "y": region("b", two)}}


@pytest.mark.parametrize(
    ("one", "two", "what"),
    [
        ({"coils": "on"}, {"coils": "off"}, "set the coils on and off"),
        ({"wheels": "on"}, {"wheels": "off"}, "set the wheels on and off"),
        ({"estimator": "triad"}, {"estimator": "kalman"}, "set different estimators"),
        ({"set": {"bdot.gain": 1.0}}, {"set": {"bdot.gain": 2.0}}, "set bdot.gain to different"),
        ({"coils": "on"}, {"coils": "on"}, None),
        ({"coils": "on"}, {"wheels": "off"}, None),
        ({"set": {"bdot.gain": 1.0}}, {"set": {"sdot.gain": 2.0}}, None),
    ],
)
def test_states_side_by_side_must_not_contradict(one, two, what):
    conflicts = [x for x in findings(Modes(**two_regions(one, two))) if x.kind == "conflict"]
    assert len(conflicts) == (what is not None)
    assert all(what in x.message and x.states == ("a", "b") for x in conflicts)


def test_states_that_exclude_each_other_do_not_contradict():
    """`b` is entered only while the other region is past `a`, for good."""
    past = {"signal": "in_state", "state": "past", "above": 0.5}
    one = {
        "a": {"coils": "on", "transitions": [{"to": "past", "when": SLOW}]},
        "past": {"final": True},
    }
    for when, expected in (([FAST, past], []), ([FAST], [("a", "b")])):
        idle = {"transitions": [{"to": "b", "when": when}]}
        two = {"idle": idle, "b": {"coils": "off", "final": True}}
        modes = Modes(regions={"x": {"states": one}, "y": {"states": two}})
        assert [x.states for x in findings(modes) if x.kind == "conflict"] == expected
        (view,) = Sight(modes, Facts()).together
        assert (("a", "b") in view.joints) == bool(expected)


def test_states_that_one_signal_keeps_apart_do_not_contradict():
    """One is left above 0.6 deg/s at once, the other below 0.8."""
    one = there_and_back(
        {"when": {"signal": "rate_deg_s", "above": 0.8}},
        {"when": {"signal": "rate_deg_s", "below": 0.8}},
    )
    for low, expected in ((0.6, []), (0.9, [("b", "d")])):
        two = {
            "c": {"transitions": [{"to": "d", "when": {"signal": "rate_deg_s", "below": 0.5}}]},
            "d": {
                "transitions": [{"to": "c", "when": {"signal": "rate_deg_s", "above": low}}],
                "coils": "on",
            },
        }
        one["b"]["coils"] = "off"
        modes = Modes(regions={"x": {"states": one}, "y": {"states": two}})
        assert [x.states for x in findings(modes) if x.kind == "conflict"] == expected


def test_too_many_combinations_are_explored_in_pairs():
    """Six regions of six states: 46656 combinations; the conflict is between the first and last."""
    names = [f"r{k}" for k in range(6)]
    regions = {}
    for r in names:
        ways = [{"to": f"{r}_{k}", "when": SLOW, "for_s": 60.0 + k} for k in reversed(range(6))]
        regions[r] = {"states": {f"{r}_{k}": {} for k in range(6)}, "transitions": ways}
    regions["r0"]["states"]["r0_3"]["coils"] = "on"
    regions["r5"]["states"]["r5_4"]["coils"] = "off"
    kinds = {x.kind: x for x in findings(Modes(regions=regions))}
    assert kinds["conflict"].states == ("r0_3", "r5_4")
    assert kinds["bound"].message.endswith("explored in pairs of regions")


THRESHOLDS = st.sampled_from([0.3, 0.5, 0.7])
conditions = st.one_of(
    st.builds(lambda x: {"signal": "rate_deg_s", "above": x}, THRESHOLDS),
    st.builds(lambda x: {"signal": "rate_deg_s", "below": x}, THRESHOLDS),
    st.builds(lambda x: {"signal": "axis_to_sun_deg", "above": 100 * x}, THRESHOLDS),
    st.just({"signal": "time_in_state_s", "above": 3.0}),
)
TIMES = st.sampled_from([0.0, 1.0, 4.0])


def a_transition(names):
    return st.builds(
        lambda to, when, for_s, times: {"to": to, "when": when, "for_s": for_s, **times},
        st.sampled_from(names), st.lists(conditions, min_size=1, max_size=2), TIMES,
        st.fixed_dictionaries({}, optional={
            "at_least_s": st.sampled_from([1.0, 5.0]), "at_most_s": st.sampled_from([2.0, 6.0]),
        }),
    )  # fmt: skip


@st.composite
def regions(draw):
    names = "abcd"[: draw(st.integers(2, 4))]
    ways = st.lists(a_transition(names), max_size=2)
    states = {name: {"transitions": draw(ways)} for name in names}
    return {"states": states, "transitions": draw(st.lists(a_transition(names), max_size=1))}


def flight(seed, count=150, step_s=0.5):
    rng = np.random.default_rng(seed)
    suns = np.array([Z, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)])[rng.integers(0, 3, count)]
    held = np.repeat(rng.uniform(0.2, 0.8, count), rng.integers(1, 12, count))[:count]
    return [
        reading(i * step_s, sun=sun, **spinning(rate))
        for i, (sun, rate) in enumerate(zip(suns, held, strict=True))
    ]


@settings(deadline=None, max_examples=80, derandomize=True)
@given(regions(), st.integers(0, 10**6))
def test_flights_respect_unreachable_states_and_the_switching_bound(keys, seed):
    """A walk is cycles and a path that passes no state twice."""
    flown, rows = Flown(axis=Z, **keys), flight(seed)
    entered = [(rows[i].t_s, flown.now[0]) for i, x in enumerate(rows) if flown(x)]
    region = Region(**keys)
    known = reachable(region)
    assert {name for _, name in entered} <= set(known)
    rate = switching_rate(flown.modes)
    longest = rows[-1].t_s - rows[0].t_s
    assert len(entered) - 1 <= rate * longest * (1.0 + 1e-5) + 2 * len(known) - 1


def switching_rate(modes, step_s=0.5):
    """The greatest rate of a table of one region [1/s], by times alone."""
    sight = Sight(modes, Facts(step_s=step_s))
    (name,) = modes.regions
    view = sight.alone(name)
    rates = [greatest_rate(sight, view, name, each)[0] for each in endless(sight, name)]
    return max(rates, default=0.0)


def test_least_time_is_met_to_one_control_step_per_state():
    """The hold time of a transition from any state runs since the state it leads to was left."""
    states = {
        "a": {"transitions": [{"to": "b", "at_least_s": 3.0}]},
        "b": {"transitions": [{"to": "c", "at_least_s": 3.0}]},
        "c": {},
    }
    flown = Flown(states=states, transitions=[{"to": "a", "when": SLOW, "for_s": 4.0}])
    step_s = 0.01
    found = flown.states(reading(i * step_s, **spinning(0.1)) for i in range(3000))
    begins = [i * step_s for i in range(1, 3000) if found[i] == "a" != found[i - 1]]
    assert switching_rate(flown.modes, 0.0) == pytest.approx(3 / 7.0)
    assert all(7.0 <= x <= 7.0 + 3 * step_s for x in np.diff(begins)) and len(begins) == 4


def test_hold_times_from_any_state_bound_frequency_not_delay():
    """Several may be due at once, one after the other, but each once in 60 s."""
    ways = [{"to": name, "when": SLOW, "for_s": 60.0} for name in "abc"]
    modes = Modes(states={name: {} for name in "abc"}, transitions=ways)
    assert switching_rate(modes, 1.0) == pytest.approx(3 / 61.0)
    flown = Flown(modes)
    found = flown.states(reading(float(t), **spinning(0.1)) for t in range(1000))
    switched = [t for t in range(1, 1000) if found[t] != found[t - 1]]
    assert 1 in np.diff(switched) and len(switched) <= 3 * 1000.0 / 61.0


def test_components_hold_each_edge_once():
    """Of the complete graph of four states and a loop of its own."""
    ways = [{"to": name, "when": FAST} for name in "abcd"]
    region = Region(states={name: {} for name in "abcd"}, transitions=ways)
    assert [len(part) for part in components(find_edges(region))] == [12]
    loop = Region(states={"a": {"transitions": [{"to": "a", "when": FAST}]}})
    assert [len(part) for part in components(find_edges(loop))] == [1]
    chain = Region(states=two_states(when=SLOW)["states"])
    assert components(find_edges(chain)) == []


def test_a_cycle_holds_at_one_valuation_from_end_to_end():
    """The shortest way back changes valuations on the way; of the others each keeps to one."""
    one, other = 1, 2
    ways = [((1, 2), one), ((2, 0), other)]
    ways += [((1, 3), one), ((3, 4), one), ((4, 0), one)]
    ways += [((1, 5), other), ((5, 6), other), ((6, 0), other)]
    quick = [(Step(start, end, ()), mask) for (start, end), mask in ways]
    first, *back = _back(quick, Step(0, 1, ()), one | other)
    assert (first.start, first.end, back[-1].end) == (0, 1, 0)
    masks = dict(quick)
    assert functools.reduce(operator.and_, [masks[step] for step in back]) != 0
