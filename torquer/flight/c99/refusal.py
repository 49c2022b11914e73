"""What cannot be translated to C is refused in one line: file, line, construct, what to write."""

import ast
from pathlib import Path

from torquer.compile.sources import PACKAGE

#: Longest piece of source text that a message shows.
_LONGEST = 60


class Impossible(Exception):
    """An operation that has no translation: what to write instead."""


class Refused(ValueError):
    """A construct that has no translation to C; its text is one line for the user.

    `place`: where it stands, `instead`: what to write in its place; `is_own`: whether the text is
    the package's, which the user cannot change; `key`: of the scenario, once it is known.
    """

    def __init__(self, place: str, construct: str, instead: str, is_own: bool = False):
        super().__init__(place, construct, instead)
        self.place, self.construct, self.instead = place, construct, instead
        self.is_own, self.key = is_own, ""

    def __str__(self) -> str:
        if self.key and self.is_own:
            received = f"what needs {self.construct} ({self.place} of torquer)"
            return f"{self.key}: must have a translation to C; received {received}"
        where = f" ({self.key})" * bool(self.key)
        return f"{self.place}: {self.construct} has no translation to C; {self.instead}{where}"


def refuse(file: str, node: ast.AST | None, construct: str, instead: str) -> Refused:
    """The error for a construct at its place; `instead`: what to write in its place."""
    line = f", line {node.lineno}" if node is not None and hasattr(node, "lineno") else ""
    is_own = Path(file).resolve().is_relative_to(PACKAGE)
    return Refused(f"{Path(file).name}{line}", construct, instead, is_own)


def quote_source(node: ast.AST) -> str:
    """The source text of a construct, cut where it is long."""
    text = " ".join(ast.unparse(node).split())
    return f"`{text}`" if len(text) <= _LONGEST else f"`{text[:_LONGEST]}...`"
