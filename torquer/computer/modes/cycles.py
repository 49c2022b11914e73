"""How fast regions can switch: chatter, and what prevents it; one witness for a component."""

import itertools
from collections.abc import Iterator

from torquer.computer.modes.explore import Explored, Sight, Step
from torquer.computer.modes.finding import Finding
from torquer.computer.modes.graph import Edge, components, cycle_along, waits
from torquer.computer.modes.wording import condition_in_words

_REMEDY = "for_s, at_least_s or hysteresis prevent it"


def chatter(sight: Sight) -> Iterator[Finding]:
    """Regions that can switch at every control step, with the states of a shortest cycle.

    The cycle is one of the region and those that it follows; all its transitions can be taken at
    one valuation, with noise about it, and nothing delays them.
    """
    restless: set[str] = set()
    for name in sight.modes.regions:
        view = _view(sight, name)
        for edges in endless(sight, name):
            steps = _quick_cycle(sight, view, name, edges, by_noise=True)
            moved = {
                r for step in steps for r, e in zip(view.regions, step.edges, strict=True) if e
            }
            if steps and not restless & moved:  # else it only follows
                cycle = _own(view, name, steps)
                text = f"{_path(name, cycle)} can switch at every control step; {_REMEDY}"
                strip = view.strip(steps) if len(view.regions) > 1 else ()
                yield Finding("chatter", name, _states(cycle), text, strip)
            restless |= {name} if steps else set()


def bounds(sight: Sight) -> Iterator[Finding]:
    """What limits the switching of components that do not chatter."""
    for name in sight.modes.regions:
        for edges in endless(sight, name):
            if not _quick_cycle(sight, _view(sight, name), name, edges, by_noise=True):
                yield _bound(sight, name, edges)


def _states(cycle: tuple[Edge, ...]) -> tuple[str, ...]:
    return tuple(edge.leave for edge in cycle)


def _path(name: str, cycle: tuple[Edge, ...]) -> str:
    return f"{name}: {' -> '.join((*_states(cycle), cycle[0].leave))}"


def endless(sight: Sight, name: str) -> list[list[Edge]]:
    """Transitions that a region can take again and again, one list for states that it joins."""
    view = _view(sight, name)
    place = view.regions.index(name)
    taken = {e.number: e for step in view.steps if (e := step.edges[place]) is not None}
    return components(taken[number] for number in sorted(taken))


def _quick_cycle(
    sight: Sight, view: Explored, name: str, edges: list[Edge], by_noise: bool
) -> list[Step]:
    """Steps of a shortest cycle in a component that nothing delays; [] if there is none.

    `by_noise`: only one whose transitions can all be taken at one valuation, with noise about it.
    """
    if not any(edge.is_instant(sight.facts.step_s) for edge in edges):
        return []
    masks = [(step, _quick(sight, view, step, by_noise)) for step in view.steps]
    quick = [(step, mask) for step, mask in masks if mask]
    place, found, numbers = view.regions.index(name), [], {edge.number for edge in edges}
    for step, mask in quick:
        edge = step.edges[place]
        if edge and edge.number in numbers and (cycle := _back(quick, step, mask)):
            found = cycle if not found or len(cycle) < len(found) else found
            if len(found) <= 2:
                break
    return found


def _own(view: Explored, name: str, steps: list[Step]) -> tuple[Edge, ...]:
    """What a region does in some steps."""
    place = view.regions.index(name)
    return tuple(edge for step in steps if (edge := step.edges[place]) is not None)


def _view(sight: Sight, name: str) -> Explored:
    """A region and those that it follows, explored; the region alone if they are too many."""
    return sight.explore(_follow(sight, name)) or sight.alone(name)


def _follow(sight: Sight, name: str) -> list[str]:
    """A region and those whose states its conditions ask for, and so on."""
    found = [name]
    for each in found:
        for _, transition in sight.modes.regions[each].all_transitions():
            asked = [c for c in transition.when if c.signal == "in_state"]
            found += {sight.modes.find_region("when", c) for c in asked} - {*found}
    return found


def _quick(sight: Sight, view: Explored, step: Step, by_noise: bool) -> int:
    """Valuations about which noise can bring a step at once; none if a time delays it."""
    now = view.now(step.start)
    mask = sight.admissible(now) if by_noise else sight.valuations.all
    for name, edge in zip(view.regions, step.edges, strict=True):
        if edge and by_noise:
            mask &= sight.masks(name, edge, now).nearly
        elif edge and not edge.is_instant(sight.facts.step_s):
            return 0
    return mask


def _back(quick: list[tuple[Step, int]], first: Step, mask: int) -> list[Step]:
    """A cycle that begins with a step, all at one valuation; [] if there is none."""
    leaving: dict[int, list[tuple[Step, int]]] = {}
    for pair in quick:
        leaving.setdefault(pair[0].start, []).append(pair)
    led, order = {first.end: mask}, [first.end]
    for number in order:
        for step, own in leaving.get(number, []):
            known = led.get(step.end, 0)
            if led[number] & own & ~known:
                led[step.end] = known | (led[number] & own)
                order.append(step.end)
    at = led.get(first.start, 0) & mask
    return _shortest(leaving, first, at & -at) if at else []


def _shortest(leaving: dict, first: Step, bit: int) -> list[Step]:
    """The shortest way from a step back to its start at one valuation."""
    paths, order = {first.end: [first]}, [first.end]
    for number in order:
        for step, own in leaving.get(number, []):
            if own & bit and step.end not in paths:
                paths[step.end] = [*paths[number], step]
                order.append(step.end)
    return paths[first.start]


def _bound(sight: Sight, name: str, edges: list[Edge]) -> Finding:
    """How often a component can switch at most, or what prevents chatter where no time does."""
    view = _view(sight, name)
    if steps := _quick_cycle(sight, view, name, edges, by_noise=False):
        cycle = _own(view, name, steps)
        text = f"has no least time; what prevents chatter is that {_gap(cycle)}"
        return Finding("hysteresis", name, _states(cycle), f"{_path(name, cycle)} {text}")
    rate, flow = greatest_rate(sight, view, name, edges)
    cycle = cycle_along(edges, flow)
    alone, _ = greatest_rate(sight, view, name, list(cycle))
    shown = f"{3600.0 * rate:.0f}" if rate >= 1.0 / 36.0 else f"{3600.0 * rate:.3g}"
    others = "" if rate < alone * (1.0 + 1e-6) else " with the region's other cycles"
    text = (
        f"takes at least {len(cycle) / alone:.6g} s: at most {shown} switches per hour on average"
        f"{others}"
    )
    return Finding("switching rate", name, _states(cycle), f"{_path(name, cycle)} {text}")


def greatest_rate(
    sight: Sight, view: Explored, name: str, edges: list[Edge]
) -> tuple[float, list[float]]:
    """(switches per second that times allow in the long run [1/s], the part of each edge).

    `edges`: those that the region `name` takes. A linear programme over the rates of all steps:
    as many lead out of a combination of states as into it; in each region the times spent in
    states fill a second at most; so do the hold times of a transition from any state, which begin
    when the state that it leads to is left, with the times spent in that state.
    """
    import numpy as np
    from scipy.optimize import linprog  # a fifth of a second of importing
    from scipy.sparse import coo_array

    count, place = len(view.steps), view.regions.index(name)
    starts, ends = ([getattr(step, key) for step in view.steps] for key in ("start", "end"))
    signs = np.repeat([1.0, -1.0], count)
    columns = np.tile(np.arange(count), 2)
    flow = coo_array((signs, ([*starts, *ends], columns)), shape=(len(view.joints), count))
    limits = np.array([row for k in range(len(view.regions)) for row in _times(sight, view, k)])
    own = [-1 if (e := step.edges[place]) is None else e.number for step in view.steps]
    numbers = [edge.number for edge in edges]
    counted = np.array([-float(number in numbers) for number in own])
    most = [(0.0, None if number in (-1, *numbers) else 0.0) for number in own]
    zeros, ones = np.zeros(len(view.joints)), np.ones(len(limits))
    found = linprog(counted, limits, ones, flow.tocsr(), zeros, most)
    parts = np.bincount(np.array(own) + 1, found.x, len(sight.edges[name]) + 1)
    return -found.fun, [float(parts[number + 1]) for number in numbers]


def _times(sight: Sight, view: Explored, place: int) -> list[list[float]]:
    """Seconds that each step takes of one region's time, and of its transitions from any state."""
    taken = [step.edges[place] for step in view.steps]
    spent = [max(e.least_s, sight.facts.step_s) if e else 0.0 for e in taken]
    held = {id(e.transition): e.transition for e in taken if e and e.from_any}.values()
    rows = [
        [
            (e.held_s if e.from_any and e.transition is one else 0.0) + t * (e.leave == one.to)
            if e
            else 0.0
            for e, t in zip(taken, spent, strict=True)
        ]
        for one in held
    ]
    return [spent, *rows]


def _gap(cycle: tuple[Edge, ...]) -> str:
    """What a signal must do around a cycle: move from above one value to below another."""
    conditions = [(edge, condition) for edge in cycle for condition in edge.transition.when]
    for (rising, high), (falling, low) in itertools.product(conditions, conditions):
        if high.above is None or low.below is None or _subject(high) != _subject(low):
            continue
        least = high.back_below if _late(rising, high.back_below) else high.above
        greatest = low.back_above if _late(falling, low.back_above) else low.below
        if least > greatest:
            return f"{high.signal} must go above {least:g} and below {greatest:g}"
    for _, condition in conditions:
        if condition.since_entry:
            return f"{condition_in_words(condition)} is not so at once"
    return "its conditions do not hold together"


def _late(edge: Edge, back: float | None) -> bool:
    """Whether a transition may fire after its condition has come true, by its hysteresis."""
    return back is not None and waits(edge)


def _subject(condition) -> tuple:
    place = condition.sensor, condition.region, condition.state
    return condition.signal, condition.since_entry, *place
