"""Gauss's collocation method of order 12 for matrices x' = A(t) x, refined until it converges.

Six stages a step, found from one linear system. The method is implicit, so that strong damping
needs no short steps, and keeps quadratic invariants: canonical equations stay canonical, and
the determinant of a traceless A of order 2 stays 1.
"""

import functools
import math
from typing import NamedTuple

import numpy as np

from torquer.compile.engine import inlined, kernel, released

STAGES = 6


@functools.cache
def gauss_rule(stages: int = STAGES) -> np.ndarray:
    """Weights a `[s, s]`, then b and the nodes c on [0, 1] as two more rows (read only)."""
    points, weights = np.polynomial.legendre.leggauss(stages)
    nodes = 0.5 * (points + 1.0)
    rule = np.empty((stages + 2, stages))
    rule[stages], rule[stages + 1] = 0.5 * weights, nodes
    within = np.multiply.outer(nodes, nodes)  # the rule itself integrates from 0 to each node
    for j in range(stages):
        others = np.delete(nodes, j)
        basis = np.prod((within[..., None] - others) / (nodes[j] - others), axis=-1)
        rule[:stages, j] = nodes * (basis @ rule[stages])
    return rule


class Workspace(NamedTuple):
    """The rule, and room for the matrix at the stages, their linear system, and a coarse result."""

    rule: np.ndarray
    at_stages: np.ndarray
    lhs: np.ndarray
    rhs: np.ndarray
    coarse: np.ndarray


def workspace(n: int) -> Workspace:
    """What the kernels need for systems of order n."""
    size = STAGES * n
    empty = np.empty
    return Workspace(
        gauss_rule(), empty((STAGES, n, n)), empty((size, size)), empty((size, n)), empty((n, n))
    )


@kernel
def _set_up(matrix, parameters, t, h, y, work):
    """Linear system of the stages' derivatives k: k_i - h A_i sum_j a_ij k_j = A_i y."""
    n, stages = y.shape[0], work.at_stages.shape[0]
    for i in range(stages):
        a = work.at_stages[i]
        matrix(t + h * work.rule[stages + 1, i], parameters, a)
        for r in range(n):
            row = i * n + r
            for j in range(stages):
                factor = -h * work.rule[i, j]
                for c in range(n):
                    work.lhs[row, j * n + c] = factor * a[r, c]
            work.lhs[row, row] += 1.0
            for c in range(n):
                work.rhs[row, c] = 0.0
            for k in range(n):
                factor = a[r, k]
                for c in range(n):
                    work.rhs[row, c] += factor * y[k, c]


@inlined
def _swap_rows(a, p, q):
    for c in range(a.shape[1]):
        a[p, c], a[q, c] = a[q, c], a[p, c]


@kernel
def solve_in_place(lhs, rhs):
    """Gauss's elimination with row pivoting; the solution replaces `rhs`."""
    size, columns = rhs.shape
    for k in range(size):
        pivot = k
        for i in range(k + 1, size):
            if abs(lhs[i, k]) > abs(lhs[pivot, k]):
                pivot = i
        if pivot != k:
            _swap_rows(lhs, pivot, k)
            _swap_rows(rhs, pivot, k)
        inverse = 1.0 / lhs[k, k]
        for i in range(k + 1, size):
            factor = lhs[i, k] * inverse
            if factor != 0.0:
                for c in range(k + 1, size):
                    lhs[i, c] -= factor * lhs[k, c]
                for c in range(columns):
                    rhs[i, c] -= factor * rhs[k, c]
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            factor = lhs[i, k]
            for c in range(columns):
                rhs[i, c] -= factor * rhs[k, c]
        inverse = 1.0 / lhs[i, i]
        for c in range(columns):
            rhs[i, c] *= inverse


@kernel
def transition(matrix, parameters, start, span, steps, work, out):
    """Matrix from x(start) to x(start + span) by `steps` equal steps, into `out`."""
    n, stages = out.shape[0], work.at_stages.shape[0]
    for i in range(n):
        for j in range(n):
            out[i, j] = 1.0 if i == j else 0.0
    h = span / steps
    for step in range(steps):
        _set_up(matrix, parameters, start + step * h, h, out, work)
        solve_in_place(work.lhs, work.rhs)
        for i in range(stages):
            weight = h * work.rule[stages, i]
            for r in range(n):
                for c in range(n):
                    out[r, c] += weight * work.rhs[i * n + r, c]


@inlined
def _copy(a, out):
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            out[i, j] = a[i, j]


@inlined
def _greatest(a, b):
    """Greatest |a - b| and |a|; infinite if an entry of a is not a finite number."""
    change = size = 0.0
    for i in range(a.shape[0]):
        for j in range(a.shape[0]):
            if not abs(a[i, j]) < np.inf:
                return np.inf, np.inf
            size = max(size, abs(a[i, j]))
            change = max(change, abs(a[i, j] - b[i, j]))
    return change, size


@kernel
def converge(matrix, parameters, control, work, out):
    """Take more steps until the transition matrix converges; return (relative error, steps).

    `control` = (start, span, tolerance, most steps). If r times the steps change the matrix by d,
    the error left by a method of order p is d / (r^p - 1); the next number of steps follows from
    it, at most fourfold. The finer matrix is kept as it is, not extrapolated, for its
    determinant. Error and matrix are NaN if the steps run out or an entry is not finite.
    """
    start, span, tolerance, most = control
    order = 2.0 * work.at_stages.shape[0]
    steps, following = 2, 4
    transition(matrix, parameters, start, span, steps, work, out)
    while following <= most:
        _copy(out, work.coarse)
        ratio = following / steps
        steps = following
        transition(matrix, parameters, start, span, steps, work, out)
        change, size = _greatest(out, work.coarse)
        error = change / ((ratio**order - 1.0) * size) if size > 0.0 else 0.0
        if error <= tolerance and size < np.inf:
            return error, steps
        growth = min(4.0, (2.0 * error / tolerance) ** (1.0 / order)) if error < 1.0 else 4.0
        following = max(steps + 1, math.ceil(growth * steps))
    for i in range(out.shape[0]):
        for j in range(out.shape[0]):
            out[i, j] = np.nan
    return np.nan, steps


@released
def converge_many(matrix, base, columns, table, control, work, out, errors, steps):
    """`converge` at every row of `table`, whose numbers replace those of `base` at `columns`.

    Releases the GIL while it runs.
    """
    parameters = base.copy()
    for point in range(table.shape[0]):
        for c in range(columns.size):
            parameters[columns[c]] = table[point, c]
        errors[point], steps[point] = converge(matrix, parameters, control, work, out[point])
