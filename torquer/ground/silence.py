"""Whether a satellite that sends regularly has fallen silent, by the pace at which frames came."""

from __future__ import annotations

from collections import deque
from statistics import median

#: Silence that is always allowed, and that of a link whose pace is not known yet [s].
LEAST_S, UNKNOWN_S = 2.5, 30.0
#: Intervals that a silence must last, of the median of the last ones; how many these are.
INTERVALS, _KEPT = 3.0, 9


class Pace:
    """Times at which frames came; all times in seconds of a clock that is not set."""

    def __init__(self) -> None:
        self._intervals: deque[float] = deque(maxlen=_KEPT)
        self._last_s: float | None = None

    def hear(self, now_s: float) -> None:
        """Note that frames have come."""
        if self._last_s is not None:
            self._intervals.append(now_s - self._last_s)
        self._last_s = now_s

    def allowed_s(self) -> float:
        """How long a silence may last: the median, so that one long gap does not change it."""
        if len(self._intervals) < 2:
            return UNKNOWN_S
        return max(LEAST_S, INTERVALS * median(self._intervals))

    def is_silent(self, now_s: float) -> bool:
        """Whether frames have come, and none for longer than is allowed."""
        return self._last_s is not None and now_s - self._last_s > self.allowed_s()
