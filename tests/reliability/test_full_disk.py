"""A small disk that others fill while a run writes to it."""

import shutil
import subprocess
import sys

import numpy as np
import pytest
from reliability_processes import done

import torquer
from torquer.compile import engine

#: Runs in a name space of its own, where $DISK is a disk of 64 MB: the run begins, the disk is
#: filled, and emptied again when the run has ended; then the run goes on.
FILLED = """
mount -t tmpfs -o size=64m tmpfs $DISK
python() { "$PYTHON" -m torquer run "$SCENARIO" --out $DISK/out --no-report "$@"; }
python --checkpoint-s 0.1 & run=$!
while [ ! -e $DISK/out/result.nc ]; do sleep 0.01; done
cat /dev/zero > $DISK/others 2> /dev/null
wait $run; echo ended $?
rm $DISK/others
python --resume; code=$?
cp $DISK/out/result.nc $KEPT
exit $code
"""


def can_mount() -> bool:
    """Whether this system lets a test have a disk of its own."""
    if shutil.which("unshare") is None:
        return False
    tried = ["unshare", "-rm", "mount", "-t", "tmpfs", "tmpfs", "/mnt"]
    return subprocess.run(tried, capture_output=True).returncode == 0


pytestmark = [
    pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT"),
    pytest.mark.skipif(not can_mount(), reason="needs the right to mount a disk"),
]


@pytest.mark.slow
def test_disk_full_at_the_end_leaves_a_resumable_checkpoint(shell, scenario_file, tmp_path):
    path, kept = scenario_file("built-in", 4e6, record_s=4e4), tmp_path / "kept.nc"
    (tmp_path / "disk").mkdir()
    where = {"DISK": tmp_path / "disk", "SCENARIO": path, "KEPT": kept, "PYTHON": sys.executable}
    named = {name: str(value) for name, value in where.items()}
    code, out, err = done(shell("unshare", "-rm", "sh", "-c", FILLED, **named))
    assert "ended 2\n" in out and code == 0, err
    assert err.count("(No space left on device)\n") == 1
    whole = torquer.simulate(torquer.load_scenario(path))
    assert np.array_equal(torquer.load(kept).omega_body, whole.omega_body)
