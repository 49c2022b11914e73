"""What a new user meets first: help, examples, `init`, completion, mistakes as JSON."""

import json
import re
import shlex
import shutil
import subprocess
import sys

import pytest

import torquer
from torquer.analysis.notes.notes import write_notes
from torquer.cli.app import app
from torquer.cli.examples import EXAMPLES


def commands(at=app, words=()):
    """Words of every command."""
    yield words
    for name in at:
        if not name.startswith("-"):
            yield from commands(at[name], (*words, name))


ALL = sorted(" ".join(words) for words in commands())


def test_every_command_has_examples():
    assert sorted(EXAMPLES) == ALL


@pytest.mark.parametrize("name", ALL)
def test_help_ends_with_examples_and_has_no_stray_flags(call, name):
    code, out, err = call(*name.split(), "--help")
    assert (code or 0, err) == (0, "")
    answer = " ".join(out.split())
    assert "--empty" not in answer and "--no-json" not in answer
    shown = answer.partition("Examples:")[2]
    for line in EXAMPLES[name]:
        assert " ".join(line.split()) in shown


@pytest.mark.parametrize("words", [(), ("run",), ("design", "coil"), ("campaign",)])
def test_help_is_a_command_too(call, words):
    code, out, err = call("help", *words)
    assert (code, out, err) == call(*words, "--help") and (code or 0) == 0
    assert "Examples:" in out
    assert call("help", "swim")[0] == 2


@pytest.mark.parametrize("name", ALL)
def test_every_option_is_explained(name):
    """Those of a spec by the string below the field, which Python does not check."""
    command = app
    for word in name.split():
        command = command[word]
    if command.default_command is not None:
        given = command.assemble_argument_collection(parse_docstring=True)
        options = [each for each in given if each.index is None and not each.children]
        assert [each.name for each in options if not each.parameter.help] == []


@pytest.mark.parametrize("line", sorted({line for each in EXAMPLES.values() for line in each}))
def test_examples_are_commands(line):
    words = shlex.split(line.partition(" > ")[0])
    assert words[0] == "torquer"
    if "--help" not in words:
        app.parse_args(words[1:], exit_on_error=False, print_error=False)


def test_version_is_an_option_too(call):
    code, out, err = call("--version")
    assert (code or 0, out, err) == (0, f"{torquer.__version__}\n", "")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_names_the_commands(call, shell):
    code, out, err = call("completion", shell)
    assert (code, err) == (0, "")
    assert all(word in out for word in ("validate", "filter-check", "no-report"))


# ------------------------------------------------------------------ init


def test_init_writes_a_scenario_that_is_valid(call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, err = call("init", "mine")
    assert (code, err) == (0, "")
    assert out.splitlines() == ["mine.toml: written", "torquer validate mine.toml",
                                "torquer run mine.toml"]  # fmt: skip
    scenario = torquer.load_scenario("mine.toml")
    assert scenario.name == "mine" and write_notes(scenario) == []


def test_what_is_commented_out_may_be_used(tmp_path):
    """Every key that stands there as a comment is one."""
    from torquer.cli.commands.init import _START

    text = _START.read_text(encoding="utf-8")
    assert "# lag_s" in text and "# [spacecraft.gyro]" in text
    opened = re.sub(r"^# (?=\[?[\w.]+\]? *(=|#|$))", "", text, flags=re.M)
    scenario = torquer.scenario_from_text(opened)
    assert scenario.spacecraft.coils.lag_s > 0.0 and scenario.spacecraft.gyro.noise_deg_s > 0.0


def test_listed_examples_are_described_by_whole_sentences(call):
    code, out, _ = call("init", "--list", "--json")
    about = json.loads(out)
    assert code == 0 and len(about) > 15 and all(about.values())
    assert about["five_days"].endswith("while gravity gradient and drag load them")
    assert about["my_law"].endswith("the rest as in the quick start")


def test_init_copies_an_example_with_its_law(call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, _ = call("init", "own", "--example", "my_law")
    assert code == 0 and out.startswith("own.toml, my_law.py: written")
    assert torquer.load_scenario("own.toml").control.law.file.is_file()
    code, out, err = call("init", "own", "--example", "my_law")
    assert (code, out) == (2, "") and "must not name an existing file; received own.toml" in err


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["init"], "NAME: must be given; received nothing"),
        (["init", "a b"], "NAME: must begin with a letter, digit or '_'"),
        (["init", "x", "--example", "chibis"], "--example: must be one of bench, chibis_m_day, "),
        (["init", "nowhere/x"], "NAME: must be a folder that can be written"),
        (["init", "x", "--like", "4u"], "--like: must be one of 1u, 2u, 3u, 6u, 12u, 50kg, 150kg"),
        (["init", "x", "--mass-kg", "4"], "--like: must be one of 1u, 2u, 3u, 6u, 12u, 50kg, 15"),
        (["init", "x", "--like", "3u", "--panels", "1"], "--panels: must be an even number, 0 or"),
        (["init", "x", "--like", "3u", "--example", "bench"], "--like: must not be given with --e"),
    ],
)
def test_init_refuses(call, tmp_path, monkeypatch, arguments, says):
    monkeypatch.chdir(tmp_path)
    code, out, err = call(*arguments)
    assert (code, out) == (2, "") and err.startswith(f"error: {says}") and err.count("\n") == 1


def test_init_writes_a_satellite_of_a_size(call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, _ = call("init", "mine", "--like", "6u", "--mass-kg", "8", "--panels", "2")
    assert code == 0 and out.startswith("mine.toml: written")
    body = torquer.load_scenario("mine.toml").spacecraft.body
    assert body.mass_kg == 8.0 and body.box_m[0] > 0.2263
    code, out, _ = call("validate", "mine.toml")
    assert code == 0 and "campaign: 64 runs" in out
    code, _, err = call("init", "mine", "--like", "6u")
    assert code == 2 and "must not name an existing file; received mine.toml" in err


def test_examples_are_found_where_they_are_installed(tmp_path, monkeypatch):
    from torquer.cli.commands import init as work

    here = work.examples()
    assert len(here) > 5 and work._about(here["spinner"]) == "Spin stabilisation in four stages"
    installed = tmp_path / "data" / "share" / "torquer" / "examples"
    shutil.copytree(here["spinner"].parent, installed)
    monkeypatch.setattr(work, "__file__", str(tmp_path / "site" / "torquer" / "cli" / "x.py"))
    monkeypatch.setattr(work.sysconfig, "get_path", lambda name: str(tmp_path / name))
    assert work.examples().keys() == here.keys()
    assert work.examples()["spinner"].is_relative_to(installed)


# ------------------------------------------------------------------ mistakes


@pytest.mark.parametrize(
    ("arguments", "first"),
    [
        (["run", "no.toml", "--json"], "scenario: must be a readable file; received no.toml"),
        (["swim", "--json"], 'Unknown command "swim"'),
        (["field", "point", "--lat", "95", "--lon", "0", "--date", "2025", "--json"],
         "--lat: must lie within -90..90 deg; received 95"),
        (["field", "point", "--lat", "5", "--lon", "0", "--date", "2031", "--json"],
         "--date: field model igrf14: date must lie within 1900.0..2030.0; received 2031.0"),
    ],
)  # fmt: skip
def test_mistakes_are_json_where_that_is_asked(call, strict_json, arguments, first):
    code, out, err = call(*arguments)
    (answer,) = strict_json(out)["errors"]
    assert code == 2 and answer.startswith(first) and err == f"error: {answer}\n"


@pytest.mark.parametrize("command", ["run", "validate", "board", "budget", "modes"])
def test_a_file_without_its_ending_has_its_suggestion(call, scenario, command):
    if command == "board":
        pytest.importorskip("uvicorn")
    code, _, err = call(command, scenario.with_suffix(""))
    assert code == 2 and err.endswith(f"(No such file or directory); did you mean {scenario}?\n")
    code, _, err = call(command, scenario.with_name("other"))
    assert code == 2 and err.endswith("other (No such file or directory)\n")


def test_a_mistyped_key_has_its_suggestion(call, scenario):
    scenario.write_text(scenario.read_text().replace("altitude_km", "altitud_km"))
    code, _, err = call("validate", scenario)
    assert code == 2
    assert "orbit.altitud_km: must be a known key; received 550 (did you mean altitude_km?)" in err


def test_the_first_run_says_that_it_compiles(monkeypatch, capsys):
    from torquer.cli import compiling

    monkeypatch.setattr(compiling, "is_cold", lambda: True)
    monkeypatch.setattr(compiling, "_printed", False)
    for _ in range(2):
        with compiling.compiling_shown():
            pass
    assert capsys.readouterr().err == "note: compiling, once, about half a minute\n"


def test_what_is_compiled_is_counted():
    from types import SimpleNamespace

    from torquer.cli import compiling
    from torquer.compile.numba_private import event

    seen, dispatcher = [], SimpleNamespace()
    with compiling.counting(seen.append):
        for _ in range(3):
            with event.trigger_event("numba:compile", data={"dispatcher": dispatcher}):
                pass
    assert len(seen) == 3 and 0.0 < seen[0] < seen[1] < seen[2] < 1.0


def test_both_ways_say_the_same(call, scenario):
    """In a process of its own `validate` needs no compiler; in this one it has it. Only the other
    process says whether the loop is in the cache: `warm` hides that here."""
    command = [sys.executable, "-m", "torquer", "validate", str(scenario)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert (0, done.stdout.partition("before that")[0], done.stderr) == call("validate", scenario)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("init", ""), "NAME: must begin with a letter, digit or '_' and hold only these"),
        (("explain", "gain"), "or gain_a_m2_s_per_t or "),
        (("schema", "b", "c"), "arguments: must be no more than the command takes; received also"),
    ],
)
def test_mistakes_are_reported_with_a_way_out(call, arguments, expected):
    code, _, err = call(*arguments)
    assert code == 2 and expected in err and err.count("\n") == 1
