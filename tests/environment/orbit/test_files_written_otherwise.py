"""Files as others write them: what means the same is the same orbit, what means nothing is told."""

import json

import numpy as np
import pytest
from environment.orbit.orbit_files import ISS, START, csv_text, gcrf, oem_text, sp3_text, times
from environment.orbit.test_elements_in_full import message_of
from environment.orbit.test_from_file import omm_fields, orbit_of, refused

from torquer.base.conventions import MU_EARTH_M3_S2
from torquer.base.explain import ScenarioError, validate_tables
from torquer.base.time import parse_utc
from torquer.environment.along_orbit import Environment, OrbitEnvironment
from torquer.environment.ephemeris import EphemerisModels
from torquer.environment.orbit.files.stamps import gps_instant, read_stamp
from torquer.environment.orbit.files.states import axes_named

INSTANTS = times(1200.0)
OEM, UTC_CSV = oem_text(INSTANTS), csv_text(INSTANTS, scale="UTC")
TLE = "\n".join(ISS.tle)


@pytest.mark.parametrize(
    "axes", ("IGb14", "IGb08", "IGS97", "IGSR3", "SLR14", "SLRF1", "ITR20", "ITRF2", "WGS84")
)
def test_realisations_of_the_earths_axes_are_one_in_sp3(tmp_path, axes):
    orbit = orbit_of(tmp_path, "a.sp3", sp3_text(INSTANTS, axes=axes))
    assert np.linalg.norm(orbit.state([600.0], START)[0] - gcrf([600.0])[0]) < 1e-3


@pytest.mark.parametrize(
    ("name", "axes"),
    (
        ("ITRF2020", "ECEF"), ("ITRF-97", "ECEF"), ("itrf20", "ECEF"), ("SLRF2014", "ECEF"),
        ("WGS-84", "ECEF"), ("WGS84(G2139)", "ECEF"), ("TDR", "ECEF"), ("DTRF2020", "ECEF"),
        ("ICRF3", "GCRF"), ("J2000", "EME2000"), ("TEMEOFDATE", "TEME"),
    ),
)  # fmt: skip
def test_axes_by_the_names_that_files_have(name, axes):
    assert axes_named(name) == axes


@pytest.mark.parametrize("name", ("WGS72", "PZ-90", "ETRF2000", "TOD", "TEME1", "IGNORE", ""))
def test_other_axes_are_refused(name):
    with pytest.raises(ValueError, match=r"or a realisation of ITRS such as ITRF2020, .*received"):
        axes_named(name)


@pytest.mark.parametrize(
    ("name", "text"),
    (
        ("comment.oem", "COMMENT from somewhere\n\n" + OEM),
        ("blank.oem", "\ufeff\n \n" + OEM),
        ("scale.oem", OEM.replace("TIME_SYSTEM = UTC", "TIME_SYSTEM = utc")),
        ("small.oem", OEM.replace(".000000 ", ".000000z ").replace("01T1", "01t1")),
        ("days.oem", OEM.replace("2025-07-01T", "2025-182T")),
        ("more.oem", "".join(x + " 0 0 0\n" if x[:2] == "20" else x + "\n"
                             for x in OEM.splitlines())),
    ),
)  # fmt: skip
def test_an_oem_written_otherwise_is_the_same_orbit(tmp_path, name, text):
    found = [orbit_of(tmp_path, *each).state(INSTANTS, START) for each in (("a.oem", OEM),
             (name, text))]  # fmt: skip
    assert text != OEM and np.array_equal(*found)


@pytest.mark.parametrize(
    "text",
    (
        UTC_CSV.replace("2025-07-01T", "2025/07/01 "),
        UTC_CSV.replace("2025-07-01T", "2025/7/1 "),
        *(UTC_CSV.replace(".000000,", f".000000{zone},")
          for zone in ("+0000", "+00:00", "+00", "-00:00", "z", " UTC")),
        UTC_CSV.replace(",", ";"),
        UTC_CSV.replace(",", "\t"),
        UTC_CSV.replace("\n", "\r\n"),
        "# a log, of a receiver\n" + UTC_CSV,
    ),
)  # fmt: skip
def test_a_table_written_otherwise_is_the_same_orbit(tmp_path, text):
    pair = (("a.csv", UTC_CSV), ("b.csv", text))
    found = [orbit_of(tmp_path, *each, axes="ECEF").state(INSTANTS, START) for each in pair]
    assert text != UTC_CSV and np.array_equal(*found)


def test_blank_lines_before_sp3_and_small_names(tmp_path):
    text = sp3_text(INSTANTS)
    found = [
        orbit_of(tmp_path, f"{k}.sp3", each, satellite="l51").state(INSTANTS, START)
        for k, each in enumerate((text, "\n  \n" + text))
    ]
    assert np.array_equal(*found)


# ------------------------------------------------------------------ instants


def test_a_leap_second_is_an_instant_of_its_own():
    """2016 ended with one: three seconds pass from 23:59:59 to 00:00:01."""
    texts = ("2016-12-31T23:59:59", "2016-366T23:59:60", "2017-01-01T00:00:00Z")
    found = [read_stamp(text, "UTC") for text in texts]
    assert np.array_equal(np.diff(found), np.array([1, 1], dtype="timedelta64[s]"))
    assert read_stamp("2016-12-31T23:59:60.5", "UTC") == found[1] + np.timedelta64(500, "ms")
    assert found[2] == np.datetime64("2017-01-01T00:00:37", "ns")
    for text, scale in ((texts[1], "TAI"), (texts[1], "GPS"), ("2016-12-31T22:59:60", "UTC"),
                        ("2017-12-31T23:59:60", "UTC")):  # fmt: skip
        with pytest.raises(ValueError, match="must hold seconds below 60, or 61 where UTC has a"):
            read_stamp(text, scale)


def test_an_ephemeris_over_a_leap_second_is_an_orbit(tmp_path):
    """A circle in GCRF by seconds of TAI, with stamps of UTC that pass 23:59:60."""
    radius, rate = 7e6, (MU_EARTH_M3_S2 / 7e6**3) ** 0.5
    t = 20.0 * np.arange(-30, 31)
    rows = []
    for s in t:
        tai = np.datetime64("2017-01-01T00:00:36", "ms") + np.timedelta64(int(s), "s")
        utc = str(tai - np.timedelta64(36 if s < 0 else 37, "s"))
        utc = "2016-12-31T23:59:60.000" if s == 0 else utc
        x, y = radius * np.cos(rate * s), radius * np.sin(rate * s)
        rows.append(f"{utc},{x:.6f},{y:.6f},0.0")
    text = "\n".join(["utc,x_m,y_m,z_m", *rows])
    orbit = orbit_of(tmp_path, "leap.csv", text, axes="GCRF")
    start = parse_utc("2017-01-01T00:00:00Z")
    r, v = orbit.state(np.array([-1.0, 0.0, 99.0]), start)
    at = rate * np.array([0.0, 1.0, 100.0])
    assert np.abs(r - radius * np.transpose([np.cos(at), np.sin(at), 0.0 * at])).max() < 1e-4
    assert np.abs(np.linalg.norm(v, axis=1) - radius * rate).max() < 1e-4


def test_weeks_of_gps_are_19_s_behind_tai():
    assert gps_instant(2373.0, 216000.0) == np.datetime64("2025-07-01T12:00:19", "ns")
    assert read_stamp("2025-07-01T12:00:00.25", "TT") == np.datetime64("2025-07-01T11:59:28.066")


SENSELESS = (
    ("2025-548T12:00:00", "must hold a day of year of 1 to 365"),
    ("2024-367T12:00:00", "must hold a day of year of 1 to 366"),
    ("2024-000T12:00:00", "must hold a day of year of 1 to 366"),
    ("1600-07-01T12:00:00", "must hold a year of 1957 to 2100"),
    ("2300-07-01T12:00:00", "must hold a year of 1957 to 2100"),
    ("2025-02-29T12:00:00", "must hold a month and a day of the calendar"),
    ("2025-07-01T25:00:00", "must hold hours of 0 to 23 and minutes of 0 to 59"),
    ("2025-07-01T12:99:00", "must hold hours of 0 to 23 and minutes of 0 to 59"),
    ("2025-07-01T12:00:61", "must hold seconds below 60, or 61 where UTC has a leap second"),
    ("2025-07-01T12:00:00+02:00", "must be a time of no other zone than UTC"),
    ("2025-07-01T12:00:00+0030", "must be a time of no other zone than UTC"),
    ("07/01/2025T12:00:00", "must be a time such as 2025-07-01T12:00:00"),
    ("NaT", "must be a time such as 2025-07-01T12:00:00"),
    ("2025-07-01", "must be a time such as 2025-07-01T12:00:00"),
)


@pytest.mark.parametrize(("stamp", "must"), SENSELESS)
def test_senseless_times_are_refused_by_line(tmp_path, stamp, must):
    line = OEM.splitlines()[20]
    text = OEM.replace(line.split()[0], stamp)
    assert refused(tmp_path, text) == f"file: orbit.oem line 21: {must}; received {stamp!r}"
    fields = json.dumps([{name: str(x) for name, x in omm_fields().items()} | {"EPOCH": stamp}])
    assert refused(tmp_path, fields, "a.json") == (
        f"file: a.json: ISS (ZARYA): EPOCH {must}; received {stamp!r}"
    )


@pytest.mark.parametrize(
    ("stamp", "must"),
    (
        ("2025 7 1 11 99 0.0", "must hold hours of 0 to 23 and minutes of 0 to 59"),
        ("2025 7 1 25 0 0.0", "must hold hours of 0 to 23 and minutes of 0 to 59"),
        ("2025 7 1 11 51 61.0", "must hold seconds below 60, or 61 where UTC has a leap second"),
        ("2025 7 1 11 51 -1.0", "must hold seconds below 60, or 61 where UTC has a leap second"),
        ("2025 7 1 11 50.5 0.0", "must hold whole years, months, days, hours and minutes"),
        ("1600 7 1 11 51 0.0", "must hold a year of 1957 to 2100"),
        ("2025 13 1 11 51 0.0", "must hold a month and a day of the calendar"),
        ("nan 7 1 11 51 0.0", "must hold 6 numbers"),
    ),
)
def test_senseless_times_of_sp3_are_refused_by_line(tmp_path, stamp, must):
    lines = sp3_text(INSTANTS).splitlines()
    at = [k for k, line in enumerate(lines) if line.startswith("*")][3]
    lines[at] = f"*  {stamp}"
    assert refused(tmp_path, "\n".join(lines), "a.sp3") == (
        f"file: a.sp3 line {at + 1}: {must}; received {stamp!r}"
    )


@pytest.mark.parametrize(
    ("week", "seconds", "message"),
    (
        ("2373.5", "0", "gps_week must be a whole number of 0 to 6312; received 2373.5"),
        ("-1", "0", "gps_week must be a whole number of 0 to 6312; received -1"),
        ("99999", "0", "gps_week must be a whole number of 0 to 6312; received 99999"),
        ("2373", "604800", "gps_s must be within its week, 0 to below 604800 s; received 604800"),
        ("2373", "1_0", "must hold 2 numbers; received '2373 1_0'"),
    ),
)
def test_senseless_weeks_are_refused_by_line(tmp_path, week, seconds, message):
    text = f"\ngps_week,gps_s,x_m,y_m,z_m\n{week},{seconds},1,2,3\n"
    assert refused(tmp_path, text, "a.csv", axes="ECEF") == f"file: a.csv line 3: {message}"


def test_a_zone_of_utc_contradicts_another_scale(tmp_path):
    text = oem_text(INSTANTS, scale="GPS").replace(".000000 ", ".000000Z ")
    assert "line 13: must be a time without the zone of UTC, as the scale is GPS; received" in (
        refused(tmp_path, text)
    )


def test_times_must_go_on(tmp_path):
    lines = OEM.splitlines()
    lines[20], lines[21] = lines[21], lines[20]
    assert "orbit.oem line 22: must be later than the position before it; received" in refused(
        tmp_path, "\n".join(lines)
    )


# ------------------------------------------------------------------ what is wrong


@pytest.mark.parametrize(
    ("text", "message"),
    (
        (message_of(MEAN_MOTION="0.005", ECCENTRICITY="0.9"),
         ": ISS (ZARYA): MEAN_MOTION and ECCENTRICITY must stay within 1500000 km of the Earth's "
         "centre, its Hill sphere; received one that goes out to"),
        (message_of(OBJECT_NAME="A\nB", BSTAR="x"), ": A B: BSTAR must be a finite number"),
        (",".join(omm_fields()) + "\n" + 200000 * "x",
         ": must be a table that can be read; received"),
        ("[" * 100000, ": must be a list of tables; received lists within lists"),
        (",".join(omm_fields()) + "\n1,2\n", " line 2: must have 21 columns as line 1 has"),
        (ISS.tle[0], " line 1: must have line 2 of its elements below it; received 'the end of"),
        (ISS.tle[1], " line 1: must follow line 1 of its elements; received '2 25544"),
        (f"{ISS.tle[0]}\n{TLE}", " line 1: must have line 2 of its elements below it; received '1"),
        (f"{ISS.tle[0]}\nISS\n{ISS.tle[1]}", " line 1: must have line 2 of its elements below it"),
        ("\n".join(line[:68] for line in ISS.tle),
         " line 1: must have 69 columns; received 68, without the checksum (column 69), which "
         "would be 7"),
        (TLE.replace("14800-3 0", "14800-3 4"),
         " line 1: column 63 must be that of elements for SGP4; received '4', which are for SGP4-"),
        ("", ": must be OEM or OMM of CCSDS, SP3, CSV with names of columns, or two-line elements; "
         "received an empty file"),
        ("CCSDS_OPM_VERS = 2.0\n", "received one that begins with 'CCSDS_OPM_VERS = 2.0'"),
        ("CCSDS_OEM_VERS = 2.0\n", ": must hold a segment (META_START); received none"),
        (OEM.replace("CENTER_NAME", "REF_FRAME_EPOCH = 2025-07-01T12:00:00\nCENTER_NAME")
         .replace("EME2000", "TEME"),
         " line 8: REF_FRAME_EPOCH must be left out, as TEME is read as that of date; received"),
        (OEM.replace(OEM.splitlines()[20], OEM.splitlines()[20] + " 1"),
         " line 21: must hold 6 numbers after the time, or 9 with accelerations; received 7"),
    ),
)  # fmt: skip
def test_files_that_are_slightly_wrong_are_told(tmp_path, text, message):
    found = refused(tmp_path, text, "a.txt")
    assert found.startswith("file: a.txt") and message in found, found
    assert "\n" not in found


@pytest.mark.parametrize(
    ("text", "message"),
    (
        ("", ": must be OEM or OMM .*; received an empty file"),
        (UTC_CSV.replace(",", ";").replace(".", ","), " line 2: must hold 3 numbers with decimal"),
        ('utc,x_m,y_m,z_m\n"' + 200000 * "x", ": must be a table that can be read; received"),
        ("utc,lat_deg,lon_deg,height_m\n2025-07-01T12:00:00,95,2,3\n",
         r" line 2: lat_deg must lie in -90..90; received 95"),
        ("utc,lat_deg,lon_deg,height_m\n2025-07-01T12:00:00,5,-200,3\n",
         r" line 2: lon_deg must lie in -180..360; received -200"),
    ),
)  # fmt: skip
def test_tables_that_are_slightly_wrong_are_told(tmp_path, text, message):
    with pytest.raises(ValueError, match=message):
        orbit_of(tmp_path, "a.csv", text, axes="ECEF")


def test_text_in_another_code_is_told_by_line(tmp_path):
    file = tmp_path / "a.oem"
    file.write_bytes(OEM.encode() + b"COMMENT \xe9t\xe9\n")
    line = OEM.count("\n") + 1
    with pytest.raises(ValueError, match=rf"a\.oem line {line}: must be text in UTF-8; received"):
        orbit_of(tmp_path, "b.oem", OEM).model_copy(update={"file": file})._read()


@pytest.mark.parametrize("value", (25544.5, True, "", " ", float("nan"), float("inf"), -5, [1]))
def test_a_satellite_is_a_name_or_a_whole_number(tmp_path, value):
    assert refused(tmp_path, TLE, "a.tle", satellite=value) == (
        f"satellite: must be a name or a catalogue number, a whole one; received {value!r}"
    )


def test_elements_that_end_during_the_run_are_told_by_file(tmp_path):
    orbit = orbit_of(tmp_path, "a.json", message_of(ECCENTRICITY="0.5"))
    with pytest.raises(ValueError, match=r"^orbit\.file: a\.json: must hold elements of an orbit "
                       r"throughout the run; received none at t = .* decayed"):  # fmt: skip
        orbit.state(INSTANTS, START)


def test_a_file_on_board_is_told_by_its_own_key(tmp_path):
    orbit = orbit_of(tmp_path, "a.oem", OEM)
    on_board = EphemerisModels(orbit=orbit).along(OrbitEnvironment(Environment(), ISS, START))
    with pytest.raises(ValueError, match=r"^control\.ephemeris\.orbit\.file: a\.oem: must cover"):
        on_board.check_dates(0.0, 86400.0)


def test_messages_begin_with_the_key_of_the_scenario(tmp_path):
    file = tmp_path / "a.oem"
    file.write_text(OEM.replace("EME2000", "MARS"))
    table = {"kind": "file", "file": str(file), "satellite": 25544.5}
    for keys, begin in (
        (
            table,
            "orbit.satellite: must be a name or a catalogue number, a whole one; received 25",
        ),
        (table | {"satellite": "ISS"}, "orbit.file: a.oem line 9: axes must be one of GCRF, ICRF"),
        (table | {"satellite": "Mir"}, "orbit.satellite: must name the object of one segment of 1"),
    ):
        with pytest.raises(ScenarioError) as error:
            validate_tables(EphemerisModels, {"orbit": keys})
        assert str(error.value).startswith(begin) and "\n" not in str(error.value)
