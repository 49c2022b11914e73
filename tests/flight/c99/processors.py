"""Exports built for other processors by zig, and flown in the emulator unicorn.

Without an operating system: what the replay calls is in `board.c`; arithmetic that a processor
lacks, and most functions of numbers, are those of zig's run-time library, others are musl's. So are
the headers of the C library. `pip install unicorn ziglang` brings all of it.
"""

import importlib.util
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import unicorn
from flight.c99.elf import Elf
from unicorn import Uc, arm_const as arm, ppc_const as ppc, riscv_const as riscv

HERE = Path(__file__).parent
_ZIG = importlib.util.find_spec("ziglang")
HAS_ZIG = _ZIG is not None
LIBRARY = Path(_ZIG.origin).parent / "lib/libc" if _ZIG and _ZIG.origin else Path()
FLAGS = (
    "-std=c99", "-O2", "-g0", "-ffp-contract=off", "-fno-slp-vectorize", "-DADCS_PORTABLE",
    "-fno-sanitize=undefined", "-fno-unwind-tables", "-fno-asynchronous-unwind-tables",
)  # fmt: skip
#: Functions that zig's library lacks, and sources of musl that they are made of.
BY_MUSL = {
    "expm1": ("expm1",),
    "pow": (
        "pow", "pow_data", "exp_data", "__math_divzero", "__math_invalid", "__math_oflow",
        "__math_uflow", "__math_xflow",
    ),
}  # fmt: skip
STACK, STACK_SIZE, STOP = 0x20000000, 1 << 20, 0x2FFF0000
PAGE, PAINTED = 4096, 32768


class Registers(NamedTuple):
    """Numbers of the emulator's registers: stack pointer, return address, answer."""

    stack: int
    link: int
    answer: int


class Processor(NamedTuple):
    """What zig builds for, and what the emulator is: architecture, mode, model."""

    target: str
    core: str
    headers: str
    emulated: tuple[int, int, int]
    registers: Registers
    #: Turns floating point on.
    begin: Callable[[Uc], None]
    #: Bytes of the instruction that begins with these.
    length: Callable[[bytes], int]
    #: Further flags of the compiler.
    flags: tuple[str, ...] = ()


def _begin_arm(uc: Uc) -> None:
    """It is on. With UC_MODE_MCLASS unicorn 2.1.4 takes a model without doubles for all others."""


def _begin_riscv(uc: Uc) -> None:
    uc.reg_write(riscv.UC_RISCV_REG_MSTATUS, uc.reg_read(riscv.UC_RISCV_REG_MSTATUS) | 3 << 13)


def _begin_ppc(uc: Uc) -> None:
    uc.reg_write(ppc.UC_PPC_REG_MSR, uc.reg_read(ppc.UC_PPC_REG_MSR) | 1 << 13)


def _arm(core: str, model: int) -> Processor:
    return Processor(
        "thumb-freestanding-eabihf", core, "arm",
        (unicorn.UC_ARCH_ARM, unicorn.UC_MODE_THUMB, model),
        Registers(arm.UC_ARM_REG_SP, arm.UC_ARM_REG_LR, arm.UC_ARM_REG_R0),
        _begin_arm, lambda first: 4 if first[1] >> 3 in (0x1D, 0x1E, 0x1F) else 2,
    )  # fmt: skip


def _riscv(bits: int, core: str) -> Processor:
    mode, model = (
        (unicorn.UC_MODE_RISCV64, riscv.UC_CPU_RISCV64_ANY) if bits == 64
        else (unicorn.UC_MODE_RISCV32, riscv.UC_CPU_RISCV32_ANY)
    )  # fmt: skip
    return Processor(
        f"riscv{bits}-freestanding-none", core, f"riscv{bits}",
        (unicorn.UC_ARCH_RISCV, mode, model),
        Registers(riscv.UC_RISCV_REG_SP, riscv.UC_RISCV_REG_RA, riscv.UC_RISCV_REG_A0),
        _begin_riscv, lambda first: 4 if first[0] & 3 == 3 else 2,
    )  # fmt: skip


_PPC = Processor(
    "powerpc-freestanding-eabihf", "750", "powerpc",
    (
        unicorn.UC_ARCH_PPC, unicorn.UC_MODE_PPC32 | unicorn.UC_MODE_BIG_ENDIAN,
        ppc.UC_CPU_PPC32_750_V3_1,
    ),
    Registers(ppc.UC_PPC_REG_1, ppc.UC_PPC_REG_LR, ppc.UC_PPC_REG_3),
    _begin_ppc, lambda first: 4,
    # without a system clang takes `long` for the type of sizes, musl's headers `int`
    ("-U__SIZE_TYPE__", "-D__SIZE_TYPE__=unsigned", "-U__PTRDIFF_TYPE__", "-D__PTRDIFF_TYPE__=int"),
)  # fmt: skip

PROCESSORS = {
    "Cortex-M7": _arm("cortex_m7+fp_armv8d16", arm.UC_CPU_ARM_CORTEX_M7),
    "Cortex-M4F": _arm("cortex_m4+vfp4d16sp", arm.UC_CPU_ARM_CORTEX_M4),
    "RV64GC": _riscv(64, "baseline_rv64"),
    "RV32GC": _riscv(32, "baseline_rv32"),
    "RV32IMAC": _riscv(32, "generic_rv32+m+a+c"),
    "PowerPC 750": _PPC,
}


def zig(*command, folder: Path) -> None:
    """Run zig's compiler in a folder; AssertionError with its words where it fails."""
    environment = {**os.environ, "ZIG_LOCAL_CACHE_DIR": str(folder / "zig")}
    done = subprocess.run(
        [sys.executable, "-m", "ziglang", "cc", *map(str, command)], cwd=folder,
        env=environment, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


def objects(processor: Processor, folder: Path, sources: list[Path], *flags: str) -> list[Path]:
    """Sources compiled, each to an object in the folder."""
    own = [
        "-target", processor.target, f"-mcpu={processor.core}", *FLAGS, *processor.flags, *flags,
        "-isystem", LIBRARY / f"include/{processor.headers}-linux-musl",
        "-isystem", LIBRARY / "include/generic-musl",
    ]  # fmt: skip
    made = []
    for source in sources:
        made.append(folder / f"{source.stem}.o")
        inner = _inner_headers(processor) if source.is_relative_to(LIBRARY) else []
        zig(*own, *inner, "-c", source, "-o", made[-1], folder=folder)
    return made


def _inner_headers(processor: Processor) -> list:
    """Flags for musl's own sources."""
    places = (f"arch/{processor.headers}", "arch/generic", "src/include", "src/internal")
    return [each for place in places for each in ("-I", LIBRARY / "musl" / place)]


def linked(processor: Processor, folder: Path, parts: list[Path]) -> Path:
    """An image of objects, that begins with `board_main`."""
    image = folder / "image.elf"
    own = ["-target", processor.target, f"-mcpu={processor.core}", "-O2", "-static"]
    zig(*own, "-Wl,-e,board_main", *parts, "-o", image, folder=folder)
    return image


def replay_image(processor: Processor, export: Path, folder: Path, *flags: str) -> Path:
    """The replay of an export; the library's own objects stay in `folder`."""
    names = ("adcs.c", "adcs_tables.c", "adcs_math.c", "test/replay.c", "test/recorded.c")
    sources = [export / name for name in names if "recorded" not in name or flags]
    made = objects(processor, folder, [*sources, HERE / "board.c"], f"-I{export}", *flags)
    wanted = Elf(made[0]).symbols()
    parts = [part for name, of in BY_MUSL.items() if name in wanted for part in of]
    more = [LIBRARY / f"musl/src/math/{part}.c" for part in parts]
    return linked(processor, folder, made + objects(processor, folder, more))


class Machine:
    """An image in the emulator's memory."""

    def __init__(self, processor: Processor, image: Path):
        architecture, mode, model = processor.emulated
        self.processor, self.elf = processor, Elf(image)
        self.symbols = self.elf.symbols()
        self.uc = Uc(architecture, mode, model)
        pages = {STOP // PAGE, *range(STACK // PAGE, (STACK + STACK_SIZE) // PAGE)}
        for at, _, size in self.elf.segments():
            pages |= set(range(at // PAGE, (at + size - 1) // PAGE + 1))
        for first, count in _runs(sorted(pages)):
            self.uc.mem_map(first * PAGE, count * PAGE)
        for at, data, _ in self.elf.segments():
            self.uc.mem_write(at, data)

    def call(self, name: str) -> int:
        """What a function without arguments answers."""
        uc, registers = self.uc, self.processor.registers
        self.processor.begin(uc)
        uc.reg_write(registers.stack, STACK + STACK_SIZE - 64)
        uc.reg_write(registers.link, STOP | self.is_thumb)
        uc.emu_start(self.symbols[name] | self.is_thumb, STOP)
        return uc.reg_read(registers.answer)

    @property
    def is_thumb(self) -> int:
        """The lowest bit of an address of code: 1 for ARM's short instructions."""
        return int(self.processor.headers == "arm")

    def read(self, name: str, size: int) -> bytes:
        """Bytes from a variable on."""
        return bytes(self.uc.mem_read(self.symbols[name], size))

    def read_word(self, name: str) -> int:
        """A variable of 32 bits."""
        return int.from_bytes(self.read(name, 4), self._order)

    def write(self, name: str, value: bytes | int) -> None:
        """Set bytes, or a variable of 32 bits."""
        data = value if isinstance(value, bytes) else value.to_bytes(4, self._order)
        self.uc.mem_write(self.symbols[name], data)

    @property
    def _order(self):
        return "big" if self.elf.order == ">" else "little"


def _runs(pages: list[int]) -> list[tuple[int, int]]:
    """First page and count of each run of pages."""
    found: list[tuple[int, int]] = []
    for page in pages:
        if found and sum(found[-1]) == page:
            found[-1] = (found[-1][0], found[-1][1] + 1)
        else:
            found.append((page, 1))
    return found


class Replayed(NamedTuple):
    """What a replay has answered: its exit code, what it has said, the record of its answers."""

    code: int
    said: str
    answers: bytes


def replayed(machine: Machine, record: bytes = b"", answers: bool = False) -> Replayed:
    """The replay of a record, or of that in the image, on a processor."""
    machine.write("board_in", record)
    machine.write("board_in_size", len(record))
    machine.write("board_files", bool(record) + (bool(record) and answers))
    code = machine.call("board_main")
    said = machine.read("board_said", 1024).partition(b"\0")[0].decode()
    return Replayed(code, said, machine.read("board_out", machine.read_word("board_out_size")))


class Step(NamedTuple):
    """Instructions and bytes of stack of a call."""

    instructions: int
    stack: int


class Measured:
    """Counts what each call of a function takes, while the machine runs."""

    def __init__(self, machine: Machine, function: str):
        self.steps: list[Step] = []
        self._machine, self._function = machine, machine.symbols[function] & ~machine.is_thumb
        self._back: int | None = None
        self._base = self._count = 0
        self._lengths: dict[tuple[int, int], int] = {}
        machine.uc.hook_add(unicorn.UC_HOOK_BLOCK, self._block)

    def _block(self, uc: Uc, address: int, size: int, _) -> None:
        registers = self._machine.processor.registers
        if self._back is None and address == self._function:
            self._base, self._count = uc.reg_read(registers.stack), 0
            self._back = uc.reg_read(registers.link) & ~self._machine.is_thumb
            uc.mem_write(self._base - PAINTED, b"\xa5" * PAINTED)
        elif address == self._back:
            below = bytes(uc.mem_read(self._base - PAINTED, PAINTED))
            self.steps.append(Step(self._count, len(below.lstrip(b"\xa5"))))
            self._back = None
        if self._back is not None:
            self._count += self._instructions(address, size)

    def _instructions(self, address: int, size: int) -> int:
        if (address, size) not in self._lengths:
            code, at, count = bytes(self._machine.uc.mem_read(address, size)), 0, 0
            while at < size:
                at += self._machine.processor.length(code[at : at + 2])
                count += 1
            self._lengths[address, size] = count
        return self._lengths[address, size]
