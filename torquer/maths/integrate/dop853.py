"""Adaptive Dormand-Prince method of order 8(5,3) for smooth problems, without allocation.

A problem is a NamedTuple of constants; `rates_of` gives its class a right-hand side, found by
type when the integrator is compiled. (A function handed over as an argument would be called
through a pointer, and the compiled code could not be cached.)
"""

import functools
import inspect
from typing import NamedTuple

import numpy as np

from torquer.compile import engine
from torquer.compile.engine import keep_off_disk, kernel
from torquer.compile.when_compiling import when_compiling
from torquer.maths.integrate import dop853_tableau as tableau

#: Return values of `dop853`.
DONE, TOO_MANY_STEPS, STEP_TOO_SMALL = 0, 1, 2


@functools.singledispatch
def rates(problem, t, y, dy):
    """Write dy/dt of a problem at time t and state y into `dy`."""
    raise TypeError(f"dop853: must have rates_of({type(problem).__name__}); received none")


_ARGUMENTS = ["problem", "t", "y", "dy"]


def rates_of(problem_class):
    """Decorator: `function(problem, t, y, dy)` is the right-hand side of this class.

    The arguments must have these names (TypeError otherwise).
    """

    def register(function):
        given = list(inspect.signature(function).parameters)
        if given != _ARGUMENTS:
            raise TypeError(
                f"rates_of: {function.__name__} must have the arguments {', '.join(_ARGUMENTS)}; "
                f"received {', '.join(given)}"
            )
        if not engine.is_own(function):
            # the key of the compiled cache does not see that file: an edit would go unnoticed
            keep_off_disk(_attempt, dop853)
        rates.register(problem_class)(function)

        @when_compiling
        def choose_it() -> None:
            from numba.extending import overload

            @overload(rates, jit_options=engine.OPTIONS)
            def choose(problem, t, y, dy):
                return function if getattr(problem, "instance_class", 0) is problem_class else None

        return function

    return register


#: Most steps of a call: some seconds.
MOST_STEPS = 1_000_000


class Workspace(NamedTuple):
    """Tableau and scratch memory: kernels cannot hold large constants if they are to be cached.

    `tableau`: rows of A, then B, C and the weights of the two error estimates. `rows`: the 13
    derivatives, then the new and the trial point.
    """

    tableau: np.ndarray
    rows: np.ndarray


_B, _C, _ERROR_5, _ERROR_3 = 12, 13, 14, 15
_NEW, _TRIAL = 13, 14


def workspace(n: int) -> Workspace:
    """What `dop853` needs for n equations."""
    table = np.zeros((16, 13))
    table[:12, :12], table[_B, :12], table[_C, :12] = tableau.A, tableau.B, tableau.C
    table[_ERROR_5], table[_ERROR_3] = tableau.ERROR_5, tableau.ERROR_3
    return Workspace(table, np.empty((15, n)))


@kernel
def _error_norm(work, h, y, rtol, atol):
    """Hairer's combined estimate of orders 5 and 3 as a multiple of what is allowed."""
    sum5 = sum3 = 0.0
    for i in range(y.size):
        allowed = atol + rtol * max(abs(y[i]), abs(work.rows[_NEW, i]))
        e5 = e3 = 0.0
        for s in range(13):
            e5 += work.tableau[_ERROR_5, s] * work.rows[s, i]
            e3 += work.tableau[_ERROR_3, s] * work.rows[s, i]
        sum5 += (e5 / allowed) ** 2
        sum3 += (e3 / allowed) ** 2
    weight = (sum5 + 0.01 * sum3) * y.size
    if weight == 0.0:  # also where 0.01 sum3 underflows
        return 0.0
    return abs(h) * sum5 / np.sqrt(weight)


@kernel
def _attempt(problem, t, y, h, work):
    """Fill the stages of one step and the new point from the derivative in stage 0."""
    for s in range(1, 12):
        for i in range(y.size):
            total = 0.0
            for j in range(s):
                total += work.tableau[s, j] * work.rows[j, i]
            work.rows[_TRIAL, i] = y[i] + h * total
        rates(problem, t + work.tableau[_C, s] * h, work.rows[_TRIAL], work.rows[s])
    for i in range(y.size):
        total = 0.0
        for s in range(12):
            total += work.tableau[_B, s] * work.rows[s, i]
        work.rows[_NEW, i] = y[i] + h * total
    rates(problem, t + h, work.rows[_NEW], work.rows[12])


@kernel
def dop853(problem, t, t_end, y, rtol, atol, h, work):
    """Integrate y' = rates from t to t_end, in place; return (status, t reached, next step, steps).

    `problem` is a NamedTuple whose class has its `rates_of`; `h` is the first step to try
    (0: chosen here); `work` comes from `workspace(y.size)`. Error per step below atol + rtol |y|
    (atol > 0 unless no component ever vanishes). On failure y is the state at the t reached.
    """
    rates(problem, t, y, work.rows[0])
    span = t_end - t
    if h == 0.0:
        scale_y = scale_f = 0.0
        for i in range(y.size):
            allowed = atol + rtol * abs(y[i])
            scale_y += (y[i] / allowed) ** 2
            scale_f += (work.rows[0, i] / allowed) ** 2
        h = span if scale_f == 0.0 else 0.01 * np.sqrt(scale_y / scale_f)
        if h == 0.0:
            h = 1e-6 * abs(span)
    h = min(abs(h), abs(span))
    sign = 1.0 if span >= 0.0 else -1.0
    for steps in range(MOST_STEPS):
        left = abs(t_end - t)
        if left <= 1e-15 * max(abs(t), abs(t_end)):
            return DONE, t, h, steps
        step = sign * min(h, left)
        _attempt(problem, t, y, step, work)
        error = _error_norm(work, step, y, rtol, atol)
        if error <= 1.0:
            t = t_end if h >= left else t + step
            for i in range(y.size):
                y[i] = work.rows[_NEW, i]
                work.rows[0, i] = work.rows[12, i]
            growth = 6.0 if error == 0.0 else min(6.0, 0.9 * error ** (-1.0 / 8.0))
            h = max(h, abs(step) * growth) if h >= left else abs(step) * growth
        else:  # also reached by an error that is not a number
            h = abs(step) * max(0.333, 0.9 * error ** (-1.0 / 8.0)) if error < 1e30 else 0.1 * h
            if not h >= 1e-14 * max(abs(t), abs(span)):
                return STEP_TOO_SMALL, t, h, steps
    return TOO_MANY_STEPS, t, h, MOST_STEPS
