"""Export of damaged archives: all that can be read, a line on what cannot, never an end of it."""

import csv
import math
import random
import shutil
import sqlite3
from contextlib import closing

import numpy as np
import pytest
from exported_netcdf import read_exported

from torquer.flight.packets.dictionary import load_dictionary
from torquer.ground.archive import EPOCH_MS, Archive, ArchiveError, Row
from torquer.ground.export import FORMATS, export_archive

CHIBIS = load_dictionary("chibis_m")
NAMES = CHIBIS.down["extended"].names
COUNT = 3000
EVENTS = 5


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """An archive with telemetry of 3000 s and five events."""
    path = tmp_path_factory.mktemp("whole") / "sat.sqlite"
    with closing(Archive(path, CHIBIS)) as archive:
        archive.put(
            Row("extended", EPOCH_MS + 1000 * k, None, 2, 0, k, (*[k % 7] * 42, 1e3 * k))
            for k in range(COUNT)
        )
        archive.put(Row("event", EPOCH_MS + k, 5, 2, 1, k, (1, 32, k, 0.5)) for k in range(EVENTS))
        archive.put([Row("dump", EPOCH_MS, None, 2, 0, 1, (1, 2, 3, "fe" * 64))])
    with closing(sqlite3.connect(path)) as db:
        db.execute("PRAGMA journal_mode = DELETE")
    return path


@pytest.fixture
def damaged(whole, tmp_path):
    """A copy, changed by statements."""
    path = tmp_path / "damaged.sqlite"
    shutil.copy(whole, path)

    def change(*statements):
        with closing(sqlite3.connect(path)) as db:
            for statement in statements:
                db.execute(statement)
            db.commit()
        return path

    return change


def exported(path, out, format="netcdf", **keys):
    """(rows by packet, lines on what is lost)."""
    lost = []
    files = export_archive(path, out, format, lost=lost.append, **keys)
    assert all("\n" not in line and "https" not in line for line in lost)
    return {file.stem: rows for file, rows in files}, lost


def netcdf(out, packet="extended"):
    return read_exported(out / f"{packet}.nc")


ALL = {"extended": COUNT, "event": EVENTS, "dump": 1}


@pytest.mark.parametrize("format", FORMATS)
def test_a_whole_archive_loses_nothing(whole, tmp_path, format):
    assert exported(whole, tmp_path, format) == (ALL, [])


def test_csv_has_units_in_its_head_and_nothing_where_nothing_was_known(damaged, tmp_path):
    path = damaged(
        "UPDATE extended SET omega_x = NULL, omega_y = 9e999 WHERE _digest = 1",
        f"UPDATE extended SET _received_ms = {EPOCH_MS + 123} WHERE _digest = 0",
    )
    assert exported(path, tmp_path, "csv") == (ALL, [])
    with open(tmp_path / "extended.csv", encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    assert head[:4] == ["time", "received", "quality", "status"]
    assert "omega_x [deg/s]" in head and "aos_mode" in head
    place, other = head.index("omega_x [deg/s]"), head.index("omega_y [deg/s]")
    assert rows[0][:4] == ["2010-01-01T00:00:00.000Z", "2010-01-01T00:00:00.123Z", "2", "0"]
    assert rows[1][1] == rows[1][place] == "" and rows[1][other] == "inf"
    assert [float(row[place]) for row in rows[2:]] == [k % 7 for k in range(2, COUNT)]


@pytest.mark.parametrize("format", FORMATS)
@pytest.mark.parametrize(
    ("column", "value", "received"),
    [
        ("omega_x", "'x'", "'x'"),
        ("omega_x", "x'00ff'", "b'\\x00\\xff'"),
        ("aos_mode", "999", "999"),
        ("aos_mode", "-1", "-1"),
        ("aos_mode", "0.5", "0.5"),
        ("_received_ms", "'now'", "'now'"),
    ],
)
def test_one_wrong_value_is_missing(damaged, tmp_path, format, column, value, received):
    path = damaged(f"UPDATE extended SET {column} = {value} WHERE _digest = 11")
    rows, lost = exported(path, tmp_path, format)
    assert rows == ALL
    assert lost == [
        f"extended.{column}: must be of its type and range; received {received}: "
        "1 value is left out"
    ]
    if format == "netcdf":
        values = netcdf(tmp_path)[column.removeprefix("_").removesuffix("_ms")].values
        is_missing = np.isnat(values) if column[0] == "_" else np.isnan(values)
        assert is_missing[11] and (column[0] == "_" or is_missing.sum() == 1)


def test_wrong_quality_is_no_trust(damaged, tmp_path):
    path = damaged("UPDATE extended SET _quality = 999", "UPDATE event SET _status = 'x'")
    rows, lost = exported(path, tmp_path)
    assert rows == ALL and len(lost) == 2
    assert "extended._quality: must be" in lost[0] and f"{COUNT} values are written as 0" in lost[0]
    assert "written as 255" in lost[1]
    assert set(netcdf(tmp_path).quality.values) == {0}


def test_text_that_is_no_bytes_is_missing(damaged, tmp_path):
    path = damaged("UPDATE dump SET data = 'no' || char(0) || 'hex'")
    rows, lost = exported(path, tmp_path)
    assert rows == ALL and len(lost) == 1 and lost[0].startswith("dump.data: must be")
    assert netcdf(tmp_path, "dump").data.values.tolist() == [""]
    path = damaged("UPDATE dump SET data = CAST(x'ff' AS TEXT)")
    assert exported(path, tmp_path, "csv")[1][0].startswith("dump.data: must be")


def test_a_row_without_a_time_is_left_out(damaged, tmp_path):
    path = damaged("UPDATE event SET _time_ms = _time_ms + 0.5 WHERE _digest = 2")
    rows, lost = exported(path, tmp_path)
    assert rows == ALL | {"event": EVENTS - 1}
    assert lost[0].startswith("event._time_ms: must be of its type and range; received 12623")


@pytest.mark.parametrize("format", FORMATS)
@pytest.mark.parametrize(
    ("time", "received"),
    [
        ("'abc' || _time_ms", "'abc12623"),
        ("CAST('abc' || _time_ms AS BLOB)", "b'abc12623"),
        ("_time_ms + 0.25", "12623"),
        ("1e300", "1e+300"),
        ("-9e999", "-inf"),
        ("9000000000000000000 + _digest", "9000000000000000003"),
        ("-9000000000000000000 + _digest", "-8999999999999999997"),
        ("9223372036855", "9223372036855"),
        ("-9223372036855", "-9223372036855"),
    ],
)
def test_rows_whose_time_is_none_are_counted(damaged, tmp_path, format, time, received):
    path = damaged(f"UPDATE extended SET _time_ms = {time} WHERE _digest % 7 = 3")
    rows, lost = exported(path, tmp_path, format)
    out = sum(k % 7 == 3 for k in range(COUNT))
    assert rows == ALL | {"extended": COUNT - out} and len(lost) == 1
    assert lost[0].startswith(
        f"extended._time_ms: must be of its type and range; received {received}"
    )
    assert lost[0].endswith(f": {out} rows are left out")
    if format == "netcdf":
        assert netcdf(tmp_path).omega_x.values.tolist() == [
            k % 7 for k in range(COUNT) if k % 7 != 3
        ]


def test_times_at_the_ends_of_what_dates_tell_are_kept(damaged, tmp_path):
    path = damaged(
        "UPDATE event SET _time_ms = 9223372036854 WHERE _digest = 1",
        "UPDATE event SET _time_ms = -9223372036854 WHERE _digest = 2",
        "UPDATE event SET _received_ms = 9223372036855 WHERE _digest = 3",
    )
    rows, lost = exported(path, tmp_path)
    assert rows == ALL and len(lost) == 1 and "event._received_ms: must be" in lost[0]
    years = netcdf(tmp_path, "event").time.values.astype("datetime64[Y]").astype(int) + 1970
    assert years.tolist() == [1677, 2010, 2010, 2010, 2262]


def test_times_outside_the_interval_are_no_loss(damaged, tmp_path):
    path = damaged("UPDATE event SET _time_ms = 9e18 WHERE _digest = 1")
    span = {"start_ms": EPOCH_MS, "end_ms": EPOCH_MS + 10}
    assert exported(path, tmp_path, packets=["event"], **span) == ({"event": EVENTS - 1}, [])
    path = damaged("UPDATE event SET _time_ms = 'x' WHERE _digest = 1")  # may be in any interval
    rows, lost = exported(path, tmp_path, packets=["event"], **span)
    assert rows == {"event": EVENTS - 1} and lost[0].endswith("'x': 1 row is left out")


def test_a_table_of_which_no_row_has_a_time_is_told(damaged, tmp_path):
    path = damaged("UPDATE event SET _time_ms = 'x'")
    rows, lost = exported(path, tmp_path)
    assert rows == {"extended": COUNT, "dump": 1} and f"{EVENTS} rows are left out" in lost[0]


@pytest.mark.parametrize(
    ("statements", "line"),
    [
        (["DELETE FROM _about"], "must hold its dictionary; received none"),
        (["DROP TABLE _about"], "must hold its dictionary; received none"),
        (["UPDATE _about SET value = '{'"], "received another: it is no table of JSON"),
        (["UPDATE _about SET value = '{}'"], "received another: name: must be given"),
        (["UPDATE _about SET value = x'00'"], "must hold its dictionary; received another"),
        (
            [
                "DROP TABLE _about",
                "CREATE VIEW _about AS WITH RECURSIVE t(n) AS (SELECT 1 UNION ALL SELECT n + 1 "
                "FROM t) SELECT 'dictionary' AS key, n AS value FROM t WHERE n < 0",
            ],
            "must hold its dictionary; received none",
        ),
    ],
)
def test_without_a_dictionary_tables_are_written_as_they_are(damaged, tmp_path, statements, line):
    rows, lost = exported(damaged(*statements), tmp_path)
    assert rows == ALL and len(lost) == 1
    assert line in lost[0] and lost[0].endswith("tables are written as they are, without units")
    found = netcdf(tmp_path)
    assert found.omega_x.values.tolist() == [k % 7 for k in range(COUNT)]
    assert found.time.values[1] == np.datetime64("2010-01-01T00:00:01")


@pytest.mark.parametrize(
    ("change", "unnamed"),
    [
        ("json_remove(value, '$.down.extended')", "extended"),
        ("json_set(value, '$.down', json('{}'))", "extended, event, dump"),
        ("""'{"name": "other"}'""", "extended, event, dump"),
    ],
)
@pytest.mark.parametrize("format", FORMATS)
def test_tables_that_no_packet_names_are_written_as_they_are(
    damaged, tmp_path, change, unnamed, format
):
    path = damaged(f"UPDATE _about SET value = {change} WHERE key = 'dictionary'")
    line = (
        "archive: must hold the packets of its tables in its dictionary; received none of "
        "{}: tables are written as they are, without units"
    )
    assert exported(path, tmp_path, format) == (ALL, [line.format(unnamed)])
    extended = {"extended": COUNT}, [line.format("extended")]
    assert exported(path, tmp_path, format, packets=["extended"]) == extended
    assert exported(path, tmp_path, format, packets=["extended"], end_ms=0)[0] == {}
    if format == "netcdf":
        found = netcdf(tmp_path)
        assert found.omega_x.values.tolist() == [k % 7 for k in range(COUNT)]
        assert "units" not in found.omega_x.attrs


def test_lines_on_unnamed_tables_are_of_those_that_are_wanted(damaged, tmp_path):
    change = "json_remove(value, '$.down.extended')"
    path = damaged(f"UPDATE _about SET value = {change} WHERE key = 'dictionary'")
    assert exported(path, tmp_path, packets=["event"]) == ({"event": EVENTS}, [])
    path = damaged("DELETE FROM extended")  # nothing is lost of a table without rows
    assert exported(path, tmp_path) == ({"event": EVENTS, "dump": 1}, [])


ENDLESS = (
    "CREATE VIEW event AS WITH RECURSIVE t(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM t) SELECT "
    "n AS _time_ms, n AS _digest, n AS _received_ms, 2 AS _quality, 0 AS _status, n AS module_id, "
    "n AS code, n AS argument, n AS on_board_ms FROM t"
)


@pytest.mark.parametrize(
    ("statements", "received"),
    [
        (["DROP TABLE event"], "none"),
        (["DROP TABLE event", ENDLESS], "a view"),
        (["DROP TABLE event", "CREATE VIRTUAL TABLE event USING fts5(a)"], "a virtual table"),
    ],
)
def test_what_is_no_table_is_refused(damaged, tmp_path, statements, received):
    rows, lost = exported(damaged(*statements), tmp_path)
    assert rows == {"extended": COUNT, "dump": 1}
    assert lost == [f"event: must be a table by the name of a packet; received {received}"]


def test_missing_and_computed_columns(damaged, tmp_path):
    path = damaged(
        "ALTER TABLE event DROP COLUMN argument",
        "ALTER TABLE event ADD COLUMN argument INTEGER AS (length(hex(zeroblob(100000))))",
    )
    rows, lost = exported(path, tmp_path)
    assert rows == ALL and lost == ["event: must have its columns; received none of argument"]
    assert "argument" not in netcdf(tmp_path, "event")


def test_names_of_tables_cannot_leave_the_folder(damaged, tmp_path):
    path = damaged('CREATE TABLE "../escaped" (_time_ms INTEGER)', "DELETE FROM _about")
    out = tmp_path / "out"
    out.mkdir()
    rows, lost = exported(path, out, "csv")
    assert rows == ALL and not (tmp_path / "escaped.csv").exists()
    assert "../escaped: must be a table by the name of a packet; received a table" in lost


@pytest.mark.parametrize("seed", range(8))
def test_rows_around_damaged_pages_are_rescued(whole, tmp_path, seed):
    """Pages filled with noise: what comes out went in, from both sides of the damage."""
    draw, path = random.Random(seed), tmp_path / "damaged.sqlite"
    content = bytearray(whole.read_bytes())
    pages = len(content) // 4096
    for page in draw.sample(range(pages // 3, pages), 2):
        content[4096 * page : 4096 * (page + 1)] = draw.randbytes(4096)
    path.write_bytes(content)
    rows, lost = exported(path, tmp_path)
    assert lost and rows["extended"] > COUNT / 2
    found = netcdf(tmp_path)
    seconds = (found.time.values - np.datetime64("2010-01-01")) / np.timedelta64(1, "s")
    assert (np.diff(seconds) > 0).all()
    assert (found.omega_x.values == seconds % 7).all()


def test_damage_is_told_once_though_a_table_is_read_twice(damaged, tmp_path):
    """NetCDF needs floats where whole numbers are missing, here behind the damage."""
    path = damaged(f"UPDATE extended SET aos_mode = NULL WHERE _digest >= {COUNT - 5}")
    content = bytearray(path.read_bytes())
    place = len(content) // 8192 * 4096
    content[place : place + 4096] = bytes(4096)
    path.write_bytes(content)
    lost = exported(path, tmp_path)[1]
    assert np.isnan(netcdf(tmp_path).aos_mode.values[-5:]).all()
    assert lost and len(lost) == len(set(lost))


def last_page_of_the_list_of_tables(content):
    """Its place: the right child of the root of the tree, which is the first page."""
    assert content[100] == 5  # an inner page
    return 4096 * (int.from_bytes(content[108:112], "big") - 1)


def test_tables_before_a_damage_in_their_list_are_read(whole, tmp_path):
    path, content = tmp_path / "damaged.sqlite", bytearray(whole.read_bytes())
    place = last_page_of_the_list_of_tables(content)
    content[place : place + 4096] = b"\xa5" * 4096
    path.write_bytes(content)
    rows, lost = exported(path, tmp_path)
    assert rows["extended"] == COUNT and netcdf(tmp_path).omega_x.attrs["units"] == "deg/s"
    assert "archive: must be readable; received damage (" in lost[0]
    assert "in the list of its tables: those behind" in lost[0]
    named = [line.split(":")[0] for line in lost[1:]]  # a line each
    assert named and all(name in CHIBIS.down and name not in rows for name in named)


def test_a_file_that_ends_early_is_read_beside_an_empty_journal(whole, tmp_path):
    path, content = tmp_path / "cut.sqlite", whole.read_bytes()
    path.write_bytes(content[: 3 * len(content) // 4])
    expected = exported(path, tmp_path)
    assert expected[0]["extended"] > COUNT / 2
    (tmp_path / "cut.sqlite-wal").touch()
    assert exported(path, tmp_path) == expected


@pytest.mark.parametrize("share", [0.0, 0.001, 0.3, 0.9])
def test_a_file_that_ends_early_or_is_none(whole, tmp_path, share):
    path = tmp_path / "cut.sqlite"
    content = whole.read_bytes()
    path.write_bytes(content[: math.floor(share * len(content))])
    try:
        rows, lost = exported(path, tmp_path, "csv")
        assert "archive: must be whole; received" in lost[0] and len(lost) > 1
        # the upper pages of the tree of a table may stand behind its rows
        assert rows.get("extended", 0) > COUNT / 2 or share < 0.5
    except ArchiveError as error:
        assert str(error).startswith("archive: must be an archive; received") and share < 0.2
        assert "\n" not in str(error)


def test_noise_anywhere_ends_in_lines(whole, tmp_path):
    """Single bytes changed anywhere in the file: never another exception, never without end."""
    content = whole.read_bytes()
    for seed in range(60):
        draw, path = random.Random(seed), tmp_path / "noise.sqlite"
        changed = bytearray(content)
        for _ in range(draw.choice((1, 10, 200))):
            changed[draw.randrange(16, len(changed))] = draw.randrange(256)
        path.write_bytes(changed)
        try:
            exported(path, tmp_path, "csv")
        except ArchiveError as error:
            assert "\n" not in str(error)
