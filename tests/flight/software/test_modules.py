"""Modules: state vector, classes, telemetry, record, dumps, updates, devices, supervisor."""

import itertools
import math
import tomllib
import zlib
from pathlib import Path

import numpy as np
import pytest
from onboard_ground import DAY, Ground, flying, grounded
from spoiled_memory import Full, spoil
from uplink_cases import TLE as ELEMENTS, in_bytes

from torquer.compile import engine
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.core import Core
from torquer.flight.software.memory import Memory
from torquer.flight.software.modules.svr import MAX, MIN, NONE, NORM, classify_value
from torquer.flight.software.modules.telemetry import DEG
from torquer.flight.software.update import ACTIVE, update_file
from torquer.maths.geometry.attitudes import to_body
from torquer.maths.geometry.frames import dcm_orbital_to_inertial
from torquer.scenario.load import load_scenario, scenario_from_data

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
#: When the day's Kalman filter works in sunlight.
SETTLED_S = 12000


@pytest.fixture(scope="module")
def settled():
    """The day of Chibis-M in its science mode, and the packets up to there."""
    ground = flying(SETTLED_S + 600.0)
    ground.tick(times=SETTLED_S)
    return ground, ground.core.snapshot()


@pytest.fixture
def ground(settled):
    """The satellite in its science mode, with a ground that begins to listen."""
    first, snapshot = settled
    return grounded(first.core, snapshot)


def last_sent(found, name):
    return [v for n, _, v in found if n == name][-1]


@pytest.mark.verifies("REQ-AOS-001")
def test_the_state_vector_is_the_estimate_in_both_frames(ground):
    """Against plain matrices: A = C_orbital^T C, and the rate of a two-body orbit."""
    found = last_sent(ground.tick(times=3), "extended")
    core = ground.core.services
    state, e = core.cdh.newest("state"), core.inputs.estimate
    r, v = map(np.array, core.inputs.ephemeris[:2])
    axes = np.array(dcm_orbital_to_inertial(tuple(r), tuple(v)))
    body = np.array([to_body(np.array(e.q_body_to_inertial), column) for column in axes.T])
    # rows of `body`: the orbital axes in body components, that is, body to orbital frame
    again = to_body(np.array(state.q_orbital), np.eye(3))
    assert np.allclose(again, body, atol=1e-12)
    orbit = np.cross(r, v) / (r @ r)
    relative = np.array(e.omega_body_rad_s) - to_body(np.array(e.q_body_to_inertial), orbit)
    assert np.allclose(state.omega_orbital_rad_s, relative, atol=1e-12)
    assert state.rate_rad_s == pytest.approx(np.linalg.norm(relative), rel=1e-9)
    q = [found[f"q_orbital_{k}"] for k in range(4)]
    assert np.allclose(q, state.q_orbital, atol=3.1e-5)
    omega = [found[f"omega_{k}"] for k in "xyz"]
    assert np.allclose(omega, np.degrees(e.omega_body_rad_s), atol=1e-5)


@pytest.mark.verifies("REQ-AOS-002")
def test_the_state_vector_is_lost_and_found(settled):
    """B-dot has no attitude: unknown numbers; later there is one."""
    first, *_ = settled
    extended = first.named("extended")
    assert extended[50]["q_orbital_0"] == pytest.approx(-1.00003, abs=1e-5)
    assert extended[50]["rate_class"] == NONE and not extended[50]["flags"] & 2
    assert extended[-1]["rate_class"] == MIN and extended[-1]["flags"] & 2
    assert {v["aos_mode"] for v in extended} >= {2, 3, 4}
    assert {v["stb_mode"] for v in extended} == {1, 2, 3}
    codes = [v["code"] for v in first.named("event") if v["module_id"] == 3]
    assert codes and set(codes) <= {Reason.STATE_LOST, Reason.STALE_STATE}


def test_telemetry_shows_the_flight(settled):
    """Every tenth packet against the record of the run, to half a step of its numbers."""
    first, snapshot = settled
    first.core.restore(snapshot)
    result, extended = first.core.result(), first.named("extended")
    start_ms = extended[0]["on_board_ms"]
    by_time = {round((v["on_board_ms"] - start_ms) * 1e-3): v for v in extended}
    rows = [(k, by_time[round(t)]) for k, t in enumerate(result.time.values[:-1].tolist())]
    assert len(rows) == SETTLED_S // 10 - 1

    def differ(names, values):
        sent = np.array([[v[name] for name in names] for _, v in rows])
        truth = values[[k for k, _ in rows]]
        known = np.isfinite(truth).all(axis=1)
        assert known.sum() > 500
        return np.abs(sent - truth)[known].max()

    xyz = "x", "y", "z"
    dipole = result["command_body"].values
    assert differ([f"dipole_{k}" for k in xyz], dipole) <= 2.5001e-4
    assert differ([f"b_{k}" for k in xyz], result["b_measured"].values * 1e9) <= 1.0001
    omega = np.degrees(result["omega_estimated"].values)
    assert differ([f"omega_{k}" for k in xyz], omega) <= 5.001e-6
    q = result["q_estimated"].values
    assert differ([f"q_inertial_{k}" for k in range(4)], q) <= 1.53e-5
    wheels = result["wheel_momentum"].values
    momentum = wheels[:, ::2] + wheels[:, 1::2]  # pairs about x, y, z; read with noise
    assert differ([f"wheel_momentum_{k}" for k in xyz], momentum) <= 5e-4


@pytest.mark.verifies("REQ-SVR-002")
@pytest.mark.parametrize(
    ("value", "is_a"), [(math.nan, NONE), (0.5, MAX), (0.4, NORM), (0.08, NORM), (0.0799, MIN)]
)
def test_classes_of_table_3_2(value, is_a):
    assert classify_value(value, 0.08, 0.4) == is_a


@pytest.mark.verifies("REQ-SVR-002")
def test_thresholds_are_settings(ground):
    rate = ground.core.services.cdh.newest("state").rate_rad_s * DEG
    ground.command("set_thresholds", rate / 2, rate / 4, 0.15, 0.02)
    assert last_sent(ground.tick(times=2), "extended")["rate_class"] == MAX
    assert ground.command("set_thresholds", 0.1, 0.2, 0.15, 0.02)["code"] == Reason.VALUE
    settings = ground.named("settings")[-1]
    assert settings["rate_max"] == pytest.approx(rate / 2) and settings["q_max"] == pytest.approx(
        0.15
    )


@pytest.mark.verifies("REQ-SVR-001")
def test_manual_operation(ground):
    """The ground commands states; transitions rest; automatic operation takes over again."""
    core = ground.core.services
    place = [name for name, _ in core.regions].index("stabilisation")
    states = core.regions[place][1]
    assert ground.command("set_mode", place, 0)["code"] == Reason.MODE
    assert ground.command("automatic", 0)["code"] == Reason.DONE
    assert last_sent(ground.tick(times=2), "extended")["svr_mode"] == 0
    assert ground.command("set_mode", place, states.index("detumbling"))["code"] == Reason.DONE
    ground.tick(times=100)
    assert core.modes["stabilisation"] == "detumbling"  # the table itself would leave it at once
    assert ground.command("set_mode", place, len(states))["code"] == Reason.VALUE
    assert ground.command("set_mode", 200, 0)["code"] == Reason.VALUE
    assert ground.command("automatic", 1)["code"] == Reason.DONE
    ground.tick(times=5)
    assert core.modes["stabilisation"] == "acquisition"


@pytest.mark.verifies("REQ-SVR-005")
def test_hold_and_release(ground):
    core = ground.core.services
    place = [name for name, _ in core.regions].index("determination")
    ground.command("automatic", 0)
    assert ground.command("hold", place, 0)["code"] == Reason.DONE
    assert ground.command("hold", place, 2)["code"] == Reason.VALUE
    assert ground.core.state.modules["svr"].held == {"stabilisation"}


@pytest.mark.verifies("REQ-SVR-006")
def test_parameters(ground):
    core = ground.core.services
    index = next(k for k, name in enumerate(core.parameters) if name.startswith("damping.gain"))
    ground.command("set_parameter", index, 1234.5)
    ground.command("get_parameter", index)
    assert ground.named("parameter")[-1] == {"index": index, "value": 1234.5}
    for value in (math.nan, 0.0, -1234.5, 1e30):
        assert ground.command("set_parameter", index, value)["code"] == Reason.VALUE
    ground.command("get_parameter", index)
    assert ground.named("parameter")[-1] == {"index": index, "value": 1234.5}
    assert ground.command("get_parameter", 60000)["code"] == Reason.VALUE


@pytest.mark.verifies("REQ-DEV-001")
def test_the_dipole_is_commanded_by_hand_for_its_time(ground):
    ground.command("coils_manual", 1.5, -0.5, 0.25, 20.0, times=2)
    assert ground.core.services.commanded[0] == (1.5, -0.5, 0.25)
    found = [v for n, _, v in ground.tick(times=15) if n == "extended"]
    assert all(v["dipole_x"] == pytest.approx(1.5, abs=1e-3) for v in found)
    ground.tick(times=8)
    assert ground.core.services.commanded[0] == ground.core.flight.answer.dipole_a_m2
    assert ground.command("coils_manual", 1.0, 0.0, 0.0, 1e6)["code"] == Reason.VALUE


@pytest.mark.verifies("REQ-SVR-007")
def test_without_power_nothing_is_commanded(ground):
    assert ground.command("power", 21, 0)["code"] == Reason.DONE
    assert ground.core.services.commanded[1] == (0.0, 0.0, 0.0)
    beacon = last_sent(ground.tick(times=12), "beacon")
    assert beacon["power_status"] == 0b11101
    assert ground.command("wheels_manual", 1e-4, 0, 0, 5.0)["code"] == Reason.STATE
    assert ground.command("power", 8, 0)["code"] == Reason.NOT_AVAILABLE  # a module without device
    ground.command("power", 21, 1)
    assert ground.core.services.commanded[1] == ground.core.flight.answer.torque_n_m


@pytest.mark.verifies("REQ-TM-001")
def test_rates_of_telemetry(ground):
    ground.command("set_rates", 7.0, 3.0, 0.0)
    found = ground.tick(times=42)
    assert [n for n, _, _ in found].count("beacon") == 6
    assert [n for n, _, _ in found].count("extended") == 14
    ground.command("set_rates", 0.0, 0.0, 0.0)
    others = {"event", "settings", "devices", "queues", "housekeeping", "wheels"}
    assert {n for n, _, _ in ground.tick(times=42)} <= others


@pytest.mark.verifies("REQ-TM-002")
def test_what_was_stored_is_what_was_sent(settled):
    """Replay of half an hour, every one and every third, against the packets sent then."""
    first, snapshot = settled
    ground = grounded(first.core, snapshot)
    now_s = ground.core.state.clock.now_s
    sent = {v["on_board_ms"]: v for v in first.named("extended")}
    for every in (1, 3):
        answer = ground.command("replay", now_s - 1800, now_s, every, times=40)
        assert answer["code"] == Reason.DONE
        stored = [(t, v) for n, t, v in ground.packets if n == "stored"]
        assert len(stored) == math.ceil(30 / every)
        assert all(v == sent[v["on_board_ms"]] for _, v in stored)
        times = [t for t, _ in stored]
        assert times == sorted(times) and times[0] >= now_s - 1800
        assert np.all(np.diff(times) == 60 * every)
        ground = grounded(first.core, snapshot)


def test_replay_without_records(ground):
    assert ground.command("replay", 0, 100, 1)["code"] == Reason.NOT_AVAILABLE
    assert ground.command("replay", 100, 0, 1)["code"] == Reason.VALUE
    assert ground.command("replay", 0, 2**32 - 1, 0)["code"] == Reason.VALUE


@pytest.mark.verifies("REQ-TM-002")
def test_the_record_is_a_ring_and_outlives_a_reboot():
    software = {
        "modules": {"tm": {"settings": {"store_s": 1.0, "in_file": 5, "files": 4}}},
    }
    memory = Memory()
    ground = flying(400.0, software=software, memory=memory)
    ground.tick(times=102)
    names = [name for name in memory.names() if name.startswith("record.")]
    assert names == [f"record.{k}" for k in range(4)]
    ground.core.reboot()
    ground.tick(times=20)
    ground.packets.clear()
    assert ground.command("replay", 0, 2**32 - 1, 1, times=60)["code"] == Reason.DONE
    times = [t for n, t, _ in ground.packets if n == "stored"]
    back = int(np.argmin(np.diff(times))) + 1  # the clock has gone back
    assert len(times) > 20 and back == 10
    assert np.all(np.diff(times[:back]) == 1) and np.all(np.diff(times[back:]) == 1)


@pytest.mark.verifies("REQ-TM-003")
def test_a_file_comes_down_whole(ground):
    """The file of the time's settings; and an end beyond the file's."""
    memory = ground.core.memory
    number = memory.names().index("fpga.lib")
    data = memory.read("fpga.lib")
    ground.command("dump", number, 10, 200, times=8)
    parts = ground.named("dump")
    assert b"".join(v["data"][: v["length"]] for v in parts) == data[10:210]
    assert [v["offset"] for v in parts] == [10, 74, 138, 202]
    assert ground.command("dump", number, len(data), 1)["code"] == Reason.VALUE
    assert ground.command("dump", 9999, 0, 1)["code"] == Reason.NOT_AVAILABLE


def update(ground, data, crc=None, activate=1, order=1):
    """Send an update; the answer to its end."""
    crc = zlib.crc32(data) if crc is None else crc
    assert ground.command("update_begin", 7, len(data), crc)["code"] == Reason.DONE
    for at in list(range(0, len(data), 64))[::order]:
        part = data[at : at + 64].ljust(64, b"\0")
        assert ground.command("update_block", at, part)["code"] == Reason.DONE
    return ground.command("update_end", activate)["code"]


@pytest.mark.verifies("REQ-FS-001")
@pytest.mark.parametrize("order", [1, -1])
def test_an_update_is_stored(ground, order):
    """In whatever order its blocks come; bytes that are no table of settings stay what they are."""
    data = bytes(range(256)) * 2 + b"end"
    assert update(ground, data, activate=0, order=order) == Reason.DONE
    assert ground.core.memory.read(update_file(7)) == data
    assert ACTIVE not in ground.core.memory.names()


TABLE = b"""[modules.tm.settings]
beacon_s = 7.5
[modules.mag.settings]
bias = [100.0, 0.0, 0.0]
"""


@pytest.mark.verifies("REQ-FS-002")
def test_a_table_of_settings_is_in_use_from_the_next_boot_on(ground):
    """And only once: what is commanded after that stays at further boots."""
    core = ground.core
    ground.command("set_rates", 5.0, 2.0, 20.0)
    before = core.state.modules["gyro"].settings
    assert update(ground, TABLE) == Reason.DONE
    assert core.services.status("tm")["beacon_s"] == 5.0
    core.reboot()
    ground.tick(times=20)
    assert core.services.status("tm")["beacon_s"] == 7.5
    assert core.services.status("tm")["extended_s"] == 2.0, "what it does not name stays"
    assert core.state.modules["mag"].settings.bias == (100.0, 0.0, 0.0)
    assert core.state.modules["gyro"].settings == before
    assert [v["argument"] for v in ground.named("event") if v["code"] == Reason.UPDATED] == [7]
    ground.command("set_rates", 3.0, 2.0, 20.0)
    core.reboot()
    ground.tick(times=20)
    assert core.services.status("tm")["beacon_s"] == 3.0
    assert core.state.modules["mag"].settings.bias == (100.0, 0.0, 0.0)


@pytest.mark.verifies("REQ-FS-002")
@pytest.mark.parametrize(
    "data",
    [
        b"\xff\xfe",
        b"no table",
        b"# nothing",
        b"modules = 3",
        b"[modules]\ntm = 3",
        b"[modules.tm]\nperiod_s = 3.0",
        b"[modules.tm.settings]\nbeacon = 3.0",
        b"[modules.tm.settings]\nbeacon_s = -3.0",
        b"[modules.mine.settings]\nbeacon_s = 3.0",
        b"[modules.tm.settings]\nbeacon_s = 3.0\n[other]\n",
        b"a=" + b"[" * 3000,
    ],
    ids=range(11),
)
def test_what_is_no_table_of_settings_is_not_activated(ground, data):
    assert update(ground, data) == Reason.VALUE
    assert not {update_file(7), ACTIVE} & set(ground.core.memory.names())
    assert ground.command("update_end", 0)["code"] == Reason.DONE
    assert ground.core.memory.read(update_file(7)) == data


@pytest.mark.verifies("REQ-FS-002")
@pytest.mark.parametrize("name", [update_file(7), ACTIVE])
@pytest.mark.parametrize("how", ["damaged", "lost", "torn"])
def test_an_update_that_is_lost_before_the_boot_is_noticed(ground, how, name):
    core = ground.core
    assert update(ground, TABLE) == Reason.DONE
    spoil(core.memory, how, name)
    core.reboot()
    ground.tick(times=40)
    assert core.services.status("tm")["beacon_s"] == 10.0
    codes = {v["code"] for v in ground.named("event")}
    assert codes & {Reason.FILE_MISSING, Reason.FILE_DAMAGED}
    assert (Reason.SETTINGS_DAMAGED in codes) == (name != ACTIVE)


@pytest.mark.verifies("REQ-FS-002")
def test_a_file_system_that_refuses_takes_no_update_twice(ground):
    """The mark is gone from both; commands after the boot count at the next one."""
    core = ground.core
    assert update(ground, TABLE) == Reason.DONE
    spoil(core.memory, Full, "", ["reserve"])
    for beacon_s in (7.5, 3.0):
        core.reboot()
        ground.tick(times=20)
        assert core.services.status("tm")["beacon_s"] == beacon_s
        ground.command("set_rates", 3.0, 2.0, 20.0)


@pytest.mark.verifies("REQ-FS-001")
def test_a_wrong_update_is_never_activated(ground):
    data = bytes(range(200))
    assert update(ground, data, crc=1) == Reason.CHECKSUM
    assert ground.command("update_begin", 7, 200, zlib.crc32(data))["code"] == Reason.DONE
    assert ground.command("update_block", 0, data[:64])["code"] == Reason.DONE
    assert ground.command("update_block", 5, data[:64])["code"] == Reason.VALUE
    assert ground.command("update_block", 256, data[:64])["code"] == Reason.VALUE
    assert ground.command("update_end", 1)["code"] == Reason.LENGTH
    assert not {update_file(7), ACTIVE} & set(ground.core.memory.names())
    assert ground.command("update_begin", 7, 2**31, 0)["code"] == Reason.VALUE


TLE = in_bytes(ELEMENTS)


@pytest.mark.verifies("REQ-MOD-001")
def test_elements_are_checked_and_kept(ground):
    wrong = TLE[0][:-1] + b"8"
    assert ground.command("set_elements", wrong, TLE[1])["code"] == Reason.CHECKSUM
    assert ground.command("set_elements", TLE[1], TLE[0])["code"] == Reason.VALUE
    assert ground.command("set_elements", b"\xff" * 69, TLE[1])["code"] == Reason.VALUE
    assert ground.core.services.status("mod")["elements"] == 0.0
    assert ground.command("set_elements", *TLE)["code"] == Reason.DONE
    ground.core.reboot()
    ground.tick(times=15)
    assert ground.core.state.modules["mod"].elements == tuple(line.decode() for line in TLE)


def test_the_status_of_each_module(ground):
    for name, number in ground.dictionary.modules.items():
        if name in ground.core.state.modules:
            ground.command("report_status", number)
            status = ground.named("module_status")[-1]
            assert status["module_id"] == number and status["state"] == 1
    assert ground.command("report_status", 99)["code"] == Reason.VALUE


@pytest.mark.verifies("REQ-SVR-008")
def test_settings_return_to_their_defaults(ground):
    ground.command("set_rates", 7.0, 3.0, 0.0)
    assert ground.command("restore_defaults", 4)["code"] == Reason.DONE
    assert ground.core.state.modules["tm"].settings == ground.core.software.modules["tm"].settings


def data_with(changes):
    """The day as data, changed in place by a function."""
    data = tomllib.loads(Path(DAY).read_text(encoding="utf-8")) | {"name": "day"}
    changes(data)
    return scenario_from_data(data)


@pytest.mark.verifies("REQ-SVR-003")
@pytest.mark.parametrize(
    ("kind", "code"), [("silent", Reason.SENSOR_SILENT), ("nan", Reason.SENSOR_ODD)]
)
def test_a_lost_sensor_raises_a_flag_that_moves_the_table(kind, code):
    """And comes back: the flag falls, unless the ground has raised it by hand."""

    def change(data):
        data["simulation"]["duration_s"] = 700.0
        data["spacecraft"]["gyro"]["failures"] = [{"kind": kind, "from_s": 100.0, "until_s": 300.0}]
        modes = data["control"]["modes"]
        modes["flags"] = ["gyro_lost", "spare"]
        states = modes["regions"]["gyro"]["states"]
        up, down = (
            {"signal": "flag", "flag": "gyro_lost", side: 0.5} for side in ("above", "below")
        )
        states["gyro_known"]["transitions"] = [{"to": "gyro_lost", "when": up}]
        states["gyro_lost"]["transitions"] = [{"to": "gyro_known", "when": down}]

    ground = Ground(Core(data_with(change)))
    ground.tick(times=160)
    assert code in [v["code"] for v in ground.named("event") if v["module_id"] == 22]
    assert ground.core.services.modes["gyro"] == "gyro_lost"
    ground.tick(times=200)
    assert ground.core.services.modes["gyro"] == "gyro_known"
    assert ground.command("set_flag", 0, 1)["code"] == Reason.DONE
    ground.tick(times=10)
    assert ground.core.services.modes["gyro"] == "gyro_lost"
    assert ground.command("set_flag", 0, 0)["code"] == Reason.DONE
    assert ground.command("set_flag", 2, 0)["code"] == Reason.VALUE
    ground.tick(times=10)
    assert ground.core.services.modes["gyro"] == "gyro_known"


@pytest.mark.verifies("REQ-SVR-004")
def test_wheels_that_do_not_follow_are_found():
    """Both wheels about x die in the acquisition; those of the other axes follow."""

    def change(data):
        data["simulation"]["duration_s"] = 9000.0
        data["spacecraft"]["wheels"]["failures"] = [
            {"wheel": wheel, "time_s": 3000.0, "noticed_after_s": 1e6} for wheel in (0, 1)
        ]

    ground = Ground(Core(data_with(change)))
    ground.tick(times=9000)
    lost = [v["argument"] for v in ground.named("event") if v["code"] == Reason.WHEEL_FAILED]
    assert lost == [0, 1]
    assert ground.core.services.status("wheels")["lost_x"] == 1.0


@pytest.mark.verifies("REQ-SVR-004")
def test_healthy_wheels_are_never_lost(settled):
    first, *_ = settled
    assert Reason.WHEEL_FAILED not in [v["code"] for v in first.named("event")]
    assert {v["code"] for v in first.named("event")} <= {
        *(Reason.BOOTED, Reason.READY, Reason.STATE_LOST, Reason.STALE_STATE),
    }


def test_the_ground_queue_overflows_without_harm(ground):
    """More packets in a step than the queue holds: the oldest are dropped, counted, reported."""
    for k in range(30):
        ground.core.services.send("parameter", (k, 1.0))
    ground.tick(times=30)
    assert ground.core.is_running and ground.core.state.cdh.dropped["ground"] >= 20
    assert 0 not in [v["index"] for v in ground.named("parameter")]


def test_many_rejected_commands_are_all_answered_and_reported(ground):
    count = ground.core.state.modules["com"].settings.waiting + 30
    frames = b"".join(ground.frame("report_status", 3) for _ in range(count))
    ground.tick(frames, 60)
    assert not any(n for name, n in ground.core.state.cdh.dropped.items() if name != "state")
    assert len(ground.named("acknowledgement")) == count
    full = [v for v in ground.named("event") if v["code"] == Reason.QUEUE_FULL]
    assert len(full) == 30


@pytest.mark.verifies("REQ-CDH-002")
def test_a_queue_that_drops_says_so(ground):
    for k in range(30):
        ground.core.services.send("parameter", (k, 1.0))
    ground.tick(times=30)
    assert Reason.QUEUE_FULL in [v["code"] for v in ground.named("event") if v["module_id"] == 6]


FLIGHT = "examples/chibis_m_flight.toml"


def flown_to_science(duration_s=9000.0):
    """A ground and the satellite with all modes, flown until it points."""
    scenario = load_scenario(FLIGHT).replace("simulation.duration_s", duration_s)
    ground = Ground(Core(scenario))
    while ground.core.services.t_s < duration_s - 1500.0:
        ground.tick(times=100)
        if ground.core.services.modes["stabilisation"] == "science":
            break
    assert ground.core.services.modes["stabilisation"] == "science"
    return ground


@pytest.mark.verifies("REQ-SVR-009")
def test_an_anomaly_ends_manual_operation_in_safe_mode():
    """Held in science by hand; then the flag: safe mode, and telemetry shows it."""
    ground = flown_to_science()
    core = ground.core.services
    assert ground.command("automatic", 0)["code"] == Reason.DONE
    shown = last_sent(ground.tick(times=5), "extended")
    assert (shown["svr_mode"], shown["stb_mode"]) == (0, 3) and core.modes["supervisor"] == "manual"
    flag = core.flags.index("anomaly")
    assert ground.command("set_flag", flag, 1)["code"] == Reason.DONE
    shown = last_sent(ground.tick(times=10), "extended")
    assert core.modes["supervisor"] == "automatic"
    assert (shown["svr_mode"], shown["stb_mode"], shown["aos_mode"]) == (1, 0, 1)


@pytest.mark.verifies("REQ-SVR-001")
def test_modes_of_the_ground_only_are_commanded():
    """From science, by hand, to the fast turn to a direction and to one axis held; and back."""
    ground = flown_to_science()
    core = ground.core.services
    ground.command("automatic", 0)
    regions = dict(core.regions)
    place = [*regions].index("stabilisation")
    for state, number in (("point2dir", 4), ("one_axis", 5)):
        index = regions["stabilisation"].index(state)
        assert ground.command("set_mode", place, index)["code"] == Reason.DONE
        assert last_sent(ground.tick(times=3), "extended")["stb_mode"] == number
    assert ground.command("automatic", 1)["code"] == Reason.DONE
    ground.tick(times=3)
    assert core.modes["supervisor"] == "automatic"


@pytest.mark.verifies("REQ-SVR-002")
def test_mode_table_thresholds_follow_the_supervisor_and_outlive_reboots():
    """|q| of 0.1 is a turn of 11.48 deg."""
    scenario = load_scenario(FLIGHT).replace("simulation.duration_s", 100.0)
    ground = Ground(Core(scenario))
    flight = ground.core.flight
    assert flight.parameter("modes.angle_max") == pytest.approx((17.2,))
    assert ground.command("set_thresholds", 0.3, 0.06, 0.1, 0.02)["code"] == Reason.DONE
    expected = {"rate_max": 0.3, "rate_min": 0.06, "angle_max": 11.478, "angle_min": 2.292}
    for _ in range(2):
        for name, value in expected.items():
            assert flight.parameter(f"modes.{name}") == pytest.approx((value,), rel=1e-4), name
        ground.core.reboot()
        ground.tick(times=20)


def test_mode_table_states_come_at_once_and_every_minute():
    ground = flying()
    ground.tick(times=400)
    regions = ground.core.services.regions
    sent = [(t, v) for name, t, v in ground.packets if name == "modes"]
    gaps = [after - before for (before, _), (after, _) in itertools.pairwise(sent)]
    assert gaps[1:] and all(gap <= 61 for gap in gaps)

    def shown(values):
        return [values[f"state_{k}"] for k in range(32)]

    now = [states.index(ground.core.flight.modes()[name]) for name, states in regions]
    assert shown(sent[-1][1]) == now + [255] * (32 - len(now))
    ground.command("automatic", 0)
    place = [name for name, _ in regions].index("stabilisation")
    assert now[place] != 1
    ground.command("set_mode", place, 1)
    name, _, values = next(p for p in reversed(ground.packets) if p[0] == "modes")
    assert (name, shown(values)[place]) == ("modes", 1)
    assert ground.core.services.cdh.dropped["ground"] == 0


def test_coils_that_spun_the_satellite_up_are_an_event_and_a_flag(ground):
    """The last guard's state is told once; the flag stays while the coils are off."""
    computer = ground.core.services.computer

    def told(state):
        computer.command_mode("spin", state)
        found = ground.tick(times=12)
        codes = [v["code"] for name, _, v in found if name == "event"]
        return codes.count(Reason.SPUN_UP), bool(last_sent(found, "extended")["flags"] & 16)

    assert told("slow") == (0, False)
    assert told("coils_off") == (1, True)
    assert not any(ground.core.services.commanded[0])
    assert told("coils_off") == (0, True)
    assert told("tried") == (0, False)
    assert told("coils_off") == (1, True)


@pytest.mark.verifies("REQ-MEM-003")
@pytest.mark.parametrize("writes", [1, 40])
def test_a_memory_that_takes_nothing_leaves_a_bounded_queue_of_reports(writes):
    """More go wrong in a period than are told in it."""
    ground = flying(120.0)
    memory = ground.core.memory
    for place in ("main", "reserve"):
        spoil(memory, Full, "", (place,))
    for number in range(100):
        for file in range(writes):
            memory.write(f"file.{file}", bytes([number]))
        ground.tick()
    fs = ground.dictionary.modules["fs"]
    events = [v["code"] for v in ground.named("event") if v["module_id"] == fs]
    assert events.count(Reason.FILE_NOT_WRITTEN) > 100
    assert len(ground.core.state.modules["fs"].reports) <= 64
