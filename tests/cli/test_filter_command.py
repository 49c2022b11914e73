"""`torquer filter-check`: verdict and exit code, in words and as JSON; mistakes."""

import json
import shutil

import numpy as np
import plotly.graph_objects as go
import pytest
from unpacking import figures_on, trace

import torquer
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
axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]]
half_field_deg = 60
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
    assert code == 0 and out.splitlines()[-1].startswith("consistent; what goes wrong in")
    assert "ok   NEES of the attitude: " in out and "FAIL" not in out
    drawn = "each run draws noise, gyro bias (0.05 deg/s), any attitude, rate (0.0627 deg/s)"
    assert out.splitlines()[1] == drawn
    assert "not flown" not in out
    assert "ok   readings rejected in a run: " in out and "; restarts: none" in out
    path = with_filter("magnetometer_noise_nt = 20", "magnetometer_noise_nt = 200")
    code, out, _ = call("filter-check", path, "--runs", "20", "--json")
    found = json.loads(out)
    assert code == 1 and not found["consistent"] and found["verdict"] != "consistent"
    assert found["drawn"]["rate"]["unit"] == "deg/s" and found["runs_never_started"] == 0
    failed = {check["name"] for check in found["checks"] if not check["passed"]}
    assert "NIS of the magnetometer" in failed


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
def test_a_bias_of_the_scenario_that_no_run_flies_is_said(call, with_filter):
    path = with_filter("noise_deg_s = 0.01\n", "noise_deg_s = 0.01\nbias_deg_s = [3, -2, 1]\n")
    _, out, _ = call("filter-check", path, "--runs", "2")
    assert out.splitlines()[2] == (
        "not flown, as each run draws its own: the scenario's gyro bias of 3.74 deg/s, 74.8 sigma "
        "by gyro_bias_sigma_deg_s"
    )
    found = json.loads(call("filter-check", path, "--runs", "2", "--json")[1])
    assert found["not_flown"] == ["gyro bias of 3.74 deg/s, 74.8 sigma by gyro_bias_sigma_deg_s"]


def test_mistakes_are_reported(call, scenario, with_filter):
    code, _, err = call("filter-check", scenario)
    assert code == 2 and "control.estimator.kind: must be one of kalman_gyro" in err
    code, _, err = call("filter-check", with_filter(), "--runs", "1")
    assert code == 2 and "--runs: must be 2 or more; received 1" in err
    for value, received in (("-1", "-1"), ("nan", "nan")):
        code, _, err = call("filter-check", with_filter(), f"--attitude-sigma-deg={value}")
        must = f"--attitude-sigma-deg: must be 0 or more; received {received}"
        assert code == 2 and must in err


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
def test_a_folder_gets_the_report_with_its_pictures(call, with_filter, tmp_path):
    out = tmp_path / "checked"
    code, said, _ = call("filter-check", with_filter(), "--runs", "4", "--out", out)
    assert code in (0, 1) and said.splitlines()[-1] == str(out / "report.html")
    assert (out / "page.pdf").read_bytes().startswith(b"%PDF")
    page = (out / "report.html").read_text(encoding="utf-8")
    pictures = sorted(path.stem for path in (out / "plots").glob("*.png"))
    assert pictures == ["consistency", "errors_attitude", "errors_gyro_bias", "whiteness"]
    figures = figures_on(page)
    assert [*figures] == [
        "Attitude error.", "Gyro bias error.", "Consistency.", "Whiteness.",
    ]  # fmt: skip
    for figure in figures.values():
        go.Figure(figure)
    _, spread = trace(figures["Attitude error."], "±3 sigma of the runs")
    _, linear = trace(figures["Attitude error."], "±3 sigma, linear covariance")
    assert 0.2 < np.median(spread) / np.median(linear) < 5.0
    assert len(page) < 3e6
    assert "control.estimator (kalman_gyro)" in page and "@article{Lefferts1982," in page
    assert "NEES of the attitude" in page and "magnetometer_noise_nt = 20" in page


def test_expected_accuracy_is_reported_for_filter_and_sensor_subsets(call, with_filter, tmp_path):
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
    for option in ("--runs", "--rate-sigma-deg-s"):
        code, _, err = call("filter-check", with_filter(), "--expected", option, "5")
        assert code == 2 and f"{option}: must be left out with --expected; received 5" in err


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
def test_a_filter_that_never_starts_is_reported_in_words(call, with_filter, tmp_path):
    """With the reason, and without a number that is none; in words, as JSON and on the page."""
    path = with_filter("magnetometer_noise_nt = 20\n", 'sensors = ["sun"]\n')
    out = tmp_path / "checked"
    code, said, _ = call("filter-check", path, "--runs", "3", "--out", out)
    why = "it needs a second sensor, or an attitude from another estimator"
    assert code == 1 and "nan" not in said
    assert said.splitlines()[-2] == f"never started: {why}"
    assert not any(line.startswith(("ok ", "FAIL")) for line in said.splitlines())
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Never started" in page and "nan" not in page.replace("nano", "")
    assert "<script" not in page and "need JavaScript" not in page
    code, said, _ = call("filter-check", path, "--runs", "3", "--json")
    found = json.loads(said)
    assert code == 1 and found["verdict"] == "never started" and found["error_deg"] is None
    assert found["runs_never_started"] == 3 and found["verdict_text"].endswith(why)


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
def test_a_start_as_stated_and_what_is_rejected(call, with_filter):
    """A field 30 sigma off, from a bias that is no state: readings rejected, restarts."""
    path = with_filter(
        "noise_nt = 20\n[initial]", "noise_nt = 20\nbias_nt = [900, 0, 0]\n[initial]"
    )
    same = ("--attitude-sigma-deg", "0", "--rate-sigma-deg-s", "0")
    code, said, _ = call("filter-check", path, "--runs", "4", *same, "--json")
    found = json.loads(said)
    assert code == 1 and set(found["drawn"]) == {"gyro bias", "magnetometer bias"}
    assert found["drawn"]["magnetometer bias"]["sigma"] == pytest.approx(900.0 / 3.0**0.5)
    assert found["verdict"] == "optimistic" and found["rejected_mean"] > 20.0
    assert found["restarted_runs"] > 0 and found["rejected_by_chance"] < 0.01


SMOOTHED = "record_s = 1.0\nrecord_inputs = true"


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
def test_a_run_is_smoothed_into_its_folder(call, with_filter, tmp_path):
    path, out = with_filter("record_s = 5.0", SMOOTHED), tmp_path / "flown"
    call("run", path, "--out", out, "--no-report")
    code, said, _ = call("smooth", out)
    assert code == 0 and said.splitlines()[-1] == f"{out}: smoothed.nc, smoothed.png"
    found = torquer.load(out / "smoothed.nc")
    assert np.isfinite(found["q_smoothed"].values).all()
    assert (out / "smoothed.png").stat().st_size > 10_000
    elsewhere = tmp_path / "elsewhere"
    code, said, _ = call("smooth", out / "result.nc", "--json", "--out", elsewhere)
    accuracy = json.loads(said)
    assert code == 0 and accuracy["smoothed_deg"] < accuracy["filter_deg"]
    assert sorted(each.name for each in elsewhere.iterdir()) == ["smoothed.nc", "smoothed.png"]


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
def test_what_cannot_be_smoothed_is_reported(call, with_filter, tmp_path):
    code, _, err = call("smooth", tmp_path / "nothing")
    assert code == 2 and "RESULT: must be folders of runs, or result.nc" in err
    out = tmp_path / "flown"
    call("run", with_filter(), "--out", out, "--no-report")
    code, _, err = call("smooth", out)
    assert code == 2 and "simulation.record_inputs: must be true in a run that is to be" in err


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_the_exported_filter_has_the_same_statistics(call, with_filter, tmp_path):
    """And they are those of the library: with another constant in C they differ."""
    path, folder = with_filter(), tmp_path / "in_c"
    torquer.export_c(torquer.load_scenario(path), folder, steps=1)
    runs = ("filter-check", path, "--runs", "2", "--json")
    _, without, _ = call(*runs)
    _, flown, _ = call(*runs, "--computer", folder)
    assert json.loads(flown) == json.loads(without)
    source = folder / "adcs.c"
    spoiled = source.read_text().replace(
        "given.readings[3][0] = inputs->sun_body[0];",
        "given.readings[3][0] = 0.999 * inputs->sun_body[0];",
    )
    source.write_text(spoiled)
    _, other, _ = call(*runs, "--computer", folder)
    assert json.loads(other) != json.loads(without)


def test_a_computer_flies_nothing_where_accuracy_is_expected(call, with_filter, tmp_path):
    code, _, err = call("filter-check", with_filter(), "--expected", "--computer", tmp_path)
    assert code == 2 and "--computer: must be left out with --expected" in err
    code, _, err = call("filter-check", with_filter(), "--computer", tmp_path)
    assert code == 2 and "computer: must be a folder of" in err.replace("\n", " ")
