"""Where each function of an export comes from: a comment above it, and a table of all.

A kernel is known by its file, its lines and a digest of them: SHA-256 of the text from its first
decorator to its last line, the first 16 digits (`sed -n 'FIRST,LASTp' FILE | sha256sum`).
Requirements are those that its docstring names, in the project's or the user's numbering.
"""

import csv
import hashlib
import io
import re
from collections.abc import Iterator
from pathlib import Path

from torquer.compile.sources import PACKAGE
from torquer.flight.c99.source import Source

#: A number of a requirement.
_REQUIREMENT = re.compile(r"\bREQ(?:-[A-Z0-9]+)+\b")
_MEETS, _FROM = "Meets", "From"
#: A function as it stands in a file of C: its comment, its name.
_FUNCTION = re.compile(
    r"(?:^/\*(?P<comment>(?:(?!\*/).)*)\*/\n)?"
    r"^(?![ #}/]|typedef)[^\n;={]*?\b(?P<name>\w+)\((?:(?![;{]).)*?\n\{",
    re.M | re.S,
)
_ORIGIN = re.compile(rf"{_FROM}\s(\S+):(\d+)-(\d+),\sSHA-256\s([0-9a-f]+)")
_EQUATION = re.compile(r"^\s*Source:\s(.*?)\.?\s*$", re.M)
HEAD = (
    "file", "function", "source", "first_line", "last_line", "sha256", "equation", "requirements",
)  # fmt: skip
#: What the table says of a function behind which there is no kernel of Python.
OF_EXPORT = "of the export"


def origin_lines(source: Source) -> str:
    """Lines of the comment above a function: what it meets, where it comes from."""
    found = dict.fromkeys(_REQUIREMENT.findall(source.docstring))
    met = [f"{_MEETS} {', '.join(found)}."] if found else []
    first, last = source.first, source.first + source.text.count("\n")
    last -= source.text.endswith("\n")
    digest = hashlib.sha256(source.text.encode()).hexdigest()[:16]
    return "\n".join([*met, f"{_FROM} {_name_of(source)}:{first}-{last}, SHA-256 {digest}"])


def _name_of(source: Source) -> str:
    """A file of the package from its root on; the name of any other alone."""
    file = Path(source.file)
    if file.is_relative_to(PACKAGE):
        return file.relative_to(PACKAGE.parent).as_posix()
    return "_".join(file.name.split())


def trace_table(texts: dict[str, str]) -> str:
    """All functions in these files of C, by name of the file: a table with commas (CSV)."""
    made = io.StringIO()
    rows = csv.writer(made, lineterminator="\n")
    rows.writerow(HEAD)
    for file, text in texts.items():
        rows.writerows((file, *row) for row in _functions_in(text))
    return made.getvalue()


def _functions_in(text: str) -> Iterator[tuple[str, ...]]:
    """Rows of the table for a file, without its name."""
    for found in _FUNCTION.finditer(text):
        comment = found["comment"] or ""
        origin, equation = _ORIGIN.search(comment), _EQUATION.search(comment)
        met = " ".join(dict.fromkeys(_REQUIREMENT.findall(comment)))
        place = origin.groups() if origin else (OF_EXPORT, "", "", "")
        yield (found["name"], *place, equation[1] if equation else "", met)
