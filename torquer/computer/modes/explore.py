"""All combinations of states that the regions of a mode table can come to, and how.

The regions are explored together, as the computer evaluates them: at a control step every region
takes the first transition that fires, all by the same values of the signals. Values may be any at
any time, and times may have passed or not; what cannot happen here can therefore not happen in
flight. What can happen here may be impossible for a satellite.
"""

import math
from collections.abc import Iterable
from functools import cached_property, partial
from typing import NamedTuple

from torquer.computer.modes.finding import Facts
from torquer.computer.modes.graph import Edge, commanded_states, find_edges, waits
from torquer.computer.modes.signals import SIGNALS
from torquer.computer.modes.spec import Modes
from torquer.computer.modes.valuations import (
    Subject,
    Valuations,
    all_values,
    condition_subject,
    holds,
)
from torquer.computer.modes.wording import transition_in_words

#: Steps between combinations of states, beyond which regions are explored in pairs.
_MOST_STEPS = 10_000
#: A transition: its region, its number in the order of the text.
Way = tuple[str, int]


class Masks(NamedTuple):
    """Valuations under which a transition may fire, must fire, and may by noise alone."""

    may: int
    must: int
    nearly: int


class Step(NamedTuple):
    """From one combination of states to another, by their numbers; the regions' transitions."""

    start: int
    end: int
    edges: tuple[Edge | None, ...]


class Explored(NamedTuple):
    """Combinations of states of some regions that can come about, the initial one first.

    `steps` are those of transitions, `commands` the steps that lead to commanded states, which have
    no edges. `came`: by which step each combination was first found.
    """

    regions: tuple[str, ...]
    joints: list[tuple[str, ...]]
    steps: list[Step]
    commands: list[Step]
    came: dict[int, Step]

    def now(self, number: int) -> dict[str, str]:
        """A combination as states by region."""
        return dict(zip(self.regions, self.joints[number], strict=True))

    def strip(self, path: list[Step]) -> tuple[str, ...]:
        """The states of all regions along a path, side by side, and why each step is taken."""
        rows = [("", *self.regions, "because")]
        rows.append(("0", *self.joints[path[0].start if path else 0], "start"))
        for number, step in enumerate(path, start=1):
            rows.append((str(number), *self.joints[step.end], self._reasons(step)))
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        return tuple(
            "  ".join(f"{text:{width}}" for text, width in zip(row, widths, strict=True)).rstrip()
            for row in rows
        )

    def _reasons(self, step: Step) -> str:
        taken = zip(self.regions, step.edges, strict=True)
        reasons = [(name, transition_in_words(edge.transition)) for name, edge in taken if edge]
        if len(self.regions) == 1:
            return reasons[0][1] if reasons else "command"
        return "; ".join(map(": ".join, reasons)) or "command"

    def path_to(self, number: int) -> list[Step]:
        """Steps from the initial combination, as few as possible."""
        path: list[Step] = []
        while number != 0:
            path.insert(0, self.came[number])
            number = path[0].start
        return path


class Sight:
    """A mode table as the checker sees it: its edges, and when each of them can be taken."""

    def __init__(self, modes: Modes, facts: Facts):
        self.modes, self.facts = modes, facts
        self.edges = {name: find_edges(region) for name, region in modes.regions.items()}
        self.values = all_values(modes, facts)
        self.valuations = Valuations(self.values)
        #: Transitions that can never be taken, with the reason.
        self.dead: dict[Way, str] = {}
        self._masks: dict[Way, Masks] = {}
        self._admissible: dict = {}
        self._explored: dict[tuple[str, ...], Explored | None] = {}

    def leaving(self, region: str, state: str) -> list[Edge]:
        """The transitions out of a state, in the order in which they are tried."""
        return [edge for edge in self.edges[region] if edge.leave == state]

    def alive(self, region: str) -> list[Edge]:
        """The edges of a region that can be taken."""
        return [edge for edge in self.edges[region] if (region, edge.number) not in self.dead]

    def subject(self, region: str, edge: Edge, condition) -> Subject:
        """What a condition of an edge compares."""
        return condition_subject(self.modes, region, edge.leave, condition)

    def masks(self, region: str, edge: Edge, now: dict[str, str]) -> Masks:
        """When an edge can be taken while regions are in these states."""
        way = region, edge.number
        if way not in self._masks:
            self._masks[way] = self._group_signals(region, edge)
        return Masks(*map(int.__and__, self._masks[way], self._follows(edge, now)))

    def _group_signals(self, region: str, edge: Edge) -> Masks:
        """By the signals and times; `in_state` apart."""
        transition, every = edge.transition, self.valuations.all
        may = must = nearly = every
        for condition in transition.when:
            if condition.signal == "in_state":
                continue
            subject, late = self.subject(region, edge, condition), waits(edge)
            where = partial(self.valuations.where, subject)
            may &= where(partial(holds, condition, late=late), True)
            must &= where(partial(holds, condition), False)
            if condition.since_entry:  # a change begins at zero
                nearly = nearly if holds(condition, 0.0, nearly=True) else 0
            else:
                nearly &= where(partial(holds, condition, late=late, nearly=True), True)
            if condition.signal == "entries" and condition.below is not None:
                nearly = 0 if subject.of[0] == region else nearly  # each time round counts
        if transition.for_s > 0.0 or transition.at_least_s is not None or not transition.when:
            must = 0
        may = every if transition.at_most_s is not None else may
        if (transition.at_most_s or math.inf) <= self.facts.step_s:
            return Masks(may, every, every)
        return Masks(may, must, nearly if edge.is_instant(self.facts.step_s) else 0)

    def _follows(self, edge: Edge, now: dict[str, str]) -> Masks:
        """Whether the other regions' states let an edge be taken, as all valuations or none."""
        transition, every = edge.transition, self.valuations.all
        may = must = every
        for condition in (c for c in transition.when if c.signal == "in_state"):
            region = self.modes.find_region("when", condition)
            if region not in now:
                must = 0
                continue
            value = float(now[region] == condition.state)
            may = may if holds(condition, value, late=waits(edge)) else 0
            must = must if holds(condition, value) else 0
        at_most_s = transition.at_most_s
        nearly = every if at_most_s is not None and at_most_s <= self.facts.step_s else may
        return Masks(every if at_most_s is not None else may, must, nearly)

    def admissible(self, now: dict[str, str]) -> int:
        """Valuations that the estimator allows which works in these states."""
        gives = self.given(now)
        if gives is None:
            return self.valuations.all
        if gives not in self._admissible:
            found = self.valuations.all
            for subject in self.values:
                if self.is_unknown(subject, gives):
                    found &= self.valuations.where(subject, math.isnan, True)
                elif subject.signal == "estimate_age_s" and not gives:
                    found &= self.valuations.where(subject, math.isinf, True)
            self._admissible[gives] = found
        return self._admissible[gives]

    def given(self, now: dict[str, str]) -> frozenset[str] | None:
        """What the estimator gives which works in these states; None if that is not known."""
        chosen = "estimator"
        for name, region in self.modes.regions.items():
            if name in now:
                chosen = region.states[now[name]].estimator or chosen
            elif any(state.estimator for state in region.states.values()):
                return None
        return self.facts.gives.get(chosen)

    def is_unknown(self, subject: Subject, gives: frozenset[str]) -> bool:
        """Whether a subject has no value while the estimator gives only this."""
        needs = set(SIGNALS[subject.signal].estimated)
        if "target" in subject.signal and self.modes.target == "sun":
            needs = needs - {"attitude"}
        return not needs <= gives

    def explore(self, names: Iterable[str]) -> Explored | None:
        """The combinations of states of some regions; None if there are too many of several."""
        names = tuple(name for name in self.modes.regions if name in set(names))
        if names not in self._explored:
            self._explored[names] = self._explore(names)
        return self._explored[names]

    def alone(self, name: str) -> Explored:
        """The states of one region, whatever the others do."""
        found = self.explore([name])
        assert found is not None
        return found

    def _explore(self, names: tuple[str, ...]) -> Explored | None:
        first = tuple(self.modes.regions[name].initial for name in names)
        joints, numbers = [first], {first: 0}
        steps, commands, came = [], [], {}
        for start, joint in enumerate(joints):
            now = dict(zip(names, joint, strict=True))
            for edges in self._choices(now):
                after = tuple(
                    edge.to if edge else state for edge, state in zip(edges, joint, strict=True)
                )
                step = Step(start, numbers.setdefault(after, len(joints)), edges)
                steps.append(step)
                if step.end == len(joints):
                    joints.append(after)
                    came[step.end] = step
            for after in self._command(names, joint):
                step = Step(start, numbers.setdefault(after, len(joints)), (None,) * len(names))
                commands.append(step)
                if step.end == len(joints):
                    joints.append(after)
                    came[step.end] = step
            if len(steps) > _MOST_STEPS and len(names) > 1:
                return None
        return Explored(names, joints, steps, commands, came)

    def _command(self, names: tuple[str, ...], joint: tuple[str, ...]) -> list[tuple[str, ...]]:
        """The combinations that one command leads to."""
        found = []
        for place, name in enumerate(names):
            for state in commanded_states(self.modes.regions[name]):
                found.append((*joint[:place], state, *joint[place + 1 :]))
        return found

    def _choices(self, now: dict[str, str]) -> list[tuple[Edge | None, ...]]:
        """The transitions that regions can take at one control step, one or none in each."""
        found: list = [((), self.admissible(now))]
        for name, state in now.items():
            options = self._options(name, state, now)
            found = [
                ((*edges, edge), both)
                for edges, mask in found
                for edge, own in options
                if (both := mask & own)
            ]
            if len(found) > _MOST_STEPS:  # too many already: the others stay
                return [(*edges, *(None,) * (len(now) - len(edges))) for edges, _ in found]
        return [edges for edges, _ in found if any(edges)]

    def _options(self, name: str, state: str, now: dict) -> list[tuple[Edge | None, int]]:
        """What a region can do, each with the valuations under which it can: the first fires."""
        left, options = self.valuations.all, []
        for edge in self.leaving(name, state):
            masks = self.masks(name, edge, now)
            if (name, edge.number) not in self.dead and left & masks.may:
                options.append((edge, left & masks.may))
            left &= ~masks.must
        return [*options, (None, left)] if left else options

    @cached_property
    def together(self) -> list[Explored]:
        """All regions together or, if they have too many combinations, in pairs."""
        names = [*self.modes.regions]
        if whole := self.explore(names):
            return [whole]
        pairs = [(a, b) for i, a in enumerate(names) for b in names[i + 1 :]]
        return [found for pair in pairs if (found := self.explore(pair))]

    @property
    def is_whole(self) -> bool:
        """Whether all regions could be explored together."""
        return [len(each.regions) for each in self.together] == [len(self.modes.regions)]
