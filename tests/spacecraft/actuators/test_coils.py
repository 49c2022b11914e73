"""Coils: sharing, saturation in three modes, lag, energy - for any set of axes."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from torquer.compile.engine import kernel, records
from torquer.spacecraft.actuators import coils as room
from torquer.spacecraft.actuators.coils import COIL_STATE, Coils

SETS = {
    "body axes": {"limit_a_m2": 2.0},
    "unequal limits": {"limit_a_m2": (1.0, 2.5, 0.5)},
    "four skew": {
        "limit_a_m2": (1.0, 2.0, 1.5, 1.2),
        "axes": ((1.0, 1.0, 1.0), (-1.0, 1.0, 0.5), (0.3, -1.0, 1.0), (0.5, 0.2, -2.0)),
    },
    "skew three": {"limit_a_m2": 1.0, "axes": ((1.0, 0.2, 0.0), (0.0, 1.0, 0.4), (0.3, 0.0, 1.0))},
    "two": {"limit_a_m2": (1.0, 0.7), "axes": ((1.0, 0.0, 0.0), (0.6, 0.8, 0.0))},
    "one": {"limit_a_m2": 1.0, "axes": ((0.0, 0.6, 0.8),)},
}
EVERY = pytest.mark.parametrize("name", SETS)
GAUSS_AT, GAUSS_WEIGHTS = (np.polynomial.legendre.leggauss(20) + np.array([[1.0], [0.0]])) / 2.0
MANY = settings(max_examples=60, deadline=None)
vectors = st.tuples(*[st.floats(-20.0, 20.0)] * 3)


# one entry each, so that what is inlined is compiled here once
@kernel
def command_coils(coils, command, state):
    return room.command_coils(coils, command, state)


@kernel
def advance(coils, state, t_s):
    return room.advance_coils(coils, state, t_s)


@kernel
def switch_off_coils(coils, state):
    return room.switch_off_coils(coils, state)


@kernel
def present_dipole(coils, state):
    return room.present_dipole(coils, state)


def packed(name, **more):
    return Coils(**SETS[name], **more).pack()


def driven(coils, command):
    """Targets of the coils, and the dipole of the whole set, residual included."""
    state = state_of(coils)
    goal = command_coils(coils, command, state)
    return state["target_a_m2"], np.array(goal.dipole_a_m2)


def state_of(coils):
    return records(np.zeros(len(coils.rows), COIL_STATE))


def limits_of(coils):
    return coils.rows["limit_a_m2"]


def columns(coils, name):
    """The vectors of that name of all coils, as rows."""
    return np.column_stack([coils.rows[f"{name}_{c}"] for c in "xyz"])


def reachable(name):
    """Projector on what the axes of this set can make."""
    axes = np.atleast_2d(SETS[name].get("axes", np.eye(3)))
    return np.linalg.pinv(axes) @ axes


@EVERY
@MANY
@given(command=vectors)
def test_scale_keeps_direction_and_limits(name, command):
    coils = packed(name)
    targets, dipole = driven(coils, command)
    limits = limits_of(coils)
    assert np.all(np.abs(targets) <= limits)
    wanted = reachable(name) @ command
    size = np.linalg.norm(wanted)
    assert np.cross(dipole, wanted) == pytest.approx(np.zeros(3), abs=1e-14 * (size**2 + 1.0))
    assert dipole @ wanted >= 0.0
    # nothing is given away: either all that was asked for, or a coil stands at its limit
    if np.max(np.abs(targets) / limits) < 1.0 - 1e-12:
        assert dipole == pytest.approx(wanted, abs=1e-14 * (1.0 + size))


@EVERY
@MANY
@given(command=vectors)
def test_clip_cuts_each_coil_alone(name, command):
    coils = packed(name, saturation="clip")
    targets, _ = driven(coils, command)
    axes = np.atleast_2d(SETS[name].get("axes", np.eye(3)))
    axes = axes / np.linalg.norm(axes, axis=1)[:, None]
    least = np.linalg.lstsq(axes.T, np.array(command), rcond=None)[0]
    limits = limits_of(coils)
    assert targets == pytest.approx(np.clip(least, -limits, limits), abs=1e-13)


@EVERY
@MANY
@given(command=vectors)
def test_relay_puts_each_coil_at_its_limit_or_at_zero(name, command):
    coils = packed(name, saturation="relay")
    targets, dipole = driven(coils, command)
    limits = limits_of(coils)
    share = columns(coils, "share") @ command
    clear, nothing = (np.abs(share) > part * np.abs(command).sum() for part in (2e-12, 0.5e-12))
    assert np.array_equal(targets[clear], (np.sign(share) * limits)[clear])
    assert not targets[~nothing].any()
    if name in ("body axes", "unequal limits"):
        assert dipole @ command >= 0.0


def test_relay_coils_across_the_command_stay_off():
    """A command along one skew coil's null direction reaches that coil as rounding only."""
    axes = ((1.0, 0.0, 0.0), (0.6, 0.8, 0.0), (0.0, 0.0, 1.0))
    coils = Coils(limit_a_m2=1.0, axes=axes, saturation="relay").pack()
    for size in (1e-9, 0.3, 1e6):
        targets, _ = driven(coils, (0.6 * size, 0.8 * size, 0.0))
        assert targets.tolist() == [0.0, 1.0, 0.0]


@pytest.mark.parametrize("mode", room.MODES)
@EVERY
def test_zero_command_gives_the_residual_dipole_alone(name, mode):
    coils = packed(name, saturation=mode, residual_dipole_a_m2=(0.01, -0.02, 0.03))
    targets, dipole = driven(coils, (0.0, 0.0, 0.0))
    assert not targets.any()
    assert dipole.tolist() == [0.01, -0.02, 0.03]


@EVERY
def test_a_small_command_is_carried_out_exactly(name):
    command = reachable(name) @ [0.11, -0.07, 0.05]
    _, dipole = driven(packed(name), tuple(command))
    assert dipole == pytest.approx(command, abs=1e-16)


def test_four_coils_share_with_the_least_squares():
    coils = packed("four skew")
    targets, _ = driven(coils, (0.1, 0.2, -0.1))
    null = np.linalg.svd(columns(coils, "axis").T)[2][-1]
    assert targets @ null == pytest.approx(0.0, abs=1e-16)  # nothing that cancels itself


def test_an_endless_command_stays_within_the_limits():
    for mode in room.MODES:
        targets, _ = driven(packed("four skew", saturation=mode), (1e300, -1e300, 1e300))
        assert np.all(np.abs(targets) <= np.array([1.0, 2.0, 1.5, 1.2]) * (1.0 + 1e-15))


def run(coils, command, before, t_s):
    """(state, energy, greatest) after coils with a lag have gone from `before` to a command."""
    state = state_of(coils)
    state["dipole_a_m2"] = before
    command_coils(coils, command, state)
    energy, greatest = advance(coils, state, t_s)
    return state, energy, greatest


@MANY
@given(
    command=vectors,
    before=st.tuples(*[st.floats(-1.0, 1.0)] * 4),
    lag=st.floats(0.01, 50.0),
    t_s=st.floats(0.0, 100.0),
)
def test_lag_and_energy_are_exact(command, before, lag, t_s):
    """m(t) = target + (before - target) exp(-t/lag); power = P (m/limit)^2, by quadrature."""
    coils = packed("four skew", lag_s=lag, power_at_limit_w=0.8)
    state, energy, greatest = run(coils, command, before, t_s)
    target, limits = state["target_a_m2"], limits_of(coils)

    def path(t):
        return target + (np.array(before) - target) * np.exp(-t / lag)

    assert state["dipole_a_m2"] == pytest.approx(path(t_s), abs=1e-14)
    edges = np.unique(np.minimum(lag * np.array([0, 0.5, 1, 2, 4, 7, 11, 16, 22, 30, 1e9]), t_s))
    expected = 0.0
    for start, end in itertools.pairwise(edges):
        times = start + (end - start) * GAUSS_AT
        power = [0.8 * np.sum((path(t) / limits) ** 2) for t in times]
        expected += (end - start) * GAUSS_WEIGHTS @ power
    assert energy == pytest.approx(expected, rel=1e-12, abs=1e-15)
    assert greatest == pytest.approx(max(np.abs(before).max(), np.abs(path(t_s)).max()))


def test_lag_in_two_legs_is_lag_in_one():
    coils = packed("four skew", lag_s=3.0, power_at_limit_w=1.0)
    command, before = (0.4, -2.0, 1.0), (0.3, 0.0, -0.6, 1.0)
    once, energy, _ = run(coils, command, before, 7.0)
    twice, first, _ = run(coils, command, before, 2.0)
    second, _ = advance(coils, twice, 5.0)
    assert twice["dipole_a_m2"] == pytest.approx(once["dipole_a_m2"], abs=1e-15)
    assert first + second == pytest.approx(energy, rel=1e-13)


def test_lagless_coils_are_on_target_and_draw_constant_power():
    coils = packed("unequal limits", power_at_limit_w=2.0)
    state = state_of(coils)
    goal = command_coils(coils, (0.5, -1.25, 0.1), state)
    assert state["dipole_a_m2"] == pytest.approx([0.5, -1.25, 0.1], abs=1e-15)
    assert present_dipole(coils, state) == goal.dipole_a_m2
    assert goal.power_w == pytest.approx(2.0 * (0.5**2 + 0.5**2 + 0.2**2))
    assert goal.greatest_a_m2 == pytest.approx(1.25)


def test_energy_of_coils_at_their_limits_is_power_times_time():
    """Also of lagging ones that are there already."""
    sharp = packed("body axes", power_at_limit_w=1.5, saturation="relay")
    assert command_coils(sharp, (1.0, -1.0, 1.0), state_of(sharp)).power_w == pytest.approx(3 * 1.5)
    lagging = packed("body axes", power_at_limit_w=1.5, saturation="relay", lag_s=2.0)
    _, energy, _ = run(lagging, (1.0, -1.0, 1.0), (2.0, -2.0, 2.0), 20.0)
    assert energy == pytest.approx(3 * 1.5 * 20.0)


def test_coils_that_are_switched_off_go_to_the_residual_dipole():
    coils = packed("body axes", lag_s=2.0, residual_dipole_a_m2=(0.01, -0.02, 0.03))
    state = state_of(coils)
    command_coils(coils, (1.0, -1.0, 1.0), state)
    goal = switch_off_coils(coils, state)
    assert goal.dipole_a_m2 == (0.01, -0.02, 0.03)
    assert (goal.power_w, goal.greatest_a_m2) == (0.0, 0.0)
    assert not state["target_a_m2"].any()


def test_axes_are_scaled_to_length_one():
    coils = Coils(limit_a_m2=1.0, axes=((0.0, 0.0, 5.0), (3.0, 4.0, 0.0)))
    assert coils.axes[0] == (0.0, 0.0, 1.0)
    assert coils.axes[1] == pytest.approx((0.6, 0.8, 0.0))
    for seed in range(50):  # stored and read again, not a bit may change
        skew = np.random.default_rng(seed).normal(size=(3, 3)).tolist()
        coils = Coils(limit_a_m2=1.0, axes=skew)
        assert Coils.model_validate_json(coils.model_dump_json()) == coils


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({"limit_a_m2": 0.0}, "greater than 0"),
        ({"limit_a_m2": -1.0}, "greater than 0"),
        ({"limit_a_m2": (1.0, 0.0, 1.0)}, "greater than 0"),
        ({"limit_a_m2": float("inf")}, "finite"),
        (
            {"limit_a_m2": (1.0, 2.0)},
            r"limit_a_m2: must be one number or one per coil \(3 axes\); received 2 numbers",
        ),
        (
            {"limit_a_m2": 1.0, "axes": ((1.0, 0.0, 0.0), (0.0, 0.0, 0.0))},
            "axes: must be non-zero vectors of 3 numbers; received",
        ),
        ({"limit_a_m2": 1.0, "axes": ()}, "axes: must be non-zero vectors of 3 numbers"),
        ({"limit_a_m2": 1.0, "axes": ((1.0, 0.0),)}, "axes"),
        ({"limit_a_m2": 1.0, "saturation": "wrap"}, "'scale', 'clip' or 'relay'"),
        ({"limit_a_m2": 1.0, "lag_s": -1.0}, "greater than or equal to 0"),
        ({"limit_a_m2": 1.0, "power_at_limit_w": 0.0}, "greater than 0"),
        ({"limit_a_m2": 1.0, "residual_dipole_a_m2": (0.0, 0.0, float("nan"))}, "finite"),
        ({"limit_a_m2": 1.0, "turns": 100}, "must be a known key"),
        ({}, "limit_a_m2: must be given without windings; received none"),
    ],
)
def test_what_cannot_be_is_reported(keys, expected):
    with pytest.raises(ValueError, match=expected):
        Coils(**keys)
