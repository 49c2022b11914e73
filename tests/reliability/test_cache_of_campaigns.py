"""Damaged compiled code of lanes and of users' laws: the same members to the bit."""

import random
import shutil

import pytest
from reliability_processes import done

import torquer
from torquer.compile import engine

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not engine.COMPILED, reason="there is no cache without a compiler"),
]
HOW = ("byte", "bit", "cut", "empty", "noise", "missing", "folder", "swapped", "copied")


@pytest.fixture
def flown(process, scenario_file, tmp_path):
    """`flown()`: the result of a campaign by the compiled code in `tmp_path / "cache"`."""
    path = scenario_file("compiled", 300.0, runs=40)

    def fly():
        out = tmp_path / "out"
        shutil.rmtree(out, ignore_errors=True)
        cache = str(tmp_path / "cache")
        begun = process("campaign", path, "--out", out, "--no-report", TORQUER_CACHE_DIR=cache)
        code, _, err = done(begun, timeout_s=600.0)
        assert code == 0, err
        notes = [line for line in err.splitlines() if line]
        assert all(line.startswith(("note: compil", "note: first use")) for line in notes), err
        return torquer.load(out / "campaign.nc"), err

    return fly


def damage(entries, how, generator):
    """Do something to an entry, or to two of one kind."""
    left = [each for each in entries if each.is_file() and each.stat().st_size > 0]
    path = generator.choice(left)
    other = generator.choice([each for each in left if each.suffix == path.suffix])
    content, foreign = path.read_bytes(), other.read_bytes()
    at = generator.randrange(len(content))
    if how in ("missing", "folder"):
        path.unlink()
    changed = {
        "byte": content[:at] + bytes([content[at] ^ 0x55]) + content[at + 1 :],
        "bit": content[:at] + bytes([content[at] ^ 1 << at % 8]) + content[at + 1 :],
        "cut": content[:at],
        "empty": b"",
        "noise": generator.randbytes(len(content)),
        "swapped": foreign,
        "copied": foreign,
    }
    if how == "folder":
        path.mkdir()
    elif how in changed:
        path.write_bytes(changed[how])
    if how == "swapped":
        other.write_bytes(content)


def test_damaged_code_flies_the_same_members(flown, tmp_path):
    """Of every entry that a campaign with a user's law has left, of its lanes and its law alike."""
    whole, _ = flown()
    cache, sound = tmp_path / "cache", tmp_path / "sound"
    shutil.copytree(cache, sound)
    users = sorted(each for each in cache.rglob("*.nb?") if "user-" in str(each))
    entries, noticed = sorted(cache.rglob("*.nb?")), 0
    assert users
    for number in range(27):
        generator, how = random.Random(number), HOW[number % len(HOW)]
        for some in (users, entries, entries, entries):
            damage(some, how, generator)
        again, err = flown()
        noticed += "note: compil" in err
        assert again.identical(whole), (number, how)
        shutil.rmtree(cache)
        shutil.copytree(sound, cache)
    assert noticed > 9
