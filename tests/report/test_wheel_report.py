"""The report on a wheel design against the array's own functions; its pictures and its page."""

import json
import re
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from unpacking import unpacked

from torquer.design.wheel_design import analyse, half_spaces
from torquer.design.wheel_file import load_wheels, wheels_from_text
from torquer.design.wheel_tables import failure_rows, hours, layout_rows, summary_rows
from torquer.report.common.html import PACKED
from torquer.report.wheels.page import make_figure, write_page
from torquer.report.wheels.pictures import draw_all
from torquer.spacecraft.wheel_array.envelope import momentum_envelope

EXAMPLE = Path(__file__).parents[2] / "examples/wheels/foton.toml"
SHORT = """
[wheels]
momentum_limit_n_m_s = 2.0
layout = { kind = "regular_pyramid", count = 6, gamma_deg = 54.7 }
[body]
inertia_kg_m2 = [[10, 1, 0], [1, 12, 0], [0, 0, 15]]
"""


@pytest.fixture(scope="module")
def design():
    return load_wheels(EXAMPLE)


@pytest.fixture(scope="module")
def report(design):
    return analyse(design)


def test_published_numbers_are_in_the_report(report):
    assert report["momentum"]["worst_rate_deg_s"] == pytest.approx(0.18494, abs=1e-4)
    assert [report["momentum"][k] for k in ("vertices", "edges", "faces")] == [14, 24, 12]
    singles = [case for case in report["failures"] if len(case["lost"]) == 1]
    assert [round(case["worst_rate_deg_s"], 3) for case in singles] == [0.092] * 4
    assert len(report["failures"]) == 1 + 4 + 6
    by_name = {row["name"]: row for row in report["layouts"]}
    assert by_name["balanced rates"]["angles"] == "alpha 80.5, beta 45.5"
    assert by_name["minimum momentum"]["norm_n_m_s"] == pytest.approx(0.5 * (4.6 + 4.6 + 29.6))


def test_the_layouts_are_best_at_what_they_are_named_for(report):
    by_name = {row["name"]: row for row in report["layouts"]}

    def best(key):
        return max(report["layouts"], key=lambda row: row[key])["name"]

    assert best("volume_n3_m3_s3") == "maximum volume"
    assert best("worst_rate_deg_s") in ("best worst-case rate", "balanced rates")
    assert min(report["layouts"], key=lambda row: row["norm_n_m_s"])["name"] == "minimum momentum"
    assert by_name["given"]["wheel_n_m_s"] > 18.0  # the pseudo-inverse cannot, minimax can
    assert report["demand"]["momentum"]["met"]


def test_demands_are_met_exactly_up_to_the_array_limit(design, report):
    rate = report["momentum"]["worst_rate_deg_s"]
    for factor, met in ((0.999, True), (1.001, False)):
        demand = design.demand.model_copy(update={"rate_deg_s": factor * rate})
        found = analyse(design.model_copy(update={"demand": demand}))["demand"]["rate"]
        assert found["met"] is met and found["share"] == pytest.approx(factor)


def test_saturation_is_where_the_envelope_is_left(design, report):
    array = design.wheels.array()
    growth = design.accumulation.growth(np.array(design.body.inertia_kg_m2))
    found = report["accumulation"]["saturation_minimax_h"]
    earlier, at = growth.after(3600.0 * np.array([found - 0.01, found]))
    envelope = momentum_envelope(array)
    assert envelope.share(at) == pytest.approx(1.0, abs=1e-4)
    assert envelope.share(earlier) < 1.0
    assert report["accumulation"]["saturation_least_squares_h"] <= found
    rows = half_spaces(array, "minimax")
    assert np.abs(rows @ at).max() == pytest.approx(float(envelope.share(at)))


def test_a_design_without_extras_has_a_report_without_them():
    report = analyse(wheels_from_text(SHORT))
    assert report["torque"] is None and report["accumulation"] is None
    assert report["demand"] == {}
    assert len(report["layouts"]) == 4 and report["only_given_layout"] is None
    assert "demand" not in failure_rows(report)[1]
    assert len(failure_rows(report)[2]) == 1 + 6 + 15
    assert len(summary_rows(report)) == 6
    json.dumps(report, allow_nan=False)


def test_with_products_of_inertia_pyramids_stand_on_the_principal_axes(report):
    """The same body in axes that are turned against it: the same rates, the axes turned back."""
    text, turn = EXAMPLE.read_text(), np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0, 0, 1.0]])
    c, s = np.cos(0.2), np.sin(0.2)
    turn = turn @ np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    tensor = turn @ np.diag([2600.0, 11100.0, 10900.0]) @ turn.T
    given = "inertia_kg_m2 = [2600.0, 11100.0, 10900.0]"
    assert given in text
    turned = analyse(wheels_from_text(
        text.replace(given, f"inertia_kg_m2 = {(0.5 * (tensor + tensor.T)).tolist()}")
    ))  # fmt: skip
    here, there = ({row["name"]: row for row in each["layouts"]} for each in (report, turned))
    assert list(there) == list(here)
    for name in ("balanced rates", "best worst-case rate"):
        assert there[name]["worst_rate_deg_s"] == pytest.approx(here[name]["worst_rate_deg_s"])
        assert there[name]["angles"] == here[name]["angles"] + " *"
        lines = np.abs(np.array(there[name]["axes"]) @ turn @ np.array(here[name]["axes"]).T)
        assert lines.max(axis=0) == pytest.approx(1.0) and lines.max(axis=1) == pytest.approx(1.0)
    assert "* along the principal axes" in layout_rows(turned)[0]
    assert "*" not in layout_rows(report)[0]


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ("momentum_limit_n_m_s = [2.0, 2.0, 2.0, 2.0, 2.0, 1.9]", "the limits are not equal"),
        ("lost = [2]\nmomentum_limit_n_m_s = 2.0", "wheels have failed"),
    ],
)
def test_where_no_layouts_are_compared_it_says_why(change, reason):
    report = analyse(wheels_from_text(SHORT.replace("momentum_limit_n_m_s = 2.0", change)))
    assert [row["name"] for row in report["layouts"]] == ["given"]
    assert ("Other layouts", f"not compared: {reason}") in summary_rows(report)


def test_six_wheels_get_the_icosahedron_and_seven_a_search():
    text = SHORT.replace("[[10, 1, 0], [1, 12, 0], [0, 0, 15]]", "[10, 12, 15]")
    six = analyse(wheels_from_text(text))["layouts"]
    assert six[-1]["angles"] == "icosahedral"
    assert six[-1]["volume_n3_m3_s3"] == pytest.approx(
        8.0 * 32.0 * np.sqrt(5.0 + 2.0 * np.sqrt(5.0))
    )
    seven = analyse(wheels_from_text(text.replace("count = 6", "count = 7")))["layouts"]
    assert seven[-1]["volume_n3_m3_s3"] >= max(row["volume_n3_m3_s3"] for row in seven)
    assert len(layout_rows({"layouts": six, "demand": {}, "accumulation": None,
                            "momentum": {"volume_n3_m3_s3": 1.0}})[2]) == 4  # fmt: skip


def test_times_are_in_words():
    assert [hours(x) for x in (None, 0.0, 12.34, 480.0)] == ["never", "immediately", "12.3 h",
                                                             "20.0 days"]  # fmt: skip


def test_pictures_are_written_and_show_something(design, report, tmp_path):
    paths = draw_all(design, report, tmp_path)
    assert [path.name for path in paths] == ["envelope.png", "failures.png", "accumulation.png"]
    for path in paths:
        picture = matplotlib.image.imread(path)[..., :3]
        coloured = np.ptp(picture, axis=2) > 0.15
        assert picture.shape[1] > 900 and coloured.mean() > 0.01


def test_the_page_is_whole_and_loads_nothing(design, report, tmp_path):
    text = write_page(design, report, tmp_path / "wheels.html").read_text(encoding="utf-8")
    assert "default-src 'none'" in text and "0.1849" in text
    own = text.split("<script>")[0]  # plotly.js names addresses, the policy lets it load none
    assert "</table>" in own and not re.search(r'(src|href)="', own)
    packed = re.search(rf'<script type="{PACKED}">(.*?)</script>', text)[1]
    figure = json.loads(unpacked(packed))
    assert len(figure["data"]) == 1 + 2 * 11


def test_each_loss_of_the_page_shows_its_own_envelope(design, report):
    figure = make_figure(design, report)
    buttons = figure["layout"]["updatemenus"][0]["buttons"]
    assert [b["label"] for b in buttons][:3] == ["all wheels", "failed: 0", "failed: 1"]
    for number, button in enumerate(buttons):
        shown = [n for n, seen in enumerate(button["args"][0]["visible"]) if seen]
        assert shown == [0, 1 + 2 * number, 2 + 2 * number]
    faces = [trace for trace in figure["data"] if trace["type"] == "mesh3d"][1:]
    assert [len(trace["x"]) for trace in faces] == [14, *[8] * 4, *[4] * 6]
    first = np.array([faces[0][k] for k in "xyz"]).T
    assert np.all(momentum_envelope(design.wheels.array()).contains(first, 1e-5))
    assert [t.get("visible", True) for t in figure["data"]] == buttons[0]["args"][0]["visible"]
