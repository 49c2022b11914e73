"""Compiling in a process of its own, while this one compiles something else.

Numba compiles one function at a time in a process. The cache on the disk carries the code over: the
other process compiles into it, and this one finds it there. What goes wrong in the other process
costs time only, as what is not found is compiled here.
"""

import atexit
import importlib
import os
import pickle
import subprocess
import sys

from torquer.compile.code_cache import is_missing

_CHILD = (
    "import pickle, sys; sys.path[:] = pickle.load(sys.stdin.buffer);"
    "from torquer.compile.other_process import compile_given; compile_given()"
)


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def compile_in_other_process(function, signature) -> subprocess.Popen | None:
    """Begin to compile an entry's function in another process; None where it is not worth it.

    That is where the code is on the disk, or cannot be kept there, or there is one core only.
    """
    if cores() < 2 or not sys.executable or not is_missing(function, signature):
        return None
    plain, nowhere = function.py_func, subprocess.DEVNULL
    child = [sys.executable, "-c", _CHILD]
    try:
        given = pickle.dumps(sys.path)
        given += pickle.dumps((plain.__module__, plain.__name__, signature))
        begun = subprocess.Popen(child, stdin=subprocess.PIPE, stdout=nowhere, stderr=nowhere)
        with begun.stdin as pipe:  # type: ignore[union-attr]
            pipe.write(given)
    except (OSError, pickle.PicklingError):
        return None
    atexit.register(_end, begun)
    return begun


def _end(begun: subprocess.Popen) -> None:
    """Do not outlive this process."""
    begun.kill()
    begun.wait()


def compile_given() -> None:
    """In the other process: compile the entry whose module and function are named on its input."""
    module, name, signature = pickle.load(sys.stdin.buffer)
    entries = vars(importlib.import_module(module)).values()
    found = {getattr(getattr(each, "function", None), "__name__", ""): each for each in entries}
    found[name].compile(signature)
