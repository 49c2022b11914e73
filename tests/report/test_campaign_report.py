"""The report on a campaign against its own statistics; pictures, page, comparison."""

import json
import math
import re
import warnings

import matplotlib.image
import numpy as np
import pytest
import xarray as xr
from artificial_campaign import artificial
from scipy import stats
from slow_cases import slow_after
from unpacking import figures_on, numbers, trace

from torquer.campaign.comparison import comparison, mean_difference, rate_difference
from torquer.campaign.contents import least_is_worst, member_outcomes, missing_as_worst
from torquer.campaign.several import compare_several, holm
from torquer.campaign.statistics import (
    chance_correlation,
    mean_interval,
    quantile,
    quantile_interval,
    rate_interval,
)
from torquer.campaign.summary import campaign_summary, summary_rows
from torquer.report.campaign import (
    compare_campaigns,
    compare_several_campaigns,
    write_campaign_report,
)
from torquer.report.campaign.bands import percentiles
from torquer.report.campaign.convergence import means
from torquer.report.campaign.distribution import draw_distribution
from torquer.report.campaign.interactive import distribution_figure, sobol_figure
from torquer.report.campaign.several import several_grid
from torquer.report.campaign.shared import input_labels, outcome_in_words, steps
from torquer.report.campaign.tables import comparison_grid, worst_grid

FAILED = (3, 20)


@pytest.fixture(scope="module")
def result():
    return artificial(60, FAILED, first=100)


@pytest.fixture(scope="module")
def summary(result):
    return campaign_summary(result)


@pytest.fixture(scope="module")
def written(result, tmp_path_factory):
    return write_campaign_report(result, tmp_path_factory.mktemp("report") / "new" / "folder")


def check_pictures(paths) -> None:
    for path in paths:
        picture = matplotlib.image.imread(path)[..., :3]
        assert picture.shape[1] > 900 and np.mean(np.ptp(picture, axis=2) > 0.15) > 1e-4, path


def test_numbers_are_those_of_statistics(result, summary):
    succeeded = int(result["succeeded"].sum())
    assert (summary["members"], summary["failed"]) == (60, 2)
    assert summary["success"]["rate"] == succeeded / 60
    assert tuple(summary["success"]["interval"]) == rate_interval(succeeded, 60)
    for name, values in member_outcomes(result).items():
        each = summary["outcomes"][name]
        assert each["missing"] == np.isnan(values).sum() >= 2
        assert each["mean"] == pytest.approx(np.nanmean(values))
        assert tuple(each["mean_interval"]) == mean_interval(values)
    values = member_outcomes(result)["settling_s"]
    for part, found in summary["outcomes"]["settling_s"]["quantiles"].items():
        low, high = quantile_interval(values, float(part))
        wanted = [quantile(values, float(part)), low, high]
        received = [found["value"], *found["interval"]]
        assert received == [None if math.isinf(x) else x for x in wanted]
    json.dumps(summary, allow_nan=False)


def test_restricted_mean_counts_missing_times_as_end_of_run():
    """96 of 256 members settle: the mean of these alone says how fast some are, not how fast."""
    result = artificial(256)
    settling = np.where(np.arange(256) < 96, np.linspace(2000.0, 4000.0, 256), np.nan)
    result["settling_s"][:] = settling
    found = campaign_summary(result)
    each = found["outcomes"]["settling_s"]
    counted = np.where(np.isnan(settling), 6000.0, settling)
    assert each["restricted_mean"]["end_s"] == 6000.0
    assert each["restricted_mean"]["mean"] == pytest.approx(counted.mean())
    known = stats.ttest_1samp(counted, 0.0).confidence_interval()
    assert each["restricted_mean"]["mean_interval"] == pytest.approx([known.low, known.high])
    rows = dict(summary_rows(found))
    assert rows["settling_s [s]"].startswith(f"mean of 96 of 256 {np.nanmean(settling):.4g} (")
    assert f"restricted mean (at most 6000) {counted.mean():.4g} (" in rows["settling_s [s]"]
    assert "median missing" in rows["settling_s [s]"]
    assert rows["Stop"].startswith("not while members have no settling_s (160 of 256)")
    assert found["outcomes"]["coil_energy_j"]["restricted_mean"] is None


def test_nothing_is_drawn_of_members_that_all_never_settle(tmp_path):
    result = artificial(20)
    result["settling_s"][:] = np.nan
    rows = dict(summary_rows(campaign_summary(result)))
    assert rows["settling_s [s]"].startswith(
        "mean unknown: no member has a value; restricted mean (at most"
    )
    names = {path.stem for path in write_campaign_report(result, tmp_path)}
    assert "distribution_settling_s" not in names and "convergence" in names


def test_distribution_of_a_time_extends_to_end_of_run(result, summary):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        axes = draw_distribution(result, summary, "settling_s").axes[1]
    assert axes.get_xlim()[1] >= 6000.0
    members, there = 60, int(np.isfinite(result["settling_s"].values).sum())
    low, high = rate_interval(there, members)
    band = axes.collections[0].get_paths()[0].vertices
    assert {low, high} <= {*band[band[:, 0] == axes.get_xlim()[1], 1]}
    share = np.isfinite(result["settling_s"].values).mean()
    assert axes.lines[-1].get_ydata()[-1] == pytest.approx(share)


def settling_axis(settling):
    """Ends of the axis of times, of which the run has 6000 s, in the picture and in the page."""
    result = artificial(100)
    result["settling_s"][:] = settling
    summary = campaign_summary(result)
    figure = distribution_figure(result, summary, "settling_s")
    last = trace(figure, "share of members")[0][-1]
    return draw_distribution(result, summary, "settling_s").axes[1].get_xlim()[1], last


def test_the_axis_of_times_is_that_of_the_times():
    """55 to 82 s of a run of 6000 s were a line; so is an end that all reached long before."""
    near = np.linspace(55.0, 82.0, 100)
    assert settling_axis(near) == (pytest.approx(82.54), 82.0)
    assert settling_axis(np.where(near > 80.0, np.nan, near))[0] < 90.0
    late = np.linspace(2000.0, 4500.0, 100)
    assert settling_axis(late)[0] == pytest.approx(4550.0)
    assert settling_axis(np.where(late > 4400.0, np.nan, late)) == (6000.0, 6000.0)


def test_intervals_stay_within_the_bounds_of_their_outcome():
    result = artificial(6)
    result["coil_energy_j"][:] = [0.1, 0.2, 0.1, 90.0, 0.3, 0.1]
    result["sun_part"][:] = [1.0, 1.0, 1.0, 1.0, 0.2, 1.0]
    found = campaign_summary(result)["outcomes"]
    assert mean_interval(result["coil_energy_j"].values).low < 0.0
    assert found["coil_energy_j"]["mean_interval"][0] == 0.0
    assert found["sun_part"]["mean_interval"][1] == 1.0


def test_missing_value_is_worst_in_the_sense_of_its_condition(result, summary):
    """Of the part of time in the Sun, which must be above a value, small ones are bad."""
    assert least_is_worst(result, "sun_part") and not least_is_worst(result, "settling_s")
    assert summary["outcomes"]["sun_part"]["quantiles"]["0.01"]["value"] is None
    assert summary["outcomes"]["sun_part"]["quantiles"]["0.99"]["value"] is not None
    assert np.all(missing_as_worst(result, "sun_part")[list(FAILED)] == -np.inf)


def test_worst_members_are_named_by_their_numbers(result, summary):
    found = summary["outcomes"]["sun_part"]["worst"]
    values = result["sun_part"].to_series().dropna().sort_values()
    assert [each["member"] for each in found] == values.index[:5].tolist()
    assert [each["value"] for each in found] == values.to_list()[:5]
    never = summary["outcomes"]["settling_s"]["worst"][0]
    assert never["value"] is None and never["member"] - 100 not in FAILED
    assert [each["member"] for each in summary["failures"]] == [103, 120]


def test_what_an_outcome_depends_on_is_found(summary):
    assert summary["chance_correlation"] == chance_correlation(60)
    first = {pair["outcome"]: pair["input"] for pair in reversed(summary["correlations"])}
    assert first["settling_s"] == first["coil_energy_j"] == "|initial.rate_deg_s|"
    assert all(abs(p["correlation"]) > chance_correlation(60) for p in summary["correlations"])


def test_rows_for_a_terminal(summary):
    rows = dict(summary_rows(summary))
    assert rows["Members"] == "60" and rows["Failed"] == "2"
    assert f"{summary['success']['rate']:.2%} (95 % interval" in rows["Success rate"]
    mean = summary["outcomes"]["coil_energy_j"]["mean"]
    assert rows["coil_energy_j [J]"].startswith(f"mean of 58 of 60 {mean:.4g} (")
    assert rows["Rank correlation: coil_energy_j"].startswith("|initial.rate_deg_s| +")


def test_every_picture_is_written_and_shows_something(written):
    assert {path.stem for path in written[1:]} == {
        *(f"distribution_{name}" for name in
          ("settling_s", "final_rate_deg_s", "sun_part", "coil_energy_j")),
        *("series_settling_s", "series_sun_part", "scatter", "correlations", "convergence"),
    }  # fmt: skip
    check_pictures(written[1:])


def test_the_page_has_the_numbers_and_loads_nothing(summary, written):
    assert written[0].name == "report.html"
    text = written[0].read_text(encoding="utf-8")
    low, high = summary["success"]["interval"]
    assert f"{summary['success']['rate']:.2%} (95 % interval {low:.2%} to {high:.2%})" in text
    for each in summary["outcomes"].values():
        low, high = each["mean_interval"]
        assert f"{each['mean']:.4g} ({low:.4g} to {high:.4g})" in text
        for worst in each["worst"]:
            assert f"torquer campaign FILE --member {worst['member']}<" in text
    assert "default-src 'none'" in text and "<img" not in text
    assert not re.search(r'<[^>]*(src|href)="(?!#)', text)
    assert 'id="sources"' in text and "@software{torquer," in text
    assert "need JavaScript; the PNG files next to this page show the same" in text


def test_page_plots_have_the_same_numbers_as_the_pictures(result, summary, written):
    import plotly.graph_objects as go

    figures = figures_on(written[0].read_text(encoding="utf-8"))
    for figure in figures.values():
        go.Figure(figure)
    shown = figures["Distribution of settling."]
    x, share = trace(shown, "share of members")
    known = member_outcomes(result)["settling_s"]
    for k in (5, 20):
        assert share[k] == pytest.approx(np.mean(known <= x[k]), rel=1e-6)
    edges, counts = trace(shown, "members")
    assert counts[1:-1:2].sum() == np.isfinite(known).sum() and edges[0] == np.nanmin(known)
    levels = [each["x0"] for each in shown["layout"]["shapes"]]
    for each in summary["outcomes"]["settling_s"]["quantiles"].values():
        assert each["value"] is None or each["value"] in levels
    rate = figures["Rate over time."]
    _, median = trace(rate, "median")
    series = result["series.settling_s"].transpose("member", "time").values
    flown = series[(result["how_it_ended"] == "complete").values]
    assert median[-1] == pytest.approx(percentiles(flown)[2, -1])
    bars = figures["Rank correlations of outcomes with inputs."]["data"]
    pairs = {(bar["name"], key): r for bar in bars if bar["type"] == "bar"
             for key, r in zip(bar["y"], bar["x"], strict=True)}  # fmt: skip
    said = input_labels({each["input"] for each in summary["correlations"]})
    for each in summary["correlations"][:5]:
        assert (
            pairs[outcome_in_words(summary, each["outcome"]), said[each["input"]]]
            == each["correlation"]
        )
    converged = figures["Convergence of the success rate."]
    assert trace(converged, "estimate")[1][-1] == pytest.approx(summary["success"]["rate"])


def of_group(first, first_interval, total, total_interval) -> dict:
    return {"first": first, "first_interval": first_interval,
            "total": total, "total_interval": total_interval}  # fmt: skip


def test_bars_of_sobol_indices_have_their_intervals():
    import plotly.graph_objects as go

    groups = {
        "scale": of_group(0.2, [0.1, 0.35], 0.3, [0.2, 0.5]),
        "law.gain_a_m2_s_per_t": of_group(0.6, [None, None], 0.7, [0.5, 0.8]),
    }
    figure = sobol_figure(groups)
    go.Figure(figure)
    first, total = figure["data"]
    assert first["y"] == total["y"] == ["law gain [A m² s/T]", "scale"]  # the greatest on top
    assert first["x"] == [0.6, 0.2] and total["x"] == [0.7, 0.3]
    assert first["error_x"]["array"] == pytest.approx([0.0, 0.15])
    assert first["error_x"]["arrayminus"] == pytest.approx([0.0, 0.1])
    assert figure["layout"]["yaxis"]["autorange"] == "reversed"


def test_scatter_menu_shows_one_input_at_a_time(written):
    figures = figures_on(written[0].read_text(encoding="utf-8"))
    figure = figures["settling over inputs."]
    (menu,) = figure["layout"]["updatemenus"]
    shown = [button["args"][0]["visible"] for button in menu["buttons"]]
    assert len(shown) > 1 and np.sum(shown, axis=0).tolist() == [1] * len(figure["data"])
    assert [trace["visible"] for trace in figure["data"]] == shown[0]


def test_latin_hypercube_member_flies_again_with_all_its_runs(result, summary):
    table = json.loads(result.attrs["campaign"])
    _, rows = worst_grid(summary, table | {"sampling": "latin_hypercube", "runs": 70})
    assert rows and all(row[0].endswith(" --runs 70") for row in rows)


def test_text_of_the_scenario_is_escaped(written):
    text = written[0].read_text(encoding="utf-8")
    assert "From &lt;rest&gt; &amp; back" in text and "<rest>" not in text
    assert "rate &lt;exceeded&gt; 100 deg/s" in text and "<exceeded>" not in text


@pytest.mark.parametrize(
    ("members", "failed"), slow_after(2, [(5, range(5)), (1, ()), (4, (0, 1))], names=2)
)
def test_few_members_and_failed_ones_have_a_report(members, failed, tmp_path):
    few = artificial(members, failed)
    found = campaign_summary(few)
    json.dumps(found, allow_nan=False)
    assert found["failed"] == len(failed) and summary_rows(found)
    paths = write_campaign_report(few, tmp_path)
    paths += compare_campaigns(few, few, tmp_path / "compared")
    assert all(path.stat().st_size > 3000 for path in paths)


def test_without_what_may_be_left_out_there_is_a_report(tmp_path):
    """No conditions, nothing varied, no series, equal values, a table without optional keys."""
    t = {"role": "outcome", "signal": '"coil_energy_j"', "what": "null"}
    result = xr.Dataset(
        {"energy_j": ("member", np.full(4, 2.0), t),
         "how_it_ended": ("member", ["complete"] * 4), "ended": ("member", [""] * 4)},
        {"member": np.arange(4)},
        {"scenario": '{"name": "$x$ <b>"}', "campaign": '{"runs": 10}', "versions": "{}"},
    )  # fmt: skip
    paths = write_campaign_report(result, tmp_path)
    assert [path.stem for path in paths] == ["report", "distribution_energy_j", "convergence"]
    text = paths[0].read_text(encoding="utf-8")
    assert "$x$ &lt;b&gt;: campaign" in text and "4 of 10 runs" in text
    assert campaign_summary(result)["success"] is None


def test_it_is_the_same_from_a_file(result, summary, tmp_path):
    result.to_netcdf(tmp_path / "campaign.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "campaign.nc", engine="h5netcdf") as again:
        assert campaign_summary(again) == summary


def test_bands_are_values_of_members():
    series = np.random.default_rng(3).normal(size=(37, 4))
    series[5, 2] = np.nan
    for part, found in zip((0.05, 0.5, 0.95), percentiles(series, (0.05, 0.5, 0.95)), strict=True):
        assert found.tolist() == [quantile(column, part) for column in series.T]


def test_the_distribution_function_counts_missing_members():
    assert [each.tolist() for each in steps(np.array([3.0, np.inf, 1.0, 2.0]))] == [
        [1.0, 1.0, 2.0, 3.0], [0.0, 0.25, 0.5, 0.75]
    ]  # fmt: skip
    assert steps(np.array([-np.inf, 1.0]))[1].tolist() == [0.5, 1.0]


def test_convergence_ends_at_the_mean_of_all(result):
    values = member_outcomes(result)["settling_s"]
    found = means(values, [10, 60], 0.95)
    assert tuple(found[1]) == (pytest.approx(np.nanmean(values)), *mean_interval(values))


# ------------------------------------------------------------------ two campaigns


def test_members_with_the_same_inputs_are_compared_in_pairs(result):
    other = artificial(60, FAILED, factor=1.1, first=100)
    found = comparison(result, other)
    within = other["coil_energy_j"].values - result["coil_energy_j"].values
    assert found["pairs"] == 60
    each = found["outcomes"]["coil_energy_j"]
    assert each["difference"] == pytest.approx(np.nanmean(within))
    assert tuple(each["interval"]) == mean_interval(within) and each["interval"][0] > 0.0
    gained, lost = found["success"]["gained"], found["success"]["lost"]
    assert gained - lost == int(other["succeeded"].sum() - result["succeeded"].sum())
    p = stats.wilcoxon(np.nan_to_num(within)).pvalue  # missing in both: no difference
    assert each["test"] == {"name": "Wilcoxon signed-rank", "p": pytest.approx(p, rel=1e-9, abs=0)}
    p = stats.binomtest(gained, gained + lost).pvalue if gained + lost else 1.0
    assert found["success"]["test"] == {"name": "McNemar", "p": p}


def test_other_members_are_independent(result):
    other = artificial(80, seed=9)
    found = comparison(result, other)
    assert found["pairs"] == 0 and found["outcomes"]["sun_part"]["interval"][0] < 0.0
    with pytest.raises(ValueError, match="must have a common outcome"):
        comparison(result, other.drop_vars(list(member_outcomes(other))))


def test_a_campaign_compared_with_itself_differs_in_nothing(result):
    found = comparison(result, result)
    for each in (*found["outcomes"].values(), found["success"]):
        assert each["difference"] == 0.0 and each["test"]["p"] == 1.0


@pytest.mark.slow
@pytest.mark.parametrize("pairs", [True, False])
def test_tests_err_as_seldom_as_they_say(pairs):
    """Of campaigns that are alike but for noise: p is uniform; missing values count as worst."""
    found = []
    for seed in range(100):
        a, b = (artificial(40, (1, 2 + k), seed=2 * seed + (0 if pairs else k)) for k in range(2))
        noise = np.random.default_rng(seed).normal(size=(2, 40))
        for each, values in zip((a, b), noise, strict=True):
            each["coil_energy_j"][:] = np.where(values > 2.0, np.nan, values)
        compared = comparison(a, b)
        assert (compared["pairs"] > 0) == pairs
        found.append(compared["outcomes"]["coil_energy_j"]["test"]["p"])
    assert stats.kstest(found, stats.uniform.cdf).pvalue > 0.01


def test_comparison_ranks_never_settled_worse_than_any_value():
    a, b = artificial(40), artificial(40, seed=7)
    a["settling_s"][:], b["settling_s"][:] = np.arange(40.0), np.arange(40.0)
    b["settling_s"][10:] = np.nan
    p = stats.mannwhitneyu(np.arange(40.0), [*range(10), *[1e9] * 30]).pvalue
    found = comparison(a, b)["outcomes"]["settling_s"]
    assert found["test"] == {"name": "Mann-Whitney", "p": pytest.approx(p, rel=1e-9)} and p < 1e-4
    assert found["difference"] < 0.0  # of those that settle
    assert found["restricted"]["difference"] == pytest.approx((45.0 + 30 * 6000.0 - 780.0) / 40.0)
    rows = {row[0]: row[1:] for row in comparison_grid(comparison(a, b))[1]}
    assert rows["  restricted mean (B - A: at most 6000)"][2].startswith("4482 (")


def test_intervals_of_differences_are_the_known_ones():
    """scipy's Welch interval; R. Newcombe's example (a) of method 10: 56/70 and 48/80."""
    rng = np.random.default_rng(4)
    one, other = rng.normal(0.0, 1.0, 12), rng.normal(1.0, 3.0, 30)
    known = stats.ttest_ind(other, one, equal_var=False).confidence_interval(0.9)
    assert mean_difference(one, other, 0.9)[1] == pytest.approx((known.low, known.high))
    difference, interval = rate_difference((48, 80), (56, 70))
    assert difference == pytest.approx(0.2)
    assert interval == pytest.approx((0.0524, 0.3339), abs=5e-5)


def test_the_page_of_two_campaigns(result, tmp_path):
    other = artificial(60, FAILED, factor=1.1, name="<other> & $x$", first=100)
    paths = compare_campaigns(result, other, tmp_path)
    found = comparison(result, other)
    text = paths[0].read_text(encoding="utf-8")
    assert "B: &lt;other&gt; &amp; $x$" in text and "<other>" not in text
    for each in found["outcomes"].values():
        assert f"{each['difference']:.4g} (" in text
    assert [path.stem for path in paths[1:]] == [
        *(f"cdf_{name}" for name in member_outcomes(result)),
        "differences",
    ]
    check_pictures(paths[1:])
    figures = figures_on(text)
    settled = figures["Distribution functions: settling."]
    for campaign, each in zip((result, other), settled["data"], strict=True):
        x, share = numbers(each["x"]), numbers(each["y"])
        known = member_outcomes(campaign)["settling_s"]
        assert share[7] == pytest.approx(np.mean(known <= x[7]), rel=1e-6)
    shown = [figure for words, figure in figures.items() if words.startswith("Difference of")]
    assert len(shown) == len(found["outcomes"]) + 1
    assert numbers(shown[0]["data"][0]["x"]).tolist() == list(found["success"]["interval"])


# ------------------------------------------------------------------ more than two


def test_each_of_several_campaigns_is_compared_with_the_first(result):
    others = [artificial(60, FAILED, factor=f, first=100, name=f"f{f}") for f in (1.1, 1.0, 2.0)]
    found = compare_several([result, *others])
    assert found["names"] == ["tumbling", "f1.1", "f1.0", "f2.0"] and found["pairs"] == [60] * 3
    for name, each in found["outcomes"].items():
        for one, other in zip(each["against_first"], others, strict=True):
            assert one == comparison(result, other)["outcomes"][name]
    energy = found["outcomes"]["coil_energy_j"]
    assert energy["test"]["name"] == "Friedman" and energy["test"]["p"] < 1e-10
    assert energy["adjusted_p"][1] == 1.0 > energy["adjusted_p"][0] > 0.0
    head, rows = several_grid(found)
    assert head == ("", "A: tumbling", "B: f1.1", "C: f1.0", "D: f2.0")
    assert all(len(row) == len(head) for row in rows)
    shown = {row[0]: row[1:] for row in rows}
    assert shown["members"] == ("60",) * 4 and "  difference from A" in shown


def test_of_other_members_the_ranks_of_all_are_tested():
    """Kruskal-Wallis as SciPy has it, with a missing value worse than any other."""
    made = [artificial(40 + k, seed=3 * k + 1) for k in range(3)]
    found = compare_several(made)["outcomes"]["settling_s"]
    ranked = [missing_as_worst(each, "settling_s") for each in made]
    assert found["test"]["name"] == "Kruskal-Wallis"
    assert found["test"]["p"] == pytest.approx(stats.kruskal(*ranked).pvalue, rel=1e-9)


def test_campaigns_that_are_one_differ_in_nothing(result):
    found = compare_several([result] * 3)
    for each in found["outcomes"].values():
        assert each["test"]["p"] == 1.0 and each["adjusted_p"] == [1.0, 1.0]


def test_adjusted_p_are_those_of_holm():
    """S. Holm's step-down: times 4, 3, 2, 1, never falling, at most 1."""
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.5, None, 0.9]) == [1.0, None, 1.0] and holm([]) == []


@pytest.mark.parametrize("count", [1, 7])
def test_so_many_cannot_be_compared(result, count):
    with pytest.raises(ValueError, match=rf"^campaigns: must be 2 to 6; received {count}$"):
        compare_several([result] * count)


def test_several_without_an_outcome_in_common_are_refused(result):
    names = list(member_outcomes(result))
    parts = [
        result.drop_vars([n for n in names if n not in kept]) for kept in (names[:1], names[1:2])
    ]
    with pytest.raises(ValueError, match="campaigns: must have an outcome that all of them have"):
        compare_several([result, *parts])


def test_the_page_on_several_has_every_outcome(result, tmp_path):
    others = [artificial(60, FAILED, factor=f, first=100) for f in (1.1, 2.0)]
    page, *pictures = compare_several_campaigns([result, *others], tmp_path / "out")
    text = page.read_text()
    assert {each.stem for each in pictures} == {f"cdf_{name}" for name in member_outcomes(result)}
    assert "Holm" in text and "Friedman" in text
    for name in member_outcomes(result):
        said = outcome_in_words(campaign_summary(result), name)
        assert f"Distribution functions: {said}." in text
