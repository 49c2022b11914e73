"""Sobol's indices: the design, the estimators on functions that are known, and a campaign flown."""

import json
import math

import matplotlib.image
import numpy as np
import pytest
import xarray as xr
from scipy import stats

import torquer
from torquer.campaign.comparison import comparison
from torquer.campaign.contents import independent
from torquer.campaign.load import campaign_from_data
from torquer.campaign.sampling import draw, member_scenario, member_seeds
from torquer.campaign.sensitivity import LEAST_POINTS, intervals, sensitivity, sobol_indices
from torquer.campaign.spec import Campaign
from torquer.campaign.summary import campaign_summary, summary_rows
from torquer.campaign.unit_numbers import unit_numbers
from torquer.compile import engine
from torquer.report.campaign import write_campaign_report

needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
ANGLE = {"uniform": [-math.pi, math.pi]}
A, B = 7.0, 0.1


def ishigami(x):
    return np.sin(x[:, 0]) + A * np.sin(x[:, 1]) ** 2 + B * x[:, 2] ** 4 * np.sin(x[:, 0])


def indices_of_ishigami():
    """First-order and total indices of the Ishigami function. T. Ishigami, T. Homma (1990)."""
    one = 0.5 * (1.0 + B * math.pi**4 / 5.0) ** 2
    two, both = A**2 / 8.0, 8.0 * B**2 * math.pi**8 / 225.0
    variance = one + two + both
    return np.array([one, two, 0.0]) / variance, np.array([one + both, two, both]) / variance


def values_at(points, function, vary=None, **keys):
    """Values of a function of the drawn numbers, as rows: A, B, A with a group of B."""
    vary = vary or {key: ANGLE for key in ("a.x", "b.x", "c.x")}
    rows = len(vary) + len(keys.get("correlated", ())) + 2
    made = Campaign(runs=points * rows, sampling="saltelli", vary=vary, **keys)
    drawn = draw(made, None, np.arange(made.runs))
    return function(np.column_stack([*drawn.values()])).reshape(-1, rows).T


def test_a_point_is_two_members_and_one_for_each_group():
    """Keys of vectors, and correlated keys, are exchanged as a whole."""
    vary = {"a.x": ANGLE, "b.x": {"direction": "uniform", "magnitude": ANGLE}}
    together = {"keys": ["c.x", "d.x"], "mean": [0, 0], "covariance": [[1, 0.5], [0.5, 1]]}
    made = Campaign(runs=5 * 64, sampling="saltelli", vary=vary, correlated=[together], seed=3)
    units = unit_numbers(made, np.arange(made.runs)).reshape(64, 5, 6)
    a, b = units[:, 0], units[:, 1]
    for k, (first, last) in enumerate(((0, 1), (1, 4), (4, 6))):
        expected = a.copy()
        expected[:, first:last] = b[:, first:last]
        assert np.array_equal(units[:, 2 + k], expected)
    assert not np.any(a == b)
    both = np.hstack([a, b])  # a Sobol sequence of 12 numbers: one in each 64th of every range
    assert all(np.unique((column * 64).astype(int)).size == 64 for column in both.T)


def test_a_member_depends_on_its_number_alone():
    vary = {"a.x": ANGLE, "b.x": ANGLE}
    few = Campaign(runs=4 * 3, sampling="saltelli", vary=vary, seed=8)
    many = Campaign(runs=4 * 500, sampling="saltelli", vary=vary, seed=8)
    numbers = np.array([11, 3, 4, 3])
    assert np.array_equal(unit_numbers(many, np.arange(12)), unit_numbers(few, np.arange(12)))
    assert np.array_equal(unit_numbers(few, numbers), unit_numbers(many, np.arange(12))[numbers])
    seeds = member_seeds(many, np.arange(2000)).reshape(-1, 4)
    assert np.all(seeds[:, 2:] == seeds[:, :1]) and np.unique(seeds[:, :2]).size == 1000


@pytest.mark.parametrize(("points", "near"), [(1024, 0.02), (16384, 0.002)])
def test_indices_of_the_ishigami_function_are_the_known_ones(points, near):
    rows = values_at(points, ishigami)
    first, total = sobol_indices(rows[0], rows[1], rows[2:])
    known_first, known_total = indices_of_ishigami()
    assert first == pytest.approx(known_first, abs=near)
    assert total == pytest.approx(known_total, abs=near)
    given = {"f_A": rows[:1], "f_B": rows[1:2], "f_AB": rows[2:, None]}
    scipys = stats.sobol_indices(func=given, n=points)
    assert first == pytest.approx(scipys.first_order, abs=1e-13)
    assert total == pytest.approx(scipys.total_order, abs=1e-13)


def test_correlated_keys_have_one_index_together():
    """y = a + c + d: the variance of c + d is 2 + 2 * 0.5."""
    together = {"keys": ["c.x", "d.x"], "mean": [5, 0], "covariance": [[1, 0.5], [0.5, 1]]}
    rows = values_at(
        4096, lambda x: x.sum(axis=1), {"a.x": {"normal": {"mean": 0, "sigma": 1}}},
        correlated=[together],
    )  # fmt: skip
    for found in sobol_indices(rows[0], rows[1], rows[2:]):
        assert found == pytest.approx([0.25, 0.75], abs=0.01)


def test_intervals_hold_as_often_as_they_say():
    """Of independent points: y = x1 + 0.5 x2 + x1 x2 of normal numbers."""
    known, inside = np.array([1.0, 0.25, 2.0, 1.25]) / 2.25, []
    for seed in range(150):
        a, b = np.random.default_rng(seed).normal(size=(2, 200, 2))
        x = np.array(
            [a, b, np.column_stack([b[:, 0], a[:, 1]]), np.column_stack([a[:, 0], b[:, 1]])]
        )
        rows = x[..., 0] + 0.5 * x[..., 1] + x[..., 0] * x[..., 1]
        found = intervals(rows[0], rows[1], rows[2:], 0.9)
        inside += [each.low <= index <= each.high for each, index in zip(found, known, strict=True)]
    assert 0.84 < np.mean(inside) < 0.94


# ------------------------------------------------------------------ of campaigns


def dataset(values, succeeded=None) -> xr.Dataset:
    """A campaign of two keys with such values of an outcome."""
    about = {"role": "outcome", "signal": '"coil_energy_j"', "what": "null"}
    members = len(values)
    data = {
        "energy_j": ("member", np.asarray(values, dtype=float), about),
        "how_it_ended": ("member", ["complete"] * members),
        "ended": ("member", ["complete"] * members),
        "a.x": ("member", np.arange(members, dtype=float), {"role": "input"}),
    }
    if succeeded is not None:
        data["succeeded"] = ("member", np.asarray(succeeded, dtype=np.int8))
    vary = {"a.x": ANGLE, "b.x": ANGLE}
    table = {"sampling": "saltelli", "runs": members, "vary": vary, "correlated": []}
    attrs = {"scenario": '{"name": "few"}', "campaign": json.dumps(table)}
    return xr.Dataset(data, {"member": np.arange(members)}, attrs)


def linear(points):
    """y = x1 + x2 / 2 of uniform numbers: indices 0.8 and 0.2."""
    vary = {"a.x": ANGLE, "b.x": ANGLE}
    return values_at(points, lambda x: x[:, 0] + 0.5 * x[:, 1], vary)


def test_points_with_missing_values_are_left_out():
    values = linear(256).T.copy()
    values[5, 1] = values[9, 3] = np.nan
    found = sensitivity(dataset(values.ravel()))
    assert found["points"] == 256
    each = found["outcomes"]["energy_j"]
    assert each["points"] == 254
    kept = np.delete(values, [5, 9], axis=0).T
    first, total = sobol_indices(kept[0], kept[1], kept[2:])
    assert [group["first"] for group in each["groups"].values()] == first.tolist()
    assert [group["total"] for group in each["groups"].values()] == total.tolist()
    assert first == pytest.approx([0.8, 0.2], abs=0.05)


def test_no_indices_if_nothing_varies_or_little_is_known():
    same = sensitivity(dataset(np.ones(4 * 64), np.ones(4 * 64)))
    assert [each["groups"] for each in same["outcomes"].values()] == [{}, {}]
    few = linear(LEAST_POINTS - 1).T.ravel()
    assert sensitivity(dataset(few))["outcomes"]["energy_j"]["groups"] == {}
    json.dumps(campaign_summary(dataset(few)), allow_nan=False)


def test_one_failure_in_many_is_no_infinite_interval():
    succeeded = np.ones(4 * 64)
    succeeded[0] = 0.0
    result = dataset(linear(64).T.ravel(), succeeded)
    for group in sensitivity(result)["outcomes"]["success"]["groups"].values():
        for end in (*group["first_interval"], *group["total_interval"]):
            assert abs(end) < 100.0


def test_statistics_are_of_the_members_that_are_independent():
    """Those with one group exchanged are no further ones: intervals would be too narrow."""
    rows = linear(256)
    result = dataset(rows.T.ravel())
    own = rows[:2].T.ravel()
    assert independent(result)["energy_j"].values.tolist() == own.tolist()
    summary = campaign_summary(result)
    assert (summary["members"], summary["independent"]) == (1024, 512)
    assert summary["outcomes"]["energy_j"]["mean"] == own.mean()
    t = stats.ttest_1samp(own, 0.0).confidence_interval()
    assert summary["outcomes"]["energy_j"]["mean_interval"] == pytest.approx(
        [max(t.low, 0.0), t.high]
    )
    assert summary["chance_correlation"] == pytest.approx(2.0 / math.sqrt(512), rel=0.03)
    assert comparison(result, result)["pairs"] == 512


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({"runs": 10}, "runs: must be a multiple of 3, the members of a point of sampling "
         "'saltelli', best with a power of 2 of them; received 10"),
        ({"vary": {}}, "vary: must have a key with sampling 'saltelli'; received none"),
        ({"stop": {"outcome": "coil_energy_j", "half_width": 1.0}},
         "stop: must be left out with sampling 'saltelli', which must be complete"),
    ],
)  # fmt: skip
def test_mistakes_are_reported(make, keys, expected):
    noise = {"spacecraft.magnetometer.noise_nt": {"uniform": [0, 50]}}
    with pytest.raises(ValueError) as caught:
        campaign_from_data({"runs": 12, "sampling": "saltelli", "vary": noise, **keys}, make())
    assert str(caught.value) == f"campaign.{expected}"


# ------------------------------------------------------------------ flown


@pytest.fixture(scope="module")
def flown(make):
    """Tip-offs under a law that reads the magnetometer alone: the gyro has no influence."""
    scenario = make({
        "control": {"law": {"kind": "bdot", "gain_a_m2_s_per_t": 1e6}, "sample_s": 2.0},
        "spacecraft.magnetometer": {"noise_nt": 200.0},
        "simulation.duration_s": 300.0,
    })  # fmt: skip
    table = {
        "runs": 5 * 64,
        "sampling": "saltelli",
        "vary": {
            "initial.rate_deg_s": {"direction": "uniform", "magnitude": {"uniform": [0.5, 5.0]}},
            "spacecraft.gyro.bias_deg_s": {"normal": {"mean": [0, 0, 0], "sigma": 1.0}},
            "control.law.gain_a_m2_s_per_t": {"log_uniform": [1e4, 1e6]},
        },
        "success": {"final_rate_deg_s": {"below": 2.0}},
    }
    made = campaign_from_data(table, scenario)
    return scenario, made, torquer.fly_campaign(scenario, made)


@needs_jit
def test_a_key_without_influence_has_index_zero(flown):
    """Exactly, as all but one member of a point have the same noise."""
    scenario, made, result = flown
    found = campaign_summary(result)["sensitivity"]["outcomes"]
    for name in ("final_rate_deg_s", "coil_energy_j", "success"):
        groups = found[name]["groups"]
        assert found[name]["points"] == 64
        gyro = groups["spacecraft.gyro.bias_deg_s"]
        assert (gyro["first"], gyro["total"]) == (0.0, 0.0)
        assert gyro["total_interval"] == [0.0, 0.0]
        assert groups["initial.rate_deg_s"]["total_interval"][0] > 0.3
    seeds = result["seed"].values.reshape(64, 5)
    assert member_scenario(scenario, made, 7).seed == seeds[1, 2] == seeds[1, 0] != seeds[1, 1]


@needs_jit
def test_indices_are_shown(flown, tmp_path):
    summary = campaign_summary(flown[2])
    each = summary["sensitivity"]["outcomes"]["final_rate_deg_s"]["groups"]["initial.rate_deg_s"]
    rows = dict(summary_rows(summary))
    shown = f"initial.rate_deg_s {each['first']:.2f}, {each['total']:.2f}; "
    assert rows["Sobol indices S1, ST: final_rate_deg_s"].startswith(shown)
    assert rows["Independent members"].startswith("128,")
    paths = {path.stem: path for path in write_campaign_report(flown[2], tmp_path)}
    text = paths["report"].read_text(encoding="utf-8")
    assert "the 64 points of Saltelli" in text and f"{each['total']:.4g} (" in text
    picture = matplotlib.image.imread(paths["sobol"])[..., :3]
    assert picture.shape[1] > 900 and np.mean(np.ptp(picture, axis=2) > 0.15) > 1e-3
