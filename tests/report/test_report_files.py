"""The files of the report: pictures, the self-contained page, and odd inputs."""

import base64
import io
import json
import re
import subprocess
import sys
from html.parser import HTMLParser

import matplotlib
import matplotlib.image
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from slow_cases import slow_after
from unpacking import unpacked

import torquer
from torquer.analysis.summary import summarise, summary_rows
from torquer.report import write_report
from torquer.report.common.colours import AXES
from torquer.report.common.interactive import pack_numbers
from torquer.report.flight import panels as drawn
from torquer.report.flight.ground_track import track_figure
from torquer.report.flight.interactive import panel_figure
from torquer.report.flight.orbit_scene import orbit_figure
from torquer.report.flight.page import page
from torquer.report.flight.png import draw_overview, draw_picture
from torquer.report.flight.scene import scene_figure
from torquer.report.flight.view import make_view
from torquer.scenario.load import scenario_from_text
from torquer.scenario.spec import Scenario
from torquer.scenario.toml_text import to_toml
from torquer.simulation.setup.simulate import simulate

PICTURES = (
    "rate", "momentum", "field", "dipoles", "torques", "pointing", "ground_track", "overview",
)  # fmt: skip
#: Tags without an end tag.
VOID = ("meta", "img", "br", "link", "input")


class Page(HTMLParser):
    """Tags, attributes and texts of a page, and whether its tags are balanced."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.attributes, self.texts, self.open, self.balanced = [], [], [], [], True
        self.feed(text)
        self.close()
        self.balanced &= not self.open

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        self.balanced &= bool(self.open) and self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append((self.open[-1] if self.open else "", data))

    def inside(self, tag):
        return [text for place, text in self.texts if place == tag]


@pytest.fixture(scope="module")
def text(report):
    return report[0]["report"].read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def parsed(text):
    return Page(text)


def test_files_lie_where_they_should(report):
    paths, answer = report
    assert set(paths) == {*PICTURES, "report"}
    root = paths["report"].parent
    assert paths["report"].name == "report.html"
    assert {p.relative_to(root).as_posix() for p in root.rglob("*") if p.is_file()} == {
        "report.html",
        *(f"plots/{name}.png" for name in PICTURES),
    }
    assert answer == sorted(answer) and answer[-1] == 1.0 and len(answer) > 5


@pytest.mark.parametrize("name", PICTURES)
def test_picture_is_drawn(report, name):
    image = matplotlib.image.imread(report[0][name])[..., :3]
    assert image.shape[0] > 500 and image.shape[1] > 1200
    assert 0.02 < np.mean(np.any(image < 0.95, axis=2)) < 0.9
    # nothing runs over the edge of the paper
    for edge in (image[:2], image[-2:], image[:, :2], image[:, -2:]):
        assert np.all(edge == 1.0)


@pytest.mark.parametrize("name", ["rate", "momentum", "field", "dipoles", "torques", "pointing"])
def test_all_three_axes_are_seen(report, name):
    image = matplotlib.image.imread(report[0][name])[..., :3]
    for _, colour in AXES:
        assert np.sum(np.abs(image - to_rgb(colour)).max(axis=2) < 0.02) > 300


def test_drawing_leaves_matplotlib_alone(detumble, tmp_path):
    before = dict(matplotlib.rcParams)
    few = make_view(detumble.isel(time=slice(0, 50)))
    FigureCanvasAgg(draw_picture(few, drawn.rate(few))).print_png(tmp_path / "rate.png")
    assert dict(matplotlib.rcParams) == before
    assert (tmp_path / "rate.png").stat().st_size > 10_000


def test_summary_loads_no_drawing_library():
    code = (
        "import sys, torquer, torquer.report\n"
        "torquer.summarise, torquer.summary_rows\n"
        "print([m for m in sys.modules if m.split('.')[0] in ('matplotlib', 'plotly')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_page_loads_nothing(text, parsed):
    assert parsed.balanced
    assert "link" not in parsed.tags and "iframe" not in parsed.tags
    for tag, name, value in parsed.attributes:
        if tag == "a" and name == "href":
            assert value.startswith("#")
        elif name in ("src", "href", "srcset", "data", "action", "poster"):
            assert tag == "img" and value.startswith("data:image/png;base64,")
    style = "".join(parsed.inside("style"))
    assert style and "@import" not in style and "url(" not in style
    policy = [value for _, name, value in parsed.attributes if name == "content"]
    assert any(value.startswith("default-src 'none'") and "http" not in value for value in policy)
    scripts = [s for s in parsed.inside("script") if s.isascii() and s.startswith("H4sI")]
    assert "Plotly, Inc." in unpacked(scripts[-1]) and len(text) < 3e6
    # newer plotly offers to send pictures to a server unless asked not to
    assert "showSendToCloud: false" in text and 'plotlyServerURL: ""' in text


def test_page_says_what_the_summary_says(detumble, parsed):
    cells = parsed.inside("td")
    for label, value in summary_rows(summarise(detumble), verdict=False):
        assert value in cells, label
    assert set(summarise(detumble)["cite"].values()) <= set(cells)
    assert "environment.field (igrf14)" in cells and "control.law (bdot)" in cells
    verdict = summarise(detumble)["verdict"]
    assert verdict["headline"] in parsed.inside("p")
    assert any(f"rate below {verdict['goals'][0]['below']:.3g} deg/s" in cell for cell in cells)
    assert "2020-03-01 00:00:00 UTC" in cells and "bdot (gain_a_m2_s_per_t = 2e+06)" in cells
    for version in json.loads(detumble.attrs["versions"]).values():
        assert version in cells


def test_page_can_be_read_without_seeing_and_steered_by_keys(parsed):
    named = {name: value for tag, name, value in parsed.attributes if tag == "img"}
    assert named["alt"]
    plots = [a for a in parsed.attributes if a[:2] == ("div", "class") and a[2] == "plot"]
    labels = [v for tag, name, v in parsed.attributes if (tag, name) == ("div", "aria-label")]
    steered = [v for tag, name, v in parsed.attributes if (tag, name) == ("div", "tabindex")]
    assert len(labels) == len(steered) >= len(plots) > 10 and all(labels) and set(steered) == {"0"}
    assert any("Absolute rate" in label and "Arrow keys" in label for label in labels)
    heads = [v for tag, name, v in parsed.attributes if (tag, name) == ("th", "scope")]
    assert len(heads) == parsed.tags.count("th")
    links = {v[1:] for tag, name, v in parsed.attributes if (tag, name) == ("a", "href")}
    ids = {v for tag, name, v in parsed.attributes if (tag, name) == ("section", "id")}
    assert links and links <= ids


def test_no_row_stands_twice(detumble):
    labels = [label.strip() for label, _ in summary_rows(summarise(detumble))]
    assert len(labels) == len(set(labels))


def test_users_text_is_text(detumble, parsed):
    scenario = Scenario.model_validate_json(detumble.attrs["scenario"])
    assert scenario.description in parsed.inside("p")
    assert "b" not in parsed.tags
    plots = sum(name == "class" and value == "plot" for _, name, value in parsed.attributes)
    # one script per plot, plotly.js and the page's own
    assert plots > 10 and parsed.tags.count("script") == plots + 2


def test_scenario_on_the_page_runs_the_same_again(detumble, parsed):
    bibtex, shown = parsed.inside("pre")
    assert bibtex == torquer.citations(detumble)
    flown = Scenario.model_validate_json(detumble.attrs["scenario"])
    assert scenario_from_text(shown).model_dump() == flown.model_dump()


@pytest.mark.parametrize(
    "description", ['quote " and \\ back', "two\nlines\ttab", "DEL \x7f", "Ж µ 漢 🛰", ""]
)
def test_any_description_survives_as_toml(make, description):
    scenario = make("text", description=description)
    answer = to_toml(json.loads(scenario.model_dump_json(exclude_unset=True)))
    assert scenario_from_text(answer).model_dump() == scenario.model_dump()


def test_toml_of_nested_and_empty_tables():
    import tomllib

    data = {
        "a": 1,
        "none": None,
        "odd key": True,
        "t": {"u": {}, "v": {"x": [[1.5, 2], [3, 4]]}},
        "long": ["x" * 60, "y" * 60],
    }
    expected = {**data}
    del expected["none"]
    text = to_toml(data)
    assert tomllib.loads(text) == expected
    assert "x = [[1.5, 2], [3, 4]]" in text  # short lists stand in a line


@pytest.mark.parametrize("words", ["[\n 1,\n]", "a[\n  2,\n]", '"', "[1,", "],", "\r\n[\n3,\n]"])
def test_no_text_is_taken_for_a_list(words):
    import tomllib

    data = {"a": words, "b": [words, words], "t": [{"x": [1, 2]}], words: [[1.0, 2.0]] * 9}
    assert tomllib.loads(to_toml(data)) == data


def figures_of(view):
    panels = [panel for picture in drawn.pictures(view) for panel in picture.panels]
    in_space = (track_figure(view), scene_figure(view), orbit_figure(view))
    return [*(panel_figure(view, p) for p in panels), *in_space]


def test_plotly_knows_every_property(detumble):
    import plotly.graph_objects as go

    for figure in figures_of(make_view(detumble)):
        go.Figure(figure)


def test_figures_on_the_page_are_those_of_the_result(detumble, parsed):
    *packed_figures, _, _ = parsed.inside("script")  # plotly.js and the page's own come last
    figures = [json.loads(unpacked(script)) for script in packed_figures]
    made = figures_of(make_view(detumble))
    assert figures == json.loads(json.dumps(made))
    trace = next(t for t in figures[0]["data"] if t["name"] == "|ω|")
    y = np.frombuffer(base64.b64decode(trace["y"]["bdata"]), dtype="<f4")
    rate = np.degrees(np.linalg.norm(detumble["omega_body"].values, axis=1))
    assert y[0] == pytest.approx(rate[:4].mean(), rel=1e-3)


def test_packed_numbers_come_back():
    values = np.array([1.5, -2.0, np.nan, 1e30])
    for kind in ("f4", "f8"):
        answer = pack_numbers(values, kind)
        back = np.frombuffer(base64.b64decode(answer["bdata"]), dtype=f"<{answer['dtype']}")
        np.testing.assert_allclose(back, values, rtol=1e-7)


def test_without_scripts_there_is_the_overview(report, parsed):
    (source,) = [v for tag, name, v in parsed.attributes if (tag, name) == ("img", "src")]
    shown = matplotlib.image.imread(io.BytesIO(base64.b64decode(source.partition(",")[2])))
    drawn = matplotlib.image.imread(report[0]["overview"])
    assert shown.shape[:2] == drawn.shape[:2]
    assert np.abs(shown[..., :3] - drawn[..., :3]).mean() < 0.01  # 256 colours of many more


def test_without_plots_there_is_the_same_page_alone(report, text, detumble, tmp_path):
    answer = []
    paths = write_report(detumble, tmp_path, answer.append)
    assert paths == {"report": tmp_path / "report.html"} and answer == [1.0]
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]
    alone = paths["report"].read_text(encoding="utf-8")
    (shown,) = re.findall(r"<noscript>.*?</noscript>", alone, re.S)
    assert "need JavaScript; <code>torquer run --plots</code> draws them" in shown
    without = re.compile(r"<noscript>.*?</noscript>", re.S)
    assert without.sub("", alone) == without.sub("", text)


def test_the_page_needs_no_matplotlib(detumble, tmp_path):
    torquer.save(detumble, tmp_path / "result.nc")
    code = (
        "import sys, torquer\n"
        "torquer.write_report(torquer.load(sys.argv[1]), sys.argv[2])\n"
        "print([name for name in ('matplotlib', 'PIL') if name in sys.modules])"
    )
    given = [str(tmp_path / name) for name in ("result.nc", "out")]
    command = [sys.executable, "-c", code, *given]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


HOLD = {"sample_s": 1.0, "measure_s": 0.0, "actuate_s": None}
BRIEF = {"duration_s": 60.0, "step_s": 0.5, "record_s": 1.0}
STILL = {"law": {"kind": "off"}, **HOLD}
SKEW = {
    "limit_a_m2": [1.0, 2.0, 3.0, 1.0],
    "lag_s": 0.2,
    "residual_dipole_a_m2": [0.1, 0.0, 0.0],
    "axes": [[1, 1, 0], [0, 1, 1], [1, 0, 1], [1, -1, 0]],
}
ODD = {
    "seconds": {"simulation": {**BRIEF, "duration_s": 3.0}, "control": HOLD},
    "no rate": {
        "initial": {"rate_deg_s": [0.0, 0.0, 0.0]},
        "control": STILL,
        "simulation": BRIEF,
        "environment": {"gravity_gradient": False},
    },
    "days": {
        "simulation": {"duration_s": 4 * 86400.0, "step_s": 10.0, "record_s": 60.0},
        "control": {**HOLD, "sample_s": 10.0},
        "initial": {"rate_deg_s": [0.5, 0.2, 0.1]},
    },
    "averaged field, polar": {
        "environment": {"field": {"kind": "averaged"}},
        "control": HOLD,
        "simulation": BRIEF,
        "orbit": {"inclination_deg": 90.0},
    },
    "skew coils, Sun sensors": {
        "spacecraft": {"coils": SKEW, "sun_sensors": {"axes": [[1, 0, 0]], "half_field_deg": 60.0}},
        "simulation": BRIEF,
    },
    "fast spin, coarse record": {
        "initial": {"rate_deg_s": [0.0, 80.0, 0.0]},
        "simulation": {"duration_s": 1200.0, "step_s": 0.5, "record_s": 20.0},
    },
}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("case", slow_after(1, ODD))
def test_odd_runs_are_reported(make, tmp_path, case):
    result = simulate(make("odd", **ODD[case]))
    paths = write_report(result, tmp_path, plots=True)
    assert all(path.stat().st_size > 10_000 for path in paths.values())
    assert Page(paths["report"].read_text(encoding="utf-8")).balanced


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("rows", [1, 2, 3, 7])
def test_partial_results_are_reported(detumble, tmp_path, rows):
    cut = detumble.isel(time=slice(0, rows)).assign_attrs(ended="interrupted at t = <i>3 s")
    if rows == 1:
        assert len(write_report(cut, tmp_path, plots=True)) == 9
    text = page(make_view(cut), drawn.pictures(make_view(cut)))
    assert "this run is not complete: interrupted at t = &lt;i&gt;3 s" in text


def test_dollars_and_long_lines_are_no_trouble(make):
    scenario = make("long", description=r"$\frac$ " + "word " * 100, simulation={"duration_s": 8.0})
    canvas = FigureCanvasAgg(draw_overview(make_view(simulate(scenario))))
    canvas.draw()
    image = np.asarray(canvas.buffer_rgba())
    assert np.all(image[:, -10:] == 255) and np.any(image[:80, -400:] < 128)
