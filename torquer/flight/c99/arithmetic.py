"""Operations on numbers, with Python's meaning of each, to the bit."""

import ast
import math
import operator
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from torquer.flight.c99.helpers import LIBRARY
from torquer.flight.c99.precision import is_single
from torquer.flight.c99.refusal import Impossible
from torquer.flight.c99.types import BOOL, INT, REAL, TIME, UNBOUNDED, Bounds, Number
from torquer.flight.c99.values import Rank, Value, as_real, as_time, as_whole, constant

#: Text in C, how tightly it binds, what Python does.
_PLAIN: dict[type, tuple[str, int, Callable]] = {
    ast.Add: ("+", Rank.SUM, operator.add),
    ast.Sub: ("-", Rank.SUM, operator.sub),
    ast.Mult: ("*", Rank.PRODUCT, operator.mul),
    ast.Div: ("/", Rank.PRODUCT, operator.truediv),
}
_BITS: dict[type, tuple[str, int, Callable]] = {
    ast.BitAnd: ("&", Rank.BIT_AND, operator.and_),
    ast.BitXor: ("^", Rank.BIT_XOR, operator.xor),
    ast.BitOr: ("|", Rank.BIT_OR, operator.or_),
}
#: Operations for which the C text has functions of its own, for floats and whole numbers.
_HELPED: dict[type, tuple[str, str, Callable]] = {
    ast.FloorDiv: ("floor_div", "floor_div_int", operator.floordiv),
    ast.Mod: ("floor_mod", "floor_mod_int", operator.mod),
}
_KNOWN: dict[type, tuple] = {**_PLAIN, **_BITS, **_HELPED, ast.Pow: (operator.pow,)}
_NO_SHIFT = "write a product or // by a power of two"
_COMPARE: dict[type, tuple[str, int, Callable]] = {
    ast.Lt: ("<", Rank.ORDER, operator.lt),
    ast.LtE: ("<=", Rank.ORDER, operator.le),
    ast.Gt: (">", Rank.ORDER, operator.gt),
    ast.GtE: (">=", Rank.ORDER, operator.ge),
    ast.Eq: ("==", Rank.EQUAL, operator.eq),
    ast.NotEq: ("!=", Rank.EQUAL, operator.ne),
}
#: Functions of floats in C with the bits of Python's: both call the same library. Those of
#: `LIBRARY` go through a function of the C text; the others round correctly everywhere.
OF_FLOATS: dict[Callable, str] = {
    **{getattr(math, name): f"{name}_of" for name in LIBRARY},
    **{f: f.__name__ for f in (math.sqrt, math.fmod, math.copysign, math.fabs)},
    np.sqrt: "sqrt", np.abs: "fabs", np.fabs: "fabs", np.copysign: "copysign", np.floor: "floor",
    np.ceil: "ceil", np.trunc: "trunc", np.fmod: "fmod",
}  # fmt: skip
#: Those of two numbers.
OF_TWO = frozenset({"fmod", "copysign", "atan2_of"})
#: NumPy's, of whole numbers whole: with no zero that has a sign.
ROUNDING = frozenset({np.floor, np.ceil, np.trunc})
#: Whole numbers of floats.
TO_WHOLE: dict[Callable, str] = {math.floor: "floor", math.ceil: "ceil", math.trunc: "trunc"}
#: Truths of floats.
TESTS: dict[Callable, str] = {
    math.isnan: "isnan", math.isinf: "isinf", math.isfinite: "isfinite",
    np.isnan: "isnan", np.isinf: "isinf", np.isfinite: "isfinite",
}  # fmt: skip


#: What to write for a power of which a compiler knows a part.
OF_CONSTANTS = (
    "write x * x, math.sqrt(x) or math.exp: compilers round a power by a constant otherwise"
)


def binary(op: ast.operator, a: Value, b: Value, helpers: set[str]) -> Value:
    """An operation on two numbers; `helpers`: names of further functions that it needs."""
    if not (isinstance(a.type, Number) and isinstance(b.type, Number)):
        raise Impossible(
            "write it out for each number (torquer.maths.geometry.vec3 has add, scale, dot)"
        )
    kind = type(op)
    if a.is_known and b.is_known:
        return _fold(op, a, b)
    if kind in _BITS:
        return _bits(kind, a, b)
    if kind is ast.Pow:
        return _power(a, b, helpers)
    if kind in _HELPED:
        return _help_out(kind, a, b, helpers)
    if kind not in _PLAIN:
        raise Impossible(_NO_SHIFT)
    return _plain(kind, a, b)


def _fold(op: ast.operator, a: Value, b: Value) -> Value:
    *_, known = _KNOWN.get(type(op), (None,))
    if known is None:
        raise Impossible(_NO_SHIFT)
    try:
        found = known(a.known, b.known)
    except (ArithmeticError, TypeError) as error:
        raise Impossible(f"write what is defined ({error})") from None
    if isinstance(op, ast.Pow) and not isinstance(found, int):
        raise Impossible(OF_CONSTANTS)
    return constant(found)


def _plain(kind: type, a: Value, b: Value) -> Value:
    sign, rank, _ = _PLAIN[kind]
    a, b = as_whole(a), as_whole(b)
    whole = a.type == b.type == INT and kind is not ast.Div
    is_time = _is_time(kind, a, b)
    if not whole:
        a, b = in_one_type(a, b)
    text = f"{a.within(rank)} {sign} {b.within(rank + 1)}"
    bounds = _bounds(kind, a, b) if whole else UNBOUNDED
    found = Value(text, a.type, rank, reads=a.reads or b.reads, bounds=bounds)
    return found if whole or is_time else as_real(found)


def _is_time(kind: type, a: Value, b: Value) -> bool:
    """Whether a result is a time: a time plus or minus a number; what lies between two is none."""
    times = [a.type, b.type].count(TIME)
    return times > 0 and (kind is ast.Add or (kind is ast.Sub and times == 1))


def in_one_type(a: Value, b: Value) -> tuple[Value, Value]:
    """Two floats for one operation: as times if one of them is a time."""
    if TIME in (a.type, b.type):
        return as_time(a), as_time(b)
    return as_real(a), as_real(b)


def _bounds(kind: type, a: Value, b: Value) -> Bounds:
    """Least and greatest sum or difference; of products nothing is said."""
    (a0, a1), (b0, b1) = a.bounds, b.bounds
    if kind is ast.Add:
        return a0 + b0, a1 + b1
    return (a0 - b1, a1 - b0) if kind is ast.Sub else UNBOUNDED


def either(a: Bounds, b: Bounds) -> Bounds:
    """Bounds of a number that is one of two."""
    return min(a[0], b[0]), max(a[1], b[1])


def _bits(kind: type, a: Value, b: Value) -> Value:
    sign, rank, _ = _BITS[kind]
    if a.type == b.type == BOOL:
        text = f"(int64_t){a.within(Rank.SIGN)} {sign} (int64_t){b.within(Rank.SIGN)}"
        return Value(f"({text}) != 0", BOOL, Rank.EQUAL, reads=a.reads or b.reads)
    a, b = as_whole(a), as_whole(b)
    if a.type != INT or b.type != INT:
        raise Impossible("use it on whole numbers")
    if kind is ast.BitAnd and (_is_below(a, b) or _is_below(b, a)):
        return constant(0)
    text = f"{a.within(Rank.SIGN)} {sign} {b.within(Rank.SIGN)}"
    masks = [each.bounds[1] for each in (a, b) if kind is ast.BitAnd and each.bounds[0] >= 0]
    bounds = (0, min(masks)) if masks else UNBOUNDED
    return Value(text, INT, rank, reads=a.reads or b.reads, bounds=bounds)


def _is_below(a: Value, mask: Value) -> bool:
    """Whether a whole number has no bit as high as the lowest one of a mask."""
    if not mask.is_known or mask.known <= 0 or a.bounds[0] < 0:
        return False
    return a.bounds[1] < (mask.known & -mask.known)


def _power(a: Value, b: Value, helpers: set[str]) -> Value:
    if a.is_known or b.is_known or a.settled or b.settled:
        raise Impossible(OF_CONSTANTS)
    if b.type in (INT, BOOL):
        raise Impossible("write a product, or float(n) as the exponent: with n the bits differ")
    helpers.add("power_of")
    return call_function("power_of", [as_real(as_whole(a)), as_real(as_whole(b))], REAL)


def _help_out(kind: type, a: Value, b: Value, helpers: set[str]) -> Value:
    of_floats, of_whole, _ = _HELPED[kind]
    a, b = as_whole(a), as_whole(b)
    whole = a.type == b.type == INT
    if not whole:
        return as_real(help_out(of_floats, [a, b], helpers))
    helpers.add(of_whole)
    made = call_function(of_whole, [a, b], INT)
    return replace(made, bounds=_bounds_of_quotient(kind, a.bounds, b.bounds))


def _bounds_of_quotient(kind: type, a: Bounds, b: Bounds) -> Bounds:
    """Least and greatest remainder, or quotient, by a positive number."""
    if b[0] <= 0:
        return UNBOUNDED
    if kind is ast.Mod:
        return 0, b[1] - 1
    if b[0] != b[1]:
        return UNBOUNDED
    low, high = (each if math.isinf(each) else each // b[0] for each in a)
    return low, high


def help_out(name: str, values: list[Value], helpers: set[str]) -> Value:
    """A call of a function of floats that the C text has of its own, or of its twin for times."""
    has_times = any(each.type == TIME for each in values)
    name = f"{name}_times" if has_times else name
    helpers.add(name)
    if has_times:
        return call_function(name, [as_time(each) for each in values], TIME)
    return call_function(name, [as_real(each) for each in values], REAL)


def call_library(name: str, values: list[Value]) -> Value:
    """A call of a function of the C library.

    In single precision those that round correctly are the library's own for floats; the others are
    computed for doubles and rounded, so that libraries which differ in a last bit agree (`_of`).
    """
    if any(each.type == TIME for each in values):
        twin = f"{name}_times" if name.endswith("_of") else name
        found = call_function(twin, [as_time(each) for each in values], TIME)
        return found if name == "fabs" else as_real(found)
    single = is_single() and not name.endswith("_of")
    return call_function(f"{name}f" if single else name, [as_real(each) for each in values], REAL)


def nearest_whole(name: str, value: Value) -> Value:
    """A whole number near a float, as a float: floor, ceil, trunc."""
    if value.type == TIME:
        return call_function(name, [value], TIME)
    return call_function(f"{name}f" if is_single() else name, [value], REAL)


def to_whole(value: Value, helpers: set[str]) -> Value:
    """A float without its fraction, as a whole number.

    Of NaN and of numbers beyond 64 bits C says nothing, and a damaged state may have them; `int_of`
    makes the number of them that an x86-64 makes.
    """
    name = "int_of_times" if value.type == TIME else "int_of"
    helpers.add(name)
    return call_function(name, [value], INT)


def call_function(name: str, values: list[Value], kind: Number) -> Value:
    """A call of a function of numbers."""
    text = f"{name}({', '.join(value.text for value in values)})"
    return Value(text, kind, reads=any(value.reads for value in values))


def negative(value: Value) -> Value:
    """Minus a number."""
    value = as_whole(value)
    if value.is_known:
        return constant(-value.known)
    low, high = value.bounds
    text = f"-{value.within(Rank.ATOM)}"
    return Value(text, value.type, Rank.SIGN, reads=value.reads, bounds=(-high, -low))


def inverse(value: Value) -> Value:
    """Not a truth."""
    value = truth(value)
    if value.is_known:
        return constant(not value.known)
    return Value(f"!{value.within(Rank.SIGN)}", BOOL, Rank.SIGN, reads=value.reads)


def truth(value: Value) -> Value:
    """Whether a number is not zero; a truth as it is."""
    if not isinstance(value.type, Number):
        raise Impossible("compare numbers")
    if value.type == BOOL:
        return value
    if value.is_known:
        return constant(bool(value.known))
    zero = "0" if value.type == INT else _zero(value.type)
    return Value(f"{value.within(Rank.ORDER)} != {zero}", BOOL, Rank.EQUAL, reads=value.reads)


def _zero(kind: Number) -> str:
    return as_time(constant(0.0)).text if kind == TIME else constant(0.0).text


def compare(op: ast.cmpop, a: Value, b: Value) -> Value:
    """A comparison of two numbers."""
    if type(op) not in _COMPARE:
        raise Impossible("use < <= > >= == != or `in` a tuple of numbers")
    if not (isinstance(a.type, Number) and isinstance(b.type, Number)):
        raise Impossible("compare numbers")
    sign, rank, known = _COMPARE[type(op)]
    if a.is_known and b.is_known:
        return constant(bool(known(a.known, b.known)))
    if b.is_known and a.type == b.type == INT and (found := _decide(op, a, b.known)) is not None:
        return constant(found)
    if a.type != b.type:
        a, b = as_whole(a), as_whole(b)
    if a.type != b.type:
        a, b = in_one_type(a, b)
    text = f"{a.within(Rank.SUM)} {sign} {b.within(Rank.SUM)}"
    return Value(text, BOOL, rank, reads=a.reads or b.reads)


def _decide(op: ast.cmpop, a: Value, limit: int) -> bool | None:
    """What a comparison with a number says by the bounds of the other side alone."""
    low, high = a.bounds
    if not isinstance(op, ast.Lt | ast.GtE) or low < limit <= high:
        return None
    return isinstance(op, ast.GtE) == (low >= limit)


def both(a: Value, b: Value, is_and: bool) -> Value:
    """Both truths, or one of them; the second is looked at only where it matters."""
    if a.is_known:
        return b if a.known == is_and else a
    sign, inner, rank = ("&&", Rank.AND, Rank.AND) if is_and else ("||", Rank.EQUAL, Rank.OR)
    text = f"{a.within(inner)} {sign} {b.within(inner)}"
    return Value(text, BOOL, rank, reads=a.reads or b.reads)
