"""How expressions are evaluated: by their kind, in Python's order.

What a call changes in memory happens before anything that comes after it: such a call becomes a
statement of its own before the statement in which it stands, and what was read before is kept.
"""

import ast
from collections.abc import Callable
from types import ModuleType

import numpy as np

from torquer.flight.c99 import arithmetic
from torquer.flight.c99.guards import guard, wrapped
from torquer.flight.c99.lines import Block
from torquer.flight.c99.scope import Scope
from torquer.flight.c99.times import type_constant, type_tuple, written_tuple
from torquer.flight.c99.types import NOTHING, PLACES, Static, Tuple, find_type, tuple_type
from torquer.flight.c99.values import Form, Value, constant, select_part, static

#: What to write in place of constructs that are often met.
_INSTEAD = {
    ast.Lambda: "write a function with def",
    ast.ListComp: "write a loop",
    ast.GeneratorExp: "write a loop",
    ast.SetComp: "write a loop",
    ast.DictComp: "write a loop",
    ast.List: "write a tuple, or cells of the memory",
    ast.Dict: "write variables, or names of the memory",
    ast.JoinedStr: "leave text out",
    ast.NamedExpr: "write an assignment before",
    ast.Await: "leave it out",
    ast.Yield: "return one answer: memory keeps what the next call needs",
    ast.YieldFrom: "return one answer: memory keeps what the next call needs",
}


#: Functions that translate an expression, by its kind.
_HANDLERS: dict[type, Callable] = {}


def translates(kind: type) -> Callable:
    """Decorator of the function that translates expressions of a kind."""

    def registered(function: Callable) -> Callable:
        _HANDLERS[kind] = function
        return function

    return registered


def evaluate(s: Scope, node: ast.expr) -> Value:
    """An expression; what it must do before goes to the scope's lines."""
    handler = _HANDLERS.get(type(node))
    if handler is None:
        raise s.refuse(node, _INSTEAD.get(type(node), "write numbers, tuples and loops"))
    return _unneeded(s, handler, node) if id(node) in s.noted.muted else handler(s, node)


def _unneeded(s: Scope, handler: Callable, node: ast.expr) -> Value:
    """An expression whose value is not needed: what it reads counts only if it changes memory."""
    with s.noted.apart() as reads, s.captured() as block:
        value = handler(s, node)
    if block.effects:
        s.noted.reads.add(reads)
    s.add(block)
    return value


def in_order(s: Scope, nodes: list[ast.expr]) -> list[Value]:
    """Several expressions, each evaluated before the next."""
    done: list[Value] = []
    for node in nodes:
        block, value = apart(s, node)
        if block.effects:
            done = [s.kept(each) if each.reads else each for each in done]
        s.add(block)
        done.append(value)
    return done


def apart(s: Scope, node: ast.expr, deeper: int = 0) -> tuple[Block, Value]:
    """An expression, and what it must do before, which is not yet said."""
    with s.captured(deeper) as block:
        value = evaluate(s, node)
    return block, value


def evaluate_truth(s: Scope, node: ast.expr) -> Value:
    """An expression as a truth."""
    value = evaluate(s, node)
    with s.refusing(node):
        return arithmetic.truth(value)


def operation(s: Scope, node: ast.AST, op: ast.operator, a: Value, b: Value) -> Value:
    """An operation on two numbers."""
    if isinstance(op, ast.Pow):
        s.note_power(a)
        s.note_power(b)
    b = guard(s, node, op, b)
    with s.refusing(node):
        found = arithmetic.binary(op, a, b, s.program.helpers)
    return wrapped(s, op, arithmetic.as_whole(a), arithmetic.as_whole(b), found)


def evaluate_outside(s: Scope, node: ast.expr, value, name: str = "") -> Value:
    """A value from outside the kernel: a constant, or what is known while translating."""
    if isinstance(value, Value):
        return value
    if isinstance(value, bool | np.bool_):
        return constant(bool(value))
    if isinstance(value, int | float | np.int64):
        number = float(value) if isinstance(value, float) else int(value)
        with s.refusing(node):
            return s.program.named_constant(name, number)
    kind = find_type(value) if isinstance(value, tuple) else None
    if isinstance(kind, Tuple):
        with s.refusing(node):
            return s.program.named_constant(name, value, type_constant(s.program, kind))
    if callable(value) or isinstance(value, ModuleType | tuple) or value is None:
        return static(value)
    hint = "use a number, a tuple, parameters or memory"
    raise s.refuse(node, "make it a float or an int" if isinstance(value, np.generic) else hint)


def parts_in_order(s: Scope, nodes: list[ast.expr]) -> list[Value]:
    """Expressions in order; one with a star stands for all its parts."""
    plain = [each.value if isinstance(each, ast.Starred) else each for each in nodes]
    found: list[Value] = []
    for node, value in zip(nodes, in_order(s, plain), strict=True):
        found += split_tuple(s, node, value) if isinstance(node, ast.Starred) else [value]
    return found


def split_tuple(s: Scope, node: ast.AST, value: Value) -> list[Value]:
    """The parts of a tuple, which is kept where it would be evaluated for each."""
    if isinstance(value.type, Static) and isinstance(value.type.value, tuple):
        return [evaluate_outside(s, node, each) for each in value.type.value]  # type: ignore[arg-type]
    if not isinstance(value.type, Tuple):
        raise s.refuse(node, "unpack tuples only; of memory read each number, such as memory.b[0]")
    held = at_hand(s, value)
    s.noted.reads.parts |= {(value.type.of, name) for name in value.type.fields or ()}
    return [select_part(held, place) for place in range(len(value.type.parts))]


def at_hand(s: Scope, value: Value) -> Value:
    """A tuple whose parts can be read: what a call returns is kept."""
    return s.kept(value) if value.form is Form.RESULT else value


def make_tuple(s: Scope, node: ast.AST, parts: list[Value], of: type = tuple) -> Value:
    """A tuple of these parts."""
    if not parts:
        return static(())
    if any(isinstance(each.type, Static) for each in parts):
        if all(each.is_known for each in parts):
            return static(tuple(each.known for each in parts))
        raise s.refuse(node, "write tuples of numbers")
    if any(isinstance(each.type, PLACES) or each.type == NOTHING for each in parts):
        raise s.refuse(node, "write tuples of numbers: records and arrays stay where they are")
    parts = type_tuple(s, of, parts)
    kind = tuple_type(tuple(each.type for each in parts), of)
    return written_tuple(s.program, kind, parts)
