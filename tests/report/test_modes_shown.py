"""Modes and logs in a report: strips, the state diagram, tables, panels."""

import base64
import itertools
import json
import re
import xml.etree.ElementTree as ElementTree

import matplotlib.image
import numpy as np
import pytest
from filter_cases import DYNAMICS, GYRO, SCENARIO
from law_examples import EXAMPLES
from pydantic import TypeAdapter

from torquer import simulate
from torquer.analysis.mode_use import RegionRecord, find_regions, state_uses
from torquer.analysis.summary import summarise, summary_rows
from torquer.computer.estimation import AnyEstimator
from torquer.computer.laws import AnyLaw
from torquer.computer.modes.diagram import svg
from torquer.report import write_report
from torquer.report.common.keys import changed_keys, in_one_line
from torquer.report.flight import panels as drawn
from torquer.report.flight.interactive import panel_figure
from torquer.report.flight.notes import notes
from torquer.report.flight.page import page
from torquer.report.flight.panels.modes import strip
from torquer.report.flight.png import draw_picture
from torquer.report.flight.setting import setting
from torquer.report.flight.view import make_view
from torquer.scenario.load import scenario_from_data
from torquer.simulation.results.dataset import flown_scenario


@pytest.fixture(scope="module")
def view(switched):
    return make_view(switched)


# ------------------------------------------------------------------ what is derived


def test_the_night_is_the_shadow(switched):
    """The region follows the ephemeris, which is that of the result."""
    (_, light) = find_regions(switched)
    assert (light.name, light.states) == ("light", ("day", "night"))
    sunlit_fraction = switched["sunlit_fraction"].values
    clear = (np.abs(sunlit_fraction - 0.5) > 0.1) & (switched["time"].values > 0.0)
    assert np.array_equal(light.numbers[clear] == 1, sunlit_fraction[clear] < 0.5)
    assert 0.2 < np.mean(sunlit_fraction < 0.5) < 0.5 and clear.mean() > 0.99


def test_uses_are_those_of_the_record(switched):
    uses, t = state_uses(switched), switched["time"].values
    task, light = uses["task"], uses["light"]
    assert [*task] == ["detumble", "hold", "safe"]
    assert (task["detumble"].entries, task["hold"].entries, task["safe"].entries) == (1, 1, 0)
    assert task["safe"].last_entered_s is None and task["safe"].share == 0.0
    assert task["detumble"].share * t[-1] == pytest.approx(task["hold"].last_entered_s, abs=5.0)
    assert sum(use.share for use in light.values()) == pytest.approx(1.0)
    changes = np.flatnonzero(np.diff(switched["sunlit_fraction"].values < 0.5))
    assert light["day"].entries + light["night"].entries == 1 + len(changes)


def test_spans_cover_the_time_without_a_gap(switched):
    t = switched["time"].values
    for region in find_regions(switched):
        spans = sorted(itertools.chain(*region.spans(t)))
        assert spans[0][0] == 0.0 and spans[-1][1] == t[-1]
        assert all(a[1] == b[0] for a, b in itertools.pairwise(spans))


def test_spans_and_shares_of_a_known_record():
    region = RegionRecord("r", ("a", "b", "c"), np.array([0, 0, 2, 0, 2, 2]))
    t = np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0])
    assert region.spans(t) == [[(0.0, 2.0), (3.0, 4.0)], [], [(2.0, 3.0), (4.0, 5.0)]]
    assert region.shares() == pytest.approx([0.6, 0.0, 0.4])
    assert region.final == "c"


def test_summary_has_laws_and_modes(switched, detumble):
    answer = summarise(switched)
    assert {key: law["name"] for key, law in answer["laws"].items()} == {
        "damping": "bdot", "pitch": "bias_momentum",
    }  # fmt: skip
    assert answer["modes"]["task"]["hold"]["entries"] == 1
    share = answer["modes"]["task"]["hold"]["share"]
    row = dict(summary_rows(answer))["Time by mode of task"]
    assert row == f"hold {share:.1%}, detumble {1.0 - share:.1%}"
    assert "modes" not in summarise(detumble)
    assert not any("mode" in label for label, _ in summary_rows(summarise(detumble)))


def test_a_law_within_modes_has_its_attitude_error(view):
    assert view.attitude_error is not None and view.attitude_error.frames == "orbital"
    assert "final_attitude_error_deg" in view.summary


# ------------------------------------------------------------------ pictures


def test_strips_stand_above_every_picture(view, detumble):
    for picture in drawn.pictures(view):
        titles = [panel.title for panel in picture.panels if panel.bars]
        assert titles == ["Mode: task", "Mode: light"]
        assert [panel.title for panel in picture.panels[:2]] == titles
    plain = drawn.pictures(make_view(detumble))
    assert not any(panel.bars for picture in plain for panel in picture.panels)


def test_a_strip_leaves_out_what_was_never_entered(view):
    task, light = (strip(view, region) for region in view.regions)
    assert [bar.label for bar in task.bars] == ["detumble", "hold"]
    assert [bar.label for bar in light.bars] == ["day", "night"]
    assert task.bars[0].spans[0][1] == task.bars[1].spans[0][0]


def test_many_states_can_be_distinguished(view):
    region = RegionRecord("r", tuple("abcdefghijkl"), np.arange(len(view.t_s)) % 12)
    bars = strip(view, region).bars
    assert len({(bar.colour, bar.opacity) for bar in bars}) == 12


def test_strips_and_panels_share_their_time_axis(view):
    picture = drawn.pictures(view)[0]
    axes = draw_picture(view, picture).axes[: len(picture.panels)]
    ends = {(round(a.get_position().x0, 9), round(a.get_position().x1, 9)) for a in axes}
    assert len(ends) == 1
    clock = view.end_s / axes[2].get_xlim()[1]
    assert axes[0].get_xlim() == pytest.approx((0.0, view.end_s)) and clock == 60.0


def test_interactive_strips_are_linked_to_the_other_panels(view):
    import plotly.graph_objects as go

    picture = drawn.pictures(view)[0]
    strip_figure, whole = (panel_figure(view, picture.panels[i]) for i in (0, 2))
    assert strip_figure["layout"]["xaxis"]["range"] == whole["layout"]["xaxis"]["range"]
    assert [trace["name"] for trace in strip_figure["data"]] == ["detumble", "hold"]
    go.Figure(strip_figure)


def test_every_logged_quantity_has_its_panel(view):
    picture = {picture.name: picture for picture in drawn.pictures(view)}["logs"]
    panels = [panel for panel in picture.panels if not panel.bars]
    assert [panel.title for panel in panels] == ["pitch.pitch_rad", "pitch.momentum_error_n_m_s"]
    logged = view.values("pitch.momentum_error_n_m_s")
    drawn_y = panels[1].lines[0].series.y
    unit = {"[N m s]": 1.0, "[mN m s]": 1e3}[panels[1].y_label]
    np.testing.assert_allclose(drawn_y, unit * logged)
    assert panels[0].y_label.endswith("rad]")


def test_no_logs_no_picture_of_them(detumble):
    assert "logs" not in [picture.name for picture in drawn.pictures(make_view(detumble))]


# ------------------------------------------------------------------ page and files


@pytest.mark.filterwarnings("error")
def test_the_report_has_diagram_strips_and_table(switched, view, tmp_path):
    paths = write_report(switched, tmp_path, plots=True)
    assert paths["modes"].read_text() == svg(flown_scenario(switched).control.modes)
    image = matplotlib.image.imread(paths["rate"])[..., :3]
    assert 0.02 < np.mean(np.any(image < 0.95, axis=2)) < 0.9
    text = paths["report"].read_text()
    section = re.search(r'<section class="card" id="modes">.*?</section>', text, re.S)[0]
    data = re.search(r"data:image/svg\+xml;base64,([^\"]+)", section)[1]
    ElementTree.fromstring(base64.b64decode(data))
    cells = re.findall(r"<td[^>]*>(.*?)</td>", section)
    states = cells[0::4]
    assert states == ["detumble", "hold", "safe", "day", "night"]
    hold_s = state_uses(switched)["task"]["hold"].last_entered_s
    hold, safe = cells[4:8], cells[8:12]
    assert hold[1] == "once" and hold[2].startswith(f"{hold_s:g} s")
    assert safe[1:] == ["0 times", "never", "0.0%"]


def test_page_of_a_run_without_modes_has_no_mode_section(detumble):
    seen = make_view(detumble)
    assert 'id="modes"' not in page(seen, drawn.pictures(seen))


def test_setting_names_every_law(view):
    rows = dict(setting(view))
    assert rows["Law damping"] == "bdot (gain_a_m2_s_per_t = 2e+06)"
    assert rows["Law pitch"] == (  # as its keys in the scenario, defaults left out
        "bias_momentum (bias_momentum_n_m_s = 0.1, pitch_inertia_kg_m2 = 1.2, bandwidth_rad_s = "
        "0.05, nutation_gain_a_m2_s_per_t = 100000, unloading_gain_per_s = 0.0001)"
    )


@pytest.mark.parametrize("kind", [*EXAMPLES, "kalman_gyro", "kalman_dynamics"])
def test_keys_shown_give_the_same_law_again(kind):
    """What a reader sees is what to write: neither packed numbers nor radians."""
    filters = {"kalman_gyro": GYRO, "kalman_dynamics": DYNAMICS}
    given = filters.get(kind) or {"kind": kind} | EXAMPLES[kind]
    spec = TypeAdapter(AnyLaw | AnyEstimator).validate_python(given)
    shown = changed_keys(spec)
    assert TypeAdapter(type(spec)).validate_python({"kind": kind} | shown) == spec
    line = in_one_line(shown)
    assert "None" not in line and all(f"{key} = " in line for key in shown)
    assert not any(key.split("_")[-1] == "rad" for key in shown)


def test_long_lists_are_shown_by_their_size():
    values = {"a": [[0.5, 1.0]] * 3, "b": np.zeros((12, 3, 6)).tolist(), "c": True, "d": {"e": "x"}}
    line = in_one_line(values)
    assert line == (
        'a = [[0.5, 1], [0.5, 1], [0.5, 1]], b = 12 x 3 x 6 numbers, c = true, d = { e = "x" }'
    )


def test_faults_of_the_table_are_notes(switched, view):
    assert not any(note.startswith("modes: ") for note in notes(view))
    data = json.loads(switched.attrs["scenario"])
    del data["control"]["modes"]["regions"]["task"]["states"]["safe"]["final"]
    trapped = make_view(switched.assign_attrs(scenario=json.dumps(data)))
    (note,) = (note for note in notes(trapped) if note.startswith("modes: "))
    assert note == "modes: task.safe: nothing leads out; declare it final = true if it is meant so"


@pytest.mark.slow
def test_states_and_their_deviations_have_panels_of_one_unit_each():
    """A covariance is shown by the standard deviations of what belongs together."""
    estimator = GYRO | {"record_covariance": True, "magnetometer_bias_sigma_nt": 300.0}
    data = {**SCENARIO, "control": {"law": {"kind": "off"}, "estimator": estimator}}
    result = simulate(scenario_from_data(data).replace("simulation.duration_s", 60.0))
    (picture,) = [each for each in drawn.pictures(make_view(result)) if each.name == "logs"]
    shown = {panel.title: panel for panel in picture.panels}
    assert [title for title in shown if "states" in title] == [
        "estimator.states, gyro_bias", "estimator.states, magnetometer_bias",
    ]  # fmt: skip
    sigma = shown["estimator.covariance, standard deviation, attitude"]
    assert [line.label for line in sigma.lines] == ["x", "y", "z"] and sigma.y_label == "[deg]"
    variance = result["estimator.covariance"].values[3, 1, 1]
    assert sigma.lines[1].series.y[3] == pytest.approx(np.degrees(np.sqrt(variance)))
    bias = shown["estimator.states, gyro_bias"]
    assert bias.y_label == "[deg/s]"


def test_what_never_changes_has_no_panel_but_a_word(view):
    name = "pitch.momentum_error_n_m_s"
    values = view.result[name]
    for still, words in ((values * 0.0 + 2.0, f"Always 2 N m s: {name}."),
                         (values * np.nan, f"Without a value: {name}.")):  # fmt: skip
        changed = make_view(view.result.assign({name: still.assign_attrs(values.attrs)}))
        (logs,) = [each for each in drawn.pictures(changed) if each.name == "logs"]
        assert [panel.title for panel in logs.panels if not panel.bars] == ["pitch.pitch_rad"]
        assert logs.caption.endswith(words)


def test_a_long_page_folds_what_comes_last(view):
    """Plots in the order of their importance; the scenario and the logs are always folded."""
    text = page(view, drawn.pictures(view))
    open_px = sum(map(int, re.findall(r"min-height:(\d+)px", without_details(text))))
    shown = sum(map(int, re.findall(r"min-height:(\d+)px", text)))
    assert open_px < 7000 + 440 + 600 + 560 < shown  # and the three in space
    assert 'id="scenario"><details><summary><h2>Scenario</h2></summary>' in text
    assert "<pre" not in without_details(text)
    assert "<summary>pitch</summary>" in text
    assert text.count("<details>") == text.count("</details>")


def without_details(text: str) -> str:
    while "</details>" in text:
        text = re.sub(r"<details>(?:(?!<details>).)*?</details>", "", text, flags=re.S)
    return text
