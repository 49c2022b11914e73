"""The orbit of a session may be positions of an ephemeris file."""

import json
from datetime import timedelta

import numpy as np
import pytest
from environment.orbit.orbit_files import ISS, START, gcrf, oem_text, sp3_text, times
from sgp4 import exporter
from sgp4.api import Satrec

from torquer.base.limits import RequestError
from torquer.environment.along_orbit import Environment, OrbitEnvironment
from torquer.environment.orbit.sgp4 import checksum
from torquer.ground.telemetry.orbit import load_orbit

INSTANTS = np.linspace(0.0, 6900.0, 24)
T_S = np.array([0.0, 10.0, 600.0])
#: The epoch of the elements in words.
EPOCH = f"{START:%Y-%m-%dT%H:%MZ}"


@pytest.mark.parametrize(("name", "write"), (("iss.oem", oem_text), ("iss.sp3", sp3_text)))
def test_positions_are_an_orbit(tmp_path, name, write):
    file = tmp_path / name
    file.write_text(write(times()))
    orbit, said = load_orbit(file, START)
    assert said == f"positions every 60 s in {name}"
    within = np.linspace(0.0, 6900.0, 101)
    assert np.abs(orbit.state(within, START)[0] - gcrf(within)[0]).max() < 2e-3
    table = tmp_path / "orbit.toml"
    table.write_text(f"start = {START.isoformat()}\norbit = {{ kind = 'file', file = '{name}' }}\n")
    again, _ = load_orbit(table, START)
    assert np.array_equal(again.state(within, START), orbit.state(within, START))


def test_a_damaged_file_is_told_in_a_line(tmp_path):
    file = tmp_path / "iss.oem"
    file.write_text(oem_text(times()).replace("REF_FRAME = EME2000", "REF_FRAME = MARS"))
    with pytest.raises(RequestError, match=r"^orbit: iss\.oem line 9: axes must be one of [^\n]*$"):
        load_orbit(file, START)


def test_lines_of_elements_may_be_indented(tmp_path):
    file = tmp_path / "iss.tle"
    file.write_text("".join(f"  {line}  \r\n" for line in ("ISS", *ISS.tle)))
    found, said = load_orbit(file, START)
    assert np.array_equal(found.state(INSTANTS, START), ISS.state(INSTANTS, START))
    assert said == f"SGP4, elements of 25544 ISS of {EPOCH}, 0.0 d after the middle row"


def test_elements_are_read_as_a_message_of_a_catalogue(tmp_path):
    """Once "must be TOML"; and of several satellites the nearest epoch was taken."""
    fields = exporter.export_omm(Satrec.twoline2rv(*ISS.tle), "ISS (ZARYA)")
    (tmp_path / "omm.json").write_text(json.dumps([fields]))
    found, said = load_orbit(tmp_path / "omm.json", START + timedelta(days=2))
    apart = found.state(INSTANTS, START)[0] - ISS.state(INSTANTS, START)[0]
    assert (
        np.abs(apart).max() < 1e-3
        and said == f"SGP4, elements of 25544 ISS (ZARYA) of {EPOCH}, 2.0 d before the middle row"
    )
    (tmp_path / "two.json").write_text(json.dumps([fields, fields | {"NORAD_CAT_ID": 48274}]))
    with pytest.raises(
        RequestError,
        match=r"^orbit: must be a TOML file with a table \[orbit\] of kind 'file' for this one: "
        r"satellite must name one of the file's by catalogue number or name \(25544 ISS",
    ):
        load_orbit(tmp_path / "two.json", START)


def test_the_set_that_is_stated_is_the_one_that_is_used(tmp_path):
    """Whatever instant the orbit is asked from later."""
    later = ISS.tle[0][:68].replace("25182.5", "25190.5")
    text = "\n".join((*ISS.tle, later + str(checksum(later)), ISS.tle[1]))
    (tmp_path / "sets.tle").write_text(text)
    found, _ = load_orbit(tmp_path / "sets.tle", START)
    day = START + timedelta(days=7)
    assert np.allclose(
        found.state(np.zeros(1), day), ISS.state(np.zeros(1), day), rtol=0.0, atol=1e-3
    )


def test_elements_without_checksums_are_told_where_to_say_so(tmp_path):
    (tmp_path / "old.tle").write_text("\n".join(line[:68] for line in ISS.tle))
    with pytest.raises(
        RequestError, match=r"; a TOML file with \[orbit\] file and orbit\.without_"
    ):
        load_orbit(tmp_path / "old.tle", START)
    table = tmp_path / "orbit.toml"
    keys = "kind = 'file', file = 'old.tle', without_checksums = true"
    table.write_text(f"start = {START.isoformat()}\norbit = {{ {keys} }}\n")
    found, _ = load_orbit(table, START)
    assert np.array_equal(found.state(INSTANTS, START), ISS.state(INSTANTS, START))


@pytest.mark.parametrize("kind", ("circular", "file"))
def test_the_field_along_the_orbit_of_a_table(tmp_path, kind):
    """It ended in an AttributeError: such an orbit had no `check_span`."""
    (tmp_path / "iss.oem").write_text(oem_text(times()))
    own = {"circular": "altitude_km = 500\ninclination_deg = 50\n", "file": 'file = "iss.oem"\n'}
    table = tmp_path / "orbit.toml"
    table.write_text(f'start = {START.isoformat()}\n[orbit]\nkind = "{kind}"\n{own[kind]}')
    orbit, later = load_orbit(table, START)[0], START + timedelta(seconds=1800)
    around = OrbitEnvironment(Environment(), orbit, later)
    b = around.field(T_S, *around.state(T_S))
    plain = OrbitEnvironment(Environment(), orbit.orbit, START)
    at = T_S + 1800.0
    assert np.allclose(b, plain.field(at, *plain.state(at)), rtol=1e-5, atol=1e-10)
    around.check_dates(0.0, 600.0)
    if kind == "file":
        assert orbit.knot_s(later) == pytest.approx(orbit.orbit.knot_s(START) - 1800.0)
        assert orbit.step_s == 60.0
        with pytest.raises(ValueError, match="must cover the run"):
            around.check_dates(0.0, 7000.0)


def test_a_file_of_another_suffix_may_be_toml(tmp_path):
    file = tmp_path / "orbit.txt"
    table = '[orbit]\nkind = "circular"\naltitude_km = 500\ninclination_deg = 50\n'
    file.write_text(f"start = {START.isoformat()}\n{table}")
    assert load_orbit(file, START)[1] == "circular orbit of orbit.txt"
    file.write_text(table)
    with pytest.raises(RequestError, match="must state `start`"):
        load_orbit(file, START)


def write_sets(path, *sets):
    """Sets of (name, number, days after those of the ISS) as two-line elements."""
    lines = []
    for name, number, days in sets:
        first, second = (line[:2] + f"{number:05d}" + line[7:68] for line in ISS.tle)
        first = first.replace("25182.5", f"25{182.5 + days:.1f}")
        lines += [name, *(line + str(checksum(line)) for line in (first, second))]
    path.write_text("\n".join(lines))
    return path


def test_a_satellite_is_chosen_by_name_or_number(tmp_path):
    """And of its sets the one nearest to the middle row, not of another's."""
    file = write_sets(
        tmp_path / "many.tle", ("ONE", 11111, 0.0), ("TWO", 22222, 3.0), ("TWO", 22222, 8.0)
    )
    for satellite in ("two", "22222"):
        _, said = load_orbit(file, START + timedelta(days=2), satellite)
        at = START + timedelta(days=3.0)
        assert said == (
            f"SGP4, elements of 22222 TWO of {at:%Y-%m-%dT%H:%MZ}, the nearest of 2 sets, 1.0 d "
            "after the middle row"
        )
    with pytest.raises(RequestError, match="satellite must name one of the file's by catalogue n"):
        load_orbit(file, START)
    table = tmp_path / "orbit.toml"
    table.write_text(f"orbit = {{ kind = 'sgp4', tle = {list(ISS.tle)} }}\n".replace("'", '"'))
    said = load_orbit(table, START)[1]
    assert said == f"SGP4, elements of 25544 of {EPOCH}, 0.0 d after the middle row"
    with pytest.raises(RequestError, match=r"^satellite: must be left out for a table \[orbit\]"):
        load_orbit(table, START, "ISS")


@pytest.mark.parametrize("days", [31.0, -31.0])
def test_old_elements_are_refused_unless_they_are_wanted(tmp_path, days):
    file, at = write_sets(tmp_path / "iss.tle", ("ISS", 25544, 0.0)), START + timedelta(days=days)
    side = "before" if days > 0.0 else "after"
    with pytest.raises(RequestError) as refused:
        load_orbit(file, at)
    assert str(refused.value) == (
        "orbit: must have elements within 30 d of the middle row (most_age_days); received SGP4, "
        f"elements of 25544 ISS of {EPOCH}, 31.0 d {side} the middle row"
    )
    assert load_orbit(file, at, most_age_days=40.0)[1].startswith("SGP4, elements of 25544 ISS")
    assert load_orbit(file, START + timedelta(days=29.9))
