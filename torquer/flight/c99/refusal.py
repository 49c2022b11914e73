"""What cannot be translated to C is refused in one line: file, line, construct, what to write."""

import ast
from pathlib import Path

#: Longest piece of source text that a message shows.
_LONGEST = 60


class Impossible(Exception):
    """An operation that has no translation: what to write instead."""


class Refused(ValueError):
    """A construct that has no translation to C; its text is one line for the user."""


def refuse(file: str, node: ast.AST | None, construct: str, instead: str) -> Refused:
    """The error for a construct at its place; `instead`: what to write in its place."""
    line = f", line {node.lineno}" if node is not None and hasattr(node, "lineno") else ""
    return Refused(f"{Path(file).name}{line}: {construct} has no translation to C; {instead}")


def quote_source(node: ast.AST) -> str:
    """The source text of a construct, cut where it is long."""
    text = " ".join(ast.unparse(node).split())
    return f"`{text}`" if len(text) <= _LONGEST else f"`{text[:_LONGEST]}...`"
