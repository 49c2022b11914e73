"""A real Dask cluster: a scheduler and workers as processes of their own, killed one by one."""

import contextlib
import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import time
import warnings
from pathlib import Path

import pytest
from slow_cases import slow_after
from tip_off import SCENARIO, campaign

import torquer
from torquer.campaign import fly
from torquer.campaign.executors import Waiting
from torquer.campaign.store import chunks_there
from torquer.compile import engine
from torquer.scenario.load import scenario_from_text

pytest.importorskip("distributed")
pytestmark = [
    pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT"),
    pytest.mark.filterwarnings("ignore::torquer.campaign.executors.Waiting"),
]
ROOT = Path(__file__).parents[2]


class Cluster:
    """Processes of a cluster on this machine, with the package of a folder."""

    def __init__(self, folder):
        self.folder, self.running = folder, []
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
        self.scheduler = self.begin_scheduler()

    def begin_scheduler(self):
        port = self.address.rpartition(":")[2]
        return self._begin(ROOT, "dask_scheduler", "--host", "127.0.0.1", "--port", port)

    def worker(self, package=ROOT):
        """A worker of one thread, without a nanny, that imports torquer from a folder."""
        return self._begin(package, "dask_worker", self.address, "--no-nanny", "--nthreads", "1")

    def _begin(self, package, name, *options):
        path = os.pathsep.join(filter(None, [str(package), os.environ.get("PYTHONPATH")]))
        with open(self.folder / f"{len(self.running)}.log", "wb") as log:
            self.running.append(
                subprocess.Popen(
                    [sys.executable, "-m", f"distributed.cli.{name}", *options, "--no-dashboard"],
                    stdout=log, stderr=log, cwd=self.folder, start_new_session=True,
                    env={**os.environ, "PYTHONPATH": path},
                )
            )  # fmt: skip
        return self.running[-1]

    def end(self):
        for each in self.running:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(each.pid, signal.SIGKILL)
            each.wait()


@pytest.fixture
def cluster(tmp_path, monkeypatch):
    monkeypatch.setattr(fly, "CHUNK", 8)
    made = Cluster(tmp_path)
    until_s = time.monotonic() + 60.0
    while time.monotonic() < until_s:
        with contextlib.suppress(OSError), socket.create_connection(
            ("127.0.0.1", int(made.address.rpartition(":")[2])), 1.0
        ):  # fmt: skip
            break
        time.sleep(0.1)
    yield made
    made.end()


@pytest.fixture(scope="module")
def here():
    """The scenario, its campaign, and what it gives on this machine."""
    scenario = scenario_from_text(SCENARIO)
    made = campaign(scenario, runs=160)
    return scenario, made, torquer.fly_campaign(scenario, made)


def other_package(folder, edit):
    """A folder with another copy of the package."""
    shutil.copytree(
        ROOT / "torquer", folder / "torquer", ignore=shutil.ignore_patterns("__pycache__", "web")
    )
    edit(folder / "torquer")
    return folder


def test_a_worker_of_another_package_is_refused_by_name(cluster, here, tmp_path):
    scenario, made, _ = here

    def edit(package):
        with (package / "campaign/outcomes.py").open("a") as file:
            file.write("# another\n")

    worker = cluster.worker(other_package(tmp_path / "other", edit))
    with pytest.raises(ValueError, match=r"^where: must have workers with the files, the") as error:
        torquer.fly_campaign(scenario, made, where=cluster.address)
    assert f"process {worker.pid} on {socket.gethostname()}, which has" in str(error.value)
    assert "as its package, not" in str(error.value) and "\n" not in str(error.value)


@pytest.mark.slow
def test_a_worker_without_the_package_is_refused(cluster, here, tmp_path):
    scenario, made, _ = here
    cluster.worker(other_package(tmp_path / "other", lambda p: (p / "campaign/fly.py").unlink()))
    with pytest.raises(ValueError, match="where: must have workers with the"):
        torquer.fly_campaign(scenario, made, where=cluster.address)


@pytest.mark.slow
def test_no_workers_are_said_and_waited_for(cluster, here):
    scenario, made, whole = here
    began_s, said_s = time.monotonic(), []

    def show(message, category, *_):
        if category is Waiting:
            said_s.append(time.monotonic() - began_s)
            assert str(message) == "the cluster has no workers; waiting"
            cluster.worker()

    with warnings.catch_warnings():
        warnings.simplefilter("always")
        warnings.showwarning = show
        there = torquer.fly_campaign(scenario, made, where=cluster.address)
    assert there.identical(whole) and len(said_s) >= 1 and said_s[0] < 5.0


@pytest.mark.parametrize("number", slow_after(1, range(12)))
def test_killed_workers_change_no_bit(cluster, here, number):
    scenario, made, whole = here
    drawn, workers = random.Random(number), [cluster.worker(), cluster.worker()]
    at = drawn.randrange(8, 120)

    def kill(progress):
        if progress.done >= at and len(workers) == 2:
            os.kill(workers[0].pid, signal.SIGKILL)
            workers.append(cluster.worker())

    there = torquer.fly_campaign(scenario, made, where=cluster.address, progress=kill)
    assert there.identical(whole)
    assert len(workers) == 3


@pytest.mark.slow
@pytest.mark.parametrize("number", range(8))
def test_a_killed_scheduler_is_one_line_and_what_was_flown_is_kept(
    cluster, here, tmp_path, number, capfd
):
    scenario, made, whole = here
    path, drawn = tmp_path / "campaign.nc", random.Random(number)
    cluster.worker()
    at = drawn.randrange(8, 120)

    def kill(progress):
        if progress.done >= at and cluster.scheduler.poll() is None:
            os.kill(cluster.scheduler.pid, signal.SIGKILL)
            cluster.scheduler.wait()

    with pytest.raises(ValueError, match="where: must keep its scheduler and its") as error:
        torquer.fly_campaign(scenario, made, to=path, where=cluster.address, progress=kill)
    assert "\n" not in str(error.value)
    assert capfd.readouterr().err == ""  # nothing of the library's own
    assert len(chunks_there(path)) >= 1
    again = torquer.fly_campaign(scenario, made, to=path, resume=True)
    assert again.identical(whole)
