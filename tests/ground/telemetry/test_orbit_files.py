"""The orbit of a session may be positions of an ephemeris file."""

import numpy as np
import pytest
from environment.orbit.orbit_files import ISS, START, gcrf, oem_text, sp3_text, times

from torquer.base.limits import RequestError
from torquer.ground.telemetry.orbit import load_orbit


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
    assert load_orbit(file, START)[0].tle == ISS.tle
