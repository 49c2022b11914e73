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
from torquer.flight.c99.words import AROUND, RESERVED, avoid_headers, is_reserved

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
    comes from.
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
        self._known_bounds = earlier.bounds if earlier else {}
        self.times: set = set(earlier.times) if earlier else set()
        self.kinds: dict[tuple[str, str], Type] = dict(earlier.kinds) if earlier else {}
        self.roots: dict[tuple[str, str], frozenset[str]] = {}
        self.known_roots = earlier.roots if earlier else {}
        self.taken: set[str] = set(RESERVED)
        self.around: frozenset[str] = frozenset()
        self.avoided = earlier.taken if earlier else set()
        self.locals: set[str] = set()
        self.checks: dict[tuple[str, int, str], None] = {}

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
        self.around = AROUND

    def free_name(self, word: str) -> str:
        """A name that nothing else has."""
        word = avoid_headers(word)
        name, count = word, 1
        while name in self.taken or name in self.around or is_reserved(name):
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
        inner = ", ".join(self._braces(v, k) for v, k in zip(value, kind.parts, strict=True))
        return f"{{{{{inner}}}}}" if kind.is_array else f"{{{inner}}}"

    def note_bounds(self, made: Function, values: list[Value]) -> None:
        """Remember within what bounds the whole numbers are that a kernel is given."""
        known = self.bounds.setdefault(made.key, {})
        for (name, kind), value in zip(made.arguments, values, strict=True):
            if kind != INT:
                continue
            known[name] = either(known[name], value.bounds) if name in known else value.bounds
