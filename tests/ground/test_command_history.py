"""What became of commands: filters, and tables that are no formulas."""

import csv
import io
from contextlib import closing

import pytest
from archived import commands_on

from torquer.computer.names import Names
from torquer.flight.packets.commands import Sent
from torquer.flight.packets.dictionary import load_dictionary
from torquer.ground.archive import Archive, read_only
from torquer.ground.command_history import Wanted, commands_csv, find_commands

NOW = 1_800_000_000_000


@pytest.fixture(scope="module")
def db(tmp_path_factory):
    """Six commands, made a second apart: 1 and 2 of Ada, of which 2 was cancelled."""
    path, dictionary = tmp_path_factory.mktemp("g") / "sat.sqlite", load_dictionary("chibis_m")
    with closing(Archive(path, dictionary)) as archive:
        commands = commands_on(archive, dictionary, Names({}, (), {}, {}, ()))
        for n in range(1, 7):
            by = "Ada (stated), page" if n < 3 else '=HYPERLINK("x"), command line'
            name, values = ("plan_clear", {}) if n > 4 else ("report_status", {"module_id": n})
            commands.order(Sent(at_s=0.0, command=name, values=values), by, NOW + 1000 * n, None)
        commands.cancel(2, "Ben", NOW)
        for number in (4, 5):
            commands.sent(number, NOW + 9_876)
        with closing(read_only(path)) as read:
            yield read


@pytest.mark.parametrize(
    ("asked", "numbers"),
    [
        ({}, [6, 5, 4, 3, 2, 1]),
        ({"command": "STATUS"}, [4, 3, 2, 1]),
        ({"command": "%"}, []),
        ({"by": "ada"}, [2, 1]),
        ({"state": "cancelled"}, [2]),
        ({"state": "sent", "command": "plan"}, [5]),
        ({"start": NOW + 2000, "end": NOW + 4000}, [4, 3, 2]),
        ({"size": 2}, [6, 5]),
        ({"size": 2, "before": 5}, [4, 3]),
    ],
)
def test_commands_are_found_by_what_is_asked(db, asked, numbers):
    assert [each["id"] for each in find_commands(db, Wanted(**asked))] == numbers


def test_who_cancelled_a_command_is_in_its_reason(db):
    (found,) = find_commands(db, Wanted(state="cancelled"))
    assert found["reason"] == "cancelled before it was sent, by Ben"


def test_a_table_has_times_and_no_formulas(db):
    rows = list(csv.DictReader(io.StringIO(commands_csv(find_commands(db, Wanted())))))
    assert [row["id"] for row in rows] == ["6", "5", "4", "3", "2", "1"]
    assert rows[2] == {
        "id": "4", "request": "4", "command": "report_status", "values": '{"module_id": 4}',
        "state": "sent", "reason": "", "made_by": '\'=HYPERLINK("x"), command line',
        "made": "2027-01-15T08:00:04.000Z", "sent": "2027-01-15T08:00:09.876Z",
        "received": "", "answered": "", "execute": "",
    }  # fmt: skip


def test_what_is_known_by_now_takes_the_place_of_what_is_stored(db):
    """A command that has become another since, one that is not stored yet; also without archive."""
    stored = {each["id"]: each for each in find_commands(db, Wanted())}
    newer = [stored[3] | {"state": "executed"}, stored[6] | {"id": 7, "state": "waiting"}]

    def numbers(archive, **asked):
        return [each["id"] for each in find_commands(archive, Wanted(**asked), newer)]

    assert numbers(db) == [7, 6, 5, 4, 3, 2, 1] and numbers(db, size=2) == [7, 6]
    assert numbers(db, state="executed") == [3] and 3 not in numbers(db, state="waiting")
    assert numbers(None) == [7, 3] and numbers(None, before=7) == [3]
    assert numbers(None, command="STATUS") == [3] and numbers(None, by="ada") == []
    assert numbers(None, start=newer[1]["made_ms"]) == [7] and numbers(None, end=0) == []
