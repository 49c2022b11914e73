"""All kernels that a program in C needs: each translated once for each types of its arguments."""

import ast
from collections.abc import Callable, Iterable

from torquer.base.user_source import plain_function
from torquer.flight.c99 import calls, expressions, places  # noqa: F401  register what they translate
from torquer.flight.c99.lines import Line, count_words, without_unread
from torquer.flight.c99.reads import Reads
from torquer.flight.c99.refusal import Refused
from torquer.flight.c99.scope import Scope, Variable
from torquer.flight.c99.source import read_source
from torquer.flight.c99.statements import block
from torquer.flight.c99.times import common_type, convert
from torquer.flight.c99.trace import origin_lines
from torquer.flight.c99.translation import Function, Place, Translation
from torquer.flight.c99.types import (
    INT,
    NOTHING,
    PLACES,
    UNBOUNDED,
    Array,
    Record,
    Static,
    Tuple,
    Type,
)
from torquer.flight.c99.values import Form, Value
from torquer.flight.c99.words import FAILURES_NAME


class Program(Translation):
    """A translation that translates the kernels that it is asked for."""

    def returned_argument(self, function) -> int | None:
        """The place of the argument that a function returns as it is; None if it does more."""
        plain = plain_function(function)
        if plain in self.replaced or not hasattr(plain, "__code__"):
            return None
        try:
            source = read_source(function)
        except ValueError:
            return None
        names = [each.arg for each in source.tree.args.args]
        match source.body:
            case [ast.Return(ast.Name(name))] if name in names:
                return names.index(name)
        return None

    def function(self, kernel, types: list[Type], s: Place | None = None, node=None) -> Function:
        """A kernel for these types of arguments.

        One of the package is made once more, with checks, where a user's kernel calls it and its
        indices are not proved.
        """
        own = read_source(kernel).is_own
        made = self._made(kernel, types, s, node, not own)
        if own and made.is_unproved and s is not None and s.checks:
            return self._made(kernel, types, s, node, True)
        return made

    def _made(self, kernel, types: list[Type], s: Place | None, node, checks: bool) -> Function:
        plain = plain_function(kernel)
        key = (plain, tuple(types), checks)
        if key in self._at_work:
            assert s is not None
            raise s.refuse(node, "write a loop", f"{plain.__name__}, which calls itself,")
        if key not in self.functions:
            self._at_work.append(key)
            try:
                self.functions[key] = self._translate(kernel, types, checks)
            except Refused as refused:
                if refused.is_own and s is not None and not s.is_own:  # what the user has written
                    raise s.refuse(node, refused.instead) from None
                refused.key = refused.key or getattr(plain, "key", "")
                raise
            self._at_work.remove(key)
        return self.functions[key]

    def _translate(self, kernel, types: list[Type], checks: bool) -> Function:
        source = read_source(kernel)
        model = getattr(kernel, "targetoptions", {}).get("error_model", "python")
        raises = model == "python" and not source.is_own
        s = Scope(self, source, _key_text(source.plain, types, checks), checks, raises)
        self._declare_arguments(s, types)
        ended = block(s, source.body)
        if s.result not in (None, NOTHING) and not ended:
            raise s.refuse(source.tree, "return a value at the end", "a kernel that may not return")
        name = self.free_name(source.plain.__name__.lstrip("_"))
        lines = without_unread([*s.at_top, *s.block.lines], set())
        names = {each: v.name for each, v in s.first_variables.items()}
        words = count_words(lines)
        arguments = list(zip(s.arguments, types, strict=True))
        unused = {n for n, k in arguments if isinstance(k, Static) or names[n] not in words}
        return Function(
            name, arguments, s.result or NOTHING, lines, names, frozenset(s.written),
            frozenset(s.written | s.mutable), frozenset(unused), source.doc, source.equation,
            key=s.key, times=frozenset(s.times), powers=frozenset(s.powers),
            copies=frozenset(s.copies), fails=s.fails, reports=s.reports,
            is_unproved=s.is_unproved, origin=origin_lines(source), reads=s.noted.reads,
        )  # fmt: skip

    def _declare_arguments(self, s: Scope, types: list[Type]) -> None:
        a = s.source.tree.args
        if a.vararg or a.kwarg or a.kwonlyargs or a.posonlyargs:
            raise s.refuse(s.source.tree, "name its arguments one by one", "this kernel")
        s.arguments = [each.arg for each in a.args]
        if len(s.arguments) != len(types):
            raise s.refuse(s.source.tree, f"take {len(types)} arguments", "this kernel")
        stored, known = s.source.stored, self._known_bounds.get(s.key, {})
        for name, kind in zip(s.arguments, types, strict=True):
            by_address = isinstance(kind, Record) or (isinstance(kind, Tuple) and kind.is_large)
            form = Form.ADDRESS if by_address else Form.VARIABLE
            roots = s.known_roots(name, frozenset([name] if isinstance(kind, PLACES) else []))
            bounds = UNBOUNDED if name in stored else known.get(name, UNBOUNDED)
            s.variables[name] = Variable(s.c_name(name), kind, form, roots, bounds)
            if isinstance(kind, Array) and len(kind.shape) > 1:
                s.mutable.add(name)
        s.first_variables = dict(s.variables)
        for name in s.arguments:
            if name in stored:
                s.copy_argument(name)

    def switch(
        self, functions: dict[int, Callable], types: list[Type], s: Place, node,
        otherwise: Value | None = None,
    ) -> Function:  # fmt: skip
        """A function that calls one of several by its number."""
        key = (tuple(functions.items()), tuple(types))
        if key not in self.functions:
            made = {n: self.function(each, types, s, node) for n, each in functions.items()}
            for each in made.values():  # what a switch hands on is not followed
                own = self.bounds.setdefault(each.key, {})
                own |= {name: UNBOUNDED for name, kind in each.arguments if kind == INT}
            kind = self._common_result(list(made.values()))
            if kind is None:
                raise s.refuse(node, "let all of them return the same")
            last = convert(s, otherwise, kind).text if otherwise else ""
            self.functions[key] = _switch(self, made, types, last)
        return self.functions[key]

    def _common_result(self, made: list[Function]) -> Type | None:
        """What all functions return, or shall return in a next translation."""
        kind = common_type(*(each.result for each in made))
        for each in made:
            if kind is not None and each.result != kind:
                self.kinds[each.key, "return"] = kind
        return kind


def _switch(
    program: Program, made: dict[int, Function], types: list[Type], otherwise: str
) -> Function:
    """A function that calls one of several; a switch has two cases or more (MISRA C:2012, 16.6)."""
    names = [f"a{k}" for k in range(len(types))]
    first, last = next(iter(made.values())), list(made)[-1]
    reports = any(each.reports for each in made.values())
    lines = [Line(1, "switch (number) {")]
    for number, each in made.items():
        head = "default" if number == last and not otherwise else f"case {number}"
        lines += [Line(1, f"{head}:"), Line(2, _hand_on(each, names))]
        if each.result == NOTHING:
            lines.append(Line(2, "break;"))
    if otherwise:
        lines += [Line(1, "default:"), Line(2, f"return {otherwise};")]
    lines.append(Line(1, "}"))
    if len(made) == 1 and not otherwise:
        lines = [Line(1, _hand_on(first, names))]
    words = count_words(lines)
    arguments = [("number", INT), *zip(names, types, strict=True)]
    return Function(
        program.free_name(f"one_of_{len(made)}_as_{first.name}"), arguments, first.result, lines,
        {n: n for n, _ in arguments}, _written_by_any(made, names, "writes"),
        _written_by_any(made, names, "mutable"),
        frozenset(n for n, _ in arguments if n not in words),
        "The kernel of a number.", times=_written_by_any(made, names, "times"),
        fails=any(each.fails for each in made.values()), reports=reports,
        is_unproved=any(each.is_unproved for each in made.values()),
        reads=_read_by_any(made, names),
    )  # fmt: skip


def _written_by_any(made: dict[int, Function], names: list[str], what: str) -> frozenset[str]:
    """Arguments of a switch that any of its functions writes, or needs to be writable."""
    return frozenset(
        name
        for each in made.values()
        for name, (own, _) in zip(names, each.arguments, strict=True)
        if own in getattr(each, what)
    )


def _read_by_any(made: dict[int, Function], names: list[str]) -> Reads:
    """What the functions of a switch read of its arguments."""
    found = Reads()
    for each in made.values():
        for name, (own, _) in zip(names, each.arguments, strict=True):
            found.fields |= {name} if own in each.reads.fields else set()
            for left, of in each.reads.cells_of(own).items():
                found.add_cells(name, left, of)
    return found


def _hand_on(made: Function, names: list[str]) -> str:
    """A call with those of the arguments that C takes."""
    pairs = zip(names, made.arguments, strict=True)
    taken = [
        n for n, (own, kind) in pairs if own not in made.unused and not isinstance(kind, Static)
    ]
    taken += [FAILURES_NAME] * made.reports
    call = f"{made.name}({', '.join(taken)});"
    return call if made.result == NOTHING else f"return {call}"


def _key_text(plain: Callable, types: list[Type], checks: bool) -> str:
    """A key that is the same when a program is translated once more."""
    return repr([getattr(plain, "__qualname__", plain), tuple(types), checks])


def translate_repeatedly(
    build: Callable[[Program], None], replaced: dict | None = None, again: int = 2,
    times: Iterable[str] = (), prefix: str = "",
    find_reads: Callable[[Program], Reads] | None = None,
) -> Program:  # fmt: skip
    """A program built several times, each with what the one before found out.

    `again`: how often for the sake of indices; from `times`, names of fields, it follows what else
    is a time in a program of single precision, until nothing changes and all names are apart.
    `find_reads`: what of memory is read by what a program consists of; without it all is kept.
    """
    program = Program(replaced, prefix=prefix)
    program.times |= set(times)
    program.live = Reads() if find_reads else None
    build(program)
    rounds, earlier, live, begun = 0, Program(), program.live, 0
    while (
        rounds < again
        or program.found() != earlier.found()
        or program.live != live
        or (find_reads and not begun)
        or not program.keeps_bounds()
        or program.locals & program.taken - program.avoided
    ):
        rounds, earlier = rounds + 1, program
        if find_reads and not begun and rounds > again + _ROUNDS:
            # once more, with the bounds of what is reached: what only served each other is left out
            begun, live = rounds, Reads()
        program = Program(replaced, earlier, prefix)
        program.live = live
        build(program)
        if find_reads and live is not None:
            found = find_reads(program)
            live = live.joined(found) if begun and rounds > begun + _MOST else found
    return program


#: Rounds after which the bounds of all that is reached are known; after which nothing that was read
#: in any of them is left out any more.
_ROUNDS, _MOST = 3, 12
