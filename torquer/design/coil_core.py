"""Rod of a soft magnetic metal in a coil: how much dipole it adds, and where it saturates.

A rod of volume V, susceptibility chi = mu_r - 1 and demagnetising factor D, in the field N I/l of a
winding along all its length l, has the magnetisation M = (N I/l) chi/(1 + chi D) and the dipole
M V. To the N I S of turns of the area S, a rod of the section s adds N I s chi/(1 + chi D). So the
core multiplies the dipole by

    1 + (s/S) chi/(1 + chi D).

D is that of an ellipsoid as long and as thick as the rod. For long rods of high permeability the
gain is near (s/S)/D: it depends on the shape and hardly on the metal. A cylinder of high
permeability has 1.10 of the gain of the ellipsoid if it is 5 times as long as thick, 1.00 at 10,
0.93 at 20, 0.85 at 50: measure the coil. The law is linear, without hysteresis; the rod cannot be
magnetised beyond the saturation of its metal. An ellipsoid is magnetised evenly. The middle of such
a cylinder has 1.27, 1.32, 1.36 and 1.40 of its mean magnetisation: it counts as saturated where
`MIDDLE` times the mean is.
"""

import math
from typing import NamedTuple

from torquer.base.conventions import MU_0_H_M

#: A permalloy with 80 % of nickel: relative permeability, saturation [T], density [kg/m^3].
PERMALLOY = 20_000.0, 0.75, 8700.0
#: Lengths of a rod over its diameter from which it counts as long.
SLENDER = 4.0
#: Magnetisation in the middle of a long cylinder over its mean, at most.
MIDDLE = 1.4
#: Beyond that it is a wire, and no coil is wound about it.
SLENDEREST = 1e4


def demagnetising_factor(slenderness: float) -> float:
    """Of a prolate ellipsoid along its axis, which is `slenderness` > 1 times its diameter.

    J. A. Osborn, Physical Review 67, 351 (1945), (2.14): 1/3 of a ball, 0.0203 at 10.
    """
    p, root = slenderness, math.sqrt(slenderness**2 - 1.0)
    return (p / root * math.log(p + root) - 1.0) / root**2


class Core(NamedTuple):
    """A rod along the axis of a coil that is wound over all its length."""

    length_m: float
    diameter_m: float
    permeability: float = PERMALLOY[0]
    saturation_t: float = PERMALLOY[1]

    @property
    def volume_m3(self) -> float:
        """Of the rod."""
        return 0.25 * math.pi * self.diameter_m**2 * self.length_m

    @property
    def mass_kg(self) -> float:
        """Of a rod of permalloy."""
        return PERMALLOY[2] * self.volume_m3

    @property
    def effective_susceptibility(self) -> float:
        """Magnetisation over the field of the winding, chi/(1 + chi D)."""
        chi = self.permeability - 1.0
        return chi / (1.0 + chi * demagnetising_factor(self.length_m / self.diameter_m))

    def gain(self, turns_m: float) -> float:
        """Dipole of a coil of turns of a diameter [m] over that without the core."""
        return 1.0 + (self.diameter_m / turns_m) ** 2 * self.effective_susceptibility

    def polarisation_t(self, dipole: float, turns_m: float) -> float:
        """mu_0 M in the middle of the rod [T] at a dipole of the whole coil [A m^2]."""
        mean = MU_0_H_M * dipole * (1.0 - 1.0 / self.gain(turns_m)) / self.volume_m3
        return MIDDLE * mean

    def greatest_dipole(self, turns_m: float) -> float:
        """Dipole of the coil [A m^2] at which the rod saturates; infinite if it is not magnetic."""
        each_t = self.polarisation_t(1.0, turns_m)
        return self.saturation_t / each_t if each_t > 0.0 else math.inf
