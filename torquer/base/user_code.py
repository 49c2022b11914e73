"""Parts of a scenario that a file of the user's own gives: Python code that is executed, or data.

Code is executed only where a scenario is loaded or flown: a result that someone sends names files,
too, and a look at it executes none of them.
"""

import functools
import hashlib
import inspect
import json
import warnings
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import FunctionType
from typing import Any, ClassVar, ForwardRef, get_args

import numpy as np
from pydantic import Field

from torquer.base.columns import Own
from torquer.base.shared import shared
from torquer.base.spec import Spec
from torquer.base.user_source import error_line, import_file, printable, source_mark, source_text

#: Python files that may be executed in this process.
_admitted: set[Path] = set()
#: Keys by which scenarios of this process name parts, by what these are; and how many are kept.
_keys: dict[str, str] = {}
_MOST_KEYS = 10_000


class OwnFile(Spec):
    """A part that a file of the user's own gives."""

    executes: ClassVar[bool] = False
    #: Its key in a scenario, as messages name it where no scenario is known that has it.
    place: ClassVar[str] = ""

    file: Path
    """The file, relative to the scenario file."""

    @property
    def own_key(self) -> str:
        """The key by which a scenario names it, as messages begin."""
        return _keys.get(self.identity(), self.place)

    def identity(self) -> str:
        """What it is, as text: a scenario that is checked again has other objects.

        Without the numbers of many scenarios, of which it has columns.
        """
        told = json.dumps(
            self.model_dump(warnings=False),
            default=lambda each: None if isinstance(each, Own) else str(each),
        )
        return f"{type(self).__name__} {told}"

    def check_parameters(self) -> None:
        """ValueError for parameters that what the file gives does not take."""

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
    #: What its function must take and return, in messages, and how many arguments it takes.
    returns: ClassVar[str]
    takes: ClassVar[int]

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
                f"{self.own_key}.file: must be of a scenario whose code may be executed, not of a "
                "result or for a command that has no option --no-user-code; received "
                f"{self.file}"
            )
        try:
            return _load(self.file, self.function, _mark(self.file))
        except ValueError as error:
            raise ValueError(f"{self.own_key}{error}") from None

    def all_parameters(self) -> dict[str, float]:
        """Parameters by name, in the order in which the function takes them."""
        known = self._named()
        for name in self.parameters:
            if name not in known:
                raise ValueError(
                    f"{self.own_key}.parameters.{name}: must be one of the function's "
                    f"({', '.join(known) or 'none'}); received {name!r}"
                )
        found = {**known, **self.parameters}
        for name, value in found.items():
            if value is inspect.Parameter.empty:
                raise ValueError(
                    f"{self.own_key}.parameters.{name}: must be given, as the function has no "
                    f"default for it; received nothing ({self.function_in_words()})"
                )
        return found

    def check_parameters(self) -> None:
        """ValueError for parameters that the function does not take, or that it lacks."""
        self.all_parameters()

    def _named(self) -> dict[str, Any]:
        """Parameters of the function by name, with their defaults or `inspect.Parameter.empty`."""
        all_of_it = inspect.signature(self.plain()).parameters.values()
        in_order = [each for each in all_of_it if each.kind == each.POSITIONAL_OR_KEYWORD]
        by_place = [each for each in all_of_it if each.kind == each.POSITIONAL_ONLY] + in_order
        if len(by_place) < self.takes and all(e.kind != e.VAR_POSITIONAL for e in all_of_it):
            count = len(by_place) or "none"
            raise self.refusal(f"one that takes {count} of these arguments")
        by_name = [each for each in all_of_it if each.kind == each.KEYWORD_ONLY]
        return {each.name: each.default for each in (*by_place[self.takes :], *by_name)}

    def call(self, *given) -> Any:
        """What the function returns; ValueError of one line where it raises an error.

        `given`: arrays with a row for each point or instant, and what is the same for all.
        """
        try:
            return self.load()(*given)
        except (Exception, SystemExit) as error:
            wrong = error
        one, wrong = self._narrowed(given, wrong)
        where = f" {self.where(*one)}" if len(one[0]) == 1 else ""
        line = error_line(wrong, Path(self.plain().__code__.co_filename))
        raise self.refusal(f"{printable(wrong)}{where}", line=line)

    def _narrowed(self, given: tuple, error: BaseException) -> tuple[tuple, BaseException]:
        """A row of what was given for which the function raises an error, and that error.

        All rows, if it raises none for either half of them.
        """
        function, count = self.load(), len(given[0])
        while count > 1:
            middle = count // 2
            for rows in (slice(0, middle), slice(middle, count)):
                part = tuple(e[rows] if isinstance(e, np.ndarray) else e for e in given)
                try:
                    function(*part)
                except (Exception, SystemExit) as found:
                    given, error, count = part, found, len(part[0])
                    break
            else:
                break
        return given, error

    def where(self, *given) -> str:
        """Place and time of the first row that a function is given, in words."""
        raise NotImplementedError

    def numbers(self, value) -> np.ndarray:
        """What the function returned, as an array of real numbers; ValueError for anything else."""
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                return np.asarray(value, dtype=np.float64, order="C")
        except (TypeError, ValueError, Warning):
            raise self.refusal(printable(value)) from None

    @property
    def must(self) -> str:
        """What must hold, as messages begin."""
        return f"{self.own_key}: must be {self.returns}"

    def refusal(self, received: str, more: str = "", line: int = 0) -> ValueError:
        """The error of one line for what the function is or does; `more`: what else must hold."""
        return ValueError(
            f"{self.must}{more}; received {received} ({self.function_in_words(line)})"
        )

    def function_in_words(self, line: int = 0) -> str:
        """Name, file and, unless 0, line of the function."""
        name = self.function or self.plain().__name__
        return f"{name} in {self.file}" + (f", line {line}" if line else "")

    def described(self) -> dict[str, str]:
        """Mark of the file and of those next to it that it imports; its text."""
        function = self.plain()
        return {"source": source_mark(function), "text": source_text(function)}


def admit(spec: Spec) -> None:
    """Let the Python files that a spec names be executed in this process."""
    remember_keys(spec)
    _admitted.update(part.file.resolve() for part in own_files(spec).values() if part.executes)


def remember_keys(spec: Spec) -> None:
    """Let messages about the parts of a spec begin with the keys that it has for them."""
    for key, part in own_files(spec).items():
        _keys.pop(part.identity(), None)  # what is put in anew is the last to be forgotten
        if key:
            _keys[part.identity()] = key
    while len(_keys) > _MOST_KEYS:
        del _keys[next(iter(_keys))]


@shared
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
        for name in _fields_with_specs(type(value)):
            yield from _find(getattr(value, name), f"{key}.{name}".lstrip("."))
    elif isinstance(value, Mapping):
        for name, part in value.items():
            yield from _find(part, f"{key}.{name}")
    elif isinstance(value, tuple):
        for k, part in enumerate(value):
            yield from _find(part, f"{key}[{k}]")


@functools.cache
def _fields_with_specs(spec: type[Spec]) -> tuple[str, ...]:
    """Fields whose values may be specs, or hold some."""
    fields = spec.model_fields.items()
    return tuple(name for name, field in fields if _is_of_specs(field.annotation))


def _is_of_specs(annotation) -> bool:
    if isinstance(annotation, type) and not get_args(annotation):
        return issubclass(annotation, Spec)
    unknown = annotation is Any or isinstance(annotation, str | ForwardRef)
    return unknown or any(map(_is_of_specs, get_args(annotation)))


def _mark(file: Path) -> str:
    """A hash of a file and of those next to it: an edit gives another."""
    digest = hashlib.sha256()
    for each in sorted(file.parent.glob("*.py")):
        digest.update(f"{each.name} {each.stat().st_mtime_ns} {each.stat().st_size} ".encode())
    return digest.hexdigest()


@functools.lru_cache(maxsize=32)
def _load(file: Path, name: str | None, mark: str) -> FunctionType:
    """A function of a file; its errors lack the key of what names the file."""
    module = import_file(file, "")
    found = {key: each for key, each in vars(module).items() if _is_public(each, module, key)}
    if name is None and len(found) != 1:
        raise ValueError(
            ".file: must define one function, or `function` name one; received "
            f"{', '.join(found) or 'none'} ({file})"
        )
    if name is not None and not isinstance(getattr(module, name, None), FunctionType):
        raise ValueError(
            f".function: must be a function of the file; received {name!r}, which is none of {file}"
        )
    return next(iter(found.values())) if name is None else getattr(module, name)


def _is_public(value, module, name: str) -> bool:
    own = isinstance(value, FunctionType) and value.__module__ == module.__name__
    return own and not name.startswith("_")
