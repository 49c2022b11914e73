"""Reports of runs with reaction wheels, or without coils: what is derived, drawn and said."""

import json
from dataclasses import replace

import matplotlib.image
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from scipy.spatial.transform import Rotation
from slow_cases import slow_after

from torquer.analysis.attitude import find_attitude_error
from torquer.analysis.summary import summarise, summary_rows
from torquer.analysis.wheel_use import FlownWheels, zero_crossings
from torquer.computer.laws.wheel_pd import WheelPd
from torquer.report import write_report
from torquer.report.flight import panels as drawn
from torquer.report.flight.interactive import panel_figure
from torquer.report.flight.notes import notes
from torquer.report.flight.page import page
from torquer.report.flight.panels.reaction_wheels import speeds
from torquer.report.flight.png import draw_overview, draw_picture
from torquer.report.flight.setting import hardware_lines, setting
from torquer.report.flight.view import make_view
from torquer.scenario.spec import Scenario
from torquer.simulation.results.dataset import flown_scenario
from torquer.simulation.setup.simulate import simulate
from torquer.spacecraft.actuators.reaction_wheels import ReactionWheels

RPM = np.pi / 30.0


@pytest.fixture(scope="module")
def view(flown):
    return make_view(flown)


@pytest.fixture(scope="module")
def view_alone(alone):
    return make_view(alone)


def wheels(momentum, kind="orthogonal", layout=None, **keys) -> FlownWheels:
    """Wheels with these momenta (n, w) in limits of 1 N m s at 6000 rpm, one record a second."""
    layout = {"kind": kind} | (layout or {})
    spec = {"layout": layout, "momentum_limit_n_m_s": 1.0, "torque_limit_n_m": 0.1}
    momentum = np.array(momentum, dtype=float)
    return FlownWheels(
        spec=ReactionWheels.model_validate(spec | keys),
        t_s=np.arange(len(momentum), dtype=float),
        momentum=momentum,
        torque=np.zeros_like(momentum),
        speed_rpm=6000.0 * momentum,
    )


# ------------------------------------------------------------------ what is derived


def test_total_wheel_momentum_is_whole_momentum_less_that_of_body(flown, view):
    body = flown["omega_body"].values * [1.0, 1.2, 1.5]
    turn = Rotation.from_quat(flown["q_body_to_inertial"].values)
    whole = turn.inv().apply(flown["momentum_inertial"].values)
    np.testing.assert_allclose(view.wheels.total_body, whole - body, atol=1e-12)


def test_orthogonal_wheels_need_what_they_hold():
    momentum = np.random.default_rng(1).uniform(-1.0, 1.0, (50, 3))
    seen = wheels(momentum)
    np.testing.assert_allclose(seen.minimax_share, np.abs(momentum).max(axis=1))
    np.testing.assert_allclose(seen.total_body, momentum)


def test_what_turns_against_each_other_needs_nothing():
    # skew wheel (1, 1, 1)/sqrt(3) against the three others
    null = np.array([1.0, 1.0, 1.0, -np.sqrt(3.0)])
    seen = wheels([0.5 * null, 0.5 * null], "orthogonal_and_skew")
    np.testing.assert_allclose(seen.minimax_share, 0.0, atol=1e-12)
    assert seen.momentum_shares.max() == pytest.approx(0.5 * np.sqrt(3.0))


def test_share_that_is_needed_counts_working_wheels_alone():
    hold = np.tile([0.2, 0.4, -0.1, 0.3], (5, 1))
    failures = [{"wheel": 3, "time_s": 2.0}, {"wheel": 1, "time_s": 3.5}]
    seen = wheels(hold, "orthogonal_and_skew", failures=failures)
    np.testing.assert_allclose(seen.minimax_share[2:4], 0.4)
    assert np.all(seen.minimax_share[:2] < 0.4) and np.isnan(seen.minimax_share[4])


def test_zero_crossings_are_of_turning_wheels():
    noise = 1e-15 * np.random.default_rng(2).normal(size=200)
    t = np.arange(200)
    momentum = np.stack([np.sin(0.1 * t + 0.5), np.where(t < 100, 0.1, noise), noise], axis=1)
    assert zero_crossings(wheels(momentum).spin_sign) == 6  # of the sine: 20.4 rad are 6 half turns
    standing = wheels([[0.1] * 3, [0.0] * 3, [-0.1] * 3])
    assert zero_crossings(standing.spin_sign) == 3


def test_events_come_in_order_of_time():
    failures = [
        {"wheel": 1, "time_s": 5.0, "noticed_after_s": 2.0},
        {"wheel": 0, "time_s": 3.0},
        {"wheel": 2, "time_s": 5.0},
    ]
    seen = wheels(np.zeros((2, 4)), "orthogonal_and_skew", failures=failures)
    expected = [
        (3.0, "wheel 0 fails"),
        (5.0, "wheel 1 fails, wheel 2 fails"),
        (7.0, "wheel 1: failure detected"),
    ]
    assert seen.events(100.0) == expected
    assert seen.events(5.0) == expected[:2]


def test_held_attitude_is_that_of_the_scenario(flown):
    held = find_attitude_error(flown)
    # euler_deg = [10, -20, 70] for [10, -20, 30], sequence 321: 40 deg about body x
    np.testing.assert_allclose(held.error_deg[0], [40.0, 0.0, 0.0], atol=1e-9)
    assert held.frames == "orbital" and held.angle_deg[0] == pytest.approx(40.0)
    assert held.angle_deg[400] < 0.1  # 800 s, before the failure
    np.testing.assert_array_equal(held.rate_rad_s, flown["omega_orbital"].values)


def test_error_and_rate_are_of_one_motion(flown):
    """The turn vector grows at the relative rate where it is small."""
    held = find_attitude_error(flown)
    rows = slice(20, 400)
    small = np.radians(held.error_deg)
    growth = (small[2:] - small[:-2])[rows] / 4.0
    assert np.radians(held.angle_deg[rows]).max() < 0.35
    np.testing.assert_allclose(growth, held.rate_rad_s[1:-1][rows], atol=2e-4)


def test_reference_is_that_of_flown_law_not_of_scenario(flown):
    other = WheelPd(
        bandwidth_rad_s=0.1, inertia_kg_m2=[1.0, 1.2, 1.5], euler_deg=[10.0, -20.0, 50.0]
    )
    result = simulate(flown_scenario(flown), laws={"wheels": other.law()}, until_s=2.0)
    assert find_attitude_error(result).error_deg[0] == pytest.approx([20.0, 0.0, 0.0], abs=1e-9)


def with_control(result, **keys):
    """A result whose scenario has other keys of `control`."""
    data = json.loads(result.attrs["scenario"])
    data["control"] |= keys
    return result.assign_attrs(scenario=json.dumps(data))


def test_nothing_is_said_of_the_attitude_under_a_users_law(flown):
    given = {"kind": "given_in_python", "name": "wheel_pd", "parameters": {"orbital": 1.0}}
    own = with_control(flown, laws={"wheels": given})
    assert find_attitude_error(own) is None
    assert "attitude_error" not in [picture.name for picture in drawn.pictures(make_view(own))]
    assert not any("attitude" in key for key in summarise(own))


def test_coils_that_hold_an_attitude_have_an_attitude_error(detumble):
    from torquer.computer.laws.three_axis import ThreeAxis

    law = ThreeAxis(rate_gain_n_m_s_per_t2=1.0, angle_gain_n_m_per_t2=1.0, reference="inertial")
    held = find_attitude_error(with_control(detumble, law=law.model_dump()))
    turn = Rotation.from_quat(detumble["q_body_to_inertial"].values)
    assert held.frames == "inertial"
    np.testing.assert_allclose(held.error_deg, np.degrees(turn.as_rotvec()), atol=1e-9)
    assert find_attitude_error(detumble) is None


def test_two_laws_have_an_error_only_if_attitudes_agree(flown):
    laws = json.loads(flown.attrs["scenario"])["control"]["laws"]
    again = laws["wheels"] | {"bandwidth_rad_s": 0.05}
    twice = with_control(flown, laws=laws | {"slow": again})
    np.testing.assert_array_equal(
        find_attitude_error(twice).error_deg, find_attitude_error(flown).error_deg
    )
    apart = with_control(flown, laws=laws | {"slow": again | {"euler_deg": [0.0, 0.0, 0.0]}})
    assert find_attitude_error(apart) is None


# ------------------------------------------------------------------ pictures


def names(view) -> list[str]:
    return [picture.name for picture in drawn.pictures(view)]


def test_pictures_are_of_what_there_is(detumble, view, view_alone):
    always = ["rate", "momentum", "field", "dipoles", "torques", "pointing"]
    assert names(make_view(detumble)) == always
    assert names(view) == ["attitude_error", "rate", "wheels", *always[1:]]
    assert names(view_alone) == [
        "attitude_error",
        "rate",
        "wheels",
        "momentum",
        "field",
        "torques",
        "pointing",
    ]


def test_deaths_are_marked(view):
    for picture in drawn.pictures(view):
        labels = [mark.label for panel in picture.panels for mark in panel.marks if mark.label]
        wanted = ["wheel 2 fails", "wheel 2: failure detected"]
        marked = picture.name in ("attitude_error", "wheels", "momentum")
        assert labels == (wanted if marked else []), picture.name
    first = drawn.pictures(view)[0].panels[0]
    assert [mark.t_s for mark in first.marks] == [900.0, 930.0]


def test_labels_of_marks_stand_above_the_lines(view):
    panel = speeds(view, view.marks())
    top = max(np.nanmax(line.series.y) for line in panel.lines)
    assert panel.y_range[1] > 1.2 * top


@pytest.mark.parametrize(("part", "seen"), [(0.3, False), (0.7, True)])
def test_limits_are_drawn_where_they_are_near(view, part, seen):
    momentum = np.zeros((len(view.t_s), 4))
    momentum[5, 1] = -0.4 * part
    near = make_view(
        view.result.assign(
            wheel_momentum=(("time", "wheel"), momentum),
            wheel_speed=(("time", "wheel"), momentum / 0.4 * 6000.0 * RPM),
        )
    )
    panel = speeds(near)
    levels = {level.y for level in panel.levels}
    assert levels == ({0.0, 6000.0, -6000.0} if seen else {0.0})
    assert ("limit" in panel.title) is not seen


def test_lines_of_wheels_are_their_speeds(flown, view):
    panel = speeds(view)
    assert [line.label for line in panel.lines] == [f"wheel {k}" for k in range(4)]
    for k, line in enumerate(panel.lines):
        np.testing.assert_allclose(line.series.y, flown["wheel_speed"].values[:, k] / RPM)


def test_twelve_wheels_are_distinguishable(view):
    momentum = np.random.default_rng(3).normal(size=(len(view.t_s), 12))
    twelve = wheels(momentum, "regular_pyramid", {"count": 12, "gamma_deg": 50.0})
    many = replace(view)
    many.__dict__["wheels"] = replace(twelve, t_s=view.t_s)
    lines = speeds(many).lines
    assert len({(line.colour, line.style) for line in lines}) == 12
    assert [line.label for line in lines] == [str(k) for k in range(12)]


def test_acquiring_and_holding_the_attitude_have_separate_panels(view):
    windows = [panel.window for panel in drawn.pictures(view)[0].panels]
    taken_up = view.acquired_s
    assert 30.0 < taken_up < 300.0
    ends = [(0.0, taken_up), (taken_up, view.end_s)]
    assert windows == [None, None, *ends, *ends]


def test_every_panel_can_be_drawn(view, view_alone):
    import plotly.graph_objects as go

    for seen in (view, view_alone):
        for picture in drawn.pictures(seen):
            assert picture.panels and picture.caption
            for panel in picture.panels:
                assert panel.lines and panel.title and "[" in panel.y_label
                assert panel.y_range is None or panel.y_range[0] < panel.y_range[1]
                go.Figure(panel_figure(seen, panel))


def test_marks_are_on_the_page(view):
    figure = panel_figure(view, speeds(view, view.marks()))
    upright = [s for s in figure["layout"]["shapes"] if s["x0"] == s["x1"] == 15.0]
    texts = [note["text"] for note in figure["layout"]["annotations"]]
    assert len(upright) == 1 and {"wheel 2 fails", "wheel 2: failure detected"} <= set(texts)


@pytest.mark.filterwarnings("error")
def test_the_report_is_written(flown, tmp_path):
    paths = write_report(flown, tmp_path, plots=True)
    assert set(paths) == {*names(make_view(flown)), "ground_track", "overview", "report"}
    for name in ("attitude_error", "wheels", "overview"):
        image = matplotlib.image.imread(paths[name])[..., :3]
        assert 0.02 < np.mean(np.any(image < 0.95, axis=2)) < 0.9
        for edge in (image[:2], image[-2:], image[:, :2], image[:, -2:]):
            assert np.all(edge == 1.0)


def reported(result) -> str:
    """The page's text, after the overview and the first picture have been drawn."""
    seen = make_view(result)
    pictures = drawn.pictures(seen)
    for figure in (draw_overview(seen), draw_picture(seen, pictures[0])):
        FigureCanvasAgg(figure).draw()
    return page(seen, pictures)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("rows", slow_after(2, [1, 455, 2]))
def test_partial_results_are_reported(alone, rows):
    text = reported(alone.isel(time=slice(0, rows)))
    assert "Reaction wheels" in text and "Dipole of the coils" not in text


@pytest.mark.filterwarnings("error")
def test_a_satellite_without_any_actuator_is_reported(detumble):
    bare = json.loads(detumble.attrs["scenario"])
    bare["spacecraft"]["coils"], bare["control"]["law"] = None, {"kind": "off"}
    off = {"law": {"name": "off", "parameters": {}, "text": "", "runs_as": "compiled"}}
    result = detumble.assign_attrs(scenario=json.dumps(bare), laws=json.dumps(off))
    text = reported(result)
    assert "Reaction wheels" not in text and "Dipole of the coils" not in text
    assert not any("coil" in key for key in summarise(result))


# ------------------------------------------------------------------ what is said


def test_summary_of_wheels(flown):
    answer = summarise(flown)
    share = np.abs(flown["wheel_momentum"].values) / 0.4
    row, wheel = np.unravel_index(np.argmax(share), share.shape)
    assert answer["peak_wheel_momentum_share"] == pytest.approx(share.max())
    assert answer["peak_wheel_momentum_wheel"] == wheel
    assert answer["peak_wheel_momentum_at_s"] == flown["time"].values[row]
    assert answer["peak_wheel_torque_n_m"] == np.abs(flown["wheel_torque"].values).max()
    assert answer["peak_wheel_torque_share"] == pytest.approx(
        answer["peak_wheel_torque_n_m"] / 0.05
    )
    axes = np.array([[1, 1, 1], [1, 1, -1], [1, -1, -1], [1, -1, 1]]) / np.sqrt(3.0)
    last = np.linalg.norm(flown["wheel_momentum"].values[-1] @ axes)
    assert answer["final_wheels_momentum_n_m_s"] == pytest.approx(last, rel=1e-5)
    assert answer["laws"] == {
        "coils": {"name": "unloading", "runs_as": "compiled"},
        "wheels": {"name": "wheel_pd", "runs_as": "compiled"},
    }
    assert json.loads(json.dumps(answer)) == answer


def test_time_at_which_a_wheel_is_full(flown):
    momentum = 0.1 * np.sin(0.01 * flown["time"].values)[:, None] * np.ones(4)
    full = flown.assign(wheel_momentum=(("time", "wheel"), momentum.copy()))
    assert summarise(full)["wheel_momentum_limit_reached_at_s"] is None
    momentum[70:80, 3] = -0.4
    full = flown.assign(wheel_momentum=(("time", "wheel"), momentum))
    answer = summarise(full)
    assert answer["wheel_momentum_limit_reached_at_s"] == 140.0
    assert answer["peak_wheel_momentum_wheel"] == 3
    assert "wheel 3 at the momentum limit for 1.1 % of the run (20 s)" in notes(make_view(full))


def test_summary_of_the_attitude(flown):
    answer = summarise(flown)
    angle = find_attitude_error(flown).angle_deg
    assert answer["initial_attitude_error_deg"] == pytest.approx(40.0)
    assert answer["final_attitude_error_deg"] == angle[-1]
    # shorter than a revolution
    assert answer["mean_attitude_error_last_revolution_deg"] is None
    from_s = answer["attitude_error_stays_below_1_deg_from_s"]
    assert np.all(angle[flown["time"].values >= from_s] < 1.0)
    assert angle[flown["time"].values < from_s][-1] >= 1.0


def test_last_revolution_of_the_attitude(flown):
    far = flown.assign_coords(time=flown["time"] * 10.0)  # 18000 s, of 5677 s each
    answer, angle = summarise(far), find_attitude_error(far).angle_deg
    last = angle[far["time"].values >= 18000.0 - 2.0 * np.pi / make_view(far).omega0_rad_s]
    assert 280 < len(last) < 290
    assert answer["mean_attitude_error_last_revolution_deg"] == pytest.approx(last.mean())
    assert answer["peak_attitude_error_last_revolution_deg"] == last.max()


def test_rows_are_of_what_there_is(flown, alone, detumble):
    def labels(result):
        return " ".join(label for label, _ in summary_rows(summarise(result))).lower()

    assert "coil" in labels(flown) and "wheel" in labels(flown)
    assert "coil" not in labels(alone) and "attitude error" in labels(alone)
    assert "wheel" not in labels(detumble) and "attitude" not in labels(detumble)
    assert not any("coil" in key for key in summarise(alone))


def test_setting_tells_hardware_and_both_laws(view, view_alone):
    answer = dict(setting(view))
    assert answer["Wheels"] == (
        "4: four sided pyramid (alpha 54.74 deg, beta 45 deg), momentum up to 0.4 N m s at "
        "6000 rpm, torque up to 0.05 N m, friction 0.0002 N m, 0.0002 N m at top speed"
    )
    assert answer["Wheel failures"] == "wheel 2 at 900 s, detected 30 s later"
    assert answer["Torque allocation"].startswith("minimax, speeds kept above 10%")
    assert answer["Law coils"] == "unloading (gain_per_s = 0.001)"
    assert answer["Law wheels"] == (
        "wheel_pd (euler_deg = [10, -20, 30], inertia_kg_m2 = [[1, 0, 0], [0, 1.2, 0], "
        "[0, 0, 1.5]], bandwidth_rad_s = 0.1)"
    )
    assert answer["Cycle"] == "sample every 1 s, dipole and wheel torque held in between"
    bare = dict(setting(view_alone))
    assert [label for label in bare if "Law" in label] == ["Law wheels", "Law wheels runs as"]
    assert bare["Cycle"] == "sample every 1 s, wheel torque held in between"


def test_setting_without_wheels_is_as_it_was(detumble):
    labels = [label for label, _ in setting(make_view(detumble))]
    assert labels == [
        "Ended", "Start", "Orbit", "Eclipse", "Field", "Law", "Law runs as", "Cycle",
        "Integration", "Seed",
    ]  # fmt: skip


def test_hardware_with_limits_of_their_own():
    spec = ReactionWheels.model_validate(
        {
            "layout": {"kind": "axes", "axes": [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]},
            "momentum_limit_n_m_s": [1.0, 1.0, 2.0, 0.5],
            "torque_limit_n_m": 0.1,
            "allocation": "least_squares",
            "lost": [1],
        }
    )
    assert hardware_lines(spec) == [
        (
            "Wheels",
            "4: axes, momentum up to 1 / 1 / 2 / 0.5 N m s at 6000 rpm, torque up to 0.1 N m",
        ),
        ("Torque allocation", "least squares"),
        ("Wheel failures", "wheel 1 from the start"),
    ]


def test_a_law_in_plain_python_is_named_in_the_report(flown):
    laws = json.loads(flown.attrs["laws"])
    laws["wheels"]["runs_as"] = "plain Python (slow: not decorated)"
    slow = make_view(flown.assign_attrs(laws=json.dumps(laws)))
    assert any(note.startswith("the law wheel_pd runs as plain Python") for note in notes(slow))
    assert dict(setting(slow))["Law wheels runs as"] == laws["wheels"]["runs_as"]


def test_a_law_of_wheels_given_in_the_call_is_reported(flown):
    """The scenario's does nothing; `simulate` gets one: its attitude is shown."""
    data = json.loads(flown.attrs["scenario"])
    law = flown_scenario(flown).control.laws["wheels"].law()
    data["control"]["laws"]["wheels"] = {"kind": "off"}
    result = simulate(Scenario.model_validate(data), laws={"wheels": law}, until_s=20.0)
    assert find_attitude_error(result).angle_deg[0] == pytest.approx(40.0)
