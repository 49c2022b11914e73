"""What explains |B|: rows, rival causes, the verdict on passes of known fault."""

from collections import Counter
from datetime import timedelta

import numpy as np
import pytest
from slow_cases import slow_after
from telemetry_passes import can_be_told, elements, is_right, make_pass, named, place_of
from telemetry_session import START, TLE, environment, session

from torquer.environment.orbit import Sgp4
from torquer.ground.telemetry.diagnosis.causes import (
    CAUSES,
    NONE_OF_THESE,
    SLIPS,
    Known,
    Place,
)
from torquer.ground.telemetry.diagnosis.diagnose import diagnose
from torquer.ground.telemetry.diagnosis.evidence import find_floor
from torquer.ground.telemetry.diagnosis.fit import SENSOR, Tried, fit, left_out
from torquer.ground.telemetry.diagnosis.lag import undo
from torquer.ground.telemetry.diagnosis.rows import find_usable
from torquer.ground.telemetry.diagnosis.verdict import Ranked, decide
from torquer.ground.telemetry.examine import examine
from torquer.ground.telemetry.reading.read import Session

#: What is said where nothing is accused.
_SILENT = ("stated", "too short")


# rows


def test_rows_that_say_nothing_are_left_out():
    t_s = np.arange(200.0)
    m = np.random.default_rng(0).normal(size=(200, 3)) + 10.0
    m[20] = np.nan
    m[30] = 0.0
    m[50:80] = m[50]
    m[100:120, 1] = 14.0
    m[160] += 500.0
    found = find_usable(t_s, m)
    assert np.flatnonzero(found.frozen).tolist() == list(range(50, 80))
    assert np.flatnonzero(found.saturated).tolist() == list(range(100, 120))
    left = set(range(200)) - set(np.flatnonzero(found.kept))
    assert left == {20, 30, *range(50, 80), *range(100, 120), 160}


def test_held_readings_are_no_frozen_ones():
    m = np.repeat(np.random.default_rng(1).normal(size=(60, 3)) + 10.0, 5, axis=0)
    found = find_usable(np.arange(300.0), m)
    assert found.kept.sum() == 60 and not found.frozen.any()


@pytest.mark.parametrize("step", [1.0, 50.0, 400.0])
def test_the_turning_points_of_coarse_numbers_are_no_end_of_range(step):
    t_s = np.arange(0.0, 6000.0, 10.0)
    m = 3e4 * np.column_stack([np.sin(1e-3 * t_s + k) for k in range(3)])
    assert not find_usable(t_s, step * np.round(m / step)).saturated.any()


# fits


def test_a_fit_finds_the_sensor_and_is_no_better_than_its_prior_allows():
    rng = np.random.default_rng(2)
    strength = 3e4 + 1e4 * np.sin(np.linspace(0.0, 6.0, 200))
    unit = rng.normal(size=(200, 3))
    b = strength[:, None] * unit / np.linalg.norm(unit, axis=1)[:, None]
    matrix = np.array([[1.01, 0, 0], [0.004, 0.99, 0], [-0.006, 0.003, 1.005]])
    bias = np.array([1500.0, -900.0, 2200.0])
    m = np.linalg.solve(matrix, b.T).T + bias + rng.normal(0, 30, b.shape)
    tried = Tried(m[None], strength[None], np.zeros((1, 200, 1)), np.zeros((1, 1)))
    found = fit(tried, 20)
    assert found.values[0, :3] == pytest.approx(bias, abs=30.0)
    assert found.values[0, 3:9] == pytest.approx(
        [0.01, -0.01, 0.005, 0.004, -0.006, 0.003], abs=2e-3
    )
    assert found.size[0] == pytest.approx(30.0, rel=0.15) and found.used[0] < 9.0
    # a bias of four standard deviations is not bought
    far = fit(tried._replace(m=tried.m + 4.0 * SENSOR[0] * np.eye(3)[0]), 40)
    assert far.cost[0] > found.cost[0] + 7.0


def test_rows_left_out_are_those_of_fits_without_them():
    rng = np.random.default_rng(3)
    strength = np.full(40, 3e4)
    unit = rng.normal(size=(40, 3))
    m = strength[:, None] * unit / np.linalg.norm(unit, axis=1)[:, None] + rng.normal(
        0, 50, (40, 3)
    )
    tried = Tried(m[None], strength[None], np.zeros((1, 40, 1)), np.zeros((1, 1)))
    off = left_out(tried, fit(tried, 30).values)[0]
    for row in (0, 7, 23):
        rest = np.arange(40) != row
        values = fit(tried.rows(rest), 30).values
        length = np.linalg.norm(_corrected(m[row], values[0]))
        assert off[row] == pytest.approx(length - 3e4, abs=4.0)


def _corrected(m, values):
    a = np.eye(3) + np.diag(values[3:6])
    a[1, 0], a[2, 0], a[2, 1] = values[6:9]
    return a @ (m - values[:3])


def test_the_floor_is_the_noise_and_gross_rows_are_out():
    data, _ = session(5, rows=200, noise=60e-9)
    m = 1e9 * data["b_measured"].values
    m[[17, 18, 90]] += [[9000.0, 0, 0], [0, -12000.0, 0], [0, 0, 3e4]]
    found = find_floor(data["time"].values, m, 3.2e4)
    assert 50.0 < found.residual_nt < 100.0  # knots 400 s apart do not follow all of the field
    assert np.flatnonzero(~found.kept).tolist() == [17, 18, 90]


# lag


@pytest.mark.parametrize("kind", ["filters", "averages"])
def test_a_lag_is_undone_to_second_order(kind):
    t_s, lag_s = np.arange(0.0, 2000.0, 1.0), 10.0
    rate = 5e-3
    field = np.column_stack([np.sin(rate * t_s + k) for k in range(3)])
    if kind == "filters":  # of a sine: amplitude and delay in closed form
        gain, delay = 1.0 / np.hypot(1.0, rate * lag_s), np.arctan(rate * lag_s) / rate
    else:
        gain, delay = np.sinc(rate * lag_s / np.pi), lag_s
    m = gain * np.column_stack([np.sin(rate * (t_s - delay) + k) for k in range(3)])
    undone, calmer = undo(t_s, m, lag_s, kind)
    inside = slice(100, -100)
    assert np.abs(undone - field)[inside].max() < 0.06 * np.abs(m - field)[inside].max()
    assert calmer <= 0.0


# the verdict


def _ranked(cause, nats, residual=50.0, fits=True, value=0.0):
    return Ranked(cause, value, nats, residual, fits)


@pytest.mark.parametrize(
    ("others", "stated_fits", "none", "verdict"),
    [
        ((), True, -50.0, "stated"),
        ((_ranked("zone", 11.0),), True, -50.0, "stated"),
        ((_ranked("zone", 11.0),), False, -50.0, "too short"),
        ((_ranked("zone", 30.0),), False, -50.0, "zone"),
        ((_ranked("zone", 30.0, fits=False),), False, -50.0, "nothing fits"),
        ((_ranked("zone", 30.0), _ranked("satellite", 25.0)), False, -50.0, "too short"),
        ((_ranked("zone", 30.0), _ranked("satellite", 23.0)), False, -50.0, "zone"),
        ((_ranked("zone", 30.0),), False, 25.0, "too short"),
        ((_ranked("clock", 30.0),), False, 25.0, "clock"),
        ((_ranked("clock", 30.0), _ranked("zone", 25.0)), False, -50.0, "too short"),
    ],
)
def test_a_cause_is_named_if_it_beats_chance_rivals_and_the_floor(
    others, stated_fits, none, verdict
):
    stated = _ranked("stated", 0.0, 60.0 if stated_fits else 900.0, stated_fits)
    ranking = tuple(sorted((stated, *others), key=lambda each: -each.nats))
    assert decide(ranking, none, 100)[0] == verdict


def test_of_few_rows_it_is_not_said_that_nothing_fits():
    ranking = (_ranked("stated", 0.0, 900.0, False),)
    assert [decide(ranking, -50.0, rows)[0] for rows in (19, 20)] == ["too short", "nothing fits"]


@pytest.mark.parametrize(
    ("value", "rivals"), [(-40.0, {"clock", "track", "lag"}), (40.0, {"clock", "track"})]
)
def test_a_late_field_has_three_names_and_an_early_one_two(value, rivals):
    causes = [_ranked("clock", 50.0, value=value), _ranked("track", 49.0, value=value)]
    causes += [_ranked("lag", -20.0), _ranked("stated", 0.0, 900.0, False)]
    assert set(decide(tuple(causes), -50.0, 100)[1]) == rivals


def test_the_priors_of_causes_are_a_distribution():
    assert sum(cause.prior for cause in CAUSES.values()) + NONE_OF_THESE == pytest.approx(1.0)


@pytest.mark.parametrize("hours", slow_after(1, [-3, 1, 5]))
def test_a_wrong_zone_is_named_with_its_hours(hours):
    data, _ = session(2, rows=200)
    place = Place(environment(START + timedelta(hours=hours)))
    t_s, b = data["time"].values, data["b_measured"].values
    found = diagnose(t_s, b, place)
    assert found.verdict == "zone" and found.named.value == hours
    assert found.named.residual_nt < 70.0
    # stamps that state their offset have no wrong zone
    stated = diagnose(t_s, b, place, Known(zone_is_stated=True))
    assert "zone" not in {each.cause for each in stated.ranking} and stated.verdict != "stated"


@pytest.mark.parametrize("factor", [1e-3, 1e3, 1e-5, 10.0])
def test_a_wrong_unit_is_named(factor):
    data, _ = session(3)
    found = diagnose(data["time"].values, factor * data["b_measured"].values, Place(environment()))
    assert found.verdict == "units" and found.named.value == factor
    assert CAUSES["units"].say(factor) == SLIPS[factor]


def test_a_clock_is_named_with_its_shift():
    data, _ = session(3, rows=300)
    place = Place(environment(START + timedelta(seconds=62)))  # the session is 2 s early itself
    found = diagnose(data["time"].values, data["b_measured"].values, place)
    assert found.verdict in ("clock", "track") and {"clock", "track"} <= set(found.rivals)
    assert found.of("clock").value == pytest.approx(-60.0, abs=3.0)


@pytest.mark.parametrize("days", slow_after(2, [10, 120, 45]))
def test_old_elements_accuse_no_zone(days):
    """Right stamps, elements older by days: node and phase are far off, the second look finds
    both."""
    data, _ = session(4, rows=220)
    lines = elements(START - timedelta(days=days), 51.6521, 324.5583, 0.00116, 6.48, 88.09, 15.2246)
    place = place_of(lines, START)
    found = diagnose(
        data["time"].values, data["b_measured"].values, place, Known(False, float(days))
    )
    assert found.verdict == "nothing fits"
    assert found.plane.fits and found.plane.residual_nt < 100.0


@pytest.mark.parametrize("seed", [0, 2])
def test_an_axis_that_stands_still_accuses_no_elements(seed):
    """A free field leaves microteslas there: what comes near it is no fit."""
    data, _ = session(seed, rows=400, cadence_s=30.0)
    b = data["b_measured"].values
    b[150:, 2] = b[150, 2]
    found = diagnose(data["time"].values, b, Place(environment()))
    assert found.verdict == "nothing fits" and found.plane.residual_nt > 3000.0
    assert not found.plane.fits


def test_an_average_over_the_rows_is_told_from_a_late_clock():
    """The case of a mean over 60 s: its noise is averaged, too."""
    data, _ = session(6, rows=7000, cadence_s=1.0, noise=200e-9, rate_deg_s=0.2)
    m = data["b_measured"].values
    mean = np.column_stack([np.convolve(axis, np.full(60, 1.0 / 60.0), "valid") for axis in m.T])
    t_s = data["time"].values[59:]
    lagged = diagnose(t_s, mean, Place(environment()))
    assert lagged.verdict == "lag" and lagged.rivals == ("lag",)
    late = diagnose(t_s, m[:-59], Place(environment(START - timedelta(seconds=2))))
    assert late.verdict in ("clock", "track") and "clock" in late.rivals


def test_findings_say_what_is_not_excluded():
    data, _ = session(6)
    good = examine(Session(data.isel(time=slice(0, 12)), ()), Sgp4(tle=TLE))
    text = next(each.text for each in good.findings if each.key == "not excluded")
    assert text.startswith("too short or too still to exclude: ")
    assert not good.mistakes


@pytest.mark.parametrize("seed", range(6))
def test_two_minutes_are_calibrated_with_what_they_determine(seed):
    """With scales of -70 % the readings, and their noise, are made small: no better fit."""
    data, b = session(seed, rows=120, cadence_s=1.0)
    found = examine(Session(data, ()), Sgp4(tle=TLE))
    assert not found.mistakes
    assert found.calibration.rms > 35e-9
    assert np.abs(found.calibration.matrix - np.eye(3)).max() < 0.1
    off = np.linalg.norm(found.calibration.apply(data) - b, axis=1).max()
    assert off < 5e-6 or "too short or too still to determine all of it" in found.verdict


def test_another_satellite_is_named_where_the_first_minutes_are_left_out():
    """Its place is that at the rows which are left."""
    data, _ = session(3, rows=260)
    # the same orbit, elsewhere on it
    stated = elements(START, 51.65, 320.0, 0.0012, 6.0, 200.0, 15.2246)
    known = Known(others={"right": Sgp4(tle=TLE)})
    for minutes in (0.0, 10.0):
        found = examine(Session(data, ()), Sgp4(tle=stated), None, 60.0 * minutes, known=known)
        assert found.diagnosis.verdict == "satellite", found.verdict
        assert "elements of another satellite, right" in found.verdict


def test_frozen_rows_are_reported_and_get_no_weight():
    data, _ = session(6, rows=200)
    data["b_measured"].values[60:100] = data["b_measured"].values[60]
    found = examine(Session(data, ()), Sgp4(tle=TLE))
    assert {"frozen": 40}.items() <= {each.key: each.rows for each in found.findings}.items()
    assert not found.mistakes and found.calibration.outliers == 0.0
    assert (found.calibrated["Flags_F"].values[60:100] == 255).all()


@pytest.mark.parametrize("seed", range(2000, 2012))
def test_right_passes_of_any_length_are_not_accused(seed):
    minutes = [2, 5, 10, 20, 30, 60, 120, 300][seed % 8]
    assert named(make_pass(seed, "stated", minutes))[0] in _SILENT


@pytest.mark.slow
def test_four_hundred_passes():
    """Never accused, long passes named, short ones named, ranked or too short."""
    false = wrong = 0
    long, short = Counter(), Counter()
    for seed in range(8000, 8400):
        each = make_pass(seed)
        verdict, rivals = named(each)
        right = is_right(each, verdict, rivals)
        if each.fault == "stated":
            false += verdict not in _SILENT
            continue
        wrong += verdict not in (*_SILENT, "nothing fits") and not right
        if can_be_told(each):
            (long if each.span_s > 5400.0 else short)[right] += 1
    assert false <= 1 and wrong <= 8  # of 400: 1 % of right ones, 2 % of all
    assert long[True] > 0.9 * long.total()
    assert short[True] > 0.5 * short.total()
