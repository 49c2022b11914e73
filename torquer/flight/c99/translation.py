"""What is known of a program while it is translated: names, types, constants, what to find out."""

import ast
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import Protocol

from torquer.flight.c99.arithmetic import either
from torquer.flight.c99.lines import Line
from torquer.flight.c99.precision import double_text, real_word
from torquer.flight.c99.reads import Reads
from torquer.flight.c99.refusal import Refused, refuse
from torquer.flight.c99.types import (
    BOOL,
    INT,
    NOTHING,
    REAL,
    TIME,
    Array,
    Bounds,
    Number,
    Record,
    Rows,
    Static,
    Tuple,
    Type,
)
from torquer.flight.c99.values import Form, Rank, Value, constant
from torquer.flight.c99.words import AROUND, DECLARED, RESERVED, avoid_headers, is_reserved

#: What of a computer has failed: the line that the kernel at work has raised in, 0 for none; the
#: line of the latest failure; bits of the laws and estimators that have failed.
FAILURES = Record("Failures", (("raised", INT), ("line", INT), ("blocks", INT)))
#: A name of a constant, as the house writes them.
_CONSTANT_NAME = re.compile(r"_?[A-Z][A-Z0-9_]+")


@dataclass
class Function:
    """A kernel in C. `arguments`: all of the kernel's; `unused`: those that C does not take.

    `writes`: arguments in whose memory it writes, `times`: in whose it writes times; `mutable`:
    whose memory must not be const; `powers`: those that are part of a power; `copies`: pairs of
    arrays, of which the first is set to the second; `fails`: whether its caller must see whether it
    has failed; `reports`: whether it is handed what has failed; `is_unproved`: whether an index in
    it is neither proved to be in its table nor checked; `origin`: lines of its comment on where it
    comes from; `reads`: what of memory it reads.
    """

    name: str
    arguments: list[tuple[str, Type]]
    result: Type = NOTHING
    lines: list[Line] = field(default_factory=list)
    names: dict[str, str] = field(default_factory=dict)
    writes: frozenset[str] = frozenset()
    mutable: frozenset[str] = frozenset()
    unused: frozenset[str] = frozenset()
    doc: str = ""
    equation: str = ""
    is_public: bool = False
    key: str = ""
    times: frozenset[str] = frozenset()
    powers: frozenset[str] = frozenset()
    copies: frozenset[tuple[str, str]] = frozenset()
    fails: bool = False
    reports: bool = False
    is_unproved: bool = False
    origin: str = ""
    reads: Reads = field(default_factory=Reads)


class Place(Protocol):
    """The place of a kernel at which the translation is: see `torquer.flight.c99.scope.Scope`."""

    program: "Translation"
    checks: bool
    is_own: bool

    def kept(self, value: Value) -> Value: ...
    def refuse(self, node: ast.AST, instead: str, construct: str = "") -> Refused: ...


class Translation(ABC):
    """Kernels, types and constants of a program. `replaced`: kernels with a translation of their
    own; `earlier`: a translation of the same program, which has found out `bounds` of whole numbers
    among arguments, which fields are `times`, and the `kinds` of variables that hold several;
    `prefix`: of the names of tuples, which two files that know each other's types must not share.
    `live`: what an earlier translation reads, None to leave nothing out; `pruned`: names of the
    records of which what is not read is left out.
    """

    def __init__(
        self, replaced: dict | None = None, earlier: "Translation | None" = None, prefix: str = ""
    ):
        self.replaced: dict[Callable, Callable] = replaced or {}
        self._prefix = prefix
        self.functions: dict[tuple, Function] = {}
        self._at_work: list[tuple] = []
        self.types: dict[Type, str] = {}
        self.constants: dict[tuple, tuple[str, Value]] = {}
        self.helpers: set[str] = set()
        self.bounds: dict[str, dict[str, Bounds]] = {}
        self._known_bounds: dict[str, dict[str, Bounds]] = (
            earlier._known_bounds | earlier.bounds if earlier else {}
        )
        self.times: set = set(earlier.times) if earlier else set()
        self.kinds: dict[tuple[str, str], Type] = dict(earlier.kinds) if earlier else {}
        self.roots: dict[tuple[str, str], frozenset[str]] = {}
        self.known_roots = earlier.roots if earlier else {}
        self.taken: set[str] = set(RESERVED)
        self.around: frozenset[str] = frozenset()
        self.avoided = earlier.taken if earlier else set()
        self.locals: set[str] = set()
        self.checks: dict[tuple[str, int, str], None] = {}
        self.loops: dict[tuple[str, int, str], None] = {}
        self.live: Reads | None = None
        self.pruned: set[str] = set()
        self._whole: set[type] = set(earlier._whole) if earlier else set()

    @abstractmethod
    def function(
        self, kernel: Callable, types: list[Type], s: Place | None = None, node=None
    ) -> Function:
        """A kernel for these types of arguments."""

    @abstractmethod
    def switch(
        self, functions: dict[int, Callable], types: list[Type], s: Place, node,
        otherwise: Value | None = None,
    ) -> Function:  # fmt: skip
        """A function that calls one of several by its number; `otherwise`: answer to any other.

        Without it the last one is called.
        """

    @abstractmethod
    def returned_argument(self, function: Callable) -> int | None:
        """The place of the argument that a function returns as it is; None if it does more."""

    def found(self) -> tuple:
        """What a next translation needs to know of this one."""
        return self.times, self.kinds, self.roots

    def name_interface(self, kinds: Iterable[Type]) -> None:
        """Give types of the interface their names; from here on nothing else has one of its."""
        for kind in kinds:
            self.type_name(kind)
            self.keep_whole(kind)
        self.around = AROUND

    def free_name(self, word: str) -> str:
        """A name that nothing else has."""
        word = avoid_headers(word)
        name, count = word, 1
        others = self.around | DECLARED
        while name in self.taken or name in others or is_reserved(name):
            count += 1
            name = f"{word}_{count}"
        self.taken.add(name)
        return name

    def type_name(self, kind: Type) -> str:
        """How C names a type; structs are declared when they are first named."""
        if isinstance(kind, Number):
            return real_word() if kind == REAL else kind.c
        if isinstance(kind, Array):
            return real_word() if kind.is_real else "double"
        if isinstance(kind, Rows):
            return self.type_name(kind.record)
        assert isinstance(kind, Tuple | Record)
        key = replace(kind, const=False, bounds=()) if isinstance(kind, Record) else kind
        if key not in self.types:
            parts = kind.parts if isinstance(kind, Tuple) else [k for _, k in kind.fields]
            for each in (kind.fields or ()) if isinstance(kind, Tuple) else ():
                if not each.isascii():
                    what = f"the field {each} of {kind.name}"
                    raise refuse("export", None, what, "use letters from a to z")
            for each in parts:
                if not isinstance(each, Static):
                    self.type_name(each)
            prefix = self._prefix if isinstance(kind, Tuple) else ""
            word = self._type_word(kind)  # may begin with the name of a part
            self.types[key] = self.free_name(word if word.startswith(prefix) else prefix + word)
        return self.types[key]

    def _type_word(self, kind: Tuple | Record) -> str:
        if kind.name is not None:
            return kind.name
        first, count = kind.parts[0], len(kind.parts)
        if kind.is_array:
            words = {REAL: "vec", TIME: "times", INT: "ints", BOOL: "bools"}
            return f"{words.get(first) or self.type_name(first) + 'x'}{count}"
        return "_".join(["parts", *(self.type_name(each).split("_t")[0] for each in kind.parts)])

    def named_constant(self, name: str, value, kind: Tuple | None = None) -> Value:
        """A constant; one that has a name as constants have keeps it in C."""
        number = constant(value) if kind is None else self._tuple_constant(value, kind)
        own = name.lstrip("_")
        if not _CONSTANT_NAME.fullmatch(name) or number.type == BOOL or is_reserved(own):
            return number
        key = (own, number.type, repr(value))
        if key not in self.constants:
            self.constants[key] = (self.free_name(own), number)
        text = self.constants[key][0]
        return replace(number, text=text, form=Form.VARIABLE, rank=Rank.ATOM)

    def _tuple_constant(self, value: tuple, kind: Tuple) -> Value:
        text = f"({self.type_name(kind)}){self._braces(value, kind)}"
        return Value(text, kind, form=Form.RESULT)

    def _braces(self, value, kind: Type) -> str:
        """The numbers of a constant in braces."""
        if not isinstance(kind, Tuple):
            return double_text(float(value)) if kind == TIME else constant(value).text
        pairs = zip(value, kind.parts, strict=True)
        kept = [pair for place, pair in enumerate(pairs) if self.keeps_part(kind, place)]
        inner = ", ".join(self._braces(*pair) for pair in kept)
        return f"{{{{{inner}}}}}" if kind.is_array else f"{{{inner}}}"

    def keep_whole(self, kind: Type) -> None:
        """Keep all parts of the tuples in a type."""
        if isinstance(kind, Tuple):
            self._whole.add(kind.of)
            for each in kind.parts:
                self.keep_whole(each)
        if isinstance(kind, Record | Rows):
            record = kind.record if isinstance(kind, Rows) else kind
            for _, part in record.fields:
                self.keep_whole(part)

    def kept_fields(self, of: type, fields: tuple[str, ...]) -> tuple[str, ...]:
        """The fields of a named tuple that are in C; one at least."""
        if self.live is None or of in self._whole:
            return fields
        return tuple(each for each in fields if (of, each) in self.live.parts) or fields[:1]

    def keeps_part(self, kind: Tuple, place: int) -> bool:
        """Whether a part of a tuple is in C."""
        return not kind.fields or kind.fields[place] in self.kept_fields(kind.of, kind.fields)

    def is_unread(self, name: str) -> bool:
        """Whether nothing reads a field, "Known.t_s"."""
        is_pruned = self.live is not None and name.partition(".")[0] in self.pruned
        return is_pruned and self.live is not None and name not in self.live.fields

    def keeps(self, record: Record, name: str) -> bool:
        """Whether a field of a record is in C: it is read, and has rows."""
        kind = dict(record.fields)[name]
        if isinstance(kind, Static):
            return False
        if self.live is None:
            return True
        if kind == FAILURES:
            return f"{record.name}.{name}" in self.live.fields
        if isinstance(kind, Rows):
            return kind.count > 0 and self.keeps_any(kind.record)
        if isinstance(kind, Record):
            return self.keeps_any(kind)
        has_cells = not isinstance(kind, Array) or 0 not in kind.shape
        return has_cells and not self.is_unread(f"{record.name}.{name}")

    def keeps_any(self, record: Record) -> bool:
        """Whether a record has fields in C."""
        return any(self.keeps(record, name) for name, _ in record.fields)

    def kept_shape(self, record: Record, name: str) -> tuple[int, ...] | None:
        """The shape in C of an array, up to the last place that is used; None for all of it."""
        if self.live is None or record.name not in self.pruned:
            return None
        shape, own = dict(record.fields)[name].shape, f"{record.name}.{name}"
        used = [self.live.cells.get((own, len(shape) - k), ()) for k in range(len(shape))]
        return tuple(max(of, default=n - 1) + 1 for n, of in zip(shape, used, strict=True))

    def keeps_bounds(self) -> bool:
        """Whether whole numbers that kernels are given are within the bounds they are known by."""
        return all(
            low <= given[0] and given[1] <= high
            for key, known in self._known_bounds.items()
            for name, (low, high) in known.items()
            if (given := self.bounds.get(key, {}).get(name)) is not None
        )

    def note_bounds(self, made: Function, values: list[Value]) -> None:
        """Remember within what bounds the whole numbers are that a kernel is given."""
        known = self.bounds.setdefault(made.key, {})
        for (name, kind), value in zip(made.arguments, values, strict=True):
            if kind != INT:
                continue
            known[name] = either(known[name], value.bounds) if name in known else value.bounds
