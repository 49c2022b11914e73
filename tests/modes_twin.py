"""Mode tables taken literally, a second at a time, and everything they can do tried out."""

import itertools
import math
from typing import NamedTuple


class Way(NamedTuple):
    """What a transition remembers: how long it has held (None: not at all), latched conditions."""

    held_s: int | None
    latched: tuple[bool, ...]


class Moment(NamedTuple):
    """All that a table remembers: states, times in them, and of each transition its way."""

    states: tuple[str, ...]
    spent_s: tuple[int, ...]
    ways: tuple[tuple[Way, ...], ...]


class Twin:
    """A table of regions whose conditions are on signals, `in_state` and `time_in_state_s`.

    Times are whole seconds, as the control step is one; beyond `_CAP_S` they are not counted on.
    """

    _CAP_S = 8

    def __init__(self, modes):
        self.modes, self.names = modes, [*modes.regions]
        self.listed = [
            [(None, one) for one in region.transitions]
            + [(name, one) for name, state in region.states.items() for one in state.transitions]
            for region in modes.regions.values()
        ]

    def first(self) -> Moment:
        """The initial states have just been entered."""
        states = tuple(region.initial for region in self.modes.regions.values())
        ways = tuple(tuple(self._fresh(one) for _, one in listed) for listed in self.listed)
        return Moment(states, (0,) * len(states), ways)

    def _fresh(self, transition) -> Way:
        return Way(None, (False,) * len(transition.when))

    def after(self, moment: Moment, values: dict) -> tuple[Moment, tuple]:
        """A second later, with these values: what is remembered, the transitions taken."""
        spent = [min(s + 1, self._CAP_S) for s in moment.spent_s]
        states, ways, taken = [*moment.states], [[*each] for each in moment.ways], []
        for r, listed in enumerate(self.listed):
            first = None
            for k, (leave, one) in enumerate(listed):
                if leave not in (None, moment.states[r]):
                    continue
                if leave is None and one.to == moment.states[r]:
                    ways[r][k] = self._fresh(one)
                    continue
                ways[r][k], done = self._looked_at(one, ways[r][k], moment, spent[r], values)
                first = k if first is None and done else first
            taken.append(first)
            if first is not None:
                states[r], spent[r] = listed[first][1].to, 0
                for k, (leave, one) in enumerate(listed):
                    if leave == moment.states[r]:
                        ways[r][k] = self._fresh(one)
        return Moment(tuple(states), tuple(spent), tuple(map(tuple, ways))), tuple(taken)

    def _looked_at(self, one, way: Way, moment: Moment, spent_s: int, values) -> tuple[Way, bool]:
        """What a transition remembers now, and whether it fires."""
        truths, latched = [], []
        for condition, before in zip(one.when, way.latched, strict=True):
            truth = self._truth(condition, before, moment, spent_s, values)
            truths.append(truth)
            latched.append(before if truth is None else truth)
        held = way.held_s
        if False in truths:
            held = None
        elif None not in truths:
            held = 0 if held is None else min(held + 1, self._CAP_S)
        true = all(truths) and held is not None and held >= one.for_s
        ready = (one.when or one.at_least_s) and true and spent_s >= (one.at_least_s or 0.0)
        late = one.at_most_s is not None and spent_s >= one.at_most_s
        return Way(held, tuple(latched)), bool(ready or late)

    def _truth(self, condition, latched: bool, moment: Moment, spent_s: int, values) -> bool | None:
        if condition.signal == "in_state":
            value = float(condition.state in moment.states)
        elif condition.signal == "time_in_state_s":
            return spent_s >= condition.above if condition.above else spent_s < condition.below
        else:
            value = values[condition.signal]
        if math.isnan(value):
            return None
        if condition.above is not None:
            back = condition.back_below
            return value > condition.above or bool(latched and back is not None and value >= back)
        back = condition.back_above
        return value < condition.below or bool(latched and back is not None and value <= back)


class Tried(NamedTuple):
    """All that was found: combinations of states, transitions taken, from where to where."""

    joints: set
    taken: set  # (region, name of the state left, place of the transition in its list)
    steps: set  # (combination, combination)


def tried(modes, values: dict[str, tuple[float, ...]], most=20_000) -> Tried | None:
    """Everything that a table can do for all sequences of these values; None if it is too much."""
    twin = Twin(modes)
    choices = [dict(zip(values, each, strict=True)) for each in itertools.product(*values.values())]
    order, joints, taken, steps = [twin.first()], set(), set(), set()
    seen = set(order)
    for moment in order:
        joints.add(moment.states)
        for choice in choices:
            after, first = twin.after(moment, choice)
            for r, k in enumerate(first):
                if k is not None:
                    taken.add((twin.names[r], moment.states[r], k))
            steps.add((moment.states, after.states))
            if after not in seen:
                seen.add(after)
                order.append(after)
        if len(order) > most:
            return None
    return Tried(joints, taken, steps)
