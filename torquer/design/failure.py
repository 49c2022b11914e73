"""Why a design fails: flights without each cause, what limits, the nearest design that works."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import reduce
from typing import NamedTuple

from torquer.analysis.causes import COUNTED_ON
from torquer.analysis.counter_tests import groups_of, lessened
from torquer.base.strict_json import finite_or_none
from torquer.design.nearest import Lever, Nearest, nearest
from torquer.scenario.spec import Scenario

#: Starts of each counter-test and trial; the part of them that must arrive for a design to work.
RUNS, _ENOUGH = 16, 0.9
#: A cause limits where at least this part of the error or time goes with it.
_LIMITS = 0.5
#: A median up to this [deg, h] is rounding of a flight that nothing disturbs.
_ROUNDING = 1e-6


class Flown(NamedTuple):
    """Of `runs` starts `arrived` come to what is wanted; `median` of the error or time of all."""

    arrived: int
    runs: int
    median: float

    @property
    def is_enough(self) -> bool:
        """Whether nearly all arrive."""
        return is_enough(self.arrived, self.runs)


def is_enough(arrived: int, runs: int) -> bool:
    """Whether nearly all starts arrive."""
    return runs > 0 and arrived >= _ENOUGH * runs


@dataclass(frozen=True)
class Failure:
    """Why a design fails.

    `design`: which; `measure`, `unit`: what the medians are; `flown`: as it is; `without`: without
    each cause that it has; `together`: those that have to go together, most important first, and
    the flights without them; `others`: designs for the same satellite that were tried, by their
    names; `found`: what was found of each number that a designer may change.
    """

    design: str
    measure: str
    unit: str
    flown: Flown
    without: Mapping[str, Flown]
    together: tuple[tuple[str, ...], Flown]
    others: Mapping[str, Flown] = field(default_factory=dict)
    found: tuple[Nearest, ...] = ()

    def share(self, cause: str) -> float:
        """Part of the error or time that goes with a cause."""
        if not self.flown.median > 0.0:
            return 0.0
        return max(0.0, 1.0 - self.without[cause].median / self.flown.median)

    @property
    def limiting(self) -> str | None:
        """The cause without which nearly all arrive; else that with which most of the error or time
        goes, if it is at least half."""
        enough = [name for name, flown in self.without.items() if flown.is_enough]
        most = max(enough or self.without, key=self.share, default=None)
        if most is None or not (enough or self.share(most) >= _LIMITS):
            return None
        return most

    def data(self) -> dict:
        """Plain data, with units in the keys."""
        key = f"median_{'_'.join(self.unit.split())}"

        def plain(flown: Flown) -> dict:
            return {"arrived": flown.arrived, "runs": flown.runs, key: finite_or_none(flown.median)}

        names, flown = self.together
        return {
            "design": self.design,
            "measure": self.measure,
            "flown": plain(self.flown),
            "without": {
                name: plain(each) | {"share": self.share(name)}
                for name, each in self.without.items()
            },
            "limiting": self.limiting,
            "together": {"causes": [*names], **plain(flown)},
            "others": {name: plain(each) for name, each in self.others.items()},
            "nearest": [each._asdict() for each in self.found],
        }

    def lines(self) -> list[str]:
        """The counter-tests, what limits, what would work."""
        why = [f"{self.design}: {self._told(self.flown)}; {self.measure}", *self._without()]
        return [
            *(f"why: {line}" for line in [*why, self._limit()]),
            *(f"works: {line}" for line in self.works()),
            *(f"not found: {line}" for line in self._missing()),
        ]

    def _told(self, flown: Flown) -> str:
        median = flown.median if flown.median > _ROUNDING else 0.0
        return f"{flown.arrived} of {flown.runs}, median {median:.3g} {self.unit}"

    def _without(self) -> list[str]:
        ordered = sorted(self.without, key=lambda name: self.without[name].median)
        return [self._change(name) for name in ordered]

    def _change(self, name: str) -> str:
        """By how much the median is another without a cause; it may be greater, too."""
        told, less = self._told(self.without[name]), 100.0 * self.share(name)
        if self.without[name].median <= self.flown.median:
            return f"without {name}: {told} ({less:.0f} % less)"
        of_flown = self.without[name].median / self.flown.median if self.flown.median else math.inf
        if not math.isfinite(of_flown):
            return f"without {name}: {told} (more)"
        more = 100.0 * (of_flown - 1.0)
        return f"without {name}: {told} ({more:.0f} % more)"

    def _limit(self) -> str:
        name = self.limiting
        if name is not None and self.without[name].is_enough:
            if self.share(name) >= _LIMITS:
                return f"what limits: {name}, {100.0 * self.share(name):.0f} % of it"
            return f"what limits: {name}; without it {self._told(self.without[name])}"
        names, flown = self.together
        told = f"{', '.join(names)}: {self._told(flown)}"
        if name is not None and not flown.is_enough:
            rest = told if names else f"it: {self._told(self.without[name])}"
            return (
                f"what limits: {name}, {100.0 * self.share(name):.0f} % of it, but not alone; even "
                f"without {rest}"
            )
        if not names:
            return "what limits: nothing disturbs it; the design is too weak for these starts"
        if flown.is_enough:
            return f"what limits: no cause alone; without {told}"
        return f"what limits: no disturbance; even without {told}"

    def works(self) -> list[str]:
        """The designs that work: for the same satellite, then with one number changed."""
        lines = [
            f"{name}: {self._told(each)}" for name, each in self.others.items() if each.is_enough
        ]
        for each in self.found:
            if each.value is not None:
                done = f"{each.verified} of {each.runs} other starts arrive"
                changed = f"{each.lever} {each.value:.3g} {each.unit} in place of {each.now:.3g}"
                lines.append(f"{changed}: {done}")
        return lines

    def _missing(self) -> list[str]:
        return [
            f"{each.lever} from {each.now:.3g} to {each.bound:.3g} {each.unit}"
            for each in self.found if each.value is None
        ]  # fmt: skip


def without_each(
    scenario: Scenario, groups: Sequence[str], fly: Callable[[Scenario, int], Flown]
) -> tuple[dict[str, Flown], tuple[tuple[str, ...], Flown]]:
    """Flights without each group of causes, and without the fewest that have to go together.

    The causes go together in the order in which they go best alone; the last flights are those
    without all where even these do not arrive.
    """
    own, alone = scenario, {group: fly(lessened(scenario, group, 0.0), 1) for group in groups}
    order = sorted(groups, key=lambda group: (not alone[group].is_enough, alone[group].median))
    names: list[str] = []
    flown = Flown(0, 0, math.nan)
    for group in order:
        if group in COUNTED_ON:
            continue
        scenario = lessened(scenario, group, 0.0)
        names.append(group)
        flown = alone[group] if len(names) == 1 else fly(scenario, 1)
        if flown.is_enough:
            break
    return alone, _fewest(own, names, flown, fly)


def _fewest(
    scenario: Scenario, names: list[str], flown: Flown, fly: Callable[[Scenario, int], Flown]
) -> tuple[tuple[str, ...], Flown]:
    """Causes that have to go together, and the flights without them: those that may stay do."""
    if not flown.is_enough:
        return tuple(names), flown
    for name in names[:-1]:
        fewer = [each for each in names if each != name]
        if len(fewer) < 2:  # none is enough alone
            break
        trial = fly(reduce(lambda each, group: lessened(each, group, 0.0), fewer, scenario), 1)
        if trial.is_enough:
            names, flown = fewer, trial
    return tuple(names), flown


def explain(
    scenario: Scenario,
    told: tuple[str, str, str],
    as_flown: Callable[[Scenario], Scenario],
    fly: Callable[[Scenario, int], Flown],
    fly_anew: Callable[[Scenario, int], Flown],
    levers: Sequence[Lever],
    others: Mapping[str, Flown],
) -> Failure:
    """Why a design fails: `told`: design, measure, unit.

    `as_flown`: what of a scenario flies; `fly`: starts with the design, by scenario and seed;
    `fly_anew`: with one made anew for the scenario; `others`: flights of other designs for the same
    satellite. Causes that the flights do not have are left out, and so are levers on a cause that
    is not enough by itself.
    """
    own = as_flown(scenario)
    groups = [
        each for each in groups_of(own) if as_flown(lessened(scenario, each, 0.0)) != own
    ]  # fmt: skip
    flown = fly(scenario, 1)
    without, together = without_each(scenario, groups, fly)
    useful = [
        lever for lever in levers
        if lever.cause is None or (lever.cause in without and without[lever.cause].is_enough)
    ]  # fmt: skip

    found = nearest(scenario, useful, lambda *trial: fly_anew(*trial)[:2], is_enough)
    return Failure(*told, flown, without, together, others, tuple(found))
