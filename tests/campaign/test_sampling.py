"""Members of campaigns: distributions, independence, designs, and scenarios of members."""

from datetime import UTC, datetime, timedelta
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy import stats
from scipy.spatial.transform import Rotation
from scipy.stats import qmc

from torquer.campaign.sampling import draw, draw_values, member_scenario, member_seeds
from torquer.campaign.spec import Campaign
from torquer.campaign.unit_numbers import random_words, unit_numbers
from torquer.scenario.change import value_at
from torquer.scenario.load import ScenarioError

N = 20_000
NOISE, BIAS, RATE = (
    "spacecraft.magnetometer.noise_nt",
    "spacecraft.magnetometer.bias_nt",
    "initial.rate_deg_s",
)
SAMPLINGS = ("random", "latin_hypercube", "sobol")
#: A test with a fixed seed that fails by chance once in a thousand such tests.
LEAST_P = 1e-3


@pytest.fixture(scope="module")
def scenario(make):
    return make({"spacecraft.magnetometer": {"noise_nt": 10.0, "scale_error": [0.1, 0.2, 0.0]}})


def drawn(scenario, variation, key=NOISE, members=N, **campaign):
    """What members have at one key."""
    whole = Campaign(runs=N, seed=20261122, vary={key: variation}, **campaign)
    return draw(whole, scenario, np.arange(members))[key]


def follows(sample, distribution) -> bool:
    return stats.kstest(sample, distribution.cdf).pvalue > LEAST_P


DISTRIBUTIONS = {
    "uniform": ({"uniform": [-2.0, 5.0]}, stats.uniform(-2.0, 7.0)),
    "log_uniform": ({"log_uniform": [1e-3, 1e4]}, stats.loguniform(1e-3, 1e4)),
    "normal": ({"normal": {"mean": 3.0, "sigma": 2.0}}, stats.norm(3.0, 2.0)),
    "truncated": (
        {"truncated_normal": {"mean": 3.0, "sigma": 2.0, "low": 2.5, "high": 9.0}},
        stats.truncnorm(-0.25, 3.0, 3.0, 2.0),
    ),
    "far tail": (
        {"truncated_normal": {"mean": 0.0, "sigma": 1.0, "low": 30.0}},
        stats.truncnorm(30.0, np.inf),
    ),
    "own": (
        {"quantiles": [[0, 1], [0.5, 2], [1, 10]]},
        SimpleNamespace(cdf=lambda x: np.interp(x, [1.0, 2.0, 10.0], [0.0, 0.5, 1.0])),
    ),
    "factor": ({"relative": {"uniform": [0.9, 1.2]}}, stats.uniform(9.0, 3.0)),
}


@pytest.mark.parametrize("name", DISTRIBUTIONS)
def test_numbers_follow_their_distribution(scenario, name):
    variation, distribution = DISTRIBUTIONS[name]
    assert follows(drawn(scenario, variation), distribution)


@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_every_sampling_has_the_same_distribution(scenario, sampling):
    variation, distribution = DISTRIBUTIONS["truncated"]
    assert follows(drawn(scenario, variation, sampling=sampling), distribution)


@pytest.mark.parametrize("name", ["uniform", "log_uniform", "truncated"])
def test_nothing_is_drawn_beyond_the_bounds(scenario, name):
    variation, distribution = DISTRIBUTIONS[name]
    low, high = distribution.support()
    sample = drawn(scenario, variation)
    assert low <= sample.min() < sample.max() <= high


def test_components_of_vectors_are_independent(scenario):
    variation = {"normal": {"mean": [1.0, 2.0, 3.0], "sigma": [1.0, 2.0, 0.0]}}
    sample = drawn(scenario, variation, BIAS)
    assert sample.shape == (N, 3)
    assert follows(sample[:, 0], stats.norm(1.0, 1.0)) and follows(sample[:, 1], stats.norm(2, 2))
    assert np.all(sample[:, 2] == 3.0)
    assert stats.pearsonr(sample[:, 0], sample[:, 1]).pvalue > LEAST_P
    cube = drawn(scenario, {"uniform": [[-1.0, 0.0, 5.0], [1.0, 4.0, 5.0]]}, BIAS)
    assert follows(cube[:, 0], stats.uniform(-1, 2)) and follows(cube[:, 1], stats.uniform(0, 4))
    assert np.all(cube[:, 2] == 5.0)


def test_values_of_a_list_are_equally_likely(scenario):
    sample = drawn(scenario, {"values": [1.0, 20.0, 300.0]})
    counts = [sample.count(value) for value in (1.0, 20.0, 300.0)]
    assert sum(counts) == N and stats.chisquare(counts).pvalue > LEAST_P


def test_starts_are_uniform_between_two_times(scenario):
    low, high = datetime(2012, 1, 1, tzinfo=UTC), datetime(2012, 3, 1, tzinfo=UTC)
    starts = drawn(scenario, {"uniform": [low, high]}, "start")
    assert low <= min(starts) < max(starts) <= high
    assert follows([(t - low) / timedelta(days=60) for t in starts], stats.uniform())


def test_a_factor_is_on_all_of_the_scenarios_own_numbers(scenario):
    inertia = drawn(
        scenario, {"relative": {"uniform": [0.5, 2.0]}}, "spacecraft.body.inertia_kg_m2"
    )
    factors = inertia / np.array(scenario.spacecraft.body.inertia_kg_m2)
    assert inertia.shape == (N, 3, 3)
    np.testing.assert_allclose(factors, np.broadcast_to(factors[:, :1, :1], factors.shape))
    assert follows(factors[:, 0, 0], stats.uniform(0.5, 1.5))


def test_directions_are_isotropic(scenario):
    variation = {"direction": "uniform", "magnitude": {"uniform": [1.0, 10.0]}}
    rates = drawn(scenario, variation, RATE)
    sizes = np.linalg.norm(rates, axis=1)
    assert follows(sizes, stats.uniform(1.0, 9.0))
    directions = rates / sizes[:, None]
    for axis in np.random.default_rng(1).normal(size=(5, 3)):
        # the component along any axis is uniform on a sphere (Archimedes)
        cosines = directions @ axis / np.linalg.norm(axis)
        assert follows(cosines, stats.uniform(-1.0, 2.0))
        assert stats.spearmanr(cosines, sizes).pvalue > LEAST_P


def test_a_plain_magnitude_is_kept(scenario):
    rates = drawn(scenario, {"direction": "uniform", "magnitude": 5}, RATE)
    np.testing.assert_allclose(np.linalg.norm(rates, axis=1), 5.0, rtol=1e-14)


#: Of a rotation that is uniform on its group the angle has the density (1 - cos a)/pi.
def angle_cdf(angle):
    return (angle - np.sin(angle)) / np.pi


@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_attitudes_are_uniform_on_the_rotation_group(scenario, sampling):
    quaternions = drawn(scenario, "uniform", "initial.attitude", sampling=sampling)
    np.testing.assert_allclose(np.linalg.norm(quaternions, axis=1), 1.0, rtol=1e-14)
    attitudes = Rotation.from_quat(quaternions)
    fixed = Rotation.from_euler("ZYX", [[0, 0, 0], [30, -50, 170], [200, 80, 3]], degrees=True)
    for turn in fixed:
        # the distribution is the same after a turn from the left and from the right
        for turned in (turn * attitudes, attitudes * turn):
            assert stats.kstest(turned.magnitude(), angle_cdf).pvalue > LEAST_P
            matrices = turned.as_matrix()
            for i, j in np.ndindex(3, 3):
                assert follows(matrices[:, i, j], stats.uniform(-1.0, 2.0))
    # second moments of the nine direction cosines: a third each, and no correlation
    cosines = attitudes.as_matrix().reshape(N, 9)
    np.testing.assert_allclose(cosines.T @ cosines / N, np.eye(9) / 3.0, atol=5.0 / np.sqrt(N) / 3)


def test_correlated_keys_have_their_mean_and_covariance(scenario):
    keys = ["orbit.raan_deg", NOISE, "orbit.altitude_km"]
    mean, sigma = np.array([10.0, 500.0, 700.0]), np.array([2.0, 30.0, 5.0])
    correlation = np.array([[1.0, 0.9, -0.3], [0.9, 1.0, 0.0], [-0.3, 0.0, 1.0]])
    covariance = correlation * np.outer(sigma, sigma)
    campaign = Campaign(
        runs=N, correlated=[{"keys": keys, "mean": mean, "covariance": covariance.tolist()}]
    )
    found = draw(campaign, scenario, range(N))
    sample = np.column_stack([found[key] for key in keys])
    standard = (sample - mean) / sigma
    assert np.abs(standard.mean(axis=0)).max() < 4.0 / np.sqrt(N)
    # the standard error of a covariance of normal numbers: sqrt((c_ii c_jj + c_ij^2)/n)
    error = np.abs(standard.T @ standard / N - correlation) / np.sqrt((1 + correlation**2) / N)
    assert error.max() < 4.0
    white = np.linalg.solve(np.linalg.cholesky(covariance), (sample - mean).T)
    assert all(follows(row, stats.norm()) for row in white)


def test_a_singular_covariance_keeps_its_numbers_on_a_line(scenario):
    together = {"keys": [NOISE, "orbit.raan_deg"], "mean": [5, 1], "covariance": [[4, 2], [2, 1]]}
    found = draw(Campaign(runs=100, correlated=[together]), scenario, range(100))
    np.testing.assert_allclose(
        found[NOISE] - 5.0, 2.0 * (found["orbit.raan_deg"] - 1.0), atol=1e-12
    )
    assert np.std(found[NOISE]) > 1.0


INERTIA = "spacecraft.body.inertia_kg_m2"
CHANGES = {"initial.attitude": "rotation", RATE: "vector", INERTIA: "inertia", NOISE: "factor"}


def changes(covariance, kinds=CHANGES):
    return {"keys": [*kinds], "changes": [*kinds.values()], "covariance": covariance.tolist()}


def test_changes_have_their_covariance_about_the_own_values(scenario):
    root = np.random.default_rng(3).normal(size=(13, 13))
    covariance = 1e-6 * (root @ root.T)
    campaign = Campaign(runs=N, seed=5, correlated=[changes(covariance)])
    found = draw(campaign, scenario, range(N))
    own = Rotation.from_quat(scenario.initial.attitude)
    turns = (own.inv() * Rotation.from_quat(found["initial.attitude"])).as_rotvec()
    inertia = found[INERTIA] - np.array(scenario.spacecraft.body.inertia_kg_m2)
    rate = found[RATE] - np.array(scenario.initial.rate_deg_s)
    elements = inertia[:, [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    logs = np.log(found[NOISE] / 10.0)
    white = np.linalg.solve(
        np.linalg.cholesky(covariance), np.column_stack([turns, rate, elements, logs]).T
    )
    assert all(follows(row, stats.norm()) for row in white)
    assert np.abs(white @ white.T / N - np.eye(13)).max() < 4.5 * np.sqrt(2.0 / N)


def test_without_deviations_a_member_is_the_scenario(scenario):
    """Numbers of one half are the middle of all distributions."""
    tables = [changes(np.eye(13)), changes(np.ones((1, 1)), {INERTIA: "factor"})]
    campaign = Campaign(runs=1, correlated=tables)
    found = draw_values(campaign, scenario, np.full((1, campaign.unit_numbers), 0.5))
    assert np.array_equal(found["initial.attitude"][0], scenario.initial.attitude)
    for key, value in found.items():
        if key != "initial.attitude":
            assert np.array_equal(value[0], value_at(scenario, key)), key


def test_a_later_table_changes_what_an_earlier_one_has_drawn(scenario):
    """Inertia and noise, whose errors are small, times one factor that is not known."""
    both = {INERTIA: "factor", NOISE: "factor"}
    small = 1e-4 * np.eye(13)
    once = Campaign(runs=50, correlated=[changes(small)])
    twice = Campaign(runs=50, correlated=[changes(small), changes(np.ones((2, 2)), both)])
    before, after = (draw(each, scenario, range(50)) for each in (once, twice))
    factors = after[NOISE] / before[NOISE]
    assert np.std(np.log(factors)) > 0.7
    np.testing.assert_allclose(after[INERTIA], factors[:, None, None] * before[INERTIA], rtol=1e-12)
    assert twice.varied_keys == [*CHANGES]
    member = member_scenario(scenario, twice, 7)
    np.testing.assert_array_equal(member.spacecraft.body.inertia_kg_m2, after[INERTIA][7])
    assert member.initial.quaternion == tuple(after["initial.attitude"][7])


MANY = {
    NOISE: {"uniform": [0.0, 1.0]},
    BIAS: {"normal": {"mean": 0.0, "sigma": [1.0, 1.0, 1.0]}},
    RATE: {"direction": "uniform", "magnitude": 1.0},
    "initial.attitude": "uniform",
}


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(SAMPLINGS),
    st.integers(0, 2**63 - 1),
    st.lists(st.integers(0, 300), min_size=1, max_size=20),
)
def test_member_does_not_depend_on_those_drawn_with_it(sampling, seed, members):
    campaign = Campaign(runs=64, seed=seed, sampling=sampling, vary=MANY)
    together = unit_numbers(campaign, members)
    for row, member in enumerate(members):
        np.testing.assert_array_equal(unit_numbers(campaign, [member])[0], together[row])
    np.testing.assert_array_equal(unit_numbers(campaign, range(301))[members], together)
    assert np.all((together > 0.0) & (together < 1.0))


ALL_FORMS = {key: variation for key, variation in MANY.items() if key != NOISE} | {
    "orbit.altitude_km": {"truncated_normal": {"mean": 500.0, "sigma": 50.0, "low": 450.0}},
    "spacecraft.body.inertia_kg_m2": {"relative": {"log_uniform": [0.5, 2.0]}},
    "start": {"uniform": ["2012-01-01T00:00:00Z", "2013-01-01T00:00:00Z"]},
    "simulation.duration_s": {"values": [600.0, 1200.0]},
    "spacecraft.magnetometer.resolution_nt": {"quantiles": [[0, 1], [0.3, 2], [1, 7]]},
}


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**63 - 1), st.lists(st.integers(0, 10**8), min_size=1, max_size=40))
def test_values_are_bit_identical_however_many_are_drawn(scenario, seed, members):
    covariance = [[4.0, 1.0, 0.5], [1.0, 3.0, 0.1], [0.5, 0.1, 2.0]]
    keys = [NOISE, "orbit.raan_deg", "orbit.inclination_deg"]
    correlated = [{"keys": keys, "mean": [50.0, 1.0, 60.0], "covariance": covariance}]
    campaign = Campaign(runs=10**8, seed=seed, vary=ALL_FORMS, correlated=correlated)
    changed = Campaign(runs=10**8, seed=seed, correlated=[changes(0.01 * np.eye(13))])
    for each in (campaign, changed):
        together = draw(each, scenario, members)
        for row in {0, len(members) - 1}:
            for key, values in draw(each, scenario, [members[row]]).items():
                assert np.array_equal(values[0], together[key][row]), key


@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_other_seeds_give_other_members(sampling):
    one, other = (
        unit_numbers(Campaign(runs=4096, seed=seed, sampling=sampling, vary=MANY), range(4096))
        for seed in (1, 1 + 2**32)
    )
    assert not np.any(one == other)
    if sampling == "sobol":  # whose scrambled sequences keep their structure
        return
    for a, b in zip(one.T, other.T, strict=True):
        assert stats.pearsonr(a, b).pvalue > LEAST_P / one.shape[1]


def test_random_numbers_of_members_and_of_keys_are_independent():
    units = unit_numbers(Campaign(runs=N, vary=MANY), range(N))
    columns = np.hstack([units[:-1], units[1:], units[:-1] ** 2])  # neighbours, too
    correlations = np.corrcoef(columns.T)
    count = units.shape[1]
    np.fill_diagonal(correlations, 0.0)
    correlations[range(count), range(2 * count, 3 * count)] = 0.0  # a number and its own square
    correlations[range(2 * count, 3 * count), range(count)] = 0.0
    assert np.abs(correlations).max() < 5.0 / np.sqrt(N)


def test_random_draws_of_a_key_do_not_depend_on_others(scenario):
    alone = Campaign(runs=10, seed=3, vary={BIAS: MANY[BIAS]})
    beside = Campaign(runs=999, seed=3, vary=MANY)
    np.testing.assert_array_equal(
        draw(alone, scenario, range(10))[BIAS], draw(beside, scenario, range(10))[BIAS]
    )


def test_latin_hypercube_has_one_number_per_part_of_each_range():
    campaign = Campaign(runs=50, sampling="latin_hypercube", vary=MANY)
    units = unit_numbers(campaign, range(100))
    for block in (units[:50], units[50:]):
        parts = np.sort(np.floor(50 * block), axis=0)
        np.testing.assert_array_equal(parts, np.tile(np.arange(50.0)[:, None], units.shape[1]))
    assert not np.any(units[:50] == units[50:])


def test_sobol_points_are_those_of_scipy():
    campaign = Campaign(runs=256, seed=11, sampling="sobol", vary=MANY)
    points = qmc.Sobol(campaign.unit_numbers, seed=np.random.default_rng(11)).random(256)
    np.testing.assert_array_equal(unit_numbers(campaign, range(256)), points)
    np.testing.assert_array_equal(unit_numbers(campaign, [200, 3, 77]), points[[200, 3, 77]])


def test_low_discrepancy_finds_a_mean_better_than_chance(scenario):
    key, variation = NOISE, {"uniform": [0.0, 1.0]}
    errors = {
        sampling: abs(np.mean(drawn(scenario, variation, key, 4096, sampling=sampling)) - 0.5)
        for sampling in ("random", "sobol")
    }
    assert errors["sobol"] < 1e-3 and errors["sobol"] < errors["random"]


def test_a_grid_has_every_combination_once(scenario):
    vary = {NOISE: {"values": [1.0, 2.0]}, "orbit.raan_deg": {"values": [0.0, 90.0, 180.0]}}
    campaign = Campaign(sampling="grid", vary=vary)
    found = draw(campaign, scenario, range(campaign.runs))
    pairs = list(zip(found[NOISE], found["orbit.raan_deg"], strict=True))
    assert pairs == [(a, b) for a in (1.0, 2.0) for b in (0.0, 90.0, 180.0)]
    with pytest.raises(ValueError, match=r"members: must lie within 0..5 of the grid; received 6"):
        draw(campaign, scenario, [6])


def test_noise_seeds_are_uniform_and_independent_of_the_values():
    campaign = Campaign(runs=N, seed=4, vary=MANY)
    seeds = member_seeds(campaign, range(N))
    assert seeds.dtype == np.int64 and seeds.min() >= 0 and len(set(seeds)) == N
    assert follows(seeds / 2.0**63, stats.uniform())
    for column in unit_numbers(campaign, range(N)).T:
        assert stats.pearsonr(seeds.astype(float), column).pvalue > LEAST_P
    assert member_seeds(campaign, [7]) == seeds[7]
    assert member_seeds(Campaign(runs=1, seed=5), [7]) != seeds[7]


def test_members_have_their_own_noise_even_if_nothing_varies(scenario):
    campaign = Campaign(runs=3)
    assert draw(campaign, scenario, range(3)) == {}
    members = [member_scenario(scenario, campaign, k) for k in range(3)]
    assert len({member.seed for member in members}) == 3


def test_a_member_is_a_scenario_with_what_was_drawn(scenario):
    campaign = Campaign(runs=10, vary=MANY, seed=8)
    member, found = member_scenario(scenario, campaign, 4), draw(campaign, scenario, range(10))
    assert (member.name, member.seed) == (f"{scenario.name}-4", member_seeds(campaign, [4])[0])
    assert member.spacecraft.magnetometer.noise_nt == found[NOISE][4]
    assert member.spacecraft.magnetometer.scale_error == (0.1, 0.2, 0.0)
    assert member.initial.quaternion == tuple(found["initial.attitude"][4])
    assert member.initial.rate_deg_s == tuple(found[RATE][4])
    assert any(scenario.initial.euler_deg) and not any(member.initial.euler_deg)
    own = {"name": scenario.name, "seed": scenario.seed, "initial": scenario.initial}
    own["spacecraft"] = scenario.spacecraft
    assert member.model_copy(update=own) == scenario


def test_keys_that_only_fit_together_are_set_together(make):
    campaign = Campaign(
        sampling="grid",
        vary={"control.sample_s": {"values": [7.0]}, "simulation.record_s": {"values": [21.0]},
              "simulation.step_s": {"values": [7.0]}},
    )  # fmt: skip
    member = member_scenario(make(), campaign, 0)
    assert (member.control.sample_s, member.simulation.record_s) == (7.0, 21.0)
    with pytest.raises(ScenarioError, match=r"control.sample_s: must be a whole multiple"):
        make().replace("simulation.step_s", 7.0)


@pytest.mark.parametrize("members", [[-1], [2**32], [0.5], [[1]], ["1"]])
def test_members_are_numbers_from_zero_on(scenario, members):
    with pytest.raises(ValueError, match=r"^members: must "):
        draw(Campaign(runs=1, vary=MANY), scenario, members)
    assert draw(Campaign(runs=1, vary=MANY), scenario, [])[BIAS].shape == (0, 3)


def test_random_words_are_64_independent_bits():
    words = random_words(7, "a", np.arange(N))
    bits = (words[:, None] >> np.arange(64, dtype=np.uint64)) & np.uint64(1)
    off = 4.5 * 0.5 / np.sqrt(N)  # by chance once in a hundred thousand
    assert np.abs(bits.mean(axis=0) - 0.5).max() < off
    both = np.corrcoef(bits.T.astype(float)) - np.eye(64)
    assert np.abs(both).max() < 2.5 * off
