"""Averaged three-axis control: channels, exponents, and the edge of the plateau for any body."""

import math
from collections import Counter

import numpy as np
import pytest
from attitude_holds import along_z, at_strength, damping, gains_of, hold
from scipy.linalg import block_diag

from torquer.environment.field.averaged import cone_angle
from torquer.theory.three_axis.averaged import (
    averaged_degree,
    channel_exponents,
    channel_factors,
    mean_damping,
    plateau_edge,
)
from torquer.theory.three_axis.floquet import mean_degrees, tabulate

ALONE = np.empty((1, 0))


def published(inclination_deg, inertia, b0_t):
    """MAG's (p + q) B0^2/A and its rho1, rho2."""
    p = 0.5 * math.sin(cone_angle(math.radians(inclination_deg))) ** 2
    q = 1.0 - 2.0 * p
    a, b, c = inertia
    return b0_t**2 * (p + q) / a, b / a, c * (p + q) / (2.0 * p * a)


def test_the_factors_are_the_published_ones():
    for inclination in (10.0, 30.0, 70.0, 98.0):
        held = hold(inclination)
        b0 = np.linalg.norm(held.free(np.zeros(1)).b_body_t)
        first, rho1, rho2 = published(inclination, (1.0, 2.0, 1.5), b0)
        wanted = sorted([first, first / rho1, first / rho2])
        assert channel_factors((1.0, 2.0, 1.5), damping(held)) == pytest.approx(wanted, rel=1e-9)


def test_exponents_are_the_roots_of_the_averaged_equations():
    """J theta'' + k S theta' + 2 k_a S theta = 0 for a body and a field that no axes share."""
    rng = np.random.default_rng(4)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    inertia = turn @ np.diag([1.0, 1.7, 2.1]) @ turn.T
    s = mean_damping(rng.normal(size=(5, 3)))
    mu = channel_factors(inertia, s)
    for k, k_a in ((0.3, 0.01), (0.3, 2.0), (2.0, 0.0)):
        matrix = np.zeros((6, 6))
        matrix[:3, 3:] = np.eye(3)
        matrix[3:] = -np.linalg.solve(inertia, np.hstack([2.0 * k_a * s, k * s]))
        found = channel_exponents(mu, k, k_a).ravel()
        for one in np.linalg.eigvals(matrix):
            assert np.abs(found - one).min() < 1e-10
        assert averaged_degree(mu, k, k_a) == pytest.approx(-found.real.max(), abs=1e-12)


def test_the_slow_root_keeps_its_digits():
    """A weak spring: s = -2 k_a/k, where the difference of the roots would cancel."""
    slow = channel_exponents([1.0, 1.0, 1.0], 1.0, 1e-14)[0, 1]
    assert slow == pytest.approx(-2e-14, rel=1e-12, abs=0)


def printed_edge(case, k, rho1, rho2):
    """K_a by (4.3.6), (4.3.7) and (4.3.8) as printed."""
    part = {"I": (2.0 * rho2 - 1.0) / rho2**2, "II": (2.0 * rho1 - 1.0) / rho1**2,
            "III": (2.0 * rho1 - rho2) / rho1**2}  # fmt: skip
    return k * k * part[case] / 8.0


@pytest.mark.parametrize(
    ("case", "inclination", "inertia"),
    [("I", 30.0, (1.0, 2.0, 1.5)), ("II", 60.0, (1.0, 2.0, 1.5)), ("III", 70.0, (1.0, 2.0, 1.5))],
)
def test_the_one_formula_has_the_printed_three(case, inclination, inertia):
    first, rho1, rho2 = published(inclination, inertia, 1.0)
    order = {"I": 1.0 < rho1 < rho2, "II": 1.0 < rho2 < rho1, "III": rho2 < 1.0 < rho1}
    assert order[case]
    mu = first / np.array([1.0, rho1, rho2])
    k = 0.7 / first  # K of 0.7 at an orbital rate of 1
    wanted = printed_edge(case, 0.7, rho1, rho2) / first
    assert plateau_edge(np.sort(mu), k) == pytest.approx(wanted, rel=1e-12)


def random_cases(count):
    """Bodies whose moments are in any order, and inclinations."""
    rng = np.random.default_rng(20)
    while count:
        moments = rng.uniform(0.3, 2.5, 3)
        if 2.0 * moments.max() < 0.98 * moments.sum():
            count -= 1
            yield tuple(moments.tolist()), float(rng.uniform(5.0, 175.0))


def lower_edge(degree, low, high):
    """Least k_a with the degree of the plateau, by bisection; of a smooth rise below it."""
    plateau = degree(high)
    while high - low > 1e-11 * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if degree(middle) < plateau * (1.0 - 1e-12) else (low, middle)
    return high


def test_the_edge_of_the_plateau_for_random_bodies_and_inclinations():
    """Against the averages of the law's own kernel, channel by channel not assumed.

    The degree of the averaged 6 x 6 system rises up to the formula's k_a and stays from there on.
    """
    worst, orders, cases = 0.0, set(), Counter()
    for inertia, inclination in random_cases(60):
        held = at_strength(hold(inclination, inertia), 0.4)
        k, edge = gains_of(held)
        made = tabulate(held, {"angle_gain": (0.1 * edge, 4.0 * edge)}, 16)

        def degree(k_a, made=made):
            return float(mean_degrees(made, np.array([[k_a]]))[0])

        mu = channel_factors(inertia, damping(held))
        assert degree(4.0 * edge) == pytest.approx(0.5 * k * mu[0] / held.rate_rad_s, rel=1e-9)
        worst = max(worst, abs(lower_edge(degree, 0.1 * edge, 2.0 * edge) / edge - 1.0))
        _, rho1, rho2 = published(inclination, inertia, 1.0)
        orders.add(tuple(np.argsort([1.0, rho1, rho2])))
        if rho1 > 1.0:  # as in MAG, which has these three cases
            cases["I" if rho2 > rho1 else "II" if rho2 > 1.0 else "III"] += 1
    assert worst < 1e-8
    assert len(orders) == 6 and min(cases[case] for case in ("I", "II", "III")) >= 5, cases


def test_a_reference_off_the_field_axes_has_its_channels_too():
    """Any inertial attitude: the averages of the kernel have the degree of the closed channels."""
    rng = np.random.default_rng(8)
    for _ in range(6):
        euler_deg = tuple(rng.uniform(-80.0, 80.0, 3))
        held = at_strength(
            hold(50.0, (1.3, 0.9, 1.8), euler_deg=euler_deg), 0.5, rng.uniform(0.3, 3)
        )
        mu = channel_factors((1.3, 0.9, 1.8), damping(held))
        found = mean_degrees(tabulate(held, {}, 16), ALONE)[0]
        wanted = averaged_degree(mu, *gains_of(held)) / held.rate_rad_s
        assert found == pytest.approx(wanted, rel=1e-9)


def test_gains_of_fig_4_4_3_belong_to_30_deg():
    """k = 20 per omega0 gives 0.015 on the edge at 30 deg inclination, 0.022 at its stated 70."""
    found = {}
    for inclination in (30.0, 70.0):
        held = hold(inclination)
        mu = channel_factors((1.0, 2.0, 1.5), damping(held))
        found[inclination] = float(plateau_edge(mu, 20.0 / held.rate_rad_s))
    assert found[30.0] == pytest.approx(0.015, abs=0.0005)
    assert found[70.0] == pytest.approx(0.022, abs=0.0005)


def test_messages():
    with pytest.raises(ValueError, match="gain: must be at least 0; received -1"):
        channel_exponents([1.0, 1.0, 1.0], -1.0, 0.0)
    with pytest.raises(ValueError, match="channel factor: must be at least 0"):
        averaged_degree([-1.0, 1.0, 1.0], 1.0, 0.0)
    with pytest.raises(ValueError, match="greatest channel factor: must be above 0"):
        plateau_edge([0.0, 0.0, 0.0], 1.0)
    with pytest.raises(ValueError, match="triangle"):
        channel_factors((1.0, 1.0, 3.0), block_diag(1.0, 1.0, 1.0))
    assert along_z(90.0)[2] == pytest.approx(90.0)
