"""The log of satellite and ground searched back through the whole archive, a bounded way."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Iterator
from itertools import islice
from typing import NamedTuple

from torquer.flight.packets.dictionary import Dictionary
from torquer.ground.history import entries_of_ground, entries_of_satellite, reception

#: Severities of entries, the least first.
SEVERITIES = ("info", "warning", "alarm")
#: Most entries of each source that a search looks at, the newest first.
MOST_SEARCHED = 500_000


class LogQuery(NamedTuple):
    """What is searched: a span of on-board time [ms since 1970], the least severity, whose entries
    ("": all), what their text has in it, in any case of letters.
    """

    start_ms: int = -(2**53)
    end_ms: int = 2**53
    severity: str = "info"
    source: str = ""
    text: str = ""

    def has(self, entry: dict) -> bool:
        """Whether an entry is looked for."""
        is_bad = SEVERITIES.index(entry["severity"]) >= SEVERITIES.index(self.severity)
        return is_bad and self.text.casefold() in entry["text"].casefold()


def search(
    db: sqlite3.Connection, dictionary: Dictionary, query: LogQuery, size: int
) -> tuple[list[dict], bool]:
    """The newest entries that a query looks for, newest first, and whether none was left unseen.

    Up to `size` entries, of the newest `MOST_SEARCHED` of satellite and ground each.
    """
    span = query.start_ms, query.end_ms
    sources = {
        "ground": lambda: entries_of_ground(db, *span),
        "satellite": lambda: entries_of_satellite(db, dictionary, *span),
    }
    asked = [source for source in sources if query.source in ("", source)]
    found = [_matching(sources[source](), query, size) for source in asked]
    entries = sorted((each for some, _ in found for each in some), key=reception, reverse=True)
    return entries[:size], all(is_all for _, is_all in found) and len(entries) <= size


def _matching(entries: Iterable[dict], query: LogQuery, size: int) -> tuple[list[dict], bool]:
    """Up to one more than `size` entries, and whether all there are were looked at."""
    rest = iter(entries)
    looked_at = islice(rest, MOST_SEARCHED)
    found = list(islice(filter(query.has, looked_at), size + 1))
    return found, len(found) <= size and not _has_more(rest)


def _has_more(entries: Iterator[dict]) -> bool:
    return next(entries, None) is not None
