"""The exported computer in the loop: the bits of runs and campaigns are those without it."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from slow_cases import slow_after
from uplink_cases import AHEAD

import torquer
from torquer.campaign.fly import fly_campaign
from torquer.campaign.load import campaign_from_data
from torquer.cli.answer import answer
from torquer.compile import sources
from torquer.scenario.load import scenario_from_data
from torquer.simulation.outside.library import Library, kernels_mark

EXAMPLES = Path(__file__).parents[3] / "examples"
pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")


def assert_same_bits(one: xr.Dataset, other: xr.Dataset) -> None:
    assert set(one.variables) == set(other.variables)
    for name, values in one.variables.items():
        assert values.values.tobytes() == other[name].values.tobytes(), name


def example(name: str) -> torquer.Scenario:
    return torquer.load_scenario(EXAMPLES / f"{name}.toml")


@pytest.fixture(scope="module")
def exports(tmp_path_factory):
    """Exports of scenarios by name."""
    folder, made = tmp_path_factory.mktemp("exports"), {}

    def export(name: str) -> Path:
        if name not in made:
            made[name] = folder / name
            torquer.export_c(example(name), made[name], steps=1)
        return made[name]

    return export


@pytest.mark.parametrize(
    ("name", "until_s"),
    slow_after(2, [("my_law", 3000.0), ("safe_mode", 600.0), ("chibis_m_day", 60.0)], names=2),
)
def test_a_stretch_has_the_same_bits(exports, name, until_s):
    without = torquer.simulate(example(name), until_s=until_s)
    flown = torquer.simulate(example(name), until_s=until_s, computer=exports(name))
    assert_same_bits(without, flown)
    assert "exported C" in flown.attrs["laws"]
    assert "exported C" not in without.attrs["laws"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["chibis_m_day", "safe_mode", "chibis_m_detumble"])
def test_whole_runs_have_the_same_bits(exports, name):
    without = torquer.simulate(example(name))
    assert_same_bits(without, torquer.simulate(example(name), computer=exports(name)))


def test_the_library_is_what_flies(exports, tmp_path):
    """A constant changed in the C text changes the flight."""
    folder = shutil.copytree(exports("my_law"), tmp_path / "edited")
    first = torquer.simulate(example("my_law"), until_s=600.0, computer=folder)
    text = (folder / "adcs.c").read_text()
    line = "dipole = add(dipole, command.dipole_a_m2);"
    changed = text.replace(line, f"{line} dipole.v[0] = 0.5 * dipole.v[0];")
    assert changed != text
    (folder / "adcs.c").write_text(changed)
    other = torquer.simulate(example("my_law"), until_s=600.0, computer=folder)
    assert not np.array_equal(first["omega_body"].values, other["omega_body"].values)


@pytest.mark.parametrize("begins", [True, False])
def test_a_run_goes_on_with_the_library_and_without(exports, begins):
    scenario, library = example("safe_mode"), exports("safe_mode")
    begun = torquer.simulate(scenario, until_s=300.0, computer=library if begins else None)
    rest = None if begins else library
    whole = torquer.resume(begun, until_s=600.0, computer=rest)
    assert_same_bits(whole, torquer.simulate(scenario, until_s=600.0))


def test_a_library_built_by_the_user_flies(exports):
    scenario, file = example("my_law"), Library(exports("my_law"))._code._name
    flown = torquer.simulate(scenario, until_s=600.0, computer=file)
    assert_same_bits(flown, torquer.simulate(scenario, until_s=600.0))


def test_the_export_of_another_scenario_is_refused(exports):
    with pytest.raises(ValueError, match="computer: must be exported from this scenario; received"):
        torquer.simulate(example("safe_mode"), computer=exports("my_law"))


def test_other_parameters_than_those_of_the_export_are_named(exports):
    scenario = example("chibis_m_detumble")
    scenario = scenario.replace("control.law.gain_a_m2_s_per_t", 7e6)
    said = r"must have law.gain of this scenario, 7e\+06; received"
    with pytest.raises(ValueError, match=said):
        torquer.simulate(scenario, computer=exports("chibis_m_detumble"))


def spoiled(folder: Path, to: Path, file: str, old: str, new: str) -> Path:
    copy = shutil.copytree(folder, to / "spoiled")
    text = (copy / file).read_text()
    assert old in text
    (copy / file).write_text(text.replace(old, new))
    return copy


def test_another_version_is_refused(exports, tmp_path):
    version, kernels, _ = Library(exports("my_law")).fingerprint.split()
    old = spoiled(exports("my_law"), tmp_path, "adcs_tables.c", f'"{version} ', '"0.0.1 ')
    with pytest.raises(ValueError, match=f"exported by torquer {version}; received .* by version"):
        Library(old)
    shutil.rmtree(old)
    edited = spoiled(exports("my_law"), tmp_path, "adcs_tables.c", kernels, "0" * 16)
    with pytest.raises(ValueError, match="by other sources of that version"):
        Library(edited)


@pytest.mark.parametrize("place", ["flight/c99/statements.py", "maths/geometry/vec3.py"])
def test_edit_of_kernels_or_translator_makes_another_export(tmp_path, monkeypatch, place):
    shutil.copytree(sources.PACKAGE, tmp_path / "torquer")
    monkeypatch.setattr(sources, "PACKAGE", tmp_path / "torquer")
    before = kernels_mark()
    assert before == kernels_mark()
    with (tmp_path / "torquer" / place).open("a") as file:
        file.write("# edited\n")
    assert kernels_mark() != before


def test_what_does_not_compile_is_one_line(exports, tmp_path):
    text = "bool adcs_self_test(void)\n{"
    broken = spoiled(exports("my_law"), tmp_path, "adcs.c", text, f"{text} nonsense;")
    with pytest.raises(
        ValueError, match=r"computer: must be compiled by cc; received: .*error"
    ) as e:
        Library(broken)
    assert "\n" not in str(e.value)


def test_fused_products_are_refused(exports, tmp_path):
    text = "sums = (x * x) + y == 0.0 &&"
    fused = spoiled(exports("my_law"), tmp_path, "adcs.c", text, "sums = fma(x, x, y) == 0.0 &&")
    with pytest.raises(ValueError, match="must be compiled with -ffp-contract=off"):
        Library(fused)


def test_a_missing_compiler_is_named(exports, monkeypatch):
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(ValueError, match="the compiler that CC names; received no-such-compiler"):
        Library(exports("my_law"))


def test_a_folder_without_an_export_is_refused(tmp_path, capsys):
    with pytest.raises(ValueError, match=r"in which there is no adcs\.c"):
        Library(tmp_path)
    (tmp_path / "a.so").write_text("text")
    with pytest.raises(ValueError, match="must be a folder of `torquer export c`, or a shared"):
        Library(tmp_path / "a.so")
    command = ["run", str(EXAMPLES / "my_law.toml"), "--computer", str(tmp_path), "--out"]
    assert answer([*command, str(tmp_path / "out")]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "--computer: must be a folder of `torquer export c`" in said
    assert answer([*command, str(tmp_path / "out"), "--no-user-code"]) in (1, 2)


FAILING = """
import torquer

@torquer.law
def odd(inputs, parameters, memory):
    late = 1.0 if inputs.t_s > 100.0 else 0.0
    return (1e-3 / (1.0 - late), 0.0, 0.0)
"""


def test_non_numeric_command_stops_the_run_as_without_the_library(tmp_path):
    (tmp_path / "my_law.py").write_text(FAILING)
    text = (EXAMPLES / "my_law.toml").read_text().replace("parameters = { gain = 3e4 }", "")
    (tmp_path / "odd.toml").write_text(text)
    scenario = torquer.load_scenario(tmp_path / "odd.toml")
    torquer.export_c(scenario, tmp_path / "c", steps=1)
    said = []
    for computer in (None, tmp_path / "c"):
        with pytest.raises(torquer.RunStopped) as stopped:
            torquer.simulate(scenario, computer=computer)
        said.append(str(stopped.value))
    assert said[0] == said[1]
    assert "ZeroDivisionError" in said[0]


def test_a_users_law_edited_since_the_export_is_refused(tmp_path):
    (tmp_path / "my_law.py").write_text(FAILING)
    text = (EXAMPLES / "my_law.toml").read_text().replace("parameters = { gain = 3e4 }", "")
    (tmp_path / "odd.toml").write_text(text)
    torquer.export_c(torquer.load_scenario(tmp_path / "odd.toml"), tmp_path / "c", steps=1)
    (tmp_path / "my_law.py").write_text(FAILING.replace("1e-3", "2e-3"))
    with pytest.raises(ValueError, match="user's code differ"):
        torquer.simulate(torquer.load_scenario(tmp_path / "odd.toml"), computer=tmp_path / "c")


def few(scenario: torquer.Scenario, vary: dict, runs: int = 20):
    outcomes = {"rate": {"signal": "rate_deg_s", "what": {"at_end": True}}}
    return campaign_from_data(
        {"runs": runs, "seed": 3, "vary": vary, "outcomes": outcomes}, scenario, EXAMPLES
    )


GAIN = {"control.law.gain_a_m2_s_per_t": {"uniform": [1e4, 9e4]}}
BDOT = {"law": {"kind": "bdot_rate", "gain_a_m2_s_per_t": 5e4}, "sample_s": 1.0}


@pytest.fixture(scope="module")
def braking(plain_data, tmp_path_factory):
    """The plain scenario under B-dot, and its export."""
    folder = tmp_path_factory.mktemp("export")
    scenario = scenario_from_data(plain_data({"control": BDOT}))
    torquer.export_c(scenario, folder, steps=1)
    return scenario, folder


@pytest.mark.parametrize("where", ["threads", pytest.param("processes", marks=pytest.mark.slow)])
def test_members_in_lanes_have_the_same_bits_whatever_their_gain(braking, where):
    scenario, computer = braking
    campaign = few(scenario, {"initial.attitude": "uniform", **GAIN})
    without = fly_campaign(scenario, campaign, workers=1)
    flown = fly_campaign(scenario, campaign, workers=2, where=where, computer=computer)
    assert_same_bits(without, flown)
    assert len(np.unique(flown["rate"].values)) == 20
    assert "exported C" in flown.attrs["laws"]


@pytest.mark.slow
def test_members_with_modes_have_the_same_bits_one_by_one(exports):
    scenario = example("safe_mode").replace("simulation.duration_s", 600.0)
    campaign = few(scenario, {"initial.attitude": "uniform"}, 4)
    without = fly_campaign(scenario, campaign)
    assert_same_bits(without, fly_campaign(scenario, campaign, computer=exports("safe_mode")))


def test_a_key_that_changes_the_tables_is_named(exports):
    scenario = example("spinner_modes")
    modes = scenario.control.modes.model_dump()
    key = "control.sample_s"
    assert modes
    campaign = few(scenario, {key: {"values": [scenario.control.sample_s * n for n in (1, 2)]}})
    with pytest.raises(ValueError, match=rf"computer: must be given without campaign\.vary\.{key}"):
        fly_campaign(scenario, campaign, computer=exports("spinner_modes"))


def test_numba_is_not_needed(plain_data, braking):
    """Without the compiler of kernels the library is called through ctypes."""
    code = (
        "import json, sys, torquer\n"
        "from torquer.scenario.load import scenario_from_data\n"
        "s = scenario_from_data(json.load(sys.stdin))\n"
        "one, two = (torquer.simulate(s, until_s=30.0, computer=c) for c in (None, sys.argv[1]))\n"
        "same = all(one[n].values.tobytes() == two[n].values.tobytes() for n in one.variables)\n"
        "print(same)"
    )
    data = json.dumps(plain_data({"control": BDOT}))
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(
        [sys.executable, "-c", code, braking[1]], input=data, capture_output=True, text=True,
        env=environment,
    )  # fmt: skip
    assert done.stdout == "True\n", done.stderr


@pytest.mark.slow
def test_a_computer_in_c_is_given_what_the_ground_sends(exports):
    """Orbit and calibration come in with what it knows, and its dipole is corrected after it."""
    results = []
    for computer in (None, exports("chibis_m_day")):
        scenario = example("chibis_m_day")
        flight = torquer.Flight(scenario, keeps_computer=True, computer=computer)
        flight.set_ephemeris(flight.chosen_ephemeris(AHEAD))
        flight.calibrate("magnetometer", bias=(1e-6, 0.0, 0.0))
        flight.calibrate("gyro", (1.0, 0.0, 0.1, 0.0, 1.0, 0.0, 0.0, 0.0, 0.9))
        flight.calibrate_coils((2.0, 1.0, 0.5))
        for _ in range(300):
            flight.read()
            flight.command()
        results.append(flight.result())
    assert_same_bits(*results)
