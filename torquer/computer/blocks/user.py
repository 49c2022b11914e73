"""Laws of the user's own in a scenario, from a Python file or given in Python; blocks of files."""

import sys
from collections.abc import Callable, Collection
from dataclasses import replace
from pathlib import Path
from types import FunctionType
from typing import ClassVar, Literal, TypeVar

import numpy as np
from pydantic import Field

from torquer.base.spec import Spec
from torquer.base.user_code import OwnFile
from torquer.base.user_source import (
    cache_beside,
    import_file,
    plain_function,
    source_file,
    source_mark,
    source_text,
)
from torquer.computer.blocks.block import Block
from torquer.computer.blocks.law import Law, as_law

AnyBlock = TypeVar("AnyBlock", bound=Block)
#: A value of a parameter: a number, a vector, or a record of these.
Parameter = float | tuple[float | tuple[float, ...], ...]
#: Functions of users' files as they were loaded first, by their text.
_loaded: dict[tuple, Callable] = {}


class UserBlock(OwnFile):
    """A block of the on-board computer of your own, from a Python file."""

    executes: ClassVar[bool] = True
    place: ClassVar[str] = "control.law"

    function: str | None = None
    """Its name in the file; may be left out if the file holds one only."""
    parameters: dict[str, Parameter] = Field(default_factory=dict)
    """Parameters by name, in place of its defaults."""
    memory: tuple[float, ...] | None = None
    """Initial memory, in place of its own."""

    def with_keys(self, block: AnyBlock) -> AnyBlock:
        """The block of the file with these parameters and this memory, and the key's name."""
        changed = replace(block, key=self.own_key).with_parameters(**self.parameters)
        return changed if self.memory is None else changed.with_memory(self.memory)


class UserLaw(UserBlock):
    """A law of your own, from a Python file."""

    kind: Literal["user"]

    def check_parameters(self) -> None:
        """ValueError for parameters or a memory that the law does not have."""
        self.law()

    def law(self) -> Law:
        """The law, compiled if it is decorated with `@torquer.law`."""
        return self.with_keys(load_law(self.file, self.function, self.own_key))


class GivenLaw(Spec):
    """Stands in a result for a law that was passed from Python and is in no file to load it from.

    To fly it again the function must be passed again.
    """

    in_files: ClassVar[bool] = False

    kind: Literal["given_in_python"] = "given_in_python"
    name: str
    """Name of the function that was flown."""
    parameters: dict[str, Parameter] = Field(default_factory=dict)
    """Parameters that were flown, by name."""
    memory: tuple[float, ...] = ()
    """Initial memory that was flown."""

    def law(self) -> Law:
        """A `ValueError`: the function is not known."""
        raise ValueError(
            f"law {self.name}: must be given again (simulate or resume with law= or laws=): "
            "it was given in Python, in no file to load it from; received none"
        )


def as_spec(law: Law, kinds: Collection[str]) -> Spec:
    """The spec of a law to fly, which is given as a spec, in a file or in Python.

    `kinds`: the kinds allowed there.
    """
    made_by = law.spec
    if made_by is not None and made_by.kind in kinds and made_by.law() == law:
        return made_by
    parameters = law.values()
    return _in_a_file(law, parameters) or GivenLaw(
        name=law.name, parameters=parameters, memory=tuple(law.first_memory().tolist())
    )


def _in_a_file(law: Law, parameters: dict[str, Parameter]) -> UserLaw | None:
    """The law as one of a file that `load_law` can load again; None if there is no such file.

    The file must have been imported as a module of its own (a script would run again, a package's
    module need not load by itself), and not been edited since.
    """
    function = plain_function(law.function)
    if not isinstance(function, FunctionType) or not source_text(function):
        return None
    file, module = source_file(function), sys.modules.get(function.__module__)
    if file is None or function.__module__ == "__main__" or getattr(module, "__package__", "-"):
        return None
    for name, value in vars(module).items():
        known = value if isinstance(value, Law) else None
        if isinstance(value, FunctionType) and not law.compiled:
            known = replace(as_law(value), name=name)
        if known is not None and _differ_in_numbers_only(known, law):
            same = np.array_equal(known.first_memory(), law.first_memory(), equal_nan=True)
            memory = None if same else tuple(law.first_memory().tolist())
            return UserLaw(
                kind="user",
                file=file.resolve(),
                function=name,
                parameters=parameters,
                memory=memory,
            )
    return None


def _differ_in_numbers_only(known: Law, law: Law) -> bool:
    """Whether values of parameters and memory turn a known law into another."""
    if known.structure() != law.structure():
        return False
    changed = replace(known, parameters=law.parameters, memory=law.memory, function=law.function)
    return changed == law and _same_function(known.function, law.function)


def _same_function(a, b) -> bool:
    """Whether two functions are one, or the same text imported twice."""
    a, b = plain_function(a), plain_function(b)
    closed = getattr(a, "__closure__", None) or getattr(b, "__closure__", None)
    return a is b or (not closed and getattr(a, "__code__", None) == b.__code__)


def load_law(file: Path, name: str | None = None, key: str = "law") -> Law:
    """The law defined in a user's Python file; by its name when there are several.

    `key`: what names the file, as messages begin.
    A function without the decorator is taken as it is and runs as plain Python (slower: the result
    says so). Code compiled from the file is cached under a hash of all Python files in its folder,
    so that an edit is always noticed.
    """
    with cache_beside(file):
        found = find_block(import_file(file, key), file, name, Law, key)
        if not isinstance(found, Law):
            found = replace(as_law(found), name=name)
        found = with_known_function(replace(found, key="" if key == "law" else key))
        if found.compiled:
            found.in_loop()
    return found


def with_known_function(block: AnyBlock) -> AnyBlock:
    """A block of a file with the function that was loaded first, as long as the text is the same.

    Each loading makes another function. Runs with one and the same fly together, and it is compiled
    once. Not in plain Python, where each run has its own module and what that remembers.
    """
    plain = plain_function(block.function)
    if not block.compiled or not isinstance(plain, FunctionType) or plain.__closure__:
        return block
    text = source_mark(plain), plain.__module__, plain.__qualname__, plain.__code__
    return replace(block, function=_loaded.setdefault(text, block.function))


def find_block(module, file: Path, name: str | None, of: type[Block], key: str):
    """The block of a class in a module, or another callable of that name."""
    what = of.__name__.lower()
    blocks = {k: v for k, v in vars(module).items() if isinstance(v, of)}
    if name is None:
        if len(blocks) != 1:
            names = ", ".join(blocks) or "none"
            raise ValueError(
                f"{key}.file: must hold one @torquer.{what}, or `function` name one; received "
                f"{names} ({file})"
            )
        return next(iter(blocks.values()))
    chosen = getattr(module, name, None)
    if not isinstance(chosen, of) and not callable(chosen):
        raise ValueError(
            f"{key}.function: must be defined in the file; received {name!r}, which is not in "
            f"{file}"
        )
    return chosen
