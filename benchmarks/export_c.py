"""A control step of the exported C against the compiled Python kernels, on recorded inputs.

Both are called by their address from one compiled loop, in turns, on the same inputs; afterwards
their states must have the same bits. `python benchmarks/export_c.py [SCENARIO ...]`
"""

import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

import torquer
from torquer.compile.arguments import Arguments, Entry, record_at
from torquer.computer.computer import Board, Computer
from torquer.flight.c99.computer import find_computer, translate_step
from torquer.flight.c99.interface import handed_in, inputs_for
from torquer.flight.c99.recording import record_steps
from torquer.flight.c99.tables import state_numbers
from torquer.simulation.loop.computers import command_from
from torquer.simulation.outside.library import Library
from torquer.simulation.setup.run import prepare

EXAMPLES = Path(__file__).parents[1] / "examples"
NAMES = (
    *("my_law", "chibis_m_detumble", "sun_pointing", "safe_mode", "which_sensors"),
    "chibis_m_day",
)
STEPS, TURNS = 2000, 15


class Steps(NamedTuple):
    """A computer, its board, the latter's inputs as numbers, and recorded inputs for each step."""

    computer: Computer
    board: Board
    known: np.ndarray
    places: np.ndarray
    inputs: np.ndarray


def _take(address, last):
    steps, moved = record_at(address), 0
    for step in range(last):
        for place in range(steps.places.shape[0]):
            steps.known[steps.places[place]] = steps.inputs[step, place]
        command = command_from(steps.computer, steps.board)
        moved += command.dipole_a_m2[0] != 0.0
    return moved


take = Entry(_take, 1)


def measured(name: str) -> tuple[float, float, float]:
    """Microseconds of a control step in Python and in C, and the median of their ratios."""
    scenario = torquer.load_scenario(EXAMPLES / f"{name}.toml")
    parts = find_computer(scenario)
    made = translate_step(parts)
    given = inputs_for(parts, made)
    places = np.array([*handed_in(given).values()])
    with tempfile.TemporaryDirectory() as folder:
        torquer.export_c(scenario, folder, steps=1)
        library = Library(folder)
    inputs, sides, times = (
        record_steps(scenario, STEPS, made, given).inputs,
        {},
        {"python": [], "c": []},
    )
    for side, by in (("python", None), ("c", library)):
        run = prepare(scenario, library=by)
        board = run.state.board
        known = board.known.view(np.float64).reshape(-1)
        own = Steps(run.plan.computer, board, known, places, inputs)
        sides[side] = run, Arguments(own), [part.copy() for part in _parts(board)]
    for turn in range(TURNS + 1):
        for side, (run, arguments, first) in sides.items():
            for part, kept in zip(_parts(run.state.board), first, strict=True):
                part[...] = kept
            call, start = take.of(arguments), time.perf_counter()
            call(arguments.address, len(inputs))
            if turn:  # the first one warms up
                times[side].append((time.perf_counter() - start) / len(inputs) * 1e6)
    one, other = (state_numbers(run.state.board, made) for run, *_ in sides.values())
    if not np.array_equal(one, other, equal_nan=True):
        raise SystemExit(f"{name}: the states differ")
    ratio = statistics.median(c / p for p, c in zip(*times.values(), strict=True))
    return statistics.median(times["python"]), statistics.median(times["c"]), ratio


def _parts(board: Board) -> list[np.ndarray]:
    return [board.known, board.parameters, board.memory, *board.modes, board.chosen]


def main(names: tuple[str, ...]) -> None:
    """Print a table."""
    print("| scenario | compiled Python, us | exported C, us | ratio |\n|---|---|---|---|")
    for name in names:
        python, c, ratio = measured(name)
        print(f"| {name} | {python:.2f} | {c:.2f} | {ratio:.2f} |", flush=True)


if __name__ == "__main__":
    main(tuple(sys.argv[1:]) or NAMES)
