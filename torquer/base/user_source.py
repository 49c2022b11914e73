"""Python files and functions that come from outside: their sources, marks, errors.

A mark is a hash of a file and of those next to it that it imports: an edit is always noticed.
"""

import ast
import contextlib
import dis
import functools
import hashlib
import importlib.util
import inspect
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from types import CodeType, FunctionType

from torquer.base.validate import as_storable
from torquer.compile import engine
from torquer.compile.sources import mark_files

#: Characters of what a user's code raised or returned that a message shows.
_LONGEST = 300


def plain_function(function: Callable) -> Callable:
    """The Python function behind a compiled one."""
    return getattr(function, "py_func", function)


def source_file(plain: Callable) -> Path | None:
    """The file in which a function is written; None for a typed one."""
    try:
        source = Path(inspect.getsourcefile(plain) or "")
    except TypeError:  # an object that is called like a function
        return None
    return source if source.is_file() else None


def _beside(file: Path) -> list[Path]:
    """All Python files of a file's folder: what it may import."""
    return sorted(file.parent.glob("*.py"))


def _imported_from_beside(file: Path) -> list[Path]:
    """A file and those of its folder that it imports, and they in turn."""
    found, to_read = [], [file]
    while to_read:
        each = to_read.pop()
        if each in found or not each.is_file():
            continue
        found.append(each)
        for name in _names_imported(each):
            to_read.append(file.parent / f"{name}.py")
            to_read += sorted((file.parent / name).rglob("*.py"))
    return sorted(found)


def _names_imported(file: Path) -> set[str]:
    """First names of the modules that a file imports."""
    names = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names |= {node.module} if node.module else {alias.name for alias in node.names}
    return {name.partition(".")[0] for name in names}


def source_mark(function: Callable) -> str:
    """Mark of a user's function's file and of those next to it that it imports.

    '' for the package's and typed ones.
    """
    plain = plain_function(function)
    file = source_file(plain)
    if file is None or engine.is_own(plain):
        return ""
    return mark_with_imports(file)


def mark_with_imports(file: Path) -> str:
    """Mark of a user's file and, of a Python file, those next to it that it imports."""
    return mark_files(_imported_from_beside(file) if file.suffix == ".py" else [file])


def source_text(function: Callable) -> str:
    """Text of the file in which a user's function is written, or of the function alone.

    '' for the package's own, for one whose file has been edited since, and for one without text.
    """
    plain = plain_function(function)
    if not isinstance(plain, FunctionType) or engine.is_own(plain):
        return ""
    try:
        file = source_file(plain)
        text = file.read_text(encoding="utf-8") if file else inspect.getsource(plain)
        known = file is None or plain.__code__ in _codes_in(compile(text, file, "exec"))
    except (OSError, SyntaxError, ValueError):
        return ""
    return text if known else ""


def _codes_in(code: CodeType) -> list[CodeType]:
    """All functions' code in a file's, however deep."""
    inner = [part for part in code.co_consts if isinstance(part, CodeType)]
    return inner + [part for each in inner for part in _codes_in(each)]


def attributes_read(function: Callable) -> frozenset[str] | None:
    """Attributes of its first argument that a function reads; None if it may read others.

    Known only where every use of the argument is `argument.name`.
    """
    plain = plain_function(function)
    if not isinstance(plain, FunctionType) or plain.__code__.co_argcount == 0:
        return None
    return _read_of_first(plain.__code__)


@functools.lru_cache(maxsize=1024)
def _read_of_first(code: CodeType) -> frozenset[str] | None:
    """Attributes of its first argument that code reads; None if it may read others."""
    found: set[str] = set()
    argument = code.co_varnames[0]
    if argument in code.co_cellvars:
        return None
    steps = [each for each in dis.get_instructions(code) if each.opname != "CACHE"]
    for step, after in zip(steps, [*steps[1:], None], strict=True):
        names = step.argval if isinstance(step.argval, tuple) else (step.argval,)
        if argument not in names or step.opcode in dis.hasname or step.opcode in dis.hasconst:
            continue
        loaded = step.opname.startswith("LOAD_FAST") and names.index(argument) == len(names) - 1
        if not loaded or after is None or after.opname not in ("LOAD_ATTR", "LOAD_METHOD"):
            return None
        found.add(after.argval)
    return frozenset(found)


def cache_beside(file: Path | None):
    """Within the block, compile into the cache of this user's file and those next to it."""
    if not file or not engine.COMPILED:
        return contextlib.nullcontext()
    from torquer.compile.code_cache import user_cache

    return user_cache(_beside(file))


def error_place(error: BaseException, file: Path | None) -> str:
    """Where in a user's file an error arose, as " (law.py, line 3)"; "" if it arose elsewhere."""
    line = error_line(error, file)
    return f" ({file.name}, line {line})" if file is not None and line else ""


def error_line(error: BaseException, file: Path | None) -> int:
    """The line of a user's file in which an error arose; 0 if it arose elsewhere."""
    lines = [
        line
        for frame, line in traceback.walk_tb(error.__traceback__)
        if Path(frame.f_code.co_filename) == file
    ]
    if isinstance(error, SyntaxError) and Path(error.filename or "") == file:
        lines.append(error.lineno or 0)
    return lines[-1] if lines else 0


def printable(value) -> str:
    """What a user's code raised or returned, as one line that can be printed and stored.

    Its own text may be long, or raise an error itself.
    """
    try:
        # the parts of a syntax error would repeat its place
        shown = f"SyntaxError({value.msg!r})" if isinstance(value, SyntaxError) else repr(value)
        text = as_storable(" ".join(shown.split()))
    except Exception:
        text = type(value).__name__
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def import_file(file: Path, key: str):
    """The file as a module of its own, with those next to it importable; `key`: what names it."""
    if not file.is_file():
        raise ValueError(f"{key}.file: must be an existing file; received {file}")
    if file.suffix != ".py":
        raise ValueError(f"{key}.file: must be a Python file (.py); received {file}")
    mark = hashlib.sha256(str(file.resolve()).encode()).hexdigest()[:8]
    spec = importlib.util.spec_from_file_location(f"torquer_user_{file.stem}_{mark}", file)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    known, folder = set(sys.modules), file.resolve().parent
    sys.path.insert(0, str(folder))
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        line = error_line(error, Path(spec.origin))
        place = f"{file}, line {line}" if line else f"{file}"
        raise ValueError(
            f"{key}.file: must import; received {printable(error)} ({place})"
        ) from None
    finally:
        sys.path.pop(0)
        # else another folder's file of the same name, or this one when edited, would not be read
        for name in set(sys.modules) - known:
            found = getattr(sys.modules[name], "__file__", None)
            if found and Path(found).resolve().is_relative_to(folder):
                del sys.modules[name]
    return module
