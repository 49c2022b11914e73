"""`torquer campaign`: its files, one member alone, going on, mistakes."""

import json

import numpy as np
import pytest
from artificial_campaign import artificial

import torquer
from torquer.base.strict_json import json_text
from torquer.campaign.comparison import comparison
from torquer.campaign.several import compare_several
from torquer.compile import engine
from torquer.simulation.results.file import save

CAMPAIGN = """
[campaign]
runs = 20
[campaign.vary]
initial.rate_deg_s = { direction = "uniform", magnitude = { uniform = [0.5, 4.0] } }
"""
needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


@pytest.fixture
def campaign_file(scenario):
    scenario.write_text(scenario.read_text() + CAMPAIGN)
    return scenario


@needs_jit
def test_a_campaign_writes_its_files(call, campaign_file, tmp_path):
    out = tmp_path / "out"
    code, printed, err = call("campaign", campaign_file, "--out", out, "--json")
    assert (code, err) == (0, "")
    summary = json.loads(printed)
    assert summary["members"] == 20 and summary["failed"] == 0
    assert json.loads((out / "summary.json").read_text()) == summary
    assert torquer.load(out / "campaign.nc").sizes["member"] == 20
    names = {file.name for file in out.iterdir()}
    assert names == {"campaign.nc", "summary.json", "report.html", "plots"}
    assert len(list((out / "plots").glob("*.png"))) >= 4


@needs_jit
def test_a_page_and_figures_are_written_beside_the_report(call, campaign_file, tmp_path):
    out = tmp_path / "out"
    code, printed, err = call(
        "campaign", campaign_file, "--out", out, "--page", "--figure", "paper"
    )
    assert (code, err) == (0, "")
    assert printed.rstrip().endswith(
        f"{out}: campaign.nc, summary.json, report.html, page.pdf, plots/, paper/"
    )
    assert (out / "page.pdf").read_bytes().startswith(b"%PDF-")
    names = {file.name for file in out.iterdir()}
    assert names == {"campaign.nc", "summary.json", "report.html", "page.pdf", "plots", "paper"}
    assert {file.suffix for file in (out / "paper").iterdir()} >= {".pdf"}


@pytest.mark.parametrize("option", [("--page",), ("--figure", "paper"), ("--plots",)])
def test_a_member_alone_needs_a_report_for_its_pictures(call, option):
    code, _, err = call("campaign", "any.toml", "--member", 1, *option, "--no-report")
    assert code == 2
    assert err == f"error: {option[0]}: must not be given with --no-report; received both\n"


@needs_jit
def test_a_member_flies_alone_to_the_same_end(call, campaign_file, no_report, tmp_path):
    out = tmp_path / "out"
    assert call("campaign", campaign_file, "--out", out, "--no-report")[0] == 0
    rates = torquer.load(out / "campaign.nc")["final_rate_deg_s"].values
    code, printed, _ = call(
        "campaign", campaign_file, "--member", 13, "--out", out / "13", "--json"
    )
    assert code == 0 and json.loads(printed)["final_rate_deg_s"] == rates[13]
    assert torquer.load(out / "13" / "result.nc").attrs["how_it_ended"] == "complete"


@needs_jit
def test_a_member_beyond_the_files_runs_flies_with_theirs(call, campaign_file, no_report, tmp_path):
    out = tmp_path / "out"
    code, _, err = call("campaign", campaign_file, "--member", 25, "--out", out, "--no-report")
    assert (code, err) == (2, "error: --member: must lie within 0..19; received 25\n")
    options = ("--member", 25, "--runs", 30, "--out", out, "--no-report")
    assert call("campaign", campaign_file, *options)[0] == 0
    assert torquer.load(out / "result.nc").attrs["how_it_ended"] == "complete"


@needs_jit
def test_runs_are_added_and_nothing_is_overwritten(call, campaign_file, tmp_path):
    out = tmp_path / "out"
    options = ("--out", out, "--no-report")
    assert call("campaign", campaign_file, *options, "--runs", 7)[0] == 0
    before = torquer.load(out / "campaign.nc")
    code, _, err = call("campaign", campaign_file, *options)
    assert (code, err) == (2, (
        f"error: --out: must hold no campaign; received {out / 'campaign.nc'}: --resume continues "
        "it, --overwrite replaces it; or choose another --out\n"
    ))  # fmt: skip
    assert call("campaign", campaign_file, *options, "--runs", 3, "--overwrite")[0] == 0
    assert torquer.load(out / "campaign.nc").sizes["member"] == 3
    assert call("campaign", campaign_file, *options, "--resume")[0] == 0
    more = torquer.load(out / "campaign.nc")
    assert more.sizes["member"] == 20
    kept = more["final_rate_deg_s"].values[:7]
    assert np.array_equal(kept, before["final_rate_deg_s"].values)


@needs_jit
def test_flying_one_by_one_is_reported(call, campaign_file, tmp_path):
    text = campaign_file.read_text().replace("step_s =", 'integrator = "splitting"\nstep_s =')
    campaign_file.write_text(text.replace("runs = 20", "runs = 2"))
    code, _, err = call("campaign", campaign_file, "--out", tmp_path / "out", "--no-report")
    assert code == 0
    assert err.startswith(
        "note: members fly one by one, not 16 at a time: they have an integrator that splits"
    )


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (("--runs", 0), "--runs: must be greater than or equal to 1; received 0"),
        (("--runs", 1.5), "Invalid value for --runs: must be a whole number; received 1.5"),
        (("--bogus", 1), "--bogus: must be a known option; --help lists them"),
        (("--otu", 1), "--otu: must be a known option (did you mean --out?)"),
        (("twice",), "arguments: must be no more than the command takes; received also twice"),
        (("--member", 20), "--member: must lie within 0..19; received 20"),
        (("--member", -1), "--member: must lie within 0..19; received -1"),
        (("--workers", 0), "--workers: must be 1 or more; received 0"),
        (("--member", 1, "--resume"), "--resume: must not be given with --member; received both"),
        (("--member", 1, "--workers", 2),
         "--workers: must not be given with --member; received both"),
        (("--member", 1, "--where", "processes"),
         "--where: must not be given with --member; received both"),
        (("--member", 20, "--runs", 20), "--member: must lie within 0..19; received 20"),
    ],
)  # fmt: skip
def test_mistakes_are_one_line(call, campaign_file, tmp_path, options, expected):
    code, out, err = call("campaign", campaign_file, "--out", tmp_path / "out", *options)
    assert (code, out, err) == (2, "", f"error: {expected}\n")


def test_a_file_without_a_campaign_is_refused(call, scenario, tmp_path):
    code, _, err = call("campaign", scenario, "--out", tmp_path / "out")
    assert code == 2 and err.count("\n") == 1
    assert err.startswith("error: campaign: must be given, a table [campaign] with runs, vary")


# ------------------------------------------------------------------ files of laws that vary

EVIL = '{ kind = "user", file = "../evil.py", function = "law" }'
#: Ways in which a member may come to a file: by a law, by all laws, by its file alone, which is one
#: value among more than are tried.
NAMED = {
    '"control.law"': ("[EVIL]", "[0].file"),
    "control": ("[{ law = EVIL, sample_s = 2.0 }]", "[0].law.file"),
    '"control.law.file"': ("[" + 300 * '"own.py", ' + '"../evil.py"]', "[300]"),
}


@pytest.fixture
def planted(scenario):
    """`planted(key)`: a scenario in a folder, with a file above it that leaves a trace."""
    folder = scenario.parent / "here"
    folder.mkdir()
    trace = scenario.parent / "executed"
    law = "def law(inputs, parameters, memory):\n    return 0.0, 0.0, 0.0\n"
    (scenario.parent / "evil.py").write_text(f"open({str(trace)!r}, 'w').close()\n{law}")
    (folder / "own.py").write_text(law)
    own = EVIL.replace("../evil.py", "own.py")

    def plant(key):
        values = NAMED[key][0].replace("EVIL", EVIL)
        text = scenario.read_text().replace('{ kind = "bdot", gain_a_m2_s_per_t = 1e6 }', own)
        path = folder / "scenario.toml"
        vary = f"[campaign]\nruns = 2\n[campaign.vary]\n{key} = {{ values = {values} }}\n"
        path.write_text(text + vary)
        return path, scenario.parent / "evil.py", trace

    return plant


@pytest.mark.parametrize("command", [("campaign",), ("campaign", "--member", 0), ("validate",)])
@pytest.mark.parametrize("key", NAMED)
def test_a_file_that_a_member_names_must_be_allowed(call, planted, key, command):
    path, file, trace = planted(key)
    code, _, err = call(*command, path)
    assert (code, err) == (2, (
        f"error: campaign.vary.{key}.values{NAMED[key][1]}: must lie in the scenario's folder, or "
        f"be allowed by --code-from-anywhere; received {file}\n"
    ))  # fmt: skip
    path.write_text(path.read_text().replace('file = "own.py"', 'file = "gone.py"'))
    code, _, err = call(*command, path, "--no-user-code")
    assert code == 2 and "must not be given with --no-user-code" in err
    assert not trace.exists()


def test_files_that_members_name_are_listed(call, planted, strict_json):
    path, file, trace = planted('"control.law.file"')
    code, out, _ = call("validate", path, "--code-from-anywhere")
    assert code == 0 and not trace.exists()
    place = 'campaign.vary."control.law.file".values[300]'
    assert f"executes {file} ({place}); --no-user-code refuses it\n" in out
    assert out.count("executes ") == 2  # the scenario's own file once
    code, out, _ = call("validate", path, "--code-from-anywhere", "--json")
    assert strict_json(out)["executes"] == sorted(map(str, (file, path.parent / "own.py")))


# ------------------------------------------------------------------ two campaigns


@pytest.fixture
def two(tmp_path):
    """Folders of campaigns: B is ten percent slower in the same members, and fails twice."""
    for name, made in (("a", artificial()), ("b", artificial(60, (3, 20), factor=1.1))):
        (tmp_path / name).mkdir()
        save(made, tmp_path / name / "campaign.nc")
    return tmp_path / "a", tmp_path / "b"


def test_two_campaigns_are_compared(call, two, tmp_path):
    code, out, err = call("campaign", "compare", *two)
    assert (code, err) == (0, "") and not list(tmp_path.glob("**/*.html"))
    found = comparison(*(torquer.load(folder / "campaign.nc") for folder in two))
    each = found["outcomes"]["coil_energy_j"]
    assert f"{each['difference']:.4g} (" in out and f"p = {each['test']['p']:.4g}" in out
    median = found["summaries"][1]["outcomes"]["coil_energy_j"]["quantiles"]["0.5"]["value"]
    assert f"{median:.4g}" in out and "Wilcoxon signed-rank" in out
    assert "60 members had the same inputs in A and in B" in " ".join(out.split())


def test_comparison_is_printed_as_json_and_written_as_report(call, two, tmp_path, strict_json):
    files = [folder / "campaign.nc" for folder in two]
    code, out, _ = call("campaign", "compare", *files, "--out", tmp_path / "out", "--json")
    assert code == 0
    assert strict_json(out) == json.loads(json_text(comparison(*map(torquer.load, files))))
    assert (tmp_path / "out" / "report.html").stat().st_size > 10_000
    assert (tmp_path / "out" / "plots" / "differences.png").exists()


def test_three_campaigns_are_compared(call, two, tmp_path, strict_json):
    (tmp_path / "c").mkdir()
    save(artificial(60, (3, 20), factor=2.0), tmp_path / "c" / "campaign.nc")
    three = (*two, tmp_path / "c")
    code, out, err = call("campaign", "compare", *three, "--out", tmp_path / "out")
    assert (code, err) == (0, "") and "Friedman" in out and "difference from A" in out
    assert (tmp_path / "out" / "report.html").stat().st_size > 10_000
    results = [torquer.load(folder / "campaign.nc") for folder in three]
    code, out, _ = call("campaign", "compare", *three, "--json")
    assert strict_json(out) == json.loads(json_text(compare_several(results)))
    code, _, err = call("campaign", "compare", *three, *three, *three)
    assert code == 2 and "campaigns: must be 2 to 6; received 9" in err


def test_what_cannot_be_compared_is_reported(call, two, tmp_path):
    nothing, single = tmp_path / "none", tmp_path / "single.nc"
    save(artificial().drop_attrs(), single)
    for b, message in (
        (nothing, "B: must be the folder or the campaign.nc of a flown campaign; received "
         f"{nothing} (No such file or directory)"),
        (single, f"B: must be the result of a campaign; received {single}"),
    ):  # fmt: skip
        assert call("campaign", "compare", two[0], b) == (2, "", f"error: {message}\n")
    damaged = bytearray((two[1] / "campaign.nc").read_bytes())
    damaged[5000] ^= 1
    (two[1] / "campaign.nc").write_bytes(damaged)
    code, _, err = call("campaign", "compare", *two)
    assert code == 2 and "must be as torquer wrote it" in err


@needs_jit
@pytest.mark.parametrize(
    ("torques", "expected"), [("[0.1, 0, 0]", 1), ("[0, 0, 0], [0.1, 0, 0]", 0)]
)
def test_a_campaign_of_which_nothing_is_left_is_no_success(
    call, scenario, no_report, tmp_path, torques, expected
):
    text = scenario.read_text() + "[disturbance]\nconstant_torque_n_m = [1e-6, 0, 0]\n"
    vary = f"[campaign.vary]\ndisturbance.constant_torque_n_m = {{ values = [{torques}] }}\n"
    scenario.write_text(f"{text}[campaign]\nruns = 12\nseed = 3\n{vary}")
    out = tmp_path / "out"
    code, printed, err = call("campaign", scenario, "--out", out, "--no-report")
    assert (code, err) == (expected, "")
    assert "RK4" in printed
    assert "no member has a value" in printed and "mean of 0" not in printed
    again = ("--out", out, "--no-report", "--overwrite", "--json")
    code, printed, _ = call("campaign", scenario, *again)
    found = json.loads(printed)
    assert (code, found["failed"] == found["members"]) == (expected, expected == 1)


@needs_jit
def test_parts_are_joined_to_the_campaign(call, campaign_file, tmp_path):
    whole, parts = tmp_path / "whole", [tmp_path / f"part-{k}" for k in (1, 2)]
    assert call("campaign", campaign_file, "--out", whole, "--no-report")[0] == 0
    code, printed, _ = call("campaign", campaign_file, "--out", parts[0], "--part", "1/2")
    assert code == 0 and "part 1/2: members 0 to 9, 0 failed; `torquer campaign join`" in printed
    code, printed, _ = call("campaign", campaign_file, "--out", parts[1], "--part", "2/2", "--json")
    assert json.loads(printed) == {"part": "2/2", "first": 10, "last": 19, "failed": 0}
    assert [*parts[0].iterdir()] == [parts[0] / "campaign.nc"]
    out = tmp_path / "joined"
    code, printed, err = call("campaign", "join", *parts, "--out", out, "--json")
    assert (code, err) == (0, "")
    assert json.loads(printed) == json.loads((whole / "summary.json").read_text())
    assert (out / "report.html").exists()
    assert torquer.load(out / "campaign.nc").identical(torquer.load(whole / "campaign.nc"))
    assert call("campaign", "join", *parts, "--out", out)[0] == 2  # there is one already


@needs_jit
@pytest.mark.parametrize("part", ["3/2", "0/2", "1/21"])
def test_a_part_that_there_is_not(call, campaign_file, tmp_path, part):
    code, _, err = call("campaign", campaign_file, "--out", tmp_path / "out", "--part", part)
    expected = f"error: --part: must be K/N with 1 <= K <= N <= 20 (runs); received {part}\n"
    assert (code, err) == (2, expected)


@pytest.mark.parametrize("part", ["2", "1-2", "a/b", "1/2/3", "-1/2", " 1/2"])
def test_a_part_that_is_none(call, campaign_file, tmp_path, part):
    code, _, err = call("campaign", campaign_file, "--out", tmp_path / "out", f"--part={part}")
    assert (code, err) == (2, f"error: --part: must be K/N, such as 2/8; received {part!r}\n")


def test_parts_that_are_none(call, campaign_file, tmp_path):
    out = tmp_path / "out"
    code, _, err = call("campaign", "join", tmp_path / "none", "--out", out)
    assert code == 2 and err.startswith("error: PARTS: must be files that can be read; received ")
    code, _, err = call("campaign", campaign_file, "--member", "1", "--part", "1/2")
    assert (code, err) == (2, "error: --part: must not be given with --member; received both\n")
