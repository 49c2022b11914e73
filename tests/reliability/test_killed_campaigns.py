"""Campaigns killed at random instants: what was flown stays, and the rest is flown on resume."""

import random
import time

import pytest
from reliability_processes import SCENARIO, done
from slow_cases import slow_after

import torquer
from torquer.campaign.store import chunks_folder, chunks_there
from torquer.compile import engine

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
LAW = '{ kind = "bdot", gain_a_m2_s_per_t = 1e6 }'
CAMPAIGN = """
[campaign]
runs = 600
[campaign.vary]
initial.rate_deg_s = { direction = "uniform", magnitude = { uniform = [0.5, 4.0] } }
"""


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """The file of a campaign of about a second, and its unbroken result."""
    path = tmp_path_factory.mktemp("campaign") / "scenario.toml"
    text = SCENARIO.format(law=LAW, duration_s=30_000.0, record_s=100.0)
    path.write_text(text.replace("record_s = 100.0", "record_s = 100.0, step_s = 1.0") + CAMPAIGN)
    return path, torquer.fly_campaign(*torquer.load_campaign(path))


def kill_and_resume(process, flown, out, number, where="threads"):
    path, whole = flown
    options = (path, "--out", out, "--no-report", "--where", where)
    run = process("campaign", *options)
    deadline_s = time.monotonic() + 100.0
    while not chunks_there(out / "campaign.nc") and time.monotonic() < deadline_s:
        assert run.poll() is None, run.communicate()
        time.sleep(0.01)
    time.sleep(random.Random(number).uniform(0.0, 0.6))
    run.kill()
    run.communicate(timeout=60.0)  # until its workers have ended, too
    kept = {file: file.read_bytes() for file in chunks_there(out / "campaign.nc").values()}
    assert kept or (out / "campaign.nc").exists()
    code, _, err = done(process("campaign", *options, "--resume"))
    assert code == 0, err
    assert torquer.load(out / "campaign.nc").identical(whole)
    assert not chunks_folder(out / "campaign.nc").exists()


@pytest.mark.parametrize("where", slow_after(1, ["processes", "threads"]))
def test_a_killed_campaign_goes_on(process, flown, tmp_path, where):
    kill_and_resume(process, flown, tmp_path / "out", 0, where)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(1, 11))
def test_campaigns_killed_at_ten_instants_go_on(process, flown, tmp_path, number):
    kill_and_resume(process, flown, tmp_path / "out", number)
