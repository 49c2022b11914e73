"""Mistakes made in the translator on purpose: the tests of single constructs must notice each."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest
from flight.c99.in_c import needs_compiler

import torquer

PACKAGE, PLACE = Path(torquer.__file__).parent, Path("flight/c99")
HELPERS = "templates/helpers.c"
TESTS = Path(__file__).parents[2]
NOTICING = ("test_by_hand.py", "test_generated.py", "test_refused.py")
#: Tests of single precision that notice a mistake about times.
OF_TIMES = "test_precision.py"


#: Tests of what users' kernels must not do.
OF_GUARDS = "test_guards.py"


class Mistake(NamedTuple):
    """A text of a file of `torquer/flight/c99/`, and the one that takes its place."""

    file: str
    right: str
    wrong: str
    noticing: tuple[str, ...] = NOTICING


MISTAKES = {
    "what is read before a call that changes it": Mistake(
        "statements.py", "before = s.kept(place) if after.effects and place.reads else place",
        "before = place",
    ),
    "a value before the place that it goes to": Mistake(
        "statements.py", "if place_block.effects and value.reads:", "if False:"
    ),
    "two variables exchanged": Mistake(
        "statements.py",
        "return s.kept(value) if (stored & read) or (in_memory and value.reads) else value",
        "return value",
    ),
    "brackets on the right": Mistake("arithmetic.py", "b.within(rank + 1)}", "b.within(rank)}"),
    "constants of an operation exchanged": Mistake(
        "arithmetic.py", "found = known(a.known, b.known)", "found = known(b.known, a.known)"
    ),
    "and for or": Mistake("arithmetic.py", '"&&", Rank.AND', '"||", Rank.AND'),
    "a comparison decided too early": Mistake(
        "arithmetic.py", "or low < limit <= high:", "or low < limit - 1 <= high:"
    ),
    "a power by a constant": Mistake(
        "arithmetic.py", "if a.is_known or b.is_known or a.settled", "if a.settled"
    ),
    "a power by a variable that is constant": Mistake(
        "arithmetic.py", " or a.settled or b.settled:", ":"
    ),
    "cells set to what the first of them is by now": Mistake(
        "places.py", "value = value if value.is_simple else s.kept(value)\n", "pass\n"
    ),
    "a copy onto itself": Mistake(
        "places.py", "return bool(pieces and a.roots & b.roots)", "return bool(False)"
    ),
    "a chain after a call": Mistake(
        "expressions.py", "right if right.is_simple or is_last else s.kept(right)", "right"
    ),
    "a loop without an end that has one": Mistake(
        "statements.py", "return isinstance(node, ast.Break) or any(", "return any("
    ),
    "digits of a number": Mistake("precision.py", "return repr(value)", 'return f"{value:.15e}"'),
    "a loop once more": Mistake(
        "statements.py", 'sign, by = ("<", "+=") if step > 0', 'sign, by = ("<=", "+=") if step > 0'
    ),
    "bounds of a counter": Mistake(
        "statements.py", "high.bounds[1] - 1", "high.bounds[1] - 2"
    ),
    "indices from the end": Mistake(HELPERS, "index + n : index", "-index - 1 : index"),
    "sign of a remainder": Mistake(
        HELPERS, "if ((b < 0.0) != (rest < 0.0)) {", "if (rest < 0.0) {"
    ),
    "zero of a remainder": Mistake(
        HELPERS, "rest = copysign(0.0, b);", "rest = copysign(0.0, a);"
    ),
    "quotient of whole numbers": Mistake(
        HELPERS, "? quotient - 1 : quotient", "? quotient : quotient"
    ),
    "the lesser of NaN and a number": Mistake(
        HELPERS, "static double min_of(double a, double b)\n{\n    return (b < a) ? b : a;",
        "static double min_of(double a, double b)\n{\n    return (a < b) ? a : b;",
    ),
    "the greater of NaN and a number": Mistake(
        HELPERS, "static double max_of(double a, double b)\n{\n    return (b > a) ? b : a;",
        "static double max_of(double a, double b)\n{\n    return (a > b) ? a : b;",
    ),
    "a time rounded": Mistake(
        "arithmetic.py",
        "return times > 0 and (kind is ast.Add or (kind is ast.Sub and times == 1))",
        "return False", (OF_TIMES,),
    ),
    "a variable that holds times later": Mistake(
        "scope.py", "self.program.kinds[self.key, name] = kind", "pass", (OF_TIMES,)
    ),
    "times in memory": Mistake(
        "scope.py", "        if value.type == TIME:\n            self.note_times(roots)\n", "",
        (OF_TIMES,),
    ),
    "an index one too far": Mistake(
        "guards.py", "if -count <= low and high < count:", "if -count <= low and high <= count:",
        (OF_GUARDS,),
    ),
    "an index from the end one too far": Mistake(
        "guards.py", "if -count <= low and high < count:", "if -count - 1 <= low and high < count:",
        (OF_GUARDS,),
    ),
    "a division by zero": Mistake(
        "guards.py", "if not (s.raises and isinstance(op, _DIVIDES)", "if not (False", (OF_GUARDS,)
    ),
    "a callee that has failed": Mistake(
        "calls.py", "    if made.fails:\n        leave_failed(s)\n", "", (OF_GUARDS,)
    ),
    "whole numbers beyond 64 bits": Mistake(
        "guards.py", "return (low, high) if low >= _LEAST and high <= _GREATEST else None",
        "return low, high", (OF_GUARDS,),
    ),
    "a float that is no whole number": Mistake(
        HELPERS, "(a < -least)) ? a : least", "(a < -least)) ? a : 0.0", (OF_GUARDS,)
    ),
    "a constant for floats": Mistake(
        "precision.py", '{np.float32(value)!s}f"', '{np.float32(value):.5e}f"', (OF_TIMES,)
    ),
}  # fmt: skip


def with_mistake(mistake: Mistake | None, folder: Path) -> Path:
    """The package in a folder, its translator copied, the rest by links."""
    package = folder / "torquer"
    for inner in (".", "flight"):
        (package / inner).mkdir()
        for each in (PACKAGE / inner).iterdir():
            if each.name not in ("flight", "c99", "__pycache__"):
                (package / inner / each.name).symlink_to(each)
    shutil.copytree(PACKAGE / PLACE, package / PLACE)
    if mistake is not None:
        file = package / PLACE / mistake.file
        text = file.read_text()
        assert text.count(mistake.right) == 1, f"{mistake.right}: in {mistake.file} once"
        file.write_text(text.replace(mistake.right, mistake.wrong))
    return folder


def tried(mistake: Mistake | None, folder: Path) -> subprocess.CompletedProcess:
    """The tests of constructs with this translator, up to the first that fails."""
    places = [str(with_mistake(mistake, folder)), str(TESTS)]
    command = [sys.executable, "-m", "pytest", "-x", "-p", "no:cacheprovider"]
    noticing = mistake.noticing if mistake else (*NOTICING, OF_TIMES, OF_GUARDS)
    command += ["-k", "not processor and not in_the_loop"]
    command += ["-c", str(TESTS.parent / "pyproject.toml"), "-o", f"pythonpath={' '.join(places)}"]
    return subprocess.run(
        [*command, *(str(Path(__file__).with_name(each)) for each in noticing)],
        capture_output=True, text=True,
        cwd=folder, env={**os.environ, "PYTHONPATH": os.pathsep.join(places)},
    )  # fmt: skip


@needs_compiler
@pytest.mark.slow
def test_the_translator_without_a_mistake_passes(tmp_path):
    done = tried(None, tmp_path)
    assert done.returncode == 0, done.stdout


@needs_compiler
@pytest.mark.slow
@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_of_the_translator_is_noticed(name, tmp_path):
    done = tried(MISTAKES[name], tmp_path)
    assert done.returncode == 1, f"{name}: no test noticed\n{done.stdout}"
    # at setup the kernels are compiled: a C compiler may notice, too
    assert "FAILED " in done.stdout or "ERROR at setup of " in done.stdout


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_are_made_where_the_text_is(name):
    mistake = MISTAKES[name]
    assert (PACKAGE / PLACE / mistake.file).read_text().count(mistake.right) == 1
