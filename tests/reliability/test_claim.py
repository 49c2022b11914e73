"""Two runs into one folder: the second is refused before it computes."""

import os
import time

import pytest
from reliability_processes import done

from torquer.cli.folder_lock import claimed
from torquer.compile import engine

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


def test_the_second_of_two_is_refused_and_the_first_goes_on(process, scenario_file, tmp_path):
    path, out = scenario_file("built-in", 4e6, record_s=4e4), tmp_path / "out"
    first = process("run", path, "--out", out, "--no-report")
    deadline_s = time.monotonic() + 60.0
    while not (out / ".claimed").exists() and time.monotonic() < deadline_s:
        time.sleep(0.01)
    code, printed, err = done(process("run", path, "--out", out, "--no-report"))
    assert (code, printed) == (2, "")
    assert err == f"error: --out: must not be in use by another run; received {out}\n"
    assert done(first)[0] == 0
    assert sorted(each.name for each in out.iterdir()) == ["result.nc", "summary.json"]


def test_a_claim_ends_with_its_block_and_with_its_process(tmp_path):
    (tmp_path / ".claimed").write_text("left by a process that was killed")
    with claimed(tmp_path):
        if os.name != "nt":
            with pytest.raises(ValueError, match="in use by another run"), claimed(tmp_path):
                pass
    assert list(tmp_path.iterdir()) == []
    with claimed(tmp_path):
        pass
