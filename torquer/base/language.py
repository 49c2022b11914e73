"""The language of what people read: English, the source, or one that a catalogue translates to.

Only texts for people are translated. What programs read is English in any language: JSON, result
files, CSV, keys, logs, messages of errors. Catalogues are `messages/*.po`; `docs/catalogue.py`
finds what is to be translated and compiles them.
"""

import os
import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gettext import GNUTranslations

ENGLISH = "en"
#: Languages that have a catalogue.
TRANSLATED = ("ru",)
_ON_WINDOWS = {"russian": "ru"}
#: What states the language, the first one that is set.
_STATED_BY = ("TORQUER_LANG", "LC_ALL", "LC_MESSAGES", "LANG")
_FOLDER = Path(__file__).parent / "messages"


def language(environment: Mapping[str, str] = os.environ) -> str:
    """The language stated by `TORQUER_LANG`, else by the locale; English where it has none."""
    stated = next(filter(None, map(environment.get, _STATED_BY)), "")
    if not stated and os.name == "nt":  # no variable states it there
        import locale

        stated = locale.getlocale()[0] or ""
    code = re.split(r"[_.@-]", stated)[0].lower()
    code = _ON_WINDOWS.get(code, code)
    return code if code in TRANSLATED else ENGLISH


def translated(text: str, **values: object) -> str:
    """A text in the language of the moment, itself where it has no translation; with `values`
    put in for its `{names}`."""
    code = language()
    if code != ENGLISH and text:
        text = catalogue(code).gettext(text)
    return text.format_map(values) if values else text


@cache
def catalogue(code: str) -> "GNUTranslations":
    """The translations to a language."""
    from gettext import GNUTranslations

    with (_FOLDER / f"{code}.mo").open("rb") as file:
        return GNUTranslations(file)
