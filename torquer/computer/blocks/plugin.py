"""Functions handed in from outside, compiled against the signature of their kind.

What a user writes in a file is cached under a hash of all Python files next to it, so that an edit
there is always noticed; what has no file (a notebook's) is compiled for this process alone. What
cannot be compiled is a `ValueError` of one line.
"""

import inspect
import re
from collections.abc import Callable
from pathlib import Path

from torquer.base.user_source import cache_beside, plain_function, printable, source_file
from torquer.compile import engine
from torquer.computer.blocks import reasons

#: Functions that return before they have worked.
NOT_PLAIN = inspect.CO_GENERATOR | inspect.CO_COROUTINE | inspect.CO_ASYNC_GENERATOR


def _named_place(error: Exception, text: str, file: Path | None) -> str:
    """(FILE, line N)" of an error of Numba in a user's file; "" if it names no line of it."""
    if file is None:
        return ""
    name = rf"(?:[^\"]*[/\\])?{re.escape(file.name)}"
    lines = re.findall(rf'File "{name}", line (\d+)', text)
    lines = lines or re.findall(rf"Raised from {name} \((\d+)\)", text)
    loc = getattr(error, "loc", None)
    if not lines and loc is not None and Path(loc.filename).name == file.name:
        lines = [loc.line]
    return f" ({file.name}, line {lines[0]})" if lines else ""


def check_arguments(plain: Callable, count: int, must: str) -> None:
    """ValueError unless a function takes so many arguments, and has worked when it returns."""
    taken = len(inspect.signature(plain).parameters)
    if taken != count:
        raise ValueError(f"{must}; received one that takes {taken} arguments")
    if plain.__code__.co_flags & NOT_PLAIN:
        raise ValueError(f"{must}; received a generator or coroutine")


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
        UnsupportedBytecodeError,
        keep_compiled,
        naming_symbols,
        rare_collections,
        register_dispatcher,
    )

    try:
        found = numba.njit(**options)(function)
        if keep:
            keep_compiled(found)
        with register_dispatcher(found), rare_collections(), naming_symbols(function):
            found.compile(signature)
        found.disable_compile()
        return found
    except (NumbaError, UnsupportedBytecodeError, NotImplementedError) as error:
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
    except ValueError as error:  # and to a text that is no number
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
