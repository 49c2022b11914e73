"""The Russian pages have the sections, commands and links of the English ones."""

import re
import tomllib
from pathlib import Path

import pytest

from torquer.cli.app import COMMANDS

ROOT = Path(__file__).parents[1]
TUTORIALS = ("detumble", "spinner", "bench")
PAGES = (
    *("README", "docs/installation", "docs/tutorials/README", "docs/all-pages"),
    *("docs/command-list", "docs/features", "docs/results-and-files", "docs/running-code"),
    "docs/satellites",
    *(f"docs/tutorials/{name}" for name in TUTORIALS),
)
#: Of the on-board computer, the coils and the checkout: these have one name each.
OTHER_WORDS = (
    "\u0431\u0446\u0432\u043c",
    "\u043c\u0430\u0433\u043d\u0438\u0442\u043e\u0440\u043a",
    "\u0447\u0435\u043a\u0430\u0443\u0442",
)
GLOSSARY = (ROOT / "docs/glossary.md").read_text(encoding="utf-8")


def parts(name: str) -> tuple[list[str], list[str], list[str]]:
    """Levels of the headings, blocks of code, targets of the links, of a page."""
    text = (ROOT / name).read_text(encoding="utf-8")
    code = re.findall(r"^```.*?^```", text, re.S | re.M)
    plain = re.sub(r"^```.*?^```", "", text, flags=re.S | re.M)
    return re.findall(r"^(#+) ", plain, re.M), code, re.findall(r"\]\(([^)#]+)\)", plain)


@pytest.mark.parametrize("page", PAGES)
def test_sections_and_examples_match(page):
    english, russian = parts(f"{page}.md"), parts(f"{page}.ru.md")
    assert russian[:2] == english[:2]


def listed(name: str) -> tuple[set[str], set[str]]:
    """Commands of the table and extras to install, of a page."""
    text = (ROOT / name).read_text(encoding="utf-8")
    rows = re.findall(r"^\| (`torquer .*?) \| ", text, re.M)
    commands = {each for row in rows for each in re.findall(r"`(torquer [^`]*)`", row)}
    return commands, set(re.findall(r"pip install '\.\[(\w+)\]'", text))


@pytest.mark.parametrize("page", ["docs/command-list", "docs/installation"])
def test_commands_and_extras_match(page):
    english, russian = listed(f"{page}.md"), listed(f"{page}.ru.md")
    assert russian == english
    assert any(english)


def test_every_extra_is_on_the_page_of_installation():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    text = (ROOT / "docs/installation.md").read_text(encoding="utf-8")
    for extra in project["optional-dependencies"]:
        assert f"[{extra}]'`" in text or f"`{extra}`" in text, extra


def test_every_command_is_in_the_list_of_commands():
    text = (ROOT / "docs/command-list.md").read_text(encoding="utf-8")
    for words in COMMANDS:
        group, *name = words.split()
        assert re.search(rf"^\| .*`torquer {words}\b", text, re.M) or re.search(
            rf"^\| .*(`torquer {group}\b.*\b{name[0] if name else ''}\b)", text, re.M
        ), words


def test_both_start_pages_give_the_same_commands_for_their_tasks():
    english, russian = (
        [
            re.findall(r"`torquer [^`]*`", row)
            for row in re.findall(r"^\| .*", (ROOT / name).read_text(encoding="utf-8"), re.M)
        ]
        for name in ("README.md", "README.ru.md")
    )
    assert russian == english
    named = {each.strip("`").removeprefix("torquer ") for row in english for each in row}
    assert named <= {*COMMANDS} and len(named) > 9


@pytest.mark.parametrize("page", PAGES)
def test_russian_pages_have_dashes_and_one_word_for_a_thing(page):
    text = (ROOT / f"{page}.ru.md").read_text(encoding="utf-8")
    text = re.sub(r"```.*?```|`[^`]*`", "", text, flags=re.S)
    lines = [line for line in text.splitlines() if not line.startswith("|")]
    assert [line for line in lines if re.search(r"\S - \S", line)] == []
    assert [word for word in OTHER_WORDS if word in text.lower()] == []


def in_english(target: str) -> str:
    """The English page of a link in a Russian one."""
    return target.replace(".ru.md", ".md")


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_where_the_english_ones_do(page):
    english, russian = parts(f"{page}.md")[2], parts(f"{page}.ru.md")[2]
    folder = (ROOT / page).parent
    assert [target for target in russian if not (folder / target).exists()] == []
    itself, own = Path(page).name + ".md", {"docs/tutorials/README.md", "../glossary.md"}
    assert {in_english(target) for target in russian} - {*english} <= {itself, *own}


def test_both_indexes_list_every_tutorial_in_one_order():
    english, russian = (
        [target for target in parts(f"docs/tutorials/README{end}")[2] if "README" not in target]
        for end in (".md", ".ru.md")
    )
    assert [in_english(target) for target in russian if "glossary" not in target] == english
    files = {path.name for path in (ROOT / "docs/tutorials").glob("*.md")}
    assert {*english} == {name for name in files if "README" not in name and ".ru." not in name}
    assert (*(name.removesuffix(".md") for name in english[:3]),) == TUTORIALS


@pytest.mark.parametrize("page", PAGES)
def test_russian_pages_are_in_russian(page):
    text = (ROOT / f"{page}.ru.md").read_text(encoding="utf-8")
    text = re.sub(r"```.*?```|`[^`]*`|\]\([^)]*\)", "", text, flags=re.S)
    letters = re.findall(r"[^\W\d_]", text)
    assert sum("\u0430" <= letter.lower() <= "\u0451" for letter in letters) > 0.75 * len(letters)


def test_the_glossary_names_what_there_is():
    """Words of the last column are commands, or stand in the pages made from the code."""
    pages = ("commands", "scenario", "api", "variables", "wheel-design", "equations")
    known = "".join((ROOT / f"docs/{page}.md").read_text(encoding="utf-8") for page in pages)
    rows = [line.split("|")[1:4] for line in GLOSSARY.splitlines() if line.startswith("| ")]
    assert len(rows) > 70
    for russian, english, word in rows:
        assert re.search("[\u0430-\u044f]", russian) and re.search("[A-Za-z]", english)
        for name in re.findall("`([^`]+)`", word):
            assert name in known or name.split(".")[-1] in known, name
