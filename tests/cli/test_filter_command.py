"""`torquer filter-check`: verdict and exit code, in words and as JSON; mistakes."""

import json

import pytest

from torquer.compile import engine

FILTER = """
[control.estimator]
kind = "kalman_gyro"
magnetometer_noise_nt = 20
sun_noise_deg = 0.1
angle_random_walk_deg_sqrt_s = 0.01
rate_random_walk_deg_s_sqrt_s = 1e-4
gyro_bias_sigma_deg_s = 0.05
[spacecraft.gyro]
noise_deg_s = 0.01
bias_drift_deg_s_sqrt_s = 1e-4
[spacecraft.sun_sensors]
axes = [[1, 0, 0], [-1, 0, 0]]
half_field_deg = 90
noise_deg = 0.1
"""
LAW = 'law = { kind = "bdot", gain_a_m2_s_per_t = 1e6 }\n'


@pytest.fixture
def with_filter(scenario):
    """`with_filter(old, new)`: the scenario with a filter, a text in it replaced."""
    plain = scenario.read_text()

    def write(old="", new=""):
        text = plain.replace(LAW, 'law = { kind = "off" }\n')
        text = text.replace("sample_s = 2.0", "sample_s = 1.0") + FILTER
        text = text.replace("[1.0, -2.0, 3.0]", "[0.1, -0.2, 0.3]")
        scenario.write_text(text.replace(old, new) if old else text)
        return scenario

    return write


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
def test_an_honest_filter_passes_and_another_fails(call, with_filter):
    code, out, _ = call("filter-check", with_filter(), "--runs", "20")
    assert code == 0 and out.splitlines()[-1] == "consistent"
    assert "ok   NEES of the attitude: " in out and "FAIL" not in out
    path = with_filter("magnetometer_noise_nt = 20", "magnetometer_noise_nt = 200")
    code, out, _ = call("filter-check", path, "--runs", "20", "--json")
    found = json.loads(out)
    assert code == 1 and not found["consistent"]
    failed = {check["name"] for check in found["checks"] if not check["passed"]}
    assert "NIS of the magnetometer" in failed


def test_mistakes_are_told(call, scenario, with_filter):
    code, _, err = call("filter-check", scenario)
    assert code == 2 and "control.estimator.kind: must be one of kalman_gyro" in err
    code, _, err = call("filter-check", with_filter(), "--runs", "1")
    assert code == 2 and "--runs: must be 2 or more; received 1" in err


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
def test_a_folder_gets_the_report_with_its_pictures(call, with_filter, tmp_path):
    out = tmp_path / "checked"
    code, said, _ = call("filter-check", with_filter(), "--runs", "4", "--out", out)
    assert code in (0, 1) and said.splitlines()[-1] == str(out / "report.html")
    page = (out / "report.html").read_text(encoding="utf-8")
    pictures = sorted(path.stem for path in (out / "plots").glob("*.png"))
    assert pictures == ["consistency", "errors_attitude", "errors_gyro_bias", "whiteness"]
    assert page.count("data:image/png;base64,") == 4
    assert "NEES of the attitude" in page and "magnetometer_noise_nt = 20" in page


def test_what_to_expect_is_told_for_the_filter_and_its_parts(call, with_filter, tmp_path):
    """As a table, in a picture, and as numbers; nothing is flown."""
    code, out, _ = call("filter-check", with_filter(), "--expected", "--out", tmp_path)
    lines = [line for line in out.splitlines() if " + gyro" in line or "gaps: " in line]
    names = ("magnetometer + Sun sensors + gyro", "magnetometer + gyro", "Sun sensors + gyro")
    assert code == 0 and len(lines) == 4
    assert all(name in line for name, line in zip(names, lines, strict=False))
    assert " min " in lines[0] and all(" - " in line for line in lines[1:3])
    assert "flights show how long it takes" in out
    assert "unknown" in lines[2] and (tmp_path / "expected.png").stat().st_size > 10_000
    code, out, _ = call("filter-check", with_filter(), "--expected", "--json")
    sets = json.loads(out)["sensor_sets"]
    assert code == 0 and [each["sensors"] for each in sets] == list(names)
    assert sets[0]["light_95_deg"] < sets[1]["light_95_deg"] < sets[2]["light_95_deg"]
    after = [each["below_5_deg_after_s"] for each in sets]
    assert after[0] >= 0.0 and after[1:] == [None, None]
    assert len(sets[0]["windows"][0]["singular_values"]) == 6


def test_runs_and_expectation_exclude_each_other(call, with_filter):
    code, _, err = call("filter-check", with_filter(), "--expected", "--runs", "5")
    assert code == 2 and "--runs: must be left out with --expected; received 5" in err
