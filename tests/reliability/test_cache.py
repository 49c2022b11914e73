"""Compiled code on the disk: damaged, not ours, without a place."""

import os
import random
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from slow_cases import slow_after

import torquer
from torquer.compile import code_cache, engine

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="there is no cache without a compiler")
SCRIPT = """
from torquer.maths.geometry.vec3 import cross, dot
from torquer.compile.engine import kernel

@kernel
def volume(a, b, c):
    return dot(a, cross(b, c))

print(volume((1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 3.0)))
print(sum(volume.stats.cache_hits.values()))
"""


#: Two functions of the same steps, of which the first is called with one kind of number or other.
ALIKE = """
from sys import argv
from torquer.compile.engine import kernel

@kernel
def half(a):
    return 0.5 * a

@kernel
def twice(a):
    return 2.0 * a

print(half(eval(argv[1])), twice(3.5))
"""


def run_script(tmp_path, script=SCRIPT, arguments=(), **environment):
    """Words of the output (volume, hits in the cache), and standard error, of a process."""
    file = tmp_path / "volume.py"
    file.write_text(script)
    there = {**os.environ, "PYTHONPATH": str(Path(torquer.__file__).parents[1]), **environment}
    ended = subprocess.run(
        [sys.executable, str(file), *arguments],
        capture_output=True,
        text=True,
        env={name: value for name, value in there.items() if value},
        timeout=300,
    )
    assert ended.returncode == 0, ended.stderr
    assert "Traceback" not in ended.stderr
    return *ended.stdout.split(), ended.stderr


def damage(path, how, generator):
    """Do something to a file."""
    content = path.read_bytes()
    at = generator.randrange(len(content))
    if how == "empty":
        path.write_bytes(b"")
    elif how == "cut":
        path.write_bytes(content[:at])
    elif how == "byte":
        path.write_bytes(content[:at] + bytes([content[at] ^ 0x55]) + content[at + 1 :])
    else:
        path.write_bytes(generator.randbytes(len(content)))


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """A folder with a script and its cache, of which the script is known to have taken its code."""
    folder = tmp_path_factory.mktemp("sound")
    cache = str(folder / "cache")
    assert run_script(folder, TORQUER_CACHE_DIR=cache) == ("6.0", "0", "")
    assert run_script(folder, TORQUER_CACHE_DIR=cache) == ("6.0", "1", "")
    return folder


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize("how", slow_after(1, ["byte", "empty", "cut", "noise"]))
def test_damaged_code_is_compiled_again(sound, how, ending):
    cache = sound / "cache"
    files = [path for path in cache.rglob(f"*.{ending}") if "volume.volume" in path.name]
    assert files
    for path in files:
        damage(path, how, random.Random(f"{how} {ending}"))
    volume, hits, answer = run_script(sound, TORQUER_CACHE_DIR=str(cache))
    assert (volume, hits) == ("6.0", "0")
    assert answer.count("CacheNote: compiled code in ") == 1
    assert run_script(sound, TORQUER_CACHE_DIR=str(cache)) == ("6.0", "1", "")


def run_alike(folder, number="3.5", cache="cache"):
    return run_script(folder, ALIKE, (number,), TORQUER_CACHE_DIR=str(folder / cache))


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """A folder with the second script, run once with 3.5."""
    folder = tmp_path_factory.mktemp("compiled")
    assert run_alike(folder) == ("1.75", "7.0", "")
    return folder


@pytest.fixture
def alike(compiled):
    """That folder, whose cache is put back as it was."""
    shutil.copytree(compiled / "cache", compiled / "kept")
    yield compiled
    shutil.rmtree(compiled / "cache")
    (compiled / "kept").rename(compiled / "cache")


def entry(folder, function, ending, cache="cache"):
    """The file of an entry."""
    (found,) = (folder / cache).rglob(f"volume.{function}-*.{ending}")
    return found


@pytest.mark.parametrize("ending", slow_after(1, ["nbc", "nbi"]))
def test_code_of_another_function_is_not_believed(alike, ending):
    """Both files are sound. Numba's key has no constants: each index fits the other function."""
    one, other = (entry(alike, name, ending) for name in ("half", "twice"))
    first, second = one.read_bytes(), other.read_bytes()
    one.write_bytes(second)
    other.write_bytes(first)
    half, twice, answer = run_alike(alike)
    assert (half, twice) == ("1.75", "7.0")
    assert answer.count("CacheNote: compiled code in ") == 1
    assert run_alike(alike) == ("1.75", "7.0", "")


def test_code_for_another_kind_of_number_is_not_believed(alike):
    """The index of one process, the data of another: what two that begin at once may leave."""
    assert run_alike(alike, "3", "other") == ("1.5", "7.0", "")
    data = entry(alike, "half", "nbc", "other").read_bytes()
    entry(alike, "half", "nbc").write_bytes(data)
    half, twice, answer = run_alike(alike)
    assert (half, twice) == ("1.75", "7.0")  # that for whole numbers gives 1.5
    assert answer.count("CacheNote: compiled code in ") == 1
    assert run_alike(alike) == ("1.75", "7.0", "")


def test_the_folder_of_compiled_code_may_be_moved(sound, tmp_path):
    shutil.copytree(sound / "cache", tmp_path / "moved")
    assert run_script(sound, TORQUER_CACHE_DIR=str(tmp_path / "moved")) == ("6.0", "1", "")


@pytest.mark.parametrize("ending", slow_after(1, ["nbi", "nbc"]))
def test_a_folder_in_place_of_a_file_is_a_note(alike, ending):
    path = entry(alike, "half", ending)
    path.unlink()
    (path / "inside").mkdir(parents=True)
    for _ in range(2):
        half, twice, answer = run_alike(alike)
        assert (half, twice) == ("1.75", "7.0")
        assert "CacheNote: compiling again: " in answer
        assert (
            "CacheNote: compiled code is not kept, so that it is compiled at every start" in answer
        )


def test_a_folder_in_which_others_can_write_is_not_used(tmp_path):
    cache, temporary = tmp_path / "cache", tmp_path / "temporary"
    cache.mkdir()
    temporary.mkdir()
    cache.chmod(0o777)
    there = {"TORQUER_CACHE_DIR": str(cache), "TMPDIR": str(temporary)}
    assert run_script(tmp_path, **there) == ("6.0", "0", "")
    assert list(cache.iterdir()) == []
    (own,) = temporary.glob("torquer-cache-*")
    assert own.stat().st_mode & 0o777 == 0o700
    assert run_script(tmp_path, **there) == ("6.0", "1", "")
    own.chmod(0o777)  # now that one is not private either
    volume, hits, answer = run_script(tmp_path, **there)
    assert (volume, hits) == ("6.0", "0")
    assert answer.count("CacheNote: compiled code is not kept, so that every start compiles") == 1


def test_nor_is_one_within_a_folder_of_our_own(tmp_path):
    cache, temporary = tmp_path / "cache", tmp_path / "temporary"
    temporary.mkdir()
    there = {"TORQUER_CACHE_DIR": str(cache), "TMPDIR": str(temporary)}
    assert run_script(tmp_path, **there) == ("6.0", "0", "")
    cache.chmod(0o755)
    (within,) = cache.iterdir()
    within.chmod(0o777)
    assert run_script(tmp_path, **there) == ("6.0", "0", "")
    assert len([*temporary.glob("torquer-cache-*")]) == 1


@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() != 0, reason="only root gives away")
def test_a_folder_of_another_user_is_not_used(tmp_path, monkeypatch):
    planted = tmp_path / "torquer-cache-0"
    planted.mkdir(mode=0o700)
    os.chown(planted, 12345, 12345)
    with pytest.raises(PermissionError, match="belongs to, or can be written by, others"):
        code_cache._made_private(planted)
    (tmp_path / "link").symlink_to(planted)
    with pytest.raises(PermissionError):
        code_cache._made_private(tmp_path / "link")


def test_without_a_home_or_a_place_to_write_everything_works(tmp_path):
    (tmp_path / "file").write_text("")
    nowhere = str(tmp_path / "file" / "nowhere")
    volume, hits, answer = run_script(tmp_path, TORQUER_CACHE_DIR=nowhere, TMPDIR=str(tmp_path))
    assert (volume, hits, answer) == ("6.0", "0", "")  # kept among the temporary files
    full = {"TORQUER_CACHE_DIR": "/dev/full", "XDG_CACHE_HOME": ""}
    assert run_script(tmp_path, TMPDIR=str(tmp_path), **full)[:2] == ("6.0", "1")
    volume, _, _ = run_script(tmp_path, TORQUER_CACHE_DIR="", XDG_CACHE_HOME="", HOME="")
    assert volume == "6.0"
