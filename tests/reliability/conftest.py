"""Runs in processes of their own that can be hit by anything."""

import os
import subprocess
import sys

import pytest
from reliability_processes import CAMPAIGN, KINDS, LAWS, SCENARIO

from torquer.cli import main


@pytest.fixture
def scenario_file(tmp_path):
    """`scenario_file("plain", duration_s=1e5)`: a file of a scenario with such a law.

    With `runs` it has a campaign, whose members fly side by side.
    """

    def write(law, duration_s=600.0, record_s=10.0, runs=0):
        (tmp_path / "laws.py").write_text(LAWS)
        path = tmp_path / "scenario.toml"
        steps = f"{record_s}, step_s = 1.0" if runs else record_s
        text = SCENARIO.format(law=KINDS[law], duration_s=duration_s, record_s=steps)
        path.write_text(text + (CAMPAIGN.format(runs=runs) if runs else ""))
        return path

    return write


@pytest.fixture
def shell():
    """`shell("sh", "-c", text)`: a command in a process of its own, ended with the test."""
    begun = []

    def begin(*command, before=None, **environment):
        begun.append(
            subprocess.Popen(
                command,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
                env={**os.environ, **environment},
                preexec_fn=before,
            )
        )
        return begun[-1]

    yield begin
    for each in begun:
        if each.poll() is None:
            each.kill()
        each.communicate()


@pytest.fixture
def process(shell):
    """`process("run", path)`: `torquer run path` in a process of its own."""

    def begin(*arguments, **how):
        return shell(sys.executable, "-m", "torquer", *map(str, arguments), **how)

    return begin


@pytest.fixture
def call(capsys, monkeypatch):
    """`call("run", path)`: exit code, standard output and error of a command in this process."""
    monkeypatch.setattr("torquer.cli.compiling._has_loop", lambda: True)

    def run(*arguments):
        with pytest.raises(SystemExit) as left:
            main([str(argument) for argument in arguments])
        return left.value.code, *capsys.readouterr()

    return run
