"""The documentation site: every page is in it, every link leads somewhere, formulas are drawn."""

import functools
import http.server
import importlib.util
import re
import subprocess
import sys
import threading
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from trade_terms import TERMS
from watched_page import CHROMIUM

from torquer.cli.app import app

ROOT = Path(__file__).parents[1]
#: Far longer than anything here takes: only a failure waits so long [ms].
PATIENCE_MS = 60_000


@pytest.fixture(scope="module")
def pages():
    """The module that makes the site's own pages."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "docs")
        patch.syspath_prepend(ROOT / "docs/site")
        yield __import__("pages")


def commands(of, words=()):
    """All commands, each as its words."""
    for name in of:
        if not name.startswith("-"):
            yield (*words, name)
            yield from commands(of[name], (*words, name))


def test_the_contents_name_every_page(pages):
    files = {
        path.relative_to(ROOT).with_suffix("").as_posix()
        for folder in (ROOT, ROOT / "docs", *(ROOT / "docs").glob("[!ms]*/"), ROOT / "design")
        for path in folder.glob("*.md")
    }
    patterns = [name for names in pages.CONTENTS.values() for name in names]
    patterns += pages.BELOW.values()
    listed = {name for name in files for each in patterns if Path(name).full_match(each)} if (
        hasattr(Path, "full_match")
    ) else {name for name in files for each in patterns if Path(name).match(each)}  # fmt: skip
    assert files - listed == {"README"}


def test_every_public_name_has_its_signature_and_docstring(pages):
    page = pages.names_page("torquer")
    for name in pages.names_of("torquer"):
        assert re.search(rf"^`+{{py:\w+}} {name}\b", page, re.M), name
    assert "{py:function} simulate(" in page
    assert "- `law`" not in page and "`spacecraft: Spacecraft`" in page


def test_code_in_a_docstring_stays_in_one_piece(pages):
    assert (
        pages.markdown("Do:\n    a = 1\n    b = 2\nDone.") == "Do:\n\n    a = 1\n    b = 2\nDone."
    )
    assert pages.markdown("Do.\n\n>>> a\n1\n\nDone.") == "Do.\n\n    >>> a\n    1\n\nDone."


def test_the_table_of_names_leads_to_their_docstrings(pages):
    text = pages.linked("## torquer.theory\n| `compare` | what | `home` |")
    assert text.endswith("| {py:obj}`compare <torquer.theory.compare>` | what | `home` |")


def test_the_pages_of_commands_and_questions_name_every_command():
    text = (ROOT / "docs/commands.md").read_text(encoding="utf-8")
    questions = (ROOT / "docs/which-tool.md").read_text(encoding="utf-8")
    administration = {"completion", "schema", "version", "kernels"}
    for words in commands(app):
        assert re.search(rf"^##+ torquer {' '.join(words)}$", text, re.M), words
        if len(words) == 1 and words[0] not in administration | {"gallery"}:
            assert f"`torquer {words[0]}" in questions, words


def test_formulas_are_closed_and_use_nothing_that_is_not_mathematics():
    for path in (ROOT / "docs").rglob("*.md"):
        text = path.read_text(encoding="utf-8")
        for formula in re.findall(r"^```math\n(.*?)^```", text, re.S | re.M):
            assert formula.count("{") == formula.count("}"), path
            assert formula.count(r"\left") == formula.count(r"\right"), path
            assert formula.isascii(), path


# ------------------------------------------------------------------ the whole site

needs_sphinx = pytest.mark.skipif(
    not all(map(importlib.util.find_spec, ("sphinx", "furo", "myst_parser"))),
    reason="needs the extra docs",
)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder of the site, made without a warning."""
    folder = tmp_path_factory.mktemp("site")
    build = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-c", "docs/site"]
    ended = subprocess.run([*build, ".", str(folder)], cwd=ROOT, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    return folder


@pytest.mark.slow
@needs_sphinx
def test_every_link_leads_to_an_existing_file_and_place(site):
    texts = {path: path.read_text(encoding="utf-8") for path in site.rglob("*.html")}
    places = {path: set(re.findall(r'\bid="([^"]+)"', text)) for path, text in texts.items()}
    assert len(texts) > 90
    for path, text in texts.items():
        for link in re.findall(r'\b(?:href|src)="([^"]+)"', text):
            parts = urlsplit(link)
            if parts.scheme in ("http", "https", "mailto", "data"):
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            assert target.exists(), (path, link)
            if parts.fragment and target in places:
                assert unquote(parts.fragment) in places[target], (path, link)


@pytest.fixture(scope="module")
def browser(site):
    """A page in Chromium, the address of the site, and requests to others."""
    sync_api = pytest.importorskip("playwright.sync_api")
    if CHROMIUM is None:
        pytest.skip("no Chromium")

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_):
            pass

    handler = functools.partial(Quiet, directory=str(site))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        address = f"http://127.0.0.1:{server.server_port}/"
        with sync_api.sync_playwright() as playwright:
            opened = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
            page, strangers = opened.new_page(), []
            page.set_default_timeout(PATIENCE_MS)
            page.on(
                "request",
                lambda request: (
                    strangers.append(request.url)
                    if not request.url.startswith((address, "data:", "blob:"))
                    else None
                ),
            )
            yield page, address, strangers
            opened.close()
        server.shutdown()


@pytest.mark.slow
@needs_sphinx
def test_formulas_are_drawn(site, browser):
    page, address, strangers = browser
    drawn = 0
    for path in sorted(site.rglob("*.html")):
        if number := path.read_text(encoding="utf-8").count('class="math notranslate'):
            page.goto(address + path.relative_to(site).as_posix())
            page.wait_for_function(
                f"document.querySelectorAll('.math mjx-container > svg').length == {number}"
            )
            assert not page.query_selector_all("[data-mml-node=merror]"), path
            drawn += number
    assert drawn >= 15
    assert strangers == []


def found(page, address, words):
    """Where the results of the search lead, the best first."""
    page.goto(f"{address}search.html?q={words}")
    page.wait_for_function("document.querySelector('.search-summary')?.textContent.match(/\\d/)")
    return page.eval_on_selector_all(
        "#search-results li a", "links => links.map(link => link.getAttribute('href'))"
    )


@pytest.mark.slow
@needs_sphinx
def test_the_search_finds_the_terms_of_the_trade(browser):
    page, address, strangers = browser
    results = {term: found(page, address, term)[:5] for term in TERMS}
    missed = {
        term: links
        for term, links in results.items()
        if not any(link.startswith(f"{TERMS[term]}.html") for link in links)
    }
    assert (missed, strangers) == ({}, [])


@pytest.mark.slow
@needs_sphinx
def test_the_search_finds_every_command_and_russian_words(browser):
    page, address, strangers = browser
    for words in commands(app):
        links = found(page, address, f"torquer {' '.join(words)}")
        assert any("commands.html" in link for link in links), words
    for word, pages in {
        "кувыркаться": "detumble.ru",
        "нутация": "glossary",
        "закрутка": "glossary",
        "маховик": "glossary",
        "подвесе": "bench.ru",
        "скомпилированные ядра": "installation.ru",
    }.items():
        assert any(pages in link for link in found(page, address, word)), word
    assert strangers == []
