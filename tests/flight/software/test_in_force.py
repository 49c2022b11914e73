"""What the ground has set is shown on request: calibrations, models, periods."""

import math
from dataclasses import replace

import pytest
from onboard_ground import Ground, flown, grounded, scenario
from uplink_cases import AHEAD, in_bytes

from torquer.compile import engine
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.core import Core
from torquer.flight.software.modules.drivers import Mag
from torquer.flight.software.software import load_software
from torquer.scenario.load import load_scenario

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
SOFTWARE = load_software()
ONE = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
OTHER = (1.0, 0.25, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.25)
#: Driver, commands, numbers that are then in force.
CALIBRATED = [
    ("coils", [("coils_calibration", 2.0, 0.5, 1.5)], (2.0, 0.5, 1.5)),
    ("gyro", [("gyro_calibration", 0.5, 0.0, 0.25)], (0.5, 0.0, 0.25, *ONE)),
    ("gyro", [("gyro_matrix", *OTHER)], (0.0, 0.0, 0.0, *OTHER)),
    ("mag", [], (0.0, 0.0, 0.0, *ONE)),
    ("mag", [("mag_calibration", 0.0, 900.0, 0.0), ("mag_matrix", *OTHER)], (0.0, 900, 0, *OTHER)),
    ("sun", [("sun_calibration", 0.0, 5.0, -1.0)], (0.0, 5.0, -1.0)),
    ("wheels", [], (1.0,) * 6),
    ("wheels", [("wheels_calibration", 3, 1.5)], (1.0, 1.0, 1.0, 1.5, 1.0, 1.0)),
]


@pytest.fixture(scope="module")
def begun():
    return flown(scenario(600.0))


@pytest.fixture
def ground(begun):
    return grounded(*begun)


def asked(ground, module, packet):
    """What comes of a packet when the status of a module is asked for."""
    ground.packets.clear()
    code = ground.command("report_status", ground.dictionary.modules[module])["code"]
    assert code == Reason.DONE
    return ground.named(packet)


@pytest.mark.verifies("REQ-TM-005")
@pytest.mark.parametrize(("driver", "commands", "numbers"), CALIBRATED)
def test_calibration_in_force_is_shown(ground, driver, commands, numbers):
    """Also after a boot, as it is kept."""
    for name, *values in commands:
        assert ground.command(name, *values)["code"] == Reason.DONE
    for _ in range(2):
        (found,) = asked(ground, driver, "calibration")
        assert found["device"] == ground.dictionary.modules[driver]
        values = [found[f"value_{k}"] for k in range(12)]
        assert found["numbers"] == len(numbers)
        assert values == [*numbers, *[0.0] * (12 - len(numbers))]
        ground.core.reboot()
        ground.tick(times=20)


@pytest.mark.verifies("REQ-TM-005")
def test_refused_calibration_is_not_shown(ground):
    (before,) = asked(ground, "mag", "calibration")
    assert ground.command("mag_matrix", *[0.0] * 9)["code"] == Reason.VALUE
    assert asked(ground, "mag", "calibration") == [before]


@pytest.mark.verifies("REQ-TM-005")
def test_models_in_force_are_shown(ground):
    assert asked(ground, "mod", "models") == [
        {"flags": 3, "elements": 0, "distance": 1000.0, "angle": 5.0}
    ]
    ground.command("elements_limits", 500.0, 2.0)
    ground.command("set_elements", *in_bytes(AHEAD))
    ground.command("set_model", 1)
    assert asked(ground, "mod", "models") == [
        {"flags": 1, "elements": 1, "distance": 500.0, "angle": 2.0}
    ]


@pytest.mark.verifies("REQ-TM-005")
@pytest.mark.parametrize("number", range(6))
def test_period_in_force_is_shown(ground, number):
    name = ground.dictionary.labels["subsystem"][number].lower() + "_period"
    (before,) = asked(ground, "tm", "periods")
    assert ground.command("set_period", number, 77.0)["code"] == Reason.DONE
    (found,) = asked(ground, "tm", "periods")
    assert found == before | {name: 77.0} and before[name] != 77.0


def test_other_modules_have_nothing_of_the_kind(ground):
    for module in sorted(set(ground.core.state.modules) - {"tm", "mod", *dict(
        (driver, 0) for driver, *_ in CALIBRATED)}):  # fmt: skip
        for packet in ("calibration", "models", "periods"):
            assert asked(ground, module, packet) == []


def test_without_device_or_module_there_is_nothing_to_show():
    made = load_scenario("examples/which_sensors.toml")
    ground = Ground(Core(made, {"modules": {"tm": {}, "coils": {}, "wheels": {}}}))
    assert asked(ground, "coils", "calibration") == []
    assert len(asked(ground, "wheels", "calibration")) == 1
    (found,) = asked(ground, "tm", "periods")
    assert math.isnan(found["temperatures_period"]) and found["wheels_period"] == 60.0


def test_other_dictionary_without_these_packets_sends_none(ground, monkeypatch):
    """Status is answered as before."""
    down = {k: v for k, v in ground.dictionary.down.items() if k != "calibration"}
    monkeypatch.setattr(ground.core.services, "sends", down.__contains__)
    assert asked(ground, "mag", "calibration") == []
    assert asked(ground, "mag", "module_status")


class Shows(Mag):
    """A module of the user's that hands over what is no packet."""

    what = ()

    def in_force(self, core):
        if isinstance(self.what, BaseException):
            raise self.what
        return self.what


@pytest.mark.verifies("REQ-COR-005")
@pytest.mark.parametrize(
    "what",
    [None, 3, [3], [("calibration",)], [("calibration", (1, 2))], [(None, ())], [([], ())],
     [("calibration", None)], SystemExit(1), KeyboardInterrupt()],
    ids=range(10),
)  # fmt: skip
def test_what_is_no_packet_costs_nobody_else(what):
    made = SOFTWARE.modules["mag"]._replace(make=type("Own", (Shows,), {"what": what}))
    software = replace(SOFTWARE, modules=SOFTWARE.modules | {"mag": made})
    ground = Ground(Core(scenario(60.0), software))
    ground.tick(times=5)
    assert asked(ground, "mag", "module_status")
    slots = ground.core.state.slots
    assert slots["svr"].failures == 0
    assert (slots["mag"].failures > 0) == (what != [(None, ())])
    ground.tick(times=20)
    assert ground.core.is_running and ground.named("extended")
