"""Statements of kernels as C: assignments, choices, loops, returns."""

import ast
import functools
from collections.abc import Callable

from torquer.flight.c99 import arithmetic
from torquer.flight.c99.evaluate import (
    apart,
    evaluate,
    evaluate_truth,
    in_order,
    operation,
    parts_in_order,
    split_tuple,
)
from torquer.flight.c99.lines import Line
from torquer.flight.c99.places import fill, fill_all
from torquer.flight.c99.refusal import quote_source
from torquer.flight.c99.scope import Scope, Variable
from torquer.flight.c99.times import common_type, convert
from torquer.flight.c99.types import INT, NOTHING, REAL, TIME, Array, Bounds, Number, Static, Tuple
from torquer.flight.c99.values import Rank, Value, constant, select_cell

_INSTEAD = {
    ast.Assert: "leave it out: check when parameters are made",
    ast.Raise: "return numbers that are not: math.nan",
    ast.With: "leave it out: nothing is opened on board",
    ast.FunctionDef: "define it outside the kernel",
    ast.Import: "import it outside the kernel",
    ast.ImportFrom: "import it outside the kernel",
    ast.Global: "keep it in the memory",
    ast.Nonlocal: "keep it in the memory",
    ast.Delete: "leave it out",
    ast.Match: "write if and elif",
}


def block(s: Scope, statements: list[ast.stmt]) -> bool:
    """Statements one after another; whether they always leave the block by a jump."""
    for each in statements:
        handler = _HANDLERS.get(type(each))
        if handler is None:
            raise s.refuse(each, _INSTEAD.get(type(each), "write assignments, ifs and loops"))
        if handler(s, each):
            return True
    return False


def _assign(s: Scope, node: ast.Assign) -> None:
    if len(node.targets) == 1:
        _mute_unread(s, node.targets[0], node.value)
    if len(node.targets) == 1 and isinstance(node.targets[0], ast.Tuple):
        _unpack(s, node, node.targets[0], node.value)
        return
    value = evaluate(s, node.value)
    if len(node.targets) > 1 and not value.is_known:
        value = s.kept(value)
    for target in node.targets:
        if isinstance(target, ast.Tuple):
            _spread(s, node, target, split_tuple(s, node.value, value))
        else:
            store(s, node, target, value)


def _mute_unread(s: Scope, target: ast.expr, value: ast.expr) -> None:
    """What is stored where nothing reads it is not needed."""
    if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
        for each, part in zip(target.elts, value.elts, strict=False):
            _mute_unread(s, each, part)
    elif all(map(functools.partial(_is_unread, s), getattr(target, "elts", [target]))):
        s.noted.muted.add(id(value))


def _is_unread(s: Scope, target: ast.expr) -> bool:
    """Whether nothing reads the memory that a target is in."""
    if not isinstance(target, ast.Attribute | ast.Subscript) or s.program.live is None:
        return False
    while isinstance(target, ast.Subscript) and not isinstance(target.slice, ast.Constant):
        target = target.value
    with s.noted.apart(), s.captured():
        return s.is_dead(evaluate(s, target))


def _unpack(s: Scope, node: ast.Assign, target: ast.Tuple, source: ast.expr) -> None:
    """Parts to targets; all parts are found before the first target is set."""
    if isinstance(source, ast.Tuple):
        values = parts_in_order(s, source.elts)
        if len(target.elts) > 1:
            values = [_safe(s, target, source, k, value) for k, value in enumerate(values)]
    else:
        values = split_tuple(s, source, _hold_tuple(s, target, evaluate(s, source)))
    _spread(s, node, target, values)


def _hold_tuple(s: Scope, target: ast.Tuple, value: Value) -> Value:
    """A tuple that the targets do not change while it is read."""
    changed = value.text in _names(target) or value.reads
    return s.kept(value) if changed and not isinstance(value.type, Static) else value


def _names(node: ast.AST) -> set[str]:
    return {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}


def _safe(s: Scope, target: ast.Tuple, source: ast.Tuple, k: int, value: Value) -> Value:
    """A part that targets before it do not change: else it is kept."""
    if k == 0 or value.is_known or isinstance(value.type, Static):
        return value
    plain = len(source.elts) == len(target.elts)
    before = target.elts[:k]
    stored = {n for each in before for n in _names(each)}
    in_memory = any(not isinstance(each, ast.Name) for each in before)
    read = _names(source.elts[k]) if plain else _names(source)
    return s.kept(value) if (stored & read) or (in_memory and value.reads) else value


def _spread(s: Scope, node: ast.stmt, target: ast.Tuple, values: list[Value]) -> None:
    if len(target.elts) != len(values):
        raise s.refuse(node, f"use as many names as there are parts ({len(values)})")
    for each, value in zip(target.elts, values, strict=True):
        if isinstance(each, ast.Tuple):
            _spread(s, node, each, split_tuple(s, node, value))
        elif isinstance(each, ast.Starred):
            raise s.refuse(node, "name every part")
        else:
            store(s, node, each, value)


def store(s: Scope, node: ast.stmt, target: ast.expr, value: Value) -> None:
    """Set a variable or a place in memory."""
    if value.type == NOTHING or (isinstance(value.type, Static) and callable(value.type.value)):
        raise s.refuse(node, "assign numbers, tuples, records or arrays")
    if isinstance(target, ast.Name):
        s.set(node, target.id, value, node)
        return
    if not isinstance(target, ast.Attribute | ast.Subscript):
        raise s.refuse(node, "assign to a name, a field or a cell")
    if _is_unread(s, target) or (isinstance(target, ast.Subscript) and fill(s, target, value)):
        return
    s.target = target
    place_block, place = apart(s, target)
    s.target = None
    if place_block.effects and value.reads:
        value = s.kept(value)
    s.add(place_block)
    _write(s, node, target, place, value)


def _write(s: Scope, node: ast.stmt, target: ast.expr, place: Value, value: Value) -> None:
    """A number into memory."""
    assert isinstance(target, ast.Attribute | ast.Subscript)
    if isinstance(place.type, Array):
        fill_all(s, target, place, value)
        return
    if place.type not in (REAL, TIME, INT) or place.is_known:
        raise s.refuse(node, "assign a number to a field or a cell of memory")
    if place.type != INT and isinstance(value.type, Number):
        is_real = place.type == REAL and not place.stored
        value = s.stored(arithmetic.as_whole(value), is_real, place.roots)
    elif place.type != value.type:
        raise s.refuse(node, "assign a number of the field's type")
    if not place.roots:
        raise s.refuse(node, "assign to memory: tuples and constants do not change")
    s.written |= place.roots
    s.say(f"{place.stored or place.text} = {value.text};", effect=True)


def _augment(s: Scope, node: ast.AugAssign) -> None:
    """`a += b`: the place is found once, and read before b is evaluated."""
    place = evaluate(s, node.target)
    after, value = apart(s, node.value)
    if after.effects and isinstance(node.target, ast.Subscript) and place.type != INT:
        place = _cell_kept(s, place)
    before = s.kept(place) if after.effects and place.reads else place
    s.add(after)
    made = operation(s, node, node.op, before, value)
    if isinstance(node.target, ast.Name):
        s.set(node, node.target.id, made, None)
    else:
        _write(s, node, node.target, place, made)


def _cell_kept(s: Scope, place: Value) -> Value:
    """The cell that a place is now, whatever happens to its index."""
    assert isinstance(place.type, Number)
    cells = Array((1,), of=place.type, is_real=not place.stored and place.type == REAL)
    address = f"&{place.stored or place.text}"
    held = s.kept(Value(address, cells, Rank.SIGN, reads=True, roots=place.roots))
    return select_cell(held, [constant(0)], ["0"])


def _annotate(s: Scope, node: ast.AnnAssign) -> None:
    if node.value is None:
        raise s.refuse(node, "give it a value")
    store(s, node, node.target, evaluate(s, node.value))


def _return(s: Scope, node: ast.Return) -> bool:
    if node.value is None or (isinstance(node.value, ast.Constant) and node.value.value is None):
        s.returns(node, NOTHING)
        s.say("return;")
        return True
    value = evaluate(s, node.value)
    value = convert(s, value, s.known_kind("return", value.type))
    s.returns(node, value.type)
    s.say("return;" if value.type == NOTHING else f"return {value.content.text};")
    return True


def _try(s: Scope, node: ast.Try) -> bool:
    """What fails within answers as the one handler says; the package's own adapters alone do so."""
    if s.checks or len(node.handlers) != 1 or node.orelse or node.finalbody:
        raise s.refuse(node, "leave it out")

    def handle() -> None:
        s.handled = None
        block(s, node.handlers[0].body)
        s.handled = handle

    s.handled = handle
    ended = block(s, node.body)
    s.handled = None
    return ended


def _if(s: Scope, node: ast.If) -> bool:
    test_block, test = apart(s, node.test)
    with s.refusing(node.test):
        test = arithmetic.truth(test)
    s.add(test_block)
    if test.is_known:
        return block(s, node.body if test.known else node.orelse)
    s.say(f"if ({test.text}) {{")
    ended = _deeper(s, node.body)
    return _otherwise(s, node.orelse) and ended


def _otherwise(s: Scope, statements: list[ast.stmt]) -> bool:
    """The other branch; one `if` alone goes on in the same line."""
    if not statements:
        s.say("}")
        return False
    with s.captured() as rest:
        ended = block(s, statements)
    if not rest:
        s.say("}")
        return False
    lines, alone = rest.lines, len(statements) == 1 and isinstance(statements[0], ast.If)
    if alone and lines and lines[0].text.startswith("if (") and _is_one(lines, s.depth):
        s.block.lines.append(Line(s.depth, f"}} else {lines[0].text}"))
        s.block.lines += lines[1:]
        _end_chain(s, lines)
    else:
        s.say("} else {")
        for each in lines:
            each.depth += 1
        s.block.lines += lines
        s.say("}")
    s.block.effects |= rest.effects
    return ended


def _end_chain(s: Scope, lines: list[Line]) -> None:
    """A last, empty `else` after `else if`, if there is none (MISRA C:2012, rule 15.7)."""
    if any(each.depth == s.depth and each.text.startswith("} else {") for each in lines):
        return
    end = s.block.lines.pop()
    s.say("} else {")
    s.block.lines += [Line(s.depth + 1, "/* nothing else */"), end]


def _is_one(lines: list[Line], depth: int) -> bool:
    """Whether lines are one `if` with its branches and nothing else."""
    return (
        all(each.depth > depth or each.text.startswith(("if (", "}")) for each in lines)
        and sum(each.depth == depth and each.text.startswith("if (") for each in lines) == 1
    )


def _deeper(s: Scope, statements: list[ast.stmt]) -> bool:
    s.depth += 1
    ended = block(s, statements)
    s.depth -= 1
    return ended


def _while(s: Scope, node: ast.While) -> bool:
    if node.orelse:
        raise s.refuse(node, "leave out the else of the loop", "a loop with else")
    with s.captured(1) as before:
        test = evaluate_truth(s, node.test)
    if test.is_known and not test.known:
        return False
    if not s.is_own:  # those of the package end
        s.program.loops[s.source.file, node.lineno, quote_source(node.test)] = None
    if before:
        s.say("while (true) {")
        s.add(before)
        s.depth += 1
        with s.braces(f"if (!{test.within(Rank.ATOM)})"):
            s.say("break;")
        s.depth -= 1
    else:
        s.say(f"while ({test.text}) {{")
    _deeper(s, node.body)
    s.say("}")
    return test.is_known and not any(map(_has_break, node.body))


def _has_break(node: ast.AST) -> bool:
    """Whether a statement leaves the loop in which it stands."""
    inner = [] if isinstance(node, ast.For | ast.While) else ast.iter_child_nodes(node)
    return isinstance(node, ast.Break) or any(map(_has_break, inner))


def _for(s: Scope, node: ast.For) -> None:
    if node.orelse:
        raise s.refuse(node, "leave out the else of the loop", "a loop with else")
    if isinstance(node.iter, ast.Call) and isinstance(node.iter.func, ast.Name):
        function = evaluate(s, node.iter.func)
        if isinstance(function.type, Static) and function.type.value is range:
            _over_range(s, node, node.iter)
            return
    _over_tuple(s, node, evaluate(s, node.iter))


def _range(s: Scope, node: ast.For, call: ast.Call) -> tuple[Value, Value, int]:
    """First number, the one not reached, step; the first two do not change within the loop."""
    if call.keywords or not 1 <= len(call.args) <= 3:
        raise s.refuse(call, "use range with one to three numbers")
    values = in_order(s, call.args)
    if any(each.type != INT for each in values):
        raise s.refuse(call, "use range of whole numbers")
    low, high = (constant(0), values[0]) if len(values) == 1 else values[:2]
    step = values[2] if len(values) == 3 else constant(1)
    if not step.is_known or step.known == 0:
        raise s.refuse(call, "use a constant step that is not 0")
    changed = {n.id for each in node.body for n in ast.walk(each) if isinstance(n, ast.Name)
               and isinstance(n.ctx, ast.Store)}  # fmt: skip
    changed |= _names(node.target)
    if not high.is_known and (high.reads or _names(call) & changed):
        high = s.kept(high)
    return low, high, step.known


def _over_range(s: Scope, node: ast.For, call: ast.Call) -> None:
    low, high, step = _range(s, node, call)
    if _never_runs(low, high, step):
        return
    if not isinstance(node.target, ast.Name):
        raise s.refuse(node, "count with one variable")
    own = s.source.is_loop_only(node) and node.target.id not in s.arguments
    name = s.c_name(node.target.id) if own else s.new_name("k")
    sign, by = ("<", "+=") if step > 0 else (">", "-=")
    further = f"{name}{by[0] * 2}" if abs(step) == 1 else f"{name} {by} {abs(step)}"
    counter = Value(name, INT, bounds=_count_range(low, high, step))
    if s.checks and abs(step) > 1 and not _is_far_from_end(high, step):
        helper = "next_up" if step > 0 else "next_down"
        s.program.helpers.add(helper)
        further = f"{name} = {helper}({name}, {abs(step)}, {high.text})"
    head = f"for (int64_t {name} = {low.text}; {name} {sign} {high.within(Rank.SUM)}; {further})"
    with s.braces(head):
        if own:  # C declares it with the loop
            s.variables[node.target.id] = Variable(name, INT, bounds=counter.bounds)
        else:
            s.set(node, node.target.id, counter, None)
        block(s, node.body)


def _is_far_from_end(high: Value, step: int) -> bool:
    """Whether a counter stays within 64 bits when it goes past its end by a step."""
    past = (high.bounds[1] if step > 0 else high.bounds[0]) + step
    return -(2**63) <= past < 2**63


def _never_runs(low: Value, high: Value, step: int) -> bool:
    """Whether no number is counted, whatever the bounds allow: the rows of an empty table."""
    if step > 0:
        return low.bounds[0] >= high.bounds[1]
    return low.bounds[1] <= high.bounds[0]


def _count_range(low: Value, high: Value, step: int) -> Bounds:
    """Least and greatest number that a loop counts."""
    if step > 0:
        return low.bounds[0], high.bounds[1] - 1
    return high.bounds[0] + 1, low.bounds[1]


def _over_tuple(s: Scope, node: ast.For, value: Value) -> None:
    """A loop over the parts of a tuple, which are of one type."""
    parts = split_tuple(s, node.iter, value)
    if not parts:
        return
    kind = common_type(*(each.type for each in parts))
    if not isinstance(kind, Number | Tuple):
        raise s.refuse(node, "loop over range, or over a tuple of parts of one type")
    parts = [convert(s, each, kind) for each in parts]
    held, name = s.listed(parts), s.new_name("k")
    item = Value(f"{held}[{name}]", parts[0].type)
    with s.braces(f"for (int64_t {name} = 0; {name} < {len(parts)}; {name}++)"):
        if isinstance(node.target, ast.Tuple):
            _spread(s, node, node.target, split_tuple(s, node, item))
        else:
            store(s, node, node.target, item)
        block(s, node.body)


def _expression(s: Scope, node: ast.Expr) -> None:
    """A call for what it changes; a text for the reader is left out."""
    if isinstance(node.value, ast.Constant):
        return
    if not isinstance(node.value, ast.Call | ast.Yield | ast.YieldFrom | ast.Await):
        raise s.refuse(node, "leave it out: it does nothing")
    evaluate(s, node.value)


def _jump(s: Scope, node: ast.stmt) -> bool:
    s.say("break;" if isinstance(node, ast.Break) else "continue;")
    return True


_HANDLERS: dict[type, Callable] = {
    ast.Assign: _assign,
    ast.AugAssign: _augment,
    ast.AnnAssign: _annotate,
    ast.Return: _return,
    ast.Try: _try,
    ast.If: _if,
    ast.While: _while,
    ast.For: _for,
    ast.Expr: _expression,
    ast.Break: _jump,
    ast.Continue: _jump,
    ast.Pass: lambda s, node: None,
}
