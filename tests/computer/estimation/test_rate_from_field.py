"""Rate from two field readings: exact across the field, blind along it, noise, when it is known."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from law_cases import ZERO, compiled, inputs
from scipy.spatial.transform import Rotation

from torquer import simulate
from torquer.compile import engine
from torquer.computer.estimation import RateFromField

MANY = settings(max_examples=80, deadline=None)
B = np.array([2e-5, -1e-5, 3e-5])
turns = st.integers(0, 10_000).map(lambda n: Rotation.random(random_state=n))


class Estimating:
    """The estimator, reading by reading."""

    def __init__(self, **keys):
        estimator = RateFromField(**keys).estimator()
        self.function, self.packed = compiled(estimator), estimator.pack()
        self.cells = estimator.first_memory()

    def __call__(self, t_s, b, read_s=None):
        known = inputs(t_s, b=b)
        if read_s is not None:
            known = known._replace(read_at=known.read_at._replace(magnetometer_s=float(read_s)))
        return self.function(known, self.packed, self.cells)


def steady_field(omega, t_s):
    """A field that stands still in space, in the axes of a body that turns."""
    return Rotation.from_rotvec(-np.asarray(omega) * t_s).apply(B)


@MANY
@given(turns, st.floats(1e-4, 3.1), st.floats(0.1, 10.0))
def test_a_rotation_across_the_field_is_found_whatever_its_size(turn, angle, interval_s):
    """Up to half a turn from one reading to the next."""
    across = np.cross(B, turn.as_matrix()[2])
    omega = across / np.linalg.norm(across) * angle / interval_s
    estimating = Estimating()
    estimating(3.0, steady_field(omega, 3.0))
    found = estimating(3.0 + interval_s, steady_field(omega, 3.0 + interval_s))
    tolerance = 1e-11 * np.linalg.norm(omega) + 1e-15 / interval_s
    assert found.omega_body_rad_s == pytest.approx(omega, rel=0.0, abs=tolerance)
    assert found.t_s == 3.0 + interval_s


@MANY
@given(st.floats(3.2, 6.2))
def test_more_than_half_a_turn_reads_as_the_shorter(angle):
    omega = np.cross(B, (0.0, 0.0, 1.0))
    omega *= angle / np.linalg.norm(omega)
    estimating = Estimating()
    estimating(0.0, steady_field(omega, 0.0))
    found = estimating(1.0, steady_field(omega, 1.0))
    expected = omega * (angle - 2.0 * math.pi) / angle
    assert found.omega_body_rad_s == pytest.approx(expected, rel=1e-9)


def test_slow_rate_across_field_is_found_to_first_order():
    errors = []
    for interval_s in (0.4, 0.2, 0.1):
        omega, estimating = np.array([0.05, 0.1, -0.08]), Estimating()
        estimating(0.0, steady_field(omega, 0.0))
        b = steady_field(omega, interval_s)
        found = np.array(estimating(interval_s, b).omega_body_rad_s)
        along = b / np.linalg.norm(b)
        assert found @ along == pytest.approx(0.0, abs=1e-15)
        errors.append(np.linalg.norm(found - (omega - along * (along @ omega))))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(1.0, abs=0.05)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(1.0, abs=0.05)


def test_a_rotation_about_the_field_is_not_seen():
    estimating = Estimating()
    estimating(0.0, B)
    assert estimating(1.0, B).omega_body_rad_s == pytest.approx(ZERO, abs=1e-15)


@pytest.mark.parametrize("axis", np.eye(3))
def test_field_along_an_unturned_axis_is_no_rate(axis):
    """The product of the two readings is zero to the last bit."""
    estimating = Estimating()
    estimating(0.0, 3e-5 * axis)
    assert estimating(1.0, 3e-5 * axis).omega_body_rad_s == ZERO


def test_magnetometer_noise_gives_the_noise_of_the_docstring():
    """sqrt(2) sigma_B/(B dt) about each axis across the field, none along it."""
    rng, sigma_t, interval_s = np.random.default_rng(1), 50e-9, 2.0
    estimating, found = Estimating(), []
    for n in range(8000):
        estimate = estimating(interval_s * n, B + sigma_t * rng.normal(size=3))
        found.append(estimate.omega_body_rad_s)
    along = B / np.linalg.norm(B)
    first = np.cross(along, (1.0, 0.0, 0.0))
    first /= np.linalg.norm(first)
    noise = np.array(found[1:]) @ np.column_stack([first, np.cross(along, first), along])
    expected = math.sqrt(2.0) * sigma_t / (np.linalg.norm(B) * interval_s)
    assert noise[:, :2].std(axis=0) == pytest.approx([expected] * 2, rel=0.04)
    assert noise[:, 2].std() < 0.01 * expected


def test_nothing_is_known_before_the_second_reading():
    estimating = Estimating()
    first = estimating(5.0, B)
    assert first.t_s == -math.inf and np.isnan(first.omega_body_rad_s).all()
    second = estimating(6.0, B)
    assert second.t_s == 6.0 and np.isfinite(second.omega_body_rad_s).all()
    for estimate in (first, second):
        assert np.isnan(estimate.q_body_to_inertial).all()


def test_between_two_readings_the_estimate_stays_and_grows_old():
    omega = np.cross(B, (0.0, 0.0, 1.0)) * 1e3
    estimating = Estimating()
    for t_s in (0.0, 1.0):
        estimate = estimating(t_s, steady_field(omega, t_s))
    for t_s in (1.25, 1.5, 1.75):
        found = estimating(t_s, steady_field(omega, 1.0), read_s=1.0)
        assert (found.t_s, found.omega_body_rad_s) == (1.0, estimate.omega_body_rad_s)
    later = estimating(2.0, steady_field(0.5 * omega, 2.0), read_s=2.0)
    assert later.t_s == 2.0 and later.omega_body_rad_s != estimate.omega_body_rad_s


def test_late_reading_belongs_to_the_time_it_was_taken():
    omega = np.cross(B, (0.0, 0.0, 1.0)) * 1e3
    estimating = Estimating()
    estimating(1.5, steady_field(omega, 0.0), read_s=0.0)
    found = estimating(2.75, steady_field(omega, 2.0), read_s=2.0)
    assert found.t_s == 2.0
    assert found.omega_body_rad_s == pytest.approx(omega, rel=1e-9)


def test_readings_are_apart_by_the_interval_or_more():
    estimating, times = Estimating(interval_s=0.3), []
    for n in range(13):
        times.append(estimating(0.1 * n, B).t_s)
    assert times == pytest.approx([-math.inf] * 3 + [0.3] * 3 + [0.6] * 3 + [0.9] * 3 + [1.2])


@pytest.mark.parametrize("wrong", [ZERO, (math.nan,) * 3, (math.inf, 0.0, 0.0)])
def test_rate_is_unknown_where_field_is_zero_or_non_finite(wrong):
    estimating = Estimating()
    for t_s, b, known in ((0, B, False), (1, B, True), (2, wrong, False), (3, B, False), (4, B, 1)):
        found = estimating(t_s, b).omega_body_rad_s
        assert np.isfinite(found).all() == bool(known) and np.isnan(found).all() != bool(known)


DETUMBLING = {
    "control": {
        "law": {"kind": "bdot_rate", "gain_a_m2_s_per_t": 1e6},
        "estimator": {"kind": "rate_from_field"},
    },
    "spacecraft.magnetometer": {"noise_nt": 20.0},
    "simulation": {"revolutions": 1.0, "step_s": 1.0, "record_s": 10.0},
}


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
def test_a_satellite_detumbles_by_it_without_a_gyro(make):
    result = simulate(make(DETUMBLING))
    rate = np.degrees(np.linalg.norm(result["omega_body"], axis=1))
    assert rate[0] > 1.3 and rate[-30:].max() < 0.2
    with_a_gyro = simulate(make(DETUMBLING | {"spacecraft.gyro": {"noise_deg_s": 5.0}}))
    for name in ("omega_body", "command_body", "omega_estimated"):
        assert np.array_equal(result[name], with_a_gyro[name], equal_nan=True), name


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
def test_the_result_tells_what_was_estimated_of_the_rate(make):
    """The part across the field, a little late and with the field's own turn along the orbit."""
    result = simulate(make(DETUMBLING | {"spacecraft.magnetometer": {}}))
    b = result["b_body"].values
    along = b / np.linalg.norm(b, axis=1)[:, None]
    omega = result["omega_body"].values
    across = omega - along * np.sum(along * omega, axis=1)[:, None]
    found, field_turns = result["omega_estimated"].values, 2.5 * 2.0 * math.pi / 5700.0
    assert np.isnan(found[0]).all() and result["estimate_time"].values[0] == -math.inf
    assert np.abs(found[1:] - across[1:]).max() < field_turns
    # at the end of a run the computer is not asked any more
    assert np.array_equal(result["estimate_time"].values[1:-1], result["time"].values[1:-1])
    assert np.isnan(result["q_estimated"]).all()
