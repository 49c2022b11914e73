"""Where the averaged motion leads: equilibria of the slow system, and whether they attract.

The slow system here is the direction of the angular momentum (rho, sigma) and the nutation angle
theta, at a given length l: every law's equations keep their equilibria while l changes. The length
has its own rate at each of them: below zero the satellite is braked there, above it spun up.

Directions are followed as unit vectors, on which nothing is singular at rho = 0 and pi.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from torquer.computer.blocks.law import Law
from torquer.theory.periodic.poincare import derivatives
from torquer.theory.slow.averaging import Nodes, averaged_motion, converged_nodes, mean_rates
from torquer.theory.slow.evolution.model import Case, Evolution, Slow
from torquer.theory.slow.spinner import Spinner

Rates = Callable[[Slow], Slow]
#: Least distance from rho = 0 and pi at which equations with 1/sin(rho) are evaluated.
_POLE = 1e-12
#: Below this part of the greatest rate an eigenvalue counts as zero, and below the other a rate.
_NEUTRAL, _RESTING = 1e-6, 1e-9
_NEAR = 1e-5
#: Distance [rad] to a family within which a point is one of it.
_SAME = 3e-3
#: Nutation angles [deg] to start from.
_NUTATIONS = (0.0, 35.0, 90.0, 130.0, 180.0)


@dataclass(frozen=True)
class Equilibrium:
    """A point, or a family of points, where direction and nutation stay.

    An angle is None where it is arbitrary. `length_rate`: l' there. `jacobian` `[3, 3]`: of the
    rates along rho, along sigma (as arcs) and of theta, by the same. `stability`: 'stable'
    (attracts nearby motions, apart from shifts along the family), 'unstable' or 'neutral'.
    """

    rho: float | None
    sigma: float | None
    theta: float | None
    length_rate: float
    jacobian: np.ndarray
    eigenvalues: np.ndarray
    stability: str

    @property
    def description(self) -> str:
        """In words, angles in degrees."""
        return f"{_direction_in_words(self)}, {_nutation_in_words(self.theta)}"


def _direction_in_words(point) -> str:
    if point.rho is None:
        return "momentum in any direction"
    rho = math.degrees(point.rho)
    if min(rho, 180.0 - rho) < 1e-3:
        return f"momentum {'along' if rho < 90.0 else 'against'} the third axis"
    across = "across the third axis" if abs(rho - 90.0) < 1e-3 else f"{rho:.2f} deg off it"
    if point.sigma is None:
        return f"momentum {across}"
    return f"momentum {across}, azimuth {math.degrees(point.sigma):.2f} deg"


def _nutation_in_words(theta) -> str:
    return "any nutation" if theta is None else f"nutation {round(math.degrees(theta), 3):.4g} deg"


def evolution_rates(evolution: Evolution, case: Case) -> Rates:
    """A law's closed equations as a function of the slow variables alone."""
    return lambda slow: evolution.rates(slow, case)


def law_rates(law: Law, spinner: Spinner, at: Nodes | None = None) -> Rates:
    """Averages of a law as such a function; by default with the fewest nodes that converge."""
    at = converged_nodes(law, spinner) if at is None else at
    problem = averaged_motion(law, spinner, at)
    return lambda slow: Slow(*mean_rates(problem, slow))


def find_equilibria(rates: Rates, length: float = 1.0) -> list[Equilibrium]:
    """All equilibria that Newton's method finds from a grid of starts, stable ones first."""
    if not 0.0 < length < math.inf:
        raise ValueError(f"length: must be positive and finite; received {length}")
    starts = [(n, theta) for n in _directions() for theta in np.radians(_NUTATIONS)]
    flows = [np.abs(_flow(rates, length, *start)).max() for start in starts]
    size = max(flows)
    if not 0.0 < size < math.inf:
        raise ValueError(f"rates: must be finite and not all zero; received up to {size:g}")
    found: dict = {}
    for start in starts:
        settled = _newton(rates, length, start, size)
        if settled is not None:
            point, key = _classify(rates, length, settled, size)
            found.setdefault(key, point)
    order = {"stable": 0, "neutral": 1, "unstable": 2}
    alone = [point for point in found.values() if not _is_of_another(point, found.values())]
    return sorted(alone, key=lambda e: (order[e.stability], e.rho or 0.0, e.theta or 0.0))


def tends_to(points: list[Equilibrium]) -> list[Equilibrium]:
    """The stable equilibria, to which the motion tends."""
    return [point for point in points if point.stability == "stable"]


def _directions() -> list[np.ndarray]:
    """Initial unit vectors: the third axis, others off all symmetry, and their opposites."""
    rows = [np.array([0.0, 0.0, 1.0])]
    for rho, count in ((33.0, 4), (62.0, 4), (90.0, 3)):
        for k in range(count):
            r, s = math.radians(rho), 2.0 * math.pi * (k / count + rho / 1000.0)
            across = math.sin(r)
            rows.append(np.array([across * math.cos(s), across * math.sin(s), math.cos(r)]))
    return [*rows, *(-row for row in rows)]


def _angles(n) -> tuple[float, float]:
    """rho, kept off the poles, and sigma of a unit vector."""
    rho = math.atan2(math.hypot(n[0], n[1]), n[2])
    return min(max(rho, _POLE), math.pi - _POLE), math.atan2(n[1], n[0])


def _along(rho, sigma) -> np.ndarray:
    """Unit vectors along rho and sigma, as rows."""
    cr, sr, cs, ss = math.cos(rho), math.sin(rho), math.cos(sigma), math.sin(sigma)
    return np.array([[cr * cs, cr * ss, -sr], [-ss, cs, 0.0]])


def _flow(rates, length, n, theta) -> np.ndarray:
    """Rate of the unit vector (three components), and of theta."""
    rho, sigma = _angles(n)
    moved = rates(Slow(float(length), rho, sigma, float(theta)))
    turning = np.array([moved.rho, math.sin(rho) * moved.sigma]) @ _along(rho, sigma)
    return np.append(turning, moved.theta)


def _chart(rates, length, n, theta):
    """The flow in coordinates x = (along rho, along sigma, theta) around a point."""
    along = _along(*_angles(n))

    def place(x):
        moved = n + x[:2] @ along
        return moved / np.linalg.norm(moved), theta + x[2]

    def flow(x):
        here = _flow(rates, length, *place(x))
        return np.append(along @ here[:3], here[3])

    return place, flow


def _newton(rates, length, start, size):
    """The equilibrium found from a start, theta within 0..pi; None if there is none."""
    n, theta = start
    for _ in range(60):
        place, flow = _chart(rates, length, n, theta)
        now = flow(np.zeros(3))
        if np.abs(now).max() < _RESTING * size:
            return _fold(n, theta)
        slope = np.column_stack([(flow(h) - flow(-h)) / 2e-5 for h in 1e-5 * np.eye(3)])
        step = np.linalg.lstsq(slope, -now, rcond=1e-7)[0]
        n, theta = place(step * min(1.0, 0.4 / max(np.abs(step).max(), 1e-300)))
    return None


def _fold(n, theta):
    """Theta within 0..pi: the motion is the same at -theta and at theta + 2 pi."""
    theta = abs(math.remainder(theta, 2.0 * math.pi))
    return n, 0.0 if theta < 1e-8 else theta


def _classify(rates, length, settled, size):
    """The equilibrium at a point, and a key that is the same for all points of its family."""
    n, theta = settled
    rho, sigma = _angles(n)
    jacobian = derivatives(_chart(rates, length, n, theta)[1], np.zeros(3), by="difference")
    jacobian = np.where(np.abs(jacobian) < 1e-9 * size, 0.0, jacobian)
    free = [np.abs(jacobian[:, k]).max() < _NEUTRAL * size for k in range(3)]
    values = np.linalg.eigvals(jacobian)
    at_pole = min(rho, math.pi - rho) < _NEAR
    if free[0] and free[1]:
        rho = sigma = None
    elif at_pole:
        rho, sigma = (0.0 if rho < 1.0 else math.pi), None
    elif free[1] and _rests_around(rates, length, settled, size):
        sigma = None
    angles = (rho, sigma, None if free[2] else theta)
    rate = rates(Slow(float(length), *_angles(n), float(theta))).l
    rate = 0.0 if abs(rate) < _RESTING * size else float(rate)
    key = _key(angles)
    return Equilibrium(*angles, rate, jacobian, values, _stability(values, size)), key


def _rests_around(rates, length, settled, size) -> bool:
    """Whether the circle of latitude through an equilibrium consists of equilibria."""
    (x, y, z), theta = settled
    turns = ((math.cos(angle), math.sin(angle)) for angle in (1.0, 2.5))
    turned = (np.array([c * x - s * y, s * x + c * y, z]) for c, s in turns)
    return all(np.abs(_flow(rates, length, n, theta)).max() < 1e3 * _RESTING * size for n in turned)


def _key(angles) -> tuple:
    rho, sigma, theta = angles
    around = None if sigma is None else [math.cos(sigma), math.sin(sigma)]
    coarse = 10.0 * _NEAR
    return tuple(None if x is None else tuple(np.round(np.atleast_1d(x) / coarse).astype(int))
                 for x in (rho, around, theta))  # fmt: skip


def _is_of_another(point: Equilibrium, points) -> bool:
    """Whether a point is one of another's family but for rounding, where rates vanish to second
    order."""
    return any(_is_of(point, each) for each in points if each is not point)


def _is_of(point: Equilibrium, family: Equilibrium) -> bool:
    pairs = (("rho", point.rho, family.rho), ("sigma", point.sigma, family.sigma),
             ("theta", point.theta, family.theta))  # fmt: skip
    free = [name for name, one, other in pairs if other is None and one is not None]
    near = all(
        other is None or (one is not None and abs(one - other) < _SAME)
        for name, one, other in pairs
        if name != "sigma" or family.rho is None or _SAME < family.rho < math.pi - _SAME
    )
    wider = bool(free) or (point.rho is None) == (family.rho is None)
    return near and wider and _freedom(family) >= _freedom(point) and _off(point) > _off(family)


def _freedom(point: Equilibrium) -> int:
    return [point.rho, point.sigma, point.theta].count(None)


def _off(point: Equilibrium) -> float:
    """Distance of a point's angles from the multiples of a right angle that families have."""
    angles = [x for x in (point.rho, point.theta) if x is not None]
    return sum(abs(math.remainder(x, 0.5 * math.pi)) for x in angles)


def _stability(values, size) -> str:
    moving = [value for value in values if abs(value) > _NEUTRAL * size]
    if any(value.real > _NEUTRAL * size for value in moving):
        return "unstable"
    damped = moving and all(value.real < -_NEUTRAL * size for value in moving)
    return "stable" if damped else "neutral"
