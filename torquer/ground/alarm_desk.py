"""The alarms of a satellite that is served: fed with its rows, stored in its archive, told to all.

Tables of the archive: `_alarms`, a row a point with an alarm or a shelf, and `_violations`, the
out-of-limits log. They are written within a second; what cannot be written is tried again.
"""

from __future__ import annotations

import sqlite3
import time
from collections.abc import Callable, Collection, Iterable, Mapping
from contextlib import closing
from dataclasses import asdict, astuple
from typing import Any

from torquer.base.strict_json import INFINITIES, json_text
from torquer.computer.names import Names
from torquer.flight.packets.dictionary import Dictionary
from torquer.ground.alarm import Alarm, Event, Now, Shelf, Violation
from torquer.ground.alarms import Alarms
from torquer.ground.archive import RECORDED, SUSPECT, ArchiveError, Row, read_only
from torquer.ground.ground_clock import now_ms
from torquer.ground.history import latest
from torquer.ground.limits import Limits
from torquer.ground.spool import PATIENCE_S, Spool
from torquer.ground.violations import (
    COLUMNS,
    describe,
    stored_alarms,
    stored_violations,
    violation_of,
)

#: Rows of earlier times that go on for so long are a clock that was set back [s].
_SET_BACK_S = 10.0
#: Most events of a look that the log names one by one.
_MOST_NAMED = 5
_LAST_MS = 2**53
#: Under what the spool keeps what is to be written.
_KEPT = ("alarms",)
_IN_LOG = {"raised": "alarm raised", "again": "alarm raised anew", "unshelved": "no longer shelved"}
_PUT_ALARM = "INSERT OR REPLACE INTO _alarms VALUES (?, ?, ?)"
_TAKE_ALARM = "DELETE FROM _alarms WHERE key = ?"
_PUT_VIOLATION = f"INSERT OR REPLACE INTO _violations VALUES ({', '.join('?' * len(COLUMNS))})"
_ACKNOWLEDGE = (
    "UPDATE _violations SET acknowledged_by = ?, acknowledged_ms = ?, comment = ? "
    "WHERE key = ? AND acknowledged_ms IS NULL"
)


def now() -> Now:
    """The ground's time."""
    return Now(now_ms(), time.monotonic())


class AlarmDesk:
    """Alarms of a satellite; `note(severity, text)`: to the ground's log; `show(message)`: to all.

    A message has `version`, one more than the last; `counts`; `alarms`, those that have changed,
    of which one without `state` is over.
    """

    def __init__(
        self,
        spool: Spool,
        dictionary: Dictionary,
        names: Names,
        note: Callable[[str, str], None],
        show: Callable[[dict], None],
    ):
        self._spool, self._note, self._show = spool, note, show
        self.limits = Limits(dictionary, names)
        points = [point for each in self.limits.points.values() for point in each]
        self._fields = {point.rule.key: point.field for point in points}
        self._modes: dict[str, int] = {}
        self._newest: dict[str, tuple[int, int]] = {}
        self._earlier_s: dict[str, float] = {}
        self.version = 0
        self._load(dictionary)

    def look(self, rows: Iterable[Row], at: Now | None = None) -> None:
        """Judge rows in the order in which they were received."""
        at = at or now()
        events = [
            event
            for row in rows
            if row.packet in self.limits.packets and self._is_present(row, at)
            for rule, verdict, value in self.limits.judge(row, self._modes)
            if (event := self.alarms.judge(rule, verdict, value, row.time_ms, at)) is not None
        ]
        if events:
            self._tell(events)

    def tick(self, at: Now | None = None) -> None:
        """What time brings; show what has changed since."""
        self._tell(self.alarms.tick(at or now()))

    def tell(self, key: str, severity: str | None, text: str, time_ms: int) -> None:
        """Raise a condition of the ground's own (`ground.archive`), or say that it is over.

        Whoever tells it says it in the log.
        """
        self.alarms.tell(key, severity, text, time_ms, now())
        self._tell([])

    def acknowledge(
        self, numbers: Mapping[str, int], by: str, comment: str, not_yet: Collection[str] = ()
    ) -> list[dict]:
        """Acknowledge alarms by key and number: all or none; RequestError with one line.

        `not_yet`: keys of those that the operator has seen as not acknowledged. Where somebody was
        quicker nothing is left to do: who only wants to acknowledge a latched one does not clear
        it.
        """
        at = now()
        checked = [self.alarms.check(key, number) for key, number in numbers.items()]
        mine = [each.key for each in checked if _is_for_somebody(each, each.key in not_yet)]
        for key in mine:
            self.alarms.acknowledge(key, numbers[key], by, comment, at)
            self._keep(("acknowledged", key), _ACKNOWLEDGE, by, at.ms, comment, key)
        if mine:
            self._note("info", f"acknowledged by {by}: {_several(mine)}{_because(comment)}")
            self._tell([])
        return [self._described(key) for key in numbers]

    def shelve(self, key: str, for_s: float, by: str, reason: str) -> dict:
        """Shelve a point for a time; RequestError with one line."""
        self.alarms.shelve(key, for_s, by, reason, now())
        self._note("info", f"shelved for {for_s / 60:.4g} min by {by}: {key}{_because(reason)}")
        self._tell([])
        return self._described(key)

    def unshelve(self, key: str, by: str) -> dict:
        """Take a point from its shelf; RequestError with one line."""
        self.alarms.unshelve(key)
        self._note("info", f"unshelved by {by}: {key}")
        self._tell([])
        return self._described(key)

    def listed(self) -> dict[str, Any]:
        """All alarms and shelves, with the counts and the number of the last message."""
        alarms = [self._described(key) for key, _, _ in self.alarms.listed()]
        return {"version": self.version, "counts": self.alarms.counts(), "alarms": alarms}

    def violations(
        self, db: sqlite3.Connection | None, start_ms: int, end_ms: int, size: int
    ) -> list[dict[str, Any]]:
        """The last violations within a span of on-board time, newest first: those of the archive,
        and those that wait for it; `db` None: only these.
        """
        waiting = map(violation_of, self._spool.kept(*_KEPT, "violation"))
        newer = [each for each in waiting if each["end_ms"] >= start_ms]
        found = [] if db is None else stored_violations(db, start_ms, end_ms, size)
        found += [each for each in newer if each["start_ms"] <= end_ms]
        once = {each["id"]: each for each in found}
        return [once[number] for number in sorted(once, reverse=True)[:size]]

    def _is_present(self, row: Row, at: Now) -> bool:
        """Whether a row tells of now: no doubtful one, none from the memory on board, none late."""
        if row.packet in RECORDED or row.quality == SUSPECT:
            return False
        time_ms, digest = self._newest.get(row.packet, (-_LAST_MS, 0))
        if row.time_ms < time_ms:
            since_s = self._earlier_s.setdefault(row.packet, at.s)
            if at.s - since_s < _SET_BACK_S:
                return False
        is_same = (row.time_ms, row.digest) == (time_ms, digest)
        self._newest[row.packet] = row.time_ms, row.digest
        self._earlier_s.pop(row.packet, None)
        return not is_same

    def _tell(self, events: list[Event]) -> None:
        """Log what calls for somebody, show and keep what has changed."""
        told = [
            (_IN_LOG[event.what], event.alarm)
            for event in events
            if event.what in _IN_LOG and self.alarms.of(event.alarm.key)[1] is None
        ]
        for what, alarm in told[:_MOST_NAMED]:
            self._note(alarm.severity, f"{what}: {self._in_words(alarm)}")
        if rest := [alarm for _, alarm in told[_MOST_NAMED:]]:
            worst = "alarm" if any(each.severity == "alarm" for each in rest) else "warning"
            keys = [each.key for each in rest]
            self._note(worst, f"{len(rest)} more alarms raised: {_several(keys)}")
        if changed := sorted(self.alarms.changed):
            self.alarms.changed.clear()
            self._keep_changed(changed)
            self.version += 1
            alarms = [self._described(key) for key in changed]
            counts = self.alarms.counts()
            self._show({"version": self.version, "counts": counts, "alarms": alarms})

    def _keep_changed(self, changed: list[str]) -> None:
        for key in changed:
            alarm, shelf = self.alarms.of(key)
            if alarm is None and shelf is None:
                self._keep(("alarm", key), _TAKE_ALARM, key)
            else:
                self._keep(("alarm", key), _PUT_ALARM, key, _stored(alarm), _stored(shelf))
        for number, each in self.alarms.violations.items():
            self._keep(("violation", number), _PUT_VIOLATION, *astuple(each))
        self.alarms.violations.clear()

    def _keep(self, key: tuple, statement: str, *values) -> None:
        self._spool.keep((*_KEPT, *key), statement, values)

    def _described(self, key: str) -> dict:
        alarm, shelf = self.alarms.of(key)
        return describe(key, alarm, shelf) | self._of_field(key)

    def _of_field(self, key: str) -> dict:
        field = self._fields.get(key)
        if field is None:
            return {"unit": "", "description": ""}
        return {"unit": field.unit, "description": field.description}

    def _in_words(self, alarm: Alarm) -> str:
        field = self._fields.get(alarm.key)
        has_number = field is not None and not alarm.limit.startswith("is ")
        value = f", {alarm.value:.7g}" if has_number and alarm.value is not None else ""
        return f"{alarm.key} {alarm.limit}{value}{f' ({alarm.mode})' if alarm.mode else ''}"

    def _load(self, dictionary: Dictionary) -> None:
        """Go on where the archive has stopped; with nothing if that cannot be read."""
        at = now()
        self.alarms = Alarms(set(self._fields), at.ms, at.ms)
        try:
            with closing(read_only(self._spool.path, PATIENCE_S)) as db:
                self._restore(db, at)
                self._look_back(db, dictionary)
        except (sqlite3.Error, ArchiveError) as error:
            self._note("warning", f"alarms as they were cannot be read: {error}")
        self.alarms.changed.clear()

    def _restore(self, db: sqlite3.Connection, at: Now) -> None:
        (last,) = db.execute("SELECT max(id) FROM _violations").fetchone()
        self.alarms = Alarms(set(self._fields), at.ms, last or 0)
        violations = [Violation(**each) for each in stored_violations(db, lasting=True)]
        lasting = {each.key: each for each in violations}
        for key, alarm, shelf in stored_alarms(db):
            self.alarms.restore(key, alarm, shelf, lasting.get(key), at)

    def _look_back(self, db: sqlite3.Connection, dictionary: Dictionary) -> None:
        """Modes, and the time that rows must not be before, by the last rows."""
        for packet in self.limits.packets:
            names, ends = dictionary.down[packet].names, (-_LAST_MS, _LAST_MS)
            for time_ms, _, _, *values in latest(db, packet, names, *ends, 1, "received"):
                self._newest[packet] = time_ms, 0
                self._modes |= self.limits.modes_in(packet, values)


def _stored(what: Alarm | Shelf | None) -> str | None:
    return None if what is None else json_text(asdict(what), None, INFINITIES)


def _is_for_somebody(alarm: Alarm, is_to_be_acknowledged: bool) -> bool:
    """Whether an alarm is left to be acknowledged, or cleared by who knows that it was."""
    is_clearing = alarm.state == "latched" and not is_to_be_acknowledged
    return alarm.acknowledged_ms is None or is_clearing


def _several(keys: Iterable[str]) -> str:
    listed = list(keys)
    more = f" and {len(listed) - 20} more" if len(listed) > 20 else ""
    return f"{', '.join(listed[:20])}{more}"


def _because(text: str) -> str:
    return f" ({text})" if text else ""
