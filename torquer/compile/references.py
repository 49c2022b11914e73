"""What compiled code of a user's function is made of: a hash names its place and its symbols.

Numba writes the values of global names, and the functions that are called, into the code; its cache
knows a function by bytecode alone, and symbols are named by module and function. Two functions of
one name would be taken for each other: one in two folders, or one before and after an edit.
"""

import contextlib
import hashlib
import sys
from collections.abc import Iterator
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np

from torquer.compile.sources import is_own

#: Modules that are known by their name: what they hold does not change.
_KNOWN = {*sys.stdlib_module_names, "llvmlite", "numba", "numpy", "scipy", "torquer"}
_NUMBERS = (type(None), bool, int, float, complex, str, bytes, np.generic, type(...))


class References:
    """A function with all that it refers to: `mark`, a hash; `functions`, those of the user's.

    What cannot be described is taken to be other in every file that names it.
    """

    def __init__(self, function: FunctionType):
        self.functions: list[FunctionType] = []
        self._seen: dict[int, int] = {}
        self._digest = hashlib.sha256()
        self._add_function(function)
        self.mark = self._digest.hexdigest()[:16]

    def _write(self, *texts: Any) -> None:
        for text in texts:
            content = text if isinstance(text, bytes) else str(text).encode()
            self._digest.update(f"{len(content)}:".encode() + content)

    def _add_function(self, function: FunctionType) -> None:
        if self._is_known_already(function):
            return
        values = [cell.cell_contents for cell in function.__closure__ or ()]
        if is_own(function) and not _is_made(function):
            self._write("own", function.__module__, function.__qualname__)
        else:
            self.functions.append(function)
            self._write("function", function.__qualname__)
            values += [function.__code__, function.__defaults__, function.__kwdefaults__]
            values += self._named(function)
        for value in values:
            self._add(value, function)

    def _named(self, function: FunctionType) -> list:
        """What the names in a function stand for."""
        names = sorted(_names(function.__code__) & function.__globals__.keys())
        self._write(*names)
        return [function.__globals__[name] for name in names]

    def _is_known_already(self, value) -> bool:
        """Whether a value has been described; of a loop of references, too."""
        if id(value) in self._seen:
            self._write("again", self._seen[id(value)])
            return True
        self._seen[id(value)] = len(self._seen)
        return False

    def _add(self, value, user: FunctionType) -> None:
        """Describe a value that a function names."""
        plain = getattr(value, "py_func", None) or getattr(value, "_defn", None) or value
        if isinstance(value, _NUMBERS):
            self._write(type(value).__name__, repr(value))
        elif isinstance(value, CodeType):
            self._add_code(value, user)
        elif isinstance(value, np.ndarray) and not value.dtype.hasobject:
            self._write("array", value.dtype.descr, value.shape, value.tobytes())
        elif isinstance(value, tuple | list | dict):
            self._write(type(value).__qualname__, len(value))
            for part in value.items() if isinstance(value, dict) else value:
                self._add(part, user)
        elif isinstance(plain, FunctionType):
            options = getattr(value, "targetoptions", None) or {}
            self._write(*sorted(f"{name}={option}" for name, option in options.items()))
            self._add_function(plain)
        elif isinstance(value, ModuleType) and not _is_known(value.__name__):
            self._add_module(value, user)
        else:
            self._add_other(value, user)

    def _add_code(self, code: CodeType, user: FunctionType) -> None:
        self._write(
            code.co_code, code.co_names, code.co_varnames, code.co_flags, code.co_firstlineno
        )
        self._add(code.co_consts, user)

    def _add_module(self, module: ModuleType, user: FunctionType) -> None:
        """A user's module: what stands there under the names that the function uses."""
        if not self._is_known_already(module):
            names = sorted(_names(user.__code__) & vars(module).keys())
            self._write("module", *names)
            for name in names:
                self._add(vars(module)[name], user)

    def _add_other(self, value, user: FunctionType) -> None:
        """A module, a class or another thing that its name describes; or what nothing describes."""
        home = value.__name__ if isinstance(value, ModuleType) else _home(value)
        name = getattr(value, "__qualname__", None) or getattr(value, "__name__", None)
        if isinstance(value, type) and issubclass(value, tuple) and hasattr(value, "_fields"):
            self._write("record", name, value._fields)
            self._add(value._field_defaults, user)
        elif _is_known(home) and name:
            self._write("known", home, name)
        elif home.startswith("numba.core.types"):
            self._write("type", value)
        else:
            self._write("unknown", home, name, user.__code__.co_filename)


def short_name(kind: str, *described: Any) -> str:
    """Name of a type that a long text describes.

    Numba puts the names of arguments' types into every symbol, and types with the same name are
    one to it. With the text of all records in them symbols were 31 000 letters long and 95 % of
    what was compiled.

        >>> short_name("Address", "Record(...)")
        'Address(6dcd4690ea095ec12af3de030e5921ae)'
    """
    digest = hashlib.sha256(", ".join(map(str, described)).encode())
    return f"{kind}({digest.hexdigest()[:32]})"


def _home(value) -> str:
    return getattr(value, "__module__", None) or type(value).__module__


def _is_known(module: str) -> bool:
    return module.partition(".")[0] in _KNOWN


def _is_made(function: FunctionType) -> bool:
    """Whether a function was made at run time, so that its name does not describe it."""
    return function.__code__.co_filename.startswith("<")


def _names(code: CodeType) -> set[str]:
    """All names in a function's code, however deep."""
    inner = [_names(part) for part in code.co_consts if isinstance(part, CodeType)]
    return set(code.co_names).union(*inner)


@contextlib.contextmanager
def naming_symbols(function: FunctionType) -> Iterator[None]:
    """Within the block, in which a user's function is compiled, name symbols by its content.

    They hold the function's module: its own, and that of all of the user's that it calls.
    """
    if is_own(function):
        yield
        return
    found = References(function)
    modules = [each.__module__ for each in found.functions]
    for each in found.functions:
        each.__module__ = f"torquer_user_{found.mark}"
    try:
        yield
    finally:
        for each, module in zip(found.functions, modules, strict=True):
            each.__module__ = module
