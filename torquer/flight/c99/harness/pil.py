"""Replay an export on an emulated processor: `make pil`, in the folder of the export.

Inputs are those of `recorded.bin`; answers are those of a build on this machine. The processor must
take the same bits: a Cortex-M7 those of the portable build; a Cortex-M4F those of an export in
single precision, whose differences from the simulation are shown. What the processor needs of
memory and time goes into README.md.
"""

import re
import shutil
import subprocess
import sys
from pathlib import Path

from differences import table  # type: ignore[import-not-found]  # in this folder
from stack import Graph  # type: ignore[import-not-found]  # in this folder

HOME = Path(__file__).resolve().parents[1]
BUILD = HOME / "build" / "pil"
NAMES = ("adcs.c", "adcs_tables.c", "adcs_math.c", "adcs_ephemeris.c")
SOURCES = [HOME / name for name in NAMES if (HOME / name).exists()]
#: What is measured: its function, what it is called.
PARTS = (("adcs_step", "a step"), ("adcs_ephemeris", "an ephemeris"))
STRICT = ["-std=c99", "-O2", "-ffp-contract=off", "-pedantic", "-Wall", "-Wextra", "-Wconversion"]
STRICT += ["-Wdouble-promotion", "-Wshadow", "-Werror"]
IS_SINGLE = "in single precision" in (HOME / "adcs.h").read_text()
NAME, CORE, UNIT, BOARD = (
    ("Cortex-M4F", "cortex-m4", "fpv4-sp-d16", "mps2-an386")
    if IS_SINGLE
    else ("Cortex-M7", "cortex-m7", "fpv5-d16", "mps2-an500")
)
PROCESSOR = [f"-mcpu={CORE}", "-mthumb", f"-mfpu={UNIT}", "-mfloat-abi=hard"]
#: In single precision functions of angles are the library's for doubles, rounded.
MATH: list = [] if IS_SINGLE else ["-DADCS_PORTABLE"]
TOOLS = "arm-none-eabi-"
TARGET = f"{NAME} (QEMU {BOARD}, newlib)"
NEEDED = {
    "cc": "gcc", "arm-none-eabi-gcc": "gcc-arm-none-eabi", "qemu-system-arm": "qemu-system-arm",
}  # fmt: skip
SKIPPED = 77
#: The emulator lets 2^6 ns pass for each instruction; the board's timer has 25 ticks a microsecond.
SHIFT, TICKS = 6, 1.6
#: Bytes that painting finds above the frame of the step: what the harness itself saves.
NOT_COUNTED = 16


def run(command: list, folder: Path = BUILD) -> str:
    """What a command prints; ends the program with its words where it fails."""
    done = subprocess.run(list(map(str, command)), cwd=folder, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout.strip()


def in_line(said: str) -> str:
    """Lines of the replay in one."""
    return "; ".join(line for line in said.splitlines() if not line.startswith("ticks "))


def on_this_machine() -> str:
    """The replay with this machine's library, then the answers that the processor must give.

    Returns the differences of an export in single precision from the simulation.
    """
    replay, record = HOME / "test" / "replay.c", HOME / "test" / "recorded.bin"
    command = ["cc", *STRICT, f"-I{HOME}", *SOURCES, replay]
    run([*command, *MATH, "-o", "given", "-lm"])
    run(["./given", record, "answers.bin"])
    if IS_SINGLE:
        return table(record, BUILD / "answers.bin") + "\n"
    run([*command, "-o", "library", "-lm"])
    print(f"this machine, its library, with the simulation: {in_line(run(['./library', record]))}")
    done = subprocess.run([BUILD / "given", record], capture_output=True, text=True)
    print(f"this machine, portable, with the simulation: {in_line(done.stdout)}")
    return ""


def on_target() -> tuple:
    """The replay on the processor: what it says; instructions (mean, most) and stack of each of
    `PARTS`."""
    command = ["arm-none-eabi-gcc", *STRICT, *PROCESSOR, f"-I{HOME}", *MATH]
    for source in SOURCES:
        run([*command, "-fstack-usage", "-fcallgraph-info=su", "-c", source])
    objects = [f"{source.stem}.o" for source in SOURCES]
    here = HOME / "test"
    linked: list = ["-DADCS_AROUND_STEP", "--specs=rdimon.specs", "-nostartfiles", "-T"]
    linked += [here / "target.ld", here / "start.c", here / "replay.c"]
    run([*command, *linked, *objects, "-o", "replay.elf", "-lm"])
    emulator = ["qemu-system-arm", "-M", BOARD, "-nographic", "-monitor", "none"]
    emulator += ["-icount", f"shift={SHIFT},sleep=off", "-semihosting", "-kernel", "replay.elf"]
    said = run(emulator)
    found = re.findall(r"ticks (\d+) (\d+) stack (\d+)", said)
    assert found, said
    measured = [tuple(map(int, each)) for each in found]
    return in_line(said), [(round(a / TICKS), round(b / TICKS), c) for a, b, c in measured]


def sizes() -> tuple:
    """Bytes of code, of constants and of writable variables of the export alone."""
    objects = [f"{source.stem}.o" for source in SOURCES]
    code = constants = writable = 0
    for line in run(["arm-none-eabi-size", "-A", *objects]).splitlines():
        section = re.match(r"(\.\S+)\s+(\d+)\s+\d+$", line)
        if section:
            name, size = section[1], int(section[2])
            code += size * name.startswith(".text")
            constants += size * name.startswith(".rodata")
            writable += size * name.startswith((".data", ".bss"))
    return code, constants, writable


def show(graph: Graph, chain: tuple) -> str:
    """Functions of a chain of calls with the bytes of their frames."""
    names = [name.rpartition(":")[2] for name in chain]
    pairs = zip(names, chain, strict=True)
    return " > ".join(f"{name} {graph.frames[own]}" for name, own in pairs)


def step_rows(graph: Graph, function: str, what: str, measured: tuple) -> dict:
    """Stack and instructions of a step, or of an ephemeris."""
    mean, most, stack = measured
    bound, chain = graph.deepest(function)
    if stack > bound + NOT_COUNTED:
        sys.exit(f"stack: {stack} bytes were used, more than the bound of {bound}")
    calls = "the replayed steps" if function == "adcs_step" else "the replayed ephemerides"
    return {
        f"worst-case stack of {what}": f"{bound} bytes, by the call graph: {show(graph, chain)}",
        f"stack of {calls}": f"{stack} bytes at most, by painting",
        f"instructions of {what}": f"{mean} on average, {most} at most, counted by QEMU's clock",
    }


def report(said: str, measured: list) -> str:
    """A section of the README."""
    code, constants, writable = sizes()
    graph = Graph(BUILD, BUILD / "replay.elf", TOOLS)
    rows = {
        "replay": said, "code": f"{code} bytes, without the C library",
        "constants": f"{constants} bytes", "writable variables of the library": f"{writable} bytes",
    }  # fmt: skip
    for (function, what), each in zip(PARTS, measured, strict=False):
        rows.update(step_rows(graph, function, what, each))
    version = run(["arm-none-eabi-gcc", "-dumpfullversion"])
    head = f"{TARGET}, GCC {version}, `-O2`\n\n| what | measured |\n|---|---|\n"
    return head + "".join(f"| {what} | {text} |\n" for what, text in rows.items())


def main() -> int:
    """All of it; 77 where a tool is missing."""
    missing = sorted(package for tool, package in NEEDED.items() if not shutil.which(tool))
    if missing:
        print(f"skipped, nothing was tried: install {', '.join(missing)}")
        return SKIPPED
    BUILD.mkdir(parents=True, exist_ok=True)
    differences = on_this_machine()
    said, measured = on_target()
    print(f"{TARGET}, with this machine: {said}")
    text = differences + report(said, measured)
    readme = HOME / "README.md"
    marks = r"(<!-- targets -->\n).*(<!-- end of targets -->)"
    before = readme.read_text(encoding="utf-8")
    after = re.sub(marks, lambda m: m[1] + text + m[2], before, flags=re.S)
    readme.write_text(after, encoding="utf-8")
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
