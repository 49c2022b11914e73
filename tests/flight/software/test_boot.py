"""Boot and reboot: order, time, counter, damaged settings, no control meanwhile."""

import numpy as np
import pytest
from onboard_ground import Ground, flying, scenario
from slow_cases import slow_after
from spoiled_memory import spoil

from torquer.compile import engine
from torquer.flight.packets.reasons import Reason
from torquer.flight.software import boot
from torquer.flight.software.clock import to_ms
from torquer.flight.software.core import Core
from torquer.flight.software.memory import Memory
from torquer.flight.software.services import settings_file
from torquer.flight.software.software import load_software
from torquer.flight.software.state import Cause
from torquer.flight.software.strikes import STRIKES

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
#: Modules with settings.
SET = [name for name, one in load_software().modules.items() if type(one.settings).model_fields]


def codes(ground, module=None):
    """Reason codes of all events, of one module if named."""
    number = ground.dictionary.modules.get(module)
    return [v["code"] for v in ground.named("event") if module is None or v["module_id"] == number]


def test_the_first_boot_is_over_when_the_flight_begins():
    ground = flying(30.0)
    assert ground.core.is_running
    ground.tick()
    (ready,) = ground.named("ready")
    assert ready["reboot_counter"] == 0 and ready["boot_reason"] == Cause.POWER_ON
    assert codes(ground)[:2] == [Reason.BOOTED, Reason.READY]
    assert Reason.SETTINGS_MISSING not in codes(ground)


@pytest.mark.verifies("REQ-BOO-001")
def test_steps_are_in_the_order_of_the_source():
    names = [step.name.partition(":")[0] for step in boot.STEPS]
    assert names == [
        *("processor", "drivers", "global variables", "current sensors", "file system", "FPGA"),
        *("modules", "time", "supervisor", "supervisor", "supervisor", "ready"),
    ]
    assert all(step.duration_s > 0.0 for step in boot.STEPS)


@pytest.mark.verifies("REQ-BOO-001")
def test_modules_start_in_the_order_of_the_source(monkeypatch):
    started = []
    core = flying(60.0).core
    core.tick()
    core.reboot()
    monkeypatch.setattr(core.services, "start", started.append)
    for _ in range(15):
        core.tick()
    order = [name for name in started if name in boot.STARTED_LAST]
    assert order == ["cdh", "tm", "mod", "aos", "stb", "com", "svr", "wdt"]
    assert started[-len(order) :] == order


@pytest.mark.verifies("REQ-BOO-002")
def test_nothing_is_controlled_or_heard_during_a_boot():
    """B-dot commands the coils before and after; commands sent meanwhile are lost."""
    ground = flying(200.0)
    core = ground.core
    commanded, dipole = [], {}
    uplink = ground.frame("set_rates", 1.0, 1.0, 1.0)
    for k in range(120):
        if k == 50:
            core.reboot()
        was_running = core.is_running
        sent = core.tick(uplink if k == 53 else b"")
        commanded.append((was_running, sent))
        if not was_running or k % 10 == 0:
            dipole[k] = core.result()["command_body"].values[-1]
    down = [k for k, (runs, _) in enumerate(commanded) if not runs]
    assert down == list(range(50, 50 + len(down)))
    assert boot.BOOT_S <= len(down) + 1 <= boot.BOOT_S + 2.0
    assert all(commanded[k][1] == b"" for k in down[:-1])
    before, after = (
        [d for k, d in dipole.items() if k in ks] for ks in (range(50), range(80, 120))
    )
    assert np.any(before) and np.any(after)
    assert not np.any([dipole[k] for k in down[1:-1]])
    assert "acknowledgement" not in [n for n, _, _ in ground.packets]


@pytest.mark.parametrize("kind", [0, 1, 2])
def test_a_reboot_by_command(kind):
    ground = flying(300.0)
    ground.tick(times=100)
    assert ground.command("reboot", kind, times=30)["code"] == Reason.DONE
    ready = ground.named("ready")[-1]
    assert ready["boot_reason"] == Cause.COMMAND and ready["reboot_counter"] == 1
    assert ready["file_system"] == (1 if kind == 2 else 0)
    lost_s = ground.core.services.t_s - (ground.core.state.clock.now_ms - start_ms(ground)) * 1e-3
    assert boot.BOOT_S - 3.0 <= lost_s <= boot.BOOT_S + 2.0 + (60.0 if kind == 1 else 0.0)
    assert Reason.REBOOT in codes(ground)


def start_ms(ground):
    """On-board time of the start of the flight."""
    return to_ms(scenario().start)


@pytest.mark.verifies("REQ-BOO-004", "REQ-CLK-002")
def test_reboots_at_many_control_steps():
    """Whatever the step: the stream goes on, the clock has lost a minute and the boot at most."""
    ground = flying(400.0)
    core = ground.core
    start = start_ms(ground)
    ground.tick(times=5)
    snapshot = core.snapshot()
    for step in (0, 1, 2, 3, 7, 20, 59, 60, 61, 100):
        core.restore(snapshot)
        fresh = Ground(core)
        fresh.tick(times=step)
        core.reboot()
        found = fresh.tick(times=25)
        assert [n for n, _, _ in found].count("ready") == 1
        assert "extended" in [n for n, _, _ in found]
        lost_s = core.services.t_s - (core.state.clock.now_ms - start) * 1e-3
        assert 0.0 <= lost_s <= 60.0 + boot.BOOT_S + 2.0


def test_a_boot_within_a_boot():
    ground = flying(200.0)
    ground.tick(times=10)
    for _ in range(4):
        ground.core.reboot()
        ground.tick(times=5)
    ground.tick(times=30)
    assert ground.core.is_running and ground.core.state.reboots >= 1


@pytest.mark.verifies("REQ-BOO-003")
@pytest.mark.parametrize("module", SET)
@pytest.mark.parametrize("damage", slow_after(2, ["bits", "missing", "nonsense", "other"]))
def test_settings_that_cannot_be_read(module, damage):
    """Defaults and an event; the module says that it has defaults."""
    memory, software = Memory(), load_software()
    ground = flying(120.0, memory=memory)
    ground.tick(times=2)
    name = settings_file(module)
    if damage == "bits":
        for files in memory.places.values():
            files[name] = files[name][:-1] + bytes([files[name][-1] ^ 1])
    elif damage == "missing":
        for files in memory.places.values():
            del files[name]
    else:
        memory.write(name, b"\xff" if damage == "nonsense" else b'{"nothing": 1}')
    ground.core.reboot()
    ground.tick(times=20)
    expected = Reason.SETTINGS_MISSING if damage == "missing" else Reason.SETTINGS_DAMAGED
    assert expected in codes(ground, module)
    core, defaults = ground.core, software.modules[module].settings
    assert core.is_running and core.state.modules[module].settings == defaults
    assert core.services.account(module)[2] == 1


@pytest.mark.verifies("REQ-MEM-002")
def test_one_damaged_copy_is_mended():
    memory = Memory()
    ground = flying(100.0, memory=memory)
    ground.command("set_thresholds", 0.5, 0.1, 0.2, 0.03)
    memory.places["main"][settings_file("svr")] = b"damaged"
    ground.core.reboot()
    ground.tick(times=20)
    assert ground.core.state.modules["svr"].settings.rate_max_deg_s == pytest.approx(0.5)
    assert Reason.FILE_REPAIRED in codes(ground, "fs")
    assert memory.places["main"] == memory.places["reserve"]


def test_everything_lost_but_the_software():
    memory = Memory()
    ground = flying(100.0, memory=memory)
    ground.tick(times=5)
    for files in memory.places.values():
        files.clear()
    ground.core.reboot()
    ground.tick(times=20)
    assert ground.core.is_running
    logged = {entry.code for entry in ground.core.state.log.entries}
    assert {Reason.TIME_LOST, Reason.SETTINGS_MISSING, Reason.FILE_MISSING} <= logged
    assert ground.core.state.clock.now_ms < 60_000


def test_a_module_that_cannot_start_is_left_out():
    core = flying(100.0).core
    core.tick()
    core.memory.write("elements", b"no elements")
    core.reboot()
    for _ in range(20):
        core.tick()
    assert core.is_running and core.services.status("mod")["elements"] == 0.0


def test_the_run_goes_on_to_its_end_after_a_reboot():
    core = Core(scenario(120.0))
    core.tick()
    core.reboot()
    ticks = 1
    while core.tick() is not None:
        ticks += 1
    assert ticks == 120 and core.flight.done


@pytest.mark.verifies("REQ-MEM-004")
@pytest.mark.parametrize("damage", ["damaged", "lost"])
def test_each_file_of_the_memory_is_missed(damage):
    """Both copies of each file in turn, those that only the ground's commands make included."""
    memory = Memory()
    ground = flying(1500.0, memory=memory)
    ground.tick(times=130)  # records are stored
    for name, values in (("elements_limits", (500.0, 2.0)), ("mag_calibration", (1.0, 2.0, 3.0))):
        assert ground.command(name, *values)["code"] == Reason.DONE
    snapshot, names = ground.core.snapshot(), memory.names()
    assert {"plan", "strikes", "settings.mag", "variables", "errors"} < set(names)
    for name in names:
        ground.core.restore(snapshot)
        fresh = Ground(ground.core)
        spoil(memory, damage, name)
        ground.core.reboot(Cause.FAULT)
        fresh.tick(times=60)
        told = {Reason.FILE_MISSING, Reason.FILE_DAMAGED}
        assert told & set(codes(fresh, "fs")), name


def made_by_the_boot(ground):
    """Events between the last announcement of a boot and of its end, both included."""
    codes = [v["code"] for v in ground.named("event")]
    end = len(codes) - 1 - codes[::-1].index(Reason.READY)
    begin = max(k for k in range(end) if codes[k] == Reason.BOOTED)
    return codes[begin : end + 1]


@pytest.mark.verifies("REQ-BOO-003")
@pytest.mark.parametrize(
    "names",
    [[], ["settings.mag"], ["settings.mag", "settings.tm", "fpga.lib"], ["time"], ["errors"]],
    ids="-".join,
)
def test_ready_counts_all_events_of_the_boot(names):
    """Also those from before modules are loaded."""
    ground = flying(200.0)
    ground.tick(times=20)
    for name in names:
        spoil(ground.core.memory, "damaged", name)
    ground.core.reboot()
    ground.tick(times=60)
    assert ground.named("ready")[-1]["events"] == len(made_by_the_boot(ground))
    assert ground.named("ready")[-1]["events"] == 2 + len(set(names) - {"errors"})


def test_an_event_from_before_the_log_is_read_is_kept():
    """Strikes that cannot be strikes: their event is older than the log on board."""
    ground = flying(200.0)
    ground.tick(times=20)
    ground.core.memory.write(STRIKES, b"[]")
    ground.core.reboot()
    ground.tick(times=60)
    assert Reason.SETTINGS_DAMAGED in [v["code"] for v in ground.named("event")]
    assert ground.named("ready")[-1]["events"] == 3
