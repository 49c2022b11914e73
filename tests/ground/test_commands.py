"""Commands from order to answer: states, order, answers that are late, a ground that restarts."""

import sqlite3
from contextlib import closing

import pytest
from archived import commands_on

from torquer.base.explain import ScenarioError
from torquer.computer.names import Names
from torquer.flight.packets.commands import Sent
from torquer.flight.packets.dictionary import load_dictionary
from torquer.flight.packets.frames import Stream
from torquer.flight.packets.reasons import Reason
from torquer.ground.archive import EPOCH_MS, Archive, read_only
from torquer.ground.commands import (
    ANSWER_MS,
    LATEST_MS,
    MOST_OPEN,
    Commands,
    last_commands,
    list_commands,
)

CHIBIS = load_dictionary("chibis_m")
NAMES = Names({"modes": (0, {"idle": 0, "science": 1})}, ("low",), {"bdot.gain": (0, 1)}, {}, ())
NOW = 1_800_000_000_000
#: The satellite's clock, a hundred seconds after the beginning of on-board time.
CLOCK = EPOCH_MS + 100_000


class Bench:
    """Commands on an archive, with a satellite's answers."""

    def __init__(self, path, dictionary=CHIBIS):
        self.archive = Archive(path, dictionary)
        self.commands = commands_on(self.archive, dictionary, NAMES)
        self.stream = Stream(dictionary, "up")

    def order(self, command="automatic", at_s=0.0, now=NOW, clock=CLOCK, **keys):
        values = keys.pop("values", {"on": 1} if command == "automatic" else {})
        sent = Sent(at_s=at_s, command=command, values=values, **keys)
        return self.commands.order(sent, "test", now, clock)["id"]

    def send(self, now=NOW, until_s=None):
        """Send what is due; the frames as the satellite finds them, by number of the command."""
        found = {}
        for number, frame in self.commands.due(now, until_s):
            (found[number],) = self.stream.feed(frame)
            self.commands.sent(number, now)
        return found

    def answer(self, frame, code=Reason.DONE, now=NOW):
        values = {
            "command_id": frame.packet.id,
            "module_id": frame.module,
            "accepted": int(code == Reason.DONE),
            "code": int(code),
            "command_time": frame.time_s,
            "request": frame.request,
        }
        return self.commands.answered(values, now)

    def state(self, number):
        return self.commands.shown(number)["state"]


@pytest.fixture
def bench(tmp_path):
    made = Bench(tmp_path / "sat.sqlite")
    with closing(made.archive):
        yield made


@pytest.fixture
def unnumbered(tmp_path):
    """A satellite whose answers do not name a command by its number."""
    packet = CHIBIS.down["acknowledgement"]
    answers = packet.model_copy(update={"fields": packet.fields[:-1]})
    down = CHIBIS.down | {"acknowledgement": answers}
    made = Bench(tmp_path / "sat.sqlite", CHIBIS.model_copy(update={"down": down}))
    with closing(made.archive):
        yield made


def test_commands_awaiting_answers_never_exceed_the_satellite_queue(bench):
    numbers = [
        bench.order("report_status", values={"module_id": 1}, delay_s=s) for s in range(1, 16)
    ]
    quiet = bench.order("automatic", acknowledge=False)
    sent = bench.send()
    assert [*sent] == numbers[:10] and not bench.send()
    bench.answer(sent[numbers[3]], Reason.WAITING)
    bench.answer(sent[numbers[7]])
    assert [*bench.send()] == numbers[10:12] and not bench.send()
    bench.commands.expire(NOW + ANSWER_MS + 1, CLOCK)
    assert [*bench.send(NOW + ANSWER_MS + 1)] == [*numbers[12:], quiet]


def test_from_order_to_execution(bench):
    number = bench.order("set_mode", values={"region": "modes", "state": "science"})
    assert bench.state(number) == "waiting"
    frame = bench.send(NOW + 1)[number]
    assert (frame.packet.name, frame.values, frame.time_s) == ("set_mode", (1, 0, 1), 0)
    assert bench.state(number) == "sent" and not bench.send()
    bench.answer(frame, now=NOW + 7)
    shown = bench.commands.shown(number)
    assert (shown["state"], shown["sent_ms"], shown["answered_ms"]) == (
        "executed",
        NOW + 1,
        NOW + 7,
    )
    assert shown["values"] == {"region": "modes", "state": "science"}


def test_a_refusal_has_its_reason(bench):
    number = bench.order()
    bench.answer(bench.send()[number], Reason.MODE)
    shown = bench.commands.shown(number)
    assert (shown["state"], shown["reason"]) == ("refused", Reason.MODE.doc)


def test_a_delayed_command_is_received_then_executed(bench):
    number = bench.order(delay_s=60.0)
    frame = bench.send()[number]
    assert frame.time_s == 160
    assert bench.commands.shown(number)["execute_ms"] == CLOCK + 60_000
    bench.answer(frame, Reason.WAITING)
    assert bench.state(number) == "received"
    assert not bench.commands.expire(NOW + 10 * ANSWER_MS, CLOCK + 60_000)
    bench.answer(frame)
    assert bench.state(number) == "executed"


def test_a_delayed_command_that_is_never_executed(bench):
    number = bench.order(delay_s=60.0)
    bench.answer(bench.send()[number], Reason.WAITING)
    assert not bench.commands.expire(NOW, None)
    (late,) = bench.commands.expire(NOW, CLOCK + 60_001 + ANSWER_MS)
    assert (late["id"], late["state"]) == (number, "unanswered")


def test_delays_need_the_satellites_clock(bench):
    with pytest.raises(ScenarioError, match="delay_s: must be left out until telemetry shows"):
        bench.order(delay_s=60.0, clock=None)
    assert bench.send() == {}


def test_without_an_acknowledgement_nothing_is_known_after_sending(bench):
    number = bench.order(acknowledge=False)
    frame = bench.send()[number]
    assert frame.values == (0, 1)
    assert not bench.commands.expire(NOW + 10 * ANSWER_MS, None)
    assert bench.state(number) == "sent"


def test_no_answer_in_time_and_then_a_late_one(bench):
    number = bench.order()
    frame = bench.send()[number]
    assert not bench.commands.expire(NOW + ANSWER_MS, None)
    (late,) = bench.commands.expire(NOW + ANSWER_MS + 1, None)
    assert (late["id"], late["state"]) == (number, "unanswered")
    assert bench.answer(frame, now=NOW + 2 * ANSWER_MS)["state"] == "executed"


def test_an_answer_that_may_be_anothers_says_so(unnumbered):
    bench = unnumbered
    first = bench.order()
    frame = bench.send()[first]
    bench.commands.expire(NOW + ANSWER_MS + 1, None)
    second = bench.order(now=NOW + 2 * ANSWER_MS)
    assert second in bench.send(NOW + 2 * ANSWER_MS)
    answered = bench.answer(frame, now=NOW + 2 * ANSWER_MS + 5)
    assert answered["id"] == second
    assert answered["reason"] == f"or the late answer to command {first}"
    # long after it was sent nobody thinks of the first one any more
    third = bench.order(now=NOW + 2 * LATEST_MS)
    frame = bench.send(NOW + 2 * LATEST_MS)[third]
    assert bench.answer(frame, now=NOW + 2 * LATEST_MS)["reason"] == ""


def test_without_numbers_equal_commands_never_overlap_and_hold_back_no_other(unnumbered):
    bench = unnumbered
    first, equal, other = bench.order(), bench.order(), bench.order("coils_automatic")
    frames = bench.send()
    assert [*frames] == [first, other]
    bench.answer(frames[first])
    assert [*bench.send()] == [equal]


def test_two_commands_of_one_second_and_another_go_up_at_once(bench):
    values = {"index": "bdot.gain", "value": 1.0}
    plan = [bench.order("set_parameter", values=values, delay_s=600.0) for _ in range(2)]
    other = bench.order("report_status", values={"module_id": 3})
    frames = bench.send()
    assert [*frames] == [*plan, other]
    assert len({frame.request for frame in frames.values()}) == 3
    bench.answer(frames[plan[1]], Reason.WAITING)
    assert [bench.state(number) for number in plan] == ["sent", "received"]
    bench.answer(frames[plan[1]], Reason.MODE)
    bench.answer(frames[plan[0]])
    assert [bench.state(number) for number in plan] == ["executed", "refused"]


def test_a_late_answer_is_known_by_its_number(bench):
    first = bench.order()
    frame = bench.send()[first]
    bench.commands.expire(NOW + ANSWER_MS + 1, None)
    second = bench.order(now=NOW + 2 * ANSWER_MS)
    bench.send(NOW + 2 * ANSWER_MS)
    assert bench.answer(frame, now=NOW + 2 * ANSWER_MS)["id"] == first
    assert (bench.state(first), bench.state(second)) == ("executed", "sent")
    assert bench.answer(frame._replace(request=0)) is None, "of somebody else's command"


def test_commands_state_the_last_second_to_receive_them(bench):
    number = bench.order()
    assert bench.send(NOW, 65536.0 * 3 + 17.4)[number].valid_until == 17
    number = bench.order()
    assert bench.send(NOW)[number].valid_until == 0, "no clock is known"


def test_a_command_that_was_not_sent_is_cancelled(bench):
    number = bench.order(at_s=60.0)
    assert bench.commands.cancel(number, "test", NOW)["state"] == "cancelled"
    assert bench.send(NOW + 10**6) == {}


def test_a_command_on_board_is_cancelled_by_its_number(bench):
    number = bench.order(delay_s=600.0)
    frame = bench.send()[number]
    bench.answer(frame, Reason.WAITING)
    ordered = bench.commands.cancel(number, "test", NOW)
    assert ordered["command"] == "plan_cancel" and ordered["values"] == {"request": frame.request}
    cancel = bench.send()[ordered["id"]]
    bench.answer(frame, Reason.CANCELLED)
    bench.answer(cancel)
    assert bench.commands.shown(number)["state"] == "cancelled"
    assert bench.state(ordered["id"]) == "executed"


def test_what_waits_nowhere_cannot_be_cancelled(bench):
    number = bench.order()
    bench.answer(bench.send()[number])
    for wrong, received in ((number, "one that is executed"), (99, "a number that no command")):
        with pytest.raises(
            ScenarioError, match=f"must wait here or on board.*; received {received}"
        ):
            bench.commands.cancel(wrong, "test", NOW)


def test_commands_wait_for_their_times(bench):
    late, soon = bench.order(at_s=10.0), bench.order("coils_automatic", at_s=0.5)
    assert bench.send(NOW + 499) == {}
    assert [*bench.send(NOW + 500)] == [soon]
    assert [*bench.send(NOW + 10_000)] == [late]


def test_an_answer_to_nothing_changes_nothing(bench):
    number = bench.order()
    frame = bench.send()[number]
    assert bench.answer(frame._replace(time_s=55)) is None
    assert bench.answer(frame)["state"] == "executed"
    assert bench.answer(frame) is None


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"command": "set_mod"}, "command: must be one of .*did you mean set_mode"),
        ({"command": "set_mode", "values": {"region": "modes"}}, "values.state: must be given"),
        ({"values": {"on": 300}}, "values.on: must be a whole number from 0 to 255"),
        ({"values": {"on": "MAYBE"}}, "values.on: must be one of OFF, ON; received 'MAYBE'"),
        ({"values": {"off": 1}}, "values.off: must be a field of automatic: on"),
    ],
)
def test_unsendable_command_gets_one_line_and_is_not_kept(bench, keys, message):
    with pytest.raises(ScenarioError, match=message) as refused:
        bench.order(**keys)
    assert "\n" not in str(refused.value)
    with closing(read_only(bench.archive.path)) as db:
        assert list_commands(db, 10) == []


def test_not_more_wait_than_there_is_room_for(bench):
    for _ in range(MOST_OPEN):
        bench.order()
    with pytest.raises(ScenarioError, match=f"fewer than {MOST_OPEN}"):
        bench.order()


def test_of_more_than_there_is_room_for_none_is_taken(bench):
    bench.order()
    sent = Sent(at_s=0.0, command="automatic", values={"on": 1})
    bench.commands.check([sent] * (MOST_OPEN - 1), CLOCK)
    with pytest.raises(ScenarioError, match=f"fewer than {MOST_OPEN}"):
        bench.commands.check([sent] * MOST_OPEN, CLOCK)


def test_an_acknowledgement_with_other_fields_answers_nothing():
    own = CHIBIS.down["acknowledgement"].model_copy(update={"fields": CHIBIS.down["ready"].fields})
    other = CHIBIS.model_copy(update={"down": CHIBIS.down | {"acknowledgement": own}})
    commands = Commands(other, NAMES, lambda command: None, lambda: None)
    assert commands.answered(dict.fromkeys(own.names, 1), NOW) is None


def test_a_ground_that_restarts(bench, tmp_path):
    done, sent, late, waiting = (bench.order(at_s=s) for s in (0.0, 1.0, 2.0, 99.0))
    frames = bench.send(NOW)
    bench.answer(frames[done])
    frames |= bench.send(NOW + 1000)
    bench.archive.close()
    again = Bench(tmp_path / "sat.sqlite")
    with closing(again.archive):
        states = {number: again.state(number) for number in (done, sent, late, waiting)}
        assert states == {done: "executed", sent: "sent", late: "cancelled", waiting: "cancelled"}
        assert again.send(NOW + 10**6) == {}, "nothing is sent that nobody has asked for now"
        assert again.answer(frames[sent])["state"] == "executed"


def test_a_command_is_executed_at_a_time(bench):
    number = bench.order(at="2010-01-01T00:03:20.5Z")
    assert bench.send()[number].time_s == 201
    assert bench.commands.shown(number)["execute_ms"] == EPOCH_MS + 201_000
    unknown = bench.order(at="2010-01-01T00:03:20Z", clock=None)
    assert bench.send()[unknown].time_s == 200


@pytest.mark.parametrize("clock", [CLOCK, 2**53])
@pytest.mark.parametrize("at_s", [0.0, 1e6])
def test_a_time_that_is_over_gets_one_line(bench, clock, at_s):
    at = "2010-01-01T00:01:40Z"
    with pytest.raises(ScenarioError, match="at: must be after the satellite's clock") as refused:
        bench.order(at=at, clock=clock, at_s=at_s)
    assert "\n" not in str(refused.value)


def test_a_clock_that_was_set_back_between_two_grounds_keeps_nobody_waiting(bench, tmp_path):
    number = bench.order()
    bench.send(NOW)
    bench.archive.close()
    again, now = Bench(tmp_path / "sat.sqlite"), NOW - 86_400_000
    with closing(again.archive):
        assert again.commands.expire(now, None) == []
        (late,) = again.commands.expire(now + ANSWER_MS + 1, None)
        assert (late["id"], late["state"]) == (number, "unanswered")


@pytest.mark.parametrize("values", ["{", "[1]", "7", None, b"\xff"])
def test_a_stored_command_that_is_damaged_is_left_out(bench, tmp_path, values):
    number, other = bench.order(), bench.order()
    bench.archive.close()
    with closing(sqlite3.connect(tmp_path / "sat.sqlite")) as db:
        db.execute("PRAGMA ignore_check_constraints = 1")
        db.execute('UPDATE _commands SET "values" = ? WHERE id = ?', (values or "", number))
        db.commit()
    with closing(Bench(tmp_path / "sat.sqlite").archive) as archive:
        assert [row["id"] for row in last_commands(archive.read)] == [other]
