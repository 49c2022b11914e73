"""No 'yes' without an effect: every command to a satellite that lacks the device is refused."""

import tomllib
from pathlib import Path

import pytest
from onboard_ground import flown, grounded

from torquer.compile import engine
from torquer.flight.packets.commands import Sent, command_numbers
from torquer.flight.packets.dictionary import load_dictionary
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.modules.telemetry import DEVICES
from torquer.scenario.load import load_scenario

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
DATA = Path(__file__).parents[2] / "data/command_effects.toml"
EFFECTS = tomllib.loads(DATA.read_text(encoding="utf-8"))
CHIBIS = load_dictionary("chibis_m")
#: Examples, without modes, by the drivers that have no device there.
WITHOUT = {"bench": {"wheels", "sun"}, "which_sensors": {"coils"}}
#: Commands about a module as software, whatever it drives.
OF_MODULES = {"module_start", "module_stop", "report_status"}
#: What a driver's own telemetry is called.
SUBSYSTEMS = {"WHEELS": "wheels"}


def cases():
    """(command, field that names a driver or "", driver) over the whole dictionary."""
    numbers = {CHIBIS.modules[device]: device for device in DEVICES}
    for name, packet in CHIBIS.up.items():
        if packet.module in DEVICES:
            yield name, "", packet.module
        for field in set(packet.names) & {"device", "module_id"} if name not in OF_MODULES else ():
            yield from ((name, field, driver) for driver in numbers.values())
        if "subsystem" in packet.names:
            yield from ((name, "subsystem", driver) for driver in SUBSYSTEMS.values())


@pytest.fixture(scope="module")
def begun():
    """The satellites after a few seconds, made as they are asked for."""
    made = {}

    def satellite(example):
        if example not in made:
            scenario = load_scenario(f"examples/{example}.toml")
            made[example] = flown(scenario.replace("simulation.duration_s", 900.0))
        return made[example]

    return satellite


@pytest.mark.verifies("REQ-COM-011")
@pytest.mark.parametrize(("name", "field", "driver"), sorted(cases()))
@pytest.mark.parametrize("example", sorted(WITHOUT))
def test_command_is_refused_where_there_is_no_device(begun, example, name, field, driver):
    ground = grounded(*begun(example))
    labels = {each: label for label, each in SUBSYSTEMS.items()}
    number = labels.get(driver) if field == "subsystem" else CHIBIS.modules[driver]
    values = EFFECTS[name]["values"] | ({field: number} if field else {})
    given = Sent.model_validate({"at_s": 0.0, "command": name, "values": values})
    numbers = command_numbers(given, CHIBIS, ground.core.flight.names)[1:]
    before = ground.core.memory.snapshot()["files"]
    answer = ground.command(name, *numbers)
    is_refused = answer["code"] == Reason.NOT_AVAILABLE
    has_no_reading = name == "read_sensor" and driver == "coils"
    assert is_refused == (driver in WITHOUT[example] or has_no_reading)
    if is_refused:
        settings = f"settings.{driver}"
        assert ground.core.memory.snapshot()["files"]["main"][settings] == before["main"][settings]


@pytest.mark.verifies("REQ-SVR-008")
@pytest.mark.parametrize("module", ["clk", "wdt"])
def test_modules_without_settings_have_no_defaults(begun, module):
    ground = grounded(*begun("bench"))
    code = ground.command("restore_defaults", CHIBIS.modules[module])["code"]
    assert code == Reason.NOT_AVAILABLE


def test_periods_of_what_does_not_run_are_refused(begun):
    ground = grounded(*begun("bench"))
    ground.command("module_stop", CHIBIS.modules["adc"])
    assert ground.command("set_period", 4, 5.0)["code"] == Reason.STATE
    ground.command("module_start", CHIBIS.modules["adc"])
    assert ground.command("set_period", 4, 5.0)["code"] == Reason.DONE


def test_limits_of_elements_without_an_ephemeris_are_refused(begun):
    ground = grounded(*begun("bench"))
    assert ground.command("elements_limits", 500.0, 2.0)["code"] == Reason.NOT_AVAILABLE
    assert ground.command("restore_defaults", CHIBIS.modules["mod"])["code"] == Reason.NOT_AVAILABLE
