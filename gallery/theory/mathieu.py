"""Hill's equation y'' + (c0 + c1 cos 2t + c2 cos 4t + ...) y = 0 and Mathieu's, by computer.

The coefficient is even and has the period pi. Where a tongue of instability begins or ends, a
solution of period pi or 2 pi exists, and it is even or odd: over half a period one entry of the
transition matrix vanishes. Its zeros are simple and stay accurate where a tongue is thin, or
closed.

FIELD writes Mathieu's equation with a = lambda^2, -2 q = lambda^2 chi. All series of FIELD are
in chi; what is given (the gravity torque) is mostly lambda^2 chi, and the series change.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from torquer.base import validate
from torquer.theory.periodic.floquet import transitions
from torquer.theory.periodic.periodic_systems import PeriodicSystem, periodic_system
from torquer.theory.validity import Limit, within


@periodic_system(order=2, period=math.pi, parameters={"a": 1.0, "q": 0.0})
def mathieu_equation(t, parameters, out):
    """x = (y, y') of y'' + (a - 2 q cos 2t) y = 0."""
    out[0, 0], out[0, 1] = 0.0, 1.0
    out[1, 0] = 2.0 * parameters[1] * math.cos(2.0 * t) - parameters[0]
    out[1, 1] = 0.0


@periodic_system(order=2, period=math.pi, data=(1.0,))
def hill_equation(t, parameters, out):
    """x = (y, y') of y'' + (c0 + c1 cos 2t + ...) y = 0, c = the system's data (Clenshaw's sum)."""
    cosine = math.cos(2.0 * t)
    last = second = 0.0
    for k in range(parameters.size - 1, 0, -1):
        last, second = 2.0 * cosine * last - second + parameters[k], last
    out[0, 0], out[0, 1] = 0.0, 1.0
    out[1, 0] = second - cosine * last - parameters[0]
    out[1, 1] = 0.0


def half_trace(matrices: np.ndarray) -> np.ndarray:
    """A: half the trace of monodromy matrices `[..., 2, 2]`; stable where |A| < 1."""
    return 0.5 * np.trace(matrices, axis1=-2, axis2=-1)


def multipliers_from_half_trace(a) -> np.ndarray:
    """Both multipliers `[..., 2]`: roots of rho^2 - 2 A rho + 1 = 0. Source: FIELD (2.9)."""
    a = np.asarray(a, dtype=complex)
    larger = a + np.sqrt(a - 1.0) * np.sqrt(a + 1.0)
    return np.stack([larger, 1.0 / larger], axis=-1)  # a - root would lose the smaller one


def half_trace_series(lambda2, chi):
    """A(chi, lambda^2) of Mathieu's equation to chi^3: cos(pi lambda) and the term of chi^2.

    The published form has chi F: F begins with chi, as a shift of u by pi/2 turns chi to -chi.
    Right to 0.1 while the term turns the cosine by no more than 0.3 rad, pi lambda chi^2/16;
    ValueError beyond. Source: FIELD (2.12).
    """
    within(Limit("lambda2", 0.0, 1e12, "the phase pi lambda is lost in rounding"), lambda2)
    root = np.sqrt(lambda2)
    within(SERIES_TURN, math.pi * root * np.square(chi) / 16.0)
    slope = -math.pi * np.sinc(root - 1.0)  # sin(pi lambda) / (lambda - 1)
    return np.cos(math.pi * root) + math.pi * root**3 * chi**2 * slope / (16.0 * (root + 1.0))


#: Where FIELD's series are off by a tenth (of the edge) from the computed ones.
SERIES_TURN = Limit(
    "pi lambda chi^2/16", 0.0, 0.3, "the series to chi^3 is off by up to 0.1",
    of="half-trace, series (FIELD 2.12)", shown="monodromy matrices", refuses=True,
)  # fmt: skip
CHI = Limit(
    "chi", -1.0, 1.0, "beyond, the series to chi^2 is off by a tenth and more",
    of="first tongue, series in chi (FIELD 2.13)",
    shown="computed edges: 0.2 % at 0.3, 9 % at 1", refuses=True,
)  # fmt: skip
STRENGTH = Limit(
    "strength", -6.5, 6.5, "the series to its fourth power is off by a tenth beyond",
    of="first tongue, series in the strength", shown="computed edges: 0.6 % at 4, a tenth at 6.5",
    refuses=True,
)  # fmt: skip


class Edges(NamedTuple):
    """Values of the parameter at which solutions of period pi and 2 pi exist, by their parity."""

    even_pi: np.ndarray
    odd_pi: np.ndarray
    even_2pi: np.ndarray
    odd_2pi: np.ndarray


#: Entry of the transition matrix over half a period that vanishes: y' or y of the solution that
#: begins with (1, 0) or (0, 1).
_ENTRY = {"even_pi": (1, 0), "odd_pi": (0, 1), "even_2pi": (0, 0), "odd_2pi": (1, 1)}


def edges(system: PeriodicSystem, parameter: str, values, tolerance: float = 1e-13) -> Edges:
    """All edges of tongues between the first and last of `values`, ascending.

    The system must be Hill's equation, even, with the period pi in (y, y'). `values` (ascending)
    must be dense enough that each kind has at most one edge in an interval. The edges of period
    pi are where A = 1, those of period 2 pi where A = -1. Source: FIELD (2.10), FIELD (2.11).
    """
    values = validate.finite(f"edges: {parameter}", values)
    if values.ndim != 1 or values.size < 2 or np.any(np.diff(values) <= 0.0):
        raise ValueError(f"edges: values of {parameter} must be 2 or more, ascending")

    def half(at):
        rows = {parameter: np.atleast_1d(at)}
        return transitions(system, rows, span=0.5 * math.pi, tolerance=tolerance).matrices

    scanned = half(values)
    if not np.all(np.isfinite(scanned)):
        raise ArithmeticError(
            f"edges: the transition matrix must converge at all values of {parameter}; it did not "
            f"at {values[~np.isfinite(scanned).all(axis=(1, 2))][0]:g}"
        )
    return Edges(**{kind: _zeros(half, values, scanned, *_ENTRY[kind]) for kind in Edges._fields})


def _zeros(half, values, scanned, row, column) -> np.ndarray:
    """Zeros of one entry between the scanned values."""
    entry = scanned[:, row, column]
    places = np.flatnonzero(np.sign(entry[:-1]) != np.sign(entry[1:]))
    found = [
        brentq(lambda a: half(a)[0, row, column], values[i], values[i + 1], xtol=1e-14, rtol=1e-14)
        for i in places
    ]
    return np.unique(np.array(found))


def mathieu_parameters(lambda2: float, chi: float) -> dict[str, float]:
    """(a, q) of y'' + lambda^2 (1 + chi cos 2u) y = 0. Source: FIELD (2.8)."""
    return {"a": lambda2, "q": -0.5 * lambda2 * chi}


def first_tongue(chi):
    """Edges lambda^2 (cosine's, sine's) of the first tongue, to chi^2, for |chi| up to 1.

    At 0.3 they are off by 0.2 %, at 1 by 9 % (the width by 11 %); ValueError beyond.
    Source: FIELD (2.13).
    """
    within(CHI, chi)
    middle = 1.0 + 7.0 / 32.0 * chi**2
    return middle - 0.5 * chi, middle + 0.5 * chi


def first_tongue_of_strength(strength):
    """Edges of the first tongue for a given strength = lambda^2 chi, to its fourth power.

    For chi = strength / lambda^2 the edge depends on itself in `first_tongue`; solved for it,
    7/32 becomes -1/32: 1 -+ s/2 - s^2/32 +- s^3/512 - s^4/24576 (Mathieu's b_1 and a_1, 2q = s).
    At |s| = 4 they are off by 0.6 %, at 6.5 by a tenth; ValueError beyond.
    """
    within(STRENGTH, strength)
    s = strength
    even, odd = 1.0 - s**2 / 32.0 - s**4 / 24576.0, 0.5 * s - s**3 / 512.0
    return even - odd, even + odd


def first_tongue_solutions(chi, u):
    """Solutions of period 2 pi on the first tongue's edges (cosine's, sine's), to chi^2.

    For |chi| up to 1, as `first_tongue`. Source: FIELD (2.14), for n = 1.
    """
    within(CHI, chi)
    cosine = np.cos(u) + chi / 16.0 * np.cos(3.0 * u)
    sine = np.sin(u) + chi / 16.0 * np.sin(3.0 * u)
    fifth, third = chi**2 / 768.0, 9.0 * chi**2 / 256.0
    cosine = cosine + fifth * np.cos(5.0 * u) - third * np.cos(3.0 * u)
    return cosine, sine + fifth * np.sin(5.0 * u) + third * np.sin(3.0 * u)
