"""Smooth functions of time, tabulated once and read in nanoseconds.

The span is cut into equal segments; in each, a polynomial interpolates every channel at
Chebyshev-Lobatto points, so neighbours share a point and the table is continuous. The error
is checked against the function itself where the interpolation error peaks, in every segment,
and the segments are halved until the tolerance is met.
"""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from torquer.compile.engine import inlined, kernel

DEGREE = 5
#: Safety factor: the error may be greater between the check points than at them.
SAFETY = 1.5


class Table(NamedTuple):
    """Polynomials for kernels: coefficients [segment, power, channel] of x in [-1, 1].

    `start_s`: where the first segment begins, at the start of what is tabulated or before. Always
    `DEGREE` + 1 powers, so that the compiler can unroll the sums.
    """

    per_second: float
    coefficients: np.ndarray
    start_s: float = 0.0

    @property
    def segment_s(self) -> float:
        """Length of a segment [s]."""
        return 1.0 / self.per_second

    def times(self, segments: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Times [s] of places x in [-1, 1] within segments, segment by segment."""
        return self.start_s + (segments[:, None] + 0.5 * (1.0 + x)).ravel() * self.segment_s


@dataclass(frozen=True)
class ProvenTable:
    """A table, the verified bound on its relative error, and the number of evaluations."""

    table: Table
    relative_error: float
    evaluations: int


@inlined
def segment_at(table, t):
    """Segment of a time; the outermost ones extrapolate."""
    s = (t - table.start_s) * table.per_second
    return min(max(int(s), 0), table.coefficients.shape[0] - 1)


@inlined
def position_in(table, segment, t):
    """Position in [-1, 1] of a time in a segment."""
    return 2.0 * ((t - table.start_s) * table.per_second - segment) - 1.0


@inlined
def _place(table, t):
    """Segment and position x in [-1, 1] of a time."""
    segment = segment_at(table, t)
    return segment, position_in(table, segment, t)


@inlined
def lookup3(table, t):
    """The first three channels at time t [s]."""
    i, x = _place(table, t)
    c = table.coefficients
    u, v, w = c[i, DEGREE, 0], c[i, DEGREE, 1], c[i, DEGREE, 2]
    for down in range(1, DEGREE + 1):
        j = DEGREE - down
        u, v, w = u * x + c[i, j, 0], v * x + c[i, j, 1], w * x + c[i, j, 2]
    return (u, v, w)


@inlined
def lookup6(table, t, first):
    """Two vectors, of three channels from `first` and of the next three, at time t [s]."""
    segment, x = _place(table, t)
    return polynomials6(table.coefficients, segment, x, first)


@inlined
def polynomials6(coefficients, segment, x, first):
    """The same at a position x in [-1, 1] of a segment."""
    c, i, k = coefficients, segment, first
    u, v, w = c[i, DEGREE, k], c[i, DEGREE, k + 1], c[i, DEGREE, k + 2]
    p, q, r = c[i, DEGREE, k + 3], c[i, DEGREE, k + 4], c[i, DEGREE, k + 5]
    for down in range(1, DEGREE + 1):
        j = DEGREE - down
        u, v, w = u * x + c[i, j, k], v * x + c[i, j, k + 1], w * x + c[i, j, k + 2]
        p, q, r = p * x + c[i, j, k + 3], q * x + c[i, j, k + 4], r * x + c[i, j, k + 5]
    return (u, v, w), (p, q, r)


@inlined
def rate_from(table, t, first):
    """Time derivative [1/s] of the vector that begins at channel `first`."""
    i, x = _place(table, t)
    c = table.coefficients
    p = q = r = 0.0
    for down in range(DEGREE):
        j = DEGREE - down
        p = p * x + j * c[i, j, first]
        q = q * x + j * c[i, j, first + 1]
        r = r * x + j * c[i, j, first + 2]
    scale = 2.0 * table.per_second
    return (scale * p, scale * q, scale * r)


def lobatto(degree: int) -> np.ndarray:
    """Chebyshev-Lobatto points on [-1, 1], ascending."""
    return -np.cos(np.pi * np.arange(degree + 1) / degree)


@functools.cache
def _error_peaks(degree: int) -> np.ndarray:
    """Two places in [-1, 1] where the node polynomial, and so the error, is greatest."""
    points = lobatto(degree)
    x = np.linspace(points[0], points[-1], 4001)
    size = np.abs(np.prod(x[:, None] - points, axis=1))
    inner = np.flatnonzero((size[1:-1] >= size[:-2]) & (size[1:-1] > size[2:])) + 1
    return x[inner[np.argsort(size[inner])[-2:]]]


def build(
    sample: Callable[[np.ndarray], np.ndarray],
    duration_s: float,
    segment_s: float,
    degree: int,
    start_s: float = 0.0,
    knot_s: float | None = None,
) -> Table:
    """Table of `sample(t_s) -> [n, channels]` over duration_s from start_s on, no check made.

    Two segments meet at `knot_s`, where the slope of the function may jump.
    """
    ahead = 0.0 if knot_s is None else (start_s - knot_s) / segment_s % 1.0
    first_s = start_s - ahead * segment_s
    segments = max(1, math.ceil(duration_s / segment_s + ahead - 1e-9))
    points = lobatto(degree)
    places = (np.arange(segments)[:, None] + 0.5 * (1.0 + points[:-1])).ravel()
    values = sample(first_s + np.append(places, segments) * segment_s)
    coefficients = np.zeros((segments, DEGREE + 1, values.shape[1]))
    _fit(np.linalg.inv(np.vander(points, increasing=True)), values, coefficients)
    return Table(1.0 / segment_s, coefficients, first_s)


@kernel
def _fit(to_power, values, coefficients):
    """Coefficients of the polynomials through the values at each segment's points."""
    degree = to_power.shape[0] - 1
    for segment in range(coefficients.shape[0]):
        for power in range(degree + 1):
            for point in range(degree + 1):
                factor = to_power[power, point]
                for channel in range(values.shape[1]):
                    value = values[segment * degree + point, channel]
                    coefficients[segment, power, channel] += factor * value


def measured_error(table: Table, sample, groups, bends_s=()) -> float:
    """Largest relative error of any group of channels at the peaks of every segment.

    Where the slope jumps in a segment, its error is sampled densely.
    """
    every = np.arange(table.coefficients.shape[0])
    error = _error_in(table, table.coefficients, every, _error_peaks(DEGREE), sample, groups)
    if len(bends_s) == 0:
        return error
    places = np.floor((np.asarray(bends_s) - table.start_s) * table.per_second).astype(np.int64)
    bent = np.unique(np.clip(places, 0, every[-1]))
    dense = np.linspace(-1.0, 1.0, 65)
    return max(error, _error_in(table, table.coefficients[bent], bent, dense, sample, groups))


def _error_in(table: Table, coefficients, segments, x, sample, groups) -> float:
    """Largest relative error at places x of segments, which have these coefficients."""
    exact = np.ascontiguousarray(sample(table.times(segments, x)))
    return max(_greatest_error(coefficients, x, exact, g.start, g.stop) for g in groups)


@kernel
def _greatest_error(coefficients, x, exact, first, end):
    """Largest relative error of the channels first..end-1; infinite if one is NaN."""
    greatest = 0.0
    for row in range(exact.shape[0]):
        segment, place = row // x.size, x[row % x.size]
        size = error = 0.0
        for channel in range(first, end):
            read = 0.0
            for down in range(coefficients.shape[1]):
                power = coefficients.shape[1] - 1 - down
                read = read * place + coefficients[segment, power, channel]
            size += exact[row, channel] ** 2
            error += (exact[row, channel] - read) ** 2
        if error == 0.0:  # also of what is zero, such as a field that there is none of
            continue
        relative = math.sqrt(error / size)
        if not relative <= greatest:
            greatest = relative if math.isfinite(relative) else math.inf
    return greatest


class NotSmooth(ValueError):
    """A function that segments cannot follow to the tolerance, however short they are."""


def build_proven(
    sample: Callable[[np.ndarray], np.ndarray],
    duration_s: float,
    segment_s: float,
    tolerance: float,
    groups: tuple[slice, ...],
    start_s: float = 0.0,
    bends_s=(),
) -> ProvenTable:
    """Table whose relative error in every group of channels is below the tolerance.

    Starts from segments of `segment_s` and halves them until the check passes; raises
    `NotSmooth` when thirteen halvings do not suffice (a function that is not smooth); an orbit from
    the ground to the Hill sphere needs that many. `bends_s`: times at which the slope jumps, the
    worst one first, where two segments meet.
    """
    evaluations, checks = 0, len(_error_peaks(DEGREE))
    knot_s = float(bends_s[0]) if len(bends_s) else None
    for _ in range(13):
        table = build(sample, duration_s, segment_s, DEGREE, start_s, knot_s)
        error = SAFETY * measured_error(table, sample, groups, bends_s)
        evaluations += table.coefficients.shape[0] * (DEGREE + checks)
        if error <= tolerance:
            return ProvenTable(table, error, evaluations)
        segment_s *= 0.5
    raise NotSmooth(
        f"environment table: must reach a relative error of {tolerance:.1e}; "
        f"received {error:.1e} with segments of {2.0 * segment_s:.3g} s"
    )


def build_exact(sample, duration_s: float, step_s: float, start_s: float = 0.0) -> ProvenTable:
    """Table that is exact at the three distinct times of every RK4 step (start, middle, end)."""
    table = build(sample, duration_s, step_s, 2, start_s)
    return ProvenTable(table, 0.0, 2 * table.coefficients.shape[0] + 1)
