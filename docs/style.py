"""The style of the English pages, checked: `python docs/style.py` (part of `make lint`).

A sentence has at most so many words; home-made words are not used; few sentences of a page are
passive. What is code, a formula, a table or a title is no sentence. Texts of commands and keys are
on pages that `docs/generate.py` makes, so they are checked, too.
"""

import re
import statistics
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
STYLE = tomllib.loads((ROOT / "docs/style.toml").read_text(encoding="utf-8"))
_BLOCK = re.compile(r"^( *)(`{3,}|\$\$).*?^\1\2[ ]*$|<!--.*?-->", re.S | re.M)
_ITEM = re.compile(r"^\s*(?:[-*+]|\d+\.)\s+")
#: What takes the place of code, so that a sentence keeps the words it is read with.
_CODE = re.compile(r"`[^`]*`|\$[^$\n]+\$")
_LINK = re.compile(r"!?\[([^\]]*)\]\([^)]*\)")
#: Ends of sentences: no point within a number, an abbreviation or a name of a file.
_END = re.compile(
    r"(?<!\be\.g)(?<!\bi\.e)(?<!\bcf)(?<!\bch)(?<!\bvs)(?<!\bNo)(?<!\bEq)[.!?][)\"'*]*\s+(?=[\"'(*]*[A-Z0-9_]|'[a-z])"
)
_WORD = re.compile(r"[A-Za-z][\w'/-]*")
_PASSIVE = re.compile(
    r"\b(?:is|are|was|were|be|been|being)\s+(?:not\s+|never\s+|only\s+|also\s+|then\s+)?"
    r"(?:\w+ed|" + "|".join(STYLE["participles"]) + r")\b",
    re.I,
)


class Sentence(NamedTuple):
    """A sentence of a page, with the line on which its paragraph begins."""

    line: int
    text: str

    @property
    def words(self) -> int:
        return len(_WORD.findall(self.text))


def pages() -> list[Path]:
    """All English pages that a reader of the project meets."""
    found = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    is_left_out = re.compile("|".join(STYLE["pages_left_out"]))
    return [path for path in found if not is_left_out.search(path.relative_to(ROOT).as_posix())]


def sentences(text: str) -> Iterator[Sentence]:
    """The sentences of a page in Markdown; an item, a cell of a table and a break end one."""
    blank = _BLOCK.sub(lambda block: "\n" * block[0].count("\n"), text)
    for line, paragraph in _paragraphs(blank):
        plain = _LINK.sub(r"\1", _CODE.sub("Code", paragraph))
        for part in _END.split(plain):
            if _WORD.search(part):
                yield Sentence(line, part.strip())


def _paragraphs(text: str) -> Iterator[tuple[int, str]]:
    begun, lines = 0, []
    for number, line in enumerate([*text.split("\n"), ""], 1):
        is_table, is_title = line.lstrip().startswith("|"), line.startswith("#")
        if lines and (not line.strip() or is_table or is_title or _ITEM.match(line)):
            yield begun, " ".join(lines)
            lines = []
        if is_table:
            yield from ((number, cell.strip()) for cell in re.split(r"(?<!\\)\||<br>", line))
        elif line.startswith("    ") and not lines and not _ITEM.match(line):
            continue  # a block of code
        elif line.strip() and not is_title:
            begun = begun if lines else number
            lines.append(_ITEM.sub("", line).strip(" >"))


def findings(text: str) -> list[tuple[int, str]]:
    """What a page does against the style: line and reason."""
    found, all_of_it = [], [*sentences(text)]
    for each in all_of_it:
        if each.words > STYLE["most_words"]:
            most = STYLE["most_words"]
            found.append((each.line, f"{each.words} words, of at most {most}: {each.text[:70]}..."))
        for word, instead in STYLE["words"].items():
            if re.search(rf"\b{word}\b", each.text, re.I):
                found.append((each.line, f"{word!r}: write {instead}: {each.text[:70]}..."))
    share = passive_share(all_of_it)
    if len(all_of_it) >= STYLE["enough_sentences"] and share > STYLE["most_passive"]:
        found.append(
            (1, f"{share:.0%} of the sentences are passive, of {STYLE['most_passive']:.0%}")
        )
    return found


def passive_share(all_of_it: list[Sentence]) -> float:
    """Part of the sentences that have a passive verb."""
    return sum(bool(_PASSIVE.search(each.text)) for each in all_of_it) / max(1, len(all_of_it))


def main() -> int:
    """Print what is found; with `--count`, words a sentence and the passive share of each page."""
    wrong = 0
    for path in pages():
        text, name = path.read_text(encoding="utf-8"), path.relative_to(ROOT)
        if "--count" in sys.argv:
            counts = sorted(each.words for each in sentences(text)) or [0]
            ninety = counts[int(0.9 * (len(counts) - 1))]
            share = passive_share([*sentences(text)])
            print(
                f"{name}: median {statistics.median(counts):g}, 90 % {ninety}, passive {share:.0%}"
            )
        for line, reason in findings(text):
            print(f"{name}:{line}: {reason}")
            wrong += 1
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
