"""Runs in processes of their own that can be hit by anything."""

import os
import subprocess
import sys

import pytest

SCENARIO = """
start = 2012-03-04T10:31:47Z
orbit = {{ kind = "circular", altitude_km = 550, inclination_deg = 60 }}
environment.field.kind = "averaged"
spacecraft.body.inertia_kg_m2 = [1.0, 1.3, 1.7]
spacecraft.coils.limit_a_m2 = 3.0
spacecraft.magnetometer.noise_nt = 50.0
initial.rate_deg_s = [1.0, -0.6, 0.8]
control = {{ law = {law}, sample_s = 2.0 }}
simulation = {{ duration_s = {duration_s}, record_s = {record_s} }}
"""
LAWS = """
import torquer


@torquer.law(memory={"calls": 0.0})
def compiled(inputs, parameters, memory):
    memory.calls += 1.0
    b = inputs.b_body_t
    return (1e4 * b[0], 1e-6 * memory.calls, -1e4 * b[2])


def plain(inputs, parameters, memory):
    memory[0] += 1.0
    b = inputs.b_body_t
    return (1e4 * b[0], 1e-6 * memory[0], -1e4 * b[2])
"""
KINDS = {
    "built-in": '{ kind = "bdot", gain_a_m2_s_per_t = 1e6 }',
    "compiled": '{ kind = "user", file = "laws.py", function = "compiled" }',
    "plain": '{ kind = "user", file = "laws.py", function = "plain" }',
}


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
def process():
    """`process("run", path)`: the command in a process of its own, ended with the test."""
    begun = []

    def begin(*arguments, before=None, **environment):
        command = [sys.executable, "-m", "torquer", *map(str, arguments)]
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


def done(process, timeout_s=120.0):
    """(Exit code, standard output, standard error) when it has ended; no traceback in either."""
    out, err = process.communicate(timeout=timeout_s)
    assert "Traceback" not in err, err
    return process.returncode, out, err
