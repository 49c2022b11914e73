"""Reports on requests: to which request an answer belongs, whatever is lost on the way."""

import copy

import pytest
from pus_ends import APID, SATELLITE, UPLINK, answer, judged, key, process, stamp, user
from spacepackets.ecss import PusTc, PusTm

from torquer.flight.packets.dictionary import Dictionary
from torquer.flight.packets.frames import ALARM
from torquer.flight.packets.pus_user import User
from torquer.flight.packets.reasons import Reason

pytestmark = pytest.mark.verifies("REQ-PUS-003")
BOTH, NONE = 0b1001, 0b0000


def telecommand(count, ack=BOTH, packet_id=18, data=b"\x01", source=1):
    made = PusTc(
        8, 1, apid=APID, app_data=bytes([packet_id]) + data, seq_count=count, ack_flags=ack,
        source_id=source,
    )  # fmt: skip
    return bytes(made.pack())


def insertion(*packets, time_s=1000, count=90, ack=BOTH):
    data = bytes([len(packets)]) + b"".join(stamp(time_s) + packet for packet in packets)
    made = PusTc(11, 4, apid=APID, app_data=data, seq_count=count, ack_flags=ack, source_id=1)
    return bytes(made.pack())


def reports(board, *answers):
    """(subtype, sequence count of the request, code or None) of reports of service 1."""
    found = [PusTm.unpack(each, 7) for each in board.reports(list(answers), 0)]
    return [
        (tm.message_subtype, int.from_bytes(tm.tm_data[2:4], "big") & 0x3FFF, *tm.tm_data[4:])
        for tm in found
        if tm.service == 1
    ]


@pytest.mark.parametrize("ack", range(16))
def test_successes_are_reported_if_asked_for_and_failures_always(ack):
    board = process()
    (frame,) = judged(board, telecommand(5, ack))
    assert reports(board) == [(1, 5)] * bool(ack & 8)
    assert reports(board, answer(frame)) == [(7, 5)] * (ack & 1)
    (frame,) = judged(board, telecommand(6, ack))
    reports(board)
    assert reports(board, answer(frame, Reason.MODE)) == [(8, 6, Reason.MODE)]
    judged(board, telecommand(7, ack), Reason.STATE)
    assert reports(board) == [(2, 7, Reason.STATE)]


def test_equal_commands_are_answered_in_their_order():
    board = process()
    first, second = (judged(board, telecommand(count))[0] for count in (5, 6))
    assert reports(board) == [(1, 5), (1, 6)]
    answers = [answer(first, Reason.MODE), answer(second)]
    assert reports(board, *answers) == [(8, 5, Reason.MODE), (7, 6)]


def test_if_answers_are_lost_it_is_the_oldest():
    """A queue of answers drops its oldest: the rest still belongs to the right requests."""
    board = process()
    frames = [judged(board, telecommand(count))[0] for count in (5, 6, 7)]
    reports(board)
    answers = [answer(frames[1], Reason.MODE), answer(frames[2])]
    assert reports(board, *answers) == [(8, 6, Reason.MODE), (7, 7)]
    (frame,) = judged(board, telecommand(8))
    assert reports(board) == [(1, 8)]
    assert reports(board, answer(frame)) == [(7, 8)]


def test_unanswered_command_takes_no_answer_of_a_later_one():
    board = process()
    judged(board, telecommand(5))
    assert reports(board) == [(1, 5)]
    (frame,) = judged(board, telecommand(6))
    assert reports(board) == [(1, 6)]
    assert reports(board, answer(frame), answer(frame)) == [(7, 6)]
    assert reports(board, answer(frame)) == [], "of the first one nothing is kept"


def test_answers_to_different_commands_belong_to_their_requests():
    board, now = process(), [(5, 17, b"\0\1"), (6, 18, b"\1"), (7, 25, b"\1"), (8, 18, b"\0")]
    frames = [judged(board, telecommand(n, packet_id=i, data=data))[0] for n, i, data in now]
    reports(board)
    order = [frames[2], frames[1], frames[0], frames[3]]
    found = reports(board, *(answer(frame, code) for code, frame in enumerate(order)))
    assert found == [(7, 7), (8, 6, 1), (8, 5, 2), (8, 8, 3)]


def test_answer_without_a_request_comes_down_as_housekeeping():
    """Made before the command was on its way, of another status, or a second one."""
    board, ground = process(), user()
    (frame,) = judged(board, telecommand(5))
    assert reports(board, answer(frame)) == [(1, 5)]
    (frame,) = judged(board, telecommand(6))
    assert reports(board) == [(1, 6)]
    alarm = bytearray(answer(frame, Reason.FAILED))
    alarm[9] = ALARM
    assert reports(board, answer(frame), answer(frame), bytes(alarm)) == [(7, 6)]
    sent = answer(frame, Reason.FAILED)
    (made,) = board.reports([sent], 0)
    assert PusTm.unpack(made, 7).service == 3
    assert [found.raw for found in ground.feed(made)] == [sent]


def test_command_dropped_at_once_from_a_full_queue_is_refused():
    board = process()
    (first,) = judged(board, telecommand(5))
    (second,) = judged(board, telecommand(6))
    board.judged(first.raw, key(first), Reason.QUEUE_FULL)
    assert reports(board) == [(2, 5, Reason.QUEUE_FULL), (1, 6)]
    assert reports(board, answer(first)) == []
    assert reports(board, answer(second)) == [(7, 6)]


def test_command_refused_after_its_acceptance_has_failed():
    board = process()
    (frame,) = judged(board, telecommand(5))
    assert reports(board) == [(1, 5)]
    board.judged(frame.raw, key(frame), Reason.STATE)
    assert reports(board) == [(8, 5, Reason.STATE)]


def inserted(board, packet, *codes):
    """Activities judged one by one."""
    codes = iter(codes)
    for frame in board.feed(packet):
        board.judged(frame.raw, key(frame), next(codes))


@pytest.mark.parametrize(
    ("codes", "expected"),
    [
        ([14], [(1, 90), (7, 90)]),
        ([10], [(2, 90, 10)]),
        ([14, 14, 14], [(1, 90), (7, 90)]),
        ([14, 10, 5], [(2, 2, 10), (2, 3, 5), (1, 90), (8, 90, 10)]),
        ([8, 10, 5], [(2, 1, 8), (2, 2, 10), (2, 3, 5), (2, 90, 8)]),
    ],
)
def test_insertions_are_reported_on(codes, expected):
    board = process()
    packets = [telecommand(count) for count in range(1, len(codes) + 1)]
    inserted(board, insertion(*packets), *codes)
    assert reports(board) == expected


def test_an_activity_is_reported_on_when_it_is_released():
    board, packet = process(), telecommand(3)
    (frame,) = judged(board, insertion(packet), Reason.WAITING)
    assert frame.raw == packet and frame.time_s == 1000
    assert reports(board) == [(1, 90), (7, 90)] and not board.waiting
    board.judged(packet, key(frame), Reason.DONE)
    assert board.waiting and reports(board) == [(1, 3)]
    assert reports(board, answer(frame)) == [(7, 3)]


def test_an_activity_whose_time_has_gone_is_executed_at_once():
    board = process()
    (frame,) = judged(board, insertion(telecommand(3)), Reason.DONE)
    assert reports(board) == [(1, 90), (7, 90), (1, 3)]
    assert reports(board, answer(frame)) == [(7, 3)]


def test_insertion_does_not_answer_for_the_command_it_drops():
    board = process()
    (first,) = judged(board, telecommand(3))
    for frame in board.feed(insertion(telecommand(4))):
        board.judged(first.raw, key(first), Reason.QUEUE_FULL)
        board.judged(frame.raw, key(frame), Reason.DONE)
    assert reports(board) == [(2, 3, Reason.QUEUE_FULL), (1, 90), (7, 90), (1, 4)]


def test_copies_go_on_as_the_first():
    board = process()
    (frame,) = judged(board, telecommand(5))
    board.reports([], 0)
    other = copy.deepcopy(board)
    assert other._profile is board._profile
    assert board.reports([answer(frame)], 0) == other.reports([answer(frame)], 0)


def answers(ground, board, *frames):
    """(command id, module, accepted, code, command time) of the acknowledgements on the ground."""
    packets = board.reports(list(frames), 0)
    return [found.values[:5] for packet in packets for found in ground.feed(packet)]


def test_the_ground_has_the_acknowledgements_of_its_commands():
    ground, board = user(), process()
    now, later = UPLINK.frame("hold", 0, (1, 0, 1)), UPLINK.frame("hold", 70, (1, 0, 1))
    (first,) = judged(board, ground.request(now))
    (second,) = judged(board, ground.request(later), Reason.WAITING)
    assert answers(ground, board) == [(17, 1, 0, Reason.WAITING, 70)] and ground.accepted == 2
    assert answers(ground, board, answer(first)) == [(17, 1, 1, Reason.DONE, 0)]
    board.judged(second.raw, key(second), Reason.DONE)
    assert answers(ground, board) == [] and ground.accepted == 3
    done = answers(ground, board, answer(second, Reason.MODE))
    assert done == [(17, 1, 0, Reason.MODE, 70)]
    for frame in (now, later):
        judged(board, ground.request(frame), Reason.LATE)
    assert answers(ground, board) == [(17, 1, 0, Reason.LATE, t) for t in (0, 70)]
    assert ground.unknown_requests == 0 and not ground.rejected


def test_requests_of_others_are_counted_and_shown_without_their_command():
    ground, board = user(), process()
    (frame,) = judged(board, telecommand(5))
    assert answers(ground, board) == [] and ground.accepted == 1
    assert answers(ground, board, answer(frame)) == [(0, 0, 1, Reason.DONE, 0)]
    judged(board, telecommand(6), Reason.STATE)
    assert answers(ground, board) == [(0, 0, 0, Reason.STATE, 0)]
    assert ground.unknown_requests == 2


def test_same_id_request_of_another_user_is_not_ours():
    ground, board = user(), process()
    ours = ground.request(UPLINK.frame("hold", 0, (1, 0, 1)))
    judged(board, telecommand(0, source=2), Reason.STATE)
    assert answers(ground, board) == [(0, 0, 0, Reason.STATE, 0)]
    judged(board, ours, Reason.MODE)
    assert answers(ground, board) == [(17, 1, 0, Reason.MODE, 0)]


def test_only_so_many_requests_are_remembered():
    ground = user()
    for _ in range(20_000):
        ground.request(UPLINK.frame("automatic", 0, (1, 1)))
    assert len(ground._sent) == User.MOST_SENT
    assert list(ground._sent.values())[-1].id == 18


def test_a_dictionary_without_acknowledgements_has_none():
    down = {"beacon": SATELLITE.down["beacon"]}
    dictionary = Dictionary(
        name="mute", modules=SATELLITE.modules, down=down, up={"hold": SATELLITE.up["hold"]}
    )
    ground, board = user(dictionary), process(dictionary)
    judged(board, ground.request(UPLINK.frame("hold", 0, (1, 0, 1))), Reason.STATE)
    (packet,) = board.reports([], 0)
    assert list(ground.feed(packet)) == [] and not ground.rejected
