"""The page of A4 about an answer: nothing overlaps, nothing is cut, what is left out is counted."""

import re
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from artificial_campaign import artificial
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

import torquer
from torquer.analysis.filters.filter_check import FilterCheck
from torquer.analysis.filters.filter_statistics import FilterRuns
from torquer.analysis.filters.filter_verdict import Check
from torquer.analysis.filters.linear_covariance import Expected
from torquer.analysis.summary import summary_rows
from torquer.design.coil_design import coil
from torquer.design.requests import CoilRequest
from torquer.report.common.models import model_rows
from torquer.report.common.one_page import HEIGHT, MARGIN, WIDTH, Page, draw_page, width_of
from torquer.report.filter.page import write_page
from torquer.report.flight.one_page import run_page
from torquer.scenario.resolution import told_of_steps

NAME = "a_satellite_with_a_name_that_" + "goes_on_" * 30
WITH_WHEELS = {
    "spacecraft": {
        "wheels": {
            "layout": {"kind": "four_sided_pyramid", "alpha_deg": 54.7356, "beta_deg": 45.0},
            "momentum_limit_n_m_s": 0.4,
            "torque_limit_n_m": 0.05,
        }
    },
    "control": {"law": None, "laws": {"coils": {"kind": "unloading", "gain_per_s": 1e-3}}},
}
LONG = Page(
    title=NAME,
    question="Is this question, which has many words, still legible? " * 20,
    verdict="Not achieved: " + "rate below 0.1 deg/s never, 3.7 deg/s at the end; " * 20,
    look="missed",
    plots=(),
    numbers=[(f"  A label of many words, number {n}", f"{n / 7.0:.15g} " * 9) for n in range(40)],
    models=[(f"Model{n}", "key " + "x" * 200) for n in range(40)],
    sources=[f"Author, A. B. A source with a long title, number {n}. " * 6 for n in range(20)],
    notes=["Careful: $5 and $6 are no formula. " * 9] * 12,
    table=[["label"] * 40, ["unit"] * 40, *([f"{n:.6f}" for n in range(40)] for _ in range(24))],
)


def written(figure) -> list[tuple[str, np.ndarray]]:
    """Each line of text with its box [inch]: left, lower, right, upper."""
    FigureCanvasAgg(figure).draw()
    return [
        (text.get_text(), text.get_window_extent().extents / figure.dpi)
        for text in figure.texts
        if text.get_text()
    ]


def check(figure) -> None:
    lines = written(figure)
    for text, (left, lower, right, upper) in lines:
        assert left > MARGIN - 0.02 and right < WIDTH - MARGIN + 0.05, text
        assert lower > 0.4 * MARGIN and upper < HEIGHT - 0.4 * MARGIN, text
    for (a, first), (b, second) in combinations(lines, 2):
        deep = np.minimum(first[2:], second[2:]) - np.maximum(first[:2], second[:2])
        assert deep.min() < 0.02, (a, b)  # an inch: of letters, which are not as high as their box
    assert {text.get_fontsize() for text in figure.texts} <= {8.0, 10.0, 14.0}
    for box in (axes.get_tightbbox().extents / figure.dpi for axes in figure.get_axes()):
        for text, line in lines:
            deep = np.minimum(box[2:], line[2:]) - np.maximum(box[:2], line[:2])
            assert deep.min() < 0.04, text


@pytest.mark.parametrize(
    "page",
    [LONG, replace(LONG, numbers=()), replace(LONG, numbers=(), models=(), table=(), notes=()),
     Page("a", "", "", "open", (), (), (), ())],
    ids=["all is long", "no numbers", "no tables", "nothing"],
)  # fmt: skip
def test_no_text_is_outside_or_on_another(page):
    check(draw_page(page))


def test_what_does_not_fit_is_counted():
    page = replace(LONG, table=())
    text = "\n".join(line for line, _ in written(draw_page(page)))
    left = [int(count) for count in re.findall(r"… and (\d+) more", text)]
    assert len(left) == 4  # notes, numbers, models, sources
    shown = len(set(re.findall(r"Model\d+", text)))
    assert left[2] == len(page.models) - shown


def test_all_that_fits_is_there():
    page = Page("name", "Which?", "This.", "done", (), [("label", "1.5 deg")] * 20,
                [("Field", "igrf14")] * 20, ["A source."] * 5, ["a note"] * 3)  # fmt: skip
    text = [line for line, _ in written(draw_page(page))]
    assert text.count("1.5 deg") == text.count("igrf14") == 20
    assert not any("more" in line for line in text)


def test_width_is_that_of_a_renderer():
    figure = draw_page(replace(LONG, title="A title of few words", notes=()))
    (line,) = (box for text, box in written(figure) if text == "A title of few words")
    assert width_of("A title of few words", 14.0, True) == pytest.approx(
        line[2] - line[0], rel=0.03
    )


@pytest.mark.parametrize("name", ["detumble", "flown", "alone", "switched"])
def test_a_run(name, request):
    result = request.getfixturevalue(name)
    figure, summary = torquer.page(result), torquer.summarise(result)
    check(figure)
    text = " ".join(line for line, _ in written(figure))
    assert summary["verdict"]["headline"][:40] in text and "Sources" in text
    assert len(figure.get_axes()) == 2
    page = run_page(result)
    assert page.numbers == summary_rows(summary)[1:]
    assert page.sources == list(summary["cite"].values())


def test_a_run_with_a_mission_and_a_long_name(make):
    brief = make(NAME[:200], simulation={"duration_s": 60.0})
    run = torquer.simulate(brief.replace("mission", {"rate_below_deg_s": 0.3, "within_s": 50.0}))
    check(run.torquer.page())
    assert run_page(run).question.endswith("Required: rate below 0.3 deg/s within 50 s.")


def test_models_are_those_of_the_scenario(make):
    rows = model_rows(make(**WITH_WHEELS))
    labels = [label for label, _ in rows]
    assert len(labels) == len(set(labels))
    told = dict(rows)
    assert told["Coils"] == "limit 3\u00a0A\u00a0m²"
    assert told["Law coils"] == "unloading, gain 0.001\u00a01/s"
    assert told["Orbit"].startswith("circular, altitude 500\u00a0km, inclination 51.6\u00a0deg")
    assert "layout (four sided pyramid, alpha 54.7356\u00a0deg" in told["Wheels"]
    assert "Gyro" not in told  # as by default


@pytest.mark.parametrize("members", [60, 2])
def test_a_campaign(members, make):
    result = artificial(members, (0,)).assign_attrs(scenario=make(NAME[:99]).model_dump_json())
    figure = torquer.page(result)
    check(figure)
    assert len(figure.get_axes()) == 2


def test_a_campaign_without_a_run_that_ended(make):
    result = artificial(2, (0, 1)).assign_attrs(scenario=make().model_dump_json())
    figure = torquer.page(result)
    check(figure)
    assert figure.get_axes() == []


def test_a_coil():
    figure = torquer.page(coil(CoilRequest(dipole_a_m2=3.2, diameter_m=0.3, mass_kg=0.4)))
    check(figure)


def test_what_has_no_page():
    with pytest.raises(TypeError, match=r"page: must be given one of .*GainSweep.*; received dict"):
        torquer.page({})


def test_the_file_has_the_same_bytes_each_time(detumble, tmp_path):
    from torquer.report.common.one_page import save_page

    page = run_page(detumble)
    first, second = (save_page(page, tmp_path).read_bytes() for _ in range(2))
    assert first == second and first.startswith(b"%PDF")
    assert first.count(b"/Type /Page ") == 1


def filter_check(started: bool) -> FilterCheck:
    """A check of a consistent filter with made-up errors, or of one that never started."""
    scenario = torquer.load_scenario("examples/which_sensors.toml")
    rng, t_s, n = np.random.default_rng(5), np.linspace(0.0, 12_000.0, 120), 6
    errors = 1e-3 * rng.normal(size=(12, len(t_s), n)) if started else np.full((12, 120, n), np.nan)
    covariance = np.broadcast_to(1e-6 * np.eye(n), (12, len(t_s), n, n))
    counts = np.ones((12, len(t_s)))
    innovations = {"sun": rng.normal(size=(12, len(t_s), 3))}
    steps = (*told_of_steps(0.3, 0.0),)
    runs = FilterRuns(t_s, errors, covariance, innovations, 0.0 * counts, counts, counts, [], steps)
    expected = Expected(t_s, covariance[0], t_s < 7000.0)
    checks = [Check("NEES of the attitude", 1.0, 0.5, 1.5, 0.95, True)] * started
    return FilterCheck(scenario, 12, [], checks, runs, runs, expected)


@pytest.mark.parametrize(("started", "plots"), [(True, 4), (False, 0)])
def test_a_filter_check(started, plots, tmp_path):
    found = filter_check(started)
    figure = torquer.page(found)
    check(figure)
    texts = " ".join(" ".join(each.get_text().split()) for each in figure.findobj(Text))
    assert "the steps of RK4 damped up to 30 %" in texts
    html = write_page(found, tmp_path / "report.html").read_text(encoding="utf-8")
    assert "the steps of RK4 damped up to 30 %" in html
    assert len([each for part in figure.subfigs for each in part.get_axes()]) == plots
    for part in figure.subfigs:  # labels of axes above each other do not overlap
        boxes = [each.yaxis.label.get_window_extent() for each in part.get_axes()]
        assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))
