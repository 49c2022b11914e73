"""Whether and how kernels are compiled, and what Numba must be told before it compiles the first.

Loading the compiler takes longer than checking a scenario. So kernels are given to it when they are
first called, and what they need of it, such as the compiled form of a Python function, waits here.
"""

import contextlib
import os
import sys
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from typing import Any

#: Numba reads its settings from here, too.
_SETTINGS = ".numba_config.yaml"


def _compiles() -> bool:
    """What Numba's settings say; it is loaded only where they may be in a file."""
    if sys.modules.get("numba") or os.path.exists(_SETTINGS):
        import numba

        return not numba.config.DISABLE_JIT
    try:
        return not int(os.environ.get("NUMBA_DISABLE_JIT", "0"))
    except ValueError:  # Numba takes it as not given
        return True


#: True when kernels are compiled (False under NUMBA_DISABLE_JIT=1, as the coverage run has it).
COMPILED = _compiles()

#: How all kernels are compiled. No `fastmath`, not even 'contract': which products are fused into
#: an addition would be the compiler's choice, which changes from one compilation to the next.
OPTIONS: Any = {"error_model": "numpy"}
#: Without the code to be called from Python: that unpacks every cell of nested arguments and takes
#: longer to compile than the function itself. (Called from there it ends the process.)
FOR_KERNELS: Any = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
#: How loops over lanes are compiled: they become vectors before LLVM puts them in their place.
LOOP_OPTIONS: Any = {**OPTIONS, **FOR_KERNELS, "forceinline": True}

#: Whether kernels run as Python here, though they can be compiled.
is_plain: ContextVar[bool] = ContextVar("is_plain", default=False)

#: Whether a kernel that Python calls runs as Python, by its arguments: the compiler may not know
#: them. None: no kernel does.
needs_python: ContextVar[Callable[[Any], bool] | None] = ContextVar("needs_python", default=None)


@contextlib.contextmanager
def plainly(plain: bool = True) -> Iterator[None]:
    """Within the block, kernels that Python calls run as Python, which gives the same bits.

    For a check that calls them for a few numbers: loading the compiler takes longer than that.
    `plain`: False for a part of such a check that computes much.
    """
    before = is_plain.set(plain)
    try:
        yield
    finally:
        is_plain.reset(before)


_waiting: list[Callable] = []
_is_loaded = False


def when_compiling(tell: Callable[[], Any]) -> Callable[[], Any]:
    """Decorator: run a function once, when Numba is there; never where nothing is compiled.

    @when_compiling
    def overload_it():
        from numba.extending import overload
        ...
    """
    if COMPILED:
        _waiting.append(tell)
        if _is_loaded:
            _tell_all()
    return tell


def numba_is_loaded() -> None:
    """Run what waits; what comes later does not wait. (`numba_private` calls this.)"""
    global _is_loaded
    _is_loaded = True
    _tell_all()


def _tell_all() -> None:
    while _waiting:
        _waiting.pop(0)()
