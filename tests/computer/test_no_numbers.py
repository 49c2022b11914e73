"""A reading that is no number: what laws, modes and estimators do without it."""

import math

import numpy as np
import pytest
from computer.laws.test_laws import EXAMPLES, SPECS, readings
from law_cases import UNKNOWN
from law_examples import of_scenario
from on_board import Gated, OnBoard

from torquer.computer.blocks.law import law
from torquer.computer.laws import LAWS

#: Vectors that a computer is handed, and what a law declares that takes each.
NEEDS = {
    "b_body_t": "magnetometer",
    "b_rate_body_t_s": "search_coil",
    "omega_body_rad_s": "rate",
    "sun_body": "sun",
    "q_body_to_inertial": "attitude",
    "wheel_momentum_body_n_m_s": "tachometers",
    "coil_dipole_body_a_m2": "coil_dipole",
    "nadir_body": "horizon",
    "sun_cells": "sun_cells",
    "r_inertial_m": "place",
    "v_inertial_m_s": "place",
    "b_inertial_t": "model_field",
    "b_rate_inertial_t_s": "model_field",
    "sun_inertial": "model_sun",
}
#: Times of readings, as `ReadingTimes` has them; those of attitude and gyro are the estimate's.
TIMES = {
    "magnetometer": "magnetometer_s",
    "search_coil": "search_coil_s",
    "sun": "sun_sensors_s",
    "tachometers": "tachometers_s",
}
FAILED = (17, 18, 24)
BUILT_IN = [kind for kind in LAWS if kind != "user"]


def example(kind):
    """The example of a built-in law."""
    return SPECS.validate_python({"kind": kind, **EXAMPLES[kind]}).law().filled(of_scenario)


def flown(made, rows, on_board=OnBoard):
    """Commands for inputs one after another, and the memory that is left."""
    board = on_board({"law": made})
    commands = [board(row) for row in rows]
    numbers = np.array([[*c.dipole_a_m2, *c.torque_n_m] for c in commands])
    return numbers, np.array(board.board.memory)


def spoil(row, name, components, value):
    """Inputs in which components of a vector have a value."""
    if name in row.ephemeris._fields:
        return row._replace(ephemeris=spoil_part(row.ephemeris, name, components, value))
    return spoil_part(row, name, components, value)


def spoil_part(part, name, components, value):
    vector = [value if k in components else x for k, x in enumerate(getattr(part, name))]
    return part._replace(**{name: tuple(vector)})


def spoilt(rows, name, value, rng):
    """Inputs in which a vector is no number at times, in all components or in one."""
    rows, size = list(rows), 4 if name == "q_body_to_inertial" else 3
    for place in FAILED:
        components = range(6) if place == FAILED[0] else [int(rng.integers(size))]
        rows[place] = spoil(rows[place], name, components, value)
    return rows


def same(a, b):
    """Whether numbers have the same bits; one that is not a number is as any other."""
    return np.array_equal(a, b, equal_nan=True) and np.array_equal(np.signbit(a), np.signbit(b))


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("kind", BUILT_IN)
def test_a_law_rests_without_a_reading_that_it_needs_and_sees_no_other(kind, value):
    """What it waits for: as if it had not been called then. What it does not need: the same."""
    made, rows, rng = example(kind), readings(), np.random.default_rng(5)
    whole, kept = flown(made, rows)
    for name, need in NEEDS.items():
        found, memory = flown(made, spoilt(rows, name, value, rng))
        assert np.isfinite(found).all() and np.isfinite(memory).all()
        if need not in made.needs:
            assert same(found, whole) and same(memory, kept)
        elif need in made.waits_for:
            left = [row for place, row in enumerate(rows) if place not in FAILED]
            rested, remembered = flown(made, left)
            assert not found[list(FAILED)].any()
            assert same(np.delete(found, FAILED, axis=0), rested) and same(memory, remembered)
            assert found[30:].any() == whole[30:].any()


@pytest.mark.parametrize("kind", BUILT_IN)
def test_a_reading_taken_at_no_time_is_none(kind):
    made, rows = example(kind), readings()
    for need, time in TIMES.items():
        for value in (math.nan, math.inf):
            timed = [row._replace(read_at=row.read_at._replace(**{time: value})) for row in rows]
            found, memory = flown(made, rows[:17] + timed[17:19] + rows[19:])
            assert np.isfinite(found).all() and np.isfinite(memory).all()
            assert found[17:19].any() <= (need not in made.waits_for)


@pytest.mark.parametrize("kind", BUILT_IN)
def test_at_a_time_that_is_no_number_nothing_is_done(kind):
    made, rows = example(kind), readings()
    lost = [row._replace(t_s=math.nan) for row in rows]
    found, memory = flown(made, rows[:17] + lost[17:19] + rows[19:], Gated)
    rested, kept = flown(made, rows[:17] + rows[19:], Gated)
    assert not found[17:19].any()
    assert same(np.delete(found, [17, 18], axis=0), rested) and same(memory, kept)


def test_only_laws_that_do_without_a_reading_are_called():
    bearing = {kind: made.needs - made.waits_for for kind in BUILT_IN if (made := example(kind))}
    assert {kind: needs for kind, needs in bearing.items() if needs} == {
        "spin_to_sun": {"sun"},
        "bias_momentum": {"magnetometer", "tachometers"},
    }


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_spin_goes_on_without_a_reading_of_the_sun(value):
    made, rows, rng = example("spin_to_sun"), readings(), np.random.default_rng(6)
    whole, _ = flown(made, rows)
    for k in FAILED:
        rows[k] = spoil(rows[k], "sun_body", range(3), 0.0)
    unseen, kept = flown(made, rows)
    found, memory = flown(made, spoilt(rows, "sun_body", value, rng))
    assert same(found, unseen) and same(memory, kept)
    assert found[list(FAILED)].any(axis=1).all() and not same(whole, found)


@pytest.mark.parametrize("value", [math.nan, math.inf])
@pytest.mark.parametrize("name", ["b_body_t", "wheel_momentum_body_n_m_s"])
def test_pitch_is_held_without_the_coils_readings(name, value):
    made, rows, rng = example("bias_momentum"), readings(), np.random.default_rng(7)
    whole, _ = flown(made, rows)
    found, _ = flown(made, spoilt(rows, name, value, rng))
    assert same(found[:, 3:], whole[:, 3:])
    assert found[list(FAILED), :3].any() == (name != "b_body_t")
    assert found[30:, :3].any()


@law
def reads_all(inputs, parameters, memory):
    return (inputs.b_body_t[0], inputs.sun_body[1], inputs.omega_body_rad_s[2])


def test_a_users_law_sees_what_is_read():
    rows = [row._replace(b_body_t=UNKNOWN, sun_body=UNKNOWN, omega_body_rad_s=UNKNOWN)
            for row in readings(2)]  # fmt: skip
    found, _ = flown(reads_all, rows)
    assert np.isnan(found[:, :3]).all()
