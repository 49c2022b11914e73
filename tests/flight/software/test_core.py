"""The flight software as a whole: the motion of `simulate`, snapshots, errors of modules."""

import copy
from dataclasses import replace

import numpy as np
import pytest
from onboard_ground import Ground, flying, scenario
from slow_cases import slow_after

from torquer import simulate
from torquer.compile import engine
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.core import WATCHDOG_S, Core
from torquer.flight.software.memory import Memory
from torquer.flight.software.modules.module import Module
from torquer.flight.software.software import load_software

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


def same(a, b):
    """Whether all variables are the same, bit for bit."""
    assert set(a.variables) == set(b.variables)
    for name in a.variables:
        x, y = a[name].values, b[name].values
        assert np.array_equal(x, y, equal_nan=x.dtype.kind == "f"), name
    return True


def flown(duration_s, **keys):
    core = Core(scenario(duration_s, **keys))
    while core.tick() is not None:
        pass
    return core.result()


@pytest.mark.verifies("REQ-COR-001")
@pytest.mark.parametrize("sample_s", [1.0, 0.1])
def test_software_that_is_left_alone_changes_nothing(sample_s):
    keys = {"control__sample_s": sample_s}
    duration_s = 1200.0 * sample_s
    assert same(flown(duration_s, **keys), simulate(scenario(duration_s, **keys)))


@pytest.mark.verifies("REQ-COR-001")
@pytest.mark.slow
def test_the_day_with_all_modules_is_the_day():
    assert same(flown(86400.0), simulate(scenario(86400.0)))


@pytest.mark.verifies("REQ-COR-003")
@pytest.mark.parametrize("count", slow_after(1, [40, 100]))
def test_snapshots_give_the_same_stream(count):
    """At random control steps, with commands and a reboot on the way."""
    ground = flying(400.0)
    core, random = ground.core, np.random.default_rng(3)
    uplink = {
        20: ground.frame("set_rates", 2.0, 1.0, 5.0),
        60: ground.frame("coils_manual", 1.0, 0.0, -1.0, 30.0),
        90: ground.frame("reboot", 0),
        150: ground.frame("replay", 0, 2**32 - 1, 1),
        200: ground.frame("shift_clock", 5000),
    }
    snapshots, stream = [], []
    while True:
        snapshots.append(core.snapshot())
        sent = core.tick(uplink.get(len(stream), b""))
        if sent is None:
            break
        stream.append(sent)
    files = core.memory.snapshot()
    for start in random.choice(len(stream), count, replace=False):
        core.restore(snapshots[start])
        until = min(start + 12, len(stream))
        again = [core.tick(uplink.get(k, b"")) for k in range(start, until)]
        assert again == stream[start:until], start
    core.restore(snapshots[85])
    again = [core.tick(uplink.get(k, b"")) for k in range(85, len(stream))]
    assert again == stream[85:] and core.memory.snapshot() == files


def test_a_snapshot_does_not_change_with_the_flight():
    core = flying().core
    for _ in range(10):
        core.tick()
    taken = core.snapshot()
    kept = copy.deepcopy(taken)
    for _ in range(50):
        core.tick()
    core.restore(taken)
    first = [core.tick() for _ in range(20)]
    core.restore(kept)
    assert [core.tick() for _ in range(20)] == first


class Faulty(Module):
    """Raises from a time on, as long as it says."""

    name = "dosimeter"

    def step(self, core):
        if 20.0 <= core.t_s < 20.0 + self.duration_s:
            raise ZeroDivisionError


def software_with(make, period_s=1.0):
    """The shipped software and one more module."""
    software = load_software()
    modules = dict(software.dictionary.modules) | {make.name: 200}
    dictionary = software.dictionary.model_copy(update={"modules": modules})
    one = software.modules["mod"]._replace(make=make, period_s=period_s, settings=make.Settings())
    return replace(software, dictionary=dictionary, modules={make.name: one} | software.modules)


@pytest.mark.verifies("REQ-COR-005", "REQ-BOO-005")
@pytest.mark.parametrize(("duration_s", "reboots"), [(5.0, 0), (45.0, 0), (1e9, 1)])
def test_an_error_in_a_module_costs_no_flight(duration_s, reboots):
    """One that passes is noted; one that lasts leaves the watchdog hungry: a reboot after 60 s."""
    make = type("Dosimeter", (Faulty,), {"duration_s": duration_s})
    ground = Ground(Core(scenario(200.0), software_with(make)))
    ground.tick(times=151)
    events = [(v["module_id"], v["code"]) for v in ground.named("event")]
    assert (200, Reason.MODULE_FAILED) in events
    lasts = duration_s > 10.0
    assert ((1, Reason.WATCHDOG) in events) == lasts
    ready = ground.named("ready")
    assert [v["reboot_counter"] for v in ready] == list(range(reboots + 1))
    if reboots:
        assert ready[1]["boot_reason"] == 2
        at = next(k for k, sent in enumerate(ground.sent) if k > 20 and not sent)
        silent = ground.core.software.modules["svr"].settings.silent_s
        assert WATCHDOG_S <= at - 20.0 <= WATCHDOG_S + silent + 3.0


class Nosy(Module):
    """Tries to reach more of the computer than it may."""

    name = "dosimeter"
    seen = ()

    def step(self, core):
        Nosy.seen = [name for name in dir(core.computer) if not name.startswith("_")]
        core.computer.modes = 1


@pytest.mark.verifies("REQ-COR-002")
def test_modules_have_some_calls_of_the_computer_and_no_more():
    ground = Ground(Core(scenario(20.0), software_with(Nosy)))
    ground.tick(times=3)
    assert Nosy.seen == [
        *("calibrate", "calibrate_coils", "calibrate_tachometers", "chosen_ephemeris"),
        *("command_mode", "ephemeris_apart", "hold", "set_ephemeris", "set_flag"),
        *("set_parameter", "wheel_count"),
    ]
    assert (200, Reason.MODULE_FAILED) in [
        (v["module_id"], v["code"]) for v in ground.named("event")
    ]


class Slow(Module):
    """Counts its steps at a rate of its own."""

    name = "dosimeter"
    times = ()

    def step(self, core):
        Slow.times = [*Slow.times, core.t_s]


@pytest.mark.verifies("REQ-COR-006")
@pytest.mark.parametrize(("period_s", "count"), [(0.01, 60), (1.0, 60), (7.0, 9), (25.0, 3)])
def test_modules_step_at_their_own_rates(period_s, count):
    Slow.times = ()
    ground = Ground(Core(scenario(59.5), software_with(Slow, period_s)))
    ground.tick(times=100)
    assert len(Slow.times) == count
    assert np.all(np.diff(Slow.times) == max(period_s, 1.0))


def test_the_memory_of_one_flight_serves_the_next(tmp_path):
    """Settings are kept; the clock goes on where it was saved."""
    first = flying(200.0, memory=Memory(tmp_path))
    first.tick(times=200)
    first.command("set_thresholds", 0.5, 0.1, 0.2, 0.03)
    second = flying(30.0, memory=Memory(tmp_path))
    assert second.core.state.modules["svr"].settings == first.core.state.modules["svr"].settings
    behind_ms = first.core.state.clock.now_ms - second.core.state.clock.now_ms
    assert 0 <= behind_ms <= 60_000
