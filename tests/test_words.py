"""Words of the trade lead to the pages that answer them: in the search, a page, `explain`."""

import json
import re
from pathlib import Path

import pytest
from trade_terms import TERMS

from torquer.cli import main
from torquer.design.stored_keys import find
from torquer.scenario.words import trade_word, trade_words

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def pages():
    """The module that makes the site's own pages."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "docs")
        patch.syspath_prepend(ROOT / "docs/site")
        yield __import__("pages")


def test_forty_terms_are_asked_for():
    assert len(TERMS) == 40


@pytest.mark.parametrize("term", TERMS)
def test_a_term_leads_to_the_page_that_answers_it(term, pages):
    word = trade_word(term)
    assert word is not None and f"docs/{word.page}" == TERMS[term]
    assert f"! single: {term}\n" in pages.index_entries(TERMS[term])


def test_each_word_has_a_page_and_a_key_that_there_are():
    words = [word.lower() for row in trade_words() for word in row.words]
    assert len(set(words)) == len(words)
    for row in trade_words():
        assert (ROOT / f"docs/{row.page}.md").is_file(), row
        assert not re.search("[,;|!]", "".join(row.words)), "these part entries of the index"
        if row.key:
            tables, keys = find(row.key)
            assert tables or keys, row


def test_case_hyphens_and_plurals_do_not_matter():
    (row,) = {trade_word(word) for word in ("Star Tracker", "star-trackers", "star_tracker")}
    assert row is not None and trade_word("star") is None and trade_word("") is None


def explained(*words):
    """The exit code of `torquer explain`."""
    with pytest.raises(SystemExit) as ended:
        main(["explain", *words])
    return ended.value.code


def test_explain_knows_the_words(capsys):
    assert explained("momentum dumping") == 0
    out = capsys.readouterr().out
    assert "called here: unloading of the wheels\n  see docs/tutorials/wheels-in-flight.md" in out
    assert "control.law, kind = 'unloading'" in out
    assert explained("desaturation", "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert found["word"]["page"] == "tutorials/wheels-in-flight" and found["tables"]


def test_a_key_comes_before_a_word_and_what_is_neither_is_refused(capsys):
    assert explained("bench") == 0
    assert "called here" not in capsys.readouterr().out
    assert explained("momentum thing") == 2
    assert capsys.readouterr().err.startswith("error: KEY: must be a key or table")
