"""The replay of an export on an emulated processor: `make pil` in its folder."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import torquer

ROOT = Path(__file__).parents[3]
EXAMPLES = ROOT / "examples"
MISSING = [t for t in ("cc", "arm-none-eabi-gcc", "qemu-system-arm") if not shutil.which(t)]


@pytest.fixture(scope="module")
def export(tmp_path_factory) -> Path:
    """The example with a user's law, with 200 control steps."""
    folder = tmp_path_factory.mktemp("pil")
    torquer.export_c(torquer.load_scenario(EXAMPLES / "my_law.toml"), folder, steps=200)
    return folder


def pil(folder: Path, **environment) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, folder / "test/pil.py"], capture_output=True, text=True,
        env={**os.environ, **environment},
    )  # fmt: skip


def test_without_the_tools_it_says_so_and_is_not_green(export, tmp_path):
    done = pil(export, PATH=str(tmp_path))
    said = "skipped, nothing was tried: install gcc, gcc-arm-none-eabi, qemu-system-arm\n"
    assert (done.returncode, done.stdout) == (77, said)
    assert "No target was tried yet." in (export / "README.md").read_text()


@pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)}")
def test_an_emulated_processor_takes_the_same_bits_and_is_measured(export, tmp_path):
    folder = shutil.copytree(export, tmp_path / "tried")
    done = pil(folder)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("200 control steps: the same bits in commands and state") >= 3
    text = (folder / "README.md").read_text()
    assert "No target was tried yet." not in text
    assert "| writable variables of the library | 0 bytes |" in text
    (stack,) = re.findall(r"\| stack of the replayed steps \| (\d+) bytes", text)
    (bound,) = re.findall(r"\| worst-case stack of a step \| (\d+) bytes, .* adcs_step", text)
    (mean, most) = re.findall(r"(\d+) on average, (\d+) at most", text)[0]
    assert 64 < int(stack) <= int(bound) < 8192
    assert 20 < int(mean) <= int(most) < 100_000


@pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)}")
def test_another_bit_on_the_processor_is_noticed(export, tmp_path):
    folder = shutil.copytree(export, tmp_path / "spoiled")
    tables = folder / "adcs_tables.c"
    off = "#ifdef __arm__\n#define GAIN 30000.000000000004\n#else\n#define GAIN 30000.0\n#endif\n"
    text = tables.read_text()
    assert "30000.0" in text
    tables.write_text(off + text.replace("30000.0", "GAIN"))
    done = pil(folder)
    assert done.returncode == 1
    assert "the first difference is at step " in done.stderr


def rows_of_note(name: str) -> list[list[str]]:
    """Rows of an example in the tables of the design note: double precision, then single."""
    text = (ROOT / "design/0016-export-c.md").read_text()
    lines = re.findall(rf"^\| {name} \| (.* / .*) \|$", text, flags=re.M)
    return [line.split(" | ") for line in lines]


def test_the_tutorial_has_the_numbers_of_the_design_note():
    page = ROOT / "docs/tutorials/from-simulation-to-flight.md"
    text = " ".join(page.read_text().split())
    (_, _, stack, _, instructions, _), *_ = rows_of_note("tip_off_campaign")
    most = instructions.split(" / ")[1]
    assert f"{stack} bytes of stack and {most} instructions for this computer" in text
    (_, _, stack, _, instructions, _), *_ = rows_of_note("chibis_m_flight")
    most = round(int(instructions.split(" / ")[1].replace(" ", "")), -3)
    kilobytes = f"{int(stack) / 1000:.1f} kB"
    assert f"{kilobytes} and {most:,} for the flight software".replace(",", " ") in text


def of_gcc_12() -> bool:
    """Whether the compiler is that of the design note."""
    if MISSING:
        return False
    command = ["arm-none-eabi-gcc", "-dumpfullversion"]
    return subprocess.run(command, capture_output=True, text=True).stdout.startswith("12.2.")


@pytest.mark.slow
@pytest.mark.skipif(not of_gcc_12(), reason="the design note's numbers are those of GCC 12.2")
@pytest.mark.parametrize("number", [0, 1], ids=["double", "float"])
def test_the_numbers_of_the_design_note_are_measured(number, tmp_path):
    scenario = torquer.load_scenario(EXAMPLES / "tip_off_campaign.toml")
    torquer.export_c(scenario, tmp_path, steps=2500, real=("double", "float")[number])
    said = pil(tmp_path).stdout
    row = rows_of_note("tip_off_campaign")[number]
    sizes = [int(each) / 1000 for each in re.findall(r"\| (?:code|constants) \| (\d+) bytes", said)]
    assert row[0] == " / ".join(f"{each:.1f}" for each in sizes)
    assert row[2:4] == re.findall(r"stack of .*? \| (\d+) bytes", said)
    (found,) = re.findall(r"(\d+) on average, (\d+) at most", said)
    assert row[4].replace(" ", "") == "/".join(found)
