"""Models on board that are worse than the truth: the size of the errors, and who sees them."""

import re

import numpy as np
import pytest
from filter_cases import DISTURBANCE, GYRO, SCENARIO

import torquer
from torquer.analysis.attitude import find_attitude_error
from torquer.base.conventions import EARTH_RADIUS_M
from torquer.campaign.fleet import Fleet
from torquer.campaign.load import campaign_from_data
from torquer.campaign.sampling import member_scenario
from torquer.compile import engine
from torquer.report.flight.setting import setting
from torquer.report.flight.view import make_view
from torquer.scenario.load import scenario_from_data
from torquer.simulation.results.dataset import flown_scenario
from torquer.simulation.setup.run import prepare

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

ALTITUDE_M = 550e3
SPEED_M_S = np.sqrt(3.986004418e14 / (EARTH_RADIUS_M + ALTITUDE_M))


def scenario(**ephemeris):
    """A satellite that is not controlled, in a circular orbit."""
    control = {"law": {"kind": "off"}, "ephemeris": ephemeris}
    return scenario_from_data({**SCENARIO, "control": control})


def flown(control, **ephemeris):
    """A run with a computer that does something."""
    simulation = {"duration_s": 600.0, "step_s": 1.0, "record_s": 10.0}
    control = {**control, "ephemeris": ephemeris}
    data = {**SCENARIO, "control": control, "disturbance": DISTURBANCE, "simulation": simulation}
    return torquer.simulate(scenario_from_data(data))


@torquer.law(
    needs=("ephemeris",),
    memory={"r": (0, 0, 0), "b": (0, 0, 0), "b_rate": (0, 0, 0), "sun": (0, 0, 0)},
    log={"r": "m", "b": "T", "b_rate": "T/s", "sun": "1"},
)
def noting(inputs, parameters, memory):
    """Logs the ephemeris."""
    e = inputs.ephemeris
    for k in range(3):
        memory.r[k], memory.b[k] = e.r_inertial_m[k], e.b_inertial_t[k]
        memory.b_rate[k], memory.sun[k] = e.b_rate_inertial_t_s[k], e.sun_inertial[k]
    return (0.0, 0.0, 0.0)


def known(**ephemeris):
    """(Result at its control steps, environment) of a computer with these errors."""
    with_errors = scenario(**ephemeris)
    result = torquer.simulate(with_errors, noting).isel(time=slice(0, -1))
    return result, with_errors.orbit_environment()


def same(result, other, but=()) -> bool:
    """Whether all numbers of two results over time are the same to the bit."""
    names = [name for name in result.data_vars if name not in but]
    return all(np.array_equal(result[n], other[n], equal_nan=True) for n in names)


EARLIER = {"kind": "igrf14", "held_at_year": 2015.0}
TIMES_S = np.linspace(0.0, 1000.0, 11)


def test_models_that_are_the_truth_share_its_tables():
    for same_models in ({}, {"field": {"kind": "igrf14"}}, {"orbit": SCENARIO["orbit"]}):
        tables = prepare(scenario(**same_models), noting).piece.tables
        assert tables.believed_orbit is tables.orbit and tables.believed_sun is tables.sun
    other = prepare(scenario(clock_error_s=1.0), noting).piece.tables
    assert other.believed_orbit is not other.orbit


def test_the_ephemeris_is_that_of_the_models_on_board():
    """What the loop reads from its tables, and what the result says of it."""
    errors = {"along_track_error_m": 4e3, "cross_track_error_m": -1e3, "radial_error_m": 500.0,
              "clock_error_s": -2.0, "clock_drift_ppm": 50.0, "field": EARLIER}  # fmt: skip
    result, _ = known(**errors)
    for name, believed in (("law.r", "position_believed"), ("law.b", "b_believed")):
        size = np.linalg.norm(result[believed].values, axis=1).min()
        assert np.abs(result[name].values - result[believed].values).max() < 1e-8 * size
    assert np.linalg.norm(result.b_believed.values - result.b_inertial.values, axis=1).min() > 1e-7


def test_displacements_are_in_the_axes_of_the_orbit():
    result, _ = known(along_track_error_m=3e3, cross_track_error_m=-700.0, radial_error_m=200.0)
    r, v = result.position_inertial.values, result.velocity_inertial.values
    off = result["law.r"].values - r
    up, normal = r, np.cross(r, v)
    radius = EARTH_RADIUS_M + ALTITUDE_M
    sagitta = radius * (1.0 - np.cos(3e3 / radius))
    for axis, size in ((np.cross(normal, up), 3e3), (normal, -700.0), (up, 200.0 - sagitta)):
        along = np.sum(off * axis, axis=1) / np.linalg.norm(axis, axis=1)
        assert along == pytest.approx(np.full(len(along), size), rel=1e-4, abs=0.1)


def test_an_along_track_error_is_the_gradient_of_the_field():
    """10 km: the change of the field along the track, by differences of 1 km about the middle."""
    result, environment = known(along_track_error_m=1e4)
    t_s, r, v = (result[n].values for n in ("time", "position_inertial", "velocity_inertial"))
    radius = EARTH_RADIUS_M + ALTITUDE_M
    ends = []
    for ahead_m in (4.5e3, 5.5e3):
        angle, along = ahead_m / radius, v / SPEED_M_S
        turned = r * np.cos(angle) + radius * np.sin(angle) * along
        ends.append(environment.field(t_s, turned, v))
    expected = 10.0 * (ends[1] - ends[0])
    found = result["law.b"].values - result.b_inertial.values
    size = np.linalg.norm(expected, axis=1)
    assert size.min() > 5e-8 and size.max() < 2e-7
    assert np.linalg.norm(found - expected, axis=1).max() < 1e-3 * size.max()


def test_clock_error_is_an_along_track_error_plus_earth_rotation():
    fast, environment = known(clock_error_s=1.0)
    t_s = fast.time.values
    r, v = environment.state(t_s + 1.0)
    assert fast["law.r"].values == pytest.approx(r, abs=0.02)
    truth = environment.field(t_s + 1.0, r, v)
    assert np.linalg.norm(fast["law.b"].values - truth, axis=1).max() < 1e-13
    ahead, _ = known(along_track_error_m=SPEED_M_S * 1.0)
    difference = fast["law.b"].values - ahead["law.b"].values
    # the Earth turns under the satellite: the field turns with it, and the place lies further west
    turn_rad, axis = 7.2921159e-5, np.array([0.0, 0.0, 1.0])
    west = environment.field(t_s, r - turn_rad * np.cross(axis, r), v)
    here = environment.field(t_s, r, v)
    expected = west - here + turn_rad * np.cross(axis, here)
    assert np.abs(expected).max() > 1e-10
    assert np.linalg.norm(difference - expected, axis=1).max() < 1e-3 * np.abs(expected).max()


def test_a_drifting_clock_gains_with_time():
    result, environment = known(clock_drift_ppm=500.0, clock_error_s=0.5)
    r, _ = environment.state(0.5 + 1.0005 * result.time.values)
    assert result["law.r"].values == pytest.approx(r, abs=0.02)


def test_coefficients_of_an_earlier_year_are_the_secular_variation():
    result, _ = known(field=EARLIER)
    t_s, r, v = (result[n].values for n in ("time", "position_inertial", "velocity_inertial"))
    at_both = [
        scenario_from_data({**SCENARIO, "environment": {"earth_rotation": "sidereal",
                            "field": {"kind": "igrf14", "held_at_year": year}}})
        .orbit_environment().field(t_s, r, v)
        for year in (2026.1, 2015.0)
    ]  # fmt: skip
    changed = result["law.b"].values - result.b_inertial.values
    expected = at_both[1] - at_both[0]
    assert np.linalg.norm(expected, axis=1).max() > 2e-7
    away = np.linalg.norm(changed - expected, axis=1).max()
    year_off = 0.1  # the start is at 2026.17
    assert away < year_off * np.linalg.norm(expected, axis=1).max() / 11.1


def test_on_board_field_rate_belongs_to_the_on_board_field():
    result, _ = known(field={"kind": "igrf14", "degree": 1}, along_track_error_m=5e4)
    b, rate, t_s = (result[n].values for n in ("law.b", "law.b_rate", "time"))
    differences = (b[2:] - b[:-2]) / (t_s[2:] - t_s[:-2])[:, None]
    away = np.linalg.norm(differences - rate[1:-1], axis=1)
    assert away.max() < 1e-3 * np.linalg.norm(rate, axis=1).max()


ERRORS = {"along_track_error_m": 3e4, "clock_error_s": 5.0, "field": EARLIER}
BDOT = {"law": {"kind": "bdot_rate", "gain_a_m2_s_per_t": 3e6}}
HOLD = {"law": {"kind": "three_axis", "angle_gain_n_m_per_t2": 100.0,
                "rate_gain_n_m_s_per_t2": 1e5, "reference": "orbital"}}  # fmt: skip


def test_reading_laws_keep_their_bits_and_pointing_laws_do_not():
    believed = ("position_believed", "b_believed")
    assert same(flown(BDOT, **ERRORS), flown(BDOT), but=believed)
    assert not same(flown(HOLD, **ERRORS), flown(HOLD), but=believed)


def test_pointing_law_points_to_the_nadir_of_on_board_place():
    """100 km ahead on the orbit the vertical has turned by 100 km over the radius."""
    craft = SCENARIO["spacecraft"] | {
        "wheels": {"layout": {"kind": "orthogonal"}, "momentum_limit_n_m_s": 1.0,
                   "torque_limit_n_m": 0.05},
        "magnetometer": {}, "gyro": {},
    }  # fmt: skip
    law = {"kind": "wheel_pd", "bandwidth_rad_s": 0.05, "reference": "orbital",
           "inertia_kg_m2": craft["body"]["inertia_kg_m2"]}  # fmt: skip
    data = {
        **SCENARIO,
        "spacecraft": craft,
        "environment": {"earth_rotation": "sidereal", "gravity_gradient": False},
        "initial": {"reference": "orbital", "rate_relative_to": "orbital", "rate_deg_s": [0, 0, 0]},
        "control": {"law": law, "ephemeris": {"along_track_error_m": 1e5}, "sample_s": 0.5},
        "simulation": {"duration_s": 600.0, "record_s": 10.0},
    }
    result = torquer.simulate(scenario_from_data(data))
    error_deg = find_attitude_error(result).angle_deg[-10:]
    turned_deg = np.degrees(1e5 / (EARTH_RADIUS_M + ALTITUDE_M))
    assert error_deg == pytest.approx(np.full(10, turned_deg), rel=0.01)


def test_a_stopped_run_goes_on_with_the_same_models(tmp_path):
    control = {"law": {"kind": "off"}, "estimator": GYRO, "ephemeris": ERRORS}
    whole = torquer.simulate(scenario_from_data({**SCENARIO, "control": control}))
    part = torquer.simulate(flown_scenario(whole), until_s=333.0)
    torquer.save(part, tmp_path / "part.nc")
    went_on = torquer.resume(torquer.load(tmp_path / "part.nc"))
    assert same(whole, went_on)
    truthful = torquer.simulate(flown_scenario(whole).replace("control.ephemeris", {}))
    assert not np.array_equal(truthful.q_estimated, whole.q_estimated)


def test_a_flight_driven_from_outside_knows_the_models_on_board():
    flight = torquer.Flight(scenario(**ERRORS))
    place = flight.read().ephemeris
    result, _ = known(**ERRORS)
    assert np.array_equal(place.r_inertial_m, result["law.r"].values[0])
    assert np.array_equal(place.b_inertial_t, result["law.b"].values[0])


def with_filter(**ephemeris):
    simulation = {"duration_s": 300.0, "step_s": 1.0, "record_s": 10.0}
    return scenario_from_data(
        {
            **SCENARIO,
            "control": {**HOLD, "estimator": GYRO, "ephemeris": ephemeris},
            "simulation": simulation,
        }
    )


RATE = {"initial.rate_deg_s": {"direction": "uniform", "magnitude": {"uniform": [0.0, 0.2]}}}
CLOCK = {"control.ephemeris.clock_error_s": {"uniform": [-5.0, 5.0]}}


@pytest.mark.filterwarnings("ignore::torquer.campaign.fly.OneByOne")
@pytest.mark.parametrize(
    ("ephemeris", "vary", "alone"),
    # members in lanes with such errors: in `tests/simulation/lanes/test_lanes.py`, too
    [pytest.param(ERRORS, RATE, "", marks=pytest.mark.slow),
     ({}, CLOCK, "control.ephemeris.clock_error_s varies"),
     ({"field": EARLIER}, CLOCK | RATE, "control.ephemeris.clock_error_s varies")],
    ids=["in lanes", "alone", "alone with a table"],
)  # fmt: skip
def test_members_of_campaigns_have_the_bits_of_their_own_runs(ephemeris, vary, alone):
    base = with_filter(**ephemeris)
    table = {"runs": 18, "vary": vary, "success": {"final_rate_deg_s": {"below": 1.0}}}
    made = campaign_from_data(table, base)
    fleet = Fleet(base, made)
    assert fleet.why_not_in_lanes.startswith(alone) and bool(fleet.why_not_in_lanes) == bool(alone)
    result = torquer.fly_campaign(base, made, workers=1)
    final = result["final_rate_deg_s"].values
    assert len(set(final)) == 18
    for member in (0, 5, 17):
        own = member_scenario(base, made, member)
        rate = np.linalg.norm(torquer.simulate(own)["omega_body"].values, axis=-1)
        assert final[member] == np.degrees(rate)[-1]


def test_tables_of_another_computer_are_refused():
    base = with_filter()
    piece = prepare(base).piece
    with pytest.raises(ValueError, match=r"piece: must have .* the models of its computer"):
        prepare(base.replace("control.ephemeris.clock_error_s", 1.0), piece=piece)
    blind = base.replace("control", {"law": {"kind": "off"}, "ephemeris": ERRORS})
    with pytest.raises(ValueError, match="piece: must have the Sun, the Moon and the air"):
        prepare(with_filter(**ERRORS), piece=prepare(blind).piece)


#: (table, beginning of the line) of mistakes.
MISTAKES = [
    ({"clock_error_s": 1e6},
     "control.ephemeris.clock_error_s: must be less than or equal to 86400"),
    ({"along_track_error_km": 2}, "control.ephemeris.along_track_error_km: must be a known key; "
     "received 2 (did you mean along_track_error_m? 1 km is 1000 m)"),
    ({"field": {"kind": "igrf14", "degree": 14}},
     "control.ephemeris.field.degree: must lie within 1..13 for igrf14; received 14"),
    ({"tle_age_days": 3}, "control.ephemeris.tle_age_days: must be left out unless orbit.kind is "
     "'numerical'; received 3 with 'circular'"),
    ({"tle_age_days": 1, "orbit": SCENARIO["orbit"]},
     "control.ephemeris.tle_age_days: must be left out with orbit, in whose place it is; "
     "received 1"),
]  # fmt: skip


@pytest.mark.parametrize(("ephemeris", "line"), MISTAKES)
def test_a_mistake_is_one_line(ephemeris, line):
    with pytest.raises(ValueError, match="^" + re.escape(line)) as mistake:
        scenario(**ephemeris)
    assert "\n" not in str(mistake.value)


def test_on_board_field_must_be_valid_at_the_clock_time():
    """The run ends within the last year of the model; by the computer's clock it does not."""
    late = scenario(field={"kind": "wmm2025"}, clock_error_s=7200.0)
    with pytest.raises(ValueError, match=r"^control.ephemeris: field model wmm2025: date must lie"):
        prepare(late.replace("start", "2029-12-31T23:00:00Z"))


def test_orbit_that_sgp4_does_not_follow_has_no_elements():
    far = {"kind": "kepler", "perigee_altitude_km": 600, "apogee_altitude_km": 400_000,
           "inclination_deg": 63.0}  # fmt: skip
    lunar = scenario().replace("orbit", {"kind": "numerical", "start": far})
    with pytest.raises(ValueError, match=r"tle_age_days: must be given with an orbit that SGP4"):
        lunar.replace("control.ephemeris.tle_age_days", 1.0).believed_environment()


def test_a_report_says_how_far_the_models_are_off():
    rows = dict(setting(make_view(flown(BDOT, radial_error_m=2e3))))
    assert rows["Models on board"].endswith("position by 2 km (rms)")
    assert "Models on board" not in dict(setting(make_view(flown(BDOT))))


def test_results_include_on_board_models_only_if_not_the_truth():
    assert "b_believed" not in flown(BDOT).data_vars
    answer = flown(BDOT, radial_error_m=1e3)
    assert (
        answer.b_believed.attrs["units"] == "T" and answer.position_believed.attrs["frame"] == "J"
    )
