"""Scenario files made at random from the examples: accepted, or refused in lines that say why.

Within ten seconds and two gigabytes each, without any other exception.
"""

import random
import re
import signal
import warnings
from pathlib import Path

import pytest
from random_devices import random_scenario

from torquer.analysis.notes.assess import UNEXPECTED
from torquer.analysis.notes.notes import write_notes
from torquer.scenario.load import scenario_from_text
from torquer.simulation.setup.usable import checked_size

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.toml"))
#: Those without Python files, which take seconds to compile.
TEXTS = [text for path in EXAMPLES if 'kind = "user"' not in (text := path.read_text())]
#: And scenarios with several devices of a kind.
TEXTS += [random_scenario(number) for number in range(12)]
VALUES = (
    *("0", "-1", "1", "2", "1e308", "-1e308", "1e-308", "nan", "-inf", "9" * 400, "1e999", "0x7f"),
    *("true", '""', '"x"', '"\\u001b[31m"', '"[/red]"', '"' + "a" * 10_000 + '"', "'''\n'''"),
    *("[]", "[[]]", "[1, 2, 3]", "[1, 2]", "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]", "[1e200, 1, 0]"),
    *("{}", "{ kind = 1 }", '{ kind = "off" }', "{ a = { b = { c = 1 } } }", "[" * 40 + "]" * 40),
    *("2012-03-04T10:31:47Z", "2012-03-04", "10:31:47", "9999-12-31T23:59:59Z", "1e-5", "1000000"),
)
NUMBER = re.compile(r"(?<![\w.\"-])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w.\"])")


def replaced_value(lines, generator):
    """The value of a key replaced by one of the list."""
    places = [k for k, line in enumerate(lines) if "=" in line and not line.startswith("#")]
    k = generator.choice(places)
    lines[k] = f"{lines[k].partition('=')[0]}= {generator.choice(VALUES)}\n"


def replaced_number(lines, generator):
    """A number replaced by another size or sign of it, or by one of the list."""
    places = [(k, found) for k, line in enumerate(lines) for found in NUMBER.finditer(line)]
    k, found = generator.choice(places)
    factor = generator.choice((0.0, -1.0, 1e-9, 1e-3, 1e3, 1e9, 1e30))
    other = generator.choice((repr(float(found[0]) * factor), generator.choice(VALUES)))
    lines[k] = lines[k][: found.start()] + other + lines[k][found.end() :]


def moved_line(lines, generator):
    """A line put elsewhere, doubled, or lost."""
    line = lines.pop(generator.randrange(len(lines)))
    for _ in range(generator.randrange(3)):
        lines.insert(generator.randrange(len(lines) + 1), line)


def foreign_line(lines, generator):
    """A line of another example."""
    other = generator.choice(TEXTS).splitlines(keepends=True)
    lines.insert(generator.randrange(len(lines) + 1), generator.choice(other))


def other_letters(lines, generator):
    """Letters that were changed, added or lost."""
    k = generator.randrange(len(lines))
    at = generator.randrange(len(lines[k]) + 1)
    letter = generator.choice(("", "=", '"', "[", "]", "\x00", "é", "\u202e", "\t", "#", "."))
    lines[k] = lines[k][:at] + letter + lines[k][at + generator.randrange(2) :]


MUTATIONS = (replaced_value, replaced_number, moved_line, foreign_line, other_letters)


def mutated(number):
    """The text of scenario file `number`."""
    generator = random.Random(number)
    lines = generator.choice(TEXTS).splitlines(keepends=True)
    for _ in range(generator.choice((1, 1, 2, 4))):
        generator.choice(MUTATIONS)(lines, generator)
    return "".join(lines)


def check(number):
    """Whether the scenario is valid; what is wrong with it is reported in short lines."""
    try:
        scenario = scenario_from_text(mutated(number))
        checked_size(scenario)
        notes = write_notes(scenario)
    except ValueError as error:
        lines = str(error).splitlines()
        assert lines and max(map(len, lines)) < 2000
        return False
    assert not any(UNEXPECTED in note for note in notes)
    return True


def too_long(number, frame):
    raise TimeoutError


@pytest.fixture
def limited():
    """At most ten seconds a file, when all is compiled; warnings are errors."""
    if not hasattr(signal, "SIGALRM"):
        pytest.skip("no alarm on this system")
    for text in TEXTS:
        write_notes(scenario_from_text(text))
        checked_size(scenario_from_text(text))
    usual = signal.signal(signal.SIGALRM, too_long)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, usual)


def check_all(numbers):
    valid = 0
    for number in numbers:
        signal.alarm(10)
        try:
            valid += check(number)
        except BaseException as error:
            raise AssertionError(f"file {number}: {error!r}"[:2000]) from None
    return valid


def test_files_made_at_random_are_accepted_or_refused_in_words(limited):
    assert 10 < check_all(range(150)) < 140


@pytest.mark.slow
def test_10_000_files_made_at_random(limited):
    import resource

    valid = check_all(range(1000, 11_000))
    assert 1000 < valid < 9000
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss < 2_000_000  # kB
