"""Laws of the user's own in a scenario: from a Python file beside it, or given in Python."""

import sys
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from types import FunctionType
from typing import Literal

from pydantic import Field

from torquer import plugin
from torquer.control.law import Law, as_law, load_law
from torquer.spec import Spec


class UserLaw(Spec):
    """`file`: Python file; `function`: the law in it (may be left out if there is one only);
    `parameters`: values by name, in place of the law's defaults; `memory`: what it remembers at
    first, in place of the law's own."""

    kind: Literal["user"]
    file: Path
    function: str | None = None
    parameters: dict[str, float] = Field(default_factory=dict)
    memory: tuple[float, ...] | None = None

    def law(self) -> Law:
        """The law, compiled if it is decorated with `@torquer.law`."""
        law = load_law(self.file, self.function).with_parameters(**self.parameters)
        if self.memory is None:
            return law
        if len(self.memory) != len(law.memory):
            raise ValueError(
                f"law {law.name}: memory must have {len(law.memory)} cells, as the law has; "
                f"received {len(self.memory)}"
            )
        return replace(law, memory=self.memory)


class GivenLaw(Spec):
    """Stands in a result for a law that was given in Python and is in no file to load it from.

    `name`, `parameters` and `memory` are those that were flown. To fly it again the function must
    be given again.
    """

    kind: Literal["given_in_python"] = "given_in_python"
    name: str
    parameters: dict[str, float] = Field(default_factory=dict)
    memory: tuple[float, ...] = ()

    def law(self) -> Law:
        """A `ValueError`: the function is not known."""
        raise ValueError(
            f"law {self.name}: must be given again (simulate or resume with law= or wheel_law=): "
            "it was given in Python, in no file to load it from; received none"
        )


def spec_of(law: Law, kinds: Collection[str]) -> Spec:
    """What a scenario says of a law that is to be flown: from its spec, a file, or Python.

    `kinds`: those that may stand there.
    """
    made_by = law.spec
    if made_by is not None and made_by.kind in kinds and made_by.law() == law:
        return made_by
    parameters = {name: float(value) for name, value in law.parameters.items()}
    return _in_a_file(law, parameters) or GivenLaw(
        name=law.name, parameters=parameters, memory=law.memory
    )


def _in_a_file(law: Law, parameters: dict[str, float]) -> UserLaw | None:
    """The law as one of a file that `load_law` can load again; None if there is no such file.

    The file must have been imported as a module of its own (a script would run again, a package's
    module need not load by itself), and not been edited since.
    """
    function = plugin.plain_of(law.function)
    if not isinstance(function, FunctionType) or not plugin.source_text(function):
        return None
    file, module = plugin.file_of(function), sys.modules.get(function.__module__)
    if file is None or function.__module__ == "__main__" or getattr(module, "__package__", "-"):
        return None
    for name, value in vars(module).items():
        known = value if isinstance(value, Law) else None
        if isinstance(value, FunctionType) and not law.compiled:
            known = replace(as_law(value), name=name)
        if known is not None and _differ_in_numbers_only(known, law):
            memory = None if known.memory == law.memory else law.memory
            return UserLaw(
                kind="user",
                file=file.resolve(),
                function=name,
                parameters=parameters,
                memory=memory,
            )
    return None


def _differ_in_numbers_only(known: Law, law: Law) -> bool:
    """Whether a known law becomes another by values of its parameters and memory."""
    same_names = list(known.parameters) == list(law.parameters)
    changed = replace(known, function=law.function, parameters=law.parameters, memory=law.memory)
    alike = same_names and len(known.memory) == len(law.memory) and changed == law
    return alike and _same_function(known.function, law.function)


def _same_function(a, b) -> bool:
    """Whether two functions are one, or the same text imported twice."""
    a, b = plugin.plain_of(a), plugin.plain_of(b)
    closed = getattr(a, "__closure__", None) or getattr(b, "__closure__", None)
    return a is b or (not closed and getattr(a, "__code__", None) == b.__code__)
