"""What the report derives from a result: fresh readings, eclipses, notes, chapters, panels."""

import itertools
import json
from xml.etree import ElementTree

import numpy as np
import pytest

import torquer
from torquer.analysis.budget import coil_reach
from torquer.analysis.control_cycle import fresh_rows
from torquer.analysis.summary import summarise
from torquer.base.conventions import EARTH_RADIUS_M
from torquer.report.flight import panels as drawn
from torquer.report.flight.notes import notes
from torquer.report.flight.scene import chapters, scene_figure
from torquer.report.flight.view import make_view
from torquer.simulation.results.dataset import flown_scenario
from torquer.simulation.setup.simulate import simulate


@pytest.fixture(scope="module")
def view(detumble):
    return make_view(detumble)


@pytest.mark.parametrize(
    "control",
    [
        {"sample_s": 2.0, "measure_s": 4.0, "actuate_s": 4.0},
        {"sample_s": 3.0, "measure_s": 0.0, "actuate_s": None},
    ],
)
def test_fresh_readings_differ_from_the_truth_by_the_bias_alone(make, control):
    result = simulate(make(control=control, simulation={"duration_s": 240.0, "record_s": 0.5}))
    error_nt = 1e9 * (result["b_measured"].values - result["b_body"].values)
    error_nt -= [100.0, -200.0, 300.0]
    fresh = fresh_rows(flown_scenario(result), result["time"].values)
    # the field is tabulated to 1e-9 of some 30 000 nT
    assert np.abs(error_nt[fresh]).max() < 1e-3
    stale = np.delete(np.arange(len(error_nt) - 1), fresh)
    assert stale.size and np.abs(error_nt[stale]).max(axis=1).min() > 10.0


def test_field_picture_shows_the_bias(view):
    panel = drawn.field(view).panels[-1]
    assert panel.title.startswith("Magnetometer") and panel.y_label == "ΔB [nT]"
    means = [line.series.y.mean() for line in panel.lines]
    assert means == pytest.approx([100.0, -200.0, 300.0], abs=0.01)


def test_no_error_panel_for_a_perfect_magnetometer(make):
    result = simulate(make(spacecraft={"magnetometer": {}}, simulation={"duration_s": 60.0}))
    titles = [panel.title for panel in drawn.field(make_view(result)).panels]
    assert not any(title.startswith("Magnetometer") for title in titles)


def test_eclipses_agree_with_the_earths_shadow(detumble, view):
    assert len(view.eclipses) >= 1
    r, sun = detumble["position_inertial"].values, detumble["sun_inertial"].values
    along = np.sum(r * sun, axis=1)
    beside = np.linalg.norm(r - along[:, None] * sun, axis=1)
    shadow = (along < 0.0) & (beside < EARTH_RADIUS_M)
    inside = np.zeros(len(shadow), dtype=bool)
    for began, ended in view.eclipses:
        inside |= (view.t_s >= began) & (view.t_s <= ended)
    # cylinder and cone differ by the half shadow: some seconds at an edge
    edges = np.array(view.eclipses).ravel()
    apart = np.abs(view.t_s[:, None] - edges).min(axis=1)
    assert 0.25 < shadow.mean() < 0.4
    assert np.all((inside == shadow) | (apart < 12.0))


def test_attitude_between_records_is_the_one_that_was_passed(make):
    fine = simulate(make(simulation={"duration_s": 60.0, "record_s": 0.5}))
    coarse = make_view(fine.isel(time=slice(0, None, 4)))
    truth = make_view(fine).to_inertial(fine["time"].values)
    answer = coarse.to_inertial(fine["time"].values)
    np.testing.assert_allclose(answer[::4], truth[::4], atol=1e-12)
    # half-way, a chord of constant rate is off by rate' t^2 / 8, and rate' <= 0.42 rate^2 here
    rate = np.linalg.norm(fine["omega_body"].values, axis=1).max()
    assert 1e-5 < np.abs(answer - truth).max() < 0.42 * rate**2 * 2.0**2 / 8.0


def test_record_is_needed(detumble):
    with pytest.raises(ValueError, match="result: must hold at least one record; received none"):
        make_view(detumble.isel(time=slice(0, 0)))


def test_notes_say_what_to_beware_of(make, detumble):
    assert notes(make_view(detumble)) == []
    tumbling = make(
        spacecraft={"magnetometer": {"range_nt": 20000.0}},
        initial={"rate_deg_s": [50.0, 20.0, 0.0]},
        simulation={"duration_s": 60.0, "step_s": 0.5, "record_s": 6.0},
    )
    answer = notes(make_view(simulate(tumbling, until_s=30.0)))
    for wanted in (
        "this run is not complete: stopped at t = 30 s",
        "the law will drive the rotation",
        "between records (6 s apart)",
        "exceeded the magnetometer's range",
    ):
        assert sum(wanted in note for note in answer) == 1, wanted


def test_law_that_took_the_place_of_the_scenarios_own(make):
    from torquer.computer.laws.off import Off

    fast = make(initial={"rate_deg_s": [50.0, 20.0, 0.0]}, simulation={"duration_s": 20.0})
    assert any("drive the rotation" in note for note in notes(make_view(simulate(fast))))
    answer = notes(make_view(simulate(fast, law=Off().law())))
    assert not any("drive the rotation" in note for note in answer)


def test_reach_of_skew_coils_is_the_greatest_over_all_switchings(make):
    axes = [[1, 1, 0], [0, 1, 2], [1, 0, 1], [1, -1, 0]]
    limits = [1.0, 2.0, 3.0, 0.5]
    skew = make(
        spacecraft={"coils": {"limit_a_m2": limits, "axes": axes}}, simulation={"duration_s": 8.0}
    )
    view = make_view(simulate(skew))
    units = np.array(axes) / np.linalg.norm(axes, axis=1)[:, None]
    switched = [np.array(signs) * limits @ units for signs in itertools.product((-1, 1), repeat=4)]
    np.testing.assert_allclose(coil_reach(skew.spacecraft.coils), np.max(switched, axis=0))
    labels = {level.label for level in drawn.dipole_whole(view).levels if level.label}
    assert labels <= {"limit x", "limit y", "limit z"}


def test_levels_are_orbital_rates(view):
    levels = drawn.rate_size(view).levels
    assert [level.y for level in levels] == pytest.approx(
        np.degrees(view.omega0_rad_s) * np.array([1, 2, 3])
    )
    assert [level.label for level in levels] == ["1 ω₀", "2 ω₀", "3 ω₀"]


def test_whole_run_of_dipoles_shows_the_coils_while_they_act(detumble, view):
    panel = drawn.dipole_whole(view)
    phase = detumble["time"].values % 8.0
    acting = detumble["dipole_body"].values[(phase >= 4.0)]
    assert np.count_nonzero(phase >= 4.0) < len(phase)
    for i, line in enumerate(panel.lines):
        assert line.series.y.max() == acting[:, i].max()
        assert line.series.y.min() == acting[:, i].min()
        assert len(line.series.t) == len(acting)
    idle = detumble["dipole_body"].values[:-1][phase[:-1] < 4.0]
    assert np.all(idle == 0.0)


def test_cycles_are_drawn_with_their_windows(view):
    first, last = drawn.dipoles(view).panels[1:]
    assert first.window == (0.0, 48.0) and last.window == (7152.0, 7200.0)
    assert first.bands == tuple((8.0 * n, 8.0 * n + 4.0) for n in range(6))
    assert all(line.style == "steps" for line in first.lines + last.lines)


def test_every_panel_can_be_drawn(view):
    for picture in drawn.pictures(view):
        assert picture.panels and picture.caption
        for panel in picture.panels:
            assert panel.lines and panel.title and "[" in panel.y_label
            if panel.y_range:
                assert panel.y_range[0] < panel.y_range[1]
            assert not panel.log or panel.y_range[0] > 0.0


def test_field_map_is_the_models_own(make):
    def map_of(kind):
        environment = {"field": kind, "earth_rotation": "sidereal"}
        result = simulate(make(environment=environment, simulation={"duration_s": 4.0}))
        return make_view(result).field_map, float(result["altitude"].mean())

    (lon, lat, strength), height_m = map_of({"kind": "direct_dipole", "mu_e_t_km3": 8e6})
    assert strength.shape == (len(lat), len(lon)) and (lon[0], lon[-1]) == (-180.0, 180.0)
    equator = strength[np.argmin(np.abs(lat))]
    np.testing.assert_allclose(equator, 1e6 * 8e15 / (EARTH_RADIUS_M + height_m) ** 3, rtol=1e-9)
    assert map_of({"kind": "averaged"})[0] is None


def test_chapters_let_the_eye_follow(view):
    parts = chapters(view)
    assert [part.name for part in parts] == ["Start", "Middle", "End"]
    t = np.concatenate([part.t_s for part in parts])
    assert len(t) == 150 and np.all(np.diff(t) > 0.0) and (t[0], t[-1]) == (0.0, view.end_s)
    rate = np.degrees(view.rate)
    for part in (parts[0], parts[-1]):
        spacing = np.diff(part.t_s)
        assert np.ptp(spacing) < 1e-6
        within = rate[(view.t_s >= part.t_s[0]) & (view.t_s <= part.t_s[-1])]
        assert within.max() * spacing[0] < 20.5


def test_slow_motion_is_one_chapter(make):
    slow = make(initial={"rate_deg_s": [0.1, 0.0, 0.2]}, simulation={"duration_s": 600.0})
    result = simulate(slow)
    (only,) = chapters(make_view(result))
    assert only.name == "Whole run" and only.t_s[-1] == 600.0
    (single,) = chapters(make_view(result.isel(time=[0])))
    assert single.t_s.tolist() == [0.0]


def test_coarse_record_is_shown_as_it_is(make):
    spin = make(
        initial={"rate_deg_s": [0.0, 0.0, 40.0]},
        simulation={"duration_s": 3000.0, "step_s": 0.5, "record_s": 10.0},
    )
    view = make_view(simulate(spin))
    assert not view.can_follow()
    assert all("too far apart" in part.description for part in chapters(view))
    assert np.isin(np.concatenate([part.t_s for part in chapters(view)]), view.t_s).all()


def test_frames_show_the_attitude(view):
    figure = scene_figure(view)
    t = np.concatenate([part.t_s for part in chapters(view)])
    assert len(figure["frames"]) == len(t) == len(figure["layout"]["sliders"][0]["steps"])
    body = view.to_inertial(t)
    names = [trace.get("name") for trace in figure["data"]]
    for n in (0, 70, 149):
        frame = figure["frames"][n]
        for axis, name in enumerate("xyz"):
            arrow = frame["data"][frame["traces"].index(names.index(name))]
            tip = [arrow[k][1] for k in "xyz"]
            np.testing.assert_allclose(tip, body[n][:, axis], atol=6e-4)


@pytest.mark.parametrize("fixture", ["detumble", "flown"])
def test_summary_does_not_depend_on_the_record_chunk_size(fixture, request, monkeypatch):
    result = request.getfixturevalue(fixture)
    whole = summarise(result)
    monkeypatch.setattr("torquer.analysis.summary._PART", 97)
    assert summarise(result) == whole


def test_printed_summary_is_a_table_and_summary_a_plain_mapping(detumble):
    summary = summarise(detumble)
    plain = dict(summary)
    assert summary == plain and isinstance(summary, dict) and repr(summary) == repr(plain)
    assert json.loads(json.dumps(summary)) == json.loads(json.dumps(plain))
    title, *lines = str(summary).splitlines()
    rows = torquer.summary_rows(summary)
    assert title == summary["scenario"] and len(lines) == len(rows)
    for line, (label, value) in zip(lines, rows, strict=True):
        assert line.startswith(label) and line.endswith(f"  {value}")
    assert len({len(line) - len(value) for line, (_, value) in zip(lines, rows, strict=True)}) == 1
    page = ElementTree.fromstring(summary._repr_html_())
    assert [tuple(cell.text or "" for cell in row) for row in page.iter("tr")] == rows
    del summary["verdict"]
    assert str(summary) == repr(summary) and "<pre>" in summary._repr_html_()


def test_a_long_run_is_shown_by_some_of_its_records(detumble, monkeypatch):
    monkeypatch.setattr("torquer.report.flight.view._MOST_RECORDS", 1000)
    seen = make_view(detumble)
    assert (seen.every, seen.record_s, len(seen.t_s)) == (4, 8.0, 901)
    assert (seen.t_s[0], seen.t_s[-1]) == (0.0, 7200.0)
    assert seen.summary == summarise(detumble)
    wanted = "plots and the notes on the record use one record in 4, 8 s apart"
    assert sum(wanted in note for note in notes(seen)) == 1
    assert len(drawn.dipole_whole(seen).lines) == 3
