"""The source text of a kernel: its syntax tree, the names in it, the values outside it."""

import ast
import builtins
import functools
import inspect
import re
import textwrap
from collections.abc import Callable, Iterator
from types import FunctionType
from typing import TypeGuard

from torquer.base.user_source import plain_function, source_text
from torquer.compile.sources import is_own
from torquer.flight.c99.refusal import refuse

#: Statements that hold further statements.
_BLOCKS = ("body", "orelse")


class Source:
    """A kernel's text. `text`: of its lines, from line `first` of its file on; `tree`: its
    definition, with line numbers of its file; `stored`: names that
    are set; `own`: names of its arguments and variables; `read`: names that are read;
    `outside`: values of the names outside it; `is_own`: whether it is of this package.
    """

    def __init__(self, function: Callable):
        self.plain = plain_function(function)
        if not isinstance(self.plain, FunctionType):
            what = getattr(function, "__name__", repr(function))
            raise refuse("export", None, f"{what}, which has no text in Python,", "write a kernel")
        self.file, self.is_own = self.plain.__code__.co_filename, is_own(self.plain)
        self.tree = self._parsed()
        self.body = self.tree.body
        if ast.get_docstring(self.tree) is not None:
            self.body = self.body[1:]
        self.places = {name: list(of) for name, of in _places(self.tree).items()}
        self.stored = {
            node.id
            for node in ast.walk(self.tree)
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
        }
        self.own = {each.arg for each in self.tree.args.args} | self.stored
        for name in sorted({self.tree.name, *self.own}):
            if not name.isascii():
                raise refuse(self.file, self.tree, f"the name {name}", "use letters from a to z")
        self.read = {
            node.id
            for node in ast.walk(self.tree)
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)
        }
        names = inspect.getclosurevars(self.plain).nonlocals
        self.outside = {**vars(builtins), **self.plain.__globals__, **names}

    def _parsed(self) -> ast.FunctionDef:
        try:
            lines, self.first = inspect.getsourcelines(self.plain)
            self.text = "".join(lines)
            tree = ast.parse(textwrap.dedent(self.text)).body[0]
        except (OSError, SyntaxError):
            what, instead = f"{self.plain.__name__}, whose text is not found,", "put it in a file"
            raise refuse(self.file, None, what, instead) from None
        ast.increment_lineno(tree, self.first - 1)
        if isinstance(tree, ast.AsyncFunctionDef):
            raise refuse(self.file, tree, "a function with async", "write a function with def")
        if not isinstance(tree, ast.FunctionDef):
            raise refuse(self.file, tree, "a lambda", "write a function with def")
        self._check_unchanged(tree)
        return tree

    def _check_unchanged(self, tree: ast.FunctionDef) -> None:
        """A text that is not what runs must not be exported."""
        if not self.is_own and not source_text(self.plain):
            what, instead = f"{tree.name}, edited since it was loaded,", "load the scenario again"
            raise refuse(self.file, tree, what, instead)

    @property
    def docstring(self) -> str:
        """The docstring; '' if there is none."""
        return ast.get_docstring(self.tree) or ""

    @property
    def doc(self) -> str:
        """What the docstring begins with: its first paragraph, without what else is told of it."""
        first = self.docstring.partition("\n\n")[0]
        return re.sub(r"^(?:Source: |Meets REQ).*\n?", "", first, flags=re.M).rstrip()

    @property
    def equation(self) -> str:
        """The line of the docstring that cites a published equation; '' if there is none."""
        found = re.search(r"^Source: .*$", self.docstring, re.M)
        return found[0] if found else ""

    @functools.cache  # noqa: B019  sources are kept, too
    def is_loop_only(self, loop: ast.For) -> bool:
        """Whether the variable of a loop is read within loops over it alone, and never set there.

        Such a variable can be that of a `for` in C.
        """
        name = loop.target.id if isinstance(loop.target, ast.Name) else ""
        loops = [each for each in ast.walk(self.tree) if _is_loop_over(each, name)]
        inside = {id(node) for each in loops for node in ast.walk(each)}
        headers = {id(each.target) for each in loops}
        nested = any(other is not each and id(other) in _ids(each)
                     for each in loops for other in loops)  # fmt: skip
        uses = [n for n in ast.walk(self.tree) if isinstance(n, ast.Name) and n.id == name]
        set_there = [n for n in uses if isinstance(n.ctx, ast.Store) and id(n) not in headers]
        return not nested and not set_there and all(id(n) in inside for n in uses)

    @functools.cache  # noqa: B019
    def is_set_first(self, name: str, statement: ast.stmt) -> bool:
        """Whether all uses of a name follow this assignment within the block that it stands in."""
        first = next((path for path, at in self.places[name] if at is statement), None)
        if first is None or not isinstance(statement, ast.Assign):
            return False
        block, number = first[:-1], first[-1]
        if any(path[: len(block)] != block or path[len(block)] < number for path, _ in
               self.places[name]):  # fmt: skip
            return False
        within = [at for path, at in self.places[name] if path[len(block)] == number]
        read = {n.id for n in ast.walk(statement.value) if isinstance(n, ast.Name)}
        return all(at is statement for at in within) and name not in read


def read_source(function: Callable) -> Source:
    """The text of a kernel, read once."""
    return _read(plain_function(function))


@functools.cache
def _read(plain: Callable) -> Source:
    return Source(plain)


def _ids(node: ast.AST) -> set[int]:
    return {id(each) for each in ast.walk(node)}


def _is_loop_over(node: ast.AST, name: str) -> TypeGuard[ast.For]:
    return (
        isinstance(node, ast.For) and isinstance(node.target, ast.Name) and node.target.id == name
    )


def _places(tree: ast.FunctionDef) -> dict[str, list]:
    """Where each name stands: path of blocks and numbers of statements, and the statement."""
    found: dict[str, list] = {}
    for path, statement in _statements(tree.body, ()):
        for node in _header(statement):
            if isinstance(node, ast.Name):
                found.setdefault(node.id, []).append((path, statement))
    return found


def _statements(block: list, path: tuple) -> Iterator[tuple[tuple, ast.stmt]]:
    for number, statement in enumerate(block):
        yield (*path, number), statement
        for part in _BLOCKS:
            yield from _statements(getattr(statement, part, []), (*path, number, part))


def _header(statement: ast.stmt) -> Iterator[ast.AST]:
    """All nodes of a statement but those of the statements in it."""
    for name, value in ast.iter_fields(statement):
        for each in value if isinstance(value, list) else [value]:
            if isinstance(each, ast.AST) and name not in _BLOCKS:
                yield from ast.walk(each)
