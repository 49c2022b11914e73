"""Rotors: motor, friction and stands against fine steps and closed forms; what the body gets."""

import math

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import assume, example, given, settings

from torquer.compile.engine import records
from torquer.maths.geometry.vec3 import as_symmetric
from torquer.spacecraft.actuators.rotors import (
    ROTOR,
    ROTOR_STATE,
    Rotors,
    carried_momentum,
    reaction,
    relative_momentum,
    speed_after,
    step_rotors,
)

FINE = 4000
NEVER = 1e18
SKEW = np.array([[1.0, 2.0, 2.0], [2.0, 1.0, -2.0], [2.0, -2.0, 1.0], [3.0, 4.0, 0.0]])
SKEW /= np.linalg.norm(SKEW, axis=1)[:, None]


def row_of(inertia=2e-3, coulomb=0.0, viscous=0.0, breakaway=None, limit=600.0):
    row = records(np.zeros(1, ROTOR))[0]
    row["axis_z"], row["inertia"], row["speed_limit"], row["dead_from"] = 1.0, inertia, limit, NEVER
    row["coulomb"], row["viscous"] = coulomb, viscous
    row["breakaway"] = coulomb if breakaway is None else breakaway
    return row


def rotors_of(*rows):
    """Rotors about skew axes."""
    rows = records(np.array(list(rows)))
    axes = SKEW[: len(rows)]
    rows["axis_x"], rows["axis_y"], rows["axis_z"] = axes.T
    tensor = np.einsum("k,ki,kj->ij", rows["inertia"], axes, axes)
    return Rotors(rows, as_symmetric(tensor))


def axes_of(rotors):
    return np.column_stack([rotors.rows[f"axis_{c}"] for c in "xyz"])


def state_of(rotors, speed=0.0, omega=(0.0, 0.0, 0.0), motor=0.0, stands=0.0):
    state = records(np.zeros(len(rotors.rows), ROTOR_STATE))
    state["momentum"] = rotors.rows["inertia"] * (np.asarray(speed) + axes_of(rotors) @ omega)
    state["motor"], state["stands"] = motor, stands
    return state


def by_fine_steps(row, speed, stands, motor, t):
    """The same rotor in many small steps, friction as a thing that is on one side or the other."""
    dt = t / FINE

    def rate(s, side):
        return (motor - row["coulomb"] * side - row["viscous"] * s) / row["inertia"]

    for _ in range(FINE):
        if stands and abs(motor) <= row["breakaway"]:
            continue
        side = math.copysign(1.0, motor if stands or speed == 0.0 else speed)
        stands = False
        middle = speed + 0.5 * dt * rate(speed, side)
        after = speed + dt * rate(middle, side)
        if after * side < 0.0:
            stands = abs(motor) <= row["breakaway"]
            after = 0.0
        speed = min(max(after, -row["speed_limit"]), row["speed_limit"])
    return speed, stands


@st.composite
def rotors_in_motion(draw):
    """(Row, speed, whether it stands, motor torque, time), with friction of every kind or none."""
    inertia = 10.0 ** draw(st.floats(-5.0, 0.0))
    t = 10.0 ** draw(st.floats(-1.0, 2.0))
    scale = 100.0 * inertia / t  # a torque that changes the speed by 100 rad/s
    coulomb = scale * draw(st.one_of(st.just(0.0), st.floats(1e-3, 2.0)))
    viscous = inertia / t * draw(st.one_of(st.just(0.0), st.floats(1e-3, 4.0)))
    breakaway = coulomb * draw(st.floats(1.0, 3.0))
    motor = scale * draw(st.one_of(st.just(0.0), st.floats(-4.0, 4.0)))
    stands = coulomb > 0.0 and draw(st.booleans())
    speed = 0.0 if stands else draw(st.floats(-150.0, 150.0))
    return row_of(inertia, coulomb, viscous, breakaway, 150.0), speed, stands, motor, t


@settings(max_examples=100, deadline=None)
@given(rotors_in_motion())
@example((row_of(1e-3, 1e-3, 0.0, 1e-3, 150.0), 50.0, False, 0.0, 100.0))  # comes to a stand
@example((row_of(1e-3, 1e-3, 1e-5, 2e-3, 150.0), 50.0, False, -1.5e-3, 50.0))  # and stays there
@example((row_of(1e-3, 1e-3, 1e-5, 2e-3, 150.0), 50.0, False, -2.5e-3, 50.0))  # turns round
@example((row_of(1e-3, 1e-3, 1e-5, 2e-3, 150.0), 0.0, True, 1.5e-3, 50.0))  # does not start
@example((row_of(1e-3, 1e-3, 1e-5, 2e-3, 150.0), 0.0, True, -2.5e-3, 50.0))  # starts
@example((row_of(1e-3, 0.0, 0.0, 0.0, 150.0), 50.0, False, 1e-2, 50.0))  # at its limit
def test_speed_follows_fine_steps(case):
    row, speed, stands, motor, t = case
    assume(abs(abs(motor) - row["breakaway"]) > 1e-9 * row["breakaway"] or motor == 0.0)
    after, stands_after = speed_after(row, speed, stands, motor, t)
    expected, stands_expected = by_fine_steps(row, speed, stands, motor, t)
    # the fine steps miss an instant of a stand by up to one of them
    missed = 2.0 * (abs(motor) + row["coulomb"]) / row["inertia"] * t / FINE
    # (below the least normal number halves are rounded, too)
    away = missed + 1e-6 * abs(speed) + np.finfo(float).tiny
    assert after == pytest.approx(expected, abs=away)
    if stands_after != stands_expected:  # it stops within the last of them
        assert abs(after) + abs(expected) <= missed + 1e-6 * abs(speed)


@settings(max_examples=100, deadline=None)
@given(rotors_in_motion(), st.floats(0.01, 0.99))
@example((row_of(1e-3, 1e-3, 1e-5, 2e-3, 150.0), 50.0, False, -1.5e-3, 50.0), 0.5)
@example((row_of(1e-3, 1e-3, 1e-5, 2e-3, 150.0), 50.0, False, -2.5e-3, 50.0), 0.5)
@example((row_of(1e-3, 1e-3, 1e-5, 2e-3, 150.0), 0.0, True, -2.5e-3, 50.0), 0.5)
def test_two_steps_are_one(case, part):
    """Through a stand, a turn round and the limit, to rounding."""
    row, speed, stands, motor, t = case
    once, stands_once = speed_after(row, speed, stands, motor, t)
    middle, stands_middle = speed_after(row, speed, stands, motor, part * t)
    twice, stands_twice = speed_after(row, middle, stands_middle, motor, (1.0 - part) * t)
    # rounding of the speeds on the way, of which 4 times 150 is the greatest
    assert twice == pytest.approx(once, abs=1e-15 * 4.0 * 150.0 * 10.0)
    if stands_once != stands_twice:
        assert abs(once) + abs(twice) < 1e-12


@settings(max_examples=100, deadline=None)
@given(rotors_in_motion())
def test_a_rotor_turned_the_other_way_does_the_same(case):
    row, speed, stands, motor, t = case
    after, stood = speed_after(row, speed, stands, motor, t)
    assert speed_after(row, -speed, stands, -motor, t) == (-after, stood)


@settings(max_examples=100, deadline=None)
@given(rotors_in_motion())
def test_friction_alone_never_accelerates_or_reverses_a_rotor(case):
    row, speed, stands, _, t = case
    after, _ = speed_after(row, speed, stands, 0.0, t)
    assert 0.0 <= math.copysign(1.0, speed) * after <= abs(speed)


@pytest.mark.parametrize("viscous", [0.0, 1e-9, 2e-5])
def test_time_to_run_down(viscous):
    """I w' = -c - v w: from w0 the stand is reached after (I/v) ln(1 + v w0/c)."""
    inertia, coulomb, speed, h = 2e-3, 3e-4, 80.0, 0.25
    rotors = rotors_of(row_of(inertia, coulomb, viscous))
    state, steps = state_of(rotors, speed), 0
    while not state["stands"][0]:
        step_rotors(rotors, state, (0.0, 0.0, 0.0), steps, h)
        steps += 1
    time_s = inertia * speed / coulomb
    if viscous:
        time_s = inertia / viscous * math.log1p(viscous * speed / coulomb)
    assert 100.0 < time_s < 600.0
    assert steps == math.ceil(time_s / h)
    assert state["momentum"][0] == 0.0


def test_viscous_friction_alone_decays_exponentially_and_never_ends():
    row = row_of(2e-3, 0.0, 1e-4)
    after, stands = speed_after(row, 80.0, False, 0.0, 50.0)
    assert after == pytest.approx(80.0 * math.exp(-1e-4 * 50.0 / 2e-3), rel=1e-14)
    assert not stands
    assert speed_after(row, 80.0, False, 2e-3, 1e5)[0] == pytest.approx(2e-3 / 1e-4, rel=1e-14)


def test_a_standing_rotor_needs_more_than_the_breakaway_torque():
    row = row_of(1e-3, 1e-3, 0.0, breakaway=4e-3)
    for small in (0.0, 1e-3, 3.999e-3, 4e-3, -4e-3):
        assert speed_after(row, 0.0, True, small, 10.0) == (0.0, True)
    after, stands = speed_after(row, 0.0, True, 4.001e-3, 10.0)
    assert (after, stands) == (pytest.approx((4.001e-3 - 1e-3) * 10.0 / 1e-3), False)
    # one that turns goes on under a torque which would not have started it
    assert speed_after(row, 5.0, False, 3e-3, 10.0)[0] == pytest.approx(5.0 + 2e-3 * 10.0 / 1e-3)


def test_rotor_at_its_limit_takes_no_more_and_can_leave():
    row = row_of(1e-3, limit=100.0)
    assert speed_after(row, 100.0, False, 1e-2, 5.0) == (100.0, False)
    assert speed_after(row, -99.0, False, -1e-2, 5.0) == (-100.0, False)
    assert speed_after(row, 100.0, False, -1e-2, 5.0)[0] == pytest.approx(50.0)
    rotors = rotors_of(row)
    state = state_of(rotors, 100.0, motor=1e-2)
    assert step_rotors(rotors, state, (0.0, 0.0, 0.0), 0, 5.0).torque == (0.0, 0.0, 0.0)


OMEGA = (0.05, -0.02, 0.03)


def four():
    """One without friction, one with, one that stands, one dead from step 7."""
    rows = [row_of(1e-3), row_of(2e-3, 1e-3, 1e-5), row_of(3e-3, 2e-3), row_of(4e-3, 1e-3)]
    rows[3]["dead_from"] = 7.0
    return rotors_of(*rows)


def four_in_motion(rotors):
    motors, stands = [1e-3, -2e-3, 1e-3, 3e-3], [0.0, 0.0, 1.0, 0.0]
    return state_of(rotors, [10.0, -20.0, 0.0, 5.0], OMEGA, motors, stands)


@pytest.mark.parametrize("step", [6, 7])
def test_what_the_rotors_gain_is_taken_from_the_body(step):
    rotors, h = four(), 0.5
    state = four_in_motion(rotors)
    before = state["momentum"].copy()
    spin = step_rotors(rotors, state, OMEGA, step, h)
    axes, gained = axes_of(rotors), state["momentum"] - before
    assert spin.momentum == pytest.approx(before @ axes, rel=1e-14)
    assert np.array(spin.torque) * h == pytest.approx(gained @ axes, rel=1e-13)
    assert reaction(spin) == pytest.approx(-(gained @ axes) / h, rel=1e-13)
    friction = [0.0, -1e-3, 0.0, 1e-3]
    torque = np.array([1e-3, -2e-3, 0.0, 3e-3 if step < 7 else 0.0]) - friction
    assert gained[[0, 2, 3]] == pytest.approx(torque[[0, 2, 3]] * h, abs=1e-16)
    viscous = -1e-5 * -20.0  # which falls a little within the step
    assert gained[1] == pytest.approx((torque[1] + viscous) * h, rel=1e-2)


def test_dead_frictionless_rotor_keeps_its_momentum_to_the_bit():
    rotors = rotors_of(row_of(1e-3))
    rotors.rows["dead_from"][0] = 0.0
    state = state_of(rotors, 30.0, OMEGA, motor=5e-3)
    before = state["momentum"][0]
    for step, turned in enumerate((OMEGA, (0.5, 0.1, -0.2), (0.0, 0.0, 0.0))):
        step_rotors(rotors, state, turned, step, 0.5)
        assert state["momentum"][0] == pytest.approx(before, rel=1e-15)


def test_a_standing_rotor_turns_with_the_body():
    """Its momentum is I g . w, what its tachometer tells is nothing."""
    rotors = rotors_of(row_of(2e-3, 1e-3))
    state = state_of(rotors, 0.0, OMEGA, stands=1.0)
    other = (0.3, 0.1, -0.4)
    step_rotors(rotors, state, other, 0, 0.5)
    assert state["stands"][0] == 1.0
    assert state["momentum"][0] == pytest.approx(2e-3 * SKEW[0] @ other, rel=1e-14)
    assert relative_momentum(rotors.rows, state, other, 0) == pytest.approx(0.0, abs=1e-19)


def test_rotor_starts_from_standstill_with_the_present_body_rate():
    """However the body has turned since the momentum was last reckoned."""
    rotors, other = rotors_of(row_of(2e-3, 1e-3)), (0.3, 0.1, -0.4)
    state = state_of(rotors, 0.0, OMEGA, motor=3e-3, stands=1.0)
    step_rotors(rotors, state, other, 0, 0.5)
    assert state["stands"][0] == 0.0
    answer = relative_momentum(rotors.rows, state, other, 0)
    assert answer == pytest.approx((3e-3 - 1e-3) * 0.5, rel=1e-13)


def test_momentum_relative_to_the_body():
    rotors = four()
    state = four_in_motion(rotors)
    answer = [relative_momentum(rotors.rows, state, OMEGA, k) for k in range(4)]
    assert answer == pytest.approx(rotors.rows["inertia"] * [10.0, -20.0, 0.0, 5.0], abs=1e-16)
    spin = step_rotors(rotors, state, OMEGA, 0, 0.5)
    axes = axes_of(rotors)
    assert carried_momentum(spin, OMEGA, 0.0) == pytest.approx(answer @ axes, abs=1e-15)
    later = [relative_momentum(rotors.rows, state, (0.1, 0.2, 0.3), k) for k in range(4)]
    assert carried_momentum(spin, (0.1, 0.2, 0.3), 0.5) == pytest.approx(later @ axes, abs=1e-15)
