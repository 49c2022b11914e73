"""The plan on board beside that on the ground: matched, and what differs is marked."""

from contextlib import closing

import pytest
from archived import commands_on

from torquer.computer.names import Names
from torquer.flight.packets.commands import Sent
from torquer.flight.packets.dictionary import load_dictionary
from torquer.flight.packets.frames import Downlink, Stream
from torquer.flight.packets.reasons import Reason
from torquer.ground.archive import EPOCH_MS, UNCHECKED, Archive, RowMaker, read_only
from torquer.ground.commands import ANSWER_MS
from torquer.ground.plan import compare_plan, has_plan

CHIBIS = load_dictionary("chibis_m")
NAMES = Names({}, (), {}, {}, ())
NOW = 1_800_000_000_000
CLOCK = EPOCH_MS + 100_000
STATUS, RATES = CHIBIS.up["report_status"].id, CHIBIS.up["set_rates"].id


class Bench:
    """An archive with delayed commands and what the satellite reports."""

    def __init__(self, path):
        self.archive, self.now = Archive(path, CHIBIS), NOW
        self.commands = commands_on(self.archive, CHIBIS, NAMES)
        self.maker, self.downlink = RowMaker(CHIBIS), Downlink(CHIBIS)
        self.stream = Stream(CHIBIS, "up")

    def order(self, delay_s, code=Reason.WAITING):
        """The number of a command to module 1 that was answered with a code, None: not."""
        sent = Sent(
            at_s=0.0, command="report_status", values={"module_id": 1}, delay_s=float(delay_s)
        )
        number = self.commands.order(sent, "Ada", self.now, CLOCK)["id"]
        for each, frame in self.commands.due(self.now):
            (found,) = self.stream.feed(frame)
            self.commands.sent(each, self.now)
        if code is not None:
            self.answer(found, code)
        return number

    def answer(self, frame, code):
        self.commands.answered({
            "command_id": frame.packet.id, "module_id": frame.module, "accepted": int(not code),
            "code": int(code), "command_time": frame.time_s, "request": frame.request,
        }, self.now)  # fmt: skip

    def report(self, *entries, size=None, time_s=100):
        """The satellite lists (request, execute_s) of report_status, or with the id of a packet."""
        listed = [(*each, STATUS)[:3] for each in entries] or [None]
        size = len(entries) if size is None else size
        rows = []
        for place, each in enumerate(listed):
            values = (0,) * 6
            if each is not None:
                request, execute_s, packet = each
                values = (size, place, request, packet, 9, execute_s)
            (frame,) = Stream(CHIBIS, "down").feed(self.downlink.frame("plan", time_s, values))
            rows.append(self.maker.row(frame, self.now, UNCHECKED))
        self.archive.put(rows)

    def plan(self):
        with closing(read_only(self.archive.path)) as db:
            return compare_plan(db, CHIBIS)

    def marks(self):
        return [(each["id"], each["mark"]) for each in self.plan()["entries"]]


@pytest.fixture
def bench(tmp_path):
    made = Bench(tmp_path / "sat.sqlite")
    with closing(made.archive):
        yield made


def test_without_a_report_nothing_is_said_of_the_board(bench):
    number = bench.order(60)
    found = bench.plan()
    assert (found["reported_ms"], found["is_complete"]) == (None, False)
    assert bench.marks() == [(number, "not reported yet")]


def test_what_is_on_both_sides_or_on_one(bench):
    first, second = bench.order(60), bench.order(90)
    bench.now += 1000
    bench.report((first, 160), (700, 170), (first, 180), (second, 190, RATES))
    found = bench.plan()
    assert (found["reported_ms"], found["is_complete"]) == (bench.now, True)
    assert [(e["id"], e["mark"], e["request"]) for e in found["entries"]] == [
        (first, "as sent", first),
        (None, "on board only", 700),
        (None, "on board only", first),  # our number, at another time
        (None, "on board only", second),  # our number and time, another command
        (second, "on ground only", second),
    ]
    assert found["entries"][0]["values"] == {"module_id": 1}
    assert found["entries"][1]["command"] == "report_status"
    assert found["entries"][3]["execute_ms"] == EPOCH_MS + 190_000


def test_an_empty_report_says_that_nothing_waits_on_board(bench):
    number = bench.order(60)
    bench.now += 1000
    bench.report()
    found = bench.plan()
    assert found["is_complete"] and found["reported_ms"] == bench.now
    assert bench.marks() == [(number, "on ground only")]


def test_a_report_cannot_list_what_came_after_it(bench):
    bench.report()
    bench.now += 1000
    assert bench.marks() == []
    number = bench.order(60)
    assert bench.marks() == [(number, "not reported yet")]


def test_half_a_report_does_not_say_what_is_missing(bench):
    first, second = bench.order(60), bench.order(90)
    bench.now += 1000
    bench.report((first, 160), size=2)
    assert not bench.plan()["is_complete"]
    assert bench.marks() == [(first, "as sent"), (second, "not reported yet")]


def test_only_the_last_report_counts(bench):
    first, second = bench.order(60), bench.order(90)
    bench.now += 1000
    bench.report((first, 160), (second, 190))
    bench.now += 1000
    bench.report((second, 190), time_s=101)
    assert bench.marks() == [(first, "on ground only"), (second, "as sent")]


def test_what_is_over_since_the_report_or_should_not_be_there(bench):
    taken_out = bench.order(50, Reason.CANCELLED)
    done = bench.order(60)
    bench.now += 1000
    bench.report((taken_out, 150), (done, 160))
    assert bench.marks() == [(taken_out, "on board only"), (done, "as sent")]
    bench.now += 1000
    frame = CHIBIS.up["report_status"]
    bench.commands.answered({
        "command_id": frame.id, "module_id": 1, "accepted": 1, "code": 0, "command_time": 160,
        "request": done,
    }, bench.now)  # fmt: skip
    assert bench.marks() == [(taken_out, "on board only"), (done, "over since")]


def test_one_that_was_not_answered_may_be_on_board(bench):
    number = bench.order(60, None)
    bench.now += ANSWER_MS + 1
    bench.commands.expire(bench.now, CLOCK)
    assert bench.marks() == []
    bench.report((number, 160))
    (entry,) = bench.plan()["entries"]
    assert (entry["mark"], entry["state"]) == ("as sent", "unanswered")


def test_numbers_that_are_not_ours_are_matched_by_command_and_time(bench):
    """As with PUS, whose plan names the numbers of telecommands."""
    first, second = bench.order(60), bench.order(60)
    bench.now += 1000
    bench.report((0x1812_C003, 160), (0x1812_C004, 160), (0x1812_C005, 160))
    assert {mark for _, mark in bench.marks()} == {"as sent", "on board only"}
    assert {number for number, _ in bench.marks()} == {first, second, None}


def test_which_dictionaries_have_a_plan():
    assert has_plan(CHIBIS)
    plan = CHIBIS.down["plan"]
    other = plan.model_copy(update={"fields": plan.fields[1:]})
    for less in ({"down": CHIBIS.down | {"plan": other}}, {"up": {}}, {"down": {}}):
        assert not has_plan(CHIBIS.model_copy(update=less))
