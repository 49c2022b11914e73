"""Control laws as plug-ins: one signature, compiled once, passed as a first-class function.

A law is a function `(measured, parameters, memory) -> (x, y, z)`:
  measured    `torquer.conventions.Measured`: all that the on-board computer knows;
  parameters  float64 array, in the order in which the law declares them;
  memory      float64 array, all that the law remembers between calls (kept across stop/resume);
  returns     as a law of the coils the wanted dipole [A m^2], as a law of the wheels the wanted
              torque [N m] on the satellite; both in body axes.
"""

import functools
import hashlib
import importlib.util
import math
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from numbers import Real
from pathlib import Path
from types import FunctionType

import numpy as np
from numba import types

from torquer import engine, plugin
from torquer.conventions import Measured

_VECTOR = types.UniTuple(types.float64, 3)
_ARRAY = types.float64[::1]
_QUATERNION = types.UniTuple(types.float64, 4)
MEASURED = types.NamedTuple(
    (types.float64, *4 * (_VECTOR,), _QUATERNION, *5 * (_VECTOR,)), Measured
)
SIGNATURE = _VECTOR(MEASURED, _ARRAY, _ARRAY)
#: Cells of memory of a function without the decorator, which cannot say how many it needs.
_PLAIN_MEMORY = 16


@dataclass(frozen=True)
class Law:
    """A control law ready to fly: its function, parameters by name, and initial memory.

    `navigates`: it wants position, velocity and model field, which are left out otherwise.
    `needs_sun`: it reads the Sun's direction; without Sun sensors it gets an ideal one.
    `spec`: what a scenario says of it, for a law that was made from its spec.
    """

    name: str
    function: Callable
    parameters: Mapping[str, float] = field(default_factory=dict)
    memory: tuple[float, ...] = ()
    compiled: bool = True
    navigates: bool = False
    needs_sun: bool = False
    spec: object = field(default=None, compare=False, repr=False)

    def with_parameters(self, **values: float) -> "Law":
        """The same law with other parameters; unknown names are errors."""
        for name in values:
            if name not in self.parameters:
                known = ", ".join(self.parameters) or "none"
                raise ValueError(
                    f"law {self.name}: parameter must be one of: {known}; received {name!r}"
                )
        merged = {**self.parameters, **values}
        return replace(self, parameters=merged, spec=None)

    def pack(self) -> np.ndarray:
        """Parameters for the kernel; raises ValueError if one is missing or not finite."""
        for name, value in self.parameters.items():
            if not _is_finite_number(value):
                raise ValueError(
                    f"law {self.name}: parameter {name} must be a finite number; received {value!r}"
                )
        return np.array([float(v) for v in self.parameters.values()], dtype=np.float64)

    def __call__(self, measured: Measured, parameters, memory) -> tuple:
        """The plain Python function, for trying the law by hand."""
        return plugin.plain_of(self.function)(measured, parameters, memory)


def _is_finite_number(value) -> bool:
    """Whether it is a real number, of Python or NumPy, that a float can hold; truth is none."""
    if not isinstance(value, Real) or isinstance(value, bool):
        return False
    try:
        return math.isfinite(float(value))
    except OverflowError:
        return False


def as_law(law_or_function, name: str = "law") -> Law:
    """A law as it is; a function without the decorator as a law that runs as plain Python.

    Such a law is slower (the result says so), takes no parameters and has 16 cells of memory.
    """
    if isinstance(law_or_function, Law):
        return law_or_function
    if not callable(law_or_function):
        raise ValueError(
            f"{name}: must be a torquer.Law or a function; received {law_or_function!r}"
        )
    called = getattr(law_or_function, "__name__", type(law_or_function).__name__)
    memory = (0.0,) * _PLAIN_MEMORY
    return Law(called, law_or_function, {}, memory, compiled=False, needs_sun=True)


def law(
    function: Callable | None = None,
    *,
    parameters: Mapping | None = None,
    memory=0,
    navigates: bool = False,
):
    """Decorator that makes a plain function a compiled control law.

    `parameters` maps names to default values, in the order in which the function indexes them;
    `memory` is a number of cells (zeros at first) or their initial values; `navigates` asks for
    position, velocity and the field of the on-board model there.

        @torquer.law(parameters={"gain": 4e4}, memory=3)
        def my_law(measured, parameters, memory):
            ...
            return (mx, my, mz)
    """
    if function is None:
        return functools.partial(law, parameters=parameters, memory=memory, navigates=navigates)
    start = (0.0,) * memory if isinstance(memory, int) else tuple(float(m) for m in memory)
    known = dict(parameters or {})
    return Law(function.__name__, function, known, start, navigates=navigates, needs_sun=True)


@functools.cache
def compile_law(function: Callable):
    """The function compiled against `SIGNATURE`; ValueError with one clear line if it does not.

    A user's law is guarded: bounds are checked, and a law that raises an error answers with
    not-a-numbers.
    """
    plain = plugin.plain_of(function)
    must = f"law {plain.__name__}: must compile as (measured, parameters, memory) -> (x, y, z)"
    if engine.is_own(plain):
        return plugin.first_class(plain, SIGNATURE, must)
    if not engine.COMPILED:
        return _guarded(plain, plain)
    plugin.check_arguments(plain, len(SIGNATURE.args), must)
    file = plugin.file_of(plain)
    with plugin.cache_beside(file):
        options = {"error_model": "python", "boundscheck": True, "cache": file is not None}
        law = plugin.compiled(plain, SIGNATURE, must, **options)
        # all guards of laws that a function makes have one place in the cache: keep them off it
        known = file is not None and plain.__closure__ is None
        guard = _guarded(law, plain)
        guard = plugin.compiled(guard, SIGNATURE, must, error_model="numpy", cache=known)
        return engine.FirstClass(guard, SIGNATURE)


def _guarded(law: Callable, plain: Callable) -> Callable:
    """`_guard` around a law, compiled or not.

    It passes for a function of the law's own file, at the law's own line, by a name that tells
    laws of one line apart: there the cache looks for it. (What is compiled as a closure over the
    law is never found in the cache by another process.)
    """
    own = plain.__code__
    name = f"{plain.__name__}_guarded_{hashlib.sha256(own.co_code).hexdigest()[:8]}"
    place = {"co_filename": own.co_filename, "co_firstlineno": own.co_firstlineno}
    code = _guard.__code__.replace(co_name=name, **place)
    guard = FunctionType(code, {"_law": law, "np": np}, name)
    guard.__qualname__, guard.__module__ = name, plain.__module__
    return guard


def _guard(measured, parameters, memory):
    try:
        return _law(measured, parameters, memory)  # noqa: F821 - named by `_guarded`
    except Exception:
        return (np.nan, np.nan, np.nan)


def load_law(file: Path, name: str | None = None) -> Law:
    """The law defined in a user's Python file; by its name when there are several.

    A function without the decorator is taken as it is and runs as plain Python (slower: the
    result says so). Code compiled from the file is cached under a hash of all Python files
    beside it, so that an edit is always noticed.
    """
    if not file.is_file():
        raise ValueError(f"law file: must exist; received {file}")
    if file.suffix != ".py":
        raise ValueError(f"law file: must be a Python file (.py); received {file}")
    with plugin.cache_beside(file):
        found = _find(_module_of(file), file, name)
        if found.compiled:
            compile_law(found.function)
    return found


def _module_of(file: Path):
    """The file as a module of its own, with the files beside it importable."""
    mark = hashlib.sha256(str(file.resolve()).encode()).hexdigest()[:8]
    spec = importlib.util.spec_from_file_location(f"torquer_user_{file.stem}_{mark}", file)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    sys.path.insert(0, str(file.resolve().parent))
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        raise ValueError(f"law file {file}: must import; received {error!r}") from None
    finally:
        sys.path.pop(0)
    return module


def _find(module, file: Path, name: str | None) -> Law:
    laws = {k: v for k, v in vars(module).items() if isinstance(v, Law)}
    if name is None:
        if len(laws) != 1:
            names = ", ".join(laws) or "none"
            raise ValueError(
                f"law file {file}: must hold one @torquer.law, or name one; received {names}"
            )
        return next(iter(laws.values()))
    chosen = getattr(module, name, None)
    if isinstance(chosen, Law):
        return chosen
    if not callable(chosen):
        raise ValueError(f"law file {file}: must define {name}; received no such function")
    return replace(as_law(chosen), name=name)
