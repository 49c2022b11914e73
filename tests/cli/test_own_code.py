"""Every command that takes a scenario executes no Python file of it where none may be executed."""

import re
from functools import cache

import pytest
from own_parts import (
    CONTROLS,
    EVERY,
    LAW,
    OFF,
    ROOT,
    SENSOR,
    TEXT,
    own_text,
)

from torquer.cli.app import COMMANDS, app

#: What commands need besides the scenario: so many words that they come to it, and no more.
MORE = {
    "ground at": ("2012-01-01T00:00:00Z",),
    "ground report": ("1",),
    "export c": ("--out", "{folder}/c"),
    "ground": ("--link", "tcp:127.0.0.1:9"),
    "ground import": ("{folder}/own.py",),
    "kernels build": ("--out", "{folder}/kernels"),
    "telemetry": ("{folder}/own.py", "--orbit", "{folder}/own.py"),
    "theory": ("bdot",),
}
CAMPAIGN = "[campaign]\nruns = 2\n[campaign.vary]\n"
CAMPAIGN += "'spacecraft.coils.limit_a_m2' = { values = [0.1, 0.2] }\n"
KEYS = (*EVERY, "control.law")


@cache
def arguments(words: str) -> dict:
    """Arguments of a command by their names."""
    found = app
    for word in words.split():
        found = found[word]
    return {each.names[0]: each for each in found.assemble_argument_collection() if each.names}


def all_commands() -> list[str]:
    """All commands by their words: those of the table, and those of groups that are one, too."""
    found = []
    for words in COMMANDS:
        group = app
        for word in words.split():
            group = group[word]
        found += [words, *(f"{words} {name}" for name in group if not name.startswith("-"))]
    return found


def takes_scenario() -> list[tuple[str, str]]:
    """(words, argument) of all arguments that are the file of a scenario."""
    return [
        (words, name)
        for words in all_commands()
        for name, each in arguments(words).items()
        if re.fullmatch(r"(--)?(scenarios?|twin)", name.lower()) and "Path" in str(each.hint)
    ]


TAKE = takes_scenario()


@pytest.fixture
def planted(tmp_path):
    """A function that writes a scenario with the part of a key; its file leaves a trace.

    The scenario is not loaded here, which would let its file be executed in this process.
    """

    def plant(key):
        text = own_text(*EVERY.get(key, ()), control=CONTROLS.get(key, OFF))
        (tmp_path / "scenario.toml").write_text(text + CAMPAIGN)
        mark = f"open({str(tmp_path / 'executed')!r}, 'w').close()\n"
        estimate = (ROOT / "examples/own_parts.py").read_text()
        for name, text in (("own.py", TEXT), ("estimate.py", estimate), ("law.py", LAW)):
            (tmp_path / name).write_text(mark + text)
        return tmp_path / "scenario.toml"

    return plant


def words_for(words, name, file, folder, refused):
    """The command with the scenario, and with what else it needs."""
    given = [word.format(folder=folder) for word in MORE.get(words, ())]
    given += [name, str(file)] if name.startswith("--") else [str(file)]
    return [*words.split(), *given, *(("--no-user-code",) if refused else ())]


def test_the_commands_that_take_a_scenario_are_found():
    """Those of the review, at least; and every command that can be told to execute no code."""
    found = {words for words, _ in TAKE}
    assert found >= {
        *("board", "budget", "campaign", "design detumble", "design magneto-gyro"),
        *("design three-axis", "export c", "faults", "field orbit", "filter-check", "fly"),
        *("ground", "ground import", "kernels build", "modes", "packets", "run", "telemetry"),
        *("theory", "theory magneto-gyro", "validate"),
    }
    careful = {words for words in all_commands() if "--no-user-code" in arguments(words)}
    recorded = {"session bisect", "session replay"}  # of what a recording names: test_fly_command
    assert careful - recorded <= found and recorded <= careful


@pytest.mark.parametrize("key", KEYS)
@pytest.mark.parametrize(
    ("words", "name"), [t for t in TAKE if "--no-user-code" in arguments(t[0])]
)
def test_a_command_that_may_execute_code_can_be_told_not_to(
    call, planted, tmp_path, words, name, key
):
    file = planted(key)
    code, out, err = call(*words_for(words, name, file, tmp_path, True))
    part = {"control.law": "law.py", "control.estimator": "estimate.py"}.get(key, "own.py")
    assert err == (
        f"error: {key}.file: must not be given with --no-user-code; received {tmp_path / part}\n"
    )
    assert code == 2 and not out and not (tmp_path / "executed").exists()


@pytest.mark.parametrize("key", KEYS)
@pytest.mark.parametrize(
    ("words", "name"), [t for t in TAKE if "--no-user-code" not in arguments(t[0])]
)
def test_a_command_that_cannot_be_told_executes_nothing(
    call, planted, tmp_path, monkeypatch, words, name, key
):
    """It answers without the part, or refuses it in one line."""
    monkeypatch.chdir(tmp_path)
    file = planted(key)
    code, _, err = call(*words_for(words, name, file, tmp_path, False))
    assert not (tmp_path / "executed").exists() and "Traceback" not in err
    refused = code in (1, 2) and err.count("\n") == 1 and err.startswith("error: ")
    assert code in (0, None) or refused


@pytest.mark.parametrize(
    ("words", "name"), [t for t in TAKE if "--no-user-code" not in arguments(t[0])]
)
def test_a_command_that_cannot_be_told_reads_the_scenario(call, planted, tmp_path, words, name):
    """So that the test above is of the scenario, not of another mistake before."""
    file = planted("orbit")
    file.write_text("nonsense = 1\n" + file.read_text())
    code, _, err = call(*words_for(words, name, file, tmp_path, False))
    assert code == 2 and err.startswith("error: nonsense: must be a known key")


def test_all_keys_of_a_file_that_is_executed_are_listed(call, tmp_path):
    """Once only the first key that names it."""
    (tmp_path / "own.py").write_text(TEXT)
    text = own_text(*EVERY["environment.field"], *EVERY["disturbance.own.leak"])
    (tmp_path / "scenario.toml").write_text(text)
    code, out, _ = call("validate", tmp_path / "scenario.toml")
    assert code == 0 and out.count("executes ") == 1
    assert f"executes {tmp_path / 'own.py'} (environment.field, disturbance.own.leak); " in out


@pytest.mark.parametrize("key", KEYS)
def test_a_complete_run_of_other_code_is_not_shown_as_this_one(call, tmp_path, key):
    """With --resume the result of the file before its edit was shown without a word."""
    lines = (SENSOR,) if key == "control.law" else EVERY.get(key, ())
    text = own_text(*lines, control=CONTROLS.get(key, OFF))
    scenario, out = tmp_path / "scenario.toml", tmp_path / "out"
    scenario.write_text(re.sub("duration_s = [0-9.]+", "duration_s = 5.0", text))
    estimate = (ROOT / "examples/own_parts.py").read_text()
    for name, text in (("own.py", TEXT), ("estimate.py", estimate), ("law.py", LAW)):
        (tmp_path / name).write_text(text)
    assert call("run", scenario, "--out", out, "--no-report")[0] == 0
    assert call("run", scenario, "--out", out, "--no-report", "--resume")[0] == 0
    for file in tmp_path.glob("*.py"):
        file.write_text(file.read_text() + "# edited\n")
    code, _, err = call("run", scenario, "--out", out, "--no-report", "--resume")
    what = {"control.law": "law mine", "control.estimator": "estimator calm"}.get(key, key)
    assert code == 2 and err.startswith(f"error: {what}")
    assert "must be the one with which the run began; " in err and "edited since\n" in err


def takes_software() -> list[str]:
    """Commands one of whose arguments is a software file."""
    return [
        words
        for words in all_commands()
        if any(re.fullmatch(r"(--)?software", name.lower()) for name in arguments(words))
    ]


#: How the software file is given, and what else, to get as far as its modules.
WITH_SOFTWARE = {
    "fly": (str(ROOT / "examples/chibis_m_day.toml"), "--ticks", "1", "--software"),
    "ground": ("--link", "tcp:127.0.0.1:9", "--no-browser", "--port", "0", "--software"),
    "ground import": ("{folder}/own.py", "--folder", "{folder}", "--software"),
    "packets": (),
}
#: Commands that need no module, and execute none.
NEVER = ("ground", "ground import")


def software_that_executes(folder):
    """A software file with a module whose file leaves a trace when it is executed."""
    (folder / "own.py").write_text(f"open({str(folder / 'executed')!r}, 'w').close()\n")
    made = folder / "software.toml"
    made.write_text('[modules.own]\nfile = "own.py"\nclass = "Own"\n')
    return made


def test_the_commands_that_take_software_are_known():
    assert set(takes_software()) == set(WITH_SOFTWARE)


@pytest.mark.parametrize("words", sorted(set(WITH_SOFTWARE) - set(NEVER)))
def test_modules_of_a_software_file_are_not_executed(call, tmp_path, words):
    before = (each.format(folder=tmp_path) for each in WITH_SOFTWARE[words])
    args = (*words.split(), *before, software_that_executes(tmp_path), "--no-user-code")
    code, _, err = call(*args)
    assert code == 2 and "modules.own.file: must not be given with --no-user-code" in err
    assert not (tmp_path / "executed").exists()


def test_import_executes_no_module(call, tmp_path):
    before = (each.format(folder=tmp_path) for each in WITH_SOFTWARE["ground import"])
    call("ground", "import", *before, software_that_executes(tmp_path))
    assert not (tmp_path / "executed").exists()


@pytest.mark.parametrize("words", [("ground",), ("ground", "passes")])
@pytest.mark.parametrize("key", KEYS)
def test_the_scenarios_of_a_ground_file_are_refused_too(call, planted, tmp_path, key, words):
    planted(key)
    file = tmp_path / "ground.toml"
    file.write_text('[satellites.one]\nlink = "tcp:127.0.0.1:9"\nscenario = "scenario.toml"\n')
    code, _, err = call(*words, str(file), "--no-user-code")
    assert code == 2 and err.startswith(f"error: {key}.file: must not be given with --no-user-code")
    assert not (tmp_path / "executed").exists()
