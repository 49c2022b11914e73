"""How well the averaged motion approximates the full one: error, resonances."""

import math
from dataclasses import dataclass
from itertools import product

import numpy as np

from torquer.computer.blocks.law import Law
from torquer.theory.slow.averaging import Nodes
from torquer.theory.slow.evolution.model import Slow
from torquer.theory.slow.full_motion import Fast, by_euler, slow_variables
from torquer.theory.slow.slow_motion import evolve_law
from torquer.theory.slow.spinner import Spinner
from torquer.theory.validity import Limit, check_slow, within


@dataclass(frozen=True)
class AveragingComparison:
    """Full and averaged motion at the same points `u`, and the greatest difference.

    `error` is that of l, and of rho and theta in rad: of order eps while eps u is of order one.
    """

    u: np.ndarray
    full: Slow
    averaged: Slow

    @property
    def error(self) -> float:
        """Greatest difference of l, rho and theta."""
        pairs = zip(self.full, self.averaged, strict=True)
        differences = [np.abs(a - b).max() for a, b in pairs]
        return max(differences[0], differences[1], differences[3])


def compare(
    law: Law,
    spinner: Spinner,
    start: Slow,
    fast: Fast,
    u_end: float,
    *,
    points: int = 400,
    at: Nodes | None = None,
    rtol: float = 1e-10,
) -> AveragingComparison:
    """Both motions from the same start over u = 0..u_end; `averaged.notes` has the caveats."""
    within(Limit("points", 2), points)
    u = np.linspace(0.0, u_end, points)
    full = slow_variables(spinner, by_euler(law, spinner, start, fast, u, rtol=rtol))
    return AveragingComparison(u, full, evolve_law(law, spinner, start, u, rtol, at))


def resonances(
    spinner: Spinner, slow: Slow, *, greatest: int = 4, width: float = 0.05
) -> list[tuple[int, int, int]]:
    """Small integers (a, b, c), the first non-zero one positive, with a phi' + b psi' + c near 0.

    Rates in units of the orbital rate: phi' = eta1 l cos theta, psi' = eta2 l. Within `width` of
    zero the averages over independent angles may fail; a law of degree n in the angles has
    harmonics up to n only (B-dot: 2 in phi and psi, 4 in u).
    """
    within(Limit("greatest", 1, 50), greatest)
    within(Limit("width", 0.0, open=True), width)
    check_slow(slow)
    own, precession = spinner.eta
    own, precession = own * slow.l * math.cos(slow.theta), precession * slow.l
    span = range(-greatest, greatest + 1)
    near = [
        numbers
        for numbers in product(span, span, span)
        if numbers > (0, 0, 0)
        and abs(numbers[0] * own + numbers[1] * precession + numbers[2]) < width
    ]
    return sorted(near, key=lambda n: sum(abs(k) for k in n))
