"""Files of every format and their oddities: what is read, what is reported, what is refused."""

import pickle
import sqlite3
from pathlib import Path

import numpy as np
import pytest
from telemetry_session import session

from torquer.ground.telemetry.proposal.propose import propose_mapping
from torquer.ground.telemetry.reading.mapping import load_mapping, make_mapping, write_mapping
from torquer.ground.telemetry.reading.quantities import make_session
from torquer.ground.telemetry.reading.read import read

DATA = Path(__file__).parents[1] / "data"
PLAIN = {"time": "t", "columns": {"b_measured": ["x", "y", "z"]}, "units": {"b_measured": "nT"}}


def mapped(**keys):
    return make_mapping(PLAIN | keys)


def written(tmp_path, text, name="file.csv"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def rows_of(count, step_s=10):
    return [f"2012-03-04T10:{10 * k // 60:02d}:{step_s * k % 60:02d}Z" for k in range(count)]


def keys_of(found):
    return [each.key for each in found.findings]


def test_the_printed_gyro_rows_of_chibis_m():
    mapping = make_mapping(
        {
            "skip": 1,
            "separator": "whitespace",
            "time": ["date", "stamp"],
            "zone": "Europe/Moscow",
            "columns": {"omega_measured": ["wx", "wy", "wz"]},
            "units": {"omega_measured": "deg/s"},
        }
    )
    found = read(DATA / "chibis_m_gyro_2012_03_04.txt", mapping).data
    assert str(found["utc"].values[0]) == "2012-03-04T10:33:50.000000000"  # UTC+4 in that year
    np.testing.assert_allclose(np.degrees(found["omega_measured"][0]), [0.1738, 0.2119, 0.0803])
    assert found["time"].values.tolist() == [0.0, 31.0, 62.0, 93.0, 125.0, 155.0, 186.0]


def test_joined_numbers_comments_missing_numbers_and_milliseconds(tmp_path):
    lines = ["note"] * 18 + ["# t,b"]
    lines += [f"{1330857107000 + 1000 * k},{100 + k}\\{200}\\{-300}" for k in range(5)]
    lines[21] = "1330857109000,N/A"
    path = written(tmp_path, "\n".join(lines))
    mapping = mapped(
        skip=18, time_format="unix_ms", columns={"b_measured": "b"}, split={"b_measured": "\\"},
        order={"b_measured": ["y", "-x", "z"]},
    )  # fmt: skip
    found = read(path, mapping)
    np.testing.assert_allclose(found.data["b_measured"][0] * 1e9, [-200.0, 100.0, -300.0])
    assert np.isnan(found.data["b_measured"][2]).all() and "missing" in keys_of(found)
    assert str(found.data["utc"].values[0]).startswith("2012-03-04T10:31:47")


def test_oddities_are_reported(tmp_path):
    rng = np.random.default_rng(0)
    stamps = rows_of(40)
    stamps[10] = stamps[9]  # doubled
    stamps[20], stamps[21] = stamps[21], stamps[20]  # not in order
    del stamps[30:33]  # a gap
    lines = ["t,x,y,z,q1,q2,q3,q4"]
    for k, stamp in enumerate(stamps):
        x = 100.0 + 0.1 * rng.normal() + (50.0 if k == 15 else 0.0)
        q = "0,0,0,0" if k == 5 else "0,0,0,2" if k == 6 else "0,0,0,1"
        lines.append(f"{stamp},{x},{200 + 0.1 * rng.normal()},{0 if k == 3 else 300},{q}")
    mapping = mapped(
        columns=PLAIN["columns"] | {"q_measured": ["q1", "q2", "q3", "q4"]},
    )
    found = read(written(tmp_path, "\n".join(lines)), mapping)
    for key in (
        "not in order", "doubled stamps", "gaps", "jumps", "near-zero quaternions",
        "quaternions not of length 1",
    ):  # fmt: skip
        assert key in keys_of(found)
    assert found.data.sizes["time"] == 36
    assert np.isnan(found.data["q_measured"][5]).all()
    np.testing.assert_array_equal(found.data["q_measured"][6], [0.0, 0.0, 0.0, 1.0])


def test_quaternions_with_the_scalar_first_and_inverse(tmp_path):
    path = written(tmp_path, "t,a,b,c,d\n2012-03-04T10:00:00Z,0.5,0.5,0.5,-0.5\n")
    mapping = make_mapping(
        {
            "time": "t",
            "columns": {"q_measured": ["a", "b", "c", "d"]},
            "order": {"q_measured": "wxyz"},
            "inverse": ["q_measured"],
        }
    )
    q = read(path, mapping).data["q_measured"].values[0]
    np.testing.assert_array_equal(q, [-0.5, -0.5, 0.5, 0.5])


def test_pickles_and_unknown_files_are_refused(tmp_path):
    path = tmp_path / "data.csv"
    path.write_bytes(pickle.dumps({"t": [1]}))
    with pytest.raises(ValueError, match="a pickle, which would be executed"):
        read(path, mapped())
    (tmp_path / "a.pkl").write_bytes(pickle.dumps([1], protocol=0))
    with pytest.raises(ValueError, match="a pickle by its name"):
        read(tmp_path / "a.pkl", mapped())
    np.save(tmp_path / "a.npy", np.zeros(3))
    with pytest.raises(ValueError, match="an array of NumPy"):
        read(tmp_path / "a.npy", mapped())
    (tmp_path / "a.bin").write_bytes(b"\1\0\2")
    with pytest.raises(ValueError, match="binary data of an unknown format"):
        read(tmp_path / "a.bin", mapped())
    with pytest.raises(ValueError, match="FILE: must be a file"):
        read(tmp_path / "none.csv", mapped())


@pytest.mark.parametrize(
    ("text", "keys", "message"),
    [
        ("t,x,y,z\n2012-03-04T10:00:00,1,2,3\n", {}, "zone: must be given"),
        ("t,x,y,z\n2012-03-04T10:00:00Z,1,2,3\n", {"zone": "UTC"}, "zone: must not be given"),
        ("t,x,y,z\n2012-10-28T02:30:00,1,2,3\n", {"zone": "Europe/Berlin"}, "comes twice"),
        ("t,x,y,z\n,1,2,3\n", {}, "t: must be times of format 'iso'"),
        ("t,x,y,z\nyesterday,1,2,3\n", {}, "t: must be times of format 'iso'"),
        ("t,x,y,z\n2012-03-04T10:00:00Z,1,b,3\n", {}, "y: must hold numbers; received 'b'"),
        ("t,x,y\n2012-03-04T10:00:00Z,1,2\n", {}, "'z' must be a column of file.csv: t, x, y"),
        (
            "t,x\n2012-03-04T10:00:00Z,1/2\n",
            {"columns": {"b_measured": "x"}, "split": {"b_measured": "/"}},
            "x: must hold 3 numbers separated by '/'; received '1/2' in row 1",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_one_line(tmp_path, text, keys, message):
    with pytest.raises(ValueError, match=message):
        read(written(tmp_path, text), mapped(**keys))


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"units": {}}, "units.b_measured: must be one of T, mT, uT, nT"),
        ({"units": {"b_measured": "km"}}, "received 'km'"),
        ({"columns": {"field": ["x"]}}, "columns.field: must be one of b_measured"),
        ({"columns": {"b_measured": ["x", "y"]}}, "must name 3 columns; received 2"),
        ({"order": {"b_measured": ["x", "x", "z"]}}, "must name each axis once"),
        ({"zone": "Moscow"}, "'Europe/Moscow'; received 'Moscow'"),
        ({"separator": ""}, "must not be empty"),
        ({"split": {"q_measured": ","}}, "must have columns.q_measured too"),
        ({"inverse": ["b_measured"]}, "must name quaternions"),
        ({"colums": {}}, "colums"),
    ],
)
def test_mistakes_in_a_mapping(keys, message):
    with pytest.raises(ValueError, match=message):
        mapped(**keys)


def test_without_a_mapping_only_own_files(tmp_path):
    data, _ = session(0)
    data.to_netcdf(tmp_path / "own.nc", engine="h5netcdf")
    found = read(tmp_path / "own.nc").data
    np.testing.assert_array_equal(found["b_measured"], data["b_measured"])
    np.testing.assert_array_equal(found["utc"], data["utc"])
    with pytest.raises(ValueError, match="mapping: must be given for files that are not"):
        read(written(tmp_path, "t,x\n1,2\n"))
    with pytest.raises(ValueError, match="FILE: must be given"):
        read([])


def test_several_files_and_parquet(tmp_path):
    import pandas as pd

    stamps = pd.date_range("2012-03-04T10:00:00Z", periods=10, freq="10s")
    frame = pd.DataFrame({"t": stamps, "x": np.arange(10.0), "y": 2.0, "z": 3.0})
    frame[5:].to_parquet(tmp_path / "b.parquet")
    frame[:5].to_csv(tmp_path / "a.csv", index=False)
    found = read([tmp_path / "b.parquet", tmp_path / "a.csv"], mapped()).data
    np.testing.assert_allclose(found["b_measured"][:, 0] * 1e9, np.arange(10.0))


def test_ground_archive(tmp_path):
    from torquer.flight.software.software import load_software
    from torquer.ground.archive import Archive

    path = tmp_path / "satellite.sqlite"
    dictionary = load_software().dictionary
    Archive(path, dictionary).close()
    names = ("b_x", "b_y", "b_z")
    with sqlite3.connect(path) as db:
        for k in range(4):
            values = (1330857107000 + 1000 * k, k, 2, 0, 1.0 + k, 2.0, 3.0)
            db.execute(
                "INSERT INTO extended (_time_ms, _digest, _quality, _status, b_x, b_y, b_z) "
                "VALUES (?, ?, ?, ?, ?, ?, ?)",
                values,
            )
    mapping = mapped(
        packet="extended", time="_time_ms", time_format="unix_ms",
        columns={"b_measured": list(names)},
    )  # fmt: skip
    found = read(path, mapping).data
    np.testing.assert_allclose(found["b_measured"][:, 0] * 1e9, [1.0, 2.0, 3.0, 4.0])
    with pytest.raises(ValueError, match=r"packet: must be one of .*extended"):
        read(path, mapped())


def test_cdf(tmp_path):
    import cdflib
    from cdflib.cdfwrite import CDF

    file = CDF(tmp_path / "swarm.cdf", {"Compressed": 0})
    stamps = cdflib.cdfepoch.compute_epoch(
        [[2012, 3, 4, 10, 31, 47, 0], [2012, 3, 4, 10, 31, 57, 0]]
    )
    row = {"Num_Elements": 1, "Rec_Vary": True}
    file.write_var({"Variable": "Timestamp", "Data_Type": 31, "Dim_Sizes": []} | row, {}, stamps)
    field = {"Variable": "B_VFM", "Data_Type": 45, "Dim_Sizes": [3]} | row
    file.write_var(field, {"UNITS": "nT"}, np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]))
    file.close()
    mapping = propose_mapping(tmp_path / "swarm.cdf").mapping
    found = read(tmp_path / "swarm.cdf", mapping).data
    np.testing.assert_allclose(found["b_measured"][1] * 1e9, [4.0, 5.0, 6.0])
    assert str(found["utc"].values[1]) == "2012-03-04T10:31:57.000000000"


def test_a_proposed_mapping_reads_the_file(tmp_path):
    lines = ["# of the station", "# stamp,mag,status"]
    lines += [f"04-03-2012 14:3{k}:00.000,2400{k}\\-16415\\-11381,ok" for k in range(8)]
    path = written(tmp_path, "\n".join(lines))
    mapping, guesses, _ = propose_mapping(path)
    assert (mapping.split, mapping.units["b_measured"]) == ({"b_measured": "\\"}, "nT")
    assert any("CHECK THIS" in each for each in guesses)
    assert any("by the size of its numbers" in each for each in guesses)
    again = load_mapping(written(tmp_path, write_mapping(mapping, guesses), "m.toml"))
    assert again == mapping
    assert read(path, mapping).data.sizes["time"] == 8


def test_a_letter_within_a_word_does_not_name_a_quantity(tmp_path):
    """Rates of the body come first here; their names have a b, and "battery" begins like "att"."""
    head = ["time_utc"]
    head += [f"{name}_{axis}" for name in ("omega_body", "battery", "b_field") for axis in "xyz"]
    head += [f"gyro_bias_r_{axis}" for axis in "xyz"]
    rows = [f"2012-03-04T10:00:0{k}Z," + ",".join(["0.01"] * 12) for k in range(3)]
    mapping = propose_mapping(written(tmp_path, "\n".join([",".join(head), *rows]))).mapping
    assert mapping.columns == {
        "b_measured": ["b_field_x", "b_field_y", "b_field_z"],
        "omega_measured": ["omega_body_x", "omega_body_y", "omega_body_z"],
    }


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1,2\n3,4\n", "names: must be given for a file without a head"),
        ("", "FILE: must hold a head and rows; received .*, which holds none"),
        (
            "t,x,y,z\n",
            "FILE: must hold a head and rows; received .*, which holds one line, 't,x,y,z'",
        ),
        ("a,b\n1,2\n", "time: must be a column of time stamps"),
        ("time,b\n1e9,2\n", "must have columns whose names"),
    ],
)
def test_what_no_mapping_can_be_proposed_for(tmp_path, text, message):
    with pytest.raises(ValueError, match=message):
        propose_mapping(written(tmp_path, text))


def test_sessions_are_checked():
    utc = np.array(["2012-03-04T10:00:01", "2012-03-04T10:00:00"], dtype="datetime64[ns]")
    with pytest.raises(ValueError, match="utc: must ascend"):
        make_session(utc, {})
    with pytest.raises(ValueError, match="field: must be one of"):
        make_session(utc[1:], {"field": np.zeros(1)})
    with pytest.raises(ValueError, match=r"b_measured: must have shape \(1, 3\)"):
        make_session(utc[1:], {"b_measured": np.zeros(1)})


def test_rows_of_a_clock_that_was_not_set_are_left_out(tmp_path):
    """Three rows of 1970 chose the elements, and were the start of the session."""
    early = [f"1970-01-01T00:00:{k:02d}Z,1,2,3" for k in range(3)]
    rows = [f"{stamp},{k},2,3" for k, stamp in enumerate(rows_of(50))]
    found = read(written(tmp_path, "\n".join(["t,x,y,z", *early, *rows])), mapped())
    assert found.data.sizes["time"] == 50 and str(found.data["utc"].values[0])[:4] == "2012"
    (finding,) = (each for each in found.findings if each.key == "clock not set")
    assert finding.text == (
        "3 rows are more than 31 days from all others (1970-01-01) and left out: of a clock that "
        "was not set?"
    )


@pytest.mark.parametrize("years", [("2012", "2014"), tuple(map(str, range(1990, 2014, 2)))])
def test_campaigns_years_apart_are_one_session(tmp_path, years):
    """Two, or a dozen of which each has less than a tenth of the rows."""
    stamps = [stamp.replace("2012", year) for year in years for stamp in rows_of(20)]
    rows = [f"{stamp},{k},2,3" for k, stamp in enumerate(stamps)]
    found = read(written(tmp_path, "\n".join(["t,x,y,z", *rows])), mapped())
    assert found.data.sizes["time"] == 20 * len(years) and "clock not set" not in keys_of(found)
