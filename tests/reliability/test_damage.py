"""Results that were damaged or changed: never believed, never a crash."""

import hashlib
import io
import os
import random
import re
import subprocess
import sys

import numpy as np
import pytest
from messages import message_of
from reliability_processes import KINDS, SCENARIO
from slow_cases import slow_after

import torquer
from torquer.compile import engine
from torquer.scenario.load import scenario_from_text
from torquer.simulation.results import file as files
from torquer.simulation.results.restore import scenario_in

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


@pytest.fixture(scope="module")
def stopped():
    """An unfinished result."""
    text = SCENARIO.format(law=KINDS["built-in"], duration_s=600.0, record_s=10.0)
    return torquer.simulate(scenario_from_text(text), until_s=200.0)


@pytest.fixture
def stored(stopped, tmp_path):
    """Its file, and what is in it."""
    path = tmp_path / "result.nc"
    torquer.save(stopped, path)
    return path, path.read_bytes()


def corrupted(content: bytes, kind: str, generator: random.Random) -> bytes:
    """The content of a file after something happened to it."""
    at = generator.randrange(len(content))
    if kind == "byte":
        other = (content[at] + generator.randrange(1, 256)) % 256
        return content[:at] + bytes([other]) + content[at + 1 :]
    if kind == "bit":
        return content[:at] + bytes([content[at] ^ 1 << generator.randrange(8)]) + content[at + 1 :]
    if kind == "cut":
        return content[:at]
    if kind == "zeros":
        return content[:at] + bytes(min(4096, len(content) - at)) + content[at + 4096 :]
    return content + generator.randbytes(generator.randrange(1, 4096))


def check_refused(path, content, number):
    """One corruption of the file, which loading and resuming refuse."""
    generator = random.Random(number)
    kind = ("byte", "bit", "cut", "zeros", "more")[number % 5]
    damaged = corrupted(content, kind, generator)
    path.write_bytes(damaged)
    if damaged == content:  # zeros written over zeros
        return
    for read in (torquer.load, torquer.resume):
        text = message_of(read, path)
        assert text.startswith("result: must be as torquer wrote it; received "), (number, text)


RESEALED = {
    "no HDF5": lambda content: b"\x89HDF\r\n\x1a\n" + bytes(500),
    "no variable": lambda content: edited(content, lambda file: file.pop("checkpoint")),
    "no scenario": lambda content: edited(content, lambda file: file.attrs.pop("scenario")),
    "a number for laws": lambda content: edited(content, lambda file: file.attrs.update(laws=5)),
}


def edited(content, change):
    """The content of a file of HDF5 with something changed in it."""
    import h5py

    kept = io.BytesIO(content)
    with h5py.File(kept, "r+") as file:
        change(file)
    return kept.getvalue()


@pytest.mark.parametrize("how", RESEALED)
def test_files_changed_on_purpose_are_refused_in_one_line(stored, how):
    """Whoever edits a file can compute its digest again."""
    path, content = stored
    changed = RESEALED[how](content[: -files._SEAL_BYTES])
    digest = hashlib.sha256(changed).hexdigest().encode()
    path.write_bytes(changed + files._SEAL + digest)
    text = message_of(torquer.resume, path)
    assert text.startswith("result: must ") and "; received " in text and "\n" not in text


def test_damaged_files_are_refused(stored):
    for number in range(50):
        check_refused(*stored, number)


@pytest.mark.slow
def test_500_damaged_files_are_refused(stored):
    for number in range(500):
        check_refused(*stored, number)


def changed(result, name, value):
    """The result with one thing changed."""
    if name in result.attrs:
        return result.assign_attrs({name: value(result.attrs[name])})
    cells = result[name].values.copy()
    return result.assign({name: (result[name].dims, value(cells))})


def with_cell(place, value):
    def put(cells):
        cells[place] = value
        return cells

    return put


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("checkpoint", with_cell(0, -1e6), "checkpoint must be at a step from 0 to .*-1e\\+06"),
        ("checkpoint", with_cell(0, 1e6), "checkpoint must be at a step from 0 to "),
        ("checkpoint", with_cell(0, np.nan), "checkpoint must be at a step from 0 to .*nan"),
        ("checkpoint", with_cell(0, 7.5), "checkpoint must be at a step from 0 to .*7.5"),
        ("checkpoint", with_cell(1, 5.0), "checkpoint must be at a step"),
        *(("checkpoint", with_cell(k, 1e9), "must be as the run left it") for k in range(2, 60, 5)),
        ("scenario", lambda text: text.replace('"seed":0', '"seed":1'), "as the run left it"),
        ("scenario", lambda text: text[:-1], "result: must hold a scenario"),
        ("scenario", lambda text: text.replace("550.0", "-550.0"), "result: must hold a scenario"),
        ("laws", lambda text: text.replace("1000000.0", "1.0"), "with which the run began"),
        ("versions", lambda text: text.replace(torquer.__version__, "0.0.1"), "of 0.0.1"),
        ("versions", lambda text: "{", "received one of an unknown version"),
        ("digest", lambda text: "", "must be as the run left it"),
    ],
)
def test_a_changed_result_is_refused(stopped, name, value, expected, tmp_path):
    other = changed(stopped, name, value)
    torquer.save(other, tmp_path / "result.nc")
    for result in (other, tmp_path / "result.nc"):
        with pytest.raises(ValueError, match=expected) as error:
            torquer.resume(result)
        assert len(str(error.value).splitlines()) <= 3


def test_another_processor_is_reported(stopped, monkeypatch):
    whole = torquer.resume(stopped)
    monkeypatch.setattr("torquer.simulation.results.restore.processor", lambda: "another (0123)")
    message = r"began with processor .* and goes on with processor another \(0123\): the last bits"
    with pytest.warns(UserWarning, match=message):
        assert np.array_equal(torquer.resume(stopped).omega_body, whole.omega_body)


@pytest.mark.skipif(os.name == "nt", reason="limits of another kind")
@pytest.mark.parametrize("room", slow_after(2, [0, 20_000, 4096, 40_000]))
def test_a_full_disk_keeps_what_stood_there(stored, room):
    """The system refuses to let a file grow, as on a full disk."""
    path, content = stored
    script = (
        "import resource, sys, torquer\n"
        "result = torquer.load(sys.argv[1])\n"
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({room}, {room}))\n"
        "try:\n    torquer.save(result, sys.argv[1])\n"
        "except OSError as error:\n    print(type(error).__name__)\n"
    )
    ended = subprocess.run(
        [sys.executable, "-c", script, str(path)], capture_output=True, text=True, timeout=100
    )
    assert (ended.returncode, ended.stdout) == (0, "OSError\n"), ended.stderr
    assert path.read_bytes() == content
    assert list(path.parent.iterdir()) == [path]


def test_an_unfinished_run_is_replaced_only_if_asked(stopped, stored):
    path, content = stored
    scenario = scenario_in(stopped)
    with pytest.raises(ValueError, match=r"^to: must hold no unfinished run; .*overwrite=True"):
        torquer.simulate(scenario, to=path)
    assert path.read_bytes() == content
    torquer.simulate(scenario, to=path, overwrite=True)
    torquer.simulate(scenario, to=path)
    assert torquer.load(path).attrs["how_it_ended"] == "complete"


def test_an_unfinished_or_damaged_result_is_not_overwritten(call, scenario_file, stored):
    path, content = stored
    scenario, out = scenario_file("built-in"), path.parent
    message = r"error: --out: must hold no unfinished run; .*--overwrite replaces it; .*\n"
    code, _, err = call("run", scenario, "--out", out, "--no-report")
    assert code == 2 and re.fullmatch(message, err)
    path.write_bytes(content[:-1])
    message = (
        r"error: --out: must hold no file that cannot be read; .*--overwrite replaces it; .*\n"
    )
    code, _, err = call("run", scenario, "--out", out, "--no-report")
    assert code == 2 and re.fullmatch(message, err)
    assert path.read_bytes() == content[:-1]
    assert call("run", scenario, "--out", out, "--no-report", "--overwrite")[0] == 0
    assert torquer.load(path).attrs["how_it_ended"] == "complete"
