"""Alarms of a satellite: what becomes of limits as rows are received, and of what operators do.

An alarm is raised once a point was out of limits for its number of samples. While it is, and until
an operator has acknowledged it, it is there once, with the count of its violations:

    active        out of limits, nobody has acknowledged it     (ISA-18.2: unacknowledged)
    acknowledged  out of limits, an operator knows
    returned      in order again, nobody has acknowledged it
    latched       in order again, acknowledged, to be cleared (points with `latched` only)
    settling      in order again, acknowledged; it ends once it has been so for a minute

It is raised anew, and to be acknowledged anew, when it becomes worse or another side, label or bit
is beyond. *Shelved* is beside all that: until a time a point does not call for anybody. Rows that
are suspect, and rows of earlier times, change nothing. A value that becomes unknown leaves an alarm
as it is. Nothing here reads a clock or a file.
"""

from __future__ import annotations

from collections.abc import Iterator

from torquer.base.limits import RequestError
from torquer.ground.alarm import Alarm, Event, Now, Shelf, Violation
from torquer.ground.limits import ALARM, IN_ORDER, RANK, UNKNOWN, WARNING, Rule, Verdict

#: How long a point must be in order until its acknowledged alarm, or a violation, is over [s].
SETTLE_S = 60.0
#: Longest shelf [s].
LONGEST_SHELF_S = 30 * 86_400.0


class _Track:
    """What is remembered of a point: samples in a row, its alarm, its violation, its shelf."""

    def __init__(self) -> None:
        self.beyond = {WARNING: 0, ALARM: 0}
        self.in_order, self.first_ms, self.extreme = 0, 0, 0.0
        self.alarm: Alarm | None = None
        self.violation: Violation | None = None
        self.shelf: Shelf | None = None
        self.over_s, self.shelf_end_s = 0.0, 0.0


class Alarms:
    """The alarms of a satellite; `changed`: keys to be shown and stored since somebody took them;
    `violations`: the like, by their number.

    RequestError with one line for what an operator cannot do.
    """

    def __init__(self, keys: set[str], number: int = 0, violation: int = 0):
        self._known, self._tracks = keys, dict[str, _Track]()
        self._number, self._violation = number, violation
        self.changed: set[str] = set()
        self.violations: dict[int, Violation] = {}

    def restore(
        self,
        key: str,
        alarm: Alarm | None,
        shelf: Shelf | None,
        violation: Violation | None,
        now: Now,
    ) -> None:
        """An alarm, a shelf and a violation that lasts, as they were stored."""
        track = self._track(key)
        track.alarm, track.shelf, track.violation = alarm, shelf, violation
        track.over_s = now.s
        if alarm is not None:
            self._number = max(self._number, alarm.number)
        if shelf is not None:
            left_ms = min(shelf.until_ms - now.ms, shelf.until_ms - shelf.made_ms)
            track.shelf_end_s = now.s + left_ms * 1e-3

    def judge(self, rule: Rule, verdict: Verdict, value, time_ms: int, now: Now) -> Event | None:
        """Take a value of a row that was judged; what happened, if anything did."""
        track = self._tracks.get(rule.key)
        if track is None:
            if verdict.condition in (IN_ORDER, UNKNOWN):
                return None
            track = self._track(rule.key)
        number = None if value is None else float(value)
        if verdict.condition == UNKNOWN:
            self._unknown(track)
            return None
        if verdict.condition == IN_ORDER:
            return self._in_order(track, rule, number, now)
        return self._beyond(track, rule, verdict, float(value), time_ms, now)

    def tell(
        self, key: str, severity: str | None, text: str, time_ms: int, now: Now
    ) -> Event | None:
        """A condition that is no number of telemetry: raise it (`text`: what is wrong), or None."""
        self._known.add(key)
        verdict = Verdict(severity or IN_ORDER, frozenset({severity} if severity else ()), text)
        return self.judge(Rule(key), verdict, RANK[verdict.condition], time_ms, now)

    def tick(self, now: Now) -> list[Event]:
        """What time alone brings: alarms and violations that are over, shelves that end."""
        found = [self._tick(key, track, now) for key, track in self._tracks.items()]
        for key in [key for key, track in self._tracks.items() if _is_idle(track)]:
            del self._tracks[key]
        return [event for event in found if event is not None]

    def check(self, key: str, number: int) -> Alarm:
        """The alarm of a point, if it is still the one of this number."""
        alarm, _ = self.of(key)
        if alarm is None:
            raise RequestError("alarm", f"must be one that is there; received {key!r}")
        if alarm.number != number:
            raise RequestError(
                "number",
                f"must be {alarm.number}, since {key} was raised anew; received {number}",
            )
        return alarm

    def acknowledge(self, key: str, number: int, by: str, comment: str, now: Now) -> Alarm:
        """An operator has seen an alarm; one that is latched is cleared."""
        alarm = self.check(key, number)
        if alarm.acknowledged_ms is None:
            alarm.acknowledged_by, alarm.acknowledged_ms, alarm.comment = by, now.ms, comment
        violation = self._tracks[key].violation
        if violation is not None and violation.acknowledged_ms is None:
            violation.acknowledged_by, violation.comment = by, comment
            violation.acknowledged_ms = now.ms
            self.violations[violation.id] = violation
        if alarm.state == "latched":
            alarm.latched = False
        self.changed.add(key)
        return alarm

    def shelve(self, key: str, for_s: float, by: str, reason: str, now: Now) -> Shelf:
        """A point calls for nobody for a time."""
        if key not in self._known:
            raise RequestError("alarm", f"must be packet.number with limits; received {key!r}")
        track = self._track(key)
        track.shelf = Shelf(now.ms + round(1e3 * for_s), by, reason, now.ms)
        track.shelf_end_s = now.s + for_s
        self.changed.add(key)
        return track.shelf

    def unshelve(self, key: str) -> None:
        """The point calls again."""
        track = self._tracks.get(key)
        if track is None or track.shelf is None:
            raise RequestError("alarm", f"must be shelved; received {key!r}, which is not")
        track.shelf = None
        self.changed.add(key)

    def listed(self) -> Iterator[tuple[str, Alarm | None, Shelf | None]]:
        """Points with an alarm, or on a shelf."""
        for key, track in self._tracks.items():
            if track.alarm is not None or track.shelf is not None:
                yield key, track.alarm, track.shelf

    def of(self, key: str) -> tuple[Alarm | None, Shelf | None]:
        """Alarm and shelf of a rule."""
        track = self._tracks.get(key)
        return (None, None) if track is None else (track.alarm, track.shelf)

    def counts(self) -> dict[str, int]:
        """Alarms that call for somebody, by severity; points on a shelf; all alarms."""
        found = {ALARM: 0, WARNING: 0, "shelved": 0, "all": 0}
        for _, alarm, shelf in self.listed():
            found["shelved"] += shelf is not None
            found["all"] += alarm is not None
            if alarm is not None and shelf is None and alarm.acknowledged_ms is None:
                found[alarm.severity] += 1
        return found

    def _track(self, key: str) -> _Track:
        return self._tracks.setdefault(key, _Track())

    def _unknown(self, track: _Track) -> None:
        track.beyond, track.in_order = dict.fromkeys(track.beyond, 0), 0
        alarm = track.alarm
        if alarm is not None and (alarm.condition, alarm.value) != (UNKNOWN, None):
            if RANK[alarm.condition]:
                alarm.condition = UNKNOWN
            alarm.value = None
            self.changed.add(alarm.key)

    def _in_order(self, track: _Track, rule: Rule, value, now: Now) -> Event | None:
        track.beyond, alarm = dict.fromkeys(track.beyond, 0), track.alarm
        track.in_order += 1
        if alarm is None:
            return None
        if alarm.value != value:
            alarm.value = value
            self.changed.add(rule.key)
        if alarm.condition == IN_ORDER or track.in_order < rule.samples:
            return None
        alarm.condition, track.over_s = IN_ORDER, now.s
        self.changed.add(rule.key)
        if track.violation is not None:
            track.violation.is_over = True
            self.violations[track.violation.id] = track.violation
        return Event("returned", alarm)

    def _beyond(
        self, track: _Track, rule: Rule, verdict: Verdict, value: float, time_ms: int, now: Now
    ) -> Event | None:
        if track.beyond[WARNING] == 0:
            track.first_ms, track.extreme = time_ms, value
        track.in_order = 0
        track.beyond[WARNING] += 1
        track.beyond[ALARM] = track.beyond[ALARM] + 1 if verdict.condition == ALARM else 0
        track.extreme = _farther(verdict, track.extreme, value)
        severity = _severity(track, rule.samples, verdict)
        if severity is None:
            if track.alarm is not None and track.alarm.value != value:
                track.alarm.value = value
                self.changed.add(rule.key)
            return None
        self._extend(track, rule.key, severity, verdict, time_ms, now)
        self.changed.add(rule.key)
        return self._raise(track, rule, severity, verdict, value, now)

    def _extend(
        self, track: _Track, key: str, severity: str, verdict: Verdict, time_ms: int, now: Now
    ) -> None:
        """Begin a violation, or go on with it."""
        found = track.violation
        if found is None or (found.is_over and now.s - track.over_s >= SETTLE_S):
            self._violation += 1
            found = track.violation = Violation(
                self._violation, key, severity, verdict.limit, verdict.mode, track.first_ms,
                time_ms, now.ms, track.extreme,
            )  # fmt: skip
        elif found.is_over:
            found.count, found.is_over = found.count + 1, False
        if RANK[severity] > RANK[found.severity]:
            found.severity, found.limit = severity, verdict.limit
        found.end_ms = max(found.end_ms, time_ms)
        found.extreme = _farther(verdict, found.extreme, track.extreme)
        self.violations[found.id] = found

    def _raise(
        self, track: _Track, rule: Rule, severity: str, verdict: Verdict, value: float, now: Now
    ) -> Event | None:
        alarm = track.alarm
        if alarm is None:
            self._number += 1
            track.alarm = Alarm(
                rule.key, self._number, severity, severity, verdict.limit, verdict.mode,
                track.first_ms, now.ms, value, track.extreme, latched=rule.latched,
                signs=tuple(sorted(verdict.signs)),
            )  # fmt: skip
            return Event("raised", track.alarm)
        alarm.count += alarm.condition == IN_ORDER
        alarm.condition, alarm.value = severity, value
        alarm.extreme = _farther(verdict, alarm.extreme, track.extreme)
        is_worse = RANK[severity] > RANK[alarm.severity]
        is_other = not verdict.signs <= set(alarm.signs)
        if not (is_worse or is_other):
            return None
        alarm.severity = max(alarm.severity, severity, key=RANK.__getitem__)
        alarm.limit, alarm.mode = verdict.limit, verdict.mode
        alarm.signs = tuple(sorted({*alarm.signs, *verdict.signs}))
        self._number += 1
        alarm.number, alarm.acknowledged_ms = self._number, None
        alarm.acknowledged_by = alarm.comment = ""
        return Event("again", alarm)

    def _tick(self, key: str, track: _Track, now: Now) -> Event | None:
        event, alarm = None, track.alarm
        if track.shelf is not None and now.s >= track.shelf_end_s:
            track.shelf = None
            self.changed.add(key)
            if alarm is not None and alarm.acknowledged_ms is None:
                event = Event("unshelved", alarm)
        if now.s - track.over_s < SETTLE_S:
            return event
        if track.violation is not None and track.violation.is_over:
            track.violation = None
        if alarm is not None and alarm.state == "settling":
            track.alarm = None
            self.changed.add(key)
            return Event("closed", alarm)
        return event


def _severity(track: _Track, samples: int, verdict: Verdict) -> str | None:
    """How bad a value beyond limits is by the samples in a row; None: not yet anything."""
    for each in (ALARM, WARNING):
        if track.beyond[each] >= samples:
            return each
    now = IN_ORDER if track.alarm is None else track.alarm.condition
    return min(now, verdict.condition, key=RANK.__getitem__) if RANK[now] else None


def _is_idle(track: _Track) -> bool:
    nothing = track.alarm is None and track.violation is None and track.shelf is None
    return nothing and track.beyond[WARNING] == 0


def _farther(verdict: Verdict, one: float, other: float) -> float:
    """The value that is farther out."""
    return min(one, other) if "below" in verdict.signs else max(one, other)
