"""The translation of one kernel as it proceeds: variables, lines, what is written."""

import ast
import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from torquer.flight.c99.lines import Block, Declared, Line, Stored
from torquer.flight.c99.reads import Noted, Reads
from torquer.flight.c99.refusal import Impossible, Refused, quote_source, refuse
from torquer.flight.c99.source import Source
from torquer.flight.c99.times import common_type, convert
from torquer.flight.c99.translation import FAILURES, Translation
from torquer.flight.c99.types import (
    INT,
    NOTHING,
    PLACES,
    TIME,
    UNBOUNDED,
    Array,
    Bounds,
    Static,
    Tuple,
    Type,
    in_words,
)
from torquer.flight.c99.values import Form, Value, as_real, as_time, constant
from torquer.flight.c99.words import avoid_headers, is_reserved


@dataclass
class Variable:
    """A variable of a kernel: its name in C, its type, where it may point to."""

    name: str
    type: Type
    form: Form = Form.VARIABLE
    roots: frozenset[str] = frozenset()
    bounds: Bounds = UNBOUNDED
    settled: bool = False


class Scope:
    """What is known at a place of a kernel that is being translated.

    `checks`: whether its indices are checked and its whole numbers wrap; `raises`: whether a
    division by zero fails; `handled`: what handles a failure here; `target`: the place that is set.
    """

    def __init__(
        self, program: Translation, source: Source, key: str, checks: bool = False,
        raises: bool = False,
    ):  # fmt: skip
        self.program, self.source, self.key = program, source, key
        self.checks, self.raises, self.is_own = checks, raises, source.is_own
        self.fails = self.reports = self.is_unproved = False
        self.handled: Callable[[], None] | None = None
        self.variables: dict[str, Variable] = {}
        self.first_variables: dict[str, Variable] = {}
        self.block, self.depth, self._count = Block(), 1, 0
        self.at_top: list[Declared] = []
        self.arguments: list[str] = []
        self.written: set[str] = set()
        self.mutable: set[str] = set()
        self.times: set[str] = set()
        self.used: set[str] = set()
        self.powers: set[str] = set()
        self.copies: set[tuple[str, str]] = set()
        self.noted = Noted()
        self.target: ast.AST | None = None
        self.result: Type | None = None
        self._names = set(source.places) | source.own
        self._c_names: dict[str, str] = {}

    def refuse(self, node: ast.AST, instead: str, construct: str = "") -> Refused:
        """The error for a construct of this kernel."""
        return refuse(self.source.file, node, construct or quote_source(node), instead)

    @contextlib.contextmanager
    def refusing(self, node: ast.AST) -> Iterator[None]:
        """Operations that are impossible, refused at their place."""
        try:
            yield
        except Impossible as why:
            raise self.refuse(node, str(why)) from None

    @contextlib.contextmanager
    def captured(self, deeper: int = 0) -> Iterator[Block]:
        """Lines said within the block, kept apart."""
        outer, self.block = self.block, Block()
        self.depth += deeper
        try:
            yield self.block
        finally:
            self.block = outer
            self.depth -= deeper

    def report(self) -> None:
        """Have the kernel be handed what has failed."""
        self.program.type_name(FAILURES)
        self.reports = True

    def add(self, block: Block) -> None:
        """Lines that were kept apart."""
        self.block.lines += block.lines
        self.block.effects |= block.effects

    def say(self, text: str, effect: bool = False) -> None:
        """A line."""
        self.block.lines.append(Line(self.depth, text))
        self.block.effects |= effect

    @contextlib.contextmanager
    def braces(self, head: str) -> Iterator[None]:
        """Lines said within the block, in the braces of a statement."""
        self.say(f"{head} {{")
        self.depth += 1
        yield
        self.depth -= 1
        self.say("}")

    def new_name(self, word: str = "part") -> str:
        """A name that no variable of the kernel has."""
        while True:
            self._count += 1
            name = f"{word}_{self._count}"
            if name not in self._names and name not in self.program.avoided:
                self.program.locals.add(name)
                return name

    def kept(self, value: Value, changes: bool = False, effect: bool = False) -> Value:
        """The value in a variable of its own; `changes`: it is set again later."""
        if isinstance(value.type, Static) or (value.is_known and not changes):
            return value
        name = self.new_name()
        value = value.content if isinstance(value.type, Tuple) else value
        text = value.address if isinstance(value.type, PLACES[:1]) else value.text
        line = Declared(
            self.depth, text, name, value.type, value.roots, not changes, has_effect=effect
        )
        self.block.lines.append(line)
        self.block.effects |= effect
        return self.variable_value(Variable(name, value.type, _find_form(value), value.roots))

    def unset(self, kind: Type, *values: Value) -> Value:
        """A variable for one of these values in a type that holds all; to be set afterwards."""
        roots = frozenset().union(*(each.roots for each in values))
        name = self.new_name()
        self.block.lines.append(Declared(self.depth, "", name, kind, roots))
        return self.variable_value(Variable(name, kind, _find_form(values[0]), roots))

    def variable_value(self, variable: Variable) -> Value:
        """A variable as it is read."""
        if isinstance(variable.type, Static):
            return Value("", variable.type, known=variable.type.value)
        if variable.type == INT and variable.bounds[0] == variable.bounds[1]:
            return constant(int(variable.bounds[0]))
        text, kind = variable.name, variable.type
        return Value(
            text, kind, form=variable.form, roots=variable.roots, bounds=variable.bounds,
            settled=variable.settled,
        )  # fmt: skip

    def c_name(self, name: str) -> str:
        """What a variable of the kernel is called in C: nothing else there has this name."""
        if name not in self._c_names:
            own = avoid_headers(name)
            while is_reserved(own) or own in self.program.avoided or (
                own != name and own in self._names
            ):  # fmt: skip
                own += "_"
            self._c_names[name] = own
            self.program.locals.add(own)
        return self._c_names[name]

    def set(self, node: ast.AST, name: str, value: Value, statement: ast.stmt | None) -> None:
        """Give a variable its value; the first one decides on its type."""
        if name not in self.source.read:
            return
        variable = self.variables.get(name)
        if variable is None:
            self._set_first(name, value, statement)
            return
        if isinstance(variable.type, Static) and variable.type == value.type:
            return
        value = self._in_type_of(name, variable, value)
        if variable.type != value.type:
            raise self.refuse(node, self._one_type(name, variable.type, value.type))
        variable.bounds = UNBOUNDED
        variable.settled |= value.is_settled
        if isinstance(value.type, PLACES):
            if value.text == variable.name:
                return
            variable.roots |= value.roots
            self.program.roots[self.key, name] = variable.roots
        self.block.lines.append(Stored(self.depth, _assigned_text(value), variable.name))

    def _in_type_of(self, name: str, variable: Variable, value: Value) -> Value:
        """A value as a variable holds it; one that must hold times as well is noted."""
        kind = common_type(variable.type, value.type)
        if kind is None or variable.type == value.type:
            return value
        if kind != variable.type:
            self.program.kinds[self.key, name] = kind
        return convert(self, value, variable.type)

    def copy_argument(self, name: str) -> None:
        """An argument that is set later: a variable in place of what is handed over by its address,
        and of what does not hold the times that it is set to.
        """
        given = self.variables[name]
        kind = self.known_kind(name, given.type)
        if kind != given.type or (given.form is Form.ADDRESS and isinstance(kind, Tuple)):
            value = convert(self, self.variable_value(given), kind).content
            own = Variable(self.new_name(self.c_name(name)), kind)
            self.at_top.append(Declared(1, value.text, own.name, kind))
            self.variables[name] = own

    def known_kind(self, name: str, kind: Type) -> Type:
        """The type that a variable, or the answer ("return"), needs for all that it holds."""
        return common_type(self.program.kinds.get((self.key, name), kind), kind) or kind

    def known_roots(self, name: str, roots: frozenset[str]) -> frozenset[str]:
        """Where a variable may point to, also by what it is set to later, in a loop."""
        return roots | self.program.known_roots.get((self.key, name), frozenset())

    def note_power(self, value: Value) -> None:
        """Note an argument that is part of a power: a caller must not set it to a constant."""
        own = {self.variables[each].name: each for each in self.arguments if each in self.variables}
        if value.text in own:
            self.powers.add(own[value.text])

    def note_copy(self, place: Value, origin: Value) -> None:
        """Note arguments between which cells are copied: their memory must not overlap."""
        names = set(self.arguments)
        self.copies |= {(a, b) for a in place.roots & names for b in origin.roots & names if a != b}

    def stored(self, value: Value, is_real: bool, roots: frozenset[str]) -> Value:
        """A number as a place in memory holds it, a double unless `is_real`; times are noted."""
        if is_real:
            return as_real(value)
        if value.type == TIME:
            self.note_times(roots)
        return as_time(value)

    def note_times(self, roots: frozenset[str]) -> None:
        """Note that times are stored in the memory in which a place is."""
        fields = {each for each in roots if "." in each}
        self.program.times |= fields
        self.times |= roots if not fields else frozenset()

    def _one_type(self, name: str, first: Type, second: Type) -> str:
        pair = {in_words(first), in_words(second)}
        if pair == {"a float", "an integer"}:
            return f"{name} must be of one type: write 0.0 for 0, or float(...)"
        return f"{name} must be of one type: it is {in_words(first)}, then {in_words(second)}"

    def _set_first(self, name: str, value: Value, statement: ast.stmt | None) -> None:
        own = self.c_name(name)
        value = convert(self, value, self.known_kind(name, value.type))
        is_place, settled = isinstance(value.type, PLACES), value.is_settled
        roots = self.known_roots(name, value.roots) if is_place else frozenset()
        variable = Variable(own, value.type, _find_form(value), roots, settled=settled)
        self.variables[name] = variable
        if isinstance(value.type, Static):
            return
        once = len([1 for _, at in self.source.places.get(name, ()) if _stores(at, name)]) == 1
        if once:
            variable.bounds = value.bounds
        if statement is not None and self.source.is_set_first(name, statement):
            self.block.lines.append(
                Declared(self.depth, _assigned_text(value), own, value.type, roots, once)
            )
            return
        self.at_top.append(Declared(1, "", own, value.type, roots))
        self.block.lines.append(Stored(self.depth, _assigned_text(value), own))

    def listed(self, parts: list[Value]) -> str:
        """Values of one type, in an array of their own."""
        name, kind = self.new_name(), self.program.type_name(parts[0].type)
        texts = ", ".join(each.content.text for each in parts)
        self.say(f"const {kind} {name}[{len(parts)}] = {{{texts}}};")
        return name

    def note_field(self, node: ast.AST, value: Value) -> None:
        """Note that a number in memory is read, unless it is what is set here."""
        if node is not self.target:
            self.noted.reads.fields |= value.roots

    def note_cells(self, value: Value, low: float, high: float) -> None:
        """Note that an array is used from one place on to another, of all that it has."""
        assert isinstance(value.type, Array)
        count = value.type.shape[0]
        if count is not None and not 0 <= low <= high < count:
            low, high = 0, count - 1
        for root in value.roots if count is not None else ():
            places = set(range(int(low), int(high) + 1))
            self.noted.reads.add_cells(root, len(value.type.shape), places)

    def note_argument(self, value: Value, reads: Reads, name: str, writes: bool) -> None:
        """Note what a kernel that is called uses of an array, its argument of a name."""
        if writes or name in reads.fields:
            self.noted.reads.fields |= value.roots
        for left, places in reads.cells_of(name).items():
            for root in value.roots:
                self.noted.reads.add_cells(root, left, places)

    def note_all(self, value: Value) -> None:
        """Note that all cells of an array are used, and read."""
        assert isinstance(value.type, Array)
        self.noted.reads.fields |= value.roots
        for left, count in enumerate(reversed(value.type.shape), 1):
            for root in value.roots:
                self.noted.reads.add_cells(root, left, set(range(count or 0)))

    def is_dead(self, place: Value) -> bool:
        """Whether nothing reads what is stored at a place."""
        fields = {each for each in place.roots if "." in each}
        return bool(fields) and all(self.program.is_unread(each) for each in fields)

    def writes(self, value: Value, node: ast.AST) -> None:
        """Note that the memory in which a place is will be written."""
        if getattr(value.type, "const", False) or not value.roots:
            raise self.refuse(node, "constants must not be written")
        self.written |= value.roots
        self.block.effects = True

    def returns(self, node: ast.AST, kind: Type) -> None:
        """Note the type of what is returned: one for all returns."""
        if self.result is None:
            self.result = kind
        both = common_type(self.result, kind)
        if both is not None and self.result != kind:
            self.program.kinds[self.key, "return"] = both
            return
        if self.result != kind:
            pair = f"{in_words(self.result)} and {in_words(kind)}"
            raise self.refuse(node, f"return one type everywhere (here: {pair})")
        if kind != NOTHING and isinstance(kind, PLACES):
            raise self.refuse(node, "return numbers or a tuple of numbers")


def _find_form(value: Value) -> Form:
    return Form.ADDRESS if isinstance(value.type, PLACES[:1]) else Form.VARIABLE


def _assigned_text(value: Value) -> str:
    """What is assigned: numbers and tuples themselves, the address of a record."""
    if isinstance(value.type, PLACES[:1]):
        return value.address
    return value.content.text


def _stores(statement: ast.stmt, name: str) -> bool:
    targets: list[ast.AST] = []
    if isinstance(statement, ast.Assign):
        targets = [*statement.targets]
    elif isinstance(statement, ast.AugAssign | ast.AnnAssign | ast.For):
        targets = [statement.target]
    names = (n for t in targets for n in ast.walk(t) if isinstance(n, ast.Name))
    return any(n.id == name and isinstance(n.ctx, ast.Store) for n in names)
