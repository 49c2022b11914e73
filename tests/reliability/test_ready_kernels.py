"""Kernels that were compiled before: read and never written, refused when damaged or foreign."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import torquer
from torquer.compile import engine
from torquer.compile.code_cache import SOURCES
from torquer.compile.ready import GENERIC, MANIFEST, VARIABLE, compiled_for, ready_folder

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="nothing is compiled")
EXAMPLE = Path(__file__).parents[2] / "examples" / "chibis_m_detumble.toml"
#: Prints a number, and how often its kernel was found compiled.
SCRIPT = """
from torquer.maths.geometry.vec3 import cross
print(cross((1.0, 0.0, 0.0), (0.0, 2.0, 0.0))[2], sum(cross.stats.cache_hits.values()))
"""
WRITE = (
    SCRIPT
    + """
from pathlib import Path
from sys import argv
from torquer.compile.code_cache import SOURCES
from torquer.compile.ready import write_manifest
write_manifest(Path(argv[1]), SOURCES)
"""
)


def words(script, cache, *arguments, **changes):
    """Words printed by a script, and its standard error."""
    environment = os.environ | {"TORQUER_CACHE_DIR": str(cache), "TORQUER_KERNELS": ""} | changes
    environment["PYTHONPATH"] = str(Path(torquer.__file__).parents[1])
    command = [sys.executable, "-c", script, *map(str, arguments)]
    ended = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)
    assert ended.returncode == 0, ended.stderr
    return (*ended.stdout.split(), ended.stderr)


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    folder = tmp_path_factory.mktemp("compiled") / "ready"
    assert words(WRITE, folder, folder, **GENERIC)[:2] == ("2.0", "0")
    return folder


@pytest.fixture
def ready(compiled, tmp_path):
    """A folder with one compiled kernel."""
    return shutil.copytree(compiled, tmp_path / "ready")


@pytest.fixture
def refusal(ready, monkeypatch):
    """Why this process does without the folder."""
    monkeypatch.setenv(VARIABLE, str(ready))

    def why():
        folder, reason = ready_folder(SOURCES)
        assert folder is None and "\n" not in reason
        return reason

    assert ready_folder(SOURCES) == (ready, "")
    return why


def test_they_are_read_and_nothing_is_compiled_or_written(ready, tmp_path):
    before = {path: path.stat().st_mtime_ns for path in ready.rglob("*")}
    cache = tmp_path / "cache"
    assert words(SCRIPT, cache, TORQUER_KERNELS=str(ready)) == ("2.0", "1", "")
    assert not [path for path in cache.rglob("*") if path.is_file()]
    assert {path: path.stat().st_mtime_ns for path in ready.rglob("*")} == before


def test_they_may_be_moved(ready, tmp_path):
    moved = ready.rename(tmp_path / "elsewhere")
    assert words(SCRIPT, tmp_path / "cache", TORQUER_KERNELS=str(moved)) == ("2.0", "1", "")


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
def test_damaged_ones_are_refused_and_compiled_instead(ready, tmp_path, ending):
    (path,) = [path for path in ready.rglob(f"vec3.cross-*.{ending}")]
    content = path.read_bytes()
    path.write_bytes(content[:100] + bytes([content[100] ^ 1]) + content[101:])
    *printed, said = words(SCRIPT, tmp_path / "cache", TORQUER_KERNELS=str(ready))
    assert printed == ["2.0", "0"]
    assert said.count("CacheNote: compiled code in ") == 1 and str(ready) in said


@pytest.mark.parametrize("key", sorted(compiled_for("")))
def test_those_for_something_else_are_refused_in_one_line(ready, refusal, key):
    stated = json.loads((ready / MANIFEST).read_text())
    (ready / MANIFEST).write_text(json.dumps(stated | {key: "other"}))
    assert refusal().endswith(f"are for {key} other, needed {stated[key]}; compiling instead")


def test_where_they_are_refused_a_process_compiles(ready, tmp_path):
    (ready / MANIFEST).unlink()
    *printed, said = words(SCRIPT, tmp_path / "cache", TORQUER_KERNELS=str(ready))
    assert printed == ["2.0", "0"]
    assert said.count("CacheNote: ") == 1 and "; compiling instead" in said


@pytest.mark.parametrize(
    "text, why",
    [(None, "No such file"), ("{", "cannot be read"), ("[1]", "kernels.json must hold a table")],
)
def test_a_folder_without_a_manifest_is_refused(ready, refusal, text, why):
    (ready / MANIFEST).unlink()
    if text:
        (ready / MANIFEST).write_text(text)
    assert why in refusal()


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="Windows keeps users apart by itself")
@pytest.mark.parametrize("inside", [False, True])
def test_a_folder_in_which_others_can_write_is_refused(ready, refusal, inside):
    place = next(path for path in ready.iterdir() if path.is_dir()) if inside else ready
    place.chmod(0o777)
    assert refusal().endswith("can be written by, others; compiling instead")


def test_no_folder_and_full_folders_are_refused(call, tmp_path):
    (tmp_path / "a").write_text("")
    code, _, err = call("kernels", "build", "--out", tmp_path / "new")
    assert code == 2 and "SCENARIOS: at least one must be given; received none" in err
    code, _, err = call("kernels", "build", EXAMPLE, "--out", tmp_path)
    assert code == 2 and "--out: must be a new or empty folder" in err
    code, _, err = call(
        "kernels", "build", EXAMPLE.with_name("my_law.toml"), "--out", tmp_path / "b"
    )
    assert code == 2 and "no-user-code" in err


@pytest.mark.slow
def test_the_main_example_flies_by_them_with_the_same_bits(tmp_path):
    def torquer_(*arguments, **changes):
        environment = os.environ | {"TORQUER_CACHE_DIR": str(tmp_path / "cache")} | changes
        command = [sys.executable, "-m", "torquer", *map(str, arguments)]
        subprocess.run(command, env=environment, check=True, capture_output=True)

    torquer_("kernels", "build", EXAMPLE, "--out", tmp_path / "ready")
    torquer_("run", EXAMPLE, "--out", tmp_path / "a", TORQUER_KERNELS=str(tmp_path / "ready"))
    assert not [path for path in (tmp_path / "cache").rglob("*") if path.is_file()]
    torquer_("run", EXAMPLE, "--out", tmp_path / "b", TORQUER_KERNELS="")
    assert torquer.load(tmp_path / "a").equals(torquer.load(tmp_path / "b"))
