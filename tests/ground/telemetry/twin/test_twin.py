"""The twin: what tip-offs say of inertia, gain and residual dipole, and what they do not."""

import numpy as np
import pytest
from twin_session import NOISE_T, believed, errors, tip_off

from torquer.compile import engine
from torquer.ground.telemetry.twin.fit import Fits, Problem, around
from torquer.ground.telemetry.twin.flights import COUNT, INERTIA, Flights, Points, twin_inertia
from torquer.ground.telemetry.twin.legs import Legs
from torquer.ground.telemetry.twin.members import Twin
from torquer.ground.telemetry.twin.readings import Readings
from torquer.ground.telemetry.twin.twin import _Search, _Step, fit_twin
from torquer.scenario.change import with_values

SLOW = pytest.mark.skipif(not engine.COMPILED, reason="hundreds of flights: slow")
#: Saturates the coils above 9 deg/s; never at 3 deg/s.
GAIN, FAST, TAME, CALM = 5e5, (10.0, 10.0, 10.0), 2e5, (2.0, -1.5, 1.2)


def relative(twin, true, name):
    return abs(twin.of(name) / true[name] - 1.0)


@pytest.mark.slow
def test_unsaturated_tip_off_gives_only_inertia_over_gain():
    scenario = believed(TAME)
    data, true = tip_off(scenario, 1, 12, CALM)
    twin = fit_twin(data, scenario, NOISE_T)
    assert twin.fits and twin.only_ratio and twin.saturated == 0.0
    assert "only J/gain is known: the coils are never saturated" in twin.verdict
    assert "gain" not in twin.names and "inertia_xx/gain" in twin.names
    off, normalised = errors(twin, true)
    assert np.max(np.abs(off[:3] / twin.values[:3])) < 0.03
    assert np.mean(normalised**2) < 3.0
    assert any("inertia_xx" in each and "inertia_zz" in each for each in twin.undetermined)


@pytest.mark.slow
def test_no_twin_fits_a_motion_that_is_none():
    """Readings of the gyro in a wrong order."""
    scenario = believed(GAIN)
    data, _ = tip_off(scenario, 3, 12, FAST)
    rng = np.random.default_rng(0)
    order = rng.permutation(data.sizes["time"])
    data["omega_measured"].values[:] = data["omega_measured"].values[order]
    twin = fit_twin(data, scenario, NOISE_T)
    assert not twin.fits and twin.names == ()
    assert "no twin fits: the best one follows" in twin.verdict


@pytest.mark.slow
def test_saturated_tip_offs():
    """An hour of each of 20 satellites, up to 25 % off: where more than one command in twenty
    saturates the coils, inertia within 0.5 % and gain within 5 %."""
    scenario, squares = believed(GAIN), []
    for seed in range(20):
        data, true = tip_off(scenario, seed, 60, FAST)
        twin = fit_twin(data, scenario, NOISE_T)
        assert twin.fits and twin.window_s == twin.session_s and not twin.only_ratio, seed
        assert not twin.doubt, seed
        squares.append(np.mean(errors(twin, true)[1] ** 2))
        assert relative(twin, true, "gain") < 0.05
        if twin.saturated > 0.05:
            moments = [relative(twin, true, f"inertia_{each}") for each in ("xx", "yy", "zz")]
            assert max(moments) < 0.005
    assert 0.7 < np.mean(squares) < 1.3 and max(squares) < 4.0


@pytest.mark.slow
def test_tip_offs_that_never_saturate():
    """An hour of each of 10 satellites: only J/gain, with errors as stated."""
    scenario, squares = believed(TAME), []
    for seed in range(10):
        data, true = tip_off(scenario, seed, 60, CALM)
        twin = fit_twin(data, scenario, NOISE_T)
        assert twin.fits and twin.only_ratio, seed
        squares.append(errors(twin, true)[1] ** 2)
    assert 0.5 < np.mean(np.concatenate(squares)) < 1.5


def test_inertia_of_a_twin():
    scenario = believed(GAIN)
    own = np.array(scenario.spacecraft.body.inertia_kg_m2)
    assert np.allclose(twin_inertia(scenario, np.zeros(COUNT)), own, rtol=1e-14)
    change = np.append([0.1, 0.1, 0.1], np.zeros(7))
    assert np.allclose(twin_inertia(scenario, change), np.exp(0.1) * own, rtol=1e-12)


def test_each_twin_is_followed_by_steps_forth_and_back():
    points = Points(np.array([[0.0, 0, 0, 1]]), np.zeros((1, 3)), np.zeros((1, COUNT)))
    moved = around(points, np.array([0, 3, 6]))
    assert len(moved.q) == 7
    assert np.allclose(moved.q[1:3, 0], [0.5e-6, -0.5e-6])
    assert np.allclose(moved.omega[3:5, 0], [1e-7, -1e-7])
    assert np.allclose(moved.physical[5:, 0], [1e-6, -1e-6])


@SLOW
def test_a_step_by_the_slopes_is_that_of_the_flights():
    """Rates and fields of a twin a little off, by the derivatives of the whitened readings."""
    scenario = believed(GAIN)
    flights = Flights(scenario, 0.0, 120.0, 0.4)
    points = Points(
        np.array([[0.1, 0.2, 0.3, np.sqrt(0.86)]]), np.radians([[9.0, 11, 8]]), np.zeros((1, COUNT))
    )
    t_s = np.array([10.0, 50.0, 110.0])
    b_j = np.tile([2e-5, -1e-5, 3e-5], (3, 1))
    blank = Readings(t_s, np.zeros((3, 3)), np.zeros((3, 3)), b_j, NOISE_T, 1e-4, 0.0, 0.0)
    exact = blank.predicted(flights.fly(points, t_s))[0].reshape(3, 6)
    readings = blank._replace(b=exact[:, :3] * NOISE_T, omega=exact[:, 3:] * 1e-4)
    free = np.full(6 + COUNT, True)
    prior = np.append(np.full(6, np.inf), np.full(COUNT, 1e3))
    problem = Problem(flights, readings, prior, free, readings.noise())
    steps = 3e-7 * np.ones((1, 6 + COUNT))
    far = points.moved(steps)
    information, pull = problem._slopes(far)
    _, chi2 = problem._costs(far)
    # back to the start by the slopes: the pull is the information times the step
    assert np.allclose(pull[0], -information[0] @ steps[0], rtol=0.02, atol=1e-3 * abs(pull).max())
    assert chi2[0] == pytest.approx(steps[0] @ information[0] @ steps[0], rel=0.02)


def test_a_verdict_says_where_errors_cannot_be_relied_on():
    names, values = tuple(f"inertia_{each}" for each in INERTIA), np.ones(6)
    twin = Twin(names, values, 1e-4 * np.eye(6), False, 0.3, 700.0, 698, 60.0, 60.0, (), "", None,
                believed(GAIN))  # fmt: skip
    share = "30 % of the commands saturate the coils"
    assert twin.verdict == f"twin: inertia to 1 %, its gain is not known: {share}"
    doubted = twin._replace(doubt="noise")
    assert doubted.verdict == f"{twin.verdict}; do not rely on these errors: noise"


@SLOW
def test_legs_share_numbers_meet_and_skip_gaps():
    """A flight in legs is the one flight; a stretch without rows is part of the leg before it."""
    scenario, start_s = believed(GAIN), 27.0
    t_s = np.append(np.arange(5.0, 650.0, 30.0), np.arange(1235.0, 1600.0, 30.0))
    rows = np.zeros((len(t_s), 3))
    b_j = np.tile([2e-5, -1e-5, 3e-5], (len(t_s), 1))
    readings = Readings(t_s, rows, rows, b_j, NOISE_T, 1e-4, 0.0, 0.0)
    free = np.full(6 + COUNT, True)
    prior = np.append(np.full(6, np.inf), np.full(COUNT, 0.3))
    legs = Legs(scenario, start_s, 0.4, readings, prior, free)
    assert np.allclose(np.diff(legs.firsts) % 9.0, 0.0) and legs.firsts[3] > 1100.0
    assert all(len(leg.readings.t_s) for leg in legs.legs)
    physical = np.array([[0.1, -0.05, 0.02, 0.0, 0.01, 0.0, 0.05, 0.01, 0.0, -0.02]])
    points = Points(
        np.array([[0.1, 0.2, 0.3, np.sqrt(0.86)]]), np.radians([[9, 11, 8.0]]), physical
    )
    whole = Flights(scenario, start_s, 1600.0, 0.4)
    course = legs.along(whole, points)
    assert legs._off_at_ends(whole, points, course) < 0.01
    once, apart = whole.fly(points, t_s), legs.predicted(course)
    assert np.allclose(once.q, apart.q, atol=1e-5) and np.allclose(
        once.omega, apart.omega, atol=1e-7
    )


POINTS = Points(
    np.array([[0.1, 0.2, 0.3, np.sqrt(0.86)]]), np.radians([[9, 11, 8.0]]), np.zeros((1, COUNT))
)
ROWS_S = np.arange(5.0, 650.0, 30.0)


def own_readings(flights, t_s, noise_t):
    """What sensors without noise read on a flight."""
    rows, b_j = np.zeros((len(t_s), 3)), np.tile([2e-5, -1e-5, 3e-5], (len(t_s), 1))
    blank = Readings(t_s, rows, rows, b_j, noise_t, 1e-4, 0.0, 0.0)
    exact = blank.predicted(flights.fly(POINTS, t_s))[0].reshape(len(t_s), 6)
    return blank._replace(b=exact[:, :3] * noise_t, omega=exact[:, 3:] * 1e-4)


def fitted_to_itself(scenario, t_s, noise_t):
    """Legs fitted to their own flight without noise, begun at it."""
    flights = Flights(scenario, 0.0, float(t_s[-1]), 0.4)
    readings = own_readings(flights, t_s, noise_t)
    free = np.full(6 + COUNT, True)
    prior = np.append(np.full(6, np.inf), np.full(COUNT, 0.3))
    legs = Legs(scenario, 0.0, 0.4, readings, prior, free)
    return legs.fit(flights, POINTS)


@SLOW
@pytest.mark.parametrize("noise_nt", [50.0, 2e4])
def test_errors_are_doubted_where_noise_bends_the_legs(noise_nt):
    scenario = with_values(believed(GAIN), {"spacecraft.magnetometer.noise_nt": noise_nt})
    fit = fitted_to_itself(scenario, ROWS_S, 1e-9 * noise_nt)
    assert bool(fit.doubt) == ("noise in the loop turns it by" in fit.doubt) == (noise_nt > 1e3)
    assert np.isfinite(fit.covariance).all() and fit.chi2 < 1e-3


@SLOW
def test_errors_are_doubted_where_the_law_remembers_earlier_cycles():
    """B-dot of one reading a cycle takes the difference from the last one, which a leg forgets."""
    law = {"kind": "bdot", "gain_a_m2_s_per_t": GAIN}
    scenario = with_values(believed(GAIN), {"control": {"sample_s": 3.0, "law": law}})
    fit = fitted_to_itself(scenario, ROWS_S, NOISE_T)
    assert fit.doubt == "its law remembers earlier cycles, without which legs begin"


@SLOW
@pytest.mark.parametrize("scale", [1.0, 1.005])
def test_errors_are_doubted_if_the_twin_cannot_explain_the_readings(scale):
    """A gyro that reads half a percent too much, which is no parameter of the twin."""
    scenario, t_s = believed(GAIN), ROWS_S[:10]
    window_s = float(t_s[-1])
    flights = Flights(scenario, 0.0, window_s, 0.4)
    exact = own_readings(flights, t_s, NOISE_T)
    noise = np.random.default_rng(1).normal(size=(2, *exact.b.shape))
    readings = exact._replace(
        b=exact.b + NOISE_T * noise[0], omega=scale * exact.omega + 1e-4 * noise[1]
    )
    search = _Search(scenario, 0.0, readings)
    problem = Problem(flights, readings, search.prior, search.free, readings.noise())
    twin = search._found(_Step(Fits(POINTS, np.zeros(1)), problem, window_s))
    assert twin.freedoms == 60 - 16
    assert (f"squares of {twin.chi2:.0f} where 44 are expected" in twin.verdict) == (scale > 1.0)
    assert bool(twin.doubt) == (scale > 1.0)


def test_mistakes():
    scenario = believed(GAIN)
    data, _ = _rows()
    with pytest.raises(ValueError, match="twin: needs omega_measured in the telemetry"):
        fit_twin(data.drop_vars("omega_measured"), scenario, NOISE_T)
    early = data.assign_coords(utc=data["utc"] - np.timedelta64(1, "h"))
    with pytest.raises(ValueError, match=r"at or before the first row.*received 3570 s after it"):
        fit_twin(early, scenario, NOISE_T)
    with pytest.raises(ValueError, match="needs 8 rows with the field of the scenario's orbit"):
        fit_twin(data, scenario, NOISE_T)


def _rows():
    """Twenty rows without the field of any orbit."""
    from torquer.ground.telemetry.reading.quantities import make_session

    start = np.datetime64("2012-03-04T10:32:17", "ns")
    utc = start + np.arange(20) * np.timedelta64(30, "s")
    zeros = np.zeros((20, 3))
    return make_session(utc, {"b_measured": zeros, "omega_measured": zeros}), None


@SLOW
def test_scenarios_that_cannot_be_twins():
    wheels = {
        "layout": {"kind": "orthogonal"},
        "momentum_limit_n_m_s": 0.1,
        "torque_limit_n_m": 0.01,
    }
    scenario = with_values(believed(GAIN), {"spacecraft.wheels": wheels})
    with pytest.raises(ValueError, match="twin: must be a scenario whose members fly together"):
        Flights(scenario, 0.0, 60.0, 0.3)
