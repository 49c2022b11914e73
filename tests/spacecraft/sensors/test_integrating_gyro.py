"""Rate-integrating gyro: its noise by the data sheet at any sampling, quanta, range, coning."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy import stats
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

from torquer.compile.engine import kernel
from torquer.compile.when_compiling import plainly
from torquer.maths.geometry.quaternion import derivative
from torquer.spacecraft.sensors.integrating_gyro import (
    IntegratingGyro,
    IntegratingGyroState,
    integrate_rate,
    start_gyro,
    turned_angle,
)

OFF = (0.0, 0.0, 0.0)
AT_START = IntegratingGyroState(OFF, OFF, OFF)
UNTURNED = (0.0, 0.0, 0.0, 1.0)
MANY = settings(max_examples=60, deadline=None)
#: A data sheet with all three noises.
SHEET = {
    "angle_random_walk_deg_sqrt_h": 0.15,
    "bias_instability_deg_h": 0.3,
    "bias_correlation_s": 300.0,
    "rate_random_walk_deg_h_sqrt_h": 0.9,
}
#: Chance that a right gyro fails a statistical test, on each side.
CHANCE = 1e-7

sizes = st.floats(-3.0, 3.0).map(lambda power: 10.0**power)
parts = st.lists(st.floats(0.05, 1.0), min_size=1, max_size=10)


def variance_within(values, expected):
    """Whether the mean square of independent normal numbers is that of this variance."""
    low, high = stats.chi2.ppf([CHANCE, 1.0 - CHANCE], values.size) / values.size
    return low < np.mean(values**2) / expected < high


def gyro_of(white=0.0, markov=0.0, correlation=1.0, walk=0.0):
    """Constants with these noises, in SI units."""
    ideal = IntegratingGyro().pack()
    return ideal._replace(
        angle_rad_sqrt_s=white,
        markov_rad_s=markov,
        markov_s=correlation,
        walk_rad_s_sqrt_s=walk,
        range_rad_s=math.inf,
    )


def step(gyro, h, state, drawn, turned=OFF):
    """The nine numbers of the state after an interval."""
    given = [tuple(map(float, part)) for part in np.reshape(state, (3, 3))]
    normals = [tuple(map(float, part)) for part in np.reshape(drawn, (3, 3))]
    after, _ = integrate_rate(gyro, IntegratingGyroState(*given), float(h), turned, *normals)
    return np.ravel(after)


def matrices(gyro, h):
    """What the kernel does to state and normal numbers, (9, 9) each: F, and Q = G G^T."""
    unit, zero = np.eye(9), np.zeros(9)
    f = np.column_stack([step(gyro, h, row, zero) for row in unit])
    g = np.column_stack([step(gyro, h, zero, row) for row in unit])
    return f, g @ g.T


def relative(q, scale):
    """A covariance with the standard deviations of another one taken for units."""
    sigma = np.sqrt(np.maximum(np.diag(scale), 1e-300))
    return q / np.outer(sigma, sigma)


def by_quadrature(white, markov, correlation, walk, h):
    """F and Q of the three coupled equations of an axis: exponentials at Gauss' nodes."""
    a = np.array([[-1.0 / correlation, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 1.0, 0.0]])
    s = np.diag([2.0 * markov**2 / correlation, walk**2, white**2])
    nodes, weights = np.polynomial.legendre.leggauss(24)
    times = [expm(a * h * 0.5 * (1.0 + node)) for node in nodes]
    q = sum(0.5 * h * w * e @ s @ e.T for w, e in zip(weights, times, strict=True))
    return expm(a * h), q


@MANY
@given(sizes, sizes, sizes, sizes, st.floats(1e-3, 10.0))
def test_each_axis_follows_the_continuous_equations(white, markov, correlation, walk, share):
    h = share * correlation
    f, q = matrices(gyro_of(white, markov, correlation, walk), h)
    expected_f, expected_q = by_quadrature(white, markov, correlation, walk, h)
    assert f == pytest.approx(np.kron(expected_f, np.eye(3)), rel=1e-12, abs=1e-12 * h)
    expected = np.kron(expected_q, np.eye(3))
    assert relative(q, expected) == pytest.approx(relative(expected, expected), abs=1e-9)


@MANY
@given(sizes, sizes, sizes, sizes, sizes, parts)
def test_any_division_of_an_interval_gives_the_same_statistics(
    white, markov, correlation, walk, h, lengths
):
    gyro = gyro_of(white, markov, correlation, walk)
    f, q = np.eye(9), np.zeros((9, 9))
    for length in np.array(lengths) * h / sum(lengths):
        one_f, one_q = matrices(gyro, length)
        f, q = one_f @ f, one_f @ q @ one_f.T + one_q
    whole_f, whole_q = matrices(gyro, h)
    assert f == pytest.approx(whole_f, rel=1e-12, abs=1e-14)
    assert relative(q, whole_q) == pytest.approx(relative(whole_q, whole_q), abs=1e-11)


def test_one_step_is_ten_steps_of_a_tenth():
    gyro = IntegratingGyro(**SHEET).pack()
    f, q = np.eye(9), np.zeros((9, 9))
    one_f, one_q = matrices(gyro, 100.0)
    for _ in range(10):
        f, q = one_f @ f, one_f @ q @ one_f.T + one_q
    whole_f, whole_q = matrices(gyro, 1000.0)
    assert f == pytest.approx(whole_f, rel=1e-13, abs=1e-15)
    assert relative(q, whole_q) == pytest.approx(relative(whole_q, whole_q), abs=1e-13)


def test_an_angle_keeps_its_digits_in_the_shortest_interval():
    """A bias of 1e9 s is a random walk: K^2 = 2 sigma^2/T. What is new is 1e-21 of the angle."""
    markov, correlation, h = 3.0, 1e9, 1e-3
    walk = markov * math.sqrt(2.0 / correlation)
    _, q = matrices(gyro_of(markov=markov, correlation=correlation), h)
    _, expected = matrices(gyro_of(walk=walk), h)
    found, angle = relative(q, q)[6, 0], [each[8, 8] for each in (q, expected)]
    assert found == pytest.approx(math.sqrt(0.75), rel=1e-11)
    assert angle[0] == pytest.approx(angle[1], rel=1e-11, abs=0.0)


@pytest.mark.parametrize("y", [1e-8, 1e-3, 0.04999, 0.05001, 0.3, 5.0])
def test_the_rest_of_the_angle_has_its_digits_on_both_sides_of_the_series(y):
    """4 sigma^2 T^2 (y - tanh y), y = h/2T: what the new bias does not tell of the angle."""
    mpmath = pytest.importorskip("mpmath")
    with mpmath.workdps(50):
        expected = float(4 * (mpmath.mpf(y) - mpmath.tanh(mpmath.mpf(y))))
    angle = step(gyro_of(markov=1.0), 2.0 * y, np.zeros(9), [0.0] * 6 + [1.0] * 3)[6:]
    assert angle**2 == pytest.approx([expected] * 3, rel=1e-12, abs=0.0)


@MANY
@given(sizes, sizes, sizes)
def test_the_bias_that_comes_and_goes_is_stationary_from_the_start(markov, correlation, h):
    gyro = gyro_of(markov=markov, correlation=correlation)
    begun = start_gyro(gyro, (1.0, -2.0, 0.5))
    assert begun == ((markov, -2.0 * markov, 0.5 * markov), OFF, OFF)
    f, q = matrices(gyro, h)
    assert f[0, 0] ** 2 * markov**2 + q[0, 0] == pytest.approx(markov**2, rel=1e-14, abs=0.0)


def allan_deviation_deg_h(spec, tau):
    """Of means over tau, from the covariance that the kernel makes."""
    gyro = spec.pack()
    f, q = matrices(gyro, tau)
    angle, unit = np.eye(9)[8], np.eye(9)
    start = np.diag([gyro.markov_rad_s**2] * 3 + [0.0] * 6)
    rows = angle @ (f - 2.0 * unit) @ f, angle @ (f - 2.0 * unit), angle
    variance = sum(row @ p @ row for row, p in zip(rows, (start, q, q), strict=True))
    return np.degrees(math.sqrt(0.5 * variance) / tau) * 3600.0


def slope(spec, tau):
    """d log deviation/d log tau."""
    ends = [allan_deviation_deg_h(spec, tau * factor) for factor in (0.999, 1.001)]
    return math.log(ends[1] / ends[0]) / math.log(1.001 / 0.999)


@pytest.mark.parametrize("tau", [0.01, 1.0, 60.0, 3600.0, 86400.0])
def test_random_walks_have_the_slopes_and_numbers_of_the_data_sheet(tau):
    hours = tau / 3600.0
    angle = IntegratingGyro(angle_random_walk_deg_sqrt_h=0.15)
    assert allan_deviation_deg_h(angle, tau) == pytest.approx(0.15 / math.sqrt(hours), rel=1e-12)
    assert slope(angle, tau) == pytest.approx(-0.5, abs=1e-9)
    rate = IntegratingGyro(rate_random_walk_deg_h_sqrt_h=0.9)
    assert allan_deviation_deg_h(rate, tau) == pytest.approx(0.9 * math.sqrt(hours / 3.0), rel=1e-9)
    assert slope(rate, tau) == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parametrize("correlation", [1.0, 300.0, 1e5])
def test_the_flat_of_the_plot_is_the_bias_instability(correlation):
    """At 1.893 correlation times; as the square root of the time before it, and after it."""
    spec = IntegratingGyro(bias_instability_deg_h=0.3, bias_correlation_s=correlation)
    best = minimize_scalar(
        lambda x: -allan_deviation_deg_h(spec, x * correlation), bounds=(1.0, 3.0), method="bounded"
    )
    assert best.x == pytest.approx(1.893, abs=0.001)
    assert -best.fun == pytest.approx(0.3, rel=1e-9)
    assert slope(spec, 1.892618 * correlation) == pytest.approx(0.0, abs=1e-6)
    assert slope(spec, 1e-3 * correlation) == pytest.approx(0.5, abs=1e-3)
    assert slope(spec, 1e4 * correlation) == pytest.approx(-0.5, abs=1e-3)


@pytest.mark.parametrize("tau", [0.1, 10.0, 570.0, 1e4, 1e6])
def test_the_plot_of_all_noises_is_that_of_the_standard(tau):
    """IEEE Std 952: the sum of the three Allan variances."""
    x, sigma = tau / 300.0, 0.3 / 0.6173642831444414
    markov = 2.0 * sigma**2 / x * (1.0 - (3.0 - 4.0 * math.exp(-x) + math.exp(-2.0 * x)) / (2 * x))
    expected = 0.15**2 / (tau / 3600.0) + markov + 0.9**2 * tau / 3600.0 / 3.0
    assert allan_deviation_deg_h(IntegratingGyro(**SHEET), tau) ** 2 == pytest.approx(expected)


@kernel
def fly(gyro, intervals, first, normals, out):
    """Angles [rad] of gyros at rest out[gyro, step, 3] by their normal numbers [.., step, 3, 3]."""
    for i in range(out.shape[0]):
        state = start_gyro(gyro, (first[i, 0], first[i, 1], first[i, 2]))
        for k in range(out.shape[1]):
            n = normals[i, k]
            state, angle = integrate_rate(
                gyro,
                state,
                intervals[k],
                (0.0, 0.0, 0.0),
                (n[0, 0], n[0, 1], n[0, 2]),
                (n[1, 0], n[1, 1], n[1, 2]),
                (n[2, 0], n[2, 1], n[2, 2]),
            )
            out[i, k, 0], out[i, k, 1], out[i, k, 2] = angle


def flown(spec, count, intervals, seed):
    """Angles [rad] (count, steps, 3) of many gyros at rest."""
    rng, out = np.random.default_rng(seed), np.empty((count, len(intervals), 3))
    normals = rng.normal(size=(count, len(intervals), 3, 3))
    fly(spec.pack(), np.array(intervals), rng.normal(size=(count, 3)), normals, out)
    return out


@pytest.mark.parametrize("samples", [1, 3, 10, 100])
def test_the_angle_over_a_second_has_the_same_noise_however_often_it_is_read(samples):
    """Its variance is the square of the angle random walk, not the one of the last sample."""
    spec = IntegratingGyro(angle_random_walk_deg_sqrt_h=0.15)
    angle = np.degrees(flown(spec, 300, [1.0 / samples] * samples, seed=samples)[:, -1])
    assert variance_within(angle, 0.15**2 / 3600.0)
    assert not variance_within(angle, 2.0 * 0.15**2 / 3600.0)


@pytest.mark.parametrize("samples", [1, 4])
@pytest.mark.parametrize("tau", [1.0, 567.8, 1e5])
def test_flown_gyros_have_the_allan_deviation_of_the_data_sheet(tau, samples):
    """Where white noise, the bias instability and the random walk rule; gyros are independent."""
    spec = IntegratingGyro(**SHEET)
    out = flown(spec, 2000, [tau / samples] * (2 * samples), seed=7)
    means = np.degrees(np.diff(out[:, samples - 1 :: samples], axis=1, prepend=0.0)) / tau * 3600.0
    halves = (means[:, 1] - means[:, 0]) / math.sqrt(2.0)
    assert variance_within(halves, allan_deviation_deg_h(spec, tau) ** 2)
    assert not variance_within(halves, 1.2 * allan_deviation_deg_h(spec, tau) ** 2)


def test_axes_and_seeds_are_independent():
    out = flown(IntegratingGyro(**SHEET), 3000, [100.0, 200.0], seed=3)
    found = np.corrcoef(np.hstack([out[:, 0], np.diff(out, axis=1)[:, 0]]).T)
    across = [found[i, j] for i in range(6) for j in range(i) if (i - j) % 3]
    limit = stats.norm.isf(CHANCE) / math.sqrt(3000)
    assert len(across) == 12 and np.abs(across).max() < limit


def read(turned=OFF, h=1.0, state=AT_START, **keys):
    """A reading without noise [rad]."""
    return integrate_rate(IntegratingGyro(**keys).pack(), state, h, turned, OFF, OFF, OFF)[1]


def test_an_ideal_gyro_reads_the_angle():
    state = IntegratingGyroState(OFF, OFF, (1.0, -2.0, 3.0))
    assert read((0.1, 0.2, -0.3), state=state) == pytest.approx((1.1, -1.8, 2.7), rel=1e-15)


def test_bias_scale_and_misalignment():
    drifted = read(h=1800.0, bias_deg_h=(2.0, -4.0, 0.5))
    assert np.degrees(drifted) == pytest.approx([1.0, -2.0, 0.25], rel=1e-14)
    seen = read((0.1, 0.2, -0.3), scale_error=(0.01, -0.02, 0.5))
    assert seen == pytest.approx((0.101, 0.196, -0.45), rel=1e-14)
    turn = np.array([3.0, -8.0, 5.0])
    seen = read((0.1, 0.2, -0.3), misalignment_deg=tuple(turn), scale_error=(0.1, 0.0, -0.1))
    axes = Rotation.from_rotvec(np.radians(turn)).as_matrix()  # columns: the sensor's axes
    expected = np.array([1.1, 1.0, 0.9]) * (axes.T @ [0.1, 0.2, -0.3])
    assert seen == pytest.approx(expected, rel=1e-14)


def test_units_of_the_data_sheet():
    packed = IntegratingGyro(**SHEET, quantum_arcsec=2.0, range_deg_s=100.0).pack()
    assert np.degrees(packed.angle_rad_sqrt_s) == pytest.approx(0.15 / 60.0)
    assert np.degrees(packed.walk_rad_s_sqrt_s) == pytest.approx(0.9 / 3600.0 / 60.0)
    assert np.degrees(packed.markov_rad_s) == pytest.approx(0.3 / 3600.0 / 0.61736, rel=1e-5)
    assert np.degrees(packed.quantum_rad) == pytest.approx(2.0 / 3600.0)
    assert np.degrees(packed.range_rad_s) == pytest.approx(100.0)
    assert packed.markov_s == 300.0


turns = st.tuples(*[st.floats(-0.3, 0.3)] * 3)


@MANY
@given(st.lists(turns, min_size=1, max_size=12), st.floats(0.1, 5000.0))
def test_counts_are_whole_and_lose_nothing(angles, quantum_arcsec):
    """The rest of a count waits for the next reading: no interval is off by more than one."""
    gyro = IntegratingGyro(quantum_arcsec=quantum_arcsec).pack()
    quantum, state, readings = gyro.quantum_rad, AT_START, [OFF]
    for angle in angles:
        state, reading = integrate_rate(gyro, state, 1.0, angle, OFF, OFF, OFF)
        readings.append(reading)
    counts = np.array(readings) / quantum
    assert counts == pytest.approx(np.round(counts), abs=1e-8)
    truth = np.cumsum([OFF, *angles], axis=0)
    for k in range(len(truth)):
        error = (np.array(readings) - readings[k]) - (truth - truth[k])
        assert np.abs(error).max() <= quantum * (1.0 + 1e-9) + 1e-15
    assert np.abs(np.array(readings) - truth).max() <= 0.5 * quantum * (1.0 + 1e-9) + 1e-15


@MANY
@given(turns, st.floats(1e-3, 10.0), st.floats(0.1, 100.0), st.floats(-5.0, 5.0))
def test_a_range_clips_the_mean_rate_about_each_axis(angle, h, range_deg_s, drawn):
    sheet = {"angle_random_walk_deg_sqrt_h": 30.0, "bias_deg_h": (0.0, 7200.0, 0.0)}
    noise, most = (drawn, 0.0, -drawn), math.radians(range_deg_s) * h
    free, clipped = (
        np.array(integrate_rate(IntegratingGyro(**sheet, **keys).pack(), AT_START, h, angle,
                                OFF, OFF, noise)[1])
        for keys in ({}, {"range_deg_s": range_deg_s})
    )  # fmt: skip
    assert clipped == pytest.approx(np.clip(free, -most, most), rel=1e-13, abs=1e-16)


def test_what_is_beyond_the_range_is_lost_for_good():
    gyro = IntegratingGyro(range_deg_s=1.0).pack()
    state, _ = integrate_rate(gyro, AT_START, 2.0, (0.5, 0.0, -0.5), OFF, OFF, OFF)
    _, angle = integrate_rate(gyro, state, 2.0, (-0.01, 0.0, 0.0), OFF, OFF, OFF)
    most = math.radians(2.0)
    assert angle == pytest.approx((most - 0.01, 0.0, -most), rel=1e-13)


def test_no_time_changes_nothing():
    state = IntegratingGyroState((0.1, 0.2, 0.3), (0.4, 0.5, 0.6), (0.7, 0.8, 0.9))
    ones = (1.0, 1.0, 1.0)
    gyro = IntegratingGyro(**SHEET, bias_deg_h=(1.0, 2.0, 3.0)).pack()
    assert integrate_rate(gyro, state, 0.0, OFF, ones, ones, ones) == (state, state.angle_rad)


def test_compiled_and_plain_code_agree():
    gyro = IntegratingGyro(**SHEET, quantum_arcsec=1e-3, scale_error=(1e-3, 0.0, 2e-3)).pack()
    given = (0.2, (0.01, -0.02, 0.03), (0.3, -1.2, 0.8), (1.0, 0.2, -0.7), (0.1, 0.5, -2.0))
    state = IntegratingGyroState((1e-6, 2e-6, -1e-6), (3e-6, 0.0, 1e-6), (0.2, -0.3, 1.1))
    ends = UNTURNED, (0.1, 0.2, 0.3), (0.1, -0.1, 0.2, 0.9), (0.3, 0.1, 0.2), 0.5
    compiled = integrate_rate(gyro, state, *given), turned_angle(*ends)
    with plainly():
        plain = integrate_rate(gyro, state, *given), turned_angle(*ends)
    for one, other in zip(compiled, plain, strict=True):
        assert np.ravel(one[0]) == pytest.approx(np.ravel(other[0]), rel=1e-14, abs=1e-20)
        assert np.ravel(one[1]) == pytest.approx(np.ravel(other[1]), rel=1e-14, abs=1e-20)


def motion(inertia, omega, torque, times):
    """Attitude, rate and integral of the rate (n, 10) of a body, by brute force."""

    def slope_of(t, y):
        w = y[4:7]
        turning = (torque(t) - np.cross(w, inertia * w)) / inertia
        return [*derivative(tuple(y[:4]), tuple(w)), *turning, *w]

    start = [*UNTURNED, *omega, 0.0, 0.0, 0.0]
    found = solve_ivp(
        slope_of, times[[0, -1]], start, "DOP853", t_eval=times, rtol=1e-13, atol=1e-15
    )
    return found.y.T


def no_torque(t):
    return np.zeros(3)


def shaking(t):
    return 0.02 * np.array([np.cos(3.0 * t), np.sin(2.0 * t), np.cos(t + 1.0)])


def as_args(row):
    return tuple(map(float, row[:4])), tuple(map(float, row[4:7]))


def error_over(inertia, torque, h, offset=0.0):
    """Error [rad] of the angle over one interval, and of the rotation vector taken for it."""
    times = np.array([0.0, 1.0 + offset * h, 1.0 + (1.0 + offset) * h])
    _, one, two = motion(np.array(inertia), (0.4, -0.3, 0.5), torque, times)
    found = turned_angle(*as_args(one), *as_args(two), h)
    truth = two[7:] - one[7:]
    phi = (Rotation.from_quat(one[:4]).inv() * Rotation.from_quat(two[:4])).as_rotvec()
    return np.linalg.norm(found - truth), np.linalg.norm(phi - truth)


@pytest.mark.parametrize("torque", [no_torque, shaking], ids=["free", "driven"])
@pytest.mark.parametrize("inertia", [(1.0, 1.3, 1.7), (1.0, 1.9, 2.8), (1.0, 5.0, 5.9)])
def test_the_angle_is_of_fifth_order_and_the_rotation_vector_of_third(inertia, torque):
    steps = np.array([0.4, 0.2, 0.1])
    errors = np.array([error_over(inertia, torque, h) for h in steps])
    orders = np.log2(errors[:-1] / errors[1:])
    assert orders[-1] == pytest.approx([5.0, 3.0], abs=0.2)
    assert (errors[:, 0] < 0.02 * errors[:, 1]).all()


def test_a_jump_of_the_torque_within_an_interval_costs_two_orders():
    def jump(t):
        return np.array([0.3, -0.2, 0.1]) * (t >= 1.0)

    steps = np.array([0.1, 0.05, 0.025])
    errors = np.array([error_over((1.0, 1.9, 2.8), jump, h, -0.3)[0] for h in steps])
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx([3.0, 3.0], abs=0.2)


bodies = st.tuples(*[st.floats(1.0, 6.0)] * 3).filter(lambda j: 2.0 * max(j) < sum(j))
directions = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)


@settings(max_examples=40, deadline=None)
@given(bodies, directions, st.floats(0.1, 1.0))
def test_tumbling_bodies_keep_to_the_stated_limit(inertia, direction, h):
    omega = np.array(direction) / np.linalg.norm(direction)
    one, two = motion(np.array(inertia), omega, no_torque, np.array([0.0, h]))
    found = turned_angle(*as_args(one), *as_args(two), h)
    assert np.linalg.norm(found - two[7:]) < 0.003 * h**5 + 1e-14


def test_the_angle_of_a_long_motion_is_of_fourth_order():
    """Four minutes of tumbling, some 25 turns: errors of intervals add up."""
    errors = []
    for h in (0.8, 0.4, 0.2):
        times = h * np.arange(round(240.0 / h) + 1)
        rows = motion(np.array([1.0, 1.9, 2.8]), (0.4, -0.3, 0.5), no_torque, times)
        pairs = itertools.pairwise(rows)
        angles = [turned_angle(*as_args(one), *as_args(two), h) for one, two in pairs]
        errors.append(np.linalg.norm(np.sum(angles, axis=0) - rows[-1, 7:]))
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders[-1] == pytest.approx(4.0, abs=0.2) and errors[-1] < 1e-4


@pytest.mark.parametrize("steps", [12, 24])
def test_coning_turns_an_axis_that_comes_back(steps):
    """The body's axis z goes round a cone once; after it the attitude is what it was, yet the gyro
    about z has counted the solid angle of the cone.
    """
    half, nu, h = np.radians(5.0), 2.0 * np.pi, 1.0 / steps
    phase = nu * np.arange(steps + 1) / steps
    zero = np.zeros_like(phase)
    tilts = np.column_stack([np.cos(phase), np.sin(phase), zero])
    turned = nu * np.column_stack([-np.sin(phase), np.cos(phase), zero])
    # rate of the rotation exp(half n): sin(half) n' - (1 - cos(half)) n x n'
    rates = np.sin(half) * turned - (1.0 - np.cos(half)) * np.cross(tilts, turned)
    rows = np.column_stack([Rotation.from_rotvec(half * tilts).as_quat(), rates])
    pairs = list(itertools.pairwise(rows))
    angles = [turned_angle(*as_args(one), *as_args(two), h) for one, two in pairs]
    solid = -nu * (1.0 - np.cos(half))
    assert np.sum(angles, axis=0) == pytest.approx((0.0, 0.0, solid), abs=0.002 * abs(solid))
    turns = [Rotation.from_quat(one[:4]).inv() * Rotation.from_quat(two[:4]) for one, two in pairs]
    uncorrected = sum(turn.as_rotvec()[2] for turn in turns)
    assert uncorrected / solid - 1.0 == pytest.approx(-((nu * h) ** 2) / 6.0, rel=0.1)


@MANY
@given(directions, st.floats(0.0, 3.1), st.integers(0, 1000), st.booleans())
def test_a_steady_turn_is_exact_in_any_frame(direction, angle, seed, is_negative):
    axis = np.array(direction) / np.linalg.norm(direction)
    frame = Rotation.random(random_state=seed)
    after = (frame * Rotation.from_rotvec(angle * axis)).as_quat() * (-1.0 if is_negative else 1.0)
    omega = tuple((angle / 2.0 * axis).tolist())
    found = turned_angle(tuple(frame.as_quat().tolist()), omega, tuple(after.tolist()), omega, 2.0)
    assert found == pytest.approx(angle * axis, abs=1e-14)


@MANY
@given(directions, directions, st.integers(0, 1000), st.floats(0.01, 1.0))
def test_a_motion_back_takes_the_angle_back(omega, omega_next, seed, h):
    q, q_next = (tuple(row) for row in Rotation.random(2, random_state=seed).as_quat().tolist())
    there = turned_angle(q, omega, q_next, omega_next, h)
    back = turned_angle(q_next, tuple(np.negative(omega_next)), q, tuple(np.negative(omega)), h)
    assert np.add(there, back) == pytest.approx(np.zeros(3), abs=1e-14)


def test_beyond_half_a_turn_the_shorter_way_is_taken():
    """The limit that is stated."""
    for turn, expected in ((math.pi - 0.01, math.pi - 0.01), (math.pi + 0.01, 0.01 - math.pi)):
        after = (math.sin(0.5 * turn), 0.0, 0.0, math.cos(0.5 * turn))
        omega = (turn, 0.0, 0.0)
        found = turned_angle(UNTURNED, omega, after, omega, 1.0)
        assert found == pytest.approx((expected, 0.0, 0.0), abs=1e-14)


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({"range_deg_s": 0.0}, "range_deg_s: .*greater than 0"),
        ({"angle_random_walk_deg_sqrt_h": -1.0}, "greater than or equal to 0"),
        ({"angle_random_walk_deg_sqrt_h": 2e9}, "must be at most 1e\\+09"),
        ({"bias_instability_deg_h": -1.0}, "greater than or equal to 0"),
        (
            {"bias_instability_deg_h": 1.0},
            "bias_correlation_s: must be given with bias_instability_deg_h; received none",
        ),
        ({"bias_correlation_s": 0.0}, "greater than 0"),
        ({"rate_random_walk_deg_h_sqrt_h": -1.0}, "greater than or equal to 0"),
        ({"rate_random_walk_deg_h_sqrt_h": 1e-16}, "must be at least 1e-15"),
        ({"bias_deg_h": (0.0, 1.0)}, "bias_deg_h"),
        ({"bias_deg_h": (0.0, 1.0, 2e9)}, "within -1e\\+09..1e\\+09"),
        ({"scale_error": (0.0, 0.0, float("nan"))}, "must be finite"),
        ({"misalignment_deg": (0.0, 0.0, float("inf"))}, "must be finite"),
        ({"quantum_arcsec": -1.0}, "greater than or equal to 0"),
        ({"quantum_arcsec": 1e-10}, "must be at least 1e-09"),
        ({"sample_s": 1.0, "delay_s": 2.0}, "delay_s: must not exceed sample_s = 1 s"),
        ({"noise_deg_s": 1.0}, "must be a known key"),
        (
            {"failures": [{"kind": "bias"}]},
            "kind: must be one of silent, stuck, zeros, nan, infinite; received 'bias'",
        ),
        ({"failures": [{"kind": "swapped", "axes": "xy"}]}, "received 'swapped'"),
    ],
)
def test_what_cannot_be_is_reported(keys, expected):
    with pytest.raises(ValueError, match=expected):
        IntegratingGyro(**keys)


def test_a_correlation_time_needs_no_instability():
    """A campaign may vary the instability down to none."""
    gyro = IntegratingGyro(bias_correlation_s=100.0).pack()
    assert (gyro.markov_rad_s, gyro.markov_s) == (0.0, 100.0)
