"""Flights with `link = "pus"`: the same flight, commanded and reported on by PUS-C."""

import random

import pytest
from onboard_ground import scenario
from spacepackets.ecss import PusTc, PusTm

from torquer.base.explain import ScenarioError
from torquer.compile import engine
from torquer.flight.packets.frames import Uplink
from torquer.flight.packets.reasons import Reason
from torquer.flight.packets.station import Station
from torquer.flight.software.core import Core
from torquer.flight.software.faults import FaultsFile
from torquer.flight.software.session import fly_steps, replay_session
from torquer.flight.software.session_file import Recorder, Replayed, begin_session, load_session
from torquer.flight.software.software import load_software

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
MODULES = {name: {} for name in load_software().modules}
PUS = load_software({"link": "pus", "modules": MODULES})
PROTECTED = load_software({"link": "protected", "modules": MODULES})
APID = PUS.keys.spacecraft


class Satellite:
    """A flight and its ground station; `reports`: telemetry packets, read by another package."""

    def __init__(self, core):
        self.core, self.station = core, Station(core.software)
        self._frame = Uplink(core.software.dictionary).frame
        self.sent, self.reports, self.frames = [], [], []

    def command(self, name, *values, time_s=0, acknowledge=1, request=0):
        """The bytes of a command."""
        return self.station.command(self._frame(name, time_s, (acknowledge, *values), request))

    def packet(self, packet):
        """The bytes of a telecommand packet, from whatever made it."""
        return self.station.protection.commands.wrap(bytes(packet))

    def tick(self, uplink=b"", times=1):
        """Control steps, the first with an uplink; (name, values) that came down."""
        found = []
        for _ in range(times):
            sent = self.core.tick(uplink)
            uplink = b""
            self.sent.append(sent)
            for packet in self.station.protection.telemetry.feed(sent):
                if self.core.software.link == "pus":
                    self.reports.append(PusTm.unpack(packet, 7))
                found += self.station.stream.feed(packet)
        self.frames += found
        return [(f.packet.name, dict(zip(f.packet.names, f.values, strict=True))) for f in found]

    def answers(self, uplink, times=4):
        """(command id, code) of the acknowledgements that come."""
        found = self.tick(uplink, times)
        return [(v["command_id"], v["code"]) for name, v in found if name == "acknowledgement"]

    def verified(self):
        """(subtype, sequence count, code if there is one) of reports of service 1 since the last
        call.
        """
        taken, self.reports = self.reports, []
        return [
            (tm.message_subtype, int.from_bytes(tm.tm_data[2:4], "big") & 0x3FFF, *tm.tm_data[4:])
            for tm in taken
            if tm.service == 1
        ]


@pytest.fixture(scope="module")
def begun():
    """A satellite that has flown for a little while, how to go back there, and its station."""
    satellite = Satellite(Core(scenario(120.0), PUS))
    satellite.tick(times=5)
    return satellite.core, satellite.core.snapshot()


@pytest.fixture
def satellite(begun):
    """The satellite as it was then, with a ground that begins to listen."""
    core, snapshot = begun
    core.restore(snapshot)
    return Satellite(core)


def commanded(software):
    """A flight of a minute with commands of all kinds; its result and acknowledgements."""
    satellite = Satellite(Core(scenario(60.0), software))
    now_s = satellite.core.state.clock.now_s
    found = satellite.answers(satellite.command("set_parameter", 0, 2e6), 10)
    delayed = satellite.command("coils_manual", 1.0, 2.0, 3.0, 10.0, time_s=now_s + 20)
    found += satellite.answers(delayed, 10)
    found += satellite.answers(satellite.command("set_mode", 0, 1), 39)
    return satellite.core.result(), found


@pytest.mark.verifies("REQ-PUS-002", "REQ-COR-001")
def test_motion_matches_the_protected_link_bit_for_bit():
    (ours, found), (theirs, expected) = commanded(PUS), commanded(PROTECTED)
    assert ours.identical(theirs)
    assert found == expected == [(20, 0), (64, Reason.WAITING), (64, 0), (16, Reason.MODE)]


@pytest.mark.verifies("REQ-PUS-003")
def test_acceptance_and_execution_are_reported(satellite):
    assert satellite.answers(satellite.command("shift_clock", 10)) == [(33, Reason.DONE)]
    assert satellite.verified() == [(1, 0), (7, 0)]
    assert satellite.answers(satellite.command("set_mode", 0, 1)) == [(16, Reason.MODE)]
    assert satellite.verified() == [(1, 1), (8, 1, Reason.MODE)]
    assert satellite.answers(satellite.command("shift_clock", 10, acknowledge=0)) == []
    assert satellite.verified() == []
    failed = satellite.answers(satellite.command("set_mode", 0, 1, acknowledge=0))
    assert failed == [(16, Reason.MODE)], "failures are always reported"
    satellite.core.services.stop("mod")
    satellite.verified()
    assert satellite.answers(satellite.command("set_model", 3)) == [(49, Reason.STATE)]
    assert satellite.verified() == [(2, 4, Reason.STATE)]


@pytest.mark.verifies("REQ-PUS-002")
def test_parameters_are_those_of_service_20(satellite):
    frames = b"".join(
        (
            *(satellite.command("get_parameter", 0), satellite.command("set_parameter", 0, 2e6)),
            satellite.command("get_parameter", 0),
        )
    )
    found = satellite.tick(frames, 4)
    assert [v["value"] for name, v in found if name == "parameter"] == [3e6, 2e6]
    kinds = [(tm.service, tm.message_subtype) for tm in satellite.reports]
    assert kinds.count((20, 2)) == 2


@pytest.mark.verifies("REQ-PUS-004", "REQ-PUS-003")
def test_a_delayed_command_is_an_activity_of_the_schedule(satellite):
    now_s = satellite.core.state.clock.now_s
    uplink = satellite.command("shift_clock", 0, time_s=now_s + 10)
    assert satellite.answers(uplink, 3) == [(33, Reason.WAITING)]
    assert satellite.verified() == [(1, 0), (7, 0)]
    assert satellite.core.services.status("com")["delayed"] == 1
    assert satellite.answers(b"", 20) == [(33, Reason.DONE)]
    at_s = [f.time_s for f in satellite.frames if f.packet.name == "acknowledgement"][-1]
    assert now_s + 10 <= at_s <= now_s + 12
    assert satellite.verified() == [(1, 1), (7, 1)]


@pytest.mark.verifies("REQ-PUS-004")
def test_several_activities_of_one_request_wait_for_their_times(satellite):
    """As another package makes them, one of them too far ahead."""
    from pus_ends import stamp

    now_s, data = satellite.core.state.clock.now_s, b"\x03"
    for count, ahead_s in ((3, 12), (4, 10**6), (5, 8)):
        shift = PusTc(8, 1, apid=APID, app_data=b"\x21\x07\0\0\0", seq_count=count, ack_flags=9)
        data += stamp(now_s + ahead_s) + bytes(shift.pack())
    request = PusTc(11, 4, apid=APID, app_data=data, seq_count=2, ack_flags=9)
    satellite.tick(satellite.packet(request.pack()), 2)
    assert satellite.verified() == [(2, 4, Reason.TIME), (1, 2), (8, 2, Reason.TIME)]
    satellite.tick(times=20)
    assert satellite.verified() == [(1, 5), (7, 5), (1, 3), (7, 3)]
    shifts = [f.values[2] for f in satellite.frames if f.packet.name == "event"]
    assert shifts.count(7) == 2


@pytest.mark.verifies("REQ-PUS-004")
@pytest.mark.parametrize(
    ("ahead", "code"), [(-601, Reason.LATE), (-599, Reason.DONE), (10**6, Reason.TIME)]
)
def test_release_times_that_cannot_be_kept(satellite, ahead, code):
    now_s = satellite.core.state.clock.now_s
    uplink = satellite.command("shift_clock", 0, time_s=now_s + ahead)
    assert satellite.answers(uplink)[-1] == (33, code)
    if code:
        assert satellite.verified() == [(2, 0, code)]
    else:
        assert satellite.verified() == [(1, 0), (7, 0), (1, 1), (7, 1)]


@pytest.mark.verifies("REQ-PUS-004")
def test_activity_displaced_by_a_set_clock_is_refused_at_release(satellite):
    now_s = satellite.core.state.clock.now_s
    satellite.tick(satellite.command("coils_manual", 1.0, 0.0, 0.0, 60.0, time_s=now_s + 100), 2)
    satellite.verified()
    satellite.tick(satellite.command("set_clock", (now_s + 86400) * 1e3), 4)
    assert (2, 1, Reason.LATE) in satellite.verified()
    assert satellite.core.services.status("coils")["manual"] == 0


@pytest.mark.verifies("REQ-PUS-004", "REQ-COM-010")
def test_an_activity_is_deleted_by_the_number_of_its_command(satellite):
    """TC[11,5] names the telecommand packet; the ground knows which one had this number."""
    now_s, at = satellite.core.state.clock.now_s, {"time_s": satellite.core.state.clock.now_s + 20}
    uplink = satellite.command("shift_clock", 10, request=41, **at)
    uplink += satellite.command("shift_clock", 20, request=42, **at)
    satellite.tick(uplink, 2)
    found = satellite.tick(satellite.command("plan_cancel", 41, request=43), 40)
    answers = [(v["request"], v["code"]) for name, v in found if name == "acknowledgement"]
    assert answers == [(43, Reason.DONE), (41, Reason.CANCELLED), (42, Reason.DONE)]
    shifts = [
        v["argument"] for name, v in found if name == "event" and v["code"] == Reason.TIME_SET
    ]
    assert shifts == [20] and satellite.core.state.clock.now_s > now_s + 20
    unknown = satellite.tick(satellite.command("plan_cancel", 99, request=44), 3)
    assert [v["code"] for name, v in unknown if name == "acknowledgement"] == [Reason.VALUE]


@pytest.mark.verifies("REQ-PUS-004", "REQ-COM-010")
def test_the_schedule_is_reset(satellite):
    now_s = satellite.core.state.clock.now_s
    for k in range(3):
        satellite.tick(satellite.command("shift_clock", k, request=k + 1, time_s=now_s + 20))
    found = satellite.tick(satellite.packet(PusTc(11, 3, apid=APID, ack_flags=9).pack()), 40)
    answers = [(v["request"], v["code"]) for name, v in found if name == "acknowledgement"]
    assert answers == [(0, Reason.DONE), *((k, Reason.CANCELLED) for k in (1, 2, 3))]
    assert not satellite.core.services.status("com")["delayed"]


@pytest.mark.verifies("REQ-PUS-003", "REQ-COM-010")
def test_an_activity_is_reported_on_after_a_reboot(satellite):
    now_s = satellite.core.state.clock.now_s
    satellite.tick(satellite.command("shift_clock", 10, request=7, time_s=now_s + 40), 3)
    satellite.verified()
    satellite.core.reboot()
    found = satellite.tick(times=80)
    answers = [(v["request"], v["code"]) for name, v in found if name == "acknowledgement"]
    assert answers == [(7, Reason.DONE)]


@pytest.mark.verifies("REQ-PUS-003")
def test_more_requests_than_a_queue_takes_are_all_executed(satellite):
    """Nine commands within a control step for a queue of five."""
    satellite.tick(b"".join(satellite.command("shift_clock", k) for k in range(9)), 4)
    found = satellite.verified()
    assert [each for each in found if each[0] == 1] == [(1, k) for k in range(9)]
    assert [each for each in found if each[0] == 7] == [(7, k) for k in range(9)]


@pytest.mark.verifies("REQ-PUS-003")
def test_no_answer_of_many_commands_is_lost(satellite):
    """Fifteen commands for three modules within a control step, a queue of ten answers."""
    frames = []
    for _ in range(5):
        frames += [satellite.command("coils_automatic"), satellite.command("shift_clock", 0)]
        frames.append(satellite.command("report_status", 1))
    satellite.tick(b"".join(frames), 4)
    found = satellite.verified()
    assert found[:15] == [(1, k) for k in range(15)]
    assert sorted(found[15:]) == [(7, k) for k in range(15)]
    satellite.tick(satellite.command("shift_clock", 0), 4)
    assert satellite.verified() == [(1, 15), (7, 15)]


@pytest.mark.verifies("REQ-PUS-006")
def test_a_connection_test_is_answered(satellite):
    satellite.tick(satellite.station.ping(), 2)
    assert satellite.station.pings_answered == 1
    assert (17, 2) in [(tm.service, tm.message_subtype) for tm in satellite.reports]


@pytest.mark.verifies("REQ-PUS-005", "REQ-COM-003")
@pytest.mark.parametrize(
    ("packet", "code", "number"),
    [
        (PusTc(8, 1, apid=APID, app_data=b"\xfa\x01"), Reason.UNKNOWN, 250),
        (PusTc(8, 1, apid=APID, app_data=b"\x12\x01\x01"), Reason.LENGTH, 18),
        (PusTc(11, 9, apid=APID), Reason.UNKNOWN, 11 << 8 | 9),
        (PusTc(3, 27, apid=APID, app_data=b"\x01\0\1"), Reason.UNKNOWN, 3 << 8 | 27),
        (PusTc(8, 1, apid=APID + 1, app_data=b"\x12\x01"), Reason.MODULE, 0),
    ],
)
def test_invalid_command_is_answered_and_the_next_one_executed(satellite, packet, code, number):
    rejected = satellite.core.services.status("com")["rejected"]
    uplink = satellite.packet(packet.pack()) + satellite.command("shift_clock", 10)
    assert satellite.answers(uplink) == [(0, code), (33, Reason.DONE)]
    assert satellite.verified() == [(2, 0, code), (1, 0), (7, 0)]
    events = [f.values[:3] for f in satellite.frames if f.packet.name == "event"]
    assert (5, code, number) in events
    assert satellite.core.services.status("com")["rejected"] == rejected + 1


@pytest.mark.verifies("REQ-PUS-005")
def test_a_wrong_checksum_within_an_authentic_frame_is_refused(satellite):
    packet = bytearray(PusTc(8, 1, apid=APID, app_data=b"\x12\x00").pack())
    packet[-3] ^= 1
    satellite.tick(satellite.packet(packet), 3)
    assert satellite.verified() == [(2, 0, Reason.CHECKSUM)]
    assert satellite.core.services.status("svr")["mode"] == 1  # not switched to manual operation


@pytest.mark.verifies("REQ-PUS-005")
def test_no_packet_makes_the_software_fail(satellite):
    """Authentic frames with mutated packets, ten a control step."""
    rng = random.Random(4)
    names = sorted(satellite.core.software.dictionary.up)
    names.remove("reboot")
    for _ in range(60):
        uplink = b""
        for _ in range(10):
            packet = PUS.dictionary.up[rng.choice(names)]
            data = bytes([packet.id]) + rng.randbytes(packet.size - 1 + (rng.random() < 0.1))
            made = bytearray(PusTc(8, 1, apid=APID, app_data=data).pack())
            if rng.random() < 0.3:
                made[rng.randrange(len(made))] ^= 1 << rng.randrange(8)
            uplink += satellite.packet(made)
        satellite.tick(uplink)
    codes = {f.values[1] for f in satellite.frames if f.packet.name == "event"}
    assert Reason.MODULE_FAILED not in codes and not satellite.core.exceptions
    assert {Reason.CHECKSUM, Reason.VALUE} <= codes


@pytest.mark.verifies("REQ-PUS-002", "REQ-COR-003")
def test_a_snapshot_restored_gives_the_same_bytes(satellite):
    """In the middle of a delayed command and of one that is on its way."""
    now_s = satellite.core.state.clock.now_s
    satellite.tick(satellite.command("shift_clock", 0, time_s=now_s + 10), 3)
    satellite.tick(satellite.command("report_status", 1))
    snapshot = satellite.core.snapshot()
    bad = satellite.packet(PusTc(11, 3, apid=APID).pack())
    flights = []
    for _ in range(2):
        satellite.core.restore(snapshot)
        flights.append([satellite.core.tick(bad if k == 2 else b"") for k in range(20)])
    assert flights[0] == flights[1]


def test_a_reboot_begins_the_counts_again(satellite):
    satellite.core.reboot()
    satellite.tick(times=15)
    assert satellite.core.is_running and not satellite.station.stream.rejected
    headers = [(tm.seq_count, tm.pus_tm_sec_header.message_counter) for tm in satellite.reports]
    assert (0, 0) in headers
    assert satellite.answers(satellite.command("shift_clock", 10)) == [(33, Reason.DONE)]


@pytest.mark.verifies("REQ-SES-001", "REQ-PUS-002")
def test_a_session_flies_again_to_the_same_bytes(tmp_path):
    file = tmp_path / "software.toml"
    tables = "".join(f"[modules.{name}]\n" for name in MODULES)
    file.write_text(f'link = "pus"\n{tables}', encoding="utf-8")
    whole, path = scenario(60.0), tmp_path / "session.json"
    core = Core(whole, load_software(file))
    satellite = Satellite(core)
    now_s = core.state.clock.now_s
    uplink = {
        5: satellite.command("get_parameter", 0),
        8: satellite.command("shift_clock", 100, time_s=now_s + 30) + satellite.station.ping(),
    }
    with Recorder(path, begin_session(whole, FaultsFile(), file)) as recorder:
        for tick in fly_steps(core, lambda number, _: uplink.get(number, b"")):
            recorder.note(tick.downlink, tick.uplink)
    session, again = load_session(path), Replayed()
    for tick in replay_session(session):
        again.note(tick.downlink)
    assert again.list_digests() == session.digests and again.ticks == session.ticks > 50


def test_spacecraft_number_is_that_of_an_application_process():
    with pytest.raises(ScenarioError, match="spacecraft: must be at least 1 with link = 'pus'"):
        load_software({"link": "pus", "spacecraft": 0})
    with pytest.raises(ScenarioError, match=r"link: .*'historical', 'protected'.* 'pus'"):
        load_software({"link": "PUS"})
