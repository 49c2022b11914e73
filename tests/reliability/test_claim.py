"""Two runs into one folder: the second is refused before it computes."""

import os
import signal
import sys
import time

import pytest
from reliability_processes import done

from torquer.base.folder_lock import claim
from torquer.compile import engine

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


def test_second_run_into_a_folder_is_refused_while_first_continues(
    process, call, scenario_file, tmp_path
):
    call("run", scenario_file("built-in"), "--out", tmp_path / "before", "--no-report")  # loads all
    path, out = scenario_file("built-in", 1e6, record_s=1e4), tmp_path / "out"
    first = process("run", path, "--out", out, "--no-report")
    deadline_s = time.monotonic() + 60.0
    while not (out / ".claimed").exists() and time.monotonic() < deadline_s:
        time.sleep(0.01)
    code, printed, err = call("run", path, "--out", out, "--no-report")
    assert (code, printed) == (2, "")
    assert err == f"error: --out: must not be in use by another run; received {out}\n"
    assert done(first)[0] == 0
    assert sorted(each.name for each in out.iterdir()) == ["result.nc", "summary.json"]


LATE = """
import pathlib, signal, sys, types
from torquer.cli.commands import run
from torquer.scenario import load
load.check_orbit_environment = lambda scenario: None
run._fly = lambda *given: (None, "", 0)
run._write = lambda *given: signal.raise_signal(signal.SIGTERM)
run.run_scenario(types.SimpleNamespace(name="x"), run.RunOptions(out=pathlib.Path(sys.argv[1])))
"""


@pytest.mark.skipif(os.name == "nt", reason="signals of another kind")
def test_a_signal_when_all_is_written_leaves_no_claim(shell, tmp_path):
    process = shell(sys.executable, "-c", LATE, str(tmp_path / "out"))
    assert done(process)[0] == -signal.SIGTERM
    assert list((tmp_path / "out").iterdir()) == []


def test_a_claim_ends_with_its_block_and_with_its_process(tmp_path):
    (tmp_path / ".claimed").write_text("left by a process that was killed")
    with claim(tmp_path):
        if os.name != "nt":
            with pytest.raises(ValueError, match="in use by another run"), claim(tmp_path):
                pass
    assert list(tmp_path.iterdir()) == []
    with claim(tmp_path):
        pass
