"""Steering: limits of torque and speed, speeds off zero, losses on the way."""

import numpy as np
import pytest
from scipy.optimize import linprog, lsq_linear

from torquer.spacecraft.wheel_array import layout
from torquer.spacecraft.wheel_array.allocation import minimax, wheel_set
from torquer.spacecraft.wheel_array.envelope import momentum_envelope
from torquer.spacecraft.wheel_array.layout import WheelArray
from torquer.spacecraft.wheel_array.steering import (
    CENTRE,
    HALF,
    ROWS,
    _most_even_null_shares,
    _torque_box,
    add_bias,
    lose,
    make_steering,
    steer,
    steer_nearest,
    steering_bias,
)

ARRAYS = {
    "four": layout.four_sided_pyramid(80.5, 45.5),
    "six": layout.regular_pyramid(6, 60.0),
    "five, any": np.random.default_rng(3).normal(size=(5, 3)),
    "twelve": np.random.default_rng(5).normal(size=(12, 3)),
}
EVERY = pytest.mark.parametrize("name", ARRAYS)


def array(name):
    axes = ARRAYS[name]
    limits = 18.0
    if name == "five, any":
        limits = (18.0, 12.0, 20.0, 15.0, 16.0)
    return WheelArray(axes=axes.tolist(), momentum_limit_n_m_s=limits, torque_limit_n_m=0.2)


def within(wheels, part, count, seed=1):
    """Demands up to that part of the envelope, most of them at it."""
    directions = np.random.default_rng(seed).normal(size=(count, 3))
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    shares = np.random.default_rng(seed).uniform(0.0, 2.0, (count, 1)).clip(max=1.0)
    return part * shares * momentum_envelope(wheels).extent(unit)[:, None] * unit


@EVERY
def test_bias_cancels_and_keeps_its_promised_part_and_idle_share(name):
    wheels, idle = array(name), 0.05
    bias, part = steering_bias(wheels, idle)
    limits, packed, out = wheels.momentum_limits(), wheel_set(wheels), np.zeros(wheels.count)
    assert np.abs(bias @ np.array(wheels.axes)).max() < 1e-13 * 18.0
    assert part > 0.2
    for demand in within(wheels, part, 300):
        add_bias(packed, limits, bias, tuple(demand), out)
        assert out @ np.array(wheels.axes) == pytest.approx(demand, abs=1e-11)
        assert np.all(np.abs(out) >= idle * limits * (1.0 - 1e-9))
        assert np.all(np.abs(out) <= limits * (1.0 + 1e-12))


@EVERY
def test_biased_wheels_reach_the_whole_envelope_within_limits(name):
    wheels = array(name)
    bias, limits, packed = steering_bias(wheels)[0], wheels.momentum_limits(), wheel_set(wheels)
    out = np.zeros(wheels.count)
    for demand in [*within(wheels, 1.0, 300), *momentum_envelope(wheels).vertices]:
        assert add_bias(packed, limits, bias, tuple(demand), out) <= 1.0 + 1e-12
        assert out @ np.array(wheels.axes) == pytest.approx(demand, abs=1e-11)
        assert np.all(np.abs(out) <= limits * (1.0 + 1e-12))


def test_regular_pyramids_have_an_even_bias():
    """Every other wheel the other way: half of the envelope but the idle share."""
    for count in (4, 6):
        axes = layout.regular_pyramid(count, 60.0)
        wheels = WheelArray(axes=axes.tolist(), momentum_limit_n_m_s=2.0)
        bias, part = steering_bias(wheels, 0.1)
        assert bias == pytest.approx(1.1 * np.array([1.0, -1.0] * (count // 2)))
        assert part == pytest.approx(0.45)


def test_the_bias_is_the_best_of_all_directions_of_rotation():
    """A linear program for each choice of signs, in place of the mixed-integer one."""
    wheels = array("five, any")
    vectors, n = np.array(wheels.axes) * wheels.momentum_limits()[:, None], 5
    best = 0.0
    for number in range(2**n):
        signs = np.array([1.0 if number >> k & 1 else -1.0 for k in range(n)])
        found = linprog(
            np.append(np.zeros(n), -1.0), bounds=[(-1, 1)] * n + [(0, 1)], b_ub=np.zeros(n),
            A_eq=np.column_stack([vectors.T, np.zeros(3)]), b_eq=np.zeros(3),
            A_ub=np.column_stack([-np.diag(signs), np.ones(n)]),
        )  # fmt: skip
        best = max(best, -found.fun)
    assert steering_bias(wheels, 0.0).keeps_off_zero_up_to == pytest.approx(
        best / (1.0 + best), rel=1e-6
    )


def test_three_wheels_and_wheels_that_cannot_balance_have_no_bias():
    assert np.all(steering_bias(array("four").without(2))[0] == 0.0)
    assert steering_bias(array("four").without(0, 1, 2, 3)) == (pytest.approx(np.zeros(4)), 0.0)
    # the fourth wheel has no partner: its null share is zero
    axes = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, 0, 1]]
    wheels = WheelArray(axes=axes, momentum_limit_n_m_s=1.0)
    bias, part = steering_bias(wheels)
    assert bias.tolist() == [0.0] * 4 and part == 0.0
    with pytest.raises(
        ValueError, match=r"minimum_speed_fraction: must be from 0 to below 1; received 1\.0"
    ):
        steering_bias(wheels, 1.0)


def wave(step):
    """A torque [N m] whose integral comes and goes."""
    return 0.05 * np.array([0.3 * np.sin(0.010 * step), np.cos(0.013 * step), np.sin(0.02 * step)])


def flown(wheels, steering, torques, momenta):
    """Momenta of the wheels after each step of 1 s; checks of every step."""
    axes, out, history = np.array(wheels.axes), np.zeros(wheels.count), []
    for torque in torques:
        part = steer(steering, 1.0, momenta, tuple(torque), out)
        assert 0.0 <= part <= 1.0
        assert out @ axes == pytest.approx(part * torque, abs=1e-12)
        assert np.all(np.abs(out) <= steering.torque_limit * (1.0 + 1e-12))
        momenta = momenta + out
        assert np.all(np.abs(momenta) <= wheels.momentum_limits() * (1.0 + 1e-12))
        history.append((part, momenta))
    return [part for part, _ in history], np.array([momenta for _, momenta in history])


@EVERY
def test_wheels_run_up_to_the_bias_and_stay_off_zero(name):
    wheels = array(name)
    torques = [wave(step) for step in range(1500)]
    parts, momenta = flown(wheels, make_steering(wheels), torques, np.zeros(wheels.count))
    assert parts == [1.0] * len(parts)
    needed = momentum_envelope(wheels).share(np.cumsum(torques, axis=0)).max()
    assert 0.05 < needed < steering_bias(wheels).keeps_off_zero_up_to
    settled = momenta[300:]
    assert np.all(np.abs(settled) >= 0.05 * wheels.momentum_limits() * (1.0 - 1e-9))
    assert np.all(np.sign(settled) == np.sign(settled[0]))


@EVERY
def test_a_lasting_torque_is_given_until_the_envelope_is_full(name):
    """All of it up to the surface, then none; the direction is kept to the last."""
    wheels = array(name)
    torque = np.array([0.02, 0.05, -0.04])
    total = momentum_envelope(wheels).extent(torque) / np.linalg.norm(torque)
    count = int(total) + 20
    parts, momenta = flown(wheels, make_steering(wheels), [torque] * count, np.zeros(wheels.count))
    assert sum(parts) == pytest.approx(total, rel=1e-9)
    assert parts[: int(total)] == [1.0] * int(total)
    assert parts[-10:] == pytest.approx([0.0] * 10, abs=1e-9)
    assert momenta[-1] @ np.array(wheels.axes) == pytest.approx(total * torque)


def test_too_great_a_torque_is_cut_to_the_torque_envelope():
    wheels = array("six")
    steering, out = make_steering(wheels), np.zeros(6)
    torques = np.random.default_rng(4).normal(size=(50, 3))
    reach = 0.2 / 18.0 * momentum_envelope(wheels).extent(torques) / np.linalg.norm(torques, axis=1)
    parts = [steer(steering, 1.0, np.zeros(6), tuple(torque), out) for torque in torques]
    assert parts == pytest.approx(np.minimum(reach, 1.0))
    assert min(parts) < 0.9


def test_the_part_given_is_the_greatest_that_linear_programming_finds():
    """Wheels near their limits, in one direction or the other."""
    wheels, random = array("six"), np.random.default_rng(5)
    steering, out = make_steering(wheels), np.zeros(6)
    for _ in range(100):
        momenta = random.choice([-1.0, 1.0], 6) * random.uniform(17.7, 18.0, 6)
        torque = 0.5 * random.normal(size=3)
        part = steer(steering, 1.0, momenta, tuple(torque), out)
        low, high = np.maximum(-0.2, -18.0 - momenta), np.minimum(0.2, 18.0 - momenta)
        assert np.all(out >= low - 1e-12) and np.all(out <= high + 1e-12)
        assert out @ np.array(wheels.axes) == pytest.approx(part * torque, abs=1e-12)
        best = linprog(
            [0.0] * 6 + [-1.0], A_eq=np.column_stack([np.array(wheels.axes).T, -torque]),
            b_eq=np.zeros(3), bounds=[*zip(low, high, strict=True), (0.0, 1.0)],
        )  # fmt: skip
        assert part == pytest.approx(-best.fun, abs=1e-9)


@EVERY
def test_after_losses_the_rest_goes_on(name):
    """One wheel stops, its momentum taken out; the others give all the torque with a new bias."""
    wheels, lost = array(name), 1
    steering = make_steering(wheels)
    _, momenta = flown(
        wheels, steering, [wave(step) for step in range(400)], np.zeros(wheels.count)
    )
    lose(steering, lost)
    after = wheels.without(lost)
    now = momenta[-1].copy()
    now[lost] = 0.0
    assert steering.bias == pytest.approx(steering_bias(after).momenta_n_m_s, abs=1e-12)
    assert steering.momentum_limit.tolist() == after.momentum_limits().tolist()
    parts, momenta = flown(after, steering, [wave(step) for step in range(400, 800)], now)
    assert parts == [1.0] * 400
    assert np.all(momenta[:, lost] == 0.0)


def test_remaining_bias_is_null_after_two_losses():
    wheels = array("twelve")
    steering = make_steering(wheels)
    lose(steering, 4)
    lose(steering, 9)
    assert steering.bias[[4, 9]].tolist() == [0.0, 0.0]
    assert np.abs(steering.bias @ np.array(wheels.axes)).max() < 1e-12
    assert np.abs(steering.bias).max() > 1.0


def test_two_wheels_left_give_what_their_plane_holds():
    wheels = array("four").without(0, 1)
    steering, out, torque = make_steering(wheels), np.zeros(4), np.array([0.01, 0.02, -0.03])
    assert steer(steering, 1.0, np.zeros(4), tuple(torque), out) == 1.0
    axes = np.array(wheels.axes)[2:]
    assert out[:2].tolist() == [0.0, 0.0]
    assert out[2:] == pytest.approx(torque @ np.linalg.pinv(axes))


def test_minimax_without_a_bias_is_what_biased_gives():
    wheels, out, plain = array("six"), np.zeros(6), np.zeros(6)
    packed, limits = wheel_set(wheels), wheels.momentum_limits()
    for demand in within(wheels, 1.0, 20):
        add_bias(packed, limits, np.zeros(6), tuple(demand), out)
        minimax(packed, limits, tuple(demand), plain)
        assert out.tolist() == plain.tolist()


def test_all_torque_that_is_left_goes_into_the_null_space():
    """From rest some wheel works at its limit; where the bias is near, one step is enough."""
    wheels, out, torque = array("six"), np.zeros(6), np.array([0.01, 0.02, -0.03])
    steering = make_steering(wheels)
    steer(steering, 1.0, np.zeros(6), tuple(torque), out)
    assert np.abs(out).max() == pytest.approx(0.2, rel=1e-12)
    near = steering.bias * (1.0 + 1e-3)
    steer(steering, 1.0, near, tuple(torque), out)
    wanted = np.zeros(6)
    add_bias(steering.wheels, steering.momentum_limit, steering.bias, tuple(torque), wanted)
    assert near + out == pytest.approx(wanted, abs=1e-13)


def nearest(wheels, momenta, torque):
    """What `steer_nearest` gives, as a vector; checks of the limits."""
    steering, out = make_steering(wheels, None), np.zeros(wheels.count)
    steer_nearest(steering, 1.0, momenta, tuple(torque), out)
    assert np.all(np.abs(momenta + out) <= wheels.momentum_limits() * (1.0 + 1e-12))
    assert np.all(np.abs(out) <= wheels.torque_limits() * (1.0 + 1e-12))
    return out @ np.array(wheels.axes)


@EVERY
def test_nearest_torque_matches_steering_while_no_wheel_is_full(name):
    """The motors are the only limit: the direction is kept."""
    wheels, random = array(name), np.random.default_rng(6)
    steering, out = make_steering(wheels), np.zeros(wheels.count)
    for _ in range(50):
        torque = random.normal(size=3)
        part = steer(steering, 1.0, np.zeros(wheels.count), tuple(torque), out)
        given = nearest(wheels, np.zeros(wheels.count), torque)
        assert given == pytest.approx(part * torque, abs=1e-12)


def test_a_full_wheel_does_not_cost_the_others():
    """Three wheels along the axes, the first one full: the second gets its torque."""
    wheels = WheelArray(axes=np.eye(3).tolist(), momentum_limit_n_m_s=1.0, torque_limit_n_m=0.1)
    momenta, torque = np.array([1.0, 0.0, 0.0]), np.array([0.02, 0.03, -0.01])
    assert steer(make_steering(wheels), 1.0, momenta, tuple(torque), np.zeros(3)) == 0.0
    assert nearest(wheels, momenta, torque) == pytest.approx([0.0, 0.03, -0.01])
    momenta = np.array([1.0, 1.0, 0.0])
    assert nearest(wheels, momenta, torque) == pytest.approx([0.0, 0.0, -0.01])
    momenta = np.array([1.0, 1.0, -1.0])
    assert nearest(wheels, momenta, torque) == pytest.approx([0.0, 0.0, 0.0])
    assert nearest(wheels, momenta, -torque) == pytest.approx(-torque)


@EVERY
def test_near_a_full_array_the_nearest_torque_is_given(name):
    """Momenta on the envelope, torques within the motors; scipy's least squares with bounds."""
    wheels, random = array(name), np.random.default_rng(7)
    steering, out, limits = make_steering(wheels), np.zeros(wheels.count), wheels.momentum_limits()
    axes, less = np.array(wheels.axes), 0
    for demand in within(wheels, 1.0, 200):
        minimax(steering.wheels, limits, tuple(demand), out)
        momenta, torque = np.clip(out, -limits, limits), 0.01 * random.normal(size=3)
        low, high = np.maximum(-0.2, -limits - momenta), np.minimum(0.2, limits - momenta)
        bounds = (low - 1e-13, high + 1e-13)
        found = lsq_linear(axes.T, torque, bounds, method="bvls", tol=1e-14)
        given = nearest(wheels, momenta, torque)
        least = np.linalg.norm(axes.T @ found.x - torque)
        assert np.linalg.norm(given - torque) == pytest.approx(least, rel=1e-9, abs=1e-10)
        less += np.linalg.norm(given - torque) > 1e-3
    assert less > 5


@EVERY
def test_a_lasting_torque_ends_at_the_momentum_farthest_along_it(name):
    """The support of the envelope, not only its surface."""
    wheels, torque = array(name), np.array([0.02, 0.05, -0.04])
    steering, momenta, out = make_steering(wheels), np.zeros(wheels.count), np.zeros(wheels.count)
    farthest = momentum_envelope(wheels).support(torque[None])[0]
    for _ in range(20_000):
        steer_nearest(steering, 1.0, momenta, tuple(torque), out)
        before, momenta = momenta, momenta + out
        if np.abs(momenta - before).max() < 1e-9:
            break
    assert momenta @ np.array(wheels.axes) @ torque == pytest.approx(farthest, rel=1e-6)


def test_the_box_of_torques_is_that_of_both_limits():
    """Also for wheels beyond their limit of momentum, which can only come back."""
    random = np.random.default_rng(5)
    limit, most, step_s = np.array([1.0, 2.0, 0.5]), np.array([0.1, 0.2, 0.3]), 2.0
    work = np.zeros((ROWS, 3))
    for _ in range(200):
        momenta = limit * random.uniform(-1.6, 1.6, 3)
        _torque_box(limit, most, step_s, momenta, work)
        torques = np.linspace(-most, most, 4001)
        after = momenta + torques * step_s
        for k in range(3):
            below, above = after[:, k] <= limit[k] + 1e-9, after[:, k] >= -limit[k] - 1e-9
            greatest = torques[below, k].max() if below.any() else -most[k]
            least = torques[above, k].min() if above.any() else most[k]
            high, low = work[CENTRE, k] + work[HALF, k], work[CENTRE, k] - work[HALF, k]
            assert high == pytest.approx(greatest, abs=most[k] / 1000.0)
            assert low == pytest.approx(least, abs=most[k] / 1000.0)


@pytest.mark.parametrize("count", [4, 5, 6])
def test_arrays_that_differ_in_size_have_one_program(count):
    """Its shares are those of the limits, whatever these are: members of a campaign share it."""
    axes = tuple(map(tuple, layout.regular_pyramid(count, 50.0).tolist()))

    def of(limit):
        made = WheelArray(axes=axes, momentum_limit_n_m_s=limit, torque_limit_n_m=1.0)
        steering = make_steering(made, 0.05)
        assert np.abs(np.array(made.axes).T @ steering.bias).max() < 1e-13 * limit
        return np.vstack([steering.bias, steering.bias_after]) / limit

    first, known = of(1.0), _most_even_null_shares.cache_info().misses
    for limit in (0.011, 0.0125, 37.0):
        assert of(limit) == pytest.approx(first, rel=1e-14, abs=1e-15)
    assert _most_even_null_shares.cache_info().misses == known
