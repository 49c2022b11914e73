"""Compiled code on the disk: damaged, not ours, without a place."""

import os
import random
import subprocess
import sys
from pathlib import Path

import pytest

import torquer
from torquer.compile import code_cache, engine

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="there is no cache without a compiler")
SCRIPT = """
from torquer.geometry.vec3 import cross, dot
from torquer.compile.engine import kernel

@kernel
def volume(a, b, c):
    return dot(a, cross(b, c))

print(volume((1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 3.0)))
print(sum(volume.stats.cache_hits.values()))
"""


def run_script(tmp_path, **environment):
    """(Volume, hits in the cache, standard error) of a process of its own."""
    file = tmp_path / "volume.py"
    file.write_text(SCRIPT)
    there = {**os.environ, "PYTHONPATH": str(Path(torquer.__file__).parents[1]), **environment}
    ended = subprocess.run(
        [sys.executable, str(file)],
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
@pytest.mark.parametrize("how", ["empty", "cut", "byte", "noise"])
def test_damaged_code_is_compiled_anew(sound, how, ending):
    cache = sound / "cache"
    files = [path for path in cache.rglob(f"*.{ending}") if "volume.volume" in path.name]
    assert files
    for path in files:
        damage(path, how, random.Random(f"{how} {ending}"))
    volume, hits, told = run_script(sound, TORQUER_CACHE_DIR=str(cache))
    assert (volume, hits) == ("6.0", "0")
    assert told.count("CacheNote: compiled code in ") == 1
    assert run_script(sound, TORQUER_CACHE_DIR=str(cache)) == ("6.0", "1", "")


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
    volume, hits, told = run_script(tmp_path, **there)
    assert (volume, hits) == ("6.0", "0")
    assert told.count("CacheNote: compiled code is not kept, so that every start compiles") == 1


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
    volume, hits, told = run_script(tmp_path, TORQUER_CACHE_DIR=nowhere, TMPDIR=str(tmp_path))
    assert (volume, hits, told) == ("6.0", "0", "")  # kept among the temporary files
    full = {"TORQUER_CACHE_DIR": "/dev/full", "XDG_CACHE_HOME": ""}
    assert run_script(tmp_path, TMPDIR=str(tmp_path), **full)[:2] == ("6.0", "1")
    volume, _, _ = run_script(tmp_path, TORQUER_CACHE_DIR="", XDG_CACHE_HOME="", HOME="")
    assert volume == "6.0"
