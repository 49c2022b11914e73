"""Progress of a run, and before the first of compiling the kernels, which takes a while."""

import contextlib
import sys
from collections.abc import Callable, Iterator

from torquer.base.language import told
from torquer.cli.output import progress_bar
from torquer.compile.when_compiling import COMPILED

NOTE = "compiling, once, about half a minute"
#: What `validate` says of it, apart from the time of computing.
AHEAD = (
    "before that the first run compiles the simulation, once: half a minute to a minute (the cache "
    "does not hold it yet)"
)
#: Number of functions that a run compiles with an empty cache: the simulation of Chibis-M.
_FUNCTIONS = 340
#: Fraction of the time after which all of them are counted; then the last, which hold all others,
#: are optimised.
_KNOWN = 0.88

_count = 0
_printed = False


def is_cold() -> bool:
    """Whether the simulation's loop has yet to be compiled, according to the cache."""
    return COMPILED and not _has_loop()


def _has_loop() -> bool:
    """Whether the simulation's loop is on the disk, compiled."""
    from torquer.compile.code_cache import FOLDER, READY, SOURCES

    folders = (FOLDER, READY and READY / SOURCES)
    loop = "torquer.simulation.loop/step._run_steps-*.nbi"
    return any(folder is not None and any(folder.glob(loop)) for folder in folders)


@contextlib.contextmanager
def counting(report: Callable[[float], None]) -> Iterator[None]:
    """Within the block, report the fraction of the compilation done, 0..1."""
    from torquer.compile.numba_private import event

    class Count(event.Listener):
        def on_start(self, each) -> None:
            """Nothing: a function counts when it is compiled."""

        def on_end(self, each) -> None:
            global _count
            _count += 1
            report(min(_KNOWN * _count / _FUNCTIONS, _KNOWN))

    listener = Count()
    event.register("numba:compile", listener)
    try:
        yield
    finally:
        event.unregister("numba:compile", listener)


@contextlib.contextmanager
def compiling_shown() -> Iterator[None]:
    """For work that may compile and shows no other progress: a bar on a terminal, else a note."""
    if not is_cold():
        yield
        return
    if not sys.stderr.isatty():
        print_once()
        yield
        return
    with bars() as shown:
        task = shown.add_task(NOTE, total=1.0)
        with counting(lambda part: shown.update(task, completed=part)):
            yield


def print_once() -> None:
    """Print the note once in a process, where there is no terminal for a bar."""
    global _printed
    if not _printed:
        print(told(f"note: {NOTE}"), file=sys.stderr)
    _printed = True


def bars():
    """Bars with the elapsed time, which keeps counting while nothing else moves."""
    from rich.progress import TaskProgressColumn, TimeElapsedColumn

    return progress_bar(TaskProgressColumn(), TimeElapsedColumn())


@contextlib.contextmanager
def show_progress(name: str, total: float | None = 1.0):
    """Progress callback for a bar on a terminal; None elsewhere.

    Without a `total`, for work of minutes that counts nothing, the bar moves to and fro.
    """
    cold = is_cold()
    if not sys.stderr.isatty():
        if cold:
            print_once()
        yield None
        return
    with bars() as shown, contextlib.ExitStack() as stack:
        task = shown.add_task(name, total=total, visible=not cold or total is None)
        if not cold:
            yield lambda part: shown.update(task, completed=part)
            return
        first = shown.add_task(NOTE, total=1.0)
        stack.enter_context(counting(lambda part: shown.update(first, completed=part)))

        def update(part: float) -> None:  # from now on all is compiled
            shown.update(first, visible=False)
            shown.update(task, completed=part, visible=True)

        yield update
