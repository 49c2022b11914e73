"""An export in other people's projects: names, C++, two in one image, CMake, kept states."""

import ctypes
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from flight.c99.in_c import COMPILER, FLAGS, needs_compiler
from flight.c99.test_export import EXAMPLES, HOLD, STRICT, replayed
from flight.c99.test_user_laws import scenario_of

import torquer
from torquer.cli.answer import answer
from torquer.computer import gate as gates
from torquer.flight.c99.export import export_c
from torquer.flight.c99.texts import without_comments

PREFIXES = ("bus", "nav")
CPP = shutil.which("g++")
needs_cmake = pytest.mark.skipif(
    None in (CPP, shutil.which("cmake"), shutil.which("pkg-config")),
    reason="no cmake, pkg-config or g++",
)
PLAIN = "#include <stdbool.h>\n#include <stdint.h>\n"
SOURCES = (".c", "_tables.c", "_math.c")
SIDE_BY_SIDE = Path(__file__).with_name("side_by_side.c")
STATES = {
    "nadir": {"laws": ["nadir"], "transitions": [{"to": "tilted", "at_most_s": 8}]},
    "tilted": {"laws": ["tilted"], "transitions": [{"to": "nadir", "at_most_s": 6}]},
}
TWO_LAWS = {
    "sample_s": 1.0, "laws": {"nadir": HOLD, "tilted": HOLD | {"euler_deg": [0, 30, 0]}},
    "modes": {"states": STATES},
}  # fmt: skip


@pytest.fixture(scope="module")
def pair(tmp_path_factory, make) -> dict[str, Path]:
    """Two computers with prefixes of their own: a user's law; a table of modes."""
    folder = tmp_path_factory.mktemp("pair")
    mine = torquer.load_scenario(EXAMPLES / "my_law.toml")
    for prefix, scenario in zip(PREFIXES, (mine, make({"control": TWO_LAWS})), strict=True):
        export_c(scenario, folder / prefix, steps=40, prefix=prefix)
    return {prefix: folder / prefix for prefix in PREFIXES}


@pytest.fixture(scope="module")
def objects(pair, tmp_path_factory) -> dict[str, list[Path]]:
    """Object files of both libraries and of their records."""
    out = tmp_path_factory.mktemp("objects")
    found = {}
    for prefix, folder in pair.items():
        sources = [*(f"{prefix}{end}" for end in SOURCES), "test/recorded.c"]
        found[prefix] = [out / f"{prefix}_{Path(each).stem}.o" for each in sources]
        for source, to in zip(sources, found[prefix], strict=True):
            command = [COMPILER, *FLAGS, *STRICT, "-fPIC", "-c", folder / source, "-o", to]
            subprocess.run(command, check=True)
    return found


@needs_compiler
@pytest.mark.skipif(shutil.which("nm") is None, reason="not installed: nm")
def test_only_names_with_the_prefix_are_seen_by_the_linker(objects):
    for prefix, files in objects.items():
        command = ["nm", "-g", "--defined-only", *files]
        said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        names = re.findall(r"^[0-9a-f]+ \S (\S+)$", said, flags=re.M)
        assert len(names) > 30
        assert [each for each in names if not each.startswith(f"{prefix}_")] == []


@needs_compiler
def test_all_that_the_headers_define_begins_with_the_prefix(pair):
    for prefix, folder in pair.items():
        assert {each.name for each in folder.iterdir() if each.suffix in (".c", ".h", ".in")} == {
            *(f"{prefix}{end}" for end in (*SOURCES, ".h", "_types.h", "_math.h", ".pc.in"))
        }
        for header in (f"{prefix}.h", f"{prefix}_math.h"):
            own, plain = (
                subprocess.run([COMPILER, "-dM", "-E", "-x", "c", "-"], input=text, cwd=folder,
                               capture_output=True, text=True, check=True).stdout.splitlines()
                for text in (f'#include "{header}"\n', PLAIN)
            )  # fmt: skip
            macros = {line.split()[1] for line in set(own) - set(plain)}
            assert all(each.startswith(f"{prefix.upper()}_") for each in macros), macros
            text = without_comments((folder / header).read_text())
            named = re.findall(r"^\} (\w+);|(\w+)\(|^    ([A-Z]\w+) = ", text, flags=re.M)
            names = {each for three in named for each in three if each} - {"UINT64_C", "INT64_C"}
            assert names and all(each.lower().startswith(f"{prefix}_") for each in names), names


@needs_compiler
@pytest.mark.parametrize("standard", ["c99", "c++11", "c++20"])
def test_two_computers_fly_side_by_side_beside_a_maths_library(pair, objects, standard, tmp_path):
    compiler = CPP if "+" in standard else COMPILER
    if compiler is None:
        pytest.skip("no C++ compiler")
    command = [compiler, f"-std={standard}", "-pedantic", "-Wall", "-Wextra", "-Werror"]
    command += ["-x", "c++" if "+" in standard else "c", SIDE_BY_SIDE, "-x", "none"]
    command += [f"-I{folder}" for folder in pair.values()]
    program = tmp_path / "both"
    subprocess.run([*command, *objects["bus"], *objects["nav"], "-o", program, "-lm"], check=True)
    done = subprocess.run([program], capture_output=True, text=True)
    assert done.stdout == "40 steps of both, law works: 1, mode: tilted\n"
    assert done.returncode == 0


class Kept:
    """A library whose states are bytes here."""

    def __init__(self, prefix: str, folder: Path, objects: list[Path], out: Path):
        subprocess.run([COMPILER, "-shared", *objects, "-o", out, "-lm"], check=True)
        self.code, self.prefix = ctypes.CDLL(str(out)), prefix
        text = (folder / f"{prefix}.h").read_text()
        (size,) = re.findall(r"_STATE_BYTES (\d+)", text)
        words = (folder / "test/recorded.c").read_text()
        numbers = [int(each, 16) for each in re.findall(r"UINT64_C\((0x[0-9a-f]{16})\)", words)]
        self.size, self.rows = int(size), np.array(numbers[4:], np.uint64).reshape(numbers[1], -1)
        self.inputs = numbers[2]

    def call(self, name: str, *arguments):
        found = getattr(self.code, f"{self.prefix}_{name}")
        return found(*(each.ctypes.data_as(ctypes.c_void_p) if isinstance(each, np.ndarray)
                       else each for each in arguments))  # fmt: skip

    def begun(self) -> np.ndarray:
        state = np.zeros(self.size, np.uint8)
        self.call("init", state)
        return state

    def step(self, state: np.ndarray, k: int) -> tuple[int, bytes]:
        command = np.ones(6)
        met = self.call("step", state, self.rows[k, 1 : 1 + self.inputs].copy(), command)
        return met, command.tobytes()


@pytest.fixture(scope="module")
def libraries(pair, objects, tmp_path_factory) -> dict[str, Kept]:
    out = tmp_path_factory.mktemp("libraries")
    return {each: Kept(each, pair[each], objects[each], out / f"{each}.so") for each in PREFIXES}


SOUND, OTHER, NOT_SEALED, DAMAGED = range(4)


@needs_compiler
@pytest.mark.parametrize("prefix", PREFIXES)
def test_a_state_that_was_kept_goes_on_with_the_same_bits(libraries, prefix):
    c = libraries[prefix]
    state = c.begun()
    for k in range(20):
        c.step(state, k)
    assert c.call("check_state", state) == NOT_SEALED
    c.call("seal_state", state)
    kept = state.copy()
    expected = [c.step(state, k) for k in range(20, 40)]
    assert c.call("check_state", state) == NOT_SEALED
    assert c.call("check_state", kept) == SOUND
    assert [c.step(kept, k) for k in range(20, 40)] == expected
    c.call("seal_state", kept)
    c.call("set_parameter", kept, -1, ctypes.c_double(0.0))  # whoever may change it breaks the seal
    assert c.call("check_state", kept) == NOT_SEALED


@needs_compiler
@pytest.mark.parametrize("prefix", PREFIXES)
def test_every_bit_of_a_kept_state_that_changes_is_seen(libraries, prefix):
    c = libraries[prefix]
    state = c.begun()
    c.call("seal_state", state)
    random = np.random.default_rng(1)
    for place in range(c.size):
        damaged = state.copy()
        damaged[place] ^= 1 << random.integers(8)
        expected = OTHER if place < 8 else DAMAGED
        assert c.call("check_state", damaged) == expected, place
    for _ in range(2000):  # signs of two numbers
        damaged = state.copy()
        damaged[16 + 7 + 8 * random.choice(c.size // 8 - 2, 2, replace=False)] ^= 0x80
        assert c.call("check_state", damaged) == DAMAGED


@needs_compiler
def test_a_state_of_another_export_is_refused_and_commands_nothing(libraries):
    bus, nav = libraries["bus"], libraries["nav"]
    theirs = np.zeros(max(bus.size, nav.size), np.uint8)
    for state in (np.resize(nav.begun(), theirs.size), theirs):
        before = state.copy()
        assert bus.call("check_state", state) == OTHER
        assert bus.step(state, 0) == (gates.NOT_BEGUN, bytes(48))
        assert (state == before).all()


@needs_compiler
def test_modes_laws_and_guards_are_told(libraries):
    c, state = libraries["nav"], libraries["nav"].begun()
    c.code.nav_mode_name.restype = ctypes.c_char_p
    seen = set()
    for k in range(40):
        c.step(state, k)
        name = c.code.nav_mode_name(c.call("mode", state, 0)).decode()
        works = [bool(c.call("is_active", state, law) & 1) for law in (-1, 0, 1, 2)]
        assert works == [False, name == "nadir", name == "tilted", False]
        seen.add(name)
    assert seen == {"nadir", "tilted"}
    assert c.code.nav_mode_name(-1) == c.code.nav_mode_name(2) == b""
    assert c.call("estimator", state) == -1
    assert not c.call("is_tripped", state, 0) & 1


@needs_compiler
def test_a_computer_with_a_prefix_flies_in_the_simulation(pair):
    scenario = torquer.load_scenario(EXAMPLES / "my_law.toml")
    without = torquer.simulate(scenario, until_s=600.0)
    flown = torquer.simulate(scenario, until_s=600.0, computer=pair["bus"])
    for name, values in without.variables.items():
        assert values.values.tobytes() == flown[name].values.tobytes(), name


BAD = [
    "", "2a", "a-b", "a b", "Nav", "nav_", "_nav", "a__b", "é", "int", "while", "math", "string",
    "atomic", "fe", "test", "m", "replay", "class", "a" * 32, "a.b", "../a",
]  # fmt: skip


@pytest.mark.parametrize("prefix", BAD)
def test_a_prefix_must_be_a_name_that_is_not_taken(prefix, tmp_path, capsys):
    command = ["export", "c", str(EXAMPLES / "my_law.toml"), "--out", str(tmp_path / "c")]
    assert answer([*command, f"--prefix={prefix}"]) == 2
    error = capsys.readouterr().err.strip()
    assert "prefix: must be a name of C that is not taken" in error
    assert not list((tmp_path / "c").glob("*"))


@needs_compiler
def test_a_folder_has_one_prefix(pair, make, tmp_path):
    folder = shutil.copytree(pair["nav"], tmp_path / "again")
    with pytest.raises(ValueError, match=r"prefix: must be that of the export in .*'nav'.*'bus'"):
        export_c(make({"control": TWO_LAWS}), folder, steps=1, prefix="bus")


LAW = """
from typing import NamedTuple
import numba
import torquer

NAV_GAP_S = 0.25


class nav_command(NamedTuple):
    nav_x: float
    ADCS_GAP_S: float


@numba.njit
def nav_step(x, nav_state):
    return nav_command(x * nav_state, NAV_GAP_S)


@numba.njit
def adcs_step(x, NAV_STATE_BYTES):
    return x - NAV_STATE_BYTES


@torquer.law(parameters={"NAV_MEASURE_S": 2.0}, memory={"ADCS_MEASURE_S": 0.0})
def nav_init(inputs, parameters, memory):
    NAV_H = nav_step(inputs.b_body_t[0], parameters.NAV_MEASURE_S)
    memory.ADCS_MEASURE_S = adcs_step(NAV_H.nav_x, NAV_H.ADCS_GAP_S * NAV_GAP_S)
    return (memory.ADCS_MEASURE_S, 0.0, 0.0)
"""


@needs_compiler
def test_names_of_a_users_law_do_not_meet_those_with_the_prefix(tmp_path):
    folder = tmp_path / "c"
    export_c(scenario_of(("nav_init",), tmp_path, LAW), folder, steps=20, prefix="nav")
    sources = [folder / each for each in ("nav.c", "nav_tables.c", "test/replay.c")]
    command = [COMPILER, *FLAGS, *STRICT, f"-I{folder}", *sources, "-o", folder / "replay", "-lm"]
    subprocess.run(command, check=True)
    done = replayed(folder / "replay", folder)
    assert done.stdout == "20 control steps: the same bits in commands and state\n"


OUTSIDE = """
cmake_minimum_required(VERSION 3.10)
project(outside C CXX)
if(INSTALLED)
    find_package(bus REQUIRED)
    find_package(nav REQUIRED)
else()
    add_subdirectory(${BUS} bus)
    add_subdirectory(${NAV} nav)
endif()
add_executable(both side_by_side.cpp ${BUS}/test/recorded.c ${NAV}/test/recorded.c)
target_link_libraries(both bus::bus nav::nav)
"""


@pytest.fixture(scope="module")
def installed(pair, tmp_path_factory) -> Path:
    place = tmp_path_factory.mktemp("installed")
    for prefix, folder in pair.items():
        build = place / f"build_{prefix}"
        run("cmake", "-S", folder, "-B", build, f"-DCMAKE_INSTALL_PREFIX={place / 'usr'}")
        run("cmake", "--build", build)
        run("ctest", "--test-dir", build)
        run("cmake", "--install", build)
    return place / "usr"


def run(*command) -> str:
    done = subprocess.run([*map(str, command)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@needs_cmake
@pytest.mark.parametrize("way", ["add_subdirectory", "find_package"])
def test_an_outside_project_of_cmake_takes_both(pair, installed, way, tmp_path):
    (tmp_path / "CMakeLists.txt").write_text(OUTSIDE)
    shutil.copy(SIDE_BY_SIDE, tmp_path / "side_by_side.cpp")
    where = [f"-D{prefix.upper()}={folder}" for prefix, folder in pair.items()]
    where += [f"-DINSTALLED={int(way == 'find_package')}", f"-DCMAKE_PREFIX_PATH={installed}"]
    run("cmake", "-S", tmp_path, "-B", tmp_path / "build", *where)
    run("cmake", "--build", tmp_path / "build")
    assert run(tmp_path / "build/both").startswith("40 steps of both")


@needs_cmake
def test_an_outside_project_takes_both_by_pkg_config(pair, installed, tmp_path, monkeypatch):
    folders = [str(each.parent) for each in installed.rglob("*.pc")]
    monkeypatch.setenv("PKG_CONFIG_PATH", ":".join(folders))
    flags = run("pkg-config", "--cflags", "--libs", *PREFIXES).split()
    records = [folder / "test/recorded.c" for folder in pair.values()]
    program = tmp_path / "both"
    run(COMPILER, "-std=c99", SIDE_BY_SIDE, *records, *flags, "-o", program)
    assert run(program).startswith("40 steps of both")
    version = run("pkg-config", "--modversion", "bus").strip()
    assert version == ".".join(re.findall(r"\d+", torquer.__version__)[:3])
    assert not list(installed.rglob("*_types.h"))
