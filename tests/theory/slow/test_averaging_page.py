"""docs/theory/averaging.md: its table of the field, its command and its example."""

import contextlib
import io
import math
import re
import shlex
from pathlib import Path

import pytest

from torquer.cli import main
from torquer.compile import engine
from torquer.environment.field.averaged import cone_angle
from torquer.theory.averaged.conditions import INCLINED, STILL_FAST

PAGE = (Path(__file__).parents[3] / "docs/theory/averaging.md").read_text(encoding="utf-8")


def row(first: str) -> list[str]:
    """Cells of the only row that begins so, without its name."""
    (line,) = [line for line in PAGE.splitlines() if line.startswith(f"| {first} |")]
    return [cell.strip() for cell in line.strip("|").split("|")][1:]


def block(language: str) -> tuple[str, str]:
    """The page's block in a language, and the output below it."""
    found = re.search(rf"```{language}\n(.*?)```\n\n```\n(.*?)```", PAGE, re.DOTALL)
    assert found
    return found[1], found[2]


def test_angle_and_mean_square_of_the_field():
    heads = re.findall(r"^\| i \[deg\] \|(.*)\|$\n\|[-|]+\n\| Theta", PAGE, re.MULTILINE)
    inclinations = [float(cell) for cell in heads[0].split("|")]
    angles = [cone_angle(math.radians(i)) for i in inclinations]
    assert len(angles) == 6
    for cell, angle in zip(row("Theta [deg]"), angles, strict=True):
        assert float(cell) == pytest.approx(math.degrees(angle), abs=0.006)
    for cell, angle in zip(row("p"), angles, strict=True):
        assert float(cell) == pytest.approx(0.5 * math.sin(angle) ** 2, abs=0.0006)


def test_the_formula_of_the_angle_as_printed():
    for i in (0.2, 0.8, 1.4):
        w = math.sqrt(1.0 + 3.0 * math.sin(i) ** 2)
        expected = (2.0 + w) / (1.0 + w) * math.tan(i)
        assert math.tan(cone_angle(i)) == pytest.approx(expected, rel=1e-12)


def test_the_limits_are_those_of_the_answers():
    text = " ".join(PAGE.split())
    assert f"Below {INCLINED.least:.0f} deg the tilt of the dipole" in text
    assert STILL_FAST.least == 10.0 and "Below some ten orbital rates" in text


@pytest.mark.skipif(not engine.COMPILED, reason="true motions: minutes without JIT")
def test_the_command_prints_what_the_page_shows(capsys):
    command, shown = block("sh")
    with contextlib.suppress(SystemExit):
        main(shlex.split(command)[1:])
    assert capsys.readouterr().out.startswith(shown)


@pytest.mark.skipif(not engine.COMPILED, reason="minutes without JIT")
def test_the_example_prints_what_the_page_shows():
    code, shown = block("python")
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(code, "averaging.md", "exec"), {})
    assert printed.getvalue() == shown
