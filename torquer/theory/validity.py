"""Where the theory holds: limits as data; beyond them a ValueError, or a note in the result.

A `Limit` names a number, its bounds and the reason. Where a result would be meaningless a function
raises ValueError with one line (`within`). Where it is merely inaccurate, a result with a `notes`
attribute has a line for each limit exceeded (`broken_limits`); a function that returns bare
numbers raises ValueError there, too. Inaccurate means throughout an error of the theory of about a
tenth (of a length, relative; of an angle, in radians).

An answer to a user carries a `Verdict`: valid, or doubtful with the doubts. A limit that is a
condition of a formula says of which, and what has shown it; `docs/theory/where-it-holds.md` is
made of these (`torquer.theory.where_it_holds`).

Where no solution exists, or none is found, it is ArithmeticError.
"""

import math
from typing import NamedTuple

import numpy as np

from torquer.base import validate


class Limit(NamedTuple):
    """Bounds of a number, both allowed unless `open`; `why`: the reason, for messages.

    Of a condition of a formula also: `of`, the formula in words; `shown`, the trial or source that
    gave the bound; `refuses`, whether there is no answer beyond.
    """

    name: str
    least: float = -math.inf
    most: float = math.inf
    why: str = ""
    open: bool = False
    of: str = ""
    shown: str = ""
    refuses: bool = False

    @property
    def must(self) -> str:
        """In words."""
        if self.least == -math.inf:
            return f"must be {'below' if self.open else 'at most'} {self.most:.6g}"
        if self.most == math.inf:
            return f"must be {'above' if self.open else 'at least'} {self.least:.6g}"
        return f"must lie within {self.least:.6g}..{self.most:.6g}" + self.open * ", ends left out"

    def holds(self, value) -> bool:
        """Whether one or more numbers all lie within it; NaN does not."""
        x = np.asarray(value)
        if self.open:
            return bool(np.all((x > self.least) & (x < self.most)))
        return bool(np.all((x >= self.least) & (x <= self.most)))


def within(limit: Limit, value) -> None:
    """ValueError unless all numbers are finite and within a limit."""
    x = validate.finite(limit.name, value)
    if not limit.holds(x):
        why = f" ({limit.why})" if limit.why else ""
        off = x[~np.vectorize(limit.holds, otypes=[bool])(x)]
        raise ValueError(f"{limit.name}: {limit.must}{why}; received {off.flat[0]:.9g}")


def broken_limits(*pairs: tuple[Limit, float]) -> tuple[str, ...]:
    """A line for each (limit, number) that is outside, in this order."""
    return tuple(
        f"{limit.name} = {value:.3g}: {limit.must} ({limit.why})"
        for limit, value in pairs
        if not limit.holds(value)
    )


class Doubt(NamedTuple):
    """A condition that a case does not meet: limit and number, or `words` in place of both."""

    limit: Limit
    value: float
    words: str = ""

    @property
    def text(self) -> str:
        """In words."""
        return self.words or broken_limits((self.limit, self.value))[0]

    def data(self) -> dict:
        """Plain data; bounds that are not there are None."""
        least, most = (x if math.isfinite(x) else None for x in (self.limit.least, self.limit.most))
        value = self.value if math.isfinite(self.value) else None
        name, why = self.limit.name, self.limit.why
        return {
            "text": self.text, "quantity": name, "value": value, "least": least, "most": most,
            "beyond": why,
        }  # fmt: skip


class Verdict(NamedTuple):
    """Whether an answer holds: its doubts, none where it is valid."""

    doubts: tuple[Doubt, ...] = ()

    @property
    def state(self) -> str:
        """'valid' or 'doubtful'."""
        return "doubtful" if self.doubts else "valid"

    def lines(self) -> list[str]:
        """A line for each doubt, or one that says that there is none."""
        return [f"doubtful: {doubt.text}" for doubt in self.doubts] or ["valid"]

    def data(self) -> dict:
        """Plain data."""
        return {"state": self.state, "doubts": [doubt.data() for doubt in self.doubts]}


#: The verdict on what no condition casts doubt on.
VALID = Verdict()


def judge(*pairs: tuple[Limit, float | None]) -> Verdict:
    """The verdict of (limit, number) pairs; None for what a case does not have.

    ValueError beyond a limit that refuses.
    """
    broken = [(limit, value) for limit, value in pairs if value is not None]
    broken = [(limit, float(value)) for limit, value in broken if not limit.holds(value)]
    for limit, value in broken:
        if limit.refuses:
            raise ValueError(f"{limit.name}: {limit.must} ({limit.why}); received {value:.6g}")
    return Verdict(tuple(Doubt(limit, value) for limit, value in broken))


#: Slow variables.
LENGTH = Limit("l", 0.0, why="angles are undefined at zero momentum", open=True)
RHO, THETA = Limit("rho", 0.0, math.pi), Limit("theta", 0.0, math.pi)
#: Least distance from rho = 0 and pi [rad] at which sigma has a rate.
POLE = 1e-10
OFF_POLES = Limit("rho", POLE, math.pi - POLE, "sigma has no rate on the third axis")
INCLINATION = Limit("inclination", 0.0, math.pi)
#: The gravity gradient balances a torque at the tilt x [rad] by its linear law, at asin(2x)/2 in
#: fact: a tenth more at 0.34, and at no angle above a half.
LEAN = Limit(
    "tilt [rad]", -0.34, 0.34, "the linear gravity-gradient torque is off by a tenth",
    of="steady tilt against the gravity gradient (three-axis hold, B-dot, pitch wheel)",
    shown="(3/2) sin 2x for 3x: asin(2x)/2 exceeds x by a tenth",
)  # fmt: skip
#: Relative tolerance of an integration.
TOLERANCE = Limit("rtol", 1e-14, 0.1)
#: Part of itself by which the momentum changes, or angle [rad] by which it turns, over a radian of
#: the orbit at the worst phase (`Evolution.change`, `averaging.greatest_relative_rate`). Against
#: the full motion the averages err by up to 0.44 of it over u = 1/eps (all laws, 15 to 80 deg): by
#: a tenth at 0.25.
SLOW_CHANGE, AVERAGES_ERR = 0.25, 0.4
#: Precession over the orbital rate: the field's products turn by up to 4u, and slower precession
#: meets it.
PRECESSION = Limit("precession/orbital rate", 4.0, why="the averages pass resonances with 4u")


def check_slow(slow) -> None:
    """ValueError unless slow variables are within their ranges."""
    within(LENGTH, slow.l)
    within(RHO, slow.rho)
    validate.finite("sigma", slow.sigma)
    within(THETA, slow.theta)
