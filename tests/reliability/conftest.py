"""Runs in processes of their own that can be hit by anything."""

import os
import subprocess
import sys

import pytest
from reliability_processes import KINDS, LAWS, SCENARIO


@pytest.fixture
def scenario_file(tmp_path):
    """`scenario_file("plain", duration_s=1e5)`: a file of a scenario with such a law."""

    def write(law, duration_s=600.0, record_s=10.0):
        (tmp_path / "laws.py").write_text(LAWS)
        path = tmp_path / "scenario.toml"
        path.write_text(SCENARIO.format(law=KINDS[law], duration_s=duration_s, record_s=record_s))
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
