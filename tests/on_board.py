"""The on-board computer without a satellite: laws and modes asked reading by reading."""

import math

import numpy as np
from known import put_known

from torquer.compile.engine import kernel, records
from torquer.computer.computer import (
    SENSOR_READINGS,
    Blocks,
    control_step,
    first_board,
    make_computer,
    parameter_places,
)
from torquer.computer.gate import (
    BOUND,
    CHECKED,
    EPHEMERIS,
    GUARD,
    OWN,
    SETTABLE,
    Gate,
    first_gate,
    gated_step,
)
from torquer.computer.interface import nothing_known
from torquer.computer.modes.table import NO_MODES, first_state
from torquer.spacecraft.sensors.devices import DEVICES


@kernel
def command_at(computer, board):
    """The computer's control step, which has no form of its own for the interpreter."""
    return control_step(computer, board)


class OnBoard:
    """Laws by name (and a mode table) as the loop has them; the estimate is what sensors read."""

    def __init__(self, laws, modes=None):
        self.blocks, self.modes = Blocks(laws, {}), modes
        table, state = NO_MODES, first_state(NO_MODES, [])
        if modes is not None:
            numbers = {name: number for number, name in enumerate(laws)}
            table, state = modes.pack(numbers, {}, parameter_places(self.blocks))
        self.computer = records(make_computer(self.blocks, SENSOR_READINGS, table))
        self.board = records(first_board(self.blocks, state, SENSOR_READINGS))

    def __call__(self, known):
        """The command."""
        put_known(self.board.known, known)
        return command_at(self.computer, self.board)

    def memory_of(self, name):
        """What a law remembers, by its names."""
        row = self.computer.law_blocks[list(self.blocks.laws).index(name)]
        return self.blocks.laws[name].record_of(self.board.memory[row["m0"] : row["m1"]])


class Gated(OnBoard):
    """The same behind a gate without bounds, whose clock may go ahead as it likes."""

    def __init__(self, laws, modes=None):
        super().__init__(laws, modes)
        readings = [(row, device.count, math.inf) for row, device in enumerate(DEVICES)]
        self.gate = records(
            Gate(
                np.array(readings, CHECKED),
                *(np.zeros(0, BOUND) for _ in range(4)),
                np.zeros(0, GUARD),
                np.zeros(len(self.board.parameters), SETTABLE),
                self.board.memory.copy(),
                np.zeros(0, EPHEMERIS),
                np.zeros(0, OWN),
                0,
                math.inf,
                0,
            )
        )
        self.now, self.given = records(first_gate()), records(nothing_known())

    def __call__(self, known):
        """The answer."""
        put_known(self.given, known)
        return gated_step(self.gate, self.computer, self.board, self.now, self.given)
