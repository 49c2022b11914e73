"""Deviations from MISRA C:2012: those of the exports are those of the list that is shipped."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from flight.c99.test_export import EXAMPLES, NAMES, written

import torquer
from torquer.flight.c99.computer import find_computer, translate_step
from torquer.flight.c99.export import make_texts

needs_cppcheck = pytest.mark.skipif(not shutil.which("cppcheck"), reason="not installed: cppcheck")


def export(name: str, folder: Path) -> Path:
    computer = find_computer(torquer.load_scenario(EXAMPLES / f"{name}.toml"))
    return written(make_texts(computer, translate_step(computer), 1), folder)


def checked(folder: Path, **environment) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, folder / "test/misra.py"], capture_output=True, text=True,
        env={**os.environ, **environment},
    )  # fmt: skip


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    return export("my_law", tmp_path_factory.mktemp("misra"))


def test_without_the_tool_it_says_so_and_is_not_green(made, tmp_path):
    done = checked(made, PATH=str(tmp_path))
    said = "skipped, nothing was checked: install cppcheck\n"
    assert (done.returncode, done.stdout) == (77, said)


@needs_cppcheck
def test_a_new_deviation_fails(made, tmp_path):
    folder = shutil.copytree(made, tmp_path / "spoiled")
    source = folder / "adcs.c"
    before = "bool adcs_self_test(void)\n{\n"
    text = source.read_text()
    assert before in text
    source.write_text(text.replace(before, f"{before}    goto end;\nend:\n"))
    done = checked(folder)
    assert done.returncode == 1
    found = re.findall(r"^(adcs\S*):\d+: misra-c2012-(\S+)$", done.stdout, flags=re.M)
    assert found == [("adcs.c", "15.1")]


@needs_cppcheck
@pytest.mark.slow
def test_all_examples_deviate_as_listed_and_in_nothing_else(tmp_path):
    found = set()
    for name in NAMES:
        try:
            folder = export(name, tmp_path / name)
        except ValueError:  # not a scenario of a flight
            continue
        done = checked(folder)
        assert done.returncode == 0, f"{name}: {done.stdout}"
        found |= set(re.findall(r"^rule (\S+):", done.stdout, flags=re.M))
    listed = re.findall(r"^\| (\d+\.\d+) \|", (folder / "MISRA.md").read_text(), flags=re.M)
    assert found == set(listed)
