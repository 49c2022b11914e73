"""The ephemeris on board in C: the bits of the kernels, its elements, what is refused."""

import math
import shutil
import subprocess
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest
from flight.c99.in_c import COMPILER, FLAGS, needs_compiler
from flight.c99.test_export import COMPILERS, EXAMPLES, STRICT, replayed
from flight.c99.test_misra import checked, needs_cppcheck
from flight.c99.test_pil import MISSING, pil
from slow_cases import slow_after

import torquer
from torquer.base.time import parse_utc
from torquer.cli.answer import answer
from torquer.computer.on_board_environment import ELEMENTS, ephemeris_along
from torquer.environment.orbit import Circular
from torquer.environment.orbit.sgp4 import checksum
from torquer.flight.c99.ephemeris import find_ephemeris, instants
from torquer.scenario.change import with_values

SOURCES = ("adcs.c", "adcs_tables.c", "adcs_math.c", "adcs_ephemeris.c", "test/replay.c")
SAME = "721 instants of the ephemeris: the same bits"


def example(name: str) -> torquer.Scenario:
    return torquer.load_scenario(EXAMPLES / f"{name}.toml")


def built(folder: Path, *flags: str, compiler: str = COMPILER or "") -> Path:
    """The replay of an export with its ephemeris; fails with the compiler's words."""
    sources = [folder / name for name in SOURCES]
    command = [compiler, *FLAGS, *STRICT, *flags, f"-I{folder}", "-o", folder / "replay", *sources]
    made = subprocess.run([*command, "-lm"], capture_output=True, text=True)
    assert made.returncode == 0, made.stderr
    return folder / "replay"


@pytest.fixture(scope="module")
def exports(tmp_path_factory):
    """Exports by scenario, how the place is found, precision; with 20 control steps."""
    folder, made = tmp_path_factory.mktemp("exports"), {}

    def export(name: str, kind: str, real: str = "double") -> Path:
        key = f"{name}-{kind}-{real}"
        if key not in made:
            made[key] = folder / key
            torquer.export_c(example(name), made[key], steps=20, real=real, ephemeris=kind)
        return made[key]

    return export


CASES = [("my_law", "given"), ("my_law", "kepler"), ("chibis_m_detumble", "sgp4")]


@needs_compiler
@pytest.mark.parametrize("compiler", slow_after(1, COMPILERS))
@pytest.mark.parametrize(("name", "kind"), CASES)
def test_a_day_has_the_bits_of_the_kernels(exports, name, kind, compiler):
    folder = exports(name, kind)
    done = replayed(built(folder, "-O2", compiler=compiler), folder)
    assert done.stdout.splitlines()[-1] == SAME
    assert done.returncode == 0


@needs_compiler
def test_a_replay_notices_another_bit(exports, tmp_path):
    folder = shutil.copytree(exports("my_law", "kepler"), tmp_path / "spoiled")
    source = folder / "adcs_ephemeris.c"
    text = source.read_text()
    assert "6371200.0" in text
    source.write_text(text.replace("6371200.0", "6371200.000000001"))
    done = replayed(built(folder), folder)
    assert done.returncode == 1
    assert "the first difference is at instant 0 of 721 of the ephemeris" in done.stdout


def answers_of(program: Path, folder: Path) -> np.ndarray:
    """What a build answers at all instants, in the place of what is recorded."""
    subprocess.run([program, folder / "test/recorded.bin", folder / "answers.bin"], check=True)
    data = (folder / "answers.bin").read_bytes()
    return np.frombuffer(data[-721 * 23 * 8 :], "<f8").reshape(721, 23)


@needs_compiler
@pytest.mark.parametrize(("real", "flag"), [("double", "-DADCS_PORTABLE"), ("float", "-O1")])
def test_portable_functions_change_last_bits_only(exports, real, flag):
    """In single precision the ephemeris keeps its doubles, with portable functions of angles."""
    folder = exports("chibis_m_detumble", "sgp4", real)
    found = answers_of(built(folder, flag), folder)
    expected = instants(find_ephemeris(example("chibis_m_detumble"), "sgp4"))
    scale = np.abs(expected).max(axis=0)
    assert (np.abs(found - expected) <= 1e-12 * scale).all()


@pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)}")
@pytest.mark.parametrize("real", ["double", pytest.param("float", marks=pytest.mark.slow)])
def test_an_emulated_processor_has_the_same_bits(exports, tmp_path, real):
    folder = shutil.copytree(exports("chibis_m_detumble", "sgp4", real), tmp_path / "tried")
    done = pil(folder)
    assert done.returncode == 0, done.stdout + done.stderr
    (said,) = (each for each in done.stdout.splitlines() if "with this machine: " in each)
    assert said.endswith(f"; {SAME}")
    text = (folder / "README.md").read_text()
    assert "| worst-case stack of an ephemeris |" in text
    assert "| instructions of an ephemeris |" in text


@needs_cppcheck
@pytest.mark.slow
@pytest.mark.parametrize(("name", "kind"), CASES)
def test_it_deviates_from_misra_as_listed(exports, name, kind):
    done = checked(exports(name, kind))
    assert done.returncode == 0, done.stdout


C_CALL = """\
#include "adcs_ephemeris.h"
#include <stdio.h>
int main(void)
{
    const double motions[3] = {15.22465494, 2.0, 15.5};
    adcs_elements elements;
    adcs_inputs inputs = {0};
    adcs_first_elements(&elements);
    inputs.t_s = 600.0;
    for (int k = 0; k < 3; k++) {
        elements.mean_motion_rev_day = motions[k];
        const bool is_known = adcs_ephemeris(&elements, &inputs);
        printf("%d %.17g %.17g\\n", is_known, inputs.r_inertial_m[0], inputs.b_body_t[0]);
    }
    return 0;
}
"""


@needs_compiler
def test_elements_can_be_sent_up_and_wrong_ones_are_refused(exports, tmp_path):
    folder = exports("chibis_m_detumble", "sgp4")
    (tmp_path / "call.c").write_text(C_CALL)
    sources = [tmp_path / "call.c", folder / "adcs_ephemeris.c"]
    command = [COMPILER, *FLAGS, f"-I{folder}", "-o", tmp_path / "call", *sources, "-lm"]
    subprocess.run(command, check=True)
    printed = subprocess.run([tmp_path / "call"], capture_output=True, text=True).stdout
    first, deep, sent = (line.split() for line in printed.splitlines())
    own = find_ephemeris(example("chibis_m_detumble"), "sgp4")
    other, nowhere = own.elements.copy(), np.zeros((1, 3))
    other["mean_motion_rev_day"] = 15.5
    for elements, (is_known, x, _) in ((own.elements, first), (other, sent)):
        found = ephemeris_along("sgp4", own.models, elements, [600.0], nowhere, nowhere)
        assert is_known == "1" and float(x) == found[0, 0]
    assert deep[0] == "0" and math.isnan(float(deep[1]))
    assert {first[2], deep[2], sent[2]} == {"0"}  # other inputs are left alone


def test_an_export_without_an_ephemeris_has_none_of_it(tmp_path):
    torquer.export_c(example("my_law"), tmp_path, steps=1)
    assert not list(tmp_path.glob("adcs_ephemeris.*"))
    assert "ephemeris.h" not in (tmp_path / "test/replay.c").read_text()
    assert "which are handed in" in (tmp_path / "README.md").read_text()


def test_export_removes_the_ephemeris_of_an_earlier_one(tmp_path):
    torquer.export_c(example("my_law"), tmp_path, steps=1, ephemeris="given")
    assert len(list(tmp_path.glob("adcs_ephemeris.*"))) == 2
    torquer.export_c(example("my_law"), tmp_path, steps=1)
    assert not list(tmp_path.glob("adcs_ephemeris.*"))


def test_the_readme_names_all_elements(exports):
    text = (exports("chibis_m_detumble", "sgp4") / "README.md").read_text()
    assert all(f"| `{name}` | " in text for name in ELEMENTS["sgp4"].names)
    assert "| `drag_term` | 0.00032146 |" in text
    assert "orbit, whose elements are sent up" in text


def test_the_readme_says_where_an_orbit_does_not_drift(exports):
    said = "so `j2` is 0 at the start and nothing drifts"
    assert said in (exports("my_law", "kepler") / "README.md").read_text()
    assert said not in (exports("chibis_m_detumble", "kepler") / "README.md").read_text()


def test_an_orbit_of_two_bodies_keeps_its_elements():
    own = find_ephemeris(example("disturbances"), "kepler")
    spec, row = example("disturbances").orbit, own.elements[0]
    assert row["semi_major_axis_m"] == spec.shape[0] and row["eccentricity"] == spec.shape[1]
    assert math.radians(row["mean_anomaly_deg"]) == pytest.approx(spec.mean_anomaly_rad)
    assert row["j2"] == 0.0
    clock = [float(row[name]) for name in ("start_day", "start_fraction")]
    noon = parse_utc("2000-01-01T12:00:00Z")
    since = (sum(clock) - 2451545.0) * timedelta(days=1)
    assert abs(noon + since - parse_utc(example("disturbances").start)) < timedelta(milliseconds=1)


def test_a_drifting_orbit_is_fitted_to_the_day_before():
    """Two-line elements by SGP4 as a Kepler orbit that drifts: what J2 does within a revolution."""
    own = find_ephemeris(example("chibis_m_detumble"), "kepler")
    rows = instants(own)
    r, _ = own.own.state(rows[:, 0])
    away = np.linalg.norm(rows[:, 7:10] - r, axis=1)
    assert own.elements["j2"][0] > 1e-3
    assert np.sqrt(np.mean(away**2)) < 20e3


def test_exported_field_and_orbit_are_the_scenarios_on_board_models():
    scenario = example("magneto_gyro")
    assert find_ephemeris(scenario, "kepler").models.field.top == 9  # a degree of 8
    orbit = Circular(altitude_km=600.0, inclination_deg=50.0)
    stated = with_values(scenario, {"control.ephemeris": {"orbit": orbit.model_dump()}})
    assert find_ephemeris(stated, "kepler").elements["semi_major_axis_m"][0] == orbit.radius_m


LEAP = (
    "1 25544U 98067A   16366.50000000  .00001000  00000-0  20000-4 0  9999",
    "2 25544  51.6400 100.0000 0005000  50.0000 310.0000 15.54000000    05",
)


@pytest.mark.parametrize("start", ["2016-12-31T23:00:00Z", "2017-01-01T01:00:00Z"])
def test_a_leap_second_between_epoch_and_start_counts_on_board_too(start):
    """The same place as the orbit's, before the end of 2016 and after it; it was 7.7 km off."""
    lines = [line[:68] + str(checksum(line)) for line in LEAP]
    scenario = with_values(
        example("my_law"), {"start": start, "orbit": {"kind": "sgp4", "tle": lines}}
    )
    own, nowhere = find_ephemeris(scenario, "sgp4"), np.zeros((1, 3))
    found = ephemeris_along("sgp4", own.models, own.elements, [600.0], nowhere, nowhere)
    place, _ = scenario.orbit_environment().state(np.array([600.0]))
    assert found[0, :3] == pytest.approx(place[0], abs=10.0)


REFUSED = [
    ("my_law", {}, "tle", "ephemeris: must be one of given, kepler, sgp4; received 'tle'"),
    ("bench", {}, "kepler", "ephemeris: must be left out with an orbit of kind 'bench'"),
    ("my_law", {"environment.field": {"kind": "averaged"}}, "given",
     "ephemeris: must be left out with a field of kind 'averaged'; received 'given'"),
    ("my_law", {"environment.sun_direction": [1.0, 0.0, 0.0]}, "given",
     "ephemeris: must be left out with environment.sun_direction; received 'given'"),
    ("my_law", {}, "sgp4", "ephemeris: must be 'given' or 'kepler' unless orbit, or "
     "control.ephemeris.orbit, is of kind sgp4 or numerical; received 'sgp4' with kind circular"),
]  # fmt: skip
DEEP = (
    "1 11801U          80230.29629788  .01431103  00000-0  14311-1 0    13",
    "2 11801  46.7916 230.4354 7318036  47.4722  10.4117  2.28537848    13",
)


@pytest.mark.parametrize(("name", "changes", "kind", "said"), REFUSED)
def test_what_cannot_be_on_board_is_refused_in_one_line(name, changes, kind, said):
    with pytest.raises(ValueError) as refused:
        find_ephemeris(with_values(example(name), changes), kind)
    assert str(refused.value).startswith(said) and "\n" not in str(refused.value)


def test_deep_space_is_refused_in_one_line():
    scenario = with_values(example("my_law"), {"orbit": {"kind": "sgp4", "tle": list(DEEP)}})
    with pytest.raises(ValueError, match=r"for periods from 225 min on, which SGP4 on board does"):
        find_ephemeris(scenario, "sgp4")


def test_the_command_refuses_with_exit_code_2(tmp_path, capsys):
    out = tmp_path / "out"
    path = str(EXAMPLES / "my_law.toml")
    assert answer(["export", "c", path, "--out", str(out), "--ephemeris", "sgp4"]) == 2
    assert "ephemeris: must be 'given' or 'kepler' unless" in capsys.readouterr().err
    assert not list(out.glob("adcs*"))
