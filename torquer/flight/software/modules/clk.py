"""CLK, on-board time: set and shifted by command, saved each minute.

After SDOT App. A.
"""

from __future__ import annotations

import math

from torquer.flight.packets.frames import CLOCK_SAVED_S
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.modules.module import Module

#: File of the non-volatile memory that holds the time.
TIME = "time"


class Clk(Module):
    """Saves the time; a reboot loses what has passed since the last time, and the boot's."""

    name = "clk"
    period_s = CLOCK_SAVED_S

    def step(self, core) -> None:
        """Save the time."""
        core.memory.write(TIME, core.clock.save())

    def on_set_clock(self, core, values) -> Reason:
        """Set the time [ms since 2010-01-01]."""
        (time_ms,) = values
        if not math.isfinite(time_ms):
            return Reason.VALUE
        return self._set(core, int(time_ms) - core.clock.now_ms)

    def on_shift_clock(self, core, values) -> Reason:
        """Shift the time [ms]."""
        (shift_ms,) = values
        return self._set(core, int(shift_ms))

    def _set(self, core, shift_ms: int) -> Reason:
        code = core.clock.shift(shift_ms)
        if code is Reason.DONE:
            core.now_ms = core.clock.now_ms
            core.report("clk", Reason.TIME_SET, shift_ms)
            core.memory.write(TIME, core.clock.save())
        return code
