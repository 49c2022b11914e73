"""Where the theory holds: limits as data; what lies beyond them is refused, or noted.

A `Limit` names a number, its bounds and the reason. Beyond one that makes the answer meaningless
a function raises ValueError with one line (`within`). Where the answer is only doubtful, a result
that is a structure carries a line for each limit passed in its `notes` (`passed`); a function that
returns bare numbers has no room for a note and refuses there as well. Doubtful is, everywhere, an
error of the theory of about a tenth (of a length to itself, of an angle to a radian).

Where no solution exists, or none is found, it is ArithmeticError.
"""

import math
from typing import NamedTuple

import numpy as np

from torquer import validate


class Limit(NamedTuple):
    """Bounds of a number, both allowed unless `open`; `why` is told to who passes them."""

    name: str
    least: float = -math.inf
    most: float = math.inf
    why: str = ""
    open: bool = False

    @property
    def must(self) -> str:
        """In words."""
        if self.least == -math.inf:
            return f"must be {'below' if self.open else 'at most'} {self.most:.6g}"
        if self.most == math.inf:
            return f"must be {'above' if self.open else 'at least'} {self.least:.6g}"
        return f"must lie within {self.least:.6g}..{self.most:.6g}" + self.open * ", ends left out"

    def holds(self, value) -> bool:
        """Whether all of one or more numbers keep to it; not-a-number does not."""
        x = np.asarray(value)
        if self.open:
            return bool(np.all((x > self.least) & (x < self.most)))
        return bool(np.all((x >= self.least) & (x <= self.most)))


def within(limit: Limit, value) -> None:
    """ValueError unless numbers (all finite) keep to a limit."""
    x = validate.finite(limit.name, value)
    if not limit.holds(x):
        why = f" ({limit.why})" if limit.why else ""
        off = x[~np.vectorize(limit.holds, otypes=[bool])(x)]
        raise ValueError(f"{limit.name}: {limit.must}{why}; received {off.flat[0]:.9g}")


def passed(*pairs: tuple[Limit, float]) -> tuple[str, ...]:
    """A line for each (limit, number) that does not keep to it, in this order."""
    return tuple(
        f"{limit.name} = {value:.3g}: {limit.must} ({limit.why})"
        for limit, value in pairs
        if not limit.holds(value)
    )


#: Slow variables.
LENGTH = Limit("l", 0.0, why="at zero momentum there are no angles", open=True)
RHO, THETA = Limit("rho", 0.0, math.pi), Limit("theta", 0.0, math.pi)
#: Closest to rho = 0 and pi [rad] where the rate of sigma still is one.
POLE = 1e-10
OFF_POLES = Limit("rho", POLE, math.pi - POLE, "on the third axis sigma has no rate")
INCLINATION = Limit("inclination", 0.0, math.pi)
#: A torque that gravity holds at the lean x [rad] by its linear law, it holds at asin(2x)/2 in
#: truth: a tenth more at 0.34, and at no angle above a half.
LEAN = Limit("lean [rad]", -0.34, 0.34, "gravity's linear law is off by a tenth")
HELD = Limit("lean [rad]", -0.5, 0.5, "gravity's greatest torque does not hold more")
#: Relative tolerance of an integration.
TOLERANCE = Limit("rtol", 1e-14, 0.1)
#: Part of itself by which the momentum changes, or angle [rad] by which it turns, over a radian of
#: the orbit at the worst phase (`Evolution.change`, `averaging.swiftest`). Against the full motion
#: the averages err by up to 0.41 of it over u = 1/eps (all laws, 15 to 80 deg): by a tenth at 0.25.
SLOW_CHANGE, AVERAGES_ERR = 0.25, 0.4
#: Precession over the orbital rate: the field's products turn by up to 4u, and below meet it.
PRECESSION = Limit("precession/orbital rate", 4.0, why="the averages pass resonances with 4u")


def check_regular(name: str, cosine) -> None:
    """ValueError where the cosine of an angle, by which rates are divided, is nothing."""
    if np.min(np.abs(cosine), initial=1.0) < 1e-9:
        raise ValueError(
            f"{name}: must stay off 90 deg, where the angles are singular; received it"
        )


def check_slow(slow) -> None:
    """ValueError unless slow variables are within their ranges."""
    within(LENGTH, slow.l)
    within(RHO, slow.rho)
    validate.finite("sigma", slow.sigma)
    within(THETA, slow.theta)
