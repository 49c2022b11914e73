"""Requests to stop by signals: noted at once, acted on where nothing can be lost.

An exception inside the glue of compiled code, or inside a write, loses the run. So a signal is
noted; the run looks at the note between its pieces, and laws in plain Python are left at once.
"""

import contextlib
import signal
import threading
import time
from collections.abc import Iterator

#: A run that has not acted on a signal after this time [s] is ended by the next one.
PATIENCE_S = 2.0
#: What runs heed by themselves, and what the command line does.
INTERRUPT = (signal.SIGINT,)
ALL = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)


class Stop:
    """The signals that came: the last one's number, how many, since when."""

    def __init__(self) -> None:
        self.number, self.count = 0, 0
        self._since_s = 0.0
        self._at_once = False
        self._writing = 0

    @property
    def asked(self) -> bool:
        """Whether a signal came."""
        return self.count > 0

    def note(self, number: int, frame) -> None:
        """The handler of a signal."""
        now_s = time.monotonic()
        impatient = self.asked and now_s - self._since_s > PATIENCE_S
        if not self.asked:
            self._since_s = now_s
        self.number, self.count = number, self.count + 1
        if not self._writing and (self._at_once or impatient):
            raise KeyboardInterrupt

    def forget(self) -> None:
        """As if no signal had come yet."""
        self.count = 0

    def interrupt_at_once(self, at_once: bool) -> bool:
        """Whether a signal raises KeyboardInterrupt from now on, where nothing is lost by it.

        Returns whether it did so before.
        """
        before, self._at_once = self._at_once, at_once
        if at_once and self.asked:
            self._at_once = before
            raise KeyboardInterrupt
        return before

    @contextlib.contextmanager
    def raising(self) -> Iterator[None]:
        """Within the block, where nothing is lost by it, a signal raises KeyboardInterrupt."""
        before = self.interrupt_at_once(True)
        try:
            yield
        except Exception:
            if self.asked:  # the glue of compiled code turns it into another error
                raise KeyboardInterrupt from None
            raise
        finally:
            self._at_once = before

    @contextlib.contextmanager
    def writing(self) -> Iterator[None]:
        """Within the block nothing is raised; after it, if there was more than one signal."""
        self._writing += 1
        try:
            yield
        finally:
            self._writing -= 1
        if self.count > 1 and not self._writing:
            raise KeyboardInterrupt


_noted: Stop | None = None


def noted_signals() -> Stop:
    """The signals that are noted now; one that nothing comes to, if none are."""
    return Stop() if _noted is None else _noted


@contextlib.contextmanager
def noting_signals(signals: tuple = INTERRUPT, instead_of: tuple = ()) -> Iterator[Stop]:
    """Within the block signals are noted; an inner block shares the notes of the outer one.

    A signal that the block leaves noted, when it ends without an error, is sent again after it.
    Left alone: signals that the caller handles or ignores, but for handlers in `instead_of`, and
    all of them outside the main thread.
    """
    global _noted
    if _noted is not None or threading.current_thread() is not threading.main_thread():
        yield noted_signals()
        return
    stop = _noted = Stop()
    usual = {number: signal.getsignal(number) for number in signals}
    free = (signal.SIG_DFL, signal.default_int_handler, *instead_of)
    ours = [number for number, handler in usual.items() if handler in free]
    try:
        for number in ours:
            signal.signal(number, stop.note)
        yield stop
    finally:
        for number in ours:
            signal.signal(number, usual[number])
        _noted = None
    if stop.asked:
        signal.raise_signal(stop.number)
