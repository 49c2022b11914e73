"""One session in many dialects: each read as meant, or refused by a line that names the key."""

from datetime import timedelta

import numpy as np
import pytest
from telemetry_dialects import (
    B_NT,
    DIALECTS,
    PLAIN,
    ROWS,
    STAMPS,
    XYZ,
    grid,
    iso,
    long_rows,
    mapping,
)

from torquer.ground.telemetry.proposal.propose import propose_mapping
from torquer.ground.telemetry.reading.mapping import load_mapping, make_mapping
from torquer.ground.telemetry.reading.read import read


def put(folder, content, name="file.csv"):
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def check_session(found, rows=ROWS, tolerance_s=2e-3):
    assert found.sizes["time"] == rows
    expected = np.array([each.replace(tzinfo=None) for each in STAMPS], dtype="datetime64[ns]")
    off = np.abs(found["utc"].values[:ROWS] - expected)
    assert off.max() <= np.timedelta64(round(1e9 * tolerance_s), "ns")
    np.testing.assert_allclose(1e9 * found["b_measured"].values[:ROWS], B_NT, rtol=0, atol=0.06)


@pytest.mark.parametrize("dialect", DIALECTS, ids=lambda each: each.name)
def test_each_is_read_as_meant(tmp_path, dialect):
    path = put(tmp_path, dialect.content, dialect.file)
    check_session(read(path, make_mapping(dialect.mapping)).data, dialect.rows)


@pytest.mark.parametrize("dialect", [d for d in DIALECTS if d.init], ids=lambda each: each.name)
def test_init_finds_it_and_its_own_mapping_reads_it(tmp_path, dialect):
    path = put(tmp_path, dialect.content, dialect.file)
    proposal = propose_mapping(path)
    again = load_mapping(put(tmp_path, proposal.text, "m.toml"))
    assert again == proposal.mapping
    check_session(read(path, again).data)


def test_there_are_sixty():
    assert len({each.name for each in DIALECTS}) == len(DIALECTS) > 90


LATIN = grid(head=("time", "x \xe9", "y", "z")).encode("latin-1")
CASES = [
    (LATIN, mapping(["x", "y", "z"]), "encoding: must be given for text that is not UTF-8, such as "
     "'latin-1', 'cp1252' or 'cp1251'; received none for file.csv, byte 0xe9 in line 1"),
    (PLAIN, mapping(encoding="ascii") | {"time": "t"}, "mapping: 't' must be a column of file.csv"),
    ("t,x,y,z\n2012-03-04T10:00:00Z,\"1,234\",\"5,678\",\"9,012\"\n", mapping(list("xyz"), "t"),
     "decimal: must be given, as \",\" or \".\", for numbers such as '1,234'; received none"),
    (long_rows(), mapping(), "long: must name the columns of names and numbers of a file with a "
     'row for each number, such as {name = "parameter", value = "value"}; received none'),
    (long_rows(), mapping(["a", *XYZ[1:]], long={"name": "parameter", "value": "value"}),
     "mapping: 'a' must be in column 'parameter': mag_x, mag_y, mag_z"),
    ("time,x,y,z\n1330857143,1,2,3\n", mapping(list("xyz")),
     "time_format: must be given for stamps "
     "that are numbers, such as 'unix_s' (`torquer explain mapping`); received none for "
     "'1330857143'"),
    ("time,x,y,z\n2012-03-04 10:00:00 MSK,1,2,3\n", mapping(list("xyz")),
     "zone: must name the zone "
     "of 'MSK', such as 'Europe/Moscow', as abbreviations have several meanings; received none for "
     "'2012-03-04 10:00:00 MSK'"),
    ("time,x,y,z\n2012-03-04 10:00:00 MSK,1,2,3\n", mapping(list("xyz"), zone="Europe/Berlin"),
     "zone: must be one whose clock is called MSK in row 1; received Europe/Berlin"),
    ("time,x,y,z\n40972.5,1,2,3\n", mapping(list("xyz"), time_format="excel"),
     "zone: must be given, as the stamps state none; received none for '40972.5'"),
    ("time,x,y,z\n40972.5,1,2,3\n", mapping(list("xyz"), time_format="gps_s", zone="UTC"),
     "zone: must not be given, as gps_s counts from an instant; received UTC"),
    ("time,x,y,z\n\"Sun, 04 Mar 2012 10:32:23 GMT\",1,2,3\n", mapping(list("xyz"), zone="UTC"),
     "zone: must not be given, as the stamps state their own; received UTC"),
    ("time,x,y,z\n2012400,1,2,3\n", mapping(list("xyz"), time_format="year_day", zone="UTC"),
     "time: must be times of format 'year_day' (time_format); received '2012400' in row 1"),
    ("time,x,y,z\n04.03.2012,1,2,3\n", mapping(list("xyz"), zone="UTC"),
     "time: must be times of format 'iso' (time_format); received '04.03.2012' in row 1"),
    ("time,x,y,z\n1,1,2,3\n", mapping(list("xyz"), time_format="lunar"), "time_format: must be "
     "'iso', a count such as 'unix_s', or a format of strptime such as '%d.%m.%Y %H:%M:%S'; "
     "received 'lunar'"),
    ("time,x,x,z\n2012-03-04T10:00:00Z,1,2,3\n", mapping(["x", "x", "z"]),
     "names: must name each column once; received 'x' twice"),
    ("time,x,y,z\n2012-03-04T10:00:00Z,1,2,3,4\n", mapping(list("xyz")), "names: must name each of "
     "5 columns; received a head of 4 in file.csv (row 1 has more)"),
    (PLAIN + "a,b,c,d,e,f,g\n", mapping(), "skip_lines: must name lines that are no rows, as all "
     "must have the head's columns; received none for file.csv: row 25 has 7 cells"),
    ("time,x,y,z\n2012-03-04T10:00:00Z,1 uT,2 km,3\n", mapping(list("xyz")),
     "b_measured: must have units of T, mT, uT, nT, G, mG in its cells; received 'km'"),
    ("time,x,y,z\n2012-03-04T10:00:00Z,1,2 kg,3\n", mapping(list("xyz")),
     "y: must hold numbers; received '2 kg' in row 1 (`missing` lists texts"),
    ("time,x,y,z\n2012-03-04T10:00:00Z,1,2,3\n2012-03-04T10:00:01,1,2,3\n", mapping(list("xyz")),
     "zone: must be stated by all stamps or by none; received '2012-03-04T10:00:01' beside "
     "'2012-03-04T10:00:00Z'"),
    ("time,x,y,z\n", mapping(list("xyz")), "FILE: must hold rows below its head; received "),
    (b"time,x\n\0\1\2,3\n", mapping(list("xyz")), "FILE: must be text (CSV), Parquet, NetCDF, CDF "
     "or a ground archive, gzip or ZIP; received"),
    ("time,x,y,z\n2012-03-04T10:00:00Z,1,2,3\n", mapping(list("xyz"), only={"x": "7"}),
     "only.x: must be in a row; received '7'"),
    ("", mapping(), "FILE: must hold a head and rows; received"),
    ('{"a": 1}\n{"a": \n{"a": 2}\n', mapping(), "FILE: must hold JSON in each line; received "
     "'{\"a\": ' in line 2"),
]  # fmt: skip


@pytest.mark.parametrize(("content", "keys", "message"), CASES)
def test_what_needs_a_decision_is_one_line_that_names_the_key(tmp_path, content, keys, message):
    with pytest.raises(ValueError) as caught:
        read(put(tmp_path, content), make_mapping(keys))
    assert str(caught.value).startswith(message) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"encoding": "klingon"}, "encoding: must be one that Python knows, such as 'cp1251'"),
        ({"encoding": "base64"}, "encoding: must be one that Python knows, such as 'cp1251'"),
        ({"decimal": ";"}, 'decimal: must be "." or ","; received \';\''),
        ({"member": ""}, "member: must not be empty"),
        ({"skip_lines": [0]}, "skip_lines[0]: "),
        ({"scale": {"b_measured": [1.0, 2.0]}}, "scale.b_measured: must be a number or 3"),
        ({"offset": {"q_measured": 1.0}}, "offset.q_measured: must have columns.q_measured too"),
        ({"epoch": "2012-03-04"}, "epoch: must be a time with a zone"),
        ({"epoch": "2012-03-04T00:00:00Z"}, "epoch: must be left out for time_format 'iso'"),
        ({"time_format": "%H:%M:%S"}, "epoch: must be given for time_format '%H:%M:%S'"),
        ({"time_format": "since_s"}, "epoch: must be given for time_format 'since_s'"),
        ({"time_format": ["gps_weeks", "s"]}, "time_format: must be given for each of 1 columns"),
        ({"time": ["a", "b"], "time_format": ["gps_weeks", "x"]}, "time_format: must be a count"),
        ({"time": ["a", "b"], "time_format": ["year", "s"]}, "time_format: must be a count"),
        ({"time": ["a", "b"], "time_format": "gps_s"}, "time_format: must be given for each of 2"),
        ({"place": [91.0, 0.0, 0.0]}, "place: must be latitude (within 90 deg)"),
        ({"long": {"name": "a"}}, "long.value: must be given"),
    ],
)
def test_mistakes_in_keys(keys, message):
    with pytest.raises(ValueError) as caught:
        make_mapping(mapping() | keys)
    assert str(caught.value).startswith(f"mapping: {message}")


def test_one_absurd_number_is_one_row_named(tmp_path):
    lines = PLAIN.split("\n")
    for row, number in ((5, "1e308"), (9, "inf"), (12, "-1e300")):
        lines[row] = ",".join([*lines[row].split(",")[:2], number, "1"])
    found = read(put(tmp_path, "\n".join(lines)), make_mapping(mapping()))
    assert np.isnan(found.data["b_measured"].values[:, 1]).sum() == 3
    (text,) = (each.text for each in found.findings if each.key == "absurd numbers")
    assert text == (
        "b_measured: rows 5, 9, 12 have a number that no sensor sends, such as 1e+299 T: taken for "
        "missing"
    )


def test_few_odd_cells_and_stamps_are_named_and_do_not_end_a_file(tmp_path):
    lines = PLAIN.split("\n")
    lines[3] = lines[3].replace(lines[3].split(",")[1], "ERR", 1)
    lines[7] = "yesterday" + lines[7][20:]
    found = read(put(tmp_path, "\n".join(lines)), make_mapping(mapping()))
    by = {each.key: each.text for each in found.findings}
    assert by["no numbers"] == "mag_x: row 3 has no number but 'ERR': taken for missing"
    assert by["no time"] == "time: row 7 has no time, such as 'yesterday': left out"
    assert found.data.sizes["time"] == ROWS - 1


def test_a_leap_second_is_a_stamp_and_another_second_60_is_none(tmp_path):
    rows = [f"2016-12-31T23:59:{k:02d}Z,{k},0,0" for k in range(20, 61)]
    text = "\n".join(["time,mag_x,mag_y,mag_z", *rows])
    found = read(put(tmp_path, text), make_mapping(mapping()))
    assert str(found.data["utc"].values[-1]) == "2017-01-01T00:00:00.000000000"
    (finding,) = (each for each in found.findings if each.key == "leap second")
    assert finding.rows == 1
    found = read(put(tmp_path, text.replace("2016-12", "2015-12")), make_mapping(mapping()))
    assert "no time" in [each.key for each in found.findings]
    assert found.data.sizes["time"] == 40


def test_a_unit_row_that_says_another_unit_is_noted(tmp_path):
    text = PLAIN.replace("\n", "\nUTC,uT,uT,uT\n", 1)
    found = read(put(tmp_path, text), make_mapping(mapping()))
    assert "units.b_measured is nT, as stated; the file says uT" in [e.text for e in found.findings]


def test_cells_with_another_unit_than_the_mapping_are_noted(tmp_path):
    text = grid(";", number=lambda x: f"{x / 1e3:.4f} uT" if abs(x) > 9e3 else f"{x:.1f}")
    found = read(put(tmp_path, text), make_mapping(mapping()))
    np.testing.assert_allclose(1e9 * found.data["b_measured"].values, B_NT, atol=0.06)
    (finding,) = (each for each in found.findings if each.key == "another unit in the cells")
    rows = int((np.abs(B_NT) > 9e3).any(axis=1).sum())
    assert finding.rows == rows
    assert finding.text == (
        f"units.b_measured is nT, but cells of {rows} rows say uT, which is used"
    )


def test_a_cut_last_line_of_json_is_left_out(tmp_path):
    lines = [f'{{"time": "{iso(m)}", "x": 1, "y": 2, "z": 3}}' for m in STAMPS]
    found = read(
        put(tmp_path, "\n".join([*lines, '{"time": "20'])), make_mapping(mapping(list("xyz")))
    )
    assert found.data.sizes["time"] == ROWS
    assert "cut off" in [each.key for each in found.findings]


@pytest.mark.parametrize(("zone", "hours"), [("UTC", 0), ("+14:00", 14), ("Asia/Tokyo", 9)])
def test_a_clock_without_a_date_goes_on_at_midnight(tmp_path, zone, hours):
    """Every six hours from 4 March 10:32:23 UTC on, over several midnights."""
    moments = [STAMPS[0] + timedelta(hours=6 * k + hours) for k in range(ROWS)]
    rows = [f"{each:%H:%M:%S},1,2,3" for each in moments]
    first = f"{moments[0]:%Y-%m-%d}T12:00:00" + ("Z" if zone == "UTC" else f"+{hours:02d}:00")
    keys = mapping(list("xyz"), time_format="%H:%M:%S", zone=zone, epoch=first)
    found = read(put(tmp_path, "\n".join(["time,x,y,z", *rows])), make_mapping(keys)).data
    expected = [(STAMPS[0] + timedelta(hours=6 * k)).replace(tzinfo=None) for k in range(ROWS)]
    np.testing.assert_array_equal(found["utc"], np.array(expected, dtype="datetime64[ns]"))
