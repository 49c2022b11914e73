"""Disks that refuse to be written from some instant on: what stood there stays, one line each."""

import builtins
import errno
import io
import os
import shutil

import pytest

import torquer
from torquer.compile import engine

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
WHY = (errno.ENOSPC, errno.EROFS, errno.EACCES)


class Disk:
    """Refuses every write below a folder after the first few.

    (For root nothing is read-only, so the calls of the system raise what it would.)
    """

    def __init__(self, monkeypatch):
        self.folder, self.left, self.why, self.refused = None, 0, 0, 0
        for name in ("mkdir", "replace", "fsync", "posix_fallocate"):
            monkeypatch.setattr(os, name, self._refusing(getattr(os, name)))
        for module in (io, builtins):
            monkeypatch.setattr(module, "open", self._refusing(open, True))

    def _refusing(self, call, opens=False):
        def refusing(file, *given, **how):
            mode = how.get("mode", given[0] if given else "r") if opens else "w"
            if set("wax+").intersection(mode) and self._is_ours(file):
                self.left -= 1
                if self.left < 0:
                    self.refused += 1
                    raise OSError(self.why, os.strerror(self.why), str(file))
            return call(file, *given, **how)

        return refusing

    def _is_ours(self, file):
        """Whether a file is below the folder; a number is that of one of ours."""
        if self.folder is None or isinstance(file, int):
            return self.folder is not None
        return str(file).startswith(str(self.folder))

    def refuse(self, folder, left, why):
        self.folder, self.left, self.why, self.refused = folder, left, why, 0


@pytest.fixture
def disk(monkeypatch):
    return Disk(monkeypatch)


def check_every_write(call, disk, path, command, result, whys):
    """Refuse from the first write on, from the second on, ...; then the disk is as before."""
    out, writes = path.parent / "out", 0
    options = (command, path, "--no-report", "--out", out)
    code, _, notes = call(*options)  # on the scenario
    assert code == 0
    whole = torquer.load(out / result)
    while True:
        shutil.rmtree(out)
        disk.refuse(out, writes, whys[writes % len(whys)])
        code, _, err = call(*options)
        refused, disk.folder = disk.refused, None
        if not refused:
            assert code == 0
            return writes
        said = [*notes.splitlines(), ""]
        lines = [line for line in err.splitlines() if line not in said]
        lines = [line for line in lines if not line.startswith("note: nothing saved")]
        # when the last file has its name, no more than the entry of its folder is not sure
        assert code == 2 or (out / "summary.json").exists()
        message = f"error: --out: must be a folder that can be written; received {out} ("
        assert [line.startswith(message) for line in lines] == [True] * (code == 2), err
        kept = {file: file.read_bytes() for file in out.rglob("*.nc")}
        assert not [file for file in out.rglob("*") if file.suffix in (".part", ".claimed")]
        for file in kept:
            torquer.load(file)  # whole, or it is not there
        code, _, err = call(*options, *["--resume"] * bool(kept))
        assert (code, err) == (0, notes)
        assert torquer.load(out / result).identical(whole), writes
        writes += 1


def test_a_run_whose_disk_refuses(call, disk, scenario_file):
    path = scenario_file("built-in", 600.0, 10.0)
    assert check_every_write(call, disk, path, "run", "result.nc", WHY) >= 8


@pytest.mark.slow
def test_a_campaign_whose_disk_refuses(call, disk, scenario_file):
    path = scenario_file("built-in", 100.0, 10.0, runs=40)
    assert check_every_write(call, disk, path, "campaign", "campaign.nc", WHY) >= 12


@pytest.mark.slow
@pytest.mark.parametrize("why", WHY)
def test_runs_in_pieces_and_campaigns_in_chunks(call, disk, scenario_file, why):
    path = scenario_file("built-in", 4e5, 4.0)
    assert check_every_write(call, disk, path, "run", "result.nc", (why,)) >= 20
    path = scenario_file("built-in", 600.0, 20.0, runs=300)
    assert check_every_write(call, disk, path, "campaign", "campaign.nc", (why,)) >= 20


def test_a_report_that_cannot_be_written_loses_nothing_else(call, disk, scenario_file, monkeypatch):
    def refused(result, out, **how):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(out / "report.html"))

    path = scenario_file("built-in")
    out = path.parent / "out"
    monkeypatch.setattr("torquer.report.write_report", refused)
    code, _, err = call("run", path, "--out", out)
    assert code == 2 and err.endswith("(No space left on device)\n") and err.count("\n") == 1
    assert sorted(file.name for file in out.iterdir()) == ["result.nc", "summary.json"]
    assert torquer.load(out / "result.nc").attrs["how_it_ended"] == "complete"
