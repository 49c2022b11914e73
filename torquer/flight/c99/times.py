"""Times in a program of single precision: what is a time in one place is one in all.

The types of fields of memory and of named tuples, of variables and of answers follow from what is
stored in them, which a first translation finds out for the next (`torquer.flight.c99.program`).
"""

from dataclasses import replace

from torquer.flight.c99.translation import Place, Translation
from torquer.flight.c99.types import REAL, TIME, Array, Number, Tuple, Type, tuple_type
from torquer.flight.c99.values import Form, Value, as_real, as_time, select_part


def common_type(*kinds: Type) -> Type | None:
    """The type that holds values of all: times, where one of them is; None if there is none."""
    found: Type | None = kinds[0]
    for each in kinds[1:]:
        found = _common_type(found, each) if found is not None else None
    return found


def _common_type(a: Type, b: Type) -> Type | None:
    if a == b:
        return a
    if {a, b} == {REAL, TIME}:
        return TIME
    if isinstance(a, Array) and isinstance(b, Array):
        of_times = replace(a, of=TIME)
        return of_times if of_times == replace(b, of=TIME) else None
    if isinstance(a, Tuple) and isinstance(b, Tuple) and (a.of, len(a.parts)) == (
        b.of, len(b.parts)
    ):  # fmt: skip
        parts = tuple(common_type(x, y) for x, y in zip(a.parts, b.parts, strict=True))
        return None if None in parts else tuple_type(parts, a.of or tuple)
    return None


def convert(s: Place, value: Value, kind: Type) -> Value:
    """A number, an array or a tuple in a type with which its own has a common one."""
    if value.type == kind:
        return value
    if isinstance(kind, Number):
        return as_time(value) if kind == TIME else as_real(value)
    if isinstance(kind, Array):  # both hold doubles
        return replace(value, type=kind)
    assert isinstance(kind, Tuple)
    held = s.kept(value) if value.form is Form.RESULT else value
    parts = [convert(s, select_part(held, place), each) for place, each in enumerate(kind.parts)]
    return written_tuple(s.program, kind, parts)


def written_tuple(program: Translation, kind: Tuple, parts: list[Value]) -> Value:
    """A tuple of these parts, written down."""
    parts = [each for place, each in enumerate(parts) if program.keeps_part(kind, place)]
    inner = ", ".join(_bare(program, each) for each in parts)
    braces = f"{{{{{inner}}}}}" if kind.is_array else f"{{{inner}}}"
    reads = any(each.reads for each in parts)
    return Value(f"({program.type_name(kind)}){braces}", kind, form=Form.RESULT, reads=reads)


def _bare(program: Translation, part: Value) -> str:
    """A part of a tuple that is written down: one written down itself needs its braces alone."""
    text, kind = part.content.text, part.type
    cast = f"({program.type_name(kind)})" if isinstance(kind, Tuple) else ""
    return text[len(cast) :] if cast and text.startswith(cast + "{") else text


def type_tuple(s: Place, of: type, parts: list[Value]) -> list[Value]:
    """Parts of a tuple; those of a named one with times in the fields that hold times anywhere."""
    marks = [(of, name) for name in getattr(of, "_fields", ())]
    for mark, part in zip(marks, parts, strict=False):
        if TIME in _numbers(part.type):
            s.program.times.add(mark)
    if not marks:
        kind = tuple_type(tuple(each.type for each in parts))
        return [convert(s, each, k) for each, k in zip(parts, kind.parts, strict=True)]
    return [
        convert(s, part, in_times(part.type)) if mark in s.program.times else part
        for mark, part in zip(marks, parts, strict=True)
    ]


def type_constant(program: Translation, kind: Tuple) -> Tuple:
    """The type of a constant tuple, with times in the fields that hold times anywhere."""
    parts = [
        type_constant(program, each) if isinstance(each, Tuple) else each for each in kind.parts
    ]
    marks = [(kind.of, name) for name in kind.fields or ()]
    for place, mark in enumerate(marks):
        if mark in program.times:
            parts[place] = in_times(parts[place])
    return Tuple(tuple(parts), kind.fields, kind.name, kind.of)


def _numbers(kind: Type) -> list[Type]:
    """A number, or those of an unnamed tuple."""
    if isinstance(kind, Tuple) and not kind.fields:
        return [each for part in kind.parts for each in _numbers(part)]
    return [kind]


def in_times(kind: Type) -> Type:
    """A number, or all of an unnamed tuple, as times."""
    if isinstance(kind, Tuple) and not kind.fields:
        return Tuple(tuple(map(in_times, kind.parts)))
    return TIME if kind == REAL else kind
