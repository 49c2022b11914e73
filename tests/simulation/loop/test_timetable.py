"""The timetable: its rows against a slow twin that looks at every step by itself."""

import itertools
import math

import hypothesis.strategies as st
import numpy as np
from hypothesis import given, settings

from torquer.computer.interface import GYRO, MAGNETOMETER, SEARCH_COIL, SENSORS
from torquer.simulation.loop.timetable import (
    COILS_OFF,
    COILS_ON,
    COILS_STAY,
    CONTROL,
    DELIVER,
    READ,
    Sampling,
    make_timetable,
    next_row,
    row_from,
)


def actions_at(step, cycle, measure, sample, read, while_acting):
    """Bits of what is due at a step, from the rules alone."""
    phase = step % cycle
    window = phase == measure or (phase < measure and phase % sample == 0)
    acts = while_acting and phase > measure and (phase - measure) % sample == 0
    controls = window or acts
    bits = COILS_OFF * (phase == 0 and measure > 0) + CONTROL * controls
    bits += COILS_ON * (phase == measure) + COILS_STAY * bool(acts)
    for sensor, (interval, delay) in read.items():
        undisturbed = sensor not in (MAGNETOMETER, SEARCH_COIL)
        reads = step % interval == 0 if interval else window or (acts and undisturbed)
        arrives = interval > 0 and delay > 0 and (step - delay) % interval == 0
        bits += (READ << sensor) * reads + (DELIVER << sensor) * arrives
    return bits


@st.composite
def timings(draw):
    """(cycle, measurement window, control interval, sensors) in steps."""
    sample, windows = draw(st.integers(1, 6)), draw(st.integers(0, 4))
    measure = sample * windows
    cycle = measure + draw(st.integers(1, 8)) if windows else sample
    sensors = draw(st.sets(st.integers(0, len(SENSORS) - 1), min_size=1, max_size=4))
    read = {}
    for sensor in sorted(sensors):
        interval = draw(st.integers(0, 9))
        read[sensor] = Sampling(interval, draw(st.integers(0, interval)))
    return cycle, measure, sample, read, windows > 0 and draw(st.booleans())


@settings(max_examples=200, deadline=None)
@given(timings(), st.integers(0, 10_000))
def test_rows_are_what_is_due_at_each_step(timing, from_step):
    table = make_timetable(*timing, disturbed=(MAGNETOMETER, SEARCH_COIL))
    found, step = {}, from_step
    last = from_step + 2 * table.cycle_steps + 1
    while step < last:
        due, actions = next_row(table, step)
        found[due] = actions
        step = due + 1
    every = {step: actions_at(step, *timing) for step in range(from_step, last)}
    assert {step: bits for step, bits in found.items() if step < last} == {
        step: bits for step, bits in every.items() if bits
    }


@settings(max_examples=100, deadline=None)
@given(timings())
def test_a_command_is_held_until_the_next_control_step(timing):
    table = make_timetable(*timing, disturbed=(MAGNETOMETER, SEARCH_COIL))
    controls = [
        step for step in range(3 * table.cycle_steps) if actions_at(step, *timing) & CONTROL
    ]
    hold = {int(row["step"]): int(row["hold_steps"]) for row in table.rows}
    for step, following in itertools.pairwise(controls):
        assert hold[step % table.cycle_steps] == following - step


@settings(max_examples=100, deadline=None)
@given(timings())
def test_all_repeats_after_the_least_common_multiple(timing):
    cycle, _, _, read, _ = timing
    intervals = [sampling.interval for sampling in read.values() if sampling.interval]
    assert make_timetable(*timing).cycle_steps == math.lcm(cycle, *intervals)


def test_steps_of_a_run_are_walked_cycle_by_cycle():
    table = make_timetable(10, 6, 2, {MAGNETOMETER: Sampling(), GYRO: Sampling(4, 1)})
    assert table.cycle_steps == 20
    assert row_from(table, 19) == (0, 20)  # the next one is the first of the next cycle
    number, cycle = row_from(table, 47)
    assert (int(table.rows[number]["step"]), cycle) == (8, 40)


def test_readings_that_are_not_late_go_straight_to_the_computer():
    late = make_timetable(4, 0, 4, {MAGNETOMETER: Sampling(2, 1), GYRO: Sampling(2, 0)}).late
    assert late == READ << MAGNETOMETER
    rows = make_timetable(4, 0, 4, {GYRO: Sampling(2, 0)}).rows
    assert not np.any(rows["actions"] & (DELIVER << GYRO))
