"""How large a run is: steps, rows, memory, disk, computing time; and that it can fit.

The costs were measured on one core of a 2020s server; they are meant to a factor of three.
"""

import math
import os
import shutil
from pathlib import Path
from typing import NamedTuple

import numpy as np

from torquer.base.shared import shared
from torquer.scenario.spec import Scenario, whole_steps
from torquer.simulation.results.variables import estimated, inputs
from torquer.spacecraft.sensors.sampling import Sampled

#: Numbers in a row of a result: without wheels, with them, and for each of them; an estimate; what
#: the computer believes of its surroundings.
_ROW, _ROW_WHEELS, _ROW_WHEEL, _ROW_BELIEVED = 49, 3, 3, 6
#: Copies of its rows that a result in memory needs while it is made.
_COPIES = 3
#: Memory [byte] of the package and what it computes with; while tables are made, of those of a
#: revolution or, exact, of a step.
BASE_BYTES, _REVOLUTION_BYTES, _EXACT_BYTES = 3e8, 1e6, 2e3
#: Computing time [s]: of a step by its integrator, with wheels, air or what else disturbs; of a
#: reading and its laws, with wheels, in plain Python; of tables by the revolution or, exact, by the
#: step; of a row.
_STEP_S = {"auto": 3e-7, "rk4": 1e-7, "splitting": 8e-7}
#: Turn of the body [rad] in an adaptive step.
_AUTO_TURN = 0.5
_WHEELS_S, _READING_S, _WHEELS_READING_S, _PYTHON_S = 2e-7, 1.5e-7, 1.3e-6, 6e-5
_REVOLUTION_S, _EXACT_S, _ROW_S = 3e-3, 2e-6, 6e-6


#: A run is computed in pieces: at most so many rows of the record, so many segments of the orbit's
#: first table, so many steps of an exact one. Each has tables of its own.
_PIECE_ROWS, _PIECE_SEGMENTS, _PIECE_EXACT_STEPS = 65536, 8192, 131072


@shared
def piece_steps(scenario: Scenario) -> int:
    """Steps of a piece of a run: a whole number of records.

    It does not depend on the duration, nor on where the result is kept: that would change bits.
    """
    simulation, step_s = scenario.simulation, scenario.grid_s
    record = whole_steps("record_s", simulation.record_s, step_s)
    tabulated = _PIECE_EXACT_STEPS
    if scenario.environment.table_tolerance > 0.0:
        tabulated = int(_PIECE_SEGMENTS * scenario.orbit_environment().segment_s / step_s)
    return max(1, min(tabulated // record, _PIECE_ROWS)) * record


class Size(NamedTuple):
    """What a run takes: counts, bytes, seconds of computing.

    `memory_bytes` if the result goes to a file, `whole_in_memory_bytes` if it does not.
    """

    steps: int
    rows: int
    memory_bytes: float
    whole_in_memory_bytes: float
    disk_bytes: float
    computing_s: float


def estimate_size(scenario: Scenario, compiled: bool = True) -> Size:
    """Estimate for a run; `compiled`: whether its laws are."""
    steps, simulation = scenario.steps(), scenario.simulation
    rows = steps // whole_steps("record_s", simulation.record_s, scenario.grid_s) + 1
    row_bytes, piece = 8.0 * row_numbers(scenario), min(steps, piece_steps(scenario))
    copies = _COPIES * row_bytes * min(rows, piece * rows / steps)
    of_a_piece = BASE_BYTES + table_bytes(scenario, piece) + copies
    in_memory = of_a_piece + (2.0 * row_bytes * rows if steps > piece else 0.0)
    seconds = stepping_s(scenario, compiled) + tables_s(scenario) + _ROW_S * rows
    return Size(steps, rows, of_a_piece, in_memory, row_bytes * rows, seconds)


def table_bytes(scenario: Scenario, steps: int) -> float:
    """Memory [byte] of the tables of so many steps while they are made."""
    if scenario.environment.table_tolerance == 0.0:
        return _EXACT_BYTES * steps
    return _REVOLUTION_BYTES * steps * scenario.grid_s / scenario.orbit.period_s


def row_numbers(scenario: Scenario) -> int:
    """How many numbers of eight bytes a row of the result has."""
    wheels, (laws, modes) = scenario.spacecraft.wheels, scenario.control.named()
    estimators = [spec for spec in _estimators(scenario) if hasattr(spec, "estimator")]
    blocks = [law.law() for law in laws.values() if law.kind != "given_in_python"]
    blocks += [spec.estimator(scenario.spacecraft.units()) for spec in estimators]
    logged = sum(part.cells for block in blocks for part in block.logged().values())
    numbers = _ROW + logged + (len(modes.regions) if modes else 0)
    if wheels:
        numbers += _ROW_WHEELS + _ROW_WHEEL * len(wheels.layout.rows())
    if scenario.simulation.record_inputs:
        numbers += sum(len(each.cells) for each in inputs(scenario.spacecraft.units()))
    if scenario.believed_environment() != scenario.orbit_environment():
        numbers += _ROW_BELIEVED
    if any(spec.kind not in ("attitude_sensor", "none") for spec in _estimators(scenario)):
        numbers += sum(len(each.cells) for each in estimated(scenario.spacecraft.units()))
    return numbers


def _estimators(scenario: Scenario) -> list:
    return [scenario.control.estimator, *scenario.control.estimators.values()]


def stepping_s(scenario: Scenario, compiled: bool) -> float:
    """Computing time [s] of the steps of a run; `compiled`: whether its laws are."""
    craft, control, simulation = scenario.spacecraft, scenario.control, scenario.simulation
    steps = scenario.steps()
    duration_s = steps * scenario.grid_s
    readings = duration_s / control.cycle_s * control.steps_in_cycle
    readings += sum(duration_s / interval_s for interval_s in _own_intervals_s(scenario))
    # adaptive steps: one for each reading, more for a fast rotation
    turns = duration_s * math.radians(float(np.linalg.norm(scenario.initial.rate_deg_s)))
    taken = max(readings, turns / _AUTO_TURN) if simulation.integrator == "auto" else steps
    if craft.coils is not None and craft.coils.pwm_period_s is not None:
        taken += (len(craft.coils.axes) + 1) * duration_s / craft.coils.pwm_period_s
    step_s = _STEP_S[simulation.integrator]
    disturbed = craft.aerodynamics or scenario.acting_torques()
    step_s += _WHEELS_S if craft.wheels or disturbed else 0.0
    reading_s = _READING_S + (_WHEELS_READING_S if craft.wheels else 0.0)
    reading_s += 0.0 if compiled else _PYTHON_S
    return step_s * taken + reading_s * readings


def tables_s(scenario: Scenario) -> float:
    """Computing time [s] of the tables of a run."""
    if scenario.environment.table_tolerance == 0.0:
        return _EXACT_S * scenario.steps()
    return _REVOLUTION_S * scenario.length_s / scenario.orbit.period_s


def _own_intervals_s(scenario: Scenario) -> list[float]:
    """Intervals of the sensors that are read at rates of their own."""
    sensors = [value for _, value in scenario.spacecraft if isinstance(value, Sampled)]
    return [sensor.sample_s for sensor in sensors if sensor.sample_s is not None]


def machine_memory() -> float:
    """Memory of this machine [byte]; infinite where the system does not tell."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):  # not on every system
        return float("inf")


def free_disk(folder: Path) -> float:
    """Bytes free where a folder is, or will be."""
    return float(shutil.disk_usage(next(p for p in (folder, *folder.parents) if p.exists())).free)


def check_memory(size: Size, to_file: bool) -> None:
    """ValueError for a run that does not fit in the memory of this machine."""
    needed = size.memory_bytes if to_file else size.whole_in_memory_bytes
    if needed > (there := machine_memory()):
        way_out = "" if to_file else " (simulate with to='result.nc' keeps it in a file)"
        raise ValueError(
            f"simulation: {size.rows:.6g} rows of the record (duration over record_s) must fit in "
            f"the {bytes_text(there)} of memory of this machine; received a run that needs "
            f"about {bytes_text(needed)}{way_out}"
        )


def check_disk(size: Size, folder: Path) -> None:
    """ValueError for a result that does not fit on the disk of a folder.

    Twice: it is replaced by its successor when that is written.
    """
    if 2.0 * size.disk_bytes > (there := free_disk(folder.absolute())):
        raise ValueError(
            f"simulation: {size.rows:.6g} rows of the record (duration over record_s) must fit in "
            f"the {bytes_text(there)} that are free at {folder}; received a result of "
            f"about {bytes_text(size.disk_bytes)}, for a moment twice on the disk"
        )


def bytes_text(count: float) -> str:
    """Bytes in the unit that suits them: '12 MB'."""
    for unit, factor in (("TB", 1e12), ("GB", 1e9), ("MB", 1e6)):
        if count >= factor:
            return f"{count / factor:.3g} {unit}"
    return f"{count / 1e3:.3g} kB"


def time_text(seconds: float) -> str:
    """A time in the unit that suits it: '20 s', '3.1 min'."""
    if seconds < 1.0:
        return "less than 1 s"
    for unit, factor in (("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2.0 * factor:
            return f"{seconds / factor:.2g} {unit}"
    return f"{seconds:.2g} s"
