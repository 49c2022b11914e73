"""Users' functions as kernels that raise where Python would, and whose numbers are defined."""

from collections.abc import Iterator
from types import ModuleType

from torquer.base.user_source import plain_function
from torquer.compile.sources import is_own


def guarded_kernel(plain, **options):
    """A user's function compiled: indices are checked, divisions by zero raise, whole numbers wrap.

    So are functions of the user's that it calls, unless they have been compiled before.
    """
    import numba

    from torquer.compile.numba_private import DefinedCompiler

    for helper in _helpers(plain, set()):
        if helper.targetoptions.get("boundscheck") is None:
            helper.targetoptions["boundscheck"] = True
    checked = {"error_model": "python", "boundscheck": True, "pipeline_class": DefinedCompiler}
    return numba.njit(**checked, **options)(plain)


def _helpers(plain, known: set) -> Iterator:
    """Compiled functions of the user's that a function may call, and those that they call."""
    for value in _values(plain):
        inner = plain_function(value)
        is_kernel = inner is not value and hasattr(value, "targetoptions")
        if not is_kernel or inner in known or is_own(inner):
            continue
        known.add(inner)
        yield value
        yield from _helpers(inner, known)


def _values(plain) -> Iterator:
    """What the names in a function stand for, in its module or in those that it names."""
    names = plain.__code__.co_names
    found = [plain.__globals__[name] for name in names if name in plain.__globals__]
    found += [cell.cell_contents for cell in plain.__closure__ or ()]
    for value in found:
        yield value
        if isinstance(value, ModuleType):
            yield from (getattr(value, name) for name in names if hasattr(value, name))
