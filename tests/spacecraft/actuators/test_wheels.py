"""Wheels as the computer has them: what is packed and read, how a torque is shared, failures."""

import math
from typing import NamedTuple

import numpy as np
import pytest

from torquer.computer.allocation import (
    Allocation,
    AllocationState,
    allocate_torque,
    first_allocation,
    make_allocation,
)
from torquer.spacecraft.actuators.reaction_wheels import ReactionWheels, read_tachometers
from torquer.spacecraft.actuators.rotors import Rotors
from torquer.spacecraft.body import Body
from torquer.spacecraft.wheel_array.allocation import allocate

RPM = 2.0 * math.pi / 60.0
OMEGA = (0.02, -0.05, 0.03)
FOUR = {"kind": "regular_pyramid", "count": 4, "gamma_deg": 54.7}
LIMITS = (2.0, 1.0, 3.0, 2.0)


def wheels(**changes):
    given = {"layout": FOUR, "momentum_limit_n_m_s": LIMITS, "torque_limit_n_m": 0.1}
    return ReactionWheels(**(given | changes))


class Ready(NamedTuple):
    """Wheels at the start, and what the computer believes of them."""

    spec: ReactionWheels
    rotors: Rotors
    allocation: Allocation
    state: np.ndarray
    believed: AllocationState

    def read(self, omega, seed, step):
        """Read the tachometers; the vector sum of the momenta."""
        noise = self.spec.speed_noise_rad_s
        momenta = self.believed.momentum
        return read_tachometers(self.rotors, noise, self.state, omega, seed, step, momenta)

    def ask(self, torque, interval_s, step):
        """Let the computer share a torque on the body."""
        allocate_torque(self.allocation, self.believed, self.state, torque, interval_s, step)
        assert np.array_equal(self.state["motor"], self.believed.motor)
        return self.believed.motor


def ready(spec, omega=OMEGA, step_s=0.5):
    rotors, allocation = spec.pack(step_s), make_allocation(spec, step_s)
    state = spec.first_state(rotors, omega)
    return Ready(spec, rotors, allocation, state, first_allocation(allocation))


def axes_of(spec):
    return np.array(spec.array().axes)


def shared(spec, torque, step=0, interval_s=1.0):
    """Motor torques for a torque on the body, after a reading."""
    flying = ready(spec)
    flying.read(OMEGA, 1, step)
    return flying.ask(torque, interval_s, step)


def test_momentum_limit_is_reached_at_the_speed_limit():
    spec = wheels(speed_limit_rpm=4500.0)
    assert spec.rotor_inertia_kg_m2() * 4500.0 * RPM == pytest.approx(LIMITS, rel=1e-15)
    rows = ready(spec).rotors.rows
    assert rows["inertia"] == pytest.approx(spec.rotor_inertia_kg_m2(), rel=1e-15)
    assert rows["speed_limit"] == pytest.approx(4500.0 * RPM, rel=1e-15)


def test_rotors_tensor_is_the_sum_over_the_axes():
    spec = wheels()
    expected = sum(
        i * np.outer(g, g) for i, g in zip(spec.rotor_inertia_kg_m2(), axes_of(spec), strict=True)
    )
    assert spec.rotor_tensor_kg_m2() == pytest.approx(expected, rel=1e-14)
    (xx, yy, zz, xy, xz, yz) = ready(spec).rotors.tensor
    assert [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]] == pytest.approx(expected, abs=1e-16)


def test_rotors_belong_to_body_but_do_not_resist_its_turning():
    spec = wheels(speed_limit_rpm=100.0)
    inertia = np.array([[2.6, 0.2, -0.3], [0.2, 3.1, 0.15], [-0.3, 0.15, 1.9]])
    rigid = Body(inertia_kg_m2=inertia.tolist()).pack(rotors_kg_m2=spec.rotor_tensor_kg_m2())
    xx, yy, zz, xy, xz, yz = rigid.inverse_inertia
    inverse = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    assert inverse @ (inertia - spec.rotor_tensor_kg_m2()) == pytest.approx(np.eye(3), abs=1e-14)
    assert rigid.inertia == pytest.approx((2.6, 3.1, 1.9, 0.2, -0.3, 0.15), rel=1e-15)


def test_friction_is_packed_and_stiction_defaults_to_coulomb_friction():
    friction = {"coulomb_friction_n_m": 1e-3, "viscous_friction_n_m_s": 2e-6}
    rows = ready(wheels(**friction)).rotors.rows
    assert rows[["coulomb", "viscous", "breakaway"]].tolist() == [(1e-3, 2e-6, 1e-3)] * 4
    rows = ready(wheels(**friction, stiction_n_m=5e-3)).rotors.rows
    assert rows["breakaway"].tolist() == [5e-3] * 4


@pytest.mark.parametrize("speeds", [0.0, -300.0, (100.0, 0.0, -200.0, 50.0)])
def test_first_state_has_the_speeds_relative_to_a_turning_body(speeds):
    spec = wheels(initial_speed_rpm=speeds, coulomb_friction_n_m=1e-3)
    flying = ready(spec)
    state, believed = flying.state, flying.believed
    total = flying.read(OMEGA, 1, 0)
    speed = np.broadcast_to(speeds, 4)
    expected = spec.rotor_inertia_kg_m2() * speed * RPM
    assert believed.momentum == pytest.approx(expected, abs=1e-15)
    assert total == pytest.approx(expected @ axes_of(spec), abs=1e-15)
    assert state["momentum"] - believed.momentum == pytest.approx(
        spec.rotor_inertia_kg_m2() * (axes_of(spec) @ OMEGA), rel=1e-10
    )
    assert state["stands"].tolist() == (speed == 0.0).tolist()
    assert believed.momentum_limit.tolist() == list(LIMITS)
    assert believed.torque_limit.tolist() == [0.1] * 4
    assert not believed.bias.any()


def test_without_friction_no_rotor_is_held_at_a_stand():
    assert not ready(wheels()).state["stands"].any()


def test_noise_of_the_tachometers():
    """Of every wheel the given deviation, independent of each other and of the last reading."""
    spec = wheels(
        layout={"kind": "icosahedral"}, momentum_limit_n_m_s=(1.0, 2.0, 3.0, 4.0, 5.0, 6.0),
        speed_noise_rpm=2.0, initial_speed_rpm=500.0,
    )  # fmt: skip
    flying = ready(spec)
    count = 4000
    read = np.empty((count, 6))
    for step in range(count):
        flying.read(OMEGA, 11, step)
        read[step] = flying.believed.momentum
    noise = (read / spec.rotor_inertia_kg_m2() / RPM - 500.0) / 2.0
    # five standard errors
    assert np.abs(noise.mean(axis=0)).max() < 5.0 / math.sqrt(count)
    assert noise.std(axis=0) == pytest.approx(1.0, abs=5.0 / math.sqrt(2.0 * count))
    both = np.corrcoef(np.hstack([noise[1:], noise[:-1]]).T) - np.eye(12)
    assert np.abs(both).max() < 5.0 / math.sqrt(count)


def test_noise_is_that_of_the_seed_and_the_step():
    flying = ready(wheels(speed_noise_rpm=2.0))
    readings = []
    for seed, step in ((1, 5), (1, 6), (2, 5), (1, 5)):
        flying.read(OMEGA, seed, step)
        readings.append(flying.believed.momentum.copy())
    assert np.array_equal(readings[0], readings[3])
    for i, j in ((0, 1), (0, 2), (1, 2)):
        assert np.all(readings[i] != readings[j])


def test_twelve_wheels_have_twelve_noises_at_every_step():
    spec = wheels(
        layout={"kind": "regular_pyramid", "count": 12, "gamma_deg": 50.0},
        momentum_limit_n_m_s=1.0, speed_noise_rpm=2.0,
    )  # fmt: skip
    flying = ready(spec)
    drawn = []
    for step in range(50):
        flying.read(OMEGA, 11, step)
        drawn += flying.believed.momentum.tolist()
    assert len(set(drawn)) == 600


@pytest.mark.parametrize("allocation", ["minimax", "least_squares"])
def test_the_body_gets_the_torque_from_the_wheels(allocation):
    spec = wheels(allocation=allocation, initial_speed_rpm=(100.0, -50.0, 20.0, 0.0))
    motors = shared(spec, (0.01, -0.02, 0.015))
    assert -motors @ axes_of(spec) == pytest.approx((0.01, -0.02, 0.015), abs=1e-16)


def test_least_squares_is_the_pseudo_inverse():
    torque = (0.01, -0.02, 0.015)
    spec = wheels(allocation="least_squares", initial_speed_rpm=(100.0, -50.0, 20.0, 0.0))
    expected = -np.linalg.pinv(axes_of(spec).T) @ torque
    assert shared(spec, torque) == pytest.approx(expected, rel=1e-13)


def test_minimax_keeps_the_greatest_share_of_the_torque_least():
    """From rest, where the momenta to be had are shared in the same way."""
    spec, torque = wheels(momentum_limit_n_m_s=2.0), (0.08, -0.03, 0.05)
    array = spec.array().model_copy(update={"momentum_limit_n_m_s": 0.1})
    expected, share = allocate(array, [-x for x in torque])
    assert shared(spec, torque) == pytest.approx(expected, abs=1e-15)
    squares = shared(spec.model_copy(update={"allocation": "least_squares"}), torque)
    assert 0.1 * share < 0.95 * np.abs(squares).max()


@pytest.mark.parametrize("allocation", ["minimax", "least_squares"])
@pytest.mark.parametrize("torque_limit", [0.1, (0.1, 0.02, 0.05, 0.1)])
def test_torque_limits_shorten_the_torque_and_keep_its_direction(allocation, torque_limit):
    spec = wheels(allocation=allocation, torque_limit_n_m=torque_limit)
    torque = np.array([3.0, -1.0, 2.0])
    motors = shared(spec, tuple(torque))
    shares = np.abs(motors) / torque_limit
    assert shares.max() == pytest.approx(1.0, abs=1e-12)
    given = -motors @ axes_of(spec)
    assert np.cross(given, torque) == pytest.approx(0.0, abs=1e-14)
    assert 0.0 < given @ torque < torque @ torque


def test_minimax_gives_more_unreachable_torque_than_least_squares():
    given = [
        np.linalg.norm(shared(wheels(allocation=name), (3.0, -1.0, 2.0)) @ axes_of(wheels()))
        for name in ("minimax", "least_squares")
    ]
    assert given[0] > 1.02 * given[1]


@pytest.mark.parametrize("interval_s", [0.5, 8.0])
def test_a_wheel_near_its_speed_limit_is_not_asked_beyond(interval_s):
    spec = wheels(initial_speed_rpm=(5990.0, 0.0, 0.0, 0.0), momentum_limit_n_m_s=2.0)
    motors = shared(spec, tuple(-0.5 * axes_of(spec)[0]), interval_s=interval_s)
    after = ready(spec).state["momentum"] + motors * interval_s
    carried = spec.rotor_inertia_kg_m2() * (axes_of(spec) @ OMEGA)
    assert np.all(np.abs(after - carried) <= 2.0 * (1.0 + 1e-12))


def test_idle_share_spins_wheels_up_without_torque_on_body():
    spec = wheels(minimum_speed_fraction=0.1, momentum_limit_n_m_s=2.0)
    flying = ready(spec, (0.0, 0.0, 0.0))
    momentum, bias = flying.state["momentum"], flying.believed.bias
    # a motor's torque is a difference of momenta, over a second, each of which is rounded
    rounding = 2.0 * len(bias) * np.spacing(np.abs(bias).max())
    for step in range(60):
        flying.read((0.0, 0.0, 0.0), 1, step)
        motors = flying.ask((0.0, 0.0, 0.0), 1.0, step)
        assert np.abs(motors @ axes_of(spec)).max() <= rounding
        momentum += motors
    assert np.abs(momentum).min() >= 0.1 * 2.0
    assert momentum == pytest.approx(bias, abs=1e-14)


def test_failures_become_steps():
    failures = ({"wheel": 2, "time_s": 10.2, "noticed_after_s": 3.0}, {"wheel": 0, "time_s": 0.0})
    flying = ready(wheels(failures=failures, lost=(1,)), step_s=0.5)
    assert flying.rotors.rows["dead_from"].tolist() == [0.0, 0.0, 21.0, math.inf]
    assert flying.allocation.noticed_from.tolist() == [0.0, math.inf, 27.0, math.inf]


def test_whole_number_of_steps_is_recognised_despite_rounding():
    flying = ready(wheels(failures=({"wheel": 2, "time_s": 0.3},)), step_s=0.1)
    assert flying.rotors.rows["dead_from"][2] == 3.0


@pytest.mark.parametrize("allocation", ["minimax", "least_squares"])
def test_the_computer_asks_a_dead_wheel_until_it_notices(allocation):
    failures = ({"wheel": 2, "time_s": 5.0, "noticed_after_s": 5.0},)
    spec, torque = wheels(failures=failures, allocation=allocation), (0.01, -0.02, 0.015)
    before, unnoticed, noticed = (shared(spec, torque, step) for step in (0, 19, 20))
    assert np.array_equal(before, unnoticed)
    assert unnoticed[2] != 0.0
    assert noticed[2] == 0.0
    assert -noticed @ axes_of(spec) == pytest.approx(torque, abs=1e-15)


@pytest.mark.parametrize("allocation", ["minimax", "least_squares"])
def test_lost_wheels_are_never_asked(allocation):
    spec = wheels(lost=(1,), allocation=allocation)
    motors = shared(spec, (0.01, -0.02, 0.015))
    assert motors[1] == 0.0
    assert -motors @ axes_of(spec) == pytest.approx((0.01, -0.02, 0.015), abs=1e-15)


@pytest.mark.parametrize("allocation", ["minimax", "least_squares"])
def test_two_wheels_act_in_their_plane_and_none_gives_nothing(allocation):
    spec = wheels(lost=(0, 2), allocation=allocation)
    torque = np.array([0.01, -0.02, 0.015])
    motors = shared(spec, tuple(torque))
    normal = np.cross(*axes_of(spec)[[1, 3]])
    normal /= np.linalg.norm(normal)
    expected = torque - (torque @ normal) * normal
    assert -motors @ axes_of(spec) == pytest.approx(expected, abs=1e-15)
    assert motors[[0, 2]].tolist() == [0.0, 0.0]
    assert (
        shared(wheels(lost=(0, 1, 2, 3), allocation=allocation), tuple(torque)).tolist()
        == [0.0] * 4
    )


def test_remaining_biases_still_cancel_after_a_wheel_loss():
    layout = {"kind": "regular_pyramid", "count": 6, "gamma_deg": 54.7}
    failures = ({"wheel": 2, "time_s": 0.0}, {"wheel": 4, "time_s": 5.0})
    spec = wheels(
        layout=layout, momentum_limit_n_m_s=2.0, minimum_speed_fraction=0.05, failures=failures
    )
    flying = ready(spec)
    for step, lost in ((0, [2]), (10, [2, 4])):
        flying.read(OMEGA, 1, step)
        motors, bias = flying.ask((0.0, 0.0, 0.0), 1.0, step), flying.believed.bias
        assert bias[lost].tolist() == motors[lost].tolist() == [0.0] * len(lost)
        assert np.abs(np.delete(bias, lost)).min() > 0.05 * 2.0
        assert bias @ axes_of(spec) == pytest.approx(0.0, abs=1e-14)
        assert motors @ axes_of(spec) == pytest.approx(0.0, abs=1e-15)


def test_nothing_is_asked_of_wheels_that_no_law_drives():
    spec = wheels(minimum_speed_fraction=0.1, momentum_limit_n_m_s=2.0)
    flying = ready(spec)._replace(allocation=make_allocation(spec, 0.5, driven=False))
    assert not flying.ask((0.01, -0.02, 0.015), 1.0, 0).any()
