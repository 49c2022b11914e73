"""What the checker of mode tables rules out never happens: against trying everything out."""

import functools
import math

import numpy as np
from flown_modes import Flown, Z, reading, spinning
from hypothesis import example, given, settings, strategies as st
from modes_twin import Twin, tried

from torquer.computer.modes.check import all_faults
from torquer.computer.modes.explore import Sight
from torquer.computer.modes.finding import Facts
from torquer.computer.modes.spec import Modes

RATES = (0.3, 0.5, 0.7)
#: On, between and beyond the thresholds.
VALUES = {"rate_deg_s": (0.1, 0.4, 0.5, 0.6, 0.8, math.nan), "sun_in_view": (0.0, 1.0)}
TIME = ("time_in_state_s",)
STATES = {"x": "abc", "y": "def"}


def _with_hysteresis(x, gap):
    return {"signal": "rate_deg_s", "above": x, "back_below": x - gap}


def conditions(other):
    """Conditions on signals, on the time and on the states of the other region."""
    return st.one_of(
        st.builds(lambda x: {"signal": "rate_deg_s", "above": x}, st.sampled_from(RATES)),
        st.builds(lambda x: {"signal": "rate_deg_s", "below": x}, st.sampled_from(RATES)),
        st.builds(_with_hysteresis, st.sampled_from(RATES), st.just(0.2)),
        st.sampled_from([
            {"signal": "sun_in_view", "above": 0.5}, {"signal": "sun_in_view", "below": 0.5},
            {"signal": "time_in_state_s", "above": 2.0},
            *({"signal": "in_state", "state": s, "above": 0.5} for s in other),
            *({"signal": "in_state", "state": s, "below": 0.5} for s in other),
        ]),
    )  # fmt: skip


TIMES = st.fixed_dictionaries(
    {},
    optional={
        "for_s": st.sampled_from([1.0, 2.0]),
        "at_least_s": st.sampled_from([1.0, 3.0]),
        "at_most_s": st.sampled_from([2.0, 4.0]),
    },
)


def transitions(own, other, times):
    return st.builds(
        lambda to, when, times: {"to": to, "when": when, **times},
        st.sampled_from(own), st.lists(conditions(other), min_size=1, max_size=2), times,
    )  # fmt: skip


@st.composite
def tables(draw, times=TIMES):
    """Two regions, of which each may follow the other."""
    regions = {}
    for name, other in (("x", "y"), ("y", "x")):
        own = STATES[name][: draw(st.integers(2, 3))]
        one = transitions(own, STATES[other][:2], times)
        states = {s: {"transitions": draw(st.lists(one, min_size=1, max_size=2))} for s in own}
        states[own[0]]["laws"] = ["bdot"]
        states[own[1]]["coils"] = "off"
        ways = st.lists(one, max_size=1) if draw(st.booleans()) else st.just([])
        regions[name] = {"states": states, "transitions": draw(ways)}
    return {"regions": regions}


@st.composite
def priorities(draw):
    """A region that says a lot of one signal: which of its transitions can be taken at all?"""
    rate = [{"signal": "rate_deg_s", side: x} for side in ("above", "below") for x in RATES]
    rate += [_with_hysteresis(x, 0.2) for x in RATES]

    def ways(*to):
        return st.builds(
            lambda to, when, times: {"to": to, "when": when, **times},
            st.sampled_from(to), st.lists(st.sampled_from(rate), min_size=1, max_size=2), TIMES,
        )  # fmt: skip

    states = {
        "a": {"transitions": draw(st.lists(ways("b", "c"), min_size=1, max_size=3))},
        "b": {"transitions": draw(st.lists(ways("a", "c"), min_size=1, max_size=1))},
        "c": {"transitions": draw(st.lists(ways("a"), min_size=1, max_size=1))},
    }
    any_state = draw(st.lists(ways("b", "c"), max_size=2))
    return {"regions": {"x": {"states": states, "transitions": any_state}}}


def rate(to, more=None, **keys):
    """A transition on the rate."""
    return {"to": to, "when": {"signal": "rate_deg_s", **keys}, **(more or {})}


def region(a=(), b=(), c=(), from_any=()):
    """One region of three states, with transitions out of each and out of any."""
    states = {name: {"transitions": [*ways]} for name, ways in zip("abc", (a, b, c), strict=True)}
    return {"regions": {"x": {"states": states, "transitions": [*from_any]}}}


SUNNY = {"signal": "sun_in_view", "above": 0.5}
#: Transitions that are taken though an earlier one is weaker: it waits for longer, it began later,
#: or only this one is still true by its hysteresis.
WEAKER_FIRST = (
    region(a=[rate("b", {"for_s": 2.0}, above=0.3), rate("c", above=0.5)]),
    region(a=[rate("b", {"for_s": 2.0}, above=0.3), rate("c", {"for_s": 1.0}, above=0.5)]),
    region(
        a=[{"to": "c", "when": SUNNY}],
        from_any=[rate(to, {"for_s": 2.0}, above=0.3) for to in "ab"],
    ),
    region(
        from_any=[
            {"to": "b", "when": SUNNY},
            rate("a", above=0.5),
            rate("c", above=0.5, back_below=0.3),
        ]
    ),
)


def on_each(tables):
    """The test on these tables, besides random ones."""
    return lambda test: functools.reduce(lambda f, table: example(table)(f), tables, test)


OFF = {STATES["x"][1], STATES["y"][1]}
FACTS = Facts(step_s=1.0, drives={"bdot": frozenset({"coils"})})
QUICK = settings(deadline=None, max_examples=80, derandomize=True)


def dead_in(sight, name):
    """(region, state, place in the text) of the transitions that are never taken."""
    region = sight.modes.regions[name]
    listed = [*region.transitions, *(t for s in region.states.values() for t in s.transitions)]
    place = {id(one): k for k, one in enumerate(listed)}
    return {
        (name, edge.leave, place[id(edge.transition)])
        for edge in sight.edges[name]
        if (name, edge.number) in sight.dead
    }


@QUICK
@on_each(WEAKER_FIRST)
@given(st.one_of(tables(), priorities(), priorities()))
def test_what_is_ruled_out_never_happens(table):
    """Combinations of states and steps between them; transitions; what findings say."""
    modes = Modes.model_validate(table)
    asked = {c.signal for _, c in modes.all_conditions()}
    values = {name: each for name, each in VALUES.items() if name in asked}
    if (truth := tried(modes, values)) is None:
        return
    sight = Sight(modes, FACTS)
    found = list(all_faults(sight))
    (view,) = sight.together
    steps = {(view.joints[step.start], view.joints[step.end]) for step in view.steps}
    assert truth.joints <= {*view.joints}
    assert {pair for pair in truth.steps if pair[0] != pair[1]} <= steps
    for name in modes.regions:
        assert not truth.taken & dead_in(sight, name)
    for each in found:
        check(each, truth, [*modes.regions])


def check(each, truth, names):
    """What a finding says of all that happens."""
    if each.kind not in ("unreachable", "deadlock", "no effect"):
        return
    places = [(names.index(region), state) for region, state in each.places]
    there = {j for j in truth.joints if all(j[k] == state for k, state in places)}
    if each.kind == "unreachable":
        assert not there
    if "wait for each other" in each.message:
        assert all(after in there for before, after in truth.steps if before in there)
    if "never acts" in each.message:
        assert all(OFF & {*joint} for joint in there)


@settings(deadline=None, max_examples=25, derandomize=True)
@given(tables(st.just({})))
def test_without_times_exactly_that_is_found_which_happens(table):
    """Nothing is lost by representative values, order and following: a shared signal is one."""
    for region in table["regions"].values():
        own = (way for state in region["states"].values() for way in state["transitions"])
        for way in (*region["transitions"], *own):
            plain = [c for c in way["when"] if not {"back_below", *TIME} & {*c, c["signal"]}]
            way["when"] = plain or [{"signal": "sun_in_view", "above": 0.5}]
    modes = Modes.model_validate(table)
    truth = tried(modes, {**VALUES, "rate_deg_s": (0.1, 0.3, *VALUES["rate_deg_s"], 0.7)})
    (view,) = Sight(modes, FACTS).together
    assert {*view.joints} == truth.joints


@settings(deadline=None, max_examples=30, derandomize=True)
@given(tables(), st.integers(0, 10**6))
def test_the_twin_flies_as_the_computer_does(table, seed):
    modes = Modes.model_validate(table)
    flown, twin = Flown(modes), Twin(modes)
    rng, moment = np.random.default_rng(seed), twin.first()
    flown(reading(0.0))
    for t_s in range(1, 40):
        values = {name: rng.choice(choice) for name, choice in VALUES.items()}
        moment, _ = twin.after(moment, values)
        sun = Z if values["sun_in_view"] else (0.0, 0.0, 0.0)
        flown(reading(float(t_s), sun=sun, **spinning(values["rate_deg_s"])))
        assert tuple(flown.now) == moment.states
