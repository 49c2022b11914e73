"""Integration of the averaged motion, and maps of where it leads, on all cores."""

import math
import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from torquer import validate
from torquer.control.law import Law
from torquer.engine import kernel, released
from torquer.integrate.dop853 import DONE, dop853, rates_of, workspace
from torquer.theory.averaging import AveragedMotion, Nodes, averaged_motion, settled_nodes
from torquer.theory.evolution.model import Case, Evolution, Slow, compile_rates
from torquer.theory.orbit_field import OrbitField
from torquer.theory.spinner import Setting, Spinner


class ClosedMotion(NamedTuple):
    """Closed averaged equations as a problem for DOP853, in u; state l, rho, sigma, theta."""

    rates: object
    case: Case


@rates_of(ClosedMotion)
def _closed_rates(problem, t, y, dy):
    dy[0], dy[1], dy[2], dy[3] = problem.rates(Slow(y[0], y[1], y[2], y[3]), problem.case)


@kernel
def sampled(problem, u, y, rtol, work, out):
    """States at the points `u` from y at u[0], into the rows of `out`; the status of DOP853.

    The absolute tolerance is that for angles: a hundredth of the relative one.
    """
    h = 0.0
    out[0] = y
    for i in range(1, u.size):
        status, h, _ = dop853(problem, u[i - 1], u[i], y, rtol, 0.01 * rtol, h, work)
        out[i] = y
        if status != DONE:
            return status
    return DONE


def path_of(problem, start, u, rtol: float = 1e-10) -> np.ndarray:
    """States [n, size] of any problem at the points `u`, from `start` at the first.

    RuntimeError if the integration fails (a singular point of the variables is reached).
    """
    u, y = validate.finite("u", u), np.array(start, dtype=np.float64)
    if u.ndim != 1 or u.size < 1:
        raise ValueError(f"u: must be a row of numbers; received shape {u.shape}")
    u, out = np.ascontiguousarray(u), np.empty((u.size, y.size))
    status = sampled(problem, u, y, rtol, workspace(y.size), out)
    if status != DONE:
        raise RuntimeError(f"slow motion: the integration ended with status {status}")
    return out


def evolve(evolution: Evolution, case: Case, start: Slow, u, rtol: float = 1e-10) -> Slow:
    """Slow variables along the points `u` (arrays) by a law's closed equations."""
    return _slow_path(ClosedMotion(compile_rates(evolution.rates), case), start, u, rtol)


def evolve_law(
    law: Law, spinner: Spinner, start: Slow, u, rtol: float = 1e-10, at: Nodes | None = None
) -> Slow:
    """Slow variables along the points `u` (arrays) by averaging a law as the integration goes."""
    return _slow_path(averaged_motion(law, spinner, at), start, u, rtol)


def _slow_path(problem, start, u, rtol) -> Slow:
    path = Slow(*path_of(problem, start, u, rtol).T)
    if not np.all(path.l > -rtol):  # a step may lead through the singular point l = 0
        raise RuntimeError("slow motion: the angular momentum must not vanish; it did")
    return path


@released
def closed_ends(rates, constants, states, u_end, rtol, work, first, last):
    """Move the rows first..last-1 of `states` from u = 0 to u_end; not a number where it fails.

    Rows of `constants`: eps, C/A, six moments, target.
    """
    for row in range(first, last):
        c, y = constants[row], states[row]
        moments = (c[2], c[3], c[4], c[5], c[6], c[7])
        case = Case(c[0], c[1], moments, (c[8], c[9], c[10]))
        problem = ClosedMotion(rates, case)
        ended = dop853(problem, 0.0, u_end, y, rtol, 0.01 * rtol, 0.0, work)
        if ended[0] != DONE or not y[0] > -rtol:
            y[:] = np.nan


@released
def averaged_ends(law, parameters, settings, memory, at, states, u_end, rtol, work, first, last):
    """The same by the averages of a law; a row of parameters and of settings for each state.

    Rows of `settings`: model, strength, angle and tilt of the field, then `Setting` in order.
    """
    for row in range(first, last):
        c, y = settings[row], states[row]
        field = OrbitField(int(c[0]), c[1], c[2], c[3])
        setting = Setting(field, c[4], c[5], c[6], c[7], c[8], c[9])
        problem = AveragedMotion(law, parameters[row], memory, setting, at)
        ended = dop853(problem, 0.0, u_end, y, rtol, 0.01 * rtol, 0.0, work)
        if ended[0] != DONE or not y[0] > -rtol:
            y[:] = np.nan


#: What a map can run over: orbit, start, gain.
AXES = ("inclination_deg", "rho_deg", "sigma_deg", "theta_deg", "eps")


def _grid(axes: Mapping, fixed: Mapping) -> tuple[dict, tuple]:
    """All points of a map as columns by name; ValueError with one clear line."""
    both = set(axes) & set(fixed)
    missing = [name for name in AXES if name not in axes and name not in fixed]
    unknown = [name for name in (*axes, *fixed) if name not in AXES]
    if both or missing or unknown:
        wrong = ", ".join(sorted(both) or missing or unknown)
        raise ValueError(
            f"map: each of {', '.join(AXES)} must be given once, fixed or as an axis; "
            f"received {'twice' if both else 'no' if missing else 'another name,'} {wrong}"
        )
    rows = [validate.finite(name, values) for name, values in axes.items()]
    if any(row.ndim != 1 for row in rows):
        raise ValueError("map: an axis must be a row of numbers")
    mesh = np.meshgrid(*rows, indexing="ij")
    columns = dict(zip(axes, (m.ravel() for m in mesh), strict=True))
    count = math.prod(len(row) for row in rows)
    columns |= {name: np.full(count, float(value)) for name, value in fixed.items()}
    return columns, tuple(len(row) for row in rows)


def _starts(columns) -> np.ndarray:
    angles = [np.radians(columns[name]) for name in ("rho_deg", "sigma_deg", "theta_deg")]
    return np.column_stack([np.ones_like(angles[0]), *angles])


def _per_inclination(spinner, columns, constants) -> np.ndarray:
    """A row of constants for each point, computed once for each inclination."""
    values, place = np.unique(columns["inclination_deg"], return_inverse=True)
    settings = (Spinner(**(dict(spinner) | {"inclination_deg": i})) for i in values.tolist())
    return np.array([constants(there) for there in settings])[place]


def _parts(count: int, workers: int) -> list[tuple[int, int]]:
    """Pieces of a batch, several per worker, so that all end together."""
    edges = np.linspace(0, count, min(count, 8 * workers) + 1).astype(int)
    return list(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True))


def _all_cores(task, parts, workers) -> None:
    with ThreadPoolExecutor(workers) as pool:
        for done in [pool.submit(task, *part) for part in parts]:
            done.result()


def _workers(workers: int | None) -> int:
    if workers is not None:
        return workers
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()


def map_of_evolution(
    evolution: Evolution,
    axes: Mapping,
    fixed: Mapping,
    u_end: float,
    *,
    spinner: Spinner | None = None,
    target=(0.0, 0.0, 1.0),
    rtol: float = 1e-8,
    workers: int | None = None,
) -> Slow:
    """Slow variables after `u_end` [rad] over a grid, by closed equations; arrays of its shape.

    `axes`: rows of values for some of `AXES`; `fixed`: the others' values. Start: l = 1. `spinner`
    gives C/A and the field's model. Not a number where the motion meets a singular point.
    """
    spinner, workers = spinner or Spinner(inclination_deg=0.0), _workers(workers)
    columns, shape = _grid(axes, fixed)
    count = len(columns["eps"])
    evolution.case(1.0, spinner)  # refuses a field that the equations are not for
    constants = np.empty((count, 11))
    constants[:, 0], constants[:, 1], constants[:, 8:] = columns["eps"], spinner.ratio, target
    constants[:, 2:8] = _per_inclination(spinner, columns, lambda there: there.moments())
    states, rates = _starts(columns), compile_rates(evolution.rates)

    def part(first, last):
        closed_ends(rates, constants, states, u_end, rtol, workspace(4), first, last)

    _all_cores(part, _parts(count, workers), workers)
    return Slow(*(states[:, k].reshape(shape) for k in range(4)))


def map_of_law(
    law: Law,
    axes: Mapping,
    fixed: Mapping,
    u_end: float,
    *,
    spinner: Spinner | None = None,
    gain: str = "gain",
    at: Nodes | None = None,
    rtol: float = 1e-8,
    workers: int | None = None,
) -> Slow:
    """The same for any law, averaged as the integration goes.

    `eps` multiplies the law's parameter named by `gain`; 1 takes the law as it is. Without nodes
    `at` the fewest that settle are found first.
    """
    spinner, workers = spinner or Spinner(inclination_deg=0.0), _workers(workers)
    columns, shape = _grid(axes, fixed)
    states, unit = _starts(columns), dict(law.parameters)
    if gain not in unit:
        known = ", ".join(unit) or "none"
        raise ValueError(f"gain: must name a parameter of law {law.name}: {known}; received {gain}")

    at = settled_nodes(law, spinner) if at is None else at
    problem = averaged_motion(law, spinner, at)
    parameters = np.tile(problem.parameters, (len(states), 1))
    parameters[:, list(unit).index(gain)] *= columns["eps"]
    settings = _per_inclination(spinner, columns, lambda there: _flat(there.pack()))

    def part(first, last):
        averaged_ends(
            problem.law,
            parameters,
            settings,
            problem.memory,
            at,
            states,
            u_end,
            rtol,
            workspace(4),
            first,
            last,
        )

    _all_cores(part, _parts(len(states), workers), workers)
    return Slow(*(states[:, k].reshape(shape) for k in range(4)))


def _flat(setting) -> tuple:
    return (*setting.field, *setting[1:])
