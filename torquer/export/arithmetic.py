"""Operations on numbers, with Python's meaning of each, to the bit."""

import ast
import math
import operator
from collections.abc import Callable

import numpy as np

from torquer.export.types import BOOL, DOUBLE, INT, Number
from torquer.export.values import (
    AND,
    ATOM,
    BIT_AND,
    BIT_OR,
    BIT_XOR,
    EQUAL,
    ORDER,
    PRODUCT,
    SIGN,
    SUM,
    Value,
    as_double,
    as_whole,
    constant,
)

#: Text in C, how tightly it binds, what Python does.
_PLAIN: dict[type, tuple[str, int, Callable]] = {
    ast.Add: ("+", SUM, operator.add),
    ast.Sub: ("-", SUM, operator.sub),
    ast.Mult: ("*", PRODUCT, operator.mul),
    ast.Div: ("/", PRODUCT, operator.truediv),
}
_BITS: dict[type, tuple[str, int, Callable]] = {
    ast.BitAnd: ("&", BIT_AND, operator.and_),
    ast.BitXor: ("^", BIT_XOR, operator.xor),
    ast.BitOr: ("|", BIT_OR, operator.or_),
}
#: Operations for which the C text has functions of its own, for doubles and whole numbers.
_HELPED: dict[type, tuple[str, str, Callable]] = {
    ast.FloorDiv: ("floor_div", "floor_div_int", operator.floordiv),
    ast.Mod: ("floor_mod", "floor_mod_int", operator.mod),
}
_COMPARE: dict[type, tuple[str, int, Callable]] = {
    ast.Lt: ("<", ORDER, operator.lt),
    ast.LtE: ("<=", ORDER, operator.le),
    ast.Gt: (">", ORDER, operator.gt),
    ast.GtE: (">=", ORDER, operator.ge),
    ast.Eq: ("==", EQUAL, operator.eq),
    ast.NotEq: ("!=", EQUAL, operator.ne),
}
#: Functions of doubles in C with the bits of Python's; both call the same library.
OF_DOUBLES: dict[Callable, str] = {
    **{f: f"{f.__name__}_of" for f in (  # the library's or `torquer.export.portable`
        math.sin, math.cos, math.asin, math.acos, math.atan, math.atan2,
    )},
    **{f: f.__name__ for f in (
        math.sqrt, math.tan, math.exp, math.expm1, math.log, math.log1p, math.log2, math.log10,
        math.sinh, math.cosh, math.tanh, math.fmod, math.copysign, math.fabs, math.pow,
    )},
    np.sqrt: "sqrt", np.abs: "fabs", np.fabs: "fabs", np.copysign: "copysign", np.floor: "floor",
    np.ceil: "ceil", np.trunc: "trunc", np.fmod: "fmod",
}  # fmt: skip
#: Whole numbers of doubles.
TO_WHOLE: dict[Callable, str] = {math.floor: "floor", math.ceil: "ceil", math.trunc: "trunc"}
#: Truths of doubles.
TESTS: dict[Callable, str] = {
    math.isnan: "isnan", math.isinf: "isinf", math.isfinite: "isfinite",
    np.isnan: "isnan", np.isinf: "isinf", np.isfinite: "isfinite",
}  # fmt: skip


class Impossible(Exception):
    """An operation that has no translation: what to write instead."""


def binary(op: ast.operator, a: Value, b: Value, helpers: set[str]) -> Value:
    """An operation on two numbers; `helpers`: names of further functions that it needs."""
    if not (isinstance(a.type, Number) and isinstance(b.type, Number)):
        raise Impossible("write it out for each number (torquer.geometry.vec3 has add, scale, dot)")
    kind = type(op)
    if a.is_known and b.is_known:
        return _folded(op, a, b)
    if kind in _BITS:
        return _bits(kind, a, b)
    if kind is ast.Pow:
        return _power(a, b, helpers)
    if kind in _HELPED:
        return _helped(kind, a, b, helpers)
    if kind not in _PLAIN:
        raise Impossible("write a product or // by a power of two")
    return _plain(kind, a, b)


def _folded(op: ast.operator, a: Value, b: Value) -> Value:
    known = {k: f for k, (*_, f) in {**_PLAIN, **_BITS, **_HELPED}.items()} | {
        ast.Pow: operator.pow
    }
    if type(op) not in known:
        raise Impossible("write a product or // by a power of two")
    try:
        found = known[type(op)](a.known, b.known)
    except (ArithmeticError, TypeError) as error:
        raise Impossible(f"write what is defined ({error})") from None
    if isinstance(found, complex) or (isinstance(found, int) and abs(found) >= 2**63):
        raise Impossible("write what a float or an integer of 64 bits can hold")
    return constant(found)


def _plain(kind: type, a: Value, b: Value) -> Value:
    sign, rank, _ = _PLAIN[kind]
    a, b = as_whole(a), as_whole(b)
    whole = a.type == b.type == INT and kind is not ast.Div
    if not whole:
        a, b = as_double(a), as_double(b)
    text = f"{a.within(rank)} {sign} {b.within(rank + 1)}"
    bounds = _bounds(kind, a, b) if whole else (None, None)
    return Value(text, INT if whole else DOUBLE, rank, reads=a.reads or b.reads, bounds=bounds)


def _bounds(kind: type, a: Value, b: Value) -> tuple[int | None, int | None]:
    """Least and greatest sum or difference; of products nothing is said."""
    (a0, a1), (b0, b1) = a.bounds, b.bounds
    if kind is ast.Sub:
        b0, b1 = None if b1 is None else -b1, None if b0 is None else -b0
    elif kind is not ast.Add:
        return None, None
    low = None if a0 is None or b0 is None else a0 + b0
    return low, None if a1 is None or b1 is None else a1 + b1


def either(a: tuple, b: tuple) -> tuple[int | None, int | None]:
    """Bounds of a number that is one of two."""
    low = None if a[0] is None or b[0] is None else min(a[0], b[0])
    return low, None if a[1] is None or b[1] is None else max(a[1], b[1])


def _bits(kind: type, a: Value, b: Value) -> Value:
    sign, rank, _ = _BITS[kind]
    if a.type == b.type == BOOL:
        text = f"(int64_t){a.within(SIGN)} {sign} (int64_t){b.within(SIGN)}"
        return Value(f"({text}) != 0", BOOL, EQUAL, reads=a.reads or b.reads)
    a, b = as_whole(a), as_whole(b)
    if a.type != INT or b.type != INT:
        raise Impossible("use it on whole numbers")
    text = f"{a.within(SIGN)} {sign} {b.within(SIGN)}"
    return Value(text, INT, rank, reads=a.reads or b.reads)


def _power(a: Value, b: Value, helpers: set[str]) -> Value:
    if a.type != DOUBLE and b.type != DOUBLE:
        raise Impossible("write a product, or make one of them a float")
    if a.is_known or b.is_known:
        raise Impossible(
            "write x * x, math.sqrt(x) or math.exp: compilers round a power by a constant otherwise"
        )
    helpers.add("power_of")
    return called("power_of", [as_double(as_whole(a)), as_double(as_whole(b))], DOUBLE)


def _helped(kind: type, a: Value, b: Value, helpers: set[str]) -> Value:
    of_doubles, of_whole, _ = _HELPED[kind]
    a, b = as_whole(a), as_whole(b)
    whole = a.type == b.type == INT
    name = of_whole if whole else of_doubles
    helpers.add(name)
    made = called(name, [a, b] if whole else [as_double(a), as_double(b)], INT if whole else DOUBLE)
    if whole and kind is ast.Mod and b.is_known and b.known > 0:
        return Value(made.text, INT, reads=made.reads, bounds=(0, b.known - 1))
    return made


def called(name: str, values: list[Value], kind: Number) -> Value:
    """A call of a function of numbers."""
    text = f"{name}({', '.join(value.text for value in values)})"
    return Value(text, kind, reads=any(value.reads for value in values))


def negative(value: Value) -> Value:
    """Minus a number."""
    value = as_whole(value)
    if value.is_known:
        return constant(-value.known)
    low, high = value.bounds
    bounds = (None if high is None else -high, None if low is None else -low)
    text = f"-{value.within(ATOM)}"
    return Value(text, value.type, SIGN, reads=value.reads, bounds=bounds)


def inverse(value: Value) -> Value:
    """Not a truth."""
    value = truth(value)
    if value.is_known:
        return constant(not value.known)
    return Value(f"!{value.within(SIGN)}", BOOL, SIGN, reads=value.reads)


def truth(value: Value) -> Value:
    """Whether a number is not zero; a truth as it is."""
    if not isinstance(value.type, Number):
        raise Impossible("compare numbers")
    if value.type == BOOL:
        return value
    if value.is_known:
        return constant(bool(value.known))
    zero = "0" if value.type == INT else "0.0"
    return Value(f"{value.within(ORDER)} != {zero}", BOOL, EQUAL, reads=value.reads)


def compare(op: ast.cmpop, a: Value, b: Value) -> Value:
    """A comparison of two numbers."""
    if type(op) not in _COMPARE:
        raise Impossible("use < <= > >= == != or `in` a tuple of numbers")
    if not (isinstance(a.type, Number) and isinstance(b.type, Number)):
        raise Impossible("compare numbers")
    sign, rank, known = _COMPARE[type(op)]
    if a.is_known and b.is_known:
        return constant(bool(known(a.known, b.known)))
    if b.is_known and a.type == b.type == INT and (found := _decided(op, a, b.known)) is not None:
        return constant(found)
    if a.type != b.type:
        a, b = as_whole(a), as_whole(b)
    if a.type != b.type:
        a, b = as_double(a), as_double(b)
    text = f"{a.within(SUM)} {sign} {b.within(SUM)}"
    return Value(text, BOOL, rank, reads=a.reads or b.reads)


def _decided(op: ast.cmpop, a: Value, limit: int) -> bool | None:
    """What a comparison with a number says by the bounds of the other side alone."""
    low, high = a.bounds
    if isinstance(op, ast.Lt | ast.GtE):
        if low is not None and low >= limit:
            return isinstance(op, ast.GtE)
        if high is not None and high < limit:
            return isinstance(op, ast.Lt)
    return None


def both(a: Value, b: Value, is_and: bool) -> Value:
    """Both truths, or one of them; the second is looked at only where it matters."""
    if a.is_known:
        return b if a.known == is_and else a
    sign = "&&" if is_and else "||"
    left = a.text if a.rank >= EQUAL or (f" {sign} " in a.text and a.rank == AND and is_and) else ""
    text = f"{left or f'({a.text})'} {sign} {b.within(EQUAL)}"
    return Value(text, BOOL, AND if is_and else AND - 1, reads=a.reads or b.reads)
