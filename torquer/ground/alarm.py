"""An alarm, a violation of a limit, a shelf: what is shown and stored of each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from torquer.ground.limits import RANK, UNKNOWN

#: Key of the alarm of an archive that takes nothing.
ARCHIVE_ALARM = "ground.archive"


class Now(NamedTuple):
    """The ground's time: of day [ms since 1970, UTC], and one that nobody sets [s]."""

    ms: int
    s: float


@dataclass
class Violation:
    """A time out of limits; times on board [ms since 1970], of the ground where it says so.

    `end_ms`: of the last row beyond; `is_over`: whether rows have been in order since. Shorter
    pauses than `SETTLE_S` are part of it, `count` the times that it was left and came again.
    """

    id: int
    key: str
    severity: str
    limit: str
    mode: str
    start_ms: int
    end_ms: int
    received_ms: int
    extreme: float
    count: int = 1
    is_over: bool = False
    acknowledged_by: str = ""
    acknowledged_ms: int | None = None
    comment: str = ""


@dataclass
class Alarm:
    """The alarm of a point; `number`: goes up when it is raised anew, so that what is acknowledged
    is what the operator has seen. `severity`: the worst, `condition`: that of the last rows.
    """

    key: str
    number: int
    severity: str
    condition: str
    limit: str
    mode: str
    since_ms: int
    raised_ms: int
    value: float | None
    extreme: float
    count: int = 1
    latched: bool = False
    signs: tuple[str, ...] = ()
    acknowledged_by: str = ""
    acknowledged_ms: int | None = None
    comment: str = ""

    @property
    def state(self) -> str:
        """Its state, as above."""
        is_beyond = RANK[self.condition] > 0 or self.condition == UNKNOWN
        if self.acknowledged_ms is None:
            return "active" if is_beyond else "returned"
        if is_beyond:
            return "acknowledged"
        return "latched" if self.latched else "settling"


@dataclass
class Shelf:
    """Until when a point calls for nobody, by the ground's time of day; who said so, and why."""

    until_ms: int
    by: str
    reason: str
    made_ms: int


class Event(NamedTuple):
    """Something that the log tells: `what`: raised, again, returned, closed, unshelved."""

    what: str
    alarm: Alarm
