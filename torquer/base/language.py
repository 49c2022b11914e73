"""The language of what people read: English, the source, or one that a catalogue translates to.

Only texts for people are translated, where they are shown (`told`); until then a text is English.
One that was made by `message` remembers how; any other, such as an f-string or a text read from a
file, is recognised by the templates of the catalogue. What programs read is English in any
language: JSON, result files, CSV, keys, logs, errors. Catalogues are `messages/*.po`;
`docs/catalogue.py` finds what is to be translated and compiles them.
"""

import os
import re
from collections.abc import Iterable, Mapping
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from torquer.base.recognised import Template, recognise, templates

if TYPE_CHECKING:
    from gettext import GNUTranslations

ENGLISH = "en"
#: Languages that have a catalogue.
TRANSLATED = ("ru",)
_ON_WINDOWS = {"russian": "ru"}
#: What states the language, the first one that is set.
_STATED_BY = ("TORQUER_LANG", "LC_ALL", "LC_MESSAGES", "LANG")
_FOLDER = Path(__file__).parent / "messages"
#: What has words, or a number with a unit of single letters: '4.8 h', '[J]'.
_TO_BE_TOLD = re.compile(r"[A-Za-z]{2}|\d [A-Za-z]|[A-Za-z]\]")


def language(environment: Mapping[str, str] = os.environ) -> str:
    """The language stated by `TORQUER_LANG`, else by the locale; English where it has none."""
    stated = next(filter(None, map(environment.get, _STATED_BY)), "")
    if not stated and os.name == "nt":  # no variable states it there
        import locale

        stated = locale.getlocale()[0] or ""
    code = re.split(r"[_.@-]", stated)[0].lower()
    code = _ON_WINDOWS.get(code, code)
    return code if code in TRANSLATED else ENGLISH


class Message(str):
    """English text that remembers how it was made, so that it can be told in other languages.

    Programs that take it, and files that store it, have the English text.
    """

    template: str
    values: Mapping[str, object]


class Verbatim(str):
    """A text of others, such as a citation or a description: it stays as it is."""


def message(template: str, **values: object) -> Message:
    """A text for people, in English, with `values` put in for the `{names}` of its template."""
    made = Message(template.format_map(values) if values else template)
    made.template, made.values = template, values
    return made


def joined(between: str, texts: Iterable[str]) -> Message:
    """Texts as one, each told for itself."""
    named = {f"text_{number}": text for number, text in enumerate(texts)}
    return message(between.join(f"{{{name}}}" for name in named), **named)


def told(text: str) -> str:
    """A text in the language of the moment, with all that was put into it; itself in English or
    where it has no translation."""
    code = language()
    if code == ENGLISH or not text:
        return text
    if isinstance(text, Verbatim):
        return text
    if not isinstance(text, Message):
        return _known(code, str(text))
    words = catalogue(code).gettext(text.template)
    given = text.values
    inner = {name: told(each) if isinstance(each, str) else each for name, each in given.items()}
    return words.format_map(inner) if inner else words


def translated(template: str, **values: object) -> str:
    """A message, told at once."""
    return told(message(template, **values))


@lru_cache(4096)
def _known(code: str, text: str) -> str:
    """A text that was not made by `message`: told as it is, or as what its templates say."""
    bare = text.strip()
    words = catalogue(code).gettext(bare) if bare else ""
    if words == bare and _TO_BE_TOLD.search(bare):
        words = recognise(bare, _templates(code), lambda part: _known(code, part))
    start = len(text) - len(text.lstrip())
    return text[:start] + words + text[start + len(bare) :]


@cache
def _templates(code: str) -> list[Template]:
    return templates(catalogue(code)._catalog)  # type: ignore[attr-defined]


@cache
def catalogue(code: str) -> "GNUTranslations":
    """The translations to a language."""
    from gettext import GNUTranslations

    with (_FOLDER / f"{code}.mo").open("rb") as file:
        return GNUTranslations(file)
