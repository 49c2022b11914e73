"""States and transitions of a region as a graph."""

import math
from collections.abc import Iterable
from typing import NamedTuple

from torquer.computer.modes.spec import Region, Transition


class Edge(NamedTuple):
    """A change of state by a transition; `from_any`: by one of those from any state.

    `number`: its place among the edges of its region, in the order in which they are tried.
    """

    leave: str
    to: str
    transition: Transition
    from_any: bool
    number: int

    @property
    def held_s(self) -> float:
        """Time that the conditions must have held, or may at most [s]."""
        return min(self.transition.for_s, self.transition.at_most_s or math.inf)

    @property
    def route_s(self) -> float:
        """The least time in the state before the conditions can fire the transition [s]."""
        transition = self.transition
        waits_s = [
            condition.above
            for condition in transition.when
            if condition.signal == "time_in_state_s" and condition.above is not None
        ]
        held_s = 0.0 if self.from_any else transition.for_s  # from any state: may have begun before
        at_least_s = math.inf if transition.by_time_only else transition.at_least_s or 0.0
        return max(held_s, at_least_s, *waits_s)

    @property
    def least_s(self) -> float:
        """The least time in the state before the transition is taken [s]."""
        return min(self.route_s, self.transition.at_most_s or math.inf)

    def is_instant(self, step_s: float) -> bool:
        """Whether no time longer than a control step [s] delays it, however often it is taken."""
        return self.least_s <= step_s and not (self.from_any and self.held_s > step_s)


def waits(edge: Edge) -> bool:
    """Whether a transition may be taken later than a condition of it has come true.

    One from any state may, after another that came first at that time.
    """
    one = edge.transition
    return edge.from_any or len(one.when) > 1 or one.for_s > 0.0 or one.at_least_s is not None


def find_edges(region: Region) -> list[Edge]:
    """All edges, those from any state first, in the order in which they are tried."""
    found = [
        (leave, transition.to, transition, True)
        for transition in region.transitions
        for leave in region.states
        if leave != transition.to
    ]
    own = ((name, one) for name, state in region.states.items() for one in state.transitions)
    found += [(name, one.to, one, False) for name, one in own]
    return [Edge(*each, number) for number, each in enumerate(found)]


def commanded_states(region: Region) -> list[str]:
    """States that a command leads to."""
    return [name for name, state in region.states.items() if state.commanded]


def reachable(region: Region) -> list[str]:
    """States that the initial one and the commanded ones lead to, themselves included."""
    return _led_to(
        list(dict.fromkeys([region.initial, *commanded_states(region)])), find_edges(region)
    )


def _led_to(first: list[str], edges: list[Edge]) -> list[str]:
    found = [*first]
    for name in found:
        found += dict.fromkeys(e.to for e in edges if e.leave == name and e.to not in found)
    return found


def components(edges: Iterable[Edge]) -> list[list[Edge]]:
    """Edges among states that lead to each other, one list for each such set of states."""
    edges = list(edges)
    leads = {state: set(_led_to([state], edges)) for state in dict.fromkeys(e.leave for e in edges)}
    found: dict = {}
    for edge in edges:
        if edge.leave in leads.get(edge.to, ()):
            found.setdefault(frozenset(leads[edge.leave]), []).append(edge)
    return list(found.values())


def cycle_along(edges: list[Edge], flow: Iterable[float]) -> tuple[Edge, ...]:
    """A cycle that passes no state twice, along the greatest flow, from its first in the text."""
    ways = sorted(zip(flow, edges, strict=True), key=lambda pair: -pair[0])
    path = [ways[0][1]]
    while path[-1].to not in (passed := [edge.leave for edge in path]):
        path.append(next(edge for _, edge in ways if edge.leave == path[-1].to))
    cycle = path[passed.index(path[-1].to) :]
    first = min(range(len(cycle)), key=lambda k: cycle[k].number)
    return (*cycle[first:], *cycle[:first])
