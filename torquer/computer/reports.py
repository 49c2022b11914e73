"""What the computer tells of itself: which laws work, which estimator, which guards have acted."""

from torquer.compile.engine import kernel
from torquer.computer.computer import is_off
from torquer.computer.modes.table import LAW


@kernel
def is_active(computer, board, law):
    """Whether a law works in the present states; without modes all do."""
    table = computer.modes
    if law < 0 or law >= computer.law_blocks.shape[0]:
        return False
    if table.regions.shape[0] == 0:
        return True
    found = False
    for region in range(table.regions.shape[0]):
        state = table.states[int(board.modes.regions[region].state)]
        for place in range(state.first_action, state.after_action):
            action = table.actions[place]
            found = found or (action.kind == LAW and action.index == law)
    return found and not is_off(table, board.modes, law)


@kernel
def active_estimator(computer, board):
    """The number of the estimator that works; below 0 where none does, see `computer.estimator`."""
    if computer.modes.regions.shape[0] == 0:
        return computer.estimator
    return int(board.chosen[0].estimator)


@kernel
def is_tripped(gate, board, region):
    """Whether a region that only guards has left its first state."""
    tripped = False
    for n in range(gate.guards.shape[0]):
        guard = gate.guards[n]
        if guard.region == region:
            tripped = int(board.modes.regions[guard.region].state) != guard.first
    return tripped
