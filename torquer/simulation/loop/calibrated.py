"""Where calibration acts in the loop: on readings that reach the computer, on the coils' command.

The ground calibrates the computer of one satellite; members in lanes have nobody who would.
"""

from numba.extending import overload

from torquer.compile.engine import inlined, kernel
from torquer.compile.numba_private import INLINED_OPTIONS
from torquer.computer.calibration import (
    correct_readings,
    correct_tachometers,
    corrected_dipole,
    expected_dipole,
)
from torquer.computer.interface import ROWS, TACHOMETERS
from torquer.simulation.loop.members import One, each
from torquer.simulation.loop.state import put_goal
from torquer.simulation.loop.timetable import ANY_DELIVERY, READ
from torquer.spacecraft.actuators.coils import believed_dipole, command_coils


@inlined
def _read(member, late, actions):
    """Correct what has been read or delivered now, where anything is calibrated."""
    state = member.state
    c, known = state.calibration[0], state.board.known[0]
    if c.sensors > 0.0:
        at_once = (actions >> ROWS) & ~(late >> ROWS)
        correct_readings(c, known, at_once | (actions & ANY_DELIVERY))
    if c.wheels > 0.0 and actions & (READ << TACHOMETERS):
        correct_tachometers(c, known, member.constants.rotors, state.allocation.momentum)


def calibrate(members, late, actions):
    """Correct the readings that reach the computer now."""
    _read(members.member, late, actions)


@overload(calibrate, jit_options=INLINED_OPTIONS)
def _calibrate(members, late, actions):
    if members.instance_class is One:
        return calibrate
    return lambda members, late, actions: None


@inlined
def drive_coils_step(member):
    """Hand the dipole that is kept to the coils."""
    state, coils = member.state, member.constants.coils
    c = state.cells[0]
    goal = command_coils(coils, (c.dipole_x, c.dipole_y, c.dipole_z), state.coils)
    put_goal(state.cells, goal)
    c.set_x, c.set_y, c.set_z = believed_dipole(coils, state.coils)


@kernel
def _drive_calibrated_step(member):
    """The same to coils that are calibrated."""
    state, coils = member.state, member.constants.coils
    c, calibration = state.cells[0], state.calibration[0]
    wanted = corrected_dipole(calibration, (c.dipole_x, c.dipole_y, c.dipole_z))
    put_goal(state.cells, command_coils(coils, wanted, state.coils))
    commanded = believed_dipole(coils, state.coils)
    c.set_x, c.set_y, c.set_z = expected_dipole(calibration, commanded)


def drive_coils(members):
    """Hand the dipoles that are kept to the coils of all members."""
    if members.member.state.calibration[0].coils > 0.0:
        _drive_calibrated_step(members.member)
    else:
        drive_coils_step(members.member)


@overload(drive_coils, jit_options=INLINED_OPTIONS)
def _drive_coils(members):
    if members.instance_class is One:
        return drive_coils
    return lambda members: each(members, drive_coils_step)
