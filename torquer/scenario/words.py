"""Words of the trade, for which torquer has another name: what answers whoever looks for one."""

import tomllib
from functools import cache
from pathlib import Path
from typing import NamedTuple


class Word(NamedTuple):
    """Words that mean the same, what torquer calls it, a page below docs/, a key or ""."""

    words: tuple[str, ...]
    here: str
    page: str
    key: str = ""


@cache
def trade_words() -> list[Word]:
    """All of them, in the order of the file."""
    text = Path(__file__).with_name("words.toml").read_text(encoding="utf-8")
    rows = tomllib.loads(text)["word"]
    return [Word(**{**row, "words": tuple(row["words"])}) for row in rows]


def trade_word(word: str) -> Word | None:
    """What answers a word, whatever its case, hyphens and plural; None for one that is none."""
    wanted = _plain(word)
    return next((each for each in trade_words() if wanted in map(_plain, each.words)), None)


def _plain(word: str) -> str:
    return " ".join(word.lower().replace("-", " ").replace("_", " ").split()).removesuffix("s")
