"""The C text of a program: types, constants, functions."""

import re
from dataclasses import replace

from torquer.flight.c99.helpers import helper_texts
from torquer.flight.c99.lines import Declared, Left, Line, Stored
from torquer.flight.c99.precision import is_single
from torquer.flight.c99.program import Program
from torquer.flight.c99.texts import without_comments
from torquer.flight.c99.translation import FAILURES, Function
from torquer.flight.c99.types import (
    BOOL,
    INT,
    NOTHING,
    REAL,
    TIME,
    Array,
    Record,
    Rows,
    Static,
    Tuple,
    Type,
    c_word,
    number_text,
)
from torquer.flight.c99.words import FAILURES_NAME

#: Longest line of C text.
_WIDTH = 100
INCLUDES = "#include <math.h>\n#include <stdbool.h>\n#include <stddef.h>\n#include <stdint.h>\n"


def declarator(program: Program, kind: Type, name: str, const: bool = False) -> str:
    """A variable or argument of a type; `const`: what it points to is not written through it."""
    word = program.type_name(kind)
    before = "const " if const else ""
    if isinstance(kind, Array):
        rest = "".join(f"[{n}]" for n in kind.in_c[1:])
        return f"{before}{word} (*{name}){rest}" if rest else f"{before}{word} *{name}"
    if isinstance(kind, Record | Rows):
        return f"{before}{word} *{name}"
    return f"{word} {name}"


def member(program: Program, kind: Type, name: str) -> str:
    """A member of a struct."""
    name = c_word(name)
    if isinstance(kind, Array):
        return f"{program.type_name(kind)} {name}{_lengths(kind)};"
    if isinstance(kind, Rows):
        return f"{program.type_name(kind)} {name}[{max(kind.count, 1)}];"
    return f"{program.type_name(kind)} {name};"


def _lengths(kind: Array) -> str:
    """Lengths of an array in a struct, one of floats with an even number: doubles follow it."""
    if kind.is_real and is_single():
        return "".join(f"[{max((n or 1) + (n or 1) % 2, 2)}]" for n in kind.in_c)
    return "".join(f"[{max(n or 1, 1)}]" for n in kind.in_c)


def types_text(program: Program, without: tuple[str, ...] = (), used: str | None = None) -> str:
    """All structs but those of some names, each after those of which it is made.

    `used`: a text in which, or in each other, those that are written have to be named.
    """
    texts = {name: _members(program, kind) for kind, name in program.types.items()}
    named = set(texts) if used is None else set()
    waiting = [] if used is None else [used]
    while waiting:
        new = set(re.findall(r"\w+", waiting.pop())) & set(texts) - named
        named |= new
        waiting += [texts[each] for each in new]
    return "\n".join(
        f"typedef struct {{\n{members}}} {name};\n"
        for name, members in texts.items()
        if members and name in named and name not in without
    )


def _members(program: Program, kind: Type) -> str:
    if isinstance(kind, Tuple) and kind.is_array:
        return f"    {program.type_name(kind.parts[0])} v[{len(kind.parts)}];\n"
    if isinstance(kind, Tuple):
        names = kind.fields or [f"v{k}" for k in range(len(kind.parts))]
        parts = enumerate(zip(names, kind.parts, strict=True))
        fields = [each for place, each in parts if program.keeps_part(kind, place)]
    else:
        assert isinstance(kind, Record)
        fields = kept_fields(program, kind)
    if isinstance(kind, Record):  # memory holds doubles
        fields = [(name, TIME if each == REAL else each) for name, each in fields]
    return "".join(f"    {member(program, each, name)}\n" for name, each in fields)


def kept_fields(program: Program, record: Record) -> list[tuple[str, Type]]:
    """The fields of a record that are in C, with their types there."""
    fields = [each for each in record.fields if program.keeps(record, each[0])]
    return [
        (name, replace(kind, kept=program.kept_shape(record, name)))
        if isinstance(kind, Array)
        else (name, kind)
        for name, kind in fields
    ]


def signature(program: Program, function: Function) -> str:
    """How a function is declared, without its storage class."""
    texts = []
    for name, kind in function.arguments:
        if name in function.unused or isinstance(kind, Static):
            continue
        own = function.names[name]
        if isinstance(kind, Tuple) and kind.is_large:
            texts.append(f"const {program.type_name(kind)} *{own}")
        else:
            texts.append(declarator(program, kind, own, name not in function.mutable))
    if function.reports:
        texts.append(declarator(program, FAILURES, FAILURES_NAME))
    return f"{program.type_name(function.result)} {function.name}({', '.join(texts) or 'void'})"


def function_text(program: Program, function: Function) -> str:
    """A function with its comment."""
    storage = "" if function.is_public else "static "
    body = "".join(f"{_line(program, function, each)}\n" for each in function.lines)
    head = wrap_line(f"{storage}{signature(program, function)}", 0)
    return f"{_comment(function)}{head}\n{{\n{body}}}\n"


def _comment(function: Function) -> str:
    said = "\n".join((function.doc, function.equation, function.origin)).replace("*/", "* /")
    lines = [each for each in said.splitlines() if each]
    return f"/* {chr(10).join(lines)} */\n".replace("\n", "\n   ", len(lines) - 1) if lines else ""


def _line(program: Program, function: Function, line: Line) -> str:
    text = line.text
    if isinstance(line, Declared):
        text = _declaration(program, function, line)
    elif isinstance(line, Stored):
        text = f"{line.name} = {text};"
    elif isinstance(line, Left):
        text = _left(program, function.result)
    return wrap_line("    " * line.depth + text, line.depth)


def _declaration(program: Program, function: Function, line: Declared) -> str:
    kind = line.type
    assert kind is not None
    points = isinstance(kind, Array | Record | Rows)
    arguments = {each for each in line.roots if "." not in each}
    const = points and (_is_const(kind) or not arguments <= function.mutable)
    made = declarator(program, kind, line.name, const)
    if not points and line.is_constant:
        made = f"const {made}"
    if not line.text:
        zero = "NULL" if points else "{0}" if isinstance(kind, Tuple) else _zero(kind)
        return f"{made} = {zero};"
    prefix = f"({program.type_name(kind)}){{" if isinstance(kind, Tuple) else ""
    text = line.text
    if prefix and text.startswith(prefix):
        text = text[len(prefix) - 1 :]
    return f"{made} = {text};"


def _left(program: Program, kind: Type) -> str:
    """How a kernel is left that has nothing to answer."""
    if kind == NOTHING:
        return "return;"
    zero = f"({program.type_name(kind)}){{0}}" if isinstance(kind, Tuple) else _zero(kind)
    return f"return {zero};"


def _zero(kind: Type) -> str:
    if kind == BOOL:
        return "false"
    return "0" if kind == INT else "0.0" if kind == TIME else number_text(0.0)


def _is_const(kind: Type | None) -> bool:
    of = kind.record if isinstance(kind, Rows) else kind
    return bool(getattr(of, "const", False))


def wrap_line(text: str, depth: int) -> str:
    """A line of C, broken at commas and blanks where it is too long."""
    lines, further = [], "    " * (depth + 1)
    while len(text) > _WIDTH:
        least = len(text) - len(text.lstrip()) + 1
        cut = max(text.rfind(", ", least, _WIDTH) + 1, text.rfind("{", least, _WIDTH) + 1)
        cut = cut or text.rfind(" ", least, _WIDTH)
        if cut <= least:
            break
        lines.append(text[:cut].rstrip())
        text = further + text[cut:].strip()
    return "\n".join([*lines, text])


def helpers_text(used: str) -> str:
    """The functions of the C text's own that a text uses."""
    found = [text for name, text in helper_texts().items() if re.search(rf"\b{name}\(", used)]
    return "\n\n".join(found) + ("\n" if found else "")


def constants_text(program: Program, used: str) -> str:
    """The constants that the text names."""
    found, words = [], set(re.findall(r"\w+", used))
    for name, value in program.constants.values():
        if name in words:
            kind = program.type_name(value.type)
            text = value.text.removeprefix(f"({kind})")
            found.append(wrap_line(f"static const {kind} {name} = {text};", 0) + "\n")
    return "".join(found)


def reached_names(program: Program, roots: tuple[str, ...] = ()) -> set[str]:
    """Names of all functions reached from public ones and `roots`."""
    lines = {f.name: "\n".join(each.text for each in f.lines) for f in program.functions.values()}
    reached: set[str] = set()
    waiting = [*roots, *(f.name for f in program.functions.values() if f.is_public)]
    while waiting:
        name = waiting.pop()
        if name not in reached:
            reached.add(name)
            called = re.findall(r"\b(\w+)\(", without_comments(lines[name]))
            waiting += [each for each in called if each in lines]
    return reached


def reached_functions(program: Program, roots: tuple[str, ...] = ()) -> dict[str, str]:
    """Text of all functions reached from public ones and `roots`, each after those it calls."""
    reached = reached_names(program, roots)
    made = {each.name: each for each in program.functions.values()}
    return {name: function_text(program, made[name]) for name in made if name in reached}


def program_text(program: Program, with_types: bool = True, roots: tuple[str, ...] = ()) -> str:
    """The whole program as one text; see `functions_text`."""
    functions = "\n".join(reached_functions(program, roots).values())
    used = without_comments(functions)
    parts = [types_text(program)] if with_types else []
    parts += [constants_text(program, used), helpers_text(used), functions]
    return "\n".join(part for part in parts if part)
