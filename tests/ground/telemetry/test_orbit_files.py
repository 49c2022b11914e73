"""The orbit of a session may be positions of an ephemeris file."""

import numpy as np
import pytest
from environment.orbit.orbit_files import START, gcrf, oem_text, sp3_text, times

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
