"""The ground's clock: that of this machine at the start, which then goes on whatever becomes of it.

A machine's clock may be set, by seconds or by a day. Times of reception and of commands would then
repeat or leap, commands would seem unanswered, and the log would be in another order. So all times
of a ground that runs are counted from its start, by a clock that cannot be set and that goes on
while the machine sleeps, where there is one.
"""

from __future__ import annotations

import time


def _steady_ns() -> int:
    if hasattr(time, "CLOCK_BOOTTIME"):
        return time.clock_gettime_ns(time.CLOCK_BOOTTIME)
    return time.monotonic_ns()


class GroundClock:
    """A clock that goes on from that of this machine."""

    def __init__(self) -> None:
        self._begun_ns = time.time_ns() - _steady_ns()

    def now_ms(self) -> int:
        """The time [ms since 1970, UTC]."""
        return (self._begun_ns + _steady_ns()) // 1_000_000

    def machine_ahead_ms(self) -> int:
        """By how much the machine's clock is ahead of this one [ms]: it was set meanwhile."""
        return time.time_ns() // 1_000_000 - self.now_ms()


_CLOCK = GroundClock()
#: The ground's time [ms since 1970, UTC], and by how much the machine's clock is ahead of it [ms].
now_ms, machine_ahead_ms = _CLOCK.now_ms, _CLOCK.machine_ahead_ms
