"""Outcomes by category: the test, its place among the correlations, and the rows."""

import math

import numpy as np
import pytest
from artificial_campaign import artificial
from scipy import stats

from torquer.campaign.categories import by_category, categories_of, kruskal_wallis
from torquer.campaign.statistics import chance_correlation
from torquer.campaign.summary import campaign_summary, summary_rows
from torquer.report.campaign import write_campaign_report
from torquer.report.campaign.interactive import category_figure
from torquer.report.campaign.tables import category_grid, correlation_grid


def rows_of(which):
    return [np.flatnonzero(which == k) for k in range(int(which.max()) + 1)]


@pytest.mark.parametrize("groups", [2, 3, 7])
def test_the_test_is_that_of_scipy_with_ties_and_missing_values(groups):
    rng = np.random.default_rng(groups)
    which = rng.integers(0, groups, 90)
    values = np.round(rng.normal(size=90) + 0.4 * which, 1)
    values[::9] = np.inf
    found = kruskal_wallis(values, rows_of(which), 0.95)
    expected = stats.kruskal(*(values[rows] for rows in rows_of(which)))
    assert found["h"] == pytest.approx(expected.statistic, rel=1e-12)
    assert found["p"] == pytest.approx(expected.pvalue, rel=1e-9)


def test_of_two_groups_it_is_a_rank_correlation():
    rng = np.random.default_rng(1)
    which, values = rng.integers(0, 2, 60), rng.normal(size=60)
    found = kruskal_wallis(values, rows_of(which), 0.95)
    assert found["between"] == pytest.approx(abs(stats.spearmanr(which, values).statistic))
    assert found["chance"] == pytest.approx(chance_correlation(60), rel=0.02)


def test_groups_that_do_not_differ_exceed_chance_as_often_as_stated():
    rng, which = np.random.default_rng(2), np.arange(60) % 3
    trials = [kruskal_wallis(rng.random(60), rows_of(which), 0.9) for _ in range(400)]
    beyond = np.mean([each["between"] > each["chance"] for each in trials])
    assert abs(beyond - 0.1) < 4.0 * math.sqrt(0.09 / 400)


def test_values_that_are_all_the_same_have_no_test():
    found = kruskal_wallis(np.full(10, 3.0), rows_of(np.arange(10) % 2), 0.95)
    assert (found["h"], found["p"], found["between"]) == (None, None, None)


def test_texts_tables_and_lists_of_different_lengths_are_categories():
    inputs = {
        "law": ["a", "b"] * 3, "table": [{"kind": "off"}, {"kind": "on"}] * 3,
        "lists": [[1.0], [1.0, 2.0]] * 3, "number": [1.0, 2.0] * 3, "one": ["a"] * 6,
        "names": [f"{k}" for k in range(6)],
    }  # fmt: skip
    found = categories_of(inputs)
    assert [*found] == ["law", "table", "lists"]
    assert [*found["table"]] == ['{"kind": "off"}', '{"kind": "on"}']
    assert [rows.tolist() for rows in found["law"].values()] == [[0, 2, 4], [1, 3, 5]]


@pytest.fixture(scope="module")
def result():
    """Sixty members of two laws, one of which takes twice as long to settle."""
    data = artificial(60).drop_vars("control.kind")
    laws = np.array(["slow", "fast"])[np.arange(60) % 2]
    data["settling_s"] = data["settling_s"].copy(
        data=data["settling_s"] * np.where(laws == "slow", 4, 1)
    )
    data["control.law.function"] = ("member", laws, {"role": "input", "units": ""})
    return data


def test_a_law_that_varies_has_its_place_among_the_sensitivities(result):
    summary = campaign_summary(result)
    (found,) = summary["categories"]
    slow, fast = (each for each in reversed(found["categories"]))
    assert (slow["value"], slow["members"], fast["members"]) == ("slow", 30, 30)
    medians = [each["outcomes"]["settling_s"]["0.5"]["value"] for each in (slow, fast)]
    assert medians[0] is None or medians[0] > 2.0 * medians[1]
    (place,) = [
        each for each in summary["correlations"]
        if (each["outcome"], each["input"]) == ("settling_s", "control.law.function")
    ]  # fmt: skip
    assert place["of"] == "categories" and place["correlation"] > 0.4
    rows = dict(summary_rows(summary))
    assert (
        f"control.law.function {place['correlation']:.2f} between categories"
        in (rows["Rank correlation: settling_s"])
    )
    assert rows["By control.law.function"].startswith("fast (30 members, ")
    assert "; Kruskal-Wallis p = " in rows["  settling_s [s]"]


def test_the_report_shows_them(result, tmp_path):
    summary = campaign_summary(result)
    (found,) = summary["categories"]
    head, rows = category_grid(found)
    assert head[:3] == ("control.law.function", "members", "success")
    assert len(rows) == 3 and all(len(row) == len(head) for row in rows)
    figure = category_figure(found, "final_rate_deg_s")
    assert figure is not None and len(figure["data"][0]["x"]) == 2
    assert any("between categories" in row[2] for row in correlation_grid(summary)[1])
    write_campaign_report(result, tmp_path)
    assert "By control.law.function" in (tmp_path / "report.html").read_text()


def test_members_of_no_category_have_none():
    assert by_category(artificial(20).drop_vars("control.kind")) == []
