"""Functions handed in from outside, compiled against the signature of their kind.

What a user writes in a file is cached under a hash of all Python files next to it, so that an edit
there is always noticed; what has no file (a notebook's) is compiled for this process alone. What
cannot be compiled is a `ValueError` of one line.
"""

import ast
import contextlib
import dis
import inspect
import re
import traceback
from collections.abc import Callable
from pathlib import Path
from types import CodeType, FunctionType

from torquer.base.validate import as_storable
from torquer.compile import engine
from torquer.compile.sources import mark_files
from torquer.computer.blocks import reasons

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
    return mark_files(_imported_from_beside(file))


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


def attributes_read(function: Callable) -> set[str] | None:
    """Attributes of its first argument that a function reads; None if it may read others.

    Known only where every use of the argument is `argument.name`.
    """
    plain = plain_function(function)
    if not isinstance(plain, FunctionType) or plain.__code__.co_argcount == 0:
        return None
    code, found = plain.__code__, set()
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
    return found


def cache_beside(file: Path | None):
    """Within the block, compile into the cache of this user's file and those next to it."""
    if not file or not engine.COMPILED:
        return contextlib.nullcontext()
    from torquer.compile.code_cache import user_cache

    return user_cache(_beside(file))


def error_place(error: BaseException, file: Path | None) -> str:
    """Where in a user's file an error arose, as " (law.py, line 3)"; "" if it arose elsewhere."""
    if file is None:
        return ""
    lines = [
        line
        for frame, line in traceback.walk_tb(error.__traceback__)
        if Path(frame.f_code.co_filename) == file
    ]
    if isinstance(error, SyntaxError) and error.filename and Path(error.filename) == file:
        lines.append(error.lineno or 0)
    return f" ({file.name}, line {lines[-1]})" if lines else ""


def printable(value) -> str:
    """What a user's code raised or returned, as one line that can be printed and stored.

    Its own text may be long, or raise an error itself.
    """
    try:
        text = as_storable(" ".join(repr(value).split()))
    except Exception:
        text = type(value).__name__
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def _named_place(error: Exception, text: str, file: Path | None) -> str:
    """(FILE, line N)" of an error of Numba in a user's file; "" if it names no line of it."""
    if file is None:
        return ""
    lines = re.findall(rf'File "(?:[^"]*[/\\])?{re.escape(file.name)}", line (\d+)', text)
    loc = getattr(error, "loc", None)
    if not lines and loc is not None and Path(loc.filename).name == file.name:
        lines = [loc.line]
    return f" ({file.name}, line {lines[0]})" if lines else ""


def check_arguments(plain: Callable, count: int, must: str) -> None:
    """ValueError unless a function takes so many arguments."""
    taken = len(inspect.signature(plain).parameters)
    if taken != count:
        raise ValueError(f"{must}; received one that takes {taken} arguments")


def compile_plugin(
    function: Callable, signature, must: str, keep: bool = False, plainly: str = "", **options
):
    """The function by Numba; `must` says what must hold, and begins the message if it does not.

    `keep`: whether the compiled code is kept on the disk. `plainly`: how the user can have the
    function run as plain Python, for the message.
    """
    import numba

    from torquer.compile.numba_private import (
        NumbaError,
        keep_compiled,
        rare_collections,
        register_dispatcher,
    )

    try:
        found = numba.njit(**options)(function)
        if keep:
            keep_compiled(found)
        with register_dispatcher(found), rare_collections():
            found.compile(signature)
        found.disable_compile()
        return found
    except NumbaError as error:
        text = re.sub(r"\x1b\[[0-9;]*m", "", str(error))
        lines = [line.strip() for line in text.splitlines() if line.strip()]
        message = [line for line in lines if not line.startswith(("Failed", "During", "File", "<"))]
        place = _named_place(error, text, source_file(plain_function(function)))
        reason, way_out = reasons.in_words((message or lines)[0], text, plainly)
        raise ValueError(f"{must}; received: {reason[:200]}{place}{way_out}") from None
    except KeyError as error:  # Numba's answer to a field that a record does not have
        raise ValueError(f"{must}; received one whose memory has no {error}") from None
    except AttributeError as error:  # and to a name that a module does not have
        raise ValueError(f"{must}; received: {printable(error)}") from None
    except (AssertionError, IndexError, TypeError) as error:  # and to defaults of a named tuple
        raise ValueError(
            f"{must}; received: {printable(error)} (in compiled code a named tuple, such as "
            "torquer.Command, must be given all its fields)"
        ) from None


def first_class(function: Callable, signature, must: str):
    """The function as kernels take it; plain without the compiler."""
    plain = plain_function(function)
    if not engine.COMPILED:
        return plain
    check_arguments(plain, len(signature.args), must)
    file, own = source_file(plain), engine.is_own(plain)
    known = file is not None and plain.__closure__ is None
    with cache_beside(file if known and not own else None):
        found = compile_plugin(plain, signature, must, keep=known, error_model="numpy")
        from torquer.compile.overloads import FirstClass

        return FirstClass(found, signature)
