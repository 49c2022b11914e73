"""The tabulated environment: its proven error, its ends, its derivative, and what it refuses."""

import numpy as np
import pytest

from torquer.compile.engine import kernel
from torquer.environment import table as room
from torquer.environment.table import (
    SAFETY,
    build,
    build_exact,
    build_proven,
    lobatto,
    measured_error,
)
from torquer.scenario.spec import Scenario

#: Bugs found in `torquer.environment.table` whose repair is on its way; a repair makes these fail.
POSITION, FIELD = slice(0, 3), slice(3, 6)
TIDE = slice(6, 9)
GROUPS = (POSITION, FIELD, TIDE)
CIRCULAR = {"kind": "circular", "altitude_km": 500, "inclination_deg": 52}
LOW_POLAR = {"kind": "circular", "altitude_km": 300, "inclination_deg": 98}
ECCENTRIC = {
    "kind": "kepler",
    "perigee_altitude_km": 400,
    "apogee_altitude_km": 8000,
    "inclination_deg": 63.4,
}


@kernel
def read6(table, t, out):
    for i in range(t.size):
        out[i, 0], out[i, 1], out[i, 2] = room.lookup3(table, t[i])
        u, v = room.lookup6(table, t[i], 3)
        out[i, 3], out[i, 4], out[i, 5] = u
        out[i, 6], out[i, 7], out[i, 8] = v


@kernel
def read_from_zero(table, t, out):
    for i in range(t.size):
        u, v = room.lookup6(table, t[i], 0)
        out[i, 0], out[i, 1], out[i, 2] = u
        out[i, 3], out[i, 4], out[i, 5] = v


@kernel
def read_rate(table, t, out):
    for i in range(t.size):
        out[i, 0], out[i, 1], out[i, 2] = room.rate_from(table, t[i], 3)


def values_of(table, t):
    out = np.empty((t.size, 9))
    read6(table, t, out)
    return out


def rates_of(table, t):
    out = np.empty((t.size, 3))
    read_rate(table, t, out)
    return out


def orbit_environment(orbit, **environment):
    return Scenario.model_validate(
        {
            "start": "2026-03-01T12:00:00Z",
            "orbit": orbit,
            "environment": environment,
            "spacecraft": {"body": {"inertia_kg_m2": (1, 1.2, 1.4)}, "coils": {"limit_a_m2": 1}},
            "initial": {"rate_deg_s": (1, 2, 3)},
            "control": {"law": {"kind": "off"}},
            "simulation": {"duration_s": 100, "step_s": 1.0},
        }
    ).orbit_environment()


def relative_errors(read, exact):
    def size(values):
        return np.linalg.norm(values, axis=1)

    return [float(np.max(size((read - exact)[:, g]) / size(exact[:, g]))) for g in GROUPS]


def smooth(t):
    """Three turning vectors, one of them with a beat."""
    w = 1e-3
    return np.stack(
        [
            7e6 * np.cos(w * t),
            7e6 * np.sin(w * t),
            1e6 * np.cos(2 * w * t),
            3e-5 * np.cos(3 * w * t),
            3e-5 * np.sin(3 * w * t),
            1e-5 + 1e-5 * np.sin(7 * w * t),
            2e-3 * np.cos(2 * w * t),
            2e-3 * np.sin(2 * w * t),
            np.full(np.shape(t), 1e-4),
        ],
        axis=1,
    )


def smooth_rate(t):
    w = 1e-3
    return np.stack(
        [
            -9e-5 * w * np.sin(3 * w * t),
            9e-5 * w * np.cos(3 * w * t),
            7e-5 * w * np.cos(7 * w * t),
        ],
        axis=1,
    )


@pytest.mark.parametrize("tolerance", [1e-6, 1e-9, 1e-11])
@pytest.mark.parametrize("orbit", [CIRCULAR, LOW_POLAR, ECCENTRIC], ids=lambda o: o["kind"])
def test_the_proven_error_holds_at_thousands_of_random_times(orbit, tolerance):
    environment = orbit_environment(orbit, table_tolerance=tolerance)
    duration = 3.0 * environment.orbit.period_s
    proven = environment.orbit_table(duration, 1.0)
    assert proven.relative_error <= tolerance
    t = np.random.default_rng(5).uniform(0.0, duration, 4000)
    # rounding of a segment's time enters with the rates: 2e-13 is far below any promise here
    errors = relative_errors(values_of(proven.table, t), environment.sample(t))
    assert max(errors) <= proven.relative_error + 2e-13


@pytest.mark.parametrize("segment_s", [40.0, 90.0, 200.0])
def test_the_error_is_checked_where_it_peaks(segment_s):
    table = build(smooth, 6000.0, segment_s, room.DEGREE)
    t = np.linspace(0.0, 6000.0, 20_001)
    real = max(relative_errors(values_of(table, t), smooth(t)))
    assert real <= SAFETY * measured_error(table, smooth, GROUPS) + 1e-15


def test_order_of_the_interpolation_is_that_of_its_degree():
    t = np.random.default_rng(1).uniform(0.0, 6000.0, 5000)
    lengths = np.array([150.0, 200.0, 300.0, 400.0])
    errors = [
        max(relative_errors(values_of(build(smooth, 6000.0, h, room.DEGREE), t), smooth(t)))
        for h in lengths
    ]
    order = np.polyfit(np.log(lengths), np.log(errors), 1)[0]
    assert order == pytest.approx(room.DEGREE + 1, abs=0.3)


def test_a_function_that_is_not_smooth_is_refused():
    def jumping(t):
        return smooth(t) * np.where(t < 1234.5, 1.0, 1.01)[:, None]

    message = (
        r"^environment table: must reach a relative error of 1.0e-09; "
        r"received \d\.\de-\d\d with segments of 0.0146 s$"
    )
    with pytest.raises(ValueError, match=message):
        build_proven(jumping, 2000.0, 60.0, 1e-9, GROUPS)


@pytest.mark.parametrize("column", [0, 3, 5])
def test_values_that_are_not_numbers_are_refused(column):
    def broken(t):
        values = smooth(t)
        values[t > 1000.0, column] = np.nan
        return values

    with pytest.raises(ValueError, match="environment table: must reach a relative error"):
        build_proven(broken, 2000.0, 500.0, 1e-6, GROUPS)


def test_segments_are_halved_until_the_promise_holds():
    proven = build_proven(smooth, 6000.0, 2000.0, 1e-9, GROUPS)
    halvings = np.log2(2000.0 / proven.table.segment_s)
    assert halvings == pytest.approx(round(halvings)) and halvings >= 2
    assert proven.relative_error <= 1e-9
    coarser = build(smooth, 6000.0, 2.0 * proven.table.segment_s, room.DEGREE)
    assert SAFETY * measured_error(coarser, smooth, GROUPS) > 1e-9
    assert proven.evaluations >= 6000.0 / proven.table.segment_s * room.DEGREE


@pytest.mark.parametrize("step_s", [0.1, 1.0, 7.0])
def test_the_exact_table_is_exact_at_the_instants_of_rk4(step_s):
    environment = orbit_environment(CIRCULAR, table_tolerance=0.0)
    steps = 400
    proven = environment.orbit_table(steps * step_s, step_s)
    assert proven.relative_error == 0.0
    i = np.arange(steps)
    t = np.concatenate([i * step_s, (i + 0.5) * step_s, (i + 1) * step_s])
    assert max(relative_errors(values_of(proven.table, t), environment.sample(t))) < 2e-15 * steps


def test_exact_instants_stay_exact_in_a_long_table():
    proven = build_exact(smooth, 6000.0, 0.3)
    t = 0.3 * np.random.default_rng(2).integers(0, 20_000, 2000)
    assert max(relative_errors(values_of(proven.table, t), smooth(t))) < 1e-13


def test_a_table_covers_its_span_whatever_its_length():
    for duration in (1.0, 99.0, 100.0, 100.0 + 1e-7, 250.0):
        table = build(smooth, duration, 100.0, room.DEGREE)
        assert table.coefficients.shape[0] == max(1, int(np.ceil(duration / 100.0 - 1e-9)))
        end = np.array([duration])
        assert max(relative_errors(values_of(table, end), smooth(end))) < 1e-6


def test_beyond_the_ends_the_last_polynomials_go_on():
    table = build(smooth, 1000.0, 100.0, room.DEGREE)
    t = np.array([-20.0, -1e-9, 1000.0, 1000.0 + 1e-9, 1020.0])
    assert max(relative_errors(values_of(table, t), smooth(t))) < 1e-5
    assert max(relative_errors(values_of(table, t[1:4]), smooth(t[1:4]))) < 1e-9
    far = values_of(table, np.array([-1e5, 1e5]))
    assert np.all(np.isfinite(far))


def test_neighbours_share_their_points():
    table = build(smooth, 1000.0, 100.0, room.DEGREE)
    knots = 100.0 * np.arange(1, 10)
    jump = values_of(table, knots * (1.0 + 1e-15)) - values_of(table, knots * (1.0 - 1e-15))
    assert np.max(np.abs(jump) / np.max(np.abs(smooth(knots)), axis=0)) < 1e-13


def test_both_readers_agree():
    table = build(smooth, 1000.0, 100.0, room.DEGREE)
    t = np.linspace(0.0, 1000.0, 77)
    out = np.empty((t.size, 6))
    read_from_zero(table, t, out)
    assert np.array_equal(out, values_of(table, t)[:, :6])


def test_the_derivative_is_that_of_the_function():
    table = build(smooth, 6000.0, 30.0, room.DEGREE)
    t = np.random.default_rng(3).uniform(0.0, 6000.0, 3000)
    expected = smooth_rate(t)
    assert rates_of(table, t) == pytest.approx(expected, abs=1e-7 * np.abs(expected).max())


def test_the_derivative_of_the_real_field_is_its_finite_difference():
    environment = orbit_environment(LOW_POLAR)
    table = environment.orbit_table(6000.0, 1.0).table
    t = np.random.default_rng(4).uniform(10.0, 5990.0, 1000)
    h = 1.0
    b = [environment.sample(t + k * h)[:, FIELD] for k in (-2, -1, 1, 2)]
    expected = (8.0 * (b[2] - b[1]) - (b[3] - b[0])) / (12.0 * h)
    size = np.linalg.norm(expected, axis=1).max()
    assert np.linalg.norm(rates_of(table, t) - expected, axis=1).max() < 1e-6 * size


def test_lobatto_points_reach_both_ends():
    for degree in (2, 5, 7):
        points = lobatto(degree)
        assert points[0] == -1.0 and points[-1] == 1.0 and points.size == degree + 1
        assert points == pytest.approx(-points[::-1], abs=1e-15)
