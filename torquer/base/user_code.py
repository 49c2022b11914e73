"""Parts of a scenario that a file of the user's own gives: Python code that is executed, or data.

Code is executed only where a scenario is loaded or flown: a result that someone sends names files,
too, and a look at it executes none of them.
"""

import functools
import hashlib
import inspect
import warnings
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import FunctionType
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from torquer.base.spec import Spec
from torquer.base.user_source import error_place, import_file, printable, source_mark, source_text

#: Python files that may be executed in this process.
_admitted: set[Path] = set()


class OwnFile(Spec):
    """A part that a file of the user's own gives."""

    executes: ClassVar[bool] = False

    file: Path
    """The file, relative to the scenario file."""

    def described(self) -> dict[str, str]:
        """What a result keeps of the file, so that a run goes on with the same one only."""
        try:
            return {"source": hashlib.sha256(self.file.read_bytes()).hexdigest()}
        except OSError as error:
            raise ValueError(
                f"file: must be a file that can be read; received {self.file} "
                f"({error.strerror or error})"
            ) from None


class UserCode(OwnFile):
    """A part that a function in a Python file gives."""

    executes: ClassVar[bool] = True
    #: What it is called in messages, and what its function must take and return.
    what: ClassVar[str]
    returns: ClassVar[str]

    file: Path
    """Python file, relative to the scenario file."""
    function: str | None = None
    """Function in the file; may be left out if the file defines one only."""
    parameters: dict[str, float] = Field(default_factory=dict)
    """Parameters by name, in place of the function's defaults."""

    def load(self) -> Callable:
        """The function with its parameters; ValueError if it cannot be had or not be executed."""
        return functools.partial(self.plain(), **self.all_parameters())

    def plain(self) -> FunctionType:
        """The function as it is in the file."""
        if self.file.resolve() not in _admitted:
            raise ValueError(
                f"{self.what} file: must be of a scenario whose code may be executed, not of a "
                f"result or for a command without --no-user-code; received {self.file}"
            )
        return _load(self.file, self.function, self.what, _mark(self.file))

    def all_parameters(self) -> dict[str, float]:
        """Parameters by name, in the order in which the function takes them."""
        named = inspect.signature(self.plain()).parameters.values()
        known = {each.name: each.default for each in named if each.default is not each.empty}
        for name in self.parameters:
            if name not in known:
                raise ValueError(
                    f"{self.what} parameters.{name}: must be one of the function's "
                    f"({', '.join(known) or 'none'}); received {name!r}"
                )
        return {**known, **self.parameters}

    def call(self, *given) -> Any:
        """What the function returns; ValueError of one line where it raises an error."""
        function = self.load()
        try:
            return function(*given)
        except (Exception, SystemExit) as error:
            place = error_place(error, Path(inspect.getfile(function.func)))
            raise ValueError(f"{self.must}; received {printable(error)}{place}") from None

    def numbers(self, value) -> np.ndarray:
        """What the function returned, as an array of real numbers; ValueError for anything else."""
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                return np.asarray(value, dtype=np.float64, order="C")
        except (TypeError, ValueError, Warning):
            raise ValueError(f"{self.must}; received {printable(value)}") from None

    @property
    def must(self) -> str:
        """What must hold, as messages begin."""
        name = self.function or "its function"
        return f"{self.what} file {self.file}: {name} must be {self.returns}"

    def described(self) -> dict[str, str]:
        """Mark of the file and of those next to it that it imports; its text."""
        function = self.plain()
        return {"source": source_mark(function), "text": source_text(function)}


def admit(spec: Spec) -> None:
    """Let the Python files that a spec names be executed in this process."""
    _admitted.update(part.file.resolve() for part in own_files(spec).values() if part.executes)


def own_files(spec: Spec) -> dict[str, OwnFile]:
    """The parts of a spec that files of the user's own give, by their keys."""
    return dict(_find(spec, ""))


def check_unchanged(began: Mapping, now: Mapping, this: str) -> None:
    """ValueError for a part of which `described` says another file now than it did.

    `this`: the file that it must be, as the message says it.
    """
    for key, file in now.items():
        if file["source"] != began.get(key, {}).get("source"):
            raise ValueError(
                f"{key}.file: must be {this}; it, or one that it imports from its folder, has been "
                "edited since"
            )


def _find(value, key: str) -> Iterator[tuple[str, OwnFile]]:
    if isinstance(value, OwnFile):
        yield key, value
    elif isinstance(value, Spec):
        for name, part in value:
            yield from _find(part, f"{key}.{name}".lstrip("."))
    elif isinstance(value, Mapping):
        for name, part in value.items():
            yield from _find(part, f"{key}.{name}")
    elif isinstance(value, tuple):
        for k, part in enumerate(value):
            yield from _find(part, f"{key}[{k}]")


def _mark(file: Path) -> str:
    """A hash of a file and of those next to it: an edit gives another."""
    digest = hashlib.sha256()
    for each in sorted(file.parent.glob("*.py")):
        digest.update(f"{each.name} {each.stat().st_mtime_ns} {each.stat().st_size} ".encode())
    return digest.hexdigest()


@functools.lru_cache(maxsize=32)
def _load(file: Path, name: str | None, what: str, mark: str) -> FunctionType:
    module = import_file(file, what)
    found = {key: each for key, each in vars(module).items() if _is_public(each, module, key)}
    if name is None and len(found) != 1:
        raise ValueError(
            f"{what} file {file}: must define one function, or name one by `function`; received "
            f"{', '.join(found) or 'none'}"
        )
    if name is not None and not isinstance(getattr(module, name, None), FunctionType):
        raise ValueError(f"{what} file {file}: must define {name}; received no such function")
    return next(iter(found.values())) if name is None else getattr(module, name)


def _is_public(value, module, name: str) -> bool:
    own = isinstance(value, FunctionType) and value.__module__ == module.__name__
    return own and not name.startswith("_")
