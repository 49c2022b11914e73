"""What is doubtful about a mode table, found by intervals of signals and by exploring the regions.

`explore` says how the regions are explored together, `valuations` by which values of signals.
"""

from collections.abc import Iterator

from torquer.computer.modes.cycles import bounds, chatter
from torquer.computer.modes.explore import Sight
from torquer.computer.modes.finding import Facts, Finding
from torquer.computer.modes.graph import reachable
from torquer.computer.modes.signals import SIGNALS
from torquer.computer.modes.spec import Modes
from torquer.computer.modes.together import conflicts, deadlocks, leftovers, without_effect
from torquer.computer.modes.ways import never_taken, on_transitions

_NOTHING_KNOWN = Facts()


def findings(modes: Modes, facts: Facts = _NOTHING_KNOWN) -> list[Finding]:
    """All that is doubtful, and what limits the switching; `facts` of the satellite around it."""
    sight = Sight(modes, facts)
    return [*all_faults(sight), *bounds(sight), *_limits(sight)]


def faults(modes: Modes, facts: Facts = _NOTHING_KNOWN) -> list[Finding]:
    """What is doubtful about a mode table."""
    return [*all_faults(Sight(modes, facts))]


def all_faults(sight: Sight) -> Iterator[Finding]:
    """The faults of a table; what is found dead stays in `sight`."""
    yield from on_transitions(sight)  # first: what they find dead is not explored
    yield from _unreachable(sight)
    stuck = list(deadlocks(sight))
    yield from stuck
    yield from never_taken(sight, {place for each in stuck for place in each.places})
    yield from _dead_ends(sight)
    yield from conflicts(sight)
    yield from without_effect(sight)
    yield from leftovers(sight)
    yield from chatter(sight)


def _limits(sight: Sight) -> Iterator[Finding]:
    """How far the regions could be explored together."""
    if not sight.is_whole:
        names = ", ".join(sight.modes.regions)
        text = f"{names}: too many combinations of states; explored in pairs of regions"
        yield Finding("bound", names, (), text)


def _unreachable(sight: Sight) -> Iterator[Finding]:
    for name, region in sight.modes.regions.items():
        known = reachable(region)
        for state in region.states:
            if state not in known:
                text = f"{name}.{state}: no transition leads there from the initial state"
                yield Finding("unreachable", name, (state,), f"{text} {region.initial}")


def _dead_ends(sight: Sight) -> Iterator[Finding]:
    """States without a transition out, or none of whose transitions is sure to be taken."""
    for name, region in sight.modes.regions.items():
        for state in reachable(region):
            edges = [edge for edge in sight.leaving(name, state) if edge.to != state]
            spec = region.states[state]
            if spec.final or spec.commanded or len(region.states) == 1:
                continue
            if not edges:
                text = (
                    f"{name}.{state}: nothing leads out; declare it final = true if it is meant so"
                )
                yield Finding("trap", name, (state,), text)
                continue
            alive = [edge for edge in edges if (name, edge.number) not in sight.dead]
            lacking = [_may_stay_unknown(edge.transition) for edge in alive]
            if lacking and all(lacking):
                signals = " or ".join(dict.fromkeys(signal for some in lacking for signal in some))
                text = (
                    f"{name}.{state}: can be left only while {signals} is known, which may never "
                    "be; at_most_s would limit the wait"
                )
                yield Finding("waits for the unknown", name, (state,), text)


def _may_stay_unknown(transition) -> list[str]:
    """Signals without which a transition cannot fire, and which may stay unknown for good."""
    if transition.at_most_s is not None:
        return []
    return [c.signal for c in transition.when if SIGNALS[c.signal].may_stay_unknown]
