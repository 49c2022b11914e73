"""Doubts about single transitions: what never holds, always holds, or is never taken."""

import math
from collections.abc import Iterator

from torquer.computer.modes.explore import Sight
from torquer.computer.modes.finding import Finding
from torquer.computer.modes.graph import Edge, reachable, waits
from torquer.computer.modes.signals import SIGNALS
from torquer.computer.modes.spec import Transition
from torquer.computer.modes.valuations import holds
from torquer.computer.modes.wording import condition_in_words, transition_in_words


def on_transitions(sight: Sight) -> Iterator[Finding]:
    """Faults of transitions by themselves and by those before them in their state.

    What they make impossible is added to `sight.dead`.
    """
    for name, region in sight.modes.regions.items():
        known, seen = reachable(region), set()
        for edge in sight.edges[name]:
            if edge.leave not in known:
                continue
            kind, reason = _fault(sight, name, edge)
            if kind == "never":
                sight.dead[name, edge.number] = reason
            place = describe_edge(name, edge)
            if reason and (place, reason) not in seen:
                seen.add((place, reason))
                yield Finding(kind.split(":")[0], name, (edge.leave,), f"{place}: {reason}")


def describe_edge(name: str, edge: Edge) -> str:
    """A transition in words: `main.a -> b`, `main: any state -> b`."""
    return (
        f"{name}: any state -> {edge.to}" if edge.from_any else f"{name}.{edge.leave} -> {edge.to}"
    )


def _fault(sight: Sight, name: str, edge: Edge) -> tuple[str, str]:
    """(kind, reason) of the first fault of a transition; "never": it is never taken."""
    by_time = edge.transition.at_most_s is not None
    if reason := _impossible(sight, name, edge):
        return ("never:conditions" if by_time else "never"), reason
    if reason := _why_hidden(sight, name, edge):
        return "never", reason
    if reason := _idle(edge):
        return "never:conditions", reason
    return "always", _says_nothing(sight, name, edge)


def _values(sight: Sight, name: str, edge: Edge) -> dict:
    """The values of each subject at which the conditions of an edge may hold together."""
    left: dict = {}
    for condition in edge.transition.when:
        subject = sight.subject(name, edge, condition)
        values = left.get(subject, sight.values[subject])
        left[subject] = [x for x in values if holds(condition, x, late=waits(edge))]
    return left


def _impossible(sight: Sight, name: str, edge: Edge) -> str:
    """Why the conditions of an edge never hold together; "" if they may."""
    for condition in edge.transition.when:
        subject = sight.subject(name, edge, condition)
        if not any(holds(condition, x, late=waits(edge)) for x in sight.values[subject]):
            return f"{condition_in_words(condition)} never holds: {_range(sight, subject)}"
    for subject, values in _values(sight, name, edge).items():
        if not values:
            both = [c for c in edge.transition.when if sight.subject(name, edge, c) == subject]
            words = " and ".join(map(condition_in_words, both))
            return f"{words} cannot hold together; one of these limits must be another"
    return ""


def _range(sight: Sight, subject) -> str:
    """The values of a subject in words."""
    low, high = subject.range
    unit = SIGNALS[subject.signal].unit
    if sight.values[subject] == (math.inf,):
        return f"the computer has no readings of the {subject.of[0].replace('_', ' ')}"
    if unit == "yes/no":
        return f"{subject.signal} is 0 or 1"
    shown = "" if unit in ("times", "part") else f" {unit}"
    name = f"the change of {subject.signal}" if subject.since_entry else subject.signal
    if high == math.inf:
        return f"{name} is never below {low:g}{shown}"
    return f"{name} is within {low:g} to {high:g}{shown}"


def _why_hidden(sight: Sight, name: str, edge: Edge) -> str:
    """Why other transitions out of the state are always taken before an edge."""
    before = True
    for other in sight.leaving(name, edge.leave):
        if other.number == edge.number:
            before = False
            continue
        if (name, other.number) in sight.dead or not _lasts(other.transition, edge.transition):
            continue
        latest_s = other.transition.at_most_s or math.inf
        if latest_s < edge.least_s or (before and latest_s == edge.least_s):
            return (
                f"never taken: it takes at least {edge.least_s:g} s, and the one to {other.to} is "
                f"taken after {latest_s:g} s at the latest"
            )
        if before and _covers(sight, name, other, edge):
            words = transition_in_words(other.transition)
            return (
                f"never taken: the one to {other.to} ({words}) comes first and is taken whenever "
                "this one could be; put the stricter one first"
            )
    return ""


def _lasts(one: Transition, two: Transition) -> bool:
    """Whether `one` is before `two` at later entries of the state, if it is at the first."""
    most = [math.inf if each.most_entries is None else each.most_entries for each in (one, two)]
    return most[0] >= most[1] and one.back_off <= two.back_off


def _covers(sight: Sight, name: str, one: Edge, two: Edge) -> bool:
    """Whether the transition `one`, which is tried first, fires no later than `two` ever does."""
    first, second = one.transition, two.transition
    if one.from_any and two.from_any and first.to != second.to:
        return False  # in the state that `one` leads to only the hold time of `two` runs
    latest_s = first.at_most_s or math.inf
    if second.at_most_s is not None and latest_s > second.at_most_s:
        return False
    if second.by_time_only:
        return True
    if first.by_time_only or first.for_s > second.for_s:
        return False
    if (first.at_least_s or 0.0) > (second.at_least_s or 0.0):
        return False
    possible = _values(sight, name, two)
    for condition in first.when:
        values = possible.get(sight.subject(name, one, condition), [math.nan])
        if not all(holds(condition, x) for x in values):
            return False
    return True


def _idle(edge: Edge) -> str:
    """Why the conditions of an edge do not matter: its time is up before."""
    one = edge.transition
    if one.at_most_s is None or one.by_time_only:
        return ""
    if edge.route_s < one.at_most_s or (edge.route_s == one.at_most_s and not one.when):
        return ""
    return (
        f"conditions and at_least_s do not matter: they take {edge.route_s:g} s or more, and "
        f"at_most_s = {one.at_most_s:g} s is up before"
    )


def _says_nothing(sight: Sight, name: str, edge: Edge) -> str:
    """Which condition of an edge always holds, or for good once it has held; "" if none does."""
    for condition in edge.transition.when:
        subject = sight.subject(name, edge, condition)
        words, known = condition_in_words(condition), _known_values(sight.values[subject])
        # a limit at the end of a range, as in `time_s` above 0, is meant to hold always
        if all(holds(condition, x) for x in known) and condition.limit not in subject.range:
            return f"{words} always holds: {_range(sight, subject)}; leave it out or correct it"
        if condition.back is not None and all(holds(condition, x, late=True) for x in known):
            key = "back_below" if condition.sign > 0.0 else "back_above"
            why = _range(sight, subject)
            return f"{words} holds for ever once it has held, for {why}; correct {key}"
    return ""


def _known_values(values) -> list[float]:
    return [x for x in values if not math.isnan(x)]


def never_taken(sight: Sight, stuck: set[tuple[str, str]]) -> Iterator[Finding]:
    """Transitions that no combination of states, values and earlier transitions lets be taken.

    `stuck`: regions and states of which it is already said that they are never left.
    """
    for name, region in sight.modes.regions.items():
        views = [each for each in sight.together if name in each.regions]
        for transition in dict.fromkeys(id(e.transition) for e in sight.edges[name]):
            edges = [e for e in sight.edges[name] if id(e.transition) == transition]
            edges = [e for e in edges if (name, e.number) not in sight.dead]
            edges = [e for e in edges if (name, e.leave) not in stuck]
            if edges and (reason := _why_not(sight, name, edges, views)):
                states = tuple(edge.leave for edge in edges if edge.leave in region.states)
                sight.dead |= {(name, edge.number): reason for edge in edges}
                yield Finding("never", name, states, f"{describe_edge(name, edges[0])}: {reason}")


def _why_not(sight: Sight, name: str, edges: list[Edge], views) -> str:
    """Why none of the edges of a transition is taken; "" if one is, or its states are not met."""
    for view in views:
        place, reasons = view.regions.index(name), []
        numbers = {edge.number for edge in edges}
        if any((e := step.edges[place]) and e.number in numbers for step in view.steps):
            continue
        for number, joint in enumerate(view.joints):
            for edge in edges:
                if edge.leave == joint[place]:
                    reasons.append(_obstacle(sight, name, edge, view.now(number)))
        if reasons:
            return "never taken: " + max(reasons)[1]
    return ""


def _obstacle(sight: Sight, name: str, edge: Edge, now: dict[str, str]) -> tuple[int, str]:
    """What keeps an edge from being taken in some states: how near it is to it, and words."""
    may = sight.masks(name, edge, now).may
    if not may:
        return 0, "no states of the other regions that can come about let it be"
    if may & sight.admissible(now):
        return 2, f"whenever it could be, another transition out of {edge.leave} comes first"
    gives = sight.given(now)
    lacking = [
        c.signal
        for c in edge.transition.when
        if c.signal != "in_state" and sight.is_unknown(sight.subject(name, edge, c), gives)
    ]
    unknown = " and ".join(dict.fromkeys(lacking)) or "estimate_age_s"
    return 1, f"{unknown} is not known here, where no estimator gives it"
