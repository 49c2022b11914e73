"""Doubts about regions together: deadlocks, contradictions, laws that never act, leftovers."""

from collections.abc import Iterator
from itertools import combinations

from torquer.computer.modes.explore import Explored, Sight, Step
from torquer.computer.modes.finding import Finding
from torquer.computer.modes.graph import components, find_edges, reachable
from torquer.computer.modes.spec import Region, State

#: Kinds of laws that take all rotation away, and of those that make it.
_BRAKES = (
    "bdot", "bdot_rate", "bdot_derivative", "bdot_model", "bdot_normalised", "bdot_weighted",
    "bcross", "momentum_projection", "non_monotonic", "non_monotonic_derivative",
)  # fmt: skip
SPINS = ("spin_up", "spin_to_sun")


def deadlocks(sight: Sight) -> Iterator[Finding]:
    """States that regions cannot leave any more, though they could be left by themselves."""
    said: set[tuple[str, str]] = set()
    for view in sight.together:
        stuck = {name: _stuck(sight, view, name) for name in view.regions}
        for number in range(len(view.joints)):
            now = view.now(number)
            found = {name: now[name] for name in view.regions if number in stuck[name]}
            if said.issuperset(found.items()):
                continue
            strip = view.strip(view.path_to(number))
            asked = {name: _asked_regions(sight, name, now) for name in found}
            ring = [name for name in found if asked[name] & found.keys()]
            if len(ring) > 1 and not said.issuperset((name, found[name]) for name in ring):
                places = " and ".join(f"{name}.{found[name]}" for name in ring)
                text = f"{places} wait for each other: together they are never left"
                states = tuple(found[name] for name in ring)
                yield Finding("deadlock", ", ".join(ring), states, text, strip)
            for name in found.keys() - {*ring}:
                if (name, found[name]) not in said:
                    others = " and ".join(f"{r} is in {now[r]}" for r in sorted(asked[name]))
                    text = f"{name}.{found[name]}: can never be left once {others}"
                    yield Finding("deadlock", name, (found[name],), text, strip)
            said.update(found.items())


def _asked_regions(sight: Sight, name: str, now: dict[str, str]) -> set[str]:
    """Other regions whose states the transitions out of a region's state ask for."""
    found = {
        sight.modes.find_region("when", condition)
        for edge in sight.leaving(name, now[name])
        for condition in edge.transition.when
        if condition.signal == "in_state"
    }
    return (found & now.keys()) - {name}


def _stuck(sight: Sight, view: Explored, name: str) -> set[int]:
    """Combinations from which a region never moves, out of a state with transitions alive."""
    place = view.regions.index(name)
    leaving = {e.leave for e in sight.alive(name) if e.to != e.leave}
    free = {
        step.start
        for step in view.steps
        if (edge := step.edges[place]) is not None and edge.to != edge.leave
    }
    before: dict[int, list[int]] = {}
    for step in (*view.steps, *view.commands):
        before.setdefault(step.end, []).append(step.start)
    order = [*free]
    for number in order:
        fresh = set(before.get(number, ())) - free
        free |= fresh
        order += fresh
    rest = set(range(len(view.joints))) - free
    return {
        number
        for number in rest
        if view.joints[number][place] in leaving and not _may_go(sight, name, view.now(number))
    }


def _may_go(sight: Sight, name: str, now: dict[str, str]) -> bool:
    """Whether the other regions' states let a region leave its own, were all signals known."""
    edges = [e for e in sight.alive(name) if e.leave == now[name] != e.to]
    return any(sight.masks(name, edge, now).may for edge in edges)


def conflicts(sight: Sight) -> Iterator[Finding]:
    """Pairs of states of different regions that can be active together and contradict."""
    said = set()
    for view in sight.together:
        for number, joint in enumerate(view.joints):
            for (one, a), (two, b) in combinations(zip(view.regions, joint, strict=True), 2):
                if (one, a, two, b) in said:
                    continue
                said.add((one, a, two, b))
                states = sight.modes.regions[one].states[a], sight.modes.regions[two].states[b]
                for what in _contradictions(sight, *states):
                    text = f"{one}.{a} and {two}.{b} can be active together, and {what}"
                    strip = view.strip(view.path_to(number))
                    yield Finding("conflict", f"{one}, {two}", (a, b), text, strip)


def _contradictions(sight: Sight, one: State, two: State) -> Iterator[str]:
    for key, name in (("estimator", "different estimators"), ("coils", "the coils on and off"),
                      ("wheels", "the wheels on and off")):  # fmt: skip
        values = getattr(one, key), getattr(two, key)
        if None not in values and values[0] != values[1]:
            yield f"set {name}"
    for parameter in one.set.keys() & two.set.keys():
        if one.set[parameter] != two.set[parameter]:
            yield f"set {parameter} to different values"
    for law in one.laws.keys() & two.laws.keys():
        if one.laws[law] * two.laws[law] < 0.0:
            factors = f"{one.laws[law]:g} and {two.laws[law]:g}"
            yield f"multiply {law} by {factors}, against each other"
    for brake, spin in ((one, two), (two, one)):
        brakes, spins = _active(sight, brake, _BRAKES), _active(sight, spin, SPINS)
        if brakes and spins and not spins & _active(sight, brake, SPINS):
            yield f"{min(brakes)} takes away the rotation that {min(spins)} makes"


def _active(sight: Sight, state: State, kinds: tuple[str, ...]) -> set[str]:
    """Laws of some kinds that a state uses with a factor above zero."""
    return {
        law for law, factor in state.laws.items()
        if factor > 0.0 and sight.facts.kinds.get(law) in kinds
    }  # fmt: skip


def without_effect(sight: Sight) -> Iterator[Finding]:
    """Laws that a state names, and that do nothing there: factor 0, actuators off."""
    for name, region in sight.modes.regions.items():
        for state in reachable(region):
            for law, factor in region.states[state].laws.items():
                if why := _nothing(sight, name, state, law, factor):
                    text = f"{name}.{state}: {law} {why}"
                    yield Finding("no effect", name, (state,), text)


def _nothing(sight: Sight, name: str, state: str, law: str, factor: float) -> str:
    """Why a law does nothing in a state; "" if it may act, or that is not known."""
    if factor == 0.0:
        return "has the factor 0 and does nothing; leave it out"
    if not sight.is_whole:
        return ""
    (view,) = sight.together
    joints = [view.now(k) for k in range(len(view.joints)) if view.now(k)[name] == state]
    off = [_off(sight, now, law) for now in joints]
    if joints and all(off):
        return f"never acts: {off[0]} whenever this state is active"
    for other, region in sight.modes.regions.items():
        last = _comes_for_good(region)
        if other == name or not last:
            continue
        lasting = [w for w, now in zip(off, joints, strict=True) if now[other] in last]
        if lasting and all(lasting):
            return f"acts for a while only: {lasting[0]} for ever, and nothing prevents it"
    return ""


def _off(sight: Sight, now: dict[str, str], law: str) -> str:
    """Which states keep a law off, or all that it drives; "" if it may work.

    Of states that switch an actuator, the last one counts.
    """
    drives, found = sight.facts.drives.get(law, frozenset()), {}
    for name, place in now.items():
        state = sight.modes.regions[name].states[place]
        if law in state.laws_off:
            return f"{name}.{place} keeps it off"
        for key in drives:
            if switch := getattr(state, key):
                found[key] = f"{name}.{place} keeps the {key} off" if switch == "off" else ""
    words = [found.get(key, "") for key in sorted(drives)]
    return " and ".join(words) if all(words) else ""


def _comes_for_good(region: Region) -> set[str]:
    """Final states of which one is entered in any case, by times alone; none if that may not be."""
    known = reachable(region)
    final = {state for state in known if region.states[state].final}
    passing = [state for state in known if state not in final]
    ways = {s: (*region.transitions, *region.states[s].transitions) for s in passing}
    timed = all(any(t.at_most_s is not None and t.to != s for t in ways[s]) for s in passing)
    circles = components(e for e in find_edges(region) if e.leave in passing)
    return final if final and timed and not circles else set()


def leftovers(sight: Sight) -> Iterator[Finding]:
    """Parameters with which a law works by itself at first, later as another state has left it."""
    regions = sight.modes.regions.values()
    given = dict.fromkeys(key for r in regions for s in r.states.values() for key in s.set)
    for parameter in given:
        for view in sight.together:
            if found := _leftover(sight, view, parameter):
                yield found
                break


def _leftover(sight: Sight, view: Explored, parameter: str) -> Finding | None:
    """The first combination in which a law works with its own parameter or with another's."""
    if not _sets_all(sight, view, parameter):
        return None
    law = parameter.partition(".")[0]
    first = (0, _setter(sight, view.now(0), view.regions, parameter))
    order: list[tuple[int, str]] = [first]
    came: dict = {first: []}
    leaving: dict[int, list[Step]] = {}
    for step in view.steps:
        leaving.setdefault(step.start, []).append(step)
    for number, setter in order:
        for step in leaving.get(number, []):
            entered = [n for n, e in zip(view.regions, step.edges, strict=True) if e]
            after = step.end, _setter(sight, view.now(step.end), entered, parameter) or setter
            if after not in came:
                came[after] = [*came[number, setter], step]
                order.append(after)
    for number, setter in order:
        now = view.now(number)
        users = [n for n, s in now.items() if law in sight.modes.regions[n].states[s].laws]
        if setter and (number, "") in came and users and setter not in map(".".join, now.items()):
            text = (
                f"{users[0]}.{now[users[0]]}: {law} works with its own {parameter} until {setter} "
                "has set it, which nothing undoes; set it here, too"
            )
            strip = view.strip(came[number, setter])
            return Finding("leftover", users[0], (now[users[0]],), text, strip)
    return None


def _sets_all(sight: Sight, view: Explored, parameter: str) -> bool:
    """Whether all states that set a parameter are of the regions explored."""
    return all(
        name in view.regions or all(parameter not in s.set for s in region.states.values())
        for name, region in sight.modes.regions.items()
    )


def _setter(sight: Sight, now: dict[str, str], entered, parameter: str) -> str:
    """The state that sets a parameter as these regions enter their states; "" if none does."""
    setting = [n for n in entered if parameter in sight.modes.regions[n].states[now[n]].set]
    return f"{setting[-1]}.{now[setting[-1]]}" if setting else ""
