"""What a module of the user's reports, hands over or is, ends no flight and blames nobody else."""

from dataclasses import replace

import pytest
from onboard_ground import Ground, scenario

from torquer.base.spec import Spec
from torquer.compile import engine
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.core import Core
from torquer.flight.software.modules.drivers import Mag
from torquer.flight.software.software import load_software
from torquer.flight.software.state import Cause, Telecommand
from torquer.flight.software.strikes import OFF

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
SOFTWARE = load_software()


class Evil:
    """Neither a number nor a truth."""

    def __bool__(self):
        raise RuntimeError("no truth")


def flown(cls, name="mag", duration_s=400.0, reboot=False):
    """The day with a module of the user's in place of one of ours; its ground."""
    made = SOFTWARE.modules[name]._replace(make=cls)
    software = replace(SOFTWARE, modules=SOFTWARE.modules | {name: made})
    ground = Ground(Core(scenario(duration_s), software))
    ground.tick(times=20)
    if reboot:
        ground.core.reboot(Cause.FAULT)
    ground.tick(times=10**6)
    return ground


@pytest.mark.verifies("REQ-COR-005")
@pytest.mark.parametrize(
    "status",
    [None, [], "power", {"power": "on"}, {"power": None}, {"lost": Evil()}, {"lost": float("nan")}],
    ids=["none", "list", "text", "a word", "no value", "no truth", "nan"],
)
def test_a_status_that_is_none_blames_its_own_module(status):
    class Own(Mag):
        def status(self):
            return status

    ground = flown(Own)
    core = ground.core
    assert core.state.reboots == 0 and core.services.kept_off() == []
    assert ground.named("devices") and ground.named("settings")
    if not isinstance(status, dict) or "nan" not in str(status):
        assert core.state.slots["mag"].failures > 0
    assert core.state.slots["svr"].failures == 0


@pytest.mark.verifies("REQ-COR-005")
@pytest.mark.parametrize(
    "frame", [b"", b"z" * 100_000, "text", None], ids=["empty", "long", "text", "none"]
)
@pytest.mark.parametrize("how", ["put_frame", "ground", "acks"])
def test_frames_that_are_none_do_not_silence_the_satellite(how, frame):
    class Own(Mag):
        def step(self, core):
            super().step(core)
            if how == "put_frame":
                core.put_frame(frame)
            else:
                core.cdh.put(how, frame)

    ground = flown(Own)
    assert ground.core.state.slots["com"].failures == 0
    assert "com" not in ground.core.services.kept_off()
    assert len(ground.named("extended")) > 100


@pytest.mark.verifies("REQ-COR-005")
def test_a_power_switch_that_fails_blames_its_own_module():
    """The driver of currents switches devices off; what a switch raises is not its error."""

    class Own(Mag):
        def power(self, core, on):
            raise SystemExit(1)

    low = SOFTWARE.modules["adc"]
    low = low._replace(settings=low.settings.model_copy(update={"current_max": 1e-6}))
    own = SOFTWARE.modules["mag"]._replace(make=Own)
    software = replace(SOFTWARE, modules=SOFTWARE.modules | {"adc": low, "mag": own})
    ground = Ground(Core(scenario(400.0), software))
    ground.tick(times=10**6)
    slots = ground.core.state.slots
    assert slots["mag"].failures > 0 and slots["adc"].failures == 0
    assert Reason.OVER_CURRENT in [v["code"] for v in ground.named("event")]


class Odd(BaseException):
    """An exception that does not say where it was raised."""

    @property
    def __traceback__(self):
        return None


class Raising(Spec):
    """Settings whose validator raises what is no ValueError."""

    oldest_s: float = 30.0

    @classmethod
    def model_validate_json(cls, data, **keys):
        raise SystemExit(3)


def _renamed(self, settings):
    Mag.__init__(self, settings)
    self.name = "other"


DEFECTS = {
    "name in step": {"step": lambda self, core: setattr(self, "name", "x") or 1 / 0},
    "name in constructor": {"__init__": _renamed},
    "no module": {"__new__": lambda cls, settings: 5},
    "odd exception": {"step": lambda self, core: (_ for _ in ()).throw(Odd())},
}


@pytest.mark.verifies("REQ-COR-005")
@pytest.mark.parametrize("defect", sorted(DEFECTS))
def test_no_module_ends_the_flight(defect):
    ground = flown(type("Own", (Mag,), DEFECTS[defect]), reboot=True)
    assert ground.core.is_running and ground.core.flight.done


@pytest.mark.verifies("REQ-COR-005", "REQ-BOO-003")
def test_a_validator_that_raises_anything_costs_the_settings_only():
    own = SOFTWARE.modules["mag"]._replace(settings=Raising())
    software = replace(SOFTWARE, modules=SOFTWARE.modules | {"mag": own})
    core = Core(scenario(120.0), software)
    ground = Ground(core)
    ground.tick(times=100)
    assert core.is_running
    codes = [v["code"] for v in ground.named("event")]
    assert Reason.SETTINGS_DAMAGED in codes


@pytest.mark.verifies("REQ-COR-005")
@pytest.mark.parametrize("queue", ["acks", "ground", "mag", "state", "svr", "tm"])
@pytest.mark.parametrize("what", [None, 5, "word", object()], ids=["none", "number", "text", "odd"])
def test_what_is_no_command_answer_or_frame_costs_nobody_else(queue, what):
    """A module that puts anything into queues; commands of the ground are carried out."""

    class Own(Mag):
        def step(self, core):
            super().step(core)
            core.cdh.put(queue, what)

    ground = flown(Own, duration_s=60.0)
    assert ground.core.flight.done
    assert len(ground.named("extended")) > 50
    assert not [name for name, slot in ground.core.state.slots.items() if slot.failures]


@pytest.mark.verifies("REQ-COR-005", "REQ-BOO-006")
@pytest.mark.parametrize("end", [None, SystemExit(1)], ids=["goes on", "exits"])
def test_a_module_that_reboots_where_it_starts_is_kept_off(end):
    """Nobody asked for it: each one is a strike."""

    class Own(Mag):
        def start(self, core):
            core.reboot()
            if end:
                raise end

    core = flown(Own, duration_s=120.0).core
    assert core.services.kept_off() == ["mag"]
    assert core.state.reboots == OFF and core.flight.done


@pytest.mark.verifies("REQ-COR-005")
def test_a_module_stops_with_what_is_no_command_in_its_queue():
    class Own(Mag):
        def step(self, core):
            core.cdh.put("adc", 5)

    made = SOFTWARE.modules["mag"]._replace(make=Own)
    software = replace(SOFTWARE, modules=SOFTWARE.modules | {"mag": made})
    ground = Ground(Core(scenario(60.0), software))
    ground.tick(times=5)
    number = ground.dictionary.modules["adc"]
    assert ground.command("module_stop", number)["code"] == Reason.DONE
    assert ground.command("module_start", number)["code"] == Reason.DONE


def test_a_handler_that_queues_its_own_command_again_does_not_hang():
    class Own(Mag):
        def on_mag_calibration(self, core, values):
            core.cdh.put("mag", command)
            return Reason.DONE

    made = SOFTWARE.modules["mag"]._replace(make=Own)
    software = replace(SOFTWARE, modules=SOFTWARE.modules | {"mag": made})
    ground = Ground(Core(scenario(60.0), software))
    command = Telecommand("mag_calibration", 68, 23, 0, False, (0.0, 0.0, 0.0))
    assert ground.command("mag_calibration", 1.0, 2.0, 3.0)["code"] == Reason.DONE
    ground.tick(times=10)
    assert ground.core.state.slots["mag"].done > 5


@pytest.mark.verifies("REQ-COR-005")
@pytest.mark.parametrize("code", [-1, 256, 10**9])
def test_a_code_that_is_no_byte_blames_its_own_module(code):
    """It could not be saved with the log, nor sent."""

    class Own(Mag):
        def step(self, core):
            core.report("mag", code)

    core = flown(Own, duration_s=60.0).core
    assert core.state.slots["svr"].failures == core.state.slots["com"].failures == 0
    assert core.state.slots["mag"].failures > 0


@pytest.mark.verifies("REQ-COR-005")
def test_a_device_that_cannot_be_asked_for_blames_its_own_module():
    def device(self):
        raise SystemExit(1)

    ground = flown(type("Own", (Mag,), {"device": property(device)}), duration_s=60.0)
    core = ground.core.services
    assert core.power("mag", True) is Reason.FAILED
    assert not core.lacks("mag")
    assert ground.core.state.slots["svr"].failures == 0 < ground.core.state.slots["mag"].failures
