"""`telemetry init`: readings ranked by names, units, dates and the field along the orbit."""

from datetime import datetime, timedelta

import numpy as np
import pandas as pd
import pytest
from telemetry_session import START, TLE, session

from torquer.cli.answer import answer
from torquer.ground.telemetry.proposal import guess_time
from torquer.ground.telemetry.proposal.column_names import group_columns, parse_name
from torquer.ground.telemetry.proposal.propose import NoProposal, propose_mapping
from torquer.ground.telemetry.reading.mapping import load_mapping
from torquer.ground.telemetry.reading.read import read

ROWS = 60


@pytest.fixture
def orbit(tmp_path):
    path = tmp_path / "c.tle"
    path.write_text("\n".join(TLE))
    return path


def put(folder, head, stamp, more=None, factor=1e9):
    """A file of the synthetic session; `more(k)`: cells after the stamp, before the field."""
    data, _ = session(0, rows=ROWS)
    lines = [head]
    for k, row in enumerate(factor * data["b_measured"].values):
        moment = START + timedelta(seconds=31.0 * k)
        cells = [stamp(moment), *(more(k) if more else ()), *(f"{each:.4f}" for each in row)]
        lines.append(",".join(cells))
    path = folder / "pass.csv"
    path.write_text("\n".join(lines))
    return path


def iso(moment):
    return moment.strftime("%Y-%m-%dT%H:%M:%SZ")


def count_from(*date, leap_s=0.0, tick_s=1.0):
    from datetime import UTC, datetime

    start = datetime(*date, tzinfo=UTC)
    return lambda moment: f"{((moment - start).total_seconds() + leap_s) / tick_s:.9f}"


HEAD = "t,mag_x_nT,mag_y_nT,mag_z_nT"


@pytest.mark.parametrize(
    ("stamp", "form"),
    [
        (count_from(1980, 1, 6, leap_s=15), "gps_s"),
        (count_from(2000, 1, 1, 12, leap_s=66.184), "j2000_s"),
        (count_from(2000, 1, 1, leap_s=34), "tai_2000_s"),
        (count_from(2000, 1, 1), "utc_2000_s"),
        (count_from(1904, 1, 1), "1904_s"),
        (count_from(1900, 1, 1), "1900_s"),
        (count_from(1899, 12, 30, tick_s=86400.0), "excel"),
        (count_from(2006, 1, 1, leap_s=1), "beidou_s"),
        (lambda moment: moment.strftime("%m/%d/%Y %H:%M:%S"), "%m/%d/%Y %H:%M:%S"),
        (lambda moment: moment.strftime("%d/%m/%Y %H:%M:%S"), "%d/%m/%Y %H:%M:%S"),
    ],
)
def test_the_orbit_tells_formats_that_no_name_does(tmp_path, orbit, stamp, form):
    path = put(tmp_path, HEAD, stamp)
    found = propose_mapping(path, orbit)
    assert found.mapping.time_format == form
    first = read(path, found.mapping).data["utc"].values[0]
    assert abs(first - np.datetime64("2012-03-04T10:31:47", "ns")) < np.timedelta64(2, "ms")
    (fits,) = (each for each in found.guesses if "fits the orbit's" in each)
    assert float(fits.split()[-2]) < 600.0


def test_the_orbit_tells_the_zone(tmp_path, orbit):
    def stamp(moment):
        return (moment + timedelta(hours=4)).strftime("%Y-%m-%d %H:%M:%S")

    path = put(tmp_path, HEAD, stamp)
    assert propose_mapping(path).mapping.zone == "UTC"
    found = propose_mapping(path, orbit)
    assert found.mapping.zone == "+04:00"
    assert "its zone is +04:00, by the field along the orbit: the stamps state none" in (
        found.guesses
    )
    assert any("zone = 'UTC'" in each and "nT)" in each for each in found.others)


def test_runners_up_stand_in_the_file_as_comments(tmp_path, orbit):
    path = put(tmp_path, HEAD, count_from(2000, 1, 1, leap_s=34))
    found = propose_mapping(path, orbit)
    assert any("utc_2000_s" in each and "nT)" in each for each in found.others)
    for each in found.others:
        assert f"# also possible: {each}\n" in found.text
    assert len(propose_mapping(path).others) > 1


def test_neither_a_magnetorquer_nor_a_model_is_a_magnetometer(tmp_path, orbit):
    def others(k):
        return ["0.1", "0.2", "0.3", "20000", "-15000", "3000"]

    head = "utc," + ",".join(f"{n}_{a}" for n in ("mtq", "b_igrf", "b") for a in "xyz")
    for given in (None, orbit):
        found = propose_mapping(put(tmp_path, head, iso, others), given).mapping
        assert found.columns == {"b_measured": ["b_x", "b_y", "b_z"],
                                 "dipole_body": ["mtq_x", "mtq_y", "mtq_z"]}  # fmt: skip


def test_a_file_without_a_whole_magnetometer_says_so(tmp_path):
    def others(k):
        return [
            f"{20.5 + 0.1 * k}",
            f"{-15.1 + 0.2 * k}",
            *(f"{(k + each) % 7}.5" for each in (1, 2, 3)),
        ]

    head = "OBT_UTC,MTM_X_uT,MTM_Y_uT,GYR_X_dps,GYR_Y_dps,GYR_Z_dps"
    rows = [",".join([iso(START + timedelta(seconds=20 * k)), *others(k)]) for k in range(ROWS)]
    path = tmp_path / "a.csv"
    path.write_text("\n".join([head, *rows]))
    found = propose_mapping(path)
    assert "b_measured" not in found.mapping.columns
    assert any(each.startswith("b_measured is none") for each in found.guesses)


def test_a_model_is_taken_where_there_is_nothing_else(tmp_path):
    found = propose_mapping(put(tmp_path, "utc,b_igrf_x,b_igrf_y,b_igrf_z", iso))
    assert found.mapping.columns["b_measured"] == ["b_igrf_x", "b_igrf_y", "b_igrf_z"]


@pytest.mark.parametrize(
    ("unit", "factor"), [("nT", 1e9), ("uT", 1e6), ("mG", 1e7), ("G", 1e4), ("T", 1.0)]
)
def test_units_by_the_strength(tmp_path, unit, factor):
    data, _ = session(0, rows=ROWS)
    rows = [f"{iso(START + timedelta(seconds=31 * k))},{x:.9e},{y:.9e},{z:.9e}"
            for k, (x, y, z) in enumerate(factor * data["b_measured"].values)]  # fmt: skip
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["utc,bx,by,bz", *rows]))
    found = propose_mapping(path)
    assert found.mapping.units == {"b_measured": unit}
    assert f"the unit of b_measured is {unit}, by the size of its numbers" in found.guesses


@pytest.mark.parametrize(
    ("cell", "unit"),
    [("{:,.0f} nT", "nT"), ("{:.1f}nT", "nT"), ("{:.0f} nanotesla", "nT")],
)
@pytest.mark.parametrize("factor", [1.0, 1e-3])
def test_the_unit_that_cells_state_counts_more_than_their_size(tmp_path, cell, unit, factor):
    data, _ = session(0, rows=ROWS)
    rows = [f"{iso(START + timedelta(seconds=31 * k))};" + ";".join(map(cell.format, row))
            for k, row in enumerate(1e9 * factor * data["b_measured"].values)]  # fmt: skip
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["utc;bx;by;bz", *rows]))
    found = propose_mapping(path)
    assert found.mapping.units == {"b_measured": unit}
    assert not any("the unit of" in each for each in found.guesses)
    sign = found.mapping.decimal
    assert any("decimal sign of b_measured" in each for each in found.guesses) == (sign is not None)


def test_cells_in_units_of_another_quantity_are_no_field(tmp_path):
    rows = [f"{iso(START + timedelta(seconds=31 * k))};{k}.5 A;20000.5 A;3.5 A;{k}.1;2e4;3"
            for k in range(ROWS)]  # fmt: skip
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["utc;mag_sens_x;mag_sens_y;mag_sens_z;bx;by;bz", *rows]))
    assert propose_mapping(path).mapping.columns["b_measured"] == ["bx", "by", "bz"]


@pytest.mark.parametrize(
    "head",
    ["year,month,day,hour,minute,second", "YYYY,MM,DD,hh,mi,ss", "Yr,Mon,Day,Hr,Min,Sec",
     "id,year,month,day,hours,minutes,seconds"],
)  # fmt: skip
@pytest.mark.parametrize("second", ["%S", "%S.%f"])
def test_a_date_with_a_column_for_each_part(tmp_path, head, second):
    first = "7," if head.startswith("id") else ""

    def stamp(moment):
        return first + moment.strftime(f"%Y,%m,%d,%H,%M,{second}")

    found = propose_mapping(put(tmp_path, f"{head},mag_x_nT,mag_y_nT,mag_z_nT", stamp))
    path = tmp_path / "pass.csv"
    utc = read(path, found.mapping).data["utc"].values
    assert str(utc[0]).startswith("2012-03-04T10:31:47.000") and len(utc) == ROWS
    assert found.mapping.columns["b_measured"] == ["mag_x_nT", "mag_y_nT", "mag_z_nT"]


OTHERS = [
    ("wx_deg_s,wy_deg_s,wz_deg_s", "1,2,3",
     {"omega_measured": ["wx_deg_s", "wy_deg_s", "wz_deg_s"]}),
    ("omega_orbital_x,omega_orbital_y,omega_orbital_z", "1,2,3", {}),
    ("temp_cpu", "40", {}),
    ("temp_mag [degC]", "12", {"temperature": "temp_mag [degC]"}),
    ("temperature", "12", {"temperature": "temperature"}),
    ("q1,q2,q3,q4", "0.5,0.5,0.5,0.5", {"q_measured": ["q1", "q2", "q3", "q4"]}),
    ("q_orbital_1,q_orbital_2,q_orbital_3,q_orbital_4", "0.5,0.5,0.5,0.5", {}),
    ("q_target_1,q_target_2,q_target_3,q_target_4", "0.5,0.5,0.5,0.5", {}),
    ("lat,lon,alt_km", "51.5,37.6,500", {"position_geodetic": ["lat", "lon", "alt_km"]}),
    ("ecef_x_km,ecef_y_km,ecef_z_km", "0,0,6900",
     {"position_ecef": ["ecef_x_km", "ecef_y_km", "ecef_z_km"]}),
    ("teme_x_km,teme_y_km,teme_z_km", "0,0,6900",
     {"position_teme": ["teme_x_km", "teme_y_km", "teme_z_km"]}),
    ("pos_x_km,pos_y_km,pos_z_km", "0,0,6900",
     {"position_j": ["pos_x_km", "pos_y_km", "pos_z_km"]}),
    ("sun_x,sun_y,sun_z", "0,0,1", {"sun_measured": ["sun_x", "sun_y", "sun_z"]}),
    ("sun_temp_x,sun_temp_y,sun_temp_z", "0,0,1", {}),
    ("sun_eci_x,sun_eci_y,sun_eci_z", "0,0,1", {}),
    ("mag_eci_x,mag_eci_y,mag_eci_z", "20000,0,1", {}),
    ("b_orbital_x,b_orbital_y,b_orbital_z", "20000,0,1", {}),
    ("battery_x,battery_y,battery_z", "7,7,7", {}),
    ("motor_1_rpm,motor_2_rpm,motor_3_rpm", "1,2,3", {}),
]  # fmt: skip


@pytest.mark.parametrize(("names", "cells", "columns"), OTHERS)
def test_other_columns_are_what_they_say(tmp_path, names, cells, columns):
    path = put(tmp_path, f"utc,{names},mag_x,mag_y,mag_z", iso, lambda k: cells.split(","))
    found = dict(propose_mapping(path).mapping.columns)
    assert found.pop("b_measured") == ["mag_x", "mag_y", "mag_z"]
    assert found == columns


def test_a_dipole_of_4_a_m2_is_no_milliampere(tmp_path):
    path = put(tmp_path, "utc,dip_x,dip_y,dip_z,mag_x,mag_y,mag_z", iso, lambda k: ["4", "0", "0"])
    assert propose_mapping(path).mapping.units["dipole_body"] == "A m^2"


@pytest.mark.parametrize(
    ("column", "stem", "axis", "unit"),
    [
        ("mag_x_nT", "mag", "x", "nT"), ("MagX [\u00b5T]", "mag", "x", "uT"), ("bx", "b", "x", ""),
        ("gyro.z (deg/s)", "gyro", "z", "deg/s"), ("/SAT/mag_y", "sat_mag", "y", ""),
        ("x_mag", "mag", "x", ""), ("b_x_t", "b", "x", "T"), ("q3", "q", "3", ""),
        ("wx_deg_s", "w", "x", "deg/s"), ("dipole_x_A_m2", "dipole", "x", "A m^2"),
        ("temperature", "temperature", "", ""), ("MAG.FIELD[0]", "mag_field", "0", ""),
    ],
)  # fmt: skip
def test_what_names_say(column, stem, axis, unit):
    assert parse_name(column) == (column, stem, axis, unit)


def test_groups_need_all_axes():
    assert group_columns(["a_x", "a_y", "b_x", "b_y", "b_z"], 3)[0].columns == ("b_x", "b_y", "b_z")
    assert not group_columns(["a_x", "a_y"], 3)
    assert group_columns(["q0", "q1", "q2", "q3"], 4)[0].axes == "0123"


#: What no mapping can be proposed for, and the reason.
GIVEN_UP = [
    ("uptime_s,mag_x,mag_y,mag_z\n" + "".join(f"{k},20000,1000,{k}\n" for k in range(20)),
     "time: must be a column of time stamps"),
    ("1,2\n3,4\n", "names: must be given for a file without a head"),
    ("utc,a,b\n2012-03-04T10:00:00Z,1,2\n2012-03-04T10:01:00Z,1,2\n",
     "FILE: must have columns whose names"),
    ("utc,mag_x,mag_y,mag_z\n"
     + "".join(f"2012-03-04T10:{k}:00Z,0,0,{k}00000\n" for k in range(10, 20)),
     "scale: must be given, with the unit, for mag_x, mag_y, mag_z"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "reason"), GIVEN_UP)
def test_a_skeleton_where_it_gives_up(tmp_path, monkeypatch, capsys, text, reason):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(NoProposal) as caught:
        propose_mapping("a.csv")
    assert str(caught.value).startswith(reason)
    assert answer(["telemetry", "init", "a.csv"]) == 2
    printed = capsys.readouterr().err
    assert printed.count("\n") == 1 and "(a skeleton to fill in: a.mapping.toml)" in printed
    skeleton = (tmp_path / "a.mapping.toml").read_text()
    assert skeleton.startswith(f"# No mapping could be proposed: {reason}")
    if not reason.startswith("names"):
        assert f"# column: {text.partition(',')[0]}" in skeleton
    with pytest.raises(ValueError, match="mapping"):
        read("a.csv", load_mapping("a.mapping.toml"))


def test_the_command_with_an_orbit(tmp_path, orbit, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    put(tmp_path, HEAD, count_from(1980, 1, 6, leap_s=15))
    assert not answer(["telemetry", "init", "pass.csv", "--orbit", "c.tle"])
    printed = capsys.readouterr().out
    assert "guessed: its numbers are gps_s" in printed and "--orbit c.tle`" in printed
    assert answer(["telemetry", "init", "pass.csv", "--orbit", "none.tle", "--out", "b.toml"]) == 2
    assert "--orbit: must be a readable file" in capsys.readouterr().err


def test_elements_of_another_year_are_said_to_be_far_away(tmp_path, orbit):
    path = put(tmp_path, HEAD, lambda m: iso(m + timedelta(days=2000)))
    found = propose_mapping(path, orbit)
    assert str(read(path, found.mapping).data["utc"].values[0])[:4] == "2017"
    assert not any("fits the orbit's" in each for each in found.guesses)


def test_an_archive_states_frames_units_and_what_is_measured(tmp_path):
    import sqlite3
    from contextlib import closing

    from torquer.flight.software.software import load_software
    from torquer.ground.archive import Archive

    path = tmp_path / "sat.sqlite"
    Archive(path, load_software().dictionary).close()
    groups = {"q_orbital": 4, "q_inertial": 4, "omega_orbital": 3, "omega": 3, "b": 3, "gyro": 3,
              "sun": 3, "dipole": 3}  # fmt: skip
    parts = {3: "xyz", 4: "0123"}
    with closing(sqlite3.connect(path)) as db:
        known = {row[1] for row in db.execute("PRAGMA table_info(extended)")}
        names = [f"{n}_{a}" for n, size in groups.items() for a in parts[size]]
        names = [each if each in known else None for each in names]
        assert None not in names
        for k in range(20):
            values = [0.5] * 8 + [0.1] * 6 + [20000.0, 1000.0 * k, 5.0] + [0.1] * 3 + [0, 0, 1] + (
                [4.0, 0.0, 0.0])  # fmt: skip
            marks = ", ".join("?" * (4 + len(values)))
            db.execute(
                f"INSERT INTO extended (_time_ms, _digest, _quality, _status, {', '.join(names)}) "
                f"VALUES ({marks})",
                (1330857107000 + 1000 * k, k, 2, 0, *values),
            )
        db.commit()
    found = propose_mapping(path)
    columns = found.mapping.columns
    assert columns["b_measured"] == ["b_x", "b_y", "b_z"]
    assert columns["omega_measured"] == ["gyro_x", "gyro_y", "gyro_z"]
    assert columns["q_measured"] == [f"q_inertial_{k}" for k in range(4)]
    assert found.mapping.units == {"b_measured": "nT", "omega_measured": "deg/s",
                                   "dipole_body": "A m^2"}  # fmt: skip
    assert "temperature" not in columns and not any("by the size" in g for g in found.guesses)
    assert read(path, found.mapping).data.sizes["time"] == 20


@pytest.mark.parametrize(
    "names",
    [
        ("BX", "BY", "BZ"), ("Bx(nT)", "By(nT)", "Bz(nT)"), ("mag0", "mag1", "mag2"),
        ("MAG_X_CALIB", "MAG_Y_CALIB", "MAG_Z_CALIB"), ("mtm1.x", "mtm1.y", "mtm1.z"),
        ("magneticFieldX", "magneticFieldY", "magneticFieldZ"), ("B1", "B2", "B3"),
        ("\u043c\u0430\u0433\u043d X", "\u043c\u0430\u0433\u043d Y", "\u043c\u0430\u0433\u043d Z"),
        ("A.FIELD[0]", "A.FIELD[1]", "A.FIELD[2]"), ("hx", "hy", "hz"), ("x_mag", "y_mag", "z_mag"),
        ("X [nT]", "Y [nT]", "Z [nT]"), ("fgm_x", "fgm_y", "fgm_z"),
    ],
)  # fmt: skip
def test_names_of_a_magnetometer(tmp_path, names):
    found = propose_mapping(put(tmp_path, ",".join(["utc", *names]), iso)).mapping
    assert found.columns == {"b_measured": [*names]} and found.units == {"b_measured": "nT"}


@pytest.mark.parametrize("form", [each for each in guess_time._FORMS if "%j" not in each][::17])
def test_a_format_is_found_of_its_own_stamps(form):
    start = datetime(2012, 10, 21, 13, 5, 9, 250_000)
    stamps = [
        (start + timedelta(seconds=37.0 * k)).strftime(form.replace("%z", "+03:00"))
        for k in range(12)
    ]
    assert form in guess_time._formats(pd.Series(stamps))
