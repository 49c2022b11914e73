"""The command line: `main`, which can be interrupted cleanly before anything slow is imported."""

import contextlib
import gc
import os
import signal
import sys
import threading

from torquer.cli.output import let_streams_take_any_text

#: A signal ends a command with this code and its own number.
SIGNAL_CODE = 128
FAILED_CODE, INTERRUPTED_CODE = 1, SIGNAL_CODE + signal.SIGINT
#: Whether the process is the command's own: it may then be set up for this command alone.
own_process = False
#: When Python looks for garbage: seldom, as a command imports much and leaves little; a tenth of
#: the time of a short run.
_GARBAGE = (500_000, 50, 100)


def main(arguments: list[str] | None = None) -> None:
    """Entry point: exit code 0 on success, 1 if a run failed or a verdict differs from the declared
    one, 2 on a user error, 130 on an interrupt."""
    global own_process
    own_process = arguments is None
    if own_process:
        gc.set_threshold(*_GARBAGE)
    let_streams_take_any_text()
    try:
        with _interrupts_of_imports():
            from torquer.cli.answer import answer

            code = answer(arguments)
    except KeyboardInterrupt:
        print("error: interrupted", file=sys.stderr)
        code = INTERRUPTED_CODE
    if own_process:
        gc.freeze()  # otherwise Python collects garbage as it exits, which takes half a second
    sys.exit(code)


@contextlib.contextmanager
def _interrupts_of_imports():
    """Within the block an interrupt during an import ends the process at once.

    An exception there may be mistaken for a missing module or be replaced by another. After the
    block nothing is left to save, and an interrupt ends the command's own process: an exception
    while Python ends would be a traceback.
    """
    usual = signal.getsignal(signal.SIGINT)
    in_main = threading.current_thread() is threading.main_thread()
    if usual is not signal.default_int_handler or not in_main:  # ignored, or a caller's own
        yield
        return
    signal.signal(signal.SIGINT, leave_or_raise)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL if own_process else usual)


def leave_or_raise(number, frame) -> None:
    """Interrupt handler: end the process during an import, else raise KeyboardInterrupt."""
    while frame:
        if frame.f_code.co_filename == "<frozen importlib._bootstrap>":
            os.write(2, b"error: interrupted\n")
            os._exit(INTERRUPTED_CODE)
        frame = frame.f_back
    raise KeyboardInterrupt
