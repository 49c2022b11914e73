"""Floquet's theory by computer: monodromy, multipliers and charts of x' = A(t) x, A periodic.

A system is a function `A(t, parameters, out)` that fills the matrix `out`; it is compiled once and
handed to one common integrator (`theory.collocation`), which is not compiled again.

    @periodic_system(order=2, period=math.pi, parameters={"a": 1.0, "q": 0.1})
    def mathieu(t, parameters, out):
        out[0, 0], out[0, 1] = 0.0, 1.0
        out[1, 0], out[1, 1] = 2.0 * parameters[1] * math.cos(2.0 * t) - parameters[0], 0.0

    chart(mathieu, x=("a", np.linspace(0, 5, 200)), y=("q", np.linspace(0, 2, 200)))
"""

import math
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import NamedTuple

import numpy as np
import xarray as xr

from torquer.base import validate
from torquer.base.cores import cores
from torquer.compile import engine
from torquer.theory.periodic.collocation import converge_many, workspace
from torquer.theory.periodic.periodic_systems import PeriodicSystem, compile_matrix
from torquer.theory.validity import Limit, within

#: A thread takes this over order^2 points at a time: about 10 ms, long enough to hide the dispatch
#: overhead.
CHUNK = 2000
Progress = Callable[[int, int], None]
PERIOD = Limit("period", 0.0, open=True)


class Transitions(NamedTuple):
    """Transition matrices `[points, n, n]`; their estimated relative errors; steps taken.

    NaN at a point that did not converge within the greatest number of steps.
    """

    matrices: np.ndarray
    errors: np.ndarray
    steps: np.ndarray


def transitions(
    system: PeriodicSystem,
    values: Mapping[str, np.ndarray] | None = None,
    *,
    start: float = 0.0,
    span: float | None = None,
    tolerance: float = 1e-10,
    most_steps: int = 1 << 14,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Transitions:
    """Matrices that take x(start) to x(start + span), one for each row of `values`.

    `values` maps names of parameters to arrays `[points]`, and "data" to `[points, len(data)]`;
    other parameters keep the system's values. `span` is the period unless given. The error
    allowed is `tolerance` times the greatest entry. `progress(done, points)` is called from
    this thread. Without the compiler all is done in one thread.
    """
    if not (tolerance > 0.0 and most_steps >= 2):
        raise ValueError(
            f"transitions: tolerance must be positive and most_steps at least 2; "
            f"received {tolerance} and {most_steps}"
        )
    columns, table = _columns(system, values or {})
    span = system.period if span is None else float(span)
    task = _Task(system, columns, table, float(start), span, tolerance, most_steps)
    found = Transitions(*task.room())
    for done in _in_threads(task, found, workers or cores()):
        if progress is not None:
            progress(done, len(table))
    return found


class _Task(NamedTuple):
    system: PeriodicSystem
    columns: np.ndarray
    table: np.ndarray
    start: float
    span: float
    tolerance: float
    most_steps: int

    def room(self):
        points, n = len(self.table), self.system.order
        return np.empty((points, n, n)), np.empty(points), np.empty(points, dtype=np.int64)

    def run(self, rows: slice, found: Transitions) -> int:
        """Fill the rows of the result; how many they are."""
        converge_many(
            compile_matrix(self.system.function),
            self.system.pack(),
            self.columns,
            self.table[rows],
            (self.start, self.span, self.tolerance, self.most_steps),
            workspace(self.system.order),
            found.matrices[rows],
            found.errors[rows],
            found.steps[rows],
        )
        return rows.stop - rows.start


def _in_threads(task: _Task, found: Transitions, workers: int):
    """Yield the number of points done so far, as the chunks are ready."""
    points, size = len(task.table), max(1, CHUNK // task.system.order**2)
    chunks = [slice(i, min(i + size, points)) for i in range(0, points, size)]
    done = 0
    if workers == 1 or len(chunks) == 1 or not engine.COMPILED:
        for rows in chunks:
            done += task.run(rows, found)
            yield done
        return
    with ThreadPoolExecutor(workers) as pool:
        for ready in as_completed([pool.submit(task.run, rows, found) for rows in chunks]):
            done += ready.result()
            yield done


def _columns(system: PeriodicSystem, values: Mapping) -> tuple[np.ndarray, np.ndarray]:
    """Which numbers of the packed parameters change, and their values at every point."""
    columns, parts = [], []
    for name, given in values.items():
        array = validate.finite(f"{system.name}: {name}", given)
        places = system.places(name)
        wanted = 2 if name == "data" else 1
        if array.ndim != wanted or (wanted == 2 and array.shape[1] != len(places)):
            shape = f"(points, {len(places)})" if wanted == 2 else "(points,)"
            raise ValueError(
                f"{system.name}: {name} must have shape {shape}; received shape {array.shape}"
            )
        columns += places
        parts.append(array.reshape(len(array), -1))
    if len({len(part) for part in parts}) > 1:
        sizes = ", ".join(str(len(part)) for part in parts)
        raise ValueError(f"{system.name}: values must be equally long; received lengths {sizes}")
    table = np.hstack(parts) if parts else np.empty((1, 0))
    return np.array(columns, dtype=np.int64), np.ascontiguousarray(table)


def monodromy(system: PeriodicSystem, *, tolerance: float = 1e-12, **values: float) -> np.ndarray:
    """Monodromy matrix `[n, n]` at one point; ArithmeticError if it does not converge."""
    rows = {name: [value] for name, value in values.items()}
    found = transitions(system, rows, tolerance=tolerance)
    if not np.isfinite(found.errors[0]):
        raise ArithmeticError(
            f"{system.name}: the monodromy matrix must converge to {tolerance:g}; it did not "
            f"within {found.steps[0]} steps"
        )
    return found.matrices[0]


def multipliers(matrices: np.ndarray) -> np.ndarray:
    """Multipliers of monodromy matrices `[..., n, n]`, greatest modulus first.

    NaN where the matrix is NaN. An error e of the matrix moves an m-fold multiplier by
    about e^(1/m): at the edges of a tongue, where two meet, look at the trace instead.
    """
    matrices = np.asarray(matrices, dtype=np.float64)
    good = np.isfinite(matrices).all(axis=(-2, -1))
    found = np.full(matrices.shape[:-1], complex(math.nan, math.nan))
    found[good] = np.linalg.eigvals(matrices[good])
    return np.take_along_axis(found, np.argsort(-np.abs(found), axis=-1, kind="stable"), axis=-1)


def exponents(multipliers: np.ndarray, period: float) -> np.ndarray:
    """Characteristic exponents ln(multiplier) / period; imaginary parts within +-pi / period."""
    within(PERIOD, period)
    return np.log(np.asarray(multipliers, dtype=complex)) / period


def degree_of_stability(multipliers: np.ndarray, period: float) -> np.ndarray:
    """-max Re(characteristic exponent): decay rate of the slowest motion; negative if one grows."""
    within(PERIOD, period)
    with np.errstate(divide="ignore"):
        return -np.log(np.abs(multipliers)).max(axis=-1) / period


def chart(
    system: PeriodicSystem,
    x: tuple[str, np.ndarray],
    y: tuple[str, np.ndarray],
    *,
    tolerance: float = 1e-10,
    workers: int | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Stability over two parameters, on all cores: (name, values) each, y down the rows.

    Variables: `degree_of_stability` [1 / unit of t], `largest_multiplier` (modulus), `trace` of
    the monodromy matrix, and its estimated relative `error`; NaN where it did not converge.
    """
    (x_name, xs), (y_name, ys) = x, y
    if x_name == y_name:
        raise ValueError(f"chart: x and y must be two parameters; received {x_name!r} twice")
    xs, ys = validate.finite(x_name, xs), validate.finite(y_name, ys)
    grid_y, grid_x = np.meshgrid(ys, xs, indexing="ij")
    values = {x_name: grid_x.ravel(), y_name: grid_y.ravel()}
    found = transitions(system, values, tolerance=tolerance, workers=workers, progress=progress)
    rho = multipliers(found.matrices)
    fixed = {name: v for name, v in system.parameters.items() if name not in values}
    results = {
        "degree_of_stability": degree_of_stability(rho, system.period),
        "largest_multiplier": np.abs(rho).max(axis=-1),
        "trace": np.trace(found.matrices, axis1=1, axis2=2),
        "error": found.errors,
    }
    return xr.Dataset(
        {name: ((y_name, x_name), row.reshape(grid_x.shape)) for name, row in results.items()},
        coords={x_name: xs, y_name: ys},
        attrs={"system": system.name, "period": system.period, **fixed},
    )
