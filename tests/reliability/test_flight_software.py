"""The flight software for a month, through a thousand reboots, and read by others."""

import gc
import random
import resource

import pytest
from onboard_ground import Ground, flying
from space_packet_parser.xtce import definitions

import torquer
from torquer.flight.packets.reasons import Reason
from torquer.flight.packets.xtce import FRAME, xtce
from torquer.flight.software.core import Core
from torquer.flight.software.faults import FaultsFile, software_faults
from torquer.flight.software.session import first_difference, fly_steps, replay_session
from torquer.flight.software.session_file import Recorder, Replayed, begin_session, load_session

pytestmark = pytest.mark.slow

DAY_S = 86400.0


def day(duration_s=DAY_S, **keys):
    """The day of Chibis-M, of another length."""
    return torquer.load_scenario("examples/chibis_m_day.toml").replace(
        "simulation.duration_s", duration_s
    )


@pytest.mark.verifies("REQ-COR-004", "REQ-CDH-001", "REQ-CLK-001")
def test_thirty_days_in_lock_step_need_no_more_memory():
    """Memory grows by less than 5 MB after the first week; queues and clock keep in bounds.

    Within the tables of the environment, which last for 5 days, it is constant to the byte. The
    first change of these tables takes 3 to 8 MB once, with modules and without.
    """
    scenario = day(30.0 * DAY_S).replace("simulation.record_s", 86400.0)
    core, sizes = Core(scenario), []
    core.result()
    begun_ms = core.state.clock.now_ms
    for step in range(int(30 * DAY_S)):
        if core.tick() is None:
            break
        if step % 86400 == 86399:
            gc.collect()
            sizes.append(_resident_mb())
            for name, queue in core.services.cdh.queues.items():
                assert len(queue) <= queue.maxlen <= 10, name
    flown_s = core.services.t_s
    assert flown_s > 30 * DAY_S - 10.0
    assert core.services.now_ms - begun_ms == round(flown_s * 100.0) * 10
    assert max(sizes[7:]) - sizes[6] < 5.0, sizes


def _resident_mb() -> float:
    """Memory of this process that is resident now [MB]."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * resource.getpagesize() / 1e6


@pytest.mark.verifies("REQ-BOO-004", "REQ-CLK-002", "REQ-SES-001")
def test_flight_survives_thousand_reboots_and_replays_to_the_same_bytes(tmp_path):
    """At random control steps of a day, none of them during a boot, which would not be counted;
    each loses a boot and at most the minute since the save."""
    rng = random.Random(5)
    ticks = [20 * slot + rng.randrange(8) for slot in sorted(rng.sample(range(1, 4300), 1000))]
    faults = FaultsFile.model_validate({
        "faults": [{"tick": tick, "fault": "reboot"} for tick in ticks]
    })  # fmt: skip
    scenario = day()
    core, path = Core(scenario), tmp_path / "session.json"
    ground = Ground(core)
    begun_ms = core.state.clock.now_ms
    with Recorder(path, begin_session(scenario, faults, None)) as recorder:
        for tick in fly_steps(core, lambda _, t_s: b"", software_faults(faults)):
            recorder.note(tick.downlink, tick.uplink)
            ground.packets += ground.decoded(tick.downlink)
    causes = [values["boot_reason"] for values in ground.named("ready")]
    assert core.services.reboots == 1000 and set(causes) == {0, 3}
    lost_s = core.services.t_s - 1e-3 * (core.services.now_ms - begun_ms)
    assert 0.0 < lost_s < 1000 * (60.0 + 12.0)
    codes = {values["code"] for values in ground.named("event")}
    assert Reason.MODULE_FAILED not in codes and Reason.SETTINGS_DAMAGED not in codes
    session, again = load_session(path), Replayed()
    for tick in replay_session(session):
        again.note(tick.downlink)
    assert again.list_digests() == session.digests
    assert first_difference(session, session) is None


@pytest.mark.verifies("REQ-PKT-004")
def test_independent_reader_decodes_a_whole_session_by_its_xtce(tmp_path):
    """Every number of every packet of two hours, without our decoder."""
    ground = flying(7200.0)
    file = tmp_path / "chibis_m.xml"
    file.write_text(xtce(ground.dictionary), encoding="utf-8")
    reader = definitions.XtcePacketDefinition.from_xtce(file, root_container_name=FRAME)
    frames = []
    for _ in range(7200):
        sent = ground.core.tick()
        for part in ground.receiver.feed(sent):
            frames += ground.stream.feed(part)
    for frame in frames:
        read = reader.parse_bytes(frame.raw)
        assert read["time_stamp"] == frame.time_s
        for (name, field, _), value in zip(frame.packet.numbers(), frame.values, strict=True):
            theirs = read[f"{frame.packet.name}__{name}"]
            assert (theirs.raw_value if field.labels else theirs) == value, name
    assert len(frames) > 7200
