"""`torquer field`: numbers, JSON, pictures, and one line per mistake."""

import csv
import io
import subprocess
import sys
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from torquer.analysis.field.cone import CONE_MODELS
from torquer.analysis.field.models import NAMED, find_model, label, moment
from torquer.analysis.field.orbit import instants
from torquer.base.time import decimal_year, parse_utc
from torquer.environment.field import FIELDS, Igrf14, TiltedDipole, Wmm2025
from torquer.environment.field.along import fields_along
from torquer.environment.field.at_point import point_field
from torquer.environment.orbit import Circular
from torquer.scenario.load import load_scenario

EXAMPLE = ["--date", "2025-07-01", "--lat", "80", "--lon", "240", "--alt-km", "50"]
CIRCLE = ["--altitude-km", "550", "--inclination-deg", "51.7", "--start", "2025-07-01"]
#: What the element set of the tests of SGP4 looks like: Chibis-M.
TLE = """CHIBIS-M
1 38051U 11062C   12058.91450162  .00007227  00000-0  32146-3 0  1024
2 38051  51.6521 324.5583 0011559   6.4829  88.0894 15.22465494  5160
"""


@pytest.fixture
def field(call, tmp_path, monkeypatch):
    """`field("point", ...)`: exit code, output, errors; pictures go to a folder of their own."""
    monkeypatch.chdir(tmp_path)
    return lambda *arguments: call("field", *arguments)


def test_help_loads_nothing_heavy():
    code = (
        "import sys\nfrom torquer.cli import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit as left:\n    assert not left.code\n"
        "heavy = {'numpy', 'numba', 'scipy', 'xarray', 'pydantic', 'matplotlib', 'plotly'}\n"
        "print(sorted(heavy & set(sys.modules)), file=sys.stderr)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[]"


@pytest.mark.parametrize("name", ["point", "orbit", "map", "cone"])
def test_every_command_has_help(field, name):
    code, out, err = field(name, "--help")
    assert (code or 0, err) == (0, "")
    assert f"torquer field {name}" in out and "--model" in out


# ------------------------------------------------------------------ point


def test_the_example_point_in_text(field):
    code, out, err = field("point", "--model", "wmm2025", *EXAMPLE)
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[0] == "wmm2025, 2025-07-01 00:00 UTC (2025.4959)"
    assert lines[1] == "latitude 80, longitude 240 deg, height 50 km (geodetic, WGS84)"
    assert [line.split() for line in lines[2:]] == [
        ["X", "north", "2269.9", "nT", "+72.3", "nT/yr"],
        ["Y", "east", "119.7", "nT", "-19.3", "nT/yr"],
        ["Z", "down", "55880.3", "nT", "-17.5", "nT/yr"],
        ["H", "horizontal", "2273.0", "nT", "+71.2", "nT/yr"],
        ["F", "total", "55926.5", "nT", "-14.6", "nT/yr"],
        ["D", "declination", "3.0189", "deg", "-0.5809", "deg/yr"],
        ["I", "inclination", "87.6707", "deg", "-0.0736", "deg/yr"],
    ]


@pytest.mark.parametrize("model", ["igrf14", "wmm2025", "tilted_dipole", "direct_dipole"])
def test_point_as_json_is_the_library(field, strict_json, model):
    code, out, err = field("point", "--model", model, *EXAMPLE, "--json")
    assert (code, err) == (0, "")
    answer = strict_json(out)
    assert answer.keys() == {
        "model", "date", "decimal_year", "coordinates", "latitude_deg", "longitude_deg",
        "altitude_km", "elements", "rates",
    }  # fmt: skip
    assert answer["date"] == "2025-07-01T00:00:00+00:00" and answer["coordinates"] == "geodetic"
    found = point_field(FIELDS[model](), answer["decimal_year"], 80.0, 240.0, 50.0)
    assert answer["elements"] == {k: float(v) for k, v in found.elements._asdict().items()}
    if model == "direct_dipole":
        assert answer["rates"] is None
    else:
        rates = {f"{k}_per_year": float(v) for k, v in found.rates._asdict().items()}
        assert answer["rates"] == rates


def test_degree_geocentric_and_negative_places(field, strict_json):
    place = ["--date", "2026.25", "--lat", "-33.5", "--lon", "-70.25"]
    short = strict_json(field("point", *place, "--degree", "6", "--geocentric", "--json")[1])
    assert (short["model"], short["coordinates"]) == ("igrf14:6", "geocentric")
    found = point_field(Igrf14(degree=6), 2026.25, -33.5, -70.25, 0.0, True).elements
    assert short["elements"]["f_nt"] == float(found.f_nt)
    assert "geocentric latitude" in field("point", *place, "--geocentric")[1]
    same = field("point", *place, "--model", "igrf14:6", "--geocentric", "--json")[1]
    assert strict_json(same) == short


def test_no_declination_at_the_pole_of_the_direct_dipole(field, strict_json):
    pole = ["--date", "2025", "--lat", "90", "--lon", "0", "--model", "direct_dipole"]
    assert "D  declination    undefined deg\n" in field("point", *pole)[1]
    assert strict_json(field("point", *pole, "--json")[1])["elements"]["d_deg"] is None


MISTAKES = [
    ({"--model": "averaged"}, "--model: averaged is defined along an orbit only; "
     "must be one of igrf14, wmm2025, tilted_dipole, direct_dipole"),
    ({"--model": "igrf13"}, "--model: must be one of igrf14, wmm2025, tilted_dipole, "
     "direct_dipole, averaged, helmholtz_coils; received 'igrf13'"),
    ({"--model": "igrf14:x"}, "--model: must end with a degree, as in igrf14:6; received "
     "'igrf14:x'"),
    ({"--degree": "14"}, "--degree: must lie within 1..13 for igrf14; received 14"),
    ({"--model": "wmm2025:0"}, "--degree: must lie within 1..12 for wmm2025; received 0"),
    ({"--model": "tilted_dipole", "--degree": "2"},
     "--degree: must go with igrf14 or wmm2025; received it with tilted_dipole"),
    ({"--lat": "90.1"}, "--lat: must lie within -90..90 deg; received 90.1"),
    ({"--lat": "nan"}, "--lat: must lie within -90..90 deg; received nan"),
    ({"--lon": "-181"}, "--lon: must lie within -180..360 deg; received -181"),
    ({"--alt-km": "-11"}, "--alt-km: must lie within -10..50000 km; received -11"),
    ({"--alt-km": "1e9"}, "--alt-km: must lie within -10..50000 km; received 1e+09"),
    ({"--date": "2030-01-02"},
     "--date: field model igrf14: date must lie within 1900.0..2030.0; received 2030.0027"),
    ({"--date": "2024.9", "--model": "wmm2025"},
     "--date: field model wmm2025: date must lie within 2025.0..2030.0; received 2024.9"),
    *(({"--date": text}, "--date: must be a date (2025-07-01), a time with a zone "
       f"(2025-07-01T12:00Z) or a decimal year (2025.5), within 1900 to 2099; received {text!r}")
      for text in ("2025-02-30", "2025-07-01T12:00", "yesterday", "1899.99", "2100", "0000.5")),
    ({"--lat": "north"}, 'Invalid value for --lat: unable to convert "north" into float.'),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "line"), MISTAKES)
def test_mistakes_at_a_point_are_one_line(field, changes, line):
    given = dict(zip(EXAMPLE[::2], EXAMPLE[1::2], strict=True)) | changes
    code, out, err = field("point", *(word for pair in given.items() for word in pair))
    assert (code, out) == (2, "")
    assert err.startswith(f"error: {line}") and err.count("\n") == 1


# ------------------------------------------------------------------ dates and models


@pytest.mark.parametrize(
    ("text", "instant"),
    [
        ("2025-07-01", "2025-07-01T00:00:00Z"),
        ("2025-07-01T12:30Z", "2025-07-01T12:30:00Z"),
        ("2025-07-01T03:00+03:00", "2025-07-01T00:00:00Z"),
        ("2025.5", "2025-07-02T12:00:00Z"),
        ("2024.5", "2024-07-02T00:00:00Z"),
        ("2030", "2030-01-01T00:00:00Z"),
        ("2030.", "2030-01-01T00:00:00Z"),
    ],
)
def test_dates(text, instant):
    assert moment(text) == parse_utc(instant)


@pytest.mark.parametrize("year", [1900.0, 1987.123, 2025.5, 2029.999])
def test_a_decimal_year_comes_back(year):
    assert decimal_year(moment(f"{year}")) == pytest.approx(year, abs=1e-12)


def test_labels_tell_what_differs_from_the_plain_model():
    assert [label(find_model(name)) for name in NAMED] == list(NAMED)
    assert label(find_model("wmm2025:5")) == "wmm2025:5"
    assert label(Igrf14(degree=13)) == "igrf14" and label(Wmm2025(degree=12)) == "wmm2025"
    assert label(TiltedDipole(source="wmm2025")) == "tilted_dipole (scenario)"


def test_instants_end_where_they_should():
    assert instants(100.0, None, None, 30.0).tolist() == [0.0, 30.0, 60.0, 90.0, 100.0]
    assert instants(100.0, 0.6, None, 30.0).tolist() == [0.0, 30.0, 60.0]
    assert instants(100.0, None, 1.0, 30.0).tolist() == [0.0, 30.0, 60.0]
    assert instants(100.0, None, 0.1, 30.0).tolist() == [0.0, 6.0]
    assert len(instants(5700.0, None, None, 5700.0 / 360.0)) == 361


# ------------------------------------------------------------------ orbit


def test_orbit_as_json_is_the_library(field, strict_json):
    models = ["--model", "tilted_dipole", "--model", "averaged"]
    code, out, err = field("orbit", *CIRCLE, *models, "--step-s", "300", "--json")
    assert (code, err) == (0, "")
    answer = strict_json(out)
    assert answer.keys() == {
        "orbit", "start", "time_s", "argument_of_latitude_deg", "latitude_deg", "longitude_deg",
        "height_km", "fields",
    }  # fmt: skip
    assert [each["model"] for each in answer["fields"]] == ["tilted_dipole", "averaged"]
    orbit = Circular.model_validate(answer["orbit"])
    start, t_s = parse_utc(answer["start"]), np.array(answer["time_s"])
    assert t_s[-1] == pytest.approx(orbit.period_s, abs=1e-6) and len(t_s) == 21
    along = fields_along((FIELDS["tilted_dipole"](), FIELDS["averaged"]()), orbit, start, t_s)
    for m, each in enumerate(answer["fields"]):
        assert each.keys() == {
            "model", "b_inertial_nt", "b_orbital_nt", "strength_nt", "angle_to_first_deg"
        }  # fmt: skip
        for name, values in (
            ("b_inertial_nt", along.b_inertial),
            ("b_orbital_nt", along.b_orbital),
            ("strength_nt", along.strength),
        ):
            assert np.array(each[name]) == pytest.approx(1e9 * values[m], abs=1e-3)
    assert np.ptp(answer["fields"][1]["strength_nt"]) < 1e-3
    assert max(answer["fields"][1]["angle_to_first_deg"]) > 5.0


def test_orbit_prints_a_thinned_table(field):
    code, out, err = field("orbit", *CIRCLE, "--model", "direct_dipole", "--model", "averaged")
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[0] == "550 km, 51.7°, circular orbit, from 2025-07-01 00:00 UTC, 95.65 min"
    assert lines[3].split() == ["direct_dipole", "23492", "32010", "39641"]
    assert lines[4].split()[:4] == ["averaged", "31567", "31567", "31567"]
    rows = [line.split() for line in lines[8:]]
    assert len(rows) == 19 and {len(row) for row in rows} == {12}
    assert rows[0][:2] == ["0.00", "0.0"] and rows[-1][:2] == ["95.65", "0.0"]
    assert max(map(len, lines)) <= 100


def test_orbit_draws_its_pictures(field, tmp_path):
    out = tmp_path / "made" / "here"
    arguments = ["--model", "tilted_dipole", "--model", "averaged", "--out", out]
    code, text, err = field("orbit", *CIRCLE, "--revolutions", "1.5", *arguments)
    assert (code, err) == (0, "")
    assert text.endswith(f"{out}: inertial.png, orbital.png\n")
    assert {path.name for path in out.iterdir()} == {"inertial.png", "orbital.png"}
    for path in out.iterdir():
        assert np.ptp(matplotlib.image.imread(path)) == 1.0


def test_scenario_orbit_begins_at_its_start_with_its_field_first(field, scenario, strict_json):
    given = ["--scenario", scenario, "--duration-min", "20", "--step-s", "600", "--json"]
    answer = strict_json(field("orbit", *given, "--model", "direct_dipole")[1])
    assert answer["start"] == "2012-03-04T10:31:47+00:00"
    assert [each["model"] for each in answer["fields"]] == ["averaged", "direct_dipole"]
    whole = load_scenario(scenario)
    environment = whole.orbit_environment()
    t_s = np.array(answer["time_s"])
    b = environment.field(t_s, *environment.state(t_s))
    assert answer["fields"][0]["b_inertial_nt"] == pytest.approx(1e9 * b, abs=1e-3)
    later = strict_json(field("orbit", *given, "--start", "2025-01-01")[1])
    assert later["start"] == "2025-01-01T00:00:00+00:00"
    twice = strict_json(field("orbit", *given, "--model", "averaged")[1])
    assert [each["model"] for each in twice["fields"]] == ["averaged"]


def test_ut1_is_that_of_the_option_else_of_the_scenario(field, scenario, strict_json):
    def longitudes(*arguments):
        answer = field(
            "orbit", "--scenario", scenario, "--revolutions", "0.1", *arguments, "--json"
        )
        return np.array(strict_json(answer[1])["longitude_deg"])

    plain, second = longitudes(), 360.0 / 86164.0905
    given = longitudes("--ut1-minus-utc-s", "0.5")
    assert plain - given == pytest.approx(0.5 * second, abs=2e-6)
    own = "[environment]\nut1_minus_utc_s = -0.4\n"
    scenario.write_text(scenario.read_text().replace("[environment]\n", own))
    assert longitudes() - plain == pytest.approx(0.4 * second, abs=2e-6)
    assert np.array_equal(longitudes("--ut1-minus-utc-s", "0.5"), given)


def test_orbit_of_an_element_set_starts_at_its_epoch(field, tmp_path, strict_json):
    (tmp_path / "chibis.tle").write_text(TLE)
    given = ["--tle", tmp_path / "chibis.tle", "--duration-min", "2", "--model", "direct_dipole"]
    answer = strict_json(field("orbit", *given, "--json")[1])
    # day 58.91450162 of 2012: 27 February, 21:56:53
    assert answer["start"] == "2012-02-27T21:56:53+00:00"
    assert 480.0 < answer["height_km"][0] < 530.0
    assert field("orbit", *given)[1].startswith("chibis.tle, sgp4 orbit, from 2012-02-27 21:56")


ORBIT_MISTAKES = [
    ([], "orbit: must be given by --altitude-km and --inclination-deg, by --tle or by --scenario; "
     "received none of them"),
    ([*CIRCLE, "--tle", "x"], "orbit: must be given by --altitude-km and --inclination-deg, by "
     "--tle or by --scenario; received --altitude-km and --tle"),
    (CIRCLE[:2], "--inclination-deg: must be given; received nothing"),
    (CIRCLE[2:], "--altitude-km: must be given; received nothing"),
    (CIRCLE[:4], "--start: must be given with --altitude-km; received nothing"),
    (["--altitude-km", "-3", *CIRCLE[2:]], "--altitude-km: must be greater than 0; received -3"),
    (["--altitude-km", "550", "--inclination-deg", "181", "--start", "2025"],
     "--inclination-deg: must be less than or equal to 180; received 181"),
    ([*CIRCLE[:5], "soon"], "--start: must be a date (2025-07-01), a time with a zone "),
    ([*CIRCLE[:5], "2031"], "--start: field model igrf14: date must lie within 1900.0..2030.0; "),
    ([*CIRCLE[:5], "2029-12-31", "--duration-min", "1500"],
     "--start: field model igrf14: date must lie within 1900.0..2030.0; received 2030.000114 at "
     "t = 90000"),
    ([*CIRCLE, "--ut1-minus-utc-s", "1.2"],
     "--ut1-minus-utc-s: must lie within -0.9..0.9; received 1.2"),
    ([*CIRCLE, "--step-s", "0"], "--step-s: must be a positive number; received 0"),
    ([*CIRCLE, "--step-s", "1e-4"], "--step-s: must divide the time into at most 200000 steps; "
     "received 5.74e+07 steps of 0.0001 s"),
    ([*CIRCLE, "--revolutions", "nan"], "--revolutions: must be a positive number; received nan"),
    ([*CIRCLE, "--duration-min", "-1"], "--duration-min: must be a positive number; received -1"),
    ([*CIRCLE, "--duration-min", "1", "--revolutions", "1"],
     "--duration-min: must not be given with --revolutions; received both"),
    ([*CIRCLE, "--model", "dipole"], "--model: must be one of igrf14, wmm2025, tilted_dipole, "),
    ([*CIRCLE, *(word for n in range(1, 8) for word in ("--model", f"igrf14:{n}"))],
     "--model: must be given at most 6 times; received 7"),
    (["--tle", "nowhere"], "--tle: must be a readable file; received nowhere (No such file or"),
    (["--scenario", "nowhere"], "scenario: must be a readable file; received nowhere"),
]  # fmt: skip


@pytest.mark.parametrize(("arguments", "line"), ORBIT_MISTAKES)
def test_mistakes_of_an_orbit_are_one_line(field, arguments, line):
    code, out, err = field("orbit", *arguments)
    assert (code, out) == (2, "")
    assert err.startswith(f"error: {line}") and err.count("\n") == 1


def test_a_wrong_element_set_and_a_folder_in_the_way(field, tmp_path):
    (tmp_path / "wrong.tle").write_text(TLE.replace("51.6521", "51.6522"))
    err = field("orbit", "--tle", tmp_path / "wrong.tle")[2]
    assert err == "error: --tle: tle line 2: checksum must be 1; received 0\n"
    (tmp_path / "in_the_way").write_text("")
    for command in (["orbit", *CIRCLE], ["cone", "--inclination-deg", "5"], ["map"]):
        models = [] if command == ["map"] else ["--model", "direct_dipole"]
        code, out, err = field(*command, *models, "--out", tmp_path / "in_the_way")
        assert (code, out) == (2, "")
        assert err.startswith("error: --out: must be a folder that can be written; received ")


# ------------------------------------------------------------------ map and cone


def test_map_writes_a_picture_and_tells_the_extremes(field, strict_json, tmp_path):
    given = ["--model", "tilted_dipole", "--alt-km", "500", "--element", "Z"]
    code, out, err = field("map", *given)
    assert (code, err) == (0, "")
    least, greatest, path = out.splitlines()
    assert least.startswith("least    Z -") and greatest.startswith("greatest Z ")
    assert path == "runs/field/map_Z.png"
    assert np.ptp(matplotlib.image.imread(tmp_path / path)) == 1.0
    answer = strict_json(field("map", *given, "--json")[1])
    assert answer.keys() == {
        "model", "date", "altitude_km", "element", "unit", "least", "greatest", "picture"
    }  # fmt: skip
    assert answer["unit"] == "nT" and answer["greatest"]["latitude_deg"] == pytest.approx(
        80.8, abs=1.0
    )


def test_cone_writes_a_picture_and_a_page(field, strict_json, tmp_path):
    models = [word for name in CONE_MODELS[1:] for word in ("--model", name)]
    given = ["--inclination-deg", "51.7", *models]
    code, out, err = field("cone", *given)
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[0].endswith("cone of half-angle 60.076 deg, 31567 nT")
    assert lines[3].split() == ["direct_dipole", "23492", "32062", "39642", "1.091"]
    assert lines[4].split() == ["averaged", "31567", "31567", "31567", "0.000"]
    assert lines[-1] == "runs/field: cone.png, cone.html"
    assert np.ptp(matplotlib.image.imread(tmp_path / "runs/field/cone.png")) == 1.0
    assert (tmp_path / "runs/field/cone.html").stat().st_size > 1e6
    answer = strict_json(field("cone", *given, "--out", tmp_path / "other", "--json")[1])
    assert answer.keys() == {"orbit", "start", "half_angle_deg", "b0_nt", "models", "files"}
    assert [Path(each).name for each in answer["files"]] == ["cone.png", "cone.html"]
    assert [each["model"] for each in answer["models"]] == list(CONE_MODELS[1:])
    assert answer["models"][0].keys() == {
        "model", "least_nt", "mean_nt", "greatest_nt", "greatest_off_cone_deg"
    }  # fmt: skip
    assert answer["half_angle_deg"] == pytest.approx(60.0761, abs=1e-4)


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["map", "--element", "Q"], "--element: must be one of X, Y, Z, H, F, D, I; received 'Q'"),
        (["map", "--model", "averaged"], "--model: averaged is defined along an orbit only"),
        (["map", "--alt-km", "-100"], "--alt-km: must lie within -10..50000 km; received -100"),
        (["map", "--date", "1899"], "--date: must be a date (2025-07-01), "),
        (["cone"], 'Command "field cone" parameter --inclination-deg requires an argument.'),
        (["cone", "--inclination-deg", "-1"], "--inclination-deg: must be greater than or equal"),
        (["cone", "--inclination-deg", "5", "--date", "x"], "--date: must be a date (2025-07-01)"),
        (["cone", "--inclination-deg", "5", "--revolutions", "0"],
         "--revolutions: must lie within 0..500, 0 left out; received 0"),
        (["cone", "--inclination-deg", "5", "--revolutions", "600"],
         "--revolutions: must lie within 0..500, 0 left out; received 600"),
        (["fly"], 'Unknown command "fly"'),
    ],
)  # fmt: skip
def test_mistakes_of_maps_and_cones_are_one_line(field, arguments, line, tmp_path):
    code, out, err = field(*arguments)
    assert (code, out) == (2, "")
    assert err.startswith(f"error: {line}") and err.count("\n") == 1
    assert not (tmp_path / "runs").exists()


# ------------------------------------------------------------------ many points


def points_file(tmp_path, text):
    path = tmp_path / "places.csv"
    path.write_text(text)
    return path


def test_many_points_are_those_of_one_by_one(call, strict_json, tmp_path):
    places = [("55.75", "37.62", "550", "2025-07-01"), ("-33", "200", "0", "1999.5")]
    rows = "".join(",".join(row) + "\n" for row in places)
    path = points_file(tmp_path, f"date,lon , LAT,alt_km\n{_reordered(rows)}")
    code, out, err = call("field", "point", "--points", path)
    assert (code, err) == (0, "")
    table = list(csv.DictReader(io.StringIO(out)))
    columns = strict_json(call("field", "point", "--points", path, "--json")[1])
    for k, (lat, lon, alt, date) in enumerate(places):
        options = ("--lat", lat, "--lon", lon, "--alt-km", alt, "--date", date)
        one = strict_json(call("field", "point", *options, "--json")[1])
        for key, value in one["elements"].items():
            name = f"{key[0].upper()}_{'deg' if key.endswith('deg') else 'nT'}"
            assert float(table[k][name]) == pytest.approx(value, rel=1e-9)
            assert columns[name][k] == value
            rate = one["rates"][f"{key}_per_year"]
            assert columns[f"{name}_per_year"][k] == rate


def _reordered(rows):
    """Latitude, longitude, height, date as date, longitude, latitude, height."""
    parts = (line.split(",") for line in rows.splitlines())
    return "".join(f"{date},{lon},{lat},{alt}\n" for lat, lon, alt, date in parts)


@pytest.mark.parametrize(
    ("text", "options", "says"),
    [
        ("lat,alt\n1,2\n", ["--date", "2025"], "--points: must have a first line with the columns"),
        ("lat,lon\n1,2\n", [], "--date: must be given where --points has no column date"),
        ("lat,lon\n1,2\n1,x\n", ["--date", "2025"],
         "--points, line 3: lon must be a number; received 'x'"),
        ("lat,lon\n91,2\n", ["--date", "2025"], "--points, line 2: lat: must lie within -90..90"),
        ("lat,lon,date\n1,2,\n", [], "--points, line 2: date must be given, or --date"),
        ("lat,lon,date\n1,2,never\n", [], "--points, line 2: must be a date"),
        ("lat,lon\n", ["--date", "2025"], "--points: must have 1 to 1000000 places; received 0"),
        ("lat,lon\n1,2\n", ["--date", "2025", "--lat", "1"], "--points: must not be given with"),
        ("lat,lon\n1,2\n", ["--date", "2031"], "--date: field model igrf14: date must lie within"),
    ],
)  # fmt: skip
def test_bad_points_are_one_line(call, tmp_path, text, options, says):
    path = points_file(tmp_path, text)
    code, out, err = call("field", "point", "--points", path, *options)
    assert (code, out) == (2, "") and err.startswith(f"error: {says}") and err.count("\n") == 1


def test_extrapolation_is_linear_and_reported(call, strict_json):
    at = {}
    for date in ("2029", "2030", "2031"):
        place = ("--lat", "10", "--lon", "20", "--date", date, "--extrapolate", "--json")
        code, out, err = call("field", "point", *place)
        assert code == 0
        assert err.count("extrapolated") == (date == "2031")
        at[date] = strict_json(out)["elements"]["x_nt"]
    assert at["2031"] == pytest.approx(2.0 * at["2030"] - at["2029"], rel=1e-12)
    code, out, err = call(
        "field", "point", "--lat", "1", "--lon", "2", "--date", "2025", "--model",
        "direct_dipole", "--extrapolate",
    )  # fmt: skip
    assert (code, out) == (2, "") and "--extrapolate: must go with a model that has dates" in err
