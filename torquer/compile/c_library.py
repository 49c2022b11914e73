"""C sources compiled into a shared library, loaded, and called by kernels by its address.

The library stands in the cache folder, named by a hash of its sources, the flags and the compiler,
so that an edit is always noticed and what has not changed is not compiled again.
"""

import ctypes
import hashlib
import os
import shlex
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload

from torquer.compile.code_cache import FOLDER
from torquer.compile.numba_private import INLINED_OPTIONS, cgutils

#: Without these products are fused into sums on some processors: other bits. GCC's vectoriser fuses
#: pairs of them whatever the first one says.
EXACT = ("-ffp-contract=off", "-fno-tree-slp-vectorize")
FLAGS = ("-std=c99", "-O2", *EXACT, "-fPIC", "-shared")
#: Numbers that `call_c` returns.
ANSWERS = 6
_NUMBERS = ir.DoubleType().as_pointer()
_WORD = ir.IntType(64)


def build_library(sources: Sequence[Path], headers: Sequence[Path], must: str) -> Path:
    """The shared library of C sources; compiled by `cc`, or what CC names, unless it is there.

    `must`: what must hold of the sources; it begins the message of the ValueError.
    """
    compiler = shlex.split(os.environ.get("CC") or "cc")
    mark = hashlib.sha256(" ".join((*compiler, *FLAGS)).encode())
    mark.update(_run_command([*compiler, "--version"], must).encode())
    for path in (*sources, *headers):
        mark.update(path.name.encode() + path.read_bytes())
    folder = (FOLDER or Path(tempfile.mkdtemp())) / "c"
    library = folder / f"{mark.hexdigest()[:32]}.so"
    if library.exists():
        return library
    folder.mkdir(mode=0o700, exist_ok=True)
    made = folder / f"{library.stem}.{os.getpid()}"  # renamed when whole: others may build it, too
    included = [f"-I{folder}" for folder in dict.fromkeys(path.parent for path in headers)]
    try:
        _run_command(
            [*compiler, *FLAGS, *included, "-o", str(made), *map(str, sources), "-lm"], must
        )
        made.replace(library)
    finally:
        made.unlink(missing_ok=True)
    return library


def _run_command(command: list[str], must: str) -> str:
    """What a command prints; ValueError of one line if it fails."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace")
    except OSError as error:
        raise ValueError(
            f"{must}, by cc or the compiler that CC names; received {command[0]} ({error.strerror})"
        ) from None
    if done.returncode:
        lines = [line for line in done.stderr.splitlines() if "error" in line] or ["no reason"]
        raise ValueError(f"{must} by {command[0]}; received: {lines[0].strip()[:300]}")
    return done.stdout


def call_c(address, arrays):
    """Call a C function `(double *array, ..., double *answer)`; the six numbers of its answer.

    Where nothing is compiled, the address is the function itself as `ctypes` has it.
    """
    answer = (ctypes.c_double * ANSWERS)()
    address(*(ctypes.c_void_p(array.ctypes.data) for array in arrays), answer)
    return tuple(answer)


@intrinsic
def _call_c(typing_context, address, arrays):
    def build(context, builder, signature, arguments):
        pointers = []
        for of_type, value in zip(arrays, cgutils.unpack_tuple(builder, arguments[1]), strict=True):
            data = context.make_array(of_type)(context, builder, value).data
            pointers.append(builder.bitcast(data, _NUMBERS))
        answer = cgutils.alloca_once(builder, ir.ArrayType(ir.DoubleType(), ANSWERS))
        pointers.append(builder.bitcast(answer, _NUMBERS))
        made = ir.FunctionType(ir.VoidType(), [_NUMBERS] * len(pointers))
        builder.call(builder.inttoptr(arguments[0], made.as_pointer()), pointers)
        return builder.load(answer)

    return types.UniTuple(types.float64, ANSWERS)(address, arrays), build


@overload(call_c, jit_options=INLINED_OPTIONS)
def _overload_call_c(address, arrays):
    return lambda address, arrays: _call_c(address, arrays)
