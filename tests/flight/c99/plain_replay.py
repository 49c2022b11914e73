"""Replays recorded control steps in plain Python: NUMBA_DISABLE_JIT=1 python plain_replay.py.

Arguments: scenario, recorded.bin. Prints the number of steps with the same bits in commands and
state; ends with 1 at the first difference.
"""

import struct
import sys
import warnings
from pathlib import Path

import numpy as np

import torquer
from torquer.compile.engine import records
from torquer.computer import computer as on_board, gate as gates
from torquer.computer.interface import KNOWN
from torquer.flight.c99.computer import find_computer, translate_step
from torquer.flight.c99.interface import handed_in, inputs_for
from torquer.flight.c99.recording import mark_numbers
from torquer.flight.c99.tables import state_numbers


def computer_and_board(scenario):
    """What the control step takes, as plain Python sees it."""
    parts = find_computer(scenario)
    made = on_board.make_computer(
        parts.blocks,
        *(parts.computer[key] for key in ("estimator", "modes", "selection")),
    )
    return records(made), records(parts.board)


def begun_anew(board, first):
    """The board as at the start."""
    for now, then in zip(numbers_in(board), numbers_in(first), strict=True):
        now[...] = then


def numbers_in(board) -> list[np.ndarray]:
    return [board.known, board.parameters, board.memory, *board.modes, board.chosen, board.selected]


def replay(path: str, file: str) -> int:
    """Number of steps that are the same; all of them unless there is a difference."""
    scenario = torquer.load_scenario(path)
    computer, board = computer_and_board(scenario)
    _, first = computer_and_board(scenario)
    parts = find_computer(scenario)
    made = translate_step(parts)
    gate, now = records(made.checks), records(gates.first_gate())
    given = records(np.zeros(1, KNOWN))
    places = [*handed_in(inputs_for(parts, made)).values()]
    numbers_of = state_numbers(made)
    data = Path(file).read_bytes()
    _, steps, inputs, _ = struct.unpack_from("<8sQQQ", data)
    size, at = 8 * (inputs + 15), 32
    for step in range(steps):
        row = np.frombuffer(data, "<f8", inputs + 14, at + step * size)
        (mark,) = struct.unpack_from("<Q", data, at + step * size + 8 * (inputs + 14))
        if row[0] > 0.0:
            begun_anew(board, first)
            now = records(gates.first_gate())
        given.view(np.float64).reshape(-1)[places] = row[1 : 1 + inputs]
        command = gates.gated_step(gate, computer, board, now, given)
        answer = np.array([*command.dipole_a_m2, *command.torque_n_m])
        if (
            answer.tobytes() != row[1 + inputs : 7 + inputs].tobytes()
            or mark_numbers(numbers_of(board)[None]) != mark
        ):
            print(f"the first difference is at step {step} of {steps}")
            return 1
    print(f"{steps} control steps: the same bits in commands and state")
    return 0


if __name__ == "__main__":
    warnings.simplefilter("ignore", RuntimeWarning)
    sys.exit(replay(*sys.argv[1:]))
