"""English texts whose making is not known, as f-strings are: recognised by their templates.

A catalogue's templates are tried on a text, those of the most letters first; what stands in the
places of its values is told in turn. A text that no template has is told part by part, between
marks such as `; `.
"""

import re
from collections.abc import Callable, Iterable, Mapping
from string import Formatter
from typing import NamedTuple

#: Where a text that is not recognised is parted; brackets are told by what is in them.
_BETWEEN = ("\n", "   ", "; ", ": ", ". ", " (", ")", ", ", " [", "]", " · ", " + ", " - ", " and ",
            "  ")  # fmt: skip
_NUMBER = r"[-+±~≥≤<> ]*(?:\d[\d.,]*(?:e[-+]?\d+)?|nan|inf)%?"
#: Where a text without such marks is parted: numbers and ranges of two that stand alone.
_ALONE = r"[-+±]?\d[\d.,]*(?:e[-+]?\d+)?%?"
_RANGE = rf"(?:from )?{_ALONE} to {_ALONE}"
_NUMBERS = re.compile(rf"((?<!\S)(?:{_RANGE}|{_ALONE})(?!\S))")
#: Cells of a row, each with the space before it; what makes a text such a row.
_CELLS, _COLUMNS = re.compile(r"( *)(\S+(?: \S+)*)"), re.compile(r"\S {2,}\S.* {2,}\S")
#: Three words in a row are a sentence, of which half is not to be told.
_SENTENCE = re.compile(r"[A-Za-z]{2,} [a-z]{2,} [a-z]{2,}")
#: Longer texts are not for reading at a glance: scenarios, code.
_LONGEST = 2000
#: Letters from which a template is taken for what was said whatever its values are.
_SURE = 16


class Template(NamedTuple):
    """A template: what recognises it, its longest piece, the names of its values, its translation.

    `letters`: how many letters it has beside its values.
    """

    pattern: re.Pattern[str]
    piece: str
    letters: int
    names: tuple[str, ...]
    translation: str


def templates(catalogue: Mapping[str, str]) -> list[Template]:
    """The templates of a catalogue with values, those of the most letters first."""
    made = [_template(text, said) for text, said in catalogue.items() if "{" in text and said]
    return sorted(filter(None, made), key=lambda each: -each.letters)


def _template(text: str, translation: str) -> Template | None:
    try:
        parts = [*Formatter().parse(text)]
    except ValueError:
        return None
    names: list[str] = []
    pattern = ""
    for literal, name, form, _ in parts:
        pattern += re.escape(literal)
        if not name:
            continue
        if name in names:
            pattern += rf"\{names.index(name) + 1}"
        else:
            names.append(name)
            pattern += f"({_NUMBER})" if form and form[-1] in "gfed%" else "(.*?)"
    pieces = [literal for literal, *_ in parts]
    letters = sum(map(str.isalpha, "".join(pieces)))
    if not names or letters < 2:
        return None
    found = re.compile(pattern, re.DOTALL)
    return Template(found, max(pieces, key=len), letters, tuple(names), translation)


def recognise(text: str, known: Iterable[Template], tell: Callable[[str], str]) -> str:
    """A text told by the first template that has it; else by its parts; else itself."""
    if len(text) > _LONGEST:
        return text
    for each in known:
        if each.piece in text and (found := each.pattern.fullmatch(text)):
            values = dict(zip(each.names, found.groups(), strict=True))
            if each.letters >= _SURE or all(map(_is_plain, values.values())):
                return _filled(each.translation, {k: tell(v) for k, v in values.items()})
    return _in_parts(text, tell)


def _is_plain(value: str) -> bool:
    """Whether a value is one number, name or word."""
    return len(value.split()) <= 2 and ":" not in value


def _filled(translation: str, values: Mapping[str, str]) -> str:
    parts = Formatter().parse(translation)
    return "".join(literal + (values[name] if name else "") for literal, name, *_ in parts)


def _in_parts(text: str, tell: Callable[[str], str]) -> str:
    """A text told part by part; itself if a part that reads as a sentence stays as it is."""
    if "\n" not in text and _COLUMNS.search(text):
        return _in_columns(text, tell)
    head, found, rest = text.partition(": ")
    if found and tell(head) != head and " " not in head:  # what follows "note: " is one text
        return _joined(text, [head, rest], found, tell)
    for mark in _BETWEEN:
        before, found, after = text.partition(mark)
        if found:
            return _joined(text, [before, after], mark, tell)
    parts = [part for part in _NUMBERS.split(text) if part]
    return _joined(text, parts, "", tell) if len(parts) > 1 else text


def _in_columns(text: str, tell: Callable[[str], str]) -> str:
    """A row of a table in plain text: each cell told, with its end where it was if it fits."""
    line = ""
    for gap, cell in _CELLS.findall(text):
        end = len(line) + len(gap) + len(cell)
        said = tell(cell)
        line += " " * max(1, end - len(line) - len(said)) if gap else ""
        line += said if gap else said.ljust(len(cell))
    return line


def _joined(text: str, parts: list[str], mark: str, tell: Callable[[str], str]) -> str:
    said = [tell(part) for part in parts]
    left = (part for part, words in zip(parts, said, strict=True) if part == words)
    return text if any(map(_SENTENCE.search, left)) else tell(mark).join(said)
