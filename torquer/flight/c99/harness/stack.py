"""Worst-case stack of an export's functions: frames along the deepest chain of calls.

`make stack CC=... CFLAGS=...` writes that of your build into adcs_stack.h, without the functions of
the C library, which it names. Frames and calls of the export itself are those that GCC states
(`-fcallgraph-info=su`); those of the C library are read from a linked program, if there is one. A
call by address, a function that calls itself and a frame whose size is known only at run time have
no bound: the program ends with their names.
"""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

HOME = Path(__file__).resolve().parents[1]
NAMES = ("adcs.c", "adcs_tables.c", "adcs_math.c", "adcs_ephemeris.c")
HEADER = "adcs_stack.h"
#: How each function of adcs.h begins, and what the header says.
PUBLIC = "adcs_"
TEXT = """\
/* Worst-case stack [bytes] of the functions of adcs.h, compiled by
   {command}
   Deepest: {chain}.
   An interrupt adds its own, and so do these functions of the C library: {library}. */
#define ADCS_STACK_BYTES {size}
"""

#: Registers and bytes that an instruction puts on the stack.
_LISTS = re.compile(r"(?:push|v?stmdb\s+sp!,)\s*\{([^}]*)\}")
_BYTES = re.compile(r"subw?(?:\.w)?\s+sp, (?:sp, )?#(\d+)|\[sp, #-(\d+)\]!")
_UNBOUND = re.compile(r"sub\S*\s+sp, (?:sp, )?r\d|mov\s+sp, r(?!7\b)|\bblx\s+r\d|\bbx\s+r\d")
_CALL = re.compile(r"^b(?:l|lx)?(?:[a-z]{2})?(?:\.[nw])?\s+(\w+)$")
_NODE = re.compile(r'node: \{ title: "([^"]+)" label: "[^"]*?\\n[^"]*?\\n(\d+) bytes \(([\w,]+)\)')
_EDGE = re.compile(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"')


class Graph:
    """Functions with the bytes of their frames and those that each calls."""

    def __init__(self, folder: Path, program, tools: str = ""):
        self.frames: dict = {}
        self.calls: dict = {}
        self.library: set = set()
        for file in sorted(folder.glob("*.ci")):
            self._read(file.read_text())
        self._is_linked = program is not None
        self._code = _functions(tools, program) if self._is_linked else {}
        self._deepest: dict = {}

    def _read(self, text: str) -> None:
        for name, size, kind in _NODE.findall(text):
            if kind not in ("static", "dynamic,bounded"):
                sys.exit(f"stack: {name} has a frame without a bound")
            self.frames[name] = int(size)
        for source, target in _EDGE.findall(text):
            if target == "__indirect_call":
                sys.exit(f"stack: {source} calls a function by its address")
            self.calls.setdefault(source, set()).add(target)

    def deepest(self, name: str, above: tuple = ()) -> tuple:
        """Bytes of the deepest chain of calls from a function, and the chain."""
        if name in above:
            sys.exit(f"stack: {name} calls itself")
        if name not in self._deepest:
            if name not in self.frames and not self._is_linked:
                self.library.add(name)
                self.frames[name] = 0
            if name not in self.frames and not self._merge(name):
                self._of_library(name)
            below = [self.deepest(each, (*above, name)) for each in self.calls.get(name, ())]
            size, chain = max(below, default=(0, ()))
            self._deepest[name] = size + self.frames[name], (name, *chain)
        return self._deepest[name]

    def _merge(self, name: str) -> bool:
        """Whether GCC made one of this function and another that has the same instructions."""
        code = self._code.get(_short(name))
        same = {each for each, other in self._code.items() if other is code}
        for title in [each for each in self.frames if code and _short(each) in same]:
            self.frames[name] = self.frames[title]
            self.calls[name] = self.calls.get(title, set())
            return True
        return False

    def _of_library(self, name: str) -> None:
        """Frame and calls of a function of the C library by its instructions: all that it ever
        puts on the stack, whether or not at once."""
        if name not in self._code:
            sys.exit(f"stack: {name} is not in the program")
        size, called = 0, set()
        inner = {each for each, code in self._code.items() if code is self._code[name]}
        for line in self._code[name]:
            if _UNBOUND.search(line):
                sys.exit(f"stack: {name} has no bound: {line}")
            size += _push(line)
            called |= {each[1] for each in [_CALL.search(line)] if each} - inner
        self.frames[name], self.calls[name] = size, called


def _short(name: str) -> str:
    """The name of a function without that of its file."""
    return name.rpartition(":")[2]


def _push(line: str) -> int:
    lists, of = _LISTS.search(line), _BYTES.search(line)
    if lists:
        return (8 if lists[1].startswith("d") else 4) * _count(lists[1])
    return int(of[1] or of[2]) if of else 0


def _count(registers: str) -> int:
    """How many registers a list such as `r4, d8-d11` names."""
    count = 0
    for part in registers.split(","):
        ends = [int(each) for each in re.findall(r"[rsd](\d+)", part)]
        count += ends[1] - ends[0] + 1 if len(ends) == 2 else 1
    return count


def _functions(tools: str, program: Path) -> dict:
    """Instructions of all functions of a program, by each of their names."""
    named: dict = {}
    for line in _output(f"{tools}nm", program).splitlines():
        at, kind, name = line.split()[-3:]
        if kind in "tTwW":
            named.setdefault(int(at, 16) & ~1, []).append(name)
    found: dict = {}
    lines: list = []
    for line in _output(f"{tools}objdump", "-d", "--no-show-raw-insn", program).splitlines():
        head = re.match(r"([0-9a-f]+) <(\S+)>:", line)
        if head:
            lines = []
            found |= dict.fromkeys(named.get(int(head[1], 16), [head[2]]), lines)
        elif "\t" in line:
            lines.append(_with_name(line.split("\t", 1)[1].replace("\t", " ")))
    return found


def _with_name(instruction: str) -> str:
    """An instruction with the name of the function that it goes to in place of the address."""
    text = instruction.split(" @ ")[0].split(";")[0].strip()
    jump = re.match(r"(bl?x?\w*(?:\.[nw])?) [0-9a-f]+ <([^>+]+)(\+0x\w+)?>$", text)
    return f"{jump[1]} {jump[2]}" if jump and not jump[3] else re.sub(r" [0-9a-f]+ <.*", "", text)


def _output(*command) -> str:
    return subprocess.run(
        list(map(str, command)), capture_output=True, text=True, check=True
    ).stdout


def compile_all(folder: Path, command: list) -> None:
    """Compile the files of the export, with what GCC states of frames and calls."""
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*.ci"):
        old.unlink()
    for source in [HOME / name for name in NAMES if (HOME / name).exists()]:
        told = ["-fstack-usage", "-fcallgraph-info=su", "-c", source]
        done = subprocess.run(
            list(map(str, [*command, f"-I{HOME}", *told])),
            cwd=folder,
            capture_output=True,
            text=True,
        )
        if done.returncode:
            lines = [line for line in done.stderr.splitlines() if "error" in line] or ["no answer"]
            sys.exit(f"stack: CC must be a GCC of version 10 or later; received {lines[0]}")


def main() -> int:
    """Write the header of a build by `CC` and `CFLAGS`, and say what is in it."""
    command = [*shlex.split(os.environ.get("CC", "cc")), "-std=c99", "-ffp-contract=off"]
    command += shlex.split(os.environ.get("CFLAGS", "-O2"))
    folder = HOME / "build" / "stack"
    compile_all(folder, command)
    graph = Graph(folder, None)
    public = [name for name in graph.frames if name.startswith(PUBLIC)]
    size, chain = max(graph.deepest(name) for name in public)
    places = {
        "size": size, "command": " ".join(command),
        "chain": " > ".join(f"{_short(name)} {graph.frames[name]}" for name in chain),
        "library": ", ".join(sorted(graph.library)) or "none",
    }  # fmt: skip
    (HOME / HEADER).write_text(TEXT.format(**places))
    print(TEXT.format(**places), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
