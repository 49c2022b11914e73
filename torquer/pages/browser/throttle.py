"""Says of each cause at once that it is there, and then only now and then how often it came."""

from __future__ import annotations

import time
from collections.abc import Callable

#: First and longest pause between two lines on one cause [s]; each is twice the one before.
PAUSES_S = 1.0, 60.0
#: Most causes that are told apart; the others are one.
MOST_CAUSES = 50
_OTHERS = "others"


class _Cause:
    def __init__(self) -> None:
        self.count, self.due_s, self.pause_s, self.what = 0, 0.0, PAUSES_S[0], ""


class Throttle:
    """Calls `say(line)`: at the first of a cause, and then after pauses for as long as it lasts."""

    def __init__(self, say: Callable[[str], None], clock: Callable[[], float] = time.monotonic):
        self._say, self._clock = say, clock
        self._causes: dict[str, _Cause] = {}

    def note(self, cause: str, what: str = "") -> None:
        """Note that something happened, `what` this time."""
        if cause not in self._causes and len(self._causes) >= MOST_CAUSES:
            cause = _OTHERS
        found = self._causes.setdefault(cause, _Cause())
        found.count, found.what = found.count + 1, what
        self._tell(cause, found)

    def flush(self) -> None:
        """Say what was counted since the last line, where it is time; forget what is over."""
        for cause, found in list(self._causes.items()):
            if found.count:
                self._tell(cause, found)
            elif self._clock() >= found.due_s + found.pause_s:
                del self._causes[cause]

    def _tell(self, cause: str, found: _Cause) -> None:
        now_s = self._clock()
        if now_s < found.due_s:
            return
        found.due_s, found.pause_s = now_s + found.pause_s, min(2.0 * found.pause_s, PAUSES_S[1])
        more = f" and {found.count - 1} more" if found.count > 1 else ""
        found.count = 0
        self._say(f"{cause}{f' ({found.what})' * bool(found.what)}{more}")
