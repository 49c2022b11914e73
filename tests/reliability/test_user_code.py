"""What a scenario may execute: only what the user allows, and nothing before it is allowed."""

import pytest
from reliability_processes import KINDS, SCENARIO, done

COMMANDS = ("run", "validate", "modes")


@pytest.fixture
def planted(tmp_path):
    """`planted(folder)`: a scenario whose law lies there and leaves a trace if executed."""

    def plant(folder):
        file = (tmp_path / folder / "laws.py").resolve()
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(f"open({str(tmp_path / 'executed')!r}, 'w').close()\n")
        scenario = tmp_path / "here" / "scenario.toml"
        scenario.parent.mkdir(exist_ok=True)
        law = KINDS["plain"].replace("laws.py", str(file))
        scenario.write_text(SCENARIO.format(law=law, duration_s=600.0, record_s=10.0))
        return scenario, file

    return plant


@pytest.mark.parametrize("command", COMMANDS)
def test_no_user_code_is_executed_where_it_is_refused(call, planted, tmp_path, command):
    scenario, file = planted("here")
    code, _, err = call(command, scenario, "--no-user-code")
    message = "control.law.file: must not be given with --no-user-code; "
    assert (code, err) == (2, f"error: {message}received {file}\n")
    assert not (tmp_path / "executed").exists()


@pytest.mark.parametrize("command", COMMANDS)
def test_code_beyond_the_folder_of_the_scenario_needs_an_option(call, planted, tmp_path, command):
    scenario, file = planted("elsewhere")
    code, _, err = call(command, scenario)
    assert code == 2
    assert err == (
        "error: control.law.file: must lie in the scenario's folder, or be allowed by "
        f"--code-from-anywhere; received {file}\n"
    )
    assert not (tmp_path / "executed").exists()


def test_a_law_of_another_folder_is_executed_if_allowed(process, planted, tmp_path):
    scenario, _ = planted("elsewhere")
    done(process("validate", scenario, "--code-from-anywhere"))
    assert (tmp_path / "executed").exists()


def test_a_link_does_not_lead_out_of_the_folder(call, planted, tmp_path):
    scenario, file = planted("elsewhere")
    (scenario.parent / "laws.py").symlink_to(file)
    scenario.write_text(scenario.read_text().replace(str(file), "laws.py"))
    code, _, err = call("validate", scenario)
    assert code == 2 and "must lie in the scenario's folder" in err
    assert not (tmp_path / "executed").exists()
