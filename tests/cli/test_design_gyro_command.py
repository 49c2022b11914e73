"""`torquer design magneto-gyro`: a satellite to a law that flies, and one line per mistake."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from torquer.analysis.attitude import attitude_error_of
from torquer.control.magneto_gyro.law import MagnetoGyro
from torquer.scenario.load import load_scenario
from torquer.simulation.simulate import simulate

EXAMPLE = Path(__file__).parents[2] / "examples/magneto_gyro.toml"
QUICK = ("--evaluations", 20)


@pytest.fixture
def changed(tmp_path):
    """The example with a text replaced, as a file."""

    def make(old, new):
        text = EXAMPLE.read_text()
        assert old in text
        path = tmp_path / "satellite.toml"
        path.write_text(text.replace(old, new))
        return path

    return make


def test_the_law_that_it_writes_flies_as_predicted(call, strict_json, tmp_path):
    code, out, err = call("design", "magneto-gyro", EXAMPLE, *QUICK, "--json", "--out", tmp_path)
    assert (code, err) == (0, "")
    found = strict_json(out)
    assert found["degree"] > 0.2 and found["stage_1"]["degree"] > 0.3
    assert min(found["margins"].values()) > 0.1
    assert found["greatest_tip_off_rad_s"] > np.radians(3.0)
    law = tomllib.loads((tmp_path / "law.toml").read_text())["control"]["law"]
    assert law == found["law"]
    scenario = load_scenario(EXAMPLE).replace("simulation.revolutions", 20.0)
    result = simulate(scenario.replace("control.law", law))
    error, orbits = attitude_error_of(result).error_deg, result.time.values / 6089.0
    assert np.linalg.norm(error[orbits > 8.0], axis=1).max() < 5.0
    parts = (np.array(found["errors_deg"][name]) for name in ("noise", "field model"))
    want = np.sqrt(sum(part**2 for part in parts))
    assert np.sqrt(np.mean(error[orbits > 10.0] ** 2, axis=0)) == pytest.approx(want, rel=0.2)


def test_the_form_of_the_text_has_the_dipole_and_windows_the_duty(call, strict_json, changed):
    path = changed("sample_s = 1.0", "sample_s = 1.0\nmeasure_s = 1.0\nactuate_s = 4.0")
    code, out, _ = call("design", "magneto-gyro", path, "--form", "text", *QUICK, "--json")
    law = strict_json(out)["law"]
    assert law["coil_duty"] == 0.8
    assert code == 0 and law["form"] == "text" and len(law["dipole_nt"]) == 3
    assert MagnetoGyro.model_validate(law).law().values()["dipole"].used == 1.0


def test_what_is_printed(call, changed):
    """With a weak wheel there is a note, and the wheel that would do."""
    path = changed("wheel_momentum_n_m_s = [0, 30, 0]", "wheel_momentum_n_m_s = [0, 15.0, 0]")
    code, out, err = call("design", "magneto-gyro", path, *QUICK, "--degree", 0.2)
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[0].startswith("satellite: J = 3699 kg m^2, lambda = 0.595, h = 2.5")
    assert any("by the frozen model" in line for line in lines)
    assert "note: h = 2.53 is near 2 or below it" in out and "20.6 N m s has h = 4" in out
    assert "[control.law]" in lines and 'kind = "magneto_gyro"' in lines
    assert max(map(len, lines)) <= 140


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[0, 30, 0]", "[0, 5, 0]", "spacecraft.body.wheel_momentum_n_m_s: must be above 5.362 "
                                    "N m s along the orbit normal, (2 - lambda) J nu0; received 5"),
        ("[0, 30, 0]", "[0, 9, 0]", "spacecraft.body.wheel_momentum_n_m_s: must make stage 1 "
                                    "stable, as 20.62 N m s would (h = 4); received 9 (h = 0.953)"),
    ],
)  # fmt: skip
def test_a_satellite_on_which_it_cannot_work(call, changed, old, new, message):
    path = changed(old, new)
    code, out, err = call("design", "magneto-gyro", path, *QUICK)
    assert (code, out, err) == (2, "", f"error: {message}\n")


def test_a_satellite_without_coils(call, scenario):
    text = scenario.read_text().replace('"bdot", gain_a_m2_s_per_t = 1e6', '"off"')
    scenario.write_text(text.replace("[spacecraft.coils]\nlimit_a_m2 = 3.0\n", ""))
    code, out, err = call("design", "magneto-gyro", scenario)
    must = "spacecraft.coils: must be given for magnetic control; received none"
    assert (code, out, err) == (2, "", f"error: {must}\n")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--tip-off-deg-s", 5, "--filter-rate-rad-s", 0.1),
         "--filter-rate-rad-s: must be at least 0.1091 to brake 5 deg/s (--tip-off-deg-s); "
         "received 0.1"),
        (("--degree", 2), "--degree: must lie within 0.01..1; received 2"),
        (("--tip-off-deg-s", 0), "--tip-off-deg-s: must lie within 0.01..30; received 0"),
    ],
)  # fmt: skip
def test_mistakes_are_one_line(call, options, message):
    code, out, err = call("design", "magneto-gyro", EXAMPLE, *options)
    assert (code, out, err) == (2, "", f"error: {message}\n")
