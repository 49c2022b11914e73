"""The Russian pages have the sections, commands and links of the English ones."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = ("README", "docs/tutorials/README")


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


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_where_the_english_ones_do(page):
    english, russian = parts(f"{page}.md")[2], parts(f"{page}.ru.md")[2]
    folder = (ROOT / page).parent
    assert [target for target in russian if not (folder / target).exists()] == []
    own = {"README.md", "README.ru.md", "docs/tutorials/README.ru.md"}
    assert set(russian) - set(english) <= own


def test_both_indexes_list_every_tutorial_in_one_order():
    english, russian = (
        [target for target in parts(f"docs/tutorials/README{end}")[2] if "README" not in target]
        for end in (".md", ".ru.md")
    )
    assert russian == english
    files = {path.name for path in (ROOT / "docs/tutorials").glob("*.md")}
    assert {*english} == files - {"README.md", "README.ru.md"}


@pytest.mark.parametrize("page", PAGES)
def test_russian_pages_are_in_russian(page):
    text = re.sub(r"```.*?```|`[^`]*`", "", (ROOT / f"{page}.ru.md").read_text(encoding="utf-8"))
    letters = re.findall(r"[^\W\d_]", text)
    assert sum("\u0430" <= letter.lower() <= "\u0451" for letter in letters) > 0.75 * len(letters)
