"""Values of signals, as few as a mode table can distinguish.

Conditions only compare a signal with numbers. So one value on each of these numbers, one between
each two neighbours and one beyond represent all values that the signal may have; not a number
stands for 'unknown'. A valuation is one such value for each signal; a set of valuations is an
integer, a bit for each.
"""

import math
from collections.abc import Callable, Iterable
from itertools import pairwise
from typing import NamedTuple

from torquer.computer.modes.finding import Facts
from torquer.computer.modes.signals import SIGNALS
from torquer.computer.modes.spec import Condition, Modes

#: Bits of the greatest set; signals that do not fit are left free.
_MOST_VALUATIONS = 1 << 14
_ALWAYS_KNOWN = ("s", "yes/no", "times")


class Subject(NamedTuple):
    """What conditions compare: a signal, of a sensor, coil, flag, region, state; or its change."""

    signal: str
    of: tuple[str, ...] = ()
    since_entry: bool = False

    @property
    def range(self) -> tuple[float, float]:
        """Its least and greatest value."""
        low, high = SIGNALS[self.signal].range
        return (low - high, high - low) if self.since_entry else (low, high)


def condition_subject(modes: Modes, region: str, state: str, condition: Condition) -> Subject:
    """What a condition of a state's transition compares."""
    if condition.since_entry:
        return Subject(condition.signal, (region, state), True)
    if condition.state is not None:
        return Subject(condition.signal, (modes.find_region("when", condition), condition.state))
    if condition.signal == "time_in_state_s":
        return Subject(condition.signal, (region,))
    named = (condition.sensor, condition.coil, condition.flag)
    return Subject(condition.signal, tuple(name for name in named if name is not None))


def holds(condition: Condition, value: float, late=False, nearly=False) -> bool:
    """Whether a condition is true of a value.

    `late`: it may have come true earlier, and stay so by its hysteresis; `nearly`: also if it is
    true next to the value, where noise would make it so.
    """
    limit, sign = condition.limit, condition.sign
    closed = nearly or (sign > 0.0 and SIGNALS[condition.signal].unit == "s")
    if late and condition.back is not None:
        limit, closed = condition.back, True
    return sign * value >= sign * limit if closed else sign * value > sign * limit


def representative_values(
    subject: Subject, numbers: Iterable[float], facts: Facts
) -> tuple[float, ...]:
    """Values that represent all that a subject may have, compared with these numbers."""
    low, high = subject.range
    unit = SIGNALS[subject.signal].unit
    if subject.signal == "reading_age_s" and subject.of[0] not in facts.sensors:
        return (math.inf,)
    if unit == "yes/no":
        return (0.0, 1.0)
    if unit == "times":
        near = {math.floor(x) + i for x in (*numbers, 0.0) for i in (-1, 0, 1)}
        return tuple(float(x) for x in sorted(near) if x >= 0)
    points = sorted({x for x in (low, high, *numbers) if low <= x <= high and math.isfinite(x)})
    points = points or [0.0]
    found = [*points, *(0.5 * (a + b) for a, b in pairwise(points))]
    found += [points[0] - 1.0] if low == -math.inf else []
    found += [points[-1] + 1.0] if high == math.inf else []
    found += [math.inf] if subject.signal.endswith("_age_s") else []
    return tuple(found) if unit in _ALWAYS_KNOWN else (*found, math.nan)


def all_values(modes: Modes, facts: Facts) -> dict[Subject, tuple[float, ...]]:
    """The representative values of every subject of a table; shared ones first."""
    numbers, regions = {}, {}
    for name, region in modes.regions.items():
        for state, spec in region.states.items():
            for transition in (*region.transitions, *spec.transitions):
                for condition in transition.when:
                    subject = condition_subject(modes, name, state, condition)
                    used = [x for x in (condition.limit, condition.back) if x is not None]
                    numbers.setdefault(subject, []).extend(used)
                    regions.setdefault(subject, set()).add(name)
    order = sorted(numbers, key=lambda subject: -len(regions[subject]))
    return {subject: representative_values(subject, numbers[subject], facts) for subject in order}


class Valuations:
    """Sets of valuations of some subjects, as bits of integers; other subjects are free."""

    def __init__(self, values: dict[Subject, tuple[float, ...]]):
        self._values, self._stride, count = {}, {}, 1
        for subject, choice in values.items():
            if subject.signal != "in_state" and count * len(choice) <= _MOST_VALUATIONS:
                self._values[subject], self._stride[subject] = choice, count
                count *= len(choice)
        self.all = (1 << count) - 1

    def where(self, subject: Subject, test: Callable[[float], bool], free: bool) -> int:
        """Valuations in which a subject's value passes a test; all or none (`free`) if left out."""
        if subject not in self._values:
            return self.all if free else 0
        stride, choice = self._stride[subject], self._values[subject]
        one = (1 << stride) - 1
        cells = sum(one << (k * stride) for k, value in enumerate(choice) if test(value))
        return cells * (self.all // ((1 << (stride * len(choice))) - 1))
