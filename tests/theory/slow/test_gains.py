"""Gains of B-dot against brute force: the sampled loop in the plane, multipliers, quadrature."""

import math
from pathlib import Path

import numpy as np
import pytest
from bdot_loop import growth, multipliers_at
from scipy.optimize import brentq

from torquer.environment.field.averaged import b_z, cone_angle
from torquer.theory.slow.gains import (
    bdot_gain,
    bdot_greatest_gain,
    damped_share,
    damping_efficiency,
    driven_rate_rad_s,
    sampling_limit_rad_s,
    saturated_damping_time_s,
)

FIELD_T, INERTIA = 3e-5, 0.8
PAGE = Path(__file__).parents[3] / "docs/theory/sampled-bdot.md"


def sampled_plane(rate, difference_s, hold_s, gain, cycles, fine=200, off_s=None, lag_s=0.0):
    """Rate after each cycle of a body that turns about the normal of a constant field.

    Brute force: the angle is integrated in small steps, the torque along the axis is m x B at
    every instant, and the dipole follows its command, held in the body, with the lag. In a window
    (as long as the difference unless given) the coils are off; without one (0), readings and holds
    follow each other, and d = a or 0. Where d = 0 the law knows dB/dt.
    """
    off_s = difference_s if off_s is None else off_s

    def field(angle):  # in the body, which has turned by the angle
        return FIELD_T * np.array([math.cos(angle), -math.sin(angle)])

    def turn(state, dipole, command, span_s):  # leapfrog
        angle, rate = state
        h = span_s / fine
        kept = math.exp(-0.5 * h / lag_s) if lag_s > 0.0 else 0.0
        for _ in range(fine if span_s > 0.0 else 0):
            angle += 0.5 * h * rate
            b, dipole = field(angle), command + kept * (dipole - command)
            rate += h * (dipole[0] * b[1] - dipole[1] * b[0]) / INERTIA
            angle, dipole = angle + 0.5 * h * rate, command + kept * (dipole - command)
        return (angle, rate), dipole

    state, dipole, rates, nothing = (0.3, rate), np.zeros(2), [], np.zeros(2)
    before = field(0.3 - rate * difference_s)
    for _ in range(cycles):
        if off_s > 0.0:
            state, dipole = turn(state, dipole, nothing, off_s - difference_s)
            before = field(state[0])
            state, dipole = turn(state, dipole, nothing, difference_s)
        now = field(state[0])
        if difference_s > 0.0:
            command = -gain * (now - before) / difference_s
        else:
            command = -gain * state[1] * np.array([now[1], -now[0]])
        before = now
        state, dipole = turn(state, dipole, command, hold_s)
        rates.append(state[1])
    return np.array(rates)


@pytest.mark.parametrize(("difference_s", "hold_s"), [(3.0, 3.0), (1.0, 6.0), (4.0, 0.5)])
@pytest.mark.parametrize("part", [0.01, 0.3, 0.8, 0.99, 1.01, 1.4, 2.5, 3.3])
def test_efficiency_is_that_of_one_hold_by_brute_force(difference_s, hold_s, part):
    rate = part * sampling_limit_rad_s(difference_s, hold_s)
    gain = 1e-6 * INERTIA / (FIELD_T**2 * hold_s)
    (after,) = sampled_plane(rate, difference_s, hold_s, gain, 1, fine=1000)
    ideal = 1e-6 * rate
    efficiency = damping_efficiency(rate, difference_s, hold_s)
    assert (rate - after) / ideal == pytest.approx(efficiency, abs=2e-6)


@pytest.mark.parametrize("times", [(2, 2, 0.5, 0), (0, 2, 0.5, 0), (1, 3, 2, 2), (0, 3, 0.5, 2)])
@pytest.mark.parametrize("part", [0.3, 0.95, 1.0, 1.05, 2.0])
def test_efficiency_matches_a_lagged_cycle_by_brute_force(times, part):
    """Once the first commands are forgotten; what coils give in the window counts."""
    d, a, lag_s, off_s = times
    rate = part * sampling_limit_rad_s(d, a, lag_s)
    gain = 1e-6 * INERTIA / (FIELD_T**2 * a)
    cycles = 2 + int(16.0 * lag_s / (a + off_s))
    rates = sampled_plane(rate, d, a, gain, cycles, fine=600, off_s=off_s, lag_s=lag_s)
    braked = (rates[-2] - rates[-1]) / (1e-6 * rate)
    # the leapfrog's error, and the rate's own change of 1e-6 a cycle
    assert braked == pytest.approx(damping_efficiency(rate, d, a, lag_s), abs=3e-5)


LOOPS = [
    (2, 2, 0, 0), (2, 2, 0.1, 0), (2, 2, 0.5, 0), (2, 2, 2, 0), (3, 3, 0, 6), (3, 3, 0.5, 6),
    (3, 3, 2, 6), (1, 5, 2, 1), (0, 2, 0, 0), (0, 2, 0.5, 0), (0, 3, 2, 6),
]  # fmt: skip


@pytest.mark.parametrize("times", LOOPS)
def test_efficiency_and_limit_are_those_of_the_multipliers(times):
    """Rotation along the field: what tilts off it dies out while E is positive."""
    limit, kappa = sampling_limit_rad_s(*times[:3]), 1e-7
    for part in (0.2, 0.7, 0.9, 1.1):
        rate = part * limit
        expected = -damping_efficiency(rate, *times[:3])
        assert growth(rate, kappa, *times) == pytest.approx(expected, abs=1e-5)
    found = brentq(lambda w: growth(w, kappa, *times), 0.85 * limit, 1.12 * limit, xtol=1e-10)
    assert found == pytest.approx(limit, rel=1e-5)


@pytest.mark.parametrize("times", LOOPS)
def test_greatest_gain_is_where_a_slow_multiplier_leaves_the_circle(times):
    d, a, lag_s, off_s = times
    gain = bdot_greatest_gain(INERTIA, FIELD_T, a, difference_s=d, lag_s=lag_s, measure_s=off_s)
    critical = gain * FIELD_T**2 / INERTIA
    for part, stable in ((1e-3, True), (0.1, True), (0.5, True), (0.999, True), (1.001, False)):
        found = multipliers_at(0.0, part * critical, *times)
        found = np.delete(found, np.argmin(np.abs(found - 1.0)))
        assert (np.abs(found).max() < 1.0) == stable, part


@pytest.mark.parametrize(
    ("d", "off_s"), [(2.0, 0.0), (0.0, 0.0), (2.0, 2.0), (2.0, 6.0), (0.0, 2.0)]
)
def test_lag_halves_the_greatest_gain_of_windowless_differences_only(d, off_s):
    parts = [
        bdot_greatest_gain(1.0, 1.0, 2.0, difference_s=d, lag_s=lag_s, measure_s=off_s)
        for lag_s in (0.0, 0.1, 0.5, 2.0, 20.0, 2000.0)
    ]
    assert parts[0] == pytest.approx(1.0, rel=1e-14)
    if d > 0.0 and off_s == 0.0:
        assert np.all(np.diff(parts) < 0.0)
        assert parts[-1] == pytest.approx(0.5, rel=1e-3)
    else:
        assert min(parts) >= 1.0 - 1e-12


def test_the_pages_table_of_greatest_gains():
    """Rows: differences, differences with a window, none; columns: lags."""
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    (first,) = [i for i, line in enumerate(lines) if line.startswith("| x | lag_s = 0")]
    cells = [[x.strip() for x in line.strip("|").split("|")] for line in lines[first : first + 5]]
    lags = [float(x.removeprefix("lag_s = ")) for x in cells[0][1:]]
    for row, times in zip(cells[2:], ((2, 2, 0), (3, 3, 6), (0, 2, 0)), strict=True):
        d, a, off_s = times
        for printed, lag_s in zip(row[1:], lags, strict=True):
            gain = bdot_greatest_gain(1.0, 1.0, a, difference_s=d, lag_s=lag_s, measure_s=off_s)
            assert gain * a == pytest.approx(float(printed), abs=0.00051), (row[0], lag_s)


@pytest.mark.parametrize(("part", "below_percent"), [(0.01, 0.7), (0.1, 6.6)])
def test_a_strong_law_has_a_lower_limit(part, below_percent):
    limit = sampling_limit_rad_s(2.0, 2.0, 0.5)
    found = brentq(lambda w: growth(w, part / 2.0, 2, 2, 0.5, 0), 0.5 * limit, 1.1 * limit)
    assert 100.0 * (1.0 - found / limit) == pytest.approx(below_percent, abs=0.051)
    assert f"{below_percent} % below" in PAGE.read_text(encoding="utf-8")


def test_the_greatest_gain_is_found_for_any_times():
    """Every answer checks its own multipliers; of no loop is it below half of that without lag."""
    random = np.random.default_rng(20)
    for _ in range(500):
        hold_s, off_s = 10.0 ** random.uniform(-3.0, 4.0, 2)
        lag_s = hold_s * 10.0 ** random.uniform(-12.0, 9.0)
        for d, off in ((hold_s, 0.0), (0.0, 0.0), (off_s, off_s), (0.1 * off_s, off_s)):
            times = {"difference_s": d, "lag_s": lag_s, "measure_s": off}
            assert bdot_greatest_gain(1.0, 1.0, hold_s, **times) * hold_s > 1.0 - 1e-5


@pytest.mark.parametrize("lag_s", [0.0, 1e-12, 1e-3, 0.5, 40.0, 1e6, 1e12])
@pytest.mark.parametrize(("d", "a"), [(2.0, 2.0), (0.0, 1.0), (1e-3, 0.0), (6.0, 1e-5)])
def test_rates_solve_their_equations_to_rounding(d, a, lag_s):
    for turn, w in (
        (0.5 * math.pi, sampling_limit_rad_s(d, a, lag_s)),
        (1.5 * math.pi, driven_rate_rad_s(d, a, lag_s)),
    ):
        if turn > math.pi and w == 2.0 * math.pi / max(d, a):
            continue  # there a sinc turns its sign first
        residual = (turn - 0.5 * math.pi) + math.atan2(1.0, w * lag_s) - 0.5 * w * (d + a)
        slope = w * (0.5 * (d + a) + lag_s / (1.0 + (w * lag_s) ** 2))
        assert abs(residual) <= 1e-15 * (slope + turn)
        assert 0.0 < w <= turn / (0.5 * (d + a)) * (1.0 + 1e-15)


def test_zero_lag_gives_closed_form_and_zero_delay_no_limit():
    assert sampling_limit_rad_s(2.0, 1.0) == pytest.approx(math.pi / 3.0, rel=1e-15)
    assert sampling_limit_rad_s(0.0, 0.0, 3.0) == driven_rate_rad_s(0.0, 0.0, 3.0) == math.inf
    assert math.degrees(sampling_limit_rad_s(2.0, 2.0, 0.5)) == pytest.approx(36.23, abs=0.01)


@pytest.mark.parametrize("times", [(2, 2, 0.5), (0, 2, 0), (1, 3, 0), (3, 1, 0.2), (0, 3, 2)])
def test_law_drives_between_limit_and_driven_rate_and_brakes_above(times):
    limit, driven = sampling_limit_rad_s(*times), driven_rate_rad_s(*times)
    inner = np.linspace(limit, driven, 400)[1:-1]
    assert np.all(damping_efficiency(inner, *times) < 0.0)
    assert damping_efficiency(driven, *times) == pytest.approx(0.0, abs=1e-15)
    assert damping_efficiency(1.001 * driven, *times) > 0.0


def test_the_sign_turns_at_the_limit_and_not_below():
    limit = sampling_limit_rad_s(3.0, 5.0)
    assert limit == pytest.approx(math.pi / 8.0)
    rates = np.linspace(1e-6, limit, 500)
    efficiency = damping_efficiency(rates, 3.0, 5.0)
    assert np.all(efficiency[:-1] > 0.0)
    assert efficiency[-1] == pytest.approx(0.0, abs=1e-12)
    assert efficiency[0] == pytest.approx(1.0, abs=1e-9)
    assert np.all(np.diff(efficiency) < 0.0)
    assert damping_efficiency(1.01 * limit, 3.0, 5.0) < 0.0


def test_zero_length_hold_leaves_the_age_of_the_difference():
    assert sampling_limit_rad_s(2.0, 0.0) == pytest.approx(math.pi / 2.0)
    w = 0.4
    assert damping_efficiency(w, 2.0, 0.0) == pytest.approx(math.sin(w * 2.0) / (w * 2.0))


@pytest.mark.parametrize("off_s", [2.0, 0.0])
@pytest.mark.parametrize("lag_s", [0.0, 0.5, 2.0])
@pytest.mark.parametrize("difference_s", [2.0, 0.0])
@pytest.mark.parametrize(("part", "grows"), [(0.97, False), (1.03, True)])
def test_slow_motion_grows_above_the_greatest_gain(off_s, lag_s, difference_s, part, grows):
    times = {"difference_s": difference_s, "lag_s": lag_s}
    gain = part * bdot_greatest_gain(INERTIA, FIELD_T, 2.0, measure_s=off_s, **times)
    rates = sampled_plane(1e-7, hold_s=2.0, gain=gain, cycles=300, fine=20, off_s=off_s, **times)
    early, late = np.abs(rates[:20]).max(), np.abs(rates[-20:]).max()
    assert (late > 3.0 * early) if grows else (late < early / 3.0)


@pytest.mark.parametrize("inclination_deg", [0.0, 1.0, 30.0, 57.0, 90.0, 120.0, 180.0])
def test_damped_share_is_the_average_over_the_orbit(inclination_deg):
    inclination = math.radians(inclination_deg)
    cone = cone_angle(inclination)
    u = np.linspace(0.0, math.pi, 400, endpoint=False)
    b = np.array([b_z(1.0, x, cone) for x in u])
    open_share = np.eye(3) - np.einsum("ni,nj->ij", b, b) / len(u)
    shares = np.linalg.eigvalsh(open_share)
    least, mean, greatest = damped_share(inclination)
    assert least == pytest.approx(shares[0], abs=1e-12)
    assert greatest == pytest.approx(shares[2], abs=1e-12)
    assert mean == pytest.approx(np.trace(open_share) / 3.0, abs=1e-12)


def test_gain_damps_in_the_time_asked_for():
    """The averaged rate equation of a sphere, by its definition, integrated in small steps."""
    share, duty, time_s = 0.6, 0.4, 2000.0
    gain = bdot_gain(time_s, INERTIA, FIELD_T, share=share, duty=duty)
    rate, h = 1.0, 1.0
    for _ in range(int(time_s / h)):
        rate *= math.exp(-h * duty * gain * FIELD_T**2 * share / INERTIA)
    assert rate == pytest.approx(math.exp(-1.0), rel=1e-9)
    assert bdot_gain(time_s, INERTIA, FIELD_T) == pytest.approx(gain * share * duty * 1.5)


def test_saturated_coils_take_at_least_the_momentum_over_the_torque():
    momentum, limit, field = 0.4, 3.2, 3e-5
    time_s = saturated_damping_time_s(momentum, limit, field, duty=1.0 / 3.0)
    assert momentum - limit * field * time_s / 3.0 == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: sampling_limit_rad_s(-1.0, 1.0), "difference_s: must be 0 or positive; "),
        (lambda: sampling_limit_rad_s(1.0, 1.0, math.inf), "lag_s: must be 0 or positive; "),
        (lambda: driven_rate_rad_s(1.0, 1.0, -1.0), "lag_s: must be 0 or positive; received -1.0"),
        (
            lambda: bdot_greatest_gain(1.0, 1.0, 1.0, difference_s=0.5),
            "difference_s: must be 0 or hold_s here; received 0.5",
        ),
        (
            lambda: bdot_greatest_gain(1.0, 1.0, 1.0, difference_s=3.0, measure_s=2.0),
            "difference_s: must not exceed measure_s; received 3.0",
        ),
        (lambda: sampling_limit_rad_s(1.0, -1.0), "hold_s: must be 0 or positive; received -1.0"),
        (lambda: damping_efficiency(1.0, math.nan, 1.0), "difference_s: .* received nan"),
        (lambda: damped_share(4.0), r"inclination_rad: must lie within 0\.\.pi; received 4.0"),
        (lambda: bdot_gain(0.0, 1.0, 1.0), "damping_time_s: must be positive .* received 0.0"),
        (lambda: bdot_gain(1.0, -1.0, 1.0), "inertia_kg_m2: must be positive"),
        (lambda: bdot_gain(1.0, 1.0, math.inf), "field_t: must be positive .* received inf"),
        (lambda: bdot_gain(1.0, 1.0, 1.0, share=0.0), "share: must be above 0 and at most 1; "),
        (lambda: bdot_gain(1.0, 1.0, 1.0, duty=1.5), "duty: must be above 0 .* received 1.5"),
        (lambda: bdot_greatest_gain(1.0, 1.0, 0.0), "hold_s: must be positive and finite"),
        (lambda: saturated_damping_time_s(1.0, 1.0, 0.0), "field_t: must be positive and finite"),
    ],
)
def test_what_makes_no_sense_is_refused(call, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        call()
