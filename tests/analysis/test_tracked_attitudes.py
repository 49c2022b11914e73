"""The attitude error of a law with slews: from the targets, and from what it commands meanwhile."""

import warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import torquer
from torquer.analysis.attitude import find_attitude_error
from torquer.analysis.goals import find_goals
from torquer.analysis.pointing.setting import held_scenario, make_setting
from torquer.analysis.summary import summarise, summary_rows
from torquer.campaign.fly import OneByOne, fly_campaign
from torquer.campaign.spec import Campaign
from torquer.report.flight.panels.attitude import angle, attitude_error
from torquer.report.flight.view import make_view
from torquer.scenario.held import held_attitudes
from torquer.scenario.load import scenario_from_data
from torquer.simulation.setup.usable import check_usable

#: A place that the satellite passes after 1100 s.
UNDER_DEG = (68.0, 45.5)
INERTIA = [0.126, 0.167, 0.061]
LOOKS = {
    "kind": "wheel_tracking", "bandwidth_rad_s": 0.18, "greatest_rate_deg_s": 1.0,
    "greatest_acceleration_deg_s2": 0.1, "inertia_kg_m2": INERTIA,
}  # fmt: skip
SUN = LOOKS | {
    "axis": [1, 0, 0], "target": "sun", "second_axis": [0, 1, 0], "second_target": "orbit_normal",
}  # fmt: skip
PLACE = LOOKS | {
    "axis": [0, 0, -1], "target": "ground", "second_axis": [0, 1, 0],
    "second_target": "orbit_normal", "latitude_deg": UNDER_DEG[0], "longitude_deg": UNDER_DEG[1],
    "least_elevation_deg": 20.0,
}  # fmt: skip
TURNS = {
    "sun": {"laws": ["sun"], "transitions": [{"to": "place", "at_most_s": 600}]},
    "place": {"laws": ["place"], "transitions": [{"to": "sun", "at_most_s": 900}]},
}


def scenario(states=TURNS, laws=None, mission=None, **more):
    """A satellite at rest in the orbital frame that looks at the Sun and at a place in turn."""
    control = {"sample_s": 0.5, "laws": laws or {"sun": SUN, "place": PLACE}}
    data = {
        "start": "2024-03-20T06:00:00Z",
        "orbit": {
            "kind": "circular", "altitude_km": 550, "inclination_deg": 97.6, "raan_deg": 337.5,
        },
        "environment": {"field": {"kind": "averaged"}, "gravity_gradient": True},
        "spacecraft": {
            "body": {"inertia_kg_m2": INERTIA},
            "wheels": {
                "layout": {"kind": "four_sided_pyramid", "alpha_deg": 54.7356, "beta_deg": 45.0},
                "momentum_limit_n_m_s": 0.012, "torque_limit_n_m": 0.002,
            },
        },
        "initial": {
            "reference": "orbital", "rate_relative_to": "orbital", "rate_deg_s": [0, 0, 0]
        },
        "control": control | ({"modes": states if "regions" in states else {"states": states}}
                              if states else {}),
        "simulation": {"duration_s": 1500, "record_s": 2.0},
    }  # fmt: skip
    return scenario_from_data(data | ({"mission": mission} if mission else {}) | more)


@pytest.fixture(scope="module")
def flown():
    return torquer.simulate(scenario())


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def place_inertial(given, t_s):
    """The place on the ground [m], inertial, by the formula of the ellipsoid WGS84."""
    a, f = 6378137.0, 1.0 / 298.257223563
    lat, lon = np.radians(UNDER_DEG)
    n = a / np.sqrt(1.0 - f * (2.0 - f) * np.sin(lat) ** 2)
    ecef = n * np.array([
        np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), (1.0 - f) ** 2 * np.sin(lat)
    ])  # fmt: skip
    return np.einsum("nji,j->ni", given.orbit_environment().dcm_to_ecef(t_s), ecef)


def wanted_by_hand(result, law):
    """Attitudes from directions alone: columns of what is to be seen along the body's axes."""
    given = scenario()
    r, v = result["position_inertial"].values, result["velocity_inertial"].values
    normal, t_s = unit(np.cross(r, v)), result["time"].values.astype(float)
    if law == "sun":
        x = unit(result["sun_inertial"].values)
        y = unit(normal - np.sum(normal * x, axis=1, keepdims=True) * x)
        return Rotation.from_matrix(np.stack([x, y, np.cross(x, y)], axis=2))
    at = place_inertial(given, t_s)
    ray = at - r
    lat, lon = np.radians(UNDER_DEG)
    ellipsoid = np.array([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])
    vertical = np.einsum("nji,j->ni", given.orbit_environment().dcm_to_ecef(t_s), ellipsoid)
    seen = -np.sum(ray * vertical, axis=1) > np.sin(np.radians(20.0)) * np.linalg.norm(ray, axis=1)
    z = -unit(np.where(seen[:, None], ray, -r))
    y = unit(normal - np.sum(normal * z, axis=1, keepdims=True) * z)
    return Rotation.from_matrix(np.stack([np.cross(y, z), y, z], axis=2))


def angle_deg(one, other):
    return np.degrees((one.inv() * other).magnitude())


# ------------------------------------------------------------------ the two errors


def test_the_error_is_the_rotation_from_what_the_targets_give(flown):
    """Recomputed from the result's quaternions and directions to the targets alone."""
    body = Rotation.from_quat(flown["q_body_to_inertial"].values)
    of_place = flown["mode_main"].values == 1
    assert 0.5 < of_place.mean() < 0.65
    known = np.where(
        of_place,
        angle_deg(wanted_by_hand(flown, "place"), body),
        angle_deg(wanted_by_hand(flown, "sun"), body),
    )
    found = find_attitude_error(flown)
    # the pole of the start is used on board: 4 m a day on the ground, 0.07 m in 1500 s, at 550 km
    np.testing.assert_allclose(found.angle_deg, known, atol=8e-6)
    assert found.angle_deg[of_place].min() < 0.001  # so it is seen, and the bound means something


def test_during_a_slew_it_differs_from_the_error_to_what_is_commanded(flown):
    error, t = find_attitude_error(flown), flown["time"].values
    of_place = flown["mode_main"].values == 1
    steered = np.where(
        of_place[:, None], flown["place.q_commanded"].values, flown["sun.q_commanded"].values
    )
    known = angle_deg(Rotation.from_quat(steered), Rotation.from_quat(flown.q_body_to_inertial))
    np.testing.assert_allclose(error.commanded_deg[:-1], known[:-1], atol=1e-9)
    # no control step follows the last record: half a second old, it would count 0.03 deg of motion
    assert error.commanded_deg[-1] == error.commanded_deg[-2] < 0.01 < known[-1]
    left = np.where(of_place, flown["place.slew_left_rad"], flown["sun.slew_left_rad"])
    # a slew begins at the start, with the state, when the place rises and when it sets
    begun = t[1:][(left[1:] > 0.0) & (left[:-1] == 0.0)]
    assert left[0] > 1.0 and begun.tolist() == [600.0, 938.0, 1266.0]
    assert error.angle_deg[left > 0.5].min() > 25.0 and error.commanded_deg.max() < 0.3
    still = (left == 0.0) & (t > 300.0)
    np.testing.assert_allclose(error.angle_deg[still], error.commanded_deg[still], atol=1e-6)
    assert still.mean() > 0.3


def test_the_rate_is_relative_to_the_moving_reference(flown):
    """The derivative of the rotation from the reference to the body, within a quarter of the bend.

    Within two seconds the acceleration may jump once; where it does not, it is a twelfth.
    """
    error, t = find_attitude_error(flown), flown["time"].values
    vectors = Rotation.from_rotvec(error.error_deg, degrees=True)
    turned = (vectors[:-1].inv() * vectors[1:]).as_rotvec() / np.diff(t)[:, None]
    middle = 0.5 * (error.rate_rad_s[1:] + error.rate_rad_s[:-1])
    same = np.diff(error.which) == 0
    rise = np.linalg.norm(np.diff(error.error_deg, axis=0), axis=1) > 5.0
    bend = np.linalg.norm(np.diff(error.rate_rad_s, 2, axis=0), axis=1)
    bend = np.maximum(np.append(bend, 0.0), np.append(0.0, bend))
    off = np.linalg.norm(turned - middle, axis=1)
    good = same & ~rise
    assert good.sum() > 700 and np.abs(error.rate_rad_s).max() > 0.01
    assert (off - 0.25 * bend)[good].max() < 1e-6
    assert np.median(off[good]) < 1e-6  # most of the flight is no slew


# ------------------------------------------------------------------ what is made of it


def test_summary_and_derived_quantities_tell_both(flown):
    error, found = find_attitude_error(flown), summarise(flown)
    assert found["initial_attitude_error_deg"] == error.angle_deg[0] > 30.0
    assert found["final_attitude_error_deg"] == error.angle_deg[-1]
    assert found["final_commanded_error_deg"] == error.commanded_deg[-1] < 0.3
    assert "Error from the commanded attitude at the end" in dict(summary_rows(found))
    derived = torquer.derive(flown)
    np.testing.assert_array_equal(derived["attitude_error"].values, error.angle_deg)
    np.testing.assert_array_equal(derived["commanded_error"].values, error.commanded_deg)


def test_the_picture_draws_both(flown):
    view = make_view(flown)
    assert [line.label for line in angle(view).lines] == [
        "from the target", "from the commanded attitude",
    ]  # fmt: skip
    assert attitude_error(view).caption.startswith(
        "The reference is the attitude that the targets of the present mode's law give, one of 2. "
        "During a slew the attitude commanded is on its way there"
    )


def test_a_mission_judges_each_by_its_own_limit(flown):
    limits = {"attitude_error_below_deg": 0.5, "commanded_error_below_deg": 0.5}
    judged = torquer.simulate(scenario(mission=limits), until_s=590.0)
    of_target, of_command = summarise(judged)["verdict"]["goals"]
    error, t = find_attitude_error(judged), judged["time"].values
    assert of_target["stays_from_s"] == t[np.flatnonzero(error.angle_deg >= 0.5)[-1] + 1] > 100.0
    assert of_command["signal"] == "error from the commanded attitude"
    assert of_command["stays_from_s"] == 0.0


def test_the_usual_limit_is_of_what_is_commanded_where_a_law_slews_again_and_again():
    """To a place that comes into sight, or in another state; a law that arrives once is there."""

    def signals(*given):
        return [goal.signal for goal in find_goals(scenario(*given))]

    assert signals() == signals(None, {"place": PLACE}) == ["error from the commanded attitude"]
    assert signals(None, {"sun": SUN}) == ["attitude error"]
    hold = {"kind": "wheel_pd", "bandwidth_rad_s": 0.1, "inertia_kg_m2": INERTIA}
    states = TURNS | {"sun": {"laws": ["hold"], "transitions": TURNS["sun"]["transitions"]}}
    assert signals(states, {"hold": hold, "place": PLACE}) == ["attitude error"]


def test_an_error_from_what_no_law_commands_cannot_be_judged():
    hold = {"kind": "wheel_pd", "bandwidth_rad_s": 0.1, "inertia_kg_m2": INERTIA}
    given = scenario(None, {"hold": hold}, {"commanded_error_below_deg": 0.5})
    line = (
        r"^mission.commanded_error_below_deg: .* by slews.* received 0.5 with laws without slews$"
    )
    with pytest.raises(ValueError, match=line):
        check_usable(given)


@pytest.mark.parametrize("states", [None, TURNS], ids=["alone", "modes"])
def test_a_campaign_has_the_error_of_each_run(states):
    given = scenario(states, None if states else {"sun": SUN})
    what = {"mean_deg": {"mean_after_s": 300.0}, "worst_deg": {"greatest_after_s": 300.0}}
    outcomes = {name: {"signal": "attitude_error_deg", "what": w} for name, w in what.items()}
    starts = {"initial.euler_deg": {"values": [[0, 0, 0], [30, 0, 20]]}}
    campaign = Campaign.model_validate({"runs": 2, "vary": starts, "outcomes": outcomes})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OneByOne)
        found = fly_campaign(given, campaign)
    for member, euler_deg in enumerate(starts["initial.euler_deg"]["values"]):
        result = torquer.simulate(given.replace("initial.euler_deg", euler_deg))
        late = find_attitude_error(result).angle_deg[result["time"].values >= 300.0]
        known = [late.mean(), late.max()]
        # a run reads the direction to the Sun from its table, a campaign computes it
        assert [found[name].values[member] for name in what] == pytest.approx(known, abs=2e-6)


# ------------------------------------------------------------------ modes


def test_modes_wait_for_the_end_of_a_slew():
    """The signals of the modes are from the targets of a law that they name."""
    shown = {"signal": "attitude_error_deg", "below": 0.2}
    slow = {"signal": "attitude_rate_deg_s", "below": 0.02}
    modes = {
        "attitude_of": "sun",
        "regions": {
            "laws": {"states": {"sun": {"laws": ["sun"]}}},
            "camera": {"states": {
                "waits": {"transitions": [{"to": "on", "when": [shown, slow], "for_s": 10}]},
                "on": {"final": True},
            }},
        },
    }  # fmt: skip
    given = scenario(modes, {"sun": SUN})
    result = torquer.simulate(given, until_s=400.0)
    error, t = find_attitude_error(result), result["time"].values
    rate = np.degrees(np.linalg.norm(error.rate_rad_s, axis=1))
    quiet = (error.angle_deg < 0.2) & (rate < 0.02)
    first = t[np.flatnonzero(~quiet)[-1] + 1]
    entered = t[np.flatnonzero(result["mode_camera"].values == 1)[0]]
    assert 100.0 < first + 8.0 <= entered <= first + 14.0


def test_modes_name_a_law_that_holds_an_attitude():
    when = {"signal": "attitude_error_deg", "below": 1.0}
    states = {
        "on": {"laws": ["sun"], "transitions": [{"to": "off", "when": when}]},
        "off": {"laws": ["off"]},
    }
    modes = {"attitude_of": "off", "regions": {"main": {"states": states}}}
    laws = {"off": {"kind": "off"}, "sun": SUN}
    with pytest.raises(ValueError, match=r"^control\.modes\.attitude_of: must be one of sun"):
        check_usable(scenario(modes, laws))


def test_a_state_that_names_another_target_changes_what_is_held():
    states = {
        "sun": {"laws": ["sun"]},
        "nadir": {"laws": ["sun"], "set": {"sun.first": [1.0, 0.0, 0.0, 0.0],
                                          "sun.second": [3.0, 0.0, 0.0, 0.0]}},
    }  # fmt: skip
    held = held_attitudes(scenario(states, {"sun": SUN}).control)
    numbers = {(each.targets.first.number, each.targets.second.number) for each in held}
    assert numbers == {(2.0, 4.0), (1.0, 3.0)}


# ------------------------------------------------------------------ the pointing budget


def test_a_pointing_budget_takes_targets_at_rest_in_the_orbit():
    """Its loop is that of the law between slews: s^2 + 2 zeta kappa s + kappa^2 about each axis."""
    nadir = LOOKS | {
        "axis": [0, 0, -1], "target": "nadir", "second_axis": [1, 0, 0],
        "second_target": "velocity",
    }  # fmt: skip
    given = scenario(None, {"look": nadir}, simulation={"duration_s": 1200, "record_s": 2.0})
    setting = make_setting(held_scenario(given), 60.0)
    n = setting.hold.rate_rad_s
    gains = setting.loop.gains[0]
    # beside spring and damper there is what turns with the orbit
    around = n * 2 * 0.18 * max(INERTIA)
    np.testing.assert_allclose(gains[:, :3], -np.diag(INERTIA) * 0.18**2, rtol=1e-4, atol=around)
    # gravity's gradient and the orbit's turn, which the law takes off as it knows them
    x, y, z = INERTIA
    carried = n**2 * np.array([4.0 * (y - z), 3.0 * (x - z), y - x])
    spring = np.multiply(INERTIA, -(0.18**2)) + carried
    np.testing.assert_allclose(np.diag(gains[:, :3]), spring, rtol=2e-6)
    damper = gains[:, 3:] / n
    np.testing.assert_allclose(np.diag(damper), np.multiply(INERTIA, -2 * 0.18), rtol=1e-4)
    # the axes of the orbital frame: nadir is -z, velocity x
    up = unit(setting.hold.instants([0.0]).r_m[0])
    assert Rotation.from_quat(setting.q_wanted[0]).apply([0, 0, 1]) == pytest.approx(up, abs=1e-9)


def test_a_pointing_budget_refuses_targets_that_move():
    with pytest.raises(ValueError, match=r"^control.laws.sun.target: must be 'nadir' with"):
        held_scenario(scenario(None, {"sun": SUN}))
