"""Members from a table, and keys tied to one draw: read, refused in one line, flown to the bit."""

import warnings

import numpy as np
import pytest
from messages import message_of
from tip_off import SCENARIO, TABLE

import torquer
from torquer.campaign.contents import groups_in
from torquer.campaign.files import code_named
from torquer.campaign.fly import OneByOne
from torquer.campaign.load import campaign_from_data, load_campaign
from torquer.campaign.notes import campaign_notes
from torquer.campaign.sampling import draw, draw_values, member_scenario
from torquer.campaign.spec import Campaign
from torquer.campaign.table import read_table
from torquer.campaign.unit_numbers import unit_numbers
from torquer.compile import engine
from torquer.scenario.load import scenario_from_text

INERTIA, RATE = "spacecraft.body.inertia_kg_m2", "initial.rate_deg_s"
LIMIT, GAIN, START = "spacecraft.coils.limit_a_m2", "control.law.gain_a_m2_s_per_t", "start"
ROWS = [[1.0 + 0.01 * k, 1.3, 1.7, 2e5 / (1 + k)] for k in range(40)]
CSV = "\n".join(
    ["# a fleet", f"{INERTIA}[0], {INERTIA}[2], {INERTIA}[1], {GAIN}"]
    + [f"{a}, {c}, {b}, {g}" for a, b, c, g in ROWS]
)


@pytest.fixture(scope="module")
def scenario():
    return scenario_from_text(SCENARIO)


def read(tmp_path, text):
    (tmp_path / "fleet.csv").write_text(text, encoding="utf-8")
    return read_table(tmp_path / "fleet.csv")


def made(scenario, tmp_path, text, **table):
    (tmp_path / "fleet.csv").write_text(text, encoding="utf-8")
    return campaign_from_data({"table": "fleet.csv", **table}, scenario, tmp_path)


# ------------------------------------------------------------------ members from a table


def test_a_row_is_a_member(scenario, tmp_path):
    campaign = made(scenario, tmp_path, CSV)
    assert campaign.runs == 40 and campaign.varied_keys == [INERTIA, GAIN]
    drawn = draw(campaign, scenario, [0, 39, 7])
    assert np.array_equal(drawn[INERTIA], np.array(ROWS)[[0, 39, 7], :3])
    assert np.array_equal(drawn[GAIN], np.array(ROWS)[[0, 39, 7], 3])
    member = member_scenario(scenario, campaign, 7)
    assert np.diag(member.spacecraft.body.inertia_kg_m2).tolist() == ROWS[7][:3]
    assert member.control.law.gain_a_m2_s_per_t == ROWS[7][3]


def test_a_file_names_its_table_beside_it(scenario, tmp_path):
    (tmp_path / "fleet.csv").write_text(CSV, encoding="utf-8")
    text = SCENARIO + '[campaign]\ntable = "fleet.csv"\nvary."initial.attitude" = "uniform"\n'
    (tmp_path / "tip.toml").write_text(text, encoding="utf-8")
    campaign = load_campaign(tmp_path / "tip.toml")[1]
    assert campaign == made(scenario, tmp_path, CSV, vary={"initial.attitude": "uniform"})
    assert Campaign.model_validate_json(campaign.model_dump_json()) == campaign


def test_dotted_keys_are_a_table_too(scenario):
    table = {"control": {"law": {"gain_a_m2_s_per_t": [1e5, 2e5, 3e5]}}}
    assert campaign_from_data({"table": table}, scenario).table == {GAIN: (1e5, 2e5, 3e5)}


def test_what_varies_is_drawn_as_without_a_table(scenario, tmp_path):
    for sampling in ("random", "latin_hypercube", "sobol"):
        vary = {"runs": 16, "seed": 3, "sampling": sampling, "vary": TABLE["vary"]}
        bare = draw(Campaign(**vary), scenario, range(16))
        drawn = draw(made(scenario, tmp_path, CSV, **vary), scenario, range(16))
        assert [*drawn] == [INERTIA, GAIN, *bare]
        assert all(np.array_equal(drawn[key], bare[key]) for key in bare)


def test_cells_are_numbers_words_and_texts(tmp_path):
    found = read(tmp_path, "a.n;a.on;a.t[1];a.t[0];a.m[0][0];a.m[0][1];a.m[1][0];a.m[1][1];b[2]\n"
                 "1e3;true;x y;2012-03-04;1;2;3;4;9\n\n-2;false;z;w;5;6;7;8;-9\n")  # fmt: skip
    assert found == {
        "a.n": (1e3, -2.0),
        "a.on": (True, False),
        "a.t": (("2012-03-04", "x y"), ("w", "z")),
        "a.m": (((1.0, 2.0), (3.0, 4.0)), ((5.0, 6.0), (7.0, 8.0))),
        "b[2]": (9.0, -9.0),
    }


def test_texts_times_and_whole_numbers_are_taken(make):
    scenario = make({"environment.field": {"kind": "igrf14", "degree": 8}})
    table = {START: ("2012-03-04T00:00:00Z", "2013-01-01T00:00:00Z"),
             "environment.field.degree": (3.0, 5.0)}  # fmt: skip
    campaign = campaign_from_data({"table": table}, scenario)
    members = [member_scenario(scenario, campaign, k) for k in (0, 1)]
    assert [each.environment.field.degree for each in members] == [3, 5]
    assert [each.start.year for each in members] == [2012, 2013]


@pytest.mark.parametrize(("text", "expected"), [
    ("", "fleet.csv: must name keys of the scenario in its first line; received nothing"),
    (f"{GAIN}\n", "fleet.csv: must have a row for each member; received none"),
    (f"{GAIN},\n1,2\n", f"fleet.csv: line 1: must name a key above each column; received {GAIN},"),
    (f"{GAIN},start\n\n1,\n", "fleet.csv: line 3: must have a value for start; received nothing"),
    (f"{GAIN},start\n1\n", "fleet.csv: line 2: must have 2 columns as line 1 has; received 1"),
    (f"{GAIN},{GAIN}\n1,2\n", "fleet.csv: line 1: must name each column once"),
])  # fmt: skip
def test_files_that_are_no_table(scenario, tmp_path, text, expected):
    message = message_of(lambda: made(scenario, tmp_path, text))
    assert message.startswith(f"campaign.table: {expected}") and "\n" not in message


def test_a_file_that_is_not_there(scenario, tmp_path):
    message = message_of(lambda: campaign_from_data({"table": "x.csv"}, scenario, tmp_path))
    assert message.startswith("campaign.table: must be a readable file; received ")


LAST = f"{INERTIA}[0],{INERTIA}[1],{INERTIA}[2]\n" + "1,1,1\n" * 20


@pytest.mark.parametrize(("text", "expected"), [
    (LAST + "1,1,9", f'campaign.table."{INERTIA}": the sum of two principal moments must not be '),
    (f"{GAIN}\n1e5\nmuch\n", f'campaign.table."{GAIN}": must be a number; received \'much\''),
    (f"{GAIN}\n1e5\nnan\n", f'campaign.table."{GAIN}": must be finite; received nan'),
    ("control.law.gane\n1\n", 'campaign.table."control.law.gane": must be a known key; '),
    ("contrl.law.gain\n1\n", 'campaign.table."contrl.law.gain": contrl: must be a table to '),
    ("initial.attitude\n1\n", "campaign.table: must have attitudes as initial.quaternion"),
    ("seed\n1\n", 'campaign.table.seed: must not vary: each member has its own'),
    ("no key\n1\n", 'campaign: table."no key": must be a key of the scenario, written like'),
])  # fmt: skip
def test_rows_that_cannot_be_flown(scenario, tmp_path, text, expected):
    message = message_of(lambda: made(scenario, tmp_path, text))
    assert message.startswith(expected) and "\n" not in message


def test_a_mistake_far_down_names_its_member(scenario, tmp_path):
    message = message_of(lambda: made(scenario, tmp_path, LAST + "1,1,9"))
    assert message.endswith("(member 20)")


@pytest.mark.parametrize(("table", "expected"), [
    ({"runs": 41}, "campaign.runs: must be at most 40, the rows of the table; received 41"),
    ({"sampling": "saltelli", "runs": 12}, "campaign.table: must be left out with sampling 'salt"),
    ({"vary": {GAIN: {"uniform": [1.0, 2.0]}}}, f'campaign.vary."{GAIN}": must not overlap'),
    ({"vary": {f"{INERTIA}[0]": {"uniform": [1.0, 2.0]}}}, "campaign.vary.\"spacecraft.body.iner"),
])  # fmt: skip
def test_tables_that_do_not_fit_the_campaign(scenario, tmp_path, table, expected):
    message = message_of(lambda: made(scenario, tmp_path, CSV, **table))
    assert message.startswith(expected) and "\n" not in message


def test_columns_are_of_one_length(scenario):
    table = {GAIN: [1e5, 2e5], LIMIT: [1.0]}
    message = message_of(lambda: campaign_from_data({"table": table}, scenario))
    assert message == f'campaign.table."{LIMIT}": must have 2 values, as {GAIN}; received 1'


def test_members_beyond_the_rows_are_refused(scenario, tmp_path):
    campaign = made(scenario, tmp_path, CSV)
    with pytest.raises(ValueError, match=r"members: must lie within 0\.\.39; received 40 to 40"):
        draw(campaign, scenario, [40])


LAW = """import torquer


@torquer.law()
def rest(inputs, parameters, memory):
    return 0.0, 0.0, 0.0
"""


def test_files_of_laws_in_a_table_are_code(scenario, tmp_path):
    (tmp_path / "one.py").write_text(LAW, encoding="utf-8")
    text = SCENARIO.replace(
        'law = { kind = "bdot_rate", gain_a_m2_s_per_t = 1e5 }',
        f'law = {{ kind = "user", file = "{tmp_path / "one.py"}", function = "rest" }}',
    )
    campaign = made(scenario_from_text(text), tmp_path, "control.law.file\none.py\n")
    assert [*code_named(campaign)] == [
        ('campaign.table."control.law.file"[0]', tmp_path / "one.py")
    ]


def test_slips_in_a_table_are_noted(scenario):
    table = {"initial.rate_deg_s": [[1.0, 0.0, 0.0], [0.01, 0.0, 0.0]], "initial.quaternion":
             [[0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.0]]}  # fmt: skip
    notes = campaign_notes(scenario, campaign_from_data({"table": table}, scenario))
    assert any(each.startswith('campaign.table."initial.quaternion": ') for each in notes)


needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


@needs_jit
def test_rows_fly_in_lanes_and_alone_to_the_same_bits(scenario, tmp_path):
    text = CSV.replace(GAIN, f"{GAIN},initial.rate_deg_s[1]", 1).splitlines()
    text = [text[0], text[1], *(f"{line},{0.1 * k}" for k, line in enumerate(text[2:]))]
    campaign = made(scenario, tmp_path, "\n".join(text), seed=4,
                    vary={"initial.attitude": "uniform"})  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("error", OneByOne)
        result = torquer.fly_campaign(scenario, campaign)
    for member in (0, 11, 39):
        alone = torquer.simulate(member_scenario(scenario, campaign, member))
        rate = np.degrees(np.linalg.norm(alone["omega_body"].values, axis=1))
        assert result["final_rate_deg_s"].values[member] == rate[-1]
    assert np.array_equal(result[INERTIA].values, np.array(ROWS)[:, :3])


@needs_jit
def test_rows_are_added_but_not_changed(scenario, tmp_path):
    lines, to = CSV.splitlines(), tmp_path / "campaign.nc"
    torquer.fly_campaign(scenario, made(scenario, tmp_path, "\n".join(lines[:22])), to=to)
    more = torquer.fly_campaign(scenario, made(scenario, tmp_path, CSV), to=to, resume=True)
    whole = torquer.fly_campaign(scenario, made(scenario, tmp_path, CSV))
    assert np.array_equal(more["final_rate_deg_s"].values, whole["final_rate_deg_s"].values)
    lines[3] = lines[2]
    with pytest.raises(ValueError, match="table: must be the one"):
        torquer.fly_campaign(
            scenario, made(scenario, tmp_path, "\n".join(lines)), to=to, resume=True
        )


# ------------------------------------------------------------------ keys tied to one draw


def tied(variation, source, sampling="random", count=64):
    return {
        "runs": count,
        "seed": 2,
        "sampling": sampling,
        "vary": {INERTIA: source, LIMIT: variation},
    }


@pytest.mark.parametrize("sampling", ["latin_hypercube", "random", "saltelli", "sobol"])
def test_tied_keys_have_one_draw(scenario, sampling):
    source = {"relative": {"normal": {"mean": 1.0, "sigma": 0.05}}}
    campaign = campaign_from_data(tied({"tied_to": INERTIA}, source, sampling, 63), scenario)
    alone = Campaign(**{**tied(None, source, sampling, 63), "vary": {INERTIA: source}})
    drawn, bare = (draw(each, scenario, range(63)) for each in (campaign, alone))
    factor = drawn[INERTIA][:, 0, 0] / scenario.spacecraft.body.inertia_kg_m2[0][0]
    np.testing.assert_allclose(drawn[LIMIT], 3.0 * factor, rtol=1e-14)
    # to tie a key changes nothing of the others
    assert np.array_equal(drawn[INERTIA], bare[INERTIA])
    assert np.array_equal(unit_numbers(campaign, range(63)), unit_numbers(alone, range(63)))
    assert campaign.groups == alone.groups


def test_a_tied_key_may_have_a_distribution_of_its_own(scenario):
    source = {"relative": {"uniform": [0.9, 1.1]}}
    campaign = campaign_from_data(
        tied({"uniform": [5.0, 9.0], "tied_to": INERTIA}, source), scenario
    )
    drawn = draw(campaign, scenario, range(64))
    factor = drawn[INERTIA][:, 0, 0] / scenario.spacecraft.body.inertia_kg_m2[0][0]
    np.testing.assert_allclose(drawn[LIMIT], 5.0 + 4.0 * (factor - 0.9) / 0.2, rtol=1e-12)


@pytest.mark.parametrize("sampling", ["grid", "random"])
def test_lists_are_taken_at_the_same_place(scenario, sampling):
    vary = {LIMIT: {"values": [2.0, 3.0, 4.0]}, "control.sample_s": {"values": [1.0, 2.0]},
            GAIN: {"values": [1e5, 2e5, 3e5], "tied_to": LIMIT}}  # fmt: skip
    runs = {} if sampling == "grid" else {"runs": 30}
    campaign = campaign_from_data({"sampling": sampling, "vary": vary, **runs}, scenario)
    assert campaign.runs == (6 if sampling == "grid" else 30)
    drawn = draw(campaign, scenario, range(campaign.runs))
    pairs = {(a, b) for a, b in zip(drawn[LIMIT], drawn[GAIN], strict=True)}
    assert pairs == {(2.0, 1e5), (3.0, 2e5), (4.0, 3e5)}


def test_the_ends_of_a_tied_key_are_tried(scenario):
    """Those of an unbounded distribution tied to a bounded one are finite, and are tried."""
    source = {"relative": {"uniform": [0.9, 1.1]}}
    normal = {"normal": {"mean": 5.0, "sigma": 1.0}, "tied_to": INERTIA}
    campaign = campaign_from_data(tied(normal, source), scenario)
    assert np.isfinite(draw_values(campaign, scenario, np.full((1, 1), 1e-3))[LIMIT]).all()
    wide = {"normal": {"mean": 5.0, "sigma": 100.0}, "tied_to": INERTIA}
    message = message_of(lambda: campaign_from_data(tied(wide, source), scenario))
    assert message.startswith(f'campaign.vary."{LIMIT}": must be ')


RELATIVE = {"relative": {"uniform": [0.9, 1.1]}}


@pytest.mark.parametrize(("variation", "source", "expected"), [
    ({"tied_to": LIMIT}, RELATIVE, f'"{LIMIT}".tied_to: must be another key of vary; received '),
    ({"tied_to": "x"}, RELATIVE, f'"{LIMIT}".tied_to: must be another key of vary; received \'x\''),
    ({"tied_to": 3}, RELATIVE, f'"{LIMIT}".tied_to: must be another key of vary; received 3'),
    ({"tied_to": INERTIA}, {**RELATIVE, "tied_to": LIMIT}, f'"{INERTIA}".tied_to: must be a key '),
    ({"direction": "uniform", "magnitude": 1.0, "tied_to": INERTIA}, RELATIVE,
     f'"{LIMIT}": must be drawn of 1 random numbers, as {INERTIA}; received one of 3'),
    ({"values": [1.0, 2.0], "tied_to": INERTIA}, {"values": [1.0, 2.0, 3.0]},
     f'"{LIMIT}".values: must have 3 values, as {INERTIA}; received 2'),
    ({"relative": {"uniform": [0.9, 1.1], "tied_to": INERTIA}}, RELATIVE,
     f'"{LIMIT}".relative.tied_to: must stand beside it; received it within'),
    (RELATIVE, {"tied_to": "initial.attitude"}, f'"{INERTIA}".tied_to: must be another key of '),
])  # fmt: skip
def test_ties_that_cannot_be(scenario, variation, source, expected):
    message = message_of(lambda: campaign_from_data(tied(variation, source), scenario))
    assert message.startswith(f"campaign.vary.{expected}") and "\n" not in message


@needs_jit
def test_tied_members_fly_in_lanes_and_alone(scenario):
    made = campaign_from_data(
        {"runs": 24, "vary": {INERTIA: RELATIVE, LIMIT: {"tied_to": INERTIA}}}, scenario
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error", OneByOne)
        result = torquer.fly_campaign(scenario, made)
    assert groups_in(result) == [INERTIA]
    alone = torquer.simulate(member_scenario(scenario, made, 17))
    rate = np.degrees(np.linalg.norm(alone["omega_body"].values, axis=1))
    assert result["final_rate_deg_s"].values[17] == rate[-1]
    ratio = result[LIMIT].values / result[INERTIA].values[:, 0, 0]
    np.testing.assert_allclose(ratio, 3.0, rtol=1e-13)
