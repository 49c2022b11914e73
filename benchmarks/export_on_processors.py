"""What an export takes on other processors: bytes, stack, instructions; beside a B-dot by hand.

`python benchmarks/export_on_processors.py [SCENARIO ...]` prints the table of the design note:
built by zig's clang with portable functions, `-O2`, and run in unicorn, where instructions are
counted by blocks, and stack by painting from the first instruction of a step on.
`pip install unicorn ziglang` brings what it needs.
"""

import re
import statistics
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from flight.c99 import processors  # noqa: E402
from flight.c99.elf import Elf  # noqa: E402
from flight.c99.processors import PROCESSORS, Machine, Measured, replay_image, replayed  # noqa: E402
from flight.c99.test_kept import BY_HAND  # noqa: E402

import torquer  # noqa: E402

NAMES = ("tip_off_campaign", "magneto_gyro_micro", "safe_mode", "turn_to_the_sun", "which_sensors")
STEPS = 300
#: Calls the law by hand as `test_kept` does.
CALLS = """
typedef struct { double t_s, b[3], m[3], shortest_s, gain; } own_state;
void take_step(own_state *s, double t_s, const double b[3], double m[3]);
static own_state state = {.gain = 5e6, .shortest_s = -1.0};
int board_main(void);
int board_main(void)
{
    for (int n = 0; n < 300; n++) {
        const double x = 1e-7 * (n % 17);
        const double b[3] = {2e-5 + x, 0.5 * x - 1e-5, 3e-5 - x};
        double m[3];
        take_step(&state, 3.0 * n, b, m);
    }
    return 0;
}
"""


class Taken(NamedTuple):
    """Bytes of code, constants, writable variables, a state, inputs, stack; instructions a
    step; whether bits are those of the record.
    """

    text: int
    constants: int
    writable: int
    state: int
    inputs: int
    stack: int
    mean: int
    most: int
    bits: str = ""

    def row(self) -> str:
        """Cells of the table."""
        fixed = " | ".join(map(str, (self.text, self.constants, self.state, self.inputs)))
        instructions = f"{self.mean:,} / {self.most:,}".replace(",", " ")
        return f"{fixed} | {self.stack} | {instructions} | {self.bits}"


def _taken(measured: Measured, sizes: list[dict], state: int, inputs: int) -> Taken:
    total = {key: sum(each[key] for each in sizes) for key in sizes[0]}
    counts = [each.instructions for each in measured.steps]
    stack = max(each.stack for each in measured.steps)
    return Taken(
        total["text"], total["constants"], total["data"] + total["bss"], state, inputs, stack,
        round(statistics.mean(counts)), max(counts),
    )  # fmt: skip


def of_export(name: str, export: Path, folder: Path) -> Taken:
    """What an export takes on a processor, and whether its bits are those of the record."""
    image = replay_image(PROCESSORS[name], export, folder)
    record = (export / "test/recorded.bin").read_bytes()
    done = replayed(Machine(PROCESSORS[name], image), record)
    step = re.search(r"difference is at step (\d+)", done.said)
    if done.code and step is None:
        raise SystemExit(f"{name}: {done.said}")
    machine = Machine(PROCESSORS[name], image)
    measured = Measured(machine, "adcs_step")
    replayed(machine, record, answers=True)
    own = Elf(folder / "adcs.o")
    needed = ["adcs.o", "adcs_tables.o"]
    needed += ["adcs_math.o"] * any("portable" in each for each in own.symbols())
    sizes = [Elf(folder / each).sizes() for each in needed]
    taken = _taken(measured, sizes, *map(machine.read_word, ("board_state", "board_inputs")))
    return taken._replace(bits=f"from step {step[1]}" if step else "same")


def by_hand(name: str, folder: Path) -> Taken:
    """What the law by hand takes."""
    text = BY_HAND.partition("static own_state state")[0]
    (folder / "by_hand.c").write_text(text)
    (folder / "calls.c").write_text(CALLS)
    sources = [folder / "by_hand.c", folder / "calls.c"]
    made = processors.objects(PROCESSORS[name], folder, sources)
    machine = Machine(PROCESSORS[name], processors.linked(PROCESSORS[name], folder, made))
    measured = Measured(machine, "take_step")
    machine.call("board_main")
    return _taken(measured, [Elf(made[0]).sizes()], 8 * 9, 8 * 4)


def main(names: tuple[str, ...]) -> None:
    """Print a table."""
    print(
        "| computer | processor | code, B | tables, B | state, B | inputs, B | stack, B "
        "| instructions a step, mean / most | bits |\n|---|---|---|---|---|---|---|---|---|"
    )
    with tempfile.TemporaryDirectory() as place:
        for name in PROCESSORS:
            folder = Path(place) / f"by_hand_{name}"
            folder.mkdir()
            print(f"| B-dot by hand | {name} | {by_hand(name, folder).row()} |", flush=True)
        for scenario in names:
            export = Path(place) / scenario
            described = torquer.load_scenario(ROOT / f"examples/{scenario}.toml")
            torquer.export_c(described, export, steps=STEPS)
            for name in PROCESSORS:
                folder = Path(place) / f"{scenario}_{name}"
                folder.mkdir()
                taken = of_export(name, export, folder)
                if taken.writable:
                    raise SystemExit(f"{scenario}, {name}: {taken.writable} bytes are writable")
                print(f"| {scenario} | {name} | {taken.row()} |", flush=True)


if __name__ == "__main__":
    main(tuple(sys.argv[1:]) or NAMES)
