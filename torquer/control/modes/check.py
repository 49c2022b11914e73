"""What is doubtful about a mode table: dead ends, contradictions, chatter."""

import itertools
from collections.abc import Iterator
from typing import NamedTuple

from torquer.control.modes.graph import Edge, cycles_of, edges_of, least_time_s, reachable
from torquer.control.modes.signals import SIGNALS
from torquer.control.modes.spec import Condition, Modes, Region, State, Transition


class Finding(NamedTuple):
    """What was found, and where: region and states.

    `kind`: `unreachable`, `trap`, `waits for the unknown`, `conflict`, `chatter`; `hysteresis` and
    `switching rate` are no faults: they state what prevents a cycle from chattering.
    """

    kind: str
    region: str
    states: tuple[str, ...]
    message: str

    @property
    def is_fault(self) -> bool:
        """Whether something is doubtful, not only explained."""
        return self.kind not in ("hysteresis", "switching rate")


def findings(modes: Modes) -> list[Finding]:
    """All that is doubtful, region by region; then conflicts between regions."""
    found = []
    for name, region in modes.regions.items():
        found += [*_unreachable(name, region), *_dead_ends(name, region)]
        found += _cycles(modes, name)
    return [*found, *_conflicts(modes)]


def _unreachable(name: str, region: Region) -> Iterator[Finding]:
    known = reachable(region)
    for state in region.states:
        if state not in known:
            text = f"{name}.{state}: no transition leads there from the initial state"
            yield Finding("unreachable", name, (state,), f"{text} {region.initial}")


def _dead_ends(name: str, region: Region) -> Iterator[Finding]:
    """States without a transition out, or none of whose transitions is sure to be taken."""
    for state in reachable(region):
        transitions = [e.transition for e in edges_of(region) if e.leave == state and e.to != state]
        if region.states[state].final or len(region.states) == 1:
            continue
        if not transitions:
            text = f"{name}.{state}: nothing leads out; declare it final = true if it is meant so"
            yield Finding("trap", name, (state,), text)
            continue
        lacking = [_may_stay_unknown(transition) for transition in transitions]
        if all(lacking):
            signals = " or ".join(dict.fromkeys(signal for some in lacking for signal in some))
            text = (
                f"{name}.{state}: can be left only while {signals} is known, which may never be; "
                "at_most_s would limit the wait"
            )
            yield Finding("waits for the unknown", name, (state,), text)


def _may_stay_unknown(transition) -> list[str]:
    """Signals without which a transition cannot fire, and which may stay unknown for good."""
    if transition.at_most_s is not None:
        return []
    return [c.signal for c in transition.when if SIGNALS[c.signal].may_stay_unknown]


def _cycles(modes: Modes, name: str) -> Iterator[Finding]:
    region = modes.regions[name]
    known = reachable(region)
    for cycle in cycles_of(e for e in edges_of(region) if e.leave in known):
        states = tuple(edge.leave for edge in cycle)
        path = " -> ".join((*states, states[0]))
        least_s = max(least_time_s(cycle), _followed_s(modes, cycle))
        if least_s > 0.0:
            rate = len(cycle) * 3600.0 / least_s
            shown = f"{rate:.0f}" if rate >= 100.0 else f"{rate:.3g}"
            text = f"takes at least {least_s:g} s: at most {shown} switches per hour on average"
            yield Finding("switching rate", name, states, f"{name}: {path} {text}")
        elif gap := _gap(cycle):
            text = f"{name}: {path} has no least time; what prevents chatter is that {gap}"
            yield Finding("hysteresis", name, states, text)
        else:
            text = "can switch at every control step; for_s, at_least_s or hysteresis prevent it"
            yield Finding("chatter", name, states, f"{name}: {path} {text}")


def _followed_s(modes: Modes, cycle: tuple[Edge, ...]) -> float:
    """The least time around a cycle that follows a state of another region in and out [s]."""
    seen = {}
    for condition in (c for edge in cycle for c in edge.transition.when if c.signal == "in_state"):
        region = modes.region_of("when", condition)
        seen.setdefault((region, condition.state), set()).add(condition.above is not None)
    followed = [place for place, sides in seen.items() if len(sides) == 2]
    return max((_around_s(modes.regions[r], state) for r, state in followed), default=0.0)


def _around_s(region: Region, state: str) -> float:
    """The least time from one entry into a state to the next [s]."""
    passing = [c for c in cycles_of(edges_of(region)) if state in {edge.leave for edge in c}]
    return min(map(least_time_s, passing), default=0.0)


def _gap(cycle: tuple[Edge, ...]) -> str:
    """How a signal must move around a cycle, from above one value to below another; or ""."""
    conditions = [(e.transition, condition) for e in cycle for condition in e.transition.when]
    for (rising, high), (falling, low) in itertools.product(conditions, conditions):
        if high.above is None or low.below is None or _subject(high) != _subject(low):
            continue
        least = high.back_below if _may_wait(rising, high.back_below) else high.above
        greatest = low.back_above if _may_wait(falling, low.back_above) else low.below
        if least > greatest:
            return f"{high.signal} must go above {least:g} and below {greatest:g}"
    return ""


def _may_wait(transition: Transition, back: float | None) -> bool:
    """Whether a transition may fire after its condition has come true, by its hysteresis."""
    waits = len(transition.when) > 1 or transition.for_s > 0.0 or transition.at_least_s is not None
    return back is not None and waits


def _subject(condition: Condition) -> tuple:
    place = condition.sensor, condition.region, condition.state
    return condition.signal, condition.since_entry, *place


def _conflicts(modes: Modes) -> Iterator[Finding]:
    """Pairs of states of different regions that can be active together and contradict."""
    together = dict.fromkeys(
        pair
        for joint in joint_states(modes)
        for pair in itertools.combinations(zip(modes.regions, joint, strict=True), 2)
    )
    for (one, a), (two, b) in together:
        for what in _contradictions(modes.regions[one].states[a], modes.regions[two].states[b]):
            text = f"{one}.{a} and {two}.{b} can be active together, and set {what}"
            yield Finding("conflict", f"{one}, {two}", (a, b), text)


def _contradictions(one: State, two: State) -> Iterator[str]:
    for key, name in (("estimator", "different estimators"), ("coils", "the coils on and off"),
                      ("wheels", "the wheels on and off")):  # fmt: skip
        values = getattr(one, key), getattr(two, key)
        if None not in values and values[0] != values[1]:
            yield name
    for parameter in one.set.keys() & two.set.keys():
        if one.set[parameter] != two.set[parameter]:
            yield f"{parameter} to different values"


def joint_states(modes: Modes) -> list[tuple[str, ...]]:
    """Combinations of the regions' states that can come about, `in_state` conditions considered."""
    regions = modes.regions
    edges = {name: edges_of(region) for name, region in regions.items()}
    found = [tuple(region.initial for region in regions.values())]
    seen = set(found)
    for joint in found:
        now = dict(zip(regions, joint, strict=True))
        moves = [
            dict.fromkeys([state, *(e.to for e in edges[name] if _may_go(modes, e, state, now))])
            for name, state in now.items()
        ]
        fresh = [after for after in itertools.product(*moves) if after not in seen]
        found += fresh
        seen.update(fresh)
    return found


def _may_go(modes: Modes, edge: Edge, state: str, now: dict[str, str]) -> bool:
    """Whether a transition may be taken, by the states that the regions are in."""
    if edge.leave != state:
        return False
    if edge.transition.at_most_s is not None:
        return True
    for condition in (c for c in edge.transition.when if c.signal == "in_state"):
        is_in = float(now[modes.region_of("when", condition)] == condition.state)
        above, below = condition.above, condition.below
        if not (is_in > above if above is not None else is_in < below):
            return False
    return True
