"""The compiler of a command: done without where that is enough, and its progress.

Compiling takes a while on the first run; loading the compiler's registries alone takes longer than
all that `validate` computes.
"""

import contextlib
import os
import sys
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path

from torquer.base.text_files import has_deep_key, limited_text
from torquer.cli.output import progress_bar

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

#: Whether this process does without the compiler that a run would use.
instead_of_compiler = False
_count = 0
_printed = False


def is_cold() -> bool:
    """Whether the simulation's loop has yet to be compiled, according to the cache."""
    from numba import config

    return not config.DISABLE_JIT and not _has_loop()  # type: ignore[attr-defined]


def _has_loop() -> bool:
    """Whether the simulation's loop is on the disk, compiled."""
    from torquer.compile.code_cache import FOLDER, READY, SOURCES

    folders = (FOLDER, READY and READY / SOURCES)
    loop = "torquer.simulation.loop/step._run_steps-*.nbi"
    return any(folder is not None and any(folder.glob(loop)) for folder in folders)


def ahead() -> bool:
    """Whether a run would compile the loop, although this process may do without the compiler."""
    return is_cold() or (instead_of_compiler and not _has_loop())


@contextlib.contextmanager
def counting(report: Callable[[float], None]) -> Iterator[None]:
    """Within the block, report the fraction of the compilation done, 0..1."""
    from numba.core import event

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
        print(f"note: {NOTE}", file=sys.stderr)
    _printed = True


def bars():
    """Bars with the elapsed time, which keeps counting while nothing else moves."""
    from rich.progress import TaskProgressColumn, TimeElapsedColumn

    return progress_bar(TaskProgressColumn(), TimeElapsedColumn())


def without_compiler(scenario: Path) -> None:
    """Use plain-Python kernels in this process if that is enough to check the scenario.

    Nothing changes if the package is already loaded, a law is in a file - the check is whether it
    compiles - or an orbit is integrated. Errors in the file are reported later.
    """
    global instead_of_compiler
    if "torquer.compile.engine" not in sys.modules and _needs_no_compiler(scenario):
        instead_of_compiler = os.environ.get("NUMBA_DISABLE_JIT", "0") == "0"
        os.environ["NUMBA_DISABLE_JIT"] = "1"


def _needs_no_compiler(path: Path) -> bool:
    try:
        text = limited_text(path)
        if has_deep_key(text):
            return False
        data = tomllib.loads(text)
        control, orbit = data.get("control", {}), data.get("orbit", {})
        laws = [control.get("law"), *control.get("laws", {}).values()]
        own = any("file" in law for law in laws if isinstance(law, dict))
        return not own and orbit.get("kind") != "numerical" and "campaign" not in data
    except (OSError, ValueError, AttributeError, TypeError, RecursionError):
        return False
