"""summary.json is written for others: what it holds changes no result, no resume, no comparison."""

import json
import shutil

import pytest
from slow_cases import slow_after

import torquer
from torquer.compile import engine

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


@pytest.fixture
def two(call, scenario_file, tmp_path):
    """`two("run")`: the file of a scenario, two folders with results, the content of a summary."""

    def fly(command):
        path = scenario_file("built-in", 100.0, runs=40 if command == "campaign" else 0)
        folders = tmp_path / "a", tmp_path / "b"
        for folder in folders:
            assert call(command, path, "--out", folder, "--no-report")[0] == 0
        return path, folders, (tmp_path / "a" / "summary.json").read_bytes()

    return fly


def edited(content):
    """What may stand in a summary after others have had it."""
    data = json.loads(content)
    yield from (b"", b"[]", b"null", b"{", b"\xff\xfe\x00", b"NaN", content[: len(content) // 2])
    for value in (None, "text", [], {}, True):
        yield json.dumps({key: value for key in data}).encode()
    for value in ("NaN", "1e999", "-1e308", "9" * 5000):
        yield json.dumps({key: "VALUE" for key in data}).replace('"VALUE"', value).encode()
    yield json.dumps(data | {"versions": {"torquer": "99.0"}}).encode()
    yield json.dumps({key: data[key] for key in list(data)[::2]}).encode()
    yield b"[" * 100_000
    yield content * 100


@pytest.mark.parametrize(
    ("command", "compare"),
    slow_after(0, [("run", ["compare"]), ("campaign", ["campaign", "compare"])], names=2),
)
def test_an_edited_summary_changes_nothing(call, two, command, compare):
    path, (a, b), content = two(command)
    said, result = call(*compare, a, b), torquer.load(a)
    assert said[0] == 0
    for number, other in enumerate(edited(content)):
        (a / "summary.json").write_bytes(other)
        assert call(*compare, a, b) == said, number
        assert torquer.load(a).identical(result)
        if number % 4 == 0:  # what is resumed writes it again
            assert call(command, path, "--out", a, "--no-report", "--resume")[0] == 0
            assert (a / "summary.json").read_bytes() == content, number


def test_a_folder_in_its_place_is_one_line(call, two):
    path, (a, _), _ = two("run")
    (a / "summary.json").unlink()
    (a / "summary.json").mkdir()
    code, _, err = call("run", path, "--out", a, "--no-report", "--resume")
    assert code == 2 and err.count("\n") == 1 and err.startswith("error: --out: must be a folder")
    shutil.rmtree(a / "summary.json")
    assert call("run", path, "--out", a, "--no-report", "--resume")[0] == 0
