"""What the averaged equations of all laws share: slow variables, constants, one signature."""

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from torquer.base import validate
from torquer.base.user_source import plain_function
from torquer.computer.blocks import plugin
from torquer.maths.geometry.vec3 import as_vector
from torquer.theory.slow.spinner import Spinner
from torquer.theory.validity import Limit, within


class Slow(NamedTuple):
    """Slow variables (numbers or arrays), or their derivatives by u.

    l = L/L0; rho, sigma polar angle and azimuth of the angular momentum in the field's frame
    (Z, S or Y); theta nutation angle.
    """

    l: float  # noqa: E741 - the letter of the field
    rho: float
    sigma: float
    theta: float


class Case(NamedTuple):
    """Constants of averaged equations: small parameter, C/A, field moments, target.

    `moments`: <b_i b_j> as (xx, yy, zz, xy, xz, yz); for the averaged field (p, p, q, 0, 0, 0).
    `target`: the law's target in the field's frame: L_f/L0 of precise reorientation, the unit
    vector to the Sun of S-dot.
    """

    eps: float
    ratio: float
    moments: tuple
    target: tuple = (0.0, 0.0, 1.0)


def signature():
    """Numba's signature of averaged equations."""
    from numba import types  # for each who compiles them, not for each who reads a theory

    number = types.float64
    slow = types.NamedUniTuple(number, 4, Slow)
    parts = (number, number, types.UniTuple(number, 6), types.UniTuple(number, 3))
    return slow(slow, types.NamedTuple(parts, Case))


def always(case: Case) -> bool:
    """First integrals that hold in every case."""
    return True


def dipole_reach(length, case: Case) -> float:
    """`reach` of a law whose dipole does not depend on the momentum."""
    return 1.0 / length


def rate_reach(length, case: Case) -> float:
    """`reach` of a law that damps the rate: its torque is proportional to the momentum."""
    return max(1.0, case.ratio)


#: C/A of a body (triangle inequality); eps and the target are finite.
RATIO = Limit("ratio", 0.0, 2.0 * (1.0 + 1e-12), "C/A of a body")
#: Nutation [rad] at which the rate of the direction is off by a tenth of that of a pure spin (at
#: worst over inclinations, directions and targets; the averages of the law itself against it).
SPIN = Limit(
    "theta", 0.0, 0.15, "the equations are those of a spin along the axis",
    of="averaged equations of reorientation",
    shown="averages of the law itself: the direction's rate is off by a tenth", refuses=True,
)  # fmt: skip
UNIT = Limit("length of target", 1.0 - 1e-9, 1.0 + 1e-9, "it is the direction to the Sun")


@dataclass(frozen=True)
class Evolution:
    """Averaged motion under one law: its closed equations and what stays constant along them.

    `rates(slow, case)`: derivatives by u. `small_parameter(gain, spinner)`. `integrals`: functions
    of (slow, case), arrays allowed, of cases for which `integrals_hold`. `any_field`: the equations
    hold for any field moments, not only for those of the averaged field. `cone_target`: for a
    target along the cone axis alone. `to_sun`: the target is the unit vector to the Sun.
    `pure_spin`: for a spin along the axis alone (theta = 0).
    `reach(length, case)`: bound on |torque|/(L omega0) at any phase, over eps.
    """

    name: str
    rates: Callable
    small_parameter: Callable[[float, Spinner], float]
    integrals: Mapping[str, Callable] = field(default_factory=dict)
    any_field: bool = False
    integrals_hold: Callable[[Case], bool] = always
    cone_target: bool = False
    to_sun: bool = False
    pure_spin: bool = False
    reach: Callable[[float, Case], float] = dipole_reach

    def case(self, gain: float, spinner: Spinner, target=None) -> Case:
        """Constants for a law's gain on a satellite; ValueError if the field does not fit.

        `target`: left out, the spinner's Sun for `to_sun`, for others the cone axis.
        """
        if spinner.field != "averaged" and not self.any_field:
            raise ValueError(
                f"evolution {self.name}: field must be averaged (others have no closed equations "
                f"here; average the law itself); received {spinner.field}"
            )
        validate.finite("gain", gain, ())
        try:
            eps = self.small_parameter(gain, spinner)
        except OverflowError:
            eps = math.inf
        validate.finite("eps", eps, ())
        if target is None:
            target = self._default_target(spinner)
        return Case(eps, spinner.ratio, spinner.moments(), as_vector(target))

    def _default_target(self, spinner: Spinner):
        if not self.to_sun:
            return (0.0, 0.0, 1.0)
        if spinner.sun is None:
            raise ValueError(f"sun: must be given for evolution {self.name}; received none")
        return spinner.sun

    def checked(self, start: Slow, case: Case) -> Case:
        """The case in floats; ValueError where the equations are not for it, or for the start."""
        validate.finite("eps", case.eps, ())
        within(RATIO, case.ratio)
        p, second, q, *mixed = validate.finite("moments", case.moments, (6,))
        off = max(abs(p - second), abs(q - 1.0 + 2.0 * p), *map(abs, mixed))
        if not self.any_field and off > 1e-9:
            raise ValueError(
                f"moments: must be those of the averaged field for {self.name}, (p, p, 1 - 2p, 0, "
                f"0, 0); received {case.moments}"
            )
        x, y, z = validate.finite("target", case.target, (3,))
        if self.cone_target and not (z > 0.0 and math.hypot(x, y) <= 1e-9 * z):
            raise ValueError(
                f"target: must lie along the cone axis, (0, 0, 1), for {self.name}; received "
                f"{case.target}"
            )
        if self.to_sun:
            within(UNIT, math.sqrt(x * x + y * y + z * z))
        if self.pure_spin:
            within(SPIN, start.theta)
        moments = (p, second, q, *mixed)
        return Case(
            float(case.eps), float(case.ratio), tuple(map(float, moments)), as_vector((x, y, z))
        )

    def change(self, path: Slow, case: Case) -> float:
        """Bound on the change of the momentum over itself by u, at any phase."""
        return abs(case.eps) * self.reach(float(np.nanmin(path.l)), case)


@functools.cache
def compile_rates(rates: Callable):
    """Averaged equations compiled against `signature`; plain without the compiler."""
    name = plain_function(rates).__name__
    return plugin.first_class(rates, signature(), f"rates {name}: must compile as (slow, case)")
