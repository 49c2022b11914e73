"""Integration of the averaged motion, and maps of where it leads, on all cores."""

import math
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import NamedTuple

import numpy as np

from torquer.base import validate
from torquer.base.cores import cores
from torquer.compile.engine import kernel, released
from torquer.computer.blocks.law import Law
from torquer.maths.geometry.vec3 import put_row
from torquer.maths.integrate.dop853 import (
    DONE,
    MOST_STEPS,
    TOO_MANY_STEPS,
    dop853,
    rates,
    rates_of,
    workspace,
)
from torquer.theory.slow.averaging import (
    AveragedMotion,
    Nodes,
    averaged_motion,
    converged_nodes,
    convergence_note,
    greatest_relative_rate,
    inside,
)
from torquer.theory.slow.evolution.model import Case, Evolution, Slow, compile_rates
from torquer.theory.slow.orbit_field import OrbitField
from torquer.theory.slow.slow_result import (
    SlowMotion,
    drift_notes,
    drifts,
    exit_notes,
    in_range,
    validity_notes,
)
from torquer.theory.slow.spinner import Setting, Spinner
from torquer.theory.validity import (
    POLE,
    PRECESSION,
    TOLERANCE,
    Limit,
    broken_limits,
    check_slow,
    within,
)


class ClosedMotion(NamedTuple):
    """Closed averaged equations as a problem for DOP853, in u; state l, rho, sigma, theta."""

    rates: object
    case: Case


@rates_of(ClosedMotion)
def _closed_rates(problem, t, y, dy):
    if inside(y):
        dy[0], dy[1], dy[2], dy[3] = problem.rates(Slow(y[0], y[1], y[2], y[3]), problem.case)
    else:
        dy[0] = dy[1] = dy[2] = dy[3] = math.nan


@kernel
def sample(problem, u, y, rtol, work, out):
    """States at the points `u` from y at u[0], into the rows of `out`.

    Returns the status of `dop853`, the number of points that were reached, and u where it stopped.
    The absolute tolerance is that for angles: a hundredth of the relative one.
    """
    h = 0.0
    put_row(out[0], y)
    for i in range(1, u.size):
        status, ended, h, _ = dop853(problem, u[i - 1], u[i], y, rtol, 0.01 * rtol, h, work)
        if status != DONE:
            return status, i, ended
        put_row(out[i], y)
    return DONE, u.size, u[-1]


def _row(u) -> np.ndarray:
    u = validate.finite("u", u)
    if u.ndim != 1 or u.size < 1:
        raise ValueError(f"u: must be a row of numbers; received shape {u.shape}")
    return np.ascontiguousarray(u)


def follow_path(problem, start, u, rtol: float = 1e-10) -> np.ndarray:
    """States [n, size] of any problem at the points `u`, from `start` at the first.

    RuntimeError if the integration fails: a singular point of the variables is reached, or the
    motion is too fast for the points.
    """
    u, y = _row(u), np.array(start, dtype=np.float64)
    within(TOLERANCE, rtol)
    out = np.empty((u.size, y.size))
    status, reached, ended = sample(problem, u, y, rtol, workspace(y.size), out)
    if status == TOO_MANY_STEPS:
        raise RuntimeError(_too_fast(u, reached, ended))
    if reached < u.size:
        raise RuntimeError(
            f"motion: must stay away from the singular points of its variables; it reached "
            f"one, or overflowed, between u = {u[reached - 1]:.6g} and {u[reached]:.6g}"
        )
    return out


def evolve(evolution: Evolution, case: Case, start: Slow, u, rtol: float = 1e-10) -> SlowMotion:
    """Slow variables along the points `u` (arrays) by a law's closed equations.

    The equations are those of first-order averaging: good to about 0.4 of `Evolution.change`
    over u = 1/eps, which is noted where it passes a tenth. ValueError where the
    equations are not those of the case (`Evolution.checked`), and for a motion too fast for the
    points.
    """
    check_slow(start)
    case = evolution.checked(start, case)
    path, ended = _slow_path(ClosedMotion(compile_rates(evolution.rates), case), start, u, rtol)
    drift = drifts(evolution, case, path, rtol)
    change = evolution.change(path, case)
    notes = (
        *exit_notes(ended, path),
        *validity_notes(change, case.eps),
        *drift_notes(drift, case.eps),
    )
    return SlowMotion(*path, u=_row(u), ended=ended, drift=drift, notes=notes)


def evolve_law(
    law: Law, spinner: Spinner, start: Slow, u, rtol: float = 1e-10, at: Nodes | None = None
) -> SlowMotion:
    """Slow variables along the points `u` (arrays) by averaging a law as the integration goes.

    `notes` has a momentum that changes fast at some phase, a slow precession, too few nodes.
    ValueError for a motion too fast for the points.
    """
    check_slow(start)
    problem = averaged_motion(law, spinner, at)
    path, ended = _slow_path(problem, start, u, rtol)
    slowest = Slow(*(float(x[np.nanargmin(path.l)]) for x in path))
    change = max(
        greatest_relative_rate(problem, _floats(start)), greatest_relative_rate(problem, slowest)
    )
    precession = (PRECESSION, abs(spinner.eta[1]) * slowest.l)
    caveats = (
        *validity_notes(change),
        *broken_limits(precession),
        *convergence_note(law, spinner, start, problem.nodes),
    )
    return SlowMotion(*path, u=_row(u), ended=ended, notes=(*exit_notes(ended, path), *caveats))


def _floats(slow) -> Slow:
    return Slow(*map(float, slow))


def _slow_path(problem, start, u, rtol) -> tuple[Slow, float | None]:
    """The path within its domain, and where it left it."""
    u, y, work = _row(u), _off_pole(problem, start), workspace(4)
    within(TOLERANCE, rtol)
    out, first = np.full((u.size, 4), np.nan), y.copy()
    status, reached, ended = sample(problem, u, first, rtol, work, out)
    if status == TOO_MANY_STEPS:
        raise ValueError(_too_fast(u, reached, ended))
    out[reached:] = np.nan
    return in_range(out.T, rtol), None if status == DONE else float(ended)


def _too_fast(u, reached, ended) -> str:
    return (
        f"u: a motion must need at most {MOST_STEPS} steps between two points; received "
        f"{u[reached - 1]:.6g} and {u[reached]:.6g}, between which it came to {ended:.6g}"
    )


@kernel
def rates_at(problem, y, dy):
    """Derivatives at a state, into `dy`."""
    rates(problem, 0.0, y, dy)


def _off_pole(problem, start) -> np.ndarray:
    """The start; a motion that leaves the third axis starts off it by POLE, along its meridian.

    On the axis sigma is arbitrary, so that it may be the meridian's; any other would turn by about
    pi/2 within a step of that size.
    """
    y, dy = np.array(start, dtype=np.float64), np.empty(4)
    if math.sin(y[1]) < POLE:
        y[1] = max(y[1], 1e-300)
        rates_at(problem, y, dy)
        if not abs(dy[2]) <= 1.0:
            y[1] = min(max(y[1], POLE), math.pi - POLE)
            rates_at(problem, y, dy)
            outwards = dy[1] if y[1] < 1.0 else -dy[1]
            y[2] += math.atan2(math.sin(y[1]) * dy[2], outwards)
    return y


@kernel
def _case(c):
    """Constants of equations from a row: eps, C/A, six moments, target."""
    return Case(c[0], c[1], (c[2], c[3], c[4], c[5], c[6], c[7]), (c[8], c[9], c[10]))


@released
def closed_ends(rates, constants, states, u_end, rtol, work, first, last):
    """Move the rows first..last-1 of `states` from u = 0 to u_end; NaN where it fails.

    Rows of `constants`: those of `_case`.
    """
    for row in range(first, last):
        y = states[row]
        problem = ClosedMotion(rates, _case(constants[row]))
        ended = dop853(problem, 0.0, u_end, y, rtol, 0.01 * rtol, 0.0, work)
        if ended[0] != DONE:
            y[:] = np.nan


@released
def averaged_ends(law, parameters, settings, memory, at, states, u_end, rtol, work, first, last):
    """Move the rows first..last-1 of `states` from u = 0 to u_end by the averages of a law; NaN
    where it fails. Each state has a row of parameters and one of settings.

    Rows of `settings`: model, strength, angle and tilt of the field, then the other numbers of
    `Setting` in order.
    """
    for row in range(first, last):
        c, y = settings[row], states[row]
        field = OrbitField(int(c[0]), c[1], c[2], c[3])
        setting = Setting(field, c[4], c[5], c[6], c[7], c[8], c[9], (c[10], c[11], c[12]))
        problem = AveragedMotion(law, parameters[row], memory, setting, at)
        ended = dop853(problem, 0.0, u_end, y, rtol, 0.01 * rtol, 0.0, work)
        if ended[0] != DONE:
            y[:] = np.nan


#: Axes of a map: orbit, start, gain.
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
    """States at the start, l = 1."""
    for name in ("rho_deg", "theta_deg"):
        within(Limit(name, 0.0, 180.0), columns[name])
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


def _check_span(u_end, rtol) -> None:
    validate.finite("u_end", u_end, ())
    within(TOLERANCE, rtol)


def _at_poles(states) -> np.ndarray:
    return np.flatnonzero(np.sin(states[:, 1]) < POLE)


def _move(ends, states, shape, u_end, rtol, workers) -> Slow:
    """The states, moved by `ends` on all cores, as arrays of a shape."""
    workers = cores() if workers is None else workers
    with ThreadPoolExecutor(workers) as pool:
        parts = [
            pool.submit(ends, states, u_end, rtol, workspace(4), *part)
            for part in _parts(len(states), workers)
        ]
        for part in parts:
            part.result()
    return Slow(*(x.reshape(shape) for x in in_range(states.T, rtol)))


def map_evolution(
    evolution: Evolution,
    axes: Mapping,
    fixed: Mapping,
    u_end: float,
    *,
    spinner: Spinner | None = None,
    target=None,
    rtol: float = 1e-8,
    workers: int | None = None,
) -> Slow:
    """Slow variables after `u_end` [rad] over a grid, by closed equations; arrays of its shape.

    `axes`: rows of values for some of `AXES`; `fixed`: the others' values. Start: l = 1. `spinner`
    gives C/A and the field's model; `target` as `Evolution.case` takes it. NaN where the motion
    meets a singular point or needs more than `MOST_STEPS` steps.
    """
    spinner = spinner or Spinner(inclination_deg=0.0)
    columns, shape = _grid(axes, fixed)
    target = evolution.case(1.0, spinner, target).target  # ValueError for an unfit field
    constants = np.empty((len(columns["eps"]), 11))
    constants[:, 0], constants[:, 1], constants[:, 8:] = columns["eps"], spinner.ratio, target
    constants[:, 2:8] = _per_inclination(spinner, columns, lambda there: there.moments())
    states, rates = _starts(columns), compile_rates(evolution.rates)
    _check_span(u_end, rtol)
    evolution.checked(Slow(*states.max(axis=0)), _case(constants[0]))
    for row in _at_poles(states):
        states[row] = _off_pole(ClosedMotion(rates, _case(constants[row])), states[row])
    ends = partial(closed_ends, rates, constants)
    return _move(ends, states, shape, u_end, rtol, workers)


def map_law(
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
    """Slow variables after `u_end` over a grid for any law, averaged as the integration goes.

    `eps` multiplies the law's parameter named by `gain`; 1 takes the law as it is. Without nodes
    `at` the fewest that converge are found first.
    """
    spinner = spinner or Spinner(inclination_deg=0.0)
    columns, shape = _grid(axes, fixed)
    states, places = _starts(columns), law.places()
    if gain not in places:
        known = ", ".join(places) or "none"
        raise ValueError(f"gain: must name a parameter of law {law.name}: {known}; received {gain}")

    at = converged_nodes(law, spinner) if at is None else at
    problem = averaged_motion(law, spinner, at)
    _check_span(u_end, rtol)
    for row in _at_poles(states):
        states[row] = _off_pole(problem, states[row])
    parameters = np.tile(problem.parameters, (len(states), 1))
    parameters[:, places[gain][0]] *= columns["eps"]
    settings = _per_inclination(spinner, columns, lambda there: _flat(there.pack()))
    ends = partial(averaged_ends, problem.law, parameters, settings, problem.memory, at)
    return _move(ends, states, shape, u_end, rtol, workers)


def _flat(setting) -> tuple:
    return (*setting.field, *setting[1:-1], *setting.sun)
