"""Windows and macOS, as far as they can be imitated here: see `other_system`."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from reliability_processes import done
from slow_cases import slow_after

import torquer
from torquer.compile import engine

ROOT = Path(__file__).parents[2]
SYSTEMS = ("win32", "darwin")
#: Far longer than anything here takes: only a failure waits so long.
PATIENCE_S = 600.0
pytestmark = [
    pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT"),
    pytest.mark.skipif(sys.platform != "linux", reason="imitated on Linux"),
]
#: Names that Windows keeps for devices, and characters that it has in no name.
DEVICES = {
    "con",
    "prn",
    "aux",
    "nul",
    *(f"{one}{n}" for one in ("com", "lpt") for n in range(1, 10)),
}
FORBIDDEN = set('<>:"\\|?*')


@pytest.fixture
def there(shell):
    """`there(system, "run", path)`: what a command prints on such a system; it must succeed."""

    def ended(system, *words):
        script = str(ROOT / "tests/other_system.py")
        command = (sys.executable, script, system, *map(str, words))
        code, printed, err = done(shell(*command, PYTHONPATH=str(ROOT)), PATIENCE_S)
        assert code == 0, err
        assert all(line.startswith("note: ") for line in err.splitlines()), err
        return printed

    return ended


def names(folder):
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*"))


@pytest.mark.parametrize("system", slow_after(1, SYSTEMS))
def test_repeated_run_replaces_the_last_with_identical_files_and_numbers(
    system, there, call, scenario_file, tmp_path
):
    path, out = scenario_file("built-in", 300.0), tmp_path / "out"
    assert call("run", path, "--out", out)[0] == 0
    files, rate = names(out), torquer.load(out / "result.nc")["omega_body"].values
    written = (out / "result.nc").stat().st_mtime_ns
    assert "Final rate" in there(system, "run", path, "--out", out)
    assert names(out) == files and (out / "result.nc").stat().st_mtime_ns > written
    assert np.array_equal(torquer.load(out / "result.nc")["omega_body"].values, rate)


@pytest.mark.slow
@pytest.mark.parametrize("system", SYSTEMS)
def test_pictures_campaigns_and_flights_with_memory_work(system, there, scenario_file, tmp_path):
    path = scenario_file("plain", 300.0, runs=40)
    there(system, "run", path, "--out", tmp_path / "run", "--plots")
    assert (tmp_path / "run/plots/rate.png").stat().st_size > 0
    for more in ((), ("--resume",)):
        there(system, "campaign", path, "--out", tmp_path / "campaign", *more)
    day = ROOT / "examples/chibis_m_day.toml"
    how = ("--ticks", "300", "--memory", tmp_path / "memory")
    for out in ("first", "second"):  # the second begins with the memory of the first
        there(system, "fly", day, *how, "--out", tmp_path / out)
    assert {"session.json", "downlink.bin"} <= set(names(tmp_path / "second"))
    lower = [name.lower() for name in names(tmp_path)]
    assert len(set(lower)) == len(lower)


def test_names_in_the_repository_can_stand_on_every_system():
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True)
    if listed.returncode:
        pytest.skip("no repository")
    files = listed.stdout.split("\0")[:-1]
    folders = {parent.as_posix() for name in files for parent in Path(name).parents}
    every = [*files, *folders]
    assert len({name.lower() for name in every}) == len(every)
    for name in every:
        assert len(name) < 160 and not FORBIDDEN & set(name), name
        for part in Path(name).parts:
            assert part.split(".")[0].lower() not in DEVICES, name
            assert not part.endswith((" ", ".")), name
