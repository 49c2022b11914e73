"""Distributions of one's own: functions that draw members of random numbers; what is refused."""

import json
import re

import numpy as np
import pytest
from messages import message_of
from scipy import stats
from tip_off import SCENARIO

import torquer
from torquer.base import user_code
from torquer.campaign.files import code_named
from torquer.campaign.load import campaign_from_data, check_own_parts, load_campaign
from torquer.campaign.sampling import draw, member_scenario
from torquer.campaign.spec import Campaign
from torquer.compile import engine
from torquer.scenario.load import scenario_from_text
from torquer.simulation.results.file import load

RATE, GAIN = "initial.rate_deg_s", "control.law.gain_a_m2_s_per_t"
LIMIT, INERTIA = "spacecraft.coils.limit_a_m2", "spacecraft.body.inertia_kg_m2"
DRAWS = """
import numpy as np
CALLS = 0

def tip_off(u, scale=3.0):
    size, turn = -scale * np.log(u[0]), 2 * np.pi * u[1]
    return size * np.cos(turn), size * np.sin(turn), 0.5

def gain(u):
    return 1e5 * (1 + u[0])

def limit(u):
    return 3.0 - u[0]

def tensor(u):
    return np.diag(1.0 + 0.1 * u)

def missing(u):
    return float("nan") if u[0] > 0.9 else 1e5

def negative(u):
    return 1e5 * (0.999 - u[0])

def at_random(u):
    return 1.0 + np.random.rand()

def counting(u):
    global CALLS
    CALLS += 1
    return 1e5 + CALLS

def ragged(u):
    return [1e5] if u[0] > 0.8 else 1e5

def broken(u):
    return u[5]

def words(u):
    return "much"

def cube(u):
    return np.ones((2, 2, 2))
"""


@pytest.fixture(scope="module")
def scenario():
    return scenario_from_text(SCENARIO)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "my_draws.py").write_text(DRAWS)
    return tmp_path


def own(function, draws=1, **more):
    return {"own": {"file": "my_draws.py", "function": function, "draws": draws, **more}}


def made(scenario, folder, runs=40, sampling="random", **vary):
    keys = {"rate": RATE, "gain": GAIN, "limit": LIMIT, "inertia": INERTIA}
    table = {"runs": runs, "seed": 5, "sampling": sampling}
    campaign = campaign_from_data(
        {**table, "vary": {keys[name]: each for name, each in vary.items()}}, scenario, folder
    )
    check_own_parts(campaign, scenario)
    return campaign


# ------------------------------------------------------------------ what is drawn


def test_a_function_draws_numbers_vectors_and_matrices(scenario, folder):
    campaign = made(
        scenario, folder, runs=4000, rate=own("tip_off", 2, parameters={"scale": 2.0}),
        gain=own("gain"), inertia=own("tensor", 3),
    )  # fmt: skip
    drawn = draw(campaign, scenario, range(4000))
    assert drawn[RATE].shape == (4000, 3) and drawn[INERTIA].shape == (4000, 3, 3)
    sizes = np.linalg.norm(drawn[RATE][:, :2], axis=1)
    assert stats.kstest(sizes, stats.expon(scale=2.0).cdf).pvalue > 1e-4
    assert stats.kstest(drawn[GAIN], stats.uniform(1e5, 1e5).cdf).pvalue > 1e-4
    assert abs(stats.spearmanr(sizes, drawn[GAIN]).statistic) < 4.0 / np.sqrt(4000)
    member = member_scenario(scenario, campaign, 7)
    assert member.initial.rate_deg_s == tuple(drawn[RATE][7])
    assert np.array_equal(member.spacecraft.body.inertia_kg_m2, drawn[INERTIA][7])


def test_a_member_does_not_depend_on_which_are_asked_for(scenario, folder):
    campaign = made(scenario, folder, rate=own("tip_off", 2), gain={"relative": own("gain")})
    whole = draw(campaign, scenario, range(40))
    for some in ([7], [39, 0, 7], range(20, 40)):
        part = draw(campaign, scenario, some)
        for key in (RATE, GAIN):
            assert np.array_equal(part[key], whole[key][[*some]])


def test_other_keys_keep_their_draws(scenario, folder):
    plain = campaign_from_data(
        {"runs": 40, "seed": 5, "vary": {LIMIT: {"uniform": [1, 3]}}}, scenario
    )
    both = made(scenario, folder, limit={"uniform": [1, 3]}, rate=own("tip_off", 2))
    found = (draw(each, scenario, range(40))[LIMIT] for each in (plain, both))
    assert np.array_equal(*found)


@pytest.mark.parametrize("sampling", ["latin_hypercube", "sobol", "saltelli"])
def test_designs_cover_the_range_of_its_random_numbers(scenario, folder, sampling):
    campaign = made(scenario, folder, 32, sampling, gain=own("gain"), limit={"uniform": [1, 3]})
    rows = np.arange(0, 32, campaign.members_per_point) if sampling == "saltelli" else np.arange(32)
    shares = np.sort((draw(campaign, scenario, rows)[GAIN] - 1e5) / 1e5)
    assert np.abs(shares - (np.arange(len(rows)) + 0.5) / len(rows)).max() <= 0.5 / len(rows) + 1e-9


def test_keys_are_tied_to_it_and_it_to_others(scenario, folder):
    tied = made(scenario, folder, gain=own("gain"), limit={"uniform": [1, 3], "tied_to": GAIN})
    drawn = draw(tied, scenario, range(40))
    assert drawn[LIMIT] == pytest.approx(1.0 + 2.0 * (drawn[GAIN] - 1e5) / 1e5, rel=1e-12)
    other = made(
        scenario, folder, gain={"uniform": [1e5, 2e5]}, limit=own("limit") | {"tied_to": GAIN}
    )
    drawn = draw(other, scenario, range(40))
    assert drawn[LIMIT] == pytest.approx(3.0 - (drawn[GAIN] - 1e5) / 1e5, rel=1e-12)


def test_within_a_direction_and_a_factor(scenario, folder):
    campaign = made(
        scenario, folder, rate={"direction": "uniform", "magnitude": own("limit")},
        gain={"relative": own("limit")},
    )  # fmt: skip
    drawn = draw(campaign, scenario, range(40))
    sizes = np.linalg.norm(drawn[RATE], axis=1)
    assert ((sizes > 2.0) & (sizes < 3.0)).all() and np.ptp(sizes) > 0.5
    factors = drawn[GAIN] / scenario.control.law.gain_a_m2_s_per_t
    assert ((factors > 2.0) & (factors < 3.0)).all()


# ------------------------------------------------------------------ what is refused

MUST = "must be a function (u) that returns a finite number, vector or matrix"
REFUSED = {
    "missing": (MUST + "; received nan for member {n} (missing in {file})", lambda u: u > 0.9),
    "ragged": (
        MUST + "; received shape (1,), not () as for u = 0.5, for member {n} (ragged in {file})",
        lambda u: u > 0.8,
    ),
    "at_random": (MUST + ", the same for the same u; received 1.", None),
    "counting": (MUST + ", the same for the same u; received 1000", None),
    "broken": (
        MUST + "; received IndexError('index 5 is out of bounds for axis 0 with size 1') for "
        "u = 0.5 (broken in {file}, line ", None,
    ),
    "words": (MUST + "; received 'much' for u = 0.5 (words in {file})", None),
    "cube": (MUST + "; received shape (2, 2, 2) for u = 0.5 (cube in {file})", None),
}  # fmt: skip


@pytest.mark.parametrize("function", REFUSED)
def test_what_is_no_value_is_refused_with_function_and_member(scenario, folder, function):
    text, wrong = REFUSED[function]
    sound = made(scenario, folder, gain=own("gain"))
    u = draw(sound, scenario, range(40))[GAIN] / 1e5 - 1.0
    member = int(np.argmax(wrong(u))) if wrong else 0
    message = message_of(lambda: made(scenario, folder, gain=own(function)))
    expected = f"campaign.vary.{GAIN}.own: " + text.format(n=member, file=folder / "my_draws.py")
    assert message.startswith(expected) and "\n" not in message


def test_a_value_beyond_the_bounds_of_its_key_is_refused_with_function_and_member(scenario, folder):
    """The least and the greatest of all members are tried, not only the first ones."""
    assert made(scenario, folder, runs=40, gain=own("negative"))
    u = draw(made(scenario, folder, runs=5000, gain=own("gain")), scenario, range(5000))[GAIN]
    worst = int(np.argmax(u))
    message = message_of(lambda: made(scenario, folder, runs=5000, gain=own("negative")))
    assert re.fullmatch(
        rf'campaign\.vary\."{GAIN}": must be greater than 0; received -[\d.]+ '
        rf"\(negative in {folder}/my_draws\.py, member {worst}\)", message,
    ), message  # fmt: skip


@pytest.mark.parametrize(("variation", "expected"), {
    "function": ({"own": {"file": "my_draws.py", "function": "none"}},
                 f"campaign.vary.{GAIN}.own.function: must be a function of the file; received"),
    "file": ({"own": {"file": "none.py"}}, f"campaign.vary.{GAIN}.own.file: must be an existing "),
    "one of many": ({"own": {"file": "my_draws.py"}},
                    f"campaign.vary.{GAIN}.own.file: must define one function, or `function` name"),
    "parameters": (own("gain", parameters={"q": 1.0}),
                   f"campaign.vary.{GAIN}.own.parameters.q: must be one of the function's (none)"),
    "draws": (own("gain", 0), f'campaign.vary."{GAIN}".own.draws: must be greater than or equal'),
    "vector as a factor": ({"relative": own("tip_off", 2)},
                           f"campaign.vary.{GAIN}.relative.own: {MUST}, here a number; received"),
    "two forms": (own("gain") | {"uniform": [1, 2]}, f'campaign.vary."{GAIN}": must have one of '),
    "attitude": (own("gain"), ""),
}.values())  # fmt: skip
def test_mistakes_have_one_line(scenario, folder, variation, expected):
    key = GAIN if expected else "initial.attitude"
    expected = expected or 'campaign.vary."initial.attitude": must be "uniform"; received own'

    def load():
        campaign = campaign_from_data({"runs": 9, "vary": {key: variation}}, scenario, folder)
        check_own_parts(campaign, scenario)

    message = message_of(load)
    assert message.startswith(expected) and "\n" not in message


def test_a_grid_has_none(scenario, folder):
    message = message_of(lambda: made(scenario, folder, 1, "grid", gain=own("gain")))
    assert "must be given by values with sampling 'grid'; received own" in message


# ------------------------------------------------------------------ whose code is executed


def test_a_look_at_a_result_executes_nothing(scenario, folder, monkeypatch):
    campaign = made(scenario, folder, gain=own("gain"))
    monkeypatch.setattr(user_code, "_admitted", set())
    stored = Campaign.model_validate_json(campaign.model_dump_json(exclude_none=True))
    message = message_of(lambda: draw(stored, scenario, [0]))
    assert message.startswith(f"campaign.vary.{GAIN}.own.file: must be of a scenario whose code ")


def test_its_file_is_among_those_that_workers_are_asked_for(scenario, folder):
    campaign = made(scenario, folder, gain=own("gain"), limit={"relative": own("limit")})
    assert dict(code_named(campaign)) == {
        f"campaign.vary.{GAIN}.own.file": folder / "my_draws.py",
        f"campaign.vary.{LIMIT}.relative.own.file": folder / "my_draws.py",
    }


# ------------------------------------------------------------------ flown

flown = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


@flown
def test_bits_do_not_depend_on_workers_parts_or_processes(scenario, folder, tmp_path):
    campaign = made(scenario, folder, 12, rate=own("tip_off", 2), gain=own("gain"))
    whole = torquer.fly_campaign(scenario, campaign, workers=1)
    assert (whole["how_it_ended"] == "complete").all()
    there = torquer.fly_campaign(scenario, campaign, workers=2, where="processes")
    files = [tmp_path / f"{k}.nc" for k in (1, 2)]
    for k, file in enumerate(files, 1):
        torquer.fly_campaign(scenario, campaign, part=(k, 2), to=file)
    joined = torquer.join_parts(files)
    for other in (there, joined):
        assert other.identical(whole)
    assert np.array_equal(whole[GAIN].values, draw(campaign, scenario, range(12))[GAIN])
    kept = json.loads(whole.attrs["parts"])
    assert {*kept} == {f"campaign.vary.{key}.own" for key in (RATE, GAIN)}
    assert all(each["text"] == DRAWS for each in kept.values())


@flown
def test_an_edited_file_is_refused_by_resume_and_by_join(folder):
    (folder / "c.toml").write_text(
        SCENARIO + '[campaign]\nruns = 4\nvary."initial.rate_deg_s" = '
        '{ own = { file = "my_draws.py", function = "tip_off", draws = 2 } }\n'
    )

    def fly(name, **how):
        scenario, campaign = load_campaign(folder / "c.toml")
        return torquer.fly_campaign(scenario, campaign, to=folder / name, workers=1, **how)

    fly("a.nc", part=(1, 2))
    again = fly("a.nc", part=(1, 2), resume=True)
    assert again["member"].values.tolist() == [0, 1]
    (folder / "my_draws.py").write_text(DRAWS.replace("2 * np.pi", "1.5 * np.pi"))
    message = message_of(lambda: fly("a.nc", resume=True))
    assert message.startswith(f"campaign.vary.{RATE}.own.file: must be the one ")
    fly("b.nc", part=(2, 2))
    message = message_of(lambda: torquer.join_parts([folder / "a.nc", folder / "b.nc"]))
    assert "whose parts is another than that of" in message
    assert load(folder / "a.nc").sizes["member"] == 2
