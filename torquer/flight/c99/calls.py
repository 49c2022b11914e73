"""Calls in kernels: of other kernels, of functions of numbers, of classes of named tuples."""

import ast
import inspect
import math
from dataclasses import replace

import numpy as np

from torquer.base.user_source import plain_function
from torquer.flight.c99 import arithmetic
from torquer.flight.c99.evaluate import (
    at_hand,
    evaluate,
    evaluate_outside,
    make_tuple,
    operation,
    parts_in_order,
    translates,
)
from torquer.flight.c99.guards import leave_failed
from torquer.flight.c99.places import Chosen, may_overlap
from torquer.flight.c99.scope import Scope
from torquer.flight.c99.types import (
    BOOL,
    INT,
    NOTHING,
    PLACES,
    REAL,
    TIME,
    UNBOUNDED,
    Array,
    Number,
    Record,
    Rows,
    Static,
    Tuple,
)
from torquer.flight.c99.values import Form, Rank, Value, as_float, as_real, constant, static
from torquer.flight.c99.words import FAILURES_NAME

#: Names of functions of Python and its library with what to write in their place.
_INSTEAD = {
    "sum": "write the sum out or a loop",
    "round": "write math.floor(x + 0.5)",
    "hypot": "write math.sqrt(x * x + y * y), whose bits are the same everywhere",
    "sorted": "write min and max, or an `if` for each order",
    "isinstance": "leave it out: types are known",
    "enumerate": "write range and an index",
    "zip": "write range and an index",
    "divmod": "write // and %",
    "pow": "write **",
    "degrees": "write x * (180.0 / math.pi)",
    "radians": "write x * (math.pi / 180.0)",
    "clip": "write min(max(x, least), greatest)",
    "minimum": "write min",
    "maximum": "write max",
    "dot": "write torquer.maths.geometry.vec3.dot",
    "cross": "write torquer.maths.geometry.vec3.cross",
    "norm": "write torquer.maths.geometry.vec3.norm",
}


_NOTHING_IS_READ = "leave it out: nothing is read on board but the inputs"
_TIME_IS_HANDED_IN = "use inputs.t_s, the time that is handed in"
_ONE_ANSWER = "leave it out: the same inputs have the same answer"
#: The same for functions of whole modules, and for those of Python that take anything.
_OF_MODULES = {
    "random": _ONE_ANSWER, "numpy.random": _ONE_ANSWER,
    "time": _TIME_IS_HANDED_IN, "datetime": _TIME_IS_HANDED_IN,
    **dict.fromkeys(("os", "posix", "nt", "posixpath", "sys", "io", "_io"), _NOTHING_IS_READ),
}  # fmt: skip
_OF_PYTHON = {
    "print": "leave it out", "input": _NOTHING_IS_READ,
    "getattr": "write a field: a.b", "setattr": "write a field: a.b",
    **dict.fromkeys(("eval", "exec", "compile"), "write what it computes"),
    **dict.fromkeys(("globals", "locals", "vars"), "name what is wanted"),
}  # fmt: skip


class Cast:
    """In place of a function: cells of memory seen as parameters, as a named memory, or as many."""

    def __init__(self, kind: Tuple | Record | Array | None):
        self.kind = kind

    def __call__(self, cells):
        raise TypeError("is for the translator alone")


class Failed:
    """In place of a function: what is answered for a law or an estimator that has failed, by its
    number.
    """

    def __init__(self, number: int, answer):
        self.number, self.answer = number, answer

    def __call__(self):
        raise TypeError("is for the translator alone")


@translates(ast.Call)
def call(s: Scope, node: ast.Call) -> Value:
    """A call, with its arguments in order."""
    function = evaluate(s, node.func)
    if not isinstance(function.type, Static):
        raise s.refuse(node, "call a kernel by its name")
    called = function.type.value
    if instead := _in_place_of(called):
        raise s.refuse(node, instead)
    keywords = [each.arg for each in node.keywords]
    if None in keywords:
        raise s.refuse(node, "name the arguments one by one")
    _mute_parts(s, node, called)
    values = parts_in_order(s, [*node.args, *(each.value for each in node.keywords)])
    split = len(values) - len(keywords)
    named = dict(zip(keywords, values[split:], strict=True))
    return translate_call(s, node, called, values[:split], named)


def _in_place_of(called) -> str:
    """What to write in place of what no satellite has, whatever its arguments; "" for others."""
    owner = getattr(called, "__self__", None)
    module = getattr(called, "__module__", None) or getattr(owner, "__module__", None) or ""
    if module == "builtins":
        return _OF_PYTHON.get(getattr(called, "__name__", ""), "")
    return _OF_MODULES.get(module, "")


def _mute_parts(s: Scope, node: ast.Call, of) -> None:
    """The parts of a named tuple that nothing reads are not needed."""
    fields = getattr(of, "_fields", ()) if isinstance(of, type) else ()
    if fields and not any(isinstance(each, ast.Starred) for each in node.args):
        named = [*zip(fields, node.args, strict=False),
                 *((each.arg, each.value) for each in node.keywords)]  # fmt: skip
        kept = s.program.kept_fields(of, fields)
        s.noted.muted |= {id(value) for name, value in named if name not in kept}


def translate_call(s: Scope, node, called, values: list[Value], named: dict) -> Value:
    """A call of what is known to be called."""
    if _is_caller(called):
        return _call_by_number(s, node, values)
    if isinstance(called, type) and hasattr(called, "_fields"):
        _, *parts = _bound(s, node, called.__new__, [static(called), *values], named)
        return make_tuple(s, node, parts, called)
    if isinstance(called, Cast):
        return _cast(s, called.kind, values[0])
    if isinstance(called, Failed):
        return _failed(s, node, called)
    if named and not hasattr(plain_function(called), "__code__"):
        raise s.refuse(node, "give the arguments by their places")
    found = _call_numbers(s, node, called, values)
    if found is not None:
        return found
    if not hasattr(plain_function(called), "__code__"):
        name = getattr(called, "__name__", "")
        raise s.refuse(node, _INSTEAD.get(name, "use math, min, max, abs, or a kernel"))
    return call_kernel(s, node, called, _bound(s, node, plain_function(called), values, named))


def _is_caller(called) -> bool:
    """Whether a function calls another by its address (`torquer.compile.engine.caller`)."""
    return getattr(called, "__qualname__", "") == "caller.<locals>.call"


def _bound(s: Scope, node, function, values: list[Value], named: dict) -> list[Value]:
    """Arguments in the order of a function's own, with default values."""
    try:
        signature = inspect.signature(function)
        bound = signature.bind(*values, **named)
    except TypeError as error:
        raise s.refuse(node, f"call it with its arguments ({error})") from None
    if any(p.kind in (p.VAR_POSITIONAL, p.VAR_KEYWORD) for p in signature.parameters.values()):
        raise s.refuse(node, "call a kernel with a fixed number of arguments")
    bound.apply_defaults()
    return [evaluate_outside(s, node, each) for each in bound.arguments.values()]


def _call_by_number(s: Scope, node: ast.Call, values: list[Value]) -> Value:
    """A kernel that is called by its address: here by its number, in a switch."""
    chosen, *rest = values
    function = chosen.type.value if isinstance(chosen.type, Static) else None
    if not isinstance(function, Chosen):
        return call_kernel(s, node, function, rest)
    return call_switch(
        s, node, dict(enumerate(function.functions)), replace(chosen, type=INT), rest
    )


def call_switch(
    s: Scope, node, functions: dict, number: Value, values: list[Value],
    otherwise: Value | None = None,
) -> Value:  # fmt: skip
    """A call of the kernel of a number; see `Program.switch`."""
    made = s.program.switch(functions, [each.type for each in values], s, node, otherwise)
    return _written_call(s, node, made, [number, *values])


def call_kernel(s: Scope, node: ast.AST, function, values: list[Value]) -> Value:
    """A call of another kernel, which is translated for these types of arguments."""
    place = s.program.returned_argument(function)
    if place is not None:
        return values[place]
    replaced = s.program.replaced.get(plain_function(function))
    if replaced is not None:
        return replaced(s, node, values)
    made = s.program.function(function, [each.type for each in values], s, node)
    s.program.note_bounds(made, values)
    return _written_call(s, node, made, values)


def _written_call(s: Scope, node: ast.AST, made, values: list[Value]) -> Value:
    texts, reads = [], False
    given = {name: value for (name, _), value in zip(made.arguments, values, strict=True)}
    for name, value in given.items():
        if name in made.mutable:
            s.mutable |= value.roots
        if name not in made.unused and not isinstance(value.type, Static):
            texts.append(_argument(s, value))
            reads = reads or value.reads or _may_change(value)
    for name, value in given.items():
        if name in made.writes:
            s.writes(value, node)
        if name in made.times:
            s.note_times(value.roots)
        if isinstance(value.type, Array):
            s.note_argument(value, made.reads, name, name in made.writes)
    _check_call(s, node, made, given)
    if made.reports:
        s.report()
        texts.append(FAILURES_NAME)
    s.is_unproved |= made.is_unproved
    text = f"{made.name}({', '.join(texts)})"
    found = Value(text, made.result, form=Form.RESULT, reads=reads)
    if not (made.writes or made.fails):
        return found
    if made.result == NOTHING:
        s.say(f"{text};", effect=True)
        found = replace(found, text="")
    else:
        found = s.kept(found, effect=True)
    if made.fails:
        leave_failed(s)
    return found


def _check_call(s: Scope, node: ast.AST, made, given: dict[str, Value]) -> None:
    """Arguments that a kernel raises to a power, and arrays that it copies to others."""
    for name in made.powers:
        s.note_power(given[name])
        if given[name].is_settled:
            raise s.refuse(node, arithmetic.OF_CONSTANTS)
    for place, origin in made.copies:
        if may_overlap(given[place], given[origin]):
            raise s.refuse(node, "copy between arrays that do not overlap, or in a loop")
        s.note_copy(given[place], given[origin])


def _may_change(value: Value) -> bool:
    return isinstance(value.type, PLACES) and not getattr(value.type, "const", False)


def _argument(s: Scope, value: Value) -> str:
    """How a value is handed over: large tuples and records by their address."""
    if isinstance(value.type, Record):
        return value.address
    if isinstance(value.type, Tuple) and value.type.is_large:
        return at_hand(s, value).address
    return value.content.text


def _cast(s: Scope, kind: Tuple | Record | Array | None, cells: Value) -> Value:
    """Cells of memory as what a block takes; () where it has none."""
    if kind is None:
        return static(())
    assert isinstance(cells.type, Array)
    if isinstance(kind, Array):
        return replace(cells, type=replace(cells.type, shape=kind.shape, kept=None))
    if isinstance(kind, Tuple):  # as it stands in memory
        s.program.keep_whole(kind)
    const = "const " if isinstance(kind, Tuple) else ""
    text = f"({const}{s.program.type_name(kind)} *){cells.within(Rank.ATOM)}"
    return Value(text, kind, Rank.SIGN, Form.ADDRESS, reads=cells.reads, roots=cells.roots)


def _failed(s: Scope, node: ast.Call, failed: Failed) -> Value:
    """Remember which block has failed and where, for it to work again at the next step."""
    s.report()
    s.say(f"{FAILURES_NAME}->line = {FAILURES_NAME}->raised;")
    s.say(f"{FAILURES_NAME}->raised = 0;")
    s.say(f"{FAILURES_NAME}->blocks |= INT64_C({failure_bit(failed.number)});")
    return evaluate_outside(s, node, failed.answer)


def failure_bit(number: int) -> int:
    """The bit of a law or an estimator among those that have failed; the last one is shared."""
    return 1 << min(number, 62)


def _call_numbers(s: Scope, node: ast.Call, called, values: list[Value]) -> Value | None:
    """A function of numbers that C has, or its text has of its own; None for any other."""
    if getattr(called, "__hash__", None) is None:
        return None
    if called in (float, np.float64, int, bool, len, abs, np.abs, min, max, np.sign):
        return _call_python(s, node, called, values)
    if called is math.pow and len(values) == 2:
        return operation(s, node, ast.Pow(), *values)
    name = arithmetic.OF_FLOATS.get(called)
    test, whole = arithmetic.TESTS.get(called), arithmetic.TO_WHOLE.get(called)
    if not (name or test or whole):
        return None
    if not all(isinstance(each.type, Number) for each in values):
        raise s.refuse(node, "call it with numbers")
    if len(values) != (2 if name in arithmetic.OF_TWO else 1):
        raise s.refuse(node, "call it with one number, or write a quotient of two logarithms")
    if called in arithmetic.ROUNDING and values[0].type not in (REAL, TIME):
        raise s.refuse(node, "leave it out: the number is whole")
    if name and all(each.is_known for each in values):  # a compiler would round it its own way
        return _known_answer(s, node, called, values)
    floats = [as_float(arithmetic.as_whole(each)) for each in values]
    if name:
        return arithmetic.call_library(name, floats)
    if test:
        found = arithmetic.call_function(test, floats, BOOL)
        return replace(found, text=f"{found.text} != 0", rank=Rank.EQUAL)
    found = arithmetic.nearest_whole(whole or "", floats[0])
    return arithmetic.to_whole(found, s.program.helpers)


def _known_answer(s: Scope, node: ast.Call, called, values: list[Value]) -> Value:
    try:
        with s.refusing(node):
            return constant(float(called(*(each.known for each in values))))
    except (ArithmeticError, ValueError):
        raise s.refuse(node, "call it where it is defined") from None


def _call_python(s: Scope, node: ast.Call, called, values: list[Value]) -> Value:
    first = values[0] if values else static(None)
    if called is len and len(values) == 1:
        return _length(s, node, first)
    if not values or not all(isinstance(each.type, Number) for each in values):
        raise s.refuse(node, "call it with numbers, not with a tuple of them")
    if called in (min, max):
        return _least_or_greatest(s, node, called.__name__, values)
    if len(values) != 1:
        raise s.refuse(node, "call it with one number")
    if called is bool:
        return arithmetic.truth(first)
    if called in (float, np.float64):
        return as_float(arithmetic.as_whole(first))
    if called is int:
        return _whole(s, node, first)
    return _magnitude_or_sign(s, node, called, arithmetic.as_whole(first))


def _magnitude_or_sign(s: Scope, node: ast.Call, called, value: Value) -> Value:
    if called is np.sign:
        if value.type == INT:
            raise s.refuse(node, "write np.sign(float(...)), or (n > 0) - (n < 0)")
        return as_real(arithmetic.help_out("sign_of", [value], s.program.helpers))
    if value.type == INT:
        s.program.helpers.add("abs_int")
        low, high = value.bounds
        most = max(abs(low), abs(high))  # of the least whole number there is no magnitude
        bounds = (0, most) if most < 2**63 else UNBOUNDED
        return replace(arithmetic.call_function("abs_int", [value], INT), bounds=bounds)
    return arithmetic.call_library("fabs", [value])


def _whole(s: Scope, node: ast.Call, value: Value) -> Value:
    if value.is_known:
        try:
            with s.refusing(node):
                return constant(int(value.known))
        except (OverflowError, ValueError):
            raise s.refuse(node, "make a finite number whole") from None
    if value.type in (REAL, TIME):
        return arithmetic.to_whole(value, s.program.helpers)
    return arithmetic.as_whole(value)


def _length(s: Scope, node: ast.Call, value: Value) -> Value:
    if isinstance(value.type, Tuple):
        return constant(len(value.type.parts))
    if isinstance(value.type, Array) and value.type.shape[0] is not None:
        return constant(value.type.shape[0])
    if isinstance(value.type, Rows):
        return constant(value.type.count)
    if isinstance(value.type, Static) and isinstance(value.type.value, tuple):
        return constant(len(value.type.value))
    raise s.refuse(node, "take the length of a tuple or an array")


def _least_or_greatest(s: Scope, node: ast.Call, name: str, values: list[Value]) -> Value:
    """The least or greatest number, the first of equal ones."""
    values = [arithmetic.as_whole(each) for each in values]
    whole = {each.type == INT for each in values}
    if len(values) < 2 or len(whole) != 1:
        raise s.refuse(node, "give it at least two numbers of one type: write 0.0 for 0")
    found = values[0]
    for each in values[1:]:
        if found.type == INT:
            s.program.helpers.add(f"{name}_of_int")
            made = arithmetic.call_function(f"{name}_of_int", [found, each], INT)
            of = min if name == "min" else max
            (a0, a1), (b0, b1) = found.bounds, each.bounds
            found = replace(made, bounds=(of(a0, b0), of(a1, b1)))
        else:
            found = arithmetic.help_out(f"{name}_of", [found, each], s.program.helpers)
    return found
