"""Sessions: flown again to the same bytes, wherever a fault strikes; the first difference found."""

import tempfile
from pathlib import Path

import pytest

import torquer
from torquer.base.explain import ScenarioError
from torquer.compile import engine
from torquer.flight.packets.commands import ScriptFile, make_frames
from torquer.flight.packets.received import as_tables
from torquer.flight.packets.station import Station
from torquer.flight.software.core import Core
from torquer.flight.software.faults import FaultsFile, software_faults, with_device_faults
from torquer.flight.software.session import (
    Sender,
    first_difference,
    fly_steps,
    replay_session,
)
from torquer.flight.software.session_file import (
    STRIDE,
    Recorder,
    Replayed,
    begin_session,
    load_session,
)
from torquer.flight.software.software import load_software

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

COMMANDS = ScriptFile.model_validate({
    "commands": [
        {"at_s": 20.0, "command": "report_status", "values": {"module_id": 1}},
        {"at_s": 30.0, "command": "set_clock", "values": {"time_ms": 1e9}, "delay_s": 40.0},
        {"at_s": 150.0, "command": "set_parameter",
         "values": {"index": "damping.gain", "value": 1e5}},
        {"at_s": 5.0, "command": "get_parameter", "values": {"index": "damping.gain"}},
    ]
})  # fmt: skip


@pytest.fixture(scope="module")
def scenario():
    return torquer.load_scenario("examples/chibis_m_day.toml").replace(
        "simulation.duration_s", 400.0
    )


def record(scenario, faults=(), commands=COMMANDS, ticks=None):
    """(session, frames with the times of their reception) of a flight."""
    file = FaultsFile.model_validate({"faults": list(faults)})
    scenario = with_device_faults(scenario, file)
    software = load_software(None)
    core = Core(scenario, software)
    station, received = Station(software), []
    frames = make_frames(commands, software.dictionary, core.flight.names, scenario.start)
    sender = Sender(frames, station)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "session.json"
        with Recorder(path, begin_session(scenario, file, None)) as recorder:
            for tick in fly_steps(
                core, lambda _, t_s: sender.at(t_s), software_faults(file), ticks
            ):
                recorder.note(tick.downlink, tick.uplink)
                received += [(tick.t_s, frame) for frame in station.receive(tick.downlink)]
        return load_session(path), received


def of_kind(received, name):
    return [(at_s, frame.values) for at_s, frame in received if frame.packet.name == name]


@pytest.mark.verifies("REQ-SES-001")
def test_stored_session_flies_again_to_the_same_bytes(scenario):
    faults = [
        {"tick": 100, "fault": "reboot"},
        {"at_s": 50.0, "fault": "gyro stuck"},
        {"at_s": 250.0, "fault": "module fails", "module": "tm"},
        {"tick": 60, "fault": "file damaged", "file": "settings.svr", "place": "both"},
    ]
    session, received = record(scenario, faults)
    again = Replayed()
    for tick in replay_session(session):
        again.note(tick.downlink)
    assert again.list_digests() == session.digests and again.ticks == session.ticks == 400
    assert first_difference(session, session) is None
    causes = [values[1] for _, values in of_kind(received, "ready")]
    assert causes == [0, 3, 2]  # switched on; the fault; the watchdog, not fed by the module
    codes = [values[1] for _, values in of_kind(received, "event")]
    assert 35 in codes and 44 in codes  # the damaged settings; the module that fails


def test_commands_take_effect_when_they_are_due(scenario):
    _, received = record(scenario)
    answers = {
        values[0]: (at_s, values[2:4]) for at_s, values in of_kind(received, "acknowledgement")
    }
    assert {k: v[1] for k, v in answers.items()} == dict.fromkeys((20, 21, 25, 32), (1, 0))
    assert answers[32][0] == pytest.approx(70.0, abs=2.0)  # delayed by 40 s
    ((_, (index, gain)),) = of_kind(received, "parameter")
    assert (index, gain) == (0, 3e6)


@pytest.mark.verifies("REQ-SES-002")
def test_the_first_difference_of_two_sessions_is_found(scenario):
    """Another command at 150 s; a session that ends early differs where it ends."""
    first, _ = record(scenario)
    fewer = ScriptFile(commands=[c for c in COMMANDS.commands if c.command != "set_parameter"])
    second, _ = record(scenario, commands=fewer)
    found = first_difference(first, second)
    assert 150 < found.first.number < 150 + STRIDE
    assert found.first.number == found.second.number
    assert found.first.downlink != found.second.downlink
    short, _ = record(scenario, ticks=130)
    found = first_difference(first, short)
    assert found.first.number == 130 and found.second is None
    forged = first.model_copy(update={"digests": ("0" * 16, *first.digests[1:])})
    with pytest.raises(ScenarioError, match="must fly here as they were recorded"):
        first_difference(first, forged)


def test_sessions_of_other_software_are_refused(scenario):
    session, _ = record(scenario, ticks=3)
    other = session.model_copy(update={"software_sha256": "0" * 64})
    with pytest.raises(ScenarioError, match="its software must be as it was recorded"):
        next(replay_session(other))


def test_what_was_received_is_a_table_a_packet(scenario):
    session, received = record(scenario, ticks=60)
    tables = as_tables(received)
    extended = tables["extended"]
    assert extended.sizes["frame"] == len(of_kind(received, "extended"))
    assert extended["omega_x"].attrs["units"] == "deg/s"
    assert extended["aos_mode"].attrs["flag_meanings"].split()[:3] == ["OFF", "SDOT", "BDOT"]
    assert set(extended["aos_mode"].values.tolist()) == {2}
    assert session.downlink_bytes > sum(len(frame.raw) for _, frame in received)


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ({"command": "jump"}, r"commands\[0\].command: must be one of set_mode, .*'jump'"),
        ({"command": "hold", "values": {"region": "stabilization", "on": "ON"}},
         r"commands\[0\].values.region: must be one of determination, .*'stabilization'"),
        ({"command": "hold", "values": {"region": 1}},
         r"commands\[0\].values.on: must be given; received nothing"),
        ({"command": "hold", "values": {"region": 1, "on": 1, "of": 2}},
         r"commands\[0\].values.of: must be a field of hold: region, on"),
        ({"command": "set_mode", "values": {"region": "stabilisation", "state": "bdot"}},
         r"commands\[0\].values.state: must be one of detumbling, acquisition, science; .*'bdot'"),
        ({"command": "coils_manual", "values": {"dipole": [1.0, 2.0], "duration": 3.0}},
         r"commands\[0\].values.dipole: must be 3 numbers; received \[1.0, 2.0\]"),
    ],
)  # fmt: skip
def test_a_command_that_cannot_be_is_refused(scenario, command, message):
    script = ScriptFile.model_validate({"commands": [{"at_s": 1.0, **command}]})
    core = Core(scenario)
    with pytest.raises(ScenarioError, match=message):
        make_frames(script, core.software.dictionary, core.flight.names, scenario.start)


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ({"fault": "reboot"}, "at_s, tick: one of the two must be given; received none"),
        ({"fault": "reboot", "at_s": 1.0, "tick": 1},
         "at_s, tick: one of the two must be given; received both"),
        ({"fault": "module stops", "at_s": 1.0}, "module: must be given for 'module stops'"),
        ({"fault": "reboot", "at_s": 1.0, "module": "tm"},
         "module: must not be given for 'reboot'"),
        ({"fault": "file lost", "at_s": 1.0, "file": "x", "place": "third"},
         "place: must be 'main', 'reserve' or 'both'; received 'third'"),
        ({"fault": "gyro broken", "at_s": 1.0},
         r"faults\[0\].fault: must be one of reboot, .*gyro stuck.*received 'gyro broken'"),
        ({"fault": "gyro stuck", "tick": 1},
         r"faults\[0\].at_s: must be given for a device; received a tick"),
    ],
)  # fmt: skip
def test_a_fault_that_cannot_be_is_refused(scenario, fault, message):
    with pytest.raises(ValueError, match=message):
        with_device_faults(scenario, FaultsFile.model_validate({"faults": [fault]}))
