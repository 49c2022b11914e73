"""Texts for people in the source, where no message is made of them: f-strings and constants.

A text is a template: `f"{share:.0%} of {what}"` is "{share:.0%} of {what}". Docstrings are left
out, and what is raised: errors stay English. A part that has two forms gives a template of each.
"""

import ast
import itertools
import re
from collections.abc import Iterator
from typing import NamedTuple

#: Most templates that one expression gives.
_MOST = 8
#: Calls whose texts nobody reads: errors, patterns, options of parsers.
_UNREAD = re.compile(
    r"(Error|Refused|Warning|Warnings)$|^(compile|sub|match|search|fullmatch|warn)$"
)
#: Texts of two words or more; no code, path, key or name of a file.
_PROSE = re.compile(r"[A-Za-z]{2,}[,:;.)\]]* +[^\s]*[A-Za-z]{2}|[A-Za-z]{3,}.*[A-Za-z]{3,} ")
_CODE = re.compile(
    r"^(upper|lower|top|bottom|middle|outside|axes) |^#|^torquer |^cmake|^ctest"
    r"|^[\w.]*=|[<>]\w+|__|\\|;$|%\(|^\s*(def|from|import) |\]: |must .*received|\{\{|\n"
)


class _Part(NamedTuple):
    """A piece of a template: a text as it is, or a value with its name and format."""

    text: str
    name: str = ""
    form: str = ""


def texts(tree: ast.Module) -> Iterator[str]:
    """Templates of the texts of a module, in order, without those of fewer than two words."""
    for node in _shown(tree):
        for parts in _forms(node):
            text = _template(parts).strip()
            if is_prose(text):
                yield text


def is_prose(text: str) -> bool:
    """Whether people read a text, as far as its look tells."""
    bare = re.sub(r"\{[^{}]*\}", "x1", text)
    return bool(_PROSE.search(bare)) and not _CODE.search(bare)


def _shown(node: ast.AST) -> Iterator[ast.expr]:
    """The outermost expressions that are texts."""
    match node:
        case ast.Raise() | ast.Assert() | ast.Import() | ast.ImportFrom():
            return
        case ast.Expr(ast.Constant()):
            return  # a docstring
        case ast.Call(ast.Name(name)) | ast.Call(ast.Attribute(_, name)) if _UNREAD.search(name):
            return
        case ast.Constant(str()) | ast.JoinedStr():
            yield node
            return
        case ast.BinOp(op=ast.Add()) if _is_text(node):
            yield node
            return
    for child in ast.iter_child_nodes(node):
        yield from _shown(child)


def _is_text(node: ast.expr) -> bool:
    match node:
        case ast.Constant(str()) | ast.JoinedStr():
            return True
        case ast.BinOp(left, ast.Add(), right):
            return _is_text(left) or _is_text(right)
        case ast.IfExp(_, body, other):
            return _is_text(body) and _is_text(other)
    return False


def _forms(node: ast.expr) -> list[list[_Part]]:
    """Every form of an expression, as parts."""
    match node:
        case ast.Constant(str(text)):
            return [[_Part(text)]]
        case ast.JoinedStr(values):
            return _each([_forms(value) for value in values])
        case ast.FormattedValue(value, _, None) if _is_text(value):
            return _forms(value)
        case ast.FormattedValue(value, _, form):
            shown = "" if form is None else _template(_forms(form)[0])
            return [[_Part("", _name(value), shown)]]
        case ast.BinOp(left, ast.Add(), right) if _is_text(node):
            return _each([_forms(left), _forms(right)])
        case ast.IfExp(_, body, other) if _is_text(node):
            return (_forms(body) + _forms(other))[:_MOST]
    return [[_Part("", _name(node))]]


def _each(parts: list[list[list[_Part]]]) -> list[list[_Part]]:
    forms = itertools.islice(itertools.product(*parts), _MOST)
    return [[piece for part in form for piece in part] for form in forms]


def _name(node: ast.expr) -> str:
    """A name for a value, from how it is computed."""
    match node:
        case ast.Name(name) | ast.Attribute(_, name):
            return name.strip("_")
        case ast.Subscript(_, ast.Constant(str(name))) if name.isidentifier():
            return name
        case ast.Subscript(value, _):
            return _name(value)
        case ast.Call(ast.Attribute(value, "join"), _):
            return _name(node.args[0])
        case ast.Call(ast.Name("len" | "abs" | "str" | "float" | "int"), [only]):
            return _name(only)
        case ast.Call(ast.Attribute(_, "degrees"), [only]):
            return _name(only)
        case ast.Call(ast.Name(name) | ast.Attribute(_, name)):
            return name.strip("_")
        case ast.BinOp(ast.Constant(), _, right):
            return _name(right)
        case ast.BinOp(left, _, ast.Constant() | ast.Name()):
            return _name(left)
    return "value"


def _template(parts: list[_Part]) -> str:
    """A template; of values of the same name each has a number."""
    made, seen = [], set()
    for part in parts:
        if not part.name:
            made.append(part.text)
            continue
        name, n = part.name, 1
        while name in seen:
            n += 1
            name = f"{part.name}{n}"
        seen.add(name)
        made.append(f"{{{name}{':' if part.form else ''}{part.form}}}")
    return "".join(made)
