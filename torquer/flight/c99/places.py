"""Parts of tuples, fields of records, cells of arrays: `a.b` and `a[b]`."""

import ast
import math
from dataclasses import replace
from enum import EnumType
from types import ModuleType

from torquer.flight.c99.evaluate import (
    at_hand,
    evaluate,
    evaluate_outside,
    in_order,
    make_tuple,
    translates,
)
from torquer.flight.c99.guards import check_index
from torquer.flight.c99.precision import is_single
from torquer.flight.c99.scope import Scope
from torquer.flight.c99.types import (
    INT,
    REAL,
    TIME,
    Array,
    Number,
    Record,
    Rows,
    Static,
    Tuple,
    in_words,
)
from torquer.flight.c99.values import (
    Rank,
    Value,
    constant,
    select_cell,
    select_field,
    select_part,
    select_row,
    static,
)


@translates(ast.Attribute)
def attribute(s: Scope, node: ast.Attribute) -> Value:
    """A field of a record or tuple, the shape of an array, or a name of a module."""
    value = evaluate(s, node.value)
    kind, name = value.type, node.attr
    if isinstance(kind, Static):
        if isinstance(kind.value, ModuleType | EnumType) and hasattr(kind.value, name):
            return evaluate_outside(s, node, getattr(kind.value, name), name)
        raise s.refuse(node, "use a name that the module has, or a constant of its own")
    if isinstance(kind, Tuple) and kind.fields and name in kind.fields:
        s.noted.reads.parts.add((kind.of, name))
        return select_part(at_hand(s, value), kind.fields.index(name))
    if isinstance(kind, Record) and name in dict(kind.fields):
        return _field(s, node, value, name)
    if name == "shape" and isinstance(kind, Array | Rows):
        shape = kind.shape if isinstance(kind, Array) else (kind.count,)
        return static(tuple(shape))
    raise s.refuse(node, f"use a field that {in_words(kind)} has")


def _field(s: Scope, node: ast.AST, record: Value, name: str) -> Value:
    """A field of a record; a number in it is read unless it is set."""
    assert isinstance(record.type, Record)
    found = select_field(record, name, s.program.times)
    if isinstance(found.type, Number):
        s.note_field(node, found)
    if isinstance(found.type, Array):
        kept = s.program.kept_shape(record.type, name)
        return replace(found, type=replace(found.type, kept=kept))
    return found


@translates(ast.Subscript)
def subscript(s: Scope, node: ast.Subscript) -> Value:
    """A part of a tuple, a cell or a row of an array, a field of a record by its name."""
    name = _text(node.slice)
    if name is not None:
        value = evaluate(s, node.value)
        if isinstance(value.type, Record) and name in dict(value.type.fields):
            return _field(s, node, value, name)
        raise s.refuse(node, "use a field that the record has")
    if isinstance(node.slice, ast.Slice):
        return _slice(s, node, node.slice)
    indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
    if any(isinstance(each, ast.Slice) for each in indices):
        raise s.refuse(node, "write a loop over the cells")
    value, *places = in_order(s, [node.value, *indices])
    _check_whole(s, node, places)
    return index(s, node, value, places)


def _check_whole(s: Scope, node: ast.AST, indices: list[Value]) -> None:
    if any(each.type != INT for each in indices):
        raise s.refuse(node, "use whole numbers as indices: int(...)")


def _text(node: ast.expr) -> str | None:
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else None


def index(s: Scope, node: ast.AST, value: Value, indices: list[Value]) -> Value:
    """What stands at these places."""
    kind = value.type
    if isinstance(kind, Array) and len(indices) <= len(kind.shape):
        texts = [_index(s, node, i, n) for i, n in zip(indices, kind.shape, strict=False)]
        for k, each in enumerate(indices):
            s.note_cells(replace(value, type=replace(kind, shape=kind.shape[k:])), *each.bounds)
        if len(indices) == len(kind.shape):
            s.note_field(node, value)
        return select_cell(value, indices, texts)
    if len(indices) != 1:
        raise s.refuse(node, "use as many indices as there are dimensions")
    index = indices[0]
    if isinstance(kind, Rows):
        return select_row(value, index, _index(s, node, index, kind.count))
    if isinstance(kind, Tuple):
        return _part(s, node, at_hand(s, value), index)
    if isinstance(kind, Static) and isinstance(kind.value, tuple):
        return _choose_static(s, node, kind.value, index)
    raise s.refuse(node, f"use an index where {in_words(kind)} is a tuple or an array")


def _choose_static(s: Scope, node: ast.AST, values: tuple, index: Value) -> Value:
    """One of several functions: chosen now, or a switch when its number is known."""
    if index.is_known:
        if not -len(values) <= index.known < len(values):
            raise s.refuse(node, "use an index that the tuple has")
        return evaluate_outside(s, node, values[index.known])  # type: ignore[arg-type]
    if not values or not all(map(callable, values)):
        raise s.refuse(node, "use a constant index")
    return replace(index, type=Static(Chosen(values)), known=None)


class Chosen:
    """Functions of which one is called, by a number that is known in flight only."""

    def __init__(self, functions: tuple):
        self.functions = functions


def _part(s: Scope, node: ast.AST, value: Value, index: Value) -> Value:
    kind = value.type
    assert isinstance(kind, Tuple)
    count = len(kind.parts)
    if index.is_known:
        if not -count <= index.known < count:
            raise s.refuse(node, f"use an index that {in_words(kind)} has")
        s.noted.reads.parts |= {(kind.of, each) for each in kind.fields or ()}
        return select_part(value, index.known % count)
    if not kind.is_array:
        raise s.refuse(node, "use a constant index, or a tuple of parts of one type")
    text = value.member(f".v[{_index(s, node, index, count)}]")
    return Value(text, kind.parts[0], reads=value.reads or index.reads)


def _index(s: Scope, node: ast.AST, index: Value, count: int | None) -> str:
    """An index in C: negative ones count from the end."""
    if s.checks and not index.is_known:
        if count is None:
            raise s.refuse(node, "use an array whose length is known")
        index = check_index(s, node, index, count)
    low, high = index.bounds
    s.is_unproved |= not s.checks and not (count is not None and -count <= low <= high < count)
    if index.is_known and count is not None:
        if not -count <= index.known < count:
            raise s.refuse(node, f"use an index from 0 to {count - 1}")
        return str(index.known % count)
    if count is not None and count <= low <= high < math.inf:
        raise s.refuse(node, f"use an index from 0 to {count - 1}")
    if low >= 0 and (s.checks or count is None or high < count):
        return index.text
    if count is None:
        raise s.refuse(node, "use an index that is not negative")
    s.program.helpers.add("place_of")
    return f"place_of({index.text}, {count})"


def _slice(s: Scope, node: ast.Subscript, cut: ast.Slice) -> Value:
    """Some parts of a tuple, or cells of an array from a place on."""
    if cut.step is not None:
        raise s.refuse(node, "write a loop over the cells")
    value, *edges = in_order(s, [node.value, *(e for e in (cut.lower, cut.upper) if e)])
    _check_whole(s, node, edges)
    low = edges[0] if cut.lower else constant(0)
    high = edges[-1] if cut.upper else None
    kind = value.type
    if isinstance(kind, Tuple) and all(each.is_known for each in edges):
        held, count = at_hand(s, value), len(kind.parts)
        chosen = range(count)[low.known : high.known if high else None]
        s.noted.reads.parts |= {(kind.of, each) for each in kind.fields or ()}
        return make_tuple(s, node, [select_part(held, place) for place in chosen])
    if not isinstance(kind, Array) or len(kind.shape) != 1:
        raise s.refuse(node, "cut a tuple at constants, or an array of one dimension")
    if low.bounds[0] < 0 or (high and high.bounds[0] < 0):
        raise s.refuse(node, "cut at places that are not negative")
    known = low.is_known and kind.shape[0] is not None
    known = known and (high.is_known if high is not None else s.checks)
    if s.checks and not known:
        raise s.refuse(node, "cut an array at constants")
    end = high.known if high is not None else None
    length = len(range(kind.shape[0])[low.known : end]) if known else None  # type: ignore
    reads = value.reads or low.reads
    text = f"&{value.within(Rank.ATOM)}[{low.text}]"
    s.note_all(value)
    cells = replace(kind, shape=(length,), kept=None)
    return Value(text, cells, Rank.SIGN, reads=reads, roots=value.roots)


def fill(s: Scope, target: ast.Subscript, value: Value) -> bool:
    """Set many cells to one number, `a[:, 0] = x`; whether the target is of this kind."""
    cuts = target.slice.elts if isinstance(target.slice, ast.Tuple) else [target.slice]
    if not any(isinstance(each, ast.Slice) for each in cuts):
        return False
    array = evaluate(s, target.value)
    if not isinstance(array.type, Array) or len(cuts) > len(array.type.shape):
        raise s.refuse(target, "write a loop over the cells")
    if isinstance(value.type, Array) and all(map(_is_all, cuts)):
        fill_all(s, target, array, value)
        return True
    if value.type not in (REAL, TIME):
        raise s.refuse(target, "set cells to one float, or write a loop")
    rest = [ast.Slice()] * (len(array.type.shape) - len(cuts))
    s.writes(array, target)
    s.note_all(array)
    _in_loops(s, target, [*cuts, *rest], array, value)
    return True


def _is_all(cut: ast.expr) -> bool:
    """Whether an index stands for all cells of a dimension."""
    return isinstance(cut, ast.Slice) and not (cut.lower or cut.upper or cut.step)


def fill_all(s: Scope, target: ast.expr, place: Value, value: Value) -> None:
    """Set all cells of a part of an array: to one number, or to those of another of its shape."""
    assert isinstance(place.type, Array)
    alike = isinstance(value.type, Array) and (value.type.shape, value.type.is_real) == (
        place.type.shape, place.type.is_real
    )  # fmt: skip
    if not (alike or value.type in (REAL, TIME)) or None in place.type.shape:
        raise s.refuse(target, "set it to one float, or to an array of the same shape")
    s.writes(place, target)
    s.note_all(place)
    if isinstance(value.type, Array):
        s.note_all(value)
        _check_apart(s, target, place, value)
    _in_loops(s, target, [ast.Slice()] * len(place.type.shape), place, value)


def _check_apart(s: Scope, target: ast.AST, place: Value, value: Value) -> None:
    """Cells are copied one after another: none may be changed before it is read."""
    if may_overlap(place, value):
        raise s.refuse(target, "copy between arrays that do not overlap, or in a loop")
    s.note_copy(place, value)


def may_overlap(a: Value, b: Value) -> bool:
    """Whether two arrays may share some of their cells: fields and rows have them all in common
    or none, variables may hold any piece.
    """
    pieces = [each for each in (a, b) if each.text.isidentifier() or "&" in each.text]
    return bool(pieces and a.roots & b.roots) and a.text != b.text


def _in_loops(s: Scope, target: ast.AST, cuts: list, array: Value, value: Value) -> None:
    assert isinstance(array.type, Array)
    with s.captured() as before:
        indices = [None if isinstance(cut, ast.Slice) else _whole_index(s, cut) for cut in cuts]
    if isinstance(value.type, Number):
        value = s.stored(value, array.type.is_real or not is_single(), array.roots)
        value = value if value.is_simple else s.kept(value)
    elif isinstance(value.type, Array) and value.type.of == TIME:
        s.note_times(array.roots)
    s.add(before)
    text, depth, of_value = array.within(Rank.ATOM), s.depth, ""
    for cut, given, count in zip(cuts, indices, array.type.shape, strict=True):
        index = _index(s, target, given, count) if given else _fill(s, target, cut, count)
        text, of_value = f"{text}[{index}]", f"{of_value}[{index}]"
    of_value = of_value if isinstance(value.type, Array) else ""
    s.say(f"{text} = {value.within(Rank.ATOM) if of_value else value.text}{of_value};", effect=True)
    while s.depth > depth:
        s.depth -= 1
        s.say("}")


def _whole_index(s: Scope, node: ast.expr) -> Value:
    index = evaluate(s, node)
    _check_whole(s, node, [index])
    return index


def _fill(s: Scope, target: ast.AST, cut: ast.expr, count: int | None) -> str:
    """The index of one dimension; a loop is opened over all of it."""
    if not _is_all(cut) or count is None:
        raise s.refuse(target, "write a loop over the cells")
    name = s.new_name("k")
    s.say(f"for (int64_t {name} = 0; {name} < {count}; {name}++) {{")
    s.depth += 1
    return name
