"""Members of a twin: what its errors leave open, as a campaign draws it."""

import numpy as np
import pytest
from twin_session import believed

import torquer
from torquer.base.validate import inertia_tensor
from torquer.campaign.load import campaign_from_data
from torquer.campaign.sampling import draw, draw_values
from torquer.ground.telemetry.twin.flights import INERTIA
from torquer.ground.telemetry.twin.members import GAIN, SCALE, Twin, member_tables, write_members
from torquer.scenario.change import with_values

N = 20_000
_J, _LAW = "spacecraft.body.inertia_kg_m2", "control.law.gain_a_m2_s_per_t"
_DIPOLE = "spacecraft.coils.residual_dipole_a_m2"
_ELEMENTS = ([0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2])
#: Names of all parameters; standard deviations: angles [rad], rates [rad/s], what was fitted.
NAMES = (*(f"inertia_{each}" for each in INERTIA), "gain", *(f"dipole_{c}" for c in "xyz"))
SIGMAS = np.array([1e-3] * 3 + [2e-5] * 3 + [0.01] * 10)


@pytest.fixture(scope="module")
def found():
    """A twin with a residual dipole, from its last leg on."""
    initial = {"quaternion": [0.1, 0.5, -0.1, np.sqrt(0.73)], "rate_deg_s": [1.0, -2.0, 0.5]}
    return with_values(believed(5e5), {"initial": initial, _DIPOLE: [0.02, -0.01, 0.03]})


@pytest.fixture(scope="module")
def covariance():
    """A joint covariance of motion and ten fitted parameters, with correlations up to 0.6."""
    root = np.eye(16) + 0.2 * np.random.default_rng(1).normal(size=(16, 16))
    whole = root @ root.T
    size = SIGMAS / np.sqrt(np.diag(whole))
    return whole * np.outer(size, size)


def members(found, tables, count=N):
    campaign = campaign_from_data({"runs": count, "correlated": [*tables]}, found)
    return draw(campaign, found, np.arange(count))


def test_members_have_the_covariance_of_the_fit(found, covariance):
    """Inertia and dipole by their slopes, rates in deg/s, the gain by its logarithm."""
    slopes = np.diag([0.9, 1.2, 1.1, 0.3, 0.2, 0.1, 5e5, 1.0, 1.0, 1.0])
    (table,) = member_tables(found, NAMES, slopes, covariance, False)
    drawn = members(found, [table])
    assert all(np.array_equal(inertia_tensor("J", each), each) for each in drawn[_J][:500])
    elements = drawn[_J][:, *_ELEMENTS] - np.array(found.spacecraft.body.inertia_kg_m2)[_ELEMENTS]
    rows = np.column_stack([
        np.radians(drawn["initial.rate_deg_s"] - found.initial.rate_deg_s),
        elements / np.diag(slopes)[:6],
        np.log(drawn[_LAW] / 5e5),
        drawn[_DIPOLE] - found.spacecraft.coils.residual_dipole_a_m2,
    ])  # fmt: skip
    white = np.linalg.solve(np.linalg.cholesky(covariance[3:, 3:]), rows.T)
    assert np.abs(white @ white.T / N - np.eye(13)).max() < 4.5 * np.sqrt(2.0 / N)


def test_what_moves_alike_is_drawn_with_one_factor(found, covariance):
    """Where the coils never saturate: the size is drawn, but what is over the gain is known."""
    names = tuple(f"{name}/gain" for name in NAMES if name != "gain")
    slopes = np.delete(np.diag([2e-6] * 6 + [0.0] + [2e-8] * 3), 6, axis=0)
    tables = member_tables(found, names, slopes, covariance, True)
    drawn, without = members(found, tables), members(found, tables[:1])
    size = drawn[_LAW] / 5e5
    assert np.std(np.log(size)) == pytest.approx(SCALE, rel=0.03)
    for key in (_J, _DIPOLE):
        over = size.reshape(-1, *(1,) * (drawn[key].ndim - 1))
        np.testing.assert_allclose(drawn[key] / over, without[key], rtol=1e-9, atol=1e-12)
    spread = np.std(without[_J][:, 0, 0])
    assert spread == pytest.approx(5e5 * 2e-6 * 0.01, rel=0.03)
    assert _LAW not in without


def test_a_gain_that_is_not_known_is_drawn_by_itself(found, covariance):
    names = tuple(name for name in NAMES if name != "gain")
    slopes = np.delete(np.eye(10), 6, axis=0)
    drawn = members(found, member_tables(found, names, slopes, covariance, False))
    assert np.std(np.log(drawn[_LAW])) == pytest.approx(GAIN, rel=0.03)
    assert abs(np.corrcoef(np.log(drawn[_LAW]), drawn[_J][:, 0, 0])[0, 1]) < 4.0 / np.sqrt(N)


def test_the_file_is_a_campaign_of_the_twin(found, covariance, tmp_path):
    """As it is written: members differ, the one without deviations is the twin."""
    tables = member_tables(found, NAMES, np.eye(10), 1e-4 * covariance, False)
    twin = Twin(NAMES, np.ones(10), np.eye(10), False, 0.3, 700.0, 698, 60.0, 60.0, (), "", None,
                found, found, tables)  # fmt: skip
    file = tmp_path / "twin.toml"
    file.write_text(write_members(found, twin), encoding="utf-8")
    scenario, campaign = torquer.load_campaign(file)
    assert campaign.runs == 1000 and campaign.varied_keys[:2] == [
        "initial.attitude", "initial.rate_deg_s",
    ]  # fmt: skip
    assert 0.0 < scenario.simulation.step_s < 3.0
    assert scenario.name == f"{found.name}-twin"
    same = with_values(scenario, {"simulation": found.simulation, "name": found.name})
    assert same.model_dump() == found.model_dump()
    middle = draw_values(campaign, scenario, np.full((1, campaign.unit_numbers), 0.5))
    assert middle[_LAW][0] == found.control.law.gain_a_m2_s_per_t
    assert np.array_equal(middle[_J][0], found.spacecraft.body.inertia_kg_m2)
    assert len({*draw(campaign, scenario, range(100))[_LAW].tolist()}) == 100


@pytest.mark.parametrize(
    ("only_ratio", "names", "said"),
    [
        (False, NAMES, ""),
        (True, tuple(f"{name}/gain" for name in NAMES if name != "gain"), "does not show the size"),
        (False, tuple(name for name in NAMES if name != "gain"), "does not show the gain"),
    ],
)
def test_the_file_says_what_was_not_measured(found, covariance, only_ratio, names, said):
    tables = member_tables(found, names, np.zeros((len(names), 10)), covariance, only_ratio)
    twin = Twin(names, np.ones(9), np.eye(9), only_ratio, 0.3, 1.0, 1, 60.0, 60.0, (),
                "squares of 9 where 4 are expected", None, found, found, tables)  # fmt: skip
    text = write_members(found, twin)
    assert said in text and ("does not show" in text) == bool(said)
    assert "# DO NOT RELY ON THESE ERRORS: squares of 9 where 4 are expected.\n" in text


def test_given_steps_stay(found):
    steps = {"duration_s": 600.0, "step_s": 0.5, "record_s": 3.0}
    scenario = with_values(found, {"simulation": steps})
    twin = Twin((), np.zeros(0), np.zeros((0, 0)), False, 0.0, 0.0, 0, 0.0, 0.0, (), "", None, None,
                scenario, ())  # fmt: skip
    assert "step_s = 0.5\n" in write_members(scenario, twin)
