"""The rights of all shipped data are stated, and the citation is that of this version."""

import re
from pathlib import Path

import torquer

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs/data.md").read_text(encoding="utf-8")
#: Files of the package that are no data of others.
_OWN = (".py", ".pyc", ".typed", ".md", ".html", ".css", ".js", ".sh", ".c", ".h", ".ld", ".in")
_OWN += (".cpp", ".hpp", ".fpp")
_OWN_NAMES = (
    *("start.toml", "words.toml", "stored_tables.json", "CMakeLists.txt", "Makefile"),
    *("ru.po", "ru.mo"),
)


def test_every_shipped_file_of_data_has_its_rights():
    files = [path for path in (ROOT / "torquer").rglob("*") if path.is_file()]
    data = [path for path in files if path.suffix not in _OWN and path.name not in _OWN_NAMES]
    assert len(data) > 10
    for path in data:
        places = (path, path.parent)
        names = [f"`{p.relative_to(ROOT).as_posix()}{'/' if p.is_dir() else ''}`" for p in places]
        assert any(name in PAGE for name in names), path


def test_the_citation_is_of_this_version():
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.search(r"^version: (.*)$", text, re.M)[1] == torquer.__version__
    assert "license: MIT" in text and text.startswith("cff-version: 1.2.0\n")
