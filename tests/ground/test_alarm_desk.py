"""Rows against limits, and alarms in the archive: modes, doubtful and late rows, restarts."""

import itertools
import math
from contextlib import closing
from pathlib import Path

import pytest
from archived import WrittenAtOnce

from torquer.base.explain import ScenarioError
from torquer.base.limits import RequestError
from torquer.computer.names import Names
from torquer.flight.packets.dictionary import load_dictionary
from torquer.ground.alarm import Now
from torquer.ground.alarm_desk import AlarmDesk
from torquer.ground.archive import AUTHENTIC, SUSPECT, Row, read_only
from torquer.ground.file import SatelliteTable, make_satellite
from torquer.ground.limits import Limits
from torquer.ground.violations import stored_violations

BAD_ALARM = 'alarm = { values = { BAD = "alarm" } }'
ANY_WARNING = 'alarm = { values = { hot = "alarm", any = "warning" } }'
NOT_WHILE_OFF = '{ mode = "house.mode", states = ["OFF"] }'
LESS_WITHOUT_SUN = '{ mode = "sun", states = ["lost"], limits = [0, 5] }'
VOLTS = f"alarm = {{ critical = [-5, 15], by_mode = [{NOT_WHILE_OFF}, {LESS_WITHOUT_SUN}] }}"
X = 'description = "x"'
DICTIONARY = f"""
name = "Cube"
[down.house]
id = 1
description = "d"
fields = [
  {{ name = "mode", type = "u8", labels = ["OFF", "ON", "BAD"], {BAD_ALARM}, {X} }},
  {{ name = "volts", type = "f32", unit = "V", limits = [0, 10], {VOLTS}, {X} }},
  {{ name = "bits", type = "u8", bits = ["hot", "cold"], {ANY_WARNING}, {X} }},
  {{ name = "big", type = "u64", limits = [0, 1e19], {X} }},
]
[down.modes]
id = 2
description = "d"
fields = [{{ name = "state", type = "u8", count = 2, {X} }}]
[down.stored]
id = 3
description = "d"
fields = "house"
"""
NAMES = Names(
    {"wheels": (0, {"off": 0, "on": 1}), "sun": (1, {"seen": 2, "lost": 3})}, (), {}, {}, ()
)
OFF, ON, BAD = range(3)


@pytest.fixture
def dictionary(tmp_path):
    path = tmp_path / "cube.toml"
    path.write_text(DICTIONARY, encoding="utf-8")
    return load_dictionary(path)


class Ground:
    """A desk at its archive, and what it says; rows come a second apart."""

    def __init__(self, path, dictionary, names=NAMES):
        spool = WrittenAtOnce(path, dictionary)
        self.archive, self.notes, self.shown = spool.archive, [], []
        note = lambda severity, text: self.notes.append((severity, text))  # noqa: E731
        self.desk = AlarmDesk(spool, dictionary, names, note, self.shown.append)
        self.count, self.at_s = itertools.count(1), 0.0

    def row(self, packet, values, time_ms=None, quality=AUTHENTIC):
        number = next(self.count)
        self.at_s += 1.0
        time_ms = 1000 * number if time_ms is None else time_ms
        row = Row(packet, time_ms, 7_000_000 + number, quality, 0, number, tuple(values))
        self.archive.put([row])
        self.desk.look([row], Now(7_000_000 + number, self.at_s))
        return row

    def house(self, volts=5.0, mode=ON, bits=0, big=0, **more):
        return self.row("house", (mode, volts, bits, f"{big:020d}"), **more)

    def alarms(self):
        return {each["key"]: each for each in self.desk.listed()["alarms"]}

    def states(self):
        return {each["key"]: each["state"] for each in self.desk.listed()["alarms"]}

    def tick(self):
        self.desk.tick(Now(7_000_000, self.at_s))

    def log(self):
        with closing(read_only(self.archive.path)) as db:
            return stored_violations(db)


@pytest.fixture
def ground(tmp_path, dictionary):
    found = Ground(tmp_path / "cube.sqlite", dictionary)
    yield found
    found.archive.close()


def test_ranges_labels_bits_and_large_numbers(ground):
    ground.house(12.0, BAD, bits=3, big=2**64 - 1)
    alarms = ground.alarms()
    assert {key: (each["severity"], each["limit"]) for key, each in alarms.items()} == {
        "house.mode": ("alarm", "is BAD"),
        "house.volts": ("warning", "above 10 V"),
        "house.bits": ("alarm", "is hot, cold"),
        "house.big": ("warning", "above 1e+19"),
    }
    assert alarms["house.volts"]["unit"] == "V" and alarms["house.big"]["value"] > 1e19
    assert ground.notes[1] == ("warning", "alarm raised: house.volts above 10 V, 12")
    assert ground.desk.listed()["counts"] == {"alarm": 2, "warning": 2, "shelved": 0, "all": 4}


def test_another_bit_calls_again(ground):
    ground.house(bits=2)
    (alarm,) = ground.desk.listed()["alarms"]
    ground.desk.acknowledge({"house.bits": alarm["number"]}, "ann", "")
    ground.house(bits=2)
    assert ground.states() == {"house.bits": "acknowledged"}
    ground.house(bits=6)  # one without a name
    assert ground.states() == {"house.bits": "active"}


def test_infinities_are_beyond(ground):
    ground.house(math.inf)
    ground.tick()
    assert ground.log()[0]["extreme"] == math.inf
    again = Ground(ground.archive.path, ground.archive.dictionary)
    assert again.alarms()["house.volts"]["value"] == math.inf
    again.archive.close()


def test_limits_by_a_label_of_the_same_row_and_by_a_region(ground):
    ground.house(20.0, OFF)
    assert ground.states() == {}, "not checked in this mode"
    ground.house(7.0, ON)
    assert ground.states() == {}
    ground.row("modes", (0, 1))
    ground.house(7.0, ON)
    (alarm,) = ground.desk.listed()["alarms"]
    assert (alarm["limit"], alarm["mode"]) == ("above 5 V", "sun lost")
    ground.row("modes", (0, 0))
    ground.house(7.0, ON)
    assert ground.states() == {"house.volts": "returned"}


def test_without_regions_their_limits_do_not_apply(tmp_path, dictionary):
    ground = Ground(tmp_path / "a.sqlite", dictionary, Names({}, (), {}, {}, ()))
    ground.row("modes", (0, 1))
    ground.house(7.0)
    assert ground.states() == {}
    ground.archive.close()


def test_doubtful_rows_and_those_from_the_memory_on_board_raise_nothing(ground):
    ground.house(99.0, quality=SUSPECT)
    ground.row("stored", (BAD, 99.0, 1, "0" * 20))
    assert ground.states() == {}
    ground.house(12.0)
    ground.house(5.0, quality=SUSPECT)
    ground.row("stored", (ON, 5.0, 0, "0" * 20))
    assert ground.states() == {"house.volts": "active"}


def test_late_and_repeated_rows_do_not_move_the_present_state(ground):
    row = ground.house(12.0, time_ms=100_000)
    ground.house(5.0, time_ms=99_000)
    assert ground.states() == {"house.volts": "active"}
    ground.desk.look([row], Now(0, ground.at_s))
    assert ground.desk.listed()["alarms"][0]["count"] == 1
    ground.house(5.0, time_ms=101_000)
    ground.desk.look([row], Now(0, ground.at_s))
    assert ground.states() == {"house.volts": "returned"}


def test_a_clock_that_was_set_back_is_followed_after_a_while(ground):
    ground.house(5.0, time_ms=10**12)
    for k in range(10):
        ground.house(12.0, time_ms=1000 * k)
        assert ground.states() == {}, k
    ground.house(12.0, time_ms=10_000)
    assert ground.states() == {"house.volts": "active"}


def test_alarms_survive_the_end_of_the_ground(tmp_path, dictionary, ground):
    ground.row("modes", (0, 1))
    ground.house(20.0, bits=2)
    numbers = {each["key"]: each["number"] for each in ground.desk.listed()["alarms"]}
    ground.desk.acknowledge({"house.bits": numbers["house.bits"]}, "ann", "known")
    ground.desk.shelve("house.volts", 3600.0, "bob", "test")
    ground.tick()
    again = Ground(ground.archive.path, dictionary)
    assert ground.alarms() == again.alarms()
    again.count = itertools.count(100)
    again.house(7.0, bits=2)
    volts, bits = (again.alarms()[key] for key in ("house.volts", "house.bits"))
    assert volts["mode"] == "sun lost", "the region is known by the archive"
    assert (volts["count"], volts["shelf"]["by"], bits["state"]) == (1, "bob", "acknowledged")
    again.house(5.0)
    again.tick()
    log = {each["key"]: each for each in again.log()}
    assert len(again.log()) == 2, "the violations went on"
    assert (log["house.bits"]["acknowledged_by"], log["house.bits"]["comment"]) == ("ann", "known")
    assert log["house.volts"]["is_over"] and log["house.volts"]["extreme"] == 20.0
    again.archive.close()


def test_a_number_is_not_used_twice(tmp_path, dictionary, ground):
    ground.house(12.0)
    (first,) = ground.desk.listed()["alarms"]
    with ground.archive.writing() as db:  # killed: nothing was written
        for table in ("_alarms", "_violations"):
            db.execute(f"DELETE FROM {table}")
    again = Ground(ground.archive.path, dictionary)
    again.house(12.0, time_ms=10**6)
    with pytest.raises(RequestError, match="raised anew"):
        again.desk.acknowledge({"house.volts": first["number"]}, "ann", "")
    again.archive.close()


def test_an_operator_acknowledges_all_or_none(ground):
    ground.house(12.0, bits=2)
    numbers = {each["key"]: each["number"] for each in ground.desk.listed()["alarms"]}
    with pytest.raises(RequestError):
        ground.desk.acknowledge(numbers | {"house.bits": 1}, "ann", "")
    assert set(ground.states().values()) == {"active"}
    ground.desk.acknowledge(numbers, "ann", "")
    assert set(ground.states().values()) == {"acknowledged"}


def test_many_at_once_are_a_few_lines(tmp_path):
    fields = ", ".join(
        f'{{ name = "v{k}", type = "u8", limits = [0, 0], description = "x" }}' for k in range(40)
    )
    path = tmp_path / "many.toml"
    path.write_text(f'name = "M"\n[down.many]\nid = 1\ndescription = "d"\nfields = [{fields}]\n')
    ground = Ground(tmp_path / "many.sqlite", load_dictionary(path))
    ground.row("many", (1,) * 40)
    assert len(ground.notes) == 6 and "35 more alarms raised: " in ground.notes[-1][1]
    assert len(ground.shown) == 1 and len(ground.shown[0]["alarms"]) == 40
    ground.archive.close()


def test_damaged_alarms_do_not_end_the_ground(tmp_path, dictionary, ground):
    ground.house(12.0)
    ground.tick()
    with ground.archive.writing() as db:
        db.execute("UPDATE _alarms SET alarm = '{\"key\": 3}'")
    again = Ground(ground.archive.path, dictionary)
    assert again.states() == {}
    again.house(12.0, time_ms=10**6)
    assert again.states() == {"house.volts": "active"}
    again.archive.close()


def test_messages_are_numbered_and_say_what_is_over(ground):
    ground.house(12.0)
    (alarm,) = ground.desk.listed()["alarms"]
    ground.desk.acknowledge({alarm["key"]: alarm["number"]}, "ann", "")
    ground.house(5.0)
    ground.desk.tick(Now(0, ground.at_s + 100))
    assert [each["version"] for each in ground.shown] == [1, 2, 3, 4]
    assert ground.shown[-1]["alarms"] == [{"key": "house.volts", "unit": "V", "description": "x"}]
    assert ground.desk.listed() == {
        "version": 4,
        "counts": ground.shown[-1]["counts"],
        "alarms": [],
    }


def test_a_region_that_the_satellite_does_not_have_gets_one_line(tmp_path):
    by_mode = '{ mode = "stabilisaton", states = ["science"], limits = [0, 1] }'
    added = (
        '[down.more]\nid = 90\ndescription = "d"\nfields = [{ name = "a", type = "u8", '
        f'description = "x", alarm = {{ by_mode = [{by_mode}] }} }}]\n'
    )
    (tmp_path / "more.toml").write_text(added, encoding="utf-8")
    shipped = Path("torquer/flight/software/chibis_m.toml").read_text(encoding="utf-8")
    software = tmp_path / "software.toml"
    software.write_text('packets = ["more.toml"]\n' + shipped, encoding="utf-8")
    asked = SatelliteTable(
        link="tcp:127.0.0.1:1", software=software, scenario=Path("examples/chibis_m_day.toml")
    )
    with pytest.raises(
        ScenarioError, match=r"software: down\.more\.fields.*'stabilisaton'"
    ) as error:
        make_satellite("sat", asked)
    assert len(str(error.value).splitlines()) == 1
    (tmp_path / "more.toml").write_text(added.replace("saton", "sation"), encoding="utf-8")
    found = make_satellite("sat", asked)
    limits = Limits(found.software.dictionary, found.names)
    (point,) = limits.points["more"]
    place = list(found.names.regions).index("stabilisation")
    state = list(found.names.regions["stabilisation"][1]).index("science")
    assert point.judge(2, {f"modes.state_{place}": state}).mode == "stabilisation science"
    assert point.judge(2, {f"modes.state_{place}": state + 1}).condition == "in order"
