"""PUS-C: the bits are those of spacepackets; every packet makes the round trip."""

import struct

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from packet_cases import some_bytes
from packet_strategies import any_fields
from pus_ends import APID, SATELLITE, SOURCE, UPLINK, answer, judged, process, reframed, stamp, user
from spacepackets.ccsds.spacepacket import SpacePacketHeader
from spacepackets.ccsds.time import CdsShortTimestamp
from spacepackets.ecss import PacketFieldEnum, PusTc, PusTm, RequestId
from spacepackets.ecss.pus_1_verification import (
    FailureNotice,
    ManagedParamsVerification,
    Service1Tm,
    VerificationParams,
)
from spacepackets.ecss.pus_17_test import Service17Tm
from spacepackets.ecss.tm import ManagedParams

from torquer.flight.packets.dictionary import Dictionary, Field, Packet
from torquer.flight.packets.document import document
from torquer.flight.packets.fields import MOST_BYTES
from torquer.flight.packets.frames import ALARM, INFO, STATUS, Stream, Uplink
from torquer.flight.packets.protected import COMMAND_BYTES
from torquer.flight.packets.pus_profile import DONE, WAITING
from torquer.flight.packets.reasons import Reason
from torquer.flight.packets.space_packets import cds, read_cds

every_command = pytest.mark.parametrize("packet", SATELLITE.up.values(), ids=SATELLITE.up)
every_telemetry = pytest.mark.parametrize("packet", SATELLITE.down.values(), ids=SATELLITE.down)
PARAMETERS = {"get_parameter": 1, "set_parameter": 3}
TIMES = st.integers(1, 2**32 - 1)


def telecommand(service, subtype, data=b"", count=0, ack=0b1001, source=SOURCE):
    """A telecommand packet by another package."""
    made = PusTc(
        service, subtype, apid=APID, app_data=data, seq_count=count, source_id=source, ack_flags=ack
    )
    return bytes(made.pack())


def telemetry(service, subtype, data, time_s, count=0, counter=0, destination=0):
    """A telemetry packet by another package."""
    made = PusTm(
        service,
        subtype,
        timestamp=stamp(time_s),
        source_data=data,
        apid=APID,
        seq_count=count,
        message_counter=counter,
        destination_id=destination,
    )
    return bytes(made.pack())


def requested(packet, data, count=0):
    """The telecommand of a command's packed data, by another package and the profile's page."""
    ack = 0b1001 if data[0] else 0
    if packet.name == "plan_clear":
        return telecommand(11, 3, b"", count, ack)
    if packet.name == "plan_cancel":
        wanted = bytes([data[4] & 7, data[3], data[2] & 0x3F, data[1]])
        return telecommand(11, 5, b"\x01" + SOURCE.to_bytes(2, "big") + wanted, count, ack)
    if packet.name in PARAMETERS:
        return telecommand(20, PARAMETERS[packet.name], b"\x01" + data[1:], count, ack)
    return telecommand(8, 1, bytes([packet.id]) + data[1:], count, ack)


def module_of(packet):
    return SATELLITE.modules[packet.module]


@pytest.mark.verifies("REQ-PUS-001", "REQ-PUS-002")
@every_command
def test_another_package_writes_the_same_telecommands(packet):
    ground, board, rng = user(), process(), np.random.default_rng(packet.id)
    for number in range(5):
        data = bytes([number % 2]) + some_bytes(packet, rng)[1:]
        frame = reframed(packet, 0, module_of(packet), data)
        made = ground.request(frame)
        assert made == requested(packet, data, count=number)
        (found,) = judged(board, made)
        (sent,) = Stream(SATELLITE, "up").feed(frame)
        assert found.values == (1, *sent.values[1:])
        assert (found.packet, found.module, found.time_s) == (packet, sent.module, 0)


@pytest.mark.verifies("REQ-PUS-001", "REQ-PUS-004")
@every_command
def test_another_package_writes_the_same_insertions_into_the_schedule(packet):
    rng = np.random.default_rng(packet.id)
    data = b"\x01" + some_bytes(packet, rng)[1:]
    time_s = int(rng.integers(1, 2**31))
    made = user().request(reframed(packet, time_s, module_of(packet), data))
    inner = requested(packet, data, count=1)
    assert made == telecommand(11, 4, b"\x01" + stamp(time_s) + inner)
    (found,) = judged(process(), made)
    assert (found.packet, found.time_s, found.raw) == (packet, time_s, inner)


@pytest.mark.verifies("REQ-PUS-001", "REQ-PUS-002")
@every_telemetry
@pytest.mark.parametrize("status", STATUS)
def test_another_package_writes_the_same_telemetry(packet, status):
    """What is not one of the services' own messages goes as housekeeping."""
    board, ground, rng = process(), user(), np.random.default_rng(packet.id)
    for count in range(3):
        data, time_s = some_bytes(packet, rng), int(rng.integers(2**31))
        if packet.name == "event":
            data = data[:1] + bytes([Reason.WATCHDOG]) + data[2:]
        frame = reframed(packet, time_s, status, data)
        (made,) = board.reports([frame], 0)
        kind, content = (3, 25), struct.pack(">H", status << 8 | packet.id) + data
        if (packet.name, status) == ("event", ALARM):
            kind, content = (5, 4), bytes([Reason.WATCHDOG]) + data
        if (packet.name, status) == ("parameter", INFO):
            kind, content = (20, 2), b"\x01" + data
        assert made == telemetry(*kind, content, time_s, count, count)
        (found,) = ground.feed(made)
        (whole,) = Stream(SATELLITE, "down").feed(frame)
        assert found == whole or any(value != value for value in whole.values)
        assert found.raw == frame


@pytest.mark.verifies("REQ-PUS-001")
def test_another_package_reads_the_headers():
    made = user().request(UPLINK.frame("automatic", 0, (1, 1)))
    header = SpacePacketHeader.unpack(made)
    assert (header.apid, header.seq_count, header.packet_len) == (APID, 0, len(made))
    assert header.ccsds_version == 0 and header.sec_header_flag and header.packet_type == 1
    read = PusTc.unpack(made)  # checks the CRC
    assert (read.service, read.message_subtype, read.source_id) == (8, 1, SOURCE)
    (report,) = process().reports([reframed(SATELLITE.down["beacon"], 5, INFO, bytes(8))], 0)
    read = PusTm.unpack(report, timestamp_len=7)
    assert (read.service, read.message_subtype, read.tm_data) == (3, 25, b"\x00\x01" + bytes(8))


@pytest.mark.verifies("REQ-PUS-001", "REQ-PUS-003")
@pytest.mark.parametrize(
    ("code", "answered", "expected"),
    [
        (Reason.DONE, Reason.DONE, [1, 7]),
        (Reason.DONE, Reason.MODE, [1, 8]),
        (Reason.QUEUE_FULL, None, [2]),
    ],
)
def test_another_package_reads_the_reports_on_requests(code, answered, expected):
    board, packet = process(), telecommand(8, 1, bytes([18, 1]), count=1234, source=500)
    (frame,) = judged(board, packet, code)
    found = board.reports([], 9)
    found += [] if answered is None else board.reports([answer(frame, answered)], 0)
    failure = answered or code
    for count, (report, subtype) in enumerate(zip(found, expected, strict=True)):
        notice = FailureNotice(PacketFieldEnum(8, failure), b"") if subtype % 2 == 0 else None
        theirs = Service1Tm(
            APID,
            subtype,
            stamp(9),
            VerificationParams(RequestId.from_pus_tc(PusTc.unpack(packet)), failure_notice=notice),
            seq_count=count,
            destination_id=500,
        )
        assert report == bytes(theirs.pack())
        read = Service1Tm.unpack(report, ManagedParams(7), ManagedParamsVerification(1, 1))
        assert read.tc_req_id.pack() == packet[:4]
        assert not read.has_failure_notice or read.error_code.val == failure


@pytest.mark.verifies("REQ-PUS-001", "REQ-PUS-006")
def test_another_package_asks_whether_we_are_alive():
    ground, board = user(), process()
    made = ground.ping()
    assert made == telecommand(17, 1, ack=0)
    assert list(board.feed(made)) == []
    (alive,) = board.reports([], 9)
    theirs = Service17Tm(APID, 2, stamp(9), destination_id=SOURCE)
    assert alive == bytes(theirs.pack())
    assert list(ground.feed(alive)) == [] and ground.pings_answered == 1
    list(board.feed(telecommand(17, 1, ack=0b1001)))
    subtypes = [PusTm.unpack(each, 7) for each in board.reports([], 9)]
    assert [(tm.service, tm.message_subtype) for tm in subtypes] == [(1, 1), (17, 2), (1, 7)]


@pytest.mark.verifies("REQ-PUS-001")
@pytest.mark.parametrize("reason", Reason)
def test_each_event_has_a_severity(reason):
    event = bytes([1, reason]) + bytes(12)
    (made,) = process().reports([reframed(SATELLITE.down["event"], 1, ALARM, event)], 0)
    read = PusTm.unpack(made, 7)
    assert (read.service, read.message_subtype) == (5, reason.severity)
    assert read.tm_data == bytes([reason]) + event


def test_an_event_of_a_user_without_a_severity_is_low():
    event = bytes([1, 200]) + bytes(12)
    (made,) = process().reports([reframed(SATELLITE.down["event"], 1, ALARM, event)], 0)
    assert PusTm.unpack(made, 7).message_subtype == 2


def test_codes_with_their_own_messages_are_those_of_the_software():
    assert (DONE, WAITING) == (Reason.DONE, Reason.WAITING)


@pytest.mark.verifies("REQ-PUS-001")
@settings(deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_times_are_those_of_another_package_until_its_days_end(time_s):
    assert read_cds(cds(time_s)) == (time_s, 0)
    if time_s < 4_021_315_200:  # 2137-06-07, when 16 bits of days since 1958 end
        assert cds(time_s) == stamp(time_s)
        theirs = CdsShortTimestamp.unpack(cds(time_s))
        assert theirs.as_unix_seconds() == 1_262_304_000 + time_s


@pytest.mark.parametrize(("time_s", "released_s"), [(0, 1), (100, 100), (100.25, 101)])
def test_release_times_are_rounded_up_and_never_mean_at_once(time_s, released_s):
    inner = telecommand(8, 1, bytes([18, 1]))
    (found,) = judged(process(), telecommand(11, 4, b"\x01" + stamp(time_s) + inner))
    assert found.time_s == released_s


@pytest.mark.verifies("REQ-PUS-001")
def test_counts_wrap_and_message_counters_are_by_type_and_destination():
    board, beacon = process(), SATELLITE.down["beacon"]
    board._count, board._counters = 2**14 - 1, {(3, 25, 0): 2**16 - 1}
    frame = reframed(beacon, 1, INFO, bytes(8))
    made = [PusTm.unpack(each, 7) for each in board.reports([frame] * 2, 0)]
    assert [tm.seq_count for tm in made] == [2**14 - 1, 0] and board._count == 1
    assert [tm.pus_tm_sec_header.message_counter for tm in made] == [2**16 - 1, 0]
    for source in (1, 2, 1):
        list(board.feed(telecommand(17, 1, ack=0, source=source)))
    made = [PusTm.unpack(each, 7).pus_tm_sec_header for each in board.reports([], 0)]
    assert [(tm.dest_id, tm.message_counter) for tm in made] == [(1, 0), (2, 0), (1, 1)]
    for source in range(1000):
        list(board.feed(telecommand(17, 1, ack=0, source=source)))
        board.reports([], 0)
    assert len(board._counters) == board.MOST_COUNTERS


def test_counts_of_a_station_wrap():
    ground = user()
    ground._count = 2**14 - 1
    frame = UPLINK.frame("automatic", 5, (1, 1))
    read = PusTc.unpack(ground.request(frame))
    assert read.seq_count == 2**14 - 1 and PusTc.unpack(read.app_data[8:]).seq_count == 0


def test_longest_command_fits_a_link_frame_even_if_delayed():
    field = Field(name="data", type="bytes", count=MOST_BYTES - 1, description="all there is")
    first = SATELLITE.up["odd"].fields[0]
    longest = Packet(
        name="odd", id=1, description="as long as can be", module="adc", fields=(first, field),
    )  # fmt: skip
    made = user().request(reframed(longest, 7, 27, bytes(MOST_BYTES)))
    assert len(made) == COMMAND_BYTES - 1


NAMES = st.sampled_from(
    ["acknowledgement", "event", "parameter", "set_parameter", "get_parameter", "alpha", "beta"]
)


@st.composite
def dictionaries(draw):
    """Dictionaries of users: any packets, known names with their own or other fields."""
    found = {}
    for direction in ("down", "up"):
        packets = {}
        for number in draw(st.sets(st.integers(1, 255), min_size=1, max_size=5)):
            name = draw(NAMES.filter(lambda name, packets=packets: name not in packets))
            own = getattr(SATELLITE, direction).get(name)
            if own and draw(st.booleans()):
                packets[name] = own.model_copy(update={"id": number})
                continue
            fields = draw(any_fields())
            if direction == "up":
                fields.insert(0, Field(name="acknowledge", type="u8", description="any"))
            packets[name] = Packet(
                name=name, id=number, description="any", module="svr" * (direction == "up"),
                fields=tuple(fields),
            )  # fmt: skip
        found[direction] = packets
    return Dictionary(name="any", modules=SATELLITE.modules, **found)


@pytest.mark.verifies("REQ-PUS-002")
@settings(max_examples=60, deadline=None)
@given(dictionaries(), st.data())
def test_every_packet_of_any_dictionary_makes_the_round_trip(dictionary, data):
    board, ground = process(dictionary), user(dictionary)
    up, down = Stream(dictionary, "up"), Stream(dictionary, "down")
    for packet in dictionary.up.values():
        time_s = data.draw(st.just(0) | TIMES)
        packed = b"\x01" + data.draw(st.binary(min_size=packet.size - 1, max_size=packet.size - 1))
        frame = reframed(packet, time_s, dictionary.modules[packet.module], packed)
        (sent,) = list(up.feed(frame)) + list(up.finish())
        (found,) = judged(board, ground.request(frame))
        assert (found.packet, found.time_s, found.module) == sent[:3]
        assert repr(found.values) == repr(sent.values)
    board.reports([], 0)
    for packet in dictionary.down.values():
        status = data.draw(st.sampled_from(STATUS))
        packed = data.draw(st.binary(min_size=packet.size, max_size=packet.size))
        frame = reframed(packet, data.draw(TIMES), status, packed)
        (sent,) = list(down.feed(frame)) + list(down.finish())
        (made,) = board.reports([frame], 0)
        PusTm.unpack(made, 7)
        (found,) = ground.feed(made)
        assert repr(found) == repr(sent)
    assert not board.rejected and not ground.rejected


def test_the_page_of_the_dictionary_names_the_messages():
    """Known by their names and fields only: another `event` is an ordinary packet."""
    page = document(SATELLITE).splitlines()
    for line in (
        "| down `beacon` | TM[3,25], structure ID 1 |",
        "| down `acknowledgement` | TM[1,1], TM[1,2], TM[1,7], TM[1,8] |",
        "| down `event` | TM[5,1] to TM[5,4], event definition ID: its code |",
        "| down `parameter` | TM[20,2] |",
        "| up `set_parameter` | TC[20,3] |",
        "| up `get_parameter` | TC[20,1] |",
        "| up `odd` | TC[8,1], function ID 200 |",
    ):
        assert line in page
    other = SATELLITE.down["odd"].model_copy(update={"name": "event", "id": 4})
    mine = SATELLITE.model_copy(update={"down": {**SATELLITE.down, "event": other}})
    assert "| down `event` | TM[3,25], structure ID 4 |" in document(mine).splitlines()


def test_what_is_no_frame_is_named():
    with pytest.raises(ValueError, match="frame: must have 16 bytes; received 3"):
        user().request(b"\x01\x02\x03")
    assert process().reports([b"junk of a module"[:9]], 0) == []
    assert Uplink(SATELLITE).frame("automatic", 0, (1, 1))[12:14] == bytes(2)


@pytest.mark.parametrize("change", [{"count": 2}, {"scale": 0.5}, {"type": "u8"}, {"name": "no"}])
def test_known_name_with_other_fields_is_an_ordinary_packet(change):
    """Here `index` of get_parameter differs."""
    first, index = SATELLITE.up["get_parameter"].fields
    other = SATELLITE.up["get_parameter"].model_copy(
        update={"fields": (first, index.model_copy(update=change))}
    )
    mine = SATELLITE.model_copy(update={"up": {"get_parameter": other}})
    made = PusTc.unpack(user(mine).request(reframed(other, 0, 1, b"\x01" + bytes(other.size - 1))))
    assert (made.service, made.app_data[0]) == (8, other.id)
