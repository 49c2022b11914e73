"""Commands: each has a handler and an answer; what is rejected is counted, logged and answered."""

import struct
import zlib

import pytest
from onboard_ground import Ground, flown, grounded, scenario
from uplink_cases import TLE, in_bytes

from torquer.compile import engine
from torquer.flight.packets.dictionary import load_dictionary
from torquer.flight.packets.frames import FRAMESYNC
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.core import Core
from torquer.flight.software.software import load_software

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
UP = load_dictionary("chibis_m").up
HISTORICAL = {"link": "historical", "modules": {m: {} for m in load_software().modules}}
ONE = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
BLOCK = bytes(range(64))
#: Values of each command that a satellite of the example in automatic operation carries out, or the
#: reason why it does not.
VALUES = {
    "set_mode": ((0, 1), Reason.MODE),
    "hold": ((0, 1), Reason.MODE),
    "automatic": ((1,), Reason.DONE),
    "set_flag": ((0, 1), Reason.VALUE),  # the example has no flags
    "set_parameter": ((0, 2e6), Reason.DONE),
    "get_parameter": ((0,), Reason.DONE),
    "set_thresholds": ((0.5, 0.1, 0.2, 0.03), Reason.DONE),
    "reboot": ((0,), Reason.DONE),
    "restore_defaults": ((4,), Reason.DONE),
    "report_status": ((3,), Reason.DONE),
    "power": ((20, 0), Reason.DONE),
    "module_start": ((24,), Reason.STATE),  # it runs
    "plan_list": ((), Reason.DONE),
    "plan_cancel": ((7,), Reason.VALUE),  # there is no plan
    "plan_clear": ((), Reason.DONE),
    "set_clock": ((5e11,), Reason.DONE),
    "shift_clock": ((-1500,), Reason.DONE),
    "set_rates": ((5.0, 2.0, 10.0), Reason.DONE),
    "replay": ((0, 2**32 - 1, 1), Reason.DONE),
    "dump": ((0, 0, 10), Reason.DONE),
    "set_elements": (in_bytes(TLE), Reason.DONE),
    "set_model": ((1,), Reason.DONE),
    "change_key": ((1,), Reason.DONE),
    "coils_manual": ((1.0, 2.0, 3.0, 10.0), Reason.DONE),
    "coils_automatic": ((), Reason.DONE),
    "wheels_manual": ((1e-4, 0.0, 0.0, 10.0), Reason.DONE),
    "wheels_automatic": ((), Reason.DONE),
    "elements_limits": ((500.0, 2.0), Reason.DONE),
    "mag_calibration": ((1.0, 2.0, 3.0), Reason.DONE),
    "mag_matrix": (ONE, Reason.DONE),
    "gyro_calibration": ((1.0, 2.0, 3.0), Reason.DONE),
    "gyro_matrix": (ONE, Reason.DONE),
    "sun_calibration": ((0.0, 1.0, 2.0), Reason.DONE),
    "coils_calibration": ((1.1, 0.9, 1.0), Reason.DONE),
    "wheels_calibration": ((5, 1.1), Reason.DONE),
    "adc_limits": ((-10.0, 50.0, 1.0), Reason.DONE),
    "update_begin": ((1, 64, zlib.crc32(BLOCK)), Reason.DONE),
    "update_block": ((0, BLOCK), Reason.STATE),
    "update_end": ((0,), Reason.STATE),
    "module_stop": ((7,), Reason.DONE),
    "set_period": ((4, 5.0), Reason.DONE),
    "read_sensor": ((23, 0), Reason.DONE),
    "wheel_power": ((0, 0), Reason.DONE),
    "wheel_manual": ((0, 1e-4, 10.0), Reason.DONE),
}


@pytest.fixture(scope="module")
def begun():
    """A satellite that has flown for a little while, and how to go back there."""
    return flown(scenario(120.0))


@pytest.fixture
def ground(begun):
    """The satellite as it was then, with a ground that begins to listen."""
    return grounded(*begun)


@pytest.mark.verifies("REQ-COM-001")
def test_every_command_has_a_handler_and_an_example():
    modules = load_software().modules
    assert set(VALUES) == set(UP)
    for name, packet in UP.items():
        assert callable(getattr(modules[packet.module].make, f"on_{name}"))


@pytest.mark.verifies("REQ-COM-001")
@pytest.mark.parametrize("name", sorted(UP))
def test_every_command_is_answered(ground, name):
    values, code = VALUES[name]
    answer = ground.command(name, *values)
    assert answer["code"] == code and answer["accepted"] == (code == Reason.DONE)
    assert answer["module_id"] == ground.dictionary.modules[UP[name].module]
    events = [v["code"] for v in ground.named("event") if v["argument"] == UP[name].id]
    assert (code in events) == (code != Reason.DONE)


@pytest.mark.verifies("REQ-COM-001")
def test_no_answer_unless_it_is_asked_for(ground):
    assert ground.command("set_rates", 5.0, 2.0, 10.0, acknowledge=0) is None
    assert ground.core.services.status("tm")["extended_s"] == 2.0


@pytest.mark.verifies("REQ-COM-002")
@pytest.mark.parametrize("name", sorted(UP))
@pytest.mark.parametrize("fill", [0x00, 0xFF, 0x7F, 0x80])
def test_no_values_crash_a_handler(ground, name, fill):
    """Bytes of all kinds, NaN among them, are carried out or rejected, never FAILED."""
    packet = UP[name]
    data = bytes([1]) + bytes([fill]) * (packet.size - 1)
    module = ground.dictionary.modules[packet.module]
    head = struct.pack("<IIBBIH", FRAMESYNC, 0, packet.id, module, 0, packet.size)
    found = ground.tick(ground.wrapped(head + data), times=3)
    codes = [v["code"] for n, _, v in found if n == "acknowledgement"]
    assert len(codes) == 1 and codes[0] != Reason.FAILED
    assert Reason.MODULE_FAILED not in [v["code"] for v in ground.named("event")]


def header(number, module, length):
    return struct.pack("<IIBBIH", FRAMESYNC, 0, number, module, 0, length)


@pytest.mark.verifies("REQ-COM-003")
@pytest.mark.parametrize(
    ("data", "code", "number"),
    [
        (header(250, 1, 4) + bytes(4), Reason.UNKNOWN, 250),
        (header(18, 1, 7) + bytes(7), Reason.LENGTH, 18),
        (header(18, 9, 2) + bytes(2), Reason.MODULE, 18),
    ],
)
def test_invalid_command_is_answered_and_the_next_one_executed(ground, data, code, number):
    good = ground.uplink.frame("shift_clock", 0, (1, 10))
    found = ground.tick(ground.wrapped(data) + ground.wrapped(good), times=3)
    answers = [(v["command_id"], v["code"]) for n, _, v in found if n == "acknowledgement"]
    assert answers == [(number, code), (33, Reason.DONE)]
    assert (5, code, number) in [
        (v["module_id"], v["code"], v["argument"]) for v in ground.named("event")
    ]
    assert ground.core.services.status("com")["rejected"] == 1


@pytest.mark.verifies("REQ-COM-004")
def test_historical_streams_resynchronise():
    ground = Ground(Core(scenario(60.0), HISTORICAL))
    good = ground.frame("shift_clock", 10)
    noise = bytes(range(200)) + good[:9] + header(18, 9, 2)
    found = ground.tick(noise, 2)
    found += ground.tick(b"\xdd\xcc" + good, 3)
    codes = [v["code"] for n, _, v in found if n == "acknowledgement"]
    assert Reason.DONE in codes


@pytest.mark.verifies("REQ-COM-003", "REQ-COM-004")
@pytest.mark.parametrize("software", [None, HISTORICAL])
def test_truncated_frame_delays_the_next_command_for_a_moment(software):
    """A protected frame's header may announce 1024 bytes, a historical one 160: whatever comes next
    could belong to it, until the line has been silent.
    """
    ground = Ground(Core(scenario(60.0), software))
    cut = ground.uplink.frame("set_elements", 0, (1, bytes(69), bytes(69)))[:20]
    if software is None:
        cut = bytes.fromhex("eb90 204d 03ff 00")
    found = ground.tick(cut + ground.frame("shift_clock", 10), 2)
    found += ground.tick(times=4)
    codes = [v["code"] for n, _, v in found if n == "acknowledgement" and v["command_id"] == 33]
    assert codes == [Reason.DONE]
    assert ground.command("shift_clock", 10)["code"] == Reason.DONE


@pytest.mark.verifies("REQ-LNK-001")
@pytest.mark.parametrize("wrong", ["bit", "again", "key", "noise"])
def test_protected_link_refuses_unauthentic_or_replayed_frames(ground, wrong):
    clock = ground.core.state.clock.now_ms
    frame = ground.frame("set_clock", 5e11)
    if wrong == "again":
        ground.tick(frame, 3)
        ground.command("set_clock", float(clock))
    elif wrong == "bit":
        frame = frame[:30] + bytes([frame[30] ^ 4]) + frame[31:]
    elif wrong == "key":
        ground.sender.key = bytes(32)
        frame = ground.frame("set_clock", 5e11)
    else:
        frame = frame[:40] + b"\x00"
    found = ground.tick(frame, 3)
    assert not [1 for n, _, v in found if n == "acknowledgement"]
    assert abs(ground.core.state.clock.now_ms - clock) < 20_000
    if wrong != "noise":
        assert Reason.REJECTED in [v["code"] for n, _, v in found if n == "event"]


@pytest.mark.verifies("REQ-LNK-002")
def test_the_counter_of_commands_outlives_a_reboot(ground):
    frame = ground.frame("shift_clock", 10)
    ground.tick(frame, 3)
    ground.core.reboot()
    ground.tick(times=15)
    assert ground.core.is_running
    found = ground.tick(frame, 3)
    assert not [1 for n, _, v in found if n == "acknowledgement"]
    assert ground.command("shift_clock", 10)["code"] == Reason.DONE


@pytest.mark.verifies("REQ-COM-005", "REQ-COM-007")
def test_a_delayed_command_waits_for_its_time(ground):
    now_s = ground.core.state.clock.now_s
    found = ground.tick(ground.frame("shift_clock", 0, time_s=now_s + 10), 20)
    received, done = [(t, v) for n, t, v in found if n == "acknowledgement"]
    assert now_s + 10 <= done[0] <= now_s + 12 and done[1]["code"] == Reason.DONE
    assert received[0] <= now_s + 2
    both = ("command_id", "module_id", "command_time")
    assert [received[1][key] for key in both] == [done[1][key] for key in both]
    assert received[1]["code"] == Reason.WAITING and not received[1]["accepted"]


@pytest.mark.verifies("REQ-COM-007")
def test_a_delayed_command_that_asks_for_no_answer_gets_none(ground):
    now_s = ground.core.state.clock.now_s
    frame = ground.frame("shift_clock", 0, time_s=now_s + 10, acknowledge=0)
    assert not [1 for n, *_ in ground.tick(frame, 20) if n == "acknowledgement"]
    assert Reason.TIME_SET in [v["code"] for v in ground.named("event")]


@pytest.mark.verifies("REQ-COM-005")
@pytest.mark.parametrize(
    ("ahead", "code"), [(-601, Reason.LATE), (-599, Reason.DONE), (10**6, Reason.TIME)]
)
def test_execution_times_that_cannot_be_kept(ground, ahead, code):
    now_s = ground.core.state.clock.now_s
    assert ground.command("shift_clock", 0, time_s=now_s + ahead)["code"] == code


@pytest.mark.verifies("REQ-COM-005")
def test_delayed_commands_are_executed_in_the_order_of_their_times(ground):
    now_s = ground.core.state.clock.now_s
    late = ground.frame("shift_clock", 1, time_s=now_s + 12)
    early = ground.frame("set_rates", 1.0, 1.0, 1.0, time_s=now_s + 8)
    found = ground.tick(late + early, 20)
    answers = [(v["command_id"], v["code"]) for n, _, v in found if n == "acknowledgement"]
    assert answers == [(33, Reason.WAITING), (40, Reason.WAITING), (40, 0), (33, 0)]


@pytest.mark.verifies("REQ-COM-005")
@pytest.mark.parametrize(("by_s", "code"), [(86400, Reason.LATE), (-604801, Reason.TIME)])
def test_setting_the_clock_strands_no_delayed_command_at_wrong_time(ground, by_s, code):
    """An hour's manual dipole of tomorrow is not executed now; one of next week does not wait."""
    now_s = ground.core.state.clock.now_s
    ground.tick(ground.frame("coils_manual", 1.0, 0.0, 0.0, 60.0, time_s=now_s + 100), 2)
    found = ground.tick(ground.frame("set_clock", (now_s + by_s) * 1e3), 4)
    answers = {v["command_id"]: v["code"] for n, _, v in found if n == "acknowledgement"}
    assert answers == {32: Reason.DONE, 64: code}
    assert ground.core.services.status("com")["delayed"] == 0
    assert ground.core.services.status("coils")["manual"] == 0


@pytest.mark.verifies("REQ-COM-005")
def test_more_delayed_commands_of_one_time_than_a_queue_takes(ground):
    now_s = ground.core.state.clock.now_s
    for k in range(8):
        ground.tick(ground.frame("shift_clock", k - 4, time_s=now_s + 30))
    found = ground.tick(times=40)
    assert [v["code"] for n, _, v in found if n == "acknowledgement"] == [Reason.DONE] * 8
    shifted = [v["argument"] for v in ground.named("event") if v["code"] == Reason.TIME_SET]
    assert shifted == [k - 4 for k in range(8)]


def test_only_so_many_delayed_commands_wait(ground):
    now_s = ground.core.state.clock.now_s
    held = ground.core.state.modules["com"].settings.delayed
    frames = b"".join(
        ground.frame("shift_clock", 0, time_s=now_s + 500 + k) for k in range(held + 2)
    )
    found = ground.tick(frames, 2)
    codes = [v["code"] for n, _, v in found if n == "acknowledgement"]
    assert codes == [Reason.WAITING] * held + [Reason.QUEUE_FULL] * 2
    assert ground.core.services.status("com")["delayed"] == held


@pytest.mark.verifies("REQ-COM-008")
def test_more_commands_than_a_queue_takes_are_executed_in_their_order(ground):
    """Nine commands within a control step for a queue of five."""
    frames = b"".join(ground.frame("shift_clock", k) for k in range(9))
    found = ground.tick(frames, 4)
    answers = [v["code"] for n, _, v in found if n == "acknowledgement"]
    assert answers == [Reason.DONE] * 9
    shifted = [v["argument"] for v in ground.named("event") if v["code"] == Reason.TIME_SET]
    assert shifted == list(range(9))
    assert not any(n for queue, n in ground.core.state.cdh.dropped.items() if queue != "state")


@pytest.mark.verifies("REQ-COM-008")
def test_of_too_many_commands_each_is_answered(ground):
    """More than may wait at once: those beyond are refused, none is lost without a word."""
    most = ground.core.state.modules["com"].settings.waiting
    frames = b"".join(ground.frame("report_status", 3) for _ in range(most + 20))
    found = ground.tick(frames, 40)
    answers = [v["code"] for n, _, v in found if n == "acknowledgement"]
    assert sorted(answers) == [Reason.DONE] * most + [Reason.QUEUE_FULL] * 20


def test_a_stopped_module_takes_no_commands(ground):
    ground.core.services.stop("mod")
    assert ground.command("set_model", 3)["code"] == Reason.STATE
    ground.core.services.start("mod")
    assert ground.command("set_model", 3)["code"] == Reason.DONE


def test_modules_that_do_not_fly_take_no_commands():
    software = {"modules": {"tm": {}}}
    ground = Ground(Core(scenario(30.0), software))
    assert ground.command("set_model", 3)["code"] == Reason.MODULE
    assert ground.command("set_rates", 1.0, 1.0, 1.0)["code"] == Reason.DONE


@pytest.mark.verifies("REQ-COM-006")
def test_too_much_uplink_at_once_loses_the_oldest(ground):
    """The receiver holds 8 kB: the last command of 20 kB arrives."""
    noise = bytes(20_000)
    answer = [
        v
        for n, _, v in ground.tick(noise + ground.frame("shift_clock", 10), 3)
        if n == "acknowledgement"
    ]
    assert answer[0]["code"] == Reason.DONE and ground.core.state.lost_uplink > 0
