"""The help of every command in Russian: nothing is left in English, no name is changed."""

import os
import re
import subprocess
import sys

import pytest

from torquer.cli.app import COMMANDS, GROUPS
from torquer.cli.examples import EXAMPLES

WORDS = sorted({"", *COMMANDS, *GROUPS, *EXAMPLES})
#: One process that shows all of it, wide enough for lines not to be wrapped.
_ALL = """
import sys
from torquer.cli import main
for words in sys.argv[1].split(","):
    print("\\f" + words)
    try:
        main([*words.split(), "--help"])
    except SystemExit as end:
        assert not end.code
"""


def shown(language: str) -> dict[str, str]:
    """What `--help` of each command prints in a language."""
    given = {"TORQUER_LANG": language, "COLUMNS": "2000", "PYTHONIOENCODING": "utf-8"}
    done = subprocess.run(
        [sys.executable, "-c", _ALL, ",".join(WORDS)],
        env=os.environ | given, capture_output=True, text=True, encoding="utf-8", check=True,
    )  # fmt: skip
    pages = (page.partition("\n") for page in done.stdout.split("\f")[1:])
    return {words: text for words, _, text in pages}


@pytest.fixture(scope="module")
def pages() -> tuple[dict[str, str], dict[str, str]]:
    return shown("en"), shown("ru")


@pytest.mark.parametrize("words", WORDS)
def test_no_line_is_left_in_english(pages, words):
    english, russian = ({*pages[k][words].splitlines()} for k in (0, 1))
    both = {line for line in english & russian if re.search("[a-z]{3}", line)}
    commands = {line for each in EXAMPLES.values() for line in each}
    bare = re.compile(r"[^a-z]*(--[a-z-]+ )?[A-Z. ]*│?")  # an option that needs no words
    left = {line for line in both if line.strip() not in commands and not bare.fullmatch(line)}
    assert left == set()
    assert not re.search(r"\[(default|choices|required)", pages[1][words])
    assert not re.search(
        "Usage|Parameters|Arguments|Commands|Examples|OPTIONS|ARGS", pages[1][words]
    )


@pytest.mark.parametrize("words", WORDS)
def test_both_languages_name_the_same_commands_options_and_values(pages, words):
    names = re.compile(r"(?<![\w-])--[a-z][\w-]*|^│ [ *]*([a-z][\w-]*|[A-Z]+)(?= )", re.M)
    values = re.compile(r"\[(?:choices|default|[^:\]]*): ([^\]]*)\]")
    english, russian = (
        ([each[0] for each in names.finditer(page)], values.findall(page))
        for page in (pages[0][words], pages[1][words])
    )
    assert sorted(russian[0]) == sorted(english[0])
    assert russian[1][-1:] == english[1][-1:]


def test_json_and_errors_are_english_in_any_language():
    def said(language: str, *words: str) -> tuple[str, str]:
        done = subprocess.run(
            [sys.executable, "-m", "torquer", *words],
            env=os.environ | {"TORQUER_LANG": language}, capture_output=True, text=True,
        )  # fmt: skip
        return done.stdout, done.stderr

    for words in (("version", "--json"), ("explain", "sample_s", "--json"), ("run", "no.toml")):
        assert said("ru", *words) == said("en", *words)
