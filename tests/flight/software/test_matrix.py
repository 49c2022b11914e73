"""No 'yes' without an effect: what each command changes in telemetry; each field can change."""

import itertools
import tomllib
from pathlib import Path

import pytest
from onboard_ground import ALL_MODES, Ground, scenario

from torquer.compile import engine
from torquer.flight.packets.commands import Sent, command_numbers
from torquer.flight.packets.dictionary import load_dictionary
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.core import Core
from torquer.flight.software.faults import SoftwareFault, strike

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
DATA = Path(__file__).parents[2] / "data/command_effects.toml"
EFFECTS = tomllib.loads(DATA.read_text(encoding="utf-8"))
CHIBIS = load_dictionary("chibis_m")
#: All telemetry within a short flight.
SOFTWARE = {
    "modules": {
        **{name: {} for name in ("aos", "stb", "mod", "clk", "fs", "mag", "gyro", "sun", "coils")},
        "tm": {"settings": {"store_s": 1.0, "modules_s": 10.0, "in_file": 5}},
        "svr": {"settings": {"report_s": 9.0}},
        "cdh": {"settings": {"report_s": 10.0}, "period_s": 1.0},
        "adc": {"settings": {"report_s": 7.0}, "period_s": 1.0},
        "wheels": {"settings": {"report_s": 8.0}},
    }
}
SHORT, LONG = 5, 40
#: Fields that cannot change in a flight of this satellite: by the beginning of their names, why.
CONSTANT = {
    "stored.isolated": "no record is stored while a sensor is judged wrong",
    "queues.commands_dropped": "no more commands are handed on than the queues take",
    "queues.acks_dropped": "as queues.commands_dropped",
    "devices.coils_errors": "no poll of the simulated coils fails",
    "wheels.speed_6": "it has six wheels",
    "wheels.speed_7": "it has six wheels",
    "wheels.motor_6": "it has six wheels",
    "wheels.motor_7": "it has six wheels",
    **{f"modes.state_{k}": "it has no such region" for k in range(14, 32)},
}


@pytest.fixture(scope="module")
def pointing():
    """The satellite in its science mode, by the wheels."""
    core = Core(scenario(9000.0, ALL_MODES), SOFTWARE)
    while core.services.modes["stabilisation"] != "science":
        assert core.tick() is not None
    for _ in range(300):
        core.tick()
    return core, core.snapshot()


class Flight:
    """A ground that commands by names from the science mode on, and the packets that it gets."""

    def __init__(self, pointing):
        core, snapshot = pointing
        core.restore(snapshot)
        self.ground = Ground(core)

    def send(self, commands, times=SHORT, **keys):
        """Commands one after the other, some control steps each."""
        core = self.ground.core
        for given in commands:
            sent = Sent.model_validate({"at_s": 0.0, **given})
            values = command_numbers(sent, core.software.dictionary, core.flight.names)[1:]
            if sent.delay_s is not None:
                keys = keys | {"time_s": core.state.clock.now_s + round(sent.delay_s)}
            self.ground.command(sent.command, *values, times=times, **keys)

    def columns(self):
        """Values of each field of telemetry, in their order."""
        found = {}
        for packet, _, values in self.ground.packets:
            for name, value in values.items():
                found.setdefault(f"{packet}.{name}", []).append(value)
        return found


def flown(pointing, name, with_it=True):
    """Telemetry of a flight with a command, or of the same one without it."""
    effect, flight = EFFECTS[name], Flight(pointing)
    flight.send(effect.get("before", ()))
    flight.send([{"command": name, "values": effect["values"]}] if with_it else ())
    if not with_it:
        flight.ground.tick(times=SHORT)
    flight.send(effect.get("after", ()))
    flight.ground.tick(times=LONG)
    return flight


def test_every_command_has_an_entry():
    assert set(EFFECTS) == set(CHIBIS.up)


@pytest.mark.verifies("REQ-COM-011")
@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_command_changes_what_it_is_to_change(pointing, name):
    effect = EFFECTS[name]
    after, before = (flown(pointing, name, with_it).columns() for with_it in (True, False))
    answers = dict(zip(after["acknowledgement.command_id"], after["acknowledgement.code"],
                       strict=True))  # fmt: skip
    refused = effect.get("refused")
    assert answers[CHIBIS.up[name].id] == (Reason[refused] if refused else Reason.DONE)
    if refused:
        assert Reason[refused] in after["event.code"]
        return
    assert effect["changes"]
    known = {f"{packet.name}.{field}" for packet in CHIBIS.down.values() for field in packet.names}
    assert set(effect["changes"]) <= known
    same = [field for field in effect["changes"] if after.get(field) == before.get(field)]
    assert same == []


def as_listed(name):
    """A command as the table has it."""
    return [{"command": name, "values": EFFECTS[name]["values"]}]


def everything(pointing):
    """All at once, and the record of it."""
    flight = Flight(pointing)
    core, ground = flight.ground.core.services, flight.ground
    power = [{"command": "power", "values": {"device": n, "on": 0}} for n in range(20, 25)]
    flight.send([*as_listed("set_thresholds"), *as_listed("automatic")])
    for region, (name, states) in enumerate(core.regions):
        if name == "supervisor":  # the other state would end manual operation
            continue
        other = (states.index(core.modes[name]) + 1) % len(states)
        ground.command("set_mode", region, other)
        ground.command("hold", region, 1)
    flight.send([*as_listed("coils_manual"), *as_listed("wheels_manual")])
    flight.send([{"command": "read_sensor", "values": {"device": 21, "unit": k}} for k in range(3)])
    flight.send(power)
    flight.send([{"command": "read_sensor", "values": {"device": 23, "unit": 0}}])
    flight.send([{"command": "get_parameter", "values": {"index": k}} for k in range(3)])
    flight.send(
        [{"command": "dump", "values": {"file": k, "offset": k, "length": 90}} for k in (0, 1)]
    )
    ground.command("shift_clock", 1, time_s=core.clock.now_s + 10)
    for after_s, name in ((500, "shift_clock"), (600, "report_status")):
        ground.command(name, 3, time_s=core.clock.now_s + after_s, request=after_s)
    flight.send(as_listed("plan_list"))
    ask = [{"command": "report_status", "values": {"module_id": n}} for n in (4, 20, 21, 22, 23)]
    set_all = ({"subsystem": k, "period": 30} for k in range(6))
    periods = [{"command": "set_period", "values": each} for each in set_all]
    other = [1.1, 0.1, 0.2, 0.3, 0.9, 0.1, 0.2, 0.3, 1.2]
    matrix = [{"command": "gyro_matrix", "values": {"matrix": other}}]
    bias = [{"command": "gyro_calibration", "values": {"bias": [0.1, 0.2, 0.3]}}]
    flight.send([*ask, *periods, *matrix, *bias, *ask])
    flight.send(as_listed("replay"), times=200)
    return flight


def troubled(pointing):
    """Too many commands, reboots, damaged settings, modules that fail or stop."""
    flight = Flight(pointing)
    ground, core = flight.ground, flight.ground.core
    for name, value in (("set_model", 0), ("report_status", 3), ("shift_clock", 10)):
        ground.tick(b"".join(ground.frame(name, value) for _ in range(60)), 30)
    strike(core, SoftwareFault(at_s=0.0, fault="file damaged", file="settings.mag", place="both"))
    core.reboot()
    while not core.is_running:
        ground.tick()
    for _ in range(3):  # while few state vectors wait
        ground.tick(ground.frame("set_period", 3, 1.0))
    ground.tick(times=30)
    strike(core, SoftwareFault(at_s=0.0, fault="module stops", module="mod"))
    strike(core, SoftwareFault(at_s=0.0, fault="module fails", module="stb"))
    ground.tick(times=60)
    flight.send(as_listed("reboot"), times=60)
    flight.send(as_listed("replay"), times=200)
    return flight


def broken():
    """Sensors that read what cannot be, a dead wheel that is driven."""
    nan = [{"kind": "nan", "from_s": 20.0}]
    wheel = [{"wheel": 0, "time_s": 20.0, "noticed_after_s": 1e7}]
    sensors = {
        f"spacecraft__{name}__failures": nan for name in ("magnetometer", "gyro", "sun_sensors")
    }
    made = scenario(400.0, ALL_MODES, spacecraft__wheels__failures=wheel, **sensors)
    core = Core(made, SOFTWARE)
    flight = Flight((core, core.snapshot()))
    flight.ground.command("wheels_manual", 5e-5, 0.0, 0.0, 900.0)
    flight.ground.tick(times=300)
    return flight


@pytest.mark.verifies("REQ-COM-011")
def test_each_field_of_telemetry_can_change(pointing):
    flights = [flown(pointing, name) for name in sorted(EFFECTS)]
    flights += [everything(pointing), troubled(pointing), broken()]
    seen = {}
    for field, values in itertools.chain.from_iterable(f.columns().items() for f in flights):
        seen.setdefault(field, set()).update(values)
    every = {f"{packet.name}.{name}" for packet in CHIBIS.down.values() for name in packet.names}
    same = {field for field in every if len(seen.get(field, ())) < 2}
    assert ", ".join(sorted(same - set(CONSTANT))) == ""
    assert ", ".join(sorted(set(CONSTANT) - same)) == ""
