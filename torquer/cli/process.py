"""The process of a command: its exit codes, and how an interrupt ends it."""

import contextlib
import os
import signal
import sys
import threading

#: A signal ends a command with this code and its own number.
SIGNAL_CODE = 128
FAILED_CODE, INTERRUPTED_CODE = 1, SIGNAL_CODE + signal.SIGINT
#: Whether the process is the command's own: it may then be set up for this command alone.
own_process = False
#: What xarray and pandas import wherever it is installed, and a run does not use: a fifth of the
#: processor time of a short one.
_UNUSED = ("dask", "pyarrow")
#: Where OpenBLAS looks for the number of NumPy's threads; the first is what it takes before others.
_THREADS = (
    "OPENBLAS_NUM_THREADS",
    "OPENBLAS_DEFAULT_NUM_THREADS",
    "GOTO_NUM_THREADS",
    "OMP_NUM_THREADS",
)


def leave_out_unused() -> None:
    """Let the command's own process find those packages missing that it would import in vain.

    Not for code of the user's own, which may use them.
    """
    if own_process:
        for name in _UNUSED:
            sys.modules.setdefault(name, None)  # type: ignore[arg-type]  # how Python notes it


def ask_for_one_thread() -> None:
    """Let NumPy have one thread, unless the user asks for a number; before it is imported.

    Others spin while they wait, and sums over many rows would depend on their number.
    """
    if not any(os.environ.get(name) for name in _THREADS):
        os.environ[_THREADS[0]] = "1"


@contextlib.contextmanager
def interrupt_imports():
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
