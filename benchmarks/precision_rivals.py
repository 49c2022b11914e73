"""SciPy and heyoka on the tasks of the work-precision benchmark that they can be given.

What differs, and for or against whom:
- SciPy's DOP853 calls a Python function for the rates; that of tip-off is compiled, from this
  package's own kernels, and reads its tables of the environment.
- heyoka's Taylor method is compiled for the very equations of the task: no sensors, no laws, no
  records; the orbit is two functions of time where the others read a table. The time that heyoka
  compiles, 0.2 to 3 s for each tolerance, is not counted.
"""

import importlib.util
import math
import time
from collections.abc import Iterator
from functools import partial

import numba
import numpy as np
from precision_equations import gyrostat_of, rates
from precision_own import Way
from precision_tasks import Task
from scipy.integrate import solve_ivp

from torquer.maths.geometry.motion import Motion
from torquer.maths.geometry.quaternion import rotate_inverse
from torquer.simulation.propagate.forces import environment_at
from torquer.simulation.setup.run import prepare
from torquer.spacecraft.body import motion_rates

SCIPY_TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
#: Each takes 5 to 10 s with B-dot.
SCIPY_BDOT_TOLERANCES = (1e-8, 1e-11)
HEYOKA_TOLERANCES = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11, 1e-13, 2.2e-16)


def scipy_ways(task: Task) -> Iterator[Way]:
    """SciPy on gyrostats, and on tip-off at 10 deg/s."""
    body = gyrostat_of(task)
    if body is not None:
        y = [0.0, 0.0, 0.0, 1.0, *task.rate]
        for tolerance in SCIPY_TOLERANCES:
            fly = partial(_scipy_from_mark_to_mark, task, body, y, tolerance)
            yield Way("scipy", tolerance, fly)
    elif task.data["control"]["law"]["kind"] == "bdot_rate" and max(task.rate) > 0.1:
        for tolerance in SCIPY_BDOT_TOLERANCES:
            yield Way("scipy", tolerance, partial(_scipy_bdot, task, tolerance))


def _scipy(function, t, until, y, tolerance):
    found = solve_ivp(
        function, (t, until), y, method="DOP853", rtol=max(tolerance, 3e-14), atol=1e-3 * tolerance
    )
    return found.y[:, -1]


def _scipy_from_mark_to_mark(task, body, y, tolerance):
    function = partial(rates, body, math.cos, math.sin)
    attitudes, t, start = [], 0.0, time.process_time()
    for until in task.times_s:
        y, t = _scipy(function, t, until, y, tolerance), until
        attitudes.append(y[:4] / np.linalg.norm(y[:4]))
    return time.process_time() - start, np.array(attitudes)


@numba.njit
def _rates_with_coils(t, y, rigid, tables, dipole):
    motion = Motion((y[0], y[1], y[2], y[3]), (y[4], y[5], y[6]))
    rate = motion_rates(rigid, environment_at(tables, t), dipole, motion, ())
    q, w = rate.q, rate.omega
    return np.array((q[0], q[1], q[2], q[3], w[0], w[1], w[2]))


@numba.njit
def _dipole(t, y, tables, gain, limit):
    """Command of B-dot, scaled to the limit of the coils."""
    bx, by, bz = rotate_inverse((y[0], y[1], y[2], y[3]), environment_at(tables, t).b_t)
    x, y_, z = y[4], y[5], y[6]
    wanted = gain * np.array((y_ * bz - z * by, z * bx - x * bz, x * by - y_ * bx))
    wanted = wanted / max(1.0, np.abs(wanted).max() / limit)
    return (wanted[0], wanted[1], wanted[2])


def _scipy_bdot(task, tolerance):
    """From control step to control step."""
    run = prepare(task.scenario(task.references[0]))
    rigid, tables = run.dynamics.rigid, run.piece.moving
    gain = task.data["control"]["law"]["gain_a_m2_s_per_t"]
    limit, hold_s = task.data["spacecraft"]["coils"]["limit_a_m2"], task.data["control"]["sample_s"]
    y, attitudes = run.state.cells.view(np.float64).ravel()[:7].copy(), []
    _rates_with_coils(0.0, y, rigid, tables, _dipole(0.0, y, tables, gain, limit))  # compiled here
    start = time.process_time()
    for step in range(round(task.duration_s / hold_s)):
        t = step * hold_s
        dipole = _dipole(t, y, tables, gain, limit)
        function = partial(_rates_with_coils, rigid=rigid, tables=tables, dipole=dipole)
        y = _scipy(function, t, t + hold_s, y, tolerance)
        if (step + 1) % round(task.record_s / hold_s) == 0:
            attitudes.append(y[:4] / np.linalg.norm(y[:4]))
    return time.process_time() - start, np.array(attitudes)


def heyoka_ways(task: Task) -> Iterator[Way]:
    """heyoka on gyrostats, where it is installed."""
    body = gyrostat_of(task)
    if body is None or importlib.util.find_spec("heyoka") is None:
        return
    import heyoka

    state = heyoka.make_vars("x", "y", "z", "s", "p", "q", "r")
    system = list(zip(state, rates(body, heyoka.cos, heyoka.sin, heyoka.time, state), strict=True))
    first = [0.0, 0.0, 0.0, 1.0, *task.rate]
    for tolerance in HEYOKA_TOLERANCES:
        integrator = heyoka.taylor_adaptive(system, first, tol=tolerance)
        yield Way("heyoka", tolerance, partial(_heyoka, task, integrator, first))


def _heyoka(task, integrator, first):
    integrator.time, integrator.state[:] = 0.0, first
    attitudes, start = [], time.process_time()
    for until in task.times_s:
        integrator.propagate_until(until)
        attitudes.append(integrator.state[:4] / np.linalg.norm(integrator.state[:4]))
    return time.process_time() - start, np.array(attitudes)
