"""Signals at random instants: what was recorded is kept, and the run goes on to the same bits."""

import os
import random
import signal
import time

import numpy as np
import pytest
from reliability_processes import KINDS, done
from slow_cases import slow_after

import torquer
from torquer.compile import engine

pytestmark = [
    pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT"),
    pytest.mark.skipif(os.name == "nt", reason="signals of another kind"),
]
#: Flights [s] that take one to two seconds, by kind of law.
DURATIONS_S = {"built-in": 1e6, "compiled": 1e6, "plain": 2e4}
SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP", "twice", "SIGKILL")


def differing(a, b):
    """The variables whose bits are not the same in both results."""
    common = set(a.variables) & set(b.variables)
    return sorted(set(a.variables) ^ set(b.variables)) + [
        name
        for name in sorted(common)
        if not np.array_equal(a[name].values, b[name].values, equal_nan=a[name].dtype.kind == "f")
    ]


def hit(process, name, out, after_s):
    """Send a signal that long after the run began to compute."""
    deadline_s = time.monotonic() + 100.0
    while not (out / "result.nc").exists() and time.monotonic() < deadline_s:
        assert process.poll() is None, process.communicate()
        time.sleep(0.01)
    time.sleep(after_s)
    process.send_signal(getattr(signal, "SIGINT" if name == "twice" else name))
    if name == "twice":
        time.sleep(random.random())
        process.send_signal(signal.SIGINT)


def check_code(ended, name, out):
    """128 + signal and an unfinished result; or all was done when it came.

    A second signal may come as Python itself is ending, which it then does by that signal.
    """
    (code, _, err), number = ended, getattr(signal, "SIGINT" if name == "twice" else name)
    how = torquer.load(out / "result.nc").attrs["how_it_ended"]
    if how == "interrupted":
        by_signal = {-number} if name in ("SIGKILL", "twice") else set()
        assert code in by_signal | ({128 + number} - {128 + signal.SIGKILL}), err
    else:
        assert how == "complete" and code in (0, -number, 128 + number), err


def check(process, scenario_file, tmp_path, law, name, after_s):
    """One try: the run is hit, what is there is sound, resumed it is the unbroken run."""
    path = scenario_file(law, DURATIONS_S[law], record_s=DURATIONS_S[law] / 100.0)
    out = tmp_path / f"{law}-{name}-{after_s}"
    run = process("run", path, "--out", out, "--no-report", "--checkpoint-s", 0.1)
    hit(run, name, out, after_s)
    check_code(done(run), name, out)
    code, _, err = done(process("run", path, "--out", out, "--resume", "--no-report"))
    assert code == 0, err
    return torquer.load(out / "result.nc")


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory):
    """The unbroken run by kind of law, each computed once."""
    return {}


def try_once(process, scenario_file, tmp_path, unbroken, law, name, number=0):
    after_s = random.Random(f"{law} {name} {number}").uniform(0.0, 0.6)
    result = check(process, scenario_file, tmp_path, law, name, after_s)
    if law not in unbroken:
        unbroken[law] = torquer.simulate(torquer.load_scenario(tmp_path / "scenario.toml"))
    assert differing(result, unbroken[law]) == []


@pytest.mark.parametrize(
    ("law", "name"),
    slow_after(
        1,
        [("compiled", "SIGTERM"), ("plain", "twice"), ("built-in", "SIGKILL"), ("plain", "SIGINT")],
        names=2,
    ),
)
def test_a_signal_loses_nothing_that_was_recorded(
    process, scenario_file, tmp_path, unbroken, law, name
):
    try_once(process, scenario_file, tmp_path, unbroken, law, name)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(14))
@pytest.mark.parametrize("name", SIGNALS)
@pytest.mark.parametrize("law", KINDS)
def test_signals_at_many_instants(process, scenario_file, tmp_path, unbroken, law, name, number):
    """14 for each of 15 pairs of law and signal: 210 tries."""
    try_once(process, scenario_file, tmp_path, unbroken, law, name, number)
