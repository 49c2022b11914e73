"""Errors along a flight: closed forms of wheels' holds, slow twins of the covariances."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from torquer.computer.laws.wheel_pd import WheelPd
from torquer.theory.three_axis.effects import (
    Loop,
    decay_s,
    make_loop,
    part_left,
    relative_to_mean,
    spread_under,
    states_under,
)
from torquer.theory.three_axis.imbalance import shaken
from torquer.theory.three_axis.sampled import Cycle, SampledHold
from torquer.theory.three_axis.wheel_hold import WheelHold

KAPPA, ZETA, SAMPLE_S = 0.05, 0.8, 1.0
J = np.array([[0.13, 0.002, 0.001], [0.002, 0.17, 0.003], [0.001, 0.003, 0.06]])


@pytest.fixture(scope="module")
def loop(make):
    """Wheels that know the inertia hold an inertial attitude, without gravity."""
    scenario = make(
        {"environment.gravity_gradient": False, "spacecraft.body.inertia_kg_m2": J.tolist()}
    )
    law = WheelPd(
        bandwidth_rad_s=KAPPA, damping=ZETA, reference="inertial", inertia_kg_m2=J.tolist()
    )
    hold = WheelHold(
        law.law(), scenario.spacecraft.body, scenario.orbit_environment(), None, revolutions=1
    )
    return make_loop(SampledHold(hold, Cycle(SAMPLE_S)))


def last_turns(loop, pushes):
    return states_under(loop, pushes)[-1, :3]


def test_a_constant_torque_leaves_what_the_spring_balances(loop):
    """J^-1 T/kappa^2, each torque by itself."""
    expected = np.linalg.inv(J) / KAPPA**2
    assert last_turns(loop, loop.torque) == pytest.approx(expected, rel=1e-6, abs=1e-6)


def test_a_constant_error_of_the_readings(loop):
    """Of the attitude: itself, reversed; of the rate: -2 zeta/kappa times it."""
    found = last_turns(loop, loop.reading)
    assert found[:, :3] == pytest.approx(-np.eye(3), abs=1e-6)
    assert found[:, 3:] == pytest.approx(-2.0 * ZETA / KAPPA * np.eye(3), abs=1e-5)


def test_nothing_turns_the_body_of_itself(loop):
    assert np.abs(loop.own).max() < 1e-12


def test_an_error_decays_as_its_roots_do(loop):
    """To 2 % in about 4/(zeta kappa); the rate, over n, starts far greater than the turn."""
    assert 3.0 / (ZETA * KAPPA) < decay_s(loop) < 20.0 / (ZETA * KAPPA)


def test_spread_of_turns_and_of_their_means_is_that_of_many_flights():
    """Against a thousand flights of a random system of seven states that changes with time."""
    random = np.random.default_rng(3)
    steps = 0.35 * random.normal(size=(60, 7, 7))
    roots = random.normal(size=(60, 7, 4))
    found = spread_under(steps, roots @ roots.transpose(0, 2, 1), 12)
    flights, turns = np.zeros((20_000, 7)), []
    for step, root in zip(steps, roots, strict=True):
        turns.append(flights[:, :3])
        flights = flights @ step.T + random.normal(size=(20_000, 4)) @ root.T
    each = np.array(turns).reshape(5, 12, -1, 3)
    means = each.mean(axis=1)
    expected = np.einsum("wki,wkj->wij", means, means) / means.shape[1]
    assert found.means == pytest.approx(expected, rel=0.1, abs=0.1 * np.abs(expected).max())
    within = each - means[:, None]
    expected = np.einsum("wnki,wnkj->wij", within, within) / within.shape[2] / 12
    assert found.within() == pytest.approx(expected, rel=0.1, abs=0.1 * np.abs(expected).max())


def test_less_the_mean_of_whole_windows():
    turns = np.arange(11.0)[:, None] * np.ones(3)
    found = relative_to_mean(turns, 4)
    assert found.shape == (8, 3)
    assert found[:, 0].tolist() == [-1.5, -0.5, 0.5, 1.5] * 2


@pytest.mark.parametrize("speed_rad_s", [150.0, 400.0])
def test_imbalance_shakes_a_free_body_whatever_the_speed(speed_rad_s):
    """Against Euler's equations under the turning torque of one wheel."""
    axis, imbalance = np.array([0.0, 0.6, 0.8]), 5e-7
    one, other = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.8, -0.6])

    def slopes(t, y):
        angle, omega = speed_rad_s * t, y[3:]
        torque = imbalance * speed_rad_s**2 * (math.cos(angle) * one + math.sin(angle) * other)
        return np.append(omega, np.linalg.solve(J, torque - np.cross(omega, J @ omega)))

    period = 2.0 * math.pi / speed_rad_s
    # from the rate at which the turn does not drift
    first = np.linalg.solve(J, -imbalance * speed_rad_s * other)
    times = np.linspace(0.0, 5.0 * period, 2000, endpoint=False)
    found = solve_ivp(slopes, (0.0, 5.0 * period), np.append(np.zeros(3), first), t_eval=times,
                      rtol=1e-9, atol=1e-15)  # fmt: skip
    turns = found.y[:3].T - found.y[:3].mean(axis=1)
    covariance = turns.T @ turns / len(turns)
    expected = shaken(J, [axis], imbalance, 0.0, 0.0)
    assert covariance == pytest.approx(expected, rel=0.02, abs=0.02 * np.abs(expected).max())


def test_static_imbalance_is_the_mean_over_places_of_the_wheel():
    random, axis, size, distance = np.random.default_rng(1), np.array([0.0, 0.0, 1.0]), 2e-6, 0.1
    places = random.normal(size=(40_000, 3))
    places *= distance / np.linalg.norm(places, axis=1, keepdims=True)
    angle = random.uniform(0.0, 2.0 * math.pi, 40_000)
    force = size * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    turns = np.cross(places, force) @ np.linalg.inv(J).T
    found = shaken(J, [axis], 0.0, size, distance)
    expected = turns.T @ turns / len(turns)
    assert found == pytest.approx(expected, rel=0.03, abs=0.03 * np.abs(expected).max())


def test_a_loop_that_grows_beyond_all_numbers_does_not_decay():
    """Of a body whose axis has next to no inertia: its numbers end before the run does."""
    steps = np.tile(10.0 * np.eye(6), (400, 1, 1))
    loop = Loop(np.arange(400.0), steps, *(None,) * 6)
    with np.errstate(all="ignore"):
        assert decay_s(loop) == part_left(loop) == math.inf


@pytest.mark.parametrize("least", [0.9, 1.1])
def test_the_state_that_decays_least_tells_what_is_left(least):
    """Of independent states, each with its factor a step."""
    steps = np.tile(np.diag([0.1, 0.2, 0.3, 0.4, 0.5, least]), (20, 1, 1))
    loop = Loop(np.arange(20.0), steps, *(None,) * 6)
    assert part_left(loop) == pytest.approx(least**20)
    assert decay_s(loop) == math.inf
