"""The timetable of the on-board computer: when which sensor is read, when it controls.

A control cycle is a window of measurement (coils off) followed by a window of actuation; a
measurement window of no length gives plain sample-and-hold control. The laws are called at every
sampling instant of the measurement window and at its end; the coils follow their latest answer. A
sensor without a rate of its own is read at every one of these instants. Where it is wanted, the
computer goes on controlling while the coils act: for the wheels, without the sensors that the
coils disturb. The whole repeats after
the least common multiple of the cycle and the sensors' intervals. All times are whole numbers of
steps, so a run can stop at any step and go on bit for bit.
"""

import math
from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from torquer.compile.engine import kernel
from torquer.computer.interface import ROWS, SENSORS

#: Actions, in the order in which they are done: late readings arrive, coils off, sensors are read,
#: the computer controls, coils on. A sensor has the bit of the first one shifted by its number.
#: Where the computer controls while the coils act, they stay as they are.
DELIVER, READ = 1, 1 << ROWS
COILS_OFF, CONTROL, COILS_ON, COILS_STAY = (1 << (2 * ROWS + k) for k in range(4))
#: Readings of devices of which there are several.
ANY_UNIT = READ * ((1 << ROWS) - (1 << len(SENSORS)))
#: All deliveries.
ANY_DELIVERY = READ - 1
#: A row: step within the cycle, bits of its actions, steps to the next row that controls.
ROW = np.dtype([("step", np.int64), ("actions", np.int64), ("hold_steps", np.int64)])


class Timetable(NamedTuple):
    """Rows sorted by their step; they repeat every `cycle_steps`.

    `late`: bits of the sensors whose readings arrive late.
    """

    cycle_steps: int
    rows: np.ndarray
    late: int


def all_actions(timetable: Timetable) -> int:
    """Bits of all actions that are ever due."""
    return int(np.bitwise_or.reduce(timetable.rows["actions"]))


class Sampling(NamedTuple):
    """A sensor's interval and delay in steps; interval 0: read at every control step."""

    interval: int = 0
    delay: int = 0


@kernel
def row_from(timetable, step):
    """(Number of the first row due at or after a step, first step of its cycle)."""
    phase = step % timetable.cycle_steps
    number, cycle = 0, step - phase
    while number < timetable.rows.shape[0] and timetable.rows[number].step < phase:
        number += 1
    if number == timetable.rows.shape[0]:
        return 0, cycle + timetable.cycle_steps
    return number, cycle


def next_row(timetable: Timetable, step: int) -> tuple[int, int]:
    """(Step of the first row at or after a step, bits of its actions)."""
    number, cycle = row_from(timetable, step)
    row = timetable.rows[number]
    return int(cycle + row["step"]), int(row["actions"])


def longest_interval(timetable: Timetable, sensor: int) -> int:
    """The longest interval between two readings of a sensor, in steps; 0 if it is never read."""
    steps = timetable.rows["step"][timetable.rows["actions"] & (READ << sensor) != 0]
    if len(steps) == 0:
        return 0
    return int(np.diff(steps, append=steps[0] + timetable.cycle_steps).max())


def make_timetable(
    cycle_steps: int,
    measure_steps: int,
    sample_steps: int,
    read: dict[int, Sampling],
    while_acting: bool = False,
    disturbed: Collection[int] = (),
) -> Timetable:
    """The timetable of a control cycle and of the sensors that are read, by their numbers.

    `while_acting`: whether the computer controls while the coils act, too, without readings of the
    sensors that are `disturbed`, unless they have a rate of their own.
    """
    control = [*range(0, measure_steps, sample_steps), measure_steps]
    acting = range(measure_steps + sample_steps, cycle_steps, sample_steps) if while_acting else ()
    own = {sensor: s for sensor, s in read.items() if s.interval}
    whole = math.lcm(cycle_steps, *(s.interval for s in own.values()))
    rows: dict[int, int] = {}

    def add(step: int, action: int) -> None:
        rows[step % whole] = rows.get(step % whole, 0) | action

    for begin in range(0, whole, cycle_steps):
        if measure_steps > 0:
            add(begin, COILS_OFF)
        for step in control:
            add(begin + step, CONTROL)
            for sensor in read.keys() - own.keys():
                add(begin + step, READ << sensor)
        for step in acting:
            add(begin + step, CONTROL | COILS_STAY)
            for sensor in read.keys() - own.keys() - set(disturbed):
                add(begin + step, READ << sensor)
        add(begin + measure_steps, COILS_ON)
    for sensor, sampling in own.items():
        for step in range(0, whole, sampling.interval):
            add(step, READ << sensor)
            if sampling.delay:
                add(step + sampling.delay, DELIVER << sensor)
    late = sum(READ << sensor for sensor, s in own.items() if s.delay)
    return Timetable(whole, _sort_rows(rows, whole), late)


def _sort_rows(rows: dict[int, int], whole: int) -> np.ndarray:
    table = np.zeros(len(rows), ROW)
    table["step"] = sorted(rows)
    table["actions"] = [rows[step] for step in table["step"]]
    controls = np.flatnonzero(table["actions"] & CONTROL)
    for this, following in zip(controls, np.roll(controls, -1), strict=True):
        table["hold_steps"][this] = (table["step"][following] - table["step"][this] - 1) % whole + 1
    return table
