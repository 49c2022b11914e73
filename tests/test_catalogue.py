"""Catalogues of messages: whole, without what is said no more, and as compiled."""

import gettext
import io
import re

import catalogue
import pytest

from torquer.base.language import TRANSLATED

CATALOGUES = {code: catalogue.read(catalogue.FOLDER / f"{code}.po") for code in TRANSLATED}
EACH = pytest.mark.parametrize("code", TRANSLATED)
#: What programs read: names of commands, options, files, keys and placeholders.
_NAMES = re.compile(r"`[^`]*`|(?<![\w.-])--?[a-z][\w-]*|\b\w+\.(?:toml|nc|json|html|png|pdf|csv)\b")


@pytest.fixture(scope="module")
def said() -> dict[str, str]:
    return catalogue.messages()


@EACH
def test_every_message_is_translated_and_none_is_stale(code, said):
    there = CATALOGUES[code]
    assert [text for text in said if not there.get(text)] == []
    assert [text for text in there if text not in said] == []


@EACH
def test_catalogues_are_as_the_script_writes_them(code, said):
    path, there = catalogue.FOLDER / f"{code}.po", CATALOGUES[code]
    assert path.read_text(encoding="utf-8") == catalogue.as_po(code, said, there)
    assert path.with_suffix(".mo").read_bytes() == catalogue.as_mo(code, there)


@EACH
def test_gettext_reads_what_the_source_says(code):
    compiled = gettext.GNUTranslations(io.BytesIO(catalogue.as_mo(code, CATALOGUES[code])))
    assert {text: compiled.gettext(text) for text in CATALOGUES[code]} == CATALOGUES[code]
    assert compiled.info()["language"] == code


@EACH
def test_translations_keep_names_placeholders_and_edges(code):
    assert len(CATALOGUES[code]) > 300
    for text, told in CATALOGUES[code].items():
        assert catalogue.placeholders(told) == catalogue.placeholders(text), text
        assert {*_NAMES.findall(told)} == {*_NAMES.findall(text)}, text
        edges = [
            (each[: len(each) - len(each.lstrip())], each[-1:].isspace()) for each in (text, told)
        ]
        assert edges[0] == edges[1], text
        assert text[-1:] not in ".:," or told[-1:] == text[-1:], text


def test_russian_is_in_russian_with_dashes_and_one_word_for_a_thing():
    for text, told in CATALOGUES["ru"].items():
        assert " - " not in told and "--  " not in told, told
        if re.search("[A-Za-z]{4}", re.sub(r"\{[^}]*\}", "", re.sub(_NAMES, "", text))):
            assert re.search("[\u0400-\u04ff]", told) or text in _SAME, text


#: Messages of nothing but names: of commands, keys of keyboards, files, kinds of text.
_SAME = (
    *("campaign join", "campaign compare", "theory magneto-gyro", "torquer board"),
    *("{out}: report.html, plots/", "control: measure_s + actuate_s", "ut1 minus utc"),
    *("Ctrl-Z", "Ctrl-Shift-Z", "TOML"),
)


def test_a_text_of_several_lines_is_read_as_written(tmp_path):
    path = tmp_path / "xx.po"
    path.write_text(
        'msgid ""\nmsgstr "Head: \\n"\n\nmsgid ""\n"one "\n"two"\nmsgstr "1 "\n"\\"2\\""\n'
    )
    assert catalogue.read(path) == {"one two": '1 "2"'}


def test_the_script_finds_texts_that_code_translates(tmp_path, monkeypatch):
    (tmp_path / "torquer").mkdir()
    (tmp_path / "torquer/a.py").write_text(
        "from torquer.base.language import message\n"
        'x = translated("one") + translated(two) + said("no") + message("{a} m", a=message("b"))\n'
    )
    (tmp_path / "torquer/a.html").write_text('<p title="{{ told("three") }}">{{ told(four) }}</p>')
    monkeypatch.setattr(catalogue, "ROOT", tmp_path)
    assert [*catalogue._of_code()] == [
        *(("torquer/a.py", text) for text in ("one", "{a} m", "b")),
        ("torquer/a.html", "three"),
    ]


def test_new_texts_wait_at_the_end_and_old_ones_go(tmp_path, monkeypatch):
    monkeypatch.setattr(catalogue, "FOLDER", tmp_path)
    path = tmp_path / "ru.po"
    path.write_text(catalogue.as_po("ru", {"old": "a", "kept": "b"}, {"old": "1", "kept": "2"}))
    assert catalogue.update("ru", {"new": "c", "kept": "b"}) == ["new"]
    assert catalogue.read(path) == {"kept": "2", "new": ""}
    assert path.read_text().rindex('"new"') > path.read_text().rindex('"kept"')
    assert catalogue.update("ru", {"new": "c"}) == ["new"]
    with path.with_suffix(".mo").open("rb") as file:
        assert gettext.GNUTranslations(file).gettext("new") == "new"


def test_placeholders_are_those_of_format():
    assert catalogue.placeholders("a {b} {c:.3g} {{d}} [e]") == {"b", "c"}
    assert catalogue.placeholders("from the { on") == set() == catalogue.placeholders("none")
