"""Control laws as plug-ins: one signature, compiled once, passed as a first-class function.

A law is a function `(measured, parameters, memory) -> (mx, my, mz)`:
  measured    `torquer.conventions.Measured`: all that the on-board computer knows;
  parameters  float64 array, in the order in which the law declares them;
  memory      float64 array, all that the law remembers between calls (kept across stop/resume);
  returns     the wanted dipole [A m^2] in the body.
"""

import contextlib
import functools
import hashlib
import importlib.util
import inspect
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numba
import numpy as np
from numba import types

from torquer import engine
from torquer.conventions import Measured

_VECTOR = types.UniTuple(types.float64, 3)
_ARRAY = types.float64[::1]
_QUATERNION = types.UniTuple(types.float64, 4)
MEASURED = types.NamedTuple(
    (types.float64, *4 * (_VECTOR,), _QUATERNION, _VECTOR, _VECTOR), Measured
)
SIGNATURE = _VECTOR(MEASURED, _ARRAY, _ARRAY)


@dataclass(frozen=True)
class Law:
    """A control law ready to fly: its function, parameters by name, and initial memory.

    `navigates`: it wants the position and velocity, which are left out otherwise.
    """

    name: str
    function: Callable
    parameters: Mapping[str, float] = field(default_factory=dict)
    memory: tuple[float, ...] = ()
    compiled: bool = True
    navigates: bool = False

    def with_parameters(self, **values: float) -> "Law":
        """The same law with other parameters; unknown names are errors."""
        for name in values:
            if name not in self.parameters:
                known = ", ".join(self.parameters) or "none"
                raise ValueError(
                    f"law {self.name}: parameter must be one of: {known}; received {name!r}"
                )
        merged = {**self.parameters, **values}
        return replace(self, parameters=merged)

    def pack(self) -> np.ndarray:
        """Parameters for the kernel; raises ValueError if one is missing or not finite."""
        for name, value in self.parameters.items():
            if not (isinstance(value, int | float) and np.isfinite(value)):
                raise ValueError(
                    f"law {self.name}: parameter {name} must be a finite number; received {value!r}"
                )
        return np.array([float(v) for v in self.parameters.values()], dtype=np.float64)

    def __call__(self, measured: Measured, parameters, memory) -> tuple:
        """The plain Python function, for trying the law by hand."""
        return getattr(self.function, "py_func", self.function)(measured, parameters, memory)


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
    position and velocity.

        @torquer.law(parameters={"gain": 4e4}, memory=3)
        def my_law(measured, parameters, memory):
            ...
            return (mx, my, mz)
    """
    if function is None:
        return functools.partial(law, parameters=parameters, memory=memory, navigates=navigates)
    start = (0.0,) * memory if isinstance(memory, int) else tuple(float(m) for m in memory)
    return Law(function.__name__, function, dict(parameters or {}), start, navigates=navigates)


class FirstClass(types.WrapperAddressProtocol):
    """A compiled law as the loop takes it: an address and a signature, so the loop is compiled
    once for all laws and its code is found in the cache by every process."""

    def __init__(self, dispatcher):
        from numba.experimental.function_type import _get_wrapper_address

        self._keep = dispatcher
        self._address = _get_wrapper_address(dispatcher, SIGNATURE)

    def __wrapper_address__(self):
        return self._address

    def signature(self):
        return SIGNATURE


@functools.cache
def compile_law(function: Callable):
    """The function compiled against `SIGNATURE`; ValueError with one clear line if it does not.

    Code of a user's file is cached under a hash of all Python files beside it.
    """
    plain = getattr(function, "py_func", function)
    if not engine.COMPILED:
        return plain
    count = len(inspect.signature(plain).parameters)
    if count != 3:
        raise ValueError(f"{_must_compile(plain)}; received one that takes {count} arguments")
    source = Path(inspect.getsourcefile(plain) or "")
    own = engine.is_own(plain) or not source.is_file()
    with contextlib.nullcontext() if own else engine.cache_of(_beside(source)):
        return _compiled(plain, source.is_file())


def _compiled(plain: Callable, cacheable: bool) -> FirstClass:
    options = {"error_model": "numpy", "fastmath": {"contract"}, "cache": cacheable}
    try:
        return FirstClass(numba.njit(SIGNATURE, **options)(plain))
    except numba.core.errors.NumbaError as error:
        lines = [line.strip() for line in str(error).splitlines() if line.strip()]
        told = [line for line in lines if not line.startswith(("Failed", "During", "File", "<"))]
        raise ValueError(f"{_must_compile(plain)}; received: {(told or lines)[0][:200]}") from None


def _must_compile(plain: Callable) -> str:
    return f"law {plain.__name__}: must compile as (measured, parameters, memory) -> (mx, my, mz)"


def _beside(file: Path) -> list[Path]:
    """All Python files of a file's folder: what it may import."""
    return sorted(file.parent.glob("*.py"))


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
    with engine.cache_of(_beside(file)):
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
    except Exception as error:
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
    return Law(name, chosen, {}, (0.0,) * 16, compiled=False)
