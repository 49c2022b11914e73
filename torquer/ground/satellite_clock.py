"""The satellite's clock as the ground knows it: by the latest telemetry, and how fast it goes."""

from __future__ import annotations

import time

from torquer.ground.archive import EPOCH_MS

#: Time over which the pace of the clock is measured [s].
_PACED_S = 2.0
#: Farthest second of the clock that a header can name [s].
_FARTHEST_S = 30_000.0


class SatelliteClock:
    """Follows the times of telemetry; a simulated satellite's may go at many times real time.

    `latest_ms`: the last time that was heard of [ms since 1970], or None.
    """

    def __init__(self) -> None:
        self.latest_ms: int | None = None
        self._heard_s = 0.0
        self._begun: tuple[float, int] | None = None
        self._pace: float | None = None

    def hear(self, clock_ms: int) -> None:
        """Note a time in new telemetry."""
        self.latest_ms, self._heard_s = clock_ms, time.monotonic()
        if self._begun is None:
            self._begun = self._heard_s, clock_ms
        since_s = self._heard_s - self._begun[0]
        if since_s >= _PACED_S:
            self._pace = (clock_ms - self._begun[1]) * 1e-3 / since_s
            self._begun = self._heard_s, clock_ms

    def now_ms(self) -> int | None:
        """The clock now, at the pace of real time since it was heard of; None if it never was."""
        if self.latest_ms is None:
            return None
        return self.latest_ms + round(1e3 * (time.monotonic() - self._heard_s))

    def seconds_in(self, wait_s: float) -> float | None:
        """The clock [s since 2010] a while from now, at its own pace.

        None until the pace is known, and where no header can name the time: a clock that was set
        meanwhile, or one that goes too fast.
        """
        if self.latest_ms is None or self._pace is None:
            return None
        by_s = self._pace * (time.monotonic() - self._heard_s + wait_s)
        if not wait_s / 2 <= by_s <= _FARTHEST_S:
            return None
        return (self.latest_ms - EPOCH_MS) * 1e-3 + by_s
