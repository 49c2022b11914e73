"""Kernels translated to C, compiled into one shared library, and called with numbers."""

import ctypes
import shutil
import struct
import subprocess
from pathlib import Path

import numpy as np
import pytest

from torquer.base.user_source import plain_function
from torquer.flight.c99.precision import computing_in
from torquer.flight.c99.print_c import INCLUDES, function_text, program_text
from torquer.flight.c99.program import Program, translate_repeatedly
from torquer.flight.c99.translation import FAILURES
from torquer.flight.c99.types import INT, REAL, TIME, Array, Static, Tuple

COMPILER = shutil.which("gcc") or shutil.which("cc")
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler")
FLAGS = ["-std=c99", "-ffp-contract=off"]


def bits(number: float) -> bytes:
    """The bits of a number; one pattern stands for all that are not numbers."""
    return b"nan" if number != number else struct.pack("<d", number)


def flat(value) -> list[float]:
    """All numbers of nested tuples as floats."""
    if isinstance(value, tuple):
        return [each for part in value for each in flat(part)]
    return [float(value)]


def _given(program, kind, at: list[int]) -> str:
    """An argument made of the numbers that the entry is given."""
    if kind in (REAL, TIME, INT):
        at[0] += 1
        return f"({program.type_name(kind)})d[{at[0] - 1}]"
    if isinstance(kind, Tuple):
        inner = ", ".join(_given(program, part, at) for part in kind.parts)
        braces = f"{{{{{inner}}}}}" if kind.is_array else f"{{{inner}}}"
        return f"({program.type_name(kind)}){braces}"
    return "memory" if len(kind.shape) == 1 else f"(double (*)[{kind.shape[1]}])memory"


def _answers(text: str, kind) -> list[str]:
    """All numbers of an answer."""
    if isinstance(kind, Tuple):
        parts = enumerate(kind.parts)
        return [each for k, part in parts for each in _answers(text + kind.member(k), part)]
    return [f"(double){text}"]


def _entry(program, function) -> str:
    at, texts = [0], []
    for name, kind in function.arguments:
        if isinstance(kind, Static):
            continue
        text = _given(program, kind, at)
        if name not in function.unused:
            texts.append(f"&{text}" if isinstance(kind, Tuple) and kind.is_large else text)
    texts += ["&failures"] if function.reports else []
    answers = _answers("r", function.result)
    stores = "".join(f"    out[{k}] = {each};\n" for k, each in enumerate(answers))
    head = f"int64_t in_{function.name}(const double *d, double *memory, double *out)"
    kind = program.type_name(FAILURES)
    first = f"    {kind} failures = {{0}};\n    (void)d;\n    (void)memory;\n"
    call = f"    {program.type_name(function.result)} r = {function.name}({', '.join(texts)});\n"
    return f"{head};\n{head}\n{{\n{first}{call}{stores}    return failures.raised;\n}}\n"


class InC:
    """Kernels, each for its types of arguments, in one shared library."""

    def __init__(
        self, kernels: dict, folder: Path, flags: tuple[str, ...] = ("-O1",), real: str = "double"
    ):
        def build(program):
            for kernel, types in kernels.items():
                program.function(kernel, types).is_public = True

        with computing_in(real):
            self._build(translate_repeatedly(build), kernels, folder, flags)

    def _build(self, program: Program, kernels: dict, folder: Path, flags: tuple[str, ...]):
        self.program = program
        self._functions = {
            kernel: self.program.function(kernel, types) for kernel, types in kernels.items()
        }
        entries = [_entry(self.program, each) for each in self._functions.values()]
        text = INCLUDES + program_text(self.program) + "\n".join(entries)
        source, library = folder / "kernels.c", folder / "kernels.so"
        source.write_text(text)
        command = [COMPILER, *FLAGS, *flags, "-fPIC", "-shared", "-o", library, source, "-lm"]
        subprocess.run(command, check=True)
        self._library = ctypes.CDLL(str(library))

    #: The line in which the kernel that was called last has failed, 0 for none.
    failed_line = 0

    def text(self, kernel) -> str:
        """The C text of a kernel."""
        return function_text(self.program, self._functions[kernel])

    def __call__(self, kernel, *arguments):
        """Numbers that a kernel answers; the last argument is its memory, which it may change."""
        function = self._functions[kernel]
        memory = next((a for a in arguments if isinstance(a, np.ndarray)), np.zeros(1))
        numbers = [n for a in arguments if not isinstance(a, np.ndarray) for n in flat(a)]
        d, out = np.array([*numbers, 0.0]), np.zeros(64)
        to = [each.ctypes.data_as(ctypes.c_void_p) for each in (d, memory, out)]
        entry = getattr(self._library, f"in_{function.name}")
        entry.restype = ctypes.c_int64
        self.failed_line = entry(*to)
        return out[: len(_answers("r", function.result))].tolist()


#: What generated kernels take: two numbers, two whole numbers, a vector, memory.
TYPES = [REAL, REAL, INT, INT, Tuple((REAL,) * 3), Array((6,))]


class Cells(np.ndarray):
    """Memory whose numbers are Python's own, by whose zeros a division raises."""

    def __getitem__(self, place):
        found = super().__getitem__(place)
        return float(found) if isinstance(found, np.floating) else found


def same_bits(c: InC, kernel, arguments: tuple, cells: list[float]) -> bool | None:
    """Whether C and plain Python answer and leave the same bits, or fail and leave the same bits;
    None where Python raises what compiled Python does not.
    """
    in_python, in_c = np.array(cells).view(Cells), np.array(cells)
    try:
        expected = plain_function(kernel)(*arguments, in_python)
    except (ZeroDivisionError, IndexError) as error:
        if "negative power" in str(error):  # of zero: infinite in compiled Python
            return None
        c(kernel, *arguments, in_c)
        return c.failed_line > 0 and list(map(bits, in_python)) == list(map(bits, in_c))
    except (ArithmeticError, ValueError):
        return None
    answer = c(kernel, *arguments, in_c)
    if c.failed_line:
        return False
    pairs = zip([*flat(expected), *in_python], [*answer, *in_c], strict=True)
    return all(bits(float(a)) == bits(b) for a, b in pairs)
