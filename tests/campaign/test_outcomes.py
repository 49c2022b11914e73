"""Outcomes of many members: what the summary of each run says, and what geometry says."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

import torquer
from torquer.analysis.attitude import find_attitude_error
from torquer.campaign.outcomes import (
    DEFAULT,
    Outcome,
    Threshold,
    What,
    check_outcomes,
    evaluate_success,
    needs_field,
    needs_sun,
)
from torquer.campaign.reduction import Reduction
from torquer.campaign.signals import Axis, Flown
from torquer.environment.orbit import kepler

LAW = {"kind": "three_axis", "rate_gain_n_m_s_per_t2": 2e5, "angle_gain_n_m_per_t2": 50.0}
HELD = {
    "control.law": LAW,
    "spacecraft.coils": {"limit_a_m2": 100.0, "power_at_limit_w": 5.0},
    "simulation": {"revolutions": 4, "step_s": 5.0, "record_s": 30.0},
    "control.sample_s": 5.0,
    "environment.table_tolerance": 1e-7,
}
RATES = ([0.3, -0.2, 0.25], [0.02, 0.03, -0.01])


NO_RECORDS = np.zeros(0, int)


def evaluate(outcomes, scenario, flown, totals=None):
    count = flown.omega_body.shape[1]
    found = Reduction(outcomes, scenario, count, NO_RECORDS)
    found.add(slice(0, count), 0, flown)
    return found.outcomes(totals or {})


def taken(what, t_s, signal, cuts=()):
    """A number of a signal (r, n), taken in parts that end before the records `cuts`."""
    found = what.begin(signal.shape[1])
    for rows in np.split(np.arange(len(t_s)), sorted(cuts)):
        what.add(found, slice(None), t_s[rows], signal[rows])
    return what.number(found)


def outcome(signal, **what):
    return Outcome(signal=signal, what=what or None)


@pytest.fixture(scope="module")
def runs(make):
    """Two runs of one scenario that differ by their motion at the start."""
    return [torquer.simulate(make(HELD | {"initial.rate_deg_s": rate})) for rate in RATES]


def flown_of(results) -> Flown:
    """What an engine of campaigns keeps of runs on one orbit."""
    first = results[0]

    def together(name):
        return np.stack([result[name].values for result in results], axis=1)

    return Flown(
        first["time"].values,
        together("q_body_to_inertial"),
        together("omega_body"),
        *(first[f"{name}_inertial"].values for name in ("position", "velocity", "b", "sun")),
    )


def totals_of(results):
    names = {"coil_energy_j": "coil_energy", "peak_dipole_a_m2": "peak_coil_dipole"}
    return {
        name: np.array([float(result[key]) for result in results]) for name, key in names.items()
    }


def missing_as_nan(values):
    return [np.nan if value is None else value for value in values]


def test_outcomes_are_the_numbers_of_each_runs_summary(make, runs):
    summaries = [torquer.summarise(result) for result in runs]
    rate3 = 3.0 * summaries[0]["orbital_rate_deg_s"]
    end_s = summaries[0]["simulated_s"]
    last_s = end_s - make(HELD).orbit.period_s
    outcomes = {
        "final_rate_deg_s": outcome("rate_deg_s", at_end=True),
        "time_to_below_3x_orbital_rate_s": outcome("rate_deg_s", first_below=rate3),
        "stays_below_3x_orbital_rate_from_s": outcome("rate_deg_s", settles_below=rate3),
        "final_attitude_error_deg": outcome("attitude_error_deg", at_end=True),
        "attitude_error_stays_below_1_deg_from_s": outcome("attitude_error_deg", settles_below=1.0),
        "mean_attitude_error_last_revolution_deg": outcome(
            "attitude_error_deg", mean_after_s=last_s
        ),
        "peak_attitude_error_last_revolution_deg": outcome(
            "attitude_error_deg", greatest_after_s=last_s
        ),
        "coil_energy_j": outcome("coil_energy_j"),
        "peak_coil_dipole_a_m2": outcome("peak_dipole_a_m2", at_end=True),
    }
    found = evaluate(outcomes, make(HELD), flown_of(runs), totals_of(runs))
    for name, values in found.items():
        known = missing_as_nan(summary[name] for summary in summaries)
        np.testing.assert_allclose(values, known, rtol=1e-9, atol=1e-6, err_msg=name)
    settled = found["stays_below_3x_orbital_rate_from_s"]
    assert settled[1] == 0.0 and settled[0] > 0.0, "one starts settled, one settles or never does"


def test_signals_over_time_are_those_of_the_results(make, runs):
    flown, scenario = flown_of(runs), make(HELD)
    for k, result in enumerate(runs):
        relative = np.degrees(np.linalg.norm(result["omega_orbital"].values, axis=1))
        angle = find_attitude_error(result).angle_deg
        for t in (0.0, 3000.0, 9000.0):
            late = flown.t_s >= t
            asked = {
                "rate": outcome("rate_orbital_deg_s", mean_after_s=t),
                "angle": outcome("attitude_error_deg", greatest_after_s=t),
            }
            found = evaluate(asked, scenario, flown)
            assert found["rate"][k] == pytest.approx(relative[late].mean(), rel=1e-9)
            assert found["angle"][k] == pytest.approx(angle[late].max(), rel=1e-9)


def directions(result):
    r, v = result["position_inertial"].values, result["velocity_inertial"].values
    return {
        "sun": result["sun_inertial"].values,
        "nadir": -r,
        "orbit_normal": np.cross(r, v),
        "field": result["b_inertial"].values,
        (3.0, 0.0, 4.0): np.tile([0.6, 0.0, 0.8], (len(r), 1)),
    }


def test_angles_to_directions_are_those_of_the_turned_axis(make, runs):
    flown, axis = flown_of(runs), np.array([0.0, 0.6, -0.8])
    for to, aims in directions(runs[0]).items():
        asked = {"x": outcome({"axis": 5.0 * axis, "to": to}, mean_after_s=0.0)}
        (means,) = evaluate(asked, make(HELD), flown).values()
        for k, result in enumerate(runs):
            turned = Rotation.from_quat(result["q_body_to_inertial"].values).apply(axis)
            cosines = np.sum(turned * aims, axis=1) / np.linalg.norm(aims, axis=1)
            assert means[k] == pytest.approx(np.degrees(np.arccos(cosines)).mean(), abs=1e-6)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 12), st.integers(1, 5))
def test_signals_do_not_depend_on_the_inertial_frame(seed, records, members):
    """All vectors turned together: angles and rates stay."""
    rng = np.random.default_rng(seed)
    t_s = 10.0 * np.arange(records)
    r, v = kepler.states(t_s, 7.2e6, 0.1, (30.0, 63.0, 50.0), 0.4)
    q = Rotation.random(records * members, random_state=rng).as_quat().reshape(records, members, 4)
    omega, b, sun = rng.normal(size=(records, members, 3)), *rng.normal(size=(2, records, 3))
    flown = Flown(t_s, q, omega, r, v, b, sun)
    turn = Rotation.random(random_state=rng)
    turned = (turn * Rotation.from_quat(q.reshape(-1, 4))).as_quat().reshape(q.shape)
    vectors = {f"{name}_inertial": turn.apply(getattr(flown, f"{name}_inertial"))
               for name in ("position", "velocity", "b", "sun")}  # fmt: skip
    other = flown._replace(q_body_to_inertial=turned, **vectors)
    targets = ("sun", "nadir", "orbit_normal", "field")
    asked = {to: outcome({"axis": [1, 2, 2], "to": to}, greatest_after_s=0) for to in targets}
    asked["rate"] = outcome("rate_orbital_deg_s", at_end=True)
    for name, values in evaluate(asked, None, flown).items():
        np.testing.assert_allclose(evaluate(asked, None, other)[name], values, atol=1e-6)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 9))
def test_outcomes_are_bit_identical_for_any_chunk_size(seed, members):
    rng, records = np.random.default_rng(seed), 300
    t_s = 10.0 * np.arange(records)
    r, v = kepler.states(t_s, 7.2e6, 0.1, (30.0, 63.0, 50.0), 0.4)
    q = rng.normal(size=(records, members, 4))
    q /= np.linalg.norm(q, axis=2, keepdims=True)
    omega, b = rng.normal(size=(records, members, 3)), rng.normal(size=(records, 3))
    flown = Flown(t_s, q, omega, r, v, b, b)
    one = [np.ascontiguousarray(part[:, 1:2]) for part in (q, omega)]
    alone = Flown(t_s, *one, r, v, b, b)
    asked = {to: outcome({"axis": [1, 2, 2], "to": to}, mean_after_s=50) for to in ("sun", "nadir")}
    asked["rate"] = outcome("rate_orbital_deg_s", mean_after_s=0.0)
    found = evaluate(asked, None, flown)
    for name, values in evaluate(asked, None, alone).items():
        assert values[0] == found[name][1], name


SERIES = st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=12)


@settings(max_examples=100, deadline=None)
@given(SERIES, st.floats(-5.0, 5.0), st.integers(0, 130))
def test_signal_measures_are_what_their_names_say(series, level, after_s):
    t_s, signal = 10.0 * np.arange(len(series)), np.array(series)[:, None]
    below = [value < level for value in series]
    settled = [t for k, t in enumerate(t_s) if all(below[k:])]
    late = [value for t, value in zip(t_s, series, strict=True) if t >= after_s]
    expected = {
        "at_end": (True, series[-1]),
        "first_below": (level, next((t for t, b in zip(t_s, below, strict=True) if b), np.nan)),
        "settles_below": (level, min(settled, default=np.nan)),
        "part_below": (level, sum(below) / len(below)),
        "greatest_after_s": (after_s, max(late, default=np.nan)),
        "mean_after_s": (after_s, np.mean(late) if late else np.nan),
    }
    for key, (argument, answer) in expected.items():
        (found,) = taken(What(**{key: argument}), t_s, signal)
        assert found == pytest.approx(answer, nan_ok=True), key


WAYS = {
    "at_end": True,
    "first_below": 0.5,
    "settles_below": 0.5,
    "part_below": 0.5,
    "greatest_after_s": 95.0,
    "mean_after_s": 95.0,
}


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32 - 1), st.lists(st.integers(0, 40), max_size=6), st.floats(0.0, 1.0))
def test_a_number_has_the_same_bits_in_whatever_parts_it_is_taken(seed, cuts, share):
    """Also where nothing is known at some records, and where parts are empty or end early."""
    rng = np.random.default_rng(seed)
    t_s, signal = 10.0 * np.arange(40), rng.random((40, 5)) * share
    signal[rng.random(signal.shape) < 0.02] = np.nan
    for key, argument in WAYS.items():
        what = What(**{key: argument})
        whole, parts = taken(what, t_s, signal), taken(what, t_s, signal, cuts)
        assert np.array_equal(whole, parts, equal_nan=True), key
        alone = taken(what, t_s, signal[:, 2:3], cuts)
        assert np.array_equal(alone, whole[2:3], equal_nan=True), key


def test_a_time_after_the_last_record_has_no_number():
    signal = np.ones((3, 2))
    for key in ("greatest_after_s", "mean_after_s"):
        found = taken(What(**{key: 25.0}), np.array([0.0, 10.0, 20.0]), signal, [1])
        assert np.isnan(found).all()


def test_an_unknown_angle_is_below_nothing():
    """No field, no direction: the angle to it is not a number."""
    t_s, signal = np.array([0.0, 10.0, 20.0]), np.array([[1.0], [1.0], [np.nan]])
    assert np.isnan(taken(What(settles_below=5.0), t_s, signal)[0])
    assert taken(What(part_below=5.0), t_s, signal)[0] == pytest.approx(2.0 / 3.0)
    assert np.isnan(taken(What(greatest_after_s=0.0), t_s, signal)[0])


def test_member_succeeds_if_all_conditions_hold_and_nothing_is_missing():
    found = {"a": np.array([1.0, 3.0, np.nan, 1.0]), "b": np.array([9.0, 9.0, 9.0, 7.0])}
    success = {"a": Threshold(below=2.0), "b": Threshold(above=8.0)}
    assert evaluate_success(success, found).tolist() == [True, False, False, False]
    assert evaluate_success({}, found) is None


def test_the_default_outcomes_are_rate_settling_and_energy(runs, make):
    found = evaluate(DEFAULT, make(HELD), flown_of(runs), totals_of(runs))
    assert [*found] == ["final_rate_deg_s", "rate_stays_below_1_deg_s_from_s", "coil_energy_j"]
    assert all(np.isfinite(values).all() for values in found.values())


def test_only_angles_to_the_sun_need_its_direction(runs, make):
    to_sun = {"x": outcome({"axis": [0, 0, 1], "to": "sun"}, at_end=True)}
    assert needs_sun(to_sun, make(HELD)) and not needs_sun(DEFAULT, make(HELD))
    dark = flown_of(runs)._replace(sun_inertial=None)
    evaluate(DEFAULT, make(HELD), dark, totals_of(runs))
    with pytest.raises(ValueError, match="sun_inertial: must be given for the angle to the Sun"):
        evaluate(to_sun, make(HELD), dark)


def test_only_angles_to_the_field_need_it(runs, make):
    to_field = {"x": outcome({"axis": [0, 0, 1], "to": "field"}, at_end=True)}
    assert needs_field(to_field) and not needs_field(DEFAULT)
    without = flown_of(runs)._replace(b_inertial=None)
    evaluate(DEFAULT, make(HELD), without, totals_of(runs))
    with pytest.raises(ValueError, match="b_inertial: must be given for the angle to the field"):
        evaluate(to_field, make(HELD), without)


def test_what_a_scenario_cannot_have_is_reported(make):
    error = {"pointing": outcome("attitude_error_deg", at_end=True)}
    check_outcomes(error, make(HELD))
    none = r"^campaign.outcomes.pointing.signal: .* hold none \(off\)$"
    with pytest.raises(ValueError, match=none):
        check_outcomes(error, make())
    late = {"late": outcome("rate_deg_s", mean_after_s=601.0)}
    with pytest.raises(ValueError, match=r"^campaign.outcomes.late.what: .* ends at 600 s"):
        check_outcomes(late, make())


@pytest.mark.parametrize(
    ("data", "line"),
    [
        ({"signal": "rate_deg_s"}, "what: must be given for a signal; received none"),
        ({"signal": "coil_energy_j", "what": {"first_below": 1}},
         "what: must be left out, or at_end = true, of coil_energy_j"),
        ({"signal": "rate_deg_s", "what": {}}, "must have one of settles_below, .*; received none"),
        ({"signal": "rate_deg_s", "what": {"at_end": True, "part_below": 1.0}},
         "received at_end and part_below"),
        ({"signal": {"axis": [0, 0, 0], "to": "sun"}, "what": {"at_end": True}},
         "axis: must be non-zero vectors"),
    ],
)  # fmt: skip
def test_mistakes_in_outcomes_are_reported(data, line):
    with pytest.raises(ValueError, match=line):
        Outcome(**data)


def test_an_axis_is_kept_as_a_unit_vector():
    assert Axis(axis=[0, 0, 5], to=[0, 3, 4]) == Axis(axis=[0, 0, 1], to=[0, 0.6, 0.8])
