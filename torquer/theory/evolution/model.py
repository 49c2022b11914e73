"""What the averaged equations of all laws share: slow variables, constants, one signature."""

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from numba import types

from torquer import plugin
from torquer.geometry.vec3 import as_vector
from torquer.theory.spinner import Spinner


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
    `target`: where a law points, in the field's frame: L_f/L0 of precise reorientation.
    """

    eps: float
    ratio: float
    moments: tuple
    target: tuple = (0.0, 0.0, 1.0)


SLOW = types.NamedUniTuple(types.float64, 4, Slow)
CASE = types.NamedTuple(
    (
        types.float64,
        types.float64,
        types.UniTuple(types.float64, 6),
        types.UniTuple(types.float64, 3),
    ),
    Case,
)
SIGNATURE = SLOW(SLOW, CASE)


@dataclass(frozen=True)
class Evolution:
    """Averaged motion under one law: its closed equations and what stays constant along them.

    `rates(slow, case)`: derivatives by u. `small_parameter(gain, spinner)`. `integrals`: functions
    of (slow, case), arrays allowed. `any_field`: the equations hold for any field moments, not
    only for those of the averaged field.
    """

    name: str
    rates: Callable
    small_parameter: Callable[[float, Spinner], float]
    integrals: Mapping[str, Callable] = field(default_factory=dict)
    any_field: bool = False

    def case(self, gain: float, spinner: Spinner, target=(0.0, 0.0, 1.0)) -> Case:
        """Constants for a law's gain on a satellite; ValueError if the field does not fit."""
        if spinner.field != "averaged" and not self.any_field:
            raise ValueError(
                f"evolution {self.name}: field must be averaged (others have no closed equations "
                f"here; average the law itself); received {spinner.field}"
            )
        eps = self.small_parameter(gain, spinner)
        return Case(eps, spinner.ratio, spinner.moments(), as_vector(target))


@functools.cache
def compile_rates(rates: Callable):
    """Averaged equations compiled against `SIGNATURE`; plain without the compiler."""
    name = plugin.plain_of(rates).__name__
    return plugin.first_class(rates, SIGNATURE, f"rates {name}: must compile as (slow, case)")
