"""Expressions of kernels as typed C: names, tuples, arithmetic, truths, choices."""

import ast
from collections.abc import Callable

from torquer.flight.c99 import arithmetic
from torquer.flight.c99.evaluate import (
    apart,
    evaluate,
    evaluate_outside,
    evaluate_truth,
    in_order,
    make_tuple,
    operation,
    parts_in_order,
    split_tuple,
    translates,
)
from torquer.flight.c99.guards import negative
from torquer.flight.c99.scope import Scope
from torquer.flight.c99.times import common_type, convert
from torquer.flight.c99.types import (
    BOOL,
    INT,
    PLACES,
    REAL,
    TIME,
    Number,
    Record,
    Static,
    Tuple,
    Type,
    in_words,
)
from torquer.flight.c99.values import Form, Rank, Value, constant, static


@translates(ast.Constant)
def _constant(s: Scope, node: ast.Constant) -> Value:
    if isinstance(node.value, bool | int | float):
        with s.refusing(node):
            return constant(node.value)
    if node.value is None:
        return static(None)
    raise s.refuse(node, "write numbers")


@translates(ast.Name)
def _name(s: Scope, node: ast.Name) -> Value:
    if node.id in s.variables:
        s.used.add(node.id)
        return s.variable_value(s.variables[node.id])
    if node.id in s.source.own:
        raise s.refuse(node, "set it before it is read")
    if node.id not in s.source.outside:
        raise s.refuse(node, "define it before the kernel is exported")
    return evaluate_outside(s, node, s.source.outside[node.id], node.id)


@translates(ast.Tuple)
def _tuple(s: Scope, node: ast.Tuple) -> Value:
    return make_tuple(s, node, parts_in_order(s, node.elts))


@translates(ast.BinOp)
def _binary(s: Scope, node: ast.BinOp) -> Value:
    a, b = in_order(s, [node.left, node.right])
    return operation(s, node, node.op, a, b)


@translates(ast.UnaryOp)
def _unary(s: Scope, node: ast.UnaryOp) -> Value:
    value = evaluate(s, node.operand)
    with s.refusing(node):
        if isinstance(node.op, ast.Not):
            return arithmetic.inverse(value)
        if isinstance(node.op, ast.UAdd | ast.USub) and isinstance(value.type, Number):
            whole = arithmetic.as_whole(value)
            if isinstance(node.op, ast.UAdd):
                return whole
            return negative(s, whole, arithmetic.negative(value))
    raise s.refuse(node, "write arithmetic of numbers")


@translates(ast.BoolOp)
def _bool(s: Scope, node: ast.BoolOp) -> Value:
    is_and = isinstance(node.op, ast.And)
    found = constant(is_and)
    for each in node.values:
        found = join_truths(s, found, each, is_and, evaluate)
        if found.type != BOOL:
            raise s.refuse(node, "write truths: `x != 0` for a number, an `if` to choose a value")
    return found


def join_truths(s: Scope, first: Value, node, is_and: bool, evaluate: Callable) -> Value:
    """The first truth, and where that matters the second, which may have to do something."""
    if first.is_known and bool(first.known) != is_and:
        return first
    if first.is_known:
        return evaluate(s, node)
    with s.captured(1) as block:
        second = evaluate(s, node)
    if not block or second.type != BOOL:
        s.add(block)
        return arithmetic.both(first, second, is_and) if second.type == BOOL else second
    held = s.kept(first, changes=True)
    with s.braces(f"if ({held.text if is_and else f'!{held.text}'})"):
        s.add(block)
        s.say(f"{held.text} = {second.text};")
    return held


@translates(ast.Compare)
def _compare(s: Scope, node: ast.Compare) -> Value:
    if len(node.ops) == 1 and isinstance(node.ops[0], ast.In | ast.NotIn):
        return _among(s, node)
    if len(node.ops) == 1 and isinstance(node.ops[0], ast.Is | ast.IsNot):
        return _same(s, node)
    a, b = in_order(s, [node.left, node.comparators[0]])
    if len(node.ops) > 1 and not b.is_simple:
        b = s.kept(b)
    return _chain(s, node, 0, a, b)


def _chain(s: Scope, node: ast.Compare, k: int, a: Value, b: Value) -> Value:
    """The comparisons from one on; each is made only where those before it hold."""
    found = _pair(s, node, node.ops[k], a, b)
    if k + 1 == len(node.ops):
        return found

    def rest(s, each):
        right, is_last = evaluate(s, each), k + 2 == len(node.ops)
        right = right if right.is_simple or is_last else s.kept(right)
        return _chain(s, node, k + 1, b, right)

    return join_truths(s, found, node.comparators[k + 1], True, rest)


def _pair(s: Scope, node: ast.Compare, op: ast.cmpop, a: Value, b: Value) -> Value:
    with s.refusing(node):
        return arithmetic.compare(op, a, b)


def _same(s: Scope, node: ast.Compare) -> Value:
    a, b = in_order(s, [node.left, node.comparators[0]])
    if not (isinstance(a.type, Static) or isinstance(b.type, Static)):
        raise s.refuse(node, "write == for numbers")
    return constant((a.type == b.type) == isinstance(node.ops[0], ast.Is))


def _among(s: Scope, node: ast.Compare) -> Value:
    """Whether a number is one of a tuple's."""
    a, b = in_order(s, [node.left, node.comparators[0]])
    if not isinstance(b.type, Tuple) or not isinstance(a.type, Number):
        raise s.refuse(node, "write `in` a tuple of numbers")
    names = {n.id for n in ast.walk(node.comparators[0]) if isinstance(n, ast.Name)}
    if a.type in (REAL, TIME) and names & s.source.own:
        raise s.refuse(node, "write == for each number: `in` takes a NaN for the same NaN")
    a = a if a.is_simple else s.kept(a)
    found = constant(False)
    for each in split_tuple(s, node, b):
        same = _pair(s, node, ast.Eq(), a, each)
        found = arithmetic.both(found, same, False)
    with s.refusing(node):
        return arithmetic.inverse(found) if isinstance(node.ops[0], ast.NotIn) else found


@translates(ast.IfExp)
def _choice(s: Scope, node: ast.IfExp) -> Value:
    test = evaluate_truth(s, node.test)
    if test.is_known:
        return evaluate(s, node.body if test.known else node.orelse)
    (first, a), (second, b) = apart(s, node.body, 1), apart(s, node.orelse, 1)
    kind = common_type(a.type, b.type)
    if kind is None or isinstance(kind, Static):
        kinds = {a.type, b.type}
        hint = "write 0.0 for 0, or float(...)" if kinds == {REAL, INT} else "choose alike values"
        raise s.refuse(node, f"{hint} (here: {in_words(a.type)} or {in_words(b.type)})")
    if isinstance(a.type, PLACES) and not isinstance(a.type, Record):
        raise s.refuse(node, "write an `if` for each of them")
    if first or second:
        return _chosen_by_statements(s, test, (first, a), (second, b), kind)
    return _choose(test, convert(s, a, kind), convert(s, b, kind))


def _choose(test: Value, a: Value, b: Value) -> Value:
    if isinstance(a.type, Record):
        texts, form = (a.address, b.address), Form.ADDRESS
    else:
        texts = (a.content.within(Rank.OR), b.content.within(Rank.CHOICE))
        form = Form.RESULT
    text = f"{test.within(Rank.EQUAL)} ? {texts[0]} : {texts[1]}"
    bounds = arithmetic.either(a.bounds, b.bounds)
    reads = test.reads or a.reads or b.reads
    return Value(text, a.type, Rank.CHOICE, form, reads, a.roots | b.roots, bounds)


def _chosen_by_statements(s: Scope, test: Value, first: tuple, second: tuple, kind: Type) -> Value:
    """A choice of which a branch has something to do before."""
    held = s.unset(kind, first[1], second[1])
    for (block, value), head in ((first, f"if ({test.text}) {{"), (second, "} else {")):
        s.say(head)
        s.add(block)
        s.depth += 1
        value = convert(s, value, kind)
        text = value.address if isinstance(value.type, Record) else value.content.text
        s.say(f"{held.text} = {text};")
        s.depth -= 1
    s.say("}")
    return held
