"""Independent pieces of drawing, in parallel on the available processors.

Each share has its own process, forked from this one, which has everything loaded: drawing holds
Python's lock, so threads would not help. Where forking is not safe (Windows, macOS, other threads
at work), everything is done here.
"""

import multiprocessing
import os
import sys
import threading
from collections.abc import Callable, Sequence

#: More shares than this do not pay: the slowest piece takes a quarter of the time.
_MOST = 4


def done_side_by_side(
    pieces: Sequence[Callable[[], object]],
    last: Callable[[], object],
    progress: Callable[[float], None] | None = None,
) -> None:
    """Call all pieces, the first one in this process, followed here by `last`.

    A share that fails in its process is done again here, where its error is raised. `progress` is
    called with the fraction done, 0..1.
    """
    count = _shares()
    mine, *others = (list(pieces[k::count]) for k in range(count))
    running = [(_split_off(share), share) for share in others if share]
    try:
        _do([*mine, last], progress)
        for process, share in running:
            process.join()
            if process.exitcode != 0:
                _do(share)
        if progress:
            progress(1.0)
    finally:
        for process, _ in running:
            process.kill()
            process.join()


def _shares() -> int:
    alone = threading.active_count() == 1 and threading.current_thread() is threading.main_thread()
    if sys.platform != "linux" or not alone:
        return 1
    return min(_MOST, len(os.sched_getaffinity(0)))


def _do(share, progress=None) -> None:
    for done, piece in enumerate(share, 1):
        piece()
        if progress:
            progress(0.95 * done / len(share))


def _split_off(share):
    """A forked process that does a share."""
    process = multiprocessing.get_context("fork").Process(target=_try, args=(share,))
    process.start()
    return process


def _try(share) -> None:
    """Do a share; its error is left to the process that does it again."""
    try:
        _do(share)
    except Exception:
        sys.exit(1)
