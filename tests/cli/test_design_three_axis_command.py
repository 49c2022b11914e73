"""`torquer design three-axis`: table, JSON, map, laws that fly, and one line per mistake."""

import contextlib
import io
import re
import tomllib

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import torquer
from torquer.analysis.derived import attitude_error_angle
from torquer.cli import main
from torquer.scenario.load import scenario_from_data

CUBESAT = ("--inertia", 0.015, 0.014, 0.007, "--altitude-km", 470, "--inclination-deg", 52,
           "--limit-a-m2", 0.2, "--sample-s", 10, "--field", "averaged",
           "--residual-a-m2", 2e-4, 0, 0, "--attitude-noise-deg", 0.1)  # fmt: skip

#: Coils that can do next to nothing.
WEAK = tuple(1e-9 if each == 0.2 else each for each in CUBESAT)


@pytest.fixture(scope="module")
def design(tmp_path_factory):
    """A design by options: its folder, what is printed."""
    folder = tmp_path_factory.mktemp("design")
    arguments = "design", "three-axis", *CUBESAT, "--json", "--out", folder
    with contextlib.redirect_stdout(io.StringIO()) as printed, pytest.raises(SystemExit) as left:
        main([str(each) for each in arguments])
    assert left.value.code == 0
    return folder, printed.getvalue()


def test_a_design_by_options(strict_json, design):
    folder, found = design[0], strict_json(design[1])
    assert set(found["candidates"]) == {"formula", "refined", "regulator"}
    refined, regulator = (found["candidates"][name] for name in ("refined", "regulator"))
    assert 0.0 < refined["degree_per_rad"] < regulator["degree_per_rad"]
    assert refined["margins"]["greatest_gain"] >= 2.0 * (1.0 - 1e-3)
    assert regulator["error"]["greatest_deg"] < 2.0 < refined["error"]["greatest_deg"]
    by_source = regulator["error"]["by_source_deg"]
    assert max(by_source, key=by_source.get) == "residual dipole"
    assert refined["law"]["kind"] == "three_axis" and refined["law"]["reference"] == "orbital"
    names = ["formula.toml", "map.png", "page.pdf", "refined.toml", "regulator.toml",
             "scenario.toml", "trim.toml"]  # fmt: skip
    assert found["trim"]["law"]["kind"] == "dipole_trim"
    left, errors = found["trim"]["error_deg"], found["candidates"]
    assert left and all(not errors[name]["error"]["is_linear"] for name in left)
    assert sorted(path.name for path in folder.iterdir()) == names
    assert (folder / "map.png").read_bytes().startswith(b"\x89PNG")


def test_the_scenario_that_it_writes_holds_with_the_dipole_trimmed(design):
    scenario = torquer.load_scenario(design[0] / "scenario.toml")
    assert set(scenario.control.named().laws) == {"hold", "trim"}
    error_deg = attitude_error_angle(torquer.simulate(scenario)).values
    assert error_deg[0] == pytest.approx(10.0) and error_deg[-50:].max() < 2.0


def test_a_law_in_a_file_is_executed_only_if_allowed(call, scenario, tmp_path):
    (tmp_path / "law.py").write_text(f"open({str(tmp_path / 'executed')!r}, 'w').close()\n")
    law = 'law = { kind = "user", file = "law.py" }'
    text = scenario.read_text()
    scenario.write_text("\n".join(law if "law =" in line else line for line in text.splitlines()))
    code, _, err = call("design", "three-axis", scenario, "--no-user-code")
    assert code == 2 and "control.law.file: must not be given with --no-user-code" in err
    assert not (tmp_path / "executed").exists()


def test_scenario_without_a_law_is_told_what_suffices(call, scenario):
    text = scenario.read_text()
    start = text.index("[control]")
    scenario.write_text(text[:start] + text[text.index("[simulation]") :])
    code, _, err = call("design", "three-axis", scenario)
    assert code == 2 and err.endswith(
        "error: control: must be given; received nothing (for a design a table [control] with "
        'sample_s and law = { kind = "off" } is enough)\n'
    )


def test_a_law_of_the_scenario_is_reported(call, strict_json, scenario):
    """Beside the laws that are designed; the air disturbs it."""
    text = scenario.read_text().replace("[1.0, 1.2, 1.5]", "[1.2, 1.5, 1.0]")
    law = '{ kind = "projected_pd", rate_gain_n_m_s = 2e-3, angle_gain_n_m = 2e-6 }'
    lines = [f"law = {law}" if line.startswith("law =") else line for line in text.splitlines()]
    text = "\n".join(lines).replace("sample_s = 2.0", "sample_s = 20.0")
    field = 'field = { kind = "averaged" }'
    text = text.replace(field, f'{field}\natmosphere = {{ kind = "gost", f107 = 150, ap = 12 }}')
    air = (
        '[spacecraft.aerodynamics]\nparts = [{ kind = "cylinder", axis = [0, 0, 1], '
        "radius_m = 0.1, length_m = 0.5, centre_m = [0, 0, 0.01] }]\n"
    )
    scenario.write_text(f"{text}\n{air}")
    code, out, err = call("design", "three-axis", scenario, "--gain-margin", 1.5, "--json")
    assert (code, err) == (0, "")
    own = strict_json(out)["candidates"]["own"]
    assert own["law"]["kind"] == "projected_pd" and own["capture"] is None
    assert own["degree_per_rad"] > 0.0 and own["error"]["by_source_deg"]["air"] > 0.0


def test_a_body_that_no_scalar_gains_hold_has_a_map(call, strict_json, tmp_path):
    """One that gravity turns over: the isolines of nothing ended in StopIteration."""
    body = ("--inertia", 0.05, 0.10, 0.13, "--altitude-km", 500, "--inclination-deg", 60)
    more = ("--limit-a-m2", 0.2, "--field", "direct_dipole", "--out", tmp_path, "--json")
    code, out, err = call("design", "three-axis", *body, *more)
    assert (code, err) == (0, "") and (tmp_path / "map.png").stat().st_size > 3000
    found = strict_json(out)
    assert not found["gains_found"]
    assert found["candidates"]["refined"]["degree_per_rad"] < 0.0
    assert found["candidates"]["regulator"]["degree_per_rad"] > 0.0


def test_a_law_with_a_large_steady_error_is_called_unusable(call, strict_json):
    torque = ("--torque-n-m", 2e-7, 0, 0, "--capture-within-deg", 2.0)
    code, out, _ = call("design", "three-axis", *CUBESAT, *torque, "--json")
    assert code == 0
    for each in strict_json(out)["candidates"].values():
        large = each["error"] is not None and not _is_below(each["error"], 2.0)
        assert any(x["text"].startswith("unusable: ") for x in each["verdict"]["doubts"]) == large
    assert any(
        not _is_below(each["error"], 2.0) for each in strict_json(out)["candidates"].values()
    )


def _is_below(error, deg):
    """Beyond the linear range the error has no number."""
    return error["is_linear"] and error["greatest_deg"] <= deg


def test_beyond_the_linear_range_there_is_no_number_but_a_cause(call, strict_json):
    """A residual dipole of 5 mA m^2: it printed an error of 2340 deg."""
    code, out, _ = call("design", "three-axis", *CUBESAT, "--torque-n-m", 3e-6, 0, 0, "--json")
    assert code == 0
    found = [each for each in strict_json(out)["candidates"].values() if each["error"]]
    beyond = [each for each in found if not each["error"]["is_linear"]]
    assert beyond
    for each in beyond:
        error = each["error"]
        assert error["greatest_deg"] is error["rms_deg"] is error["by_source_deg"] is None
        assert sum(error["shares"].values()) == pytest.approx(1.0)
        assert any(
            note.startswith("its error is made by constant torque") for note in each["notes"]
        )
        assert not any("compensate a constant dipole" in note for note in each["notes"])


def test_the_regulator_flies_as_predicted(design, strict_json):
    """From its TOML: residual dipole and noise of the attitude, ten revolutions."""
    law = tomllib.loads((design[0] / "regulator.toml").read_text())["control"]["law"]
    scenario = scenario_from_data({
        "start": "2025-01-01T00:00:00Z",
        "orbit": {"kind": "circular", "altitude_km": 470, "inclination_deg": 52},
        "environment": {"field": {"kind": "averaged"}},
        "spacecraft": {"body": {"inertia_kg_m2": [0.015, 0.014, 0.007]},
                       "coils": {"limit_a_m2": 0.2, "residual_dipole_a_m2": [2e-4, 0, 0]},
                       "attitude_sensor": {"noise_deg": 0.1}},
        "initial": {"reference": "orbital", "rate_relative_to": "orbital",
                    "rate_deg_s": [0, 0, 0], "euler_deg": [3.0, -2.0, 4.0]},
        "control": {"law": law, "sample_s": 10.0},
        "simulation": {"revolutions": 10, "record_s": 30.0},
    })  # fmt: skip
    run = torquer.simulate(scenario)
    last = run.isel(time=slice(-188, None))
    r, v = last.position_inertial.values, last.velocity_inertial.values
    up = r / np.linalg.norm(r, axis=1)[:, None]
    normal = np.cross(r, v) / np.linalg.norm(np.cross(r, v), axis=1)[:, None]
    frame = Rotation.from_matrix(np.stack([np.cross(normal, up), normal, up], axis=2))
    turns = (frame.inv() * Rotation.from_quat(last.q_body_to_inertial.values)).magnitude()
    error = strict_json(design[1])["candidates"]["regulator"]["error"]
    assert np.degrees(np.sqrt(np.mean(turns**2))) == pytest.approx(error["rms_deg"], rel=0.05)
    assert np.degrees(turns.max()) < error["greatest_deg"] + 5.0 * error["noise_rms_deg"]


def test_a_scenario_gives_the_satellite(call, scenario):
    """The conftest's, whose law holds no attitude; nothing disturbs it."""
    text = scenario.read_text().replace("inclination_deg = 60", "inclination_deg = 98")
    scenario.write_text(text.replace("sample_s = 2.0", "sample_s = 20.0"))
    starts = ("--capture-runs", 16, "--capture-rate-deg-s", 0.1)
    code, out, err = call("design", "three-axis", scenario, "--gain-margin", 1.5, *starts)
    assert (code, err) == (0, "")
    assert "refined: captures nothing" in out  # a body that gravity would turn over
    assert "refined: no gains within the coils' limit are stable with a gain margin of 1.5" in out
    assert "initial attitudes (" in out and "to within 30 deg in" in out
    captured = re.search(r"regulator: captures (\d+) of 16 random initial attitudes \(", out)
    assert 12 <= int(captured[1]) <= 16
    missed = 16 - int(captured[1])
    said = f"degree and settling are those of errors up to 10 deg: {missed} of 16 starts"
    assert (f"regulator: doubtful: {said}" in out) == (missed > 0)
    lines = out.splitlines()
    assert lines[0].startswith("short: three axes by coils, field averaged (repeats after 1 rev of")
    assert [line.split()[0] for line in lines[3:6]] == ["formula", "refined", "regulator"]
    assert any(line.startswith("refined: rate_gain_n_m_s_per_t2 = ") for line in lines)
    assert "note: no law holds an attitude: alignment with the orbital frame is assumed" in lines
    assert max(map(len, lines)) <= 140


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "--inertia: must be given, or a scenario; received nothing"),
        ((*CUBESAT[:-1], -0.1), "--attitude-noise-deg: must be"),
        (
            (*CUBESAT, "--linear-range-deg", 120),
            "--linear-range-deg: must lie within 0..90 deg, ends left out",
        ),
        (
            (*CUBESAT, "--linear-range-deg", 0),
            "--linear-range-deg: must lie within 0..90 deg, ends left out",
        ),
        (WEAK, "design: gains must make the loop stable with a gain margin of 2 within the coils'"),
        ((*CUBESAT, "--measure-s", 20), "--actuate-s: must be given with measure_s"),
        ((*CUBESAT, "--capture-runs", 0), "--capture-runs: must lie within 1.."),
        ((*CUBESAT, "--revolutions", 0), "--revolutions: must be 1 or more; received 0"),
    ],
)
def test_mistakes_are_one_line(call, arguments, message):
    code, out, err = call("design", "three-axis", *arguments)
    assert (code, out) == (2, "")
    assert err.startswith("error: ") and err.count("\n") == 1
    assert message in err


def test_more_mistakes(call, scenario):
    code, _, err = call("design", "three-axis", scenario, "--altitude-km", 500)
    assert code == 2 and "--altitude-km: must not be given with a scenario; received both" in err
    scenario.write_text(scenario.read_text().replace('{ kind = "bdot"', '{ kind = "off" } #'))
    coils = scenario.read_text().replace("[spacecraft.coils]\nlimit_a_m2 = 3.0\n", "")
    scenario.write_text(coils)
    code, _, err = call("design", "three-axis", scenario)
    assert code == 2 and "spacecraft.coils: must be given for magnetic control" in err
