"""A defect that stays does not reset the computer for ever: strikes, safe boot, the way back."""

from dataclasses import replace

import numpy as np
import pytest
from onboard_ground import ALL_MODES, Ground, scenario
from slow_cases import slow_after
from spoiled_memory import Full, spoil

from torquer.compile import engine
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.core import Core
from torquer.flight.software.memory import Memory
from torquer.flight.software.software import load_software
from torquer.flight.software.state import Cause
from torquer.flight.software.strikes import (
    FORGIVEN_S,
    OFF,
    REQUIRED,
    REQUIRED_OFF,
    STRIKES,
    Strikes,
    read_strikes,
)

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
SOFTWARE = load_software()
MODULES = sorted(SOFTWARE.modules)
FREE = [name for name in MODULES if name not in REQUIRED]
#: Time of a boot, and until the watchdog bites when it is no longer fed [s].
RESET_S = 90.0
DEFECTS = [
    *("step raises", "start raises", "is not made", "stops", "exits", "reboots"),
    "start reboots",
]


def with_defect(name, defect, until_s=np.inf):
    """The software with a module that has a defect at each boot, until a time of the run [s]."""
    one = SOFTWARE.modules[name]

    class Defective(one.make):
        def __init__(self, settings):
            super().__init__(settings)
            if defect == "is not made" and until_s > 0.0 and Defective.made:
                raise RuntimeError("defect")
            Defective.made += 1

        def start(self, core):
            super().start(core)
            if defect == "start raises" and core.t_s < until_s:
                raise RuntimeError("defect")
            if defect == "start reboots" and core.t_s < until_s:
                core.reboot()

        def step(self, core):
            if core.t_s >= until_s:
                return super().step(core)
            if defect == "stops":
                core._state.slots[name].due_ms = 1 << 62
            elif defect == "reboots":
                core.reboot()
            elif defect == "exits":
                raise SystemExit(1)
            elif defect == "step raises":
                raise RuntimeError("defect")
            return super().step(core)

    Defective.made = 0
    made = {name: one._replace(make=Defective)}
    return replace(SOFTWARE, modules=SOFTWARE.modules | made)


def flown(name, defect, duration_s=4000.0, **keys):
    """A ground whose satellite flies with a defect."""
    flight = scenario(duration_s, ALL_MODES)
    ground = Ground(Core(flight, with_defect(name, defect, **keys)))
    ground.tick(times=10**6)
    return ground


def codes(ground, module):
    number = ground.dictionary.modules[module]
    return [v["code"] for v in ground.named("event") if v["module_id"] == number]


@pytest.mark.verifies("REQ-BOO-006")
@pytest.mark.parametrize("defect", slow_after(1, DEFECTS))
@pytest.mark.parametrize("name", MODULES)
def test_a_defect_that_stays_does_not_reboot_for_ever(name, defect):
    """The module is kept off, the satellite flies on, and its attitude stays within bounds."""
    ground = flown(name, defect)
    core, bound = ground.core, REQUIRED_OFF if name in REQUIRED else OFF
    assert core.is_running
    assert core.state.reboots <= bound
    cycle_s = 3.0 * SOFTWARE.modules[name].period_s + RESET_S
    assert core.state.boot_s < bound * cycle_s
    rate = np.linalg.norm(core.result()["omega_body"].values, axis=1)
    assert np.rad2deg(rate[-1]) < np.rad2deg(rate[0])
    if core.state.reboots:
        assert core.state.strikes.modules == {name: bound}
        assert name in core.services.kept_off()
    if core.state.reboots and name not in ("com", "svr"):
        assert Reason.KEPT_OFF in codes(ground, name)


def test_settings_and_file_system_are_given_up_before_a_required_module():
    ground = flown("com", "step raises", 1000.0)
    assert not ground.packets, "nothing comes down without communications"
    number = SOFTWARE.dictionary.modules["com"]
    log = [(entry.code, entry.argument) for entry in ground.core.services.log.entries
           if entry.module in (number, SOFTWARE.dictionary.modules["svr"])]  # fmt: skip
    given_up = [code for code, _ in log if code in (Reason.DEFAULTS_USED, Reason.FROM_RESERVE)]
    own, every = [Reason.DEFAULTS_USED] * 2, [Reason.DEFAULTS_USED]
    assert given_up == own + every + [Reason.FROM_RESERVE, *every] + [Reason.DEFAULTS_USED]
    assert (Reason.KEPT_OFF, REQUIRED_OFF) in log


@pytest.mark.verifies("REQ-BOO-006")
@pytest.mark.parametrize("name", REQUIRED)
def test_a_required_module_is_tried_again_and_comes_back(name):
    """Its defect goes after an hour: six hours after the last reset it works again."""
    ground = flown(name, "step raises", FORGIVEN_S + 3000.0, until_s=3600.0)
    core = ground.core
    assert core.state.slots[name].runs and core.state.slots[name].failures == 0
    assert core.state.reboots == REQUIRED_OFF
    assert ground.command("report_status", 1) is None  # the flight is over
    assert core.services.kept_off() == []


@pytest.mark.verifies("REQ-BOO-007")
def test_a_command_brings_a_module_back():
    ground = Ground(
        Core(scenario(3000.0, ALL_MODES), with_defect("sun", "step raises", until_s=900))
    )
    ground.tick(times=1000)
    core, number = ground.core, ground.dictionary.modules["sun"]
    assert core.services.kept_off() == ["sun"]
    assert ground.command("report_status", number)["code"] == Reason.DONE
    assert ground.named("module_status")[-1]["state"] == 3
    assert ground.command("module_start", number)["code"] == Reason.DONE
    assert ground.command("report_status", number)["code"] == Reason.DONE
    assert ground.named("module_status")[-1]["state"] == 1
    assert ground.command("module_start", number)["code"] == Reason.STATE
    assert ground.command("module_start", 99)["code"] == Reason.VALUE
    core.reboot(Cause.FAULT)
    ground.tick(times=100)
    assert core.services.kept_off() == [] and core.is_running


def test_a_module_that_is_still_broken_goes_off_again():
    ground = Ground(Core(scenario(4000.0, ALL_MODES), with_defect("sun", "step raises")))
    ground.tick(times=1000)
    number = ground.dictionary.modules["sun"]
    assert ground.command("module_start", number)["code"] == Reason.DONE
    ground.tick(times=1500)
    assert ground.core.services.kept_off() == ["sun"]
    assert ground.core.state.reboots == 2 * OFF


@pytest.mark.parametrize("cause", sorted(Cause))
def test_it_stays_off_over_reboots_of_every_kind(cause):
    ground = Ground(Core(scenario(3000.0, ALL_MODES), with_defect("sun", "step raises")))
    ground.tick(times=1000)
    ground.core.reboot(cause)
    ground.tick(times=100)
    assert ground.core.services.kept_off() == ["sun"]
    assert ground.core.state.reboots == (OFF if cause is Cause.POWER_ON else OFF + 1)


@pytest.mark.verifies("REQ-BOO-006")
def test_a_memory_that_takes_nothing_makes_no_loop():
    """The strikes are in the memory of the processor as well."""
    core = Core(scenario(4000.0, ALL_MODES), with_defect("sun", "step raises"))
    spoil(core.memory, Full, "")
    Ground(core).tick(times=10**6)
    assert core.services.kept_off() == ["sun"]


@pytest.mark.parametrize("damage", ["damaged", "lost"])
def test_strikes_that_cannot_be_read_are_noticed(damage):
    memory = Memory()
    ground = Ground(Core(scenario(300.0), memory=memory))
    ground.tick(times=5)
    spoil(memory, damage, STRIKES)
    ground.core.reboot(Cause.FAULT)
    ground.tick(times=60)
    code = Reason.FILE_MISSING if damage == "lost" else Reason.FILE_DAMAGED
    assert code in codes(ground, "fs")


def test_resets_that_no_module_explains_end_too():
    """A watchdog module that steps more rarely than the watchdog bites."""
    slow = SOFTWARE.modules["wdt"]._replace(period_s=100.0)
    software = replace(SOFTWARE, modules=SOFTWARE.modules | {"wdt": slow})
    ground = Ground(Core(scenario(4000.0), software))
    ground.tick(times=10**6)
    assert ground.core.state.reboots == REQUIRED_OFF


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{", '{"sun": 0}', '{"sun": true}', '{"sun": 1e9}', '{"sun": "3"}', '{"sun": 1001}']
)  # fmt: skip
def test_what_are_no_strikes(text):
    assert read_strikes(text.encode()) is None


def test_strikes_are_kept_as_they_are():
    strikes = Strikes().against(["sun", "mag"]).against(["sun"]).against([])
    assert read_strikes(strikes.save()) == strikes
    assert strikes.modules == {"sun": 2, "mag": 1, "": 1}
    assert strikes.uses_defaults("sun") and not strikes.uses_defaults("mag")
    assert strikes.without("sun").modules == {"mag": 1, "": 1}
    assert strikes.forgiven() == Strikes()
