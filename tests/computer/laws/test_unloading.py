"""Unloading of wheels by coils: what its torque takes, dead band, decay in a turning field."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from law_cases import ZERO, inputs
from scipy.spatial.transform import Rotation
from wheel_cases import machine

from torquer.computer.laws.unloading import Unloading
from torquer.computer.laws.wheel_lyapunov import WheelLyapunov

MANY = settings(max_examples=60, deadline=None)
vectors = st.tuples(*[st.integers(-50_000, 50_000).map(float)] * 3).map(np.array)
turns = st.integers(0, 10_000).map(lambda n: Rotation.random(random_state=n))


def row(b, h, q=(0.0, 0.0, 0.0, 1.0), omega=ZERO):
    return inputs(b=b, wheels=h, q=q, omega=omega)


@MANY
@given(b=vectors, h=vectors)
def test_torque_is_gain_times_momentum_across_the_field(b, h):
    b, h = 1e-9 * b, 1e-4 * h
    wanted = np.array([0.3, -0.1, 0.2])
    dipole = machine(Unloading(gain_per_s=2e-3, wanted_momentum_n_m_s=wanted))(row(b, h))
    if not b.any():
        assert np.array_equal(dipole, np.zeros(3))
        return
    along = b / np.linalg.norm(b)
    excess = h - wanted
    expected = -2e-3 * (excess - along * (along @ excess))
    scale = 1e-12 * np.linalg.norm(excess)
    assert np.cross(dipole, b) == pytest.approx(expected, abs=scale)
    assert dipole @ along == pytest.approx(0.0, abs=scale / np.linalg.norm(b))


@MANY
@given(b=vectors, h=vectors, turn=turns)
def test_dipoles_turn_with_the_body_axes(b, h, turn):
    b, h, wanted = 1e-9 * b, 1e-4 * h, np.array([0.3, -0.1, 0.2])
    keys = {"gain_per_s": 1e-3, "dead_band_n_m_s": 0.2}
    one = machine(Unloading(**keys, wanted_momentum_n_m_s=wanted))(row(b, h))
    there = machine(Unloading(**keys, wanted_momentum_n_m_s=turn.apply(wanted)))
    other = there(row(turn.apply(b), turn.apply(h)))
    assert other == pytest.approx(turn.apply(one), rel=1e-9, abs=1e-12 * (1 + np.abs(one).max()))


def test_nothing_is_asked_below_the_dead_band():
    ask = machine(
        Unloading(gain_per_s=1e-3, wanted_momentum_n_m_s=(0.0, 0.0, 1.0), dead_band_n_m_s=0.5)
    )
    b = (2e-5, 1e-5, 3e-5)
    for h in ((0.0, 0.0, 1.0), (0.0, 0.499, 1.0), (0.0, 0.0, 1.499), (0.28, 0.28, 1.28)):
        assert np.array_equal(ask(row(b, h)), np.zeros(3))
    for h in ((0.0, 0.501, 1.0), (0.0, 0.0, 0.499), (0.3, 0.3, 1.3), (0.0, 0.0, 0.0)):
        assert np.linalg.norm(ask(row(b, h))) > 1.0


def test_it_begins_at_one_size_and_ends_below_another():
    """The same excess is left alone while it grows, and taken while it falls."""
    keys = {"dead_band_n_m_s": 0.2, "begin_n_m_s": 0.6, "wanted_momentum_n_m_s": (0.0, 0.0, 1.0)}
    ask = machine(Unloading(gain_per_s=1e-3, **keys))
    at_once = machine(Unloading(gain_per_s=1e-3, wanted_momentum_n_m_s=(0.0, 0.0, 1.0)))
    b = (2e-5, 1e-5, 3e-5)
    sizes = [0.1, 0.3, 0.59, 0.6, 0.9, 0.5, 0.21, 0.2, 0.19, 0.3, 0.59, 0.61, 0.21]
    works = [0, 0, 0, 1, 1, 1, 1, 1, 0, 0, 0, 1, 1]
    for size, on in zip(sizes, works, strict=True):
        known = row(b, (0.0, size, 1.0))
        assert np.array_equal(ask(known), at_once(known) if on else np.zeros(3))


def orbiting(u_deg, inclination_deg=70.0, raan_deg=40.0):
    """Position and velocity at an argument of latitude, on a circular orbit."""
    turn = Rotation.from_euler("ZXZ", [raan_deg, inclination_deg, u_deg], degrees=True)
    return turn.apply([7e6, 0.0, 0.0]), turn.apply([0.0, 7.5e3, 0.0])


@pytest.mark.parametrize("centre", [0.0, 90.0, -30.0])
def test_in_windows_alone(centre):
    """Within 20 deg of a point of the orbit and of the one opposite."""
    ask = machine(Unloading(gain_per_s=1e-3, window_deg=20.0, window_centre_deg=centre))
    every = machine(Unloading(gain_per_s=1e-3))
    known = row((2e-5, 1e-5, 3e-5), (0.1, 0.2, -0.1))
    for off in range(-179, 181, 7):
        r, v = orbiting(centre + off)
        here = known._replace(ephemeris=inputs(r=r, v=v).ephemeris)
        near = min(abs(off), 180 - abs(off)) < 20
        assert np.array_equal(ask(here), every(known) if near else np.zeros(3))


def test_only_windows_take_the_place():
    assert "place" in Unloading(gain_per_s=1.0, window_deg=20.0).needs
    assert "ephemeris" not in Unloading(gain_per_s=1.0, begin_n_m_s=0.1).needs


def test_nothing_is_asked_without_a_field_or_an_excess():
    ask = machine(Unloading(gain_per_s=1e-3))
    assert np.array_equal(ask(row(ZERO, (1.0, 2.0, 3.0))), np.zeros(3))
    assert np.array_equal(ask(row((1e-5, 2e-5, 3e-5), ZERO)), np.zeros(3))


def test_plain_python_gives_the_same():
    spec = Unloading(gain_per_s=1e-3, wanted_momentum_n_m_s=(0.1, 0.2, 0.3), dead_band_n_m_s=0.1)
    law, ask, rng = spec.law(), machine(spec), np.random.default_rng(2)
    for _ in range(30):
        at = row(3e-5 * rng.normal(size=3), rng.normal(size=3))
        assert ask(at) == pytest.approx(law(at), rel=1e-12)


def turning_field(t, rate):
    """A field that turns in the plane of axes 1 and 2."""
    return 3e-5 * np.array([math.cos(rate * t), math.sin(rate * t), 0.0])


def test_momentum_decays_by_mean_square_across_a_turning_field():
    """Half the gain in the plane in which the field turns, the whole gain along its axis.

    The body stands still: the wheels give what the coils take, dh/dt = m x B. The exact motion
    in the plane is linear in axes that turn with the field.
    """
    k, rate = 2e-4, 2e-3
    ask = machine(Unloading(gain_per_s=k))

    def slope(t, h):
        b = turning_field(t, rate)
        return np.cross(ask(row(b, h)), b)

    first = h = np.array([2.0, -1.0, 3.0])
    step, n = 20.0, 1000
    for i in range(n):
        t = step * i
        k1 = slope(t, h)
        k2 = slope(t + step / 2, h + step / 2 * k1)
        k3 = slope(t + step / 2, h + step / 2 * k2)
        k4 = slope(t + step, h + step * k3)
        h = h + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    end = step * n
    assert h[2] == pytest.approx(first[2] * math.exp(-k * end), rel=1e-9)
    # with the field: g' = [[0, rate], [-rate, -k]] g, in components along and across it
    values, modes = np.linalg.eig(np.array([[0.0, rate], [-rate, -k]]))
    g = (modes @ (np.exp(values * end) * np.linalg.solve(modes, first[:2].astype(complex)))).real
    c, s = math.cos(rate * end), math.sin(rate * end)
    assert h[:2] == pytest.approx([c * g[0] - s * g[1], s * g[0] + c * g[1]], abs=1e-6)
    assert values.real == pytest.approx([-0.5 * k] * 2)
    # within a turn it falls unevenly: by k/rate about the mean, at most
    fallen = np.linalg.norm(h[:2]) / np.linalg.norm(first[:2])
    assert fallen == pytest.approx(math.exp(-0.5 * k * end), rel=1.1 * k / rate)


def test_a_held_body_sheds_the_momentum_of_its_wheels():
    """Body, wheels and coils together: the attitude stays, the wheels shed momentum."""
    inertia = np.array([1.0, 1.5, 2.0])
    wanted = np.array([0.05, -0.1, 0.0])
    hold = machine(
        WheelLyapunov(
            rate_gain_n_m_s=0.4,
            angle_gain_n_m=0.1,
            reference="inertial",
            inertia_kg_m2=inertia.tolist(),
        )
    )
    unload = machine(Unloading(gain_per_s=2e-3, wanted_momentum_n_m_s=wanted))

    def rates(t, x):
        q, omega, h = np.split(x, (4, 7))
        b = Rotation.from_quat(q).inv().apply(turning_field(t, 5e-3) + np.array([0.0, 0.0, 2e-5]))
        at = row(b, h, q, omega)
        motor, coils = hold(at), np.cross(unload(at), b)
        x_, y_, z_ = omega
        q_rate = 0.5 * np.array(
            [
                q[3] * x_ + q[1] * z_ - q[2] * y_,
                q[3] * y_ + q[2] * x_ - q[0] * z_,
                q[3] * z_ + q[0] * y_ - q[1] * x_,
                -q[:3] @ omega,
            ]
        )
        turned = (coils + motor - np.cross(omega, inertia * omega + h)) / inertia
        return np.concatenate([q_rate, turned, -motor])

    x = np.concatenate([[0.0, 0.0, 0.0, 1.0], np.zeros(3), [0.4, 0.3, -0.5]])
    step, worst, far = 2.0, 0.0, [np.linalg.norm(x[7:] - wanted)]
    for i in range(2500):
        t = step * i
        k1 = rates(t, x)
        k2 = rates(t + step / 2, x + step / 2 * k1)
        k3 = rates(t + step / 2, x + step / 2 * k2)
        k4 = rates(t + step, x + step * k3)
        x = x + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        x[:4] /= np.linalg.norm(x[:4])
        worst = max(worst, Rotation.from_quat(x[:4]).magnitude())
        far.append(np.linalg.norm(x[7:] - wanted))
    assert far[-1] < 2e-3 * far[0]
    # the coils' torque, 1.3 mN m at first, bends the spring of 0.05 N m/rad
    assert math.radians(0.1) < worst < math.radians(2.0)
    assert Rotation.from_quat(x[:4]).magnitude() < math.radians(0.01)


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({"gain_per_s": 0.0}, r"gain_per_s: .*greater than 0"),
        ({}, r"gain_per_s: must be given"),
        (
            {"gain_per_s": 1.0, "dead_band_n_m_s": -1.0},
            r"dead_band_n_m_s: .*greater than or equal to 0",
        ),
        ({"gain_per_s": 1.0, "wanted_momentum_n_m_s": (1.0, 2.0)}, r"wanted_momentum_n_m_s"),
        (
            {"gain_per_s": 1.0, "dead_band_n_m_s": 0.2, "begin_n_m_s": 0.1},
            r"begin_n_m_s: must be at least dead_band_n_m_s = 0.2; received 0.1",
        ),
        ({"gain_per_s": 1.0, "window_deg": 90.0}, r"window_deg: .*less than 90"),
        ({"gain_per_s": 1.0, "window_deg": 0.0}, r"window_deg: .*greater than 0"),
        (
            {"gain_per_s": 1.0, "wanted_momentum_n_m_s": (1.0, math.inf, 0.0)},
            r"wanted_momentum_n_m_s\[1\]: must be finite",
        ),
    ],
)
def test_keys_are_checked(keys, expected):
    with pytest.raises(ValueError, match=expected):
        Unloading(**keys)
