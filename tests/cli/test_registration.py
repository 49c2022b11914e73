"""Commands are registered by their places: each is there, and its help is that of its function."""

import importlib
import inspect
import subprocess
import sys
from pathlib import Path

import pytest
from cyclopts import Token

import torquer.cli
from torquer.cli.app import COMMANDS, GROUPS, app, read_help
from torquer.cli.examples import EXAMPLES
from torquer.cli.options import as_written

FOLDER = Path(torquer.cli.__file__).parent
#: File, target and, of a group, default command, by the words of each command.
PLACES = [pytest.param(words, *place.split(":"), id=words) for words, place in COMMANDS.items()]
_COUNTED = """
import atexit, sys
from torquer.cli import main
loaded = lambda: [name for name in sys.modules if name.startswith("torquer.cli.commands.")]
atexit.register(lambda: print("LOADED", *loaded()))
main(sys.argv[1:])
"""


@pytest.mark.parametrize(("words", "file", "target", "default"), [
    pytest.param(*(*each.values, None)[:4], id=each.id) for each in PLACES
])  # fmt: skip
def test_each_place_has_its_command_with_its_help(words, file, target, default):
    module = importlib.import_module(f"torquer.cli.commands.{file}")
    function = getattr(module, default or target)
    if default is not None:
        assert getattr(module, target).default_command is function
    assert read_help(file, default or target) == inspect.getdoc(function)
    *group, name = words.split()
    registered = (app[group[0]] if group else app)[name]
    assert registered.default_command is function
    assert registered.help == inspect.getdoc(function)


def test_every_group_has_commands_and_examples():
    assert {words.split()[0] for words in COMMANDS if " " in words} == set(GROUPS)
    assert {*COMMANDS, *GROUPS} <= set(EXAMPLES)


def loaded(*words: str) -> set[str]:
    """Files of commands that a command line imports."""
    done = subprocess.run(
        [sys.executable, "-c", _COUNTED, *words], capture_output=True, text=True, timeout=60
    )
    last = done.stdout.splitlines()[-1].split()
    assert last[0] == "LOADED", done.stderr
    return {name.removeprefix("torquer.cli.commands.") for name in last[1:]}


@pytest.mark.parametrize(
    ("words", "files"),
    [
        (["--help"], set()),
        (["field", "--help"], set()),
        (["design"], set()),
        (["version", "--help"], {"about"}),
        (["ground", "send", "--help"], {"ground", "ground_orders"}),
    ],
)
def test_help_imports_only_what_it_describes(words, files):
    assert loaded(*words) == files


def test_the_ground_is_asked_for_help_without_the_simulation():
    code = _COUNTED.replace('"torquer.cli.commands."', '("numba", "scipy", "torquer.simulation")')
    for words in (["--help"], ["send", "a", "b=1"]):
        done = subprocess.run(
            [sys.executable, "-c", code, "ground", *words], capture_output=True, text=True
        )
        assert done.stdout.splitlines()[-1] == "LOADED", done.stderr


def test_a_command_is_one_file():
    files = sorted(path.name for path in FOLDER.rglob("*.py"))
    assert len(files) <= 38
    assert not [name for name in files if name.endswith("_work.py")]


@pytest.mark.parametrize(("kind", "words", "value"), [
    (int, ["3"], 3),
    (int | None, ["3"], 3),
    (list[int], ["3", "4"], [3, 4]),
    (tuple[int, int], ["3", "4"], (3, 4)),
    (float, ["1.5"], 1.5),
])  # fmt: skip
def test_words_of_an_option_are_taken_whole(kind, words, value):
    assert as_written(kind, [Token(value=word) for word in words]) == value


@pytest.mark.parametrize("kind", [int, int | None])
def test_a_whole_number_must_be_written_as_one(kind):
    with pytest.raises(ValueError, match=r"must be a whole number; received 1\.5"):
        as_written(kind, [Token(value="1.5")])
