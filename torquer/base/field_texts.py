"""The strings below the fields of a class: what its keys mean, read from the source on demand.

Never during a run. A file is parsed once, whatever the number of its classes.
"""

import ast
import inspect
import linecache
from collections.abc import Iterator
from functools import cache
from itertools import pairwise


@cache
def texts_below_fields(kind: type) -> dict[str, str]:
    """The string below each field of a class or of one that it inherits, by name.

    A class whose source is not there states none.
    """
    found: dict[str, str] = {}
    for each in reversed(kind.__mro__):
        if vars(each).get("__annotations__"):
            found |= _own_texts(each)
    return found


@cache
def _own_texts(kind: type) -> dict[str, str]:
    try:
        file = inspect.getsourcefile(kind) or ""
    except (OSError, TypeError):
        return {}
    linecache.checkcache(file)
    classes = _classes_in("".join(linecache.getlines(file)))
    return _texts_in(classes[kind.__qualname__]) if kind.__qualname__ in classes else {}


@cache
def _classes_in(source: str) -> dict[str, ast.ClassDef]:
    """The classes of a file by their qualified names; of one defined twice the last."""
    return dict(_classes_below(ast.parse(source), ""))


def _classes_below(node: ast.AST, prefix: str) -> Iterator[tuple[str, ast.ClassDef]]:
    for child in ast.iter_child_nodes(node):
        match child:
            case ast.ClassDef(name=name):
                yield prefix + name, child
                yield from _classes_below(child, f"{prefix}{name}.")
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name):
                yield from _classes_below(child, f"{prefix}{name}.<locals>.")
            case ast.stmt():
                yield from _classes_below(child, prefix)


def _texts_in(node: ast.ClassDef) -> dict[str, str]:
    found = {}
    for field, below in pairwise(node.body):
        match field, below:
            case (
                ast.AnnAssign(target=ast.Name(id=name)),
                ast.Expr(value=ast.Constant(value=str(words))),
            ):
                found[name] = " ".join(words.split())
    return found
