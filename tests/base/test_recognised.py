"""Texts whose making is not known: recognised by their templates, told part by part."""

import pytest

from torquer.base.language import Verbatim, told
from torquer.base.recognised import recognise, templates

CATALOGUE = {
    "{name} is below {limit:.3g} {unit}": "{name}: меньше {limit} {unit}",
    "{what} of {name}": "{what} для {name}",
    "{a:g} of {b:g} wheels": "{a} из {b} маховиков",
    "the rate": "скорость",
    "rate": "скорость",
    "power": "мощность",
    "twice {x} and {x}": "дважды {x}",
    "{count:g} runs; then {what} a while; end": "пока: {what}; конец",
}


def tell(text: str) -> str:
    bare = text.strip()
    words = CATALOGUE.get(bare) or recognise(bare, KNOWN, tell)
    return text.replace(bare, words) if bare else text


KNOWN = templates(CATALOGUE)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("the rate is below 0.25 deg/s", "скорость: меньше 0.25 deg/s"),
        ("the rate is below much deg/s", "the rate is below much deg/s"),  # no number
        ("3 of 4 wheels", "3 из 4 маховиков"),
        ("rate of power", "скорость для мощность"),
        ("a long walk of a short man", "a long walk of a short man"),  # of too few letters
        ("twice 2 and 2", "дважды 2"),
        ("twice 2 and 3", "twice 2 and 3"),
        ("spare: rate, power", "spare: скорость, мощность"),
        ("rate 3 power", "скорость 3 мощность"),
        ("rate: 2 runs; then rate a while; end", "скорость: пока: скорость; конец"),
        ("rate; but nobody knows what comes", "rate; but nobody knows what comes"),
        ("rate {x", "rate {x"),
        ("", ""),
    ],
)
def test_a_text_is_told_by_its_template_else_by_its_parts(text, words):
    assert tell(text) == words


def test_rows_of_a_table_keep_the_ends_of_their_cells():
    head, row = "    name     rate    power", "      ab        1        2"
    assert tell(head) == "    name скорость мощность"
    assert len(tell(head)) == len(head) and tell(row) == row


def test_what_others_wrote_stays(monkeypatch):
    monkeypatch.setenv("TORQUER_LANG", "ru")
    assert told("residual dipole") != "residual dipole"
    assert told(Verbatim("residual dipole")) == "residual dipole"
