"""The catalogues of messages: `python docs/catalogue.py` after texts have changed.

It finds every text that is translated, writes them into `torquer/base/messages/*.po`, and compiles
these (`*.mo`). Texts that are new stand at the end of the `.po` with an empty translation, to be
filled in; then run it again. Texts that are no more are taken out.
"""

import ast
import importlib
import json
import re
import string
import struct
from collections.abc import Iterable, Iterator
from pathlib import Path

import texts_in_code

from torquer.base.language import TRANSLATED
from torquer.cli import translated_help
from torquer.cli.app import app
from torquer.cli.translated_help import paragraphs
from torquer.pages.board import words
from torquer.pages.board.form import make_form
from torquer.pages.board.text import data_from_toml
from torquer.scenario.keys import key_words, spec_tables
from torquer.scenario.spec import Scenario

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "torquer/base/messages"
#: Tables of texts that are translated where they are shown: all, or one column of their rows.
TABLES: dict[str, int | None] = {
    "torquer.analysis.budget:NAMES": 1,
    "torquer.analysis.goals:SIGNALS": None,
    "torquer.report.flight.setting:LABELS": None,
    "torquer.analysis.summary:_ROWS": 0,
}
#: Where texts for people are f-strings and constants: every text of these rooms and files.
ROOMS = (
    "analysis/budget.py", "analysis/causes.py", "analysis/conserved.py", "analysis/field",
    "analysis/filters", "analysis/mode_use.py", "analysis/notes", "analysis/pointing",
    "analysis/spin_up.py", "campaign", "cli/commands", "cli/compiling.py", "computer/modes",
    "design", "environment/orbit", "pages/board", "report/campaign",
    "report/common/side_by_side.py", "report/field", "report/filter",
    "report/flight/torque_budget.py", "report/mission.py",
    "report/theory", "report/wheels", "scenario/ending.py", "scenario/spec.py",
    "theory/averaged/answer.py", "theory/averaged/case.py", "theory/averaged/flights.py",
    "theory/averaged/motion.py", "theory/slow/equilibria.py", "theory/slow/gain_and_time.py",
    "theory/slow/gains.py", "theory/slow/slow_result.py", "theory/three_axis/gain_search.py",
    "theory/three_axis/periodic_lqr.py",
)  # fmt: skip
#: Files in these rooms whose texts are for programs, or for operators of flight and ground.
_NOT_READ = re.compile(
    r"cli/commands/(ground|packets|kernels|about|fly|telemetry|export)"
    r"|orbit/(files|sgp4|user|point_mass)"
    r"|computer/modes/(table|signals|layout|diagram)|field/(requests|orbit)|filters/smoothing"
    r"|campaign/(store|executors|chunk_files|provenance|fleet|outcomes|joining|unit_numbers"
    r"|variation|load|momenta|sampling)|design/(file_keys|stored_keys|requests)"
)
#: Units of quantities in texts and on axes.
UNITS = (
    *("s", "min", "h", "d", "deg", "deg/s", "rpm", "J", "A m²", "coil-seconds"),
    *(prefix + unit for unit in ("N m", "N m s", "T", "A m²") for prefix in ("", "m", "µ", "n")),
)
#: Frames of a reference attitude.
FRAMES = ("orbital", "inertial", "orbital or inertial")
#: How a run ended, and how its laws were executed.
ENDS = ("complete", "stopped", "interrupted", "failed", "compiled")
ENDS += ("plain Python (slow: not decorated)",)
#: Words that stand alone: in heads of tables, in names of what failed, in values of keys.
WORDS = Path(__file__).with_name("catalogue_words.txt").read_text(encoding="utf-8").splitlines()
_MAKERS = ("message", "translated")
_IN_TEMPLATES = re.compile(r'\btold\("([^"]+)"\)')
#: Head of a catalogue, by the code of its language.
_HEAD = {
    "ru": "Language: ru\nMIME-Version: 1.0\nContent-Type: text/plain; charset=UTF-8\n"
    "Content-Transfer-Encoding: 8bit\n"
}


def messages() -> dict[str, str]:
    """Every text that is translated, with the place that it first stands at."""
    found: dict[str, str] = {}
    known = (("words", each) for each in (*UNITS, *FRAMES, *ENDS, *WORDS))
    for place, text in (
        *_of_help(()),
        *_of_cyclopts(),
        *_of_tables(),
        *_of_code(),
        *_of_rooms(),
        *_of_form(),
        *known,
    ):
        found.setdefault(text, place)
    return found


def _of_help(words: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    """Help of a command and of those below it."""
    place = " ".join(("torquer", *words, "--help"))
    _, apps, _ = app.parse_commands(list(words))
    shown = [apps[-1].help]
    for _, panel in app._assemble_help_panels(list(words), "markdown"):
        described = (each.description.primary_renderable for each in panel.entries)
        shown += [getattr(each, "markup", "") for each in described]
    yield from ((place, each) for text in shown for each in paragraphs(text or ""))
    for name in apps[-1]:
        if not name.startswith("-"):
            yield from _of_help((*words, name))


def _of_cyclopts() -> Iterator[tuple[str, str]]:
    for text in (*translated_help.TITLES, *translated_help.MARKS, *translated_help.USAGE):
        yield "torquer/cli/translated_help.py", text


def _of_tables() -> Iterator[tuple[str, str]]:
    for home, column in TABLES.items():
        module, name = home.split(":")
        table = getattr(importlib.import_module(module), name)
        rows = table.items() if isinstance(table, dict) else table
        for row in rows:
            yield from ((module, each) for each in (row if column is None else (row[column],)))


def _of_form() -> Iterator[tuple[str, str]]:
    """Labels of all keys, and what the form of a new scenario says of its own."""
    start = (ROOT / "torquer/scenario/start.toml").read_text(encoding="utf-8")
    for table in make_form(data_from_toml(start)):
        fields = (each["about"] for each in table["fields"])
        yield from (("a new scenario", text) for text in (table["title"], table["about"], *fields))
    names = dict.fromkeys(
        key_words(key.name) for table in spec_tables(Scenario) for key in table.keys
    )
    yield from (("labels of keys", name) for name in names)


def _of_code() -> Iterator[tuple[str, str]]:
    """Templates of messages: literal first arguments of the functions that make them."""
    for path in sorted((ROOT / "torquer").rglob("*.py")):
        source = path.read_text(encoding="utf-8")
        nodes = ast.walk(ast.parse(source)) if "base.language" in source else ()
        for call in sorted((n for n in nodes if isinstance(n, ast.Call)), key=_place):
            match call:
                case ast.Call(ast.Name(name), [ast.Constant(str(text)), *_]) if name in _MAKERS:
                    yield path.relative_to(ROOT).as_posix(), text
    for path in sorted((ROOT / "torquer").rglob("*.html")):
        for text in _IN_TEMPLATES.findall(path.read_text(encoding="utf-8")):
            yield path.relative_to(ROOT).as_posix(), text


def _of_rooms() -> Iterator[tuple[str, str]]:
    """Texts of the rooms whose texts are read, and of the board's page."""
    for room in ROOMS:
        path = ROOT / "torquer" / room
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            place = file.relative_to(ROOT).as_posix()
            if not _NOT_READ.search(place):
                tree = ast.parse(file.read_text(encoding="utf-8"))
                yield from ((place, text) for text in texts_in_code.texts(tree))
    yield from (("torquer/pages/board/web", text) for text in words.texts())


def _place(node: ast.Call) -> tuple[int, int]:
    return node.lineno, node.col_offset


def read(path: Path) -> dict[str, str]:
    """Translations of a `.po` file, without its head."""
    found: dict[str, str] = {}
    key, part = "", ""
    for line in path.read_text(encoding="utf-8").splitlines():
        word = re.match(r'(?:(msgid|msgstr) )?(".*")$', line)
        if word is None:
            continue
        part, text = word[1] or part, json.loads(word[2])
        if part == "msgid":
            key = text if word[1] else key + text
        else:
            found[key] = text if word[1] else found[key] + text
    found.pop("", None)
    return found


def as_po(code: str, placed: dict[str, str], translations: dict[str, str]) -> str:
    """The text of a `.po` file: those to be translated come last."""
    rows = [("", _HEAD[code], "")]
    rows += [(text, translations.get(text, ""), place) for text, place in placed.items()]
    rows.sort(key=lambda row: not row[1])
    return "\n".join(_entry(*row) for row in rows)


def _entry(text: str, translation: str, place: str) -> str:
    head = f"#: {place.replace(' ', '_')}\n" if place else ""
    return f"{head}msgid {_quoted(text)}\nmsgstr {_quoted(translation)}\n"


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def as_mo(code: str, translations: dict[str, str]) -> bytes:
    """A catalogue as gettext reads it: keys in order, and where each text lies."""
    pairs = sorted({"": _HEAD[code], **translations}.items())
    keys, texts = ([each[k].encode() for each in pairs] for k in (0, 1))
    count, start = len(pairs), 28 + 16 * len(pairs)
    places, end = [], start
    for each in (*keys, *texts):
        places += [len(each), end]
        end += len(each) + 1
    head = (0x950412DE, 0, count, 28, 28 + 8 * count, 0, 0)
    return struct.pack(f"<{7 + len(places)}I", *head, *places) + b"".join(
        each + b"\0" for each in (*keys, *texts)
    )


def placeholders(text: str) -> set[str]:
    """Names in braces that a text is given values for; none if it is no such text."""
    try:
        return {name for _, name, _, _ in string.Formatter().parse(text) if name}
    except ValueError:
        return set()


def update(code: str, placed: dict[str, str]) -> Iterable[str]:
    """Write both files of a language; the texts that lack a translation."""
    path = FOLDER / f"{code}.po"
    known = {text: told for text, told in read(path).items() if text in placed and told}
    path.write_text(as_po(code, placed, known), encoding="utf-8")
    path.with_suffix(".mo").write_bytes(as_mo(code, known))
    return [text for text in placed if text not in known]


if __name__ == "__main__":
    found = messages()
    for language in TRANSLATED:
        for missing in update(language, found):
            print(f"{language}: no translation: {missing}")
