"""The compute engine: one decorator for every kernel, and a compiled cache that cannot go stale.

A *kernel* is a pure function of numbers, tuples and `float64` arrays: no
allocation, no exceptions, no strings, no globals that change. Vectors are
3-tuples, so they live in registers.

Numba's own disk cache does not notice an edited callee in another file. The
cache folder is therefore named by a hash of all sources that hold kernels:
edit one, and the next process compiles afresh.
"""

import contextlib
import hashlib
import os
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numba
import numpy as np
from numba import types
from numba.core import cgutils
from numba.core.caching import NullCache
from numba.extending import intrinsic, overload

PACKAGE = Path(__file__).parent
#: Rooms without kernels: editing them must not throw compiled code away.
ROOMS_WITHOUT_KERNELS = (
    "notes",
    "scenario",
    "analysis",
    "report",
    "gallery",
    "cli",
    "__init__.py",
    "__main__.py",
)


def source_key() -> str:
    """Hash of the Numba version and of every source file that can hold a kernel."""
    digest = hashlib.sha256(f"{numba.__version__} {sys.version}".encode())
    for path in sorted(PACKAGE.rglob("*.py")):
        place = path.relative_to(PACKAGE)
        if place.parts[0] not in ROOMS_WITHOUT_KERNELS:
            digest.update(str(place).encode() + path.read_bytes())
    return digest.hexdigest()[:16]


def cache_root() -> Path:
    """Folder of compiled kernels; `TORQUER_CACHE_DIR` moves it."""
    if chosen := os.environ.get("TORQUER_CACHE_DIR"):
        return Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    return (Path(base) if base else Path.home() / ".cache") / "torquer"


def _use_cache() -> None:
    folder = cache_root() / source_key()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:  # a read-only home: compiled code is still kept for this machine and user
        # (the name must not be importable: a script in the temporary folder would find it first)
        user = getattr(os, "getuid", lambda: "user")()
        folder = Path(tempfile.gettempdir()) / f"torquer-cache-{user}" / source_key()
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    numba.config.CACHE_DIR = str(folder)


_use_cache()

#: True when kernels are compiled (False under NUMBA_DISABLE_JIT=1, as the coverage run has it).
COMPILED = not numba.config.DISABLE_JIT

#: How all kernels are compiled; 'contract' allows fused multiply-add and nothing else.
OPTIONS: Any = {"error_model": "numpy", "fastmath": {"contract"}}
#: Without the code to be called from Python: that unpacks every array of a nested record and takes
#: longer to compile than the function itself. (Called from there it ends the process.)
_KERNELS_ONLY = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
#: The one decorator for kernels.
kernel = numba.njit(**OPTIONS, cache=True)
#: The same, letting other threads run meanwhile: for maps and charts on all cores.
released = numba.njit(**OPTIONS, cache=True, nogil=True)
#: The same for small kernels of inner loops: always inlined by LLVM, which removes the reference
#: counting of arrays that cross the call.
inlined = numba.njit(**OPTIONS, cache=True, forceinline=True)
#: The same for what kernels alone call, never Python.
internal = numba.njit(**OPTIONS, cache=True, forceinline=True, **_KERNELS_ONLY)
#: For what kernels alone call and is too large to be inlined.
inner = numba.njit(**OPTIONS, cache=True, **_KERNELS_ONLY)


def with_attributes(value):
    """Arrays of records, also within tuples, with their fields as attributes, for plain Python."""
    if isinstance(value, tuple):
        parts = map(with_attributes, value)
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    named = isinstance(value, np.ndarray) and value.dtype.names is not None
    return value.view(np.recarray) if named else value


def records(value):
    """The same for kernels: without the compiler they are plain Python."""
    return value if COMPILED else with_attributes(value)


def _without_owner(context, builder, of_type, value):
    """The value with every array in it, however deep in tuples, cut from its reference count."""
    if isinstance(of_type, types.BaseTuple):
        parts = cgutils.unpack_tuple(builder, value)
        parts = [
            _without_owner(context, builder, t, v) for t, v in zip(of_type, parts, strict=True)
        ]
        return context.make_tuple(builder, of_type, parts)
    if isinstance(of_type, types.Array):
        view = context.make_array(of_type)(context, builder, value)
        view.meminfo = cgutils.get_null_value(view.meminfo.type)
        view.parent = cgutils.get_null_value(view.parent.type)
        return view._getvalue()
    return value


@intrinsic
def _cut(typing_context, value):
    def build(context, builder, signature, arguments):
        return _without_owner(context, builder, value, arguments[0])

    return value(value), build


def without_reference_counts(value):
    """The same arrays (also within tuples) without their reference counts.

    For a kernel's own arguments, which its caller keeps alive: each call that an array crosses
    would cost two locked instructions. In plain Python there is nothing to cut.
    """
    return value


@overload(without_reference_counts)
def _without_reference_counts(value):
    return lambda value: _cut(value)


class FirstClass(types.WrapperAddressProtocol):
    """A compiled plug-in as kernels take it: an address and a signature.

    What calls it is compiled once for all plug-ins of a kind, and every process finds that code
    in the cache.
    """

    def __init__(self, dispatcher, signature):
        from numba.experimental.function_type import _get_wrapper_address

        self.compiled = dispatcher
        self.address = address_of(dispatcher, signature)
        self._signature = signature
        self._address = _get_wrapper_address(dispatcher, signature)

    def __wrapper_address__(self):
        return self._address

    def signature(self):
        return self._signature


def caller(signature):
    """A function that calls another of this signature by its address, at the speed of a call.

    Which function it is, is a number: what calls it is compiled once for all and found in the
    cache by every process. (Numba's own first-class functions cost 30 us each to hand over.) A
    plain function in place of the address is called as it is.
    """

    def call(function, *arguments):
        return function(*arguments)

    @intrinsic
    def by_address(typing_context, address, arguments):
        def build(context, builder, _, values):
            made = context.call_conv.get_function_type(signature.return_type, signature.args)
            pointer = builder.inttoptr(values[0], made.as_pointer())
            parts = cgutils.unpack_tuple(builder, values[1])
            _, answer = context.call_conv.call_function(
                builder, pointer, signature.return_type, signature.args, parts
            )
            return answer

        return signature.return_type(address, arguments), build

    @overload(call)
    def _call(function, *arguments):
        if isinstance(function, types.Integer):
            return lambda function, *arguments: by_address(function, arguments)
        return lambda function, *arguments: function(*arguments)

    return call


def address_of(dispatcher, signature) -> int:
    """Address of a compiled function for `caller`; valid as long as the dispatcher lives."""
    compiled = dispatcher.get_compile_result(signature)
    return compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)


def processor() -> str:
    """Kind of processor that is compiled for: its name and a mark of its instructions."""
    name = numba.config.CPU_NAME or llvm.get_host_cpu_name()
    features = numba.config.CPU_FEATURES
    if features is None:
        features = llvm.get_host_cpu_features().flatten()
    return f"{name} ({hashlib.sha256(features.encode()).hexdigest()[:8]})"


def is_own(function) -> bool:
    """Whether a Python function is from this package, whose sources name the cache folder."""
    return Path(function.__code__.co_filename).resolve().is_relative_to(PACKAGE.resolve())


def keep_off_disk(*kernels) -> None:
    """From now on compile these kernels for this process alone."""
    for each in kernels if COMPILED else ():
        each._cache = NullCache()


def mark_of(files: Iterable[Path]) -> str:
    """Hash of the names and the content of files."""
    digest = hashlib.sha256()
    for path in files:
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:16]


@contextlib.contextmanager
def cache_of(files: Iterable[Path]) -> Iterator[None]:
    """Compile, within the block, into a cache folder named by the content of the user's files."""
    usual = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(Path(usual) / f"user-{mark_of(files)}")
    try:
        yield
    finally:
        numba.config.CACHE_DIR = usual
