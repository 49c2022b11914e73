"""Rows of telemetry against the limits of the dictionary: what is beyond, in which mode.

What is judged is a number of a packet, a *point*; its key is `packet.number`. A value that was not
known on board is neither in order nor beyond.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from torquer.computer.names import Names
from torquer.flight.packets.alarm_limits import ANY, SEVERITIES, AlarmKeys, Beyond, Ends
from torquer.flight.packets.bits import in_words
from torquer.flight.packets.dictionary import Dictionary, Field
from torquer.ground.archive import Row

#: The packet with the states of the regions of the mode table.
_MODES = "modes"
#: Conditions of a point: the value of its last rows.
UNKNOWN, IN_ORDER, WARNING, ALARM = "unknown", "in order", *SEVERITIES
#: How bad each is.
RANK = {UNKNOWN: 0, IN_ORDER: 0, WARNING: 1, ALARM: 2}


class Verdict(NamedTuple):
    """A value judged: its condition; what is beyond (one word a side, label or bit); the limit in
    words; the mode whose limits these are, "" for those of the field.
    """

    condition: str
    signs: frozenset[str] = frozenset()
    limit: str = ""
    mode: str = ""


class Ranges(NamedTuple):
    """What is out of limits, as the dictionary has it; `inner`: what is in order by all ranges."""

    limits: Ends | None
    critical: Ends | None
    values: Mapping[str, str]
    inner: Ends


class _ByMode(NamedTuple):
    """Limits while the number of a mode is one of some; in words."""

    mode: str
    numbers: frozenset[int]
    words: str
    ranges: Ranges


class Rule(NamedTuple):
    """How an alarm is raised: its key, samples in a row, whether it has to be cleared."""

    key: str
    samples: int = 1
    latched: bool = False


class Point(NamedTuple):
    """A number with limits: its place in the packet's rows, its field, its own limits, by mode."""

    rule: Rule
    place: int
    field: Field
    own: Ranges
    by_mode: tuple[_ByMode, ...]

    def judge(self, value, modes: Mapping[str, int]) -> Verdict:
        """A value of a row; `modes`: the last known number of each mode, by its key."""
        if value is None:
            return _UNKNOWN
        if isinstance(value, str):  # too large for SQLite
            value = int(value)
        ranges, words = self.own, ""
        for each in self.by_mode:
            if modes.get(each.mode) in each.numbers:
                ranges, words = each.ranges, each.words
                break
        low, high = ranges.inner
        if low <= value <= high and not ranges.values:
            return _IN_ORDER
        return _judge(self.field, ranges, value, words)


#: Most verdicts: of rows in which all is well.
_IN_ORDER, _UNKNOWN = Verdict(IN_ORDER), Verdict(UNKNOWN)


def _judge(field: Field, beyond: Ranges, value, mode: str) -> Verdict:
    for condition, ends in ((ALARM, beyond.critical), (WARNING, beyond.limits)):
        if ends and not ends[0] <= value <= ends[1]:
            side, end = ("above", ends[1]) if value > ends[1] else ("below", ends[0])
            limit = f"{side} {end:.12g} {field.unit}".rstrip()
            return Verdict(condition, frozenset({side}), limit, mode)
    found = _values(field, beyond.values, int(value)) if beyond.values else {}
    if not found:
        return _IN_ORDER
    condition = max(found.values(), key=RANK.__getitem__)
    return Verdict(condition, frozenset(found), f"is {', '.join(found)}", mode)


def _values(field: Field, values: Mapping[str, str], raw: int) -> dict[str, str]:
    """The label, or the bits that are set, that are out of limits, with their severities."""
    if field.labels:
        label = field.texts.get(raw, "")
        return {label: values[label]} if label in values else {}
    names = in_words(field, raw).split(", ") if raw else []
    stated = {name: values.get(name, values.get(ANY)) for name in names}
    return {name: severity for name, severity in stated.items() if severity}


class Limits:
    """All points of a satellite with limits, by packet; `modes`: keys of modes by their packet.

    Without regions (no scenario) limits by a region never apply.
    """

    def __init__(self, dictionary: Dictionary, names: Names):
        self.points: dict[str, tuple[Point, ...]] = {}
        regions = {name: states for name, (_, states) in names.regions.items()}
        self._modes: dict[str, dict[str, int]] = {}
        for name in dictionary.down:
            found = tuple(self._points(dictionary, name, regions))
            if found:
                self.points[name] = found

    def _points(self, dictionary, packet: str, regions) -> Iterator[Point]:
        for place, (name, field, _) in enumerate(dictionary.down[packet].numbers()):
            alarm = field.alarm or AlarmKeys()
            own = Beyond(limits=field.limits, critical=alarm.critical, values=alarm.values)
            by_mode = tuple(self._by_mode(dictionary, alarm, regions))
            if not (own.limits or own.critical or own.values or by_mode):
                continue
            rule = Rule(f"{packet}.{name}", alarm.samples, alarm.latched)
            yield Point(rule, place, field, _ranges(own), by_mode)

    def _by_mode(self, dictionary, alarm: AlarmKeys, regions) -> Iterator[_ByMode]:
        for each in alarm.by_mode:
            words = f"{each.mode} {' or '.join(each.states)}"
            if each.place and each.place[0] in dictionary.down:
                packet, number = each.place
                fields = [(name, field) for name, field, _ in dictionary.down[packet].numbers()]
                place = [name for name, _ in fields].index(number)
                texts = fields[place][1].texts
                numbers = frozenset(n for n, text in texts.items() if text in each.states)
            elif each.mode in regions and _MODES in dictionary.down:
                packet, place = _MODES, list(regions).index(each.mode)
                states = enumerate(regions[each.mode])  # numbered within the region
                numbers = frozenset(n for n, state in states if state in each.states)
            else:
                continue
            if place >= len(names := dictionary.down[packet].names):
                continue  # more regions than the packet has room for
            key = f"{packet}.{names[place]}"
            self._modes.setdefault(packet, {})[key] = place
            yield _ByMode(key, numbers, words, _ranges(each))

    @property
    def packets(self) -> set[str]:
        """Packets that matter to limits."""
        return self.points.keys() | self._modes.keys()

    def judge(self, row: Row, modes: dict[str, int]) -> Iterator[tuple[Rule, Verdict, Any]]:
        """(how, verdict, value) of each point of a row; `modes` takes first what the row tells."""
        modes |= self.modes_in(row.packet, row.values)
        for point in self.points.get(row.packet, ()):
            value = row.values[point.place]
            yield point.rule, point.judge(value, modes), value

    def modes_in(self, packet: str, values: Sequence) -> dict[str, int]:
        """Numbers of modes in a row's values, by their keys; unknown ones are left out."""
        found = self._modes.get(packet, {})
        return {key: values[k] for key, k in found.items() if values[k] is not None}


def describe_limits(limits: Limits) -> dict[str, dict]:
    """The limits of each point by its key, for a page: ranges, values, and by mode the same."""
    points = [point for each in limits.points.values() for point in each]
    return {
        point.rule.key: _described(point.own)
        | {
            "by_mode": [
                {"mode": each.mode, "numbers": sorted(each.numbers), **_described(each.ranges)}
                for each in point.by_mode
            ]
        }
        for point in points
    }


def _described(ranges: Ranges) -> dict:
    return {name: getattr(ranges, name) for name in ("limits", "critical", "values")}


def _ranges(beyond: Beyond) -> Ranges:
    inner = beyond.limits or beyond.critical or (-math.inf, math.inf)
    return Ranges(beyond.limits, beyond.critical, beyond.values, inner)
