"""What stays the same during a run, what changes, and what is kept of it: named records."""

from typing import NamedTuple

import numpy as np

from torquer.compile.engine import inlined
from torquer.computer.allocation import Allocation, AllocationState
from torquer.computer.computer import Board, Computer
from torquer.environment.sun import Shadow
from torquer.environment.table import Table
from torquer.maths.geometry.motion import Motion
from torquer.simulation.loop.timetable import Timetable
from torquer.spacecraft.actuators.coils import CoilSet
from torquer.spacecraft.actuators.rotors import Rotors
from torquer.spacecraft.body import Rigid
from torquer.spacecraft.disturbance.held import HeldTorque
from torquer.spacecraft.disturbance.unmodelled import Unmodelled
from torquer.spacecraft.failures import Failures
from torquer.spacecraft.sensors.device import MOST_PARTS, OWN_CELLS
from torquer.spacecraft.sensors.devices import SensorSets, UnitCounts, UnitSets


class ReadingTables(NamedTuple):
    """The tabulated environment that readings and ephemeris need.

    `orbit`: position [m], B [T], gravity-gradient vector [1/s]; `sun`: position of the Sun [m];
    `moon`: of the Moon [m].
    `believed_orbit`, `believed_sun`: the same by the computer's models, for its ephemeris; the
    very same tables where its models are the truth.
    """

    orbit: Table
    sun: Table
    moon: Table
    believed_orbit: Table
    believed_sun: Table


#: Cells of `State.at`.
AT_CELLS = 3
#: Cells of B [T] and gravity-gradient vector [1/s] where the loop stands: each of its phases would
#: look them up again.
LOCAL_CELLS = 6


@inlined
def put_local(cells, found):
    """Keep field and gravity-gradient vector."""
    (cells[0], cells[1], cells[2]), (cells[3], cells[4], cells[5]) = found


@inlined
def local_in(cells):
    """Field and gravity-gradient vector, as they are kept."""
    return (cells[0], cells[1], cells[2]), (cells[3], cells[4], cells[5])


class Plant(NamedTuple):
    """What the satellite's devices are: actuators, sensors with their errors.

    `rotors`: without rows for a satellite without wheels; `sensors`: constants of each device;
    `units`: of devices of which there are several, a row for each, `unit_counts`: how many.
    """

    coils: CoilSet
    rotors: Rotors
    sensors: SensorSets
    units: UnitSets
    unit_counts: UnitCounts
    tachometer_noise_rad_s: float
    shadow: Shadow
    failures: Failures


class Dynamics(NamedTuple):
    """What moves the body: its type is that of a compiled `propagate`.

    `rotors`: () for a satellite without wheels; `unmodelled`: sizes and jumps of that torque, ()
    where none of `torquer.spacecraft.disturbance` acts; `switching`: period [s] of the modulation
    of coils, () for coils that are not switched.
    """

    rigid: Rigid
    coils: CoilSet
    rotors: Rotors | tuple[()]
    held: HeldTorque
    unmodelled: Unmodelled | tuple[()]
    switching: tuple[float, ...]


class Plan(NamedTuple):
    """All that stays the same during a run, but for the motion between events.

    `stops`: the loop stops at every control step. `driven_from_outside`: for a command from
    outside, before modes and laws, which do not work; else after them. `log_cells`: cells
    of the memory that are recorded. `first_board`: what a computer that restarts begins with.
    """

    plant: Plant
    timetable: Timetable
    computer: Computer
    allocation: Allocation
    needs_ephemeris: bool
    stops: bool
    driven_from_outside: bool
    step_s: float
    record_steps: int
    log_cells: np.ndarray
    first_board: Board


def _record(*names: str) -> np.dtype:
    return np.dtype([(name, np.float64) for name in names])


def _xyz(*names: str) -> list[str]:
    return [f"{name}_{c}" for name in names for c in "xyz"]


#: A sensor: number of its readings so far; the reading on its way: when it was taken, its numbers;
#: what the device itself remembers.
SENSOR = np.dtype(
    [
        *((name, np.float64) for name in ("count", "t_s")),
        ("reading", np.float64, (MOST_PARTS,)),
        ("own", np.float64, (OWN_CELLS,)),
    ]
)
#: Attitude and rate; what the computer last asked for; energy of
#: the coils [J], greatest dipole of one; what RK4 did by itself: damping of oscillations, lag of
#: the rotation; adaptive steps: next one to try, of orders 8 and 5; shortest, their number, sums
#: of their errors; what the coils go to (`Goal`); the dipole that the computer has set, and the one
#: that it believes to have been reached at the last control step; for the condition that ends the
#: run (`torquer.simulation.setup.ending`), its signal at the start, and since when it holds.
CELLS = _record(
    *("q_x", "q_y", "q_z", "q_w"),
    *_xyz("omega", "dipole", "torque"),
    *("coil_energy_j", "peak_dipole_a_m2", "damping", "lag"),
    *("next_step_s", "slow_step_s", "least_step_s", "steps", "error_rad", "error_rad_s"),
    *_xyz("goal"),
    *("goal_power_w", "goal_greatest_a_m2"),
    *_xyz("set", "reached"),
    *("start_signal", "holds_since_s"),
)
#: What is kept of an instant: attitude, rate, dipole, last readings, last command.
ROW = _record(
    *("step", "q_x", "q_y", "q_z", "q_w"),
    *_xyz("omega", "dipole", "b_measured", "omega_measured", "sun_measured", "command", "torque"),
)


class State(NamedTuple):
    """All that changes: a few arrays, so that a run can be stored and resumed exactly.

    `at`: steps done, 1 while a host is to answer, bits (`READ`) of readings that sensors without
    power do not take; `cells`: one record; `sensors`, `coils`,
    `rotors`: state of each; `held`: present constant and random torque; `coefficients`: present
    ones of the unmodelled torque [N m]; `rods`: what hysteresis rods remember; `calibration`: see
    `torquer.computer.calibration`.
    """

    at: np.ndarray
    cells: np.ndarray
    sensors: np.ndarray
    coils: np.ndarray
    rotors: np.ndarray
    held: np.ndarray
    coefficients: np.ndarray
    rods: np.ndarray
    allocation: AllocationState
    calibration: np.ndarray
    board: Board


class Record(NamedTuple):
    """What is kept: a row of each array for each recorded instant.

    `rows`: `ROW`; `wheels`: momentum and motor torque of each; `log`: what the laws log; `known`:
    `KNOWN`, without rows where there is no estimator and nobody asks for it; `modes`: number of
    each region's state.
    """

    rows: np.ndarray
    wheels: np.ndarray
    log: np.ndarray
    known: np.ndarray
    modes: np.ndarray


def find_arrays(state: tuple) -> list[np.ndarray]:
    """All arrays in records, however deep."""
    return [
        array
        for part in state
        for array in ([part] if isinstance(part, np.ndarray) else find_arrays(part))
    ]


@inlined
def read_motion(cells):
    """Motion held in the state."""
    c = cells[0]
    return Motion((c.q_x, c.q_y, c.q_z, c.q_w), (c.omega_x, c.omega_y, c.omega_z))


@inlined
def put_motion(cells, x):
    """Write the motion into the state."""
    c = cells[0]
    c.q_x, c.q_y, c.q_z, c.q_w = x.q
    c.omega_x, c.omega_y, c.omega_z = x.omega


@inlined
def goal_dipole(cells):
    """The dipole [A m^2, body] that the coils go to."""
    c = cells[0]
    return (c.goal_x, c.goal_y, c.goal_z)


@inlined
def put_goal(cells, goal):
    """Write what the coils go to into the state."""
    c = cells[0]
    c.goal_x, c.goal_y, c.goal_z = goal.dipole_a_m2
    c.goal_power_w, c.goal_greatest_a_m2 = goal.power_w, goal.greatest_a_m2
