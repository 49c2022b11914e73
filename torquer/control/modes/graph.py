"""States and transitions of a region as a graph."""

import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from torquer.control.modes.spec import Region, Transition


class Edge(NamedTuple):
    """A change of state by a transition; `from_any`: by one of those from any state."""

    leave: str
    to: str
    transition: Transition
    from_any: bool

    @property
    def least_s(self) -> float:
        """The least time in the state before the transition is taken [s]."""
        transition = self.transition
        waits_s = [
            condition.above
            for condition in transition.when
            if condition.signal == "time_in_state_s" and condition.above is not None
        ]
        held_s = 0.0 if self.from_any else transition.for_s  # from any state: may have begun before
        at_least_s = math.inf if transition.by_time_only else transition.at_least_s or 0.0
        return min(max(held_s, at_least_s, *waits_s), transition.at_most_s or math.inf)


def edges_of(region: Region) -> list[Edge]:
    """All edges, those from any state first, in the order in which they are tried."""
    found = [
        Edge(leave, transition.to, transition, True)
        for transition in region.transitions
        for leave in region.states
        if leave != transition.to
    ]
    own = ((name, one) for name, state in region.states.items() for one in state.transitions)
    return found + [Edge(name, one.to, one, False) for name, one in own]


def reachable(region: Region) -> list[str]:
    """States that the initial one leads to, itself included."""
    found, edges = [region.initial], edges_of(region)
    for name in found:
        found += dict.fromkeys(e.to for e in edges if e.leave == name and e.to not in found)
    return found


def cycles_of(edges: Iterable[Edge]) -> Iterator[tuple[Edge, ...]]:
    """Every cycle that passes no state twice, once each."""
    edges = list(edges)
    order = list(dict.fromkeys(edge.leave for edge in edges))
    for first in order:
        later = order[order.index(first) :]
        paths = [(edge,) for edge in edges if edge.leave == first]
        while paths:
            path = paths.pop()
            passed = {edge.to for edge in path}
            if path[-1].to == first:
                yield path
            elif path[-1].to in later:
                onward = (e for e in edges if e.leave == path[-1].to and e.to not in passed)
                paths += [(*path, edge) for edge in onward]


def least_time_s(cycle: tuple[Edge, ...]) -> float:
    """The least time around a cycle [s].

    The hold time of a transition from any state begins again when the state it leads to is left.
    """
    found_s = sum(edge.least_s for edge in cycle)
    for edge in cycle:
        if edge.from_any:
            (after,) = (e for e in cycle if e.leave == edge.to)
            held_s = min(edge.transition.for_s, edge.transition.at_most_s or math.inf)
            found_s = max(found_s, after.least_s + held_s)
    return found_s
