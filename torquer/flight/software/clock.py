"""On-board time: milliseconds since 2010-01-01 UTC in steps of 10 ms.

As SDOT 3.4 describes it, the timer always runs; it is right once it has been set by command. It is
saved each minute and at a regular reboot, and restored at boot: it has then lost the time between.

Like civil time on most computers it has no leap seconds; the command that corrects the clock also
takes out the second that a leap second leaves.
"""

import struct
from datetime import datetime, timedelta

from torquer.flight.packets.frames import EPOCH
from torquer.flight.packets.reasons import Reason

#: Resolution [ms].
STEP_MS = 10
#: Greatest time [ms]: the last step of the seconds that a u32 holds, in the year 2146.
LAST_MS = 2**32 * 1000 - STEP_MS
_SAVED = struct.Struct("<Q")


def to_ms(utc: datetime) -> int:
    """On-board time [ms] of a civil time with a zone, rounded down to the step."""
    return (utc - EPOCH) // timedelta(milliseconds=STEP_MS) * STEP_MS


def timer_ms(t_s: float) -> int:
    """Reading of the timer [ms] at a time of the run [s], rounded down to the step.

    Rounding to a microsecond comes first: 0.29 s are 29 steps, whatever a float makes of it.
    """
    return round(t_s * 1e6) // (1000 * STEP_MS) * STEP_MS


class Clock:
    """The clock; monotone unless it is set. Plain integers that can be copied.

    `now_ms`, `now_s`: on-board time; it stays within 0..`LAST_MS` and does not wrap.
    `is_set`: whether it was set since it was started.
    """

    def __init__(self, t_s: float = 0.0, now_ms: int = 0):
        """A clock started at the time `t_s` of the run, at `now_ms`, within 0..`LAST_MS`."""
        self._timer_ms = timer_ms(t_s)
        self.now_ms = min(max(now_ms, 0), LAST_MS) // STEP_MS * STEP_MS
        self.is_set = False

    @property
    def now_s(self) -> int:
        """Whole seconds of on-board time: the time stamp of frames, a u32."""
        return self.now_ms // 1000

    def run_to(self, t_s: float) -> int:
        """Go on to a time of the run [s]; the on-board time [ms]. An earlier time is ignored."""
        timer = timer_ms(t_s)
        if timer > self._timer_ms:
            self.now_ms = min(self.now_ms + timer - self._timer_ms, LAST_MS)
            self._timer_ms = timer
        return self.now_ms

    def set(self, now_ms: int) -> Reason:
        """Set the time, rounded down to the step; VALUE, and no change, beyond 0..`LAST_MS`."""
        if not 0 <= now_ms < LAST_MS + STEP_MS:
            return Reason.VALUE
        self.now_ms = int(now_ms) // STEP_MS * STEP_MS
        self.is_set = True
        return Reason.DONE

    def shift(self, by_ms: int) -> Reason:
        """Set the time to a later (or, negative, earlier) one; VALUE as `set`."""
        return self.set(self.now_ms + by_ms)

    def save(self) -> bytes:
        """The time for the non-volatile memory: u64 [ms], little-endian."""
        return _SAVED.pack(self.now_ms)

    def restore(self, data: bytes | None) -> Reason:
        """Take over what `save` gave; TIME_LOST, and time zero, for anything else."""
        saved = _SAVED.unpack(data)[0] if data is not None and len(data) == _SAVED.size else -1
        valid = 0 <= saved <= LAST_MS
        self.now_ms = saved // STEP_MS * STEP_MS if valid else 0
        self.is_set = False
        return Reason.DONE if valid else Reason.TIME_LOST
