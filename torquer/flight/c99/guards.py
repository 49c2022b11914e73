"""What a user's kernel must not do on board: leave a table, divide by zero, leave 64 bits.

In the simulation a law that does the first two raises an error. In C, too, its kernels return at
once, and so do those that have called them, up to the computer, which takes no command of the law.
Whole numbers that leave 64 bits wrap, as in the simulation (`numba_private.defined_numbers`).
"""

import ast
import math

from torquer.flight.c99.arithmetic import call_function
from torquer.flight.c99.lines import Left
from torquer.flight.c99.refusal import quote_source
from torquer.flight.c99.scope import Scope
from torquer.flight.c99.types import INT, TIME, UNBOUNDED, Bounds, Number
from torquer.flight.c99.values import Value, as_whole, constant
from torquer.flight.c99.words import FAILURES_NAME

_LEAST, _GREATEST = -(2**63), 2**63 - 1
_WRAPPING: dict[type, str] = {
    ast.Add: "sum_of_int", ast.Sub: "difference_of_int", ast.Mult: "product_of_int",
}  # fmt: skip
_DIVIDES = (ast.Div, ast.FloorDiv, ast.Mod)


def _leave(s: Scope) -> None:
    """Return at once; within a `try` do what its handler says."""
    if s.handled is not None:
        s.handled()
        return
    s.fails = True
    s.block.lines.append(Left(s.depth, ""))


def leave_failed(s: Scope) -> None:
    """Return at once if the kernel that has just been called has failed."""
    with s.braces(f"if ({FAILURES_NAME}->raised != 0)"):
        _leave(s)


def fail_if(s: Scope, node: ast.AST, condition: str) -> None:
    """Have the kernel fail where a condition holds; the line of its file tells where."""
    line = getattr(node, "lineno", 1)
    s.report()
    s.program.checks[s.source.file, line, quote_source(node)] = None
    with s.braces(f"if ({condition})"):
        s.say(f"{FAILURES_NAME}->raised = {line};")
        _leave(s)


def check_index(s: Scope, node: ast.AST, index: Value, count: int) -> Value:
    """An index that is in its table, from -count to count - 1, from here on."""
    low, high = index.bounds
    if high < -count or low >= count:
        raise s.refuse(node, f"use an index from 0 to {count - 1}")
    if -count <= low and high < count:
        return index
    held = index if index.is_simple else s.kept(index)
    conditions = [
        f"{held.text} < {-count}" if low < -count else "",
        f"{held.text} >= {count}" if high >= count else "",
    ]
    fail_if(s, node, " || ".join(filter(None, conditions)))
    return held


def guard(s: Scope, node: ast.AST, op: ast.operator, b: Value) -> Value:
    """The second operand of an operation: no division by it fails from here on."""
    if not (s.raises and isinstance(op, _DIVIDES) and isinstance(b.type, Number)):
        return b
    if b.is_known and b.known == 0:
        raise s.refuse(node, "divide by what is not 0")
    if b.is_known or (b.type == INT and not b.bounds[0] <= 0 <= b.bounds[1]):
        return b
    b = as_whole(b)
    held = b if b.is_simple else s.kept(b)
    zero = "0" if b.type == INT else "0.0" if b.type == TIME else constant(0.0).text
    fail_if(s, node, f"{held.text} == {zero}")
    return held


def wrapped(s: Scope, op: ast.operator, a: Value, b: Value, found: Value) -> Value:
    """A sum, difference or product of whole numbers that may leave 64 bits: it wraps."""
    name = _WRAPPING.get(type(op))
    if not s.checks or name is None or found.type != INT or found.is_known:
        return found
    bounds = _exact_bounds(op, a.bounds, b.bounds)
    if bounds is not None:
        return Value(found.text, INT, found.rank, reads=found.reads, bounds=bounds)
    s.program.helpers.add(name)
    return call_function(name, [a, b], INT)


def _exact_bounds(op: ast.operator, a: Bounds, b: Bounds) -> Bounds | None:
    """Least and greatest result of an operation; None if it may leave 64 bits."""
    (a0, a1), (b0, b1) = _of_64_bits(a), _of_64_bits(b)
    if isinstance(op, ast.Add):
        low, high = a0 + b0, a1 + b1
    elif isinstance(op, ast.Sub):
        low, high = a0 - b1, a1 - b0
    else:
        products = (a0 * b0, a0 * b1, a1 * b0, a1 * b1)
        low, high = min(products), max(products)
    return (low, high) if low >= _LEAST and high <= _GREATEST else None


def _of_64_bits(bounds: Bounds) -> tuple[int, int]:
    low, high = bounds
    return (
        _LEAST if math.isinf(low) else max(int(low), _LEAST),
        _GREATEST if math.isinf(high) else min(int(high), _GREATEST),
    )


def negative(s: Scope, value: Value, found: Value) -> Value:
    """Minus a whole number, which wraps where it is the least."""
    if not s.checks or found.type != INT or found.is_known or value.bounds[0] > _LEAST:
        return found
    s.program.helpers.add("difference_of_int")
    text = f"difference_of_int(0, {value.text})"
    return Value(text, INT, reads=value.reads, bounds=UNBOUNDED)
