"""What the libraries of a server say: one line a cause on the error stream, never a traceback."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import sys
from collections.abc import Callable, Iterator

#: Loggers of what serves pages.
_LOGGERS = ("uvicorn", "uvicorn.error", "uvicorn.access", "asyncio", "websockets")
_LONGEST = 200


def say_on_stderr(line: str) -> None:
    """Print a line, if anybody still reads."""
    with contextlib.suppress(OSError, ValueError):
        print(line, file=sys.stderr, flush=True)


class _Handler(logging.Handler):
    def __init__(self, note: Callable[[str], None]):
        super().__init__(logging.WARNING)
        self._note = note

    def emit(self, record: logging.LogRecord) -> None:
        self._note(one_line(record.getMessage(), record.exc_info[1] if record.exc_info else None))


@contextlib.contextmanager
def quietly(note: Callable[[str], None]) -> Iterator[None]:
    """Within the block, `note(line)` gets what the libraries would print."""
    handler = _Handler(note)
    loggers = [logging.getLogger(name) for name in _LOGGERS]
    before = [(each.handlers[:], each.propagate, each.level) for each in loggers]
    for each in loggers:
        each.handlers, each.propagate = [handler], False
        each.setLevel(logging.WARNING)
    try:
        yield
    finally:
        for each, (handlers, propagate, level) in zip(loggers, before, strict=True):
            each.handlers, each.propagate = handlers, propagate
            each.setLevel(level)


def watch_loop(note: Callable[[str], None]) -> None:
    """Let `note(line)` get the errors of the running loop, such as a lack of file descriptors."""

    def handle(loop: asyncio.AbstractEventLoop, context: dict) -> None:
        note(one_line(str(context.get("message", "error")), context.get("exception")))

    asyncio.get_running_loop().set_exception_handler(handle)


def one_line(message: str, error: BaseException | None) -> str:
    """A message with its cause in one short line, which controls no terminal."""
    why = f": {type(error).__name__}: {error}" if error is not None else ""
    line = " ".join(f"{message}{why}".split())[:_LONGEST]
    return "".join(each if each.isprintable() else ascii(each)[1:-1] for each in line)
