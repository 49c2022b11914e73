"""The board's page in the language of the reader: its own texts, and those of its scripts.

A script says `t("not flown")`; the page loads `/messages.js`, which holds the translations of all
such texts, none in English.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from functools import cache
from html import escape, unescape
from pathlib import Path

from torquer.base.language import ENGLISH, language, told

WEB = Path(__file__).parent / "web"
_IN_SCRIPTS = re.compile(r'\bt\(\s*"([^"]+)"')
#: Texts of the page: between tags, and in attributes that are read out or shown.
_IN_PAGE = re.compile(
    r'(?<=>)[^<>{}\n]*[A-Za-z]{2}[^<>{}\n]*(?=<)|(?<= title=")[^"]+|(?<=aria-label=")[^"]+'
)


@cache
def texts() -> list[str]:
    """Texts of the page and of its scripts, in English."""
    scripts = (path.read_text(encoding="utf-8") for path in sorted(WEB.glob("*.js")))
    found = [unescape(each) for each in _IN_PAGE.findall(_page())]
    return [*dict.fromkeys([*found, *(x for each in scripts for x in _IN_SCRIPTS.findall(each))])]


def page() -> str:
    """The page as HTML."""
    text = _IN_PAGE.sub(lambda found: escape(told(unescape(found[0]))), _page())
    return text.replace('<html lang="en">', f'<html lang="{language()}">')


def messages() -> str:
    """The script with the translations of all texts."""
    said = {} if language() == ENGLISH else {text: told(text) for text in texts()}
    return f"export const words = {json.dumps(said, ensure_ascii=False, sort_keys=True)};\n"


def told_all(data, keys: tuple[str, ...], tell: Callable[[str], str] = told):
    """Plain data with the texts at these keys in the language of the reader."""
    if isinstance(data, dict):
        return {
            key: _told_texts(each, tell) if key in keys else told_all(each, keys, tell)
            for key, each in data.items()
        }
    if isinstance(data, list | tuple):
        return [told_all(each, keys, tell) for each in data]
    return data


def _told_texts(value, tell: Callable[[str], str]):
    if isinstance(value, str):
        return tell(value)
    return [_told_texts(each, tell) for each in value] if isinstance(value, list | tuple) else value


@cache
def _page() -> str:
    return (WEB / "index.html").read_text(encoding="utf-8")
