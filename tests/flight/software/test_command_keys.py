"""Counters of commands that are lost, damaged or unwritable: the key is closed, never replayed."""

import hashlib

import pytest
from onboard_ground import Ground, scenario
from spoiled_memory import PLACES, Full, ReadOnly, spoil

from torquer.base.explain import ScenarioError
from torquer.compile import engine
from torquer.flight.packets.frames import Uplink
from torquer.flight.packets.keys import Keys, new_key
from torquer.flight.packets.reasons import Reason
from torquer.flight.packets.security import USED_UP
from torquer.flight.packets.software_file import load_link
from torquer.flight.packets.station import Station
from torquer.flight.software.command_keys import COMMANDS, RECOVERY, WINDOW
from torquer.flight.software.core import Core
from torquer.flight.software.link import TELEMETRY
from torquer.flight.software.session import Sender, fly_steps

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
#: Control steps of a boot.
BOOT = 14
#: Of HMAC.
_PADS = (0x36, 0x5C)


@pytest.fixture(scope="module")
def begun():
    """A satellite that has executed five commands, which somebody has recorded."""
    ground = Ground(Core(scenario(4000.0)))
    recorded = [ground.frame("report_status", 1) for _ in range(5)]
    for frame in recorded:
        ground.tick(frame, 2)
    assert len(answers(ground)) == 5
    return ground, recorded, ground.core.snapshot()


@pytest.fixture
def ground(begun):
    """The ground after them, with memory file systems that work."""
    first, _, snapshot = begun
    first.core.memory.places.update({place: {} for place in PLACES})
    first.core.restore(snapshot)
    ground = Ground(first.core)
    ground.sender.counter = 5
    return ground


@pytest.fixture
def recorded(begun):
    return begun[1]


def answers(ground):
    return [v["code"] for v in ground.named("acknowledgement")]


def events(ground):
    return {v["code"] for v in ground.named("event")}


def reboot(ground):
    ground.packets.clear()
    ground.core.reboot()
    ground.tick(times=BOOT)
    assert ground.core.is_running


def executed(ground, frames):
    """How many of these frames are answered as executed."""
    ground.packets.clear()
    for frame in frames:
        ground.tick(frame)
    ground.tick(times=3)
    return answers(ground).count(Reason.DONE)


def recovers(ground, number=1):
    """Whether the recovery key brings commands back, and what was recorded is still refused."""
    answer = ground.command("change_key", number)
    if not answer or answer["code"] != Reason.DONE:
        return False
    ground.use_key(number)
    return executed(ground, [ground.frame("report_status", 1) for _ in range(3)]) == 3


@pytest.mark.verifies("REQ-LNK-001", "REQ-LNK-005")
@pytest.mark.parametrize("how", ["damaged", "lost", "torn"])
@pytest.mark.parametrize("name", [COMMANDS, RECOVERY, TELEMETRY])
def test_one_copy_less_costs_nothing_but_is_noticed(ground, recorded, how, name):
    for place, code in (("main", Reason.RESERVE_USED), ("reserve", Reason.FILE_REPAIRED)):
        spoil(ground.core.memory, how, name, [place])
        reboot(ground)
        ground.tick(times=6)
        assert code in events(ground) and Reason.KEY_CLOSED not in events(ground)
        assert executed(ground, recorded) == 0
        assert executed(ground, [ground.frame("report_status", 1)]) == 1


@pytest.mark.verifies("REQ-LNK-005")
@pytest.mark.parametrize("how", ["damaged", "lost", "torn"])
def test_a_lost_counter_closes_the_key_until_the_recovery_key_gives_another(ground, recorded, how):
    spoil(ground.core.memory, how, COMMANDS, PLACES)
    reboot(ground)
    assert Reason.KEY_CLOSED in events(ground)
    fresh = [ground.frame("report_status", 1) for _ in range(3)]
    assert executed(ground, recorded + fresh) == 0
    assert {Reason.KEY_CLOSED, Reason.REJECTED} <= events(ground)
    reboot(ground)  # and it stays closed
    assert executed(ground, recorded + fresh) == 0
    assert recovers(ground)
    reboot(ground)
    assert Reason.KEY_CLOSED not in events(ground)
    assert executed(ground, recorded + fresh) == 0
    assert executed(ground, [ground.frame("report_status", 1)]) == 1


@pytest.mark.verifies("REQ-LNK-005")
@pytest.mark.parametrize("how", ["damaged", "lost", "torn"])
def test_the_recovery_counter_is_found_in_the_other_file(ground, recorded, how):
    change = ground.frame("change_key", 1)
    ground.tick(change, 4)
    ground.use_key(1)
    assert executed(ground, [ground.frame("report_status", 1)]) == 1
    spoil(ground.core.memory, how, RECOVERY, PLACES)
    reboot(ground)
    ground.tick(times=6)
    assert events(ground) & {Reason.FILE_MISSING, Reason.FILE_DAMAGED}
    assert Reason.KEY_CLOSED not in events(ground)
    assert executed(ground, [change, *recorded]) == 0
    assert executed(ground, [ground.frame("report_status", 1)]) == 1
    assert recovers(ground, 2)


@pytest.mark.verifies("REQ-LNK-005")
def test_without_either_file_nothing_is_accepted_any_more(ground, recorded):
    change = ground.frame("change_key", 1)
    ground.tick(change, 4)
    for name in (COMMANDS, RECOVERY):
        spoil(ground.core.memory, "lost", name, PLACES)
    for _ in range(2):
        reboot(ground)
        closed = [v for v in ground.named("event") if v["code"] == Reason.KEY_CLOSED]
        assert {v["argument"] for v in closed} == {1, 2}
        assert executed(ground, [change, *recorded, ground.frame("report_status", 1)]) == 0
        assert not recovers(ground, 2)


@pytest.mark.verifies("REQ-LNK-005")
@pytest.mark.parametrize("how", [Full, ReadOnly])
def test_a_counter_that_cannot_be_stored_refuses_the_command_and_closes_the_key(
    ground, recorded, how
):
    spoil(ground.core.memory, how, "", PLACES)
    fresh = [ground.frame("report_status", 1) for _ in range(4)]
    assert executed(ground, fresh) == 0
    assert {Reason.COUNTER_NOT_KEPT, Reason.KEY_CLOSED} <= events(ground)
    assert not recovers(ground)
    assert Reason.COUNTER_NOT_KEPT in events(ground)
    reboot(ground)
    assert executed(ground, recorded + fresh) == 0
    files = ground.core.memory.places
    files.update({place: dict(files[place]) for place in PLACES})  # they work again
    assert executed(ground, recorded + fresh) == 0
    ground.use_key(0)
    assert recovers(ground, 2)
    reboot(ground)
    assert executed(ground, recorded + fresh) == 0


@pytest.mark.verifies("REQ-LNK-005")
@pytest.mark.parametrize(("full", "other"), [PLACES, PLACES[::-1]])
@pytest.mark.parametrize("how", ["damaged", "lost", "torn"])
def test_a_copy_that_could_not_be_replaced_never_counts_again(ground, full, other, how):
    """One file system takes no more files; later the only new copy is lost."""
    spoil(ground.core.memory, Full, "", [full])
    frames = [ground.frame("report_status", 1) for _ in range(3)]
    assert executed(ground, frames) == 3
    ground.core.memory.places[full] = dict(ground.core.memory.places[full])
    spoil(ground.core.memory, how, COMMANDS, [other])
    reboot(ground)
    assert Reason.KEY_CLOSED in events(ground)
    assert executed(ground, frames) == 0
    assert recovers(ground)


@pytest.mark.verifies("REQ-LNK-006")
def test_the_recovery_key_changes_the_key_and_does_nothing_else(ground):
    frame = ground.uplink.frame("report_status", 0, (1, 1))
    ground.tick(ground.wrapped(frame, ground.recovery), 3)
    change = ground.uplink.frame("change_key", 0, (1, 1))
    ground.tick(ground.wrapped(change, ground.sender), 3)
    assert answers(ground) == [Reason.REJECTED] * 2
    assert executed(ground, [ground.frame("report_status", 1)]) == 1


@pytest.mark.verifies("REQ-LNK-006")
def test_a_changed_key_takes_the_place_of_the_other_for_good(ground, recorded):
    old, change = ground.frame("report_status", 1), ground.frame("change_key", 3)
    assert executed(ground, [change]) == 1 and Reason.KEY_CHANGED in events(ground)
    assert executed(ground, [old, change, *recorded]) == 0
    ground.use_key(3)
    new = [ground.frame("report_status", 1) for _ in range(2)]
    assert executed(ground, new) == 2
    reboot(ground)
    assert executed(ground, [old, change, *recorded, *new]) == 0
    assert executed(ground, [ground.frame("report_status", 1)]) == 1


@pytest.mark.verifies("REQ-LNK-006")
@pytest.mark.parametrize("number", [0, 2, 3, 4 + WINDOW, USED_UP])
def test_a_number_that_was_used_or_leaps_is_no_new_key(ground, number):
    assert executed(ground, [ground.frame("change_key", 3)]) == 1
    assert ground.command("change_key", number)["code"] == Reason.VALUE
    ground.use_key(3)
    assert executed(ground, [ground.frame("report_status", 1)]) == 1


def test_keys_are_derived_as_nist_sp_800_108_has_it():
    """Counter mode, one block: HMAC(key, [1] || label || 0 || context || length in bits)."""
    keys = Keys()
    inner, outer = (bytes(byte ^ pad for byte in keys.recovery.ljust(64, b"\0")) for pad in _PADS)
    for number in (1, 2, 77, 2**32 - 1):
        block = b"\0\0\0\1torquer key of commands\0" + number.to_bytes(4, "big") + b"\0\0\1\0"
        first = hashlib.sha256(inner + block).digest()
        assert keys.command_key(number) == hashlib.sha256(outer + first).digest()
    assert keys.command_key(0) == keys.up
    assert len({keys.command_key(number) for number in range(100)}) == 100


def test_two_keys_of_a_link_are_never_the_same(tmp_path):
    names = ("up", "recovery", "down")
    for name in names:
        new_key(tmp_path / name)
    tables = {f"{name}_key": str(tmp_path / name) for name in names}
    keys = load_link(tables).keys
    assert not keys.are_known
    (tmp_path / "down").write_bytes(keys.up)
    with pytest.raises(ScenarioError, match="must be three different keys; received one twice"):
        load_link(tables)
    assert Keys(up=keys.up, down=keys.down).are_known


@pytest.mark.verifies("REQ-LNK-006")
def test_with_pus_the_key_changes_alike():
    ground = Ground(Core(scenario(200.0), {"link": "pus"}))
    station, uplink = Station(ground.core.software), ground.uplink

    def codes(name, *values):
        sent = station.command(uplink.frame(name, 0, (1, *values)))
        steps = [ground.core.tick(sent), *(ground.core.tick() for _ in range(3))]
        frames = [frame for data in steps for frame in station.receive(data)]
        return [f.values[3] for f in frames if f.packet.name == "acknowledgement"]

    assert codes("change_key", 5) == [Reason.DONE]
    assert codes("report_status", 1) == []  # by the key of before
    station.use_key(5)
    assert codes("report_status", 1) == [Reason.DONE]
    assert codes("change_key", 5) == [Reason.VALUE]


def test_historical_frames_have_no_key():
    ground = Ground(Core(scenario(60.0), {"link": "historical"}))
    assert ground.command("change_key", 1)["code"] == Reason.NOT_AVAILABLE


def test_a_script_goes_on_with_the_key_that_it_has_changed_to():
    core = Core(scenario(60.0))
    station = Station(core.software)
    frame = Uplink(core.software.dictionary).frame
    change, status = frame("change_key", 0, (1, 2)), frame("report_status", 0, (1, 1))
    sender = Sender([(1.0, status), (2.0, change), (5.0, status)], station)
    ticks = list(fly_steps(core, lambda _, t_s: sender.at(t_s), ticks=12))
    frames = [frame for tick in ticks for frame in station.receive(tick.downlink)]
    answered = [f.values[3] for f in frames if f.packet.name == "acknowledgement"]
    assert answered == [Reason.DONE] * 3
