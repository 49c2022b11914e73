"""The software with the mode tables of all modes: what modules and tables do together."""

import math
from dataclasses import replace

import pytest
from onboard_ground import ALL_MODES, Ground, flying, scenario

from torquer.compile import engine
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.core import Core
from torquer.flight.software.modules.module import Module
from torquer.flight.software.services import settings_file
from torquer.flight.software.software import load_software

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


@pytest.fixture
def ground():
    """A satellite that has just started, in safe mode."""
    ground = flying(600.0, file=ALL_MODES)
    ground.tick(times=10)
    return ground


def place(ground, region, state):
    """Numbers of a region and its state in commands."""
    regions = ground.core.services.regions
    number = [name for name, _ in regions].index(region)
    return number, regions[number][1].index(state)


def test_every_state_of_the_tables_has_its_mode_in_telemetry():
    core = flying(10.0, file=ALL_MODES).core
    for module, region in (("aos", "determination"), ("stb", "stabilisation")):
        states = dict(core.services.regions)[region]
        assert set(states) <= set(core.state.modules[module].settings.modes)


def test_every_flag_that_a_failure_raises_is_in_the_tables():
    core = flying(10.0, file=ALL_MODES).core
    flags = set(load_software().modules["svr"].settings.flags.values())
    assert flags <= set(core.services.flags)


def test_safe_mode_comes_first(ground):
    beacon = ground.named("beacon")[0]
    assert (beacon["aos_mode"], beacon["stb_mode"], beacon["svr_mode"]) == (1, 0, 1)


@pytest.mark.verifies("REQ-SVR-001")
def test_manual_operation_is_a_state_of_the_table(ground):
    core = ground.core.services
    ground.command("automatic", 0)
    assert core.modes["supervisor"] == "manual"
    assert ground.command("set_mode", *place(ground, "determination", "aos_off"))["code"] == 0
    ground.tick(times=20)
    extended = ground.named("extended")[-1]
    assert core.modes["determination"] == "aos_off" and extended["aos_mode"] == 0
    ground.command("automatic", 1)
    assert core.modes["supervisor"] == "automatic"


@pytest.mark.verifies("REQ-SVR-002")
def test_thresholds_of_the_table_follow_the_settings(ground):
    core = ground.core.services
    names = [f"modes.{name}" for name in ("rate_max", "rate_min", "angle_max", "angle_min")]
    before = [core.parameter(name)[0] for name in names]
    ground.command("set_thresholds", 0.5, 0.1, 0.2, 0.03)
    angles = [2.0 * math.degrees(math.asin(q)) for q in (0.2, 0.03)]
    now = [core.parameter(name)[0] for name in names]
    assert now == pytest.approx([0.5, 0.1, *angles], rel=1e-6)
    ground.core.reboot()
    ground.tick(times=20)
    assert [core.parameter(name)[0] for name in names] == pytest.approx(now)
    ground.command("restore_defaults", 1)
    assert [core.parameter(name)[0] for name in names] == pytest.approx(before, rel=5e-3)


@pytest.mark.verifies("REQ-SVR-002")
def test_thresholds_that_the_table_rejects_are_not_kept(ground):
    """As a hysteresis would: the settings of before are in force, here and in the memory."""
    core, svr = ground.core.services, ground.core.state.modules["svr"]
    before, set_parameter = svr.settings, core.computer.set_parameter

    def reject(name, value):
        if (name, value) == ("modes.rate_min", pytest.approx(0.1)):
            raise ValueError
        set_parameter(name, value)

    core.computer.set_parameter = reject
    assert ground.command("set_thresholds", 0.5, 0.1, 0.2, 0.03)["code"] == Reason.VALUE
    assert svr.settings == before and core.parameter("modes.rate_max")[0] == pytest.approx(0.4)
    assert before.model_validate_json(core.memory.read(settings_file("svr"))) == before


class Silent(Module):
    """Never ends a step."""

    name = "mod"

    def step(self, core):
        raise RuntimeError

    def on_set_elements(self, core, values):
        return Reason.DONE

    on_set_model = on_set_elements


def test_an_anomaly_ends_manual_operation():
    """A module that is silent: its flag is raised, the regions are free, the table is in charge."""
    software = load_software()
    one = software.modules["mod"]._replace(make=Silent, settings=Silent.Settings(), period_s=1.0)
    software = replace(software, modules=software.modules | {"mod": one})
    ground = Ground(Core(scenario(100.0, ALL_MODES), software))
    assert ground.command("automatic", 0)["code"] == Reason.DONE
    ground.tick(times=16)
    assert ground.named("extended")[-1]["svr_mode"] == 1
    assert ground.core.services.modes["supervisor"] == "automatic"
    assert ground.core.state.modules["svr"].raised == {"anomaly": True}
    assert not ground.core.state.modules["svr"].held
