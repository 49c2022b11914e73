"""The exported on-board computer in a run: software in the loop.

`torquer export c` writes the computer of a scenario as C. Compiled as a shared library it works in
the loop in place of the Python kernels. It has parameters and memory from the run, as the kernels
have, so that members of a campaign may differ in them; its tables (modes, places) are its own.
"""

import ctypes
import hashlib
import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from torquer.base.user_source import plain_function, source_mark, source_text
from torquer.base.version import VERSION
from torquer.compile import sources
from torquer.compile.c_library import EXACT, build_library
from torquer.compile.engine import COMPILED
from torquer.computer.computer import Blocks, Board, Computer, parameter_places

#: Ends of the names of files that make up the library, after the prefix, and of what they include.
_SOURCES, _HEADERS = ("_tables.c", "_math.c"), (".c", ".h", "_types.h", "_math.h")
_IN_THE_LOOP = "test/in_the_loop.c"
_MUST = "computer: must be a folder of `torquer export c`, or a shared library built from one"
_AGAIN = "export it again with `torquer export c`"


class OtherComputer(ValueError):
    """A library is of another computer than that of the run."""


class Library:
    """A computer in C, loaded. `path`: the folder of an export, which is compiled, or a library.

    ValueError of one line for one that cannot be built, or is of another version of torquer.
    """

    def __init__(self, path: str | os.PathLike):
        self.path = Path(path)
        file = _find_library(self.path)
        try:
            self._code = ctypes.CDLL(str(file.resolve()))
            self._code.torquer_fingerprint.restype = ctypes.c_char_p
            text = self._code.torquer_fingerprint().decode()
            step = self._code.torquer_step
            self._code.torquer_self_test.restype = ctypes.c_bool
        except (OSError, AttributeError) as error:
            raise ValueError(f"{_MUST}; received {file} ({error})") from None
        self.fingerprint = text
        step.restype = None
        self.address: Any = step
        if COMPILED:
            self.address = ctypes.cast(step, ctypes.c_void_p).value
        version, kernels, _, *real = text.split()
        self.is_single = real == ["float"]
        if (version, kernels) != (VERSION, kernels_mark()):
            other = f"version {version}" if version != VERSION else "other sources of that version"
            raise ValueError(
                f"computer: must be exported by torquer {VERSION}; received {self.path} by {other}:"
                f" {_AGAIN}"
            )
        if not self._code.torquer_self_test():
            raise ValueError(
                f"computer: must be compiled with {' and '.join(EXACT)}; "
                f"received {file}, which computes other bits"
            )

    def check(self, computer: Computer, blocks: Blocks) -> None:
        """`OtherComputer` unless this is such a computer, whatever its parameters."""
        if self.fingerprint.split()[2] != computer_mark(computer, blocks):
            raise OtherComputer(
                "computer: must be exported from this scenario; received the export of another in "
                f"{self.path} (laws, estimators, modes or user's code differ): {_AGAIN}"
            )

    def check_start(self, board: Board, blocks: Blocks) -> None:
        """`OtherComputer` unless parameters and memory at the start are those of the export."""
        here = np.concatenate([_cells(part) for part in (board.parameters, board.memory)])
        if self.is_single:
            count = max(len(board.parameters), 1)
            here[:count] = here[:count].astype(np.float32)
        first = np.zeros(len(here))
        self._code.torquer_first(first.ctypes.data_as(ctypes.c_void_p))
        differ = np.flatnonzero((here != first) & ~(np.isnan(here) & np.isnan(first)))
        if not len(differ):
            return
        place = int(differ[0])
        named = [
            name
            for name, (at, count) in parameter_places(blocks).items()
            if at <= place < at + count
        ]
        what = named[0] if named else "the memory at the start"
        raise OtherComputer(
            f"computer: must have {what} of this scenario, {here[place]:g}; received "
            f"{first[place]:g} in {self.path}: {_AGAIN}"
        )


def _find_library(path: Path) -> Path:
    """The shared library of a folder, compiled, or the file itself."""
    if path.is_file():
        return path
    prefix = find_prefix(path) or "adcs"
    c_files = [*(path / f"{prefix}{end}" for end in _SOURCES), path / _IN_THE_LOOP]
    headers = [path / f"{prefix}{end}" for end in _HEADERS]
    if (own := path / f"{prefix}_ephemeris.c").is_file():  # the self-test asks it, too
        c_files.append(own)
        headers.append(own.with_suffix(".h"))
    if missing := [each for each in (*headers, *c_files) if not each.is_file()]:
        name = missing[0].relative_to(path)
        raise ValueError(f"{_MUST}; received {path}, in which there is no {name}")
    return build_library(c_files, headers, "computer: must be compiled")


def find_prefix(folder: Path) -> str | None:
    """The prefix of the export in a folder; None where there is none."""
    for file in sorted(folder.glob("*_tables.c")):
        prefix = file.name.removesuffix("_tables.c")
        if f"{prefix}_fingerprint(void)" in file.read_text(encoding="utf-8", errors="replace"):
            return prefix
    return None


def kernels_mark() -> str:
    """Mark of all sources that an export depends on: kernels, and what translates them."""
    translator = sorted((sources.PACKAGE / "flight" / "c99").rglob("*.py"))
    return sources.source_key(of_compiler=False) + sources.mark_files(translator)


def make_fingerprint(computer: Computer, blocks: Blocks) -> str:
    """What an export says of itself: the version, a mark of the sources, one of the computer."""
    return f"{VERSION} {kernels_mark()} {computer_mark(computer, blocks)}"


def computer_mark(computer: Computer, blocks: Blocks) -> str:
    """Mark of what is constant in a computer: its functions, its tables, the places of numbers.

    Parameters and memory are handed in at every step and do not count.
    """
    digest = hashlib.sha256()
    for key, block in blocks.by_key().items():
        plain = plain_function(block.function)
        said = (key, block.name, plain.__module__, plain.__qualname__, block.structure())
        digest.update(json.dumps(said).encode())
        digest.update(f"{source_mark(plain)} {source_text(plain)}".encode())
    for rows in (computer.law_blocks, computer.estimator_blocks):
        places = rows.copy()
        places["function"] = 0  # whose number says whether it is compiled
        _put(digest, places)
    _put(digest, (*computer.modes, int(computer.estimator)))
    return digest.hexdigest()[:16]


def _put(digest, value) -> None:
    """Add numbers, arrays and tuples of them to a digest."""
    if isinstance(value, tuple):
        for part in value:
            _put(digest, part)
    else:
        array = np.ascontiguousarray(value)
        digest.update(f"{array.dtype.descr} {array.shape}".encode() + array.tobytes())


def _cells(part: np.ndarray) -> np.ndarray:
    """An array as the struct in C has it, where one of no length has one place."""
    return part if len(part) else np.zeros(1)
