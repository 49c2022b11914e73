"""What the log says of archive, counters and clock: when something goes wrong, and is over."""

from __future__ import annotations

from collections.abc import Iterator

from torquer.base.dates import table_utc
from torquer.ground.ground_clock import machine_ahead_ms
from torquer.ground.kept_counters import KeptCounters
from torquer.ground.spool import Spool

#: By how much the machine's clock may differ from the ground's before the log says so [ms].
_AHEAD_MS = 2000


class StorageReport:
    """News of a spool and of counters; `news` is to be asked for now and then."""

    def __init__(self, spool: Spool, counters: KeptCounters):
        self._spool, self._counters = spool, counters
        self._is_wrong: dict[str, bool] = {}
        self._ahead_ms = 0

    def news(self) -> Iterator[tuple[str, str]]:
        """Severity and text of what is new."""
        yield from self._spool.notes()
        since_ms = self._spool.since_ms
        if self._has_become_wrong("archive", since_ms is not None):
            reason = self._spool.reason or "it is slow"
            yield "alarm", f"not archived since {table_utc(since_ms or 0)} UTC: {reason}"
        if (made_up := self._spool.made_up()) is not None:
            late, lost = made_up
            text = f"archived again: {late} rows archived late, {lost} lost"
            yield ("alarm" if lost else "info"), text
        why = self._counters.trouble()
        if self._has_become_wrong("counters", why is not None):
            yield "alarm", f"commands may have to wait, as their counter cannot be kept: {why}"
        yield from self._clock()

    def _clock(self) -> Iterator[tuple[str, str]]:
        by_ms = machine_ahead_ms() - self._ahead_ms
        if abs(by_ms) > _AHEAD_MS:
            self._ahead_ms += by_ms
            yield (
                "warning",
                f"the clock of this machine was set by {by_ms * 1e-3:+.0f} s: times of reception "
                "go on by the old one until the ground is started again",
            )

    def _has_become_wrong(self, what: str, is_wrong: bool) -> bool:
        was_wrong, self._is_wrong[what] = self._is_wrong.get(what, False), is_wrong
        return is_wrong and not was_wrong
