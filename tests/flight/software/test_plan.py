"""The plan of delayed commands: kept over reboots, executed once, listed, cancelled; numbers."""

import pytest
from onboard_ground import Ground, flown, flying, grounded, scenario
from spoiled_memory import spoil

from torquer.compile import engine
from torquer.flight.packets.frames import last_second, seconds_late
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.memory import Memory
from torquer.flight.software.plan import PLAN
from torquer.flight.software.state import Cause

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


@pytest.fixture(scope="module")
def begun():
    return flown(scenario(900.0))


@pytest.fixture
def ground(begun):
    return grounded(*begun)


def now_s(ground):
    return ground.core.state.clock.now_s


def answers(found):
    """(request, code) of acknowledgements."""
    return [(v["request"], v["code"]) for n, _, v in found if n == "acknowledgement"]


def planned(ground, *by_s, first=1):
    """Shifts of the clock by 10 ms, 20 ms.. in so many seconds, with numbers from `first`."""
    frames = [
        ground.frame("shift_clock", 10 * (k + 1), time_s=now_s(ground) + after, request=first + k)
        for k, after in enumerate(by_s)
    ]
    return ground.tick(b"".join(frames), 2)


def shifts(ground):
    return [v["argument"] for v in ground.named("event") if v["code"] == Reason.TIME_SET]


@pytest.mark.verifies("REQ-COM-008")
def test_equal_commands_of_one_second_have_their_own_answers(ground):
    found = planned(ground, 20, 20, 20) + ground.tick(times=30)
    waiting, done = answers(found)[:3], answers(found)[3:]
    assert waiting == [(k, Reason.WAITING) for k in (1, 2, 3)]
    assert done == [(k, Reason.DONE) for k in (1, 2, 3)]
    assert shifts(ground) == [10, 20, 30]


@pytest.mark.verifies("REQ-COM-008")
def test_a_delayed_command_keeps_no_other_waiting(ground):
    planned(ground, 400, 400)
    assert ground.command("report_status", 3)["code"] == Reason.DONE


@pytest.mark.verifies("REQ-COM-010")
@pytest.mark.parametrize("cause", sorted(Cause))
def test_the_plan_outlives_a_reboot_and_is_executed_once(ground, cause):
    planned(ground, 10, 60, 200)
    ground.tick(times=15)
    assert shifts(ground) == [10]
    ground.core.reboot(cause)
    found = ground.tick(times=300)
    assert answers(found) == [(2, Reason.DONE), (3, Reason.DONE)]
    assert shifts(ground) == [10, 20, 30]


@pytest.mark.verifies("REQ-COM-010")
def test_a_reboot_at_any_step_executes_each_command_at_most_once(ground):
    """Around the time of execution: once, or not at all where it was under way."""
    planned(ground, 10, 11)
    snapshot, counter = ground.core.snapshot(), ground.sender.counter
    for step in range(14):
        ground.core.restore(snapshot)
        fresh = Ground(ground.core)
        fresh.sender.counter = counter
        fresh.tick(times=step)
        ground.core.reboot(Cause.FAULT)
        fresh.tick(times=120)
        found = shifts(fresh)
        assert len(found) == len(set(found)) and set(found) <= {10, 20}


@pytest.mark.verifies("REQ-COM-010")
def test_it_is_listed_in_the_order_of_its_times(ground):
    begin = now_s(ground)
    planned(ground, 300, 100, 200, first=70)
    assert ground.command("plan_list", times=3)["code"] == Reason.DONE
    listed = [(v["size"], v["place"], v["request"], v["execute_s"] - begin, v["command_id"])
              for v in ground.named("plan")]  # fmt: skip
    assert listed == [(3, 0, 71, 100, 33), (3, 1, 72, 200, 33), (3, 2, 70, 300, 33)]


def test_a_long_plan_is_listed_whole(ground):
    planned(ground, *range(100, 190))
    ground.command("plan_list", times=20)
    assert [v["place"] for v in ground.named("plan")] == list(range(90))


def test_an_empty_plan_is_listed_as_such(ground):
    ground.command("plan_list", times=3)
    assert [v["size"] for v in ground.named("plan")] == [0]


@pytest.mark.verifies("REQ-COM-010")
def test_a_command_is_cancelled_by_its_number_and_answered(ground):
    planned(ground, 30, 40)
    found = ground.tick(ground.frame("plan_cancel", 1, request=9), 60)
    assert answers(found) == [(1, Reason.CANCELLED), (9, Reason.DONE), (2, Reason.DONE)]
    assert shifts(ground) == [20]
    assert ground.command("plan_cancel", 1)["code"] == Reason.VALUE


@pytest.mark.verifies("REQ-COM-010")
def test_the_plan_is_cleared(ground):
    planned(ground, 30, 40, 50)
    found = ground.tick(ground.frame("plan_clear", request=9), 80)
    assert answers(found) == [*((k, Reason.CANCELLED) for k in (1, 2, 3)), (9, Reason.DONE)]
    assert shifts(ground) == []
    ground.core.reboot(Cause.FAULT)
    ground.tick(times=60)
    assert ground.core.services.status("com")["delayed"] == 0


@pytest.mark.verifies("REQ-COM-009")
@pytest.mark.parametrize(("ahead", "code"), [(0, Reason.DONE), (30, Reason.DONE), (-2, Reason.LATE),
                                             (-30000, Reason.LATE)])  # fmt: skip
def test_a_command_that_comes_too_late_is_not_executed(ground, ahead, code):
    until = last_second(now_s(ground) + 1 + ahead)
    found = ground.tick(ground.frame("shift_clock", 10, request=5, valid_until=until), 3)
    assert answers(found) == [(5, code)]
    assert shifts(ground) == [10] * (code is Reason.DONE)


@pytest.mark.parametrize("now", [0, 1, 65535, 65536, 2**31, 2**32 - 40000])
def test_marks_of_times(now):
    for by_s in (-32000, -1, 0, 1, 100, 32000):
        if now + by_s >= 0 and (now + by_s) % 65536:
            assert seconds_late(now, last_second(now + by_s)) == -by_s
    assert seconds_late(now, 0) == 0


def filled(ground):
    """Have the memory take no plan any more; what is called to have it take one again."""
    memory = ground.core.memory
    write = memory.write
    memory.write = lambda name, data: name != PLAN and write(name, data)
    return lambda: setattr(memory, "write", write)


@pytest.mark.verifies("REQ-COM-010")
def test_a_plan_that_cannot_be_kept_is_refused_and_one_that_cannot_be_changed_waits(ground):
    planned(ground, 10)
    empty = filled(ground)
    try:
        assert answers(planned(ground, 300, first=7)) == [(7, Reason.FAILED)]
        ground.tick(times=20)
        assert shifts(ground) == [], "a reboot would execute it again"
    finally:
        empty()
    ground.tick(times=3)
    assert shifts(ground) == [10]


@pytest.mark.parametrize("damage", ["damaged", "lost"])
def test_a_plan_that_cannot_be_read_is_reported(damage):
    memory = Memory()
    ground = flying(300.0, memory=memory)
    ground.tick(times=2)
    planned(ground, 100)
    spoil(memory, damage, PLAN)
    ground.core.reboot(Cause.FAULT)
    ground.tick(times=30)
    assert Reason.PLAN_LOST in [v["code"] for v in ground.named("event")]


def test_a_lost_clock_drops_no_command_of_the_plan(ground):
    """It begins in 2010; once it is set the plan goes on."""
    begin = now_s(ground)
    planned(ground, 120)
    for files in ground.core.memory.places.values():
        del files["time"]
    ground.core.reboot(Cause.FAULT)
    ground.tick(times=30)
    assert now_s(ground) < 1000 and ground.core.services.status("com")["delayed"] == 1
    ground.tick(ground.frame("set_clock", (begin + 100) * 1e3), 40)
    assert [v["code"] for v in ground.named("acknowledgement") if v["request"] == 1][-1] == 0


def test_a_plan_of_other_software_is_refused_when_it_is_due():
    """The memory goes on with software in which the module does not fly."""
    memory = Memory()
    first = flying(300.0, memory=memory)
    first.tick(times=2)
    first.tick(first.frame("set_model", 1, time_s=now_s(first) + 30, request=3), 2)
    second = flying(300.0, software={"modules": {"tm": {}, "clk": {}}}, memory=memory)
    second.core.state.clock.set(first.core.state.clock.now_ms)
    found = second.tick(times=60)
    assert answers(found) == [(3, Reason.STATE)]
    assert second.core.state.slots["com"].failures == 0
    assert second.core.services.status("com")["delayed"] == 0


@pytest.mark.verifies("REQ-COM-010")
def test_commands_planned_for_the_second_of_a_reboot_are_executed_after_it(ground):
    """More than the queues take, too: what has not been handed on is still in the memory."""
    at = now_s(ground) + 20
    frames = ground.frame("reboot", 0, time_s=at, request=1)
    for k in range(30):
        frames += ground.frame("shift_clock", 10 * k, time_s=at, request=2 + k)
    found = ground.tick(frames, 120)
    done = [request for request, code in answers(found) if code == Reason.DONE]
    assert done == list(range(1, 32))
    assert sorted(shifts(ground)) == [10 * k for k in range(30)]
