"""Drivers of coils: steps, dead band, random errors, the instants of pulse-width modulation."""

import numpy as np
import pytest
from scipy import stats

from torquer.compile.engine import kernel, records
from torquer.spacecraft.actuators import coil_driver, coils as room
from torquer.spacecraft.actuators.coils import COIL_STATE, Coils


@kernel
def drive(coils, state, command, seed, step):
    room.command_coils(coils, command, state)
    return coil_driver.drive_as_given(coils, state, seed, step)


@kernel
def believed(coils, state):
    return room.believed_dipole(coils, state)


@kernel
def next_switch(coils, state, t_s):
    return coil_driver.next_switch(coils, state, t_s)


@kernel
def switch(coils, state, t_s):
    return coil_driver.switch_coils(coils, state, t_s)


def state_of(coils):
    return records(np.zeros(len(coils.rows), COIL_STATE))


def given(command, seed=1, step=0, **keys):
    """Dipoles [A m^2] that three coils have for a command."""
    coils = Coils(**{"limit_a_m2": 1.0} | keys).pack()
    state = state_of(coils)
    goal = drive(coils, state, tuple(command), seed, step)
    assert np.array_equal(state["target_a_m2"], state["dipole_a_m2"])
    assert goal.dipole_a_m2 == pytest.approx(state["target_a_m2"], abs=1e-15)
    assert believed(coils, state) == tuple(command)  # the computer knows nothing of it
    return state["target_a_m2"].copy()


def test_dipoles_are_rounded_to_the_nearest_step():
    found = given((0.24, -0.26, 0.5), resolution_a_m2=0.1)
    assert found == pytest.approx([0.2, -0.3, 0.5], abs=1e-15)
    each = given((0.24, -0.26, 0.5), resolution_a_m2=(0.1, 0.25, 0.0))
    assert each == pytest.approx([0.2, -0.25, 0.5], abs=1e-15)


def test_no_step_is_beyond_the_limit():
    """Of steps that do not divide the limit the last one is out of reach."""
    found = given((1.0, -0.99, 0.7), resolution_a_m2=0.3)
    assert found == pytest.approx([0.9, -0.9, 0.6], abs=1e-15)
    assert given((1.0, -1.0, 0.5), resolution_a_m2=0.1)[:2] == pytest.approx([1.0, -1.0])


def test_small_commands_are_dead():
    found = given((0.049, -0.051, 0.0), dead_band_a_m2=0.05)
    assert found.tolist() == [0.0, -0.051, 0.0]
    # the command is judged, not what rounding makes of it
    both = given((0.06, 0.04, 0.2), dead_band_a_m2=0.05, resolution_a_m2=0.1)
    assert both == pytest.approx([0.1, 0.0, 0.2], abs=1e-15)


def test_errors_are_random_relative_and_of_each_coil():
    commands = np.array([[0.5, -0.2, 0.8]] * 4000)
    found = [given(c, step=k, random_error=0.03) for k, c in enumerate(commands)]
    errors = (np.array(found) / commands - 1.0) / 0.03
    for axis in range(3):
        assert stats.kstest(errors[:, axis], "norm").pvalue > 1e-3
    both = np.corrcoef(np.hstack([errors[1:], errors[:-1]]).T) - np.eye(6)
    assert np.abs(both).max() < 5.0 / np.sqrt(len(errors))
    assert given((0.5, 0.5, 0.5), seed=2, random_error=0.03) != pytest.approx(found[0])
    again = given(commands[7], step=7, random_error=0.03)
    assert np.array_equal(again, found[7])


def test_errors_of_many_coils_are_apart():
    axes = np.random.default_rng(1).normal(size=(7, 3))
    coils = Coils(limit_a_m2=9.0, axes=axes, random_error=0.1).pack()
    factors = []
    for step in range(3):
        state = state_of(coils)
        drive(coils, state, (1.0, 2.0, 3.0), 4, step)
        factors += [*(state["target_a_m2"] / state["command_a_m2"])]
    assert len({round(each, 12) for each in factors}) == 21


def test_without_a_driver_a_command_is_kept_to_the_bit():
    command = (0.1 + 0.2, -1.0 / 3.0, 1e-12)
    assert tuple(given(command)) == command


def modulated(mean, period=0.1, **keys):
    coils = Coils(**{"limit_a_m2": 2.0, "pwm_period_s": period} | keys).pack()
    state = state_of(coils)
    state["mean_a_m2"] = mean
    return coils, state


def test_coils_are_on_for_their_share_of_each_period():
    coils, state = modulated((0.5, -1.0, 0.0))
    t, seen = 0.0, []
    while t < 0.2 - 1e-9:
        goal = switch(coils, state, t)
        later = next_switch(coils, state, t)
        seen.append((later - t, goal.dipole_a_m2))
        t = later
    expected = [(0.025, (2.0, -2.0, 0.0)), (0.025, (0.0, -2.0, 0.0)), (0.05, (0.0, 0.0, 0.0))]
    for (length, dipole), (expected_s, expected_dipole) in zip(seen, expected * 2, strict=True):
        assert length == pytest.approx(expected_s, abs=1e-12)
        assert dipole == expected_dipole


@pytest.mark.parametrize(
    ("place", "expected"),
    [
        ("middle", [(0.025, (0.0, 0.0)), (0.0125, (0.0, -2.0)), (0.025, (2.0, -2.0)),
                    (0.0125, (0.0, -2.0)), (0.025, (0.0, 0.0))]),
        ("end", [(0.05, (0.0, 0.0)), (0.025, (0.0, -2.0)), (0.025, (2.0, -2.0))]),
    ],
)  # fmt: skip
def test_the_pulse_stands_at_its_place_in_the_period(place, expected):
    """A quarter of the time along x, half of it along y, the third coil off."""
    coils, state = modulated((0.5, -1.0, 0.0), pwm_place=place)
    t, seen = 0.0, []
    while t < 0.2 - 1e-9:
        goal = switch(coils, state, t)
        later = next_switch(coils, state, t)
        seen.append((later - t, goal.dipole_a_m2))
        t = later
    for (length, dipole), (known_s, known) in zip(seen, expected * 2, strict=True):
        assert length == pytest.approx(known_s, abs=1e-9)
        assert dipole == (*known, 0.0)


@pytest.mark.parametrize("place", ["begin", "middle", "end"])
@pytest.mark.parametrize("first", [0.0, 3.0, 86400.0 * 10])
@pytest.mark.parametrize("period", [0.1, 0.3, 1.0 / 3.0, 0.7])
def test_shares_hold_whatever_the_period_and_the_time(first, period, place):
    """Of many periods, none of which is a whole number of binary fractions."""
    coils, state = modulated((1.3, 2.0, -0.01), period, pwm_place=place)
    t, end, total = first, first + 30 * period, np.zeros(3)
    for _ in range(1000):
        if t >= end:
            break
        goal = switch(coils, state, t)
        later = min(next_switch(coils, state, t), end)
        assert later > t
        total, t = total + (later - t) * np.array(goal.dipole_a_m2), later
    assert total / (30 * period) == pytest.approx([1.3, 2.0, -0.01], abs=1e-5)


def test_a_coil_at_its_limit_is_never_off():
    coils, state = modulated((2.0, -2.5, 2.0 - 1e-9))
    assert switch(coils, state, 0.0999).dipole_a_m2 == (2.0, -2.0, 2.0)
    assert next_switch(coils, state, 0.05) == pytest.approx(0.1, abs=1e-10)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"resolution_a_m2": 1.5}, "resolution_a_m2: must not exceed the limit of coil 0, 1 A m"),
        ({"dead_band_a_m2": (0.1, 0.1, 1.1)}, "dead_band_a_m2: must not exceed the limit of coil "
         r"2, 1 A m\^2, or it has no dipole at all; received 1.1 A m\^2"),
        ({"resolution_a_m2": (0.1, 0.1)}, r"resolution_a_m2: must be one number or one per coil "
         r"\(3 axes\); received 2 numbers"),
        ({"random_error": 1.5}, "less than or equal to 1"),
        ({"pwm_period_s": 0.0}, "greater than 0"),
        ({"pwm_place": "end"}, "pwm_place: must be left out without pwm_period_s; received 'end'"),
    ],
)  # fmt: skip
def test_drivers_that_cannot_be_are_refused(keys, message):
    with pytest.raises(ValueError, match=message):
        Coils(limit_a_m2=1.0, **keys)
