"""Orbits from files: exact at their instants, within the stated error between them."""

import json
import re

import numpy as np
import pytest
from environment.orbit.orbit_files import (
    ISS,
    START,
    TLE,
    csv_text,
    ecef,
    gcrf,
    oem_text,
    sp3_text,
    times,
)
from sgp4 import exporter
from sgp4.api import Satrec

from torquer.base.explain import ScenarioError
from torquer.environment.along_orbit import Environment, OrbitEnvironment
from torquer.environment.orbit import FileOrbit
from torquer.environment.orbit.files.states import rounding

INSTANTS = times()
FORMS = {
    "eme2000.oem": (oem_text(INSTANTS), {}),
    "gcrf.oem": (oem_text(INSTANTS, "GCRF", "TAI"), {}),
    "itrf.oem": (oem_text(INSTANTS, "ITRF2014", "GPS"), {}),
    "teme.oem": (oem_text(INSTANTS, "TEME", "TT"), {}),
    "coarse.oem": (oem_text(times(step_s=300.0, before_s=1500.0)), {}),
    "log.csv": (csv_text(INSTANTS), {"axes": "ECEF"}),
    "places.csv": (csv_text(INSTANTS, False, "UTC"), {"axes": "ECEF"}),
    "geodetic.csv": (csv_text(INSTANTS, geodetic=True), {}),
    "places.sp3": (sp3_text(INSTANTS), {}),
    "states.sp3": (sp3_text(INSTANTS, True), {}),
}


def orbit_of(tmp_path, name, text=None, **keys):
    file = tmp_path / name
    file.write_text(FORMS[name][0] if text is None else text)
    return FileOrbit(kind="file", file=file, **{**(FORMS[name][1] if text is None else {}), **keys})


def refused(tmp_path, text, name="orbit.oem", **keys) -> str:
    with pytest.raises(ScenarioError) as error:
        orbit_of(tmp_path, name, text, **keys)
    return str(error.value)


@pytest.mark.parametrize("name", FORMS)
def test_positions_are_those_of_the_file_and_within_the_stated_error_between(tmp_path, name):
    orbit = orbit_of(tmp_path, name)
    step_s = orbit.step_s
    at = np.arange(0.0, 6901.0, step_s)
    assert np.linalg.norm(orbit.state(at, START)[0] - gcrf(at)[0], axis=1).max() < 1e-3
    within = np.linspace(0.0, 6900.0, 2001)
    r, v = orbit.state(within, START)
    stated_m = orbit.interpolation_error_m(START, 0.0, 6900.0)
    assert np.linalg.norm(r - gcrf(within)[0], axis=1).max() < stated_m < 10.0
    # velocities of SGP4 are not the derivative of its positions: 2 cm/s
    assert np.linalg.norm(v - gcrf(within)[1], axis=1).max() < 0.05
    assert orbit.frame == "GCRF"
    assert orbit.period_s == pytest.approx(ISS.period_s, rel=2e-3)
    assert orbit.extent(START)[2] == pytest.approx(ISS.extent()[2], abs=3e-3)


def test_velocities_are_the_derivative_of_positions(tmp_path):
    orbit = orbit_of(tmp_path, "coarse.oem")
    at, h = np.linspace(1000.0, 5000.0, 101), 1e-2
    ahead, before = (orbit.state(at + s, START)[0] for s in (h, -h))
    assert np.abs((ahead - before) / (2.0 * h) - orbit.state(at, START)[1]).max() < 1e-4


def test_the_table_of_a_run_is_exact_for_both_rotations_of_the_earth(tmp_path):
    """The place over the ground is that of the file: the field there is the same."""
    orbit, at = orbit_of(tmp_path, "itrf.oem"), np.arange(0.0, 6001.0, 600.0)
    for rotation in ("precise", "sidereal"):
        along = OrbitEnvironment(Environment(earth_rotation=rotation), orbit, START)
        r, _ = along.state(at)
        assert np.abs(np.einsum("nij,nj->ni", along.dcm_to_ecef(at), r) - ecef(at)[0]).max() < 1e-3
        table = along.orbit_table(6000.0, 1.0)
        assert table.relative_error < 1e-9
        assert table.evaluations < 2000  # segments meet where polynomials do


def test_a_coarser_file_states_more(tmp_path):
    errors = []
    for step_s in (60.0, 120.0, 240.0, 400.0):
        text = csv_text(times(step_s=step_s, before_s=5 * step_s), False)
        orbit = orbit_of(tmp_path, f"{step_s}.csv", text, axes="ECEF")
        errors.append(orbit.interpolation_error_m(START, 0.0, 5000.0))
    assert errors == sorted(errors) and errors[-1] > 100.0 * errors[0]


def test_a_run_beyond_the_file_is_refused(tmp_path):
    orbit = orbit_of(tmp_path, "eme2000.oem")
    orbit.check_span(START, 0.0, 7200.0)
    lacks = (
        r"must cover the run; received positions that lack 600 s at its start and 60 s at its end"
    )
    with pytest.raises(ValueError, match=rf"orbit\.file: eme2000\.oem: {lacks} \(they are from 20"):
        orbit.check_span(START, -1200.0, 7260.0)


def test_a_gap_is_refused_by_line(tmp_path):
    lines = FORMS["eme2000.oem"][0].splitlines()
    orbit = orbit_of(tmp_path, "gap.oem", "\n".join(lines[:60] + lines[120:]))
    orbit.check_span(START, 0.0, 1200.0)
    with pytest.raises(ValueError, match=r"between lines 60 and 61, 3660 s apart, positions must "
                       r"be known to greatest_error_m = 100 m; received an error"):  # fmt: skip
        orbit.check_span(START, 0.0, 7200.0)
    with pytest.raises(ValueError, match="greatest_error_m = 1e-06 m"):
        strict = orbit_of(tmp_path, "coarse.oem", greatest_error_m=1e-6)
        strict.check_span(START, 0.0, 600.0)


def line_of(text: str, k: int) -> list[str]:
    return text.splitlines()[k].split()


DAMAGED = (
    (lambda t: t.replace(line_of(t, 40)[2], "-nan"),
     "orbit.oem line 41: must hold 6 numbers; received"),
    (lambda t: t.replace(line_of(t, 40)[0], "yesterday"),
     "line 41: must be a time such as 2025-07-01T12:00:00; received 'yesterday'"),
    (lambda t: t.replace(line_of(t, 40)[0], line_of(t, 30)[0]),
     "line 41: must be later than the position before it; received 2025-07-01T"),
    (lambda t: t.replace(line_of(t, 40)[1], "1" + line_of(t, 40)[1][1:]),
     r"line \d+: positions must move under gravity in the axes stated; received an "
     r"acceleration that is off by"),
    (lambda t: t.replace(line_of(t, 40)[4], "9.9"),
     r"line 41: velocity must be that of the positions around it; received one that is off by"),
    (lambda t: t.replace("REF_FRAME = EME2000", "REF_FRAME = ITRF"),
     r"line \d+: positions must move under gravity in the axes stated"),
    (lambda t: t.replace("REF_FRAME = EME2000", "REF_FRAME = MARS"),
     "line 9: axes must be one of GCRF, .*; received 'MARS'"),
    (lambda t: t.replace("TIME_SYSTEM = UTC", "TIME_SYSTEM = UT1"),
     "line 10: time scale must be one of UTC, TAI, .*; received 'UT1'"),
    (lambda t: t.replace("REF_FRAME = EME2000\n", ""),
     "orbit.oem line 12: REF_FRAME must stand before the first position; received none"),
    (lambda t: t.replace("CENTER_NAME = EARTH", "CENTER_NAME = MOON"),
     "line 8: CENTER_NAME must be EARTH; received 'MOON'"),
    (lambda t: "\n".join(t.splitlines()[:14]), "must hold 4 or more positions; received 2"),
    (lambda t: "\n".join(t.splitlines()[:11]), "must hold positions; received a segment without"),
    (lambda t: t + t, "must hold one segment of an object, as segments are not joined; received 2"),
    (lambda t: "<?xml version='1.0'?><oem></oem>",
     r"must be an OMM where it is XML \(.*\); received 'oem'"),
    (lambda t: "<omm>", "must be XML that can be read; received an error: no element found"),
    (lambda t: "<omm><segment/></omm>", "OMM: EPOCH must be given; received none"),
    (lambda t: "[1", "must be JSON that can be read"),
    (lambda t: "[1]", "must be a list of tables"),
    (lambda t: '{"OBJECT_NAME": "A"}', "A: EPOCH must be given; received none"),
    (lambda t: "some words",
     "must be OEM or OMM of CCSDS, SP3, CSV with names of columns, or two-line elements; "
     "received one that begins with 'some words'"),
)  # fmt: skip


@pytest.mark.parametrize(("damage", "message"), DAMAGED)
def test_a_damaged_file_is_refused_by_line(tmp_path, damage, message):
    text = damage(FORMS["eme2000.oem"][0])
    assert re.search(message, refused(tmp_path, text)), refused(tmp_path, text)


def test_earth_fixed_positions_are_no_inertial_ones(tmp_path):
    """The axes that are not stated by a CSV file must be those in which positions move."""
    text = csv_text(INSTANTS, False)
    for axes in ("GCRF", "TEME", "EME2000"):
        assert "positions must move under gravity" in refused(tmp_path, text, "log.csv", axes=axes)
    kilometres = text.replace("x_m,y_m,z_m", "x_km,y_km,z_km")
    assert "must lie above the Earth and within" in refused(
        tmp_path, kilometres, "log.csv", axes="ECEF"
    )


CSV = (
    ("# a log\nutc,x_m,y_m,z_m\n2025-01-01T00:00:00,1,2\n", {"axes": "GCRF"},
     "line 3: must have 4 columns"),
    ("utc,x_m,y_m,z_m\n2025-01-01T00:00:00+03:00,1,2,3\n", {"axes": "GCRF"},
     "line 2: must be a time of no other zone than UTC; received '2025-01-01T00:00:00\\+03:00'"),
    ("utc,x_m,y_m,z_m\n2025-13-01 00:00:00,1,2,3\n", {"axes": "GCRF"},
     "line 2: must hold a month and a day of the calendar"),
    ("gps,x_m,y_m\n", {}, "line 1: must name the columns of a place|must hold rows"),
    ("t,x_m,y_m,z_m\n1,2,3,4\n", {}, "line 1: must name one column of times"),
    ("utc,a,b\n2025-01-01T00:00:00,1,2\n", {}, "line 1: must name the columns of a place"),
    ("utc,x_m,y_m,z_m\n2025-01-01T00:00:00,1,2,3\n", {}, "axes: must be given for a CSV file"),
    ("utc,x_m,y_m,z_m\n2025-01-01T00:00:00,1,2\n", {"axes": "GCRF"}, "line 2: must have 4 columns"),
    ("utc,x_m,y_m,z_m\n2025-01-01T00:00:00,1,2,x\n", {"axes": "GCRF"}, "line 2: must hold 3 num"),
    ("utc,lat_deg,lon_deg,height_m\n2025-01-01T00:00:00,1,2,3\n", {"axes": "GCRF"},
     "axes: must be left out, or 'ECEF'"),
    ("utc,x_m,y_m,z_m\n2025-01-01T00:00:00,1,2,3\n", {"axes": "GCRF", "satellite": "A"},
     "satellite: must be left out for a table of one"),
)  # fmt: skip


@pytest.mark.parametrize(("text", "keys", "message"), CSV)
def test_a_table_that_says_too_little_is_refused(tmp_path, text, keys, message):
    assert re.search(message, refused(tmp_path, text, "a.csv", **keys))


def test_axes_are_for_tables_only(tmp_path):
    assert refused(tmp_path, FORMS["eme2000.oem"][0], axes="GCRF") == (
        "axes: must be left out, as the file says them; received 'GCRF' (file orbit.oem)"
    )


def test_gps_weeks_are_times(tmp_path):
    text = csv_text(INSTANTS)
    lines = text.splitlines()
    week = np.datetime64("1980-01-06", "ns")
    rows = ["gps_week,gps_s," + lines[0].partition(",")[2]]
    for line in lines[1:]:
        stamp, _, rest = line.partition(",")
        since = (np.datetime64(stamp, "ns") - week) / np.timedelta64(1, "s")
        rows.append(f"{int(since // 604800)},{since % 604800:.6f},{rest}")
    one = orbit_of(tmp_path, "week.csv", "\n".join(rows), axes="ECEF")
    other = orbit_of(tmp_path, "log.csv")
    assert np.array_equal(one.state(INSTANTS[20:40], START), other.state(INSTANTS[20:40], START))


def test_sp3_leaves_missing_positions_out_and_names_satellites(tmp_path):
    text = sp3_text(INSTANTS)
    row = next(line for line in text.splitlines() if line.startswith("PL51"))
    zeros = "PL51" + 4 * f"{0.0:14.6f}"
    orbit = orbit_of(tmp_path, "zeros.sp3", text.replace(row, zeros, 1))
    assert len(orbit._read().tai) == len(INSTANTS) - 1
    two = text.replace("EOF", f"{row.replace('L51', 'L52')}\nEOF")
    assert "satellite: must be one of L51, L52; received None" in refused(tmp_path, two, "2.sp3")
    assert orbit_of(tmp_path, "3.sp3", two, satellite="L51").step_s == 60.0


def second(number: str) -> list[str]:
    """The elements of the ISS under another number, a tenth of a degree further."""
    lines = [line[:2] + number + line[7:68] for line in TLE]
    lines[1] = lines[1].replace("270.0000", "270.1000")
    return [
        line + str(sum(int(c) if c.isdigit() else c == "-" for c in line) % 10) for line in lines
    ]


def test_a_satellite_of_many_is_chosen_by_number_or_name(tmp_path):
    text = "\n".join(["ISS (ZARYA)", *ISS.tle, "0 OTHER", *second("11111")])
    for name in (25544, "25544", "iss (zarya)"):
        orbit = orbit_of(tmp_path, "many.tle", text, satellite=name)
        assert np.array_equal(orbit.state(INSTANTS, START), ISS.state(INSTANTS, START))
        assert (orbit.frame, orbit.period_s) == ("TEME", ISS.period_s)
    message = refused(tmp_path, text, "many.tle")
    assert message == (
        "satellite: must name one of the file's by catalogue number or name (11111 OTHER, 25544 "
        "ISS (ZARYA)); received None (file many.tle)"
    )


def test_wrong_elements_are_refused_by_line(tmp_path):
    text = "\n".join(["ISS (ZARYA)", ISS.tle[0], ISS.tle[1].replace("51.6370", "51.6371")])
    assert refused(tmp_path, text, "wrong.tle") == (
        "file: wrong.tle line 3: checksum must be "
        f"{(int(ISS.tle[1][-1]) + 1) % 10}; received {ISS.tle[1][-1]}"
    )
    assert "short.tle line 2: must have 69 columns" in refused(
        tmp_path, "\n".join(["ISS", *(line[:60] for line in ISS.tle)]), "short.tle"
    )


def test_a_stamp_may_be_written_with_a_space_and_its_zone(tmp_path):
    text = csv_text(INSTANTS, scale="UTC")
    other = text.replace("T", " ").replace(".000000,", ".000000+00:00,")
    found = [
        orbit_of(tmp_path, f"{k}.csv", each, axes="ECEF").state([0.0], START)[0]
        for k, each in enumerate((text, other))
    ]
    assert other != text and np.array_equal(*found)


def omm_fields() -> dict:
    return exporter.export_omm(Satrec.twoline2rv(*ISS.tle), "ISS (ZARYA)")


@pytest.mark.parametrize("form", ("kvn", "json", "csv", "xml"))
def test_mean_elements_messages_are_the_same_orbit(tmp_path, form):
    fields = {key: str(value) for key, value in omm_fields().items()}
    if form == "kvn":
        text = "CCSDS_OMM_VERS = 2.0\n" + "\n".join(f"{k} = {v}" for k, v in fields.items())
    elif form == "json":
        text = json.dumps([fields])
    elif form == "csv":
        text = ",".join(fields) + "\n" + ",".join(fields.values()) + "\n"
    else:
        body = "".join(f"<{k}>{v}</{k}>" for k, v in fields.items())
        body = f"<metadata></metadata><data><meanElements>{body}</meanElements>"
        body += "<tleParameters></tleParameters></data>"
        text = f'<?xml version="1.0"?><ndm><omm><body><segment>{body}</segment></body></omm></ndm>'
    orbit = orbit_of(tmp_path, f"iss.{form}", text)
    assert np.abs(orbit.state(INSTANTS, START)[0] - ISS.state(INSTANTS, START)[0]).max() < 1e-3


def test_of_several_sets_the_nearest_is_taken(tmp_path):
    later = list(second("25544"))
    later[0] = later[0].replace("25182.5", "25190.5")
    later = [
        x[:68] + str(sum(int(c) if c.isdigit() else c == "-" for c in x[:68]) % 10) for x in later
    ]
    orbit = orbit_of(tmp_path, "sets.tle", "\n".join([*ISS.tle, *later]))
    assert np.array_equal(orbit.state(INSTANTS, START), ISS.state(INSTANTS, START))
    assert not np.array_equal(
        orbit.state([0.0], "2025-07-09T00:00:00Z"), ISS.state([0.0], "2025-07-09T00:00:00Z")
    )


def test_elements_without_checksums_are_read_by_a_key(tmp_path):
    old = "\n".join(("ISS", *(line[:68] for line in ISS.tle), "NEXT", *second("25545")))
    keys = {"satellite": "iss", "without_checksums": True}
    orbit = orbit_of(tmp_path, "old.tle", old, **keys)
    assert np.array_equal(orbit.state(INSTANTS, START), ISS.state(INSTANTS, START))
    orbit_of(tmp_path, "old.tle", old, **keys | {"satellite": 25545})  # with checksums, those hold
    with pytest.raises(
        ValueError, match=r"line 2: .* would be 7; orbit\.without_checksums = true does"
    ):
        orbit_of(tmp_path, "old.tle", old, satellite="iss")
    for name, text in (("iss.json", json.dumps([omm_fields()])), ("iss.csv", csv_text(INSTANTS))):
        with pytest.raises(ValueError, match=r"without_checksums: must be left out, as the file"):
            orbit_of(tmp_path, name, text, without_checksums=True)


def test_rounding_is_by_the_digits_of_the_largest():
    assert rounding(np.array([[6800.123456, 1.5, 0.0]]), 1e3) == pytest.approx(0.5e-3 * 3**0.5)
    assert rounding(np.array([[1.0, 20.0, 300.0]])) == pytest.approx(0.5 * 3**0.5)


def test_a_file_that_has_been_written_again_is_read_again(tmp_path):
    orbit = orbit_of(tmp_path, "log.csv")
    before = orbit.state([0.0], START)[0]
    text = csv_text(times(before_s=1200.0))
    orbit.file.write_text(text)
    assert orbit._read().t_s[-1] == 7200.0 + 1200.0
    assert np.allclose(orbit.state([0.0], START)[0], before, atol=1e-4)
    orbit.file.unlink()
    with pytest.raises(ValueError, match=r"orbit\.file: must be a file that can be read"):
        orbit.state([0.0], START)


def test_uneven_times_show_other_axes_too(tmp_path):
    """With jitter or gaps no interval is equal to the next."""
    jitter = INSTANTS + np.random.default_rng(1).uniform(-1.0, 1.0, len(INSTANTS)).round(3)
    for instants in (jitter, np.delete(times(step_s=30.0), slice(None, None, 3))):
        text = csv_text(instants, False)
        orbit_of(tmp_path, "log.csv", text, axes="ECEF")
        for axes in ("GCRF", "TEME"):
            message = refused(tmp_path, text, "log.csv", axes=axes)
            assert "positions must move under gravity" in message, message


@pytest.mark.parametrize(
    ("name", "text", "message"),
    (
        ("a.csv", "utc,x_m,y_m,z_m,z_m\n2025-07-01T12:00:00,1,2,3\n",
         "line 1: must name each column once"),
        ("a.csv", "utc,x_m,y_m,z_m\n" + "".join(f"2025-07-01T12:0{k}:00,0,0,0\n" for k in range(5)),
         "position must lie above the Earth"),
        ("a.json", json.dumps([{**exporter.export_omm(Satrec.twoline2rv(*ISS.tle), "ISS"),
                               "BSTAR": None}], default=str),
         "a.json: ISS: BSTAR must be given; received none"),
    ),
)  # fmt: skip
def test_what_a_reader_cannot_take_is_one_line(tmp_path, name, text, message):
    keys = {"axes": "GCRF"} if name.endswith("csv") else {}
    assert message in refused(tmp_path, text, name, **keys)


@pytest.mark.parametrize(
    ("key", "value", "must"),
    (
        ("CENTER_NAME", "MARS", "EARTH"),
        ("REF_FRAME", "GCRF", "TEME or TEMEOFDATE"),
        ("TIME_SYSTEM", "TAI", "UTC"),
        ("MEAN_ELEMENT_THEORY", "DSST", "SGP4 or SGP/SGP4"),
        ("EPHEMERIS_TYPE", "4", "0 or 2"),
    ),
)
def test_elements_of_another_theory_or_place_are_refused(tmp_path, key, value, must):
    fields = {name: str(each) for name, each in omm_fields().items()} | {key: value}
    message = refused(tmp_path, json.dumps([fields]), "a.json")
    assert message == f"file: a.json: ISS (ZARYA): {key} must be {must}; received {value!r}"
